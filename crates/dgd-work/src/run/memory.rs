//! Memory checks for runs, fits, searches and ensembles.

use dgd_compiler::argument::Argument;
use dgd_compiler::sentence;
use dgd_compiler::sentence::Sentence;

use crate::error::{ComputationError, WorkError};

/// Approximate number of work vectors of all unknowns in a run.
const VECTORS: f64 = 40.0;

/// Memory for one purpose.
pub(crate) struct MemoryDemand {
    bytes: f64,
    /// Its purpose, and how to reduce it.
    reason: Sentence,
}

/// Sizes of the rows and of the work space of a run.
#[derive(Clone, Copy)]
pub(crate) struct MemoryNeeds {
    pub unknowns: usize,
    /// Number of unknowns kept at each row.
    pub kept: usize,
    pub outputs: usize,
    pub inputs: usize,
    pub directions: usize,
    pub rows: usize,
}

impl MemoryNeeds {
    /// Bytes of the rows: results, and the columns made from them.
    fn of_rows(&self) -> f64 {
        let values = (self.kept + self.outputs) as f64 * (1.0 + self.directions as f64);
        8.0 * self.rows as f64 * (1.0 + self.inputs as f64 + 2.0 * values)
    }

    /// Bytes of work space.
    fn of_work(&self) -> f64 {
        8.0 * VECTORS * self.unknowns as f64 * (1.0 + self.directions as f64)
    }

    fn derivatives(&self) -> String {
        match self.directions {
            0 => String::new(),
            1 => " with a derivative each".to_owned(),
            n => format!(" with {n} derivatives each"),
        }
    }

    /// "1000 rows of 3 unknowns and 1 output".
    fn rows(&self) -> String {
        let values = match (self.kept, self.outputs) {
            (0, outputs) => counted(outputs, "output"),
            (kept, 0) => counted(kept, "unknown"),
            (kept, outputs) => {
                format!("{} and {}", counted(kept, "unknown"), counted(outputs, "output"))
            }
        };
        format!("{} of {values}{}", counted(self.rows, "row"), self.derivatives())
    }

    /// Demands of a run.
    pub(crate) fn demands(&self) -> [MemoryDemand; 2] {
        let (fewer, smaller) = if self.directions == 0 {
            (Sentence::default(), "a smaller model".into())
        } else {
            let fewer = sentence!["fewer derivatives (", Argument::To, ")"];
            (sentence![", or for ", &fewer], fewer)
        };
        let (rows, derivatives) = (self.rows(), self.derivatives());
        let unknowns = counted(self.unknowns, "unknown");
        [
            MemoryDemand {
                bytes: self.of_rows(),
                reason: sentence![format!("it keeps {rows}; "), fewer_rows(), fewer],
            },
            MemoryDemand {
                bytes: self.of_work(),
                reason: sentence![format!("it steps {unknowns}{derivatives}; ask for "), smaller],
            },
        ]
    }

    /// Demands of this many parallel runs, one for each recording, from which `estimates` numbers are estimated.
    /// `self.directions` counts the derivatives kept at each row.
    pub(crate) fn demands_of_fit(
        &self,
        side_by_side: usize,
        recordings: usize,
        estimates: usize,
    ) -> [MemoryDemand; 3] {
        let runs = side_by_side as f64;
        let work = MemoryNeeds { directions: estimates, ..*self };
        let at_once = match side_by_side {
            1 => String::new(),
            n => format!("{n} recordings at a time, each with "),
        };
        let threads = if side_by_side > 1 {
            sentence![", or ", fewer_threads()]
        } else {
            Sentence::default()
        };
        let fewer_numbers = sentence!["estimate fewer numbers (", Argument::Fix, ")"];
        let unknowns = counted(self.unknowns, "unknown");
        let (rows, derivatives) = (self.rows(), work.derivatives());
        // A square matrix for each output of each recording.
        let squares = 8.0 * (recordings * self.outputs.max(1)) as f64 * (estimates as f64).powi(2);
        [
            MemoryDemand {
                bytes: runs * self.of_rows(),
                reason: sentence![
                    format!("it simulates {at_once}{rows}; use shorter recordings ("),
                    Argument::From,
                    ", ",
                    Argument::Until,
                    ")",
                    &threads
                ],
            },
            MemoryDemand {
                bytes: runs * work.of_work(),
                reason: sentence![
                    format!("it steps {at_once}{unknowns}{derivatives}; "),
                    &fewer_numbers,
                    threads
                ],
            },
            MemoryDemand {
                bytes: squares,
                reason: sentence![
                    format!(
                        "it finds {} from {}; ",
                        counted(estimates, "estimate"),
                        counted(recordings, "recording")
                    ),
                    fewer_numbers
                ],
            },
        ]
    }

