//! Layers: channels of the .exr file beside the image's own.

use std::collections::BTreeMap;

use exr::prelude::{ReadChannels, ReadLayers, read};

use crate::{Run, code, refused, stderr};

/// The channels of a file, by their names.
fn channels(file: &[u8]) -> BTreeMap<String, Vec<f32>> {
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(std::io::Cursor::new(file))
        .unwrap();
    let channels = image.layer_data.channel_data.list.into_iter();
    channels.map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect())).collect()
}

#[test]
fn layers_are_channels_that_add_up_and_leave_the_image_alone() {
    let run = Run::new();
    let plain = channels(&run.image("plain.exr", &["--spp", "2"]));
    let options = ["--spp", "2", "--layers", "classes,bounces", "--layer", "red=C<D'red'>.*L", "--max-depth", "6"];
    let file = run.image("layers.exr", &options);
    assert_eq!(file, run.image("again.exr", &options), "the same layers are the same file");
    let found = channels(&file);
    assert_eq!(plain.keys().collect::<Vec<_>>(), ["B", "G", "R"]);
    assert_eq!(found.len(), 3 * (1 + 7 + 6 + 1));
    for set in ["classes.", "bounces."] {
        for letter in ["R", "G", "B"] {
            let own = |name: &str| name.starts_with(set) && name.ends_with(letter);
            let layers: Vec<_> = found.iter().filter(|(name, _)| own(name)).map(|(_, values)| values).collect();
            for (i, value) in found[letter].iter().enumerate() {
                let sum: f32 = layers.iter().map(|layer| layer[i]).sum();
                assert!((sum - value).abs() <= 1e-5 * value, "{set}{letter}: {sum} and {value}");
            }
        }
    }
    assert!(found["red.R"].iter().any(|x| *x > 0.0) && found["red.R"] != found["R"]);
}

#[test]
fn the_image_is_the_same_with_and_without_layers() {
    let run = Run::new();
    let plain = channels(&run.image("plain.exr", &["--spp", "2"]));
    let layered = channels(&run.image("layers.exr", &["--spp", "2", "--layers", "strategies"]));
    assert!(["R", "G", "B"].iter().all(|letter| plain[*letter] == layered[*letter]));
}

#[test]
fn paths_alone_are_their_layer() {
    let run = Run::new();
    let layers = channels(&run.image("layers.exr", &["-i", "bdpt", "--spp", "2", "--layer", "some=C.*D.L"]));
    let alone = channels(&run.image("alone.exr", &["-i", "bdpt", "--spp", "2", "--paths", "C.*D.L"]));
    for letter in ["R", "G", "B"] {
        assert_eq!(layers[&format!("some.{letter}")], alone[letter]);
        assert_ne!(layers[letter], alone[letter]);
    }
}

#[test]
fn a_bounce_alone_is_its_layer() {
    let run = Run::new();
    let by_bdpt =
        |file: &str, options: &[&str]| channels(&run.image(file, &[&["-i", "bdpt", "--spp", "2"], options].concat()));
    let layers = by_bdpt("layers.exr", &["--layers", "bounces", "--max-depth", "4"]);
    let alone = by_bdpt("alone.exr", &["--min-depth", "3", "--max-depth", "3"]);
    let deep = by_bdpt("deep.exr", &["--min-depth", "4", "--max-depth", "4"]);
    for letter in ["R", "G", "B"] {
        // The weights of a length do not depend on how long others may be, but walks and their numbers end with the
        // table.
        let mean = |values: &[f32]| values.iter().sum::<f32>() / values.len() as f32;
        assert_eq!(layers[&format!("bounces.4.{letter}")], deep[letter]);
        let (a, b) = (mean(&layers[&format!("bounces.3.{letter}")]), mean(&alone[letter]));
        assert!((a / b - 1.0).abs() < 0.2, "{letter}: {a} and {b}");
    }
    refused(&run.render(&["--min-depth", "5", "--max-depth", "4"]), 2, "raise --max-depth");
}

/// Layers are sums as the image is: stopped, resumed and put together, they are those of the single render.
#[test]
fn layers_are_resumed_and_merged_to_the_byte() {
    let run = Run::new();
    for (integrator, more) in
        [("path", &[][..]), ("light", &["--filter", "blackman-harris"]), ("bdpt", &["--transparent"])]
    {
        let sets = if integrator == "path" { "lights,bounces" } else { "strategies,neumann,classes" };
        let own = ["-i", integrator, "--max-depth", "5", "--layers", sets, "--layer", "even=C<D'red'>.*L"];
        let common = [&own[..], more].concat();
        let with = |name: &str, options: &[&str]| run.image(name, &[&common[..], options].concat());
        let whole = with("whole.exr", &["--spp", "7"]);
        with("first.exr", &["--spp", "3", "--checkpoint", "kept.exr"]);
        let resumed = with("resumed.exr", &["--spp", "7", "--resume", "kept.exr", "--threads", "1"]);
        assert!(resumed == whole, "{integrator} resumed");
        let shards = ["1/3", "2/3", "3/3"].map(|shard| {
            let name = shard.replace('/', "-of-") + ".exr";
            with(&name, &["--spp", "7", "--shard", shard]);
            name
        });
        let merge = ["merge", &shards[2], &shards[0], &shards[1], "-o", "merged.exr", "-o", "merged.png"];
        let output = run.pathspace(&merge);
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        assert!(std::fs::read(run.path("merged.exr")).unwrap() == whole, "{integrator} merged");
        let output = run.pathspace(&["merge", &shards[0], "--partial", "-q", "-o", "part.exr"]);
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        assert_eq!(channels(&std::fs::read(run.path("part.exr")).unwrap()).len(), channels(&whole).len());

        let mut other = common.clone();
        other[5] = "bounces";
        let output = run.render(&[&other[..], &["--spp", "7", "-q", "--resume", "kept.exr", "-o", "no.exr"]].concat());
        refused(&output, 3, "layers is ");
        run.image(
            "other.exr",
            &[&["-i", integrator, "--max-depth", "5"], more, &["--spp", "7", "--shard", "2/3"]].concat(),
        );
        let output = run.pathspace(&["merge", &shards[0], "other.exr", "-q", "--partial", "-o", "no.exr"]);
        refused(&output, 3, "layers is not given");
        let output = run.pathspace(&["merge", &shards[0], "-q", "--partial", "-o", "no.exr", "--memory-limit", "100K"]);
        refused(&output, 2, "--memory-limit");
    }
}

