//! Errors as curves in log-log axes.

use std::{error::Error, ops::Range};

use plotters::prelude::*;

use crate::converge::PowerLaw;

/// A curve: its colour and its points, all positive.
pub(super) struct Curve {
    pub(super) colour: [u8; 3],
    pub(super) points: Vec<(f64, f64)>,
    /// What fits them, drawn thinly.
    pub(super) law: Option<PowerLaw>,
}

/// What the axes show.
pub(super) struct Axes<'a> {
    pub(super) x: &'a str,
    pub(super) y: &'a str,
    /// A level to draw across.
    pub(super) level: Option<f64>,
}

/// An SVG element of the curves.
pub(super) fn log_log(curves: &[Curve], axes: &Axes<'_>) -> Result<String, Box<dyn Error>> {
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
