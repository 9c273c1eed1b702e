//! `pathspace compare`.

use std::path::{Path, PathBuf};

use pathspace::{
    compare::{Measured, Metric, brightness_difference, difference, p_of_no_bias},
    film::{Crop, Exposure, Format, Header, Image, encode_exr, encode_png},
    io::{Limits, read_halves, read_image},
    math::luminance,
    scene::camera::Sensor,
};
use serde_json::{Map, Value, json};

use crate::cli::shared::{
    args::VerbosityArgs,
    denoised::is_denoised,
    exit::{Exit, Failure},
    pictures::{Outputs, difference_in_colour},
    terminal::{self, Terminal},
    values,
};

/// Raised when a key of the JSON changes or goes.
const LAYOUT: u32 = 1;

/// What `pathspace compare` is asked for.
#[derive(Debug, clap::Args)]
pub struct CompareArgs {
    /// An image, .exr
    #[arg(value_name = "A")]
    a: PathBuf,

    /// What it is compared with, .exr of the same size
    #[arg(value_name = "B")]
    b: PathBuf,

    /// Compare both with this image, .exr, instead of one with the other
    #[arg(long, value_name = "R")]
    reference: Option<PathBuf>,

    /// Write A minus B: .exr as it is, .png in colours (white: equal, red: A is brighter, blue: B is); may be given
    /// several times
    #[arg(short, long, value_name = "DIFF")]
    output: Vec<PathBuf>,

    /// Exit with 1 if this error of A, or with --reference of A or B, is above X; may be given several times. METRIC is
    /// mse, relmse, relmse-trimmed, mape, or flip (at the reference's automatic exposure)
    #[arg(long, value_name = "METRIC=X", value_parser = values::bound)]
    fail_above: Vec<(Metric, f64)>,

    /// Answer as JSON
    #[arg(long)]
    json: bool,

    #[command(flatten)]
    verbosity: VerbosityArgs,
}

/// An image and how far it is from what it is compared with.
struct Row<'a> {
    file: &'a Path,
    errors: [f64; Metric::ALL.len()],
    brighter: f64,
}

impl<'a> Row<'a> {
    fn new(file: &'a Path, image: &Image, reference: &Image) -> Self {
        let errors = Metric::ALL.map(|metric| metric.between(image, reference));
        Self { file, errors, brighter: brightness_difference(image, reference) }
    }

    fn errors(&self) -> impl Iterator<Item = (Metric, f64)> {
        Metric::ALL.into_iter().zip(self.errors)
    }

    /// The bounds that it is above.
    fn above(&self, bounds: &[(Metric, f64)]) -> Vec<String> {
        let is_above = |(metric, most): &&(Metric, f64)| self.errors().any(|(m, error)| m == *metric && error > *most);
        let say =
            |(metric, most): &(Metric, f64)| format!("{} of {} is above {most}", metric.name(), self.file.display());
        bounds.iter().filter(is_above).map(say).collect()
    }

    fn json(&self) -> Value {
        let errors = self.errors().map(|(metric, error)| (metric.name().to_owned(), json!(error)));
        let mut object: Map<String, Value> = errors.collect();
        object.insert("file".to_owned(), json!(self.file.display().to_string()));
        object.insert("brighter".to_owned(), json!(self.brighter));
        Value::Object(object)
    }
}

