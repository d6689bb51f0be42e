//! The time budget of a search.

use std::time::{Duration, Instant};

/// Share of the time reserved for the search for places and formulas.
const KEPT: f64 = 0.3;

/// The deadlines of a search.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct SearchBudget {
    /// Deadlines of the search for names, and of that for places and formulas.
    ends: Option<[Instant; 2]>,
}

impl SearchBudget {
    /// Ends after this many seconds from now; `None` means no limit.
    pub(crate) fn new(seconds: Option<f64>) -> SearchBudget {
        let ends = |all: f64| {
            // Without a budget no clock is read: WebAssembly has none.
            let now = Instant::now();
            let after = |seconds: f64| now.checked_add(Duration::try_from_secs_f64(seconds).ok()?);
            Some([after((1.0 - KEPT) * all)?, after(all)?])
        };
        SearchBudget { ends: seconds.and_then(ends) }
    }

    /// Whether the time for the search for names is over.
    pub(crate) fn is_spent(self) -> bool {
        self.ends.is_some_and(|[of_names, _]| Instant::now() >= of_names)
    }

    /// Whether all of the time is over.
    pub(crate) fn is_over(self) -> bool {
        self.ends.is_some_and(|[_, of_all]| Instant::now() >= of_all)
    }
}
