//! `pathspace verify --json`, and the file `verify.json`.

use pathspace::{
    path::Roulette,
    verify::{Budget, ClassShare, Contestant, FAMILY, Outcome, Report, Row},
};
use serde_json::{Value, json};

use crate::cli::{
    verify,
    verify::{Job, pictures, text},
};

/// The file's name in the folder.
pub const FILE: &str = "verify.json";
/// The version of the layout: it grows when a member changes its meaning or goes away, not when one is added.
const LAYOUT: u32 = 1;

/// Everything that was found. Biases, shares and differences are fractions of the image's mean, times are in seconds.
pub fn describe(job: &Job, report: &Report) -> Value {
    let Job { plan, sensor, scene_hash, environment, lights } = job;
    let (seconds, spp) = match plan.budget {
        Budget::Time(time) => (Some(time.as_secs_f64()), None),
        Budget::Passes(passes) => (None, Some(passes)),
    };
    let (roulette, rule) = match plan.roulette {
        Roulette::Off => (None, None),
        Roulette::FromDepth(depth) => (Some(depth), Some("reflectance")),
        Roulette::ByThroughput(depth) => (Some(depth), Some("throughput")),
    };
    let files: Vec<_> = pictures::names(report).into_iter().chain([FILE.to_owned()]).collect();
    json!({
        "layout": LAYOUT,
        "version": env!("CARGO_PKG_VERSION"),
        "outcome": match report.outcome {
            Outcome::Agree => "agree",
            Outcome::Disagree => "disagree",
            Outcome::Undecided => "undecided",
        },
        "exit": verify::exit(report) as u8,
        "summary": text::summary(job, report),
        "scene": scene_hash,
        "environment": environment,
        "lights": lights.name(),
        "width": sensor.width,
        "height": sensor.height,
        "max_depth": plan.max_depth,
        "roulette": roulette,
        "roulette_rule": rule,
        "seed": plan.seed,
        "seconds": seconds,
        "spp": spp,
        "bias": plan.bar,
        "significance": FAMILY,
        "visible": report.visible(),
        "mean": report.mean,
        "lights": report.lights,
        "retested": report.retested,
        "needed": needed(job, report),
        "integrators": report.integrators.iter().map(integrator).collect::<Vec<_>>(),
        "classes": report.classes.iter().map(|class| share(report, class)).collect::<Vec<_>>(),
        "comparisons": report.rows.iter().map(|row| comparison(report, row)).collect::<Vec<_>>(),
        "files": files,
    })
}

/// What a run of sufficient length would take, if this one was too short; nobody waits for what is beyond
/// [`text::needed`].
fn needed(job: &Job, report: &Report) -> Option<Value> {
    let longer = report.longer.filter(|_| text::needed(job, report).flatten().is_some())?;
    Some(match job.plan.budget {
        Budget::Time(time) => json!({ "seconds": time.as_secs_f64() * longer }),
        Budget::Passes(passes) => json!({ "spp": (f64::from(passes) * longer).ceil() }),
    })
}

fn integrator(one: &Contestant) -> Value {
    let classes = one.uncovered_classes.iter().map(|(class, part)| json!({ "class": class.name(), "share": part }));
    json!({
        "name": one.kind.name(),
        "spp": one.passes,
        "seconds": one.elapsed.as_secs_f64(),
        "uncovered": one.uncovered,
        "uncovered_classes": classes.collect::<Vec<_>>(),
        "rejected": one.rejected,
    })
}

fn share(report: &Report, class: &ClassShare) -> Value {
    let covered = report.integrators.iter().filter(|one| {
        one.uncovered_classes.iter().all(|(missing, part)| *missing != class.class || *part < class.share)
    });
    json!({
        "name": class.class.name(),
        "letters": class.class.letters(),
        "share": class.share,
        "covered_by": covered.map(|one| one.kind.name()).collect::<Vec<_>>(),
        "covered_by_one_alone": class.alone,
    })
}

fn comparison(report: &Report, row: &Row) -> Value {
    let name = |i: usize| report.integrators[i].kind.name();
    json!({
        "pair": [name(row.pair.0), name(row.pair.1)],
        "paths": row.scope.name(),
        "p": row.p,
        "share": row.share,
        "difference": row.difference,
        "visible": row.visible,
        "visible_of_class": row.visible_of_scope,
        "verdict": row.verdict.name().to_lowercase(),
    })
}
