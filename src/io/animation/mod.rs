//! Animations: the document as it is at one time.
//!
//! An animation changes numbers of the JSON and nothing else, so that is what happens here: the values of all channels
//! at the time go into the document, which is then read like any other. Whatever the reader reads of a property that
//! is listed in [`property`] can therefore be animated, without code of its own.

mod curve;
mod property;
mod target;

use std::collections::HashMap;

use gltf_json::{Accessor, Animation, Index, Root};
#[cfg(test)]
pub(super) use property::PROPERTIES;
use serde_json::Value;

use self::{curve::Curve, target::Target};
use super::{
    accessor::Accessors,
    error::{Fault, LoadError, one_line, quoted},
    limits::PosedAt,
};

/// An animation of a file, as [`Summary`](super::Summary) lists it.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedAnimation {
    /// Its name, where it has one.
    pub name: Option<String>,
    /// The time of its last key, seconds; none where its times cannot be read.
    pub seconds: Option<f32>,
    /// Whether the scene is posed by it.
    pub shown: bool,
}

/// The animations of a file, none of them shown.
pub(super) fn list(root: &Root, accessors: Accessors<'_>) -> Vec<NamedAnimation> {
    // Samplers share their times, and a file may have many.
    let mut ends: HashMap<usize, Option<f32>> = HashMap::new();
    let mut end = |times: Index<Accessor>| {
        *ends.entry(times.value()).or_insert_with(|| accessors.scalars(times).ok()?.last().copied())
    };
    let mut last = |animation: &Animation| {
        let ends: Option<Vec<f32>> = animation.samplers.iter().map(|sampler| end(sampler.input)).collect();
        ends?.into_iter().filter(|end| end.is_finite()).reduce(f32::max)
    };
    let mut one = |animation: &Animation| NamedAnimation {
        name: animation.name.as_deref().map(one_line),
        seconds: last(animation),
        shown: false,
    };
    root.animations.iter().map(&mut one).collect()
}

/// What a document says of animations that are not shown.
pub(super) fn at_rest(root: &Root, warnings: &mut Vec<String>) {
    let help = "(--at SECONDS poses it)";
    match root.animations.len() {
        0 => {}
        1 => warnings.push(format!("its animation is not played: what it moves is at rest {help}")),
        count => warnings.push(format!("its {count} animations are not played: what they move is at rest {help}")),
    }
}

/// A document at a time.
pub(super) struct Posed {
    /// The document as JSON, without its animations.
    pub(super) json: Vec<u8>,
    /// Which of its animations it is posed by.
    pub(super) shown: Vec<usize>,
}

/// The document `json`, which `root` was read from, posed; `None` if nothing in it is animated.
pub(super) fn posed(
    json: &[u8],
    root: &Root,
    accessors: Accessors<'_>,
    at: PosedAt<'_>,
    file: &str,
    warnings: &mut Vec<String>,
) -> Result<Option<Posed>, LoadError> {
    let wanted = at.animation.map(|wanted| named(root, wanted, file)).transpose()?;
    if root.animations.is_empty() {
        warnings.push("the file has no animation: at all times it looks the same".to_owned());
        return Ok(None);
    }
    let mut pose = || {
        // It was read once already.
        let mut document: Value =
            serde_json::from_slice(json).map_err(|error| Fault::invalid("", format!("it is no JSON: {error}")))?;
        let animations = document.as_object_mut().and_then(|document| document.remove("animations"));
        let targets = target::all(animations.as_ref(), root)?;
        let shown = wanted.map_or_else(|| together(root, &targets, warnings), |index| vec![index]);
        let mut left_out = LeftOut::default();
        for target in shown.iter().flat_map(|&index| &targets[index]) {
            match property::kind(&target.pointer) {
                Some(kind) => {
                    let curve = Curve::read(root, accessors, target, kind)?;
                    let value =
                        curve.at(at.seconds).ok_or_else(|| target.fault("the value at this time is no number"))?;
                    property::set(&mut document, &target.pointer, kind, &value)
                        .map_err(|what| target.fault(format!("it animates {}, {what}", quoted(&target.pointer))))?;
                }
                None => left_out.add(&target.pointer),
            }
        }
        warnings.extend(left_out.warning());
        let json = serde_json::to_vec(&document).map_err(|error| Fault::invalid("", error.to_string()))?;
        Ok(Some(Posed { json, shown }))
    };
    pose().map_err(|fault: Fault| fault.at(file))
}

/// The index of the animation with this name, or number.
fn named(root: &Root, wanted: &str, file: &str) -> Result<usize, LoadError> {
    let count = root.animations.len();
    // A name goes first: it was given by a person.
    let named = root.animations.iter().position(|animation| animation.name.as_deref() == Some(wanted));
    named.or_else(|| wanted.parse().ok().filter(|&index| index < count)).ok_or_else(|| {
        let what = format!("there is no animation {}: {}", quoted(wanted), names(root));
        LoadError::NoSuchAnimation { file: file.to_owned(), what }
    })
}

/// All animations, if no two of them move the same thing: they are parts of one. Else they are takes of which one is
/// shown at a time: the first.
fn together(root: &Root, targets: &[Vec<Target>], warnings: &mut Vec<String>) -> Vec<usize> {
    let read = |target: &&Target| property::kind(&target.pointer).is_some();
    let of_each = targets.iter().enumerate();
    let mut all: Vec<(&str, usize)> =
        of_each.flat_map(|(i, own)| own.iter().filter(read).map(move |t| (t.pointer.as_str(), i))).collect();
    all.sort_unstable();
    // The last one that is no part of the one before, as a weight is of all weights.
    let mut whole: Option<(&str, usize)> = None;
    let is_in =
        |part: &str, whole: &str| part.strip_prefix(whole).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'));
    let disjoint = all.iter().all(|&(pointer, animation)| match whole {
        Some((whole, of)) if is_in(pointer, whole) => of == animation,
        _ => {
            whole = Some((pointer, animation));
            true
        }
    });
    if disjoint {
        return (0..targets.len()).collect();
    }
    let what = "animations that move the same things: the first is shown (--animation NAME shows another)";
    warnings.push(format!("the file has {what}; {}", names(root)));
    vec![0]
}

fn names(root: &Root) -> String {
    /// More would be no sentence.
    const MOST: usize = 20;
    let one = |(index, animation): (usize, &Animation)| match &animation.name {
        Some(name) => format!("{index} {}", quoted(name)),
        None => index.to_string(),
    };
    let known: Vec<_> = root.animations.iter().enumerate().map(one).take(MOST).collect();
    match root.animations.len() {
        0 => "the file has none".to_owned(),
        count if count > MOST => format!("the file has {}, and {} more", known.join(", "), count - MOST),
        _ => format!("the file has {}", known.join(", ")),
    }
}

/// Animated properties that are not read.
#[derive(Default)]
struct LeftOut {
    first: Option<String>,
    count: usize,
}

impl LeftOut {
    fn add(&mut self, pointer: &str) {
        self.first.get_or_insert_with(|| pointer.to_owned());
        self.count += 1;
    }

    fn warning(&self) -> Option<String> {
        let first = quoted(self.first.as_ref()?);
        let more = if self.count == 1 { String::new() } else { format!(" (and {} more like it)", self.count - 1) };
        Some(format!("what animates {first}{more} is left out: this is not read, or not animated"))
    }
}
