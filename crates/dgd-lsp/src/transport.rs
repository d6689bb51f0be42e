//! Messages over a stream. Invalid data is answered with an error, and reading continues at the next message.

use std::io::{self, BufRead, Read, Write};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use lsp_server::{Connection, ErrorCode, Message, Notification};
use serde::de::IgnoredAny;
use serde_json::json;

use crate::failure::ServerFailure;
use crate::server;

/// Limit on the bytes of a message. No model comes near it: a greater length is an error.
const LARGEST: usize = 64 << 20;

/// Limit on the bytes of a header line that are stored.
const LONGEST: usize = 8 << 10;

/// The header of each message, in lower case.
const LENGTH: &[u8] = b"content-length:";

/// Serves an editor that writes to `input` and reads from `output`.
pub(crate) fn serve_stream(
    input: impl BufRead + Send + 'static,
    output: impl Write + Send + 'static,
) -> Result<(), ServerFailure> {
    let (editor, server) = Connection::memory();
    let output = Arc::new(Mutex::new(output));
    let (sender, receiver) = (editor.sender, editor.receiver);
    let answers = Arc::clone(&output);
    let writer = thread::spawn(move || {
        receiver.iter().try_for_each(|message| message.write(&mut *locked(&answers)))
    });
    let reader = thread::spawn(move || {
        let mut frames = MessageFrames { input, is_lost: false };
        while let Some(frame) = frames.next()? {
            match frame.and_then(|text| message(&text)) {
                Ok(message) => {
                    let is_exit = matches!(&message, Message::Notification(Notification { method, .. }) if method == "exit");
                    if sender.send(message).is_err() || is_exit {
                        break;
                    }
                }
                Err(mistake) => mistake.write(&mut *locked(&output))?,
            }
        }
        Ok::<(), io::Error>(())
    });
    server::run(&server)?;
    // The writing thread ends when nothing more can be sent.
    drop(server);
    for thread in [reader, writer] {
        thread.join().map_err(|_| "a thread of the language server panicked")??;
    }
    Ok(())
}

