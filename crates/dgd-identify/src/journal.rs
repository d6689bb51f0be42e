//! Results of long computations, stored so that an interrupted run can continue.
//!
//! Each result is a bit-exact function of its key: looking it up gives the same result as computing it again.
//!
//! ```text
//!   key = digest of all arguments          Digest of their `{:?}` output, in which numbers are exact
//!   journal has the key?  yes: read it     Kept::read
//!                         no:  compute and store it    Kept::write
//! ```

use std::convert::Infallible;
use std::fmt::{self, Write as _};

use dgd_runtime::Direction;

use crate::{BoundReached, ParameterEstimate};

/// A store of results.
pub trait Journal: fmt::Debug + Sync {
    /// The result stored under this key.
    fn find(&self, key: u128) -> Option<Vec<u8>>;

    /// Stores a result. It may be lost, but a result that is found is complete.
    fn keep(&self, key: u128, result: &[u8]);

    /// Whether it ever stores anything; if not, keys need not be computed.
    fn is_of_use(&self) -> bool {
        true
    }
}

/// A journal that stores nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoJournal;

impl Journal for NoJournal {
    fn find(&self, _key: u128) -> Option<Vec<u8>> {
        None
    }

    fn keep(&self, _key: u128, _result: &[u8]) {}

    fn is_of_use(&self) -> bool {
        false
    }
}

/// A journal, and the arguments of all its results that are not in their keys.
#[derive(Debug, Clone, Copy)]
pub struct JournalScope<'a> {
    /// The store.
    pub journal: &'a dyn Journal,
    /// Digest of arguments outside of the computation, such as the text of a model.
    pub of: Digest,
}

impl JournalScope<'_> {
    /// A journal that stores nothing.
    pub const NOTHING: JournalScope<'static> =
        JournalScope { journal: &NoJournal, of: Digest::EMPTY };

    /// The digest of further arguments appended to the common ones; `None` if nothing is stored.
    pub fn digest(&self, arguments: impl FnOnce(Digest) -> Digest) -> Option<Digest> {
        self.journal.is_of_use().then(|| arguments(self.of))
    }
}

/// The result under a key; computed and stored if it is not there.
pub fn kept<T: Journaled>(journal: &dyn Journal, key: u128, compute: impl FnOnce() -> T) -> T {
    let computed = kept_success(journal, key, || Ok::<T, Infallible>(compute()));
    computed.unwrap_or_else(|never| match never {})
}

/// [`kept`] for computations that may fail: failures are not stored.
///
/// # Errors
///
/// That of the computation.
pub fn kept_success<T: Journaled, E>(
    journal: &dyn Journal,
    key: u128,
    compute: impl FnOnce() -> Result<T, E>,
) -> Result<T, E> {
    let read = |bytes: Vec<u8>| {
        let mut rest = bytes.as_slice();
        T::read(&mut rest).filter(|_| rest.is_empty())
    };
    if let Some(found) = journal.find(key).and_then(read) {
        return Ok(found);
    }
    let result = compute()?;
    let mut bytes = Vec::new();
    result.write(&mut bytes);
    journal.keep(key, &bytes);
    Ok(result)
}

/// A platform-independent digest of bytes: 128-bit FNV-1a.
///
/// # Source
///
/// Fowler, Noll, Vo, Eastlake, The FNV Non-Cryptographic Hash Algorithm, draft-eastlake-fnv.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Digest(u128);

impl Digest {
    /// The digest of no bytes.
    pub const EMPTY: Self = Self(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d);

    const PRIME: u128 = 0x0000_0000_0100_0000_0000_0000_0000_013b;

    /// The digest with these bytes appended.
    #[must_use]
    pub fn bytes(mut self, bytes: &[u8]) -> Self {
        for byte in bytes {
            self.0 = (self.0 ^ u128::from(*byte)).wrapping_mul(Self::PRIME);
        }
        self
    }

