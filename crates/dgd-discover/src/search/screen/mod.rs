//! Screens candidates to first order: the score test.
//!
//! ```text
//!   r = measured − simulated, J = ∂w/∂(fitted parameters and start values), φ = ∂w/∂λ at λ = 0
//!   r⊥, φ⊥: the parts that are orthogonal to J, all in units of the noise
//!   λ̂ = φ⊥ᵀr / φ⊥ᵀφ⊥,   gain in Σ(e/σ)² = (φ⊥ᵀr)² / φ⊥ᵀφ⊥
//! ```
//!
//! λ switches the candidate on: the parameters named by its `null`, or its blend. A simulation with candidates at their
//! nulls gives φ of each. Inner constants of an effect (an onset, a time constant, a friction) have no influence there;
//! they are tried on a grid, with one simulation for each point.
//!
//! Rao, Proc. Cambridge Phil. Soc. 44 (1948) 50; Silvey, Ann. Math. Stat. 30 (1959) 389.

mod inner;
mod projection;
mod resampled;
mod score;
mod steps;
mod weighted;

use dgd_compiler::effects::{AddedItems, EffectBlending};
use dgd_execute::LoadedSystem;
use dgd_identify::journal::kept;
use dgd_runtime::parallel::{in_parallel, in_parallel_stateless};
use dgd_runtime::{Direction, System};

use crate::fit::{FittedStructure, SearchData, StartPoint, ranges};
use crate::library::{
    BaseModel, CarriedValues, EffectCandidate, ModelStructure, QuantityRanges, StructureId,
};

use inner::{InnerConstant, ONSETS, inner_constants};
pub(super) use projection::OrthonormalBasis;
use resampled::PointContrast;
pub(super) use resampled::{
    BLOCKS, ErrorBlocks, MANY_RESAMPLES, PointTrial, RESAMPLES, gain, p_value, resampled_p_value,
};
pub(crate) use score::{
    CandidateScore, ScoreRemedy, Screen, SilentCandidate, are_parallel, best_first,
};
pub(crate) use weighted::{blocks, independent_blocks, weighted};
use weighted::{fitted_directions, sensitivities};

/// Factor by which the grid is refined around the best onset each time …
const ZOOM: i32 = 4;

/// … at most this many times, from a twelfth of a recording of some hours to a second …
const MOST_ZOOMS: usize = 5;

/// … and while that increases a candidate's gain by this factor.
const WORTH_ZOOMING: f64 = 1.02;

/// Maximum number of candidates in a simulation: compilation grows faster than their number.
const TOGETHER: usize = 12;

/// How finely a screen resolves onsets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum OnsetResolution {
    /// On the grid, which suffices for `trials`.
    Grid,
    /// Also refined around the best.
    Refined,
}

/// Maximum number of grid points from which fits begin.
const MOST_POINTS: usize = 3;

