//! The page of `pathspace converge`, and its numbers: one file that loads nothing.

mod plot;

use std::{fmt::Write, io, path::Path};

use base64::{Engine, engine::general_purpose::STANDARD};
use maud::{DOCTYPE, Markup, PreEscaped, html as markup};
use pathspace::{
    compare::Metric,
    converge::{Measured, Own, Part, Plan, Report, Snapshot, power_law},
    film::{Exposure, Image, encode_png},
    math::Rgb,
    scene::light::LightChoice,
    verify::{self, Budget, Outcome, Verdict},
};
use serde_json::{Value, json as value};

use self::plot::{Axes, Curve, log_log};

/// Raised when a key of the JSON changes or goes.
const LAYOUT: u32 = 1;
/// Told apart by most eyes (Observable's categorical scheme).
const COLOURS: [[u8; 3]; 8] = [
    [66, 105, 208],
    [239, 177, 24],
    [255, 114, 92],
    [108, 197, 176],
    [60, 169, 81],
    [255, 138, 183],
    [164, 99, 242],
    [151, 187, 245],
];

/// What is no result.
pub struct Facts<'a> {
    pub title: String,
    /// As a shell reads it.
    pub command: String,
    /// How much is in it, in words.
    pub scene: String,
    pub scene_hash: String,
    pub environment: Option<String>,
    pub lights: LightChoice,
    pub threads: usize,
    pub plan: &'a Plan,
    pub given: Option<&'a Path>,
}

impl Facts<'_> {
    fn reference(&self, report: &Report) -> String {
        match (report.reference.own, self.given) {
            (Some(Own { passes, seconds }), _) => format!("a bdpt run of its own, {passes} spp in {seconds:.1} s"),
            (None, path) => format!("the image {}", path.unwrap_or("given".as_ref()).display()),
        }
    }
}

/// Everything plotted.
pub fn json(facts: &Facts<'_>, report: &Report) -> Value {
    let snapshot = |one: &Measured| -> Vec<Value> {
        let each = one.snapshots.iter().map(|s| {
            let mut object = value!({ "spp": s.passes, "seconds": s.seconds });
            for (metric, error) in Metric::ALL.iter().zip(s.errors) {
                object[metric.name()] = value!(error);
            }
            object
        });
        each.collect()
    };
    let integrators = report.measured.iter().map(|one| {
        value!({
            "name": one.kind.name(),
                "slope": one.law(RELMSE).map(|law| law.exponent),
                "efficiency": one.efficiency(RELMSE),
            "slope-trimmed": one.law(TRIMMED).map(|law| law.exponent), "efficiency-trimmed": one.efficiency(TRIMMED),
            "rays": one.rays, "rejected": one.rejected, "snapshots": snapshot(one),
        })
    });
    let parts = |parts: &[Part]| -> Vec<Value> {
        parts.iter().map(|part| value!({ "name": part.name, "share": part.share })).collect()
    };
    let agreement = report.agreement.as_ref().map(|agreement| {
        let name = |i: usize| agreement.integrators[i].kind.name();
        let row = |row: &verify::Row| {
            value!({
                "pair": [name(row.pair.0), name(row.pair.1)], "paths": row.scope.name(), "p": row.p,
                "difference": row.difference, "visible": row.visible, "verdict": row.verdict.name().to_lowercase(),
            })
        };
        let rows: Vec<_> = agreement.rows.iter().map(row).collect();
        value!({ "outcome": outcome(agreement.outcome), "comparisons": rows })
    });
    let (seconds, spp) = match facts.plan.budget {
        Budget::Time(time) => (Some(time.as_secs_f64()), None),
        Budget::Passes(passes) => (None, Some(passes)),
    };
    value!({
        "layout": LAYOUT, "version": env!("CARGO_PKG_VERSION"), "command": facts.command, "scene": facts.scene_hash,
        "width": report.reference.image.width, "height": report.reference.image.height, "seconds": seconds, "spp": spp,
        "max_depth": facts.plan.max_depth, "seed": facts.plan.seed, "threads": facts.threads,
        "environment": facts.environment, "lights": facts.lights.name(), "processor": processor(),
        "ended_early": report.ended_early,
        "reference": {
            "what": facts.reference(report),
            "seconds": report.reference.own.map(|own| own.seconds),
            "relmse": report.reference.noise,
        },
        "integrators": integrators.collect::<Vec<_>>(), "classes": parts(&report.classes),
        "strategies": parts(&report.pyramid), "agreement": agreement,
    })
}

