//! Renders kept in files: what of a render goes into a checkpoint or shard, and how it comes back.

use std::{collections::BTreeMap, ops::Range, path::Path};

use pathspace::{
    film::{CheckpointError, CheckpointFile, CheckpointHeader, Crop, encode_checkpoint},
    path::{Strategy, Technique},
    render::{Lookups, Rays, Renderer, Statistics},
    scene::camera::Sensor,
};

use crate::cli::shared::{exit::Failure, header::CHOICE};

/// A file of sums, opened.
pub fn open(path: &Path) -> Result<CheckpointFile, Failure> {
    CheckpointFile::open(path).map_err(|error| unusable(path, &error))
}

/// The sentence for a file of sums that cannot be used.
pub fn unusable(path: &Path, error: &CheckpointError) -> Failure {
    Failure::input(format!("cannot use '{}': {error}", path.display()))
}

/// The file's contents for the render as it stands, which is to have `whole` passes if that is known.
pub fn encode(
    renderer: &Renderer<'_>,
    sensor: Sensor,
    settings: &BTreeMap<String, String>,
    whole: Option<u32>,
) -> std::io::Result<Vec<u8>> {
    let sums = renderer.sums();
    let film = sums.film;
    let header = CheckpointHeader {
        // The filter says how much padding there is.
        sensor: Sensor { padding: 0, ..sensor },
        crop: film.crop(),
        settings: settings.clone(),
        scale: film.scale(),
        passes: renderer.range(),
        whole,
        errors: sums.errors(),
        counts: counts(&renderer.statistics()),
    };
    encode_checkpoint(&sums, &header)
}

/// The render, going on where the file at `path` ends. It is to have the passes `wanted`.
pub fn resume<'a>(
    renderer: Renderer<'a>,
    path: &Path,
    sensor: Sensor,
    settings: &BTreeMap<String, String>,
    wanted: Range<u32>,
) -> Result<Renderer<'a>, Failure> {
    let file = open(path)?;
    let header = file.header().clone();
    let refuse = |what: String| Failure::input(format!("cannot resume '{}': {what}", path.display()));
    let here = Shape { sensor, crop: renderer.film().crop(), settings };
    if let Some(other) = Shape::of(&header).differs(&here) {
        return Err(refuse(format!("{} there, and {} here", other.0, other.1)));
    }
    // The settings say which they are, so that only a file that no render wrote ends here.
    if *file.contents() != renderer.sums().contents() {
        return Err(refuse("its channels are not those of this render".to_owned()));
    }
    let Range { start, end } = header.passes;
    if start != wanted.start {
        return Err(refuse(format!("its samples begin with number {start}, and this render's with {}", wanted.start)));
    }
    if end > wanted.end {
        return Err(refuse(format!("it has the samples up to number {}, and only {} are wanted", end, wanted.end)));
    }
    let done = statistics(&header.counts).ok_or_else(|| refuse("its counts are unreadable".to_owned()))?;
    file.add_to(&renderer.sums()).map_err(|error| unusable(path, &error))?;
    Ok(renderer.resumed(start..end, &done))
}

/// What may differ because something else does, which made a pilot choose another integrator.
const CHOSEN: [&str; 6] = ["integrator", "light-paths", "merge-radius", "roulette", "sampler", "weights"];

/// What must be the same for two files, or a file and a render, to be parts of one image.
pub struct Shape<'a> {
    pub sensor: Sensor,
    pub crop: Crop,
    pub settings: &'a BTreeMap<String, String>,
}

impl<'a> Shape<'a> {
    pub fn of(header: &'a CheckpointHeader) -> Self {
        Self { sensor: header.sensor, crop: header.crop, settings: &header.settings }
    }

    /// The first thing in which `self` is not like `other`, as each of them has it.
    pub fn differs(&self, other: &Self) -> Option<(String, String)> {
        let size = |sensor: Sensor| format!("the image is {}×{}", sensor.width, sensor.height);
        if size(self.sensor) != size(other.sensor) {
            return Some((size(self.sensor), size(other.sensor)));
        }
        // Where the scene is another one the camera is, too: say what matters.
        let first = ["version", "scene"].into_iter();
        let all = || self.settings.keys().chain(other.settings.keys()).map(String::as_str);
        // Who chose the integrator makes no difference.
        let others = all().filter(|name| *name != CHOICE && !CHOSEN.contains(name));
        let names = first.chain(others).chain(CHOSEN);
        for name in names {
            let [a, b] = [self, other].map(|shape| shape.settings.get(name));
            if a != b {
                return Some((say(name, a), say(name, b)));
            }
        }
        (self.crop != other.crop).then(|| (format!("{:?}", self.crop), format!("{:?}", other.crop)))
    }
}

