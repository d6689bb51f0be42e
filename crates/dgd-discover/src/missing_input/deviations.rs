//! Linear model of deviations from a simulated trajectory, sample by sample.
//!
//! Around the trajectory y(t) of M ẏ = f(t, y, u, d, p), w = w(t, y, u, d, p), where d = 0 unless
//! given, split into differential x and algebraic z,
//!
//! ```text
//!   δẋ = f_x δx + f_z δz + f_d d      0 = g_x δx + g_z δz + g_d d      δw = w_x δx + w_z δz + w_d d
//! ```
//!
//! and with δz = −g_z⁻¹ (g_x δx + g_d d), index 1,
//!
//! ```text
//!   δẋ = A δx + B d,    δw = C δx + D d
//!   A = f_x − f_z g_z⁻¹ g_x    B = f_d − f_z g_z⁻¹ g_d    (C, D alike from w)
//! ```
//!
//! A and B are evaluated in the middle of each sample interval: x is the mean of its ends, and z that of the start
//! corrected by one Newton step, so that the discretisation, exact for constant A and B, is of second order in the
//! interval (Magnus expansion truncated after its first term). d is constant from one sample to the next, and so is its
//! effect on outputs at a sample.
//!
//! A trajectory that is not a solution of the model ([`filtered`](super::filtered)) has known shifts, δx(k+1) = Φ δx +
//! Γ d + c.

use std::fmt;

use dgd_execute::LoadedSystem;
use dgd_runtime::linearize::{Elimination, Responses};
use dgd_runtime::{EvaluationPoint, Inputs, LimitSide, Pattern, Solution, System};
use nalgebra::{DMatrix, DVector};

use super::missing_terms::MissingTerms;

/// A sparse matrix.
struct SparseMatrix<'a> {
    pattern: &'a Pattern,
    values: &'a [f64],
}

/// The linear time-varying system of deviations from a trajectory, in discrete time.
///
/// ```text
///   δx(k+1) = Φ(k) δx(k) + Γ(k) d(k),     δw(k) = C(k) δx(k) + D(k) d(k)
/// ```
///
/// | name | symbol | shape |
/// |---|---|---|
/// | `transitions[k]` | Φ | n × n, n differential unknowns; one less than samples |
/// | `responses[k]` | Γ | n × n_d, one column for each place |
/// | `seen[k].states` | C | n_w × n |
/// | `seen[k].inputs` | D | n_w × n_d |
#[derive(Debug, Clone)]
pub struct Deviations {
    /// The samples' times, s.
    pub times: Vec<f64>,
    /// Typical sizes of the deviations' states, SI: those of the unknowns.
    pub sizes: Vec<f64>,
    /// Number of places d at which something can be missing.
    pub n_places: usize,
    /// Number of outputs.
    pub n_outputs: usize,
    pub(crate) transitions: Vec<DMatrix<f64>>,
    pub(crate) responses: Vec<DMatrix<f64>>,
    /// `None` where the trajectory has no derivative, so that measurements there carry no information.
    pub(crate) seen: Vec<Option<SampleEquation>>,
    /// Shift of δx in each interval if the trajectory is not a run of the model: the model's prediction from the
    /// previous sample minus the trajectory. Empty for a run.
    pub(crate) shifts: Vec<DVector<f64>>,
}

/// The output equation at one sample.
#[derive(Debug, Clone)]
pub(crate) struct SampleEquation {
    /// C, n_w × n.
    pub(crate) states: DMatrix<f64>,
    /// D, n_w × n_d.
    pub(crate) inputs: DMatrix<f64>,
}

/// Why there are no derivatives along a trajectory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DeviationError {
    /// The trajectory has fewer than two samples.
    TooShort,
    /// The model has delays, which deviations at a sample cannot represent.
    Delayed,
    /// At every sample the algebraic equations do not determine their unknowns, or a derivative is not finite.
    Undetermined,
}

impl fmt::Display for DeviationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::TooShort => "the trajectory has fewer than two samples",
            Self::Delayed => "the model has delays, which its deviations do not follow",
            Self::Undetermined => "the model has no derivatives anywhere along the trajectory",
        })
    }
}

impl std::error::Error for DeviationError {}

