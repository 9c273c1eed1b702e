//! What `pathspace trace` says to a person.

use std::fmt::Write;

use glam::DVec3;
use pathspace::{
    integrator::IntegratorKind,
    layers::kind_of_light,
    math::{Rgb, luminance},
    path::Technique,
    scene::{Scene, bsdf::ScatterEvent, point::Point},
    trace::{Contribution, Passage, Share, Trace},
};

use crate::cli::{shared::number::brief, trace::Job};

/// A weight by which the fast form may be off for the rounding of f32.
const ROUNDING: f64 = 1e-3;
/// A technique that is better by less is no better.
const BETTER: f64 = 1.5;

/// The pixel, and each of its largest contributions. Writing to a string cannot fail.
pub fn describe(job: &Job<'_>, scene: &Scene, trace: &Trace<'_>) -> String {
    let ([x, y], candidate) = (job.args.pixel, job.candidate);
    let mut text = String::new();
    let _ = writeln!(
        text,
        "pixel {x},{y} of {}×{}, -i {candidate}, {} spp: {}",
        job.sensor.width,
        job.sensor.height,
        trace.passes,
        rgb(trace.value.as_dvec3())
    );
    let all = luminance(Rgb::from(trace.sum));
    let part = |value: Rgb| if all > 0.0 { 100.0 * f64::from(luminance(value) / all) } else { 0.0 };
    let largest: f64 = trace.largest.iter().map(|one| part(one.value)).sum();
    let _ = writeln!(
        text,
        "{}",
        match (trace.contributions, trace.largest.len()) {
            (0, _) => "no path has reached it".to_owned(),
            (1, _) => "one contribution".to_owned(),
            (count, 1) => format!("{count} contributions; the largest makes up {largest:.1} % of its luminance"),
            (count, len) => format!("{count} contributions; the {len} largest make up {largest:.1} % of its luminance"),
        }
    );
    for (i, one) in trace.largest.iter().enumerate() {
        let _ = writeln!(text, "\n{}. {:.1} %: {}", i + 1, part(one.value), found(one, trace));
        let _ = write!(text, "{}", columns(&vertices(scene, one)));
        let (t, f) = (rgb(one.path.throughput()), rgb(one.path.contribution()));
        let wavelength = one.path.wavelength().map(|x| format!("; λ = {} nm", brief(x.nanometres())));
        let _ = writeln!(text, "   T = {t}; F = {f}{}", wavelength.unwrap_or_default());
        let _ = write!(text, "{}", columns(&techniques(one)));
        for sentence in unable(one).into_iter().chain(sentences(one, candidate.integrator)) {
            let _ = writeln!(text, "   {sentence}");
        }
    }
    text
}

/// What was found, by what and where.
fn found(one: &Contribution<'_>, trace: &Trace<'_>) -> String {
    let (class, edges) = (one.path.class(), one.path.edges());
    let adds = rgb(one.value.as_dvec3() / f64::from(trace.passes));
    let place = one.raster.0;
    format!(
        "{class}, {edges} edge{}, found by {} in sample {} at {:.2},{:.2}, adds {adds}",
        if edges == 1 { "" } else { "s" },
        one.technique,
        one.pass,
        place.x,
        place.y
    )
}

/// The path, a vertex a line; G and V are those of the edge to the next one.
fn vertices(scene: &Scene, one: &Contribution<'_>) -> Vec<Vec<String>> {
    let n = one.path.edges();
    let head = ["", "event", "material", "place", "G to next", "V"].map(str::to_owned);
    let vertex = |i: usize| {
        let point = &one.path.vertices()[i].point;
        let (g, v) = if i < n {
            (brief(one.path.geometry_term(i)), brief(one.path.visibility()[i]))
        } else {
            (String::new(), String::new())
        };
        vec![format!("p{i}"), event(scene, one, i), material(scene, point), place(scene, point), g, v]
    };
    let mut rows = vec![head.to_vec()];
    rows.extend((0..=n).map(vertex));
    if let Some((i, q)) = one.path.merged() {
        let beside = vec!["q".to_owned(), format!("merged with p{i}"), material(scene, q), place(scene, q)];
        rows.insert(i + 2, beside);
    }
    rows
}

/// What happens at p_i.
pub fn event(scene: &Scene, one: &Contribution<'_>, i: usize) -> String {
    match i {
        0 => "camera".to_owned(),
        _ if i == one.path.edges() => light(scene, &one.path.vertices()[i].point),
        _ => passage(one.events[i - 1]).to_owned(),
    }
}

fn light(scene: &Scene, point: &Point) -> String {
    let kind = point.light.map_or("surface", |id| kind_of_light(scene.lights().get(id)));
    format!("light ({kind})")
}

fn passage(Passage { event, transmits }: Passage) -> &'static str {
    match (event, transmits) {
        (ScatterEvent::Diffuse, false) => "diffuse reflection",
        (ScatterEvent::Diffuse, true) => "diffuse transmission",
        (ScatterEvent::Glossy, false) => "glossy reflection",
        (ScatterEvent::Glossy, true) => "glossy transmission",
        (ScatterEvent::Specular, false) => "specular reflection",
        (ScatterEvent::Specular, true) => "specular transmission",
    }
}

/// The name of a surface's material.
fn material(scene: &Scene, point: &Point) -> String {
    super::material(scene, point).map(|name| format!("'{}'", name.escape_debug())).unwrap_or_default()
}

