//! The work of dgd, each piece a function: a typed request in, a typed result out.
//!
//! ```text
//!   CheckRequest    ─ check ────► Checked        what is in a model
//!   SimulateRequest ─ simulate ─► Simulated      states and outputs over time
//!                     simulate_each ► Ensemble   the same for many sets of parameters
//!   SensitivityRequest ─ sensitivity ─► Sensitivities
//!   LinearizeRequest ─ linearize ─► Linearised   A, B, C, D, poles
//!   ScreenRequest   ─ screen ───► Screenings     what is wrong with recordings
//!   FitRequest      ─ fit ──────► Fitted         parameters and start values from recordings
//!   TrackRequest    ─ track ────► Tracked        the same row by row, as data comes in
//!   DiscoverRequest ─ discover ─► Discovered     what a model lacks
//! ```
//!
//! A request has a field for each option, with the defaults of the command line. Whoever asks gives a [`Session`]
//! besides: a seed, a number of threads, and a [`Listener`], who hears remarks and progress as they arise and may stop
//! the work. A result serialises, and its tables, texts, figures and files are made of it
//! alone. What is wrong is a [`WorkError`]: what, where, what helps, and which class of mistake it is.
//!
//! Nothing here reads a command line, prints, handles signals or ends a process. Files are read where a request names
//! them; results are written by whoever asked.
//!

pub mod check;
pub mod discover;
mod error;
pub mod fit;
pub mod linearize;
#[doc(hidden)]
pub mod model;
#[doc(hidden)]
pub mod output;
mod request;
#[doc(hidden)]
pub mod run;
pub mod screen;
pub mod sensitivity;
mod session;
pub mod simulate;
pub mod track;

pub use check::{Checked, check};
pub use discover::{Discovered, discover};
pub use error::{Class, Ended, Mistake, Spot, WorkError, meant};
pub use fit::{FitFigure, Fitted, fit};
pub use linearize::{Linearised, linearize};
pub use output::provenance::{DataFile, Provenance};
pub use request::{
    CheckRequest, Choices, DiscoverRequest, Engine, Estimator, FitRequest, IntervalRequest, Keep,
    LinearizeAt, LinearizeRequest, NoiseFrom, Normalise, RegressionRequest, RunRequest,
    ScreenRequest, SearchRequest, SensitivityRequest, SimulateRequest, Solve, Sought, Start,
    TrackRequest, Tracker,
};
pub use screen::{Screenings, screen};
pub use sensitivity::{Sensitivities, sensitivity};
pub use session::{Listener, Remark, Remarks, Session, Silent};
pub use simulate::{Ensemble, Simulated, simulate, simulate_each};
pub use track::{LineFormat, Tracked, track};