/// A setting in words; a hash by its first digits.
fn say(name: &str, value: Option<&String>) -> String {
    // Both are from a file, which can say anything.
    let name = name.escape_debug();
    match value {
        None => format!("{name} is not given"),
        Some(value) if name.to_string() == "scene" => {
            format!("the scene has hash {:.12}", value.escape_debug().to_string())
        }
        Some(value) => format!("{name} is '{}'", value.escape_debug()),
    }
}

const SAMPLES: &str = "samples";
const CAMERA_RAYS: &str = "rays.camera";
const LIGHT_RAYS: &str = "rays.light";
const VISIBILITY_RAYS: &str = "rays.visibility";
const LOOKUPS: &str = "lookups";
const FOUND: &str = "lookups.found";
const SPARED_RAYS: &str = "rays.spared";
const LOST_TO_SIDES: &str = "lost.sides";
const REJECTED: &str = "rejected";

/// The statistics as text: integers, so that those of parts can be added as the parts can.
pub fn counts(statistics: &Statistics) -> BTreeMap<String, String> {
    let technique = |technique: &Technique| match technique {
        Technique::Bidirectional(Strategy { s, t }) => format!("{s},{t}"),
        Technique::Merged(Strategy { s, t }) => format!("{s}+{t}"),
        Technique::Area => "area".to_owned(),
    };
    let rejected = statistics.rejected.iter().map(|(which, count)| format!("{} {count}", technique(which)));
    let rejected = rejected.collect::<Vec<_>>().join("; ");
    let Rays { camera, light, visibility } = statistics.rays;
    let all = [
        (SAMPLES, statistics.samples.to_string()),
        (CAMERA_RAYS, camera.to_string()),
        (LIGHT_RAYS, light.to_string()),
        (VISIBILITY_RAYS, visibility.to_string()),
        (LOOKUPS, statistics.lookups.made.to_string()),
        (FOUND, statistics.lookups.found.to_string()),
        (SPARED_RAYS, statistics.spared.to_string()),
        (LOST_TO_SIDES, statistics.lost_to_sides.to_string()),
        (REJECTED, rejected),
    ];
    all.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}

/// What [`counts`] wrote.
pub fn statistics(counts: &BTreeMap<String, String>) -> Option<Statistics> {
    let mut rejected = BTreeMap::new();
    for entry in counts.get(REJECTED)?.split("; ").filter(|entry| !entry.is_empty()) {
        let (which, count) = entry.split_once(' ')?;
        let strategy = |(s, t): (&str, &str)| Some(Strategy { s: s.parse().ok()?, t: t.parse().ok()? });
        let technique = match (which.split_once(','), which.split_once('+')) {
            (Some(pair), _) => Technique::Bidirectional(strategy(pair)?),
            (None, Some(pair)) => Technique::Merged(strategy(pair)?),
            (None, None) if which == "area" => Technique::Area,
            (None, None) => return None,
        };
        rejected.insert(technique, count.parse().ok()?);
    }
    let count = |name: &str| counts.get(name)?.parse().ok();
    let rays = Rays { camera: count(CAMERA_RAYS)?, light: count(LIGHT_RAYS)?, visibility: count(VISIBILITY_RAYS)? };
    // Older files do not have all.
    let later = |name: &str| if counts.contains_key(name) { count(name) } else { Some(0) };
    let (lookups, lost_to_sides) = (Lookups { made: later(LOOKUPS)?, found: later(FOUND)? }, later(LOST_TO_SIDES)?);
    Some(Statistics { samples: count(SAMPLES)?, rays, lookups, spared: count(SPARED_RAYS)?, lost_to_sides, rejected })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_differs_is_said_with_what_matters_first() {
        let sensor = Sensor { width: 4, height: 3, padding: 0 };
        let text = |(name, value): &(&str, &str)| ((*name).to_owned(), (*value).to_owned());
        let mut settings: BTreeMap<_, _> =
            [("camera", "a"), ("scene", "1"), ("version", "0.1.0")].iter().map(text).collect();
        let here = settings.clone();
        settings.extend([("camera", "b"), ("version", "0.2.0")].iter().map(text));
        let shape = |settings| Shape { sensor, crop: Crop::full(sensor), settings };
        let said = shape(&settings).differs(&shape(&here)).unwrap();
        assert_eq!(said, ("version is '0.2.0'".to_owned(), "version is '0.1.0'".to_owned()));
        assert!(shape(&here).differs(&shape(&here)).is_none());
    }

    #[test]
    fn statistics_come_back() {
        let strategy = Strategy { s: 2, t: 13 };
        let rejected =
            [(Technique::Area, 3), (Technique::Bidirectional(strategy), 1), (Technique::Merged(strategy), 2)];
        for rejected in [BTreeMap::new(), rejected.into()] {
            let rays = Rays { camera: 7, light: 0, visibility: u64::MAX };
            let lookups = Lookups { made: 3, found: 8 };
            let all = Statistics { samples: 1 << 40, rays, lookups, spared: 5, lost_to_sides: 9, rejected };
            assert_eq!(statistics(&counts(&all)), Some(all));
        }
    }
}
