//! How the values of options are written.

use std::{fmt, ops::Range, time::Duration};

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use glam::DVec3;
use pathspace::{
    compare::Metric,
    film::Crop,
    integrator::{IntegratorKind, RelativeRoulette, Weights},
    io::Limits,
    math::Rgb,
    path::{Roulette, Strategy},
    sampling::{Filter, SamplerKind},
    scene::{
        bsdf::Directions,
        camera::Blades,
        geometry::BuildEffort,
        light::{BRIGHTEST, LightChoice},
    },
};

use crate::cli::shared::progress::Style;

/// `--look-at`: where a camera stands, what it looks at, and its vertical field of view in radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LookAt {
    /// In the file's coordinates.
    pub eye: DVec3,
    pub target: DVec3,
    pub yfov: Option<f32>,
}

/// `--memory-limit` in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bytes(pub u64);

/// `--shard`: one of several parts of the samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 1.
    pub index: u32,
    pub count: u32,
}

impl Shard {
    /// Its part of so many passes. The parts of all shards are as equal as can be, and some are empty if there are more
    /// of them than passes.
    pub fn passes(self, whole: u32) -> Range<u32> {
        let end = |shards: u32| (u64::from(whole) * u64::from(shards) / u64::from(self.count)) as u32;
        end(self.index - 1)..end(self.index)
    }
}

/// `--frames`: the first and the last one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frames {
    pub first: u32,
    pub last: u32,
}

impl fmt::Display for Frames {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}..{}", self.first, self.last)
    }
}

/// `--preset`: a choice of paths by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Preset {
    /// Direct light: paths of two edges at most.
    Direct,
    /// Direct light, and what mirrors and glass show of it.
    Whitted,
}

impl Preset {
    const ALL: [Self; 2] = [Self::Direct, Self::Whitted];

    fn name(self) -> &'static str {
        match self {
            Self::Direct => "direct",
            Self::Whitted => "whitted",
        }
    }
}

/// `-i`: an integrator, or that which a pilot chooses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    Auto,
    One(IntegratorKind),
}

impl Asked {
    const AUTO: &str = "auto";

    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => Self::AUTO,
            Self::One(kind) => kind.name(),
        }
    }
}

pub fn integrator() -> impl TypedValueParser<Value = Asked> {
    let auto = PossibleValue::new(Asked::AUTO).help(
        "The one of path, hybrid, bdpt, bdpt-sds and vcm that needs the least work for the same noise, which a small \
         pilot image predicts",
    );
    PossibleValuesParser::new([auto].into_iter().chain(described(IntegratorKind::ALL.into_iter())))
        .try_map(|name| if name == Asked::AUTO { Ok(Asked::Auto) } else { name.parse().map(Asked::One) })
}

/// The integrators that `verify` can compare: those that sample the whole integral, whatever the length of a path, and
/// nothing beside it.
pub fn comparable() -> impl TypedValueParser<Value = IntegratorKind> {
    one_of(IntegratorKind::ALL.into_iter().filter(|kind| kind.has_strategies() && !kind.merges()))
}

fn one_of(kinds: impl Iterator<Item = IntegratorKind>) -> impl TypedValueParser<Value = IntegratorKind> {
    PossibleValuesParser::new(described(kinds)).try_map(|name| name.parse::<IntegratorKind>())
}

fn described(kinds: impl Iterator<Item = IntegratorKind>) -> impl Iterator<Item = PossibleValue> {
    kinds.map(|kind| PossibleValue::new(kind.name()).help(kind.description().what))
}

/// One of `all`, by the name that `name` gives it.
fn named<T: Copy + Send + Sync + 'static, const N: usize>(
    all: [T; N],
    name: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(all.map(name))
        .try_map(move |given| all.into_iter().find(|value| name(*value) == given).ok_or("no such name"))
}

pub fn directions() -> impl TypedValueParser<Value = Directions> {
    named(Directions::ALL, Directions::name)
}

pub fn weights() -> impl TypedValueParser<Value = Weights> {
    named(Weights::ALL, Weights::name)
}

pub fn lights() -> impl TypedValueParser<Value = LightChoice> {
    named(LightChoice::ALL, LightChoice::name)
}

pub fn preset() -> impl TypedValueParser<Value = Preset> {
    named(Preset::ALL, Preset::name)
}

pub fn effort() -> impl TypedValueParser<Value = BuildEffort> {
    named(BuildEffort::ALL, BuildEffort::name)
}

pub fn filter() -> impl TypedValueParser<Value = Filter> {
    named(Filter::ALL, Filter::name)
}

