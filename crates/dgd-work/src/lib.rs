//! The tasks of dgd, each a function with a typed request and a typed result.
//!
//! ```text
//!   CheckRequest    ─ check ────► Checked        contents of a model, or its mistakes
//!   SimulateRequest ─ simulate ─► Simulated      states and outputs over time
//!                     simulate_each ► Ensemble   the same for many sets of parameters
//!   RunRequest      ─ prepare ──► Prepared       the same again and again, read and compiled once
//!   SensitivityRequest ─ sensitivity ─► Sensitivities
//!   RunRequest      ─ equations ─► Equations     right-hand sides and Jacobians at single points
//!   LinearizeRequest ─ linearize ─► Linearised   A, B, C, D, poles
//!   InvertRequest   ─ invert ───► Missing        missing term of an equation, from measurements
//!   ScreenRequest   ─ screen ───► Screenings     faults of recordings
//!   FitRequest      ─ fit ──────► Fitted         parameters and initial values from recordings
//!                     objective ─► Objective     objective of a fit, for external optimisers
//!   CompareRequest  ─ compare ──► Comparison     fits of several models side by side
//!   TrackRequest    ─ track ────► Tracked        states and parameters row by row, as data comes in
//!   DiscoverRequest ─ discover ─► Discovered     missing terms of a model
//!   AdoptRequest    ─ adopt ────► Adopted        a discovered formula for the library
//! ```
//!
//! A request has a field for each option. With the feature `clap`, it also reads itself from a command line. The caller also passes a
//! [`TaskContext`]: a seed, a number of threads, and a [`Reporter`], which receives remarks and progress and may cancel
//! the task. A result serialises, and its tables, texts, figures and files derive from it alone. A failure is a
//! [`WorkError`] with its class, message, place and advice.
//!
//! Nothing here reads a command line, prints, handles signals or ends a process. Files named in a request are read from
//! disk or from an [`InMemory`](dgd_data::InMemory); the caller writes the results.
//!
//! ```
//! use dgd_data::InMemory;
//! use dgd_work::{FitRequest, SilentReporter, TaskContext, fit};
//!
//! let files = InMemory::default()
//!     .with_file("cooling.dgd", "model cooling\n\
//!         parameter tau [s] = 100 in 1 .. 1e4\n\
//!         state T [K] = 80\n\
//!         equation cooling: tau*der(T) = -T\n\
//!         output T [K] noise 0.1\n")
//!     .with_file("cup.csv", "time [s],T [K]\n0,80.1\n50,53.2\n100,36.1\n200,16.0\n300,7.1\n");
//! let context = TaskContext::new(&SilentReporter).with_files(&files);
//! let fitted = fit(&FitRequest::new("cooling.dgd", vec!["cup.csv".into()]), context)?;
//! assert!((fitted.estimates[0].value - 124.5).abs() < 1.0);
//! # Ok::<(), dgd_work::WorkError>(())
//! ```

pub mod check;
pub mod discover;
mod error;
pub mod fit;
pub mod linearize;
mod model;
mod output;
mod request;
mod run;
pub mod screen;
pub mod sensitivity;
mod session;
pub mod simulate;
#[cfg(test)]
mod tests;
pub mod track;

pub use check::{CheckedModel, check};
pub use dgd_compiler::argument::{Argument, ArgumentUse, ArgumentValue, Spelling, neutral};
pub use dgd_compiler::sentence;
pub use dgd_compiler::sentence::Sentence;
pub use discover::invert::{self, InvertedReport, TwinInput, invert};
pub use discover::{AdoptedFile, DiscoveryResult, adopt, discover};
pub use error::{
    ComputationError, Interruption, Mistake, MistakeClass, OutputPart, TaskEnd, TextCorrection,
    TextSpot, UnusableFile, UsageError, WorkError, meant,
};
pub use fit::compare::{self, FitComparison, compare};
pub use fit::objective::{Objective, objective};
pub use fit::{FitFigure, FitResult, fit};
pub use linearize::{LinearModelReport, linearize};
pub use model::effects::{ApplicableEffect, FOLDER, applicable, load_folder};
pub use model::{ChangedTrees, LoadedModel, digest_of_texts, load};
pub use output::columns::{ColumnKind, NamedColumn, TimeTable};
pub use output::provenance::{DataFile, Provenance, SCHEMA_VERSION};
pub use output::quantity::{shown, shown_like, with_unit};
pub use output::{json_text, result};
pub use request::{
    AdoptRequest, CheckRequest, CompareRequest, DiscoverRequest, Engine, Estimator, FitRequest,
    FreeParameters, IntervalRequest, InvertRequest, JournalChoice, LinearizeAt, LinearizeRequest,
    ModelChoices, NoiseFrom, RegressionRequest, RunRequest, ScreenRequest, SearchRequest,
    SensitivityRequest, SimulateRequest, SolverOptions, StartChoice, TrackRequest, TrackerKind,
    values,
};
pub use run::MeasuredOutputs;
pub use run::equations::{EquationPoint, ModelEquations, equations};
pub use screen::{ScreeningResults, screen};
pub use sensitivity::{Sensitivities, sensitivity};
pub use session::{Remark, Remarks, Reporter, SilentReporter, TaskContext};
pub use simulate::{
    EnsembleRuns, PreparedRun, SimulationResult, SpaceTimeField, Sweep, prepare, simulate,
    simulate_each,
};
pub use track::{LineFormat, TrackingResult, track};
