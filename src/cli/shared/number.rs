//! Numbers in sentences and in JSON.

/// A number as a person reads it: six significant digits at most, with an exponent where it is tiny or huge.
pub fn short(x: impl Into<f64>) -> String {
    rounded(x.into(), 6)
}

/// The same of a number that is measured rather than given: four digits.
pub fn brief(x: impl Into<f64>) -> String {
    rounded(x.into(), 4)
}

fn rounded(x: f64, significant: usize) -> String {
    // To so many digits first: to six, 9,999,999 is 1e7.
    let scientific = format!("{x:.*e}", significant - 1);
    let Some((digits, exponent)) = scientific.split_once('e') else { return scientific };
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let trimmed = |digits: &str| digits.trim_end_matches('0').trim_end_matches('.').to_owned();
    if x == 0.0 {
        "0".to_owned()
    } else if (-4..7).contains(&exponent) {
        let decimals = (significant as i32 - 1 - exponent).max(0) as usize;
        let plain = format!("{x:.decimals$}");
        if decimals > 0 { trimmed(&plain) } else { plain }
    } else {
        format!("{}e{exponent}", trimmed(digits))
    }
}

/// A place or a direction: `[1, 2.5, -3e-9]`.
pub fn short_vec(v: glam::Vec3) -> String {
    format!("[{}, {}, {}]", short(v.x), short(v.y), short(v.z))
}

/// The shortest number that is `x` in f32: 0.1, not the 0.10000000149011612 that it is in f64.
pub fn exact(x: f32) -> serde_json::Value {
    serde_json::json!(x.to_string().parse::<f64>().ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_six_digits_and_no_tail_of_zeros() {
        let cases = [
            (0.0, "0"),
            (-0.0, "0"),
            (1.0, "1"),
            (-12.5, "-12.5"),
            (0.000_123_456_789, "0.000123457"),
            (0.000_012_345_678_9, "1.23457e-5"),
            (-1.401_298_464e-45, "-1.4013e-45"),
            (123_456.7, "123457"),
            (1_234_567.0, "1234567"),
            (9_999_999.9, "1e7"),
            (12_345_678.0, "1.23457e7"),
            (3.402_823_47e38, "3.40282e38"),
            (f64::INFINITY, "inf"),
        ];
        for (x, text) in cases {
            assert_eq!(short(x), text);
        }
        assert_eq!([0.123_456, 1234.56, 123_456.0].map(brief), ["0.1235", "1235", "123456"]);
        assert_eq!(short_vec(glam::Vec3::new(1.0, 2.5, -3e-9)), "[1, 2.5, -3e-9]");
    }
}
