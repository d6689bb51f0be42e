//! Sessions with an editor, in memory.

mod everywhere;
mod fixes;
mod keystrokes;
mod sessions;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use dgd_compiler::source::{ColumnUnit, LineStarts};
use lsp_server::{Connection, Message, Notification, Request, RequestId};
use serde_json::{Value, json};

use crate::places::{path_of, uri_of};
use crate::serve;

/// An editor: a connection, and the notifications received.
struct Editor {
    connection: Connection,
    server: JoinHandle<()>,
    next: i32,
    /// The last diagnostics of each document, with its version.
    told: BTreeMap<String, Value>,
    columns: ColumnUnit,
}

impl Editor {
    fn new(folder: &Path, encoding: &str) -> Editor {
        let (own, other) = Connection::memory();
        let server = thread::spawn(move || serve(&other).expect("a session"));
        let columns = if encoding == "utf-8" { ColumnUnit::Utf8 } else { ColumnUnit::Utf16 };
        let diagnostics = BTreeMap::new();
        let mut editor = Editor { connection: own, server, next: 0, told: diagnostics, columns };
        let root = uri_of(&folder.display().to_string()).expect("an address");
        let general = json!({ "general": { "positionEncodings": [encoding] } });
        let answer =
            editor.ask("initialize", json!({ "rootUri": root.as_str(), "capabilities": general }));
        assert_eq!(answer["capabilities"]["positionEncoding"], encoding);
        editor.tell("initialized", json!({}));
        editor
    }

    fn tell(&self, method: &str, params: Value) {
        let notification = Notification { method: method.to_owned(), params };
        self.connection.sender.send(notification.into()).expect("a server that listens");
    }

    fn response(&mut self, method: &str, params: Value) -> lsp_server::Response {
        self.next += 1;
        let id = RequestId::from(self.next);
        let request = Request { id: id.clone(), method: method.to_owned(), params };
        self.connection.sender.send(request.into()).expect("a server that listens");
        loop {
            match self.receive() {
                Some(Message::Response(response)) if response.id == id => return response,
                Some(_) => {}
                None => panic!("no answer to {method}"),
            }
        }
    }

    fn ask(&mut self, method: &str, params: Value) -> Value {
        let response = self.response(method, params);
        serde_json::to_value(response).expect("JSON")["result"].take()
    }

    fn receive(&mut self) -> Option<Message> {
        self.hears_within(Duration::from_mins(1))
    }

    fn hears_within(&mut self, time: Duration) -> Option<Message> {
        let message = self.connection.receiver.recv_timeout(time).ok()?;
        if let Message::Notification(notification) = &message {
            let uri = notification.params["uri"].as_str().unwrap_or_default().to_owned();
            self.told.insert(uri, notification.params["diagnostics"].clone());
        }
        Some(message)
    }

    /// Opens a document and waits for its diagnostics.
    fn open(&mut self, path: &Path, text: &str) -> Value {
        let uri = address(path);
        let document = json!({ "uri": uri, "languageId": "dgd", "version": 1, "text": text });
        self.tell("textDocument/didOpen", json!({ "textDocument": document }));
        self.wait_for(&uri)
    }

    /// Types into a document.
    fn change(&self, uri: &str, version: usize, changes: &Value) {
        let document = json!({ "uri": uri, "version": version });
        self.tell(
            "textDocument/didChange",
            json!({ "textDocument": document, "contentChanges": changes }),
        );
    }

    fn wait_for(&mut self, uri: &str) -> Value {
        self.told.remove(uri);
        while !self.told.contains_key(uri) {
            assert!(self.receive().is_some(), "no diagnostics of {uri}");
        }
        self.told[uri].clone()
    }

    /// A document and a position in it, the `skip`th byte of the first occurrence of a text.
    fn ask_at(&self, path: &Path, text: &str, what: &str, skip: usize) -> Value {
        let byte = text.find(what).expect("it is there") + skip;
        let (line, character) = LineStarts::from_text(text).position(text, byte, self.columns);
        let position = json!({ "line": line, "character": character });
        json!({ "textDocument": { "uri": address(path) }, "position": position })
    }

    fn end(mut self) {
        self.ask("shutdown", Value::Null);
        self.tell("exit", Value::Null);
        self.server.join().expect("the server ends well");
    }
}

fn address(path: &Path) -> String {
    uri_of(&path.display().to_string()).expect("an address").as_str().to_owned()
}

fn models() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).expect("the repository").join("models")
}

/// All files of the repository, in order.
fn files() -> Vec<PathBuf> {
    let mut folders = vec![models()];
    let mut paths = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "dgd") {
                paths.push(path);
            }
        }
    }
    paths.sort();
    paths
}

