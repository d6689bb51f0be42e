//! The result of an output-error fit, for programs and as text.

use std::fmt::Write as _;
use std::path::PathBuf;

use dgd_compiler::argument::Spelling;
use dgd_compiler::model::Variant;
use dgd_identify::{
    CombinationTerm, Fit, FitStepping, OutputErrorEvaluation, OutputMisfit, ParameterEstimate,
    Recording, Starts, Termination, UndeterminedDirection,
};
use dgd_runtime::{Direction, Output, PerSampleChoice, Signature, Unit};

use crate::fit::multi_start::Minima;
use crate::fit::report::excess::ResidualExcess;
use crate::fit::report::few_samples::FewSamples;
use crate::fit::report::information::InformationSources;
use crate::fit::report::intervals::{IntervalEstimates, Intervals};
use crate::fit::report::left_out::IncompleteFit;
use crate::fit::report::left_over::ModelErrorSpread;
use crate::fit::report::linearised::LinearisedReport;
use crate::fit::report::quality::FitQuality;
use crate::fit::report::runaway;
use crate::output::provenance::Provenance;
use crate::output::quantity::short;
use crate::output::table::{push_table, significant};
use crate::result::ByName;
use crate::result::fit::{
    BoundEntry, EstimateEntry, FitDocument, NoiseEntry, OutputEntry, QualityPair, RecordingValues,
    SimulationDetails, SteppingEntry, ValueEntry,
};

/// Stronger correlations are pointed out.
pub(crate) const CORRELATED: f64 = 0.95;

/// A fit and its quality.
pub(crate) struct OutputErrorReport<'a> {
    pub signature: &'a Signature,
    pub variants: &'a [Variant],
    pub fit: &'a Fit,
    pub data: &'a [PathBuf],
    /// Names of the recordings.
    pub recording_names: Vec<String>,
    pub train: OutputErrorEvaluation,
    pub valid: Option<ValidationResult>,
    /// The training recordings.
    pub recordings: &'a [Recording],
    pub information: Option<InformationSources>,
    pub intervals: Intervals,
    /// Reasons to doubt that the recordings can answer.
    pub reservations: Vec<String>,
    /// The outcomes of several starting points.
    pub minima: Option<Minima>,
    /// The parts left out because of Ctrl-C.
    pub left_out: &'a IncompleteFit,
    /// Outputs whose noise could not be estimated.
    pub few: &'a FewSamples,
    /// Model error in the residuals of the training recordings, and the bias it may have caused.
    pub left_over: ModelErrorSpread,
    pub quality: FitQuality,
    /// Size of residuals relative to the declared noise, by output.
    pub excess: Vec<Option<ResidualExcess>>,
    /// On validation recordings.
    pub quality_valid: Option<FitQuality>,
    /// The operating points of the linear models, if those were fitted.
    pub linearised: Option<LinearisedReport>,
    /// How readers give arguments.
    pub spelling: Spelling,
}

/// Validation recordings.
pub(crate) struct ValidationResult {
    pub paths: Vec<PathBuf>,
    /// Recordings, with the time from which their samples count.
    pub recordings: Vec<Recording>,
    pub starts: Vec<Starts>,
    pub evaluation: OutputErrorEvaluation,
}

impl ValidationResult {
    /// The time from which readings of each recording count, s; null if all count.
    pub(crate) fn counts_from(&self) -> Vec<Option<f64>> {
        let from = self.recordings.iter().map(|recording| recording.counts_from);
        from.map(|from| from.is_finite().then_some(from)).collect()
    }
}

/// Residuals of one output in its declared unit.
struct OutputErrors {
    train: Option<f64>,
    valid: Option<f64>,
    noise: Option<f64>,
}

/// The outcome of a search.
pub(crate) fn ended(termination: Termination) -> &'static str {
    match termination {
        Termination::Gradient => "converged (the gradient is zero)",
        Termination::Reduction => "converged (no further reduction)",
        Termination::Step => "converged (steps became negligible)",
        Termination::Stalled => "not converged (stalled)",
        Termination::Blocked => "not converged (simulations fail nearby)",
        Termination::Flat => "not converged (the outputs do not respond)",
        Termination::EvaluationLimit => "not converged (evaluation limit)",
        Termination::Stopped => "stopped",
    }
}

