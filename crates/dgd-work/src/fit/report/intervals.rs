//! Confidence intervals that assume neither a linear model nor white noise: by profile likelihood, and by a bootstrap
//! of the residuals.

use std::fmt::Write as _;

use dgd_compiler::argument::Argument;
use dgd_identify::{
    Bootstrap, CombinationTerm, EstimateError, Fit, OutputErrorProblem, ParameterEstimate, Profile,
    ProfileEnd, THRESHOLD, UndeterminedDirection, bootstrap, profiles,
};
use dgd_plot::{Figure, MathText, Panel, PlotSeries, SeriesStyle};
use dgd_runtime::{Direction, Signature, Unit};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;

use crate::error::{SIMULATING, UsageError, WorkError};
use crate::fit::report::left_out::IncompleteFit;
use crate::fit::report::outcome::{digits_of, unit_of};
use crate::output::quantity::short;
use crate::output::table::{push_table, significant};
use crate::request::{Estimator, IntervalRequest};
use crate::result::ByName;
use crate::result::fit::{
    BootstrapEntry, BootstrapResult, ProfileEndEntry, ProfileEndKind, ProfileEntry,
    UndeterminedTerm,
};

/// Probability of the intervals.
const PROBABILITY: f64 = 0.95;

/// A profile that falls below the fit by more than this has found a better fit.
const BETTER: f64 = 0.1;

/// Estimates for which intervals can be computed.
pub(crate) trait IntervalEstimates {
    /// Signature of the model.
    fn signature(&self) -> &Signature;

    /// All estimates.
    fn estimates(&self) -> &[ParameterEstimate];

    /// The name of an estimate.
    fn name(&self, i: usize) -> String;

    /// The unit of an estimate.
    fn unit(&self, i: usize) -> &Unit {
        unit_of(self.signature(), &self.estimates()[i])
    }

    /// Combinations of estimates that no output depends on.
    fn undetermined(&self, all: &[UndeterminedDirection]) -> Vec<Vec<UndeterminedTerm>> {
        let combination =
            |one: &UndeterminedDirection| one.terms.iter().map(|term| self.change(term)).collect();
        all.iter().map(combination).collect()
    }

    /// A term of a combination of estimates, with its name.
    fn change(&self, term: &CombinationTerm) -> UndeterminedTerm {
        let relative_change = Some(term.change);
        UndeterminedTerm::Change { name: self.name(term.estimate), relative_change }
    }
}

impl IntervalRequest {
    /// Checks, before anything is fitted, that the requested intervals are possible.
    pub(crate) fn verify(
        &self,
        estimator: Estimator,
        signature: &Signature,
    ) -> Result<(), WorkError> {
        if self.profile.is_empty() && self.bootstrap == 0 && !self.information {
            return Ok(());
        }
        if !estimator.simulates() && (self.bootstrap > 0 || self.information) {
            return Err(UsageError::NeedsEstimator {
                given: vec![Argument::Bootstrap.into(), Argument::Information.into()],
                estimators: SIMULATING,
            }
            .into());
        }
        if !self.profile.is_empty() && !estimator.has_profiles() {
            return Err(UsageError::NoProfiles(estimator).into());
        }
        let directions = signature.directions.iter().enumerate();
        let estimated = directions.filter(|(_, of)| {
            estimator.estimates_starts() || matches!(of, Direction::Parameter(_))
        });
        let names: Vec<String> =
            estimated.map(|(j, _)| signature.direction_name(j).into_owned()).collect();
        for name in self.profile.iter().map(|name| name.trim()) {
            if name != "all" && !names.iter().any(|known| known == name) {
                let name = name.to_owned();
                return Err(UsageError::NotEstimated { name, estimated: names }.into());
            }
        }
        Ok(())
    }

    /// Indices of the estimates to profile.
    pub(crate) fn profiled(&self, estimates: &[ParameterEstimate]) -> Vec<usize> {
        let wanted = |(_, estimate): &(usize, &ParameterEstimate)| {
            self.profile.iter().map(|name| name.trim()).any(|name| {
                name == estimate.name
                    || name == "all" && matches!(estimate.of, Direction::Parameter(_))
            })
        };
        estimates.iter().enumerate().filter(wanted).map(|(i, _)| i).collect()
    }
}