fn model(name: &str) -> (PathBuf, String) {
    let path = models().join(name);
    let text = fs::read_to_string(&path).expect("a model");
    (path, text)
}

/// The text after the edits that an answer has for a document.
fn edited(text: &str, edits: &Value, columns: ColumnUnit) -> String {
    let lines = LineStarts::from_text(text);
    let byte = |at: &Value| {
        let number = |key: &str| at[key].as_u64().expect("a number") as usize;
        lines.byte(text, number("line"), number("character"), columns)
    };
    let mut changes: Vec<(usize, usize, &str)> = edits
        .as_array()
        .expect("edits")
        .iter()
        .map(|edit| {
            let range = &edit["range"];
            let new = edit["newText"].as_str().expect("a text");
            (byte(&range["start"]), byte(&range["end"]), new)
        })
        .collect();
    changes.sort_unstable();
    let mut edited = text.to_owned();
    for (start, end, new) in changes.into_iter().rev() {
        edited.replace_range(start..end, new);
    }
    edited
}

#[test]
fn mistakes_come_with_places_and_fixes_while_one_types() {
    for encoding in ["utf-8", "utf-16"] {
        let mut editor = Editor::new(&models(), encoding);
        let path = models().join("not saved/größe.dgd");
        let text = "model greek\n/// τ\nparameter τ_größe [s] = 3\nstate Δx [m] = 1\n\
                    equation e: der(Δx) = -Δx/τ_größ\n";
        let diagnostics = editor.open(&path, text);
        assert_eq!(diagnostics.as_array().expect("a list").len(), 1, "{diagnostics}");
        let range = diagnostics[0]["range"].clone();
        let start = text.find("τ_größ\n").expect("the mistake");
        let (line, character) = LineStarts::from_text(text).position(text, start, editor.columns);
        assert_eq!(range["start"], json!({ "line": line, "character": character }));
        let document = json!({ "uri": address(&path) });
        let context = json!({ "diagnostics": [] });
        let params = json!({ "textDocument": document, "range": range, "context": context });
        let fixes = editor.ask("textDocument/codeAction", params);
        let edits = &fixes[0]["edit"]["changes"][address(&path)];
        let fixed = edited(text, edits, editor.columns);
        assert!(fixed.ends_with("= -Δx/τ_größe\n"), "{fixed}");
        // The editor applies the change and sends it to the server, and no error remains.
        let change = json!({ "range": edits[0]["range"], "text": edits[0]["newText"] });
        let document = json!({ "uri": address(&path), "version": 2 });
        editor.tell(
            "textDocument/didChange",
            json!({ "textDocument": document, "contentChanges": [change] }),
        );
        assert_eq!(editor.wait_for(&address(&path)), json!([]));
        editor.end();
    }
}

#[test]
fn what_is_under_the_cursor_is_told() {
    let mut editor = Editor::new(&models(), "utf-16");
    let (path, text) = model("mud_circulation.dgd");
    assert_eq!(editor.open(&path, &text), json!([]));
    let position = editor.ask_at(&path, &text, "M = M_ssp }", 4);
    let hover = editor.ask("textDocument/hover", position.clone());
    let hover_text = hover["contents"]["value"].as_str().expect("a text");
    for part in ["parameter M_ssp [kg/m^4]", "= 110000000 kg/m^4", "Used", "is in `kg/m^4`"] {
        assert!(hover_text.contains(part), "{part}: {hover_text}");
    }
    let label = editor.ask_at(&path, &text, "riser:", 0);
    let hover = editor.ask("textDocument/hover", label);
    let shown = hover["contents"]["value"].as_str().expect("a text");
    assert!(shown.contains("$$\n") && shown.contains("\\dot{h}"), "{shown}");
    let declared = editor.ask("textDocument/definition", position);
    let line = text.lines().position(|line| line.starts_with("parameter M_ssp")).expect("it is");
    assert_eq!(declared[0]["range"]["start"]["line"], line);
    let document = json!({ "textDocument": { "uri": address(&path) } });
    let hints = editor.ask("textDocument/inlayHint", document.clone());
    assert!(
        hints.as_array().expect("a list").iter().any(|hint| hint["label"] == "[m^2]"),
        "{hints}"
    );
    let symbols = editor.ask("textDocument/documentSymbol", document.clone());
    let names: Vec<&str> =
        symbols.as_array().expect("a list").iter().filter_map(|one| one["name"].as_str()).collect();
    assert!(names.contains(&"riser") && names.contains(&"h_r"), "{names:?}");
    let folds = editor.ask("textDocument/foldingRange", document.clone());
    assert!(!folds.as_array().expect("a list").is_empty());
    assert_eq!(editor.ask("textDocument/formatting", document.clone()), json!([]));
    let lenses = editor.ask("textDocument/codeLens", document.clone());
    assert_eq!(lenses[0]["command"]["command"], "dgd.simulate", "{lenses}");
    assert_eq!(lenses[0]["command"]["arguments"], json!([path.display().to_string()]));
    let tokens = editor.ask("textDocument/semanticTokens/full", document);
    assert_eq!(tokens["data"].as_array().expect("a list").len() % 5, 0);
    editor.end();
}

