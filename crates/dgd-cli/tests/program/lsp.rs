//! `dgd lsp`: a recorded session over standard input and output.

use std::fmt::Write as _;
use std::io::Write as _;
use std::process::Stdio;

use serde_json::{Value, json};

use crate::support::{Run, command, root};

/// The messages of a text in the protocol's frames.
fn messages(mut text: &str) -> Vec<Value> {
    let mut entries = Vec::new();
    while let Some((head, rest)) = text.split_once("\r\n\r\n") {
        let length: usize =
            head.trim_start_matches("Content-Length: ").parse().expect("a length of a message");
        entries.push(serde_json::from_str(&rest[..length]).expect("JSON"));
        text = &rest[length..];
    }
    assert!(text.is_empty(), "nothing but messages is written: {text}");
    entries
}

#[test]
fn a_recorded_session_is_answered_and_ends() {
    let uri = format!("file://{}/models/pendulum.dgd", root().display());
    let text = "model τ_test\nstate x [m] = 1\nequation e: der(x) = y\n";
    let document = json!({ "uri": uri, "languageId": "dgd", "version": 1, "text": text });
    let position = json!({ "line": 2, "character": 16 });
    let session = [
        json!({ "jsonrpc": "2.0", "id": 1, "method": "initialize", "params": { "capabilities": {} } }),
        json!({ "jsonrpc": "2.0", "method": "initialized", "params": {} }),
        json!({ "jsonrpc": "2.0", "method": "textDocument/didOpen", "params": { "textDocument": document } }),
        json!({ "jsonrpc": "2.0", "id": 2, "method": "textDocument/hover",
                "params": { "textDocument": { "uri": uri }, "position": position } }),
        json!({ "jsonrpc": "2.0", "id": 3, "method": "shutdown" }),
        json!({ "jsonrpc": "2.0", "method": "exit" }),
    ];
    let mut input = String::new();
    for message in session {
        let message = message.to_string();
        write!(input, "Content-Length: {}\r\n\r\n{message}", message.len()).expect("a string");
    }
    let mut child = command(&root(), &["lsp", "--stdio"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts");
    let mut stdin = child.stdin.take().expect("it is piped");
    stdin.write_all(input.as_bytes()).expect("it reads");
    drop(stdin);
    let run = Run::of(&child.wait_with_output().expect("it ends")).done();
    let entries = messages(&run.out);
    let answer = |id: u32| entries.iter().find(|message| message["id"] == id).expect("an answer");
    assert_eq!(answer(1)["result"]["serverInfo"]["name"], "dgd");
    assert_eq!(answer(1)["result"]["capabilities"]["positionEncoding"], "utf-16");
    let hover = answer(2)["result"]["contents"]["value"].as_str().expect("a text");
    assert!(hover.contains("state x [m] = 1"), "{hover}");
    assert_eq!(answer(3)["result"], Value::Null);
}
