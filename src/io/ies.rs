//! Light profiles (`EXT_lights_ies`): files of IES LM-63, and which node shines by which of them.
//!
//! The format is that of ANSI/IES LM-63 (1986, 1991, 1995, 2002 and 2019): a line `TILT=…` behind the keywords, then
//! numbers alone.

use std::{collections::HashMap, sync::Arc};

use glam::{DMat3, DVec3, Mat3};
use gltf_json::{Root, scene::Node};
use serde_json::Value;

use super::{
    buffer::{self, Buffers, Hash},
    error::{Fault, quoted},
    light::PunctualLight,
    limits::{Limit, Place},
    placed::Placed,
};
use crate::{
    math::Rgb,
    scene::light::{BRIGHTEST, Profile},
};

pub(super) const NAME: &str = "EXT_lights_ies";
/// More angles than a table in steps of 0.1° has are a mistake.
const MOST_ANGLES: usize = 3601;
/// More intensities than this, too.
const MOST_VALUES: usize = 1 << 20;

/// The profiles that nodes of a document have, by their index; `None` for one that is dark.
pub(super) type Profiles = HashMap<usize, Option<Arc<Profile>>>;

fn of_node(node: &Node) -> Option<&Value> {
    node.extensions.as_ref()?.others.get(NAME)
}

fn index_of(reference: &Value, at: &str) -> Result<usize, Fault> {
    let index = reference.get("light").and_then(Value::as_u64).and_then(|index| usize::try_from(index).ok());
    index.ok_or_else(|| Fault::invalid(format!("{at}/light"), "this is not the number of a light profile"))
}

/// Reads the profiles that some node has; `hash` takes in the files.
pub(super) fn profiles(
    root: &Root,
    buffers: &Buffers,
    place: Place<'_>,
    hash: &mut Hash,
    warnings: &mut Vec<String>,
) -> Result<Profiles, Fault> {
    let mut profiles = Profiles::new();
    let lights = root.extensions.as_ref().and_then(|extensions| extensions.others.get(NAME)?.get("lights")?.as_array());
    let mut entries = 0_u64;
    for (i, node) in root.nodes.iter().enumerate() {
        let Some(reference) = of_node(node) else { continue };
        let index = index_of(reference, &format!("/nodes/{i}/extensions/{NAME}"))?;
        if profiles.contains_key(&index) {
            continue;
        }
        let at = format!("/extensions/{NAME}/lights/{index}");
        let Some(light) = lights.and_then(|lights| lights.get(index)) else {
            return Err(Fault::invalid(at, "there is no such light profile"));
        };
        let of_view = |view: &Value| view.as_u64().and_then(|view| usize::try_from(view).ok());
        let profile = match (light.get("uri").and_then(Value::as_str), light.get("bufferView").and_then(of_view)) {
            (Some(uri), _) if uri.starts_with("data:") => parse(&buffer::data_uri(uri, &at)?, &at, warnings)?,
            (Some(uri), _) => {
                let bytes = buffer::beside(uri, place, "light profile", &at)?;
                hash.add(&bytes);
                parse(&bytes, &at, warnings)?
            }
            (None, Some(view)) => parse(buffers.view(root, view)?, &at, warnings)?,
            (None, None) => return Err(Fault::invalid(at, "the light profile has neither a URI nor a buffer view")),
        };
        entries += profile.as_ref().map_or(0, |profile| profile.size() as u64);
        let most = place.limits.texels;
        if entries > most {
            let what =
                format!("the light profiles up to this one have {entries} intensities, and {}", Limit("texels", most));
            return Err(Fault::too_large(at, what));
        }
        profiles.insert(index, profile.map(Arc::new));
    }
    Ok(profiles)
}

