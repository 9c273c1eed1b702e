//! `pathspace denoise` and `render --denoise`: by a library that can be worked out by hand, and by the real one where
//! it is installed.

use std::{
    env, fs,
    io::Cursor,
    path::{Path, PathBuf},
    process::{Command, Output},
    sync::OnceLock,
};

use exr::{
    image::{AnyChannels, FlatSamples, Image, Layer},
    meta::attribute::{AttributeValue, Text},
    prelude::{ReadChannels, ReadLayers, WritableImage, f16, read},
};
use pathspace::compare::{Metric, brightness_difference};
use serde_json::{Value, json};

use crate::{Run, code, pixels, refused, scene, stderr, stdout};

type File = Image<Layer<AnyChannels<FlatSamples>>>;

/// A library made of `oidn.c`; `None` where it is not Linux.
fn stub(name: &str, flags: &[&str]) -> Option<PathBuf> {
    if !cfg!(target_os = "linux") {
        #[expect(clippy::print_stderr, reason = "a test that is skipped says so")]
        let () = eprintln!("SKIPPED: the library of the tests is compiled on Linux alone");
        return None;
    }
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cli/oidn.c");
    // The compiler that FLIP needs as well.
    let library = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let mut compiler = Command::new("c++");
    compiler.args(["-x", "c", "-shared", "-fPIC", "-o"]).arg(&library).args(flags).arg(source);
    assert!(compiler.status().is_ok_and(|status| status.success()), "{name}");
    Some(library)
}

/// The library that is worked out by hand.
fn by_hand() -> Option<&'static str> {
    static LIBRARY: OnceLock<Option<PathBuf>> = OnceLock::new();
    LIBRARY.get_or_init(|| stub("liboidn-by-hand.so", &[])).as_deref().and_then(Path::to_str)
}

/// Whether the real library is there; `OIDN_LIBRARY` says that it has to be.
fn is_installed(run: &Run) -> bool {
    run.image("probe.exr", &["-q", "-i", "path", "--spp", "1"]);
    let probe = run.pathspace(&["denoise", "probe.exr", "-o", "probe.png", "-q"]);
    let installed = code(&probe) == 0;
    assert!(installed || env::var_os("OIDN_LIBRARY").is_none(), "{}", stderr(&probe));
    if !installed {
        #[expect(clippy::print_stderr, reason = "a test that is skipped says so")]
        let () = eprintln!("SKIPPED: Open Image Denoise is not installed ('pip install pyoidn', or OIDN_LIBRARY)");
    }
    installed
}

fn read_file(bytes: &[u8]) -> File {
    let layers = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    layers.from_buffered(Cursor::new(bytes)).unwrap()
}

fn floats(file: &File, name: &str) -> Vec<f32> {
    let channels = &file.layer_data.channel_data.list;
    let found = channels.iter().find(|c| c.name.to_string() == name).unwrap_or_else(|| panic!("no channel {name}"));
    found.sample_data.values_as_f32().collect()
}

fn names(file: &File) -> Vec<String> {
    file.layer_data.channel_data.list.iter().map(|c| c.name.to_string()).collect()
}

fn attribute(file: &File, name: &str) -> Option<String> {
    match file.layer_data.attributes.other.get(&Text::from(format!("pathspace.{name}").as_str()))? {
        AttributeValue::Text(text) => Some(text.to_string()),
        _ => None,
    }
}