#[test]
fn a_new_name_reaches_every_file_and_leaves_them_sound() {
    let mut editor = Editor::new(&models(), "utf-16");
    let (path, text) = model("mud_circulation.dgd");
    assert_eq!(editor.open(&path, &text), json!([]));
    let mut params = editor.ask_at(&path, &text, "h_r ", 0);
    for taken in ["rho", "time", "1x", "a b", "sqrt", "x.y"] {
        params["newName"] = json!(taken);
        let response = editor.response("textDocument/rename", params.clone());
        let error = serde_json::to_value(response).expect("JSON")["error"].take();
        assert!(error["message"].is_string(), "{taken} was not refused");
    }
    params["newName"] = json!("κ_level");
    let answer = editor.ask("textDocument/rename", params);
    let changes = answer["changes"].as_object().expect("changes");
    assert!(changes.len() > 2, "effects name it, too: {}", changes.len());
    let columns = editor.columns;
    for (uri, edits) in changes {
        let path = PathBuf::from(path_of(&uri.parse().expect("an address")));
        let text = fs::read_to_string(&path).expect("a file");
        editor.open(&path, &edited(&text, edits, columns));
    }
    // Each was analysed again with the current state of the others.
    for uri in changes.keys() {
        let text = edited(
            &fs::read_to_string(path_of(&uri.parse().expect("an address"))).expect("a file"),
            &changes[uri],
            columns,
        );
        let document = json!({ "uri": uri, "version": 3 });
        let change = json!({ "textDocument": document, "contentChanges": [{ "text": text }] });
        editor.tell("textDocument/didChange", change);
        assert_eq!(editor.wait_for(uri), json!([]), "{uri}");
    }
    editor.end();
}

#[test]
fn an_effect_knows_its_model_where_only_its_folder_is_open() {
    let mut editor = Editor::new(&models().join("effects"), "utf-16");
    let (path, text) = model("effects/pump_wear.dgd");
    assert_eq!(editor.open(&path, &text), json!([]));
    let position = editor.ask_at(&path, &text, "replace c0", 8);
    let declared = editor.ask("textDocument/definition", position);
    assert_eq!(declared[0]["uri"], address(&models().join("mud_circulation.dgd")), "{declared}");
    editor.end();
}

#[test]
fn a_request_that_crashes_gets_an_error_and_loses_no_document() {
    let mut editor = Editor::new(&models(), "utf-16");
    let (path, text) = model("pendulum.dgd");
    assert_eq!(editor.open(&path, &text), json!([]));
    let response = serde_json::to_value(editor.response("dgd/panic", json!({}))).expect("JSON");
    assert_eq!(response["error"]["code"], -32603, "{response}");
    // Notifications that crash or cannot be parsed change nothing either.
    editor.tell("dgd/panic", json!({}));
    editor.tell("textDocument/didChange", json!({ "textDocument": 3 }));
    let response = serde_json::to_value(editor.response("dgd/other", json!({}))).expect("JSON");
    assert_eq!(response["error"]["code"], -32601, "{response}");
    let position = editor.ask_at(&path, &text, "theta [deg]", 0);
    let hover = editor.ask("textDocument/hover", position);
    assert!(hover["contents"]["value"].as_str().is_some_and(|said| said.contains("theta")));
    editor.end();
}

#[test]
fn other_choices_are_looked_at_after_a_pause() {
    let mut editor = Editor::new(&models(), "utf-16");
    let path = models().join("not saved/choices.dgd");
    let text = "model choices\nstate x [m] = 1\nvariant v {\n  a { let r = 1 [m/s] }\n  \
                b { let r = 1 [m] }\n}\nequation e: der(x) = r\n";
    assert_eq!(editor.open(&path, text), json!([]), "the first choice is sound");
    let later = editor.wait_for(&address(&path));
    assert_eq!(later[0]["code"], "E302", "{later}");
    editor.end();
}
