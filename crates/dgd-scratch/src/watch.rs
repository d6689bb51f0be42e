//! Looks how much the process holds, and lets go of the file's pages before it is too much.
//!
//! A thread looks every few milliseconds. On a machine with other work it may have to wait for longer, so that whoever takes or
//! copies a large vector looks, too.

use std::fs::{File, OpenOptions};
use std::hint::black_box;
use std::io;
use std::os::unix::fs::{FileExt, OpenOptionsExt};
use std::path::Path;
use std::sync::Mutex;
use std::time::Duration;

use crate::arena::{Arena, LEAST, ask_for_short_slices, is_in_memory, page};
use crate::limits::{Limits, Refusal, Trouble};

/// How often the thread looks.
const LOOKS: Duration = Duration::from_millis(1);

/// Bytes of the file that are held before they are let go. What is read or written in order costs the same
/// however few these are, and what is left of the memory is for what comes until somebody looks again.
const HELD: u64 = 64 << 20;

/// The least time in which what is held beyond the limit cannot be let go.
const PATIENCE: Duration = Duration::from_millis(200);

/// Nobody begins while another one does.
static BEGINS: Mutex<()> = Mutex::new(());

pub(crate) fn begin(limits: &Limits, ends: fn(Trouble) -> !) -> Result<(), Refusal> {
    let _one = BEGINS.lock();
    if Arena::of_process().is_some() {
        return Err(Refusal::Twice);
    }
    let Limits { memory, ref folder } = *limits;
    let refused = |error: io::Error| Refusal::File(folder.clone(), error.to_string());
    let watch = Watch::new(memory).map_err(refused)?;
    let least = watch.program + watch.held().map_err(refused)?.own;
    if memory < 2 * least {
        return Err(Refusal::Little { held: least, memory });
    }
    let file = nameless(folder).map_err(refused)?;
    if is_in_memory(&file).map_err(refused)? {
        return Err(Refusal::InMemory(folder.clone()));
    }
    let arena = Arena::begin(file, watch, ends).map_err(refused)?;
    if !arena.has(black_box(Vec::<u8>::with_capacity(LEAST)).as_mut_ptr()) {
        return Err(Refusal::Allocator);
    }
    let thread = std::thread::Builder::new().name("scratch".to_owned());
    thread.spawn(move || watch_over(arena)).map_err(refused)?;
    Ok(())
}

fn watch_over(arena: &Arena) {
    ask_for_short_slices();
    let mut beyond = Duration::ZERO;
    loop {
        std::thread::sleep(LOOKS);
        beyond = if arena.look() { Duration::ZERO } else { beyond + LOOKS };
        if beyond >= PATIENCE {
            arena.end_beyond();
        }
    }
}

/// A file without a name.
fn nameless(folder: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.read(true).write(true).mode(0o600);
    match options.clone().custom_flags(libc::O_TMPFILE).open(folder) {
        Ok(file) => Ok(file),
        Err(_) if folder.is_dir() => {
            // Not every file system knows files that never had one.
            let path = folder.join(format!(".dgd-scratch-{}", std::process::id()));
            let file = options.create_new(true).open(&path)?;
            std::fs::remove_file(&path)?;
            Ok(file)
        }
        Err(error) => Err(error),
    }
}

/// Looks how much the process holds.
pub(crate) struct Watch {
    statm: File,
    page: u64,
    /// Bytes that it may hold.
    memory: u64,
    /// Bytes of the program itself, which are in files, too.
    program: u64,
}

/// Bytes that a process holds.
#[derive(Clone, Copy)]
pub(crate) struct HeldBytes {
    /// In no file.
    pub(crate) own: u64,
    /// In files.
    pub(crate) in_files: u64,
}

impl Watch {
    fn new(memory: u64) -> io::Result<Watch> {
        let statm = File::open("/proc/self/statm")?;
        let watch = Watch { statm, page: page(), memory, program: 0 };
        let program = watch.held()?.in_files;
        Ok(Watch { program, ..watch })
    }

    pub(crate) fn held(&self) -> io::Result<HeldBytes> {
        let mut text = [0; 128];
        let n = self.statm.read_at(&mut text, 0)?;
        let mut numbers = str::from_utf8(&text[..n]).unwrap_or_default().split(' ').skip(1);
        let mut next = || numbers.next()?.parse::<u64>().ok();
        match (next(), next()) {
            (Some(all), Some(in_files)) => {
                let own = all.saturating_sub(in_files) * self.page;
                Ok(HeldBytes { own, in_files: in_files * self.page })
            }
            _ => Err(io::ErrorKind::InvalidData.into()),
        }
    }

    /// Whether pages of the file have to go.
    pub(crate) fn is_much(&self, held: HeldBytes) -> bool {
        let least = held.own + self.program;
        let most = (self.memory.saturating_sub(least) / 4).min(HELD);
        held.in_files > self.program + most
    }

    /// Whether what is in no file is within what is allowed.
    pub(crate) fn is_within(&self, held: HeldBytes) -> bool {
        held.own + self.program <= self.memory
    }
}
