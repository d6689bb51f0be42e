//! What a person sees of a long computation, and what Ctrl-C does to it.

use std::io::{self, IsTerminal, Write};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use dgd_compiler::source::Sources;
use dgd_identify::{Of, Progress, Watch};
use dgd_runtime::Watched;
use dgd_work::{Listener, Remark, Session, WorkError};

use crate::console::Console;
use crate::interrupt::{self, on_interrupt};

/// The line is drawn no more often than this.
const BETWEEN: Duration = Duration::from_millis(100);

/// Nothing is said of the time that is left before so much has gone by.
const TOO_SOON: Duration = Duration::from_secs(1);

/// Longest line, in characters: what a terminal has at least.
const WIDTH: usize = 79;

/// What becomes of a search that Ctrl-C stops.
pub(crate) const BEST_SO_FAR: &str = "stopping at the best so far";

/// What becomes of a run that Ctrl-C stops.
pub(crate) const ROWS_SO_FAR: &str = "stopping; the rows so far are kept";

/// What becomes of a computation with no result on its way.
pub(crate) const NOTHING: fn(bool) -> &'static str = |_| "stopped by Ctrl-C: there is no result";

/// Shows how far a computation is, on a terminal, and knows whether it is to stop.
#[derive(Debug)]
pub(crate) struct ProgressDisplay<'a> {
    console: Console<'a>,
    interrupt: Interrupt,
    shared: Arc<Shared>,
}

/// What Ctrl-C does once the computation has begun.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Interrupt {
    /// The first one asks it to stop, and says what becomes of it; the second ends the program.
    Stops(&'static str),
    /// It ends the program, which says this, depending on whether finished work is kept.
    Ends(fn(bool) -> &'static str),
}

/// What the runs of this process look at: one command line is run.
static RUNS: Watched = Watched::new();

#[derive(Debug)]
struct Shared {
    /// Whether results are written: what is ended then would leave half of them.
    is_writing: Mutex<bool>,
    /// None where nobody looks.
    line: Option<Mutex<Line>>,
}

impl<'a> ProgressDisplay<'a> {
    /// Of a computation that Ctrl-C stops or ends.
    pub(crate) fn new(console: Console<'a>, interrupt: Interrupt) -> Self {
        let for_a_program = console.is_json() && !io::stdout().is_terminal();
        let is_seen = io::stderr().is_terminal() && !console.is_quiet() && !for_a_program;
        let line = is_seen.then(|| Mutex::new(Line::new(Instant::now())));
        let shared = Arc::new(Shared { is_writing: Mutex::new(false), line });
        Self { console, interrupt, shared }
    }

    /// Who asks for the work.
    pub(crate) fn session(&self) -> Session<'_> {
        Session::new(self).with_seed(self.console.seed()).with_threads(self.console.threads())
    }
}

impl Watch for ProgressDisplay<'_> {
    fn advanced(&self, progress: Progress) {
        // Who is drawing already will draw again.
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

    fn watched(&self) -> Option<&'static Watched> {
        Some(&RUNS)
    }
}

impl Listener for ProgressDisplay<'_> {
    fn remark(&self, remark: Remark<'_>) {
        Listener::remark(&self.console, remark);
    }

    fn hears_remarks(&self) -> bool {
        self.console.hears_remarks()
    }

    fn has_read(&self, sources: &Sources) -> Result<(), WorkError> {
        self.console.has_read(sources)
    }

    /// From now on Ctrl-C does what it is to do.
    fn begins(&self, is_kept: bool) {
        if let Some(line) = &self.shared.line
            && let Ok(mut line) = line.lock()
        {
            *line = Line::new(Instant::now());
        }
        let (shared, is_quiet) = (Arc::clone(&self.shared), self.console.is_quiet());
        match self.interrupt {
            Interrupt::Stops(words) => on_interrupt(move || {
                if RUNS.stop() {
                    shared.end("");
                } else if !is_quiet {
                    shared.say(&format!("{words}; Ctrl-C once more ends at once\n"));
                }
            }),
            Interrupt::Ends(words) => {
                let words = format!("{}\n", words(is_kept));
                on_interrupt(move || shared.end(&words));
            }
        }
    }

    /// The computation is over: takes the line away, and lets nothing end the program while it writes.
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

