//! One file of coefficients per method.

mod rodas5p;

pub use rodas5p::RODAS5P;
