//! Trajectories of states and outputs, for one run or many.

mod ensemble;
mod fields;
mod noise;
mod over;
mod page;
mod prepared;

use dgd_compiler::pipeline::SensitivityDirections;
use dgd_page::Markup;
use dgd_plot::{Figure, MathText, SeriesMeaning};
use dgd_runtime::{IntegrateError, Observations, Solution};
use serde::{Serialize, Serializer};
use serde_json::{Value, json};

use crate::error::{TaskEnd, WorkError};
use crate::model::load;
use crate::output::agreement::Agreement;
use crate::output::columns::{events, in_unit, is_added, is_element, is_share, per_sample};
use crate::output::figure::{self, PanelLine, PanelSubject};
use crate::output::provenance::Provenance;
use crate::output::quantity::short;
use crate::output::table::push_table;
use crate::output::{ColumnKind, NamedColumn, TimeTable};
use crate::request::SimulateRequest;
use crate::result::simulate::EventEntry;
use crate::run::jumps::tell_jumps;
use crate::run::under_way::{stopped_by, told};
use crate::run::{MeasuredOutputs, ModelRun, PartialRun};
use crate::session::TaskContext;

pub use ensemble::{EnsembleRuns, EnsembleStorage};
pub use fields::SpaceTimeField;
pub use over::Sweep;
pub use prepared::{PreparedRun, prepare};

/// States and outputs over time.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct SimulationResult {
    /// Name of the model.
    pub model: String,
    /// Inputs, states and outputs; an output named like a state takes its column.
    pub table: TimeTable,
    /// Measurements of the outputs.
    pub measured: MeasuredOutputs,
    /// Name of the integration method.
    pub method: &'static str,
    /// Statistics of the solution, and its events.
    pub solution: SolutionFacts,
    /// Why it did not reach the end.
    pub stopped: Option<String>,
    /// Whether it was cancelled.
    pub is_interrupted: bool,
    /// The abscissa of the plots, if not time.
    pub sweep: Option<Sweep>,
    /// Arrays of unknowns that no output shows, if requested.
    pub fields: Vec<SpaceTimeField>,
    /// Versions and digests of the inputs.
    pub provenance: Provenance,
}

/// Statistics of a run's solution, and its events.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct SolutionFacts {
    /// Rows of the result.
    pub rows: usize,
    /// Accepted steps.
    pub steps: usize,
    /// Rejected steps.
    pub rejected: usize,
    /// Number of steps per sample; `None` for adaptive steps.
    pub steps_per_sample: Option<u32>,
    /// Events, for programs.
    events: Vec<EventEntry>,
}

impl SolutionFacts {
    pub(crate) fn from_solution(solution: &Solution) -> Self {
        SolutionFacts {
            rows: solution.len(),
            steps: solution.statistics.steps,
            rejected: solution.statistics.rejected,
            steps_per_sample: per_sample(solution),
            events: events(solution),
        }
    }

    /// The facts as JSON.
    pub(crate) fn to_json(&self, model: &str, method: &str) -> Value {
        json!({
            "model": model,
            "rows": self.rows,
            "method": method,
            "steps": self.steps,
            "rejected": self.rejected,
            "steps_per_sample": self.steps_per_sample,
            "events": self.events,
        })
    }
}

/// Simulates a model once.
///
/// # Errors
///
/// [`WorkError`]. A run that ends early returns a result with the reason.
pub fn simulate(
    request: &SimulateRequest,
    session: TaskContext<'_>,
) -> Result<SimulationResult, WorkError> {
    let choices = request.run.choices.starting(&request.run.solve);
    let loaded = load(&request.run.model, &choices, &SensitivityDirections::None, session)?;
    let mut run = ModelRun::prepare(&request.run, loaded, session)?;
    let mut sweep = Sweep::from_request(request, run.signature())?;
    let wanted = if request.fields && sweep.is_none() {
        fields::WantedArrays::collect(run.signature())
    } else {
        fields::WantedArrays::default()
    };
    session.listener.begins(false);
    let reached = told(session, run.span(), || run.simulate_with(&wanted.elements));
    let PartialRun { solution, mut observations, stopped } = reached?;
    tell_jumps(run.signature(), &solution, session);
    for fold in &solution.folds {
        session.remark(format!("note: {fold}"));
    }
    if let Some(seed) = request.noise_seed {
        noise::add(run.signature(), &mut observations, seed);
    }
    let table = table(&run, &solution, &observations);
    if let Some(sweep) = &mut sweep
        && request.run.every.is_none()
        && request.noise_seed.is_none()
        && stopped.is_none()
        && let Some(times) = over::between(&table.times)
    {
        run.times = times;
        let PartialRun { solution, observations, .. } =
            told(session, run.span(), || run.simulate())?;
        sweep.fine = Some(self::table(&run, &solution, &observations));
    }
    session.listener.ends();
    let fields = wanted.found(&solution, run.single_unknowns());
    Ok(SimulationResult {
        sweep,
        fields,
        ..SimulationResult::from_run(&run, table, &solution, stopped.as_ref())
    })
}

