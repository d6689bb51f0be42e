//! What each candidate promises, to first order: the score test.
//!
//! ```text
//!   r = measured − simulated, J = ∂w/∂(fitted parameters and start values), φ = ∂w/∂λ at λ = 0
//!   r⊥, φ⊥: what is orthogonal to J, all in units of the noise
//!   λ̂ = φ⊥ᵀr / φ⊥ᵀφ⊥,   gain in Σ(e/σ)² = (φ⊥ᵀr)² / φ⊥ᵀφ⊥
//! ```
//!
//! λ is what switches the candidate on: the parameters that its `null` names, or its blend. A
//! simulation with candidates at nothing gives φ of each. Constants within an effect (an onset,
//! a time constant, a friction) do nothing there; they are tried on a grid, one simulation for each
//! point of it.
//!
//! Rao, Proc. Cambridge Phil. Soc. 44 (1948) 50; Silvey, Ann. Math. Stat. 30 (1959) 389.

mod projection;
mod resampled;

use std::sync::{Mutex, PoisonError};

use dgd_compiler::effects::{Blending, Brought};
use dgd_execute::Loaded;
use dgd_identify::Recording;
use dgd_identify::journal::{Kept, kept};
use dgd_identify::keep_by_fields;
use dgd_identify::outputs_with_sensitivities as observe;
use dgd_runtime::{Direction, System};

use crate::fit::{Data, Fitted, StartPoint, in_parallel, ranges, whitened};
use crate::library::{BaseModel, Candidate, Ranges, Structure, Values, range_of};
use crate::noise::Whitener;

pub(super) use projection::Basis;
use projection::dot;
use resampled::Contrast;
pub(super) use resampled::{
    BLOCKS, Errors, MANY_RESAMPLES, RESAMPLES, Trial, gain, p_value, resampled_p_value,
};

/// Points of the grid of an onset: a fit finds an onset that lies within a tenth of the recording.
const ONSETS: usize = 12;

/// About the best onset the grid is made finer so many times each time …
const ZOOM: i32 = 6;

/// … at most so often, from a twelfth of a recording of some hours to a second …
const MOST_ZOOMS: usize = 4;

/// … and while that gains a candidate so much.
const WORTH_ZOOMING: f64 = 1.02;

/// Points of the grid of another inner constant, whose effect changes slowly with it.
const CONSTANTS: usize = 6;

/// What a candidate promises.
#[derive(Debug, Clone)]
pub(crate) struct Score {
    /// Position of the candidate.
    pub candidate: usize,
    /// The most that it takes from Σ (e/σ)², over the grid.
    pub gain: f64,
    /// Where to begin a fit, the best first.
    pub points: Vec<StartPoint>,
    /// φ⊥ at the best point of the grid, one column for each λ.
    pub columns: Vec<Vec<f64>>,
}

/// What a screen says.
#[derive(Debug, Clone, Default)]
pub(crate) struct Screen {
    /// Candidates that promise something, the best first.
    pub scores: Vec<Score>,
    /// What each candidate could gain at each place of its grid, whether it does or not.
    pub trials: Vec<Trial>,
    /// Candidates whose score says little or nothing.
    pub silent: Vec<Silent>,
}

/// A candidate whose score says little or nothing.
#[derive(Debug, Clone)]
pub(crate) struct Silent {
    /// Position of the candidate.
    pub candidate: usize,
    /// Why, as what follows its name.
    pub why: String,
    /// What may be done about it.
    pub remedy: Remedy,
}

/// What may be done about a candidate whose score says little.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Remedy {
    /// Its score is that it takes nothing away.
    ScoreIsZero,
    /// It can be fitted from the values in its file.
    Fit,
    /// That, too, since its score is nothing for a reason that a fit does not have.
    FitAnyway,
    /// Nothing.
    LeaveOut,
}

/// How closely a screen looks for onsets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Resolution {
    /// On the grid: all that `trials` need.
    Grid,
    /// Refined about the best, too.
    Refined,
}