/// The lamp at a node; `None` if it has none, or a dark one.
pub(super) fn light(node: &Node, placed: &Placed, profiles: &Profiles) -> Result<Option<PunctualLight>, Fault> {
    let Some(reference) = of_node(node) else { return Ok(None) };
    let at = format!("{}/extensions/{NAME}", placed.pointer());
    let Some(Some(profile)) = profiles.get(&index_of(reference, &at)?) else { return Ok(None) };
    let number = |value: &Value| value.as_f64().filter(|x| *x >= 0.0).map(|x| x as f32);
    let multiplier = match reference.get("multiplier") {
        None => 1.0,
        Some(value) => number(value)
            .ok_or_else(|| Fault::invalid(format!("{at}/multiplier"), "this is not a number of at least 0"))?,
    };
    let color = match reference.get("color") {
        None => Rgb::ONE,
        Some(value) => {
            let channels: Option<Vec<_>> = value.as_array().and_then(|list| list.iter().map(number).collect());
            let channels = channels.and_then(|list| <[f32; 3]>::try_from(list).ok());
            let Some(channels) = channels.filter(|c| c.iter().all(|c| *c <= 1.0)) else {
                return Err(Fault::invalid(format!("{at}/color"), "this is not a colour: three numbers from 0 to 1"));
            };
            Rgb::from_array(channels)
        }
    };
    let color = color * multiplier;
    let peak = color.max_element() * profile.peak();
    if peak.is_nan() || peak > BRIGHTEST {
        return Err(Fault::invalid(at, format!("the brightest intensity is {peak:e}, and {BRIGHTEST:e} is the limit")));
    }
    if color == Rgb::ZERO {
        return Ok(None);
    }
    let to_world = frame(placed)?;
    Ok(Some(PunctualLight::Profile { position: placed.origin(), to_world, color, profile: profile.clone() }))
}

/// The node's axes in the world, of unit length and at right angles: −z, along which the lamp shines, is the node's.
fn frame(node: &Placed) -> Result<Mat3, Fault> {
    let z = node.axis(DVec3::Z)?.as_dvec3();
    let x = node.axis(DVec3::X)?.as_dvec3();
    let flat = || Fault::invalid(node.pointer(), "a light here has no direction, its node is scaled to nothing");
    let x = (x - z * x.dot(z)).try_normalize().ok_or_else(flat)?;
    let mirrored = node.to_world.matrix3.determinant() < 0.0;
    let y = z.cross(x) * if mirrored { -1.0 } else { 1.0 };
    Ok(DMat3::from_cols(x, y, z).as_mat3())
}

/// The numbers of a file, in order.
struct Numbers<'a, I: Iterator<Item = &'a str>> {
    words: I,
    count: usize,
    at: &'a str,
}

impl<'a, I: Iterator<Item = &'a str>> Numbers<'a, I> {
    fn next(&mut self, what: &str) -> Result<f64, Fault> {
        self.count += 1;
        let Some(word) = self.words.next() else {
            return Err(self.fault(&format!("the file ends where {what} should be (number {})", self.count)));
        };
        let number = word.parse().ok().filter(|x: &f64| x.is_finite());
        number.ok_or_else(|| {
            self.fault(&format!("{what} (number {} after TILT) is {}, not a number", self.count, quoted(word)))
        })
    }

    fn count(&mut self, what: &str) -> Result<usize, Fault> {
        let number = self.next(what)?;
        if number.fract() != 0.0 || !(1.0..=MOST_ANGLES as f64).contains(&number) {
            return Err(self.fault(&format!("{what} is {number}, not one of 1 to {MOST_ANGLES}")));
        }
        Ok(number as usize)
    }

    fn several(&mut self, n: usize, what: &str) -> Result<Vec<f64>, Fault> {
        (0..n).map(|_| self.next(what)).collect()
    }

    fn fault(&self, what: &str) -> Fault {
        Fault::invalid(self.at, format!("light profile: {what}"))
    }
}

/// What stands on the line `TILT=`, and what follows it.
fn tilt(text: &str) -> Option<(&str, &str)> {
    let mut rest = text;
    loop {
        let line = rest.lines().next()?;
        rest = rest.get(line.len()..).unwrap_or("").trim_start_matches(['\r', '\n']);
        if let Some(tilt) = line.trim().strip_prefix("TILT=") {
            return Some((tilt.trim(), rest));
        }
    }
}

