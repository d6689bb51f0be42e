//! Starting points of fits.
//!
//! They are a Latin hypercube: with n points, each parameter has one in each n-th of its range. Around the values,
//!
//! | parameter | range |
//! |---|---|
//! | with a prior | two standard deviations to both sides |
//! | with bounds on both sides of zero, or at zero | between its bounds, or within its size if it has none |
//! | any other | from a tenth of its value to ten times of it, evenly in the logarithm, within its bounds |
//!
//! and with bounds, the range between them, evenly in the logarithm if the model says `log`; a parameter that has a
//! prior, or not both bounds, has its range around its value. Each point is simulated once, without sensitivities; one
//! that cannot be simulated is drawn again in its strata, so that no fit is wasted on it.
//!
//! Source: McKay, Beckman, Conover, A comparison of three methods for selecting values of input variables,
//! Technometrics 21 (1979) 239.

use dgd_runtime::Direction;
use dgd_runtime::for_identify::parameter_size;
use dgd_runtime::signature::{PriorDensity, choices};

use crate::output_error::{OutputErrorProblem, Starts, evaluate};
use crate::random::Uniform;

/// Largest factor between a parameter and its value.
const FACTOR: f64 = 10.0;

/// Largest distance from the mean of its prior, in standard deviations.
const OF_PRIOR: f64 = 2.0;

/// Limit on the draws of a point that cannot be simulated.
const MOST_DRAWS: usize = 20;

choices! {
    /// The ranges that starting points are drawn from.
    pub enum DrawnFrom {
        /// Around the model's values: from a tenth to ten times each value, within its bounds; with a prior, two standard
        /// deviations around its mean.
        Values = "values",
        /// The whole range between the bounds; a parameter with a missing bound, or with a prior, as with `values`.
        Bounds = "bounds",
    }
}

/// Starting points of fits: the problem's own point, and others that are drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct StartingPoints {
    /// For each parameter that is drawn: its position, its range, and the stratum of each drawn point.
    ranges: Vec<(usize, StartRange, Vec<usize>)>,
    /// The seed of each drawn point.
    seeds: Vec<u64>,
}

impl StartingPoints {
    /// Number of points, the first being the problem's own.
    pub fn len(&self) -> usize {
        self.seeds.len() + 1
    }

    /// Always false: there is the problem's own.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// Values of parameters, by position, SI, for the first, second, … draw of a point. The problem's own has none.
    pub fn draw(&self, point: usize, draw: usize) -> Starts {
        let Some(k) = point.checked_sub(1) else { return Starts::new() };
        // Each draw has a stream of its own.
        let mut state = self.seeds[k].wrapping_add(mixed(draw as u64));
        let mut uniform = Uniform(move || {
            state = state.wrapping_add(INCREMENT);
            mixed(state)
        });
        let drawn = self.seeds.len() as f64;
        let of_range = |(i, range, strata): &(usize, StartRange, Vec<usize>)| {
            (*i, range.value((strata[k] as f64 + uniform.next()) / drawn))
        };
        self.ranges.iter().map(of_range).collect()
    }

    /// The first draw of a point that can be simulated, or the last if none of several can, and the number of failures.
    /// Sensitivities are not computed. `None` if cancelled.
    pub(super) fn simulated(
        &self,
        problem: &OutputErrorProblem<'_>,
        point: usize,
    ) -> Option<(Starts, usize)> {
        let mut drawn = self.draw(point, 0);
        // For its own point, the fit decides whether it can be simulated.
        if point == 0 {
            return Some((drawn, 0));
        }
        let starts: Vec<Starts> = problem.recordings.iter().map(|r| r.start.clone()).collect();
        for failed in 0..MOST_DRAWS {
            if problem.watch.is_stopped() {
                return None;
            }
            if failed > 0 {
                drawn = self.draw(point, failed);
            }
            let mut p = problem.p.to_vec();
            for &(i, value) in &drawn {
                p[i] = value;
            }
            if evaluate(problem, &p, &starts).is_ok() {
                return Some((drawn, failed));
            }
        }
        Some((drawn, MOST_DRAWS))
    }
}

/// The increment of [`mixed`]'s argument in a stream.
const INCREMENT: u64 = 0x9e37_79b9_7f4a_7c15;

/// Pseudo-random bits from a counter: SplitMix64 of Steele, Lea, Flood, Fast splittable pseudorandom number generators,
/// OOPSLA (2014).
fn mixed(counter: u64) -> u64 {
    let z = (counter ^ (counter >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// `count` starting points, that of the problem first.
///
/// `random` returns uniform 64-bit numbers.
pub fn starting_points(
    problem: &OutputErrorProblem<'_>,
    count: usize,
    from: DrawnFrom,
    mut random: impl FnMut() -> u64,
) -> StartingPoints {
    let drawn = count.saturating_sub(1);
    let mut ranges = Vec::new();
    let directions = problem.system.signature().directions.iter().zip(&problem.free);
    for (direction, is_free) in directions {
        let (&Direction::Parameter(i), true) = (direction, is_free) else { continue };
        let mut strata: Vec<usize> = (0..drawn).collect();
        let mut uniform = Uniform(&mut random);
        for k in (1..drawn).rev() {
            strata.swap(k, uniform.below(k + 1));
        }
        ranges.push((i, StartRange::from_problem(problem, i, from), strata));
    }
    StartingPoints { ranges, seeds: (0..drawn).map(|_| random()).collect() }
}

/// The starting range of a parameter, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
struct StartRange {
    from: f64,
    until: f64,
    /// Whether it is uniform in the logarithm.
    by_factors: bool,
}

impl StartRange {
    fn from_problem(problem: &OutputErrorProblem<'_>, i: usize, from: DrawnFrom) -> Self {
        let parameter = &problem.system.signature().parameters[i];
        let (lower, upper) = (parameter.lower, parameter.upper);
        let value = problem.p[i].clamp(lower, upper);
        let within = |from: f64, until: f64, by_factors| Self {
            from: from.clamp(lower, upper),
            until: until.clamp(lower, upper),
            by_factors,
        };
        if let Some(prior) = problem.priors.iter().find(|prior| prior.parameter() == Some(i)) {
            let (mean, half) = (prior.density.mean(), OF_PRIOR * prior.density.std());
            let of_logarithm = matches!(prior.density, PriorDensity::LogNormal { .. });
            if (parameter.log || of_logarithm) && mean > 0.0 {
                let factor = 1.0 + half / mean;
                return within(mean / factor, mean * factor, true);
            }
            return within(mean - half, mean + half, false);
        }
        if from == DrawnFrom::Bounds && (upper - lower).is_finite() {
            let by_factors = parameter.log && lower > 0.0;
            return Self { from: lower, until: upper, by_factors };
        }
        let has_both_signs = lower < 0.0 && upper > 0.0 && (upper - lower).is_finite();
        if has_both_signs || value == 0.0 {
            let size = parameter_size(&problem.system, i);
            let or_size = |bound: f64, size: f64| if bound.is_finite() { bound } else { size };
            return within(or_size(lower, -size), or_size(upper, size), false);
        }
        let range = within(value / FACTOR, value * FACTOR, true);
        // A bound at zero, or on the other side, has no logarithm.
        Self { by_factors: range.from * range.until > 0.0, ..range }
    }

    /// The value at a position between 0 and 1.
    fn value(&self, place: f64) -> f64 {
        let Self { from, until, by_factors } = *self;
        let value = if by_factors {
            from * (until / from).powf(place)
        } else {
            from + (until - from) * place
        };
        value.clamp(from.min(until), from.max(until))
    }
}
