//! Curves of tables in the graph.
//!
//! Nodes are a few numbers that are copied and compared, but a curve has many. So each curve is stored once for the
//! life of the process, and a node refers to it by number. Compilations of the same table share it; an editor's session
//! leaves one copy of each compiled version of a table.

pub mod interpolate;

use std::collections::BTreeMap;
use std::fmt;
use std::hash::{Hash, Hasher};
use std::sync::{Mutex, PoisonError};

pub use dgd_signature::Curve;

/// A curve and its properties.
#[derive(Debug, Clone, PartialEq)]
pub struct TableCurve {
    /// Its name in listings.
    pub name: String,
    /// Its polynomials.
    pub curve: Curve,
    /// Number of its continuous derivatives; −1 if it jumps.
    pub smooth: i8,
    /// Knots at which the slope of its table jumps, ascending.
    pub kinks: Vec<f64>,
    /// The first and the last point of its table.
    pub ends: [f64; 2],
    /// The message when its argument leaves its table, if a run ends there.
    pub limit: Option<String>,
}

/// A stored curve.
#[derive(Clone, Copy)]
pub struct CurveId {
    number: u32,
    curve: &'static TableCurve,
}

/// Stored curves, by their bits.
static KEPT: Mutex<BTreeMap<CurveKey, CurveId>> = Mutex::new(BTreeMap::new());

/// Texts, and numbers by their bits.
type CurveKey = (String, Option<String>, Vec<u64>);

impl TableCurve {
    /// Whether it interpolates points, rather than looking numbers up.
    pub fn is_table(&self) -> bool {
        self.smooth != i8::MAX
    }

    /// Whether it is a table that jumps.
    pub fn jumps(&self) -> bool {
        self.smooth < 0 && !self.kinks.is_empty()
    }
}

impl CurveId {
    /// Stores a curve.
    pub fn store(curve: TableCurve) -> Self {
        let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
        let number = u32::try_from(kept.len()).unwrap_or(u32::MAX);
        *kept.entry(key(&curve)).or_insert_with(|| {
            let curve: &'static TableCurve = Box::leak(Box::new(curve));
            Self { number, curve }
        })
    }

    /// Numbers by position, the first at 0: a step for each. Steps have no events because only counts vary along them.
    /// The message `limit` applies below the first and above the last.
    pub fn of_numbers(name: &str, numbers: &[f64], limit: Option<String>) -> Self {
        let last = numbers.len().saturating_sub(1);
        let knots: Vec<f64> = (0..last).map(|k| k as f64 + 0.5).collect();
        let pieces: Vec<[f64; 4]> = numbers.iter().map(|number| [*number, 0.0, 0.0, 0.0]).collect();
        Self::store(TableCurve {
            name: name.to_owned(),
            curve: Curve { knots: knots.into(), pieces: pieces.into() },
            smooth: i8::MAX,
            kinks: Vec::new(),
            ends: if limit.is_some() { [0.5, last as f64 - 0.5] } else { [0.0, last as f64] },
            limit,
        })
    }

    /// The curve.
    pub fn get(self) -> &'static TableCurve {
        self.curve
    }

    /// The value at x.
    pub fn value(self, x: f64) -> f64 {
        self.curve.curve.value(x)
    }

    /// Its derivative; `None` if that is zero everywhere.
    pub fn derivative(self) -> Option<Self> {
        let TableCurve { name, curve, smooth, ends, .. } = self.curve;
        let curve = curve.derivative();
        (!curve.is_zero()).then(|| {
            let (name, smooth) = (format!("{name}'"), smooth.saturating_sub(1));
            let (kinks, limit) = (Vec::new(), None);
            Self::store(TableCurve { name, curve, smooth, kinks, ends: *ends, limit })
        })
    }

    /// A number that depends only on the curve's content.
    pub fn digest(self) -> u64 {
        let (name, _, numbers) = key(self.curve);
        let bytes = name.bytes().map(u64::from);
        // FNV-1a over words.
        bytes.chain(numbers).fold(0xcbf2_9ce4_8422_2325, |digest, word| {
            (digest ^ word ^ (word >> 32)).wrapping_mul(0x0000_0100_0000_01b3)
        })
    }
}

fn key(curve: &TableCurve) -> CurveKey {
    let TableCurve { name, curve, smooth, kinks, ends, limit } = curve;
    let bits = |numbers: &[f64]| numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    let mut numbers = vec![u64::from(smooth.cast_unsigned()), curve.knots.len() as u64];
    numbers.extend(bits(&curve.knots));
    numbers.extend(curve.pieces.iter().flat_map(|piece| bits(piece)));
    numbers.extend(bits(kinks));
    numbers.extend(bits(ends));
    (name.clone(), limit.clone(), numbers)
}

impl PartialEq for CurveId {
    fn eq(&self, other: &Self) -> bool {
        self.number == other.number
    }
}

impl Eq for CurveId {}

impl Hash for CurveId {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.number.hash(state);
    }
}

impl fmt::Debug for CurveId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Curve({})", self.curve.name)
    }
}