#[test]
fn without_the_library_a_sentence_says_how_to_get_it() {
    let run = Run::new();
    run.image("in.exr", &["-q", "-i", "path", "--spp", "1"]);
    fs::write(run.path("text.so"), "no library").unwrap();
    let denoise = |library: &str| run.pathspace(&["denoise", "in.exr", "-o", "out.exr", "--oidn", library]);
    if let Some(library) = by_hand() {
        fs::copy(library, run.path("named.so")).unwrap();
        assert_eq!(code(&denoise("named.so")), 0, "a name is that of a file here");
        for name in ["named.so", "out.exr"] {
            fs::remove_file(run.path(name)).unwrap();
        }
    }
    for output in [denoise("/nonexistent/lib.so"), denoise("text.so"), denoise("./no-folder")] {
        refused(&output, 2, "pip install pyoidn");
    }
    refused(&run.render(&["--denoise", "--oidn", "/nonexistent/lib.so", "-o", "out.exr"]), 2, "'/nonexistent/lib.so'");
    let by_variable = Command::new(env!("CARGO_BIN_EXE_pathspace"))
        .args(["denoise", "in.exr", "-o", "out.exr"])
        .current_dir(run.folder.path())
        .env("OIDN_LIBRARY", "/nonexistent/lib.so")
        .output()
        .unwrap();
    refused(&by_variable, 2, "'/nonexistent/lib.so'");
    if cfg!(target_os = "linux") {
        refused(&denoise("libm.so.6"), 2, "'libm.so.6' is not Open Image Denoise: it has no function oidnNewDevice");
    }
    if let Some(old) = stub("liboidn-old.so", &["-DOLD"]) {
        refused(&denoise(old.to_str().unwrap()), 2, "is too old: version 2");
    }
    if let Some(new) = stub("liboidn-new.so", &["-DMAJOR=3"]) {
        refused(&denoise(new.to_str().unwrap()), 2, "is version 3.7.7 of Open Image Denoise");
    }
    assert_eq!(run.files(), ["in.exr", "text.so"]);
}

#[test]
fn what_does_not_go_together_is_refused() {
    let Some(library) = by_hand() else { return };
    let run = Run::new();
    let oidn = ["--oidn", library];
    let render = |options: &[&str]| run.render(&[options, &oidn, &["-o", "out.exr"]].concat());
    refused(&render(&[]), 2, "--denoise as well");
    refused(&render(&["--denoise", "--shard", "1/2"]), 2, "pathspace denoise");
    refused(&render(&["--denoise", "--layer", "noisy=CL"]), 2, "another name");
    run.image("small.exr", &["-q", "-i", "path", "--spp", "1", "--crop", "0,0,4,5", "--data", "albedo"]);
    run.image("beside.exr", &["-q", "-i", "path", "--spp", "1", "--crop", "4,0,8,5", "--data", "albedo"]);
    run.image("part.exr", &["-q", "-i", "path", "--spp", "2", "--shard", "1/2"]);
    run.image("in.exr", &["-q", "-i", "path", "--spp", "2", "--layer", "caustics=CL"]);
    run.image("layer.exr", &["-q", "-i", "path", "--spp", "1", "--layer", "noisy=CL"]);
    run.image("picture.png", &["-q", "-i", "path", "--spp", "1"]);
    run.image("done.exr", &[&["-q", "-i", "path", "--spp", "2", "--denoise"], &oidn[..]].concat());
    let files = run.files();
    for (arguments, exit, about) in [
        (&["none.exr"][..], 3, "none.exr"),
        (&["picture.png"], 3, "no OpenEXR file"),
        (&["part.exr"], 3, "no channels R, G and B"),
        (&["done.exr"], 3, "denoised already"),
        (&["layer.exr"], 3, "has a layer noisy"),
        (&["in.exr", "--guides", "small.exr"], 3, "has 4 × 5 pixels"),
        (&["beside.exr", "--guides", "small.exr"], 3, "its first pixel is (0, 0), that of the image (4, 0)"),
        (&["in.exr", "--guides", "layer.exr"], 3, "no albedo"),
        (&["in.exr", "-o", "out.jpg"], 2, ".exr or .png"),
        (&["in.exr", "-o", "no/out.exr"], 4, "no folder"),
    ] {
        refused(&run.pathspace(&[&["denoise"], arguments, &oidn, &["-o", "out.exr"]].concat()), exit, about);
    }
    // A denoised image is no estimate that anything may be measured against, added to or resumed from.
    let scene = scene();
    let scene = scene.to_str().unwrap();
    let size = ["--width", "16", "--height", "12", "--spp", "2"];
    let converge = ["converge", scene, "--reference", "done.exr", "-o", "page.html"];
    refused(&run.pathspace(&[&converge[..], &size].concat()), 3, "'done.exr' is denoised");
    refused(&run.pathspace(&["merge", "done.exr", "-o", "out.exr"]), 3, "'done.exr'");
    let resume = ["-q", "-i", "path", "--spp", "4", "--resume", "done.exr", "-o", "out.exr"];
    refused(&run.render(&resume), 3, "'done.exr'");
    assert_eq!(run.files(), files);
}

