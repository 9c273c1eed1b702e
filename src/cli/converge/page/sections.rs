//! The sections of the page, and the pictures in them.

use std::io;

use base64::{Engine, engine::general_purpose::STANDARD};
use maud::{Markup, PreEscaped, html as markup};
use pathspace::{
    compare::Metric,
    converge::{Measured, PYRAMID_DEPTH, Part, Report, Snapshot, power_law},
    film::{Exposure, Image, encode_png},
    math::Rgb,
    verify::{self, Budget, Verdict},
};

use super::{
    Facts, RELMSE, TRIMMED,
    plot::{Axes, Curve, log_log},
    processor,
};

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

/// An image as the page shows it.
pub struct Shown<'a> {
    name: &'a str,
    label: String,
    /// A data URI, as `error`.
    image: String,
    /// `None` of the reference.
    error: Option<String>,
}

/// The images at the exposure `ev`, the reference last.
pub fn images<'a>(facts: &Facts<'_>, report: &'a Report, ev: f32) -> io::Result<Vec<Shown<'a>>> {
    let reference = &report.reference;
    let mut images = Vec::new();
    for one in &report.measured {
        let label = format!("{}, {} spp, relMSE {:.2e}", one.kind, one.end().passes, one.end().error(RELMSE));
        let error = uri(&false_colour(&one.image, &reference.image), 0.0)?;
        images.push(Shown { name: one.kind.name(), label, image: uri(&one.image, ev)?, error: Some(error) });
    }
    let label = format!("reference: {}", facts.reference(report));
    images.push(Shown { name: "reference", label, image: uri(&reference.image, ev)?, error: None });
    Ok(images)
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

/// What was measured, in a sentence.
pub fn summary(facts: &Facts<'_>, report: &Report) -> Markup {
    let reference = &report.reference;
    let budget = match facts.plan.budget {
        Budget::Time(time) => format!("{} s each, in turns", time.as_secs_f64()),
        Budget::Passes(passes) => format!("{passes} samples per pixel each, in turns"),
    };
    markup! {
        p.soft {
            (reference.image.width) " × " (reference.image.height) " pixels, paths of up to "
            (facts.plan.max_depth) " edges, " (budget)
            "; errors against " (facts.reference(report))
            @if report.ended_early { " (interrupted before)" }
            @match reference.noise {
                Some(n) => { ", whose own relMSE is " (format!("{n:.2e}")) " by its half images" }
                None => { ", whose own noise is unknown" }
            }
            "."
        }
    }
}

/// Two of the images, one over the other.
pub fn duel(images: &[Shown<'_>]) -> Markup {
    let last = images.len() - 1;
    markup! {
        div.tools {
            (chooser("a", images, 0)) (chooser("b", images, last))
            input id="slider" type="range" min="0" max="100" value="50" step="0.1" aria-label="where the images meet";
            button id="flip" { "Flip (f)" } button id="reset" { "Whole image" }
            span.soft { "wheel: zoom, drag: move, all images together" }
        }
        div."view duel" {
            img id="under" alt="right" src=(images[last].image);
            div.top id="cut" { img id="top" alt="left" src=(images[0].image); }
            div.bar id="bar" { }
        }
    }
}

fn chooser(id: &str, images: &[Shown<'_>], chosen: usize) -> Markup {
    markup! {
        select id=(id) aria-label="image" {
            @for (i, one) in images.iter().enumerate() { option value=(i) selected[i == chosen] { (one.name) } }
        }
    }
}

/// All images, and the errors of those that have one.
pub fn gallery(images: &[Shown<'_>]) -> Markup {
    markup! {
        div.grid {
            @for (i, Shown { label, image, .. }) in images.iter().enumerate() {
                figure {
                    div.view { img id={ "image-" (i) } alt=(label) src=(image); }
                    figcaption { (label) }
                }
            }
        }
        p.soft { "Relative error of each pixel: black 1 % or less, red 10 %, white 100 % or more." }
        div.grid {
            @for Shown { name, error, .. } in images {
                @if let Some(error) = error {
                    figure {
                        div.view { img alt={ "error of " (name) } src=(error); }
                        figcaption { "error of " (name) }
                    }
                }
            }
        }
    }
}

/// The errors as curves.
pub fn curves(report: &Report) -> io::Result<Markup> {
    let noise = report.reference.noise.map(f64::sqrt).filter(|noise| *noise > 0.0);
    let plots = plots(report, noise)?;
    Ok(markup! {
        p {
            @for (i, one) in report.measured.iter().enumerate() { (dot(i)) (one.kind) " \u{2003}" }
            span.soft {
                "thin: the power law that fits"
                @if noise.is_some() {
                    "; grey, where all pixels count: the reference's own noise, below which nothing can be told"
                }
            }
        }
        div."grid plots" { @for plot in &plots { figure { (PreEscaped(plot)) } } }
    })
}

/// What a snapshot took.
type Cost = fn(&Snapshot) -> f64;

/// An SVG element for each metric and what it is plotted against. `noise` is the reference's own.
fn plots(report: &Report, noise: Option<f64>) -> io::Result<Vec<String>> {
    let costs: [(&str, Cost); 2] = [("seconds", |s| s.seconds), ("samples per pixel", |s| f64::from(s.passes))];
    let mut plots = Vec::new();
    for (metric, y, level) in
        [(RELMSE, "root of relMSE", noise), (TRIMMED, "root of relMSE without the worst 0.1 %", None)]
    {
        for (x, of) in costs {
            let svg = log_log(&curves_of(report, of, metric), &Axes { x, y, level });
            plots.push(svg.map_err(|e| io::Error::other(e.to_string()))?);
        }
    }
    Ok(plots)
}

fn curves_of(report: &Report, x: Cost, metric: Metric) -> Vec<Curve> {
    let curve = |(i, one): (usize, &Measured)| {
        let points = one.snapshots.iter().map(|s| (x(s), s.root(metric)));
        let points: Vec<_> = points.filter(|p| p.0 > 0.0 && p.1 > 0.0).collect();
        Curve { colour: COLOURS[i % 8], law: power_law(points.iter().copied()), points }
    };
    report.measured.iter().enumerate().map(curve).collect()
}

fn dot(i: usize) -> Markup {
    let [r, g, b] = COLOURS[i % 8];
    markup! { span.dot style={ "background:rgb(" (r) "," (g) "," (b) ")" } { } }
}

/// How fast the integrators' errors go down, in numbers.
pub fn efficiencies(report: &Report) -> Markup {
    let of_first = |metric: Metric, one: &Measured| {
        let first = report.measured.first().and_then(|first| first.efficiency(metric));
        one.efficiency(metric).zip(first).map(|(own, first)| own / first)
    };
    let text = |x: Option<f64>, unit: &str| x.map_or("–".to_owned(), |x| format!("{x:.2}{unit}"));
    markup! {
        table.numbers {
            tr {
                th { } th { } th { }
                th colspan="4" { "all pixels" } th colspan="4" { "without the worst 0.1 %" }
                th { } th { }
            }
            tr { th { "integrator" } th { "spp" } th { "seconds" }
                @for _ in 0..2 { th { "relMSE" } th { "efficiency" } th { "of the first" } th { "slope" } }
                th { "FLIP" } th { "rays" } }
            @for (i, one) in report.measured.iter().enumerate() { tr {
                td { (dot(i)) (one.kind) } td { (one.end().passes) } td { (format!("{:.2}", one.end().seconds)) }
                @for metric in [RELMSE, TRIMMED] {
                    td { (format!("{:.2e}", one.end().error(metric))) } td { (text(one.efficiency(metric), "")) }
                    td { (text(of_first(metric, one), "×")) } td { (text(one.law(metric).map(|law| law.exponent), "")) }
                }
                td { (format!("{:.4}", one.end().error(Metric::Flip))) }
                td { (format!("{:.1} M", one.rays as f64 * 1e-6)) }
            } }
        }
        p.soft { "Efficiency is 1/(relMSE × seconds). The slope is that of the root of relMSE against samples: −0.5 is \
            what independent samples make. A flatter one means light that the integrator cannot see, fireflies, or a \
            reference as noisy as the image." }
    }
}

/// A row for each class of paths, a column for each pair of integrators.
pub fn agreements(report: &verify::Report) -> Markup {
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
                        (format!("{:+.2} %", 100.0 * row.difference)) br;
                        small {
                            (row.verdict.name().to_lowercase()) ", p " (format!("{:.2}", row.p)) br;
                            "visible: " (format!("{:.2} %", 100.0 * row.visible))
                        }
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

/// What each class of paths adds to the image.
pub fn classes(report: &Report, ev: f32) -> io::Result<Markup> {
    let bar = |part: &Part| format!("{:.1}", 4.0 * 100.0 * part.share);
    Ok(markup! {
        table {
            @for part in &report.classes {
                tr {
                    td { (part.name) }
                    td { (format!("{:.2} %", 100.0 * part.share)) }
                    td style="text-align:left" { span.meter style={ "width:" (bar(part)) "px" } { } }
                }
            }
        }
        div.grid {
            @for part in &report.classes {
                figure { div.view { img alt=(part.name) src=(uri(&part.image, ev)?); } figcaption { (part.name) } }
            }
        }
    })
}

/// What each strategy adds to the image, a row for each length.
pub fn pyramid(report: &Report, ev: f32) -> io::Result<Markup> {
    let row = |edges: u32| {
        report.pyramid.iter().filter(move |part| {
            let (s, t) = strategy(&part.name);
            s + t == edges + 1
        })
    };
    Ok(markup! {
        p.soft { "w C of each strategy (s,t) of bdpt: s vertices from a light, t from the camera; a row for \
            each path length, from two edges on a stop brighter than the one above. Each row adds up to the \
            light of its length." }
        @for edges in 1..=PYRAMID_DEPTH {
            div.row {
                @for part in row(edges) {
                    figure {
                        div.view { img alt=(part.name) src=(uri(&part.image, ev + edges as f32 - 2.0)?); }
                        figcaption { (part.name) ", " (format!("{:.1} %", 100.0 * part.share)) }
                    }
                }
            }
        }
    })
}

/// s and t, of a strategy's name.
fn strategy(name: &str) -> (u32, u32) {
    let mut numbers = name.split(|c: char| !c.is_ascii_digit()).filter_map(|n| n.parse().ok());
    (numbers.next().unwrap_or(0), numbers.next().unwrap_or(0))
}

/// What it takes to make the page again.
pub fn provenance(facts: &Facts<'_>, report: &Report, ev: f32) -> Markup {
    let Image { width, height, .. } = report.reference.image;
    let (version, system) = (env!("CARGO_PKG_VERSION"), std::env::consts::OS);
    let processor = processor();
    let processor = processor.as_deref().unwrap_or(std::env::consts::ARCH);
    markup! {
        table.facts {
            (fact("command", &facts.command))
            (fact("scene", &facts.scene)) (fact("its hash", &facts.scene_hash))
            (fact("environment", facts.environment.as_deref().unwrap_or("the file's, or none")))
            (fact("next-event estimation", &format!("lights: {}", facts.lights)))
            (fact("image", &format!("{width} × {height} pixels, exposure {ev:+.2} EV everywhere")))
            (fact("random numbers", &format!("seed {}", facts.plan.seed)))
            (fact("processor", &format!("{processor}, {} threads", facts.threads)))
            (fact("program", &format!("pathspace {version} on {system}")))
        }
    }
}

fn fact(name: &str, what: &str) -> Markup {
    markup! { tr { td { (name) } td { (what) } } }
}
