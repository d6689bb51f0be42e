//! A file mapped into memory, and the allocator that gives large vectors from it.
//!
//! Mapping a file and being an allocator are unsafe. What the calls rely on:
//!
//! - the file is this process' own: it has no name, so that nobody shortens or writes it, and each byte that is given out has
//!   its room on the disk beforehand, so that writing it cannot fail;
//! - a block belongs to one vector at a time, by [`Blocks`], which a lock guards;
//! - `MADV_DONTNEED` takes pages of a shared mapping of a file from the process, not from the file.
#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::fs::File;
use std::io;
use std::os::fd::AsRawFd;
use std::ptr::null_mut;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

use crate::blocks::Blocks;
use crate::limits::Trouble;
use crate::watch::Watch;

/// Bytes of a block.
const BLOCK: usize = 1 << 16;

/// Bytes of the smallest vector that lies in the file.
pub(crate) const LEAST: usize = BLOCK;

/// Bytes that are copied at a time.
const COPIED: usize = 4 << 20;

/// Alignment that every block has.
const ALIGNED: usize = 4096;

/// Bytes of address space that are asked for at most.
const MOST: u64 = 1 << 44;

/// The allocator of a program, whose large vectors may lie in a file.
#[derive(Debug, Clone, Copy, Default)]
pub struct Scratch;

static ARENA: OnceLock<Arena> = OnceLock::new();

/// A file mapped into memory.
pub(crate) struct Arena {
    base: usize,
    bytes: usize,
    file: File,
    blocks: Mutex<Blocks>,
    /// Whether a block that is given out for the second time is zero, which most file systems see to.
    is_zeroed: AtomicBool,
    watch: Watch,
    ends: fn(Trouble) -> !,
}

impl Arena {
    /// That of this process.
    pub(crate) fn of_process() -> Option<&'static Arena> {
        ARENA.get()
    }

    /// Maps a file that nobody else has, and gives large vectors from it from now on.
    pub(crate) fn begin(
        file: File,
        watch: Watch,
        ends: fn(Trouble) -> !,
    ) -> io::Result<&'static Arena> {
        let room = room(&file)?.min(MOST) as usize / BLOCK * BLOCK;
        file.set_len(room as u64)?;
        // SAFETY: a new mapping, at an address that the system chooses.
        let base = unsafe {
            let protection = libc::PROT_READ | libc::PROT_WRITE;
            libc::mmap(null_mut(), room, protection, libc::MAP_SHARED, file.as_raw_fd(), 0)
        };
        if base == libc::MAP_FAILED {
            return Err(io::Error::last_os_error());
        }
        let arena = Arena {
            base: base as usize,
            bytes: room,
            file,
            blocks: Mutex::new(Blocks::free(room / BLOCK)),
            is_zeroed: AtomicBool::new(true),
            watch,
            ends,
        };
        ARENA.set(arena).map_err(|_| io::Error::other("there is one"))?;
        ARENA.get().ok_or_else(|| io::Error::other("there is none"))
    }

    /// Bytes that the disk has for it.
    pub(crate) fn room(&self) -> u64 {
        room(&self.file).unwrap_or(0)
    }

    /// Looks how much the process holds, and lets go of the file's pages where that is much. Whether what is in no file
    /// is within what is allowed.
    pub(crate) fn look(&self) -> bool {
        let Ok(held) = self.watch.held() else { return true };
        if self.watch.is_much(held) {
            self.let_go();
        }
        self.watch.is_within(held)
    }

    /// Ends the process, as it holds too much in no file.
    pub(crate) fn end_beyond(&self) {
        match self.watch.held() {
            Ok(held) if !self.watch.is_within(held) => (self.ends)(Trouble::Beyond(held.own)),
            _ => {}
        }
    }

    /// Takes all pages of the file from the process.
    fn let_go(&self) {
        let used = self.lock().end() * BLOCK;
        // SAFETY: the range is within the mapping. What was written stays in the file.
        unsafe { libc::madvise(self.base as *mut libc::c_void, used, libc::MADV_DONTNEED) };
    }

    fn lock(&self) -> MutexGuard<'_, Blocks> {
        self.blocks.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn has(&self, pointer: *mut u8) -> bool {
        (self.base..self.base + self.bytes).contains(&(pointer as usize))
    }

    /// Has the disk keep room for these blocks.
    fn reserve(&self, at: usize, n: usize) -> bool {
        // SAFETY: the file is open, and the range is within it.
        let refused = unsafe {
            let (from, length) = (bytes_of(at), bytes_of(n));
            libc::posix_fallocate(self.file.as_raw_fd(), from, length)
        };
        refused == 0
    }

    fn take(&self, size: usize) -> *mut u8 {
        self.look();
        let n = size.div_ceil(BLOCK);
        let taken = self.lock().take(n);
        match taken {
            Some(at) if self.reserve(at, n) => (self.base + at * BLOCK) as *mut u8,
            _ => (self.ends)(Trouble::Full(size as u64)),
        }
    }

    /// Whether a vector could grow where it is.
    fn grow(&self, pointer: *mut u8, size: usize, more: usize) -> bool {
        let (at, n) = ((pointer as usize - self.base) / BLOCK, size.div_ceil(BLOCK));
        let more_blocks = more.div_ceil(BLOCK);
        if more_blocks <= n {
            return more_blocks == n;
        }
        if !self.lock().grow(at, n, more_blocks) {
            return false;
        }
        if !self.reserve(at + n, more_blocks - n) {
            (self.ends)(Trouble::Full((more - size) as u64));
        }
        true
    }

    fn give_back(&self, pointer: *mut u8, size: usize) {
        let (at, n) = ((pointer as usize - self.base) / BLOCK, size.div_ceil(BLOCK));
        // SAFETY: the range is within the file, and nobody has it any more.
        let refused = unsafe {
            let mode = libc::FALLOC_FL_PUNCH_HOLE | libc::FALLOC_FL_KEEP_SIZE;
            let (from, length) = (bytes_of(at), bytes_of(n));
            libc::fallocate(self.file.as_raw_fd(), mode, from, length)
        };
        if refused != 0 {
            self.is_zeroed.store(false, Ordering::Relaxed);
        }
        self.lock().give_back(at, n);
    }
}

