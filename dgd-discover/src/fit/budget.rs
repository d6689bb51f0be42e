//! How long a search may take.

use std::time::{Duration, Instant};

/// The end of a search that is given so much time.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Budget {
    end: Option<Instant>,
}

impl Budget {
    /// So many seconds from now; without a number, as long as it takes.
    pub(crate) fn new(seconds: Option<f64>) -> Budget {
        let length = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
        Budget { end: length.and_then(|length| Instant::now().checked_add(length)) }
    }

    /// Whether it is spent.
    pub(crate) fn is_spent(self) -> bool {
        self.end.is_some_and(|end| Instant::now() >= end)
    }
}

/// Why something was not tried after that.
pub(crate) fn not_tried() -> String {
    "not tried: the time that the search was given had passed".to_owned()
}
