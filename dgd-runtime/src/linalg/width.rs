//! Vector operations of this machine's full width, detected at run time.
//!
//! A program is compiled for any machine of its architecture, with vectors of two numbers. `WidthTask` is also compiled
//! for wider ones. Operations are not fused, so that results do not depend on the width.

/// Width of vector operations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum VectorWidth {
    /// The width for which the program is compiled.
    Compiled,
    /// Four numbers.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// Eight numbers.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

/// Work to do at some width: inlined, with everything that it calls, into code of that width.
pub(crate) trait WidthTask {
    fn run(self);
}

impl VectorWidth {
    /// The largest width of this machine.
    #[inline]
    pub(crate) fn widest() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if std::arch::is_x86_feature_detected!("avx512f") {
                return Self::Avx512;
            }
            if std::arch::is_x86_feature_detected!("avx2") {
                return Self::Avx2;
            }
        }
        Self::Compiled
    }

    /// Does the work.
    #[inline]
    #[allow(unsafe_code)]
    pub(crate) fn run(self, work: impl WidthTask) {
        match self {
            Self::Compiled => work.run(),
            // SAFETY: only `widest` returns these, if the machine supports them.
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => unsafe { run_avx2(work) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => unsafe { run_avx512(work) },
        }
    }
}

/// Does the work four numbers at a time if the machine can: for numbers that are not contiguous, which compilers gather
/// and scatter one by one at larger widths.
#[inline]
#[allow(unsafe_code)]
pub(crate) fn run_by_fours(work: impl WidthTask) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the machine supports AVX2.
        unsafe { run_avx2(work) };
        return;
    }
    work.run();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_avx2(work: impl WidthTask) {
    work.run();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn run_avx512(work: impl WidthTask) {
    work.run();
}
