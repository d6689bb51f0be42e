//! The state that requests and threads share.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use dgd_data::DiskFiles;
use dgd_work::RunRequest;
use tokio::sync::{Semaphore, watch};

use super::limits;
use crate::ask::PageRequest;
use crate::bench::ModelBench;
use crate::stop::StopHandle;

/// State shared by requests and threads.
pub(super) struct ServerState {
    bench: Mutex<ModelBench>,
    pub(super) model: PathBuf,
    /// The files of the last answer.
    files: Mutex<Vec<PathBuf>>,
    /// Incremented on every change of a file.
    pub(super) changes: watch::Sender<u64>,
    stop: StopHandle,
    /// A permit for each page that may still listen for changes.
    pub(super) listening: Arc<Semaphore>,
    /// The request that is being answered.
    current: Mutex<Option<u64>>,
    /// Number of requests so far.
    pub(super) count: AtomicU64,
    pub(super) assets: Vec<(&'static str, String)>,
}

impl ServerState {
    pub(super) fn new(request: RunRequest) -> ServerState {
        let mut assets = crate::assets();
        assets.push(("index.html", include_str!("../../assets/watch.html").to_owned()));
        assets.push(("watch.js", include_str!("../../assets/watch.js").to_owned()));
        assets.push(("icon.svg", include_str!("../../assets/icon.svg").to_owned()));
        let model = request.model.clone();
        let bench = ModelBench::new(request);
        let stop = bench.stop();
        let files = Mutex::new(bench.files());
        let (changes, _) = watch::channel(0);
        ServerState {
            bench: Mutex::new(bench),
            model,
            files,
            changes,
            stop,
            listening: Arc::new(Semaphore::new(limits::LISTENING)),
            current: Mutex::new(None),
            count: AtomicU64::new(0),
            assets,
        }
    }

    pub(super) fn bench(&self) -> MutexGuard<'_, ModelBench> {
        self.bench.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Handles a changed file: abandons the current run, and makes files be read again.
    pub(super) fn changed(&self) {
        self.give_up(|_| true);
        self.bench().forget();
        self.changes.send_modify(|count| *count += 1);
    }

    fn current(&self) -> MutexGuard<'_, Option<u64>> {
        self.current.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Stops the request that is being answered, if `is_meant` holds.
    pub(super) fn give_up(&self, is_meant: impl Fn(u64) -> bool) {
        if self.current().is_some_and(is_meant) {
            self.stop.stop();
        }
    }

    /// Answers one request after another, except those whose page is gone.
    pub(super) fn answer(&self, number: u64, ask: &PageRequest, is_gone: &AtomicBool) -> String {
        let mut bench = self.bench();
        {
            let mut current = self.current();
            if is_gone.load(Ordering::SeqCst) {
                return String::new();
            }
            self.stop.reset();
            *current = Some(number);
        }
        let answer = bench.answer(ask, &DiskFiles);
        *self.current() = None;
        let mut files = self.watched();
        files.extend(bench.files());
        // A folder changes when a file is added or removed.
        files.extend(Some(effects_of(&self.model)).filter(|folder| folder.is_dir()));
        files.sort();
        files.dedup();
        answer
    }

    pub(super) fn watched(&self) -> MutexGuard<'_, Vec<PathBuf>> {
        self.files.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The folder of a model's effects.
fn effects_of(model: &Path) -> PathBuf {
    model.with_file_name("effects")
}
