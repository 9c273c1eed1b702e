//! Parts of a render, on their way through a file.

use std::io::Cursor;

use pathspace::{
    film::{CheckpointFile, CheckpointHeader, encode_checkpoint},
    render::Renderer,
    scene::camera::Sensor,
};

/// Adds the sums of a shard to those of `merged`, as a file of them does: of an image of `whole` passes.
pub fn add(shard: &Renderer<'_>, merged: &Renderer<'_>, sensor: Sensor, whole: u32) {
    let film = shard.film();
    let header = CheckpointHeader {
        sensor: Sensor { padding: 0, ..sensor },
        crop: film.crop(),
        settings: Default::default(),
        scale: film.scale(),
        passes: shard.range(),
        whole: Some(whole),
        errors: film.errors(),
        counts: Default::default(),
    };
    let bytes = encode_checkpoint(&shard.sums(), &header).unwrap();
    CheckpointFile::from_reader(Cursor::new(bytes)).unwrap().add_to(&merged.sums()).unwrap();
}
