//! What is known of a parameter beforehand.

/// The density of a parameter p.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PriorDensity {
    /// Normal.
    Normal {
        /// Its mean.
        mean: f64,
        /// Its standard deviation.
        std: f64,
    },
    /// ln p is normal.
    LogNormal {
        /// Its median, above zero.
        median: f64,
        /// The standard deviation of ln p.
        sigma: f64,
    },
    /// Constant within bounds.
    Uniform {
        /// The lower one.
        lower: f64,
        /// The upper one.
        upper: f64,
    },
    /// e^(−|p − median|/scale)/(2 scale).
    Laplace {
        /// Its median.
        median: f64,
        /// Its scale.
        scale: f64,
    },
    /// p^(shape − 1) e^(−p/scale), without its factor.
    Gamma {
        /// Its shape, 1 or more.
        shape: f64,
        /// Its scale.
        scale: f64,
    },
}

impl PriorDensity {
    /// Its mean.
    pub fn mean(self) -> f64 {
        match self {
            Self::Normal { mean, .. } => mean,
            Self::LogNormal { median, sigma } => median * (0.5 * sigma * sigma).exp(),
            Self::Uniform { lower, upper } => 0.5 * (lower + upper),
            Self::Laplace { median, .. } => median,
            Self::Gamma { shape, scale } => shape * scale,
        }
    }

    /// Its standard deviation.
    pub fn std(self) -> f64 {
        match self {
            Self::Normal { std, .. } => std,
            Self::LogNormal { sigma, .. } => self.mean() * (sigma * sigma).exp_m1().sqrt(),
            Self::Uniform { lower, upper } => (upper - lower) / 12.0_f64.sqrt(),
            Self::Laplace { scale, .. } => std::f64::consts::SQRT_2 * scale,
            Self::Gamma { shape, scale } => shape.sqrt() * scale,
        }
    }

    /// Its word in a model.
    pub fn name(self) -> &'static str {
        match self {
            Self::Normal { .. } => "normal",
            Self::LogNormal { .. } => "lognormal",
            Self::Uniform { .. } => "uniform",
            Self::Laplace { .. } => "laplace",
            Self::Gamma { .. } => "gamma",
        }
    }
}
