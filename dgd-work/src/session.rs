//! Who asks for a piece of work: what is random, how many threads, which files there are, and who hears of it.

use std::sync::Mutex;

use dgd_compiler::diagnostics::{Diagnostic, render};
use dgd_compiler::source::Sources;
use dgd_data::{Disk, FileSystem};
use dgd_identify::{Of, Progress, Watch};

use crate::error::WorkError;

/// Hears of a piece of work while it is done, and may stop it.
///
/// Remarks are what is worth knowing besides the result. [`Watch`] has the progress of long computations and stops
/// them at their best so far.
pub trait Listener: Watch {
    /// Takes a remark, as soon as it arises.
    fn remark(&self, remark: Remark<'_>);

    /// Whether remarks are heard: some take work.
    fn hears_remarks(&self) -> bool {
        true
    }

    /// Whether progress within a single run is heard: telling it takes a second thread.
    fn hears_progress(&self) -> bool {
        self.watched().is_some()
    }

    /// All files have been read, before anything is computed.
    ///
    /// # Errors
    ///
    /// Why it must not go on, such as a result that would replace one of these files.
    fn has_read(&self, _sources: &Sources) -> Result<(), WorkError> {
        Ok(())
    }

    /// A long computation begins; whether what it finishes is kept for another that goes on.
    fn begins(&self, _is_kept: bool) {}

    /// The long computation is over: only the result is still made.
    fn ends(&self) {}
}

/// Something about a piece of work that is not its result.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub enum Remark<'a> {
    /// A sentence.
    Words(&'a str),
    /// A diagnostic that is not a mistake, and the texts that it points into.
    Diagnostic(&'a Diagnostic, &'a Sources),
}

impl Remark<'_> {
    /// As people read it, without colours.
    pub fn to_text(&self) -> String {
        match self {
            Remark::Words(words) => (*words).to_owned(),
            Remark::Diagnostic(diagnostic, sources) => {
                let text = render::render_note(diagnostic, sources, render::Style::Plain);
                text.trim_end().to_owned()
            }
        }
    }
}

/// Hears nothing and stops nothing.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Silent;

impl Watch for Silent {
    fn advanced(&self, _progress: Progress) {}

    fn is_stopped(&self) -> bool {
        false
    }
}

impl Listener for Silent {
    fn remark(&self, _remark: Remark<'_>) {}

    fn hears_remarks(&self) -> bool {
        false
    }
}

/// Collects remarks, and stops nothing.
#[derive(Debug, Default)]
pub struct Remarks {
    all: Mutex<Vec<String>>,
}

impl Remarks {
    /// What was remarked so far.
    pub fn all(&self) -> Vec<String> {
        self.all.lock().map(|all| all.clone()).unwrap_or_default()
    }
}

impl Watch for Remarks {
    fn advanced(&self, _progress: Progress) {}

    fn is_stopped(&self) -> bool {
        false
    }
}

impl Listener for Remarks {
    fn remark(&self, remark: Remark<'_>) {
        if let Ok(mut all) = self.all.lock() {
            all.push(remark.to_text());
        }
    }
}

/// Who asks for a piece of work.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct Session<'a> {
    /// Seed of everything random: equal requests and seeds give equal results.
    pub seed: u64,
    /// Threads for what runs many simulations; no result depends on them.
    pub threads: usize,
    /// Who hears of it.
    pub listener: &'a dyn Listener,
    /// Where requests' models, effects and recordings are read from.
    pub files: &'a dyn FileSystem,
}

impl<'a> Session<'a> {
    /// With seed 0, all processors, the files of this machine, and this listener.
    pub fn new(listener: &'a dyn Listener) -> Self {
        let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        Session { seed: 0, threads, listener, files: &Disk }
    }

    /// The same with another seed.
    #[must_use]
    pub fn with_seed(self, seed: u64) -> Self {
        Session { seed, ..self }
    }

    /// The same with so many threads.
    #[must_use]
    pub fn with_threads(self, threads: usize) -> Self {
        Session { threads, ..self }
    }

    /// The same with other files.
    #[must_use]
    pub fn with_files(self, files: &'a dyn FileSystem) -> Self {
        Session { files, ..self }
    }

    /// Says something.
    pub fn remark(self, words: &str) {
        self.listener.remark(Remark::Words(words));
    }

    /// So much is done.
    pub(crate) fn advanced(self, what: &'static str, done: usize, of: Of) {
        self.listener.advanced(Progress { what, done, of });
    }

    /// Shows a diagnostic that is not a mistake.
    pub fn note(self, diagnostic: &Diagnostic, sources: &Sources) {
        self.listener.remark(Remark::Diagnostic(diagnostic, sources));
    }

    /// All files have been read.
    ///
    /// # Errors
    ///
    /// Why the listener does not let it go on.
    pub fn spare(self, sources: &Sources) -> Result<(), WorkError> {
        self.listener.has_read(sources)
    }
}