/// Squared cosine between the columns of candidates that are the same equations: the solver's error
/// is what is left of it.
const PARALLEL: f64 = 1.0 - 1e-6;

/// Most points of the grid to begin fits from.
const MOST_POINTS: usize = 3;

/// Screens candidates that are not in a fitted structure. The best comes first.
pub(crate) fn screen(
    base: &BaseModel,
    all: &[Candidate<'_>],
    others: &[usize],
    fitted: &Fitted,
    data: &Data<'_>,
    resolution: Resolution,
    threads: usize,
) -> Screen {
    let key = data.keeping.key(&("screen", &fitted.structure.id, others, resolution), |digest| {
        digest.of(&fitted.values).of(&fitted.estimates).of(&data.noise).of(&data.options)
    });
    kept(data.keeping.journal, key, || {
        computed(base, all, others, fitted, data, (resolution, threads))
    })
}

/// The screen, computed.
fn computed(
    base: &BaseModel,
    all: &[Candidate<'_>],
    others: &[usize],
    fitted: &Fitted,
    data: &Data<'_>,
    (resolution, threads): (Resolution, usize),
) -> Screen {
    let residuals = fitted.residuals(data);
    let Some((basis, undefined)) = fitted_directions(fitted, data) else {
        return Screen::default();
    };
    let blocks = blocks(data, &residuals, independent_blocks(data));
    let weighted = weighted(data, &residuals);
    let (samples, errors) = (weighted.len(), Errors::new(&weighted, blocks, &basis));
    let (ranges, basis) = (&ranges(fitted, data), &basis);
    let errors = &errors;
    let parts = Parts {
        base,
        all,
        fitted,
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
    for group in parts.groups(others, &mut screen.silent) {
        parts.screen(&group, &mut screen);
        count.more(group.len());
    }
    best_first(&mut screen.scores);
    screen
}

/// Puts the best first.
pub(crate) fn best_first(scores: &mut [Score]) {
    scores.sort_by(|a, b| b.gain.total_cmp(&a.gain).then(a.candidate.cmp(&b.candidate)));
}

/// Whether two candidates do the same to the outputs, to first order and but for a factor.
pub(crate) fn are_parallel(a: &Score, b: &Score) -> bool {
    let ([a], [b]) = (a.columns.as_slice(), b.columns.as_slice()) else { return false };
    a.len() == b.len() && dot(a, b).powi(2) > PARALLEL * dot(a, a) * dot(b, b)
}

/// What the screen of one structure works with.
struct Parts<'a> {
    base: &'a BaseModel,
    all: &'a [Candidate<'a>],
    fitted: &'a Fitted,
    data: &'a Data<'a>,
    threads: usize,
    basis: &'a Basis,
    /// Measured samples.
    samples: usize,
    /// Those at which the fitted directions have no derivative.
    undefined: usize,
    errors: &'a Errors,
    ranges: &'a Ranges,
    resolution: Resolution,
}

impl Parts<'_> {
    /// Candidates that are screened in one simulation: all that have no inner constants, all whose
    /// inner constants are onsets, unless one of them hides another, and each of the others alone,
    /// since it may bring states and steps of its own.
    fn groups(&self, others: &[usize], silent: &mut Vec<Silent>) -> Vec<Vec<usize>> {
        let (mut plain, mut with_onset, mut alone) = (Vec::new(), Vec::new(), Vec::new());
        let structure = self.fitted.structure.id;
        for &other in others {
            let mut leave_out = |why: String| {
                silent.push(Silent { candidate: other, why, remedy: Remedy::LeaveOut });
            };
            let (system, brought) =
                match self.base.screening(self.all, structure, &[other], Blending::Null) {
                    Ok(screening) => screening,
                    Err(refused) => {
                        leave_out(format!("cannot be applied: {}", refused.0));
                        continue;
                    }
                };
            let inner = inner_constants(&system, &self.all[other], &brought[0], self);
            if let Some(onset) =
                inner.iter().find(|inner| inner.is_onset && inner.lower >= inner.upper)
            {
                leave_out(format!(
                    "cannot begin while something is recorded: the bounds of `{}` rule that out",
                    onset.name
                ));
                continue;
            }
            if structure.effects().any(|one| self.all[one].excludes(&self.all[other])) {
                alone.push(vec![other]);
            } else if inner.is_empty() {
                plain.push(other);
            } else if inner.iter().all(|inner| inner.is_onset) {
                with_onset.push(other);
            } else {
                alone.push(vec![other]);
            }
        }
        [self.apart(&plain), self.apart(&with_onset), alone].concat()
    }

    /// Candidates in groups in which none hides another.
    fn apart(&self, some: &[usize]) -> Vec<Vec<usize>> {
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for &one in some {
            let is_hidden = |other: &usize| self.all[*other].excludes(&self.all[one]);
            match groups.iter_mut().find(|group| !group.iter().any(is_hidden)) {
                Some(group) => group.push(one),
                None => groups.push(vec![one]),
            }
        }
        groups
    }

    /// Screens some candidates by simulations that hold them all; where these cannot be had, one by
    /// one.
    fn screen(&self, others: &[usize], screen: &mut Screen) {
        if self.screen_together(others, Blending::Null, screen).is_some() {
            return;
        }
        let [candidate] = *others else {
            for &other in others {
                self.screen(&[other], screen);
            }
            return;
        };
        // At its null it has no derivative; blended in, with the null's parameters on a grid, it may.
        if self.screen_together(others, Blending::Blended, screen).is_none() {
            let why = "has no derivative where it does nothing".to_owned();
            screen.silent.push(Silent { candidate, why, remedy: Remedy::Fit });
        }
    }

    /// Nothing where the candidates cannot be simulated, or lose derivatives that the fitted structure
    /// has: one by itself more than half of them.
    fn screen_together(&self, others: &[usize], how: Blending, screen: &mut Screen) -> Option<()> {
        if others.is_empty() {
            return Some(());
        }
        let Parts { base, all, .. } = *self;
        let structure = self.fitted.structure.id;
        let (system, brought) = base.screening(all, structure, others, how).ok()?;
        let inner = self.inner_of(others, &system, &brought);
        let together = Together { system: &system, brought: &brought, inner: &inner };
        let points = inner.iter().flatten().map(|inner| inner.points).max().unwrap_or(1);
        let grid: Vec<Place> = (0..points).map(|g| together.grid(g)).collect();
        let mut found: Vec<Vec<Promise>> = vec![Vec::new(); others.len()];
        let least = self.try_places(&together, &grid, &mut found)?;
        // A kink of one of them may take the derivatives of all; of its own it may lose some.
        let bearable = if others.len() > 1 { 0 } else { self.samples / 2 };
        if least > self.undefined.max(bearable) {
            return None;
        }
        for (&candidate, found) in others.iter().zip(&mut found) {
            let is_seen = found.iter().any(|promise| promise.is_seen);
            found.retain(|promise| !promise.columns.is_empty());
            let is_better = found.iter().any(|promise| promise.gain > 0.0);
            let said = match (found.is_empty(), is_seen) {
                (true, true) => Some((
                    "can change the outputs only as the model's own parameters do",
                    Remedy::LeaveOut,
                )),
                (true, false) => Some(("changes nothing that is measured", Remedy::Fit)),
                (false, _) if is_better => None,
                (false, _) if self.has_own_start(candidate) => Some((
                    "begins at a value of its own, which only a fit can find",
                    Remedy::FitAnyway,
                )),
                (false, _) => Some(("takes nothing away within its bounds", Remedy::ScoreIsZero)),
            };
            let silent =
                |(why, remedy): (&str, _)| Silent { candidate, why: why.to_owned(), remedy };
            screen.silent.extend(said.map(silent));
            let contrasts = found.iter_mut().map(|promise| std::mem::take(&mut promise.contrasts));
            screen.trials.extend(contrasts.map(|contrasts| Trial { candidate, contrasts }));
            found.retain(|promise| promise.gain > 0.0);
            found.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        }
        if self.resolution == Resolution::Refined {
            self.zoom(others, how, &inner, &mut found);
        }
        let scores = others.iter().zip(found).filter_map(|(&candidate, found)| {
            let best = found.first()?;
            let (gain, columns) = (best.gain, best.columns.clone());
            let points = found.into_iter().take(MOST_POINTS).map(|promise| promise.point).collect();
            Some(Score { candidate, gain, points, columns })
        });
        screen.scores.extend(scores);
        Some(())
    }

    /// Simulates candidates with their inner constants at some places, and adds what each promises
    /// there; says at how many measured samples derivatives are undefined, at the place where they are
    /// fewest, and nothing where nothing could be simulated.
    fn try_places(
        &self,
        together: &Together<'_>,
        places: &[Place],
        found: &mut [Vec<Promise>],
    ) -> Option<usize> {
        let Together { system, brought, inner } = *together;
        let (known, data) = (&self.fitted.values, self.data);
        // Loaded models are for one thread each.
        let systems: Vec<Mutex<Loaded>> =
            places.iter().map(|_| Mutex::new(system.clone())).collect();
        let runs = in_parallel(self.threads, places.len(), |g| {
            let mut values = known.clone();
            for (inner, at) in inner.iter().zip(&places[g]) {
                values.p.extend(inner.iter().map(|inner| inner.name.clone()).zip(at.clone()));
            }
            let system = systems[g].lock().unwrap_or_else(PoisonError::into_inner);
            sensitivities(&system, &values, data)
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
                let at = inner.iter().map(|inner| inner.name.clone()).zip(at.clone());
                promise.point.set(at);
                found.push(promise);
            }
        }
        undefined
    }

    /// Looks closer about the best onset of each candidate, as long as that gains something: readings
    /// that jump lose all that an onset gains within a few samples, and no fit finds it from afar.
    /// What is found in the end takes the place of the best.
    fn zoom(
        &self,
        others: &[usize],
        how: Blending,
        inner: &[Vec<Inner>],
        found: &mut [Vec<Promise>],
    ) {
        let structure = self.fitted.structure.id;
        // Positions among the others, and where the best onset is.
        let best = |k: usize| match (inner[k].as_slice(), found[k].first()) {
            ([inner], Some(best)) if inner.is_onset => Some((k, best.point.value(&inner.name))),
            _ => None,
        };
        let mut open: Vec<(usize, f64)> = (0..others.len()).filter_map(best).collect();
        let mut spacing = 1.0 / ONSETS as f64;
        for _ in 0..MOST_ZOOMS {
            let own: Vec<usize> = open.iter().map(|(k, _)| others[*k]).collect();
            if own.is_empty() {
                return;
            }
            let Ok((system, brought)) = self.base.screening(self.all, structure, &own, how) else {
                return;
            };
            let inner = self.inner_of(&own, &system, &brought);
            let together = Together { system: &system, brought: &brought, inner: &inner };
            spacing /= f64::from(ZOOM);
            let place = |offset: i32| -> Place {
                let near = |(inner, (_, onset)): (&Vec<Inner>, &(usize, f64))| {
                    let offset = f64::from(offset) * spacing;
                    inner.iter().map(|inner| inner.near(*onset, offset)).collect()
                };
                inner.iter().zip(&open).map(near).collect()
            };
            let about: Vec<Place> =
                (1 - ZOOM..ZOOM).filter(|offset| *offset != 0).map(place).collect();
            let mut closer = vec![Vec::new(); own.len()];
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

    /// Whether a candidate brings a start value that is fitted with it: its derivative is nothing where
    /// the candidate does nothing, and what the candidate then does is that of a wrong start.
    fn has_own_start(&self, candidate: usize) -> bool {
        let with_it = self.fitted.structure.id.with(candidate);
        let starts = |structure: &Structure| {
            let directions = &structure.system.signature().directions;
            directions.iter().filter(|one| matches!(one, Direction::Start(_))).count()
        };
        let with_it = self.base.structure(self.all, with_it);
        with_it.is_ok_and(|with_it| starts(&with_it) > starts(&self.fitted.structure))
    }

    /// Inner constants of each of some candidates.
    fn inner_of(&self, some: &[usize], system: &Loaded, brought: &[Brought]) -> Vec<Vec<Inner>> {
        let each = some.iter().zip(brought);
        each.map(|(&one, brought)| inner_constants(system, &self.all[one], brought, self)).collect()
    }
}

/// Inner constants of each of some candidates.
type Place = Vec<Vec<f64>>;

/// Candidates that are simulated together.
#[derive(Clone, Copy)]
struct Together<'a> {
    system: &'a Loaded,
    brought: &'a [Brought],
    /// Inner constants of each.
    inner: &'a [Vec<Inner>],
}

impl Together<'_> {
    /// A point of the grid.
    fn grid(&self, g: usize) -> Place {
        self.inner.iter().map(|inner| inner.iter().map(|inner| inner.at(g)).collect()).collect()
    }
}

