//! How long a search may take.

use std::time::{Duration, Instant};

/// Share of the time that is kept for saying where something is missing, with or without a name.
const KEPT: f64 = 0.3;

/// The end of a search that is given so much time.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Budget {
    /// When the search for names ends, and when that for places and formulas does.
    ends: Option<[Instant; 2]>,
}

impl Budget {
    /// So many seconds from now; without a number, as long as it takes.
    pub(crate) fn new(seconds: Option<f64>) -> Budget {
        let ends = |all: f64| {
            // Where nobody asks for a budget no clock is read: WebAssembly has none.
            let now = Instant::now();
            let after = |seconds: f64| now.checked_add(Duration::try_from_secs_f64(seconds).ok()?);
            Some([after((1.0 - KEPT) * all)?, after(all)?])
        };
        Budget { ends: seconds.and_then(ends) }
    }

    /// Whether the time for names is over.
    pub(crate) fn is_spent(self) -> bool {
        self.ends.is_some_and(|[of_names, _]| Instant::now() >= of_names)
    }

    /// Whether all of it is spent.
    pub(crate) fn is_over(self) -> bool {
        self.ends.is_some_and(|[_, of_all]| Instant::now() >= of_all)
    }
}
