//! States and parameters to track, and their uncertainties.

use dgd_runtime::for_identify::{differential_somewhere, parameter_size, unknown_sizes};
use dgd_runtime::model::Model;
use dgd_runtime::{Direction, Inputs, Options, Problem, consistent_start};

use super::error::{FilterError, OptionOutOfRange};
use super::unscented::SigmaSpread;

/// Default initial uncertainty of a state, relative to its size.
const STATE_START: f64 = 0.1;
/// Default initial uncertainty of a free parameter, relative to its size.
const PARAMETER_START: f64 = 0.3;
/// Default process noise of a state in a minute, relative to its size.
const STATE_WALK: f64 = 1e-3;
/// Default process noise of a free parameter in an hour, relative to its size.
const PARAMETER_WALK: f64 = 0.1;

const MINUTE: f64 = 60.0;
const HOUR: f64 = 3600.0;

/// The algorithm that moves and corrects estimates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FilterAlgorithm {
    /// Extended Kalman filter: covariances follow the linearised model.
    ///
    /// # Source
    ///
    /// Jazwinski, Stochastic Processes and Filtering Theory (1970), §8.3; in square-root array form
    /// Kailath, Sayed, Hassibi, Linear Estimation (2000), §12.3.
    ExtendedKalman,
    /// Unscented Kalman filter: the model moves points with the same covariance.
    ///
    /// # Source
    ///
    /// Julier, Uhlmann, A new extension of the Kalman filter to nonlinear systems (1997); Wan, van der
    /// Merwe, The unscented Kalman filter for nonlinear estimation (2000).
    Unscented(SigmaSpread),
    /// Recursive prediction error method on the simulated model: parameters and start values by recursive
    /// least squares, with the model's sensitivities ψ = ∂ŵ/∂θ as regressors.
    ///
    /// The simulation is moved with the estimates, x ← x + ∂x/∂θ Δθ: to first order, this is the model simulated with
    /// the current estimates. States have no process noise.
    ///
    /// # Source
    ///
    /// Ljung, Söderström, Theory and Practice of Recursive Identification (1983), §3.7.
    Recursive {
        /// λ in (0, 1]: weight of a sample relative to the next one. It applies to parameters, not to start values.
        forgetting_factor: f64,
        /// R₀: a step that would bring the largest eigenvalue of the parameters' covariance above it leaves the
        /// covariance unchanged (Haukanes 2015, Table 3.1). Relative to the initial largest eigenvalue.
        most_covariance: f64,
    },
}

/// Initial uncertainty and process noise of a quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RandomWalk {
    /// Initial standard deviation, SI.
    pub start: f64,
    /// Process noise: standard deviation of the random walk after one second, SI/√s, the root of its spectral density.
    pub rate: f64,
}

/// Noise and uncertainties.
///
///  field | length: one for each |
/// |---|---|
/// | `states` | unknown that is differential in some mode, in the order of y |
/// | `parameters` | free parameter, in the order of the model's directions |
/// | `noise` | output |
#[derive(Debug, Clone, PartialEq)]
pub struct FilterTuning {
    /// The states.
    pub states: Vec<RandomWalk>,
    /// The free parameters. Their process noise never increases them beyond their initial uncertainty, so that
    /// parameters without information in the data do not wind up.
    pub parameters: Vec<RandomWalk>,
    /// σ of the outputs, SI; `None` for an unused one.
    pub noise: Vec<Option<f64>>,
}

impl FilterTuning {
    /// Standard deviations before the first row, SI: states, then parameters.
    pub fn start_stds(&self) -> Vec<f64> {
        self.states.iter().chain(&self.parameters).map(|walk| walk.start).collect()
    }
}

/// A filter problem: the quantities to track.
#[derive(Debug, Clone)]
pub struct FilterProblem<'a> {
    /// The model. Its directions are the parameters that can be free and the start values of all unknowns that are
    /// differential in some mode.
    pub system: &'a dyn Model,
    /// All parameters, SI: values of fixed ones, first estimates of free ones.
    pub p: &'a [f64],
    /// Which of the directions are free; only parameters matter because states are always tracked.
    pub free: Vec<bool>,
    /// Start values that replace the model's, by position of the unknown, SI.
    pub start: Vec<(usize, f64)>,
    /// The algorithm that moves and corrects estimates.
    pub estimator: FilterAlgorithm,
    /// Samples whose innovation exceeds this many of its standard deviations are ignored.
    pub gate: Option<f64>,
    /// Integrator options.
    pub options: Options,
}

impl<'a> FilterProblem<'a> {
    /// An extended Kalman filter in which all parameters with a direction are free.
    pub fn new(system: &'a dyn Model, p: &'a [f64]) -> Self {
        Self {
            system,
            p,
            free: vec![true; system.signature().directions.len()],
            start: Vec::new(),
            estimator: FilterAlgorithm::ExtendedKalman,
            gate: None,
            options: Options::default(),
        }
    }

    /// Positions of the unknowns that are differential, in some mode.
    pub fn states(&self) -> Vec<usize> {
        states_of(self.system)
    }

