//! What `pathspace verify` says to a person.

use std::{fmt::Write, time::Duration};

use super::{progress::Clock, verify::Job};
use crate::verify::{Budget, Contestant, Outcome, Report, Row, Verdict};

/// Less than this part of the image is not worth a sentence.
const WORTH_SAYING: f64 = 5e-4;
/// A longer run than this is nothing to recommend.
const PATIENCE: Duration = Duration::from_secs(1000 * 3600);

/// The tables, and then the summary. Writing to a string cannot fail.
pub(super) fn describe(job: &Job, report: &Report) -> String {
    let mut text = String::new();
    let _ = writeln!(text, "{:<34}{:>8}{:>10}   cannot see", "integrator", "spp", "time");
    for one in &report.integrators {
        let name = one.kind.name();
        let time = Clock(one.elapsed).to_string();
        let missing =
            if one.uncovered == 0.0 { "nothing".to_owned() } else { percent(one.uncovered) + " of the image" };
        let _ = writeln!(text, "{name:<34}{:>8}{time:>10}   {missing}", one.passes);
    }
    let _ = writeln!(text, "\n{:<34}{:>8}{:>10}   covered by", "paths", "", "image");
    for class in &report.classes {
        let uncovered = |one: &&Contestant| one.uncovered_classes.iter().find(|x| x.0 == class.class).map(|x| x.1);
        let covers = |one: &&Contestant| uncovered(one).is_none_or(|part| part < class.share);
        let by = report.integrators.iter().filter(covers).map(|one| match uncovered(&one) {
            Some(_) => format!("{} (in part)", one.kind),
            None => one.kind.name().to_owned(),
        });
        let by = by.collect::<Vec<_>>().join(", ");
        let name = format!("{}  {}", class.class.name(), class.class.letters());
        let _ = writeln!(text, "{name:<42}{:>10}   {by}", percent(class.share));
    }
    let mut pair = None;
    for row in &report.rows {
        if pair != Some(row.pair) {
            pair = Some(row.pair);
            let (a, b) = names(report, row);
            let head = format!("{a} - {b}");
            let _ = writeln!(text, "\n{head:<34}{:>8}{:>12}{:>16}   verdict", "p", "difference", "would be seen");
        }
        let (difference, visible) = (signed(row.difference), percent(row.visible));
        let p = p_value(row.p);
        let _ =
            writeln!(text, "  {:<32}{p:>8}{difference:>12}{visible:>16}   {}", row.scope.name(), row.verdict.name());
    }
    let _ = writeln!(text, "\n{}", summary(job, report).join("\n"));
    text
}

/// The result in sentences, the most important one first.
pub(super) fn summary(job: &Job, report: &Report) -> Vec<String> {
    let mut sentences = match report.outcome {
        Outcome::Agree if report.rows.is_empty() => vec!["agree: the image is black".to_owned()],
        Outcome::Agree => {
            vec![format!("agree: a bias of {} of the image would have been seen", percent(report.visible()))]
        }
        Outcome::Disagree => disagreement(report),
        Outcome::Undecided => doubt(job, report),
    };
    for one in report.integrators.iter().filter(|one| one.uncovered >= WORTH_SAYING) {
        let classes = one.uncovered_classes.iter().filter(|(_, part)| *part >= WORTH_SAYING);
        let classes: Vec<_> = classes.map(|(class, part)| format!("{class} {}", percent(*part))).collect();
        let all = percent(one.uncovered);
        sentences.push(format!("{} cannot see {all} of this image: {}", one.kind, classes.join(", ")));
    }
    let alone: f64 = report.classes.iter().map(|class| class.alone).sum();
    if alone >= WORTH_SAYING {
        let all = percent(alone);
        sentences
            .push(format!("{all} of this image only one of the integrators covers: nothing vouches for that part"));
    }
    let faint = report.rows.iter().filter(|row| row.verdict == Verdict::Faint).map(|row| row.scope);
    if faint.max().is_some() {
        let bar = percent(job.plan.bar);
        sentences.push(format!("'faint' are paths that make less than {bar} of the image, too few to look at closely"));
    }
    if report.rows.iter().any(|row| row.verdict == Verdict::SameStrategy) {
        sentences.push(
            "'same strategy': every integrator finds these paths alike, so that their noise is no doubt".to_owned(),
        );
    }
    for one in report.integrators.iter().filter(|one| one.rejected > 0) {
        sentences.push(format!("{} made {} contributions that are no number: a mistake", one.kind, one.rejected));
    }
    sentences
}

