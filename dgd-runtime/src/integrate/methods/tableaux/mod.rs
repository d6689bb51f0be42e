//! Coefficients of methods: the types of tableaux, and one file of numbers per method.

mod kencarp4;
mod rodas4;
mod rodas5p;
mod rosenbrock;
mod runge_kutta;
mod triangle;
mod tsit5;

pub use kencarp4::KENCARP4;
pub use rodas4::RODAS4;
pub use rodas5p::RODAS5P;
pub use rosenbrock::RosenbrockTableau;
pub(in crate::integrate) use runge_kutta::extrapolate;
pub use runge_kutta::{EqualSteps, RungeKuttaTableau};
pub use triangle::{LowerTriangle, MAX_STAGES, triangle};
pub use tsit5::TSIT5;
