//! Detects effects that cancel each other.
//!
//! A loss from one moment on and an inflow of the same size from a later one together describe anything that comes and
//! goes: a good description, but two wrong names. Along the trajectory of the structure with both,
//!
//! ```text
//!   d_a(t) = f(t, y) − f_without_a(t, y),   d_b likewise,   d(t) = f(t, y) − f_without_both(t, y)
//! ```
//!
//! and b cancels a if both change the same rows and d is small relative to d_b while b is active. Unrelated effects are
//! equal and opposite only by accident: at one place they are one unknown input. The reading of a sensor and the
//! equation of its quantity are two places even if they have one name: an offset in one is a slope in the other. If a
//! also changes other rows, b may be its consequence: an overflow into a tank may make that tank overflow.

use super::activity::{AT_WORK, EffectChange, changes};
use super::tried::EffectSearch;
use crate::fit::FittedStructure;
use crate::library::StructureId;

impl EffectSearch<'_> {
    /// Two effects of a structure, one of which only cancels the other, over all training recordings together.
    pub(crate) fn cancelling(&self, structure: StructureId) -> Option<[usize; 2]> {
        let fitted = self.fitted(structure)?;
        *fitted.cancelling.get_or_init(|| self.taken_back(fitted))
    }

    fn taken_back(&self, fitted: &FittedStructure) -> Option<[usize; 2]> {
        let structure = fitted.structure.id;
        let chosen: Vec<usize> = structure.effects().collect();
        if chosen.len() < 2 {
            return None;
        }
        let changes_by = |some: &[usize]| {
            let rest = structure.effects().filter(|c| !some.contains(c)).collect();
            let without = self.base.structure(self.candidates, rest).ok()?;
            let (values, train) = (&fitted.values, self.data.train);
            Some(changes(&fitted.structure, &without, values, train, &self.data.options))
        };
        let alone: Vec<Option<Vec<EffectChange>>> =
            chosen.iter().map(|c| changes_by(&[*c])).collect();
        let pairs = (0..chosen.len()).flat_map(|i| (i + 1..chosen.len()).map(move |j| (i, j)));
        let taken_back = |(i, j): (usize, usize)| {
            let (Some(by_a), Some(by_b)) = (&alone[i], &alone[j]) else { return None };
            if !are_at_one_place(by_a, by_b) {
                return None;
            }
            let [a, b] = [chosen[i], chosen[j]];
            let by_both = changes_by(&[a, b])?;
            let share = self.thresholds.taken_back;
            if is_taken_back(by_b, &by_both, share) {
                return Some([a, b]);
            }
            is_taken_back(by_a, &by_both, share).then_some([b, a])
        };
        pairs.into_iter().find_map(taken_back)
    }
}

/// Whether two effects change the same rows.
fn are_at_one_place(by_one: &[EffectChange], by_other: &[EffectChange]) -> bool {
    !by_one.is_empty() && by_one.iter().map(|c| &c.what).eq(by_other.iter().map(|c| &c.what))
}

/// Whether an effect is cancelled by another at the same place, from its changes and those of both: less than a
/// fraction `share` is left while it is active.
fn is_taken_back(by_one: &[EffectChange], by_both: &[EffectChange], share: f64) -> bool {
    by_one.iter().all(|change| {
        let largest = change.by.iter().fold(0.0, |most: f64, d| most.max(d.abs()));
        let Some(both) = by_both.iter().find(|both| both.what == change.what) else { return false };
        let (mut own, mut left) = (0.0, 0.0);
        for (k, d) in change.by.iter().enumerate().filter(|(_, d)| d.abs() > AT_WORK * largest) {
            own += d * d;
            left += both.by[k] * both.by[k];
        }
        left < share * share * own
    })
}

#[cfg(test)]
mod tests {
    use super::super::activity::ChangedPlace;
    use super::super::thresholds::Thresholds;
    use super::*;

    fn change(what: &str, f: impl Fn(f64) -> f64) -> EffectChange {
        EffectChange {
            what: ChangedPlace::Equation(what.to_owned()),
            by: (0..100).map(|k| f(f64::from(k))).collect(),
        }
    }

    fn step(since: f64, size: f64) -> impl Fn(f64) -> f64 {
        move |t| if t > since { size } else { 0.0 }
    }

    /// Whether the second of two changes of a level cancels the first.
    fn takes_back(first: impl Fn(f64) -> f64, second: impl Fn(f64) -> f64) -> bool {
        let both = change("level", |t| first(t) + second(t));
        let (first, second) = ([change("level", first)], [change("level", second)]);
        are_at_one_place(&first, &second)
            && is_taken_back(&second, &[both], Thresholds::default().taken_back)
    }

    #[test]
    fn steps_cancel_where_they_are_equal_and_opposite() {
        assert!(takes_back(step(20.0, -1.0), step(60.0, 0.9)));
        assert!(!takes_back(step(20.0, -1.0), step(60.0, 0.5)));
        assert!(!takes_back(step(20.0, -1.0), step(60.0, -0.9)));
        // The first acts alone for half of its time.
        assert!(!takes_back(step(60.0, 0.9), step(20.0, -1.0)));
    }

    #[test]
    fn what_acts_elsewhere_too_is_not_taken_back() {
        let (out, into) = (step(20.0, -1.0), step(20.0, 1.0));
        let overflow = [change("upper", &out), change("lower", &into)];
        let second = [change("lower", &out)];
        assert!(!are_at_one_place(&overflow, &second));
    }

    #[test]
    fn a_sensor_does_not_take_back_what_an_equation_does() {
        let heat = change("T", step(20.0, -1.0));
        let probe = EffectChange {
            what: ChangedPlace::Reading("T".to_owned()),
            ..change("T", step(20.0, 1.0))
        };
        assert!(!are_at_one_place(&[heat], &[probe]));
    }
}
