//! From one row to the next: the estimate along the model, and how uncertain it becomes.

use nalgebra::{DMatrix, DVector};

use super::estimator::Filter;
use super::interval::{Local, Place};
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
                let Self { model, coordinates, variables, place, .. } = &*self;
                let moved = model.move_with_sensitivities(
                    inputs,
                    (from, until),
                    place,
                    coordinates,
                    variables,
                )?;
                let mut phi = DMatrix::identity(coordinates.len(), coordinates.len());
                phi.view_mut((0, 0), moved.phi.shape()).copy_from(&moved.phi);
                let mut next = variables.clone();
                coordinates.read_states(&moved.place.y, &mut next);
                if let Some(carried) = &mut self.carried {
                    *carried = phi * &*carried;
                } else {
                    let moved_root = phi * &self.root;
                    let (root, ahead) =
                        self.with_noise(&moved_root, inputs, (from, until), &moved.place, &next)?;
                    (self.root, self.ahead) = (root, ahead);
                }
                (self.place, self.variables) = (moved.place, next);
                Ok(())
            }
        }
    }

    /// The same by sigma points. Each goes through the modes that it comes to; the next interval begins in
    /// that of the middle one.
    fn predict_points(
        &mut self,
        spread: Spread,
        inputs: &Inputs,
        from: f64,
        until: f64,
    ) -> Result<(), TrialFailure> {
        let Self { model, coordinates, place, .. } = &*self;
        let mut points = spread.points(&self.variables, &self.root);
        let n = coordinates.len();
        let mut middle = None;
        for mut point in points.column_iter_mut() {
            let mut variables: Vec<f64> = point.iter().copied().collect();
            let moved = model.move_states(inputs, (from, until), place, coordinates, &variables)?;
            coordinates.read_states(&moved.y, &mut variables);
            point.copy_from_slice(&variables);
            middle.get_or_insert(moved);
        }
        let (mean, deviations) = spread.moments(&points, n);
        let next: Vec<f64> = mean.iter().copied().collect();
        let place = middle.unwrap_or_else(|| place.clone());
        let (root, _) = self.with_noise(&deviations, inputs, (from, until), &place, &next)?;
        self.root = root;
        (self.place, self.variables) = (place, next);
        Ok(())
    }

    /// Root of the covariance after an interval, from that without noise and what the walks add, with the
    /// model's Jacobian at its end.
    fn with_noise(
        &self,
        without: &DMatrix<f64>,
        inputs: &Inputs,
        (from, until): (f64, f64),
        place: &Place,
        variables: &[f64],
    ) -> Result<(DMatrix<f64>, Option<Local>), TrialFailure> {
        let mut densities = self.guarded(until - from);
        for k in self.model.held(place, &self.coordinates) {
            densities[k] = 0.0;
        }
        if densities.iter().all(|q| *q == 0.0) {
            return Ok((triangular(without), None));
        }
        let local = self.model.local(inputs, until, place, &self.coordinates, variables)?;
        let Some(noise) = integrated_noise(&local.a, &densities, until - from) else {
            let equation = self.model.system.signature().name.to_string();
            return Err(TrialFailure::NoSensitivity { equation, t: until });
        };
        let root = consistent(&local.phi, beside(without, &noise));
        Ok((triangular(&root), Some(local)))
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

/// The root of the covariance in which states that are algebraic at the time follow the others.
pub(super) fn consistent(phi: &DMatrix<f64>, root: DMatrix<f64>) -> DMatrix<f64> {
    let (n_states, n) = phi.shape();
    if *phi == DMatrix::identity(n_states, n) {
        return root;
    }
    let mut all = DMatrix::identity(n, n);
    all.rows_mut(0, n_states).copy_from(phi);
    all * root
}
