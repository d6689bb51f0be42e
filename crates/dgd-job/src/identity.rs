//! Identifies the program and machine that compute results: equal identities give bitwise equal results.

use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use dgd_identify::journal::Digest;
use serde::{Deserialize, Serialize};

/// The program file, and the command that starts it again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProgramFile {
    /// The first words of its command line.
    pub start: Vec<OsString>,
    /// The program file.
    pub file: PathBuf,
}

impl ProgramFile {
    /// The program of this process.
    ///
    /// # Errors
    ///
    /// The system does not report the program file.
    pub fn this() -> io::Result<ProgramFile> {
        let file = std::env::current_exe()?;
        Ok(ProgramFile { start: vec![file.clone().into_os_string()], file })
    }
}

/// A build of dgd, and the platform that it runs on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct BuildIdentity {
    /// Version of dgd.
    pub version: String,
    /// Digest of the program's file.
    pub build: String,
    /// Processor and system, such as `x86_64-linux`.
    pub platform: String,
    /// Digest of results of the platform's elementary functions, to the last bit.
    pub arithmetic: String,
}

/// Number of parts that are digested in parallel, because a program has tens of megabytes.
const LANES: usize = 8;

impl BuildIdentity {
    /// The identity of a program on this machine.
    ///
    /// # Errors
    ///
    /// Its file cannot be read.
    pub fn read(program: &Path) -> io::Result<BuildIdentity> {
        Ok(BuildIdentity {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            build: shown(digest_in_lanes(&fs::read(program)?)),
            platform: format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS),
            arithmetic: shown(arithmetic()),
        })
    }

    /// Why results of the other identity are not valid for this one, as text after "this is"; `None` if they are.
    pub fn difference(&self, other: &BuildIdentity) -> Option<String> {
        let BuildIdentity { version, build, platform, arithmetic } = self;
        if version != &other.version {
            return Some(format!("dgd {version}, not {}", other.version));
        }
        if platform != &other.platform {
            return Some(format!("dgd for {platform}, not for {}", other.platform));
        }
        if build != &other.build {
            let (build, others) = (short(build), short(&other.build));
            return Some(format!("another build of dgd {version}, {build} and not {others}"));
        }
        (arithmetic != &other.arithmetic).then(|| {
            format!(
                "the same build of dgd {version} on another type of machine, whose `exp`, `log` or `sin` differ in \
                 their last digits"
            )
        })
    }
}

/// The end of a digest, enough to compare by eye.
fn short(digest: &str) -> &str {
    digest.len().checked_sub(8).and_then(|from| digest.get(from..)).unwrap_or(digest)
}

fn shown(digest: Digest) -> String {
    format!("fnv1a-128:{:032x}", digest.value())
}

/// The digest of the digests of equal parts of these bytes, computed in parallel.
fn digest_in_lanes(bytes: &[u8]) -> Digest {
    let length = bytes.len().div_ceil(LANES).max(1);
    let digests: Vec<u128> = std::thread::scope(|scope| {
        let one = |stretch| scope.spawn(move || Digest::EMPTY.bytes(stretch).value());
        let threads: Vec<_> = bytes.chunks(length).map(one).collect();
        // A digest does not panic.
        threads.into_iter().filter_map(|thread| thread.join().ok()).collect()
    });
    Digest::EMPTY.debug(&(bytes.len(), digests))
}

/// Digest of values of elementary functions over their ranges. Libraries and processors differ in the last digits.
fn arithmetic() -> Digest {
    let functions: [fn(f64) -> f64; 14] = [
        f64::exp,
        f64::exp_m1,
        f64::ln,
        f64::ln_1p,
        f64::log10,
        f64::sin,
        f64::cos,
        f64::tan,
        f64::atan,
        f64::sinh,
        f64::cosh,
        f64::tanh,
        f64::cbrt,
        f64::sqrt,
    ];
    let mut digest = Digest::EMPTY;
    let mut keep = |value: f64| digest = digest.bytes(&value.to_bits().to_le_bytes());
    for k in 1..=256_u32 {
        let x = f64::from(k) * 0.061_803_398_874_989;
        for function in functions {
            keep(function(x));
        }
        let inner = x / 16.0;
        let of_two = [inner.asin(), inner.acos(), x.powf(1.7), x.powf(-0.3), x.atan2(inner)];
        for value in of_two {
            keep(value);
        }
    }
    digest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_of_a_program_counts() {
        let mut bytes: Vec<u8> = (0..1003_u32).map(|k| (k * 7 % 251) as u8).collect();
        let whole = digest_in_lanes(&bytes);
        for place in 0..bytes.len() {
            bytes[place] ^= 1;
            assert_ne!(digest_in_lanes(&bytes), whole, "byte {place}");
            bytes[place] ^= 1;
        }
        assert_eq!(digest_in_lanes(&bytes), whole);
        assert_ne!(digest_in_lanes(&bytes[..1002]), whole);
        assert_ne!(digest_in_lanes(b""), digest_in_lanes(b"\0"));
    }

    #[test]
    fn a_copy_of_a_program_is_the_same_and_what_differs_is_named() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let path = |name: &str| folder.path().join(name);
        for (name, text) in [("a", "one"), ("copy", "one"), ("b", "two")] {
            fs::write(path(name), text).expect("the folder is writable");
        }
        let identity = |name: &str| BuildIdentity::read(&path(name)).expect("it is there");
        assert_eq!(identity("a").difference(&identity("copy")), None);
        let words = |other: BuildIdentity| identity("a").difference(&other).unwrap_or_default();
        assert!(words(identity("b")).contains("another build"), "{}", words(identity("b")));
        let others = [
            (BuildIdentity { version: "9.0.0".into(), ..identity("b") }, "not 9.0.0"),
            (BuildIdentity { platform: "z80-cpm".into(), ..identity("a") }, "not for z80-cpm"),
            (BuildIdentity { arithmetic: String::new(), ..identity("a") }, "type of machine"),
        ];
        for (other, part) in others {
            assert!(words(other.clone()).contains(part), "{}", words(other));
        }
    }
}
