//! The program as a person or a script meets it: exit codes, sentences, files.

mod auto;
mod black;
mod checkpoints;
mod compare;
mod converge;
mod denoise;
mod environment;
mod extreme;
mod frames;
mod info;
mod interruption;
mod layers;
mod lecture;
mod malformed;
mod openexr;
mod render;
mod shards;
mod statistics;
mod trace;
mod usage;
mod verify;
mod viewer;

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

/// The program, run in its own folder so that nothing is written anywhere else.
struct Run {
    folder: tempfile::TempDir,
}

impl Run {
    fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn files(&self) -> Vec<String> {
        let name = |entry: std::io::Result<fs::DirEntry>| entry.unwrap().file_name().into_string().unwrap();
        let mut names: Vec<_> = fs::read_dir(self.folder.path()).unwrap().map(name).collect();
        names.sort();
        names
    }

    fn pathspace(&self, arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_pathspace")).args(arguments).current_dir(self.folder.path()).output().unwrap()
    }

    /// `pathspace render` of the Cornell box at a size that takes no time.
    fn render(&self, options: &[&str]) -> Output {
        let scene = scene();
        let small = ["render", scene.to_str().unwrap(), "--width", "16", "--height", "12"];
        self.pathspace(&[&small[..], options].concat())
    }

    /// Renders to `name`, which must succeed, and returns the file.
    fn image(&self, name: &str, options: &[&str]) -> Vec<u8> {
        let output = self.render(&[options, &["-o", name]].concat());
        assert_eq!(code(&output), 0, "{options:?}: {}", stderr(&output));
        fs::read(self.path(name)).unwrap()
    }
}

fn scene() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-box.glb")
}

fn code(output: &Output) -> i32 {
    output.status.code().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// Refused with this exit code and one sentence that contains `about`, before anything was written.
#[track_caller]
fn refused(output: &Output, exit: i32, about: &str) {
    let text = stderr(output);
    assert_eq!(code(output), exit, "{text}");
    assert!(text.starts_with("error: ") && text.trim_end().lines().count() == 1, "not one sentence: {text}");
    assert!(text.contains(about), "nothing about '{about}': {text}");
    assert!(output.stdout.is_empty());
}

/// A document of one triangle, whose first coordinate is `x`.
fn triangle(x: &str) -> String {
    let corners: [f32; 9] = [x.parse().unwrap(), 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let bytes: Vec<u8> = corners.iter().flat_map(|c| c.to_le_bytes()).collect();
    let escaped: String = bytes.iter().map(|b| format!("%{b:02x}")).collect();
    format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "scene": 0, "scenes": [{{ "nodes": [0] }}], "nodes": [{{ "mesh": 0 }}],
        "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0 }} }}] }}],
        "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                         "min": [0, 0, 0], "max": [1, 1, 0] }}],
        "bufferViews": [{{ "buffer": 0, "byteLength": 36 }}],
        "buffers": [{{ "byteLength": 36, "uri": "data:application/octet-stream,{escaped}" }}] }}"#
    )
}

fn pixels(file: &[u8]) -> pathspace::film::Image {
    use exr::prelude::{ReadChannels, ReadLayers, Vec2, read};
    use pathspace::{film::Image, math::Rgb};
    let blank = |size: Vec2<usize>, _: &_| Image {
        width: size.0 as u32,
        height: size.1 as u32,
        pixels: vec![Rgb::ZERO; size.0 * size.1],
    };
    let set = |image: &mut Image, Vec2(x, y): Vec2<usize>, (r, g, b): (f32, f32, f32)| {
        image.pixels[y * image.width as usize + x] = Rgb::new(r, g, b);
    };
    let layers = read().no_deep_data().largest_resolution_level().rgb_channels(blank, set);
    layers
        .first_valid_layer()
        .all_attributes()
        .from_buffered(std::io::Cursor::new(file))
        .unwrap()
        .layer_data
        .channel_data
        .pixels
}