#[test]
fn what_cannot_be_a_layer_is_refused_in_a_sentence() {
    let run = Run::new();
    let long = format!("{}=CL", "a".repeat(200));
    for (options, about) in [
        (&["--layer", "CDL"][..], "NAME=EXPR"),
        (&["--layer", "a b=CDL"], "'a b' is no name of a layer"),
        (&["--layer", &long], "200 letters, and 128"),
        (&["--layer", "a=CDX"], "character 3 of 'CDX': 'X' is no event"),
        (&["--layer", "a=C<D'door'>L"], "no material of the scene is called 'door'"),
        (&["--layer", "a=CDL", "--layer", "a=CGL"], "two layers 'a'"),
        (&["--layers", "bounce"], "bounces"),
        (&["--layers", "bounces", "-o", "a.png"], "layers are channels of an .exr file"),
        (&["--layers", "strategies", "--max-depth", "200", "--memory-limit", "1MiB"], "--memory-limit"),
    ] {
        let output = run.render(&[&["--spp", "1", "-q"], options].concat());
        refused(&output, 2, about);
        assert!(run.files().is_empty(), "{options:?} wrote {:?}", run.files());
    }
    let output = run.render(&["--spp", "1", "-q", "--layers", "bounces", "--max-depth", "3"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
}

#[test]
fn data_channels_are_beside_an_image_that_they_leave_alone() {
    let run = Run::new();
    let plain = channels(&run.image("plain.exr", &["--spp", "8"]));
    let all = ["--spp", "8", "--data", "albedo,normals,position,depth,ids,samples,halves,variance"];
    let file = run.image("data.exr", &all);
    assert_eq!(file, run.image("again.exr", &[&all[..], &["--threads", "1"]].concat()), "whatever the threads");
    let found = channels(&file);
    assert_eq!(found.len(), 3 + 3 + 6 + 3 + 1 + 3 + 2 + 6 + 3);
    for letter in ["R", "G", "B"] {
        assert_eq!(found[letter], plain[letter]);
        let (even, odd) = (&found[&format!("even.{letter}")], &found[&format!("odd.{letter}")]);
        let variance = &found[&format!("variance.{letter}")];
        for (i, value) in plain[letter].iter().enumerate() {
            assert!((0.5 * (even[i] + odd[i]) - value).abs() <= 1e-6 * value);
            assert!((variance[i] - (0.5 * (even[i] - odd[i])).powi(2)).abs() <= 1e-6 * variance[i]);
        }
    }
    assert!(found["samples.count"].iter().all(|n| *n == 8.0));
    // The box is closed but for the side that the camera looks through.
    let hit: Vec<_> = (0..found["depth.Z"].len()).filter(|i| found["samples.hits"][*i] == 1.0).collect();
    assert!(hit.len() > 100, "{}", hit.len());
    for i in hit {
        let three = |name: &str| ["X", "Y", "Z"].map(|axis| found[&format!("{name}.{axis}")][i]);
        let length = three("normal").iter().map(|x| x * x).sum::<f32>().sqrt();
        assert!(length <= 1.0 + 1e-5 && found["depth.Z"][i] > 0.0 && found["id.material"][i] >= 1.0);
        assert_eq!(three("normal"), three("geometric-normal"), "flat walls");
        assert!(["R", "G", "B"].iter().all(|c| (0.0..=1.0).contains(&found[&format!("albedo.{c}")][i])));
    }
}

#[test]
fn data_goes_where_it_can_be_written() {
    let run = Run::new();
    refused(&run.render(&["--data", "depth", "-o", "x.png"]), 2, "no output is one (-o OUT.exr)");
    refused(&run.render(&["--data", "depth", "--shard", "1/2", "-o", "x.exr"]), 2, "a shard holds no data channels");
    refused(&run.render(&["--data", "halves", "--spp", "1", "-o", "x.exr"]), 2, "one sample per pixel has no halves");
}

#[test]
fn a_render_may_be_resumed_with_other_data() {
    let run = Run::new();
    let data = ["--data", "halves,albedo"];
    let whole = run.image("whole.exr", &[&["--spp", "8"][..], &data].concat());
    run.image("first.exr", &["--spp", "4", "--checkpoint", "part.exr"]);
    let resumed = run.image("resumed.exr", &[&["--spp", "8", "--resume", "part.exr"][..], &data].concat());
    assert_eq!(whole, resumed);
}