pub fn sampler() -> impl TypedValueParser<Value = SamplerKind> {
    named(SamplerKind::ALL, SamplerKind::name)
}

pub fn progress() -> impl TypedValueParser<Value = Style> {
    named(Style::ALL, Style::name)
}

/// `30s`, `1.5m`, `2h`, `500ms`; a bare number is seconds.
pub fn duration(text: &str) -> Result<Duration, String> {
    let (number, unit) = split_unit(text);
    let seconds = match unit {
        "ms" => 1e-3,
        "" | "s" => 1.0,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        _ => return Err("a time is written like 30s, 5m, 2h or 500ms".to_owned()),
    };
    let number: f64 = number.parse().map_err(|_| "a time is written like 30s, 5m, 2h or 500ms".to_owned())?;
    match Duration::try_from_secs_f64(number * seconds) {
        Ok(duration) if !duration.is_zero() => Ok(duration),
        _ => Err("a time must be positive".to_owned()),
    }
}

/// `HOST:PORT`, not looked up.
pub fn address(text: &str) -> Result<String, String> {
    let port = text.rsplit_once(':').filter(|(host, _)| !host.is_empty()).map(|(_, port)| port.parse::<u16>());
    match port {
        Some(Ok(1..)) => Ok(text.to_owned()),
        _ => Err("an address is written like 127.0.0.1:14158".to_owned()),
    }
}

/// `relmse=0.01`: the most that an error may be.
pub fn bound(text: &str) -> Result<(Metric, f64), String> {
    let known = || {
        let names = Metric::ALL.map(Metric::name).join(", ");
        format!("a bound is written like relmse=0.01, and its metric is one of {names}")
    };
    let (name, most) = text.split_once('=').ok_or_else(known)?;
    let metric = Metric::ALL.into_iter().find(|metric| metric.name() == name).ok_or_else(known)?;
    let most: f64 = most.parse().map_err(|_| known())?;
    if most >= 0.0 && most.is_finite() { Ok((metric, most)) } else { Err("a bound is not negative".to_owned()) }
}

/// `triangles=64M`; K, M, G and T are powers of 1024 as in sizes.
pub fn limit(text: &str) -> Result<(&'static str, u64), String> {
    let known =
        || format!("a limit is written like triangles=64M, and its name is one of {}", Limits::NAMES.join(", "));
    let (name, value) = text.split_once('=').ok_or_else(known)?;
    let name = Limits::NAMES.into_iter().find(|known| *known == name).ok_or_else(known)?;
    bytes(value).map(|Bytes(value)| (name, value)).map_err(|_| known())
}

/// `4GiB`, `512MiB`, `4G`; a bare number is bytes.
pub fn bytes(text: &str) -> Result<Bytes, String> {
    let (number, unit) = split_unit(text);
    let shift = match unit.to_ascii_lowercase().as_str() {
        "" | "b" => 0,
        "k" | "kib" => 10,
        "m" | "mib" => 20,
        "g" | "gib" => 30,
        "t" | "tib" => 40,
        _ => return Err("a size is written like 4GiB or 512MiB".to_owned()),
    };
    let number: f64 = number.parse().map_err(|_| "a size is written like 4GiB or 512MiB".to_owned())?;
    let bytes = number * (1_u64 << shift) as f64;
    if bytes >= 1.0 && bytes.is_finite() { Ok(Bytes(bytes as u64)) } else { Err("a size must be positive".to_owned()) }
}

fn split_unit(text: &str) -> (&str, &str) {
    text.split_at(text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len()))
}

/// `2%`, as a fraction.
pub fn percentage(text: &str) -> Result<f64, String> {
    let number = text.strip_suffix('%').and_then(|number| number.trim().parse::<f64>().ok());
    let fraction = number.map(|percent| percent / 100.0).filter(|x| *x > 0.0 && *x < 1.0);
    fraction.ok_or_else(|| "a bias is written like 2%, between 0% and 100%".to_owned())
}

/// `5%` or `0.05`, as a fraction.
pub fn noise(text: &str) -> Result<f64, String> {
    let number = |text: &str| text.trim().parse::<f64>().ok();
    let fraction = match text.strip_suffix('%') {
        Some(percent) => number(percent).map(|percent| percent / 100.0),
        None => number(text),
    };
    fraction.filter(|x| *x > 0.0 && *x < 1.0).ok_or_else(|| "a noise is written like 5% or 0.05, below 100%".to_owned())
}

