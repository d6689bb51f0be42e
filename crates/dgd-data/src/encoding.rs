//! Detects files that are not UTF-8 text by their first bytes.

/// Why bytes are not the text of a table or a model, with advice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct NotText {
    pub(crate) message: &'static str,
    pub(crate) help: &'static str,
}

const UTF_16: NotText = NotText {
    message: "its text is UTF-16",
    help: "save it as UTF-8, or convert it: `iconv -f UTF-16 -t UTF-8 OLD > NEW`",
};

const UTF_32: NotText = NotText {
    message: "its text is UTF-32",
    help: "save it as UTF-8, or convert it: `iconv -f UTF-32 -t UTF-8 OLD > NEW`",
};

/// Magic bytes of file types; a longer one comes before its prefix.
const BEGINNINGS: &[(&[u8], NotText)] = &[
    (
        b"PK\x03\x04",
        NotText { message: "it is a spreadsheet or a zip archive", help: "save the sheet as CSV" },
    ),
    (b"\xd0\xcf\x11\xe0", NotText { message: "it is a spreadsheet", help: "save it as CSV" }),
    (b"\xff\xfe\0\0", UTF_32),
    (b"\0\0\xfe\xff", UTF_32),
    (b"\xff\xfe", UTF_16),
    (b"\xfe\xff", UTF_16),
];

/// Number of bytes checked for those that text cannot contain.
const LOOKED_AT: usize = 1024;

/// The kind of a file that is not UTF-8 text, by its first bytes; `None` if it is not recognised.
pub(crate) fn not_text(head: &[u8]) -> Option<NotText> {
    if let Some((_, why)) = BEGINNINGS.iter().find(|(magic, _)| head.starts_with(magic)) {
        return Some(*why);
    }
    let head = &head[..head.len().min(LOOKED_AT)];
    let zeros = |odd: usize| head.iter().skip(odd).step_by(2).filter(|byte| **byte == 0).count();
    // In Latin text as UTF-16, every other byte is zero; which one gives the byte order.
    match (zeros(0), zeros(1)) {
        (0, 0) => None,
        (0, n) if 4 * n > head.len() => Some(NotText { help: UTF_16_LE, ..UTF_16 }),
        (n, 0) if 4 * n > head.len() => Some(NotText { help: UTF_16_BE, ..UTF_16 }),
        _ => Some(NotText {
            message: "it is not a text: it has NUL bytes",
            help: "save it as UTF-8",
        }),
    }
}

/// Without a byte order mark, only the bytes reveal the order.
const UTF_16_LE: &str = "save it as UTF-8, or convert it: `iconv -f UTF-16LE -t UTF-8 OLD > NEW`";
const UTF_16_BE: &str = "save it as UTF-8, or convert it: `iconv -f UTF-16BE -t UTF-8 OLD > NEW`";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_in_other_encodings_are_known_with_and_without_a_mark() {
        let units: Vec<u16> = "time [s],q [lpm]\n0,1\n".encode_utf16().collect();
        let little: Vec<u8> = units.iter().flat_map(|unit| unit.to_le_bytes()).collect();
        let big: Vec<u8> = units.iter().flat_map(|unit| unit.to_be_bytes()).collect();
        let marked = [&b"\xff\xfe"[..], &little].concat();
        for (bytes, help) in [(&marked, "-f UTF-16 "), (&little, "UTF-16LE"), (&big, "UTF-16BE")] {
            let why = not_text(bytes).expect("no UTF-8");
            assert!(why.message.contains("UTF-16") && why.help.contains(help), "{why:?}");
        }
        assert_eq!(not_text(b"\xff\xfe\0\0t\0\0\0").map(|why| why.message), Some(UTF_32.message));
        assert!(not_text(b"time [s],q\0\n").is_some_and(|why| why.message.contains("NUL")));
        assert_eq!(not_text("time [s],ρ [kg/m^3]\n".as_bytes()), None);
        assert_eq!(not_text(b""), None);
    }
}
