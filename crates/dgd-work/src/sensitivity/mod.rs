//! Derivatives of states and outputs with respect to parameters over time.

mod page;
pub mod verify;

use dgd_compiler::argument::Argument;
use dgd_compiler::diagnostics::{Code, Diagnostic};
use dgd_compiler::pipeline::SensitivityDirections;
use dgd_plot::{Figure, MathText, SeriesMeaning};
use dgd_runtime::{Direction, Observations, Signature, Solution, Unit};
use serde::{Serialize, Serializer};
use serde_json::{Value, json};

use crate::error::{TaskEnd, WorkError, meant};
use crate::model::{Compilation, LoadedModel};
use crate::output::columns::{is_share, quotient};
use crate::output::figure::{self, PanelLine, PanelSubject};
use crate::output::provenance::Provenance;
use crate::output::{ColumnKind, NamedColumn, TimeTable};
use crate::request::SensitivityRequest;
use crate::run::jumps::tell_jumps;
use crate::run::under_way::{stopped_by, told};
use crate::run::{ModelRun, PartialRun};
use crate::session::TaskContext;
use crate::simulate::SolutionFacts;

/// Derivatives over time.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Sensitivities {
    /// Name of the model.
    pub model: String,
    /// A column for each derivative.
    pub table: TimeTable,
    /// The differentiated quantities, each with its derivatives in the order of the table.
    pub trajectories: Vec<NamedColumn>,
    /// Name of the integration method.
    pub method: &'static str,
    /// Statistics of the solution, and its events.
    pub solution: SolutionFacts,
    /// Intervals in which a derivative is undefined.
    pub undefined: Vec<UndefinedInterval>,
    /// Thresholds at which the run began, where derivatives are one-sided.
    pub one_sided: Vec<OneSidedThreshold>,
    /// The comparison with differences, if requested.
    pub verification: Option<verify::VerificationReport>,
    /// Why it did not reach the end.
    pub stopped: Option<String>,
    /// Whether it was cancelled.
    pub is_interrupted: bool,
    /// Versions and digests of the inputs.
    pub provenance: Provenance,
    /// Titles of the derivatives in a figure.
    titles: Vec<MathText>,
}

/// An interval in which derivatives are undefined.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct UndefinedInterval {
    /// When it begins, s.
    pub from: f64,
    /// When it ends, s.
    pub until: f64,
    /// The equation that causes it.
    pub equation: String,
}

/// A threshold at which the run began.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct OneSidedThreshold {
    /// The change at the threshold.
    pub threshold: String,
    /// Parameters and initial values whose derivatives are one-sided.
    pub directions: Vec<String>,
}

/// Something that can be differentiated.
#[derive(Debug, Clone, Copy)]
enum DifferentiableQuantity {
    /// An unknown, by index.
    Unknown(usize),
    /// An output, by index.
    Output(usize),
}

