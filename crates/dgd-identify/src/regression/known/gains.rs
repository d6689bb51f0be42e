//! Sensitivity of unknowns to the readings that determine them.

use dgd_runtime::EvaluationPoint;
use dgd_runtime::for_identify::unknown_sizes;
use dgd_runtime::model::Model;
use nalgebra::DMatrix;

use super::{PseudoInverse, RecordingSamples, SampleSolver, SensorEquations};

/// The sensitivity of unknowns to errors of outputs.
pub(crate) struct Gains<'a> {
    solver: SampleSolver<'a>,
    sizes: Vec<f64>,
    /// Values that replace unknowns that are not known.
    guess: Vec<f64>,
}

impl<'a> Gains<'a> {
    /// The sensitivities near `guess`.
    pub(crate) fn new(
        system: &'a dyn Model,
        sensors: &'a SensorEquations,
        guess: Vec<f64>,
    ) -> Self {
        let mut sizes = vec![0.0; guess.len()];
        unknown_sizes(&system, &guess, &mut sizes);
        Self { solver: SampleSolver::new(system, sensors, sizes.clone()), sizes, guess }
    }

    /// The error of each unknown, SI, for an error of one standard deviation of each output that was measured at sample
    /// k: n × outputs.
    pub(crate) fn compute(
        &mut self,
        known: &RecordingSamples,
        k: usize,
        p: &[f64],
        measured: &dyn Fn(usize) -> f64,
    ) -> Option<DMatrix<f64>> {
        let point = known.point(k, p);
        for (guess, y) in self.guess.iter_mut().zip(point.y) {
            if y.is_finite() {
                *guess = *y;
            }
        }
        let y = self.guess.clone();
        let (matrix, _) = self.solver.linearized(EvaluationPoint { y: &y, ..point }, measured)?;
        if !self.solver.last.as_ref().is_some_and(|(last, _)| *last == matrix) {
            let inverse = PseudoInverse::from_matrix(&matrix)?;
            self.solver.last = Some((matrix, inverse));
        }
        let (_, inverse) = self.solver.last.as_ref()?;
        let sensors = self.solver.sensors.outputs.iter();
        let n_seen = sensors.filter(|(output, _)| measured(*output).is_finite()).count();
        let mut gains = inverse.pseudo.columns(0, n_seen.min(inverse.pseudo.ncols())).into_owned();
        for (mut row, size) in gains.row_iter_mut().zip(&self.sizes) {
            row *= *size;
        }
        Some(gains)
    }
}
