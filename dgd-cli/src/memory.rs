//! Whether there is memory for what a run would keep.

use crate::failure::CommandError;

/// Vectors of all unknowns that a run works with, in round numbers.
const VECTORS: f64 = 40.0;

/// What a run keeps at each of its rows, and works with.
pub(crate) struct Needs {
    pub unknowns: usize,
    /// Those that are kept at each row.
    pub kept: usize,
    pub outputs: usize,
    pub inputs: usize,
    pub directions: usize,
    pub rows: usize,
}

impl Needs {
    /// Bytes of the rows: results, and once more the columns that are made of them.
    fn of_rows(&self) -> f64 {
        let values = (self.kept + self.outputs) as f64 * (1.0 + self.directions as f64);
        8.0 * self.rows as f64 * (1.0 + self.inputs as f64 + 2.0 * values)
    }

    /// Bytes of work space.
    fn of_work(&self) -> f64 {
        8.0 * VECTORS * self.unknowns as f64 * (1.0 + self.directions as f64)
    }

    /// What most of it is for, and what to do.
    fn reason(&self) -> String {
        let derivatives = match self.directions {
            0 => String::new(),
            1 => " with a derivative each".to_owned(),
            n => format!(" with {n} derivatives each"),
        };
        let fewer = if self.directions == 0 { "" } else { ", or for fewer derivatives (`--to`)" };
        if self.of_work() > self.of_rows() {
            let what =
                if self.directions == 0 { "a smaller model" } else { "fewer derivatives (`--to`)" };
            let n = self.unknowns;
            return format!("it steps {n} unknowns{derivatives}; ask for {what}");
        }
        let counted = |count: usize, what: &str| match count {
            1 => format!("1 {what}"),
            count => format!("{count} {what}s"),
        };
        let values = match (self.kept, self.outputs) {
            (0, outputs) => counted(outputs, "output"),
            (kept, 0) => counted(kept, "unknown"),
            (kept, outputs) => {
                format!("{} and {}", counted(kept, "unknown"), counted(outputs, "output"))
            }
        };
        format!(
            "it keeps {} rows of {values}{derivatives}; ask for fewer rows (`--every`, `--from`, \
             `--until`){fewer}",
            self.rows
        )
    }
}

/// Refuses what there is no memory for.
pub(crate) fn verify(needs: &Needs) -> Result<(), CommandError> {
    within(needs, available())
}

fn within(needs: &Needs, available: Option<f64>) -> Result<(), CommandError> {
    let needed = needs.of_rows() + needs.of_work();
    // No machine has more, whatever its system says of itself.
    let available = available.unwrap_or(MOST);
    if needed <= available {
        return Ok(());
    }
    Err(CommandError::Computation(format!(
        "the run needs about {} of memory, and {} are free: {}",
        size(needed),
        size(available),
        needs.reason()
    )))
}

/// Where a system does not say how much memory is free: a terabyte.
const MOST: f64 = 1e12;

/// A number of bytes as people write it.
fn size(bytes: f64) -> String {
    let units = ["kB", "MB", "GB", "TB", "PB", "EB"];
    let mut value = bytes / 1e3;
    let mut unit = 0;
    while value >= 999.5 && unit + 1 < units.len() {
        value /= 1e3;
        unit += 1;
    }
    let digits = usize::from(value < 10.0);
    format!("{value:.digits$} {}", units[unit])
}

/// Bytes that a process can still have: those that Linux says are available, or fewer where a group of
/// processes has a limit. `None` on other systems.
fn available() -> Option<f64> {
    let of_machine = std::fs::read_to_string("/proc/meminfo").ok()?;
    let free = field(&of_machine, "MemAvailable:")? * 1024.0;
    let of_group = |file: &str| -> Option<f64> {
        std::fs::read_to_string(format!("/sys/fs/cgroup/{file}")).ok()?.trim().parse().ok()
    };
    let left =
        of_group("memory.max").zip(of_group("memory.current")).map(|(most, used)| most - used);
    Some(left.map_or(free, |left| free.min(left.max(0.0))))
}

/// The number behind a name at the start of a line.
fn field(text: &str, name: &str) -> Option<f64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn needs() -> Needs {
        Needs { unknowns: 1_000_000, kept: 3, outputs: 2, inputs: 1, directions: 0, rows: 1000 }
    }

    fn refusal(needs: &Needs, available: f64) -> String {
        match within(needs, Some(available)) {
            Err(CommandError::Computation(message)) => message,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_run_needs_memory_for_what_it_keeps() {
        // Forty vectors, and little beside them.
        assert!(within(&needs(), Some(0.33e9)).is_ok());
        assert_eq!(
            refusal(&needs(), 0.3e9),
            "the run needs about 320 MB of memory, and 300 MB are free: it steps 1000000 unknowns; \
             ask for a smaller model"
        );
        let all = Needs { kept: 1_000_000, directions: 4, ..needs() };
        assert_eq!(
            refusal(&all, 2e9),
            "the run needs about 82 GB of memory, and 2.0 GB are free: it keeps 1000 rows of \
             1000000 unknowns and 2 outputs with 4 derivatives each; ask for fewer rows \
             (`--every`, `--from`, `--until`), or for fewer derivatives (`--to`)"
        );
    }

    #[test]
    fn the_free_memory_is_a_line_of_its_own() {
        let text = "MemTotal:  100 kB\nMemFree:  10 kB\nMemAvailable:   42 kB\n";
        assert_eq!(field(text, "MemAvailable:"), Some(42.0));
        assert_eq!(field(text, "MemNothing:"), None);
    }
}