/// Prepares the runs of many sets of parameters and initial values.
///
/// # Errors
///
/// [`WorkError`], also for mistakes in the sets.
pub fn simulate_each(
    request: &SimulateRequest,
    session: TaskContext<'_>,
) -> Result<EnsembleRuns, WorkError> {
    EnsembleRuns::prepare(request, session)
}

impl SimulationResult {
    /// The result of a run.
    fn from_run(
        run: &ModelRun,
        table: TimeTable,
        solution: &Solution,
        stopped: Option<&IntegrateError>,
    ) -> SimulationResult {
        let (is_interrupted, stopped) = stopped_by(stopped, run.span());
        SimulationResult {
            model: run.signature().name.to_string(),
            table,
            method: run.options.method.name,
            solution: SolutionFacts::from_solution(solution),
            stopped,
            is_interrupted,
            fields: Vec::new(),
            sweep: None,
            measured: run.measured.clone(),
            provenance: run.provenance.clone(),
        }
    }

    /// The JSON without the columns.
    pub fn details(&self) -> Value {
        let mut details = self.solution.to_json(&self.model, self.method);
        if let (Some(error), Some(details)) = (&self.stopped, details.as_object_mut()) {
            details.insert("error".to_owned(), json!(error));
        }
        let agreements: Vec<Value> = self
            .agreements()
            .into_iter()
            .map(|(output, agreement)| {
                json!({
                    "name": output.name,
                    "unit": output.unit.symbol,
                    "fit_percent": agreement.fit_percent,
                    "rms": agreement.rms,
                    "samples": agreement.samples,
                })
            })
            .collect();
        if let Some(details) = details.as_object_mut() {
            details.insert("agreement".to_owned(), json!(agreements));
        }
        self.provenance.push_json(&mut details);
        details
    }

    /// The whole result as JSON.
    pub fn to_json(&self) -> Value {
        let mut result = self.details();
        self.table.push_json(&mut result);
        result
    }

    /// Agreement of each output with its measurements, at the rows that have a sample.
    fn agreements(&self) -> Vec<(&NamedColumn, Agreement)> {
        let times = &self.table.times;
        let one = |(output, samples): (_, &Option<Vec<f64>>)| {
            let output: &NamedColumn = output;
            // Times ascend on both sides. Of two rows at one time the second counts.
            let mut rows = 0;
            let mut simulated = move |time: &f64| {
                rows += times[rows..].iter().take_while(|row| *row <= time).count();
                let row = rows.checked_sub(1)?;
                (times[row].to_bits() == time.to_bits()).then(|| output.values[row])
            };
            let pairs = self.measured.times.iter().zip(samples.as_ref()?);
            let pairs = pairs.filter_map(|(time, sample)| Some((*sample, simulated(time)?)));
            let in_unit = |si: f64| output.unit.from_si(si);
            let pairs = pairs.map(|(y, w)| (in_unit(y), in_unit(w)));
            Some((output, Agreement::measure(pairs)?))
        };
        self.of_kind(ColumnKind::Output).zip(&self.measured.outputs).filter_map(one).collect()
    }

    /// Agreement of each output with its measurements, as text; empty without measurements.
    pub fn agreement(&self) -> String {
        let mut rows =
            vec![["output", "unit", "fit", "rms residual", "samples"].map(str::to_owned)];
        for (output, agreement) in self.agreements() {
            let fit = agreement.fit_percent.map(|fit| format!("{fit:.1} %"));
            rows.push([
                output.name.clone(),
                output.unit.symbol.to_string(),
                fit.unwrap_or_else(|| "-".to_owned()),
                short(agreement.rms, 3),
                agreement.samples.to_string(),
            ]);
        }
        let mut text = String::new();
        if rows.len() > 1 {
            push_table(&mut text, &rows);
        }
        text
    }

    /// The outcome.
    pub fn ended(&self) -> TaskEnd {
        let ended = if self.is_interrupted { TaskEnd::Interrupted } else { TaskEnd::Stopped };
        self.stopped.clone().map_or(TaskEnd::Done, |stopped| ended(stopped.into()))
    }

    /// Its figure: over time, or over the requested quantity.
    pub fn figure(&self) -> Figure {
        let over = self.sweep.as_ref().and_then(|sweep| over::figure(sweep, self));
        over.unwrap_or_else(|| {
            let arrays = fields::arrays_of(&self.table);
            let subjects = self.subjects(&arrays).into_iter().map(|(_, subject)| subject);
            let subjects: Vec<PanelSubject> = subjects.collect();
            let Figure { x_label, mut panels, .. } = figure::panels(&subjects);
            panels.extend(fields::panels(&self.fields, &self.table, &arrays));
            Figure::new(x_label, panels)
        })
    }

