//! A place with its missing input, and the reason why it is implausible.

use dgd_identify::Starts;
use dgd_runtime::Solution;

use super::missing_terms::MissingPlace;
use crate::noise::SignalWindow;

/// The missing input at a place.
#[derive(Debug, Clone)]
pub struct MissingInput {
    /// The place.
    pub place: MissingPlace,
    /// The unit of `value` and `std`.
    pub unit: String,
    /// Times of the first training recording, s.
    pub times: Vec<f64>,
    /// The smoothed estimate: the missing term on an equation's right-hand side, the values of a parameter, or the
    /// error of an input or a sensor.
    pub value: Vec<f64>,
    /// Its standard deviation.
    pub std: Vec<f64>,
    /// Windows in which it stands out.
    pub windows: Vec<SignalWindow>,
    /// Gain in log-likelihood over nothing missing, of validation readings if there are any.
    pub gain: f64,
}

impl MissingInput {
    /// Name of the place in a result: an equation's label, a parameter, an input or `sensor NAME`.
    pub fn target(&self) -> String {
        self.place.called()
    }
}

/// The missing input at a place in one recording, for comparison with formulas.
#[derive(Debug, Clone)]
pub(crate) struct PlaceTrace {
    /// Times, s.
    pub(crate) times: Vec<f64>,
    /// d, SI.
    pub(crate) d: Vec<f64>,
    /// Its standard deviation.
    pub(crate) std: Vec<f64>,
    /// Start values of the recording.
    pub(crate) start: Starts,
    /// Correlation time of the errors of d, s.
    pub(crate) resolved: f64,
    /// The trajectory that includes d, if it is that of a filter.
    pub(crate) followed: Option<Solution>,
}

/// A place with its traces.
#[derive(Debug, Clone)]
pub(crate) struct FoundPlace {
    pub(crate) missing: MissingInput,
    /// All parameters, SI, that belong to the traces.
    pub(crate) p: Vec<f64>,
    /// Traces of the training recordings; the validation recordings follow.
    pub(crate) train: Vec<PlaceTrace>,
    pub(crate) valid: Vec<PlaceTrace>,
    /// Windows in which it stands out in each training recording.
    pub(super) windows: Vec<Vec<SignalWindow>>,
    /// Mean square of the residuals relative to the noise in simulations of the training recordings with its traces, at
    /// most that of the readings about their mean.
    pub(crate) left: f64,
    /// The unknowns along the first training recording.
    pub(crate) course: Option<Solution>,
    /// The reason why it is implausible.
    pub(crate) objection: Option<PlaceObjection>,
}

impl FoundPlace {
    /// Whether its traces were estimated along the trajectory of a filter.
    pub(crate) fn is_followed(&self) -> bool {
        self.train.iter().any(|trace| trace.followed.is_some())
    }
}

/// Why a place is implausible.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PlaceObjection {
    /// A parameter would change its sign.
    Sign,
    /// A parameter would leave its bounds.
    Bounds,
    /// The error of a sensor or of an input would vary more than its readings.
    Size,
}

/// Windows in which the missing term at one place stands out in each training recording.
pub(crate) fn windows(found: &FoundPlace) -> Vec<Vec<[f64; 2]>> {
    let ends = |windows: &Vec<SignalWindow>| windows.iter().map(|w| [w.from, w.until]).collect();
    found.windows.iter().map(ends).collect()
}