/// What the stub makes of color, albedo and normal: both guides are doubled, and color + albedo + 10 normal is there.
fn expected(file: &File, color: [&str; 3]) -> [Vec<f32>; 3] {
    [0, 1, 2].map(|i| {
        let albedo = floats(file, ["albedo.R", "albedo.G", "albedo.B"][i]);
        let normal = floats(file, ["normal.X", "normal.Y", "normal.Z"][i]);
        let guides = albedo.into_iter().zip(normal).map(|(a, n)| (2.0 * a, 2.0 * n));
        floats(file, color[i]).into_iter().zip(guides).map(|(c, (a, n))| c + a + 10.0 * n).collect()
    })
}

#[test]
fn guides_are_fed_and_the_image_as_rendered_is_kept_bit_by_bit() {
    let Some(library) = by_hand() else { return };
    let run = Run::new();
    let common = ["-q", "-i", "bdpt", "--spp", "4", "--layers", "classes", "--crop", "2,1,12,9", "--transparent"];
    let sets = ["--data", "albedo,normals,halves,ids"];
    let rendered = read_file(&run.image("rendered.exr", &[&common[..], &sets].concat()));
    let denoise = ["--denoise", "--oidn", library];
    let denoised = run.image("denoised.exr", &[&common[..], &sets, &denoise].concat());
    let file = read_file(&denoised);
    for (i, letter) in ["R", "G", "B"].into_iter().enumerate() {
        let noisy = floats(&file, &format!("noisy.{letter}"));
        assert!(noisy.iter().map(|x| x.to_bits()).eq(floats(&rendered, letter).iter().map(|x| x.to_bits())));
        assert_eq!(floats(&file, letter), expected(&rendered, ["R", "G", "B"])[i], "{letter}");
    }
    // Everything else is as it was.
    for name in names(&rendered).into_iter().filter(|name| !["R", "G", "B"].contains(&&name[..])) {
        assert_eq!(floats(&file, &name), floats(&rendered, &name), "{name}");
    }
    assert_eq!(names(&file).len(), names(&rendered).len() + 3);
    let said = attribute(&file, "denoised").unwrap();
    assert!(said.starts_with("by Open Image Denoise 2.7.7, from colours, albedo and normals; biased"), "{said}");
    assert_eq!(attribute(&rendered, "denoised"), None);

    // The command makes the same file, of the same image; and of its guides alone.
    let oidn = ["--oidn", library, "-q"];
    let out = run.pathspace(&[&["denoise", "rendered.exr", "-o", "out.exr", "-o", "out.png"], &oidn[..]].concat());
    assert_eq!((code(&out), &stderr(&out)[..]), (0, ""));
    assert!(fs::read(run.path("out.exr")).unwrap() == denoised);
    run.image("picture.png", &[&["-q", "-i", "bdpt", "--spp", "4", "--transparent"], &denoise[..]].concat());
    run.image("plain.exr", &common);
    let out =
        run.pathspace(&[&["denoise", "plain.exr", "--guides", "rendered.exr", "-o", "other.exr"], &oidn[..]].concat());
    assert_eq!(code(&out), 0, "{}", stderr(&out));
    let other = read_file(&fs::read(run.path("other.exr")).unwrap());
    assert_eq!(floats(&other, "G"), floats(&file, "G"));
    assert!(!names(&other).iter().any(|name| name.starts_with("albedo")));
    // Guides that nobody asked for are fed, and are not in the file.
    let file = read_file(&run.image("bare.exr", &[&common[..], &denoise].concat()));
    assert_eq!(floats(&file, "G"), floats(&other, "G"));
    assert_eq!(names(&file), names(&other));
}

