//! What `pathspace verify` says to a person.

use std::{fmt::Write, time::Duration};

use pathspace::verify::{Budget, Contestant, Outcome, Report, Row, Verdict};

use crate::cli::{shared::progress::Clock, verify::Job};

/// Less than this part of the image is not worth a sentence.
const WORTH_SAYING: f64 = 5e-4;
/// A longer run than this is nothing to recommend.
const PATIENCE: Duration = Duration::from_secs(24 * 3600);

/// The tables, and then the summary. Writing to a string cannot fail.
pub fn describe(job: &Job, report: &Report) -> String {
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
pub fn summary(job: &Job, report: &Report) -> Vec<String> {
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
        sentences.push(format!("only one of the integrators covers {all} of this image: that part was not checked"));
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
        "disagree: in '{paths}', {brighter} is brighter than {darker} by {difference} of the image (p = {p}, confirmed \
         with fresh \
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
            "undecided: in '{paths}', {a} and {b} could differ by {} of the image unseen",
            percent(worst.visible)
        ),
    }];
    said.push(match needed(job, report).flatten() {
        Some(needed) => format!("{needed} should be about enough"),
        None => "no sensible time would be enough for all of them".to_owned(),
    });
    said.extend(advice(job, report));
    said
}

/// Which integrators to leave out for a decision, where that helps.
fn advice(job: &Job, report: &Report) -> Option<String> {
    let doubts: Vec<_> = report.rows.iter().map(Doubt::from).collect();
    let name = |i: &usize| report.integrators[*i].kind.name();
    let others = |out: &[usize]| {
        let left = (0..report.integrators.len()).filter(|i| !out.contains(i));
        left.map(|i| name(&i)).collect::<Vec<_>>().join(",")
    };
    if report.rows.iter().any(|row| row.verdict == Verdict::Unconfirmed) {
        return None;
    }
    if let Some(out) = decided_without(report.integrators.len(), &doubts) {
        let names = out.iter().map(name).collect::<Vec<_>>().join(" and ");
        let are = if out.len() == 1 { "is" } else { "are" };
        return Some(format!("{names} {are} too noisy here; the others agree already (-i {})", others(&out)));
    }
    // Nothing decides it now: leaving out the one that takes longest may still bring it within reach.
    let longest = |out: usize| longest(&doubts, |i| i != out);
    let all = longest(usize::MAX);
    let out = (0..report.integrators.len()).min_by(|a, b| longest(*a).total_cmp(&longest(*b)))?;
    let needed =
        sensible(job, report, longest(out)).filter(|_| report.integrators.len() > 2 && 2.0 * longest(out) < all)?;
    Some(format!("without {}, the others need {needed} (-i {})", name(&out), others(&[out])))
}

/// What an open comparison says of its two integrators.
struct Doubt {
    pair: (usize, usize),
    open: bool,
    visible: f64,
    longer: f64,
}

impl From<&Row> for Doubt {
    fn from(row: &Row) -> Self {
        Self { pair: row.pair, open: row.verdict.is_open(), visible: row.visible, longer: row.longer }
    }
}

impl Doubt {
    fn among(&self, kept: impl Fn(usize) -> bool) -> bool {
        kept(self.pair.0) && kept(self.pair.1)
    }
}

/// The fewest of `n` integrators without which no comparison is open, and of equally many the noisiest: two are left at
/// least, with something to compare.
fn decided_without(n: usize, doubts: &[Doubt]) -> Option<Vec<usize>> {
    let members = |set: u32| (0..n).filter(move |i| (set >> i) & 1 == 1);
    let decides = |set: &u32| {
        let mut left = doubts.iter().filter(|doubt| doubt.among(|i| (set >> i) & 1 == 0)).peekable();
        left.peek().is_some() && left.all(|doubt| !doubt.open)
    };
    let noise = |set: u32| {
        let of = |i: usize| doubts.iter().filter(move |d| d.pair.0 == i || d.pair.1 == i).map(|d| d.visible);
        members(set).flat_map(of).sum::<f64>()
    };
    let sets = (1..1_u32 << n).filter(|set| set.count_ones() as usize + 2 <= n).filter(decides);
    let best = sets.min_by(|a, b| a.count_ones().cmp(&b.count_ones()).then(noise(*b).total_cmp(&noise(*a))))?;
    Some(members(best).collect())
}