/// Bytes of so many blocks, of which the file has fewer than an offset can count.
fn bytes_of(blocks: usize) -> libc::off_t {
    (blocks * BLOCK).cast_signed() as libc::off_t
}

/// Free bytes of the disk on which a file lies.
fn room(file: &File) -> io::Result<u64> {
    let found = file_system(file)?;
    Ok(found.f_bavail.saturating_mul(found.f_bsize.unsigned_abs()))
}

/// Whether a file lies in memory.
pub(crate) fn is_in_memory(file: &File) -> io::Result<bool> {
    // `ramfs`, which libc does not name.
    const RAMFS: u64 = 0x8584_58f6;
    // Numbers of 32 bits, which some systems sign.
    let kind = |number: i128| number as u64 & 0xffff_ffff;
    let own = kind(file_system(file)?.f_type.into());
    Ok([kind(libc::TMPFS_MAGIC.into()), kind(libc::HUGETLBFS_MAGIC.into()), RAMFS].contains(&own))
}

fn file_system(file: &File) -> io::Result<libc::statfs> {
    // SAFETY: a structure of numbers, all of which may be zero, and which the system fills in.
    let (refused, found) = unsafe {
        let mut found: libc::statfs = std::mem::zeroed();
        (libc::fstatfs(file.as_raw_fd(), &raw mut found), found)
    };
    if refused == 0 { Ok(found) } else { Err(io::Error::last_os_error()) }
}

/// Bytes of a page.
pub(crate) fn page() -> u64 {
    // SAFETY: asks for a number.
    unsafe { libc::sysconf(libc::_SC_PAGESIZE) }.unsigned_abs()
}

/// Asks the system to let this thread, which runs seldom and briefly, run as soon as it wants to.
pub(crate) fn ask_for_short_slices() {
    /// `struct sched_attr`, as far as all systems have it.
    #[repr(C)]
    struct Attributes {
        size: u32,
        policy: u32,
        flags: u64,
        nice: i32,
        priority: u32,
        runtime: u64,
        deadline: u64,
        period: u64,
    }
    let slice = 100_000; // ns, the least there is
    let size = size_of::<Attributes>() as u32;
    let attributes = Attributes {
        size,
        policy: libc::SCHED_OTHER.unsigned_abs(),
        flags: 0,
        nice: 0,
        priority: 0,
        runtime: slice,
        deadline: 0,
        period: 0,
    };
    // SAFETY: reads a structure of the size that it says. Where the system knows nothing of it, all stays as it is.
    unsafe { libc::syscall(libc::SYS_sched_setattr, 0, &raw const attributes, 0) };
}

/// The file's mapping, for what is large.
fn arena_for(layout: Layout) -> Option<&'static Arena> {
    if layout.size() < LEAST || layout.align() > ALIGNED { None } else { ARENA.get() }
}

// SAFETY: each vector is given by the system or by the arena, which is told by its address, and goes back to where it is from.
unsafe impl GlobalAlloc for Scratch {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        match arena_for(layout) {
            Some(arena) => arena.take(layout.size()),
            None => unsafe { System.alloc(layout) },
        }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        let Some(arena) = arena_for(layout) else { return unsafe { System.alloc_zeroed(layout) } };
        let pointer = arena.take(layout.size());
        if !arena.is_zeroed.load(Ordering::Relaxed) {
            unsafe { pointer.write_bytes(0, layout.size()) };
        }
        pointer
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        match ARENA.get().filter(|arena| arena.has(pointer)) {
            Some(arena) => arena.give_back(pointer, layout.size()),
            None => unsafe { System.dealloc(pointer, layout) },
        }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        let own = ARENA.get().filter(|arena| arena.has(pointer));
        let new = Layout::from_size_align(size, layout.align()).ok();
        if own.is_some_and(|arena| size >= LEAST && arena.grow(pointer, layout.size(), size)) {
            return pointer;
        }
        if own.is_none() && new.and_then(arena_for).is_none() {
            return unsafe { System.realloc(pointer, layout, size) };
        }
        let Some(new) = new else { return null_mut() };
        // SAFETY: both are as long as what is copied, and apart from each other.
        unsafe {
            let to = self.alloc(new);
            if !to.is_null() {
                let (length, arena) = (layout.size().min(size), ARENA.get());
                for at in (0..length).step_by(COPIED) {
                    let part = COPIED.min(length - at);
                    to.add(at).copy_from_nonoverlapping(pointer.add(at), part);
                    arena.filter(|_| length > COPIED).map(Arena::look);
                }
                self.dealloc(pointer, layout);
            }
            to
        }
    }
}
