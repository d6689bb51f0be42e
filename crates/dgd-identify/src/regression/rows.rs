//! The rows of a regression: residuals of each equation and output at each sample.
//!
//! | row | predicted | target |
//! |---|---|---|
//! | differential equation i | fᵢ(t, y, u, p) | ẏᵢ |
//! | algebraic equation i | fᵢ(t, y, u, p) | 0 |
//! | output i | wᵢ(t, y, u, p) | measured |
//!
//! The residual is predicted − target; that of an equation with a multiplier p_k is p_k (predicted − target), which
//! undoes the division by the coefficient of the derivative: M ẏ = F has become ẏ = F/M. An equation that is
//! differential in some modes only is not multiplied in the others, and counts there if it reads a parameter.
//!
//! Delayed values move with a delay that is estimated: ∂/∂p also contains −∂f/∂x(t − τ) ẋ(t − τ) ∂τ/∂p.

use dgd_runtime::for_identify::changes_by_mode;
use dgd_runtime::model::Model;
use dgd_runtime::{Direction, EvaluationPoint, Pattern};

use crate::recording::Recording;
use crate::regression::error::RegressionError;
use crate::regression::known::RecordingSamples;
use crate::regression::known::delayed::{BeforeRecord, DelayedColumns};

/// The equation or output of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowOf {
    /// The equation at this position.
    Equation(usize),
    /// The output at this position.
    Output(usize),
}

/// Samples without rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RowsLeftOut {
    /// Their delayed values are before the record.
    pub before_record: usize,
    /// The model cannot be simulated up to them, so their modes are unknown.
    pub without_mode: usize,
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
    /// Delayed unknowns that it reads, each with the position of the derivative with respect to its value among the
    /// non-zeros, and the free parameters in their delays.
    pub delayed: Vec<(usize, usize)>,
    pub in_delays: Vec<usize>,
    /// Position of the free parameter by which it is multiplied.
    pub multiplier: Option<usize>,
}

impl RowKind {
    /// Whether the row depends on the j-th free parameter.
    pub(crate) fn has_parameter(&self, j: usize) -> bool {
        self.in_delays.contains(&j) || self.parameters.iter().any(|(other, _)| *other == j)
    }

    /// All kinds with a free parameter: equations, and used outputs.
    pub(crate) fn all(
        system: &dyn Model,
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
        let delayed = |pattern: &Pattern, row: usize| delayed_reads(system, pattern, row);
        let delaying = delaying(system, free);
        let in_delays = |delayed: &[(usize, usize)]| -> Vec<usize> {
            let reads = |j: &usize| delayed.iter().any(|(k, _)| delaying[*k].contains(j));
            (0..free.len()).filter(reads).collect()
        };
        let equations = (0..signature.unknowns.len()).map(|i| {
            let delayed = delayed(&signature.input_jacobian, i);
            Self {
                of: RowOf::Equation(i),
                name: signature.equations.get(i).into_owned(),
                reads: reads(&signature.jacobian, i),
                parameters: parameters(&signature.parameter_jacobian, i),
                in_delays: in_delays(&delayed),
                delayed,
                multiplier: None,
            }
        });
        let [by_y, by_u, by_p] = &signature.output_jacobians;
        let outputs = (0..signature.outputs.len()).filter(|i| used(*i)).map(|i| {
            let delayed = delayed(by_u, i);
            Self {
                of: RowOf::Output(i),
                name: signature.outputs[i].name.to_string(),
                reads: reads(by_y, i),
                parameters: parameters(by_p, i),
                in_delays: in_delays(&delayed),
                delayed,
                multiplier: None,
            }
        });
        let has_some = |kind: &Self| !(kind.parameters.is_empty() && kind.in_delays.is_empty());
        equations.chain(outputs).filter(has_some).collect()
    }
}

/// Delayed unknowns that a row reads, each with the position of the derivative with respect to its value.
pub(crate) fn delayed_reads(
    system: &dyn Model,
    pattern: &Pattern,
    row: usize,
) -> Vec<(usize, usize)> {
    let values = system.signature().past().values();
    let places = pattern.positions().enumerate();
    let delayed = places.filter(|(_, (r, column))| *r == row && values.contains(column));
    delayed.map(|(place, (_, column))| (column - values.start, place)).collect()
}

/// For each delayed unknown, the free parameters that its delay may depend on.
pub(crate) fn delaying(system: &dyn Model, free: &[usize]) -> Vec<Vec<usize>> {
    let signature = system.signature();
    let p: Vec<f64> = signature.parameters.iter().map(|parameter| parameter.value).collect();
    let (n_tau, n_s) = (signature.delays.len(), signature.directions.len());
    let mut dtau = vec![0.0; n_tau * n_s];
    let delayed = signature.delayed_unknowns.iter();
    if n_tau > 0 && delayed.len() > 0 {
        let point = EvaluationPoint { t: 0.0, y: &[], u: &[], p: &p, z: &[] };
        system.delay_sensitivities(point, &mut dtau);
    }
    let moves = |delay: usize, j: &usize| {
        signature.directions.iter().enumerate().any(|(direction, of)| {
            *of == Direction::Parameter(free[*j]) && dtau[direction * n_tau + delay] != 0.0
        })
    };
    delayed
        .map(|delayed| {
            (0..free.len())
                .filter(|j| !delayed.varies && moves(delayed.delay, j))
                .collect::<Vec<_>>()
        })
        .collect()
}

