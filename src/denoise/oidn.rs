//! Open Image Denoise's C interface, as much of it as one filter on the processor takes, and safe functions over it.
//!
//! # Why this is sound
//! - The types are those of `OpenImageDenoise/oidn.h`, version 2: handles are pointers, enums are `int`, sizes are
//!   `size_t`, and `bool` is C's. A library without a function that is new in version 2 is refused before any is
//!   called.
//! - Who gives a library's place says that it may run code, as with a program. [`Oidn`] never unloads it, so functions
//!   outlive whoever has copied them, and its threads their code.
//! - A [`Device`] owns its handle, which is not null, and no function gets the handle of a device that was released.
//! - Images are lent to a filter by address. [`Device::filter`] holds the slices until the filter, which it made
//!   itself, is released; the call that filters returns when all is done; and the slices have as many pixels as it was
//!   told. Inputs are only read, and no input is the output.

use std::{
    ffi::{CStr, c_char, c_int, c_void},
    path::Path,
    ptr,
};

use libloading::Library;

type Handle = *mut c_void;

/// `OIDN_DEVICE_TYPE_CPU`: the one to which memory of the program can be lent everywhere.
const CPU: c_int = 1;
/// `OIDN_FORMAT_FLOAT3`.
const FLOAT3: c_int = 3;

/// Declares the functions that are called, and looks them up by their names.
macro_rules! functions {
    ($($function:ident = $name:literal: fn($($argument:ty),*) $(-> $result:ty)?;)*) => {
        #[derive(Clone, Copy)]
        struct Functions {
            $($function: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
        }

        impl Functions {
            /// # Safety
            /// Whatever the library exports by these names has these types.
            unsafe fn of(library: &Library) -> Result<Self, &'static str> {
                Ok(Self { $($function: *unsafe { library.get($name) }.map_err(|_| $name)?,)* })
            }
        }
    };
}

functions! {
    new_device = "oidnNewDevice": fn(c_int) -> Handle;
    set_device_int = "oidnSetDeviceInt": fn(Handle, *const c_char, c_int);
    get_device_int = "oidnGetDeviceInt": fn(Handle, *const c_char) -> c_int;
    commit_device = "oidnCommitDevice": fn(Handle);
    get_device_error = "oidnGetDeviceError": fn(Handle, *mut *const c_char) -> c_int;
    release_device = "oidnReleaseDevice": fn(Handle);
    new_filter = "oidnNewFilter": fn(Handle, *const c_char) -> Handle;
    set_image = "oidnSetSharedFilterImage":
        fn(Handle, *const c_char, *mut c_void, c_int, usize, usize, usize, usize, usize);
    set_filter_bool = "oidnSetFilterBool": fn(Handle, *const c_char, bool);
    commit_filter = "oidnCommitFilter": fn(Handle);
    execute_filter = "oidnExecuteFilter": fn(Handle);
    release_filter = "oidnReleaseFilter": fn(Handle);
}