/// Screens candidates that are not in a fitted structure. The best comes first.
pub(crate) fn screen(
    base: &BaseModel,
    all: &[EffectCandidate<'_>],
    others: &[usize],
    fitted: &FittedStructure,
    data: &SearchData<'_>,
    resolution: OnsetResolution,
    threads: usize,
) -> Screen {
    let key = data.keeping.key(&("screen", &fitted.structure.id, others, resolution), |digest| {
        let options = data.options_for(&fitted.structure.system);
        digest.debug(&fitted.values).debug(&fitted.estimates).debug(&data.noise).debug(&options)
    });
    kept(data.keeping.journal, key, || {
        computed(base, all, others, fitted, data, resolution, threads)
    })
}

/// Computes the screen.
fn computed(
    base: &BaseModel,
    all: &[EffectCandidate<'_>],
    others: &[usize],
    fitted: &FittedStructure,
    data: &SearchData<'_>,
    resolution: OnsetResolution,
    threads: usize,
) -> Screen {
    let residuals = fitted.residuals(data);
    let Some((basis, undefined)) = fitted_directions(fitted, data) else {
        return Screen::default();
    };
    let blocks = blocks(data, &residuals, independent_blocks(data));
    let weighted = weighted(data, &residuals);
    let (samples, errors) = (weighted.len(), ErrorBlocks::new(&weighted, blocks, &basis));
    let (ranges, basis) = (&ranges(fitted, data), &basis);
    let errors = &errors;
    let parts = ScreenData {
        base,
        all,
        structure: fitted.structure.id,
        values: &fitted.values,
        starts: starts(&fitted.structure),
        data,
        threads,
        basis,
        samples,
        undefined,
        errors,
        ranges,
        resolution,
    };
    let mut screen = Screen::default();
    let count = data.keeping.count("candidates screened", others.len());
    let groups = parts.groups(others, &mut screen.silent);
    // One thread for each group if there are enough groups: a single group often has too few simulations to share.
    let of_group = if groups.len() < threads { threads } else { 1 };
    let parts = ScreenData { threads: of_group, ..parts };
    let screens = in_parallel_stateless(groups.len(), threads, |k| {
        let mut screen = Screen::default();
        parts.screen(&groups[k], &mut screen);
        count.more(groups[k].len());
        screen
    });
    for Screen { scores, silent, trials } in screens {
        screen.scores.extend(scores);
        screen.silent.extend(silent);
        screen.trials.extend(trials);
    }
    best_first(&mut screen.scores);
    screen
}

/// The candidates with which one is screened.
enum CandidateCompany {
    /// Other candidates without inner constants.
    Plain,
    /// Other candidates whose inner constants are onsets.
    WithOnset,
    /// Other templates with inner constants.
    WithConstants,
    /// Alone: it may add states and steps of its own.
    None,
    /// Not screened, with the reason.
    LeftOut(String),
}

/// Data for the screen of one structure.
struct ScreenData<'a> {
    base: &'a BaseModel,
    all: &'a [EffectCandidate<'a>],
    /// The fitted structure, its values, and the number of fitted start values.
    structure: StructureId,
    values: &'a CarriedValues,
    starts: usize,
    data: &'a SearchData<'a>,
    threads: usize,
    basis: &'a OrthonormalBasis,
    /// Number of measured samples.
    samples: usize,
    /// Number of these at which the fitted directions have no derivative.
    undefined: usize,
    errors: &'a ErrorBlocks,
    ranges: &'a QuantityRanges,
    resolution: OnsetResolution,
}