/// `0..47`, both included, or `12`.
pub fn frames(text: &str) -> Result<Frames, String> {
    let (first, last) = text.split_once("..").unwrap_or((text, text));
    match (first.trim().parse(), last.trim().parse()) {
        (Ok(first), Ok(last)) if first <= last => Ok(Frames { first, last }),
        (Ok(_), Ok(_)) => Err("the first frame is not after the last".to_owned()),
        _ => Err("frames are written like 0..47, which includes both, or 12".to_owned()),
    }
}

/// `x0,y0,x1,y1`.
pub fn crop(text: &str) -> Result<Crop, String> {
    match numbers::<u32>(text)?[..] {
        [x0, y0, x1, y1] if x0 < x1 && y0 < y1 => Ok(Crop { x0, y0, x1, y1 }),
        [_, _, _, _] => Err("a crop holds at least one pixel: x0 < x1 and y0 < y1".to_owned()),
        _ => Err("a crop is four whole numbers x0,y0,x1,y1".to_owned()),
    }
}

/// `x,y`: column and row, from the upper left.
pub fn pixel(text: &str) -> Result<[u32; 2], String> {
    match numbers::<u32>(text)?[..] {
        [x, y] => Ok([x, y]),
        _ => Err("a pixel is two whole numbers x,y".to_owned()),
    }
}

/// `s,t`.
pub fn strategy(text: &str) -> Result<Strategy, String> {
    match numbers::<u32>(text)?[..] {
        [_, 0] => Err("t counts the camera's own vertex, so it is at least 1".to_owned()),
        [0, 1] => Err("a path has at least two vertices: s + t ≥ 2".to_owned()),
        [s, t] if s <= 256 && t <= 256 => Ok(Strategy { s, t }),
        _ => Err("a strategy is two numbers of vertices s,t".to_owned()),
    }
}

/// `I/N`.
pub fn shard(text: &str) -> Result<Shard, String> {
    let parts = text.split_once('/').and_then(|(i, n)| Some((i.trim().parse().ok()?, n.trim().parse().ok()?)));
    match parts {
        Some((index, count)) if (1..=count).contains(&index) => Ok(Shard { index, count }),
        Some(_) => Err("the shards of N are 1/N, 2/N, … N/N".to_owned()),
        None => Err("a shard is written like 2/16".to_owned()),
    }
}

/// `ex,ey,ez,tx,ty,tz` and perhaps `,yfov` in degrees.
pub fn look_at(text: &str) -> Result<LookAt, String> {
    let (values, yfov) = match &numbers::<f64>(text.trim_end_matches('°'))?[..] {
        &[ref values @ .., yfov] if values.len() == 6 => (values.to_vec(), Some(yfov)),
        values if values.len() == 6 => (values.to_vec(), None),
        _ => return Err("six numbers ex,ey,ez,tx,ty,tz, and perhaps a field of view in degrees".to_owned()),
    };
    let (eye, target) = (DVec3::from_slice(&values[..3]), DVec3::from_slice(&values[3..]));
    if !eye.as_vec3().is_finite() || !target.as_vec3().is_finite() {
        return Err("coordinates must be finite".to_owned());
    }
    if (target - eye).try_normalize().is_none() {
        return Err("a camera cannot look at the place where it stands".to_owned());
    }
    if yfov.is_some_and(|degrees| !(0.001..=179.0).contains(&degrees)) {
        return Err("a vertical field of view lies between 0.001 and 179 degrees".to_owned());
    }
    Ok(LookAt { eye, target, yfov: yfov.map(|degrees| (degrees as f32).to_radians()) })
}

/// `off`, or a number of edges, perhaps with the rule before it.
pub fn roulette(text: &str) -> Result<Roulette, String> {
    if text == "off" {
        return Ok(Roulette::Off);
    }
    let known = || "'off', or a number of edges up to 255, alone or as reflectance:N or throughput:N".to_owned();
    let (rule, depth) = text.split_once(':').unwrap_or(("reflectance", text));
    let depth: u8 = depth.parse().map_err(|_| known())?;
    match rule {
        "reflectance" => Ok(Roulette::FromDepth(depth.into())),
        "throughput" => Ok(Roulette::ByThroughput(depth.into())),
        _ => Err(known()),
    }
}

