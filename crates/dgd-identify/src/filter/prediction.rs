//! From one row to the next: moves the estimate and its covariance along the model.

use dgd_runtime::Inputs;
use nalgebra::{DMatrix, DVector};

use super::estimator::RunningFilter;
use super::interval::{RunState, TimeInterval};
use super::problem::FilterAlgorithm;
use super::remembered::EstimateHistory;
use super::square_root::{beside, integrated_noise, triangular};
use super::unscented::SigmaSpread;
use crate::error::TrialFailure;

impl RunningFilter<'_> {
    /// Moves the estimate to the next row. After an error it is unchanged.
    pub(super) fn predict(
        &mut self,
        inputs: &Inputs,
        over: TimeInterval,
    ) -> Result<(), TrialFailure> {
        match self.estimator {
            FilterAlgorithm::Unscented(spread) => self.predict_points(spread, inputs, over),
            FilterAlgorithm::ExtendedKalman | FilterAlgorithm::Recursive { .. } => {
                let Self { model, coordinates, variables, place, .. } = &*self;
                let moved =
                    model.move_with_sensitivities(inputs, over, place, coordinates, variables)?;
                let mut phi = DMatrix::identity(variables.len(), variables.len());
                phi.view_mut((0, 0), moved.phi.shape()).copy_from(&moved.phi);
                let mut next = variables.clone();
                coordinates.read_states(&moved.place.y, &mut next);
                let moved_with = phi * self.carried.as_ref().unwrap_or(&self.root);
                self.arrive(moved_with, inputs, over, moved.place, next)
            }
        }
    }

    /// [`Self::predict`] by sigma points. Each point follows its own modes; the next interval starts in those of the
    /// middle one.
    fn predict_points(
        &mut self,
        spread: SigmaSpread,
        inputs: &Inputs,
        over: TimeInterval,
    ) -> Result<(), TrialFailure> {
        let Self { model, coordinates, place, .. } = &*self;
        let mut points = spread.points(&self.variables, &self.root);
        let n = self.variables.len();
        let mut middle = None;
        for mut point in points.column_iter_mut() {
            let mut variables: Vec<f64> = point.iter().copied().collect();
            let place = place.moved_by(&variables[coordinates.len()..]);
            let moved = model.move_states(inputs, over, &place, coordinates, &variables)?;
            coordinates.read_states(&moved.y, &mut variables);
            point.copy_from_slice(&variables);
            middle.get_or_insert(moved);
        }
        let (mean, deviations) = spread.moments(&points, n);
        let next: Vec<f64> = mean.iter().copied().collect();
        let mut place = middle.unwrap_or_else(|| place.clone());
        if let Some(past) = &mut place.past {
            past.end_at(coordinates, &next);
        }
        self.arrive(deviations, inputs, over, place, next)
    }

    /// Updates the estimate at the end of an interval: `moved` is the root of its covariance without noise, or the
    /// carried derivatives. After an error all is unchanged.
    fn arrive(
        &mut self,
        moved: DMatrix<f64>,
        inputs: &Inputs,
        over: TimeInterval,
        mut place: RunState,
        mut variables: Vec<f64>,
    ) -> Result<(), TrialFailure> {
        let Self { model, coordinates, .. } = &*self;
        let n_present = coordinates.len();
        let mut gone = Vec::new();
        if let Some(past) = &mut place.past {
            gone = past.forget(model.reach(&coordinates.p(model.p, &variables)));
            for position in &mut gone {
                *position += n_present;
            }
        }
        let known = variables.len() - gone.len();
        variables.truncate(n_present);
        variables.resize(n_present + place.past.as_ref().map_or(0, EstimateHistory::len), 0.0);

        let mut densities = self.guarded(over.length());
        for k in model.held(&place, coordinates) {
            densities[k] = 0.0;
        }
        let strays = self.carried.is_none() && densities.iter().any(|q| *q != 0.0);
        let mut local = None;
        if strays || place.past.is_some() {
            local = Some(model.local(inputs, over.until, &place, coordinates, &variables)?);
        }
        let mut moved = without(moved, &gone);
        if let (Some(local), true) = (&local, strays) {
            let Some(noise) = integrated_noise(&local.a, &densities, over.length()) else {
                let equation = model.system.signature().name.to_string();
                return Err(TrialFailure::NoSensitivity { equation, t: over.until });
            };
            let noise = noise.resize_vertically(known, 0.0);
            let phi = local.phi.columns(0, known).into_owned();
            moved = consistent(&phi, beside(&moved, &noise));
        }
        match &mut self.carried {
            Some(carried) => *carried = moved,
            None => self.root = triangular(&moved),
        }
        (self.place, self.variables) = (place, variables);
        if let (Some(local), true) = (&local, self.place.past.is_some()) {
            self.remember(local.watched.columns(0, known).into_owned());
        }
        self.ahead = local;
        Ok(())
    }

    /// Densities of the process noise; parameters with their initial uncertainty get none.
    fn guarded(&self, dt: f64) -> Vec<f64> {
        let n_states = self.coordinates.n_states();
        let mut densities = self.densities.clone();
        for (k, density) in densities.iter_mut().enumerate().skip(n_states) {
            let variance = self.root.row(k).norm_squared();
            *density = density.min((self.first[k] - variance).max(0.0) / dt);
        }
        densities
    }

    /// Increases the uncertainty of states that could not be moved.
    pub(super) fn stray(&mut self, until: f64, dt: f64) {
        let densities = self.guarded(dt);
        let noise =
            DVector::from_iterator(densities.len(), densities.iter().map(|q| (q * dt).sqrt()));
        let noise = DMatrix::from_diagonal(&noise).resize_vertically(self.root.nrows(), 0.0);
        self.root = triangular(&beside(&self.root, &noise));
        if let Some(past) = &mut self.place.past {
            // The last copy is the best estimate of the values since then.
            past.hold(until);
            let (each, known) = (past.sizes().len(), self.variables.len());
            self.variables.resize(known + each, 0.0);
            let sizes = past.sizes().to_vec();
            self.remember(DMatrix::from_fn(each, known, |row, column| {
                if column + each == known + row { sizes[row] } else { 0.0 }
            }));
        }
    }
}

/// A matrix without some of its rows.
fn without(m: DMatrix<f64>, rows: &[usize]) -> DMatrix<f64> {
    if rows.is_empty() { m } else { m.remove_rows_at(rows) }
}

/// The root of the covariance in which currently algebraic states follow the others.
pub(super) fn consistent(phi: &DMatrix<f64>, root: DMatrix<f64>) -> DMatrix<f64> {
    let (n_states, n) = phi.shape();
    if *phi == DMatrix::identity(n_states, n) {
        return root;
    }
    let mut transition = DMatrix::identity(n, n);
    transition.rows_mut(0, n_states).copy_from(phi);
    transition * root
}
