//! Parameters and start values from recordings.
//!
//! A model, recordings and how certain they are come in; estimates, their intervals and what the data does
//! not determine come out. [`fit`] simulates, [`filter`] goes row by row, [`regression`] does neither.
//!
//! ```text
//!   θ = (parameters, start values of each recording)
//!   e_r(t) = w(t; θ) − measured_r(t)                 simulated from the start of recording r
//!   minimise  Σ_r Σ_outputs Σ_samples (e / σ)²  +  Σ_priors ((p − mean) / std)²
//! ```
//!
//! | file | holds |
//! |---|---|
//! | `recording` | an experiment; its simulation and what its samples add to the normal equations |
//! | `linearised` | the same by the linear model close to an operating point |
//! | `variables` | from θ to variables of the order of 1, with bounds |
//! | `output_error` | the problem, and how it is solved |
//! | `multi_start` | the same from several points, and the minima that they end in |
//! | `weighing` | recordings simulated, weighed and added up |
//! | `fit` | what was found |
//! | `levenberg_marquardt`, `box_quadratic` | the minimisation |
//! | `loss` | what an error adds: its square, or less where it is large |
//! | `noise` | σ of each output: given, or from the residuals |
//! | `stepping` | how simulations step: the same way in all trials, where recordings allow it |
//! | `regression` | equations and outputs in which all else is known: least squares, recursive too |
//! | `nelder_mead` | the simplex method |
//! | `uncertainty` | covariance, and what the data does not determine |
//! | `around` | the problem of a fit again, next to where it ended |
//! | `along` | from a minimum outwards along one variable |
//! | `profile` | how far an estimate can go while the others make up for it |
//! | `bootstrap` | how estimates scatter when residuals come in another order |
//! | `information` | which samples determine which estimate |
//! | `random` | deviates from random bits |
//! | `progress` | who looks on, and may stop it |
//! | `journal` | results kept, so that a run that was ended goes on where it was |
//! | `filter` | states and parameters while samples come in, and by the likelihood of innovations |

mod along;
mod around;
mod beginning;
mod bootstrap;
mod box_quadratic;
mod error;
pub mod filter;
mod fit;
mod information;
pub mod journal;
mod levenberg_marquardt;
mod linearised;
mod loss;
mod multi_start;
mod nelder_mead;
mod noise;
mod output_error;
mod profile;
mod progress;
mod random;
mod recording;
pub mod regression;
mod stepping;
mod uncertainty;
mod variables;
mod weighing;

pub use beginning::{NoiseCorrelation, counts_from};
pub use bootstrap::{Bootstrap, bootstrap};
pub use error::{EstimateError, TrialFailed, TrialFailure};
pub use fit::Fit;
pub use information::{Information, information};
pub use levenberg_marquardt::{
    Minimum, NormalEquations, Region, StoppingRule, Termination, minimise, minimise_watched,
};
pub use linearised::{Departure, Nonlinear, nonlinear, operating_points};
pub use loss::{Loss, LossAt};
pub use multi_start::{LocalMinimum, MultiStart, PointEnd, fit_from, starting_points};
pub use nelder_mead::{Simplex, SimplexRule, nelder_mead};
pub use noise::{Noise, too_few_for_noise};
pub use output_error::{Evaluation, OutputErrorProblem, Prior, Starts, evaluate, fit, fit_starts};
pub use profile::{End, Profile, THRESHOLD, profile, profiles};
pub use progress::{Of, Progress, Unwatched, Watch};
pub use recording::{Misfit, Recording, outputs_with_sensitivities};
pub use stepping::Stepping;
pub use uncertainty::{Correlated, Estimate, Term, Undetermined};
pub use variables::Bound;