impl ScreenData<'_> {
    /// Groups of candidates that are screened in one simulation, unless one of them hides another.
    fn groups(&self, others: &[usize], silent: &mut Vec<SilentCandidate>) -> Vec<Vec<usize>> {
        let companies =
            in_parallel_stateless(others.len(), self.threads, |k| self.company(others[k]));
        let (mut plain, mut with_onset, mut alone) = (Vec::new(), Vec::new(), Vec::new());
        let mut with_constants = Vec::new();
        for (&candidate, company) in others.iter().zip(companies) {
            match company {
                CandidateCompany::Plain => plain.push(candidate),
                CandidateCompany::WithOnset => with_onset.push(candidate),
                CandidateCompany::WithConstants => with_constants.push(candidate),
                CandidateCompany::None => alone.push(vec![candidate]),
                CandidateCompany::LeftOut(why) => {
                    silent.push(SilentCandidate { candidate, why, remedy: ScoreRemedy::LeaveOut });
                }
            }
        }
        [self.apart(&plain), self.apart(&with_onset), self.apart(&with_constants), alone].concat()
    }

    fn company(&self, one: usize) -> CandidateCompany {
        let (structure, candidate) = (self.structure, &self.all[one]);
        let is_apart = structure.effects().any(|other| self.all[other].excludes(candidate));
        // Whether it can be applied shows when its group is screened.
        if candidate.is_generic && !candidate.has_inner && !is_apart {
            return CandidateCompany::Plain;
        }
        let screening = self.base.screening(self.all, structure, &[one], EffectBlending::Null);
        let (system, brought) = match screening {
            Ok(screening) => screening,
            Err(refused) => {
                return CandidateCompany::LeftOut(format!("cannot be applied: {refused}"));
            }
        };
        let inner = self.inner_of_one(&system, one, &brought[0]);
        let never = inner.iter().find(|inner| inner.is_onset && inner.lower >= inner.upper);
        if let Some(onset) = never {
            return CandidateCompany::LeftOut(format!(
                "cannot begin while something is recorded: the bounds of `{}` rule that out",
                onset.name
            ));
        }
        if is_apart {
            CandidateCompany::None
        } else if inner.is_empty() {
            CandidateCompany::Plain
        } else if inner.iter().all(|inner| inner.is_onset) {
            CandidateCompany::WithOnset
        } else if candidate.is_generic && !candidate.brings_unknowns {
            CandidateCompany::WithConstants
        } else {
            CandidateCompany::None
        }
    }

    /// Candidates in groups in which none hides another.
    fn apart(&self, some: &[usize]) -> Vec<Vec<usize>> {
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for &one in some {
            let is_hidden = |other: &usize| {
                let (other, one) = (&self.all[*other], &self.all[one]);
                other.excludes(one) || other.bends(one)
            };
            let has_room =
                |group: &&mut Vec<usize>| group.len() < TOGETHER && !group.iter().any(is_hidden);
            match groups.iter_mut().find(has_room) {
                Some(group) => group.push(one),
                None => groups.push(vec![one]),
            }
        }
        groups
    }

    /// Screens some candidates with simulations that include all of them; if that fails, in halves.
    fn screen(&self, others: &[usize], screen: &mut Screen) {
        if self.screen_together(others, EffectBlending::Null, screen).is_some() {
            return;
        }
        let [candidate] = *others else {
            let (some, rest) = others.split_at(others.len() / 2);
            for half in [some, rest].into_iter().filter(|half| !half.is_empty()) {
                self.screen(half, screen);
            }
            return;
        };
        // At its null it has no derivative; blended in, with the null's parameters on a grid, it may have one.
        if self.screen_together(others, EffectBlending::Blended, screen).is_none() {
            let why = "has no derivative where it does nothing".to_owned();
            screen.silent.push(SilentCandidate { candidate, why, remedy: ScoreRemedy::Fit });
        }
    }

    /// `None` if the candidates cannot be simulated, or lose derivatives that the fitted structure has; a single
    /// candidate may lose up to half of them.
    fn screen_together(
        &self,
        others: &[usize],
        how: EffectBlending,
        screen: &mut Screen,
    ) -> Option<()> {
        if others.is_empty() {
            return Some(());
        }
        let ScreenData { base, all, .. } = *self;
        let structure = self.structure;
        let (system, brought) = base.screening(all, structure, others, how).ok()?;
        let inner = self.inner_of(others, &system, &brought);
        let together = CandidateBatch { system: &system, brought: &brought, inner: &inner };
        let points = inner.iter().flatten().map(|inner| inner.points).max().unwrap_or(1);
        let grid: Vec<InnerValues> = (0..points).map(|g| together.grid(g)).collect();
        let mut promises: Vec<Vec<GridPromise>> = vec![Vec::new(); others.len()];
        let least = self.try_places(&together, &grid, &mut promises)?;
        // A kink of one candidate may remove the derivatives of all; alone it may lose some of its own.
        let bearable = if others.len() > 1 { 0 } else { self.samples / 2 };
        if least > self.undefined.max(bearable) {
            return None;
        }
        for (((&one, brought), inner), promised) in
            others.iter().zip(&brought).zip(&inner).zip(&mut promises)
        {
            if inner.is_empty() {
                promised.extend(self.steps(&system, &all[one], brought));
            }
        }
        for (&candidate, promised) in others.iter().zip(&mut promises) {
            let is_seen = promised.iter().any(|promise| promise.is_seen);
            promised.retain(|promise| !promise.columns.is_empty());
            let is_better = promised.iter().any(|promise| promise.gain > 0.0);
            let obstacle = match (promised.is_empty(), is_seen) {
                (true, true) => Some((
                    "can change the outputs only as the model's own parameters do",
                    ScoreRemedy::LeaveOut,
                )),
                (true, false) => Some(("changes nothing that is measured", ScoreRemedy::Fit)),
                (false, _) if is_better => None,
                (false, _) if self.has_own_start(candidate) => Some((
                    "begins at a value of its own, which only a fit can find",
                    ScoreRemedy::FitAnyway,
                )),
                (false, _) => {
                    Some(("takes nothing away within its bounds", ScoreRemedy::ScoreIsZero))
                }
            };
            let silent = |(why, remedy): (&str, _)| SilentCandidate {
                candidate,
                why: why.to_owned(),
                remedy,
            };
            screen.silent.extend(obstacle.map(silent));
            let contrasts =
                promised.iter_mut().map(|promise| std::mem::take(&mut promise.contrasts));
            let contrasts = contrasts.filter(|contrasts| !contrasts.is_empty());
            screen.trials.extend(contrasts.map(|contrasts| PointTrial { candidate, contrasts }));
            promised.retain(|promise| promise.gain > 0.0);
            promised.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        }
        if self.resolution == OnsetResolution::Refined {
            self.zoom(others, how, &inner, &mut promises);
        }
        let scores = others.iter().zip(promises).filter_map(|(&candidate, promised)| {
            let best = promised.first()?;
            let (gain, columns) = (best.gain, best.columns.clone());
            let points =
                promised.into_iter().take(MOST_POINTS).map(|promise| promise.point).collect();
            Some(CandidateScore { candidate, gain, points, columns })
        });
        screen.scores.extend(scores);
        Some(())
    }

    /// Simulates candidates with their inner constants at some points, and adds the promise of each there. Returns the
    /// smallest number, over these points, of measured samples with undefined derivatives; `None` if nothing could be
    /// simulated.
    fn try_places(
        &self,
        together: &CandidateBatch<'_>,
        places: &[InnerValues],
        found: &mut [Vec<GridPromise>],
    ) -> Option<usize> {
        let CandidateBatch { system, brought, inner } = *together;
        let (known, data) = (self.values, self.data);
        let runs = in_parallel(system, places.len(), self.threads, |system, g| {
            let mut values = known.clone();
            for (inner, at) in inner.iter().zip(&places[g]) {
                values.p.extend(inner.iter().map(|inner| inner.name.clone()).zip(at.clone()));
            }
            sensitivities(system, &values, data)
        });
        let undefined = runs.iter().flatten().map(|(_, undefined)| *undefined).min();
        for (place, columns) in places.iter().zip(runs) {
            let Some((columns, _)) = columns else { continue };
            let mut columns = columns.into_iter();
            let parts = brought.iter().zip(inner).zip(place).zip(&mut *found);
            for (((brought, inner), at), found) in parts {
                let lambdas: Vec<&String> = brought.null.iter().chain(&brought.blend).collect();
                let columns: Vec<Vec<f64>> = columns.by_ref().take(lambdas.len()).collect();
                if !found.is_empty() && inner.is_empty() {
                    continue;
                }
                let mut promise =
                    promise(system, &lambdas, brought, &columns, self.basis, self.errors);
                let constants = inner.iter().map(|inner| inner.name.clone()).zip(at.clone());
                promise.point.set(constants);
                found.push(promise);
            }
        }
        undefined
    }

    /// Refines the grid around the best onset of each candidate as long as that increases the gain: if readings jump,
    /// an onset loses its gain within a few samples, and no fit finds it from afar. The refined onset replaces the
    /// best.
    fn zoom(
        &self,
        others: &[usize],
        how: EffectBlending,
        inner: &[Vec<InnerConstant>],
        found: &mut [Vec<GridPromise>],
    ) {
        let structure = self.structure;
        // Positions among the others, and the best onset.
        let best = |k: usize| match (inner[k].as_slice(), found[k].first()) {
            ([inner], Some(best)) if inner.is_onset => Some((k, best.point.value(&inner.name))),
            _ => None,
        };
        let mut open: Vec<(usize, f64)> = (0..others.len()).filter_map(best).collect();
        let mut spacing = 1.0 / ONSETS as f64;
        for _ in 0..MOST_ZOOMS {
            let refined: Vec<usize> = open.iter().map(|(k, _)| others[*k]).collect();
            if refined.is_empty() {
                return;
            }
            let Ok((system, brought)) = self.base.screening(self.all, structure, &refined, how)
            else {
                return;
            };
            let inner = self.inner_of(&refined, &system, &brought);
            let together = CandidateBatch { system: &system, brought: &brought, inner: &inner };
            spacing /= f64::from(ZOOM);
            let place = |offset: i32| -> InnerValues {
                let near = |(inner, (_, onset)): (&Vec<InnerConstant>, &(usize, f64))| {
                    let offset = f64::from(offset) * spacing;
                    inner.iter().map(|inner| inner.near(*onset, offset)).collect()
                };
                inner.iter().zip(&open).map(near).collect()
            };
            let about: Vec<InnerValues> =
                (1 - ZOOM..ZOOM).filter(|offset| *offset != 0).map(place).collect();
            let mut closer = vec![Vec::new(); refined.len()];
            self.try_places(&together, &about, &mut closer);
            let mut better = Vec::new();
            for (((k, _), inner), closer) in open.iter().zip(&inner).zip(closer) {
                let closest = closer.into_iter().max_by(|a, b| a.gain.total_cmp(&b.gain));
                let (Some(best), Some(closest)) = (found[*k].first_mut(), closest) else {
                    continue;
                };
                let before = best.gain;
                if closest.gain > before {
                    *best = closest;
                }
                if best.gain > WORTH_ZOOMING * before {
                    let onset = inner.first().map(|inner| best.point.value(&inner.name));
                    better.extend(onset.map(|onset| (*k, onset)));
                }
            }
            open = better;
        }
    }

    /// Whether a candidate adds a fitted start value: its derivative is zero at the candidate's null, and the candidate
    /// would otherwise act like a wrong start value.
    fn has_own_start(&self, candidate: usize) -> bool {
        let with_it = self.structure.with_candidate(candidate);
        let with_it = self.base.structure(self.all, with_it);
        with_it.is_ok_and(|with_it| starts(&with_it) > self.starts)
    }

    fn inner_of_one(
        &self,
        system: &LoadedSystem,
        one: usize,
        brought: &AddedItems,
    ) -> Vec<InnerConstant> {
        inner_constants(system, &self.all[one], brought, self.data.train, self.ranges)
    }

    /// The inner constants of each of some candidates.
    fn inner_of(
        &self,
        some: &[usize],
        system: &LoadedSystem,
        brought: &[AddedItems],
    ) -> Vec<Vec<InnerConstant>> {
        let each = some.iter().zip(brought);
        each.map(|(&one, brought)| self.inner_of_one(system, one, brought)).collect()
    }
}

