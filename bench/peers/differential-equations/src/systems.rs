//! The two-state model with the crate's traits.

use differential_equations::linalg::Matrix;
use differential_equations::prelude::*;
use peers_problems::two_state::{AREA, FLOW, LEVEL, TwoState, WIDTH};

/// Two scaled states.
#[derive(Clone, Copy)]
pub(crate) struct States(pub(crate) TwoState);

/// Two scaled states and their sensitivities, as one system of twelve.
#[derive(Clone, Copy)]
pub(crate) struct Augmented(pub(crate) TwoState);

impl States {
    /// y with the flow at which the static model balances, by Newton's method in q.
    pub(crate) fn consistent(&self, y: [f64; 2]) -> [f64; 2] {
        let (h, mut q) = (LEVEL * y[0], FLOW * y[1]);
        // The residual is quadratic: from a flow of the right size, six iterations give all digits.
        for _ in 0..6 {
            q -= self.0.rhs(h, q)[1] / self.0.slopes(q)[1];
        }
        [y[0], q / FLOW]
    }
}

impl ODE<f64, [f64; 2]> for States {
    fn diff(&self, _t: f64, y: &[f64; 2], ydot: &mut [f64; 2]) {
        let [hdot, qdot] = self.0.rhs(LEVEL * y[0], FLOW * y[1]);
        *ydot = [hdot / LEVEL, qdot / FLOW];
    }

    fn jacobian(&self, _t: f64, y: &[f64; 2], jacobian: &mut Matrix<f64>) {
        let [by_h, by_q] = self.0.slopes(FLOW * y[1]);
        jacobian[(0, 0)] = 0.0;
        jacobian[(0, 1)] = FLOW / AREA / LEVEL;
        jacobian[(1, 0)] = by_h * LEVEL / FLOW;
        jacobian[(1, 1)] = by_q;
    }
}

impl ParametrizedODE<f64, [f64; 2], [f64; 5]> for States {
    fn parameters(&self) -> [f64; 5] {
        [1.0; 5]
    }

    fn jacobian_p(&self, _t: f64, y: &[f64; 2], jacobian: &mut Matrix<f64>) {
        for (j, by_theta) in self.0.by_theta(LEVEL * y[0], FLOW * y[1]).into_iter().enumerate() {
            jacobian[(0, j)] = 0.0;
            jacobian[(1, j)] = by_theta / FLOW;
        }
    }
}

/// The static model: 0 = q̇.
impl DAE<f64, [f64; 2]> for States {
    fn diff(&self, t: f64, y: &[f64; 2], f: &mut [f64; 2]) {
        ODE::diff(self, t, y, f);
    }

    fn mass(&self, mass: &mut Matrix<f64>) {
        mass[(0, 0)] = 1.0;
        mass[(1, 1)] = 0.0;
    }

    fn jacobian(&self, t: f64, y: &[f64; 2], jacobian: &mut Matrix<f64>) {
        ODE::jacobian(self, t, y, jacobian);
    }
}

impl ODE<f64, [f64; WIDTH]> for Augmented {
    fn diff(&self, _t: f64, y: &[f64; WIDTH], ydot: &mut [f64; WIDTH]) {
        *ydot = self.0.augmented(y);
    }
}
