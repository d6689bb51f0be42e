//! Progress of a long computation on the terminal, and its reaction to Ctrl-C.

use std::io::{self, IsTerminal, Write};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use dgd_compiler::source::SourceMap;
use dgd_identify::{Monitor, Progress, Total};
use dgd_runtime::RunMonitor;
use dgd_work::{Remark, Reporter, Spelling, TaskContext, WorkError};

use crate::console::Console;
use crate::interrupt::{self, on_interrupt};

/// Shortest interval between updates of the line.
const BETWEEN: Duration = Duration::from_millis(100);

/// Elapsed time before the remaining time is estimated.
const TOO_SOON: Duration = Duration::from_secs(1);

/// Longest line in characters, so that it fits any terminal.
const WIDTH: usize = 79;

/// Message for a search that Ctrl-C stops.
pub(crate) const BEST_SO_FAR: &str = "stopping at the best so far";

/// Message for a run that Ctrl-C stops.
pub(crate) const ROWS_SO_FAR: &str = "stopping; the rows so far are kept";

/// Message for a computation without partial results.
pub(crate) const NOTHING: fn(bool) -> &'static str = |_| "stopped by Ctrl-C: there is no result";

/// Shows the progress of a computation on a terminal, and handles its cancellation.
#[derive(Debug)]
pub(crate) struct ProgressDisplay<'a> {
    console: Console<'a>,
    interrupt: InterruptPolicy,
    shared: Arc<ProgressState>,
}

/// Action of Ctrl-C once the computation has begun.
#[derive(Debug, Clone, Copy)]
pub(crate) enum InterruptPolicy {
    /// The first one requests a stop, with this message; the second ends the program.
    Stops(&'static str),
    /// It ends the program with a message that depends on whether there is a journal.
    Ends(fn(bool) -> &'static str),
}

/// Cancel flag of the runs of this process, which executes a single command line.
static RUNS: RunMonitor = RunMonitor::new();

#[derive(Debug)]
struct ProgressState {
    /// Whether results are being written, when ending would leave them incomplete.
    is_writing: Mutex<bool>,
    /// `None` if progress is not shown.
    line: Option<Mutex<ProgressLine>>,
}

impl<'a> ProgressDisplay<'a> {
    /// For a computation that Ctrl-C stops or ends.
    pub(crate) fn new(console: Console<'a>, interrupt: InterruptPolicy) -> Self {
        let for_a_program = console.is_json() && !io::stdout().is_terminal();
        let is_seen = io::stderr().is_terminal() && !console.is_quiet() && !for_a_program;
        let line = is_seen.then(|| Mutex::new(ProgressLine::new(Instant::now())));
        let shared = Arc::new(ProgressState { is_writing: Mutex::new(false), line });
        Self { console, interrupt, shared }
    }

    /// The session with this display as listener.
    pub(crate) fn session(&self) -> TaskContext<'_> {
        TaskContext::new(self).with_seed(self.console.seed()).with_threads(self.console.threads())
    }
}

impl Monitor for ProgressDisplay<'_> {
    fn advanced(&self, progress: Progress) {
        // If another thread is drawing, this update is skipped.
        if let Some(line) = &self.shared.line
            && let Ok(mut line) = line.try_lock()
            && let Some(text) = line.advanced(progress, Instant::now())
        {
            draw(&text);
        }
    }

    fn is_stopped(&self) -> bool {
        RUNS.is_stopped()
    }

    fn watched(&self) -> Option<&'static RunMonitor> {
        Some(&RUNS)
    }
}

impl Reporter for ProgressDisplay<'_> {
    fn remark(&self, remark: Remark<'_>) {
        Reporter::remark(&self.console, remark);
    }

    fn spelling(&self) -> Spelling {
        self.console.spelling()
    }

    fn hears_remarks(&self) -> bool {
        self.console.hears_remarks()
    }

    fn has_read(&self, sources: &SourceMap) -> Result<(), WorkError> {
        self.console.has_read(sources)
    }

    /// Activates the action of Ctrl-C.
    fn begins(&self, is_kept: bool) {
        if let Some(line) = &self.shared.line
            && let Ok(mut line) = line.lock()
        {
            *line = ProgressLine::new(Instant::now());
        }
        let (shared, is_quiet) = (Arc::clone(&self.shared), self.console.is_quiet());
        match self.interrupt {
            InterruptPolicy::Stops(words) => on_interrupt(move || {
                if RUNS.stop() {
                    shared.end("");
                } else if !is_quiet {
                    shared.say(&format!("{words}; Ctrl-C once more ends at once\n"));
                }
            }),
            InterruptPolicy::Ends(words) => {
                let words = format!("{}\n", words(is_kept));
                on_interrupt(move || shared.end(&words));
            }
        }
    }

    /// Clears the line at the end of the computation, and prevents Ctrl-C from interrupting the writing of results.
    fn ends(&self) {
        if let Ok(mut is_writing) = self.shared.is_writing.lock() {
            *is_writing = true;
        }
        self.shared.clear();
    }
}

impl Drop for ProgressDisplay<'_> {
    fn drop(&mut self) {
        self.shared.clear();
    }
}

