//! The linear model at a point.

use dgd_runtime::linearize::{ConservedCombination, OperatingPoint, StateSpace, rest};
use dgd_runtime::{Options, SolvableSystem, linearize as at_runtime};

use crate::{Error, Problem, Solution};

/// The point of a linearisation.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum LinearizationPoint {
    /// The point of a run from the first to the second time, s.
    Run {
        /// Start of the run.
        from: f64,
        /// Its end, the point.
        until: f64,
    },
    /// The steady state with the inputs held at their values at this time, s. Conserved quantities keep their initial
    /// values.
    Steady(f64),
}

/// ẋ = A x + B u, w = C x + D u, where all quantities are differences from the point.
#[derive(Debug, Clone)]
pub struct LinearModel {
    states: Vec<String>,
    inputs: Vec<String>,
    outputs: Vec<String>,
    found: StateSpace,
    conserved: Vec<ConservedCombination>,
}

/// Rows of a matrix.
pub type MatrixRows = Vec<Vec<f64>>;

fn rows(matrix: &at_runtime::DMatrix<f64>) -> MatrixRows {
    matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
}

impl LinearModel {
    /// Names of the states x: the order of A's rows and columns.
    pub fn states(&self) -> &[String] {
        &self.states
    }

    /// Names of the inputs u: the order of B's and D's columns.
    pub fn inputs(&self) -> &[String] {
        &self.inputs
    }

    /// Names of the outputs w: the order of C's and D's rows.
    pub fn outputs(&self) -> &[String] {
        &self.outputs
    }

    /// A, n_x × n_x, SI.
    pub fn a(&self) -> MatrixRows {
        rows(&self.found.a)
    }

    /// B, n_x × n_u, SI.
    pub fn b(&self) -> MatrixRows {
        rows(&self.found.b)
    }

    /// C, n_w × n_x, SI.
    pub fn c(&self) -> MatrixRows {
        rows(&self.found.c)
    }

    /// D, n_w × n_u, SI.
    pub fn d(&self) -> MatrixRows {
        rows(&self.found.d)
    }

    /// Poles as (real, imaginary), 1/s, from right to left.
    ///
    /// # Errors
    ///
    /// [`Error::Linearize`] if the eigenvalue iteration does not converge.
    pub fn poles(&self) -> Result<Vec<(f64, f64)>, Error> {
        let poles = self.found.poles_beside(&self.conserved).map_err(Error::Linearize)?;
        Ok(poles.poles.iter().map(|pole| (pole.re, pole.im)).collect())
    }
}

/// The linear model of `problem` at a point.
///
/// # Errors
///
/// [`Error::Length`], [`Error::Run`], [`Error::SteadyState`], [`Error::Linearize`].
pub fn linearize<M: SolvableSystem>(
    problem: &Problem<'_, M>,
    at: LinearizationPoint,
    options: &Options,
) -> Result<LinearModel, Error> {
    let run = problem.as_run()?;
    let (point, conserved) = match at {
        LinearizationPoint::Run { from, until } => {
            let reached = OperatingPoint::reached(&run, from, until, options)
                .map_err(|error| Error::Run { error, reached: Box::new(Solution::default()) })?;
            (reached, Vec::new())
        }
        LinearizationPoint::Steady(t) => {
            let steady = rest(&run, t, options).map_err(Error::SteadyState)?;
            (steady.at, steady.conserved)
        }
    };
    let linear = at_runtime::linearize(&run, &point).map_err(Error::Linearize)?;
    let signature = problem.model.signature();
    let states = linear.states.iter().map(|i| signature.unknowns.name(*i).to_string()).collect();
    let inputs = (linear.channels.iter())
        .map(|channel| signature.inputs[channel.input()].name.to_string())
        .collect();
    let outputs = signature.outputs.iter().map(|output| output.name.to_string()).collect();
    Ok(LinearModel { states, inputs, outputs, found: linear, conserved })
}
