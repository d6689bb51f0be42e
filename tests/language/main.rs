//! Parts, arrays, effects and lines of cells.

#[path = "../support/mod.rs"]
mod support;

mod arrays;
mod definitions;
mod effects;
mod elements;
mod from_rust;
mod line;
mod parts;
mod rounds;
mod tables;
mod vector_models;
mod vectors;
