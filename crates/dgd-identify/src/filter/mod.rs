//! Filters: track states and parameters as samples arrive.
//!
//! ```text
//!   dx = f_d(t, x, y_a, u, θ) dt + dβ,   0 = f_a(t, x, y_a, u, θ)     E dβ dβᵀ = Q_c dt
//!   w(t_k) = w(t_k, x, y_a, u, θ) + v_k,  dθ = dβ_θ                   E v vᵀ = R = diag(σ²)
//! ```
//!
//! x are the differential unknowns of the model; algebraic ones follow from the equations. Between two samples the
//! model's own solver moves the estimate, and its sensitivities are the transition matrix Φ = ∂(x, θ)(t_{k+1})/∂(x,
//! θ)(t_k). At a sample the generated derivatives of the outputs, chained through the algebraic unknowns, are the
//! measurement matrix.
//!
//! | file | contents |
//! |---|---|
//! | `problem` | tracked quantities, their uncertainties and the defaults of these |
//! | `coordinates` | transforms states and parameters to variables of the order of 1, and back |
//! | `drive` | samples of the inputs as functions of time over the current interval |
//! | `interval` | the model over one interval, and its derivatives at one time |
//! | `remembered` | past values of delayed unknowns, and their uncertainty |
//! | `delayed_outputs` | delayed outputs |
//! | `square_root` | covariances as triangular factors |
//! | `estimator` | the filter, row by row |
//! | `prediction` | from one row to the next |
//! | `correction` | correction by the samples of a row |
//! | `unscented` | sigma points |
//! | `watch` | consistency test of the innovations |
//! | `prediction_error` | parameters and noise levels by the likelihood of the innovations |
//! | `likelihood` | that likelihood, and its derivatives |
//! | `profile` | the likelihood along an estimate |
//! | `levels` | noise levels as variables |
//! | `secant` | difference between its Hessian and the information |
//! | `side_by_side` | filters with several sets of numbers along one recording |
//!
//! Modes follow the prediction as in a simulation: a transition occurs where the estimate passes its threshold, and the
//! covariance passes through it like sensitivities, S⁺ = D⁺ − ẏ⁺ τ with the derivatives τ of its time (the saltation
//! matrix). An unknown that is differential in some modes only is always treated as a state; while it is algebraic, it
//! follows the others, and so does its uncertainty. A correction does not change modes: a condition that it makes true
//! acts at the start of the next interval. A correction does not move a state at its bound, because that state has no
//! uncertainty.
//!
//! If a model or an output reads delayed unknowns, these are tracked, too: as variables in addition to the present
//! ones, which samples correct. Treating them as known would make standard deviations many times too small. Delays that
//! vary with the unknowns are refused, [`FilterError::NotFollowed`].

mod coordinates;
mod correction;
mod delayed_outputs;
mod drive;
mod error;
mod estimator;
mod interval;
mod likelihood;
mod prediction;
mod problem;
mod remembered;
mod square_root;
mod unscented;
mod watch;

pub use error::{FilterError, OptionOutOfRange};
pub use estimator::{Innovation, RunningFilter, TrackedEstimate, TrackedRow};
pub use likelihood::prediction_error::{
    LevelEstimate, NoiseLevelSource, PredictionError, PredictionErrorProblem, prediction_error,
    predictions,
};
pub use likelihood::profile::prediction_error_profiles;
pub use problem::{
    FilterAlgorithm, FilterProblem, FilterSample, FilterTuning, RandomWalk, usual_tuning,
};
pub use unscented::SigmaSpread;
pub use watch::InnovationAlarm;
