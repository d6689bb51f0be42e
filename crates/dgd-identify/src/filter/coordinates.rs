//! Transforms states and parameters to variables of the order of 1, and back.
//!
//! | quantity | variable |
//! |---|---|
//! | a state | x / size |
//! | a parameter | as in fits: θ / size, or ln θ if the model says `log` |
//!
//! States come first, in the order of y; then parameters, in the order of the directions.

use dgd_runtime::Direction;
use dgd_runtime::for_identify::unknown_sizes;

use super::error::FilterError;
use super::problem::FilterProblem;
use crate::variables::FitVariables;

/// The tracked quantities as scaled variables.
#[derive(Debug, Clone)]
pub(super) struct FilterCoordinates {
    /// Positions of the states in y.
    pub states: Vec<usize>,
    /// Their sizes.
    pub sizes: Vec<f64>,
    /// For each variable, its position among the model's directions.
    pub directions: Vec<usize>,
    parameters: FitVariables,
}

impl FilterCoordinates {
    /// The coordinates of a problem and the initial variables, given y at the start.
    pub(super) fn new(
        problem: &FilterProblem<'_>,
        y: &[f64],
    ) -> Result<(Self, Vec<f64>), FilterError> {
        let signature = problem.system.signature();
        let states = problem.states();
        let mut all_sizes = vec![0.0; y.len()];
        unknown_sizes(&problem.system, y, &mut all_sizes);
        let free: Vec<bool> = signature
            .directions
            .iter()
            .zip(&problem.free)
            .map(|(direction, free)| *free && matches!(direction, Direction::Parameter(_)))
            .collect();
        let (parameters, z) =
            FitVariables::new(problem.system, problem.p, &[], &free).map_err(FilterError::Free)?;
        let mut directions = Vec::with_capacity(states.len() + z.len());
        for &i in &states {
            let start = Direction::Start(i);
            let Some(j) = signature.directions.iter().position(|of| *of == start) else {
                let unknown = signature.unknowns.name(i).to_string();
                return Err(FilterError::NoDirection { unknown });
            };
            directions.push(j);
        }
        directions.extend((0..free.len()).filter(|j| free[*j]));
        if directions.is_empty() {
            return Err(FilterError::NothingTracked);
        }
        let sizes: Vec<f64> = states.iter().map(|i| all_sizes[*i]).collect();
        let of_states = states.iter().zip(&sizes).map(|(i, size)| y[*i] / size);
        let variables = of_states.chain(z).collect();
        Ok((Self { states, sizes, directions, parameters }, variables))
    }

    pub(super) fn len(&self) -> usize {
        self.directions.len()
    }

    pub(super) fn n_states(&self) -> usize {
        self.states.len()
    }

    /// All parameters of the model, within their bounds.
    pub(super) fn p(&self, p: &[f64], variables: &[f64]) -> Vec<f64> {
        self.parameters.parameters(p, &variables[self.n_states()..self.len()])
    }

    /// Writes the states into y.
    pub(super) fn write_states(&self, variables: &[f64], y: &mut [f64]) {
        for ((i, size), variable) in self.states.iter().zip(&self.sizes).zip(variables) {
            y[*i] = variable * size;
        }
    }

    /// Reads the states from y.
    pub(super) fn read_states(&self, y: &[f64], variables: &mut [f64]) {
        for ((i, size), variable) in self.states.iter().zip(&self.sizes).zip(variables) {
            *variable = y[*i] / size;
        }
    }

    /// The value of the k-th variable, SI.
    pub(super) fn value(&self, k: usize, variable: f64) -> f64 {
        match k.checked_sub(self.n_states()) {
            None => variable * self.sizes[k],
            Some(parameter) => self.parameters.all[parameter].value(variable),
        }
    }

    /// Derivative of the value with respect to the variable.
    pub(super) fn slope(&self, k: usize, variable: f64) -> f64 {
        match k.checked_sub(self.n_states()) {
            None => self.sizes[k],
            Some(parameter) => self.parameters.all[parameter].slope(variable),
        }
    }

    /// Moves parameters that are outside of their bounds to the nearest bound.
    pub(super) fn project(&self, variables: &mut [f64]) {
        let parameters = &mut variables[self.states.len()..self.directions.len()];
        for (of, variable) in self.parameters.all.iter().zip(parameters) {
            let (low, high) = of.bounds();
            *variable = variable.clamp(low, high);
        }
    }
}
