//! On-line estimates: a thread tracks rows like `dgd track` on a pipe, one row in, one row out.

use std::io::{self, Read, Write};
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use dgd_data::{DiskFiles, InMemory, LayeredFiles};
use dgd_work::{LineFormat, TaskContext, TrackRequest, track};
use pyo3::prelude::*;

use crate::errors::{self, RequestedTask};
use crate::guard::{self, CaughtPanic};
use crate::observer::PyObserver;

/// Lines from Python, read as they arrive.
struct PyLines {
    lines: Receiver<Vec<u8>>,
    current: io::Cursor<Vec<u8>>,
}

impl Read for PyLines {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        loop {
            match self.current.read(into)? {
                0 if !into.is_empty() => match self.lines.recv() {
                    Ok(line) => self.current = io::Cursor::new(line),
                    // The sender is gone.
                    Err(_) => return Ok(0),
                },
                n => return Ok(n),
            }
        }
    }
}

/// Lines for Python, sent when they are complete.
struct PyAnswers {
    to: Sender<TrackerMessage>,
    line: Vec<u8>,
}

impl Write for PyAnswers {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        for byte in bytes {
            if *byte == b'\n' {
                let line = String::from_utf8_lossy(&self.line).into_owned();
                self.line.clear();
                let gone = |_| io::Error::from(io::ErrorKind::BrokenPipe);
                self.to.send(TrackerMessage::Line(line)).map_err(gone)?;
            } else {
                self.line.push(*byte);
            }
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A message from the thread.
enum TrackerMessage {
    Line(String),
    Ended(CaughtPanic<Vec<String>>),
}

/// Both ends of the channels of a tracking thread.
struct ChannelEnds {
    to: Sender<Vec<u8>>,
    from: Receiver<TrackerMessage>,
}

/// Estimates row by row.
#[pyclass(frozen, name = "Tracker", module = "dgd._dgd")]
pub(crate) struct PyTracker {
    ends: Mutex<Option<ChannelEnds>>,
    observer: Arc<PyObserver>,
}

impl PyTracker {
    /// Starts the thread; the first line is the header.
    pub(crate) fn new(request: TrackRequest, texts: InMemory) -> Self {
        let (to, lines) = mpsc::channel();
        let (answers, from) = mpsc::channel();
        let observer = Arc::new(PyObserver::new(None));
        let for_thread = Arc::clone(&observer);
        thread::spawn(move || {
            let mut out = PyAnswers { to: answers.clone(), line: Vec::new() };
            let ended = guard::caught(|| {
                let files = LayeredFiles { above: &texts, below: &DiskFiles };
                let session = TaskContext::new(&*for_thread).with_files(&files);
                let lines = Box::new(PyLines { lines, current: io::Cursor::default() });
                let tracked = track(&request, Some(lines), session, &mut out, LineFormat::Lines)?;
                tracked.stopped.map_or(Ok(tracked.remarks), Err)
            });
            let _ = answers.send(TrackerMessage::Ended(ended));
        });
        PyTracker { ends: Mutex::new(Some(ChannelEnds { to, from })), observer }
    }
}

#[pymethods]
impl PyTracker {
    /// Sends the text of one row and receives `lines` lines.
    fn exchange(&self, py: Python<'_>, text: Vec<u8>, lines: usize) -> PyResult<Vec<String>> {
        let mut ended = None;
        let answers = py.detach(|| {
            let mut ends = self.ends.lock().unwrap_or_else(PoisonError::into_inner);
            let Some(ChannelEnds { to, from }) = &*ends else { return None };
            // A thread that has ended reports the reason below.
            let _ = to.send(text);
            let mut answers = Vec::with_capacity(lines);
            while answers.len() < lines {
                match from.recv() {
                    Ok(TrackerMessage::Line(line)) => answers.push(line),
                    Ok(TrackerMessage::Ended(why)) => {
                        ended = Some(why);
                        *ends = None;
                        break;
                    }
                    Err(_) => break,
                }
            }
            Some(answers)
        });
        if let Some(why) = ended {
            guard::ended(py, RequestedTask::Simulate, why)?;
        }
        answers
            .filter(|answers| answers.len() == lines)
            .ok_or_else(|| errors::usage(py, "this tracker has ended; begin another one"))
    }

    /// Ends it; returns the summary of all rows.
    fn close(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        let ended = py.detach(|| {
            let ends = self.ends.lock().unwrap_or_else(PoisonError::into_inner).take()?;
            let ChannelEnds { to, from } = ends;
            drop(to);
            from.iter().find_map(|answer| match answer {
                TrackerMessage::Ended(ended) => Some(ended),
                TrackerMessage::Line(_) => None,
            })
        });
        ended.map_or_else(
            || Ok(Vec::new()),
            |ended| guard::ended(py, RequestedTask::Simulate, ended),
        )
    }

    #[getter]
    fn remarks(&self) -> Vec<String> {
        self.observer.remarks()
    }
}
