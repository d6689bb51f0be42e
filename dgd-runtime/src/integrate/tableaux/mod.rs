//! One file of coefficients per method.

mod kencarp4;
mod rodas5p;
mod tsit5;

pub use kencarp4::KENCARP4;
pub use rodas5p::RODAS5P;
pub use tsit5::TSIT5;
