//! The loop: messages in, answers and diagnostics out.

use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use dgd_compiler::source::ColumnUnit;
use lsp_server::{Connection, ErrorCode, Message, Notification, Request, Response};
use lsp_types::notification::{
    DidChangeTextDocument, DidCloseTextDocument, DidOpenTextDocument, LogMessage,
    Notification as _, PublishDiagnostics,
};
use lsp_types::{
    DidChangeTextDocumentParams, DidCloseTextDocumentParams, DidOpenTextDocumentParams,
    InitializeParams, MessageType, PositionEncodingKind, PublishDiagnosticsParams,
};
use serde_json::{Value, json};

use crate::analysis::{Analysis, analyse};
use crate::answer::{self, AnswerContext};
use crate::failure::ServerFailure;
use crate::files::OpenDocuments;
use crate::places;

/// Pause in typing after which other variants are analysed.
const PAUSE: Duration = Duration::from_millis(300);

struct Server<'a> {
    connection: &'a Connection,
    files: OpenDocuments,
    columns: ColumnUnit,
    /// Documents changed since their last analysis, and since that of their other variants.
    changed: BTreeSet<String>,
    unfinished: BTreeSet<String>,
    analyses: BTreeMap<String, Analysis>,
    /// The editor's version of each open text, with which it matches diagnostics.
    versions: BTreeMap<String, i32>,
}

pub(crate) fn run(connection: &Connection) -> Result<(), ServerFailure> {
    let (id, params) = loop {
        let (id, params) = connection.initialize_start()?;
        match serde_json::from_value::<InitializeParams>(params) {
            Ok(params) => break (id, params),
            Err(error) => {
                let code = ErrorCode::InvalidParams as i32;
                connection.sender.send(Response::new_err(id, code, error.to_string()).into())?;
            }
        }
    };
    let columns = columns(&params);
    let encoding = match columns {
        ColumnUnit::Utf8 => PositionEncodingKind::UTF8,
        ColumnUnit::Utf16 | ColumnUnit::Characters => PositionEncodingKind::UTF16,
    };
    let version = env!("CARGO_PKG_VERSION");
    let info = json!({ "name": "dgd", "version": version });
    let answer = json!({ "capabilities": answer::capabilities(encoding), "serverInfo": info });
    connection.initialize_finish(id, answer)?;
    let folders = folders(&params);
    let files = OpenDocuments { folders, ..OpenDocuments::default() };
    let (changed, unfinished) = (BTreeSet::new(), BTreeSet::new());
    let (analyses, versions) = (BTreeMap::new(), BTreeMap::new());
    Server { connection, files, columns, changed, unfinished, analyses, versions }.serve()
}

/// UTF-8 if the editor supports it, else UTF-16, which every editor supports.
fn columns(params: &InitializeParams) -> ColumnUnit {
    let general = params.capabilities.general.as_ref();
    let encodings = general.and_then(|general| general.position_encodings.as_ref());
    match encodings {
        Some(all) if all.contains(&PositionEncodingKind::UTF8) => ColumnUnit::Utf8,
        Some(_) | None => ColumnUnit::Utf16,
    }
}

#[allow(deprecated)] // Editors of some years ago only send `rootUri`.
fn folders(params: &InitializeParams) -> Vec<String> {
    let folders = params.workspace_folders.iter().flatten().map(|folder| &folder.uri);
    let mut paths: Vec<String> = folders.map(places::path_of).collect();
    if paths.is_empty() {
        paths.extend(params.root_uri.iter().map(places::path_of));
    }
    paths
}