const RELMSE: Metric = Metric::RelMse;
const TRIMMED: Metric = Metric::RelMseTrimmed;

/// The name of the processor, where the system tells.
fn processor() -> Option<String> {
    let all = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = all.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

/// The curves, a line for each snapshot.
pub fn csv(report: &Report) -> String {
    let names = Metric::ALL.map(Metric::name).join(",");
    let mut text = format!("integrator,spp,seconds,{names}\n");
    for one in &report.measured {
        for s in &one.snapshots {
            let errors = s.errors.map(|error| error.to_string()).join(",");
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{},{},{},{errors}", one.kind.name(), s.passes, s.seconds);
        }
    }
    text
}

fn outcome(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Agree => "agree",
        Outcome::Disagree => "disagree",
        Outcome::Undecided => "undecided",
    }
}

fn uri(image: &Image, ev: f32) -> io::Result<String> {
    Ok(format!("data:image/png;base64,{}", STANDARD.encode(encode_png(image, None, Exposure::Ev(ev))?)))
}

/// The relative error of each pixel, black at 1 % or less over red to yellow-white at 100 % or more, in logarithms.
fn false_colour(image: &Image, reference: &Image) -> Image {
    let colour = |(i, r): (&Rgb, &Rgb)| {
        let relative = (*i - *r) * (*i - *r) / (*r * *r + Rgb::splat(0.01));
        let x = (1.0 + relative.element_sum().max(3e-4).log10() / 4.0 - 3.0_f32.log10() / 4.0).clamp(0.0, 1.0);
        Rgb::new((2.0 * x).min(1.0), (2.0 * x - 0.7).clamp(0.0, 1.0), (4.0 * x - 3.0).clamp(0.0, 1.0))
    };
    Image { pixels: image.pixels.iter().zip(&reference.pixels).map(colour).collect(), ..*image }
}

/// s and t, of a strategy's name.
fn strategy(name: &str) -> (u32, u32) {
    let mut numbers = name.split(|c: char| !c.is_ascii_digit()).filter_map(|n| n.parse().ok());
    (numbers.next().unwrap_or(0), numbers.next().unwrap_or(0))
}

