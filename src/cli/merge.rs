//! `pathspace merge`: the shards of a render, put together.

use std::{
    ops::Range,
    path::{Path, PathBuf},
};

use pathspace::{
    film::{AlphaSums, CheckpointHeader, Contents, Film, Sums, encode_checkpoint},
    render::Statistics,
    scene::camera::Sensor,
};

use crate::cli::{
    render::pass_loop,
    shared::{
        args::{VerbosityArgs, check_memory},
        exit::{Exit, Failure},
        header::{filter_of, header},
        layers,
        look::LookArgs,
        passes::Passes,
        pictures::{Outputs, Picture},
        saved::{self, Shape, open, unusable},
        terminal::Terminal,
        values::{self, Bytes},
    },
};

/// The options of `pathspace merge`.
#[derive(Debug, clap::Args)]
pub struct MergeArgs {
    /// Shards and checkpoints of one render, in any order: what 'render --shard' and --checkpoint wrote
    #[arg(value_name = "SHARD", required = true)]
    shards: Vec<PathBuf>,

    /// Image to write, .exr (linear, lossless) or .png; may be given several times
    #[arg(short, long, value_name = "OUT", required = true)]
    output: Vec<PathBuf>,

    /// Merge what is there even if samples are missing; a line says which
    #[arg(long)]
    partial: bool,

    /// Write exact sums, to be merged with others, instead of an image: a shard, of which the samples have to be one
    /// range
    #[arg(long, conflicts_with_all = ["partial", "exposure", "tone", "white_balance"])]
    as_shard: bool,

    #[command(flatten)]
    look: LookArgs,

    /// Refuse images that need more memory than this
    #[arg(long, value_name = "SIZE", default_value = "4GiB", value_parser = values::bytes)]
    memory_limit: Bytes,

    #[command(flatten)]
    verbosity: VerbosityArgs,
}

/// Adds the sums of all shards. What can be refused by their headers is refused before any of the sums is read.
pub fn run(args: &MergeArgs) -> Result<Exit, Failure> {
    let terminal = Terminal::new(args.verbosity.verbosity());
    let outputs = Outputs::check(args.output.clone())?;
    let set = Set::of(&args.shards)?;
    let passes = &set.passes;
    let product = Product::of(args, &set, &outputs)?;

    let CheckpointHeader { sensor, crop, settings, .. } = &set.first;
    let contents = &set.contents;
    // Beside the film the sums of a shard, as integers and, where one is written, as a file.
    let times = if matches!(product, Product::Shard(_)) { 2 } else { 1 };
    let films = (1 + contents.layers.len() as u64).saturating_mul(Film::memory(crop.pixels()));
    check_memory(films.saturating_add(set.bytes.saturating_mul(times)), args.memory_limit, *crop)?;
    let foreign = || Failure::input(format!("cannot use '{}': its filter is unknown", args.shards[0].display()));
    let filter = filter_of(settings).ok_or_else(foreign)?;
    let sensor = Sensor { padding: filter.padding(), ..*sensor };
    let film = || Film::new(sensor, *crop, filter, set.first.scale);
    let (image, layers) = (film(), contents.layers.iter().map(|name| (name.as_str(), film())).collect::<Vec<_>>());
    let alpha_sums = contents.transparent.then(|| AlphaSums::new(*crop, filter));
    let layers = layers.iter().map(|(name, film)| (*name, film)).collect();
    let sums = Sums { film: &image, alpha_sums: alpha_sums.as_ref(), layers };
    for path in &args.shards {
        let file = open(path)?;
        // It was checked, and may have been replaced since.
        if Shape::of(file.header()).differs(&Shape::of(&set.first)).is_some() || file.contents() != contents {
            return Err(Failure::input(format!("'{}' changed while it was merged", path.display())));
        }
        file.add_to(&sums).map_err(|error| unusable(path, &error))?;
    }

    let exit = pass_loop::faults(&set.statistics, sums.errors(), terminal);
    let noise = pass_loop::noise(passes.noise(&image), passes.count(), &image);
    terminal.say(format_args!("{} spp from {} files, {noise}", passes.count(), args.shards.len()));
    match product {
        Product::Shard(passes) => {
            let counts = saved::counts(&set.statistics);
            let header = CheckpointHeader { passes, errors: sums.errors(), counts, ..set.first.clone() };
            outputs.write_bytes(encode_checkpoint(&sums, &header))?;
        }
        Product::Image(missing) => {
            if missing.count() > 0 {
                let (there, whole) = (passes.count(), set.whole);
                let only = format_args!("only {there} of {whole} samples per pixel are merged: {missing} are missing");
                terminal.warn(only);
            }
            let header = header(sensor, settings, &sums, passes);
            let picture = Picture {
                image: image.image(passes.count()),
                alpha: alpha_sums.as_ref().map(AlphaSums::alpha),
                layers: layers::images(&sums, passes.count()),
                data: Vec::new(),
            };
            outputs.write(&picture, &header, args.look.look(), terminal)?;
        }
    }
    terminal.say(outputs.said());
    Ok(exit)
}

