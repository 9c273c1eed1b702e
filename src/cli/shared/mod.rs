//! What several commands have in common: their options, what they read and write, and how they talk.

pub mod args;
pub mod camera;
pub mod choice;
pub mod denoised;
pub mod environment;
pub mod exit;
pub mod header;
pub mod image;
pub mod interrupt;
pub mod layers;
pub mod listening;
pub mod look;
pub mod number;
pub mod opened;
pub mod passes;
pub mod pictures;
pub mod progress;
pub mod saved;
pub mod terminal;
pub mod values;
