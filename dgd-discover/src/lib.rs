//! Where a model and measurements disagree, and which known effect is missing.

mod discovery;
mod windows;

pub use discovery::{
    Alternative, Discovery, Evidence, FoundEffect, Gap, MissingInput, OutputTrace, ParameterValue,
    Ranked, RecordingTrace, Screened, Unexplained, Verdict,
};
pub use windows::Window;