/// One row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RegressionRow<'a> {
    /// Position of its kind.
    pub kind: usize,
    /// Position of its recording, and of its sample in the recording.
    pub recording: usize,
    pub sample: usize,
    pub predicted: f64,
    pub target: f64,
    /// Multiplied, if its kind has a multiplier.
    pub residual: f64,
    /// Derivatives of the residual with respect to the free parameters.
    pub slopes: &'a [f64],
}

/// Evaluates rows.
pub(crate) struct RegressionRows<'a> {
    system: &'a dyn Model,
    pub recordings: &'a [Recording],
    pub known: &'a [RecordingSamples],
    pub kinds: Vec<RowKind>,
    /// Positions of the free parameters.
    pub free: &'a [usize],
    f: Vec<f64>,
    w: Vec<f64>,
    mass: Vec<f64>,
    /// Whether each equation is differential in some modes and algebraic in others.
    by_mode: Vec<bool>,
    dfdp: Vec<f64>,
    dfdu: Vec<f64>,
    dtau: Vec<f64>,
    delayed_columns: Option<DelayedColumns>,
    u: Vec<f64>,
    output_jacobians: [Vec<f64>; 3],
    dwdt: Vec<f64>,
    /// Predicted values of all kinds and their derivatives, kind by kind.
    predicted: Vec<f64>,
    by_p: Vec<f64>,
    slopes: Vec<f64>,
}