#[test]
fn without_albedo_colours_do_it_alone_and_that_is_said() {
    let Some(library) = by_hand() else { return };
    let run = Run::new();
    run.image("in.exr", &["-q", "-i", "path", "--spp", "2"]);
    let output = run.pathspace(&["denoise", "in.exr", "-o", "out.exr", "-o", "out.png", "--oidn", library]);
    assert_eq!(code(&output), 0);
    assert!(stderr(&output).contains("'in.exr' has no albedo"), "{}", stderr(&output));
    let file = read_file(&fs::read(run.path("out.exr")).unwrap());
    assert_eq!(floats(&file, "R"), floats(&file, "noisy.R"), "the stub adds guides, and there are none");
    assert!(attribute(&file, "denoised").unwrap().contains("from its colours alone"));
}

#[test]
fn when_the_filter_fails_the_samples_are_not_lost() {
    let Some(library) = by_hand() else { return };
    let run = Run::new();
    let plain = run.image("plain.exr", &["-q", "-i", "path", "--spp", "2"]);
    let fails = |arguments: &[&str]| -> Output {
        Command::new(env!("CARGO_BIN_EXE_pathspace"))
            .args(arguments)
            .args(["-q", "--oidn", library])
            .current_dir(run.folder.path())
            .env("OIDN_STUB_FAILS", "1")
            .output()
            .unwrap()
    };
    let scene = scene();
    let render = ["render", scene.to_str().unwrap(), "--width", "16", "--height", "12", "-i", "path", "--spp", "2"];
    let output = fails(&[&render[..], &["--denoise", "-o", "out.exr"]].concat());
    refused(&output, 4, "out of memory, as planted; wrote out.exr as rendered");
    assert!(fs::read(run.path("out.exr")).unwrap() == plain);
    let told = ["--denoise", "-o", "out.exr", "--stats", "stats.json", "--progress", "json"];
    let output = fails(&[&render[..], &told].concat());
    assert_eq!(code(&output), 4);
    let end: Value = serde_json::from_str(stdout(&output).lines().last().unwrap()).unwrap();
    assert_eq!((&end["event"], &end["exit"]), (&json!("end"), &json!(4)));
    fs::remove_file(run.path("stats.json")).unwrap();
    refused(&fails(&["denoise", "plain.exr", "-o", "none.exr"]), 4, "out of memory, as planted");
    assert_eq!(run.files(), ["out.exr", "plain.exr"]);
}