    /// Demands of an ensemble: `packed` simultaneous runs that keep all unknowns, and `held` results with this many
    /// columns.
    pub(crate) fn demands_of_ensemble(
        &self,
        packed: usize,
        held: usize,
        columns: usize,
    ) -> [MemoryDemand; 2] {
        let (rows, columns_text) = (counted(self.rows, "row"), counted(columns, "column"));
        [
            MemoryDemand {
                bytes: packed as f64 * (self.of_rows() + self.of_work()),
                reason: sentence![
                    format!("it runs {packed} sets at a time, each with {}; ", self.rows()),
                    fewer_rows(),
                    " or ",
                    fewer_threads()
                ],
            },
            MemoryDemand {
                bytes: 8.0 * held as f64 * self.rows as f64 * columns as f64,
                reason: sentence![
                    format!("it keeps {rows} of {columns_text} for {}; ", counted(held, "set")),
                    fewer_rows(),
                    " or fewer sets, or write a table (",
                    Argument::Out.with("x.csv"),
                    ") without ",
                    Argument::Plot
                ],
            },
        ]
    }
}

fn fewer_rows() -> Sentence {
    sentence![
        "ask for fewer rows (",
        Argument::Every,
        ", ",
        Argument::From,
        ", ",
        Argument::Until,
        ")"
    ]
}

fn fewer_threads() -> Sentence {
    sentence!["fewer threads (", Argument::Threads, ")"]
}

fn counted(count: usize, what: &str) -> String {
    match count {
        1 => format!("1 {what}"),
        count => format!("{count} {what}s"),
    }
}

/// Refuses work that needs more memory than is free; `what` names it.
pub(crate) fn verify(what: &str, demands: &[MemoryDemand]) -> Result<(), WorkError> {
    within(what, demands, available())
}

fn within(what: &str, demands: &[MemoryDemand], available: Option<f64>) -> Result<(), WorkError> {
    let needed: f64 = demands.iter().map(|demand| demand.bytes).sum();
    // No machine has more, whatever its system reports.
    let available = available.unwrap_or(MOST);
    let largest = demands.iter().max_by(|a, b| a.bytes.total_cmp(&b.bytes));
    match largest {
        Some(largest) if needed > available => {
            let (what, reason) = (what.to_owned(), largest.reason.clone());
            Err(ComputationError::Memory { what, needed, available, reason }.into())
        }
        _ => Ok(()),
    }
}

/// Assumed memory if a system does not report it: a terabyte.
const MOST: f64 = 1e12;

/// Bytes that a process can still allocate, including disk space for scratch data. `None` if the system does not report
/// it.
fn available() -> Option<f64> {
    let on_disk = dgd_scratch::room().map_or(0.0, |bytes| bytes as f64);
    free_memory().map(|free| free + on_disk)
}

/// Memory that Linux reports as available, less if a control group or this process has a limit.
fn free_memory() -> Option<f64> {
    let of_machine = std::fs::read_to_string("/proc/meminfo").ok()?;
    let free = field(&of_machine, "MemAvailable:")? * 1024.0;
    let of_group = |file: &str| -> Option<f64> {
        std::fs::read_to_string(format!("/sys/fs/cgroup/{file}")).ok()?.trim().parse().ok()
    };
    let left =
        of_group("memory.max").zip(of_group("memory.current")).map(|(most, used)| most - used);
    let of_this = |file: &str| std::fs::read_to_string(format!("/proc/self/{file}")).ok();
    let of_process = of_this("limits").zip(of_this("status")).and_then(|(limits, status)| {
        // Its first number; `unlimited` is not one.
        Some(field(&limits, "Max address space")? - field(&status, "VmSize:")? * 1024.0)
    });
    let most = left.into_iter().chain(of_process).map(|left| left.max(0.0));
    Some(most.fold(free, f64::min))
}