keep_by_fields!(Screen { scores, trials, silent });

keep_by_fields!(Silent { candidate, why, remedy });

impl Kept for Remedy {
    fn write(&self, bytes: &mut Vec<u8>) {
        let fits = matches!(self, Remedy::Fit | Remedy::FitAnyway);
        [matches!(self, Remedy::ScoreIsZero | Remedy::FitAnyway), fits].write(bytes);
    }

    fn read(bytes: &mut &[u8]) -> Option<Self> {
        match <[bool; 2]>::read(bytes)? {
            [true, false] => Some(Remedy::ScoreIsZero),
            [false, true] => Some(Remedy::Fit),
            [false, false] => Some(Remedy::LeaveOut),
            [true, true] => Some(Remedy::FitAnyway),
        }
    }
}

keep_by_fields!(Score { candidate, gain, points, columns });

/// What a candidate promises at one point of the grid.
#[derive(Debug, Clone)]
struct Promise {
    gain: f64,
    point: StartPoint,
    columns: Vec<Vec<f64>>,
    contrasts: Vec<Contrast>,
    /// Whether it changes anything that is measured.
    is_seen: bool,
}

/// The gain of the best λ within bounds.
///
/// Several λ of one candidate are taken one after another, each orthogonal to those before.
fn promise(
    system: &Loaded,
    lambdas: &[&String],
    brought: &Brought,
    columns: &[Vec<f64>],
    basis: &Basis,
    errors: &Errors,
) -> Promise {
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
    Promise { gain, point, columns: kept, contrasts, is_seen }
}

