//! The report on a comparison of sensitivities with differences.

use std::fmt::Write;

use dgd_runtime::signature::number::short;
use serde_json::{Value, json};

/// The comparison of a run's sensitivities.
#[derive(Debug, Clone)]
pub struct VerificationReport {
    pub(super) rows: Vec<VerificationRow>,
    /// Most units of deviation allowed.
    pub(super) allowed: f64,
}

/// One unknown or output, and one parameter.
#[derive(Debug, Clone)]
pub(super) struct VerificationRow {
    pub(super) of: String,
    pub(super) to: String,
    /// Its largest value over all times, or the range of `of` over the run per size of `to`, SI.
    pub(super) scale: f64,
    /// The largest deviation; `None` if nothing could be compared.
    pub(super) worst: Option<WorstDisagreement>,
    /// Largest error of the compared differences, SI.
    pub(super) uncertainty: f64,
    /// Compared samples.
    pub(super) compared: usize,
    /// Samples at which the sensitivity is undefined.
    pub(super) undefined: usize,
    /// Samples passed by an event or jump as the parameter changes.
    pub(super) passed: usize,
    /// Samples with a difference too uncertain to compare.
    pub(super) uncertain: usize,
    /// Samples at a kink, where the sensitivity is one-sided.
    pub(super) kinks: usize,
}

/// The largest disagreement.
#[derive(Debug, Clone)]
pub(super) struct WorstDisagreement {
    /// In units of the tolerance or the difference's error, whichever is larger.
    pub(super) ratio: f64,
    /// SI.
    pub(super) apart: f64,
    /// Its time, s.
    pub(super) at: f64,
}

impl VerificationRow {
    fn name(&self) -> String {
        format!("d({})/d({})", self.of, self.to)
    }

    fn ratio(&self) -> f64 {
        self.worst.as_ref().map_or(0.0, |worst| worst.ratio)
    }

    fn is_wrong(&self, allowed: f64) -> bool {
        // NaN counts as wrong.
        self.worst.as_ref().is_some_and(|worst| worst.ratio > allowed || worst.ratio.is_nan())
    }

    /// A number in SI as a fraction of the scale.
    fn fraction(&self, value: f64) -> f64 {
        if self.scale == 0.0 { 0.0 } else { value / self.scale }
    }

    /// The samples that were not compared.
    fn left_out(&self) -> String {
        let mut text = String::new();
        for (count, why) in [
            (self.undefined, "undefined"),
            (self.passed, "passed by an event or jump"),
            (self.uncertain, "too uncertain"),
            (self.kinks, "at a kink"),
        ] {
            if count > 0 {
                let _ = write!(text, ", {count} {why}");
            }
        }
        text
    }

    fn to_json(&self, allowed: f64) -> Value {
        let worst = self.worst.as_ref();
        json!({
            "of": self.of,
            "to": self.to,
            "difference": worst.map(|worst| self.fraction(worst.apart)),
            "ratio": worst.map(|worst| worst.ratio),
            "at": worst.map(|worst| worst.at),
            "uncertainty": self.fraction(self.uncertainty),
            "samples": {
                "compared": self.compared,
                "undefined": self.undefined,
                "passed_by_events": self.passed,
                "too_uncertain": self.uncertain,
                "at_kinks": self.kinks,
            },
            "agrees": worst.map(|_| !self.is_wrong(allowed)),
        })
    }
}

impl VerificationReport {
    /// For programs.
    pub fn to_json(&self) -> Value {
        let rows: Vec<Value> = self.rows.iter().map(|row| row.to_json(self.allowed)).collect();
        json!({ "allowed": self.allowed, "sensitivities": rows })
    }

    /// The comparison as text.
    pub fn to_text(&self) -> String {
        let mut text = format!(
            "sensitivities against differences, in units of the tolerance or of the difference's own \
             error, largest first; {} are allowed. The scale of each is its largest value, or what the \
             unknown or output does over the run for a parameter as large as it is:\n",
            self.allowed
        );
        for row in self.by_ratio() {
            let name = row.name();
            let left_out = row.left_out();
            let _ = match &row.worst {
                None => writeln!(text, "  {name:<24} not compared{left_out}"),
                Some(WorstDisagreement { ratio, apart, at }) => writeln!(
                    text,
                    "  {name:<24} {} units at {at} s ({} of its scale, differences \
                     good to {}), {} samples{left_out}{}",
                    short(*ratio, 2),
                    short(row.fraction(*apart), 2),
                    short(row.fraction(row.uncertainty), 2),
                    row.compared,
                    if row.is_wrong(self.allowed) { "  WRONG" } else { "" },
                ),
            };
        }
        text.trim_end().to_owned()
    }

    /// The sensitivity with the largest deviation beyond the allowed one, in words.
    pub fn wrong(&self) -> Option<String> {
        let row = self.by_ratio().into_iter().find(|row| row.is_wrong(self.allowed))?;
        let WorstDisagreement { ratio, apart, at } = row.worst.as_ref()?;
        Some(format!(
            "{} differs from its difference by {} of its scale at {at} s, {} \
             times the tolerance or what the difference is good to; {} times are allowed",
            row.name(),
            short(row.fraction(*apart), 2),
            short(*ratio, 2),
            self.allowed
        ))
    }

    /// Rows in order of decreasing deviation.
    fn by_ratio(&self) -> Vec<&VerificationRow> {
        let mut rows: Vec<&VerificationRow> = self.rows.iter().collect();
        rows.sort_by(|a, b| b.ratio().total_cmp(&a.ratio()));
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(ratio: f64) -> VerificationRow {
        let worst = Some(WorstDisagreement { ratio, apart: 2.0, at: 3.0 });
        let (of, to) = ("h".to_owned(), "k".to_owned());
        let uncertainty = 0.1;
        VerificationRow {
            of,
            to,
            scale: 4.0,
            worst,
            uncertainty,
            compared: 5,
            undefined: 6,
            passed: 7,
            uncertain: 0,
            kinks: 0,
        }
    }

    #[test]
    fn what_is_wrong_is_an_error_that_names_it() {
        let wrong = |ratio: f64| {
            VerificationReport { rows: vec![row(1.0), row(ratio)], allowed: 100.0 }.wrong()
        };
        assert_eq!(wrong(99.0), None);
        for ratio in [101.0, f64::INFINITY, f64::NAN] {
            let error = wrong(ratio).expect("it is wrong");
            assert!(error.contains("d(h)/d(k)") && error.contains("at 3 s"), "{error}");
        }
    }

    #[test]
    fn what_was_not_compared_is_counted() {
        assert_eq!(row(1.0).left_out(), ", 6 undefined, 7 passed by an event or jump");
        let none = VerificationRow { worst: None, ..row(1.0) }.to_json(100.0);
        assert!(none["agrees"].is_null() && none["samples"]["undefined"] == 6, "{none}");
        assert_eq!(row(200.0).to_json(100.0)["agrees"], false);
    }
}
