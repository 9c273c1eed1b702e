//! `auto`: which integrator needs the least work for the same noise, predicted by a pilot.
//!
//! The pilot is a small image of the whole scene. What is frequent in it is measured: every candidate renders it twice,
//! and the two images differ by its noise (`frequent.rs`). What is too rare to be met in so few samples, such as the
//! light that a path tracer finds through a glass once in ten thousand samples, is predicted from a few passes with all
//! techniques, by what each candidate would deposit for such a path (`rare.rs`). Work is counted and not timed
//! ([`Work`]), so that the choice is a function of the scene, the settings and the seed alone.
//!
//! The idea of a pilot with all techniques, whose samples tell the second moments of others, is from Grittmann et al.
//! 2022, *Efficiency-aware multiple importance sampling for bidirectional rendering algorithms*.

mod candidate;
mod frequent;
mod rare;
#[cfg(test)]
mod tests;
mod work;

use std::ops::ControlFlow;

pub use self::{
    candidate::{CANDIDATES, Candidate},
    work::Work,
};
use self::{
    frequent::Measured,
    rare::{Bounds, Rare},
};
use crate::{
    film::Crop,
    path::JoinedPath,
    render::{MergeRadius, Settings},
    sampling::Filter,
    scene::{Scene, camera::Sensor},
};

/// The pixels of the pilot for each of the image's, and how many there are at least and at most.
const PART: f64 = 1.0 / 64.0;
const PIXELS: [f64; 2] = [32.0 * 32.0, 64.0 * 64.0];
/// Merges have the radius of this pass: the area within it is about the mean of 48 passes.
const TYPICAL_PASS: u32 = 16;
/// What is much darker than this part of the image's mean is compared with it.
const DARK: f64 = 0.1;
/// A simpler integrator is chosen if it needs so much more than the best at most: the pilot is no more exact.
const AS_GOOD: f64 = 1.05;
/// One that does not merge is chosen if it needs so much more than one that does at most: the pilot does not see the
/// bias of merges.
const UNBIASED: f64 = 1.2;
/// The same where a scene disperses: a pass with merges has one wavelength for all pixels, and the pilot compares
/// luminances, in which its colours do not show.
const UNCOLORED: f64 = 1.5;
/// A candidate that misses so much more of the light than another is none.
const MISSED: f64 = 1e-3;

/// Which paths are in the image.
pub type Keep<'a> = dyn Fn(&Scene, &JoinedPath) -> bool + Sync + 'a;

/// Hears which part of the pilot is done, and ends it by breaking.
pub type Say<'a> = dyn FnMut(f64) -> ControlFlow<()> + 'a;

/// What the pilot says of a candidate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Of which it says it.
    pub candidate: Candidate,
    /// The mean squared error of an image of 64 samples per pixel, relative to the pixel, times their number: that of
    /// one sample, where the image is converged enough for its error to be noise.
    pub error: f64,
    /// What a sample of a pixel takes.
    pub work: Work,
    /// The part of the image's light that it cannot find.
    pub missed: f64,
}

impl Estimate {
    /// How much work an image of a given noise is, in units that all candidates have in common.
    pub fn needed(&self) -> f64 {
        self.error * self.work.cost()
    }
}

/// The candidate to take, and what is known of all.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Its place in the list.
    pub chosen: usize,
    /// In the order of the candidates.
    pub estimates: Vec<Estimate>,
}

impl Choice {
    /// Of those that find all the light that any does: the first that is about as good as the best, or of those that do
    /// not merge, if they need no more than `margin` times as much.
    fn among(estimates: Vec<Estimate>, margin: f64) -> Self {
        let least = estimates.iter().map(|x| x.missed).fold(f64::INFINITY, f64::min);
        let finds_all = |x: &Estimate| x.missed <= least + MISSED;
        let least = |counts: fn(&Estimate) -> bool| {
            let all = estimates.iter().filter(|x| finds_all(x) && counts(x));
            all.map(Estimate::needed).fold(f64::INFINITY, f64::min)
        };
        let [best, unbiased] = [least(|_| true), least(|x| !x.candidate.integrator.merges())];
        let may_merge = unbiased > margin * best;
        let limit = AS_GOOD * if may_merge { best } else { unbiased };
        let is_good =
            |x: &Estimate| finds_all(x) && x.needed() <= limit && (may_merge || !x.candidate.integrator.merges());
        let chosen = estimates.iter().position(is_good).unwrap_or(estimates.len() - 1);
        Self { chosen, estimates }
    }

    /// The candidate to take.
    pub fn candidate(&self) -> Candidate {
        self.estimates[self.chosen].candidate
    }