/// A constant within an effect, and where it is tried.
struct Inner {
    name: String,
    lower: f64,
    upper: f64,
    log: bool,
    /// Points of its grid.
    points: usize,
    is_onset: bool,
    /// Which of the candidate's inner constants it is.
    place: usize,
}

impl Inner {
    /// Its value at a point of the grid. The constants of one candidate go through their grids in
    /// different orders, so that they do not only move together.
    fn at(&self, g: usize) -> f64 {
        // Strides without a common divisor with 6 and 12.
        let stride = [1, 5, 7, 11][self.place % 4];
        let share = ((g * stride % self.points) as f64 + 0.5) / self.points as f64;
        if self.log {
            (self.lower.ln() + share * (self.upper / self.lower).ln()).exp()
        } else {
            self.lower + share * (self.upper - self.lower)
        }
    }
}

impl Inner {
    /// So far from a value, in shares of its range, and within it.
    fn near(&self, value: f64, offset: f64) -> f64 {
        (value + offset * (self.upper - self.lower)).clamp(self.lower, self.upper)
    }
}

/// The constants of a candidate that do nothing at its null.
fn inner_constants(
    system: &Loaded,
    candidate: &Candidate<'_>,
    brought: &Brought,
    parts: &Parts<'_>,
) -> Vec<Inner> {
    let names = brought.parameters.iter().filter(|name| !brought.null.contains(name));
    let parameters = names.filter_map(|name| {
        let parameter = system.signature().parameters.iter().find(|p| *p.name == **name)?;
        (!parameter.fixed).then_some((name, parameter))
    });
    let inner = parameters.enumerate().map(|(place, (name, parameter))| {
        let own = brought.names.iter().find(|(_, new)| new == name).map(|(own, _)| own);
        let is_onset = own.is_some_and(|own| candidate.onsets.contains(own));
        let size = if parameter.value == 0.0 { parameter.unit.factor } else { parameter.value };
        let (lower, upper) = if is_onset {
            let (first, last) = span(parts.data.train);
            (first.max(parameter.lower), last.min(parameter.upper))
        } else if let (false, Some(range)) =
            (parameter.upper.is_finite(), range_of(candidate, &parameter.unit.symbol, parts.ranges))
        {
            range
        } else {
            // Without a bound, five times more or less than what the effect suggests.
            let open = |bound: f64, other: f64| if bound.is_finite() { bound } else { other };
            (open(parameter.lower, size / 5.0), open(parameter.upper, size * 5.0))
        };
        let log = parameter.log && lower > 0.0 && !is_onset;
        let points = if is_onset { ONSETS } else { CONSTANTS };
        Inner { name: name.clone(), lower, upper, log, points, is_onset, place }
    });
    inner.collect()
}

