//! Invalid requests.

use std::fmt;
use std::path::PathBuf;

use dgd_compiler::argument::{Argument, ArgumentUse};
use dgd_compiler::sentence;
use dgd_compiler::sentence::Sentence;
use dgd_compiler::units::UnitError;
use dgd_identify::EstimateError;
use dgd_identify::filter::FilterError;
use dgd_identify::regression::RegressionError;
use dgd_runtime::integrate::catalogue::UnknownMethod;
use dgd_runtime::signature::number::short;

use super::{meant, named};
use crate::request::Estimator;

/// The reason why a request is invalid. Values are in declared units.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum UsageError {
    /// An argument does not have its form.
    Form {
        /// The argument as given.
        given: ArgumentUse,
        /// Its form.
        form: &'static str,
        /// A value of that form.
        example: &'static str,
    },
    /// Nothing of this kind has the name.
    Unknown {
        /// The argument that gives the name; `None` for a value of a call.
        given: Option<ArgumentUse>,
        /// What the name should be of.
        kind: &'static str,
        /// The name.
        name: String,
        /// The names that there are.
        known: Vec<String>,
    },
    /// A wrong number of values.
    ValueCount {
        /// Their kind, in the plural.
        what: &'static str,
        /// The number needed.
        needed: usize,
        /// The number given.
        given: usize,
    },
    /// A wrong number of values for the variables of an objective.
    VariableCount {
        /// The number of variables.
        needed: usize,
        /// The number of values.
        given: usize,
    },
    /// Arguments that need another estimator.
    NeedsEstimator {
        /// The arguments.
        given: Vec<ArgumentUse>,
        /// Estimators that take them.
        estimators: &'static [Estimator],
    },
    /// The estimator does not search, so there is nothing to limit.
    NoSearch(Estimator),
    /// The estimator has no profiles.
    NoProfiles(Estimator),
    /// This build lacks the estimator.
    EstimatorNotBuilt(Estimator),
    /// A profile of something that is not estimated.
    NotEstimated {
        /// The name.
        name: String,
        /// The estimates.
        estimated: Vec<String>,
    },
    /// The objective of an estimator that does not simulate.
    ObjectiveNotSimulated,
    /// All parameters are fixed.
    NothingToEstimate,
    /// A prior that is not a residual, for the objective of a fit.
    PriorNotResidual {
        /// The names of its parameters, as in a sentence.
        names: String,
        /// Its density.
        density: &'static str,
    },
    /// A prior that resampling cannot draw from.
    PriorNotDrawn {
        /// The names of its parameters, as in a sentence.
        names: String,
        /// Its density.
        density: &'static str,
    },
    /// A standard deviation is zero, negative, or not a number.
    NoiseNotPositive {
        /// The output.
        output: String,
        /// The value.
        sigma: f64,
    },
    /// Standard deviations of readings, for the objective of a fit.
    ObjectiveWithDeviations,
    /// Outputs without a declared noise, which residuals are weighed by.
    ResidualsWithoutNoise(Vec<String>),
    /// Outputs without a declared noise, which a filter weighs samples by.
    FilterWithoutNoise {
        /// Their names.
        outputs: Vec<String>,
        /// The unit of the first.
        unit: String,
    },
    /// A rate that is not a positive number.
    Rate {
        /// The argument as given.
        given: ArgumentUse,
        /// The unit of the state.
        unit: String,
    },
    /// There are fewer starting points.
    NoSuchStart {
        /// Its number.
        number: u32,
        /// How many there are.
        starts: u32,
    },
    /// A distribution of starting points, of which there is one.
    SpreadOfOne,
    /// Fewer than two models to compare.
    TooFewContenders,
    /// A contender is given twice.
    ContenderTwice(String),
    /// A contender with a sign and nothing after it.
    NothingBehind {
        /// The contender as given.
        text: String,
        /// The sign.
        sign: char,
    },
    /// Points to mark in another unit than the axis.
    MarksOffAxis {
        /// The argument as given.
        given: ArgumentUse,
        /// The first quantity of the points.
        x: String,
        /// Its unit.
        unit: String,
        /// The quantity of the axis.
        over: String,
        /// Its unit.
        axis: String,
    },
    /// Two arrays of different lengths.
    UnequalLengths {
        /// The argument as given.
        given: ArgumentUse,
        /// The arrays with their lengths.
        arrays: [(String, usize); 2],
    },
    /// An ensemble without sets.
    NoSets,
    /// An argument that an ensemble does not take.
    OfSingleRun(ArgumentUse),
    /// A value beyond the bounds of its parameter.
    BeyondBounds {
        /// The parameter.
        name: String,
        /// The value.
        value: f64,
        /// Its unit.
        unit: String,
    },
    /// The last time of a run that ends at an operating point.
    EndOfLinearisation,
    /// An operating point before the run.
    PointBeforeRun {
        /// Its time, s.
        t: f64,
        /// When the run begins, s.
        from: f64,
    },
    /// An operating point with mean inputs, without a recording.
    MeanWithoutData,
    /// An inversion without a recording.
    InversionWithoutData,
    /// An exact equation lacks nothing.
    ExactEquation(String),
    /// Equations of one label in several units.
    SeveralUnits {
        /// The label.
        label: String,
        /// The units.
        units: Vec<String>,
    },
    /// A unit of another dimension.
    OtherDimension {
        /// The unit asked for.
        asked: String,
        /// The label of the equation.
        label: String,
        /// A unit that it has.
        unit: String,
    },
    /// A unit that cannot be read.
    UnreadableUnit {
        /// The unit asked for.
        asked: String,
        /// The cause.
        error: UnitError,
    },
    /// A folder of effects that does not exist.
    NoEffectFolder(PathBuf),
    /// Folders without effects.
    NoEffects,
    /// The library has an effect of this name.
    EffectExists(String),
    /// Several files that could be adopted.
    SeveralToAdopt {
        /// The folder of the result.
        folder: PathBuf,
        /// The files.
        files: Vec<PathBuf>,
    },
    /// A word that cannot be a name.
    NotAName(String),
    /// Fewer than two columns that should measure the same.
    OneName(ArgumentUse),
    /// No recording has both columns.
    NeverTogether([String; 2]),
    /// No sample between the first and the last time.
    NothingBetween {
        /// The file.
        path: PathBuf,
        /// What it lacks: `sample` or `row`.
        what: &'static str,
    },
    /// Initial values from a row that has no output.
    StartNotMeasured,
    /// A standard deviation with a wrong sign.
    Deviation {
        /// The argument as given.
        given: ArgumentUse,
        /// Whether it may be zero.
        takes_zero: bool,
    },
    /// Forgetting in a filter.
    ForgettingInFilter,
    /// Process noise in a recursive estimator.
    ProcessNoiseInRecursion,
    /// A resumed run without the folder of the first.
    ResumeWithoutOut,
    /// An output with a density, for a task that takes one number.
    DensityNotTaken {
        /// The output.
        output: String,
        /// The task.
        task: &'static str,
    },
    /// The noise of an output is more than the argument takes.
    NoiseNotTaken {
        /// The output.
        output: String,
        /// Whether the noise is a column of standard deviations.
        is_column: bool,
        /// The argument.
        by: ArgumentUse,
    },
    /// A recording without the standard deviations that others have.
    NoDeviations {
        /// The file.
        path: PathBuf,
        /// The output.
        output: String,
    },
    /// Equations of a model with delays are not functions of one time.
    ReadsPast(String),
    /// A run of a model with inputs, without a recording.
    NeedsData {
        /// The model.
        model: String,
        /// Its inputs, each with its unit.
        inputs: Vec<String>,
    },
    /// A run without a last time.
    NoEnd,
    /// A run that ends before it begins.
    EndsBeforeBegin {
        /// The last time, s.
        last: f64,
        /// The first time, s.
        first: f64,
    },
    /// More rows than a run can have.
    TooManyRows {
        /// Their distance, s.
        every: f64,
        /// Their number.
        rows: f64,
        /// The largest number.
        most: f64,
    },
    /// No method has the name.
    UnknownMethod(UnknownMethod),
    /// What was to be a model is an effect.
    EffectNotModel(PathBuf),
    /// A result would replace a file that is read.
    Replaces {
        /// The argument that names the result.
        by: ArgumentUse,
        /// The file.
        path: PathBuf,
    },
    /// As many kept sets as there can be.
    TooManyKept(usize),
    /// A fit without a recording.
    FitWithoutData,
    /// The part of the program for discoveries is not there.
    DiscoveryNotLoaded,
    /// An estimate that cannot be made as requested.
    Estimate(EstimateError),
    /// A regression that cannot be made as requested.
    Regression(RegressionError),
    /// A filter that cannot be made as requested.
    Filter(FilterError),
}