/// Runs a model with its sensitivities.
///
/// # Errors
///
/// [`WorkError`]. A run that ends early returns a result with the reason.
pub fn sensitivity(
    request: &SensitivityRequest,
    session: TaskContext<'_>,
) -> Result<Sensitivities, WorkError> {
    let (loaded, of) = load(request, session)?;
    let run = ModelRun::prepare(&request.run, loaded, session)?;
    session.listener.begins(false);
    let reached = told(session, run.span(), || run.simulate_with_sensitivities());
    let PartialRun { solution, observations, stopped } = reached?;
    tell_jumps(run.signature(), &solution, session);
    for fold in &solution.folds {
        session.remark(format!("note: {fold}"));
    }
    for undefined in &solution.undefined {
        session.remark(format!("note: {undefined}"));
    }
    for one_sided in &solution.one_sided {
        session.remark(format!("note: {one_sided}"));
    }
    let verified =
        (cfg!(feature = "estimators") && request.verify_sensitivities && stopped.is_none())
            .then(|| {
                let compared = compared(request, &run, &of);
                verify::against_differences(&run, &solution, &observations, &compared, session)
            })
            .transpose();
    let (mut is_interrupted, mut stopped) = stopped_by(stopped.as_ref(), run.span());
    let verification = match verified {
        Err(_) if session.listener.is_stopped() => {
            let words = "stopped by Ctrl-C: the sensitivities are not compared with differences";
            (is_interrupted, stopped) = (true, Some(words.to_owned()));
            None
        }
        verified => verified?,
    };
    session.listener.ends();
    let pairs = pairs(&run, &solution, &observations, &of, request.scaled);
    let trajectory = |of: &DifferentiableQuantity| {
        let (name, unit) = of.name_and_unit(run.signature());
        let kind = match of {
            DifferentiableQuantity::Unknown(_) => ColumnKind::Unknown,
            DifferentiableQuantity::Output(_) => ColumnKind::Output,
        };
        NamedColumn::new(&name, unit, kind, of.values(&solution, &observations))
    };
    let undefined = solution.undefined.iter().map(|stretch| UndefinedInterval {
        from: stretch.from,
        until: stretch.until,
        equation: stretch.equation.clone(),
    });
    let one_sided = solution.one_sided.iter().map(|start| OneSidedThreshold {
        threshold: start.threshold.clone(),
        directions: start.directions.clone(),
    });
    Ok(Sensitivities {
        model: run.signature().name.to_string(),
        trajectories: of.iter().map(trajectory).collect(),
        method: run.options.method.name,
        solution: SolutionFacts::from_solution(&solution),
        undefined: undefined.collect(),
        one_sided: one_sided.collect(),
        verification,
        stopped,
        is_interrupted,
        provenance: run.provenance.clone(),
        titles: pairs.iter().map(DerivativePair::title).collect(),
        table: TimeTable {
            times: solution.times.clone(),
            epoch: run.epoch,
            columns: pairs.into_iter().map(DerivativePair::column).collect(),
        },
    })
}

impl Sensitivities {
    /// The JSON without the columns.
    pub fn details(&self) -> Value {
        let mut result = self.solution.to_json(&self.model, self.method);
        if let Some(details) = result.as_object_mut() {
            details.insert("undefined".to_owned(), json!(self.undefined));
            if !self.one_sided.is_empty() {
                details.insert("one_sided".to_owned(), json!(self.one_sided));
            }
            if let Some(error) = &self.stopped {
                details.insert("error".to_owned(), json!(error));
            }
            if let Some(verification) = &self.verification {
                details.insert("verification".to_owned(), verification.to_json());
            }
        }
        self.provenance.push_json(&mut result);
        result
    }

    /// The whole result as JSON.
    pub fn to_json(&self) -> Value {
        let mut result = self.details();
        self.table.push_json(&mut result);
        result
    }

    /// The outcome; a derivative that differs from its difference is a failure.
    pub fn ended(&self) -> TaskEnd {
        if let Some(error) = &self.stopped {
            let ended = if self.is_interrupted { TaskEnd::Interrupted } else { TaskEnd::Stopped };
            return ended(error.clone().into());
        }
        let wrong = self.verification.as_ref().and_then(verify::VerificationReport::wrong);
        wrong.map_or(TaskEnd::Done, |wrong| TaskEnd::Stopped(wrong.into()))
    }

    /// Its page, with the command that reproduces it.
    pub fn page(&self, command: &str) -> String {
        page::write(self, command)
    }

    /// For each quantity its trajectory, then its derivatives.
    pub fn figure(&self) -> Figure {
        let subject = |column: &NamedColumn, title: MathText| PanelSubject {
            title,
            unit: column.unit.symbol.to_string(),
            lines: vec![PanelLine {
                name: MathText::default(),
                times: self.table.times.clone(),
                values: column.in_unit(),
                meaning: SeriesMeaning::Simulated,
            }],
        };
        let each = self.table.columns.len() / self.trajectories.len().max(1);
        let mut derivatives = self.table.columns.iter().zip(&self.titles);
        let mut subjects = Vec::new();
        for trajectory in &self.trajectories {
            subjects.push(subject(trajectory, MathText::name(&trajectory.name)));
            let own_columns = derivatives.by_ref().take(each);
            subjects.extend(own_columns.map(|(column, title)| subject(column, title.clone())));
        }
        figure::panels(&subjects)
    }
}

impl Serialize for Sensitivities {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.to_json().serialize(serializer)
    }
}