/// First and last time of the recordings.
fn span(recordings: &[Recording]) -> (f64, f64) {
    let times = recordings.iter().flat_map(|recording| &recording.times);
    times.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(*t), b.max(*t)))
}

/// The span of what is fitted already: parameters, and start values of each recording; and at how many
/// measured samples derivatives to it are undefined.
fn fitted_directions(fitted: &Fitted, data: &Data<'_>) -> Option<(Basis, usize)> {
    let structure = &fitted.structure;
    let system = &structure.system;
    let is_held = |j: usize| {
        let name = system.signature().direction_name(j);
        fitted.estimates.iter().any(|e| e.name == name && e.at_bound.is_some())
    };
    let shared = |j: usize| matches!(system.signature().directions[j], Direction::Parameter(_));
    let per_recording = sensitivities_by_recording(system, &fitted.values, data)?;
    let samples: usize = per_recording.iter().map(|columns| columns.rows).sum();
    let mut all = Vec::new();
    for j in 0..system.signature().directions.len() {
        if is_held(j) {
            continue;
        }
        if shared(j) {
            all.push(per_recording.iter().flat_map(|part| part.columns[j].clone()).collect());
            continue;
        }
        let mut before = 0;
        for part in &per_recording {
            let mut column = vec![0.0; samples];
            column[before..before + part.rows].copy_from_slice(&part.columns[j]);
            before += part.rows;
            all.push(column);
        }
    }
    let undefined = per_recording.iter().map(|part| part.undefined).sum();
    Some((Basis::new(&all), undefined))
}

