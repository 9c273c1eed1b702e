//! Light transport held against its definition, against closed forms, and against itself by other strategies.

#![allow(clippy::print_stdout, clippy::print_stderr)] // a test says what it measured

mod agreement;
mod alpha;
mod area;
mod back_faces;
mod cameras;
mod caustics;
mod closed_forms;
mod coincident;
mod covering;
mod dispersion;
mod exactness;
mod gallery;
mod gaps;
mod glass;
mod identity;
mod instances;
mod islands;
mod lanes;
mod layered;
mod layers;
mod lecture;
mod ledger;
mod lights;
mod media;
mod merging;
mod metamorphic;
mod normals;
mod operator;
mod options;
mod public;
mod range;
mod report;
mod robustness;
mod scenes;
mod shards;
mod strategies;
mod textures;
mod trace;
mod transparent;
mod variance;