impl Server<'_> {
    fn serve(mut self) -> Result<(), ServerFailure> {
        loop {
            let waits = !self.connection.receiver.is_empty();
            if !waits && let Some(path) = self.changed.pop_first() {
                self.look_at(&path)?;
                continue;
            }
            let message = if self.unfinished.is_empty() {
                self.connection.receiver.recv().ok()
            } else {
                match self.connection.receiver.recv_timeout(PAUSE) {
                    Ok(message) => Some(message),
                    Err(error) if error.is_timeout() => {
                        self.finish()?;
                        continue;
                    }
                    Err(_) => None,
                }
            };
            match message {
                None => return Ok(()),
                Some(Message::Request(request)) => {
                    if self.connection.handle_shutdown(&request)? {
                        return Ok(());
                    }
                    if let Some(path) = answer::document(&request.params)
                        && self.changed.remove(&path)
                    {
                        // An answer refers to the current text.
                        self.look_at(&path)?;
                    }
                    let response = self.answer(request);
                    self.connection.sender.send(response.into())?;
                }
                Some(Message::Notification(notification)) => self.take(notification)?,
                Some(Message::Response(_)) => {}
            }
        }
    }

    /// Answers a request; a crash gives an error.
    fn answer(&mut self, Request { id, method, params }: Request) -> Response {
        let answered = catch_unwind(AssertUnwindSafe(|| {
            let path = answer::document(&params);
            if let Some(path) = &path
                && !self.analyses.contains_key(path)
            {
                self.analyses.insert(path.clone(), analyse(path, &self.files));
            }
            let analysis = path.as_ref().and_then(|path| self.analyses.get(path));
            let (path, files, columns) =
                (path.clone().unwrap_or_default(), &self.files, self.columns);
            answer::answer(&method, params, &AnswerContext { path, files, columns, analysis })
        }));
        match answered {
            Ok(Some(Ok(result))) => Response::new_ok(id, result),
            Ok(Some(Err(message))) => {
                Response::new_err(id, ErrorCode::InvalidParams as i32, message)
            }
            Ok(None) => {
                let message = format!("dgd does not know the request {method}");
                Response::new_err(id, ErrorCode::MethodNotFound as i32, message)
            }
            Err(_) => {
                let message = format!("{method} could not be answered: a mistake of dgd itself");
                Response::new_err(id, ErrorCode::InternalError as i32, message)
            }
        }
    }

    /// Handles a notification. Invalid notifications change nothing: an opened document stays open.
    fn take(&mut self, Notification { method, params }: Notification) -> Result<(), ServerFailure> {
        let taken = catch_unwind(AssertUnwindSafe(|| self.understand(&method, params)));
        match taken {
            Ok(Ok(Some(closed))) => self.publish(&closed, Vec::new()),
            Ok(Ok(None)) => Ok(()),
            Ok(Err(error)) => self.log(&format!("{method} could not be read: {error}")),
            Err(_) => self.log(&format!("{method} was not taken in: a mistake of dgd itself")),
        }
    }

    /// Applies a notification to the documents; returns the path of a closed one.
    fn understand(
        &mut self,
        method: &str,
        params: Value,
    ) -> Result<Option<String>, serde_json::Error> {
        #[cfg(test)]
        assert!(method != "dgd/panic", "as asked");
        match method {
            DidOpenTextDocument::METHOD => {
                let params: DidOpenTextDocumentParams = serde_json::from_value(params)?;
                let path = places::path_of(&params.text_document.uri);
                self.versions.insert(path.clone(), params.text_document.version);
                self.files.open.insert(path.clone(), params.text_document.text);
                self.touch(&path);
            }
            DidChangeTextDocument::METHOD => {
                let params: DidChangeTextDocumentParams = serde_json::from_value(params)?;
                let path = places::path_of(&params.text_document.uri);
                self.versions.insert(path.clone(), params.text_document.version);
                let text = self.files.open.entry(path.clone()).or_default();
                for change in params.content_changes {
                    match change.range {
                        None => *text = change.text,
                        Some(range) => {
                            let start = places::byte(text, range.start, self.columns);
                            let end = places::byte(text, range.end, self.columns).max(start);
                            text.replace_range(start..end, &change.text);
                        }
                    }
                }
                self.touch(&path);
            }
            DidCloseTextDocument::METHOD => {
                let params: DidCloseTextDocumentParams = serde_json::from_value(params)?;
                let path = places::path_of(&params.text_document.uri);
                self.files.open.remove(&path);
                self.changed.remove(&path);
                self.unfinished.remove(&path);
                self.analyses.remove(&path);
                self.versions.remove(&path);
                return Ok(Some(path));
            }
            _ => {}
        }
        Ok(None)
    }

    /// Sends a line to the editor's log.
    fn log(&self, text: &str) -> Result<(), ServerFailure> {
        let params = json!({ "type": MessageType::WARNING, "message": text });
        let method = LogMessage::METHOD.to_owned();
        self.connection.sender.send(Notification { method, params }.into())?;
        Ok(())
    }

    /// Marks a changed document, and open ones that may read it, for analysis when no message is waiting.
    fn touch(&mut self, path: &str) {
        self.changed.extend(self.files.open.keys().cloned());
        self.unfinished.remove(path);
    }

    /// Analyses a document with the first choice of each variant.
    fn look_at(&mut self, path: &str) -> Result<(), ServerFailure> {
        let looked = catch_unwind(AssertUnwindSafe(|| analyse(path, &self.files)));
        let Ok(analysis) = looked else {
            // The earlier analysis belongs to an older text.
            self.analyses.remove(path);
            return self.publish(path, vec![answer::crashed()]);
        };
        let diagnostics = answer::diagnostics(&analysis, self.columns);
        self.analyses.insert(path.to_owned(), analysis);
        self.unfinished.insert(path.to_owned());
        self.publish(path, diagnostics)
    }

    /// Analyses the other variants of a document, unless a newer message arrives.
    fn finish(&mut self) -> Result<(), ServerFailure> {
        let Some(path) = self.unfinished.pop_first() else { return Ok(()) };
        let Some(analysis) = self.analyses.get_mut(&path) else { return Ok(()) };
        let receiver = &self.connection.receiver;
        let others =
            catch_unwind(AssertUnwindSafe(|| analysis.other_variants(&mut || receiver.is_empty())));
        match others {
            Ok(Some(others)) => {
                analysis.add(others);
                let diagnostics = answer::diagnostics(analysis, self.columns);
                self.publish(&path, diagnostics)
            }
            Ok(None) => {
                self.unfinished.insert(path);
                Ok(())
            }
            Err(_) => Ok(()),
        }
    }

    fn publish(
        &self,
        path: &str,
        diagnostics: Vec<lsp_types::Diagnostic>,
    ) -> Result<(), ServerFailure> {
        let Some(uri) = places::uri_of(path) else { return Ok(()) };
        let version = self.versions.get(path).copied();
        let params = PublishDiagnosticsParams { uri, diagnostics, version };
        let params: Value = serde_json::to_value(params)?;
        let method = PublishDiagnostics::METHOD.to_owned();
        self.connection.sender.send(Notification { method, params }.into())?;
        Ok(())
    }
}