/// The profile in a file of IES LM-63; `None` if it is dark.
pub(super) fn parse(bytes: &[u8], at: &str, warnings: &mut Vec<String>) -> Result<Option<Profile>, Fault> {
    let text = String::from_utf8_lossy(bytes);
    let Some((tilt, rest)) = tilt(&text) else {
        return Err(Fault::invalid(at, "light profile: there is no line TILT=, so that it is no IES LM-63 file"));
    };
    let words = rest.split(|c: char| c.is_whitespace() || c == ',').filter(|word| !word.is_empty());
    let mut numbers = Numbers { words, count: 0, at };
    if tilt == "INCLUDE" {
        numbers.next("the lamp's position")?;
        let pairs = numbers.count("the number of tilt angles")?;
        numbers.several(2 * pairs, "a tilt angle or its factor")?;
    }
    if tilt != "NONE" {
        warnings.push(format!("{at}: TILT={} is ignored, the lamp shines as it was measured", quoted(tilt)));
    }
    let [_lamps, _lumens, multiplier] =
        [numbers.next("the number of lamps")?, numbers.next("lumens per lamp")?, numbers.next("the multiplier")?];
    let polar = numbers.count("the number of vertical angles")?;
    let azimuths = numbers.count("the number of horizontal angles")?;
    let kind = numbers.next("the type of photometry")?;
    numbers.several(4, "the units, the width, the length or the height")?;
    let factor = multiplier * numbers.next("the ballast factor")? * numbers.next("the ballast-lamp factor")?;
    numbers.next("the input watts")?;
    if kind == 2.0 || kind == 3.0 {
        let name = if kind == 2.0 { "B" } else { "A" };
        return Err(Fault::unsupported(at, format!("light profile: photometry is of type {name}, only C is read")));
    }
    if kind != 1.0 {
        return Err(numbers.fault(&format!("the type of photometry is {kind}, not 1, 2 or 3")));
    }
    if polar * azimuths > MOST_VALUES {
        return Err(numbers.fault(&format!("{polar} × {azimuths} intensities, and {MOST_VALUES} is the limit")));
    }
    let vertical = numbers.several(polar, "a vertical angle")?;
    let horizontal = numbers.several(azimuths, "a horizontal angle")?;
    // Of each horizontal angle all vertical ones.
    let values = numbers.several(polar * azimuths, "an intensity")?;
    let values: Vec<_> = values.into_iter().map(|value| value * factor).collect();
    if let Some(bad) = values.iter().find(|value| !(0.0..=f64::from(BRIGHTEST)).contains(*value)) {
        return Err(numbers.fault(&format!("an intensity is {bad:e} cd, not one of 0 to {BRIGHTEST:e}")));
    }
    if numbers.words.next().is_some() {
        warnings.push(format!("{at}: what follows the light profile's last intensity is ignored"));
    }
    let around = around(&horizontal).map_err(|what| numbers.fault(&what))?;
    let rising = vertical.len() > 1 && vertical.is_sorted_by(|a, b| a < b);
    let (first, last) = (vertical[0], vertical[polar - 1]);
    if !rising || first < 0.0 || last > 180.0 {
        return Err(numbers.fault("the vertical angles do not rise within 0 to 180"));
    }
    if ![0.0, 90.0].contains(&first) || ![90.0, 180.0].contains(&last) {
        warnings.push(format!("{at}: the light profile is dark outside of its vertical angles, {first}° to {last}°"));
    }
    let radians: Vec<_> = vertical.iter().map(|angle| angle.to_radians()).collect();
    let turns: Vec<_> = around.iter().map(|(angle, _)| angle.to_radians()).collect();
    Ok(Profile::new(&radians, &turns, |i, j| values[around[j].1 * polar + i] as f32))
}

/// The horizontal angles all around, degrees, each with the column that it shows. Those of a file end where the rest
/// follows by symmetry: a single one, a quadrant to 90°, a half to 180°, or from 90° to 270° (LM-63-1995).
fn around(angles: &[f64]) -> Result<Vec<(f64, usize)>, String> {
    if !angles.is_sorted_by(|a, b| a < b) {
        return Err("the horizontal angles do not rise".to_owned());
    }
    let (first, last, n) = (angles[0], angles[angles.len() - 1], angles.len());
    let mirrored = |about: f64, all: &[(f64, usize)]| -> Vec<(f64, usize)> {
        let back = all.iter().rev().skip(1).map(|(angle, column)| (2.0 * about - angle, *column));
        all.iter().copied().chain(back).collect()
    };
    let all: Vec<_> = angles.iter().copied().zip(0..).collect();
    match (first, last) {
        _ if n == 1 => Ok(vec![(0.0, 0), (360.0, 0)]),
        (0.0, 90.0) => Ok(mirrored(180.0, &mirrored(90.0, &all))),
        (0.0, 180.0) => Ok(mirrored(180.0, &all)),
        (90.0, 270.0) => Ok(mirrored(270.0, &all)),
        (0.0, 360.0) => Ok(all),
        // Files leave the last angle out, which repeats the first.
        (0.0, 180.0..360.0) => Ok(all.into_iter().chain([(360.0, 0)]).collect()),
        _ => Err(format!(
            "the horizontal angles run from {first} to {last}, not from 0 to 90, 180 or 360, nor from 90 to 270"
        )),
    }
}