/// The page.
pub fn html(facts: &Facts<'_>, report: &Report, json: &Value) -> io::Result<String> {
    let reference = &report.reference;
    let ev = Exposure::Auto.ev(&reference.image);
    let mut images = Vec::new();
    for one in &report.measured {
        let label = format!("{}, {} spp, relMSE {:.2e}", one.kind, one.end().passes, one.end().error(RELMSE));
        let error = uri(&false_colour(&one.image, &reference.image), 0.0)?;
        images.push((one.kind.name(), label, uri(&one.image, ev)?, Some(error)));
    }
    images.push(("reference", format!("reference: {}", facts.reference(report)), uri(&reference.image, ev)?, None));
    let noise = reference.noise.map(f64::sqrt).filter(|noise| *noise > 0.0);
    let curves = |x: fn(&Snapshot) -> f64, metric: Metric| -> Vec<Curve> {
        let points = |one: &Measured| {
            one.snapshots.iter().map(|s| (x(s), s.root(metric))).filter(|p| p.0 > 0.0 && p.1 > 0.0).collect()
        };
        let curve = |(i, one): (usize, &Measured)| {
            let points: Vec<_> = points(one);
            Curve { colour: COLOURS[i % 8], law: power_law(points.iter().copied()), points }
        };
        report.measured.iter().enumerate().map(curve).collect()
    };
    let mut plots = Vec::new();
    for (metric, y, level) in
        [(RELMSE, "root of relMSE", noise), (TRIMMED, "root of relMSE without the worst 0.1 %", None)]
    {
        for (x, of) in
            [("seconds", (|s| s.seconds) as fn(&Snapshot) -> f64), ("samples per pixel", |s| f64::from(s.passes))]
        {
            plots.push(
                log_log(&curves(of, metric), &Axes { x, y, level }).map_err(|e| io::Error::other(e.to_string()))?,
            );
        }
    }
    // In a script element only '<' could end it.
    let data = json.to_string().replace('<', "\\u003c");
    let budget = match facts.plan.budget {
        Budget::Time(time) => format!("{} s each, in turns", time.as_secs_f64()),
        Budget::Passes(passes) => format!("{passes} samples per pixel each, in turns"),
    };
    let page = markup! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8"; meta name="viewport" content="width=device-width";
                title { (facts.title) " – convergence" }
                link rel="icon" href="data:,";
                style { (PreEscaped(include_str!("page.css"))) }
            }
            body {
                h1 { (facts.title) }
                p.soft { (reference.image.width) " × " (reference.image.height) " pixels, paths of up to " (facts.plan.max_depth) " edges, " (budget)
                    "; errors against " (facts.reference(report))
                    @if report.ended_early { " (interrupted before)" }
                    @match reference.noise { Some(n) => { ", whose own relMSE is " (format!("{n:.2e}")) " by its half images" } None => { ", whose own noise is unknown" } } "." }
                h2 { "Side by side" }
                div.tools {
                    (chooser("a", &images, 0)) (chooser("b", &images, images.len() - 1))
                    input id="slider" type="range" min="0" max="100" value="50" step="0.1" aria-label="where the images meet";
                    button id="flip" { "Flip (f)" } button id="reset" { "Whole image" }
                    span.soft { "wheel: zoom, drag: move, all images together" }
                }
                div."view duel" { img id="under" alt="right" src=(images[images.len() - 1].2); div.top id="cut" { img id="top" alt="left" src=(images[0].2); } div.bar id="bar" { } }
                h2 { "Images and their errors" }
                div.grid { @for (i, (_, label, image, _)) in images.iter().enumerate() {
                    figure { div.view { img id={ "image-" (i) } alt=(label) src=(image); } figcaption { (label) } }
                } }
                p.soft { "Relative error of each pixel: black 1 % or less, red 10 %, white 100 % or more." }
                div.grid { @for (name, _, _, error) in &images { @if let Some(error) = error {
                    figure { div.view { img alt={ "error of " (name) } src=(error); } figcaption { "error of " (name) } }
                } } }
                h2 { "Error against time and samples" }
                p { @for (i, one) in report.measured.iter().enumerate() { (dot(i)) (one.kind) " \u{2003}" }
                    span.soft { "thin: the power law that fits" @if noise.is_some() { "; grey, where all pixels count: the reference's own noise, below which nothing can be told" } } }
                div."grid plots" { @for plot in &plots { figure { (PreEscaped(plot)) } } }
                h2 { "Efficiency" }
                (efficiencies(report))
                @if let Some(agreement) = &report.agreement {
                    h2 { "Do they agree? " (outcome(agreement.outcome)) }
                    (agreements(agreement))
                }
                h2 { "What the light does" }
                table { @for part in &report.classes { tr { td { (part.name) } td { (format!("{:.2} %", 100.0 * part.share)) } td style="text-align:left" { span.meter style={ "width:" (format!("{:.1}", 4.0 * 100.0 * part.share)) "px" } { } } } } }
                div.grid { @for part in &report.classes { figure { div.view { img alt=(part.name) src=(uri(&part.image, ev)?); } figcaption { (part.name) } } } }
                h2 { "Technique pyramid" }
                p.soft { "w C of each strategy (s,t) of bdpt: s vertices from a light, t from the camera; a row for \
                    each path length, from two edges on a stop brighter than the one above. Each row adds up to the \
                    light of its length." }
                @for edges in 1..=pathspace::converge::PYRAMID_DEPTH { div.row {
                    @for part in report.pyramid.iter().filter(|p| { let (s, t) = strategy(&p.name); s + t == edges + 1 }) {
                        figure { div.view { img alt=(part.name) src=(uri(&part.image, ev + edges as f32 - 2.0)?); } figcaption { (part.name) ", " (format!("{:.1} %", 100.0 * part.share)) } }
                    }
                } }
                h2 { "How it was made" }
                table.facts {
                    (fact("command", &facts.command))
                    (fact("scene", &facts.scene)) (fact("its hash", &facts.scene_hash))
                    (fact("environment", facts.environment.as_deref().unwrap_or("the file's, or none")))
                    (fact("next-event estimation", &format!("lights: {}", facts.lights)))
                    (fact("image", &format!("{} × {} pixels, exposure {ev:+.2} EV everywhere", reference.image.width, reference.image.height)))
                    (fact("random numbers", &format!("seed {}", facts.plan.seed)))
                    (fact("processor", &format!("{}, {} threads", processor().as_deref().unwrap_or(std::env::consts::ARCH), facts.threads)))
                    (fact("program", &format!("pathspace {} on {}", env!("CARGO_PKG_VERSION"), std::env::consts::OS)))
                }
                p.soft { "All numbers are in this page and in the files beside it." }
                script id="data" type="application/json" { (PreEscaped(data)) }
                script { (PreEscaped(include_str!("page.js"))) }
            }
        }
    };
    Ok(page.into_string())
}