fn disagreement(report: &Report) -> Vec<String> {
    let rows: Vec<_> = report.rows.iter().filter(|row| row.verdict == Verdict::Disagree).collect();
    let Some(worst) = rows.iter().min_by(|a, b| a.p.total_cmp(&b.p)) else { return Vec::new() };
    let (a, b) = names(report, worst);
    let (p, difference) = (p_value(worst.p), percent(worst.difference.abs()));
    let (brighter, darker) = if worst.difference > 0.0 { (a, b) } else { (b, a) };
    let paths = worst.scope.name();
    let mut said = vec![format!(
        "disagree: in '{paths}', {brighter} is brighter than {darker} by {difference} of the image (p = {p}, confirmed with fresh \
         seeds); {} of {} comparisons disagree",
        rows.len(),
        report.rows.len()
    )];
    if let Some(one) = in_all(report, &rows) {
        said.push(format!("every disagreement involves {one}: look there first"));
    }
    said
}

fn doubt(job: &Job, report: &Report) -> Vec<String> {
    let rows: Vec<_> = report.rows.iter().filter(|row| row.verdict.is_open()).collect();
    let longest = |a: &&&Row, b: &&&Row| a.longer.total_cmp(&b.longer);
    let Some(worst) = rows.iter().max_by(longest) else {
        return vec!["undecided: no two integrators cover the same paths of this image (-i chooses others)".to_owned()];
    };
    let (a, b) = names(report, worst);
    let paths = worst.scope.name();
    let mut said = vec![match worst.verdict {
        Verdict::Unconfirmed => {
            format!("undecided: a difference of {a} and {b} in '{paths}' was not confirmed by fresh seeds")
        }
        _ => format!(
            "too noisy to say: in '{paths}', {a} and {b} could differ by {} of the image unseen",
            percent(worst.visible)
        ),
    }];
    let longer = report.longer.unwrap_or(1.0);
    said.push(match job.plan.budget {
        Budget::Time(time) if longer * time.as_secs_f64() < PATIENCE.as_secs_f64() => {
            format!("--time {} would be enough", flag(time.mul_f64(longer)))
        }
        Budget::Passes(passes) if longer * f64::from(passes) < f64::from(1 << 24) => {
            format!("--spp {:.0} would be enough", (longer * f64::from(passes)).ceil())
        }
        _ => "no sensible time would be enough".to_owned(),
    });
    if let Some(one) = in_all(report, &rows)
        && report.integrators.len() > 2
    {
        let others = report.integrators.iter().map(|one| one.kind.name()).filter(|name| *name != one);
        let others = others.collect::<Vec<_>>().join(",");
        said.push(format!("only {one} is too noisy: -i {others} agree already"));
    }
    said
}

/// The integrator that is in all of these pairs, if it is one.
fn in_all(report: &Report, rows: &[&Row]) -> Option<&'static str> {
    let has = |row: &&Row, i: usize| row.pair.0 == i || row.pair.1 == i;
    let mut all = (0..report.integrators.len()).filter(|i| rows.iter().all(|row| has(row, *i)));
    // Of a single pair nobody knows which of the two it is.
    let one = all.next().filter(|_| all.next().is_none())?;
    Some(report.integrators[one].kind.name())
}

fn names(report: &Report, row: &Row) -> (&'static str, &'static str) {
    (report.integrators[row.pair.0].kind.name(), report.integrators[row.pair.1].kind.name())
}

/// Two digits that mean something: `0.62 %`, `12 %`.
fn percent(fraction: f64) -> String {
    let percent = 100.0 * fraction;
    match percent.abs() {
        x if x >= 1000.0 => "> 1000 %".to_owned(),
        x if x >= 9.95 => format!("{percent:.0} %"),
        x if x >= 0.995 => format!("{percent:.1} %"),
        x if x >= 0.005 => format!("{percent:.2} %"),
        0.0 => "0 %".to_owned(),
        _ => "< 0.01 %".to_owned(),
    }
}

fn signed(fraction: f64) -> String {
    match fraction {
        x if x.abs() < 5e-5 => "0".to_owned(),
        x if x > 0.0 => format!("+{}", percent(x)),
        x => percent(x),
    }
}

fn p_value(p: f64) -> String {
    if p >= 0.001 { format!("{p:.3}") } else { format!("{p:.0e}") }
}

/// As `--time` takes it, rounded up.
fn flag(time: Duration) -> String {
    let seconds = time.as_secs_f64();
    match seconds {
        s if s < 100.0 => format!("{:.0}s", s.ceil()),
        s if s < 5400.0 => format!("{:.0}m", (s / 60.0).ceil()),
        s => format!("{:.0}h", (s / 3600.0).ceil()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        assert_eq!([0.00618, 0.123, 0.0201, 1e-9, 0.0].map(percent), ["0.62 %", "12 %", "2.0 %", "< 0.01 %", "0 %"]);
        assert_eq!((signed(0.012), signed(-0.012)), ("+1.2 %".to_owned(), "-1.2 %".to_owned()));
        assert_eq!((p_value(0.4321), p_value(3.2e-12)), ("0.432".to_owned(), "3e-12".to_owned()));
        let times = [61.0, 119.0, 7201.0].map(|s| flag(Duration::from_secs_f64(s)));
        assert_eq!(times, ["61s", "2m", "3h"]);
    }
}