/// The quantities to compare with differences: those of `--of`, or all.
fn compared(
    request: &SensitivityRequest,
    run: &ModelRun,
    of: &[DifferentiableQuantity],
) -> Vec<verify::VerifiedQuantity> {
    if request.of.is_empty() {
        return verify::VerifiedQuantity::all(run.signature());
    }
    let compared = of.iter().map(|of| match *of {
        DifferentiableQuantity::Unknown(i) => verify::VerifiedQuantity::Unknown(i),
        DifferentiableQuantity::Output(i) => verify::VerifiedQuantity::Output(i),
    });
    compared.collect()
}

/// Compiles the model with the requested sensitivities, and resolves the names of quantities.
fn load(
    request: &SensitivityRequest,
    session: TaskContext<'_>,
) -> Result<(LoadedModel, Vec<DifferentiableQuantity>), WorkError> {
    let mut compilation = Compilation::new(session.files);
    let options = compilation.options(&request.run.choices.starting(&request.run.solve))?;
    let directions = if request.to.is_empty() {
        SensitivityDirections::All
    } else {
        SensitivityDirections::Named(
            request.to.iter().map(|name| compilation.name(Argument::To, name.trim())).collect(),
        )
    };
    let apply = &request.run.choices.apply;
    let (compiled, changed) =
        match compilation.compile(&request.run.model, apply, &options, &directions)? {
            Ok(compiled) => compiled,
            Err(reported) => return Err(compilation.fail(reported)),
        };

    let signature = &compiled.program.signature;
    let unknowns: Vec<_> = signature.unknowns.iter().map(|x| x.name).collect();
    let outputs: Vec<&str> = signature.outputs.iter().map(|output| &*output.name).collect();
    let unknown = |name: &str| unknowns.iter().position(|x| x == name);
    let output = |name: &str| outputs.iter().position(|x| *x == name);
    let mut quantities = Vec::new();
    for name in &request.of {
        let name = compilation.name(Argument::Of, name.trim());
        let quantity = unknown(&name.text).map(DifferentiableQuantity::Unknown);
        if let Some(quantity) =
            quantity.or_else(|| output(&name.text).map(DifferentiableQuantity::Output))
        {
            quantities.push(quantity);
            continue;
        }
        let message = format!("no state and no output is called `{}`", name.text);
        let names = signature.unknowns.single.iter().map(|x| &*x.name);
        let names = names.filter(|name| !is_share(name));
        // An output may have the name of its unknown.
        let others = outputs.iter().copied();
        let known: Vec<&str> = names.chain(others.filter(|name| unknown(name).is_none())).collect();
        let help = meant(&name.text, &known);
        let diagnostic = Diagnostic::new(Code::UnknownName, name.span, message).help(help);
        compilation.diagnostics.error(diagnostic);
    }
    if compilation.diagnostics.check().is_err() {
        return Err(WorkError::diagnosed(&compilation.diagnostics, compilation.sources));
    }
    if quantities.is_empty() {
        let unknowns = signature.unknowns.single.iter().enumerate();
        let shown = unknowns.filter(|(_, unknown)| !is_share(&unknown.name));
        quantities.extend(shown.map(|(i, _)| DifferentiableQuantity::Unknown(i)));
        // An output that equals an unknown would only repeat it in another unit.
        let others = outputs.iter().enumerate();
        let single = signature.unknowns.single.len();
        let is_new = |name: &str| unknown(name).is_none_or(|i| i >= single);
        quantities.extend(
            others.filter(|(_, x)| is_new(x)).map(|(i, _)| DifferentiableQuantity::Output(i)),
        );
    }
    Ok((LoadedModel::new(compiled, compilation.sources, changed), quantities))
}

impl DifferentiableQuantity {
    fn name_and_unit(self, signature: &Signature) -> (String, &Unit) {
        match self {
            DifferentiableQuantity::Unknown(i) => {
                (signature.unknowns.name(i).into_owned(), signature.unknowns.unit(i))
            }
            DifferentiableQuantity::Output(i) => {
                (signature.outputs[i].name.to_string(), &signature.outputs[i].unit)
            }
        }
    }

