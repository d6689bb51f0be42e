//! Transforms estimated quantities to variables of the order of 1, and back.
//!
//! | θ | variable z | bounds |
//! |---|---|---|
//! | a parameter | p / size | the model's, over size |
//! | a parameter with `log` | ln p | logarithms of the model's |
//! | a start value | y₀ / size | none |
//!
//! Parameters are shared by all recordings; each recording has start values of its own. Variables are in this order:
//! parameters, then the start values of the first recording, of the second, ….

use dgd_runtime::for_identify::{parameter_size, start_values, unknown_sizes};
use dgd_runtime::model::Model;
use dgd_runtime::{Direction, EvaluationPoint, InitialError, LimitSide, Problem, discrete_numbers};
use dgd_runtime::{IntegrateError, Signature};

use crate::error::{EstimateError, TrialFailed, TrialFailure};
use crate::recording::{DirectionColumn, Recording};

/// Limit on the factor by which a step of a search changes a quantity with a logarithmic variable.
pub(crate) const LARGEST_FACTOR: f64 = 10.0;

/// A bound that an estimate has reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BoundReached {
    /// The lower.
    Lower,
    /// The upper.
    Upper,
}

/// A variable of the fit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FitVariable {
    /// The quantity.
    pub of: Direction,
    /// The recording, for a start value.
    pub recording: Option<usize>,
    /// Position among the model's directions.
    direction: usize,
    pub scale: VariableScale,
    /// Bounds of the quantity, SI.
    lower: f64,
    upper: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum VariableScale {
    /// θ = z · size
    Linear(f64),
    /// θ = exp z
    Logarithm,
}

impl FitVariable {
    /// θ, SI.
    pub(crate) fn value(&self, z: f64) -> f64 {
        let value = match self.scale {
            VariableScale::Linear(size) => z * size,
            VariableScale::Logarithm => z.exp(),
        };
        // Snaps to the bound in spite of rounding errors.
        value.clamp(self.lower, self.upper)
    }

    /// z of a value in SI.
    pub(crate) fn variable(&self, value: f64) -> f64 {
        match self.scale {
            VariableScale::Linear(size) => value / size,
            VariableScale::Logarithm => value.ln(),
        }
    }

    /// ∂θ/∂z.
    pub(crate) fn slope(&self, z: f64) -> f64 {
        match self.scale {
            VariableScale::Linear(size) => size,
            VariableScale::Logarithm => z.exp(),
        }
    }

    /// Limit on a step of a search.
    pub(crate) fn reach(&self) -> f64 {
        match self.scale {
            VariableScale::Linear(_) => f64::INFINITY,
            VariableScale::Logarithm => LARGEST_FACTOR.ln(),
        }
    }

    /// The bound at which z lies.
    pub(crate) fn bound(&self, z: f64) -> Option<BoundReached> {
        let (low, high) = self.bounds();
        if z <= low {
            Some(BoundReached::Lower)
        } else if z >= high {
            Some(BoundReached::Upper)
        } else {
            None
        }
    }

    /// Bounds of z.
    pub(crate) fn bounds(&self) -> (f64, f64) {
        match self.scale {
            VariableScale::Linear(_) => (self.variable(self.lower), self.variable(self.upper)),
            VariableScale::Logarithm => (self.lower.max(0.0).ln(), self.upper.ln()),
        }
    }
}

/// All variables of a fit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FitVariables {
    pub all: Vec<FitVariable>,
    /// Number of leading variables that are parameters.
    pub n_shared: usize,
    /// Number of start values of each recording.
    pub n_start: usize,
}

