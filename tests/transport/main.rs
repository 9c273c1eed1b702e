//! Light transport held against its definition, against closed forms, and against itself by other strategies.

mod agreement;
mod exactness;
mod furnace;
mod identity;
mod public;
mod report;
mod scenes;
mod statistics;