/// Computed intervals.
pub(crate) struct Intervals {
    profiles: Vec<Profile>,
    bootstrap: Option<Bootstrap>,
    /// The number of the first data set, if this is a share of a larger bootstrap.
    first: Option<usize>,
    /// Estimates whose profiles were requested.
    profiled: Vec<usize>,
}

impl Intervals {
    /// The intervals of a fit to this problem. A fit that has not converged has none; after a cancellation, those that
    /// are complete.
    pub(crate) fn find(
        args: &IntervalRequest,
        problem: &OutputErrorProblem<'_>,
        fit: &Fit,
        seed: u64,
    ) -> Result<Self, EstimateError> {
        let profiled = args.profiled(&fit.estimates);
        if !fit.termination.is_converged() || !cfg!(feature = "estimators") {
            return Ok(Self::of_profiles(Vec::new(), profiled));
        }
        let first = args.bootstrap_from.unwrap_or_default();
        let generator = |replicate: usize| {
            let mut random = Pcg64::new(u128::from(seed), (first + replicate) as u128);
            move || random.next_u64()
        };
        let resampled = (args.bootstrap > 0)
            .then(|| bootstrap(problem, fit, args.bootstrap, generator))
            .transpose()?;
        let profiles = profiles(problem, fit, &profiled)?;
        Ok(Self { profiles, bootstrap: resampled, first: args.bootstrap_from, profiled })
    }

    /// The complete profiles of another estimator.
    pub(crate) fn of_profiles(profiles: Vec<Profile>, profiled: Vec<usize>) -> Self {
        Self { profiles, bootstrap: None, first: None, profiled }
    }

    /// Adds requested intervals that are not complete.
    pub(crate) fn push_left_out(
        &self,
        left_out: &mut IncompleteFit,
        name: impl Fn(usize) -> String,
    ) {
        if let Some(Bootstrap { replicates, failures, left_out: missing @ 1.., .. }) =
            &self.bootstrap
        {
            let made = replicates.len() + failures;
            left_out.push(format!(
                "the bootstrap was stopped after {made} of {} data sets, and its intervals are those of \
                 {made}",
                made + missing
            ));
        }
        let is_missing = |i: &&usize| !self.profiles.iter().any(|profile| profile.estimate == **i);
        let missing = self.profiled.iter().filter(is_missing);
        let missing: Vec<String> = missing.map(|i| format!("`{}`", name(*i))).collect();
        if !missing.is_empty() {
            left_out.push(format!("there is no profile of {}", missing.join(", ")));
        }
    }

    /// The profiles in the result.
    pub(crate) fn profile_entries(&self, outcome: &dyn IntervalEstimates) -> ByName<ProfileEntry> {
        let profiles = self.profiles.iter();
        profiles
            .map(|profile| (outcome.name(profile.estimate), profile_entry(profile, outcome)))
            .collect()
    }

    /// The bootstrap in the result.
    pub(crate) fn bootstrap_entry(
        &self,
        outcome: &dyn IntervalEstimates,
    ) -> Option<BootstrapResult> {
        let resampled = self.bootstrap.as_ref()?;
        let entry = |i: usize| {
            let unit = outcome.unit(i);
            let interval = resampled.interval(i, PROBABILITY);
            let values = || resampled.replicates.iter().map(|all| Some(unit.from_si(all[i])));
            BootstrapEntry {
                unit: unit.symbol.to_string(),
                std: resampled.std(i).map(|std| std / unit.factor),
                interval: interval
                    .map(|(low, high)| [low, high].map(|end| Some(unit.from_si(end)))),
                // The report that merges shares needs all of them.
                values: self.first.map(|_| values().collect()),
            }
        };
        let estimates = 0..outcome.estimates().len();
        Some(BootstrapResult {
            first: self.first.unwrap_or_default(),
            replicates: resampled.replicates.len(),
            failures: resampled.failures,
            block_lengths: resampled.block_lengths.iter().copied().map(Some).collect(),
            estimates: estimates.map(|i| (outcome.name(i), entry(i))).collect(),
        })
    }