impl OutputErrorReport<'_> {
    /// For programs.
    pub(crate) fn result(&self, provenance: Provenance) -> FitDocument {
        let fit = self.fit;
        let parameters = || self.parameters();
        let names = parameters().map(|i| fit.estimates[i].name.clone());
        let starts = self.data.iter().enumerate().map(|(r, path)| {
            let starts = fit.estimates.iter().enumerate();
            let starts = starts.filter(|(_, estimate)| estimate.recording == Some(r));
            let values = self.entries(starts.map(|(i, _)| i));
            RecordingValues { data: path.display().to_string(), values }
        });
        let information = self.information.as_ref();
        FitDocument {
            model: self.signature.name.to_string(),
            estimator: self.linearised.as_ref().map(|_| "linearised".to_owned()),
            variants: Some(variant_entries(self.variants)),
            parameters: self.entries(parameters()),
            fixed: Some(fixed_entries(self.signature, &fit.p, &fit.estimates)),
            outputs: self.outputs().map(|(i, output)| self.output_entry(i, output)).collect(),
            starts: Some(starts.collect()),
            starts_valid: Some(self.starts_valid()),
            counts_from: self.valid.as_ref().map(ValidationResult::counts_from),
            rows: None,
            process_noise_in_a_minute: None,
            names: Some(names.collect()),
            covariance: Some(self.matrix(|i, j| {
                let factor = |i: usize| self.unit(i).factor;
                Some(fit.covariance(i, j)? / factor(i) / factor(j))
            })),
            correlation: Some(self.matrix(|i, j| fit.correlation(i, j))),
            undetermined: self.undetermined(&fit.undetermined),
            regression: None,
            few_samples: self.few.entries(),
            reservations: Some(self.reservations.clone()),
            samples: fit.samples,
            simulation: Some(self.details()),
            cost: Some(fit.cost),
            deviance: Some(fit.deviance - self.logarithms_of_units()),
            iterations: fit.iterations,
            evaluations: fit.evaluations,
            termination: Some(fit.termination.name().to_owned()),
            converged: fit.termination.is_converged(),
            status: self.left_out.status(),
            left_out: self.left_out.all().to_vec(),
            profiles: self.intervals.profile_entries(self),
            bootstrap: self.intervals.bootstrap_entry(self),
            multi_start: self.minima.as_ref().map(|minima| minima.entry(self)),
            linearised: self.linearised.as_ref().map(|linearised| linearised.entry(self)),
            information: information.map(|information| information.entries(self)),
            operating_points: information
                .map(|information| information.point_entries(self.signature)),
            provenance,
        }
    }

    fn details(&self) -> SimulationDetails {
        let fit = self.fit;
        let criterion = |value: f64| value - self.logarithms_of_units();
        SimulationDetails {
            left_over: self.left_over.entry(self.data, |i| self.name(i)),
            samples_without_sensitivity: fit.samples_without_sensitivity,
            degrees_of_freedom: fit.degrees_of_freedom,
            loss: fit.loss.name().to_owned(),
            reduced_chi_square: fit.reduced_chi_square(),
            aic: fit.criteria.map(|criteria| criterion(criteria.aic)),
            aicc: fit.criteria.and_then(|criteria| criteria.aicc).map(criterion),
            bic: fit.criteria.map(|criteria| criterion(criteria.bic)),
            failures: fit.failures,
            rtol: fit.options.rtol,
            steps: match fit.stepping {
                FitStepping::Adaptive => SteppingEntry::Name("adaptive".to_owned()),
                FitStepping::Exact => SteppingEntry::Name("exact".to_owned()),
                FitStepping::PerSample(PerSampleChoice { method, steps }) => {
                    let method = method.name.to_string();
                    SteppingEntry::PerSample { per_sample: steps.get() as usize, method }
                }
            },
        }
    }

    fn output_entry(&self, i: usize, output: &Output) -> (String, OutputEntry) {
        let errors = self.errors(i);
        let valid = self.quality_valid.as_ref();
        let entry = OutputEntry {
            unit: output.unit.symbol.to_string(),
            fitted: Some(self.fit.noise[i].is_some()),
            noise: errors.noise.map(NoiseEntry::Std),
            over_declared_noise: self.excess[i].map(ResidualExcess::entry),
            light_samples: Some(self.fit.light_samples[i]),
            rms_train: errors.train,
            rms_valid: errors.valid,
            quality: Some(QualityPair {
                train: self.quality.entry(i, self.signature),
                valid: valid.and_then(|quality| quality.entry(i, self.signature)),
            }),
        };
        (output.name.to_string(), entry)
    }

    /// The change of −2 ln L when densities are in SI instead of the units of the outputs.
    fn logarithms_of_units(&self) -> f64 {
        let outputs = self.signature.outputs.iter().enumerate();
        let fitted = outputs.filter(|(i, _)| self.fit.noise[*i].is_some());
        let logarithm = |(i, output): (usize, &Output)| {
            let samples: usize = self.fit.misfits.iter().map(|misfits| misfits[i].samples).sum();
            2.0 * samples as f64 * output.unit.factor.abs().ln()
        };
        fitted.map(logarithm).sum()
    }

    /// Indices of the estimated parameters.
    fn parameters(&self) -> impl Iterator<Item = usize> + '_ {
        let estimates = self.fit.estimates.iter().enumerate();
        estimates.filter(|(_, estimate)| estimate.recording.is_none()).map(|(i, _)| i)
    }

    /// Entries of estimates by their indices.
    fn entries(&self, estimates: impl Iterator<Item = usize>) -> ByName<EstimateEntry> {
        let entry_of = |i: usize| {
            let (name, entry) = entry(self.signature, &self.fit.estimates[i]);
            let std_model = self.left_over.std_in(i, self.unit(i));
            (name, EstimateEntry { std_model, ..entry })
        };
        estimates.map(entry_of).collect()
    }

    fn starts_valid(&self) -> Vec<RecordingValues<ValueEntry>> {
        let Some(tested) = &self.valid else { return Vec::new() };
        let starts_of = |(path, starts): (&PathBuf, &Starts)| {
            let entry = |(i, value): &(usize, f64)| {
                let unknown = self.signature.unknowns.get(*i);
                (unknown.name.to_string(), ValueEntry::new(*value, &unknown.unit))
            };
            let values = starts.iter().map(entry).collect();
            RecordingValues { data: path.display().to_string(), values }
        };
        tested.paths.iter().zip(&tested.starts).map(starts_of).collect()
    }

    /// A matrix over the estimated parameters; `None` for undetermined entries.
    fn matrix(&self, entry: impl Fn(usize, usize) -> Option<f64>) -> Vec<Vec<Option<f64>>> {
        let row = |i: usize| self.parameters().map(|j| entry(i, j)).collect();
        self.parameters().map(row).collect()
    }

    /// Outputs that can be measured, with their indices.
    fn outputs(&self) -> impl Iterator<Item = (usize, &Output)> {
        let outputs = self.signature.outputs.iter().enumerate();
        outputs.filter(|(i, _)| !self.signature.is_deviation(*i))
    }

    fn errors(&self, output: usize) -> OutputErrors {
        let unit = &self.signature.outputs[output].unit;
        let rms = |evaluation: &OutputErrorEvaluation| rms_of(evaluation, output, unit);
        OutputErrors {
            train: rms(&self.train),
            valid: self.valid.as_ref().and_then(|tested| rms(&tested.evaluation)),
            noise: self.fit.noise[output]
                .filter(|_| !self.few.hide_noise(&self.signature.outputs[output].name))
                .map(|sigma| sigma / unit.factor),
        }
    }

    /// Tables and remarks.
    pub(crate) fn to_text(&self) -> String {
        let fit = self.fit;
        let mut text = String::new();
        let mut table =
            vec![["estimate", "value", "std", "std model", "unit", ""].map(str::to_owned)];
        for (i, estimate) in fit.estimates.iter().enumerate() {
            let unit = self.unit(i);
            let value = unit.from_si(estimate.value);
            let std = estimate.std.map(|std| std / unit.factor);
            let remark = match estimate.at_bound {
                Some(bound) => format!("at its {} bound", BoundEntry::from(bound).name()),
                None if self.runaway(i).is_some() => "ran away".to_owned(),
                None if std.is_none() && !self.few.hide_stds() => "not determined".to_owned(),
                None => String::new(),
            };
            table.push([
                self.name(i),
                digits_of(value, std),
                std.map_or_else(String::new, |std| significant(std, 2)),
                self.left_over
                    .std(i)
                    .map_or_else(String::new, |std| significant(std / unit.factor.abs(), 2)),
                unit.symbol.to_string(),
                remark,
            ]);
        }
        if self.left_over.is_shown() {
            push_table(&mut text, &table);
        } else {
            let without = |[estimate, value, std, _, unit, remark]: [String; 6]| {
                [estimate, value, std, unit, remark]
            };
            push_table(&mut text, &table.into_iter().map(without).collect::<Vec<_>>());
        }

        text.push('\n');
        let mut table = vec![
            ["output", "rms train", "rms valid", "noise", "unit", "fit train %", "fit valid %"]
                .map(str::to_owned),
        ];
        for (i, output) in self.outputs() {
            let errors = self.errors(i);
            let shown = |value: Option<f64>| {
                value.map_or_else(|| "-".to_owned(), |value| significant(value, 3))
            };
            table.push([
                output.name.to_string(),
                shown(errors.train),
                shown(errors.valid),
                shown(errors.noise),
                output.unit.symbol.to_string(),
                shown(self.quality.fit_percent(i)),
                shown(self.quality_valid.as_ref().and_then(|quality| quality.fit_percent(i))),
            ]);
        }
        push_table(&mut text, &table);
        text.push('\n');
        self.left_out.push_text(&mut text);
        self.few.push_text(&mut text);
        if let Some(linearised) = &self.linearised {
            linearised.push_text(&mut text, self);
        }
        self.push_remarks(&mut text);
        self.intervals.push_text(&mut text, self);
        if let Some(information) = &self.information {
            information.push_text(&mut text, self);
        }
        text
    }

    /// Advice on an estimate that ran away.
    fn runaway(&self, i: usize) -> Option<String> {
        let estimate = &self.fit.estimates[i];
        let Direction::Parameter(at) = estimate.of else { return None };
        runaway::line(self.signature.parameters.get(at)?, estimate, self.unit(i), self.spelling)
    }

    /// A line for each output with outliers.
    fn push_light(&self, text: &mut String) {
        let outputs = self.signature.outputs.iter().enumerate();
        for (i, output) in outputs.filter(|(i, _)| self.fit.light_samples[*i] > 0) {
            let samples: usize = self.fit.misfits.iter().map(|misfits| misfits[i].samples).sum();
            let light = self.fit.light_samples[i];
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "`{}`: {light} of {samples} samples weigh less than half, {} %; of normal noise it were {} %",
                output.name,
                short(100.0 * light as f64 / samples as f64, 2),
                short(100.0 * self.fit.loss.light_share(), 2)
            );
        }
    }

    fn push_remarks(&self, text: &mut String) {
        let fit = self.fit;
        for line in (0..fit.estimates.len()).filter_map(|i| self.runaway(i)) {
            text.push_str(&line);
        }
        // Writing to a string cannot fail.
        for pair in fit.correlated(CORRELATED) {
            let (first, second) = (self.name(pair.first), self.name(pair.second));
            push_correlated(text, &first, &second, pair.correlation);
        }
        push_combinations(text, &fit.undetermined, |i| self.name(i), "output");
        for words in &self.reservations {
            let _ = writeln!(text, "{words}");
        }
        self.push_light(text);
        self.quality.push_remarks(text, self.signature);
        let name = |i| self.name(i);
        self.left_over.push_text(text, self.signature, &self.recording_names, name);
        if fit.samples_without_sensitivity > 0 {
            let _ = writeln!(
                text,
                "{} of {} samples have no defined sensitivities: the fit had to do without their \
                 derivatives",
                fit.samples_without_sensitivity, fit.samples
            );
        }
        if fit.failures > 0 {
            let _ = writeln!(text, "{} trials could not be simulated", fit.failures);
        }
        if let Some(minima) = &self.minima {
            minima.push_text(text, self);
        }
        let chi = fit.reduced_chi_square();
        let chi = chi.map_or_else(String::new, |chi| format!(", reduced χ² = {chi:.3}"));
        let _ = writeln!(
            text,
            "{} samples{chi}; {} steps, {} simulations, {}",
            fit.samples,
            fit.iterations,
            fit.evaluations,
            ended(fit.termination)
        );
    }
}

