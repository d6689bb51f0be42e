//! Parsers for values that only the command line has.

/// An amount of memory.
pub(super) fn size(text: &str) -> Result<u64, String> {
    dgd_job::bytes(text).ok_or_else(|| "this must be a size, as in 500MB or 2GB".to_owned())
}

/// A port on this machine; 0 selects a free one.
pub(super) fn port(text: &str) -> Result<u16, String> {
    text.parse().map_err(|_| {
        "this must be a port, a whole number from 1 to 65535, or 0 for a free one".to_owned()
    })
}
