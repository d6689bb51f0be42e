//! Vectors in the file are vectors: what was written is read, and what is held stays within what is allowed.
#![cfg(target_os = "linux")]

use std::fs::Metadata;
use std::os::unix::fs::MetadataExt;
use std::thread;

use dgd_scratch::{Limits, Refusal, Scratch, Trouble, begin, default_folder, room};

#[global_allocator]
static ALLOCATOR: Scratch = Scratch;

const MEMORY: u64 = 300_000_000;

fn ends(trouble: Trouble) -> ! {
    eprintln!("{trouble}");
    std::process::exit(3)
}

/// How often the work is done before too much held memory is a defect: on a busy machine the thread that watches over it can
/// wait for long, and a limit that does not hold is never met.
const TIMES: usize = 3;

/// Forgets what the process held at most before.
fn forget_most_held() {
    std::fs::write("/proc/self/clear_refs", "5").expect("Linux has it");
}

/// Bytes that the process held at most since that was forgotten.
fn most_held() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux has it");
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).expect("a line");
    let number = line.trim().strip_suffix("kB").expect("kB").trim().parse::<u64>();
    1024 * number.expect("a number")
}

/// Bytes of the disk that the file takes.
fn on_disk() -> u64 {
    let files = std::fs::read_dir("/proc/self/fd").expect("Linux has it").flatten();
    let found = files.flat_map(|file| std::fs::metadata(file.path()));
    // Nothing else is as long.
    let file = found.filter(Metadata::is_file).max_by_key(Metadata::len);
    512 * file.expect("it is open").blocks()
}

/// One test, as a process begins once.
#[test]
fn vectors_lie_in_the_file() {
    assert_eq!(room(), None);
    let limits = |memory, folder: &str| Limits { memory, folder: folder.into() };
    let refused = begin(&limits(1000, "."), ends);
    assert!(matches!(refused, Err(Refusal::Little { memory: 1000, .. })), "{refused:?}");
    let refused = begin(&limits(MEMORY, "no such folder"), ends);
    assert!(matches!(refused, Err(Refusal::File(..))), "{refused:?}");
    if std::path::Path::new("/dev/shm").is_dir() {
        let refused = begin(&limits(MEMORY, "/dev/shm"), ends);
        assert_eq!(refused, Err(Refusal::InMemory("/dev/shm".into())));
    }

    // From before, and grown after.
    let mut before: Vec<u32> = (0..1_000_000).collect();
    begin(&Limits { memory: MEMORY, folder: default_folder() }, ends).expect("there is a disk");
    assert_eq!(begin(&limits(MEMORY, "."), ends), Err(Refusal::Twice));
    assert!(room().is_some_and(|room| room > 0));
    before.extend(1_000_000..3_000_000);
    assert!(before.iter().enumerate().all(|(k, x)| k as u32 == *x));
    before.truncate(10);
    before.shrink_to_fit();
    assert_eq!(before, (0..10).collect::<Vec<u32>>());

    // Four threads, each with more than all may hold, written, grown and read in several orders.
    let work = |seed: u64| {
        let mut x: Vec<u64> = Vec::new();
        for k in 0..32_000_000 {
            x.push(k * seed);
        }
        let zeros = vec![0_u64; 1_000_000];
        let y: Vec<u64> = x.iter().rev().step_by(2).copied().collect();
        assert!(zeros.iter().all(|zero| *zero == 0));
        let forth = x.iter().fold(0_u64, |sum, x| sum.wrapping_add(*x));
        let back = y.iter().fold(0_u64, |sum, y| sum.wrapping_add(*y));
        (forth, back)
    };
    let n = 32_000_000_u64;
    let mut held = Vec::new();
    for _ in 0..TIMES {
        forget_most_held();
        thread::scope(|scope| {
            let threads: Vec<_> =
                (1..5).map(|seed| (seed, scope.spawn(move || work(seed)))).collect();
            for (seed, thread) in threads {
                let (forth, back) = thread.join().expect("it comes to its end");
                // Σ k over all k, and over the odd ones.
                assert_eq!((forth, back), (seed * (n * (n - 1) / 2), seed * (n / 2) * (n / 2)));
            }
        });
        held.push(most_held());
        if held.last() < Some(&MEMORY) {
            break;
        }
    }
    assert!(held.last() < Some(&MEMORY), "{held:?} bytes were held");
    // What is given back leaves the disk.
    assert!(on_disk() < 10_000_000, "{} bytes are still on the disk", on_disk());
}
