//! Replays recorded sessions of an editor.
//!
//! `crates/dgd-lsp/sessions/` has a file for each: the editor's messages, one per line, as written by
//! `editors/nvim/record.mjs`, each request followed by its answer and each change by its diagnostics. `UPDATE_GOLDEN=1`
//! rewrites the answers.

use std::fs;
use std::path::Path;
use std::thread;
use std::time::Duration;

use lsp_server::{Connection, Message, Notification, Request, RequestId};
use serde_json::{Value, json};

use crate::serve;

/// The next answer to a request, or diagnostics of a version of a document.
fn await_answer(editor: &Connection, is_it: impl Fn(&Message) -> bool) -> Value {
    loop {
        let message =
            editor.receiver.recv_timeout(Duration::from_mins(1)).expect("an answer in time");
        if is_it(&message) {
            return match message {
                Message::Response(response) => {
                    let mut answer = serde_json::to_value(response).expect("JSON");
                    let object = answer.as_object_mut().expect("an object");
                    object.retain(|key, _| key == "result" || key == "error");
                    answer
                }
                Message::Notification(Notification { params, .. }) => json!({ "told": params }),
                Message::Request(_) => unreachable!("the server asks nothing"),
            };
        }
    }
}

/// Sends a message of the editor, and returns the server's reply.
fn play(editor: &Connection, message: &Value) -> Option<Value> {
    let method = message["method"].as_str()?.to_owned();
    let params = message["params"].clone();
    if let Some(id) = message["id"].as_i64() {
        let id = RequestId::from(i32::try_from(id).expect("a small number"));
        let request = Request { id: id.clone(), method, params };
        editor.sender.send(request.into()).expect("a server that listens");
        let is_it = |message: &Message| matches!(message, Message::Response(r) if r.id == id);
        return Some(await_answer(editor, is_it));
    }
    let document = params["textDocument"].clone();
    let is_change = ["textDocument/didOpen", "textDocument/didChange"].contains(&method.as_str());
    editor.sender.send(Notification { method, params }.into()).expect("a server that listens");
    is_change.then(|| {
        await_answer(editor, |message| match message {
            Message::Notification(told) => {
                told.params["uri"] == document["uri"]
                    && told.params["version"] == document["version"]
            }
            _ => false,
        })
    })
}

/// An answer with its keys sorted, since those of files come in any order.
fn in_order(value: Value) -> Value {
    match value {
        Value::Object(all) => {
            let mut sorted: Vec<_> =
                all.into_iter().map(|(key, one)| (key, in_order(one))).collect();
            sorted.sort_by(|(a, _), (b, _)| a.cmp(b));
            Value::Object(sorted.into_iter().collect())
        }
        Value::Array(all) => all.into_iter().map(in_order).collect(),
        other => other,
    }
}

/// The text of a session after replaying it here.
fn played(text: &str, root: &str) -> String {
    let (editor, server) = Connection::memory();
    let server = thread::spawn(move || serve(&server).expect("a session"));
    let mut lines = Vec::new();
    for line in text.lines() {
        let line: Value = serde_json::from_str(&line.replace("ROOT", root)).expect("JSON");
        let Some(sent) = line.get("editor") else { continue };
        lines.push(json!({ "editor": sent }));
        lines.extend(play(&editor, sent).map(|answer| json!({ "server": in_order(answer) })));
    }
    server.join().expect("the server ends well");
    let lines: Vec<String> =
        lines.iter().map(|line| line.to_string().replace(root, "ROOT")).collect();
    lines.join("\n") + "\n"
}

#[test]
fn recorded_sessions_are_answered_as_they_were() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root = folder.ancestors().nth(2).expect("the repository").display().to_string();
    let mut n_played = 0;
    for entry in fs::read_dir(folder.join("sessions")).expect("recorded sessions") {
        let path = entry.expect("an entry").path();
        let text = fs::read_to_string(&path).expect("a text");
        let again = played(&text, &root);
        n_played += 1;
        if std::env::var_os("UPDATE_GOLDEN").is_some() {
            fs::write(&path, &again).expect("a place to write");
            continue;
        }
        for (number, (was, is)) in text.lines().zip(again.lines()).enumerate() {
            assert_eq!(is, was, "line {} of {}", number + 1, path.display());
        }
        assert_eq!(again.lines().count(), text.lines().count(), "{}", path.display());
    }
    assert!(n_played > 0);
}