impl<'a> RegressionRows<'a> {
    pub(crate) fn new(
        system: &'a dyn Model,
        recordings: &'a [Recording],
        known: &'a [RecordingSamples],
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
            by_mode: changes_by_mode(&system),
            dfdp: vec![0.0; signature.parameter_jacobian.len()],
            dfdu: vec![0.0; signature.input_jacobian.len()],
            dtau: vec![0.0; signature.delays.len() * signature.directions.len()],
            delayed_columns: DelayedColumns::new(system),
            u: vec![0.0; signature.n_u()],
            output_jacobians: [0, 1, 2].map(|of| vec![0.0; signature.output_jacobians[of].len()]),
            dwdt: vec![0.0; n_w],
            predicted: vec![0.0; kinds.len()],
            by_p: vec![0.0; kinds.len() * free.len()],
            slopes: vec![0.0; free.len()],
            kinds,
        }
    }

    pub(crate) fn system(&self) -> &'a dyn Model {
        self.system
    }

    /// Predicted values of all kinds at a point, and their derivatives with respect to the free parameters, kind by
    /// kind.
    pub(crate) fn predict(&mut self, at: EvaluationPoint<'_>) -> (&[f64], &[f64]) {
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
        if self.kinds.iter().any(|kind| !kind.in_delays.is_empty()) {
            self.add_delays(at);
        }
        (&self.predicted, &self.by_p)
    }

    /// −∂f/∂x(t − τ) ẋ(t − τ) ∂τ/∂p.
    fn add_delays(&mut self, at: EvaluationPoint<'_>) {
        let signature = self.system.signature();
        self.system.input_jacobian(at, &mut self.dfdu);
        self.system.delay_sensitivities(at, &mut self.dtau);
        let (layout, n_tau) = (signature.past(), signature.delays.len());
        for (k, kind) in self.kinds.iter().enumerate() {
            let derivatives = match kind.of {
                RowOf::Equation(_) => &self.dfdu,
                RowOf::Output(_) => &self.output_jacobians[1],
            };
            for (delayed, place) in &kind.delayed {
                let rate = at.u[layout.rates().start + delayed];
                let delay = signature.delayed_unknowns[*delayed].delay;
                for j in &kind.in_delays {
                    let wanted = Direction::Parameter(self.free[*j]);
                    let direction = signature.directions.iter().position(|of| *of == wanted);
                    let slope = direction.map_or(0.0, |of| self.dtau[of * n_tau + delay]);
                    self.by_p[k * self.free.len() + j] -= derivatives[*place] * rate * slope;
                }
            }
        }
    }

    /// Calls `f` with a point of a recording, including delayed values.
    pub(crate) fn with_late<T>(
        &mut self,
        recording: usize,
        at: EvaluationPoint<'_>,
        f: impl FnOnce(&mut Self, EvaluationPoint<'_>) -> T,
    ) -> T {
        let Some(mut delayed) = self.delayed_columns.take() else { return f(self, at) };
        let mut u = std::mem::take(&mut self.u);
        u.copy_from_slice(at.u);
        delayed.write(self.system, &self.known[recording], BeforeRecord::AsAtFirst, at, &mut u);
        let result = f(self, EvaluationPoint { u: &u, ..at });
        (self.delayed_columns, self.u) = (Some(delayed), u);
        result
    }

    /// Whether the row is that of a differential equation at the point.
    pub(crate) fn is_differential(&mut self, kind: usize, at: EvaluationPoint<'_>) -> bool {
        match self.kinds[kind].of {
            RowOf::Equation(i) => {
                self.system.mass(at, &mut self.mass);
                self.mass[i] != 0.0
            }
            RowOf::Output(_) => false,
        }
    }

    /// Whether the multiplier of a row applies at the point: an algebraic equation has not been divided.
    pub(crate) fn is_multiplied(&mut self, kind: usize, at: EvaluationPoint<'_>) -> bool {
        match self.kinds[kind].of {
            RowOf::Equation(i) => !self.by_mode[i] || self.is_differential(kind, at),
            RowOf::Output(_) => true,
        }
    }

    /// The target of a row; NaN if readings do not determine the row.
    pub(crate) fn target(
        &mut self,
        kind: usize,
        recording: usize,
        sample: usize,
        p: &[f64],
    ) -> f64 {
        let known = &self.known[recording];
        if !known.counts(sample) {
            return f64::NAN;
        }
        self.with_late(recording, known.point(sample, p), |rows, at| {
            rows.target_at(kind, recording, sample, at)
        })
    }

    fn target_at(
        &mut self,
        kind: usize,
        recording: usize,
        sample: usize,
        at: EvaluationPoint<'_>,
    ) -> f64 {
        let known = &self.known[recording];
        let RowKind { of, reads, delayed, .. } = &self.kinds[kind];
        let layout = self.system.signature().past();
        let is_unknown = |(k, _): &(usize, usize)| at.u[layout.values().start + k].is_nan();
        if reads.iter().any(|i| at.y[*i].is_nan()) || delayed.iter().any(is_unknown) {
            return f64::NAN;
        }
        if !delayed.is_empty() && !known.has_past(sample) {
            return f64::NAN;
        }
        let subject = *of;
        if self.is_idle(kind, at) {
            return f64::NAN;
        }
        match subject {
            RowOf::Output(i) => {
                let measured = self.recordings[recording].measured[i].as_ref();
                measured.map_or(f64::NAN, |samples| samples[sample])
            }
            RowOf::Equation(i) if self.is_differential(kind, at) => known.ydot(sample)[i],
            RowOf::Equation(_) => 0.0,
        }
    }

    /// Number of samples without rows for lack of a history or of modes.
    pub(crate) fn left_out(&self) -> RowsLeftOut {
        let mut left_out = RowsLeftOut::default();
        for known in self.known {
            let n = known.times.len();
            left_out.without_mode += n - known.lost_from.max(known.first).min(n);
            left_out.before_record += (known.first..n).filter(|k| !known.has_past(*k)).count();
        }
        left_out
    }

    /// Whether the parameters of an equation only enter in modes other than those at the point.
    fn is_idle(&mut self, kind: usize, at: EvaluationPoint<'_>) -> bool {
        let RowOf::Equation(i) = self.kinds[kind].of else { return false };
        if !self.by_mode[i] || self.is_differential(kind, at) {
            return false;
        }
        let n = self.free.len();
        let (_, by_p) = self.predict(at);
        by_p[kind * n..(kind + 1) * n].iter().all(|slope| *slope == 0.0)
    }

    /// Visits all rows that readings determine.
    ///
    /// # Errors
    ///
    /// [`RegressionError::NotFinite`] if such a row has no finite value.
    pub(crate) fn visit(
        &mut self,
        p: &[f64],
        visitor: &mut dyn FnMut(RegressionRow<'_>),
    ) -> Result<(), RegressionError> {
        self.visit_every(1, p, visitor)
    }

    /// [`Self::visit`] for every n-th sample.
    pub(crate) fn visit_every(
        &mut self,
        stride: usize,
        p: &[f64],
        visitor: &mut dyn FnMut(RegressionRow<'_>),
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
                let point = known.point(sample, p);
                self.with_late(recording, point, |rows, at| {
                    rows.predict(at);
                });
                for (kind, &target) in targets.iter().enumerate().filter(|(_, t)| !t.is_nan()) {
                    let predicted = self.predicted[kind];
                    self.slopes.copy_from_slice(&self.by_p[kind * n..(kind + 1) * n]);
                    let mut residual = predicted - target;
                    let multiplier = self.kinds[kind].multiplier;
                    let multiplier = multiplier.filter(|_| self.is_multiplied(kind, point));
                    if let Some(k) = multiplier {
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
                    visitor(RegressionRow {
                        kind,
                        recording,
                        sample,
                        predicted,
                        target,
                        residual,
                        slopes,
                    });
                }
            }
        }
        Ok(())
    }
}

/// Whether a value and its square are finite.
fn is_summable(value: f64) -> bool {
    (value * value).is_finite()
}
