//! The rows of a regression: what each equation and output says at each sample.
//!
//! | row | predicted | target |
//! |---|---|---|
//! | differential equation i | fᵢ(t, y, u, p) | ẏᵢ |
//! | algebraic equation i | fᵢ(t, y, u, p) | 0 |
//! | output i | wᵢ(t, y, u, p) | measured |
//!
//! Its residual is predicted − target; that of an equation with a multiplier p_k is p_k (predicted −
//! target), which undoes the division by a factor of the derivative: M ẏ = F has become ẏ = F/M.

use crate::identify::recording::Recording;
use crate::identify::regression::error::RegressionError;
use crate::identify::regression::known::Known;
use crate::system::{Pattern, Point, System};

/// What a row is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowOf {
    /// The equation at this position.
    Equation(usize),
    /// The output at this position.
    Output(usize),
}

/// Rows of one equation or output at all samples.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RowKind {
    pub of: RowOf,
    pub name: String,
    /// Unknowns that it reads.
    pub reads: Vec<usize>,
    /// Free parameters that it reads, each with the position of its derivative among the non-zeros.
    pub parameters: Vec<(usize, usize)>,
    /// Position of the free parameter by which it is multiplied.
    pub multiplier: Option<usize>,
}

impl RowKind {
    /// All that have a free parameter: equations, and outputs that are in use.
    pub(crate) fn all<S: System>(
        system: &S,
        free: &[usize],
        used: impl Fn(usize) -> bool,
    ) -> Vec<Self> {
        let signature = system.signature();
        let parameters = |pattern: &Pattern, row: usize| -> Vec<(usize, usize)> {
            let places = pattern.positions().enumerate().filter(|(_, (r, _))| *r == row);
            places.filter_map(|(k, (_, c))| Some((free.iter().position(|i| *i == c)?, k))).collect()
        };
        let reads = |pattern: &Pattern, row: usize| -> Vec<usize> {
            let mut reads: Vec<usize> =
                pattern.positions().filter(|(r, _)| *r == row).map(|(_, c)| c).collect();
            reads.sort_unstable();
            reads.dedup();
            reads
        };
        let equations = (0..signature.unknowns.len()).map(|i| Self {
            of: RowOf::Equation(i),
            name: signature.equations.at(i).into_owned(),
            reads: reads(&signature.jacobian, i),
            parameters: parameters(&signature.parameter_jacobian, i),
            multiplier: None,
        });
        let [by_y, _, by_p] = &signature.output_jacobians;
        let outputs = (0..signature.outputs.len()).filter(|i| used(*i)).map(|i| Self {
            of: RowOf::Output(i),
            name: signature.outputs[i].name.to_string(),
            reads: reads(by_y, i),
            parameters: parameters(by_p, i),
            multiplier: None,
        });
        equations.chain(outputs).filter(|kind| !kind.parameters.is_empty()).collect()
    }
}

/// One row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row<'a> {
    /// Position of its kind.
    pub kind: usize,
    pub predicted: f64,
    pub target: f64,
    /// Multiplied, where its kind has a multiplier.
    pub residual: f64,
    /// Derivatives of the residual to the free parameters.
    pub slopes: &'a [f64],
}

/// Evaluates rows.
pub(crate) struct Rows<'a, S> {
    system: &'a S,
    pub recordings: &'a [Recording],
    pub known: &'a [Known],
    pub kinds: Vec<RowKind>,
    /// Positions of the free parameters.
    pub free: &'a [usize],
    f: Vec<f64>,
    w: Vec<f64>,
    mass: Vec<f64>,
    dfdp: Vec<f64>,
    output_jacobians: [Vec<f64>; 3],
    dwdt: Vec<f64>,
    /// Predicted values of all kinds and their derivatives, kind by kind.
    predicted: Vec<f64>,
    by_p: Vec<f64>,
    slopes: Vec<f64>,
}

impl<'a, S: System> Rows<'a, S> {
    pub(crate) fn new(
        system: &'a S,
        recordings: &'a [Recording],
        known: &'a [Known],
        kinds: Vec<RowKind>,
        free: &'a [usize],
    ) -> Self {
        let signature = system.signature();
        let (n, n_w) = (signature.unknowns.len(), signature.outputs.len());
        Self {
            system,
            recordings,
            known,
            free,
            f: vec![0.0; n],
            w: vec![0.0; n_w],
            mass: vec![0.0; n],
            dfdp: vec![0.0; signature.parameter_jacobian.len()],
            output_jacobians: [0, 1, 2].map(|of| vec![0.0; signature.output_jacobians[of].len()]),
            dwdt: vec![0.0; n_w],
            predicted: vec![0.0; kinds.len()],
            by_p: vec![0.0; kinds.len() * free.len()],
            slopes: vec![0.0; free.len()],
            kinds,
        }
    }