/// Weighted sensitivities of the measured samples of one recording.
struct Part {
    rows: usize,
    /// One for each direction.
    columns: Vec<Vec<f64>>,
    /// Of these rows, those at which a derivative is undefined.
    undefined: usize,
}

/// One column for each direction over the samples of all training recordings, and at how many of them
/// a derivative is undefined.
fn sensitivities(
    system: &Loaded,
    values: &Values,
    data: &Data<'_>,
) -> Option<(Vec<Vec<f64>>, usize)> {
    let parts = sensitivities_by_recording(system, values, data)?;
    let directions = system.signature().directions.len();
    let joined = |j: usize| parts.iter().flat_map(|part| part.columns[j].iter().copied()).collect();
    let undefined = parts.iter().map(|part| part.undefined).sum();
    Some(((0..directions).map(joined).collect(), undefined))
}

fn sensitivities_by_recording(
    system: &Loaded,
    values: &Values,
    data: &Data<'_>,
) -> Option<Vec<Part>> {
    let p = values.parameters(system);
    let directions = system.signature().directions.len();
    let recordings = data.train.iter().enumerate();
    recordings
        .map(|(r, recording)| {
            let start = values.starts(system, r);
            let observations = observe(system, recording, &p, &start, &data.options).ok()?;
            let mut columns = vec![Vec::new(); directions];
            let mut undefined = 0;
            for (output, noise) in data.noise.iter().enumerate() {
                let (Some(noise), Some(measured)) = (noise, &recording.measured[output]) else {
                    continue;
                };
                let is_measured = |k: usize| measured[k].is_finite();
                let whitener = Whitener::new(&recording.times, is_measured, noise);
                let is_undefined = |k: usize| {
                    let value = |j: usize| observations.dw(k)[j * observations.n_w + output];
                    is_measured(k) && !(0..directions).all(|j| value(j).is_finite())
                };
                undefined += (0..measured.len()).filter(|k| is_undefined(*k)).count();
                for (j, column) in columns.iter_mut().enumerate() {
                    // What is known of no sample behind a point at which it does not exist takes no part.
                    let derivative = |k: usize| {
                        let value = observations.dw(k)[j * observations.n_w + output];
                        if value.is_finite() { value } else { 0.0 }
                    };
                    let of_sample =
                        |k: usize| if is_measured(k) { derivative(k) } else { f64::NAN };
                    let whitened = whitener.apply((0..measured.len()).map(of_sample));
                    let measured = whitened.into_iter().enumerate();
                    column.extend(measured.filter(|(k, _)| is_measured(*k)).map(|(_, e)| e));
                }
            }
            Some(Part { rows: columns.first().map_or(0, Vec::len), columns, undefined })
        })
        .collect()
}

