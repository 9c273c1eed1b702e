//! The page of `pathspace converge`, and its numbers: one file that loads nothing.

mod plot;
mod sections;

use std::{fmt::Write, io, path::Path};

use maud::{DOCTYPE, PreEscaped, html as markup};
use pathspace::{
    compare::Metric,
    converge::{Measured, Own, Part, Plan, Report},
    film::Exposure,
    scene::light::LightChoice,
    verify::{self, Budget, Outcome},
};
use serde_json::{Value, json as value};

/// Raised when a key of the JSON changes or goes.
const LAYOUT: u32 = 1;
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

/// The page.
pub fn html(facts: &Facts<'_>, report: &Report, json: &Value) -> io::Result<String> {
    let ev = Exposure::Auto.ev(&report.reference.image);
    let images = sections::images(facts, report, ev)?;
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
                (sections::summary(facts, report))
                h2 { "Side by side" }
                (sections::duel(&images))
                h2 { "Images and their errors" }
                (sections::gallery(&images))
                h2 { "Error against time and samples" }
                (sections::curves(report)?)
                h2 { "Efficiency" }
                (sections::efficiencies(report))
                @if let Some(agreement) = &report.agreement {
                    h2 { "Do they agree? " (outcome(agreement.outcome)) }
                    (sections::agreements(agreement))
                }
                h2 { "What the light does" }
                (sections::classes(report, ev)?)
                h2 { "Technique pyramid" }
                (sections::pyramid(report, ev)?)
                h2 { "How it was made" }
                (sections::provenance(facts, report, ev))
                p.soft { "All numbers are in this page and in the files beside it." }
                script id="data" type="application/json" { (PreEscaped(inert(json))) }
                script { (PreEscaped(include_str!("page.js"))) }
            }
        }
    };
    Ok(page.into_string())
}

/// The text of a script element: only '<' could end it.
fn inert(json: &Value) -> String {
    json.to_string().replace('<', "\\u003c")
}