/// Why a file is of no use.
pub(super) enum Refusal {
    Unloadable(String),
    /// It has no such function.
    Foreign(&'static str),
    TooOld,
}

/// The library.
pub(super) struct Oidn(Functions);

impl Oidn {
    pub(super) fn load(file: &Path) -> Result<Self, Refusal> {
        // SAFETY: loading runs the code of whoever was given as the library, which the caller trusts.
        let library = unsafe { Library::new(file) }.map_err(|error| Refusal::Unloadable(reason(&error)))?;
        // SAFETY: nothing is called; that these names have these types is what makes a library this one.
        let functions = match unsafe { Functions::of(&library) } {
            Ok(functions) => functions,
            // SAFETY: as above.
            Err(_) if unsafe { library.get::<*const c_void>("oidnSetFilter1b") }.is_ok() => {
                return Err(Refusal::TooOld);
            }
            Err(missing) => return Err(Refusal::Foreign(missing)),
        };
        // Threads of the library may run until the program ends.
        std::mem::forget(library);
        Ok(Self(functions))
    }
}

/// What the system said, without the words around it.
fn reason(error: &libloading::Error) -> String {
    std::error::Error::source(error).map_or_else(|| error.to_string(), ToString::to_string)
}

/// An image that a filter reads.
pub(super) enum Input<'a> {
    /// Linear radiances, of any size.
    Color(&'a [[f32; 3]]),
    Albedo(&'a [[f32; 3]]),
    Normal(&'a [[f32; 3]]),
}

/// The processor, as the library sees it.
pub(super) struct Device<'a> {
    functions: &'a Functions,
    handle: Handle,
}

impl<'a> Device<'a> {
    /// On so many threads; on all without a number.
    pub(super) fn new(Oidn(functions): &'a Oidn, threads: Option<usize>) -> Result<Self, String> {
        // SAFETY: the type of a device is a value of the enum.
        let handle = unsafe { (functions.new_device)(CPU) };
        let device = Self { functions, handle };
        if handle.is_null() {
            return Err(device.error().unwrap_or_else(|| "it has no device for this processor".to_owned()));
        }
        // SAFETY: the device is there, and the name ends with a zero.
        unsafe {
            if let Some(threads) = threads {
                (functions.set_device_int)(handle, c"numThreads".as_ptr(), threads as c_int);
            }
            (functions.commit_device)(handle);
        }
        device.error().map_or(Ok(()), Err).map(|()| device)
    }

    pub(super) fn version(&self) -> [i32; 3] {
        // SAFETY: the device is there, and the names end with zeros.
        [c"versionMajor", c"versionMinor", c"versionPatch"]
            .map(|name| unsafe { (self.functions.get_device_int)(self.handle, name.as_ptr()) })
    }

    /// Makes, of the pixels row by row, those that the filter for ray tracing makes of these inputs. Beside colours
    /// albedo and normals are taken for free of noise.
    ///
    /// # Panics
    /// If an input has another size.
    pub(super) fn filter(&self, [width, height]: [usize; 2], inputs: &[Input<'_>]) -> Result<Vec<[f32; 3]>, String> {
        let Functions { new_filter, set_image, set_filter_bool, commit_filter, execute_filter, release_filter, .. } =
            *self.functions;
        let inputs: Vec<(&CStr, &[[f32; 3]])> = inputs.iter().map(Input::named).collect();
        assert!(inputs.iter().all(|(_, pixels)| pixels.len() == width * height), "images of one size");
        let has_color = inputs.iter().any(|(name, _)| *name == c"color");
        let mut output = vec![[0.0; 3]; width * height];
        let out = output.as_mut_ptr().cast::<c_void>();
        let images = inputs.iter().map(|(name, pixels)| (*name, pixels.as_ptr().cast_mut().cast::<c_void>()));

        // SAFETY: the device is there; so are the images, with width · height pixels of three floats without gaps (the
        // zeros), until the filter is released; inputs are only read; all names end with zeros.
        unsafe {
            let filter = new_filter(self.handle, c"RT".as_ptr());
            if filter.is_null() {
                return Err(self.error().unwrap_or_else(|| "it has no filter RT".to_owned()));
            }
            for (name, pixels) in images.chain([(c"output", out)]) {
                set_image(filter, name.as_ptr(), pixels, FLOAT3, width, height, 0, 0, 0);
            }
            if has_color {
                set_filter_bool(filter, c"hdr".as_ptr(), true);
                set_filter_bool(filter, c"cleanAux".as_ptr(), inputs.len() > 1);
            }
            commit_filter(filter);
            execute_filter(filter);
            release_filter(filter);
        }
        self.error().map_or(Ok(output), Err)
    }

    /// What went wrong first since this was asked last.
    fn error(&self) -> Option<String> {
        let mut message = ptr::null();
        // SAFETY: of no device, it is the error of this thread; the message is the library's until the next call.
        let code = unsafe { (self.functions.get_device_error)(self.handle, &raw mut message) };
        if code == 0 {
            return None;
        }
        if message.is_null() {
            return Some(format!("error {code}"));
        }
        // SAFETY: a message that is there ends with a zero.
        Some(unsafe { CStr::from_ptr(message) }.to_string_lossy().into_owned())
    }
}

impl Drop for Device<'_> {
    fn drop(&mut self) {
        if !self.handle.is_null() {
            // SAFETY: it was made once, and is released once.
            unsafe { (self.functions.release_device)(self.handle) };
        }
    }
}

impl<'a> Input<'a> {
    /// With the name that the filter has for it.
    fn named(&self) -> (&'static CStr, &'a [[f32; 3]]) {
        match self {
            Self::Color(pixels) => (c"color", pixels),
            Self::Albedo(pixels) => (c"albedo", pixels),
            Self::Normal(pixels) => (c"normal", pixels),
        }
    }
}