/// A place, or the direction of one at infinity.
fn place(scene: &Scene, point: &Point) -> String {
    let [x, y, z] = super::place(scene, point).to_array().map(brief);
    let towards = if super::is_direction(point) { "towards " } else { "" };
    format!("{towards}[{x}, {y}, {z}]")
}

/// The densities and weights of all techniques that can find the path, one a line.
fn techniques(one: &Contribution<'_>) -> Vec<Vec<String>> {
    let head = ["technique", "p", "n", "n p", "w"].map(str::to_owned);
    let row = |share: &Share| {
        let Share { technique, pdf, count, variance_factor, weight, .. } = share;
        let mark = if *technique == one.technique { " <" } else { "" };
        let [n, expected, w] = if *count > 0.0 {
            [brief(*count), brief(share.expected()), format!("{weight:.4}{mark}")]
        } else {
            ["-"; 3].map(str::to_owned)
        };
        let expected =
            if *variance_factor == 1.0 { expected } else { format!("{expected} (v = {})", brief(*variance_factor)) };
        let within = share.radius.map(|r| format!(" within {} m", brief(r))).unwrap_or_default();
        vec![format!("{technique}{within}"), brief(*pdf), n, expected, w]
    };
    let mut rows = vec![head.to_vec()];
    rows.extend(one.shares.iter().filter(|share| share.pdf > 0.0).map(row));
    rows
}

/// The others in one line.
fn unable(one: &Contribution<'_>) -> Option<String> {
    let is_merge = |share: &&&Share| matches!(share.technique, Technique::Merged(_));
    let unable: Vec<_> = one.shares.iter().filter(|share| share.pdf == 0.0).collect();
    let merges = unable.iter().filter(is_merge).count();
    let count = |n: usize, one: &str, many: &str| match n {
        0 => None,
        1 => Some(format!("1 {one}")),
        n => Some(format!("{n} {many}")),
    };
    let parts = [count(unable.len() - merges, "strategy", "strategies"), count(merges, "merge", "merges")];
    let parts: Vec<_> = parts.into_iter().flatten().collect();
    (!parts.is_empty()).then(|| format!("{} cannot find it: p = 0", parts.join(" and ")))
}

/// What the numbers mean.
fn sentences(one: &Contribution<'_>, kind: IntegratorKind) -> Vec<String> {
    let mut sentences = vec![verdict(one, kind)];
    let survival = f64::from(one.survival);
    if survival < 1.0 {
        sentences.push(format!(
            "roulette ends all but {} % of such walks, and these count for all",
            brief(100.0 * survival)
        ));
    }
    let rest = one.excess() * survival;
    if (rest - 1.0).abs() > 0.01 {
        sentences.push(format!(
            "counts {} times, for a clamp, for roulette on connections, or for other light vertices",
            brief(rest)
        ));
    }
    if (one.filter - 1.0).abs() > 1e-6 {
        sentences.push(format!("h = {}: the filter's value for this pixel at that place", brief(one.filter)));
    }
    let (fast, weight) = (f64::from(one.fast_weight), one.own().weight);
    if (fast - weight).abs() > ROUNDING {
        sentences.push(format!("the renderer has weighed it by {fast:.4}, and its definition by {weight:.4}"));
    }
    sentences
}

/// Which technique would have been the best: of the strategies, which are unbiased, and of all.
fn verdict(one: &Contribution<'_>, kind: IntegratorKind) -> String {
    let own = one.own();
    let is_merge = |share: &&Share| matches!(share.technique, Technique::Merged(_));
    let best = |all: &mut dyn Iterator<Item = &Share>, than: f64| {
        let better = |a: &Share, b: &Share| a.expected_anywhere().total_cmp(&b.expected_anywhere());
        all.max_by(|a, b| better(a, b)).filter(|share| share.expected_anywhere() > BETTER * than).cloned()
    };
    let strategy = best(&mut one.shares.iter().filter(|share| !is_merge(share)), own.expected());
    let than = strategy.as_ref().map_or(own.expected(), Share::expected_anywhere);
    let merge = best(&mut one.shares.iter().filter(is_merge), than);
    let all: Vec<_> = strategy.iter().chain(&merge).map(|share| praise(share, own, kind)).collect();
    let found = one.technique;
    if all.is_empty() {
        return format!("{found} found it, and nothing finds such paths more often: more samples help");
    }
    format!("{found} found it; {}", all.join("; "))
}

/// How much better one technique is than another.
fn praise(better: &Share, own: &Share, kind: IntegratorKind) -> String {
    let times = brief(better.expected_anywhere() / own.expected());
    let others: Vec<_> = better.elsewhere.iter().map(|other| other.name()).collect();
    let who = if others.is_empty() {
        String::new()
    } else {
        format!(", but is not in -i {kind} (choose -i {})", others.join(", "))
    };
    format!("{} finds such paths {times} times as often{who}", better.technique)
}

/// Columns as wide as what is in them: the first two to the left of theirs, numbers to the right.
fn columns(rows: &[Vec<String>]) -> String {
    let count = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max();
    let widths: Vec<_> = (0..count).map(|column| width(column).unwrap_or(0)).collect();
    let line = |row: &Vec<String>| {
        let cells = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:<width$}"));
        format!("   {}\n", cells.collect::<Vec<_>>().join("  ").trim_end())
    };
    rows.iter().map(line).collect()
}

fn rgb(v: DVec3) -> String {
    v.to_array().map(brief).join(" ")
}
