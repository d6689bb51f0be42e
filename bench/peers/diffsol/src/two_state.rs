//! The two-state model as diffsol's closures.

use std::cell::Cell;

use diffsol::{NalgebraLU, NalgebraMat};
use peers_problems::two_state::{AREA, FLOW, LEVEL, TwoState, WIDTH};

/// Matrices of two rows, for which nalgebra takes a third of the time of faer.
pub(crate) type Matrix = NalgebraMat<f64>;
/// Their solver.
pub(crate) type Solver = NalgebraLU<f64>;

/// Values that change at a restart.
pub(crate) struct Now {
    pub(crate) model: Cell<TwoState>,
    /// States and sensitivities to start with.
    pub(crate) start: Cell<[f64; WIDTH]>,
}

impl Now {
    /// Starts in steady state.
    pub(crate) fn new(model: TwoState) -> Self {
        Self { model: Cell::new(model), start: Cell::new(row_at_rest()) }
    }

    /// Returns to steady state, with the same parameters.
    pub(crate) fn restart(&self) {
        self.start.set(row_at_rest());
    }

    /// (ḣ, q̇); in the static model 0 = q̇.
    pub(crate) fn rhs(&self) -> impl Fn(&[f64], &[f64], f64, &mut [f64]) {
        |y, _p, _t, ydot| ydot.copy_from_slice(&self.model.get().rhs(y[0], y[1]))
    }

    /// ∂f/∂y v.
    pub(crate) fn jacobian_times(&self) -> impl Fn(&[f64], &[f64], f64, &[f64], &mut [f64]) {
        |y, _p, _t, v, result| {
            let [by_h, by_q] = self.model.get().slopes(y[1]);
            result.copy_from_slice(&[v[1] / AREA, by_h * v[0] + by_q * v[1]]);
        }
    }

    /// ∂f/∂θ v.
    pub(crate) fn by_theta_times(&self) -> impl Fn(&[f64], &[f64], f64, &[f64], &mut [f64]) {
        |y, _p, _t, v, result| {
            let by_theta = self.model.get().by_theta(y[0], y[1]);
            let sum = by_theta.iter().zip(v).map(|(a, b)| a * b).sum();
            result.copy_from_slice(&[0.0, sum]);
        }
    }

    /// The same for the static model, which does not contain M.
    pub(crate) fn by_theta_times_static(&self) -> impl Fn(&[f64], &[f64], f64, &[f64], &mut [f64]) {
        |y, _p, _t, v, result| {
            let by_theta = self.model.get().by_theta(y[0], y[1]);
            let sum = by_theta[1..].iter().zip(&v[1..]).map(|(a, b)| a * b).sum();
            result.copy_from_slice(&[0.0, sum]);
        }
    }

    /// y at the start.
    pub(crate) fn start(&self) -> impl Fn(&[f64], f64, &mut [f64]) {
        |_p, _t, y| y.copy_from_slice(&self.start.get()[..2])
    }

    /// S v at the start.
    pub(crate) fn start_times(&self) -> impl Fn(&[f64], f64, &[f64], &mut [f64]) {
        |_p, _t, v, result| {
            let start = self.start.get();
            result.fill(0.0);
            for (s, v) in start[2..].chunks_exact(2).zip(v) {
                result[0] += s[0] * v;
                result[1] += s[1] * v;
            }
        }
    }
}

/// y ← M x + β y with M = diag(1, 0).
pub(crate) fn mass(x: &[f64], _p: &[f64], _t: f64, beta: f64, y: &mut [f64]) {
    y[0] = x[0] + beta * y[0];
    y[1] *= beta;
}

/// The initial row.
pub(crate) fn row_at_rest() -> [f64; WIDTH] {
    let mut row = [0.0; WIDTH];
    row[0] = LEVEL;
    row[1] = FLOW;
    row
}
