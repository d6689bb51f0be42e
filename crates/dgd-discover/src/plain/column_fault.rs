//! Faults of recorded columns.

use dgd_compiler::units::Unit;
use dgd_runtime::signature::Interpolation;

/// A possible fault of recorded columns.
#[derive(Debug, Clone)]
pub(crate) enum ColumnFault {
    /// A column is not in the unit that the model declares.
    Unit { name: String, unit: Unit, meant_in: Unit },
    /// Two columns are exchanged.
    Exchanged([String; 2]),
    /// An input is not interpolated as declared.
    Between { name: String, is: Interpolation },
    /// A column stays at one value; `lost` readings from that time are left out.
    Stuck { name: String, unit: Unit, since: Vec<StuckColumn>, lost: usize },
    /// Times of all recordings are in another unit than seconds.
    Clock { meant_in: Unit },
}

/// A recording in which a column is stuck.
#[derive(Debug, Clone)]
pub(crate) struct StuckColumn {
    /// Whether in a validation recording.
    pub(crate) is_held_out: bool,
    /// The position of the recording.
    pub(crate) recording: usize,
    /// The last time at which it was read, s.
    pub(crate) time: f64,
    /// The value at which it stays, SI.
    pub(crate) value: f64,
}

/// The keyword of the language.
pub(crate) fn between(is: Interpolation) -> &'static str {
    match is {
        Interpolation::Hold => "hold",
        Interpolation::Linear => "linear",
    }
}