/// An estimate's name and its entry in the result.
pub(crate) fn entry(
    signature: &Signature,
    estimate: &ParameterEstimate,
) -> (String, EstimateEntry) {
    let unit = unit_of(signature, estimate);
    let name = match estimate.of {
        Direction::Parameter(_) => estimate.name.clone(),
        Direction::Start(i) => signature.unknowns.name(i).to_string(),
    };
    let entry = EstimateEntry {
        value: Some(unit.from_si(estimate.value)),
        unit: unit.symbol.to_string(),
        std: estimate.std.map(|std| std / unit.factor),
        at_bound: estimate.at_bound.map(BoundEntry::from),
        std_model: None,
        regression: None,
    };
    (name, entry)
}

impl IntervalEstimates for OutputErrorReport<'_> {
    fn signature(&self) -> &Signature {
        self.signature
    }

    fn estimates(&self) -> &[ParameterEstimate] {
        &self.fit.estimates
    }

    fn name(&self, i: usize) -> String {
        name_of(&self.fit.estimates[i], &self.recording_names)
    }
}

/// The name of an estimate: for an initial value with its recording if there are several.
pub(crate) fn name_of(estimate: &ParameterEstimate, recording_names: &[String]) -> String {
    match (estimate.recording, recording_names) {
        (Some(r), [_, _, ..]) => format!("{} of {}", estimate.name, recording_names[r]),
        _ => estimate.name.clone(),
    }
}

