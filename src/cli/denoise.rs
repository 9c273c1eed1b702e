//! `pathspace denoise`: an image that was rendered, without its noise.

use std::path::{Path, PathBuf};

use pathspace::{
    denoise::Guides,
    film::{DENOISED, Format, encode_png},
    io::{Layered, Limits, read_layered},
};

use crate::cli::shared::{
    args::VerbosityArgs,
    denoised::{self, NOISY, OidnArgs},
    exit::{Exit, Failure},
    look::LookArgs,
    pictures::Outputs,
    terminal::Terminal,
};

/// What `pathspace denoise` is asked for.
#[derive(Debug, clap::Args)]
pub struct DenoiseArgs {
    /// The image, .exr: best with albedo and normals, which 'render --data albedo,normals' puts beside it
    #[arg(value_name = "IN")]
    image: PathBuf,

    /// Image to write, .exr (with all that IN has, and its image in the layer noisy) or .png; may be given several
    /// times
    #[arg(short, long, value_name = "OUT", required = true)]
    output: Vec<PathBuf>,

    /// Take albedo and normals from this .exr file of the same pixels, instead of IN
    #[arg(long, value_name = "FILE")]
    guides: Option<PathBuf>,

    #[command(flatten)]
    look: LookArgs,

    /// Threads [default: one for each core]
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,

    #[command(flatten)]
    oidn: OidnArgs,

    #[command(flatten)]
    verbosity: VerbosityArgs,
}

/// Denoises the image, and writes it with everything that the file has.
pub fn run(args: &DenoiseArgs) -> Result<Exit, Failure> {
    let terminal = Terminal::new(args.verbosity.verbosity());
    let outputs = Outputs::check(args.output.clone())?;
    let denoiser = args.oidn.load()?;
    let file = read(&args.image)?;
    let name = args.image.display();
    if file.attribute(DENOISED).is_some() {
        return Err(Failure::input(format!(
            "'{name}' is denoised already: its layer {NOISY} is the image as rendered"
        )));
    }
    if ["R", "G", "B"].into_iter().any(|letter| file.has(&format!("{NOISY}.{letter}"))) {
        return Err(Failure::input(format!("'{name}' has a layer {NOISY}, which is where its image would go")));
    }
    let guides = match &args.guides {
        None => guides(&args.image, &file)?,
        Some(path) => Some(guides_of(path, &file)?),
    };
    if guides.is_none() {
        terminal.warn(format_args!(
            "'{name}' has no albedo, and is denoised by its colours alone (render with --data albedo,normals)"
        ));
    }
    let threads = args.threads.map(usize::from);
    let image = denoiser.denoise(file.rgb(), guides.as_ref(), threads).map_err(|error| denoised::failed(&error))?;
    let attribute = denoised::attribute(&denoiser, guides.as_ref());
    let alpha = file.alpha();
    outputs.write_each(|format| match format {
        Format::Exr => file.encode_with(&image, NOISY, std::slice::from_ref(&attribute)),
        Format::Png => encode_png(&image, alpha.as_deref(), args.look.look()),
    })?;
    let (version, fed) = (denoiser.version(), denoised::fed(guides.as_ref()));
    terminal.say(format_args!("denoised by Open Image Denoise {version} from {fed}"));
    terminal.say(outputs.said());
    Ok(Exit::Done)
}

fn read(path: &Path) -> Result<Layered, Failure> {
    read_layered(&Limits::default(), path).map_err(|error| Failure::input(error.to_string()))
}

/// The guides in a file.
fn guides(path: &Path, file: &Layered) -> Result<Option<Guides>, Failure> {
    let three = |layer: &str, letters: [&str; 3]| file.three(&letters.map(|letter| format!("{layer}.{letter}")));
    denoised::guides(three).map_err(|what| Failure::input(format!("cannot use '{}': {what}", path.display())))
}

/// The guides in another file than the image.
fn guides_of(path: &Path, image: &Layered) -> Result<Guides, Failure> {
    let file = read(path)?;
    let [(w, h), (x, y)] = [file.rgb(), image.rgb()].map(|image| (image.width, image.height));
    let name = path.display();
    if (w, h) != (x, y) {
        return Err(Failure::input(format!("'{name}' has {w} × {h} pixels and the image {x} × {y}")));
    }
    let [from, to] = [&file, image].map(Layered::corner);
    if from != to {
        return Err(Failure::input(format!(
            "'{name}' is another crop: its first pixel is {from:?}, that of the image {to:?}"
        )));
    }
    let none = || Failure::input(format!("'{name}' has no albedo: render it with --data albedo,normals"));
    guides(path, &file)?.ok_or_else(none)
}