/// A row for each class of paths, a column for each pair of integrators.
fn agreements(report: &verify::Report) -> Markup {
    let mut pairs: Vec<_> = report.rows.iter().map(|row| row.pair).collect();
    pairs.sort_unstable();
    pairs.dedup();
    let mut scopes: Vec<&str> = Vec::new();
    for row in &report.rows {
        if !scopes.contains(&row.scope.name()) {
            scopes.push(row.scope.name());
        }
    }
    let name = |i: usize| report.integrators[i].kind.name();
    let cell = |scope: &str, pair| report.rows.iter().find(|row| row.pair == pair && row.scope.name() == scope);
    let class = |verdict: Verdict| match verdict {
        Verdict::Disagree => "differs",
        verdict if verdict.is_open() => "open",
        Verdict::Agree => "agrees",
        _ => "faint",
    };
    markup! {
        table.agreement {
            tr { th { "paths" } @for pair in &pairs { th { (name(pair.0)) " – " (name(pair.1)) } } }
            @for scope in scopes { tr { td { (scope) } @for pair in &pairs {
                @match cell(scope, *pair) {
                    Some(row) => td class=(class(row.verdict)) {
                        (format!("{:+.2} %", 100.0 * row.difference)) br; small { (row.verdict.name().to_lowercase()) ", p " (format!("{:.2}", row.p)) br; "visible: " (format!("{:.2} %", 100.0 * row.visible)) }
                    }
                    None => td.soft { "–" },
                }
            } } }
        }
        p.soft { "First minus second of a pair, as a part of the image, over the paths that both cover; below, the \
            verdict, the probability of such a difference by chance, and the bias that would have been seen. 'Too \
            noisy' could hide one of 2 %; a 'faint' class is too small a part of the image to matter." }
    }
}

fn fact(name: &str, what: &str) -> Markup {
    markup! { tr { td { (name) } td { (what) } } }
}

fn dot(i: usize) -> Markup {
    let [r, g, b] = COLOURS[i % 8];
    markup! { span.dot style={ "background:rgb(" (r) "," (g) "," (b) ")" } { } }
}

fn chooser(id: &str, images: &[(&str, String, String, Option<String>)], chosen: usize) -> Markup {
    markup! { select id=(id) aria-label="image" { @for (i, (name, ..)) in images.iter().enumerate() { option value=(i) selected[i == chosen] { (name) } } } }
}

fn efficiencies(report: &Report) -> Markup {
    let of_first = |metric: Metric, one: &Measured| {
        let first = report.measured.first().and_then(|first| first.efficiency(metric));
        one.efficiency(metric).zip(first).map(|(own, first)| own / first)
    };
    let text = |x: Option<f64>, unit: &str| x.map_or("–".to_owned(), |x| format!("{x:.2}{unit}"));
    markup! {
        table.numbers {
            tr { th { } th { } th { } th colspan="4" { "all pixels" } th colspan="4" { "without the worst 0.1 %" } th { } th { } }
            tr { th { "integrator" } th { "spp" } th { "seconds" }
                @for _ in 0..2 { th { "relMSE" } th { "efficiency" } th { "of the first" } th { "slope" } }
                th { "FLIP" } th { "rays" } }
            @for (i, one) in report.measured.iter().enumerate() { tr {
                td { (dot(i)) (one.kind) } td { (one.end().passes) } td { (format!("{:.2}", one.end().seconds)) }
                @for metric in [RELMSE, TRIMMED] {
                    td { (format!("{:.2e}", one.end().error(metric))) } td { (text(one.efficiency(metric), "")) }
                    td { (text(of_first(metric, one), "×")) } td { (text(one.law(metric).map(|law| law.exponent), "")) }
                }
                td { (format!("{:.4}", one.end().error(Metric::Flip))) } td { (format!("{:.1} M", one.rays as f64 * 1e-6)) }
            } }
        }
        p.soft { "Efficiency is 1/(relMSE × seconds). The slope is that of the root of relMSE against samples: −0.5 is \
            what independent samples make. A flatter one means light that the integrator cannot see, fireflies, or a \
            reference as noisy as the image." }
    }
}