/// `0.1,50%`: a threshold, and the probability to end what lies below it.
pub fn connection_roulette(text: &str) -> Result<RelativeRoulette, String> {
    let known = || "roulette on connections is written like 0.1,50%, with a probability below 100%".to_owned();
    let (threshold, end) = text.split_once(',').ok_or_else(known)?;
    let threshold: f32 = threshold.trim().parse().map_err(|_| known())?;
    let end = match end.trim().strip_suffix('%') {
        Some(percent) => percent.trim().parse::<f32>().map(|percent| percent / 100.0),
        None => end.trim().parse(),
    };
    let end = end.map_err(|_| known())?;
    let usable = threshold > 0.0 && threshold.is_finite() && (0.0..1.0).contains(&end);
    if usable { Ok(RelativeRoulette { threshold, end }) } else { Err(known()) }
}

/// `R,G,B`, or one number for all three: a radiance.
pub fn radiance(text: &str) -> Result<Rgb, String> {
    let radiance = match numbers::<f32>(text)?[..] {
        [r, g, b] => Rgb::new(r, g, b),
        [grey] => Rgb::splat(grey),
        _ => return Err("a radiance is three numbers R,G,B, or one for all three".to_owned()),
    };
    let allowed = radiance.to_array().iter().all(|c| (0.0..=BRIGHTEST).contains(c));
    if allowed { Ok(radiance) } else { Err(format!("a radiance lies between 0 and {BRIGHTEST:e}")) }
}

/// A number that is neither infinite nor NaN.
pub fn finite(text: &str) -> Result<f32, String> {
    text.parse().ok().filter(|x: &f32| x.is_finite()).ok_or_else(|| "a finite number is needed".to_owned())
}

/// `--blades`: their number, or 0 for none.
pub fn blades(text: &str) -> Result<u32, String> {
    let [least, most] = Blades::COUNTS;
    let known = |count: &u32| *count == 0 || (least..=most).contains(count);
    text.parse().ok().filter(known).ok_or_else(|| format!("0, or a number from {least} to {most}, is needed"))
}

/// A radius whose square f32 has, and its reciprocal.
pub fn merge_radius(text: &str) -> Result<f32, String> {
    let fits = |r: &f32| (1e-9..=1e9).contains(r);
    positive(text).ok().filter(fits).ok_or_else(|| "a radius from 1e-9 to 1e9 metres is needed".to_owned())
}

/// A finite number above zero.
pub fn positive(text: &str) -> Result<f32, String> {
    finite(text).ok().filter(|x| *x > 0.0).ok_or_else(|| "a positive number is needed".to_owned())
}

/// A finite number, zero or above.
pub fn not_negative(text: &str) -> Result<f32, String> {
    finite(text).ok().filter(|x| *x >= 0.0).ok_or_else(|| "a number that is not negative is needed".to_owned())
}