/// Number of fitted start values of a structure.
fn starts(structure: &ModelStructure) -> usize {
    let directions = &structure.system.signature().directions;
    directions.iter().filter(|one| matches!(one, Direction::Start(_))).count()
}

/// Values of the inner constants of each of some candidates.
type InnerValues = Vec<Vec<f64>>;

/// Candidates that are simulated together.
#[derive(Clone, Copy)]
struct CandidateBatch<'a> {
    system: &'a LoadedSystem,
    brought: &'a [AddedItems],
    /// The inner constants of each.
    inner: &'a [Vec<InnerConstant>],
}

impl CandidateBatch<'_> {
    /// A point of the grid.
    fn grid(&self, g: usize) -> InnerValues {
        self.inner.iter().map(|inner| inner.iter().map(|inner| inner.value(g)).collect()).collect()
    }
}

/// The promise of a candidate at one point of the grid.
#[derive(Debug, Clone)]
struct GridPromise {
    gain: f64,
    point: StartPoint,
    columns: Vec<Vec<f64>>,
    contrasts: Vec<PointContrast>,
    /// Whether it affects any measurement.
    is_seen: bool,
}

/// The gain of the best λ within bounds.
///
/// Several λ of one candidate are treated one after another, each orthogonal to those before.
fn promise(
    system: &LoadedSystem,
    lambdas: &[&String],
    brought: &AddedItems,
    columns: &[Vec<f64>],
    basis: &OrthonormalBasis,
    errors: &ErrorBlocks,
) -> GridPromise {
    let mut basis = basis.clone();
    let (mut gain, mut point) = (0.0, StartPoint::default());
    let (mut kept, mut contrasts) = (Vec::new(), Vec::new());
    for (name, column) in lambdas.iter().zip(columns) {
        let mut parameters = system.signature().parameters.iter();
        let Some(parameter) = parameters.find(|p| *p.name == ***name) else { continue };
        let Some(rest) = basis.project_out(column) else { continue };
        let null = parameter.value;
        let contrast = errors.contrast(&rest, [parameter.lower - null, parameter.upper - null]);
        gain += contrast.gain();
        if brought.blend.as_deref() != Some(name.as_str()) {
            point.values.push(((*name).clone(), null + contrast.estimate()));
            point.at_nothing.push(((*name).clone(), null));
        }
        basis.extend(&rest);
        kept.push(rest);
        contrasts.push(contrast);
    }
    let is_seen = columns.iter().flatten().any(|value| *value != 0.0);
    GridPromise { gain, point, columns: kept, contrasts, is_seen }
}
