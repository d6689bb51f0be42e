//! The model over one interval, and its derivatives at one time.
//!
//! A run over one interval begins with all unknowns given, algebraic ones as guesses. A run of no length
//! makes them consistent and gives S = ∂y/∂(x, θ) there; with it the generated functions give
//!
//! ```text
//!   A = ∂ẋ/∂(x, θ) = rows of x of (∂f/∂y S + ∂f/∂θ),    C = dw/d(x, θ) = ∂w/∂y S + ∂w/∂θ
//! ```

use nalgebra::DMatrix;

use super::coordinates::Coordinates;
use super::error::FilterError;
use super::problem::FilterProblem;
use crate::delay::delays;
use crate::error::IntegrateError;
use crate::identify::error::TrialFailure;
use crate::observe::observe;
use crate::problem::{Options, Problem};
use crate::signal::{Inputs, Side};
use crate::solution::Solution;
use crate::system::{AutomatonKind, Point, Signature, System};
use crate::{simulate, simulate_with_sensitivities};

/// A model as a filter sees it.
pub(super) struct Model<'a, S> {
    pub system: &'a S,
    pub p: &'a [f64],
    pub options: Options,
}

/// Where an interval ended.
pub(super) struct Moved {
    /// Unknowns.
    pub y: Vec<f64>,
    /// ∂x/∂(x, θ) in scaled variables: states × all.
    pub phi: DMatrix<f64>,
}

/// The model close to one time.
pub(super) struct Local {
    /// Unknowns, consistent.
    pub y: Vec<f64>,
    /// Outputs.
    pub w: Vec<f64>,
    /// A in scaled variables: states × all.
    pub a: DMatrix<f64>,
    /// C in scaled variables: outputs, SI, × all.
    pub c: DMatrix<f64>,
}

impl<'a, S: System> Model<'a, S> {
    /// # Errors
    ///
    /// [`FilterError::Remembers`] for a model that does not go on from its differential unknowns alone.
    pub(super) fn new(problem: &FilterProblem<'a, S>) -> Result<Self, FilterError> {
        match remembered(problem.system.signature()) {
            Some(what) => Err(FilterError::Remembers { what }),
            None => Ok(Self { system: problem.system, p: problem.p, options: problem.options }),
        }
    }

    /// How far delayed inputs reach back, s.
    pub(super) fn reach(&self, p: &[f64]) -> f64 {
        let inputs = Inputs::none();
        let problem = Problem { system: self.system, p, inputs: &inputs, start: &[] };
        delays(&problem).into_iter().filter(|tau| tau.is_finite()).fold(0.0, f64::max)
    }

    /// Moves the unknowns from one time to another, with sensitivities.
    pub(super) fn move_with_sensitivities(
        &self,
        inputs: &Inputs,
        times: (f64, f64),
        y: &[f64],
        coordinates: &Coordinates,
        variables: &[f64],
    ) -> Result<Moved, TrialFailure> {
        let (p, start) = self.started(y, coordinates, variables);
        let problem = Problem { system: self.system, p: &p, inputs, start: &start };
        let solution = simulate_with_sensitivities(&problem, &[times.0, times.1], &self.options);
        let solution = solution.map_err(|failure| TrialFailure::Simulation(failure.error))?;
        let last = solution.len() - 1;
        let y = solution.y(last).to_vec();
        let s = solution.s(last);
        let n = y.len();
        let phi = DMatrix::from_fn(coordinates.n_states(), coordinates.len(), |row, column| {
            let slope = coordinates.slope(column, variables[column]);
            let of = coordinates.directions[column] * n + coordinates.states[row];
            s[of] * slope / coordinates.sizes[row]
        });
        if phi.iter().all(|value| value.is_finite()) {
            Ok(Moved { y, phi })
        } else {
            Err(self.undefined(times.1, &solution))
        }
    }

    /// Moves the unknowns from one time to another.
    pub(super) fn move_states(
        &self,
        inputs: &Inputs,
        times: (f64, f64),
        y: &[f64],
        coordinates: &Coordinates,
        variables: &[f64],
    ) -> Result<Vec<f64>, TrialFailure> {
        let (p, start) = self.started(y, coordinates, variables);
        let problem = Problem { system: self.system, p: &p, inputs, start: &start };
        let solution = simulate(&problem, &[times.0, times.1], &self.options);
        let solution = solution.map_err(|failure| TrialFailure::Simulation(failure.error))?;
        Ok(solution.y(solution.len() - 1).to_vec())
    }