/// Residuals in units of the noise and without its correlation, in the order of the columns above.
pub(crate) fn weighted(data: &Data<'_>, residuals: &[Vec<Vec<f64>>]) -> Vec<f64> {
    let mut all = Vec::new();
    for (recording, outputs) in data.train.iter().zip(residuals) {
        for (values, noise) in outputs.iter().zip(&data.noise) {
            let Some(noise) = noise else { continue };
            all.extend(whitened(recording, values, noise).into_iter().filter(|e| e.is_finite()));
        }
    }
    all
}

/// Blocks are at least so many times as long as the noise's memory: what is left of its correlation, which
/// is never known exactly, stays within a block.
const MEMORIES: f64 = 5.0;

/// And so many there are at least.
const FEWEST_BLOCKS: f64 = 10.0;

/// How many blocks of all recordings have little to do with each other.
fn independent_blocks(data: &Data<'_>) -> usize {
    let colours = data.noise.iter().flatten().filter_map(|noise| noise.colour);
    let memory = colours.map(|colour| colour.memory).fold(0.0, f64::max);
    let length = |recording: &Recording| match recording.times.as_slice() {
        [first, .., last] => last - first,
        _ => 0.0,
    };
    let seconds: f64 = data.train.iter().map(length).sum();
    (seconds / (MEMORIES * memory)).clamp(FEWEST_BLOCKS, BLOCKS as f64) as usize
}

/// The block of each weighted residual, in their order, of so many.
pub(crate) fn blocks(data: &Data<'_>, residuals: &[Vec<Vec<f64>>], number: usize) -> Vec<usize> {
    let samples: usize = data.train.iter().map(|recording| recording.times.len()).sum();
    let (mut all, mut before) = (Vec::new(), 0);
    for (recording, outputs) in data.train.iter().zip(residuals) {
        for (values, noise) in outputs.iter().zip(&data.noise) {
            let measured =
                values.iter().enumerate().filter(|(_, e)| noise.is_some() && e.is_finite());
            all.extend(measured.map(|(k, _)| (before + k) * number / samples.max(1)));
        }
        before += recording.times.len();
    }
    all
}
