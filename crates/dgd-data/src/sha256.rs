//! SHA-256 digests of data, which `sha256sum` can check.

use std::fmt;
use std::io::{self, Read};

use sha2::{Digest, Sha256};

/// A SHA-256 digest; its text is `sha256:` and 64 hexadecimal digits.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Sha256Digest([u8; 32]);

impl Sha256Digest {
    /// The digest of these parts, one after the other.
    pub fn from_parts<T: AsRef<[u8]>>(parts: impl IntoIterator<Item = T>) -> Self {
        let hasher = parts.into_iter().fold(Sha256::new(), Sha256::chain_update);
        Self::finished(hasher)
    }

    pub(crate) fn finished(hasher: Sha256) -> Self {
        Sha256Digest(hasher.finalize().into())
    }

    /// The digest of all bytes.
    ///
    /// # Errors
    ///
    /// Those of reading.
    pub fn read(input: impl Read) -> io::Result<Self> {
        let mut input = DigestingReader::new(input);
        io::copy(&mut input, &mut io::sink())?;
        Ok(input.digest())
    }
}

impl fmt::Display for Sha256Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("sha256:")?;
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for Sha256Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// Digests bytes as they are read.
pub(crate) struct DigestingReader<R> {
    input: R,
    hasher: Sha256,
}

impl<R: Read> DigestingReader<R> {
    pub(crate) fn new(input: R) -> Self {
        DigestingReader { input, hasher: Sha256::new() }
    }

    /// The digest of the bytes read so far.
    pub(crate) fn digest(self) -> Sha256Digest {
        Sha256Digest::finished(self.hasher)
    }
}

impl<R: Read> Read for DigestingReader<R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let n = self.input.read(bytes)?;
        self.hasher.update(&bytes[..n]);
        Ok(n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_digest_is_what_sha256sum_prints() {
        // An example of FIPS 180-4.
        let text = "sha256:ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(Sha256Digest::read(b"abc".as_slice()).expect("readable").to_string(), text);
        assert_eq!(Sha256Digest::from_parts(["a", "bc"]).to_string(), text);
    }
}