/// What is made of the sums.
enum Product {
    /// An image without these passes.
    Image(Passes),
    /// A file of the sums of these passes.
    Shard(Range<u32>),
}

impl Product {
    /// Refuses what cannot be made of the passes that are there.
    fn of(args: &MergeArgs, set: &Set, outputs: &Outputs) -> Result<Self, Failure> {
        let (passes, missing) = (&set.passes, set.passes.missing(set.whole));
        if passes.count() == 0 {
            return Err(Failure::input("there is no sample in any of these files, so there is nothing to merge"));
        }
        if args.as_shard {
            outputs.refuse_png("a shard")?;
            let ranges = || Failure::input(format!("the samples {passes} are not one range, and those of a shard are"));
            return passes.range().map(Self::Shard).ok_or_else(ranges);
        }
        if missing.count() > 0 && !args.partial {
            return Err(Failure::input(format!(
                "of the samples 0 to {} there are none of the numbers {missing} in these files (--partial merges what \
                 is there)",
                set.whole - 1
            )));
        }
        Ok(Self::Image(missing))
    }
}

/// What the headers of all files say together.
struct Set {
    first: CheckpointHeader,
    contents: Contents,
    passes: Passes,
    /// How many passes there should be.
    whole: u32,
    statistics: Statistics,
    /// What the largest file takes while it is read.
    bytes: u64,
}

impl Set {
    /// Refuses files that are no parts of one render.
    fn of(paths: &[PathBuf]) -> Result<Self, Failure> {
        let mut set: Option<Self> = None;
        let mut ranges: Vec<Range<u32>> = Vec::new();
        for path in paths {
            let file = open(path)?;
            let header = file.header();
            let counted = saved::statistics(&header.counts);
            let counted = counted
                .ok_or_else(|| Failure::input(format!("cannot use '{}': its counts are unreadable", path.display())))?;
            // A render by time has as many passes as it made.
            let whole = header.whole.unwrap_or(header.passes.end);
            let set = set.get_or_insert_with(|| Self {
                first: header.clone(),
                contents: file.contents().clone(),
                passes: Passes::default(),
                whole,
                statistics: Statistics::default(),
                bytes: 0,
            });
            set.bytes = set.bytes.max(file.bytes());
            set.check(&paths[0], path, header, file.contents())?;
            if let Err(twice) = set.passes.insert(header.passes.clone()) {
                let other = ranges.iter().position(|range| range.contains(&twice.start)).unwrap_or_default();
                let (a, b) = (paths[other].display(), path.display());
                let twice = Passes::from(twice);
                return Err(Failure::input(format!("'{a}' and '{b}' both have the samples number {twice}")));
            }
            ranges.push(header.passes.clone());
            set.statistics.add(&counted);
        }
        // At least one file is required.
        set.ok_or_else(|| Failure::usage("there is nothing to merge"))
    }

    /// Refuses a file that belongs to another render than the first one.
    fn check(&self, first: &Path, path: &Path, header: &CheckpointHeader, contents: &Contents) -> Result<(), Failure> {
        let (a, b) = (first.display(), path.display());
        let refuse = |what: String| Err(Failure::input(format!("'{a}' and '{b}' are no parts of one image: {what}")));
        if let Some((here, there)) = Shape::of(&self.first).differs(&Shape::of(header)) {
            return refuse(format!("in the first {here}, in the other {there}"));
        }
        // The settings say which they are, so that only a file that no render wrote ends here.
        if self.contents != *contents {
            return refuse("they have other channels".to_owned());
        }
        if self.first.whole != header.whole {
            let whole = |whole: Option<u32>| whole.map_or("unknown".to_owned(), |whole| whole.to_string());
            let (here, there) = (whole(self.first.whole), whole(header.whole));
            return refuse(format!("the whole has {here} samples per pixel in the first, and {there} in the other"));
        }
        Ok(())
    }
}
