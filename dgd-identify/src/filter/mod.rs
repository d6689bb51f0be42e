//! States and parameters while samples come in: filters.
//!
//! ```text
//!   dx = f_d(t, x, y_a, u, θ) dt + dβ,   0 = f_a(t, x, y_a, u, θ)     E dβ dβᵀ = Q_c dt
//!   w(t_k) = w(t_k, x, y_a, u, θ) + v_k,  dθ = dβ_θ                   E v vᵀ = R = diag(σ²)
//! ```
//!
//! x are the differential unknowns of the model; algebraic ones follow from the equations. Between two
//! samples the model's own solver moves the estimate, and its sensitivities are the transition matrix
//! Φ = ∂(x, θ)(t_{k+1})/∂(x, θ)(t_k). At a sample the outputs' generated derivatives, chained through the
//! algebraic unknowns, are the measurement matrix.
//!
//! | file | holds |
//! |---|---|
//! | `problem` | what is tracked and how uncertain it is, with the usual values where nobody says |
//! | `coordinates` | from states and parameters to variables of the order of 1, and back |
//! | `drive` | samples of the inputs as functions of time over the interval at hand |
//! | `interval` | the model over one interval, and its derivatives at one time |
//! | `remembered` | what unknowns that are read late were, and how uncertain |
//! | `late_outputs` | outputs that are read late |
//! | `square_root` | covariances as triangular factors |
//! | `estimator` | one row after the other |
//! | `prediction` | from one row to the next |
//! | `correction` | what a row's samples say |
//! | `unscented` | sigma points |
//! | `watch` | whether the innovations are what the filter expects |
//! | `prediction_error` | parameters and noise levels by the likelihood of the innovations |
//! | `likelihood` | that likelihood, and its derivatives |
//! | `profile` | the likelihood along an estimate |
//! | `levels` | levels of noise as variables |
//! | `secant` | what its Hessian is beside the information |
//! | `side_by_side` | filters with several sets of numbers along one recording |
//!
//! Modes go along with the prediction as in a simulation: a transition is located where the estimate passes its
//! threshold, and the covariance goes through it as sensitivities do, S⁺ = D⁺ − ẏ⁺ τ with the derivatives τ of
//! its time (the saltation matrix). An unknown that is differential in some modes only is a state all the time;
//! where it is algebraic, it follows the others, and so does its uncertainty. A correction does not change
//! modes: a condition that it makes true acts when the next interval begins. What a correction makes of a
//! state at its bound is nothing, as it is certain to be there.
//!
//! Where a model or an output reads what unknowns were, that is tracked, too: as variables beside the present
//! ones, which samples correct. Taken as known it would make standard deviations many times too small. Delays that
//! vary with the unknowns are refused, [`FilterError::NotFollowed`].

mod coordinates;
mod correction;
mod drive;
mod error;
mod estimator;
mod interval;
mod late_outputs;
mod likelihood;
mod prediction;
mod problem;
mod remembered;
mod square_root;
mod unscented;
mod watch;

pub use error::{FilterError, Missing};
pub use estimator::{Filter, Innovation, Row, Tracked};
pub use likelihood::prediction_error::{
    Level, LevelEstimate, PredictionError, PredictionErrorProblem, prediction_error, predictions,
};
pub use likelihood::profile::prediction_error_profiles;
pub use problem::{Estimator, FilterProblem, Sample, Tuning, Walk, usual_tuning};
pub use unscented::Spread;
pub use watch::Alarm;
