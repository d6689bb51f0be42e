//! Data files as inputs and measured outputs of a model, in SI.

use std::path::{Path, PathBuf};

use dgd_compiler::dae::Dae;
use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::source::SourceMap;
use dgd_compiler::units::Unit;
use dgd_data::select::{self, GapPolicy};
use dgd_data::{DataTable, Epoch, ReadOptions, Rename, Sha256Digest};
use dgd_execute::LoadedSystem;
use dgd_identify::Recording as Experiment;
use dgd_runtime::{InputColumn, Inputs, Options, Problem, Signature, System};

use crate::error::{ComputationError, UsageError, WorkError};
use crate::model::Compilation;
use crate::request::{SolverOptions, StartChoice};
use crate::run::{densities, measured_start};
use crate::session::TaskContext;

/// Whether a data file may have no time column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TimeColumnRule {
    /// It must have one.
    Time,
    /// It may hold independent rows, for a model whose outputs depend only on the inputs at the same time. They are
    /// read as one row per second.
    Rows,
}

/// The columns of a data file that the model uses, SI.
pub(crate) struct RunRecording {
    /// How its rows are timed.
    pub clock: TimeColumnRule,
    /// Digest of its bytes; none for a stream.
    pub digest: Option<Sha256Digest>,
    /// The timestamp of the first row, if times are timestamps.
    pub epoch: Option<Epoch>,
    pub times: Vec<f64>,
    inputs: Vec<Vec<f64>>,
    pub measured: MeasuredOutputs,
}

impl RunRecording {
    /// The inputs as functions of time.
    pub(crate) fn inputs(&self, signature: &Signature) -> Result<Inputs, WorkError> {
        let columns: Vec<InputColumn<'_>> = signature
            .inputs
            .iter()
            .zip(&self.inputs)
            .map(|(input, values)| InputColumn {
                name: &input.name,
                interpolation: input.interpolation,
                values,
            })
            .collect();
        Ok(Inputs::recorded(&self.times, &columns).map_err(ComputationError::Inputs)?)
    }

    /// Reads a data file; `None` after mistakes, which are reported.
    pub(crate) fn read(
        path: &Path,
        renames: &[Rename],
        dae: &Dae,
        clock: TimeColumnRule,
        sources: &mut SourceMap,
        diagnostics: &mut Diagnostics,
        session: TaskContext<'_>,
    ) -> Option<RunRecording> {
        let known = KnownColumns::from_dae(dae);
        let wanted = known.wanted();
        let table = ReadOptions::default()
            .renamed(renames)
            .with_columns(&wanted)
            .read(session.files, path, sources, diagnostics)
            .ok()?;
        let read =
            Self::select(&table, &known, clock, GapPolicy::Refused, sources, diagnostics, session);
        let mut recording = read?;
        let outputs = recording.measured.outputs.iter_mut().zip(known.outputs());
        for (samples, output) in outputs {
            // A column without any value counts as not measured.
            if samples.as_ref().is_some_and(|samples| !samples.iter().any(|y| y.is_finite())) {
                *samples = None;
                session.remark(format!(
                    "`{}`: the column `{}` has no value in any row, and is not used",
                    path.display(),
                    output.name
                ));
            }
        }
        Some(recording)
    }

    /// Reads data files; mistakes in any of them end the command.
    pub(crate) fn read_all(
        paths: &[PathBuf],
        renames: &[Rename],
        dae: &Dae,
        clock: TimeColumnRule,
        compilation: &mut Compilation<'_>,
        session: TaskContext<'_>,
    ) -> Result<Vec<RunRecording>, WorkError> {
        let Compilation { sources, diagnostics, .. } = compilation;
        let read =
            |path: &PathBuf| Self::read(path, renames, dae, clock, sources, diagnostics, session);
        let recordings: Vec<RunRecording> = paths.iter().filter_map(read).collect();
        if diagnostics.check().is_err() {
            return Err(WorkError::diagnosed(diagnostics, sources.clone()));
        }
        Ok(recordings)
    }

