//! Effects that take each other back.
//!
//! A loss from one moment on and an inflow of the same size from a later one are together what comes
//! and goes, whatever that is: a good description of it, and two wrong names. Along the trajectory of
//! the structure with both,
//!
//! ```text
//!   d_a(t) = f(t, y) − f_without_a(t, y),   d_b likewise,   d(t) = f(t, y) − f_without_both(t, y)
//! ```
//!
//! and b takes a back where both change the same rows and, while b is at work, d is small beside d_b.
//! Two effects that have nothing to do with each other are equal and opposite by accident only: at one
//! place they are one unknown input. Where a changes other rows, too, b may well follow from it: what runs
//! over into a tank runs over there.

use crate::activity::{AT_WORK, Change, changes};
use crate::search::Search;

/// An effect takes another back where they leave less than this share of it, root mean square: the
/// chance that two sizes that know nothing of each other are so near.
const LEFT: f64 = 0.2;

impl Search<'_> {
    /// Two effects of a structure of which one does nothing but take back what the other does.
    pub(crate) fn cancelling(&self, chosen: &[usize]) -> Option<[usize; 2]> {
        let fitted = self.fitted(chosen)?;
        let without = |some: &[usize]| {
            let rest: Vec<usize> = chosen.iter().copied().filter(|c| !some.contains(c)).collect();
            self.base.structure(self.candidates, &rest).ok()
        };
        let by = |some: &[usize]| {
            let (values, recording) = (&fitted.values, &self.data.train[0]);
            let without = without(some)?;
            Some(changes(&fitted.structure, &without, values, recording, &self.data.options))
        };
        let pairs = chosen
            .iter()
            .enumerate()
            .flat_map(|(i, a)| chosen[i + 1..].iter().map(move |b| [*a, *b]));
        let taken_back = |[a, b]: [usize; 2]| {
            let (by_a, by_b, by_both) = (by(&[a])?, by(&[b])?, by(&[a, b])?);
            if do_cancel(&by_a, &by_b, &by_both) {
                return Some([a, b]);
            }
            do_cancel(&by_b, &by_a, &by_both).then_some([b, a])
        };
        pairs.into_iter().find_map(taken_back)
    }
}

/// Whether an effect takes another back: what the other changes, what it changes, and what both change.
fn do_cancel(by_other: &[Change], by_one: &[Change], by_both: &[Change]) -> bool {
    let is_taken_back = |change: &Change| {
        let largest = change.by.iter().fold(0.0, |most: f64, d| most.max(d.abs()));
        let Some(both) = by_both.iter().find(|both| both.what == change.what) else { return false };
        let (mut own, mut left) = (0.0, 0.0);
        for (k, d) in change.by.iter().enumerate().filter(|(_, d)| d.abs() > AT_WORK * largest) {
            own += d * d;
            left += both.by[k] * both.by[k];
        }
        left < LEFT * LEFT * own
    };
    let is_same_place = by_one.iter().map(|c| &c.what).eq(by_other.iter().map(|c| &c.what));
    is_same_place && !by_one.is_empty() && by_one.iter().all(is_taken_back)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn change(what: &str, f: impl Fn(f64) -> f64) -> Change {
        Change { what: what.to_owned(), by: (0..100).map(|k| f(f64::from(k))).collect() }
    }

    fn step(since: f64, size: f64) -> impl Fn(f64) -> f64 {
        move |t| if t > since { size } else { 0.0 }
    }

    /// Whether the second of two changes of a level takes the first back.
    fn takes_back(first: impl Fn(f64) -> f64, second: impl Fn(f64) -> f64) -> bool {
        let both = change("level", |t| first(t) + second(t));
        do_cancel(&[change("level", first)], &[change("level", second)], &[both])
    }

    #[test]
    fn steps_cancel_where_they_are_equal_and_opposite() {
        assert!(takes_back(step(20.0, -1.0), step(60.0, 0.9)));
        assert!(!takes_back(step(20.0, -1.0), step(60.0, 0.5)));
        assert!(!takes_back(step(20.0, -1.0), step(60.0, -0.9)));
        // The first is alone for half of its time.
        assert!(!takes_back(step(60.0, 0.9), step(20.0, -1.0)));
    }

    #[test]
    fn what_acts_elsewhere_too_is_not_taken_back() {
        let (out, into) = (step(20.0, -1.0), step(20.0, 1.0));
        let overflow = [change("upper", &out), change("lower", &into)];
        let second = [change("lower", &out)];
        let both = [change("upper", &out), change("lower", |_| 0.0)];
        assert!(!do_cancel(&overflow, &second, &both));
    }
}