    /// The digest with the `{:?}` output of a value, which distinguishes all finite numbers, and a terminator appended.
    #[must_use]
    pub fn debug(mut self, value: &dyn fmt::Debug) -> Self {
        // Writing to a digest cannot fail.
        let _ = write!(self, "{value:?}");
        self.bytes(&[0])
    }

    /// The number.
    pub fn value(self) -> u128 {
        self.0
    }
}

impl fmt::Write for Digest {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        *self = self.bytes(text.as_bytes());
        Ok(())
    }
}

/// Values that can be stored bit-exactly.
pub trait Journaled: Sized {
    /// Appends its bytes.
    fn write(&self, bytes: &mut Vec<u8>);

    /// Reads it from the beginning of the bytes; `None` if they are invalid.
    fn read(bytes: &mut &[u8]) -> Option<Self>;
}

/// Implements [`Journaled`] for a struct whose fields all do: `keep_by_fields!(Point { x, y })`.
#[macro_export]
macro_rules! keep_by_fields {
    ($of:ty { $($field:ident),+ }) => {
        impl $crate::journal::Journaled for $of {
            fn write(&self, bytes: &mut Vec<u8>) {
                let Self { $($field),+ } = self;
                $($crate::journal::Journaled::write($field, bytes);)+
            }

            fn read(bytes: &mut &[u8]) -> Option<Self> {
                Some(Self { $($field: $crate::journal::Journaled::read(bytes)?),+ })
            }
        }
    };
}

impl Journaled for u64 {
    fn write(&self, bytes: &mut Vec<u8>) {
        bytes.extend(self.to_le_bytes());
    }

    fn read(bytes: &mut &[u8]) -> Option<Self> {
        let (first, rest) = bytes.split_first_chunk()?;
        *bytes = rest;
        Some(Self::from_le_bytes(*first))
    }
}

impl Journaled for usize {
    fn write(&self, bytes: &mut Vec<u8>) {
        (*self as u64).write(bytes);
    }

    fn read(bytes: &mut &[u8]) -> Option<Self> {
        usize::try_from(u64::read(bytes)?).ok()
    }
}

impl Journaled for f64 {
    fn write(&self, bytes: &mut Vec<u8>) {
        self.to_bits().write(bytes);
    }

    fn read(bytes: &mut &[u8]) -> Option<Self> {
        Some(Self::from_bits(u64::read(bytes)?))
    }
}

impl Journaled for bool {
    fn write(&self, bytes: &mut Vec<u8>) {
        bytes.push(u8::from(*self));
    }

    fn read(bytes: &mut &[u8]) -> Option<Self> {
        let (first, rest) = bytes.split_first()?;
        *bytes = rest;
        match first {
            0 => Some(false),
            1 => Some(true),
            _ => None,
        }
    }
}

impl Journaled for String {
    fn write(&self, bytes: &mut Vec<u8>) {
        self.len().write(bytes);
        bytes.extend(self.as_bytes());
    }

    fn read(bytes: &mut &[u8]) -> Option<Self> {
        let length = usize::read(bytes)?;
        let (text, rest) = bytes.split_at_checked(length)?;
        *bytes = rest;
        Some(std::str::from_utf8(text).ok()?.to_owned())
    }
}

impl<T: Journaled> Journaled for Option<T> {
    fn write(&self, bytes: &mut Vec<u8>) {
        self.is_some().write(bytes);
        if let Some(value) = self {
            value.write(bytes);
        }
    }

    fn read(bytes: &mut &[u8]) -> Option<Self> {
        Some(if bool::read(bytes)? { Some(T::read(bytes)?) } else { None })
    }
}

impl<T: Journaled, E: Journaled> Journaled for Result<T, E> {
    fn write(&self, bytes: &mut Vec<u8>) {
        self.is_ok().write(bytes);
        match self {
            Ok(value) => value.write(bytes),
            Err(error) => error.write(bytes),
        }
    }

    fn read(bytes: &mut &[u8]) -> Option<Self> {
        Some(if bool::read(bytes)? { Ok(T::read(bytes)?) } else { Err(E::read(bytes)?) })
    }
}