    /// The columns of a table that the model uses; `None` after mistakes.
    pub(crate) fn select(
        table: &DataTable,
        known: &KnownColumns<'_>,
        clock: TimeColumnRule,
        gaps: GapPolicy,
        sources: &SourceMap,
        diagnostics: &mut Diagnostics,
        session: TaskContext<'_>,
    ) -> Option<RunRecording> {
        let clock = match clock {
            TimeColumnRule::Rows if table.time.is_none() && known.dae.is_static() => {
                TimeColumnRule::Rows
            }
            TimeColumnRule::Rows | TimeColumnRule::Time => TimeColumnRule::Time,
        };
        let times = match clock {
            TimeColumnRule::Rows => Ok((0..table.len()).map(|row| row as f64).collect()),
            TimeColumnRule::Time => table.recording(diagnostics).map(<[f64]>::to_vec),
        };
        let input_columns =
            select::inputs_with(table, &known.inputs(), &known.names(), gaps, diagnostics);
        let output_columns = select::measured(table, &known.outputs(), diagnostics);
        let deviations = select::deviations(table, &known.outputs(), diagnostics);
        let (times, inputs) = (times.ok()?, input_columns.ok()?);
        let (mut outputs, mut deviations) = (output_columns.ok()?, deviations.ok()?);
        // A computed standard deviation is not a measured output.
        for density in &known.dae.densities {
            outputs[density.deviation] = None;
            if deviations[density.output].take().is_some() {
                let name = &known.dae.outputs[density.output].declared.name;
                densities::remark_unused(name, "the model has a formula for the noise", session);
            }
        }
        if let Some(note) = &table.time_note {
            session.note(note, sources);
        }
        if let Some(note) = select::unknown_note(table, &known.names()) {
            session.note(&note, sources);
        }
        let measured = MeasuredOutputs { times: times.clone(), outputs, deviations };
        let (digest, epoch) = (table.digest, table.epoch);
        Some(RunRecording { clock, digest, epoch, times, inputs, measured })
    }

    /// Inputs in one row, SI.
    pub(crate) fn inputs_at(&self, row: usize) -> Vec<f64> {
        self.inputs.iter().map(|values| values[row]).collect()
    }

    /// The part between the first and the last time for a fit, with initial values from the requested source.
    pub(crate) fn experiment(
        &self,
        system: &LoadedSystem,
        p: &[f64],
        path: &Path,
        args: &SolverOptions,
        options: &Options,
    ) -> Result<Experiment, WorkError> {
        let inputs = self.inputs(system.signature())?;
        let times = &self.times;
        let from = args.from.map_or(0, |from| times.partition_point(|t| *t < from));
        let until = args.until.map_or(times.len(), |to| times.partition_point(|t| *t <= to));
        let Some(&first) = times[..until].get(from) else {
            let path = path.to_owned();
            return Err(UsageError::NothingBetween { path, what: "sample" }.into());
        };
        let window = |samples: &Vec<f64>| samples[from..until].to_vec();
        let outputs = self.measured.outputs.iter();
        let measured = outputs.map(|samples| samples.as_ref().map(window)).collect();
        let deviations = self.measured.deviations.iter();
        let mut experiment = Experiment::new(window(times), inputs, measured);
        experiment.deviations = deviations.map(|all| all.as_ref().map(window)).collect();
        if args.start == StartChoice::Measured {
            let problem = Problem { system, p, inputs: &experiment.inputs, start: &[] };
            experiment.start = measured_start(&problem, first, &self.measured, options)?;
        }
        Ok(experiment)
    }
}

