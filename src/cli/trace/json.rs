//! `pathspace trace --json`: the same for programs. `docs/trace.md` has the layout.

use glam::DVec3;
use pathspace::{
    integrator::IntegratorKind,
    path::Technique,
    scene::Scene,
    trace::{Contribution, Share, Trace},
};
use serde_json::{Value, json};

use crate::cli::{
    shared::number::exact,
    trace::{self, Job, text},
};

/// The version of the layout: it grows when a member changes its meaning or goes away, not when one is added.
const LAYOUT: u32 = 1;

/// Everything that is known about the pixel.
pub fn describe(job: &Job<'_>, scene: &Scene, trace: &Trace<'_>) -> Value {
    json!({
        "layout": LAYOUT,
        "scene": job.scene_hash,
        "width": job.sensor.width,
        "height": job.sensor.height,
        "pixel": job.args.pixel,
        "integrator": job.candidate.integrator.name(),
        "light_paths": job.candidate.light_paths.to_string(),
        "spp": trace.passes,
        "value": trace.value.to_array().map(exact),
        "contributions": trace.contributions,
        "sum": vector(trace.sum),
        "largest": trace.largest.iter().map(|one| contribution(scene, one)).collect::<Vec<_>>(),
    })
}

fn contribution(scene: &Scene, one: &Contribution<'_>) -> Value {
    json!({
        "value": one.value.to_array().map(exact),
        "sample": one.pass,
        "raster": one.raster.0.to_array().map(exact),
        "h": exact(one.filter),
        "class": one.path.class().to_string(),
        "technique": technique(one.technique),
        "vertices": (0..=one.path.edges()).map(|i| vertex(scene, one, i)).collect::<Vec<_>>(),
        "edges": (0..one.path.edges()).map(|i| edge(one, i)).collect::<Vec<_>>(),
        "merged": one.path.merged().map(|(at, q)| json!({
            "vertex": at,
            "place": vector(trace::place(scene, q)),
        })),
        "throughput": vector(one.path.throughput()),
        "contribution": vector(one.path.contribution()),
        "wavelength": one.path.wavelength().map(|x| exact(x.nanometres())),
        "survival": exact(one.survival),
        "weight": one.own().weight,
        "fast_weight": exact(one.fast_weight),
        "techniques": one.shares.iter().map(share).collect::<Vec<_>>(),
        "best": technique(one.best().technique),
        "best_over_found": one.best().expected_anywhere() / one.own().expected(),
    })
}

fn vertex(scene: &Scene, one: &Contribution<'_>, i: usize) -> Value {
    let point = &one.path.vertices()[i].point;
    json!({
        "event": text::event(scene, one, i),
        "material": trace::material(scene, point),
        "place": vector(trace::place(scene, point)),
        "is_direction": trace::is_direction(point),
        "normal": vector(point.normal.as_dvec3()),
    })
}

fn edge(one: &Contribution<'_>, i: usize) -> Value {
    json!({ "G": one.path.geometry_term(i), "V": one.path.visibility()[i] })
}

fn share(share: &Share) -> Value {
    json!({
        "technique": technique(share.technique),
        "p": share.pdf,
        "radius": share.radius.map(exact),
        "n": share.count,
        "v": share.variance_factor,
        "w": share.weight,
        "elsewhere": share.elsewhere.iter().map(|kind: &IntegratorKind| kind.name()).collect::<Vec<_>>(),
    })
}

/// `{"kind": "strategy", "s": 1, "t": 2}`.
fn technique(technique: Technique) -> Value {
    match technique {
        Technique::Bidirectional(x) => json!({ "kind": "strategy", "s": x.s, "t": x.t }),
        Technique::Merged(x) => json!({ "kind": "merge", "s": x.s, "t": x.t }),
        Technique::Area => json!({ "kind": "area" }),
    }
}

fn vector(v: DVec3) -> Value {
    json!(v.to_array())
}