impl Deviations {
    /// Linearises a model around its trajectory, at the trajectory's times.
    ///
    /// `inputs` and `p` are those with which the trajectory was simulated; inputs may be the model's own, or those
    /// followed by the unknown ones. Where derivatives do not exist, as at a static flow that comes to rest, or in
    /// modes whose differential unknowns differ from those at the start, the derivatives of the previous sample are
    /// used and the outputs count as not measured.
    ///
    /// # Errors
    ///
    /// [`DeviationError`].
    ///
    /// # Panics
    ///
    /// If the trajectory, inputs or parameters belong to another model.
    pub fn linearize(
        model: &MissingTerms,
        p: &[f64],
        inputs: &Inputs,
        trajectory: &Solution,
    ) -> Result<Self, DeviationError> {
        if trajectory.len() < 2 {
            return Err(DeviationError::TooShort);
        }
        let signature = model.system().signature();
        if !(signature.delays.is_empty() && signature.delayed_unknowns.is_empty()) {
            return Err(DeviationError::Delayed);
        }
        let mut linear = Linearization::new(model, p, inputs);
        let samples: Vec<Option<PointMatrices>> = (0..trajectory.len())
            .map(|k| {
                linear.matrices_at(
                    trajectory.times[k],
                    trajectory.side(k),
                    trajectory.y(k),
                    trajectory.z(k),
                )
            })
            .collect();
        let Some(first) = samples.iter().flatten().next().cloned() else {
            return Err(DeviationError::Undetermined);
        };

        let mut transitions: Vec<DMatrix<f64>> = Vec::with_capacity(samples.len() - 1);
        let mut responses: Vec<DMatrix<f64>> = Vec::with_capacity(samples.len() - 1);
        let mut last = (first.a, first.b, f64::NAN);
        for k in 0..samples.len() - 1 {
            let h = trajectory.times[k + 1] - trajectory.times[k];
            let middle = linear.matrices_between(trajectory, k);
            let (a, b) = match middle.or_else(|| samples[k].clone()) {
                Some(space) => (space.a, space.b),
                None => (last.0.clone(), last.1.clone()),
            };
            // Many models are linear over long periods: the same system has the same discretisation.
            if k > 0 && h == last.2 && a == last.0 && b == last.1 {
                transitions.push(transitions[k - 1].clone());
                responses.push(responses[k - 1].clone());
                continue;
            }
            let response = Responses::balanced(&a).response(h, 0.0).value.clone();
            transitions.push(response.phi);
            responses.push(response.gamma_0 * &b);
            last = (a, b, h);
        }
        let output_equations = samples
            .into_iter()
            .map(|space| space.map(|space| SampleEquation { states: space.c, inputs: space.d }))
            .collect();
        Ok(Deviations {
            times: trajectory.times.clone(),
            sizes: linear.sizes(trajectory),
            n_places: model.places().len(),
            n_outputs: linear.n_w(),
            transitions,
            responses,
            seen: output_equations,
            shifts: Vec::new(),
        })
    }

    /// Number of differential unknowns.
    pub(crate) fn n(&self) -> usize {
        self.sizes.len()
    }
}

/// A, B, C, D at one point.
#[derive(Debug, Clone)]
struct PointMatrices {
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    c: DMatrix<f64>,
    d: DMatrix<f64>,
}

/// Evaluates a model's derivatives, and eliminates the algebraic unknowns.
struct Linearization<'a> {
    system: &'a LoadedSystem,
    p: &'a [f64],
    inputs: &'a Inputs,
    n_places: usize,
    differential: Vec<usize>,
    /// The model's inputs, and the unknown ones: zeros unless given.
    u: Vec<f64>,
    slopes: Vec<f64>,
    f: Vec<f64>,
    dfdt: Vec<f64>,
    dfdy: Vec<f64>,
    dfdu: Vec<f64>,
    dwdy: Vec<f64>,
    dwdu: Vec<f64>,
    dwdp: Vec<f64>,
    dwdt: Vec<f64>,
}

impl<'a> Linearization<'a> {
    fn new(model: &'a MissingTerms, p: &'a [f64], inputs: &'a Inputs) -> Self {
        let system = model.system();
        let signature = system.signature();
        let n = signature.unknowns.len();
        let n_u = signature.inputs.len();
        let n_places = model.places().len();
        let n_given = inputs.len();
        assert!(n_given == n_u || n_given + n_places == n_u, "inputs of the model");
        let [by_y, by_u, by_p] = &signature.output_jacobians;
        Linearization {
            system,
            p,
            inputs,
            n_places,
            differential: signature.unknowns.differential().collect(),
            u: vec![0.0; n_u],
            slopes: vec![0.0; n_u],
            f: vec![0.0; n],
            dfdt: vec![0.0; n],
            dfdy: vec![0.0; signature.jacobian.len()],
            dfdu: vec![0.0; signature.input_jacobian.len()],
            dwdy: vec![0.0; by_y.len()],
            dwdu: vec![0.0; by_u.len()],
            dwdp: vec![0.0; by_p.len()],
            dwdt: vec![0.0; signature.outputs.len()],
        }
    }

    fn n_w(&self) -> usize {
        self.dwdt.len()
    }

    /// A, B, C, D at a point; `None` if they do not exist.
    fn matrices_at(
        &mut self,
        t: f64,
        side: LimitSide,
        y: &[f64],
        z: &[f64],
    ) -> Option<PointMatrices> {
        let (elimination, rows) = self.eliminated(t, side, y, z)?;
        self.space(&elimination, &rows)
    }

