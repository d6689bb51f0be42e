//! The result of a regression, for programs and as text.

use std::fmt::Write as _;
use std::path::PathBuf;

use dgd_compiler::model::Variant;
use dgd_identify::regression::{
    ParameterPath, RegressionFit, RowOf, RowQuality, RowTrace, RowsLeftOut,
};
use dgd_identify::{BoundReached, ParameterEstimate};
use dgd_plot::{Figure, MathText, SeriesMeaning};
use dgd_runtime::Signature;

use crate::fit::report::few_samples::FewSamples;
use crate::fit::report::intervals::{IntervalEstimates, Intervals};
use crate::fit::report::left_out::IncompleteFit;
use crate::fit::report::outcome::{
    CORRELATED, ValidationResult, digits_of, entry, fixed_entries, push_combinations,
    push_correlated, rms_of, variant_entries,
};
use crate::output::figure::{PanelLine, PanelSubject, beside, differences as differences_panel};
use crate::output::provenance::Provenance;
use crate::output::quantity::short;
use crate::output::table::{push_table, significant};
use crate::request::Estimator;
use crate::result::fit::{
    EstimateEntry, FitDocument, OutputEntry, RecursiveResult, RegressionDetails,
    RegressionEstimate, RegressionRowEntry, SamplesLeftOut,
};
use crate::run::recording;

/// A regression and the model's quality with its estimates.
pub(crate) struct RegressionOutcome<'a> {
    pub estimator: Estimator,
    pub signature: &'a Signature,
    pub variants: &'a [Variant],
    pub fit: &'a RegressionFit,
    /// Estimates over time, of the recursive estimator.
    pub followed: Option<&'a ParameterPath>,
    /// The simulated recordings, or the reason why they cannot be simulated.
    pub train: Option<Result<ValidationResult, String>>,
    pub valid: Option<Result<ValidationResult, String>>,
    pub intervals: Intervals,
    /// The parts left out because of Ctrl-C.
    pub left_out: &'a IncompleteFit,
    /// Outputs whose noise could not be estimated.
    pub few: &'a FewSamples,
}

impl IntervalEstimates for RegressionOutcome<'_> {
    fn signature(&self) -> &Signature {
        self.signature
    }

    fn estimates(&self) -> &[ParameterEstimate] {
        &self.fit.estimates
    }

    fn name(&self, i: usize) -> String {
        self.fit.estimates[i].name.clone()
    }
}