/// Names of recordings in results: their file names; if two are equal, the paths as given, with numbers if even those
/// are equal.
pub(crate) fn names(paths: &[PathBuf]) -> Vec<String> {
    let file = |path: &PathBuf| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let files: Vec<String> = paths.iter().map(file).collect();
    let typed: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
    let is_unique = |names: &[String]| {
        let mut sorted: Vec<&String> = names.iter().collect();
        sorted.sort_unstable();
        sorted.windows(2).all(|pair| pair[0] != pair[1])
    };
    if is_unique(&files) {
        files
    } else if is_unique(&typed) {
        typed
    } else {
        typed.iter().enumerate().map(|(k, path)| format!("{path} ({})", k + 1)).collect()
    }
}

/// Columns that a model uses.
pub(crate) struct KnownColumns<'a> {
    dae: &'a Dae,
    /// Names of outputs that are elements of arrays.
    elements: Vec<(String, &'a dgd_compiler::model::DeclarationHeader)>,
    /// Names of columns with standard deviations of readings.
    deviations: Vec<String>,
}

impl<'a> KnownColumns<'a> {
    pub(crate) fn from_dae(dae: &'a Dae) -> Self {
        let arrays = dae.output_arrays.iter();
        let elements: Vec<(String, &dgd_compiler::model::DeclarationHeader)> =
            arrays.flat_map(|array| array.names().map(|name| (name, &array.declared))).collect();
        let outputs = dae.outputs.iter().map(|output| output.declared.name.as_str());
        let names = outputs.chain(elements.iter().map(|(name, _)| name.as_str()));
        let deviations = names.map(select::deviation).collect();
        KnownColumns { dae, elements, deviations }
    }

    pub(crate) fn inputs(&self) -> Vec<select::DeclaredColumn<'_>> {
        self.dae.inputs.iter().map(|input| declared(&input.declared)).collect()
    }

    pub(crate) fn outputs(&self) -> Vec<select::DeclaredColumn<'_>> {
        let single = self.dae.outputs.iter().map(|output| declared(&output.declared));
        let elements = self.elements.iter();
        let elements =
            elements.map(|(name, whole)| select::DeclaredColumn { name, ..declared(whole) });
        single.chain(elements).collect()
    }

    /// Names of all columns that a recording reads from a file.
    fn wanted(&self) -> Vec<&str> {
        let KnownColumns { dae, elements, deviations } = self;
        let inputs = dae.inputs.iter().map(|input| input.declared.name.as_str());
        let outputs = dae.outputs.iter().map(|output| output.declared.name.as_str());
        let elements = elements.iter().map(|(name, _)| name.as_str());
        let deviations = deviations.iter().map(String::as_str);
        inputs.chain(outputs).chain(elements).chain(deviations).collect()
    }

    /// Names of all columns that need no remark.
    fn names(&self) -> Vec<&str> {
        let unknowns = self.dae.unknowns.iter().map(|unknown| unknown.name.as_str());
        self.wanted().into_iter().chain(unknowns).collect()
    }
}

fn declared(declared: &dgd_compiler::model::DeclarationHeader) -> select::DeclaredColumn<'_> {
    let unit: &Unit = &declared.unit;
    select::DeclaredColumn { name: &declared.name, unit, place: Some(declared.span) }
}

/// Measured outputs, SI.
#[derive(Debug, Clone, Default)]
pub struct MeasuredOutputs {
    /// Sample times, s.
    pub times: Vec<f64>,
    /// For each output of the model, its samples.
    pub outputs: Vec<Option<Vec<f64>>>,
    /// For each output, the standard deviations of its samples, if the data has them.
    pub deviations: Vec<Option<Vec<f64>>>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recordings_have_names_of_their_own() {
        let named = |paths: &[&str]| names(&paths.iter().map(PathBuf::from).collect::<Vec<_>>());
        assert_eq!(named(&["a/one.csv", "b/two.csv"]), ["one.csv", "two.csv"]);
        assert_eq!(named(&["a/run.csv", "b/run.csv"]), ["a/run.csv", "b/run.csv"]);
        let twice = named(&["run.csv", "a/run.csv", "run.csv"]);
        assert_eq!(twice, ["run.csv (1)", "a/run.csv (2)", "run.csv (3)"]);
    }
}
