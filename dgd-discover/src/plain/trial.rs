//! Fits of what is suspected.

use dgd_runtime::System;
use dgd_runtime::parallel::in_parallel;

use super::{Cause, Number, Plain, Suspect, Suspicion};
use crate::fit::{Fitted, StartPoint, cost_at};
use crate::library::{Structure, StructureId, Values};
use crate::search::Search;

/// Maximum number of simulations of a fit that begins, and of one that is finished.
const BEGINNING: usize = 10;
pub(super) const EVALUATIONS: usize = 60;
/// Number of causes that are simulated in the validation recordings.
const HELD_OUT: usize = 12;
/// A fit that begins is finished if it leaves at most this fraction of the base model's excess over noise.
const PROMISING: f64 = 0.5;
/// And at most this many times as much as the best one, or as noise.
const HOPEFUL: f64 = 10.0;
/// Least change of a number, in standard deviations.
const SIGNIFICANT: f64 = 4.0;

impl Plain<'_> {
    /// Causes that leave only noise, the likeliest first.
    pub(super) fn explaining(&self, search: &Search<'_>, suspects: &[Suspect]) -> Vec<Cause> {
        let Plain { base, model, data, threads, .. } = *self;
        let begun = in_parallel(self.fitted, suspects.len(), threads, |fitted, k| {
            let plain = Plain { base, model, fitted, data, threads };
            (!data.is_over()).then(|| plain.begun(&suspects[k])).flatten()
        });
        let mut begun: Vec<Cause> = begun.into_iter().flatten().collect();
        let left = |fitted: &Fitted| fitted.error.0 / fitted.error.1 as f64;
        let all = left(self.fitted) - 1.0;
        let least = begun.iter().map(|one| left(&one.fitted)).fold(f64::INFINITY, f64::min);
        begun.retain(|one| {
            let left = left(&one.fitted);
            left - 1.0 <= PROMISING * all && left <= HOPEFUL * least.max(1.0)
        });
        let mut finished = in_parallel(&begun, begun.len(), threads, |begun, k| {
            let Cause { suspicion, fitted } = &begun[k];
            let fitted = fitted.continued(&data.not_kept(), EVALUATIONS);
            let fitted = fitted.unwrap_or_else(|_| begun[k].fitted.clone());
            Cause { suspicion: suspicion.clone(), fitted }
        });
        finished.retain(|one| search.fits(&one.fitted));
        finished.sort_by(|a, b| a.fitted.error.0.total_cmp(&b.fitted.error.0));
        finished.truncate(HELD_OUT);
        for one in &mut finished {
            one.fitted.know_correlations(data);
            one.fitted.hold_out(data, EVALUATIONS);
        }
        finished.retain(|one| {
            let gain = cost(self.fitted) - cost(&one.fitted);
            gain > search.thresholds.least_gain
                && left(&one.fitted) - 1.0 <= PROMISING * all
                && search.leaves_nothing(&one.fitted)
                && one.is_believable()
        });
        finished
    }

    /// A fit of a suspect that begins; `None` if it cannot be fitted.
    fn begun(&self, suspect: &Suspect) -> Option<Cause> {
        let Plain { fitted, data, .. } = *self;
        let Suspect { suspicion, base } = suspect;
        let structure = base.structure(&[], StructureId::BASE).ok()?;
        let Suspicion::Number(number) = suspicion;
        let points = self.points(&structure, number);
        let data = data.not_kept();
        let fitted = Fitted::new(structure, &fitted.values, &points, &data, BEGINNING).ok()?;
        Some(Cause { suspicion: suspicion.clone(), fitted })
    }

    /// Where fits of a number start: at its value, and at the likeliest of those that it would have in another unit. All
    /// others have adapted to its wrong value, so that their own values in the text are a start, too.
    fn points(&self, structure: &Structure, number: &Number) -> Vec<StartPoint> {
        let Plain { fitted, data, .. } = *self;
        let signature = structure.system.signature();
        let declared: Vec<(String, f64)> =
            signature.parameters.iter().map(|own| (own.name.to_string(), own.value)).collect();
        let adapted: Vec<(String, f64)> =
            fitted.values.p.iter().map(|(name, value)| (name.clone(), *value)).collect();
        let at = |of: &[(String, f64)], value: f64| {
            let others = of.iter().filter(|(name, _)| *name != number.name).cloned();
            others.chain([(number.name.clone(), value)]).collect::<Vec<_>>()
        };
        let cost = |point: &[(String, f64)]| {
            let values = Values { p: point.iter().cloned().collect(), ..fitted.values.clone() };
            cost_at(structure, &values, data)
        };
        let own = at(&adapted, number.declared);
        let mut best = (cost(&own), own);
        for value in number.in_other_units() {
            for of in [&adapted, &declared] {
                let point = at(of, value);
                let cost = cost(&point);
                if cost < best.0 {
                    best = (cost, point);
                }
            }
        }
        let mut start = StartPoint::default();
        start.set(best.1.into_iter());
        vec![start]
    }
}

/// Σ ε² + k ln N of the training recordings.
pub(super) fn cost(fitted: &Fitted) -> f64 {
    let (sum, n) = fitted.error;
    sum + fitted.free() as f64 * (n as f64).ln()
}

impl Cause {
    /// Whether the recordings determine what is wrong, and it is.
    fn is_believable(&self) -> bool {
        match &self.suspicion {
            Suspicion::Number(number) => {
                let own = self.fitted.estimates.iter();
                let mut own = own.filter(|e| e.recording.is_none() && e.name == number.name);
                own.any(|own| {
                    let off = (own.value - number.declared).abs();
                    own.std.is_some_and(|std| off > SIGNIFICANT * std)
                        && !self.fitted.is_at_bound(own)
                })
            }
        }
    }
}