    /// Positions of the free parameters, in the order of the directions.
    pub fn parameters(&self) -> Vec<usize> {
        let directions = self.system.signature().directions.iter().zip(&self.free);
        directions
            .filter_map(|(direction, free)| match direction {
                Direction::Parameter(i) if *free => Some(*i),
                Direction::Parameter(_) | Direction::Start(_) => None,
            })
            .collect()
    }
}

/// Positions of the unknowns that are differential, in some mode.
pub(super) fn states_of(system: &dyn Model) -> Vec<usize> {
    let somewhere = differential_somewhere(&system);
    (0..somewhere.len()).filter(|i| somewhere[*i]).collect()
}

/// The readings at one time.
#[derive(Debug, Clone, Copy)]
pub struct FilterSample<'a> {
    /// Time, s.
    pub t: f64,
    /// Inputs as declared, SI; NaN for a missing one, which keeps its last value.
    pub u: &'a [f64],
    /// Outputs, SI; NaN for a missing one.
    pub measured: &'a [f64],
}

/// Default noise and uncertainties: the outputs' declared noise; for states, an uncertainty of 10 % of their size and
/// process noise of 0.1 % in a minute; for parameters, an uncertainty of 30 % and process noise of 10 % in an hour.
///
/// # Errors
///
/// [`FilterError::Start`]: the sizes of states without declared nominal values are those of their start values.
pub fn usual_tuning(
    problem: &FilterProblem<'_>,
    first: FilterSample<'_>,
) -> Result<FilterTuning, FilterError> {
    let FilterProblem { system, p, start, options, .. } = problem;
    let signature = system.signature();
    verify_first_inputs(problem, first)?;
    let inputs = Inputs::constant(first.u);
    let started = Problem { system, p, inputs: &inputs, start };
    let y = consistent_start(&started, first.t, options).map_err(FilterError::Start)?.y;
    let mut sizes = vec![0.0; y.len()];
    unknown_sizes(system, &y, &mut sizes);
    let states = problem.states();
    let state = |i: &usize| RandomWalk {
        start: STATE_START * sizes[*i],
        rate: STATE_WALK * sizes[*i] / MINUTE.sqrt(),
    };
    let parameter = |i: &usize| {
        // A logarithm has size 1, and its derivative is the value.
        let log = signature.parameters[*i].log;
        let size = if log { p[*i].abs() } else { parameter_size(system, *i) };
        RandomWalk { start: PARAMETER_START * size, rate: PARAMETER_WALK * size / HOUR.sqrt() }
    };
    Ok(FilterTuning {
        states: states.iter().map(state).collect(),
        parameters: problem.parameters().iter().map(parameter).collect(),
        noise: signature.outputs.iter().map(|output| output.noise).collect(),
    })
}

/// Checks that all inputs have a value in the first row.
pub(super) fn verify_first_inputs(
    problem: &FilterProblem<'_>,
    first: FilterSample<'_>,
) -> Result<(), FilterError> {
    let inputs = &problem.system.signature().inputs;
    match first.u.iter().position(|u| !u.is_finite()) {
        Some(i) => Err(FilterError::FirstInput { input: inputs[i].name.to_string() }),
        None => Ok(()),
    }
}

/// Checks numbers that may come from a user.
pub(super) fn verify_tuning(
    problem: &FilterProblem<'_>,
    tuning: &FilterTuning,
) -> Result<(), FilterError> {
    let signature = problem.system.signature();
    let wrong = |of: String, value, expected| {
        Err(FilterError::Option(OptionOutOfRange { of, value, expected }))
    };
    for (output, noise) in signature.outputs.iter().zip(&tuning.noise) {
        if let Some(sigma) = *noise
            && !(sigma > 0.0 && sigma.is_finite())
        {
            let subject = format!("the noise of output `{}`", output.name);
            return wrong(subject, sigma, "a positive number");
        }
    }
    let states = problem.states().into_iter().map(|i| signature.unknowns.name(i));
    let parameters = problem.parameters().into_iter().map(|i| signature.parameters[i].name.clone());
    let walks = tuning.states.iter().chain(&tuning.parameters);
    for (name, walk) in states.chain(parameters).zip(walks) {
        for (what, value) in [("first uncertainty", walk.start), ("walk", walk.rate)] {
            if !(value >= 0.0 && value.is_finite()) {
                return wrong(format!("the {what} of `{name}`"), value, "zero or above");
            }
        }
    }
    if let Some(gate) = problem.gate
        && !(gate > 0.0 && gate.is_finite())
    {
        return wrong("the gate".to_owned(), gate, "a positive number");
    }
    match problem.estimator {
        FilterAlgorithm::Recursive { forgetting_factor: factor, .. }
            if !(factor > 0.0 && factor <= 1.0) =>
        {
            wrong("the forgetting factor".to_owned(), factor, "above 0 and at most 1")
        }
        FilterAlgorithm::Recursive { most_covariance: most, .. } if most.is_nan() || most < 1.0 => {
            wrong("the most covariance".to_owned(), most, "at least 1, in units of the first")
        }
        FilterAlgorithm::Unscented(spread) => {
            spread.verify(problem.states().len() + problem.parameters().len())
        }
        FilterAlgorithm::ExtendedKalman | FilterAlgorithm::Recursive { .. } => Ok(()),
    }
}