    /// Outputs at one time, for one set of states and parameters.
    pub(super) fn outputs(
        &self,
        inputs: &Inputs,
        t: f64,
        y: &[f64],
        coordinates: &Coordinates,
        variables: &[f64],
    ) -> Result<Vec<f64>, TrialFailure> {
        let (p, start) = self.started(y, coordinates, variables);
        let problem = Problem { system: self.system, p: &p, inputs, start: &start };
        let solution = simulate(&problem, &[t], &self.options);
        let solution = solution.map_err(|failure| TrialFailure::Simulation(failure.error))?;
        Ok(observe(&problem, &solution).w)
    }

    /// The model close to one time.
    pub(super) fn local(
        &self,
        inputs: &Inputs,
        t: f64,
        y: &[f64],
        coordinates: &Coordinates,
        variables: &[f64],
    ) -> Result<Local, TrialFailure> {
        let (p, start) = self.started(y, coordinates, variables);
        let problem = Problem { system: self.system, p: &p, inputs, start: &start };
        let solution = simulate_with_sensitivities(&problem, &[t], &self.options);
        let solution = solution.map_err(|failure| TrialFailure::Simulation(failure.error))?;
        let observations = observe(&problem, &solution);
        let (y, s, z) = (solution.y(0), solution.s(0), solution.z(0));

        let mut u = vec![0.0; self.system.signature().n_u()];
        let read = problem.inputs_read();
        let read = read.map_err(|error| TrialFailure::Simulation(IntegrateError::Inputs(error)))?;
        read.value(t, Side::Right, &mut u);
        let (mut f, mut g) = (vec![0.0; y.len()], vec![0.0; s.len()]);
        self.system.sensitivity_rhs(Point { t, y, u: &u, p: &p, z }, s, &mut f, &mut g);

        let slope = |column: usize| coordinates.slope(column, variables[column]);
        let n = y.len();
        let a = DMatrix::from_fn(coordinates.n_states(), coordinates.len(), |row, column| {
            let of = coordinates.directions[column] * n + coordinates.states[row];
            g[of] * slope(column) / coordinates.sizes[row]
        });
        let (dw, n_w) = (observations.dw(0), observations.n_w);
        let c = DMatrix::from_fn(n_w, coordinates.len(), |row, column| {
            dw[coordinates.directions[column] * n_w + row] * slope(column)
        });
        Ok(Local { y: y.to_vec(), w: observations.w(0).to_vec(), a, c })
    }

    /// Parameters, and start values of all unknowns.
    fn started(
        &self,
        y: &[f64],
        coordinates: &Coordinates,
        variables: &[f64],
    ) -> (Vec<f64>, Vec<(usize, f64)>) {
        let mut y = y.to_vec();
        coordinates.write_states(variables, &mut y);
        (coordinates.p(self.p, variables), y.into_iter().enumerate().collect())
    }

    /// Derivatives do not exist: the first equation to blame, or the model as a whole.
    fn undefined(&self, t: f64, solution: &Solution) -> TrialFailure {
        let named = solution.undefined.first().map(|undefined| undefined.equation.clone());
        let equation = named.unwrap_or_else(|| self.system.signature().name.to_string());
        TrialFailure::NoSensitivity { equation, t }
    }
}

/// What a model goes on from beside its differential unknowns, if there is something.
fn remembered(signature: &Signature) -> Option<String> {
    for automaton in signature.discrete.automata.iter() {
        let name = &automaton.name;
        match automaton.kind {
            AutomatonKind::Modes => return Some(format!("the mode of `{name}`")),
            AutomatonKind::When => return Some(format!("what `{name}` has done before")),
            AutomatonKind::States => {
                return Some(format!("which unknowns are states, `{name}`"));
            }
            AutomatonKind::Saturation => {
                return Some(format!("whether `{name}` is at its bound"));
            }
            // Which side they are on is seen from y.
            AutomatonKind::Switch | AutomatonKind::Corner => {}
        }
    }
    if let Some(delayed) = signature.delayed_unknowns.first() {
        let name = signature.unknowns.name(delayed.unknown);
        return Some(format!("what `{name}` was before"));
    }
    let late = signature.outputs.iter().find(|output| output.delay.is_some());
    late.map(|output| format!("what output `{}` reads late", output.name))
}
