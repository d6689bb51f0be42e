//! Converts spans to the protocol's lines and columns and back, and paths to URIs and back.

use std::fmt::Write as _;
use std::str::FromStr;

use dgd_compiler::source::{ColumnUnit, LineStarts, SourceMap, Span};
use lsp_types::{Location, Position, Range, Uri};

/// The range of some bytes of a text.
pub(crate) fn range(text: &str, bytes: std::ops::Range<usize>, columns: ColumnUnit) -> Range {
    let lines = LineStarts::from_text(text);
    let position = |byte| {
        let (line, column) = lines.position(text, byte, columns);
        Position::new(line as u32, column as u32)
    };
    Range::new(position(bytes.start), position(bytes.end))
}

/// The range of a span in its text.
pub(crate) fn range_of(span: Span, sources: &SourceMap, columns: ColumnUnit) -> Range {
    range(&sources.get(span.source).text, span.start as usize..span.end as usize, columns)
}

/// The location of a span, with its file; `None` if that has no URI.
pub(crate) fn location(span: Span, sources: &SourceMap, columns: ColumnUnit) -> Option<Location> {
    let uri = uri_of(&sources.get(span.source).name)?;
    Some(Location::new(uri, range_of(span, sources, columns)))
}

/// The byte at a position of a text.
pub(crate) fn byte(text: &str, at: Position, columns: ColumnUnit) -> usize {
    LineStarts::from_text(text).byte(text, at.line as usize, at.character as usize, columns)
}

/// The path of a file URI, with escapes such as `%20` decoded; other URIs are used as paths.
pub(crate) fn path_of(uri: &Uri) -> String {
    let text = uri.as_str();
    let Some(path) = text.strip_prefix("file://") else { return text.to_owned() };
    let mut bytes = Vec::with_capacity(path.len());
    let mut rest = path.as_bytes();
    while let [first, behind @ ..] = rest {
        let code = behind.get(..2).filter(|_| *first == b'%');
        let code = code.and_then(|code| u8::from_str_radix(str::from_utf8(code).ok()?, 16).ok());
        bytes.push(code.unwrap_or(*first));
        rest = if code.is_some() { &behind[2..] } else { behind };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// The URI of a path.
pub(crate) fn uri_of(path: &str) -> Option<Uri> {
    if path.contains("://") {
        return Uri::from_str(path).ok();
    }
    let mut text = String::from("file://");
    for byte in path.bytes() {
        if byte.is_ascii_alphanumeric() || b"/-_.~".contains(&byte) {
            text.push(char::from(byte));
        } else {
            // Writing to a string does not fail.
            let _ = write!(text, "%{byte:02X}");
        }
    }
    Uri::from_str(&text).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_and_addresses_lead_to_each_other() {
        for path in ["/a/b.dgd", "/Größe und τ/50%.dgd", "untitled://x"] {
            let uri = uri_of(path).expect("an address");
            assert_eq!(path_of(&uri), path);
        }
    }
}
