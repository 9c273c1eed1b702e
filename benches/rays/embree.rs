//! The little of Embree 4's C interface that single rays need, loaded at run time.

use std::{ffi::c_void, mem::transmute_copy, ptr::null_mut};

use glam::Vec3;
use libloading::Library;
use pathspace::scene::geometry::Ray;

use super::meshes::Soup;

type Handle = *mut c_void;

/// `RTCRay` of `rtcore_ray.h`.
#[repr(C, align(16))]
struct RtcRay {
    origin: [f32; 3],
    near: f32,
    direction: [f32; 3],
    time: f32,
    far: f32,
    mask: u32,
    id: u32,
    flags: u32,
}

/// `RTCHit` of `rtcore_ray.h`; the size leaves room for more instance levels than the library was built with.
#[repr(C, align(16))]
struct RtcHit {
    normal: [f32; 3],
    uv: [f32; 2],
    primitive: u32,
    geometry: u32,
    instance: [u32; 9],
}

#[repr(C, align(16))]
struct RtcRayHit {
    ray: RtcRay,
    hit: RtcHit,
}

/// Embree's flags and qualities that are compared.
#[derive(Clone, Copy)]
pub struct Mode {
    pub robust: u32,
    pub quality: u32,
}

pub const MEDIUM_FAST: Mode = Mode { robust: 0, quality: 1 };
pub const MEDIUM_ROBUST: Mode = Mode { robust: 4, quality: 1 };
pub const HIGH_FAST: Mode = Mode { robust: 0, quality: 2 };
pub const HIGH_ROBUST: Mode = Mode { robust: 4, quality: 2 };

/// A scene of one triangle mesh; device and scene live as long as the process.
pub struct Embree {
    scene: Handle,
    intersect: unsafe extern "C" fn(Handle, *mut RtcRayHit, Handle),
    occluded: unsafe extern "C" fn(Handle, *mut RtcRay, Handle),
}

fn rtc_ray(ray: &Ray) -> RtcRay {
    let (origin, direction) = (ray.origin.to_array(), ray.direction.to_array());
    RtcRay { origin, near: 0.0, direction, time: 0.0, far: ray.t_max, mask: !0, id: 0, flags: 0 }
}

impl Embree {
    pub fn new(library: &'static Library, mesh: &Soup, mode: Mode) -> Self {
        // SAFETY: every use names a function of Embree 4 with the signature of its header.
        unsafe fn function<F>(library: &'static Library, name: &str) -> F {
            let symbol = unsafe { library.get::<*const ()>(name.as_bytes()) }
                .unwrap_or_else(|e| panic!("the Embree library is not version 4: {e}"));
            unsafe { transmute_copy(&*symbol) }
        }
        // SAFETY: handles come from Embree; the buffers have the sizes that were asked for.
        unsafe {
            let new_device: unsafe extern "C" fn(*const c_void) -> Handle = function(library, "rtcNewDevice");
            let new_scene: unsafe extern "C" fn(Handle) -> Handle = function(library, "rtcNewScene");
            let scene_flags: unsafe extern "C" fn(Handle, u32) = function(library, "rtcSetSceneFlags");
            let scene_quality: unsafe extern "C" fn(Handle, u32) = function(library, "rtcSetSceneBuildQuality");
            let new_geometry: unsafe extern "C" fn(Handle, u32) -> Handle = function(library, "rtcNewGeometry");
            let geometry_quality: unsafe extern "C" fn(Handle, u32) = function(library, "rtcSetGeometryBuildQuality");
            let new_buffer: unsafe extern "C" fn(Handle, u32, u32, u32, usize, usize) -> Handle =
                function(library, "rtcSetNewGeometryBuffer");
            let commit_geometry: unsafe extern "C" fn(Handle) = function(library, "rtcCommitGeometry");
            let attach: unsafe extern "C" fn(Handle, Handle) -> u32 = function(library, "rtcAttachGeometry");
            let commit_scene: unsafe extern "C" fn(Handle) = function(library, "rtcCommitScene");
            let device_error: unsafe extern "C" fn(Handle) -> i32 = function(library, "rtcGetDeviceError");

            let device = new_device(c"threads=2".as_ptr().cast());
            assert!(!device.is_null(), "Embree has no device");
            let scene = new_scene(device);
            scene_flags(scene, mode.robust);
            scene_quality(scene, mode.quality);
            let geometry = new_geometry(device, 0); // triangles
            geometry_quality(geometry, mode.quality);
            const FLOAT3: u32 = 0x9003;
            const UINT3: u32 = 0x5003;
            let vertices = new_buffer(geometry, 1, 0, FLOAT3, 12, mesh.positions.len()).cast::<Vec3>();
            vertices.copy_from_nonoverlapping(mesh.positions.as_ptr(), mesh.positions.len());
            let indices = new_buffer(geometry, 0, 0, UINT3, 12, mesh.triangles.len()).cast::<[u32; 3]>();
            indices.copy_from_nonoverlapping(mesh.triangles.as_ptr(), mesh.triangles.len());
            commit_geometry(geometry);
            attach(scene, geometry);
            commit_scene(scene);
            assert_eq!(device_error(device), 0, "Embree reports an error");
            Self { scene, intersect: function(library, "rtcIntersect1"), occluded: function(library, "rtcOccluded1") }
        }
    }

    #[inline]
    pub fn closest(&self, ray: &Ray) -> Option<f32> {
        let hit = RtcHit { normal: [0.0; 3], uv: [0.0; 2], primitive: !0, geometry: !0, instance: [!0; 9] };
        let mut query = RtcRayHit { ray: rtc_ray(ray), hit };
        // SAFETY: the scene is committed, the query aligned and initialised.
        unsafe { (self.intersect)(self.scene, &raw mut query, null_mut()) };
        (query.hit.geometry != !0).then_some(query.ray.far)
    }

    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        let mut query = rtc_ray(ray);
        // SAFETY: as above.
        unsafe { (self.occluded)(self.scene, &raw mut query, null_mut()) };
        query.far < 0.0
    }
}