    /// A table of the intervals, and the reasons for open ends.
    pub(crate) fn push_text(&self, text: &mut String, outcome: &dyn IntervalEstimates) {
        let shown: Vec<usize> = match &self.bootstrap {
            Some(_) => (0..outcome.estimates().len()).collect(),
            None => self.profiles.iter().map(|profile| profile.estimate).collect(),
        };
        if shown.is_empty() {
            return;
        }
        let mut table = vec![
            ["95 % interval", "by std", "by profile", "by bootstrap", "its std", "unit"]
                .map(str::to_owned),
        ];
        for i in shown {
            let estimate = &outcome.estimates()[i];
            let unit = outcome.unit(i);
            let half = estimate.std.map(|std| THRESHOLD.sqrt() * std);
            let scale = self.scale_of(i, outcome.estimates());
            let number =
                |value: f64| digits_of(unit.from_si(value), scale.map(|s| s / unit.factor));
            let pair = |low: f64, high: f64| format!("{} .. {}", number(low), number(high));
            let by_std = half.map(|half| pair(estimate.value - half, estimate.value + half));
            let profile = self.profiles.iter().find(|profile| profile.estimate == i);
            let by_profile = profile.map(|profile| {
                let end = |end: Option<f64>| end.map_or_else(String::new, number);
                let (low, high) = profile.interval();
                format!("{} .. {}", end(low), end(high)).trim().to_owned()
            });
            let resampled = self.bootstrap.as_ref();
            let interval = resampled.and_then(|b| b.interval(i, PROBABILITY));
            let std = resampled.and_then(|b| b.std(i)).map(|std| significant(std / unit.factor, 2));
            let cell = |cell: Option<String>| cell.unwrap_or_else(|| "-".to_owned());
            table.push([
                outcome.name(i),
                cell(by_std),
                cell(by_profile),
                cell(interval.map(|(low, high)| pair(low, high))),
                cell(std),
                unit.symbol.to_string(),
            ]);
        }
        text.push('\n');
        push_table(text, &table);
        text.push('\n');
        self.push_remarks(text, outcome);
    }

    /// The scale for the digits of an interval, SI.
    fn scale_of(&self, i: usize, estimates: &[ParameterEstimate]) -> Option<f64> {
        let profile = self.profiles.iter().find(|profile| profile.estimate == i);
        let width = profile.and_then(|profile| match profile.interval() {
            (Some(low), Some(high)) => Some(0.25 * (high - low)),
            _ => None,
        });
        width.or(estimates[i].std).or_else(|| self.bootstrap.as_ref()?.std(i))
    }

    fn push_remarks(&self, text: &mut String, outcome: &dyn IntervalEstimates) {
        // Writing to a string cannot fail.
        for profile in &self.profiles {
            let sides = [
                ("below", profile.lower, &profile.with_lower),
                ("above", profile.upper, &profile.with_upper),
            ];
            for (side, end, others) in sides {
                let name = outcome.name(profile.estimate);
                let unit = outcome.unit(profile.estimate);
                let reached = short(unit.from_si(end.value()), 3);
                let _ = match end {
                    ProfileEnd::Interval(_) | ProfileEnd::Bound(_) => continue,
                    ProfileEnd::Open(_) => {
                        let others = with_others(others, outcome);
                        writeln!(
                            text,
                            "`{name}` is open {side}, as far as {reached} {}: {others}",
                            unit.symbol
                        )
                    }
                    ProfileEnd::Unsimulated(_) => writeln!(
                        text,
                        "`{name}` is open {side}: the model cannot be simulated beyond {reached} {}",
                        unit.symbol
                    ),
                };
            }
            let least = profile.deviance.iter().copied().fold(0.0, f64::min);
            if least < -BETTER {
                let _ = writeln!(
                    text,
                    "the profile of `{}` has found a better fit, by {} in Σ (e/σ)²: start from there",
                    outcome.name(profile.estimate),
                    short(-least, 2)
                );
            }
        }
        if let Some(resampled) = &self.bootstrap {
            let lengths = &resampled.block_lengths;
            let mean = lengths.iter().sum::<f64>() / lengths.len().max(1) as f64;
            let failed = match resampled.failures {
                0 => String::new(),
                n => format!("; {n} more reached no minimum"),
            };
            let _ = writeln!(
                text,
                "{} data sets of blocks of {} rows on the average{failed}",
                resampled.replicates.len(),
                short(mean, 2)
            );
        }
    }