impl ProgressState {
    fn clear(&self) {
        if let Some(line) = &self.line
            && let Ok(mut line) = line.lock()
        {
            draw(&line.cleared());
        }
    }

    fn say(&self, words: &str) {
        self.clear();
        draw(words);
    }

    /// Ends the program, unless it is writing.
    fn end(&self, words: &str) {
        // The lock is held to the end, so that writing cannot begin.
        if let Ok(is_writing) = self.is_writing.lock()
            && !*is_writing
        {
            self.say(words);
            interrupt::end();
        }
    }
}

/// Draws on the terminal; a failure cannot be reported anywhere.
fn draw(text: &str) {
    let mut terminal = io::stderr().lock();
    let _ = terminal.write_all(text.as_bytes()).and_then(|()| terminal.flush());
}

/// The progress line of a terminal.
#[derive(Debug)]
struct ProgressLine {
    /// The current count, and its start time.
    what: &'static str,
    since: Instant,
    done: usize,
    drawn: Option<Instant>,
    /// Number of characters drawn.
    width: usize,
}

impl ProgressLine {
    fn new(now: Instant) -> Self {
        Self { what: "", since: now, done: 0, drawn: None, width: 0 }
    }

    /// The text to draw, if an update is due.
    fn advanced(&mut self, progress: Progress, now: Instant) -> Option<String> {
        if progress.what != self.what || progress.done < self.done {
            // A new count starts when the previous one ends.
            let began = if self.what.is_empty() { self.since } else { now };
            *self = Self { what: progress.what, since: began, ..*self };
        }
        self.done = progress.done;
        if self.drawn.is_some_and(|drawn| now < drawn + BETWEEN) {
            return None;
        }
        let text: String = words(progress, now - self.since).chars().take(WIDTH).collect();
        let width = text.chars().count();
        let padding = " ".repeat(self.width.saturating_sub(width));
        (self.drawn, self.width) = (Some(now), width);
        Some(format!("\r{text}{padding}"))
    }

    /// The text that erases the line.
    fn cleared(&mut self) -> String {
        let width = std::mem::take(&mut self.width);
        if width == 0 { String::new() } else { format!("\r{}\r", " ".repeat(width)) }
    }
}

fn words(progress: Progress, elapsed: Duration) -> String {
    let Progress { what, done, of } = progress;
    let (all, at_most) = match of {
        Total::Exactly(all) => (all, ""),
        Total::AtMost(all) => (all, "at most "),
    };
    let mut text = format!("{what}: {done} of {at_most}{all}, {} so far", clock(elapsed));
    if elapsed >= TOO_SOON && done > 0 && done < all {
        let left = elapsed.mul_f64((all - done) as f64 / done as f64);
        let about = if at_most.is_empty() { "about " } else { at_most };
        text.extend([", ", about, &clock(left), " left"]);
    }
    text
}

/// Minutes and seconds, with hours if there are any.
fn clock(time: Duration) -> String {
    let seconds = time.as_secs();
    let (hours, minutes, seconds) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
    if hours > 0 {
        format!("{hours}:{minutes:02}:{seconds:02}")
    } else {
        format!("{minutes}:{seconds:02}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_says_what_how_many_and_how_long() {
        let start = Instant::now();
        let instant = |seconds: u64| start + Duration::from_secs(seconds);
        let mut line = ProgressLine::new(start);
        let mut text_after = |what, done, of, seconds| {
            line.advanced(Progress { what, done, of }, instant(seconds))
                .map(|text| text.trim().to_owned())
        };
        let total = Total::AtMost(200);
        let first = text_after("simulations", 1, total, 0);
        assert_eq!(first.as_deref(), Some("simulations: 1 of at most 200, 0:00 so far"));
        assert_eq!(
            text_after("simulations", 2, total, 0),
            None,
            "twice within a tenth of a second"
        );
        assert_eq!(
            text_after("simulations", 50, total, 30).as_deref(),
            Some("simulations: 50 of at most 200, 0:30 so far, at most 1:30 left")
        );
        // Another count has its own time, and so has the same one when it restarts.
        let total = Total::Exactly(3);
        text_after("profiles", 1, total, 40);
        let second = text_after("profiles", 2, total, 4050);
        assert_eq!(second.as_deref(), Some("profiles: 2 of 3, 1:06:50 so far, about 33:25 left"));
        assert_eq!(
            text_after("profiles", 1, total, 5000).as_deref(),
            Some("profiles: 1 of 3, 0:00 so far")
        );
    }

    #[test]
    fn nothing_of_a_longer_line_stays() {
        let start = Instant::now();
        let mut line = ProgressLine::new(start);
        let progress = |done, all| Progress { what: "starts", done, of: Total::Exactly(all) };
        let long = line.advanced(progress(100_000, 100_000), start).expect("the first is drawn");
        let short = line.advanced(progress(1, 2), start + BETWEEN).expect("it is time");
        assert_eq!(short.chars().count(), long.chars().count());
        let cleared = line.cleared();
        assert!(cleared.trim().is_empty() && cleared.starts_with('\r') && cleared.ends_with('\r'));
        assert_eq!(line.cleared(), "", "nothing is there any more");
    }
}