    /// Predicted values of all kinds at a point, and their derivatives to the free parameters, kind by
    /// kind.
    pub(crate) fn predict(&mut self, at: Point<'_>) -> (&[f64], &[f64]) {
        let has = |wanted: fn(&RowOf) -> bool| self.kinds.iter().any(|kind| wanted(&kind.of));
        if has(|of| matches!(of, RowOf::Equation(_))) {
            self.system.rhs(at, &mut self.f);
            self.system.parameter_jacobian(at, &mut self.dfdp);
        }
        if has(|of| matches!(of, RowOf::Output(_))) {
            self.system.outputs(at, &mut self.w);
            let [by_y, by_u, by_p] = &mut self.output_jacobians;
            self.system.output_jacobians(at, by_y, by_u, by_p, &mut self.dwdt);
        }
        self.by_p.fill(0.0);
        for (k, kind) in self.kinds.iter().enumerate() {
            let (value, derivatives) = match kind.of {
                RowOf::Equation(i) => (self.f[i], &self.dfdp),
                RowOf::Output(i) => (self.w[i], &self.output_jacobians[2]),
            };
            self.predicted[k] = value;
            for (j, place) in &kind.parameters {
                self.by_p[k * self.free.len() + j] = derivatives[*place];
            }
        }
        (&self.predicted, &self.by_p)
    }

    /// Whether the row is that of a differential equation at the point.
    pub(crate) fn is_differential(&mut self, kind: usize, at: Point<'_>) -> bool {
        match self.kinds[kind].of {
            RowOf::Equation(i) => {
                self.system.mass(at, &mut self.mass);
                self.mass[i] != 0.0
            }
            RowOf::Output(_) => false,
        }
    }

    /// The target of a row; NaN where readings do not give the row.
    pub(crate) fn target(
        &mut self,
        kind: usize,
        recording: usize,
        sample: usize,
        p: &[f64],
    ) -> f64 {
        let known = &self.known[recording];
        let at = known.point(sample, p);
        if sample < known.first || self.kinds[kind].reads.iter().any(|i| at.y[*i].is_nan()) {
            return f64::NAN;
        }
        let of = self.kinds[kind].of;
        match of {
            RowOf::Output(i) => {
                let measured = self.recordings[recording].measured[i].as_ref();
                measured.map_or(f64::NAN, |samples| samples[sample])
            }
            RowOf::Equation(i) if self.is_differential(kind, at) => known.ydot(sample)[i],
            RowOf::Equation(_) => 0.0,
        }
    }

    /// Visits all rows that readings give.
    ///
    /// # Errors
    ///
    /// [`RegressionError::NotFinite`] where such a row has no finite value.
    pub(crate) fn visit(
        &mut self,
        p: &[f64],
        visitor: &mut dyn FnMut(Row<'_>),
    ) -> Result<(), RegressionError> {
        self.visit_every(1, p, visitor)
    }

    /// The same of every so many samples.
    pub(crate) fn visit_every(
        &mut self,
        stride: usize,
        p: &[f64],
        visitor: &mut dyn FnMut(Row<'_>),
    ) -> Result<(), RegressionError> {
        let n = self.free.len();
        let mut targets = vec![0.0; self.kinds.len()];
        let known = self.known;
        for (recording, known) in known.iter().enumerate() {
            for sample in (0..known.times.len()).step_by(stride) {
                for (kind, target) in targets.iter_mut().enumerate() {
                    *target = self.target(kind, recording, sample, p);
                }
                if targets.iter().all(|target| target.is_nan()) {
                    continue;
                }
                self.predict(known.point(sample, p));
                for (kind, &target) in targets.iter().enumerate().filter(|(_, t)| !t.is_nan()) {
                    let predicted = self.predicted[kind];
                    self.slopes.copy_from_slice(&self.by_p[kind * n..(kind + 1) * n]);
                    let mut residual = predicted - target;
                    if let Some(k) = self.kinds[kind].multiplier {
                        // ∂(p_k e)/∂p_j = p_k ∂e/∂p_j + δ_jk e
                        let factor = p[self.free[k]];
                        self.slopes.iter_mut().for_each(|slope| *slope *= factor);
                        self.slopes[k] += residual;
                        residual *= factor;
                    }
                    if !is_summable(residual)
                        || !self.slopes.iter().all(|slope| is_summable(*slope))
                    {
                        return Err(RegressionError::NotFinite {
                            row: self.kinds[kind].name.clone(),
                            recording,
                            t: known.times[sample],
                        });
                    }
                    let slopes = &self.slopes;
                    visitor(Row { kind, predicted, target, residual, slopes });
                }
            }
        }
        Ok(())
    }
}

/// Whether the square of a value is finite, too.
fn is_summable(value: f64) -> bool {
    (value * value).is_finite()
}
