//! Reads the results of one occasion: estimates with confidence intervals, missing terms, failures.

use dgd_identify::percentiles;
use serde_json::Value;

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
        let mut documents: Vec<(&PieceKind, Value)> = Vec::new();
        for (kind, text) in results {
            let Some(text) = text else {
                findings.open += 1;
                continue;
            };
            let document: Value = serde_json::from_str(text).unwrap_or_default();
            if document["state"] == "done" {
                documents.push((kind, document));
            } else {
                let why = document["error"].as_str().unwrap_or("the result cannot be read");
                let first = why.lines().next().unwrap_or_default().to_owned();
                findings.failures.push((kind.to_string(), first));
            }
        }
        findings.read_fits(&documents);
        findings.read_bands(&documents);
        if let Some((_, document)) =
            documents.iter().find(|(kind, _)| **kind == PieceKind::Discover)
        {
            let result = &document["result"];
            findings.search = Some(SearchOutcome::read(result));
            if findings.estimates.is_empty() {
                findings.estimates = estimates(&result["base_parameters"]);
            }
        }
        findings
    }

    /// Takes the fit with the lowest deviance among those that converged, over all starting points.
    fn read_fits(&mut self, documents: &[(&PieceKind, Value)]) {
        let is_whole = |kind: &PieceKind| !matches!(kind, PieceKind::Discover);
        let fits: Vec<&(&PieceKind, Value)> =
            documents.iter().filter(|(kind, _)| is_whole(kind)).collect();
        let deviance =
            |document: &Value| document["result"]["deviance"].as_f64().unwrap_or(f64::INFINITY);
        let has_converged = |document: &Value| document["result"]["converged"] == true;
        let best = fits.iter().min_by(|(_, a), (_, b)| {
            has_converged(b).cmp(&has_converged(a)).then(deviance(a).total_cmp(&deviance(b)))
        });
        let Some((_, document)) = best else { return };
        let result = &document["result"];
        self.estimates = estimates(&result["parameters"]);
        self.reduced_chi_square = result["reduced_chi_square"].as_f64();
        self.degrees_of_freedom = result["degrees_of_freedom"].as_f64().filter(|n| *n > 0.0);
        let reason = document["stopped"].as_str().unwrap_or("it has not converged");
        self.fit = Some(if has_converged(document) { Ok(()) } else { Err(reason.to_owned()) });
        let least = deviance(document);
        let starts: Vec<&Value> = (fits.iter())
            .filter(|(kind, _)| matches!(kind, PieceKind::Start { .. }))
            .map(|(_, document)| document)
            .collect();
        let led = starts
            .iter()
            .filter(|one| has_converged(one) && deviance(one) - least <= SAME_DEVIANCE);
        self.starts = (!starts.is_empty()).then(|| (led.count(), starts.len()));
    }

    /// Replaces standard deviations by profiles or, failing that, by resampled data.
    fn read_bands(&mut self, documents: &[(&PieceKind, Value)]) {
        for (name, estimate) in &mut self.estimates {
            let values: Vec<f64> = documents
                .iter()
                .flat_map(|(_, document)| {
                    let entry = &document["result"]["bootstrap"]["estimates"][name.as_str()];
                    entry["values"].as_array().into_iter().flatten().filter_map(Value::as_f64)
                })
                .collect();
            let count = values.len();
            if let Some(band) = percentiles(values, BAND) {
                (estimate.band, estimate.by) = (Some(band), IntervalSource::Replicates(count));
            }
            let profile = documents.iter().find_map(|(_, document)| {
                let interval =
                    document["result"]["profiles"][name.as_str()]["interval"].as_array()?;
                Some((interval.first()?.as_f64()?, interval.get(1)?.as_f64()?))
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

fn estimates(parameters: &Value) -> Vec<(String, FleetEstimate)> {
    let entries = parameters.as_object().into_iter().flatten();
    let one = |(name, entry): (&String, &Value)| {
        let value = entry["value"].as_f64()?;
        let std = [&entry["std"], &entry["std_model"]].into_iter().filter_map(Value::as_f64);
        let std = std.filter(|std| std.is_finite() && *std > 0.0).reduce(f64::max);
        let band = std.map(|std| (value - HALF_BAND * std, value + HALF_BAND * std));
        let unit = entry["unit"].as_str().unwrap_or_default().to_owned();
        Some((name.clone(), FleetEstimate { value, std, band, by: IntervalSource::Std, unit }))
    };
    entries.filter_map(one).collect()
}

impl SearchOutcome {
    fn read(result: &Value) -> SearchOutcome {
        let list = |key: &str| result[key].as_array().into_iter().flatten();
        let effects = list("effects").filter_map(|effect| {
            let name = effect["name"].as_str()?.to_owned();
            Some((name, effect["onset"].as_f64()))
        });
        let terms = result["law"]["terms"].as_array().into_iter().flatten();
        let terms = terms.filter_map(|term| {
            let (formula, target) = (term["formula"].as_str()?, term["target"].as_str()?);
            Some((format!("`{formula}` in `{target}`"), None))
        });
        let causes = result["plain"]["causes"].as_array().into_iter().flatten().take(1);
        let causes = causes
            .filter_map(|cause| Some((format!("`{}` is off", cause["name"].as_str()?), None)));
        let left_over = list("unexplained").filter_map(|one| {
            Some((format!("something unknown at `{}`", one["target"].as_str()?), None))
        });
        let verdict = result["verdict"].as_str().unwrap_or_default().to_owned();
        SearchOutcome {
            verdict,
            missing: causes.chain(effects).chain(terms).chain(left_over).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn fit(value: f64, deviance: f64, converged: bool) -> String {
        let parameters =
            json!({ "c": { "value": value, "unit": "m", "std": 0.5, "std_model": null } });
        let result =
            json!({ "parameters": parameters, "deviance": deviance, "converged": converged });
        json!({ "state": "done", "stopped": (!converged).then_some("why"), "result": result })
            .to_string()
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
            let bootstrap = json!({ "estimates": { "c": { "values": values } } });
            let parameters = json!({ "c": { "value": 20.0, "unit": "m", "std": 1.0 } });
            let result =
                json!({ "parameters": parameters, "converged": true, "bootstrap": bootstrap });
            Some(json!({ "state": "done", "result": result }).to_string())
        };
        let replicates = |from| PieceKind::Replicates { from, count: 20 };
        let mut results = vec![(replicates(0), part(1)), (replicates(20), part(21))];
        let findings = PeriodResults::read("now", &results);
        assert_eq!(findings.estimates[0].1.by, IntervalSource::Replicates(40));
        // 1 … 40: the quantiles 1/40.98 and its mirror.
        let (low, high) = findings.estimates[0].1.band.expect("a band");
        assert!((low - 1.025).abs() < 1e-9 && (high - 39.975).abs() < 1e-9, "{low} {high}");
        let profiles = json!({ "c": { "interval": [18.5, 22.0] } });
        let parameters = json!({ "c": { "value": 20.0, "unit": "m", "std": 1.0 } });
        let result = json!({ "parameters": parameters, "converged": true, "profiles": profiles });
        let text = json!({ "state": "done", "result": result }).to_string();
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
            "effects": [{ "name": "leak", "onset": 12.0 }],
            "law": { "terms": [{ "target": "line", "formula": "-0.3 [1/s] * q" }] },
            "unexplained": [{ "target": "riser" }],
            "base_parameters": { "c": { "value": 1.0, "unit": "m", "std": null } },
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