/// Says the errors of A against B, or of both against the reference.
pub fn run(args: &CompareArgs) -> Result<Exit, Failure> {
    let terminal = Terminal::new(args.verbosity.verbosity());
    let outputs = Outputs::check(args.output.clone())?;
    let a = read(&args.a)?;
    let b = read(&args.b)?;
    let same_size = |path: &Path, image: &Image| {
        if (image.width, image.height) == (a.width, a.height) {
            return Ok(());
        }
        let (first, other) = (args.a.display(), path.display());
        let (w, h, x, y) = (a.width, a.height, image.width, image.height);
        Err(Failure::input(format!(
            "'{first}' has {w} × {h} pixels and '{other}' {x} × {y}: only images of one size can be compared"
        )))
    };
    same_size(&args.b, &b)?;
    let rows = match &args.reference {
        None => vec![Row::new(&args.a, &a, &b)],
        Some(path) => {
            let reference = read(path)?;
            same_size(path, &reference)?;
            vec![Row::new(&args.a, &a, &reference), Row::new(&args.b, &b, &reference)]
        }
    };
    write(&outputs, &a, &b)?;
    let (halves_a, halves_b) = (halves(&args.a, &a)?, halves(&args.b, &b)?);
    let [measured_a, measured_b] =
        [(&a, &halves_a), (&b, &halves_b)].map(|(image, halves)| Measured { image, halves: halves.as_ref() });
    let denoised = denoised(args)?;
    // A denoised image has a bias, and no halves that tell its noise.
    let has_noise_alone = ![&args.a, &args.b].iter().any(|file| denoised.contains(file));
    let p = if has_noise_alone { p_of_no_bias(measured_a, measured_b) } else { None };

    let above: Vec<_> = rows.iter().flat_map(|row| row.above(&args.fail_above)).collect();
    let exit = if above.is_empty() { Exit::Done } else { Exit::ComparisonFailed };
    if args.json {
        let images: Vec<_> = rows.iter().map(Row::json).collect();
        let (width, height) = (a.width, a.height);
        terminal::answer(json!({
            "layout": LAYOUT, "width": width, "height": height, "images": images, "above": above, "exit": exit as u8,
            "p_of_no_bias": p, "denoised": denoised,
        }));
    } else if !terminal.is_quiet() {
        let bias = p.map(|p| match p {
            ..1e-3 => format!("these images are not of one expectation (p = {p:.1e})"),
            _ => format!("they differ by no more than their noise does (p = {p:.2})"),
        });
        let biased =
            |file: &&PathBuf| format!("'{}' is denoised, so errors are also those of a filter", file.display());
        let biased: Vec<_> = denoised.iter().map(biased).collect();
        table(&rows).iter().chain(&bias).chain(&biased).chain(&above).for_each(terminal::answer);
    }
    Ok(exit)
}

/// Which of the files have denoised images.
fn denoised(args: &CompareArgs) -> Result<Vec<&PathBuf>, Failure> {
    let mut denoised = Vec::new();
    for file in [&args.a, &args.b].into_iter().chain(&args.reference) {
        if !denoised.contains(&file) && is_denoised(file).map_err(|error| Failure::input(error.to_string()))? {
            denoised.push(file);
        }
    }
    Ok(denoised)
}

fn read(path: &Path) -> Result<Image, Failure> {
    read_image(&Limits::default(), path).map_err(|error| Failure::input(error.to_string()))
}

/// The half images beside an image, from `--data halves`.
fn halves(path: &Path, image: &Image) -> Result<Option<[Image; 2]>, Failure> {
    let halves = read_halves(&Limits::default(), path).map_err(|error| Failure::input(error.to_string()))?;
    Ok(halves.filter(|halves| halves.iter().all(|half| (half.width, half.height) == (image.width, image.height))))
}

/// A line for the names and one for each image.
fn table(rows: &[Row<'_>]) -> Vec<String> {
    let names = rows.iter().map(|row| row.file.display().to_string().chars().count());
    let widest = names.max().unwrap_or(0);
    let head: String = Metric::ALL.iter().map(|metric| format!("{:>16}", metric.name())).collect();
    let line = |row: &Row<'_>| {
        let errors: String = row.errors.iter().map(|error| format!("{error:>16.4e}")).collect();
        format!("{:widest$}{errors}{:>+14.3} %", row.file.display(), 100.0 * row.brighter)
    };
    [format!("{:widest$}{head}{:>16}", "", "brighter")].into_iter().chain(rows.iter().map(line)).collect()
}

/// Writes the difference to all outputs.
fn write(outputs: &Outputs, a: &Image, b: &Image) -> Result<(), Failure> {
    let difference = difference(a, b);
    let sensor = Sensor { width: a.width, height: a.height, padding: 0 };
    let attributes = [("version", env!("CARGO_PKG_VERSION")), ("shows", "the first image minus the second")];
    let attributes = attributes.map(|(name, value)| (name.to_owned(), value.to_owned())).to_vec();
    let header = Header { sensor, crop: Crop::full(sensor), attributes };
    outputs.write_each(|format| match format {
        Format::Exr => encode_exr(&difference, None, &[], &[], &header),
        Format::Png => encode_png(&difference_in_colour(&difference, luminance(b.mean())), None, Exposure::Ev(0.0)),
    })
}