/// How many times as long the open comparisons among the integrators that are kept would take.
fn longest(doubts: &[Doubt], kept: impl Fn(usize) -> bool) -> f64 {
    let open = doubts.iter().filter(|doubt| doubt.open && doubt.among(&kept));
    open.map(|doubt| doubt.longer).fold(0.0, f64::max)
}

/// What a decision takes, as an option: `None` if the run was long enough, and within that if nobody would wait for it.
pub fn needed(job: &Job, report: &Report) -> Option<Option<String>> {
    report.longer.map(|longer| sensible(job, report, longer))
}

/// A run so many times as long, as an option; `None` beyond anybody's patience.
fn sensible(job: &Job, report: &Report, longer: f64) -> Option<String> {
    let spent: Duration = report.integrators.iter().map(|one| one.elapsed).sum();
    match job.plan.budget {
        Budget::Time(time) if longer * time.as_secs_f64() <= PATIENCE.as_secs_f64() => {
            Some(format!("--time {}", flag(time.mul_f64(longer))))
        }
        Budget::Passes(passes)
            if longer * f64::from(passes) < f64::from(1 << 24)
                && longer * spent.as_secs_f64() <= PATIENCE.as_secs_f64() =>
        {
            Some(format!("--spp {:.0}", (longer * f64::from(passes)).ceil()))
        }
        _ => None,
    }
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

    fn doubts(rows: &[(usize, usize, bool, f64)]) -> Vec<Doubt> {
        let doubt = |&(a, b, open, visible)| Doubt { pair: (a, b), open, visible, longer: 100.0 * visible };
        rows.iter().map(doubt).collect()
    }

    #[test]
    fn the_noisiest_are_left_out_and_no_more_than_have_to() {
        // Of four, 1 is noisy: whatever it is compared with.
        let quiet = [(0, 2, false, 0.01), (0, 3, false, 0.01), (2, 3, false, 0.01)];
        let one = doubts(&[&quiet[..], &[(0, 1, true, 0.1), (1, 2, true, 0.1), (1, 3, true, 0.1)]].concat());
        assert_eq!(decided_without(4, &one), Some(vec![1]));
        // One comparison is open: of its two, 3 is the noisier one elsewhere.
        let rows = [(0, 1, false, 0.01), (0, 2, false, 0.01), (0, 3, false, 0.019), (1, 2, false, 0.01)];
        let single = doubts(&[&rows[..], &[(1, 3, false, 0.019), (2, 3, true, 0.021)]].concat());
        assert_eq!(decided_without(4, &single), Some(vec![3]));
        // Two are too noisy.
        let rows = [(0, 1, true, 0.1), (0, 2, false, 0.01), (0, 3, true, 0.3), (1, 2, true, 0.1), (1, 3, true, 0.3)];
        let two = doubts(&[&rows[..], &[(2, 3, true, 0.3)]].concat());
        assert_eq!(decided_without(4, &two), Some(vec![1, 3]));
        assert_eq!((longest(&two, |_| true), longest(&two, |i| i != 3)), (30.0, 10.0));
        // Of a single pair nothing can be left out, nor where nothing would be compared.
        assert_eq!(decided_without(2, &doubts(&[(0, 1, true, 0.1)])), None);
        assert_eq!(decided_without(3, &doubts(&[(0, 1, true, 0.1), (1, 2, true, 0.1), (0, 2, true, 0.1)])), None);
    }

    #[test]
    fn numbers_read_well() {
        assert_eq!([0.00618, 0.123, 0.0201, 1e-9, 0.0].map(percent), ["0.62 %", "12 %", "2.0 %", "< 0.01 %", "0 %"]);
        assert_eq!((signed(0.012), signed(-0.012)), ("+1.2 %".to_owned(), "-1.2 %".to_owned()));
        assert_eq!((p_value(0.4321), p_value(3.2e-12)), ("0.432".to_owned(), "3e-12".to_owned()));
        let times = [61.0, 119.0, 7201.0].map(|s| flag(Duration::from_secs_f64(s)));
        assert_eq!(times, ["61s", "2m", "3h"]);
    }
}
