//! The missing term of an equation, computed from measurements.

mod page;
mod report;
mod sensors;
mod twin;

use dgd_compiler::argument::Argument;
use dgd_compiler::model::Model;
use dgd_compiler::pipeline::SensitivityDirections;
use dgd_compiler::units::parse_unit;
use dgd_discover::{MissingTerms, NoSuchTerm, ReconstructedRecording as Readings, inputs_with};
use dgd_identify::Recording;
use dgd_identify::inversion::{InversionProblem, invert as invert_equation};
use dgd_runtime::{Inputs, System, Unit};

use crate::error::{ComputationError, UsageError, WorkError};
use crate::model::load;
use crate::request::InvertRequest;
use crate::run::ModelRun;
use crate::session::TaskContext;
use sensors::{Sensor, sensors};

pub use report::InvertedReport;
pub use twin::TwinInput;

/// Computes the missing term of an equation.
///
/// # Errors
///
/// [`WorkError`]: there is no such equation, or its variables were not measured.
pub fn invert(
    request: &InvertRequest,
    session: TaskContext<'_>,
) -> Result<InvertedReport, WorkError> {
    let choices = request.choices.starting(&request.solve);
    let loaded = load(&request.model, &choices, &SensitivityDirections::None, session)?;
    let model = loaded.compiled.model.clone();
    let label = request.equation.as_str();
    let terms = opened(&model, label, request)?;
    let units = units(&terms, &model, request)?;
    let run = ModelRun::prepare(&request.run(), loaded, session)?;
    let sensors = sensors(&run, &request.outputs)?;

    let (first, last) = (run.times[0], run.times[run.times.len() - 1]);
    let times = &run.measured.times;
    let in_run = times.partition_point(|t| *t < first)..times.partition_point(|t| *t <= last);
    let window = |samples: &Vec<f64>| samples[in_run.clone()].to_vec();
    let measured: Vec<Option<Vec<f64>>> =
        run.measured.outputs.iter().map(|samples| samples.as_ref().map(window)).collect();
    let times = times[in_run.clone()].to_vec();
    // Delayed inputs are read before the first sample.
    let inputs = with_nothing(&terms, &run.inputs, &run.measured.times)?;
    let noise: Vec<Option<f64>> =
        sensors.iter().map(|sensor| sensor.as_ref().map(|sensor| sensor.noise)).collect();
    let mut recording = Recording::new(times, inputs, measured);
    recording.start.clone_from(&run.start);
    let problem = InversionProblem {
        system: terms.system(),
        p: &run.p,
        recording: &recording,
        input: run.inputs.len(),
        noise: &noise,
        bandwidth: request.bandwidth,
    };
    session.listener.begins(false);
    let inverted = invert_equation(&problem)
        .map_err(|error| ComputationError::Inversion { label: label.to_owned(), error })?;
    let twin = request
        .with_estimate
        .then(|| twin::estimate(&terms, &run, &recording, &noise, session))
        .flatten();
    session.listener.ends();
    let used: Vec<Sensor> = sensors.into_iter().flatten().collect();
    let signature = terms.system().signature();
    let missing =
        InvertedReport::new(request, signature, inverted, units, used, twin, run.provenance);
    Ok(missing.since(run.epoch))
}

/// The model with an unknown input in the equation.
fn opened(model: &Model, label: &str, request: &InvertRequest) -> Result<MissingTerms, WorkError> {
    let engine = request.solve.engine;
    MissingTerms::of_equation(model, label, engine).map_err(|reason| match reason {
        NoSuchTerm::NoEquation => {
            let mut known: Vec<String> =
                model.all_equations().map(|equation| equation.label.clone()).collect();
            known.dedup();
            let given = Some(Argument::For.with(label));
            let (kind, name) = ("equation", label.to_owned());
            UsageError::Unknown { given, kind, name, known }.into()
        }
        NoSuchTerm::Exact => UsageError::ExactEquation(label.to_owned()).into(),
        NoSuchTerm::Closed(reason) => {
            ComputationError::NotOpened { label: label.to_owned(), reason }.into()
        }
    })
}

/// The display unit and the SI unit of the missing term.
fn units(
    terms: &MissingTerms,
    model: &Model,
    request: &InvertRequest,
) -> Result<[Unit; 2], WorkError> {
    let label = &request.equation;
    let [place] = terms.places() else {
        let units = terms.places().iter().map(|place| place.unit.clone()).collect();
        return Err(UsageError::SeveralUnits { label: label.clone(), units }.into());
    };
    let si_unit = parse_unit(&place.unit).ok();
    let si = Unit { symbol: place.unit.clone().into(), factor: 1.0, offset: 0.0 };
    let Some(asked) = &request.unit else {
        let familiar = si_unit.map(|si_unit| model.familiar(si_unit.dimension)).map(|unit| Unit {
            symbol: unit.symbol.into(),
            factor: unit.factor,
            offset: 0.0,
        });
        return Ok([familiar.unwrap_or_else(|| si.clone()), si]);
    };
    match parse_unit(asked) {
        Ok(unit) if si_unit.as_ref().is_none_or(|si_unit| si_unit.dimension == unit.dimension) => {
            Ok([Unit { symbol: asked.clone().into(), factor: unit.factor, offset: 0.0 }, si])
        }
        Ok(_) => {
            let (asked, label, unit) = (asked.clone(), label.clone(), place.unit.clone());
            Err(UsageError::OtherDimension { asked, label, unit }.into())
        }
        Err(error) => Err(UsageError::UnreadableUnit { asked: asked.clone(), error }.into()),
    }
}

fn with_nothing(terms: &MissingTerms, inputs: &Inputs, times: &[f64]) -> Result<Inputs, WorkError> {
    let nothing = vec![0.0; times.len()];
    let readings = Readings { p: &[], inputs, start: &[], times, measured: &[], noise: &[] };
    Ok(inputs_with(terms, &readings, 0, &nothing).map_err(ComputationError::Inputs)?)
}
