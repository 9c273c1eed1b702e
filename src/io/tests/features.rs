//! The list of extensions: what it says is true, and the page says what it says.

use std::{env, fmt::Write, fs};

use super::*;
use crate::io::{Drafts, EXTENSIONS, Status};

/// Between these lines of `docs/gltf.md` the table stands.
const BEGIN: &str = "<!-- The table is written by: PATHSPACE_WRITE_DOCS=1 cargo test --release --lib features -->\n";
const END: &str = "<!-- End of the table. -->\n";

fn table() -> String {
    let mut table = "| extension | read | not read, or otherwise | tested by |\n|---|---|---|---|\n".to_owned();
    for extension in EXTENSIONS {
        let tests: Vec<_> = extension.tests.iter().map(|test| format!("`{test}`")).collect();
        let limits = if extension.limits.is_empty() { "–" } else { extension.limits };
        writeln!(table, "| `{}` | {} | {limits} | {} |", extension.name, extension.read, tests.join(", ")).unwrap();
    }
    table
}

#[test]
fn the_table_of_extensions_is_current() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/gltf.md");
    let page = fs::read_to_string(&path).unwrap();
    let (before, rest) = page.split_once(BEGIN).expect("a place for the table");
    let (found, after) = rest.split_once(END).expect("an end of the table");
    if env::var_os("PATHSPACE_WRITE_DOCS").is_some() {
        fs::write(&path, format!("{before}{BEGIN}\n{}\n{END}{after}", table())).unwrap();
        return;
    }
    assert_eq!(found.trim(), table().trim());
}

/// A file that requires what is on the list is read, and each test that is named is there.
#[test]
fn what_the_list_says_is_so() {
    for pair in EXTENSIONS.windows(2) {
        assert!(pair[0].name < pair[1].name, "{} is out of order", pair[1].name);
    }
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/io");
    for extension in EXTENSIONS {
        let document = changed(triangle(), "/extensionsRequired", json!([extension.name]));
        let document = changed(document, "/extensionsUsed", json!([extension.name]));
        let drafts = LoadOptions { drafts: Drafts::Read, ..LoadOptions::default() };
        assert_eq!(load(&document).is_err(), extension.status == Status::Draft, "{}", extension.name);
        let loaded = load_as(&document, &drafts).unwrap_or_else(|error| panic!("{}: {error}", extension.name));
        assert_eq!(loaded.summary.extensions_honoured, [extension.name]);
        assert!(!extension.tests.is_empty(), "{} is not tested", extension.name);
        for test in extension.tests {
            let (file, name) = test.split_once("::").unwrap();
            let source = fs::read_to_string(sources.join(format!("{file}.rs"))).unwrap();
            assert!(
                source.contains(&format!("\nfn {name}() {{")),
                "{} names {test}, which is not there",
                extension.name
            );
            assert!(source.contains(short(extension.name)), "{test} says nothing of {}", extension.name);
        }
    }
}

/// What a test would call an extension: `sheen`, `texture_webp`.
fn short(name: &str) -> &str {
    let own = name.split_once('_').map_or(name, |(_, rest)| rest);
    let own = own.strip_prefix("materials_").unwrap_or(own);
    match own {
        // A test of metadata lists their names.
        "mesh_features" | "structural_metadata" | "xmp" | "xmp_json_ld" => "metadata",
        // It adds no member that a test would name.
        "mesh_quantization" => "quantized",
        _ if own.contains("meshopt") => "meshopt",
        _ => own,
    }
}