    /// Its values in SI.
    fn values(self, solution: &Solution, observations: &Observations) -> Vec<f64> {
        let value = |k| match self {
            DifferentiableQuantity::Unknown(i) => solution.y(k)[i],
            DifferentiableQuantity::Output(i) => observations.w(k)[i],
        };
        (0..solution.len()).map(value).collect()
    }

    /// Its derivatives in the j-th direction, SI.
    fn derivatives(self, solution: &Solution, observations: &Observations, j: usize) -> Vec<f64> {
        let derivative = |k| match self {
            DifferentiableQuantity::Unknown(i) => solution.s(k)[j * solution.n + i],
            DifferentiableQuantity::Output(i) => observations.dw(k)[j * observations.n_w + i],
        };
        (0..solution.len()).map(derivative).collect()
    }
}

/// The derivative of one quantity with respect to one parameter.
struct DerivativePair {
    of: String,
    to: String,
    scaled: bool,
    unit: Unit,
    /// SI.
    values: Vec<f64>,
}

impl DerivativePair {
    fn column(self) -> NamedColumn {
        let derivative = format!("d({})/d({})", self.of, self.to);
        let name = if self.scaled { format!("{}*{derivative}", self.to) } else { derivative };
        NamedColumn { name, unit: self.unit, kind: ColumnKind::Derivative, values: self.values }
    }

    fn title(&self) -> MathText {
        let derivative = MathText::derivative(&self.of, &self.to);
        if self.scaled {
            MathText::name(&self.to).then(MathText::plain(" ")).then(derivative)
        } else {
            derivative
        }
    }
}

fn pairs(
    run: &ModelRun,
    solution: &Solution,
    observations: &Observations,
    of: &[DifferentiableQuantity],
    scaled: bool,
) -> Vec<DerivativePair> {
    let signature = run.signature();
    let mut pairs = Vec::new();
    for of in of {
        let (name, unit) = of.name_and_unit(signature);
        for (j, direction) in signature.directions.iter().enumerate() {
            let mut values = of.derivatives(solution, observations, j);
            let unit = if scaled {
                let size = match *direction {
                    Direction::Parameter(i) => run.p[i],
                    Direction::Start(i) => solution.y(0)[i],
                };
                for value in &mut values {
                    *value *= size;
                }
                Unit { offset: 0.0, ..unit.clone() }
            } else {
                quotient(unit, signature.direction_unit(j))
            };
            let (of, to) = (name.clone(), signature.direction_name(j).into_owned());
            pairs.push(DerivativePair { of, to, scaled, unit, values });
        }
    }
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::request::RunRequest;
    use crate::session::SilentReporter;

    /// Verifies a run's sensitivities, scaled by a factor and shifted by an offset in units of the largest.
    fn verified(factor: f64, off: f64) -> Result<Option<String>, WorkError> {
        let manifest = env!("CARGO_MANIFEST_DIR");
        let [model, data] = ["model.dgd", "good.csv"]
            .map(|file| format!("{manifest}/../../tests/golden/data/{file}"));
        let mut run = RunRequest::new(model);
        run.data = Some(data.into());
        let request = SensitivityRequest::new(run);
        let session = TaskContext::new(&SilentReporter);
        let (loaded, of) = load(&request, session)?;
        let run = ModelRun::prepare(&request.run, loaded, session)?;
        let mut reached = run.simulate_with_sensitivities()?;
        let s = &mut reached.solution.s;
        let largest = s.iter().fold(0.0, |largest: f64, s| largest.max(s.abs()));
        for s in s.iter_mut() {
            *s = factor * *s + off * largest;
        }
        let PartialRun { solution, observations, .. } = reached;
        let compared = compared(&request, &run, &of);
        Ok(verify::against_differences(&run, &solution, &observations, &compared, session)?.wrong())
    }

    #[test]
    fn derivatives_that_are_wrong_are_found() {
        assert!(matches!(verified(1.0, 0.0), Ok(None)));
        for (factor, off) in [(1.01, 0.0), (-1.0, 0.0), (0.0, 0.0), (1.0, 0.01)] {
            let wrong = verified(factor, off);
            assert!(matches!(wrong, Ok(Some(_))), "{factor} {off}: {wrong:?}");
        }
    }
}
