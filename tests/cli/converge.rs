//! `pathspace converge`: the page, its numbers, and what it refuses.

use std::{fs, path::Path, process::Command};

use serde_json::Value;

use crate::{Run, code, refused, scene, stderr};

fn converge(run: &Run, options: &[&str]) -> std::process::Output {
    let scene = scene();
    let small = ["converge", scene.to_str().unwrap(), "--width", "16", "--height", "12", "-q", "-o", "page.html"];
    run.pathspace(&[&small[..], options].concat())
}

#[test]
fn the_page_stands_alone_and_its_numbers_are_finite() {
    let run = Run::new();
    let output = converge(&run, &["--spp", "8", "-i", "path,bdpt"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert_eq!(run.files(), ["page.csv", "page.html", "page.json"]);
    let page = fs::read_to_string(run.path("page.html")).unwrap();
    for attribute in ["src=\"", "href=\""] {
        let all = page.split(attribute).skip(1);
        assert!(
            all.clone().count() > 0 && all.clone().all(|rest| rest.starts_with("data:")),
            "{attribute} from elsewhere"
        );
    }
    let json: Value = serde_json::from_str(&fs::read_to_string(run.path("page.json")).unwrap()).unwrap();
    for one in json["integrators"].as_array().unwrap() {
        let spp: Vec<_> = one["snapshots"].as_array().unwrap().iter().map(|s| s["spp"].as_u64().unwrap()).collect();
        assert_eq!(spp, [1, 2, 4, 8]);
        let slope = one["slope"].as_f64().unwrap();
        assert!((-1.0..-0.2).contains(&slope), "√relMSE falls as N^{slope}");
        assert!(one["efficiency"].as_f64().unwrap() > 0.0);
    }
    let shares: f64 = json["classes"].as_array().unwrap().iter().map(|class| class["share"].as_f64().unwrap()).sum();
    assert!((shares - 1.0).abs() < 1e-5, "the classes are all of the light, not {shares}");
    assert_eq!(fs::read_to_string(run.path("page.csv")).unwrap().lines().count(), 1 + 2 * 4);
}

#[test]
fn the_page_works_in_a_browser() {
    let Some(browser) = ["/usr/bin/chromium", "/usr/bin/google-chrome"].into_iter().find(|p| Path::new(p).exists())
    else {
        #[expect(clippy::print_stderr, reason = "a test that is skipped says so")]
        let () = eprintln!("SKIPPED: no chromium, so the page was not opened in a browser");
        return;
    };
    let run = Run::new();
    assert_eq!(code(&converge(&run, &["--spp", "8", "-i", "path,bdpt"])), 0);
    let url = format!("file://{}#selftest", run.path("page.html").display());
    let profile = format!("--user-data-dir={}", run.path("profile").display());
    let options =
        ["--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", "--virtual-time-budget=9000"];
    let output = Command::new(browser).args(options).args([&profile, "--dump-dom", &url]).output().unwrap();
    let (dom, log) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(
        dom.contains("data-selftest=\"passed\""),
        "{:?}\n{log}",
        dom.split("data-selftest").nth(1).map(|s| &s[..80])
    );
    assert!(!log.contains("CONSOLE"), "{log}");
}

#[test]
fn what_cannot_be_measured_is_said() {
    let run = Run::new();
    run.image("small.exr", &["-q", "-i", "path", "--spp", "1", "--crop", "0,0,4,5"]);
    for (options, exit, about) in [
        (&["-i", "path,path"][..], 2, "twice"),
        (&["--spp", "1"], 2, "--spp"),
        (&["--reference", "none.exr"], 3, "none.exr"),
        (&["--reference", "small.exr"], 3, "4 × 5 pixels"),
        (&["--memory-limit", "1KiB"], 2, "--memory-limit"),
    ] {
        refused(&converge(&run, options), exit, about);
    }
    let scene = scene();
    refused(&run.pathspace(&["converge", scene.to_str().unwrap(), "-o", "page.pdf"]), 2, ".html");
    assert_eq!(run.files(), ["small.exr"]);
}