pub(crate) fn unit_of<'a>(signature: &'a Signature, estimate: &ParameterEstimate) -> &'a Unit {
    match estimate.of {
        Direction::Parameter(i) => &signature.parameters[i].unit,
        Direction::Start(i) => signature.unknowns.unit(i),
    }
}

/// The parameters that were not estimated, with their values.
pub(crate) fn fixed_entries(
    signature: &Signature,
    p: &[f64],
    estimates: &[ParameterEstimate],
) -> ByName<ValueEntry> {
    let is_fixed = |i: usize| !estimates.iter().any(|e| e.of == Direction::Parameter(i));
    let fixed = signature.parameters.iter().enumerate().filter(|(i, _)| is_fixed(*i));
    let entry = |(i, parameter): (usize, &dgd_runtime::Parameter)| {
        (parameter.name.to_string(), ValueEntry::new(p[i], &parameter.unit))
    };
    fixed.map(entry).collect()
}

/// The choice of each variant.
pub(crate) fn variant_entries(variants: &[Variant]) -> ByName<Option<String>> {
    let entry =
        |variant: &Variant| (variant.name.clone(), variant.choices.get(variant.chosen).cloned());
    variants.iter().map(entry).collect()
}

/// Root-mean-square residual of an output over all recordings, in its unit.
pub(crate) fn rms_of(
    evaluation: &OutputErrorEvaluation,
    output: usize,
    unit: &Unit,
) -> Option<f64> {
    let misfit: OutputMisfit = evaluation.misfits.iter().map(|misfits| misfits[output]).sum();
    misfit.rms().map(|rms| rms / unit.factor)
}

