//! Families of methods: each tries a step, and leaves the judgement to its caller.

pub mod catalogue;
mod esdirk;
mod explicit_rk;
pub(in crate::integrate) mod family;
pub(in crate::integrate) mod multistep;
mod newton;
pub(in crate::integrate) mod non_finite;
pub(in crate::integrate) mod rosenbrock;
pub(in crate::integrate) mod stepper;
pub mod tableaux;
pub(in crate::integrate) mod taylor;
