//! Writes values into the text of the opened model, and nothing else.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use axum::body::Bytes;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Response;
use dgd_data::files::write_whole;
use dgd_data::open::{DiskFiles, read_text};
use serde::Deserialize;
use serde_json::json;

use super::response::json_response;
use super::state::ServerState;
use crate::bench::digest;
use crate::values::ParameterValues;

/// The request to write.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct WriteRequest {
    /// Values in the declared units.
    values: BTreeMap<String, f64>,
    /// The choices of variants that declare them.
    variant: BTreeMap<String, String>,
    /// Digest of the text that the page knows.
    digest: String,
}

pub(super) async fn write(State(shared): State<Arc<ServerState>>, body: Bytes) -> Response {
    let written = serde_json::from_slice::<WriteRequest>(&body)
        .map_err(|error| (StatusCode::BAD_REQUEST, format!("this cannot be written: {error}")))
        .and_then(|wanted| {
            // One at a time, and not while a run reads the file.
            let _bench = shared.bench();
            write_into(&shared.model, &wanted).map_err(|why| (StatusCode::CONFLICT, why))
        });
    match written {
        Ok(()) => json_response(StatusCode::OK, json!({ "ok": true }).to_string()),
        Err((status, why)) => {
            json_response(status, json!({ "ok": false, "error": why }).to_string())
        }
    }
}

/// Writes the values into a file, atomically, if it has the text that the page knows.
fn write_into(path: &Path, wanted: &WriteRequest) -> Result<(), String> {
    let shown = path.display();
    let text =
        read_text(&DiskFiles, path).map_err(|reason| format!("cannot read `{shown}`: {reason}"))?;
    if digest(&text) != wanted.digest {
        return Err(format!(
            "`{shown}` has changed since it was read, so nothing was written; look at what is drawn now, and write again"
        ));
    }
    let changed = ParameterValues::read(&text, &wanted.variant)
        .write(&wanted.values)
        .map_err(|error| error.to_string())?;
    write_whole(path, |out| out.write_all(changed.as_bytes())).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_file_that_has_changed_is_left_alone() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let path = folder.path().join("m.dgd");
        let text =
            "model m\nparameter k [1/s] = 2  /// rate\nstate x = 1\nequation e: der(x) = -k*x\n";
        fs::write(&path, text).expect("the folder is writable");
        let wanted = |digest: String| WriteRequest {
            values: BTreeMap::from([("k".to_owned(), 2.5)]),
            variant: BTreeMap::new(),
            digest,
        };
        write_into(&path, &wanted(digest(text))).expect("it is as it was read");
        let now = fs::read_to_string(&path).expect("it is there");
        assert_eq!(now, text.replace("= 2  ///", "= 2.5 ///"));
        let refused = write_into(&path, &wanted(digest(text))).expect_err("it has changed");
        assert!(refused.contains("has changed since it was read"), "{refused}");
        assert_eq!(fs::read_to_string(&path).expect("it is there"), now);
        fs::remove_file(&path).expect("it is there");
        assert!(write_into(&path, &wanted(digest(text))).is_err());
        assert!(!path.exists());
    }
}
