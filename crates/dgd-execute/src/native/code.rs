//! Native code, and the only place from which it is called.
//!
//! A call is sound because the code reads and writes only within the lengths of its [`NativePlan`], which are checked
//! against those of the slices before each call; it retains no addresses; and it is freed only once it can no longer be
//! called.

#![allow(unsafe_code)]

use std::mem::{offset_of, transmute};
use std::sync::{Mutex, PoisonError};

use cranelift_jit::JITModule;
use dgd_compiler::expr::curve::Curve;
use dgd_runtime::EvaluationPoint;

use super::plan::{ARGUMENTS, MOST_RESULTS, NativePlan};

/// Addresses of the arrays of a piece of code.
#[repr(C)]
pub(super) struct ArrayFrame {
    arguments: [*const f64; ARGUMENTS.len()],
    results: [*mut f64; MOST_RESULTS],
    scratch: *mut f64,
}

impl ArrayFrame {
    /// Offset of the address of an argument, in bytes.
    pub(super) fn argument(position: usize) -> i32 {
        distance(offset_of!(ArrayFrame, arguments), position)
    }

    /// Offset of the address of a result.
    pub(super) fn result(position: usize) -> i32 {
        distance(offset_of!(ArrayFrame, results), position)
    }

    /// Offset of the address of the scratch memory.
    pub(super) fn scratch() -> i32 {
        distance(offset_of!(ArrayFrame, scratch), 0)
    }
}

/// Bytes from the start of a frame to one of its addresses.
fn distance(first: usize, position: usize) -> i32 {
    let bytes = first + position * size_of::<*const f64>();
    i32::try_from(bytes).unwrap_or_else(|_| unreachable!("a frame has a few addresses"))
}

/// A piece of native code, called with t and a frame whose arrays have the lengths of the code's plan.
type NativeEntry = unsafe extern "C" fn(f64, *const ArrayFrame);

/// Native code of a function.
pub(crate) struct NativeCode {
    /// Entry points, called one after the other.
    entries: Vec<NativeEntry>,
    /// Number of values read from each argument.
    reads: [usize; ARGUMENTS.len()],
    /// Length of each result.
    lengths: Vec<usize>,
    /// Length of the scratch memory shared by the pieces.
    scratch: usize,
    /// Owner of the code's memory; `None` once that is freed.
    memory: Mutex<Option<JITModule>>,
}

impl NativeCode {
    /// Code compiled from all pieces of a plan, at these addresses in the module's memory.
    pub(super) fn new(plan: &NativePlan<'_>, addresses: &[*const u8], memory: JITModule) -> Self {
        // SAFETY: `translate` gave each piece the signature of an `NativeEntry` in the convention of C.
        let entry = |address: &*const u8| unsafe { transmute::<*const u8, NativeEntry>(*address) };
        NativeCode {
            entries: addresses.iter().map(entry).collect(),
            reads: plan.reads,
            lengths: plan.function.lengths.clone(),
            scratch: plan.scratch(),
            memory: Mutex::new(Some(memory)),
        }
    }

    /// Length of the scratch memory that a call needs.
    pub(crate) fn scratch(&self) -> usize {
        self.scratch
    }

    /// Executes the function.
    ///
    /// # Panics
    ///
    /// If an array is shorter than the part that is read, or a result has the wrong length.
    #[inline]
    pub(crate) fn call(
        &self,
        at: EvaluationPoint<'_>,
        udot: &[f64],
        s: &[f64],
        results: &mut [&mut [f64]],
        scratch: &mut [f64],
    ) {
        let arguments = [at.y, at.u, at.p, at.z, udot, s];
        let enough = arguments.iter().zip(self.reads).all(|(array, reads)| array.len() >= reads);
        let exact = results.len() == self.lengths.len()
            && results.iter().zip(&self.lengths).all(|(result, length)| result.len() == *length);
        assert!(
            enough && exact && scratch.len() >= self.scratch,
            "lengths of arguments and results"
        );
        let mut frame = ArrayFrame {
            arguments: arguments.map(<[f64]>::as_ptr),
            results: [std::ptr::null_mut(); MOST_RESULTS],
            scratch: scratch.as_mut_ptr(),
        };
        for (address, result) in frame.results.iter_mut().zip(results) {
            *address = result.as_mut_ptr();
        }
        for entry in &self.entries {
            // SAFETY: the entries were compiled from one plan. They read the first `reads` numbers of
            // each argument, write within the lengths of the results and within the scratch memory,
            // and nothing else; the slices have these lengths, and those written to are borrowed
            // exclusively. The memory of the code is freed by `drop` only.
            unsafe { entry(at.t, &raw const frame) };
        }
    }
}

impl Drop for NativeCode {
    fn drop(&mut self) {
        let memory = self.memory.get_mut().unwrap_or_else(PoisonError::into_inner);
        if let Some(module) = memory.take() {
            // SAFETY: the entries are this value's own and never leave it, so that none is running or
            // will be called.
            unsafe { module.free_memory() };
        }
    }
}

/// Called by native code for a function of one argument.
///
/// # Safety
///
/// `value` is the address of a `fn(f64) -> f64`.
pub(super) unsafe extern "C" fn call_one(x: f64, value: *const ()) -> f64 {
    // SAFETY: guaranteed by the caller.
    let value = unsafe { transmute::<*const (), fn(f64) -> f64>(value) };
    value(x)
}

/// Called by native code for the curve of a table.
///
/// # Safety
///
/// `curve` is the address of a [`Curve`] that is never freed.
pub(super) unsafe extern "C" fn call_curve(x: f64, curve: *const ()) -> f64 {
    // SAFETY: guaranteed by the caller.
    let curve = unsafe { &*curve.cast::<Curve>() };
    curve.value(x)
}

/// Called by native code for a function of two arguments.
///
/// # Safety
///
/// `value` is the address of a `fn(f64, f64) -> f64`.
pub(super) unsafe extern "C" fn call_two(x: f64, y: f64, value: *const ()) -> f64 {
    // SAFETY: guaranteed by the caller.
    let value = unsafe { transmute::<*const (), fn(f64, f64) -> f64>(value) };
    value(x, y)
}
