//! A model on its data, for repeated runs with other parameters.

use std::path::PathBuf;

use dgd_compiler::pipeline::SensitivityDirections;

use super::{SimulationResult, table};
use crate::check::ModelDescription;
use crate::error::{UsageError, WorkError};
use crate::model::load;
use crate::output::provenance::Provenance;
use crate::request::{RunRequest, StartChoice};
use crate::run::{ModelRun, PartialRun, measured_start};
use crate::session::TaskContext;

/// A model on its data, for repeated runs with other parameters: read and compiled once.
pub struct PreparedRun {
    /// The contents of the model, with choices and settings.
    pub description: ModelDescription,
    /// The files it was read from, which may change: the model, its libraries and effects, the data.
    pub files: Vec<PathBuf>,
    run: ModelRun,
    /// Parameters of the model, SI.
    declared: Vec<f64>,
    start: StartChoice,
}

/// Reads and compiles a model, and reads its data.
///
/// # Errors
///
/// [`WorkError`].
pub fn prepare(request: &RunRequest, session: TaskContext<'_>) -> Result<PreparedRun, WorkError> {
    let choices = request.choices.starting(&request.solve);
    let loaded = load(&request.model, &choices, &SensitivityDirections::None, session)?;
    let provenance = Provenance::new(session, Some(loaded.digest.clone()), Vec::new());
    let path = request.model.display().to_string();
    let compiled = &loaded.compiled;
    let description = ModelDescription::describe(&path, &compiled.model, &compiled.dae, provenance);
    let mut files: Vec<PathBuf> =
        loaded.sources.files().map(|source| PathBuf::from(&source.name)).collect();
    files.extend(request.data.clone());
    files.retain(|file| session.files.is_file(file));
    let run = ModelRun::prepare(request, loaded, session)?;
    let declared = run.p.clone();
    Ok(PreparedRun { description, files, run, declared, start: request.solve.start })
}

impl PreparedRun {
    /// Simulates it with these values of parameters, each in its declared unit, and the model's values for the others.
    ///
    /// # Errors
    ///
    /// [`WorkError`]. A run that ends early returns a result with the reason.
    pub fn simulate(&mut self, values: &[(&str, f64)]) -> Result<SimulationResult, WorkError> {
        self.set(values)?;
        let run = &self.run;
        let PartialRun { solution, observations, stopped } = run.simulate()?;
        let table = table(run, &solution, &observations);
        Ok(SimulationResult::from_run(run, table, &solution, stopped.as_ref()))
    }

    fn set(&mut self, values: &[(&str, f64)]) -> Result<(), WorkError> {
        let mut p = self.declared.clone();
        for (name, value) in values {
            let parameters = &self.run.signature().parameters;
            let position = parameters.iter().position(|parameter| parameter.name == *name);
            let Some(at) = position else {
                let known = parameters.iter().map(|parameter| parameter.name.to_string()).collect();
                let (kind, name) = ("parameter", (*name).to_owned());
                return Err(UsageError::Unknown { given: None, kind, name, known }.into());
            };
            let parameter = &parameters[at];
            let si = value * parameter.unit.factor + parameter.unit.offset;
            let bounds = parameter.lower..=parameter.upper;
            // The bounds were converted from the declared unit, and may have been rounded differently.
            let room = 1e-12 * si.abs();
            if !si.is_finite() || si < bounds.start() - room || si > bounds.end() + room {
                let (name, unit) = ((*name).to_owned(), parameter.unit.symbol.to_string());
                return Err(UsageError::BeyondBounds { name, value: *value, unit }.into());
            }
            p[at] = si;
        }
        self.run.p = p;
        if self.start == StartChoice::Measured {
            self.run.start.clear();
            let run = &self.run;
            self.run.start =
                measured_start(&run.problem(), run.times[0], &run.measured, &run.options)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::request::SimulateRequest;
    use crate::session::SilentReporter;
    use crate::simulate;

    fn request() -> RunRequest {
        let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
        let mut request = RunRequest::new(format!("{root}/models/mud_circulation.dgd"));
        request.data = Some(format!("{root}/examples/data/circulation.csv").into());
        request.every = Some(60.0);
        request
    }

    #[test]
    fn another_value_gives_what_setting_it_gives_to_the_last_bit() {
        let session = TaskContext::new(&SilentReporter);
        let mut prepared = prepare(&request(), session).expect("a sound model");
        let mut with_other = SimulateRequest::new(request());
        let declared = simulate(&with_other, session).expect("a sound model");
        with_other.run.choices.set = vec!["c0=280".to_owned(), "M_ssp=2e8".to_owned()];
        let other = simulate(&with_other, session).expect("a sound model");
        let values = |simulated: &SimulationResult| -> Vec<Vec<f64>> {
            simulated.table.columns.iter().map(|column| column.values.clone()).collect()
        };
        let moved = prepared.simulate(&[("c0", 280.0), ("M_ssp", 2e8)]).expect("a run");
        assert_eq!(values(&moved), values(&other));
        // Earlier values do not persist.
        let back = prepared.simulate(&[]).expect("a run");
        assert_eq!(values(&back), values(&declared));
        assert_ne!(values(&moved), values(&declared));
    }

    #[test]
    fn what_was_read_is_named_and_what_cannot_be_is_refused() {
        let mut prepared =
            prepare(&request(), TaskContext::new(&SilentReporter)).expect("a sound model");
        let names: Vec<_> = prepared.files.iter().filter_map(|file| file.file_name()).collect();
        assert_eq!(names, ["mud_circulation.dgd", "circulation.csv"]);
        for (name, value) in [("c9", 1.0), ("c0", -1.0), ("c0", f64::NAN), ("M_ssp", 1e5)] {
            let error = prepared.simulate(&[(name, value)]).expect_err("it cannot be");
            assert!(error.to_string().contains(&format!("`{name}`")), "{error}");
        }
    }
}
