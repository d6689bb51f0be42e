//! The parent's side of a child process that computes pieces.

use std::io::{self, BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::thread::JoinHandle;

use super::{WorkerAnswer, WorkerQuestion};
use crate::identity::ProgramFile;

/// Length of the end of standard error that is kept, in bytes.
const LAST_WORDS: usize = 400;

/// A child process.
pub(super) struct WorkerProcess {
    child: Child,
    questions: ChildStdin,
    answers: BufReader<ChildStdout>,
    words: JoinHandle<String>,
}

impl WorkerProcess {
    /// Starts a child process.
    pub(super) fn start(program: &ProgramFile) -> io::Result<WorkerProcess> {
        let (first, more) = program.start.split_first().ok_or(io::ErrorKind::NotFound)?;
        let mut command = Command::new(first);
        command.args(more).args(["job", "work"]);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn()?;
        let pipes = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let (Some(questions), Some(answers), Some(errors)) = pipes else {
            return Err(io::ErrorKind::BrokenPipe.into());
        };
        let words = std::thread::spawn(move || last_words(errors));
        Ok(WorkerProcess { child, questions, answers: BufReader::new(answers), words })
    }

    /// The answer to a question; `None` if the process ended instead.
    pub(super) fn ask(&mut self, ask: &WorkerQuestion) -> Option<WorkerAnswer> {
        let mut line = serde_json::to_string(ask).ok()?;
        line.push('\n');
        self.questions.write_all(line.as_bytes()).and_then(|()| self.questions.flush()).ok()?;
        let mut answer = String::new();
        self.answers.read_line(&mut answer).ok()?;
        serde_json::from_str(&answer).ok()
    }

    /// How it ended, as text after "the process that computed it".
    pub(super) fn ended(mut self) -> String {
        drop(self.questions);
        let status = self.child.wait();
        let words = self.words.join().unwrap_or_default();
        let how = status.map_or_else(|_| "was ended".to_owned(), how);
        let words = words.split_whitespace().collect::<Vec<_>>().join(" ");
        if words.is_empty() { how } else { format!("{how}: {words}") }
    }

    /// Ends an idle child.
    pub(super) fn dismiss(self) {
        let _ = self.ended();
    }
}

/// The last part of a stream.
fn last_words(mut errors: impl Read) -> String {
    let (mut kept, mut bytes) = (Vec::new(), [0; 4096]);
    while let Ok(n @ 1..) = errors.read(&mut bytes) {
        kept.extend_from_slice(&bytes[..n]);
        let surplus = kept.len().saturating_sub(LAST_WORDS);
        kept.drain(..surplus);
    }
    String::from_utf8_lossy(&kept).into_owned()
}

#[cfg(unix)]
fn how(status: ExitStatus) -> String {
    use std::os::unix::process::ExitStatusExt;
    match status.signal() {
        Some(9) => "was killed, as systems do that run out of memory".to_owned(),
        Some(signal) => format!("was ended by signal {signal}"),
        None => with_code(status),
    }
}

#[cfg(not(unix))]
fn how(status: ExitStatus) -> String {
    with_code(status)
}

fn with_code(status: ExitStatus) -> String {
    match status.code() {
        Some(code) => format!("ended with code {code}"),
        None => "was ended".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_many_words_the_last_are_kept() {
        let long = format!("{}{}", "x".repeat(10_000), "the end");
        let kept = last_words(long.as_bytes());
        assert!(kept.len() == LAST_WORDS && kept.ends_with("the end"));
        assert_eq!(last_words(&b""[..]), "");
    }
}
