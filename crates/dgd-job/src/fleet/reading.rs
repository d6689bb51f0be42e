//! Reads the results of one occasion: estimates with confidence intervals, missing terms, failures.

use dgd_identify::percentiles;
use dgd_work::result::ByName;
use dgd_work::result::discover::DiscoverDocument;
use dgd_work::result::fit::FitDocument;

use crate::outcome::PieceDocument;
use crate::piece::PieceKind;

/// Half width of a 95 % confidence interval, in standard deviations.
const HALF_BAND: f64 = 1.959_963_984_540_054;

/// Confidence level.
const BAND: f64 = 0.95;

/// The results of recordings that were used together.
#[derive(Debug, Default)]
pub(super) struct PeriodResults {
    pub(super) when: String,
    /// Parameters by name, in the order of the model.
    pub(super) estimates: Vec<(String, FleetEstimate)>,
    /// Whether the fit converged, and why not; `None` without a fit.
    pub(super) fit: Option<Result<(), String>>,
    pub(super) reduced_chi_square: Option<f64>,
    /// Samples minus estimates.
    pub(super) degrees_of_freedom: Option<f64>,
    /// Number of starting points that reached the lowest deviance, and their total.
    pub(super) starts: Option<(usize, usize)>,
    /// The result of the search, if there was one.
    pub(super) search: Option<SearchOutcome>,
    /// Failed pieces, with the reasons.
    pub(super) failures: Vec<(String, String)>,
    /// Pieces without a result.
    pub(super) open: usize,
}

/// A parameter in its declared unit.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FleetEstimate {
    pub(super) value: f64,
    /// Standard deviation; that of the model error if larger.
    pub(super) std: Option<f64>,
    /// 95 % confidence interval.
    pub(super) band: Option<(f64, f64)>,
    pub(super) by: IntervalSource,
    pub(super) unit: String,
}

/// Source of a confidence interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum IntervalSource {
    /// The standard deviation.
    Std,
    /// The profile of the likelihood.
    Profile,
    /// Refits to this many resampled data sets.
    Replicates(usize),
}

impl IntervalSource {
    pub(super) fn name(self) -> &'static str {
        match self {
            IntervalSource::Std => "std",
            IntervalSource::Profile => "profile",
            IntervalSource::Replicates(_) => "replicates",
        }
    }
}

/// The result of a search.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SearchOutcome {
    pub(super) verdict: String,
    /// Missing terms by name, with their onset within the recordings, s.
    pub(super) missing: Vec<(String, Option<f64>)>,
}

/// Fits whose deviances differ by less than this ended in the same minimum.
const SAME_DEVIANCE: f64 = 0.1;

impl PeriodResults {
    /// From the results of its pieces, as far as there are any.
    pub(super) fn read(when: &str, results: &[(PieceKind, Option<String>)]) -> PeriodResults {
        let mut findings = PeriodResults { when: when.to_owned(), ..PeriodResults::default() };
        let mut fits: Vec<FittedPiece<'_>> = Vec::new();
        let mut search = None;
        for (kind, text) in results {
            let Some(text) = text else {
                findings.open += 1;
                continue;
            };
            let read = PieceDocument::read(text).and_then(|(stopped, result)| {
                let unreadable = |error| format!("its result cannot be read: {error}");
                if *kind == PieceKind::Discover {
                    search = Some(serde_json::from_value(result).map_err(unreadable)?);
                } else {
                    let result = serde_json::from_value(result).map_err(unreadable)?;
                    fits.push(FittedPiece { kind, stopped, result });
                }
                Ok(())
            });
            if let Err(why) = read {
                let first = why.lines().next().unwrap_or_default().to_owned();
                findings.failures.push((kind.to_string(), first));
            }
        }
        findings.read_fits(&fits);
        findings.read_bands(&fits);
        if let Some(result) = search {
            findings.search = Some(SearchOutcome::read(&result));
            if findings.estimates.is_empty() {
                findings.estimates = estimates(&result.base_parameters, |entry| {
                    FleetEstimate::new(entry.value, [entry.std, entry.std_model], &entry.unit)
                });
            }
        }
        findings
    }