impl Shared {
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

    /// Ends the program, but not while it writes.
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

/// There is nowhere to say that this failed.
fn draw(text: &str) {
    let mut terminal = io::stderr().lock();
    let _ = terminal.write_all(text.as_bytes()).and_then(|()| terminal.flush());
}

/// The line of a terminal that says how far it is.
#[derive(Debug)]
struct Line {
    /// What is counted at present, and since when.
    what: &'static str,
    since: Instant,
    done: usize,
    drawn: Option<Instant>,
    /// Characters on the terminal.
    width: usize,
}

impl Line {
    fn new(now: Instant) -> Self {
        Self { what: "", since: now, done: 0, drawn: None, width: 0 }
    }

    /// What to write, if it is time to.
    fn advanced(&mut self, progress: Progress, now: Instant) -> Option<String> {
        if progress.what != self.what || progress.done < self.done {
            // What is counted now began when the last of what was counted before was done.
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

    /// What to write so that nothing stays.
    fn cleared(&mut self) -> String {
        let width = std::mem::take(&mut self.width);
        if width == 0 { String::new() } else { format!("\r{}\r", " ".repeat(width)) }
    }
}

fn words(progress: Progress, elapsed: Duration) -> String {
    let Progress { what, done, of } = progress;
    let (all, at_most) = match of {
        Of::Exactly(all) => (all, ""),
        Of::AtMost(all) => (all, "at most "),
    };
    let mut text = format!("{what}: {done} of {at_most}{all}, {} so far", clock(elapsed));
    if elapsed >= TOO_SOON && done > 0 && done < all {
        let left = elapsed.mul_f64((all - done) as f64 / done as f64);
        let about = if at_most.is_empty() { "about " } else { at_most };
        text.extend([", ", about, &clock(left), " left"]);
    }
    text
}

/// Minutes and seconds, with hours where there are some.
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
        let at = |seconds: u64| start + Duration::from_secs(seconds);
        let mut line = Line::new(start);
        let mut said = |what, done, of, seconds| {
            line.advanced(Progress { what, done, of }, at(seconds))
                .map(|text| text.trim().to_owned())
        };
        let of = Of::AtMost(200);
        let first = said("simulations", 1, of, 0);
        assert_eq!(first.as_deref(), Some("simulations: 1 of at most 200, 0:00 so far"));
        assert_eq!(said("simulations", 2, of, 0), None, "twice within a tenth of a second");
        assert_eq!(
            said("simulations", 50, of, 30).as_deref(),
            Some("simulations: 50 of at most 200, 0:30 so far, at most 1:30 left")
        );
        // Another count has a time of its own, and so has the same one when it begins anew.
        let of = Of::Exactly(3);
        said("profiles", 1, of, 40);
        let second = said("profiles", 2, of, 4050);
        assert_eq!(second.as_deref(), Some("profiles: 2 of 3, 1:06:50 so far, about 33:25 left"));
        assert_eq!(said("profiles", 1, of, 5000).as_deref(), Some("profiles: 1 of 3, 0:00 so far"));
    }

    #[test]
    fn nothing_of_a_longer_line_stays() {
        let start = Instant::now();
        let mut line = Line::new(start);
        let progress = |done, all| Progress { what: "starts", done, of: Of::Exactly(all) };
        let long = line.advanced(progress(100_000, 100_000), start).expect("the first is drawn");
        let short = line.advanced(progress(1, 2), start + BETWEEN).expect("it is time");
        assert_eq!(short.chars().count(), long.chars().count());
        let cleared = line.cleared();
        assert!(cleared.trim().is_empty() && cleared.starts_with('\r') && cleared.ends_with('\r'));
        assert_eq!(line.cleared(), "", "nothing is there any more");
    }
}