fn numbers<T: std::str::FromStr>(text: &str) -> Result<Vec<T>, String> {
    text.split(',').map(|part| part.trim().parse().map_err(|_| format!("'{part}' is not such a number"))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_and_sizes_carry_units() {
        assert_eq!(duration("30s"), Ok(Duration::from_secs(30)));
        assert_eq!(duration("1.5m"), Ok(Duration::from_secs(90)));
        assert_eq!(duration("250ms"), Ok(Duration::from_millis(250)));
        for bad in ["", "s", "0s", "-1s", "3 days", "nan", "1e400s", "inf"] {
            assert!(duration(bad).is_err(), "{bad}");
        }
        assert_eq!(bytes("4GiB"), Ok(Bytes(4 << 30)));
        assert_eq!(bytes("100"), Ok(Bytes(100)));
        for bad in ["", "GiB", "0", "-1G", "4X", "nan"] {
            assert!(bytes(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn limits_have_names_and_numbers() {
        assert_eq!(limit("triangles=64M"), Ok(("triangles", 64 << 20)));
        assert_eq!(limit("depth=3"), Ok(("depth", 3)));
        for bad in ["", "triangles", "height=3", "depth=", "depth=-1", "=3", "depth=0"] {
            assert!(limit(bad).is_err_and(|error| error.contains("environment-texels")), "{bad}");
        }
    }

    #[test]
    fn shards_are_a_partition() {
        assert_eq!(shard("2/16"), Ok(Shard { index: 2, count: 16 }));
        for bad in ["", "2", "0/3", "4/3", "-1/3", "1/0", "1/2/3", "a/b", "1/4294967296"] {
            assert!(shard(bad).is_err(), "{bad}");
        }
        for (whole, count) in [(1, 1), (64, 3), (3, 16), (1 << 24, 1000), (7, 7), (5, u32::MAX)] {
            let shards = (1..=count.min(1000)).map(|index| Shard { index, count }.passes(whole));
            let end = shards.fold(0, |end, range| {
                assert!(range.start == end && range.len() as u32 <= whole.div_ceil(count), "{range:?} of {whole}");
                range.end
            });
            assert!(end == whole || count > 1000);
        }
    }

    #[test]
    fn a_bias_is_a_percentage() {
        assert_eq!((percentage("2%"), percentage("0.5 %")), (Ok(0.02), Ok(0.005)));
        assert_eq!((noise("5%"), noise("0.05")), (Ok(0.05), Ok(0.05)));
        assert!(["0", "1", "100%", "-1%", "", "%", "nan"].iter().all(|bad| noise(bad).is_err()));
        for bad in ["2", "0%", "-1%", "100%", "nan%", "%", "0.02"] {
            assert!(percentage(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn lists_of_numbers_are_checked() {
        assert_eq!(
            (frames("0..47"), frames("7")),
            (Ok(Frames { first: 0, last: 47 }), Ok(Frames { first: 7, last: 7 }))
        );
        for bad in ["", "..", "1..", "..3", "3..1", "-1..2", "1..=2", "1.5", "1...2", "0..4294967296"] {
            assert!(frames(bad).is_err(), "{bad}");
        }
        assert_eq!(crop("1,2,3,4"), Ok(Crop { x0: 1, y0: 2, x1: 3, y1: 4 }));
        for bad in ["1,2,3", "3,0,1,1", "0,0,0,0", "-1,0,1,1", "a,b,c,d", "1,2,3,4,5", ""] {
            assert!(crop(bad).is_err(), "{bad}");
        }
        assert_eq!(pixel("12, 3"), Ok([12, 3]));
        for bad in ["", "1", "1,2,3", "-1,2", "1.5,2", "x,y"] {
            assert!(pixel(bad).is_err(), "{bad}");
        }
        assert_eq!(strategy("0,2"), Ok(Strategy { s: 0, t: 2 }));
        for bad in ["2,0", "0,1", "1", "1,2,3", "900,2", "4294967295,4294967295"] {
            assert!(strategy(bad).is_err(), "{bad}");
        }
        let there = look_at("0,1,-2.5,0,0,0,90°").unwrap();
        assert_eq!((there.eye, there.target), (DVec3::new(0.0, 1.0, -2.5), DVec3::ZERO));
        assert_eq!(there.yfov, Some(90.0_f32.to_radians()));
        assert_eq!(look_at("0,1,2,0,0,0").unwrap().yfov, None);
        for bad in ["0,0,0,0,0,0", "0,0,0,1,1", "0,0,0,1,1,nan", "0,0,0,1,1,1,0", "0,0,0,1,1,1,180", "1,2,3,4,5,6,7,8"]
        {
            assert!(look_at(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn single_values_are_checked() {
        assert_eq!(roulette("off"), Ok(Roulette::Off));
        assert_eq!(roulette("4"), Ok(Roulette::FromDepth(4)));
        assert_eq!(roulette("throughput:2"), Ok(Roulette::ByThroughput(2)));
        assert_eq!(roulette("reflectance:0"), Ok(Roulette::FromDepth(0)));
        assert!(roulette("luck:2").is_err() && roulette("throughput").is_err() && roulette("throughput:off").is_err());
        let half = RelativeRoulette { threshold: 0.25, end: 0.5 };
        assert_eq!((connection_roulette("0.25,50%"), connection_roulette("0.25, 0.5")), (Ok(half), Ok(half)));
        for bad in ["", "1", "0,50%", "-1,0.5", "1,100%", "1,1", "nan,0.5", "1,nan", "1,-0.1", "inf,0.5", "1,2,3"] {
            assert!(connection_roulette(bad).is_err(), "{bad}");
        }
        assert!(roulette("-1").is_err() && roulette("on").is_err() && roulette("256").is_err());
        assert_eq!(finite("-1.5"), Ok(-1.5));
        assert_eq!(radiance("0.5"), Ok(Rgb::splat(0.5)));
        assert_eq!(radiance("1,2.5, 0"), Ok(Rgb::new(1.0, 2.5, 0.0)));
        for bad in ["", "1,2", "1,2,3,4", "-1", "nan", "inf", "1,1,1e31", "red"] {
            assert!(radiance(bad).is_err(), "{bad}");
        }
        assert!(finite("nan").is_err() && finite("inf").is_err() && positive("0").is_err() && positive("-1").is_err());
        assert!(not_negative("0") == Ok(0.0) && not_negative("-1").is_err() && not_negative("inf").is_err());
    }
}
