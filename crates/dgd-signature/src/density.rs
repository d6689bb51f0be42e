//! How readings scatter around outputs whose `noise` is more than a number.

/// How the readings of an output are distributed where a plain standard deviation does not say it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Density {
    /// Position of the output.
    pub output: usize,
    /// Position of the output that computes σ, behind those that the model declares. For
    /// [`Distribution::LogNormal`] it is a plain number, otherwise it has the unit of the output.
    pub deviation: usize,
    /// What σ is the scale of.
    pub distribution: Distribution,
}

/// The density of a reading y around the output w.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Distribution {
    /// Normal, with the standard deviation σ.
    Normal,
    /// ln y is normal around ln w, with the standard deviation σ.
    LogNormal,
    /// (y − w)/σ has Student's t distribution.
    Student {
        /// Its degrees of freedom, above zero.
        freedom: f64,
    },
}