#[test]
fn files_of_other_programs_keep_what_they_have() {
    let Some(library) = by_hand() else { return };
    let run = Run::new();
    let mut file = read_file(&run.image("ours.exr", &["-q", "-i", "path", "--spp", "2", "--data", "albedo"]));
    for channel in &mut file.layer_data.channel_data.list {
        channel.sample_data = FlatSamples::F16(channel.sample_data.values_as_f32().map(f16::from_f32).collect());
    }
    let comment = || Some(Text::from("by hand"));
    file.layer_data.attributes.comments = comment();
    file.layer_data.attributes.other.insert(Text::from("renderTime"), AttributeValue::F32(7.5));
    let write = |file: &File, name: &str| {
        file.write().to_file(run.path(name)).unwrap();
    };
    write(&file, "theirs.exr");
    let denoise = |name: &str| run.pathspace(&["denoise", name, "-o", "out.exr", "--oidn", library, "-q"]);
    assert_eq!(code(&denoise("theirs.exr")), 0);
    let out = read_file(&fs::read(run.path("out.exr")).unwrap());
    let half = |file: &File, name: &str| {
        let channels = &file.layer_data.channel_data.list;
        channels.iter().find(|c| c.name.to_string() == name).unwrap().sample_data.clone()
    };
    assert_eq!(half(&out, "noisy.G"), half(&file, "G"), "halves stay halves");
    assert_eq!(half(&out, "albedo.B"), half(&file, "albedo.B"));
    assert_eq!(out.layer_data.attributes.comments, comment());
    assert_eq!(out.layer_data.attributes.other[b"renderTime".as_slice()], AttributeValue::F32(7.5));

    let bad = file.layer_data.channel_data.list.iter_mut().find(|c| c.name == *"albedo.G").unwrap();
    let FlatSamples::F16(samples) = &mut bad.sample_data else { unreachable!("they are halves now") };
    samples[17] = f16::NAN;
    write(&file, "bad.exr");
    refused(&denoise("bad.exr"), 3, "channel albedo.G is NaN in column 1, row 1");
}

#[test]
fn compare_says_what_is_denoised() {
    let Some(library) = by_hand() else { return };
    let run = Run::new();
    let scene = scene();
    let render = |name: &str, options: &[&str]| {
        let small = ["render", scene.to_str().unwrap(), "--width", "32", "-q", "-i", "path", "--spp", "4"];
        let output = run.pathspace(&[&small[..], &["--data", "halves", "-o", name], options].concat());
        assert_eq!(code(&output), 0, "{}", stderr(&output));
    };
    render("a.exr", &["--denoise", "--oidn", library]);
    render("b.exr", &["--seed", "1"]);
    let answer: Value =
        serde_json::from_str(&stdout(&run.pathspace(&["compare", "a.exr", "b.exr", "--json"]))).unwrap();
    assert_eq!(answer["denoised"], json!(["a.exr"]));
    assert_eq!(answer["p_of_no_bias"], Value::Null, "the halves are those of another image");
    assert!(stdout(&run.pathspace(&["compare", "a.exr", "b.exr"])).contains("'a.exr' is denoised"));
    let answer: Value =
        serde_json::from_str(&stdout(&run.pathspace(&["compare", "b.exr", "b.exr", "--json"]))).unwrap();
    assert_eq!(answer["denoised"], json!([]));
    assert!(answer["p_of_no_bias"].is_number());
}

#[test]
fn a_denoised_image_is_closer_to_the_reference() {
    let run = Run::new();
    if !is_installed(&run) {
        return;
    }
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/textured-room.glb");
    let render = |name: &str, options: &[&str]| {
        let common = ["render", scene.to_str().unwrap(), "--width", "160", "-i", "path", "-q", "-o", name];
        let output = run.pathspace(&[&common[..], options].concat());
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        pixels(&fs::read(run.path(name)).unwrap())
    };
    let reference = render("reference.exr", &["--spp", "256", "--seed", "1"]);
    let noisy = render("noisy.exr", &["--spp", "4"]);
    let guided = render("guided.exr", &["--spp", "4", "--denoise"]);
    assert_eq!(code(&run.pathspace(&["denoise", "noisy.exr", "-o", "alone.exr", "-q"])), 0);
    let alone = pixels(&fs::read(run.path("alone.exr")).unwrap());
    for metric in [Metric::Flip, Metric::RelMseTrimmed] {
        let [noisy, guided, alone] = [&noisy, &guided, &alone].map(|image| metric.between(image, &reference));
        assert!(guided < 0.7 * noisy, "{}: {noisy} noisy, {guided} guided", metric.name());
        assert!(guided < 0.9 * alone, "{}: {alone} by colour, {guided} guided", metric.name());
    }
    let brighter = brightness_difference(&guided, &noisy);
    assert!(brighter.abs() < 0.02, "{brighter}");
}
