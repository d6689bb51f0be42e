//! Estimates parameters and start values from recordings.
//!
//! The input is a model, recordings and their noise; the results are estimates, their intervals, and undetermined
//! combinations. [`fit`] simulates, [`filter`] works row by row, [`regression`] does neither.
//!
//! ```text
//!   θ = (parameters, start values of each recording)
//!   e_r(t) = w(t; θ) − measured_r(t)                 simulated from the start of recording r
//!   minimise  Σ_r Σ_outputs Σ_samples (e / σ)²  +  Σ_priors ((p − mean) / std)²
//! ```
//!
//! | file or folder | contents |
//! |---|---|
//! | `recording` | an experiment; its simulation and the contribution of its samples to the normal equations |
//! | `variables` | transforms θ to variables of the order of 1, with bounds |
//! | `noise` | σ of each output: given, estimated from residuals or computed; loss functions |
//! | `minimise` | a trust region within bounds, and the simplex method |
//! | `output_error` | fits that simulate |
//! | `regression` | equations and outputs with only unknown parameters: least squares, also recursive |
//! | `inversion` | the missing term of an equation whose other quantities were measured |
//! | `filter` | states and parameters as samples arrive, and by the likelihood of innovations |
//! | `uncertainty`, `intervals` | covariances; profiles and resampled data; informative samples; spread between parts |
//! | `progress` | progress and cancellation |
//! | `journal` | stored results, so that an interrupted run can continue |
//! | `random` | deviates from random bits |

mod error;
pub mod filter;
mod intervals;
pub mod inversion;
pub mod journal;
mod minimise;
mod noise;
mod output_error;
mod progress;
mod random;
mod recording;
pub mod regression;
mod uncertainty;
mod variables;

pub use error::{EstimateError, TrialFailed, TrialFailure, WrongLength, WrongReading};
pub use intervals::bootstrap::{Bootstrap, bootstrap, percentiles};
pub use intervals::information::{Information, information};
pub use intervals::profile::{Profile, ProfileEnd, THRESHOLD, profile, profiles};
pub use intervals::spread::{Jackknife, JackknifeBlock, SpreadAt, spread};
pub use minimise::nelder_mead::{Simplex, SimplexRule, nelder_mead};
pub use minimise::trust_region::{
    Minimum, NormalEquations, StoppingRule, Termination, VariableRegion, minimise, minimise_watched,
};
pub use noise::loss::{Loss, LossAt};
pub use noise::shape::NoiseShape;
pub use noise::{JudgedReading, NoiseSource, too_few_for_noise};
pub use output_error::beginning::{NoiseCorrelation, counts_from};
pub use output_error::fit::{Criteria, Fit};
pub use output_error::linearised::{ModeDeparture, NonlinearModel, nonlinear, operating_points};
pub use output_error::multi_start::points::{DrawnFrom, StartingPoints, starting_points};
pub use output_error::multi_start::{
    LocalMinimum, MultiStart, PointEnd, fit_from, fit_from_drawn, fit_from_point,
};
pub use output_error::prior::Prior;
pub use output_error::stepping::FitStepping;
pub use output_error::{
    OutputErrorEvaluation, OutputErrorProblem, Starts, evaluate, fit, fit_starts,
};
pub use progress::{Monitor, NoMonitor, Progress, Total};
pub use recording::{
    DerivativeUse, OutputMisfit, Recording, outputs_of, outputs_with_sensitivities,
};
pub use uncertainty::{CombinationTerm, CorrelatedPair, ParameterEstimate, UndeterminedDirection};
pub use variables::BoundReached;
