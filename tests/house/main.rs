//! How the code is laid out and how it reads: which crates and folders may use which, that files have a purpose and paths exist.

mod circles;
mod dependencies;
mod faces;
mod layers;
mod names;
mod paths;
mod purpose;
mod results;
mod source;
mod unsafety;
mod words;
