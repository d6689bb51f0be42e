//! The context of a task: seed, threads, files, and the listener for remarks and progress.

use std::sync::Mutex;

use dgd_compiler::argument::{Spelling, neutral};
use dgd_compiler::diagnostics::{Diagnostic, render};
use dgd_compiler::sentence::Sentence;
use dgd_compiler::source::SourceMap;
use dgd_data::{DiskFiles, FileSystem};
use dgd_identify::{Monitor, Progress, Total};

use crate::error::WorkError;

/// Receives remarks and progress of a task, and may cancel it.
///
/// Remarks are notes in addition to the result. [`Monitor`] receives the progress of long computations and stops them
/// at their best so far.
pub trait Reporter: Monitor {
    /// Receives a remark as soon as it arises.
    fn remark(&self, remark: Remark<'_>);

    /// Whether remarks are used; some take work.
    fn hears_remarks(&self) -> bool {
        true
    }

    /// How its users give arguments, for sentences that name them.
    fn spelling(&self) -> Spelling {
        neutral
    }

    /// Whether progress within a single run is used; reporting it takes a second thread.
    fn hears_progress(&self) -> bool {
        self.watched().is_some()
    }

    /// Called after all files have been read, before anything is computed.
    ///
    /// # Errors
    ///
    /// The reason not to continue, such as a result that would replace one of these files.
    fn has_read(&self, _sources: &SourceMap) -> Result<(), WorkError> {
        Ok(())
    }

    /// Called when a long computation begins; `is_kept` if it has a journal from which it can be resumed.
    fn begins(&self, _is_kept: bool) {}

    /// Called when the long computation has ended, before the result is made.
    fn ends(&self) {}
}

/// A note about a task that is not part of its result.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub enum Remark<'a> {
    /// A sentence.
    Words(&'a str),
    /// A diagnostic that is not a mistake, and the sources that its spans refer to.
    Diagnostic(&'a Diagnostic, &'a SourceMap),
}

impl Remark<'_> {
    /// As text without colours, with the arguments as a face writes them.
    pub fn to_text(&self, spelling: Spelling) -> String {
        match self {
            Remark::Words(words) => (*words).to_owned(),
            Remark::Diagnostic(diagnostic, sources) => {
                let text =
                    render::render_note(diagnostic, sources, render::RenderStyle::Plain, spelling);
                text.trim_end().to_owned()
            }
        }
    }
}

/// Ignores everything and never cancels.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SilentReporter;

impl Monitor for SilentReporter {
    fn advanced(&self, _progress: Progress) {}

    fn is_stopped(&self) -> bool {
        false
    }
}

impl Reporter for SilentReporter {
    fn remark(&self, _remark: Remark<'_>) {}

    fn hears_remarks(&self) -> bool {
        false
    }
}

/// Collects remarks and never cancels.
#[derive(Debug)]
pub struct Remarks {
    all: Mutex<Vec<String>>,
    spelling: Spelling,
}

impl Remarks {
    /// Collects remarks with the arguments as a face writes them.
    pub fn new(spelling: Spelling) -> Self {
        Remarks { all: Mutex::default(), spelling }
    }

    /// The remarks so far.
    pub fn all(&self) -> Vec<String> {
        self.all.lock().map(|all| all.clone()).unwrap_or_default()
    }
}

impl Monitor for Remarks {
    fn advanced(&self, _progress: Progress) {}

    fn is_stopped(&self) -> bool {
        false
    }
}

impl Reporter for Remarks {
    fn remark(&self, remark: Remark<'_>) {
        if let Ok(mut all) = self.all.lock() {
            all.push(remark.to_text(self.spelling));
        }
    }

    fn spelling(&self) -> Spelling {
        self.spelling
    }
}

/// The context of a task.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct TaskContext<'a> {
    /// Seed of everything random: equal requests and seeds give equal results.
    pub seed: u64,
    /// Threads for tasks with many simulations; results do not depend on their number.
    pub threads: usize,
    /// Receives remarks and progress.
    pub listener: &'a dyn Reporter,
    /// Source of models, effects and recordings.
    pub files: &'a dyn FileSystem,
}

impl<'a> TaskContext<'a> {
    /// Seed 0, all processors, files on disk, and this listener.
    pub fn new(listener: &'a dyn Reporter) -> Self {
        let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        TaskContext { seed: 0, threads, listener, files: &DiskFiles }
    }

    /// The same session with another seed.
    #[must_use]
    pub fn with_seed(self, seed: u64) -> Self {
        TaskContext { seed, ..self }
    }

    /// The same session with this number of threads.
    #[must_use]
    pub fn with_threads(self, threads: usize) -> Self {
        TaskContext { threads, ..self }
    }

    /// The same session with other files.
    #[must_use]
    pub fn with_files(self, files: &'a dyn FileSystem) -> Self {
        TaskContext { files, ..self }
    }

    /// Sends a remark.
    pub fn remark(self, words: impl Into<Sentence>) {
        self.listener.remark(Remark::Words(&words.into().spelled(self.spelling())));
    }

    /// How the users of this task give arguments.
    pub fn spelling(self) -> Spelling {
        self.listener.spelling()
    }

    /// Reports progress.
    pub(crate) fn advanced(self, what: &'static str, done: usize, of: Total) {
        self.listener.advanced(Progress { what, done, of });
    }

    /// Sends a diagnostic that is not a mistake.
    pub fn note(self, diagnostic: &Diagnostic, sources: &SourceMap) {
        self.listener.remark(Remark::Diagnostic(diagnostic, sources));
    }

    /// Calls [`Reporter::has_read`].
    ///
    /// # Errors
    ///
    /// The listener's reason not to continue.
    pub fn spare(self, sources: &SourceMap) -> Result<(), WorkError> {
        self.listener.has_read(sources)
    }
}