    /// Takes the fit with the lowest deviance among those that converged, over all starting points.
    fn read_fits(&mut self, fits: &[FittedPiece<'_>]) {
        let deviance = |fit: &FittedPiece<'_>| fit.result.deviance.unwrap_or(f64::INFINITY);
        let best = fits.iter().min_by(|a, b| {
            let converged = b.result.converged.cmp(&a.result.converged);
            converged.then(deviance(a).total_cmp(&deviance(b)))
        });
        let Some(best) = best else { return };
        self.estimates = estimates(&best.result.parameters, |entry| {
            FleetEstimate::new(entry.value, [entry.std, entry.std_model], &entry.unit)
        });
        let details = best.result.simulation.as_ref();
        self.reduced_chi_square = details.and_then(|details| details.reduced_chi_square);
        let freedom = details.map(|details| details.degrees_of_freedom as f64);
        self.degrees_of_freedom = freedom.filter(|n| *n > 0.0);
        let reason = || best.stopped.clone().unwrap_or_else(|| "it has not converged".to_owned());
        self.fit = Some(if best.result.converged { Ok(()) } else { Err(reason()) });
        let least = deviance(best);
        let starts: Vec<&FittedPiece<'_>> =
            fits.iter().filter(|fit| matches!(fit.kind, PieceKind::Start { .. })).collect();
        let led = starts
            .iter()
            .filter(|fit| fit.result.converged && deviance(fit) - least <= SAME_DEVIANCE);
        self.starts = (!starts.is_empty()).then(|| (led.count(), starts.len()));
    }

    /// Replaces standard deviations by profiles or, failing that, by resampled data.
    fn read_bands(&mut self, fits: &[FittedPiece<'_>]) {
        for (name, estimate) in &mut self.estimates {
            let resampled = fits.iter().filter_map(|fit| fit.result.bootstrap.as_ref());
            let values = resampled.filter_map(|all| all.estimates.get(name)?.values.as_ref());
            let values: Vec<f64> = values.flatten().copied().flatten().collect();
            let count = values.len();
            if let Some(band) = percentiles(values, BAND) {
                (estimate.band, estimate.by) = (Some(band), IntervalSource::Replicates(count));
            }
            let mut profiles = fits.iter().filter_map(|fit| fit.result.profiles.get(name));
            let profile = profiles.find_map(|profile| {
                let [low, high] = profile.interval;
                low.zip(high)
            });
            if profile.is_some() {
                (estimate.band, estimate.by) = (profile, IntervalSource::Profile);
            }
        }
    }

    /// A parameter by name.
    pub(super) fn estimate(&self, name: &str) -> Option<&FleetEstimate> {
        self.estimates.iter().find(|(known, _)| known == name).map(|(_, estimate)| estimate)
    }
}

fn estimates<T>(
    entries: &ByName<T>,
    estimate: impl Fn(&T) -> Option<FleetEstimate>,
) -> Vec<(String, FleetEstimate)> {
    entries.iter().filter_map(|(name, entry)| Some((name.clone(), estimate(entry)?))).collect()
}

impl FleetEstimate {
    /// `None` without a finite value.
    fn new(value: Option<f64>, stds: [Option<f64>; 2], unit: &str) -> Option<Self> {
        let value = value?;
        let stds = stds.into_iter().flatten().filter(|std| std.is_finite() && *std > 0.0);
        let std = stds.reduce(f64::max);
        let band = std.map(|std| (value - HALF_BAND * std, value + HALF_BAND * std));
        Some(FleetEstimate { value, std, band, by: IntervalSource::Std, unit: unit.to_owned() })
    }
}

/// A piece with a fit.
struct FittedPiece<'a> {
    kind: &'a PieceKind,
    /// Why the fit is incomplete.
    stopped: Option<String>,
    result: FitDocument,
}

impl SearchOutcome {
    fn read(result: &DiscoverDocument) -> SearchOutcome {
        let causes = result.plain.iter().filter_map(|plain| plain.causes.first());
        let causes = causes.map(|cause| (format!("`{}` is off", cause.name), None));
        let effects = result.effects.iter().map(|effect| (effect.name.clone(), effect.onset));
        let terms = result.law.iter().flat_map(|law| &law.terms);
        let terms = terms.map(|term| (format!("`{}` in `{}`", term.formula, term.target), None));
        let left_over = result.unexplained.iter();
        let left_over =
            left_over.map(|place| (format!("something unknown at `{}`", place.target), None));
        let missing = causes.chain(effects).chain(terms).chain(left_over).collect();
        SearchOutcome { verdict: result.verdict.clone(), missing }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;

    /// A document with these keys in the result of a fit.
    fn document(keys: &Value) -> String {
        let mut result = json!({
            "model": "m", "parameters": {}, "outputs": {}, "counts_from": null, "undetermined": [], "few_samples": {},
            "samples": 9, "iterations": 3, "evaluations": 4, "converged": true, "status": "done", "left_out": [],
            "profiles": {},
            "provenance": { "schema": 0, "version": "", "seed": 0, "model": null, "data": [] },
        });
        for (key, value) in keys.as_object().into_iter().flatten() {
            result[key] = value.clone();
        }
        let stopped = (result["converged"] == false).then_some("why");
        json!({ "state": "done", "stopped": stopped, "result": result }).to_string()
    }

    fn fit(value: f64, deviance: f64, converged: bool) -> String {
        let parameters =
            json!({ "c": { "value": value, "unit": "m", "std": 0.5, "std_model": null } });
        document(&json!({ "parameters": parameters, "deviance": deviance, "converged": converged }))
    }

    #[test]
    fn of_several_starts_the_least_deviance_that_converged_counts() {
        let start = |number| PieceKind::Start { number, of: 4 };
        let results = [
            (start(0), Some(fit(1.0, 10.0, true))),
            (start(1), Some(fit(2.0, 3.0, true))),
            (start(2), Some(fit(3.0, 1.0, false))),
            (start(3), Some(fit(2.1, 3.05, true))),
            (PieceKind::Discover, None),
        ];
        let findings = PeriodResults::read("now", &results);
        let (name, estimate) = &findings.estimates[0];
        assert_eq!((name.as_str(), estimate.value, estimate.std), ("c", 2.0, Some(0.5)));
        assert_eq!((findings.starts, findings.fit, findings.open), (Some((2, 4)), Some(Ok(())), 1));
        let (low, high) = estimate.band.expect("a band");
        assert!((low - 1.02).abs() < 1e-3 && (high - 2.98).abs() < 1e-3);
    }

    #[test]
    fn bands_are_profiles_or_replicates_of_all_pieces_where_there_are_some() {
        let part = |from: u32| {
            let values: Vec<f64> = (from..from + 20).map(f64::from).collect();
            let entry = json!({ "unit": "m", "std": 1.0, "interval": null, "values": values });
            let bootstrap = json!({
                "first": from, "replicates": 20, "failures": 0, "block_lengths": [], "estimates": { "c": entry },
            });
            let parameters = json!({ "c": { "value": 20.0, "unit": "m", "std": 1.0 } });
            Some(document(&json!({ "parameters": parameters, "bootstrap": bootstrap })))
        };
        let replicates = |from| PieceKind::Replicates { from, count: 20 };
        let mut results = vec![(replicates(0), part(1)), (replicates(20), part(21))];
        let findings = PeriodResults::read("now", &results);
        assert_eq!(findings.estimates[0].1.by, IntervalSource::Replicates(40));
        // 1 … 40: the quantiles 1/40.98 and its mirror.
        let (low, high) = findings.estimates[0].1.band.expect("a band");
        assert!((low - 1.025).abs() < 1e-9 && (high - 39.975).abs() < 1e-9, "{low} {high}");
        let end = json!({ "value": 18.5, "end": "interval" });
        let profiles = json!({ "c": {
            "unit": "m", "interval": [18.5, 22.0], "lower": end, "upper": end, "with_lower": [], "with_upper": [],
            "values": [], "deviance": [], "threshold": 3.84, "evaluations": 9,
        } });
        let parameters = json!({ "c": { "value": 20.0, "unit": "m", "std": 1.0 } });
        let text = document(&json!({ "parameters": parameters, "profiles": profiles }));
        results.push((PieceKind::Profile { of: "c".into() }, Some(text)));
        let findings = PeriodResults::read("now", &results);
        assert_eq!(
            (findings.estimates[0].1.by, findings.estimates[0].1.band),
            (IntervalSource::Profile, Some((18.5, 22.0)))
        );
    }

    #[test]
    fn what_failed_is_told_with_its_reason_and_what_is_missing_by_name() {
        let failed = json!({ "state": "failed", "error": "no such file\n  --> there" }).to_string();
        let result = json!({
            "verdict": "effects",
            "reason": "", "p_value": null, "reservations": [], "model": "m", "model_file": "m.dgd",
            "effects": [{
                "name": "leak", "kind": "plant", "form": null, "target": "line", "alternatives": [], "other_forms": [],
                "told_apart_by": null, "onset": 12.0, "windows": [], "condition": null, "parameters": {},
                "evidence": { "p_value": 0.0, "resamples": 9, "bic_gain": 9.0, "inclusion": 1.0 },
            }],
            "law": {
                "terms": [{ "target": "line", "formula": "-0.3 [1/s] * q", "coefficients": [] }],
                "range": {}, "near": [],
            },
            "regime": null, "rivals": [], "plain": null, "described": [],
            "unexplained": [{
                "target": "riser", "kind": "equation", "tied": false, "joint": false, "left": null, "objection": null,
                "told_apart_by": null, "gain": 0.5, "windows": [], "condition": null, "together": [], "trace": "",
                "description": "", "guess": null, "law": null,
            }],
            "places_not_tried": [], "power": [], "gap": {}, "parameters": {},
            "base_parameters": { "c": { "value": 1.0, "unit": "m", "std": null, "std_model": null } },
            "recordings": [], "counts_from": [], "ranking": [], "screened": [], "not_tried": [],
        });
        let search = json!({ "state": "done", "result": result }).to_string();
        let findings = PeriodResults::read(
            "now",
            &[
                (PieceKind::Fit, Some(failed)),
                (PieceKind::Discover, Some(search)),
                (PieceKind::Fit, Some("torn".into())),
            ],
        );
        assert_eq!(findings.failures[0], ("fit".to_owned(), "no such file".to_owned()));
        assert_eq!(findings.failures.len(), 2);
        let search = findings.search.expect("a search");
        let expected = [
            ("leak".to_owned(), Some(12.0)),
            ("`-0.3 [1/s] * q` in `line`".to_owned(), None),
            ("something unknown at `riser`".to_owned(), None),
        ];
        assert_eq!(
            (search.verdict.as_str(), search.missing.as_slice()),
            ("effects", &expected[..])
        );
        assert_eq!((findings.estimates[0].1.value, findings.estimates[0].1.band), (1.0, None));
        assert_eq!(findings.fit, None);
    }
}
