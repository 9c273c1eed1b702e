//! What a file of sums says besides them, as attributes of OpenEXR.

use std::{collections::BTreeMap, ops::Range, str::FromStr};

use ::exr::{
    meta::{attribute::AttributeValue, header},
    prelude::Vec2,
};

use super::CheckpointError;
use crate::{
    film::{Crop, DepositErrors, FixedPoint, exr::PREFIX},
    scene::camera::Sensor,
};

/// The layout that this module's parent describes; another one gets another number.
pub(super) const LAYOUT: u32 = 2;
/// After [`PREFIX`], before the names of what is not a setting.
pub(super) const STATE: &str = "state.";

pub(super) const CHECKSUM: &str = "checksum";
pub(super) const ENTRIES: &str = "wide-sums";
/// What a file of sums says besides them.
#[derive(Clone, Debug, PartialEq)]
pub struct CheckpointHeader {
    /// The full image.
    pub sensor: Sensor,
    /// The pixels in the file.
    pub crop: Crop,
    /// Everything else that changes pixels, by the names that it has in an image's header.
    pub settings: BTreeMap<String, String>,
    /// Where the film's words lie, in which most sums are written. It changes none.
    pub scale: FixedPoint,
    /// The passes whose samples the sums hold.
    pub passes: Range<u32>,
    /// How many passes there are in the whole render; `None` if that was not said beforehand.
    pub whole: Option<u32>,
    /// What could not be added in these passes.
    pub errors: DepositErrors,
    /// What else was counted in them, by names of the caller's.
    pub counts: BTreeMap<String, String>,
}

impl CheckpointHeader {
    /// All attributes but the checksum and what the sums say of themselves, in the order of their names.
    pub(super) fn attributes(&self) -> BTreeMap<String, String> {
        let Range { start, end } = self.passes;
        let DepositErrors { non_finite, overflow } = self.errors;
        let own = [
            ("layout", LAYOUT.to_string()),
            ("quantum", format!("2^{}", self.scale.exponent())),
            ("passes", format!("{start}..{end}")),
            ("whole", self.whole.map_or(OPEN.to_owned(), |passes| passes.to_string())),
            ("non-finite", non_finite.to_string()),
            ("overflow", overflow.to_string()),
        ];
        let own = own.into_iter().map(|(name, value)| (format!("{STATE}{name}"), value));
        let counts = self.counts.iter().map(|(name, value)| (format!("{STATE}{COUNT}{name}"), value.clone()));
        own.chain(counts).chain(self.settings.clone()).collect()
    }
}

/// What [`CheckpointHeader::whole`] is where it is not known.
const OPEN: &str = "open";
/// Before the names of [`CheckpointHeader::counts`].
const COUNT: &str = "count.";
/// The header's contents, the number of entries of its table and its checksum.
pub(super) fn parse(file: &header::Header) -> Result<(CheckpointHeader, u64, String), CheckpointError> {
    let mut settings = BTreeMap::new();
    let mut state = BTreeMap::new();
    for (name, value) in &file.own_attributes.other {
        let (name, AttributeValue::Text(value)) = (name.to_string(), value) else { continue };
        let Some(name) = name.strip_prefix(PREFIX) else { continue };
        let value = String::from_utf8_lossy(value.as_slice()).into_owned();
        match name.strip_prefix(STATE) {
            Some(name) => state.insert(name.to_owned(), value),
            None => settings.insert(name.to_owned(), value),
        };
    }
    if state.is_empty() {
        let what = if settings.is_empty() { "another program's image" } else { "a finished image, without its sums" };
        return Err(CheckpointError::Foreign(what.to_owned()));
    }
    let layout = take(&mut state, "layout")?;
    if layout != LAYOUT {
        return Err(CheckpointError::OtherLayout(layout));
    }
    let exponent = take::<String>(&mut state, "quantum")?;
    let exponent = exponent.strip_prefix("2^").and_then(|exponent| exponent.parse().ok());
    let scale = FixedPoint::with_exponent(exponent.ok_or_else(|| damaged("quantum"))?);
    if exponent != Some(scale.exponent()) {
        return Err(damaged("quantum"));
    }
    let passes = take::<String>(&mut state, "passes")?;
    let passes = passes.split_once("..").and_then(|(a, b)| Some(a.parse().ok()?..b.parse().ok()?));
    let passes = passes.filter(|Range { start, end }| start <= end).ok_or_else(|| damaged("passes"))?;
    let whole = match take::<String>(&mut state, "whole")?.as_str() {
        OPEN => None,
        number => Some(number.parse().map_err(|_| damaged("whole"))?),
    };
    if whole.is_some_and(|whole| whole < passes.end) {
        return Err(damaged("passes"));
    }
    let errors = DepositErrors { non_finite: take(&mut state, "non-finite")?, overflow: take(&mut state, "overflow")? };
    let checksum = take(&mut state, CHECKSUM)?;
    let entries = take(&mut state, ENTRIES)?;
    let counts = state.into_iter().filter_map(|(name, value)| Some((name.strip_prefix(COUNT)?.to_owned(), value)));
    let counts = counts.collect();
    let (sensor, crop) =
        windows(file).ok_or_else(|| CheckpointError::Damaged("its windows make no image".to_owned()))?;
    Ok((CheckpointHeader { sensor, crop, settings, scale, passes, whole, errors, counts }, entries, checksum))
}

/// The full image and the pixels in the file, as far as they can be those of a render.
fn windows(file: &header::Header) -> Option<(Sensor, Crop)> {
    let narrow = |Vec2(x, y): Vec2<usize>| Some((u32::try_from(x).ok()?, u32::try_from(y).ok()?));
    let display = file.shared_attributes.display_window;
    let (width, height) = narrow(display.size)?;
    let (columns, rows) = narrow(file.layer_size)?;
    let (x0, y0) = (file.own_attributes.layer_position.0, file.own_attributes.layer_position.1);
    let (x0, y0) = (u32::try_from(x0).ok()?, u32::try_from(y0).ok()?);
    let crop = Crop { x0, y0, x1: x0.checked_add(columns)?, y1: y0.checked_add(rows)? };
    let sensor = Sensor { width, height, padding: 0 };
    (display.position == Vec2(0, 0) && crop.fits(sensor)).then_some((sensor, crop))
}

fn take<T: FromStr>(state: &mut BTreeMap<String, String>, name: &str) -> Result<T, CheckpointError> {
    state.remove(name).and_then(|value| value.parse().ok()).ok_or_else(|| damaged(name))
}

fn damaged(name: &str) -> CheckpointError {
    CheckpointError::Damaged(format!("attribute {PREFIX}{STATE}{name}"))
}
