//! Outputs along a solution.

use crate::problem::Problem;
use crate::solution::Solution;
use crate::system::{Point, Storage, System};

/// Outputs, and their sensitivities where the solution has them.
#[derive(Debug, Clone, PartialEq)]
pub struct Observations {
    /// Number of outputs n_w.
    pub n_w: usize,
    /// Number of directions n_s; 0 without sensitivities.
    pub n_s: usize,
    /// Outputs, n_w numbers per time.
    pub w: Vec<f64>,
    /// ∂w/∂θ, n_w · n_s numbers per time, direction by direction; NaN where undefined.
    pub dw: Vec<f64>,
}

impl Observations {
    /// Outputs at the k-th time.
    pub fn w(&self, k: usize) -> &[f64] {
        &self.w[k * self.n_w..(k + 1) * self.n_w]
    }

    /// Sensitivities at the k-th time: `dw(k)[j * n_w + i]` is ∂wᵢ/∂θⱼ.
    pub fn dw(&self, k: usize) -> &[f64] {
        let len = self.n_w * self.n_s;
        &self.dw[k * len..(k + 1) * len]
    }
}

/// Evaluates the outputs at the times of a solution of `problem`.
///
/// Where inputs jump, they are taken on the side that the solution's values are on.
///
/// # Panics
///
/// When the solution is that of a model of another size.
pub fn observe<S: System>(problem: &Problem<'_, S>, solution: &Solution) -> Observations {
    let system = problem.system;
    let n_w = system.signature().outputs.len();
    let n_s = solution.n_s;
    let len = n_w * n_s;
    let mut observations = Observations {
        n_w,
        n_s,
        w: vec![0.0; n_w * solution.len()],
        dw: vec![0.0; len * solution.len()],
    };
    let mut u = S::Inputs::zeros(problem.inputs.len());
    for (k, &t) in solution.times.iter().enumerate() {
        problem.inputs.value(t, solution.side(k), u.as_mut());
        let (y, z) = (solution.y(k), solution.z(k));
        let at = Point { t, y, u: u.as_ref(), p: problem.p, z };
        let w = &mut observations.w[k * n_w..(k + 1) * n_w];
        if n_s == 0 {
            system.outputs(at, w);
        } else {
            let dw = &mut observations.dw[k * len..(k + 1) * len];
            system.output_sensitivities(at, solution.s(k), w, dw);
        }
    }
    observations
}