    /// A, B, C, D midway between the k-th and the next sample.
    fn matrices_between(&mut self, trajectory: &Solution, k: usize) -> Option<PointMatrices> {
        let t = f64::midpoint(trajectory.times[k], trajectory.times[k + 1]);
        let mut y = trajectory.y(k).to_vec();
        for &i in &self.differential {
            y[i] = f64::midpoint(y[i], trajectory.y(k + 1)[i]);
        }
        let z = trajectory.z(k);
        let (mut elimination, mut rows) = self.eliminated(t, LimitSide::Right, &y, z)?;
        if !elimination.eliminated.is_empty() {
            let step = elimination.step(&self.f);
            for (&i, step) in elimination.eliminated.iter().zip(&step) {
                y[i] += step;
            }
            (elimination, rows) = self.eliminated(t, LimitSide::Right, &y, z)?;
        }
        self.space(&elimination, &rows)
    }

    /// The elimination of algebraic unknowns at a point, and ∂f/∂(y, d): the only place that evaluates the model.
    /// `None` if they are not determined, and in modes whose differential unknowns differ from those at the start.
    fn eliminated(
        &mut self,
        t: f64,
        side: LimitSide,
        y: &[f64],
        z: &[f64],
    ) -> Option<(Elimination, DMatrix<f64>)> {
        let n_given = self.inputs.len();
        self.inputs.value(t, side, &mut self.u[..n_given]);
        let point = EvaluationPoint { t, y, u: &self.u, p: self.p, z };
        self.system.linearize(point, &self.slopes, &mut self.f, &mut self.dfdy, &mut self.dfdt);
        self.system.input_jacobian(point, &mut self.dfdu);
        self.system.output_jacobians(
            point,
            &mut self.dwdy,
            &mut self.dwdu,
            &mut self.dwdp,
            &mut self.dwdt,
        );
        let signature = self.system.signature();
        let by_y = SparseMatrix { pattern: &signature.jacobian, values: &self.dfdy };
        let by_u = SparseMatrix { pattern: &signature.input_jacobian, values: &self.dfdu };
        let rows = self.rows(self.f.len(), &by_y, &by_u);
        let elimination = Elimination::new(self.system, point, &rows).ok()?;
        (elimination.states == self.differential).then_some((elimination, rows))
    }

    /// Rows of derivatives with respect to y, then d, from the non-zeros with respect to y and u.
    fn rows(
        &self,
        number: usize,
        by_y: &SparseMatrix<'_>,
        by_u: &SparseMatrix<'_>,
    ) -> DMatrix<f64> {
        let (n, own) = (self.f.len(), self.u.len() - self.n_places);
        let mut matrix = DMatrix::zeros(number, n + self.n_places);
        for ((row, column), value) in by_y.pattern.positions().zip(by_y.values) {
            matrix[(row, column)] = *value;
        }
        for ((row, column), value) in by_u.pattern.positions().zip(by_u.values) {
            if column >= own {
                matrix[(row, n + column - own)] = *value;
            }
        }
        matrix
    }

    /// A, B, C, D at the point of the last evaluation.
    fn space(&self, elimination: &Elimination, rows: &DMatrix<f64>) -> Option<PointMatrices> {
        let [by_y, by_u, _] = &self.system.signature().output_jacobians;
        let by_y = SparseMatrix { pattern: by_y, values: &self.dwdy };
        let by_u = SparseMatrix { pattern: by_u, values: &self.dwdu };
        let outputs = self.rows(self.n_w(), &by_y, &by_u);
        let (states, outputs) = (elimination.of_states(rows), elimination.reduced(&outputs));
        let n = self.differential.len();
        let split = |rows: &DMatrix<f64>| {
            [rows.columns(0, n).into_owned(), rows.columns(n, self.n_places).into_owned()]
        };
        let ([a, b], [c, d]) = (split(&states), split(&outputs));
        let is_finite = states.iter().chain(&outputs).all(|x| x.is_finite());
        is_finite.then_some(PointMatrices { a, b, c, d })
    }

    /// Sizes of the differential unknowns: the declared size, else the largest magnitude on the trajectory, else one
    /// unit.
    fn sizes(&self, trajectory: &Solution) -> Vec<f64> {
        let unknowns = &self.system.signature().unknowns;
        let largest = |i: usize| {
            (0..trajectory.len()).fold(0.0f64, |size, k| size.max(trajectory.y(k)[i].abs()))
        };
        self.differential
            .iter()
            .map(|&i| {
                let size = unknowns.nominal(i).map_or_else(|| largest(i), f64::abs);
                if size > 0.0 { size } else { unknowns.unit(i).factor.abs() }
            })
            .collect()
    }
}