/// Estimators that simulate the model.
pub(crate) const SIMULATING: &[Estimator] = &[Estimator::OutputError, Estimator::Linearised];

impl UsageError {
    /// The form of an argument that was given otherwise.
    pub(crate) fn form(
        argument: Argument,
        value: &str,
        form: &'static str,
        example: &'static str,
    ) -> Self {
        UsageError::Form { given: argument.with(value), form, example }
    }

    /// The error in words.
    #[expect(clippy::too_many_lines, reason = "a sentence for each")]
    pub fn sentence(&self) -> Sentence {
        match self {
            Self::Form { given, form, example } => {
                let example = given.argument.with(example);
                sentence![given, format!(" needs the form {form}, as in "), example]
            }
            Self::Unknown { given, kind, name, known } => {
                let known: Vec<&str> = known.iter().map(String::as_str).collect();
                let is_said = given.as_ref().is_some_and(|given| given.value() == Some(name.as_str()));
                let called = if is_said { "so".to_owned() } else { format!("`{name}`") };
                let text = format!("no {kind} is called {called}; {}", meant(name, &known));
                match given {
                    Some(given) => sentence![given, ": ", text],
                    None => text.into(),
                }
            }
            Self::ValueCount { what, needed, given } => {
                format!("the model has {needed} {what}, and {given} are given").into()
            }
            Self::VariableCount { needed, given } => {
                format!("there are {needed} variables, and {given} values are given").into()
            }
            Self::NeedsEstimator { given, estimators } => {
                let mut sentence = Sentence::default();
                for (k, one) in given.iter().enumerate() {
                    sentence.push(if k == 0 { "" } else { " and " });
                    sentence.push(one);
                }
                sentence.push(if given.len() == 1 { " needs " } else { " need " });
                if let [first, others @ ..] = estimators {
                    sentence.push(Argument::Estimator.with(first.name()));
                    for other in others {
                        sentence.push(format!(" or `{}`", other.name()));
                    }
                }
                sentence
            }
            Self::NoSearch(estimator) => sentence![
                Argument::Evaluations,
                " limits a search, and ",
                Argument::Estimator.with(estimator.name()),
                " has none"
            ],
            Self::NoProfiles(estimator) => sentence![
                Argument::Estimator.with(estimator.name()),
                " has no profiles, so ",
                Argument::Profile,
                " cannot be used with it"
            ],
            Self::EstimatorNotBuilt(_) => "this program fits by simulation alone".into(),
            Self::NotEstimated { name, estimated } => sentence![
                Argument::Profile.with(name),
                format!(
                    ": nothing that is called so is estimated; estimated are {}",
                    named(estimated)
                )
            ],
            Self::ObjectiveNotSimulated => sentence![
                "residuals are those of simulated outputs: ",
                Argument::Estimator.with(Estimator::OutputError.name())
            ],
            Self::NothingToEstimate => "nothing is to be estimated: all parameters are fixed".into(),
            Self::PriorNotResidual { names, density } => format!(
                "the prior of {names} is `{density}`, which is not a residual: the objective of a fit takes normal ones"
            )
            .into(),
            Self::PriorNotDrawn { names, density } => sentence![
                format!("the prior of {names} is `{density}`, and "),
                Argument::Bootstrap,
                " draws from normal ones"
            ],
            Self::NoiseNotPositive { output, sigma } => {
                format!("the noise of `{output}` must be above 0: {sigma}").into()
            }
            Self::ObjectiveWithDeviations => {
                "the objective of a fit takes no column of standard deviations: leave out `std(…)`"
                    .into()
            }
            Self::ResidualsWithoutNoise(outputs) => sentence![
                format!(
                    "{} declares no noise, and residuals are weighed by it: say `noise` in the model, give it by ",
                    named(outputs)
                ),
                Argument::Noise,
                ", or leave the output out by ",
                Argument::Outputs
            ],
            Self::FilterWithoutNoise { outputs, unit } => {
                let first = outputs.first().map_or("", String::as_str);
                sentence![
                    format!(
                        "{} declares no noise, and a filter weighs samples by it: say `noise` in the model, give ",
                        named(outputs)
                    ),
                    Argument::Noise.with(format!("{first}=… [{unit}]")),
                    ", or leave it out by ",
                    Argument::Outputs
                ]
            }
            Self::Rate { given, unit } => sentence![
                given,
                format!(": the rate is a positive number, in {unit} per second")
            ],
            Self::NoSuchStart { number, starts } => sentence![
                Argument::StartPoint.with(number),
                " is none of the points of ",
                Argument::Starts.with(starts),
                ", which are counted from 0"
            ],
            Self::SpreadOfOne => sentence![
                Argument::Spread,
                " says what starting points are drawn from, and there is one: add ",
                Argument::Starts.taking("N")
            ],
            Self::TooFewContenders => {
                "a comparison needs two contenders or more: models, or folders of results".into()
            }
            Self::ContenderTwice(name) => format!("`{name}` is there twice").into(),
            Self::NothingBehind { text, sign } => {
                format!("`{text}`: nothing stands behind `{sign}`").into()
            }
            Self::MarksOffAxis { given, x, unit, over, axis } => sentence![
                given,
                format!(
                    ": `{x}` is in {unit}, and the axis of `{over}` in {axis}; mark points whose first quantity is in \
                     {axis}"
                )
            ],
            Self::UnequalLengths { given, arrays: [(one, n_one), (other, n_other)] } => sentence![
                given,
                format!(
                    ": `{one}` has {n_one} elements and `{other}` has {n_other}; take two of one length"
                )
            ],
            Self::NoSets => "an ensemble needs a file of sets".into(),
            Self::OfSingleRun(given) => sentence![given, " is for a single run"],
            Self::BeyondBounds { name, value, unit } => {
                format!("`{name}` cannot be {value} {unit}: it is beyond its bounds").into()
            }
            Self::EndOfLinearisation => sentence![
                "a linearisation does not take ",
                Argument::Until,
                ": its run ends where ",
                Argument::At,
                " says"
            ],
            Self::PointBeforeRun { t, from } => sentence![
                Argument::At.with(t),
                format!(": the run begins at {from} s, so it never gets there")
            ],
            Self::MeanWithoutData => sentence![
                Argument::At.with("mean"),
                " needs the inputs of a recording: give one with ",
                Argument::Data.taking("FILE")
            ],
            Self::InversionWithoutData => sentence![
                "an inversion needs measurements: give a recording with ",
                Argument::Data.taking("FILE")
            ],
            Self::ExactEquation(label) => sentence![
                Argument::For.with(label),
                ": the model declares this equation exact, so that it lacks nothing"
            ],
            Self::SeveralUnits { label, units } => sentence![
                Argument::For.with(label),
                format!(
                    ": equations of this label measure different things, in {}",
                    units.join(" and ")
                )
            ],
            Self::OtherDimension { asked, label, unit } => sentence![
                Argument::Unit.with(asked),
                format!(": what `{label}` lacks is measured in {unit}")
            ],
            Self::UnreadableUnit { asked, error } => {
                sentence![Argument::Unit.with(asked), format!(": {error}")]
            }
            Self::NoEffectFolder(path) => {
                sentence![Argument::Effects.with(path.display()), ": there is no such folder"]
            }
            Self::NoEffects => sentence![
                "there are no effects in the folders of ",
                Argument::Effects,
                ": each is a `.dgd` file"
            ],
            Self::EffectExists(name) => {
                format!("the library has an effect `{name}` already: choose another name").into()
            }
            Self::SeveralToAdopt { folder, files } => {
                let files = files.iter().map(|file| file.display().to_string());
                format!(
                    "there are several files to adopt in `{}`; name one: {}",
                    folder.display(),
                    named(&files.collect::<Vec<_>>())
                )
                .into()
            }
            Self::NotAName(name) => format!(
                "`{name}` is not a name: letters, digits and `_`, a letter first, and not a reserved word"
            )
            .into(),
            Self::OneName(given) => sentence![given, " needs two names or more, with commas"],
            Self::NeverTogether([one, other]) => sentence![
                Argument::Same,
                format!(": no recording has both `{one}` and `{other}`")
            ],
            Self::NothingBetween { path, what } => sentence![
                format!("`{}` has no {what} between ", path.display()),
                Argument::From,
                " and ",
                Argument::Until
            ],
            Self::StartNotMeasured => sentence![
                Argument::Start.with("measured"),
                " needs data with at least one output of the model in its first row"
            ],
            Self::Deviation { given, takes_zero } => {
                let what = if *takes_zero { "0 or more" } else { "above 0" };
                sentence![given, format!(": a standard deviation must be a number, {what}")]
            }
            Self::ForgettingInFilter => sentence![
                Argument::Forgetting,
                " belongs to ",
                Argument::Estimator.with("recursive"),
                "; in a filter, ",
                Argument::ProcessNoise,
                " says how fast parameters may change"
            ],
            Self::ProcessNoiseInRecursion => sentence![
                Argument::ProcessNoise,
                " belongs to `ekf` and `ukf`; in ",
                Argument::Estimator.with("recursive"),
                ", ",
                Argument::Forgetting,
                " says how fast parameters may change"
            ],
            Self::ResumeWithoutOut => sentence![
                Argument::Resume,
                " goes on from what a run with ",
                Argument::Out.taking("DIR"),
                " has kept beside it: give that ",
                Argument::Out
            ],
            Self::DensityNotTaken { output, task } => sentence![
                format!(
                    "the `noise` of `{output}` is more than a number, which {task} does not take: a fit by "
                ),
                Argument::Estimator.with(Estimator::OutputError.name()),
                " does"
            ],
            Self::NoiseNotTaken { output, is_column, by } => {
                let what = if *is_column {
                    format!("`std({output})` is a column")
                } else {
                    format!("the `noise` of `{output}` is more than a number")
                };
                sentence![what, ", which ", by, " does not take"]
            }
            Self::NoDeviations { path, output } => format!(
                "`{}` has no column `std({output})`, which other recordings have: give it to all or none",
                path.display()
            )
            .into(),
            Self::ReadsPast(model) => format!(
                "the model `{model}` reads what was earlier, so its equations are not functions of one time"
            )
            .into(),
            Self::NeedsData { model, inputs } => sentence![
                format!(
                    "model `{model}` has inputs: give a file with the columns `time [s]`, {} by ",
                    named(inputs)
                ),
                Argument::Data.taking("FILE")
            ],
            Self::NoEnd => sentence![
                "how long? give the last time by ",
                Argument::Until.taking("T"),
                ", in s, or a recording by ",
                Argument::Data.taking("FILE")
            ],
            Self::EndsBeforeBegin { last, first } => sentence![
                Argument::Until,
                format!(": the run would end at {last} s, before it begins at {first} s")
            ],
            Self::TooManyRows { every, rows, most } => sentence![
                Argument::Every.with(format!("{every:e}")),
                format!(
                    " asks for {} rows; a run has at most {}",
                    short(*rows, 2),
                    short(*most, 2)
                )
            ],
            Self::UnknownMethod(error) => error.to_string().into(),
            Self::EffectNotModel(path) => {
                format!("`{}` is an effect, not a model", path.display()).into()
            }
            Self::Replaces { by, path } => sentence![
                by,
                format!(
                    " would replace `{}`, which this command reads: give another name",
                    path.display()
                )
            ],
            Self::TooManyKept(most) => {
                format!("{most} sets are kept; let go of one to keep another").into()
            }
            Self::FitWithoutData => "a fit needs a recording of the outputs".into(),
            Self::DiscoveryNotLoaded => "the module for discoveries has not been loaded".into(),
            Self::Estimate(error) => error.to_string().into(),
            Self::Regression(error) => error.to_string().into(),
            Self::Filter(error) => error.to_string().into(),
        }
    }
}

/// With the arguments as a library names them.
impl fmt::Display for UsageError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.sentence().fmt(f)
    }
}

impl std::error::Error for UsageError {}