impl FitVariables {
    /// Variables for the free directions, and their initial values.
    pub(crate) fn new(
        system: &dyn Model,
        p: &[f64],
        recordings: &[Recording],
        free: &[bool],
    ) -> Result<(Self, Vec<f64>), EstimateError> {
        let signature = system.signature();
        let directions =
            || signature.directions.iter().copied().enumerate().filter(|(j, _)| free[*j]);
        let (mut all, mut z) = (Vec::new(), Vec::new());
        for (direction, of) in directions() {
            let Direction::Parameter(i) = of else { continue };
            let parameter = &signature.parameters[i];
            let scale = if parameter.log {
                VariableScale::Logarithm
            } else {
                VariableScale::Linear(parameter_size(&system, i))
            };
            let (lower, upper) = (parameter.lower, parameter.upper);
            let variable = FitVariable { of, recording: None, direction, scale, lower, upper };
            let value = p[i].clamp(lower, upper);
            if parameter.log && (value.is_nan() || value <= 0.0) {
                let parameter = parameter.name.to_string();
                return Err(EstimateError::NotPositive { parameter, value });
            }
            let (low, high) = variable.bounds();
            z.push(variable.variable(value).clamp(low, high));
            all.push(variable);
        }
        let n_shared = all.len();
        for (r, recording) in recordings.iter().enumerate() {
            let start = first_start(system, p, recording)
                .map_err(|reason| EstimateError::Start(TrialFailed { recording: r, reason }))?;
            let mut sizes = vec![0.0; start.len()];
            unknown_sizes(&system, &start, &mut sizes);
            for (direction, of) in directions() {
                let Direction::Start(i) = of else { continue };
                let variable = FitVariable {
                    of,
                    recording: Some(r),
                    direction,
                    scale: VariableScale::Linear(sizes[i]),
                    lower: f64::NEG_INFINITY,
                    upper: f64::INFINITY,
                };
                z.push(variable.variable(start[i]));
                all.push(variable);
            }
        }
        let n_start = (all.len() - n_shared).checked_div(recordings.len()).unwrap_or(0);
        Ok((Self { all, n_shared, n_start }, z))
    }

    pub(crate) fn len(&self) -> usize {
        self.all.len()
    }

    /// Limit on a step in each.
    pub(crate) fn reach(&self) -> Vec<f64> {
        self.all.iter().map(FitVariable::reach).collect()
    }

    /// Number of variables that are not at a bound, the degrees of freedom that they use.
    pub(crate) fn unheld(&self, z: &[f64]) -> usize {
        self.all.iter().zip(z).filter(|(variable, z)| variable.bound(**z).is_none()).count()
    }

    /// Position of the variable of a parameter, if it is free.
    pub(crate) fn parameter(&self, i: usize) -> Option<usize> {
        self.all.iter().position(|variable| variable.of == Direction::Parameter(i))
    }

    /// Position of the i-th of a recording's own variables: the shared ones, then its start values.
    pub(crate) fn position(&self, recording: usize, i: usize) -> usize {
        if i < self.n_shared { i } else { i + recording * self.n_start }
    }

    /// A recording's own variables as columns of the outputs' sensitivities.
    pub(crate) fn columns(&self, recording: usize, z: &[f64]) -> Vec<DirectionColumn> {
        (0..self.n_shared + self.n_start)
            .map(|i| self.position(recording, i))
            .map(|i| DirectionColumn {
                direction: self.all[i].direction,
                slope: self.all[i].slope(z[i]),
            })
            .collect()
    }

    /// All parameters; fixed ones as given.
    pub(crate) fn parameters(&self, p: &[f64], z: &[f64]) -> Vec<f64> {
        let mut p = p.to_vec();
        for (variable, z) in self.all.iter().zip(z) {
            if let Direction::Parameter(i) = variable.of {
                p[i] = variable.value(*z);
            }
        }
        p
    }

    /// Start values that replace the model's in a recording.
    pub(crate) fn starts(
        &self,
        recording: usize,
        given: &[(usize, f64)],
        z: &[f64],
    ) -> Vec<(usize, f64)> {
        let first = self.n_shared + recording * self.n_start;
        let mut starts = given.to_vec();
        for (variable, z) in self.all.iter().zip(z).skip(first).take(self.n_start) {
            if let Direction::Start(i) = variable.of {
                starts.retain(|(unknown, _)| *unknown != i);
                starts.push((i, variable.value(*z)));
            }
        }
        starts
    }

    /// Name of a variable: that of a parameter, or `x(0)` for a start value.
    pub(crate) fn name(&self, signature: &Signature, i: usize) -> String {
        signature.direction_name(self.all[i].direction).into_owned()
    }
}

/// The model's start values in a recording, with its replacements.
pub(crate) fn first_start(
    system: &dyn Model,
    p: &[f64],
    recording: &Recording,
) -> Result<Vec<f64>, TrialFailure> {
    let failed = |error: InitialError| TrialFailure::Simulation(IntegrateError::Initial(error));
    let mut y = vec![0.0; system.signature().unknowns.len()];
    let Some(&t) = recording.times.first() else { return Ok(y) };
    let mut u = vec![0.0; recording.inputs.len()];
    recording.inputs.value(t, LimitSide::Right, u.as_mut());
    let problem =
        Problem { system: &system, p, inputs: &recording.inputs, start: &recording.start };
    let z = discrete_numbers(&system, p, t);
    let point = EvaluationPoint { t, y: &[], u: u.as_ref(), p, z: &z };
    start_values(&problem, point, &mut y).map_err(failed)?;
    Ok(y)
}
