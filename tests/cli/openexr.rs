//! OpenEXR's own tool on one file of every kind that the program writes. Skipped, loudly, where it is not installed.

use std::{fs, process::Command};

use crate::{Run, code, scene, stderr, triangle};

/// Whether `exrinfo --strict` takes the file; `None` where there is no such program.
fn is_strictly_valid(run: &Run, name: &str) -> Option<Result<(), String>> {
    let output = match Command::new("exrinfo").arg("--strict").arg(run.path(name)).output() {
        Ok(output) => output,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return None,
        Err(error) => panic!("exrinfo: {error}"),
    };
    let said = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
    Some(if output.status.success() { Ok(()) } else { Err(said) })
}

/// A scene whose lamp has a name of 80 letters.
fn long_name() -> String {
    let material =
        format!(r#""materials": [{{ "name": "{}", "emissiveFactor": [1, 1, 1] }}], "accessors""#, "lamp ".repeat(16));
    let document = triangle("0.0").replacen(r#""accessors""#, &material, 1);
    document.replacen(r#""POSITION": 0 }"#, r#""POSITION": 0 }, "material": 0"#, 1)
}

#[test]
fn every_kind_of_file_is_strictly_valid() {
    let run = Run::new();
    fs::write(run.path("long.gltf"), long_name()).unwrap();
    let scene = scene();
    let cornell = scene.to_str().unwrap();
    let render = |scene: &str, name: &str, options: &[&str]| {
        let small = ["render", scene, "--width", "16", "--height", "12", "--spp", "4", "-q", "-o", name];
        let output = run.pathspace(&[&small[..], options].concat());
        assert_eq!(code(&output), 0, "{name}: {}", stderr(&output));
    };
    render(cornell, "image.exr", &["--checkpoint", "checkpoint.exr"]);
    render(cornell, "crop.exr", &["--crop", "3,2,9,7", "--transparent"]);
    render(cornell, "layers.exr", &["-i", "bdpt", "--layers", "bounces,neumann,classes,lights,strategies"]);
    render(cornell, "data.exr", &["--data", "albedo,normals,position,depth,ids,samples,halves,variance"]);
    render("long.gltf", "long.exr", &["--layers", "lights", "--data", "halves"]);
    render(cornell, "shard-1.exr", &["--shard", "1/2"]);
    render(cornell, "shard-2.exr", &["--shard", "2/2", "--threads", "1"]);
    render("long.gltf", "long-shard.exr", &["--layers", "lights", "--transparent", "--shard", "1/1"]);
    for arguments in [
        &["merge", "shard-1.exr", "shard-2.exr", "-q", "-o", "merged.exr"][..],
        &["merge", "shard-1.exr", "shard-2.exr", "-q", "--as-shard", "-o", "both.exr"],
        &["compare", "image.exr", "merged.exr", "-q", "-o", "difference.exr"],
        &["verify", cornell, "--width", "16", "--height", "12", "--spp", "2", "-i", "path,light", "-q", "-o", "verify"],
    ] {
        let output = run.pathspace(arguments);
        assert!([0, 5].contains(&code(&output)), "{arguments:?}: {}", stderr(&output));
    }
    let folder = |folder: &str| {
        let files =
            fs::read_dir(run.path(folder)).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
        files.filter(|name| name.ends_with(".exr")).map(|name| format!("{folder}/{name}")).collect::<Vec<_>>()
    };
    let files = [folder("."), folder("verify")].concat();
    assert!(files.len() >= 14, "{files:?}");
    let refused: Vec<_> = files.iter().map(|name| (name, is_strictly_valid(&run, name))).collect();
    if refused.iter().any(|(_, valid)| valid.is_none()) {
        #[expect(clippy::print_stderr, reason = "what a test could not look at must be said")]
        let () = eprintln!("SKIPPED: no exrinfo (Debian's openexr), so that {} files were not looked at", files.len());
        return;
    }
    let refused: Vec<_> = refused.into_iter().filter(|(_, valid)| *valid != Some(Ok(()))).collect();
    assert!(refused.is_empty(), "{refused:#?}");
}