    /// Its figures over time: outputs; their residuals; other unknowns and inputs. An empty figure has no panels.
    pub fn figures(&self) -> [Figure; 3] {
        let (mut outputs, mut unknowns, mut inputs) = (Vec::new(), Vec::new(), Vec::new());
        for (kind, subject) in self.subjects(&fields::arrays_of(&self.table)) {
            match kind {
                ColumnKind::Output => outputs.push(subject),
                ColumnKind::Input => inputs.push(subject),
                ColumnKind::Unknown | ColumnKind::Derivative => unknowns.push(subject),
            }
        }
        unknowns.append(&mut inputs);
        let residuals = page::residuals(self, &page::compared(self));
        let residuals = residuals.unwrap_or_else(|| figure::panels(&[]));
        [figure::panels(&outputs), residuals, figure::panels(&unknowns)]
    }

    /// The quality of the agreement, or the reason why the run stopped, as a sentence; and the agreement of each output
    /// with its measurements as a table of a page, empty without measurements.
    pub fn in_words(&self) -> (String, Markup) {
        page::in_words(self, &page::compared(self))
    }

    /// Its page, with the command that reproduces it.
    pub fn page(&self, command: &str) -> String {
        page::write(self, command)
    }

    /// Columns of a kind, in order.
    pub(crate) fn of_kind(&self, kind: ColumnKind) -> impl Iterator<Item = &NamedColumn> {
        self.table.columns.iter().filter(move |column| column.kind == kind)
    }

    /// The curves of the figure: the inputs by unit; then each declared state and each output, with its measurements.
    /// Elements of `arrays`, which have pictures of their own, are included if they were measured.
    fn subjects(&self, arrays: &[String]) -> Vec<(ColumnKind, PanelSubject)> {
        let line = |name: MathText, column: &NamedColumn, meaning| PanelLine {
            name,
            times: self.table.times.clone(),
            values: column.in_unit(),
            meaning,
        };
        let mut subjects: Vec<(ColumnKind, PanelSubject)> = Vec::new();
        for (place, input) in self.of_kind(ColumnKind::Input).enumerate() {
            let line = line(MathText::name(&input.name), input, SeriesMeaning::Input(place));
            let unit = input.unit.symbol.to_string();
            let alike = subjects.iter_mut().find(|(_, subject)| subject.unit == unit);
            if let Some((_, subject)) = alike {
                // Two or more lines are named by the legend.
                subject.title = MathText::default();
                subject.lines.push(line);
            } else {
                let title = MathText::name(&input.name);
                subjects.push((ColumnKind::Input, PanelSubject { title, unit, lines: vec![line] }));
            }
        }
        for unknown in self.of_kind(ColumnKind::Unknown).filter(|unknown| !is_added(&unknown.name))
        {
            let subject = PanelSubject {
                title: MathText::name(&unknown.name),
                unit: unknown.unit.symbol.to_string(),
                lines: vec![line(MathText::plain("simulated"), unknown, SeriesMeaning::Simulated)],
            };
            subjects.push((ColumnKind::Unknown, subject));
        }
        for (i, output) in self.of_kind(ColumnKind::Output).enumerate() {
            let is_measured = self.measured.outputs.get(i).is_some_and(Option::is_some);
            if fields::is_of(&output.name, arrays) && !is_measured {
                continue;
            }
            let mut lines =
                vec![line(MathText::plain("simulated"), output, SeriesMeaning::Simulated)];
            if let Some(Some(samples)) = self.measured.outputs.get(i) {
                lines.push(PanelLine {
                    name: MathText::plain("measured"),
                    times: self.measured.times.clone(),
                    values: in_unit(samples, &output.unit),
                    meaning: SeriesMeaning::Measured,
                });
            }
            let (title, unit) = (MathText::name(&output.name), output.unit.symbol.to_string());
            subjects.push((ColumnKind::Output, PanelSubject { title, unit, lines }));
        }
        subjects
    }
}

impl Serialize for SimulationResult {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.to_json().serialize(serializer)
    }
}

/// Time series in the documented order: inputs, states, outputs; an output named like a state takes its column.
fn table(run: &ModelRun, solution: &Solution, observations: &Observations) -> TimeTable {
    let signature = run.signature();
    let mut columns = Vec::new();
    for (i, input) in signature.inputs.iter().enumerate() {
        let values = run.input_values(solution, i);
        columns.push(NamedColumn::new(&input.name, &input.unit, ColumnKind::Input, values));
    }
    for (i, unknown) in signature.unknowns.iter().enumerate() {
        let shown_as_output = || signature.outputs.iter().any(|output| output.name == unknown.name);
        let is_shown = !is_element(&unknown.name) && !is_share(&unknown.name);
        if is_shown && !shown_as_output() {
            let values = (0..solution.len()).map(|k| solution.y(k)[i]).collect();
            columns.push(NamedColumn::new(
                &unknown.name,
                &unknown.unit,
                ColumnKind::Unknown,
                values,
            ));
        }
    }
    for (i, output) in signature.outputs.iter().enumerate() {
        let values = (0..solution.len()).map(|k| observations.w(k)[i]).collect();
        columns.push(NamedColumn::new(&output.name, &output.unit, ColumnKind::Output, values));
    }
    TimeTable { times: solution.times.clone(), epoch: run.epoch, columns }
}