impl<T: Journaled> Journaled for Vec<T> {
    fn write(&self, bytes: &mut Vec<u8>) {
        self.len().write(bytes);
        for value in self {
            value.write(bytes);
        }
    }

    fn read(bytes: &mut &[u8]) -> Option<Self> {
        let length = usize::read(bytes)?;
        // Reserves no more than possible: each element takes at least one byte.
        let mut values = Vec::with_capacity(length.min(bytes.len()));
        for _ in 0..length {
            values.push(T::read(bytes)?);
        }
        Some(values)
    }
}

impl<A: Journaled, B: Journaled> Journaled for (A, B) {
    fn write(&self, bytes: &mut Vec<u8>) {
        self.0.write(bytes);
        self.1.write(bytes);
    }

    fn read(bytes: &mut &[u8]) -> Option<Self> {
        Some((A::read(bytes)?, B::read(bytes)?))
    }
}

impl<T: Journaled, const N: usize> Journaled for [T; N] {
    fn write(&self, bytes: &mut Vec<u8>) {
        for value in self {
            value.write(bytes);
        }
    }

    fn read(bytes: &mut &[u8]) -> Option<Self> {
        let values: Option<Vec<T>> = (0..N).map(|_| T::read(bytes)).collect();
        values?.try_into().ok()
    }
}

impl Journaled for Direction {
    fn write(&self, bytes: &mut Vec<u8>) {
        let (is_start, place) = match *self {
            Self::Parameter(place) => (false, place),
            Self::Start(place) => (true, place),
        };
        (is_start, place).write(bytes);
    }

    fn read(bytes: &mut &[u8]) -> Option<Self> {
        let (is_start, place) = Journaled::read(bytes)?;
        Some(if is_start { Self::Start(place) } else { Self::Parameter(place) })
    }
}

impl Journaled for BoundReached {
    fn write(&self, bytes: &mut Vec<u8>) {
        (*self == Self::Upper).write(bytes);
    }

    fn read(bytes: &mut &[u8]) -> Option<Self> {
        Some(if bool::read(bytes)? { Self::Upper } else { Self::Lower })
    }
}

keep_by_fields!(ParameterEstimate { name, of, recording, value, std, at_bound });

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_digest_is_that_of_the_standard() {
        // Its authors' test vectors.
        assert_eq!(Digest::EMPTY.bytes(b"a").value(), 0xd228_cb69_6f1a_8caf_7891_2b70_4e4a_8964);
        assert_eq!(
            Digest::EMPTY.bytes(b"foobar").value(),
            0x343e_1662_793c_64bf_6f0d_3597_ba44_6f18
        );
        // Adjacent values do not merge.
        let of = |a: &str, b: &str| Digest::EMPTY.debug(&a).debug(&b);
        assert_ne!(of("ab", "c"), of("a", "bc"));
        let (one, next) = (1.0_f64, 1.0_f64.next_up());
        assert_ne!(Digest::EMPTY.debug(&one), Digest::EMPTY.debug(&next));
    }

    #[test]
    fn what_is_kept_comes_back_to_the_bit_and_torn_bytes_do_not() {
        type All = Vec<(Result<Option<f64>, String>, Vec<(usize, bool)>)>;
        let all: All = vec![
            (Ok(Some(-0.0)), vec![(0, true), (usize::MAX, false)]),
            (Ok(None), vec![]),
            (Err("ϑ".to_owned()), vec![(7, true)]),
        ];
        let mut bytes = Vec::new();
        all.write(&mut bytes);
        let mut rest = bytes.as_slice();
        let back = All::read(&mut rest).expect("whole");
        assert_eq!((&back, rest.len()), (&all, 0));
        assert!(matches!(back[0].0, Ok(Some(zero)) if zero.is_sign_negative()));
        for length in 0..bytes.len() {
            assert_eq!(All::read(&mut &bytes[..length]), None, "of {length} bytes");
        }
    }
}
