//! Memory of this process.

use std::fs;

/// Resident memory of this process, bytes; `None` if the system does not report it.
pub(super) fn resident() -> Option<u64> {
    of_status(&fs::read_to_string("/proc/self/status").ok()?)
}

/// Whether the memory of a piece can be limited on this system.
pub fn is_limited() -> bool {
    resident().is_some()
}

fn of_status(text: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    let kilobytes = line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?;
    Some(1024 * kilobytes)
}

#[cfg(test)]
mod tests {
    use std::hint::black_box;

    use super::*;

    #[test]
    fn what_a_process_holds_is_read() {
        let text = "Name:\tdgd\nVmHWM:\t  9000 kB\nVmRSS:\t   8192 kB\nThreads:\t1\n";
        assert_eq!(of_status(text), Some(8 << 20));
        assert_eq!(of_status("Name:\tdgd\n"), None);
        if cfg!(target_os = "linux") {
            // Other tests allocate and free memory meanwhile, so the difference is not checked.
            let block = black_box(vec![1_u8; 256 << 20]);
            let resident = resident().expect("Linux tells");
            assert!(resident >= 240 << 20, "{resident} bytes");
            drop(block);
        }
    }
}