/// A line about two correlated estimates.
pub(crate) fn push_correlated(text: &mut String, first: &str, second: &str, correlation: f64) {
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "`{first}` and `{second}` are hardly told apart: correlation {correlation:.3}"
    );
}

/// A line for each combination of estimates that no output, or no row, depends on.
pub(crate) fn push_combinations(
    text: &mut String,
    undetermined: &[UndeterminedDirection],
    name: impl Fn(usize) -> String,
    what: &str,
) {
    for combination in undetermined {
        // Writing to a string cannot fail.
        let _ = match combination.terms.as_slice() {
            [one] => writeln!(text, "no {what} depends on `{}`", name(one.estimate)),
            terms => {
                let term = |term: &CombinationTerm| {
                    format!("`{}` by {:+.3} %", name(term.estimate), term.change)
                };
                let terms: Vec<String> = terms.iter().map(term).collect();
                writeln!(text, "no {what} sees a change of {}", terms.join(" and "))
            }
        };
    }
}

/// A value to the second digit of its standard deviation.
pub(crate) fn digits_of(value: f64, std: Option<f64>) -> String {
    let digits = match std {
        Some(std) if std > 0.0 && value != 0.0 => {
            (value.abs().log10().floor() - std.log10().floor()).clamp(0.0, 12.0) as usize + 2
        }
        _ => 6,
    };
    significant(value, digits)
}
