//! From one row to the next: the estimate along the model, and how uncertain it becomes.

use nalgebra::{DMatrix, DVector};

use super::estimator::Filter;
use super::interval::Local;
use super::problem::Estimator;
use super::square_root::{beside, integrated_noise, triangular};
use super::unscented::Spread;
use crate::identify::error::TrialFailure;
use crate::signal::Inputs;
use crate::system::System;

impl<S: System> Filter<'_, S> {
    /// Moves the estimate to the next row. After an error it is where it was.
    pub(super) fn predict(
        &mut self,
        inputs: &Inputs,
        from: f64,
        until: f64,
    ) -> Result<(), TrialFailure> {
        match self.estimator {
            Estimator::Unscented(spread) => self.predict_points(spread, inputs, from, until),
            Estimator::ExtendedKalman | Estimator::Recursive { .. } => {
                let Self { model, coordinates, variables, y, .. } = &*self;
                let moved = model.move_with_sensitivities(
                    inputs,
                    (from, until),
                    y,
                    coordinates,
                    variables,
                )?;
                let mut phi = DMatrix::identity(coordinates.len(), coordinates.len());
                phi.view_mut((0, 0), moved.phi.shape()).copy_from(&moved.phi);
                let mut next = variables.clone();
                coordinates.read_states(&moved.y, &mut next);
                if let Some(carried) = &mut self.carried {
                    *carried = phi * &*carried;
                } else {
                    let (noise, ahead) = self.noise_over(inputs, (from, until), &moved.y, &next)?;
                    self.root = triangular(&beside(&(phi * &self.root), &noise));
                    self.ahead = ahead;
                }
                (self.y, self.variables) = (moved.y, next);
                Ok(())
            }
        }
    }

    /// The same by sigma points.
    fn predict_points(
        &mut self,
        spread: Spread,
        inputs: &Inputs,
        from: f64,
        until: f64,
    ) -> Result<(), TrialFailure> {
        let Self { model, coordinates, y, .. } = &*self;
        let mut points = spread.points(&self.variables, &self.root);
        let n = coordinates.len();
        let mut middle = None;
        for mut point in points.column_iter_mut() {
            let mut variables: Vec<f64> = point.iter().copied().collect();
            let moved = model.move_states(inputs, (from, until), y, coordinates, &variables)?;
            coordinates.read_states(&moved, &mut variables);
            point.copy_from_slice(&variables);
            middle.get_or_insert(moved);
        }
        let (mean, deviations) = spread.moments(&points, n);
        let next: Vec<f64> = mean.iter().copied().collect();
        let y = middle.unwrap_or_else(|| y.clone());
        let (noise, _) = self.noise_over(inputs, (from, until), &y, &next)?;
        self.root = triangular(&beside(&deviations, &noise));
        (self.y, self.variables) = (y, next);
        Ok(())
    }

    /// Root of what the walks add over an interval, with the model's Jacobian at its end.
    fn noise_over(
        &self,
        inputs: &Inputs,
        (from, until): (f64, f64),
        y: &[f64],
        variables: &[f64],
    ) -> Result<(DMatrix<f64>, Option<Local>), TrialFailure> {
        let n = self.coordinates.len();
        let densities = self.guarded(until - from);
        if densities.iter().all(|q| *q == 0.0) {
            return Ok((DMatrix::zeros(n, 0), None));
        }
        let local = self.model.local(inputs, until, y, &self.coordinates, variables)?;
        let Some(noise) = integrated_noise(&local.a, &densities, until - from) else {
            let equation = self.model.system.signature().name.to_string();
            return Err(TrialFailure::NoSensitivity { equation, t: until });
        };
        Ok((noise, Some(local)))
    }

    /// Densities of the walks; parameters that are as uncertain as at first do not walk.
    fn guarded(&self, dt: f64) -> Vec<f64> {
        let n_states = self.coordinates.n_states();
        let mut densities = self.densities.clone();
        for (k, density) in densities.iter_mut().enumerate().skip(n_states) {
            let variance = self.root.row(k).norm_squared();
            *density = density.min((self.first[k] - variance).max(0.0) / dt);
        }
        densities
    }

    /// States that could not be moved are less certain.
    pub(super) fn stray(&mut self, dt: f64) {
        let densities = self.guarded(dt);
        let noise =
            DVector::from_iterator(densities.len(), densities.iter().map(|q| (q * dt).sqrt()));
        self.root = triangular(&beside(&self.root, &DMatrix::from_diagonal(&noise)));
    }
}