/// The number after a name at the start of a line.
fn field(text: &str, name: &str) -> Option<f64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn needs() -> MemoryNeeds {
        MemoryNeeds {
            unknowns: 1_000_000,
            kept: 3,
            outputs: 2,
            inputs: 1,
            directions: 0,
            rows: 1000,
        }
    }

    fn refusal(what: &str, demands: &[MemoryDemand], available: f64) -> String {
        match within(what, demands, Some(available)) {
            Err(error @ WorkError::Computation(_)) => error.to_string(),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_run_needs_memory_for_what_it_keeps() {
        // Forty vectors, and little else.
        assert!(within("the run", &needs().demands(), Some(0.33e9)).is_ok());
        assert_eq!(
            refusal("the run", &needs().demands(), 0.3e9),
            "the run needs about 320 MB of memory, and 300 MB is free: it steps 1000000 unknowns; \
             ask for a smaller model"
        );
        let full = MemoryNeeds { kept: 1_000_000, directions: 4, ..needs() };
        assert_eq!(
            refusal("the run", &full.demands(), 2e9),
            "the run needs about 82 GB of memory, and 2.0 GB is free: it keeps 1000 rows of \
             1000000 unknowns and 2 outputs with 4 derivatives each; ask for fewer rows \
             (`every`, `from`, `until`), or for fewer derivatives (`to`)"
        );
    }

    #[test]
    fn a_fit_needs_memory_for_recordings_side_by_side_and_for_its_estimates() {
        let small = MemoryNeeds { unknowns: 3, kept: 3, ..needs() };
        assert!(within("the fit", &small.demands_of_fit(2, 5, 4), Some(1e6)).is_ok());
        let full = MemoryNeeds { kept: 1_000_000, ..needs() };
        assert_eq!(
            refusal("the fit", &full.demands_of_fit(2, 5, 1), 20e9),
            "the fit needs about 33 GB of memory, and 20 GB is free: it simulates 2 recordings at a \
             time, each with 1000 rows of 1000000 unknowns and 2 outputs; use shorter recordings \
             (`from`, `until`), or fewer threads (`threads`)"
        );
        assert_eq!(
            refusal("the fit", &MemoryNeeds { rows: 2, ..full }.demands_of_fit(1, 1, 100), 20e9),
            "the fit needs about 32 GB of memory, and 20 GB is free: it steps 1000000 unknowns with \
             100 derivatives each; estimate fewer numbers (`fix`)"
        );
        assert_eq!(
            refusal("the fit", &small.demands_of_fit(1, 1, 100_000), 20e9),
            "the fit needs about 160 GB of memory, and 20 GB is free: it finds 100000 estimates from \
             1 recording; estimate fewer numbers (`fix`)"
        );
    }

    #[test]
    fn an_ensemble_needs_memory_for_the_sets_under_way_and_those_it_holds() {
        let small = MemoryNeeds { unknowns: 3, kept: 3, ..needs() };
        assert!(within("the ensemble", &small.demands_of_ensemble(16, 128, 6), Some(1e8)).is_ok());
        assert_eq!(
            refusal("the ensemble", &small.demands_of_ensemble(16, 1_000_000, 6), 1e9),
            "the ensemble needs about 48 GB of memory, and 1.0 GB is free: it keeps 1000 rows of 6 \
             columns for 1000000 sets; ask for fewer rows (`every`, `from`, `until`) or fewer \
             sets, or write a table (`out = x.csv`) without `plot`"
        );
        let full = MemoryNeeds { kept: 1_000_000, ..needs() };
        assert_eq!(
            refusal("the ensemble", &full.demands_of_ensemble(8, 64, 3), 1e9),
            "the ensemble needs about 131 GB of memory, and 1.0 GB is free: it runs 8 sets at a time, \
             each with 1000 rows of 1000000 unknowns and 2 outputs; ask for fewer rows (`every`, \
             `from`, `until`) or fewer threads (`threads`)"
        );
    }

    #[test]
    fn the_free_memory_is_a_line_of_its_own() {
        let text = "MemTotal:  100 kB\nMemFree:  10 kB\nMemAvailable:   42 kB\n";
        assert_eq!(field(text, "MemAvailable:"), Some(42.0));
        assert_eq!(field(text, "MemNothing:"), None);
        let limits = "Limit   Soft Limit   Hard Limit   Units\n\
                      Max address space         4096000   unlimited   bytes\n";
        assert_eq!(field(limits, "Max address space"), Some(4_096_000.0));
        assert_eq!(field(&limits.replace("4096000", "unlimited"), "Max address space"), None);
    }
}
