//! Screens limits at which an effect begins by finite steps rather than by their derivative.
//!
//! A limit at the edge of a quantity's range acts on one sample at most; further in it acts on more and more. So its
//! derivative at the edge does not show its influence. With w(ℓ) the outputs with the limit at ℓ and ℓ₀ its null,
//!
//! ```text
//!   φ = w(ℓ) − w(ℓ₀),   gain = 2 φ⊥ᵀr − φ⊥ᵀφ⊥
//! ```
//!
//! for the whole step, at some points between the edge and the other end of the limit's range.

use dgd_compiler::effects::AddedItems;
use dgd_execute::LoadedSystem;
use dgd_runtime::System;
use dgd_runtime::parallel::in_parallel;
use dgd_runtime::signature::Parameter;

use super::weighted::outputs;
use super::{GridPromise, OnsetResolution, ScreenData};
use crate::fit::StartPoint;
use crate::library::EffectCandidate;

/// Points of the grid.
const POINTS: usize = 6;

/// Number of times that the grid is refined about the best point, by a factor of three each.
const ZOOMS: usize = 2;

/// Share of Σ (e/σ)² that the best point must promise for a refinement.
const WORTH_ZOOMING: f64 = 0.1;

/// A limit at the edge of its range.
struct RangeLimit<'a> {
    name: &'a str,
    null: f64,
    /// The other end of its range.
    end: f64,
}

impl RangeLimit<'_> {
    fn value(&self, share: f64) -> f64 {
        self.null + share * (self.end - self.null)
    }
}

/// The parameters of a kinked effect whose null is one end of their range.
fn limits<'a>(
    system: &LoadedSystem,
    one: &EffectCandidate<'_>,
    brought: &'a AddedItems,
) -> Vec<RangeLimit<'a>> {
    let limit = |name: &'a String| {
        let mut parameters = system.signature().parameters.iter();
        let &Parameter { value, lower, upper, .. } = parameters.find(|p| *p.name == **name)?;
        let end = match (value == lower, value == upper) {
            (true, false) => upper,
            (false, true) => lower,
            _ => return None,
        };
        end.is_finite().then_some(RangeLimit { name, null: value, end })
    };
    if one.has_kink() { brought.null.iter().filter_map(limit).collect() } else { Vec::new() }
}

impl ScreenData<'_> {
    /// The promise of a candidate with its limits moved, all by the same share of their ranges.
    pub(super) fn steps(
        &self,
        system: &LoadedSystem,
        one: &EffectCandidate<'_>,
        brought: &AddedItems,
    ) -> Vec<GridPromise> {
        let limits = limits(system, one, brought);
        if limits.is_empty() {
            return Vec::new();
        }
        let Some(as_it_is) = outputs(system, self.values, self.data) else { return Vec::new() };
        let try_shares = |shares: &[f64]| -> Vec<(f64, GridPromise)> {
            let promises = in_parallel(system, shares.len(), self.threads, |system, k| {
                let moved =
                    limits.iter().map(|limit| (limit.name.to_owned(), limit.value(shares[k])));
                self.step(system, moved.collect(), &as_it_is)
            });
            let both = shares.iter().copied().zip(promises);
            both.filter_map(|(share, promise)| Some((share, promise?))).collect()
        };
        let grid: Vec<f64> = (0..POINTS).map(|g| (g as f64 + 0.5) / POINTS as f64).collect();
        let mut promises = try_shares(&grid);
        let mut spacing = 1.0 / POINTS as f64;
        let zooms = if self.resolution == OnsetResolution::Refined { ZOOMS } else { 0 };
        for _ in 0..zooms {
            let best = promises.iter().max_by(|(_, a), (_, b)| a.gain.total_cmp(&b.gain));
            let least = WORTH_ZOOMING * self.errors.square();
            let Some((share, _)) = best.filter(|(_, best)| best.gain > least) else { break };
            spacing /= 3.0;
            let mut nearer = try_shares(&[share - spacing, share + spacing]);
            // Points chosen by looking at the data do not count in p-values.
            for (_, promise) in &mut nearer {
                promise.contrasts.clear();
            }
            promises.extend(nearer);
        }
        promises.into_iter().map(|(_, promise)| promise).collect()
    }

    /// The promise of moved limits; `None` if they change nothing that is measured, or cannot be simulated.
    fn step(
        &self,
        system: &LoadedSystem,
        moved: Vec<(String, f64)>,
        as_it_is: &[f64],
    ) -> Option<GridPromise> {
        let mut values = self.values.clone();
        values.p.extend(moved.iter().cloned());
        let outputs = outputs(system, &values, self.data)?;
        let column: Vec<f64> = outputs.iter().zip(as_it_is).map(|(w, before)| w - before).collect();
        let rest = self.basis.project_out(&column)?;
        let contrast = self.errors.contrast(&rest, [0.0, 1.0]);
        let gain = contrast.gain();
        // Held at first: from the edge, a fit makes little progress while the rest of the model has to change.
        let moved_names = moved.iter().map(|(name, _)| name.clone()).collect();
        let mut point = StartPoint { held: moved_names, ..StartPoint::default() };
        point.set(moved.into_iter());
        Some(GridPromise {
            gain,
            point,
            columns: vec![rest],
            contrasts: vec![contrast],
            is_seen: true,
        })
    }
}
