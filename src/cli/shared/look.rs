//! How PNG images look: `--exposure`, `--tone` and `--white-balance`.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use pathspace::film::{Exposure, Look, Tone, WhiteBalance};

use crate::cli::shared::values;

#[derive(Clone, Debug, clap::Args)]
pub struct LookArgs {
    /// Exposure of PNG images: radiances times 2^EV [default: automatic]
    #[arg(long, value_name = "EV", allow_negative_numbers = true, value_parser = values::finite)]
    exposure: Option<f32>,

    /// Tone curve of PNG images; .exr files have none
    #[arg(long, value_name = "NAME", default_value = "none", value_parser = tone())]
    tone: Tone,

    /// Light of this colour temperature looks white in PNG images, 1667 to 25000 kelvin; .exr files stay as they are
    /// [default: colours as they are, with white at 6504]
    #[arg(long, value_name = "K", allow_negative_numbers = true, value_parser = white_balance)]
    white_balance: Option<WhiteBalance>,
}

impl LookArgs {
    pub fn look(&self) -> Look {
        let exposure = self.exposure.map_or(Exposure::Auto, Exposure::Ev);
        Look { exposure, white_balance: self.white_balance, tone: self.tone }
    }
}

fn tone() -> impl TypedValueParser<Value = Tone> {
    let help = |tone: Tone| match tone {
        Tone::Clip => "What is brighter than white is white",
        Tone::Filmic => "Narkowicz' fit of ACES: contrast, and soft highlights",
        Tone::Agx => "AgX by Wrensch's approximation: bright colours fade to white",
    };
    let values = Tone::ALL.map(|tone| PossibleValue::new(tone.name()).help(help(tone)));
    let of = |name: String| Tone::ALL.into_iter().find(|tone| tone.name() == name);
    PossibleValuesParser::new(values).try_map(move |name| of(name).ok_or("there is no such tone curve"))
}

fn white_balance(text: &str) -> Result<WhiteBalance, String> {
    let [from, to] = WhiteBalance::RANGE;
    let known = values::finite(text).ok().and_then(WhiteBalance::new);
    known.ok_or_else(|| format!("a colour temperature from {from} to {to} kelvin is needed"))
}