fn locked<T>(output: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    output.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The reason why data is not a message.
struct MalformedMessage {
    code: ErrorCode,
    reason: String,
}

impl MalformedMessage {
    fn new(code: ErrorCode, reason: impl Into<String>) -> Self {
        MalformedMessage { code, reason: reason.into() }
    }

    /// Writes an error without an id, as the protocol requires if no request could be read.
    fn write(&self, output: &mut impl Write) -> io::Result<()> {
        let error = json!({ "code": self.code as i32, "message": self.reason });
        let text = json!({ "jsonrpc": "2.0", "id": null, "error": error }).to_string();
        write!(output, "Content-Length: {}\r\n\r\n{text}", text.len())?;
        output.flush()
    }
}

fn message(text: &[u8]) -> Result<Message, MalformedMessage> {
    serde_json::from_slice(text).map_err(|error| {
        let is_json = serde_json::from_slice::<IgnoredAny>(text).is_ok();
        let code = if is_json { ErrorCode::InvalidRequest } else { ErrorCode::ParseError };
        MalformedMessage::new(code, format!("this is not a message: {error}"))
    })
}

/// The bodies of messages.
struct MessageFrames<R> {
    input: R,
    /// Whether the next header is being searched for because the previous length was wrong.
    is_lost: bool,
}

impl<R: BufRead> MessageFrames<R> {
    /// The next body, or an error; `None` at the end of the stream.
    fn next(&mut self) -> io::Result<Option<Result<Vec<u8>, MalformedMessage>>> {
        let Some(length) = self.length()? else { return Ok(None) };
        let length = match length {
            Ok(length) => length,
            Err(mistake) => {
                self.is_lost = true;
                return Ok(Some(Err(mistake)));
            }
        };
        self.is_lost = false;
        let mut text = Vec::new();
        (&mut self.input).take(length as u64).read_to_end(&mut text)?;
        Ok((text.len() == length).then_some(Ok(text)))
    }

    /// The length in the next headers. Data before them is skipped.
    fn length(&mut self) -> io::Result<Option<Result<usize, MalformedMessage>>> {
        let mut length: Option<Result<usize, MalformedMessage>> = None;
        let mut line = Vec::new();
        while self.line(&mut line)? {
            let text = line.trim_ascii();
            if let Some(at) = header(text) {
                let value = String::from_utf8_lossy(&text[at + LENGTH.len()..]).trim().to_owned();
                length = Some(length_of(&value));
            } else if !text.is_empty() && !text.contains(&b':') && !self.is_lost {
                let reason = "this is not a header: a message begins with `Content-Length: N`";
                return Ok(Some(Err(MalformedMessage::new(ErrorCode::ParseError, reason))));
            } else if text.is_empty() && length.is_some() {
                return Ok(length);
            }
        }
        Ok(None)
    }

    /// Reads a line, keeping only the end of a long one; returns whether there is one.
    fn line(&mut self, line: &mut Vec<u8>) -> io::Result<bool> {
        line.clear();
        loop {
            let most = LONGEST as u64;
            let n = (&mut self.input).take(most).read_until(b'\n', line)?;
            if n == 0 || line.ends_with(b"\n") {
                return Ok(!line.is_empty());
            }
            line.drain(..line.len().saturating_sub(LONGEST));
        }
    }
}

/// Start of the last header with a length in a line, possibly after a message that was skipped.
fn header(line: &[u8]) -> Option<usize> {
    let is_header = |at: &usize| line[*at..*at + LENGTH.len()].eq_ignore_ascii_case(LENGTH);
    (0..(line.len() + 1).saturating_sub(LENGTH.len())).rev().find(is_header)
}

fn length_of(value: &str) -> Result<usize, MalformedMessage> {
    value.parse().ok().filter(|length| *length <= LARGEST).ok_or_else(|| {
        let reason =
            format!("a message has at most {LARGEST} bytes, and this header gives `{value}`");
        MalformedMessage::new(ErrorCode::ParseError, reason)
    })
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    fn framed(text: &str) -> String {
        format!("Content-Length: {}\r\n\r\n{text}", text.len())
    }

    /// Codes of errors and ids of answers, in their order, of a session in which `between` is sent.
    fn session(between: &str) -> Vec<String> {
        let asks = [
            r#"{"jsonrpc":"2.0","id":1,"method":"initialize","params":{"capabilities":{}}}"#,
            r#"{"jsonrpc":"2.0","method":"initialized","params":{}}"#,
            r#"{"jsonrpc":"2.0","id":2,"method":"shutdown"}"#,
            r#"{"jsonrpc":"2.0","method":"exit"}"#,
        ]
        .map(framed);
        let text = format!("{}{}{between}{}{}", asks[0], asks[1], asks[2], asks[3]);
        let written = Arc::new(Mutex::new(Vec::new()));
        serve_stream(Cursor::new(text.into_bytes()), Shared(Arc::clone(&written)))
            .expect("the session ends well");
        let written = written.lock().expect("whole").clone();
        let mut frames = MessageFrames { input: Cursor::new(written), is_lost: false };
        let mut all = Vec::new();
        while let Some(Ok(text)) = frames.next().expect("readable") {
            let answer: serde_json::Value = serde_json::from_slice(&text).expect("JSON");
            all.push(match answer["error"]["code"].as_i64() {
                Some(code) => code.to_string(),
                None => format!("answer {}", answer["id"]),
            });
        }
        // The reading thread answers errors immediately.
        all.sort();
        all
    }

    struct Shared(Arc<Mutex<Vec<u8>>>);

    impl Write for Shared {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            locked(&self.0).write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_session_goes_on_after_what_is_not_a_message() {
        let answers = |error: &str| vec![error.to_owned(), "answer 1".into(), "answer 2".into()];
        assert_eq!(session(""), ["answer 1", "answer 2"]);
        for text in ["this is no JSON", "{\"id\":", "\u{fffd}\r\n", ""] {
            assert_eq!(session(&framed(text)), answers("-32700"), "{text:?}");
        }
        for text in ["{}", "[]", "3", "{\"id\":{}}"] {
            assert_eq!(session(&framed(text)), answers("-32600"), "{text}");
        }
        let deep = "[".repeat(100_000);
        assert_eq!(session(&framed(&deep)), answers("-32700"));
        for length in ["99999999999999", "18446744073709551615", "1e999", "-3", "", "x"] {
            // With and without a body after it.
            for body in ["", "{}", "{}\n\nnothing\n"] {
                let text = format!("Content-Length: {length}\r\n\r\n{body}");
                assert_eq!(session(&text), answers("-32700"), "{text}");
            }
        }
        for noise in ["noise\r\n", "noise\n\n\n"] {
            assert_eq!(session(noise), answers("-32700"), "{noise}");
        }
        let long = format!("Content-Length: 99999999999999\r\n\r\n{}", "x".repeat(1 << 20));
        assert_eq!(session(&long), answers("-32700"));
        assert_eq!(session("Content-Type: text\r\n"), ["answer 1", "answer 2"]);
    }
}
