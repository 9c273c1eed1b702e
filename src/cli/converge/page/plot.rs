//! Errors as curves in log-log axes.

use std::{error::Error, ops::Range};

use pathspace::converge::PowerLaw;
use plotters::prelude::*;

/// A curve: its colour and its points, all positive.
pub struct Curve {
    pub colour: [u8; 3],
    pub points: Vec<(f64, f64)>,
    /// What fits them, drawn thinly.
    pub law: Option<PowerLaw>,
}

/// What the axes show.
pub struct Axes<'a> {
    pub x: &'a str,
    pub y: &'a str,
    /// A level to draw across.
    pub level: Option<f64>,
}

/// An SVG element of the curves.
pub fn log_log(curves: &[Curve], axes: &Axes<'_>) -> Result<String, Box<dyn Error>> {
    let noise = axes.level;
    let all = || curves.iter().flat_map(|curve| &curve.points);
    let xs = range(all().map(|p| p.0));
    let ys = range(all().map(|p| p.1).chain(noise));
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (620, 400)).into_drawing_area();
        let mut chart = ChartBuilder::on(&area)
            .margin(14)
            .x_label_area_size(44)
            .y_label_area_size(76)
            .build_cartesian_2d(xs.clone().log_scale(), ys.log_scale())?;
        chart
            .configure_mesh()
            .x_desc(axes.x)
            .y_desc(axes.y)
            .x_label_formatter(&|x| number(*x))
            .x_labels(5)
            .y_labels(5)
            .y_label_formatter(&|y| number(*y))
            .light_line_style(RGBColor(240, 240, 240))
            .bold_line_style(RGBColor(214, 214, 214))
            .label_style(("sans-serif", 15))
            .draw()?;
        if let Some(level) = noise {
            let line = [(xs.start, level), (xs.end, level)];
            chart.draw_series(LineSeries::new(line, RGBColor(150, 150, 150).stroke_width(1)))?;
        }
        for curve in curves {
            let [r, g, b] = curve.colour;
            let colour = RGBColor(r, g, b);
            if let Some(law) = curve.law {
                let line = [xs.start, xs.end].map(|x| (x, law.at(x)));
                chart.draw_series(LineSeries::new(line, colour.mix(0.6).stroke_width(1)))?;
            }
            chart.draw_series(LineSeries::new(curve.points.iter().copied(), colour.stroke_width(3)))?;
            chart.draw_series(curve.points.iter().map(|p| Circle::new(*p, 4, colour.filled())))?;
        }
        area.present()?;
    }
    Ok(svg)
}

fn number(x: f64) -> String {
    // Ticks are sums, and would show their rounding.
    let x = format!("{x:.2e}").parse().unwrap_or(x);
    if (1e-3..1e5).contains(&x) { format!("{x}") } else { format!("{x:.0e}") }
}

/// A little more than the points, with a power of ten among it, which alone is labelled; anything where there are none.
fn range(points: impl Iterator<Item = f64>) -> Range<f64> {
    let ends = points.filter(|x| *x > 0.0 && x.is_finite()).fold(None, |ends: Option<(f64, f64)>, x| {
        Some(ends.map_or((x, x), |(least, most)| (least.min(x), most.max(x))))
    });
    let (least, most) = ends.unwrap_or((0.1, 1.0));
    let (least, most) = (0.8 * least, 1.25 * most);
    let [below, above] = [f64::floor, f64::ceil].map(|round| 10.0_f64.powf(round(least.log10())));
    if above <= most {
        least..most
    } else if least / below < above / most {
        below..most
    } else {
        least..above
    }
}

#[cfg(test)]
mod tests {
    use pathspace::converge::power_law;

    use super::*;

    /// Without a power of ten in it an axis has no label at all.
    #[test]
    fn every_range_holds_its_points_and_a_power_of_ten() {
        for (least, most) in [(1.0, 1.0), (2.0, 3.0), (2.0, 60.0), (4.3e-7, 7.9e-7), (1.1e-3, 9.9e-3), (85.0, 99.0)] {
            let Range { start, end } = range([least, most].into_iter());
            assert!(start < least && most < end, "{start} {least} {most} {end}");
            let power = 10.0_f64.powf(end.log10().floor());
            assert!((start..=end).contains(&power), "no power of ten from {start} to {end}");
        }
        let of_nothing = range([0.0, f64::NAN].into_iter());
        assert!(of_nothing.start > 0.0 && of_nothing.start < of_nothing.end);
    }

    #[test]
    fn a_plot_has_its_points_their_law_and_labels_on_both_axes() {
        let points = vec![(0.25, 0.4), (1.0, 0.2), (4.0, 0.1)];
        let plot = |law, level| {
            let curve = Curve { colour: [200, 0, 0], points: points.clone(), law };
            log_log(&[curve], &Axes { x: "seconds", y: "error", level }).unwrap()
        };
        let count = |svg: &str, what: &str| svg.matches(what).count();
        let (bare, fitted) = (plot(None, None), plot(power_law(points.iter().copied()), None));
        assert_eq!(count(&bare, "<circle"), points.len());
        assert_eq!(count(&fitted, "<polyline"), count(&bare, "<polyline") + 1);
        assert_eq!(count(&plot(None, Some(0.15)), "<polyline"), count(&bare, "<polyline") + 1);
        let labels = |text: &str| bare.lines().filter(|line| line.trim() == text).count();
        for text in ["seconds", "error", "1", "0.1"] {
            assert!(labels(text) > 0, "no label '{text}' in {bare}");
        }
    }
}