    /// A figure for each profile, with the name of its estimate.
    pub(crate) fn figures(&self, outcome: &dyn IntervalEstimates) -> Vec<(String, Figure)> {
        let figure_of = |profile: &Profile| {
            let name = outcome.name(profile.estimate);
            let figure = figure(profile, &name, outcome);
            (name, figure)
        };
        self.profiles.iter().map(figure_of).collect()
    }
}

/// Estimates that change along with an open end.
fn with_others(terms: &[CombinationTerm], outcome: &dyn IntervalEstimates) -> String {
    if terms.is_empty() {
        return "no output is far enough off there".to_owned();
    }
    let names: Vec<String> =
        terms.iter().map(|term| format!("`{}`", outcome.name(term.estimate))).collect();
    let verb = if names.len() == 1 { "makes" } else { "make" };
    format!("{} {verb} up for it", names.join(" and "))
}

fn profile_entry(profile: &Profile, outcome: &dyn IntervalEstimates) -> ProfileEntry {
    let unit: &Unit = outcome.unit(profile.estimate);
    let in_unit = |value: f64| unit.from_si(value);
    let end = |end: ProfileEnd| ProfileEndEntry {
        value: Some(in_unit(end.value())),
        end: match end {
            ProfileEnd::Interval(_) => ProfileEndKind::Interval,
            ProfileEnd::Bound(_) => ProfileEndKind::Bound,
            ProfileEnd::Open(_) => ProfileEndKind::Open,
            ProfileEnd::Unsimulated(_) => ProfileEndKind::Unsimulated,
        },
    };
    let (low, high) = profile.interval();
    let followers =
        |terms: &[CombinationTerm]| terms.iter().map(|term| outcome.change(term)).collect();
    ProfileEntry {
        unit: unit.symbol.to_string(),
        interval: [low, high].map(|end| end.map(in_unit)),
        lower: end(profile.lower),
        upper: end(profile.upper),
        with_lower: followers(&profile.with_lower),
        with_upper: followers(&profile.with_upper),
        values: profile.values.iter().map(|value| Some(in_unit(*value))).collect(),
        deviance: profile.deviance.iter().copied().map(Some).collect(),
        threshold: THRESHOLD,
        evaluations: profile.evaluations,
    }
}

/// Deviance over the estimate, with the threshold.
fn figure(profile: &Profile, name: &str, outcome: &dyn IntervalEstimates) -> Figure {
    let unit = outcome.unit(profile.estimate);
    let x: Vec<f64> = profile.values.iter().map(|value| unit.from_si(*value)).collect();
    let ends = [x.first().copied().unwrap_or(0.0), x.last().copied().unwrap_or(0.0)];
    let line = |name: &str, style, x: &[f64], y: Vec<f64>| {
        PlotSeries::new(MathText::plain(name), style, x.to_vec(), y)
    };
    let panel = Panel {
        title: MathText::plain("Profile likelihood"),
        y_label: MathText::plain("Rise of the deviance"),
        series: vec![
            line("least", SeriesStyle::Line, &x, profile.deviance.clone()),
            line("95 %", SeriesStyle::ThinLine, &ends, vec![THRESHOLD; 2]),
        ],
        ..Panel::default()
    };
    Figure::new(MathText::name(name).with_unit(&unit.symbol), vec![panel])
}