    /// Why, for readers: what the others lack.
    pub fn reason(&self) -> String {
        let own = &self.estimates[self.chosen];
        let others = || self.estimates.iter().filter(|x| x.candidate != own.candidate);
        if others().next().is_none() {
            return "there is no other".to_owned();
        }
        if own.error == 0.0 {
            return "its pilot has no noise".to_owned();
        }
        let misses = |x: &&Estimate| x.missed > own.missed + MISSED;
        let list = |all: Vec<String>| (!all.is_empty()).then(|| all.join(", "));
        let needs = |x: &Estimate| format!("{} needs {:.1} times the work", x.candidate, x.needed() / own.needed());
        let lacks = |x: &Estimate| format!("{} misses {:.1} % of the light", x.candidate, 100.0 * x.missed);
        let needs = list(others().filter(|x| !misses(x)).map(needs).collect());
        let needs = needs.map(|needs| format!("for the same noise {needs}"));
        let lacks = list(others().filter(misses).map(lacks).collect());
        needs.into_iter().chain(lacks).collect::<Vec<_>>().join("; ")
    }
}

/// Chooses among candidates for an image of the scene's camera; `keep` as for
/// [`Renderer::keeping`](crate::render::Renderer::keeping). The scene is the same afterwards.
///
/// The candidates' crops, clamps and filters make no difference: the pilot has the whole image, and one size for all.
/// `say` hears which part of it is done, in [0, 1]; where it breaks, the choice ends with `None`.
///
/// # Panics
/// Without candidates.
pub fn choose(
    scene: &mut Scene,
    candidates: &[Settings],
    keep: Option<&Keep<'_>>,
    say: &mut Say<'_>,
) -> Option<Choice> {
    let camera = scene.camera;
    scene.camera = camera.with_sensor(reduced(camera.sensor()));
    let estimates = estimates(scene, candidates, keep, (camera.sensor(), say));
    scene.camera = camera;
    let margin = if scene.disperses() { UNCOLORED } else { UNBIASED };
    estimates.map(|estimates| Choice::among(estimates, margin))
}

/// The pilot's size.
fn reduced(Sensor { width, height, .. }: Sensor) -> Sensor {
    let pixels = f64::from(width) * f64::from(height);
    let [least, most] = PIXELS;
    let scale = ((pixels * PART).clamp(least, most) / pixels).sqrt().min(1.0);
    let side = |x: u32| ((f64::from(x) * scale).round() as u32).max(1);
    Sensor { width: side(width), height: side(height), padding: 0 }
}

/// Of the camera's image as it is, for one of the size `image`.
fn estimates(
    scene: &Scene,
    candidates: &[Settings],
    keep: Option<&Keep<'_>>,
    (image, say): (Sensor, &mut Say<'_>),
) -> Option<Vec<Estimate>> {
    let sensor = scene.camera.sensor();
    let whole = |settings: &Settings| {
        let crop = Crop::full(sensor);
        let merge_radius = Some(MergeRadius::of(scene, settings.merge_radius).of_pass(TYPICAL_PASS));
        Settings { crop, filter: Filter::Box, clamp: None, only: None, merge_radius, ..settings.clone() }
    };
    let candidates: Vec<_> = candidates.iter().map(whole).collect();
    let widest = candidates.last().expect("a candidate");
    let bounds = Bounds::around(frequent::typical_value(scene, widest, keep));
    let mut measured = Vec::new();
    for settings in &candidates {
        say(measured.len() as f64 / (candidates.len() + 1) as f64).continue_value()?;
        measured.push(Measured::new(scene, settings, bounds.common, keep));
    }
    say(candidates.len() as f64 / (candidates.len() + 1) as f64).continue_value()?;
    let rare = Rare::predict(scene, widest, &measured, bounds, keep);
    let least = (0..measured.len()).map(|x| rare.missed(x)).fold(f64::INFINITY, f64::min);
    let complete = || (0..measured.len()).filter(|x| rare.missed(*x) <= least + MISSED);
    let mean = |pixel: usize| {
        let sum: f64 = complete().map(|x| measured[x].mean(pixel) + rare.mean(x, pixel) + rare.lost(x, pixel)).sum();
        sum / complete().count() as f64
    };
    let brightness = frequent::smooth(mean, sensor);
    let dark = DARK * brightness.iter().sum::<f64>() / brightness.len() as f64;
    let estimate = |(candidate, measured): (usize, &Measured)| {
        // The square of a mean of few finds is too large, that of their neighbourhood less so.
        let lost = frequent::smooth(|pixel| rare.lost(candidate, pixel), sensor);
        let of_pixel = |(pixel, brightness): (usize, &f64)| {
            let variance = measured.variance(pixel) + rare.variance(candidate, pixel, measured.mean(pixel));
            let squared = variance + rare::SAMPLES * lost[pixel] * lost[pixel];
            // Nothing is as dark as what is black, in which there is no deviation either.
            squared / (brightness * brightness + dark * dark).max(f64::MIN_POSITIVE)
        };
        let error = brightness.iter().enumerate().map(of_pixel).sum::<f64>() / brightness.len() as f64;
        let (settings, merges) = (&candidates[candidate], measured.integrator.merges());
        let kept = measured.integrator.techniques().merging_per_sample();
        let light_paths = f64::from(if merges { kept } else { 0.0 });
        Estimate {
            candidate: Candidate::of(settings),
            error,
            work: Work { kept_paths: light_paths * f64::from(image.pixels()), ..measured.work },
            missed: rare.missed(candidate),
        }
    };
    Some(measured.iter().enumerate().map(estimate).collect())
}