impl RegressionOutcome<'_> {
    /// For programs.
    pub(crate) fn result(&self, provenance: Provenance) -> FitDocument {
        let Self { signature, fit, .. } = self;
        let parameter = |(j, estimate): (usize, &ParameterEstimate)| {
            let (name, entry) = entry(signature, estimate);
            let regression =
                Some(RegressionEstimate { linear: fit.linear[j], unbounded: self.unbounded(j) });
            (name, EstimateEntry { regression, ..entry })
        };
        let output = |(i, output): (usize, &dgd_runtime::Output)| {
            let entry = OutputEntry {
                unit: output.unit.symbol.to_string(),
                fitted: Some(fit.rows.iter().any(|row| row.of == RowOf::Output(i))),
                noise: None,
                over_declared_noise: None,
                light_samples: None,
                rms_train: self.rms(self.train.as_ref(), i),
                rms_valid: self.rms(self.valid.as_ref(), i),
                quality: None,
            };
            (output.name.to_string(), entry)
        };
        let factor = |j: usize| self.unit(j).factor;
        let covariance = |i, j| Some(fit.covariance(i, j)? / factor(i) / factor(j));
        let valid = self.valid.as_ref().and_then(|valid| valid.as_ref().ok());
        FitDocument {
            model: signature.name.to_string(),
            estimator: Some(self.estimator.name().to_owned()),
            variants: Some(variant_entries(self.variants)),
            parameters: fit.estimates.iter().enumerate().map(parameter).collect(),
            fixed: Some(fixed_entries(signature, &fit.p, &fit.estimates)),
            outputs: signature.outputs.iter().enumerate().map(output).collect(),
            starts: None,
            starts_valid: None,
            counts_from: valid.map(ValidationResult::counts_from),
            rows: Some(fit.rows.iter().map(|row| self.row_entry(row)).collect()),
            process_noise_in_a_minute: None,
            names: Some(fit.estimates.iter().map(|estimate| estimate.name.clone()).collect()),
            covariance: Some(self.matrix(covariance)),
            correlation: Some(self.matrix(|i, j| fit.correlation(i, j))),
            undetermined: self.undetermined(&fit.undetermined),
            regression: Some(self.details()),
            few_samples: self.few.entries(),
            reservations: None,
            samples: fit.samples,
            simulation: None,
            cost: Some(fit.cost),
            deviance: None,
            iterations: fit.iterations,
            evaluations: fit.evaluations,
            termination: None,
            converged: fit.is_converged,
            status: self.left_out.status(),
            left_out: self.left_out.all().to_vec(),
            profiles: self.intervals.profile_entries(self),
            bootstrap: self.intervals.bootstrap_entry(self),
            multi_start: None,
            linearised: None,
            information: None,
            operating_points: None,
            provenance,
        }
    }

    fn details(&self) -> RegressionDetails {
        let fit = self.fit;
        let factor = |j: usize| self.unit(j).factor;
        let RowsLeftOut { before_record, without_mode } = fit.left_out;
        RegressionDetails {
            rank: fit.rank,
            condition_number: Some(fit.condition_number).filter(|number| number.is_finite()),
            samples_left_out: SamplesLeftOut { before_record, without_mode },
            recursive: self.followed.map(|followed| RecursiveResult {
                samples: followed.times.len(),
                frozen_seconds: followed.frozen,
                p: self.matrix(|i, j| Some(followed.covariance[(i, j)] / factor(i) / factor(j))),
            }),
        }
    }

    /// The recursive estimates, sample by sample, with a column for the recording if there are several.
    pub(crate) fn estimates_csv(&self) -> Option<String> {
        let Self { signature, fit, followed, .. } = self;
        let followed = (*followed)?;
        let is_one = followed.times.iter().all(|(recording, _)| *recording == 0);
        let units = || {
            fit.estimates.iter().filter_map(|estimate| match estimate.of {
                dgd_runtime::Direction::Parameter(i) => Some(&signature.parameters[i]),
                dgd_runtime::Direction::Start(_) => None,
            })
        };
        let mut text = "time [s]".to_owned();
        for parameter in units() {
            let _ = write!(text, ",{} [{}]", parameter.name, parameter.unit.symbol);
        }
        text.push_str(if is_one { "\n" } else { ",recording [1]\n" });
        for ((recording, t), estimates) in followed.times.iter().zip(&followed.estimates) {
            let _ = write!(text, "{t}");
            for (value, parameter) in estimates.iter().zip(units()) {
                let _ = write!(text, ",{}", parameter.unit.from_si(*value));
            }
            let _ = if is_one { writeln!(text) } else { writeln!(text, ",{}", recording + 1) };
        }
        Some(text)
    }

    /// The unconstrained j-th estimate, in its unit.
    fn unbounded(&self, j: usize) -> Option<f64> {
        let dgd_runtime::Direction::Parameter(i) = self.fit.estimates[j].of else { return None };
        let value = self.fit.unbounded.as_ref()?[i];
        self.fit.linear[j].then(|| self.signature.parameters[i].unit.from_si(value))
    }

    /// Unit of a row's residuals, and its factor to SI.
    fn row_unit(&self, row: &RowQuality) -> (String, f64) {
        match row.of {
            RowOf::Output(i) => {
                let unit = &self.signature.outputs[i].unit;
                (unit.symbol.to_string(), unit.factor)
            }
            RowOf::Equation(i) if self.signature.unknowns.is_differential(i) => {
                let unit = self.signature.unknowns.unit(i);
                (format!("{}/s", unit.symbol), unit.factor)
            }
            RowOf::Equation(_) => ("SI".to_owned(), 1.0),
        }
    }

    fn row_entry(&self, row: &RowQuality) -> RegressionRowEntry {
        let (unit, factor) = self.row_unit(row);
        let of = match row.of {
            RowOf::Output(_) => "output",
            RowOf::Equation(_) => "equation",
        };
        RegressionRowEntry {
            name: row.name.clone(),
            of: of.to_owned(),
            unit,
            samples: row.samples,
            mse: Some(row.mean_squared_error / (factor * factor)),
            r_squared: row.r_squared,
            multiplied_by: row.multiplied_by.clone(),
        }
    }

    fn rms(&self, of: Option<&Result<ValidationResult, String>>, output: usize) -> Option<f64> {
        let Some(Ok(tested)) = of else { return None };
        rms_of(&tested.evaluation, output, &self.signature.outputs[output].unit)
    }

    /// Target and prediction of each equation and output, and their difference with the band of ± 2 standard
    /// deviations, over time or over rows.
    pub(crate) fn figure(&self, traces: &[RowTrace], paths: &[PathBuf], by_row: bool) -> Figure {
        let names = recording::names(paths);
        let (mut subjects, mut differences) = (Vec::new(), Vec::new());
        for trace in traces {
            let row = &self.fit.rows[trace.row];
            let (unit, factor) = self.row_unit(row);
            let offset = match row.of {
                RowOf::Output(i) => self.signature.outputs[i].unit.offset,
                RowOf::Equation(_) => 0.0,
            };
            let in_unit =
                |values: &[f64]| values.iter().map(|value| (value - offset) / factor).collect();
            let line = |name: &str, values: &[f64], meaning| PanelLine {
                name: MathText::plain(name),
                times: trace.times.clone(),
                values: in_unit(values),
                meaning,
            };
            let file = match names.as_slice() {
                [_] => String::new(),
                names => format!(", {}", names[trace.recording]),
            };
            let title = |what: &str| {
                MathText::plain(what).then(MathText::name(&row.name)).then(MathText::plain(&file))
            };
            let read = match row.of {
                RowOf::Output(_) => "measured",
                RowOf::Equation(_) => "from readings",
            };
            let both = trace.target.iter().zip(&trace.predicted);
            let difference = both.map(|(target, predicted)| (target - predicted) / factor);
            let std = vec![row.mean_squared_error.sqrt() / factor.abs(); trace.times.len()];
            differences.push(differences_panel(
                title("residual of "),
                &unit,
                &trace.times,
                difference.collect(),
                &std,
            ));
            subjects.push(PanelSubject {
                title: title(""),
                unit,
                lines: vec![
                    line("fitted", &trace.predicted, SeriesMeaning::Simulated),
                    line(read, &trace.target, SeriesMeaning::Measured),
                ],
            });
        }
        let x_label =
            if by_row { MathText::plain("Row") } else { MathText::plain("Time").with_unit("s") };
        beside(&subjects, differences, x_label)
    }

    /// A matrix over the estimates; `None` for undetermined entries.
    fn matrix(&self, entry: impl Fn(usize, usize) -> Option<f64>) -> Vec<Vec<Option<f64>>> {
        let n = self.fit.estimates.len();
        let row = |i: usize| (0..n).map(|j| entry(i, j)).collect();
        (0..n).map(row).collect()
    }

    /// Tables and remarks.
    pub(crate) fn to_text(&self) -> String {
        let Self { signature, fit, .. } = self;
        let mut text = String::new();
        let mut table = vec![["estimate", "value", "std", "unit", ""].map(str::to_owned)];
        for (j, estimate) in fit.estimates.iter().enumerate() {
            let dgd_runtime::Direction::Parameter(i) = estimate.of else { continue };
            let unit = &signature.parameters[i].unit;
            let std = estimate.std.map(|std| std / unit.factor);
            let unbounded = || match self.unbounded(j) {
                Some(value) => format!(", without bounds {}", short(value, 4)),
                None => String::new(),
            };
            let remark = match estimate.at_bound {
                Some(BoundReached::Lower) => format!("at its lower bound{}", unbounded()),
                Some(BoundReached::Upper) => format!("at its upper bound{}", unbounded()),
                None if std.is_some() || self.followed.is_some() || self.few.hide_stds() => {
                    String::new()
                }
                None => "not determined".to_owned(),
            };
            table.push([
                estimate.name.clone(),
                digits_of(unit.from_si(estimate.value), std),
                std.map_or_else(String::new, |std| significant(std, 2)),
                unit.symbol.to_string(),
                remark,
            ]);
        }
        push_table(&mut text, &table);
        self.left_out.push_text(&mut text);
        self.few.push_text(&mut text);

        text.push('\n');
        let mut table = vec![["row", "samples", "R²", "MSE", "unit"].map(str::to_owned)];
        for row in &fit.rows {
            let (unit, factor) = self.row_unit(row);
            table.push([
                row.name.clone(),
                row.samples.to_string(),
                row.r_squared.map_or_else(|| "-".to_owned(), |r| significant(r, 5)),
                significant(row.mean_squared_error / (factor * factor), 4),
                format!("({unit})²"),
            ]);
        }
        push_table(&mut text, &table);

        text.push('\n');
        let mut table = vec![["output", "rms train", "rms valid", "unit"].map(str::to_owned)];
        for (i, output) in signature.outputs.iter().enumerate() {
            let shown = |value: Option<f64>| {
                value.map_or_else(|| "-".to_owned(), |value| significant(value, 3))
            };
            table.push([
                output.name.to_string(),
                shown(self.rms(self.train.as_ref(), i)),
                shown(self.rms(self.valid.as_ref(), i)),
                output.unit.symbol.to_string(),
            ]);
        }
        push_table(&mut text, &table);
        text.push('\n');
        self.push_remarks(&mut text);
        self.intervals.push_text(&mut text, self);
        text
    }

    fn push_remarks(&self, text: &mut String) {
        let fit = self.fit;
        // Writing to a string cannot fail.
        for row in &fit.rows {
            if let Some(parameter) = &row.multiplied_by {
                let _ = writeln!(
                    text,
                    "equation `{}` was multiplied by `{parameter}`, which makes it linear",
                    row.name
                );
            }
        }
        let RowsLeftOut { before_record, without_mode } = fit.left_out;
        if before_record > 0 {
            let _ = writeln!(
                text,
                "{before_record} samples were left out: what they read late was before the record"
            );
        }
        if without_mode > 0 {
            let _ = writeln!(
                text,
                "{without_mode} samples were left out: the model cannot be simulated up to them, so \
                 that their modes are not known"
            );
        }
        for tested in [&self.train, &self.valid].into_iter().flatten() {
            if let Err(error) = tested {
                let _ = writeln!(text, "not simulated with these estimates: {error}");
            }
        }
        let outer: Vec<String> = fit
            .estimates
            .iter()
            .zip(&fit.linear)
            .filter(|(_, linear)| !**linear)
            .map(|(estimate, _)| format!("`{}`", estimate.name))
            .collect();
        if !outer.is_empty() {
            let _ = writeln!(text, "{}: not linear, found by search", outer.join(", "));
        }
        let n = fit.estimates.len();
        for (i, j) in (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j))) {
            if let Some(correlation) = fit.correlation(i, j)
                && correlation.abs() > CORRELATED
            {
                let [first, second] = [i, j].map(|i| &fit.estimates[i].name);
                push_correlated(text, first, second, correlation);
            }
        }
        push_combinations(text, &fit.undetermined, |i| fit.estimates[i].name.clone(), "row");
        if let Some(followed) = self.followed {
            let _ = writeln!(text, "{} samples were followed", followed.times.len());
            if followed.frozen > 0.0 {
                let _ = writeln!(text, "P was kept from growing for {} s", followed.frozen);
            }
        }
        let condition = if fit.condition_number.is_finite() {
            format!("condition number {}", short(fit.condition_number, 3))
        } else {
            "no finite condition number".to_owned()
        };
        let _ = writeln!(
            text,
            "{} rows, rank {} of {}, {condition}; {} evaluations",
            fit.samples,
            fit.rank,
            fit.estimates.len(),
            fit.evaluations
        );
    }
}
