//! `--layer` and `--layers`: images of some of the paths beside the image of all.

use std::collections::BTreeMap;

use pathspace::{
    film::{Contents, Film, Image, Sums},
    layers::{Expression, LONGEST_NAME, LayerError, LayerSet, Layers},
    render::Renderer,
    scene::Scene,
};

use crate::cli::shared::{args::SizeArgs, exit::Failure, pictures::Outputs};

/// Layers as channels of the .exr file.
#[derive(Clone, Debug, clap::Args)]
pub struct LayerArgs {
    /// A layer of the paths that a light path expression holds for.
    #[arg(long, value_name = "NAME=EXPR", value_parser = layer, help = LAYER)]
    layer: Vec<(String, Expression)>,

    /// Ready-made layers: one for each length of paths (bounces) or up to it (neumann), classes, lights, or
    /// strategies (s,t), weighted or unweighted
    #[arg(long, value_name = "SET", value_delimiter = ',')]
    layers: Vec<LayerSet>,
}

// A constant and no comment: rustdoc takes brackets for links.
const LAYER: &str = "A layer of the paths that a light path expression holds for, as channels NAME.R, NAME.G and \
    NAME.B of the \
    .exr file: C camera, D diffuse, G glossy, S specular, R reflected, T transmitted, L light, '.' anything, \
    <TS'glass'> at a \
    material, <L sun> of a kind (surface, point, spot, sun, sky), [DG], [^S], *, +, ?, {n,m}, |, (…). Such as \
    caustics='C.*[DG]S+L'";

/// Of an image in memory besides its film, and of its channels in a file before it is written.
const BYTES_PER_PIXEL: u64 = 12 + 24;

impl LayerArgs {
    /// Refuses what does not go together.
    pub fn check(&self, outputs: &Outputs) -> Result<(), Failure> {
        if self.layer.is_empty() && self.layers.is_empty() {
            return Ok(());
        }
        let mut taken: Vec<&str> = self.layers.iter().map(|set| set.name()).collect();
        taken.extend(self.layer.iter().map(|(name, _)| name.as_str()));
        taken.sort_unstable();
        if let Some(twice) = taken.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(Failure::usage(format!("there are two layers '{}'; give one another name", twice[0])));
        }
        if !outputs.holds_layers() {
            return Err(Failure::usage("layers are channels of an .exr file, and no output is one (-o OUT.exr)"));
        }
        Ok(())
    }

    /// Whether a layer has this name.
    pub fn has(&self, name: &str) -> bool {
        self.layer.iter().any(|(found, _)| found == name)
    }

    /// The layers for this scene, if there is room for them beside `data` bytes.
    pub fn choose(
        &self,
        size: &SizeArgs,
        data: u64,
        scene: &Scene,
        renderer: &Renderer<'_>,
    ) -> Result<Layers, Failure> {
        let layers = Layers::new(&self.layers, &self.layer, scene, renderer.integrator()).map_err(|e| refuse(&e))?;
        let crop = renderer.film().crop();
        let (pixels, films) = (crop.pixels(), layers.len() as u64 + 1);
        // As without layers: the image, or a checkpoint as integers and as a file.
        let contents = Contents { layers: layers.names().map(str::to_owned).collect(), ..renderer.sums().contents() };
        let written = (films * BYTES_PER_PIXEL * pixels).max(2 * contents.bytes(pixels));
        size.check_memory(films * Film::memory(pixels) + written + data, crop)?;
        Ok(layers)
    }

    /// What an image's header says of them.
    pub fn record(&self, recorded: &mut BTreeMap<String, String>) {
        let sets = self.layers.iter().map(|set| set.name().to_owned());
        let all: Vec<_> = sets.chain(self.layer.iter().map(|(name, text)| format!("{name}={text}"))).collect();
        if !all.is_empty() {
            recorded.insert("layers".to_owned(), all.join("; "));
        }
    }
}

/// The images of the layers with their names.
pub fn images(sums: &Sums<'_>, passes: u32) -> Vec<(String, Image)> {
    sums.layers.iter().map(|(name, film)| ((*name).to_owned(), film.image(passes))).collect()
}

fn refuse(error: &LayerError) -> Failure {
    Failure::usage(format!("--layer: {error}"))
}

fn layer(text: &str) -> Result<(String, Expression), String> {
    let Some((name, expression)) = text.split_once('=') else {
        return Err("a layer is NAME=EXPR, such as caustics='C.*[DG]S+L'".to_owned());
    };
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if name.is_empty() || !name.chars().all(plain) {
        return Err(format!("'{name}' is no name of a layer: these are letters, digits, '-' and '_'"));
    }
    if name.len() > LONGEST_NAME {
        return Err(format!("this name of a layer has {} letters, and {LONGEST_NAME} is the limit", name.len()));
    }
    Ok((name.to_owned(), Expression::parse(expression).map_err(|error| error.to_string())?))
}
