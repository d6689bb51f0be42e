//! Vector operations as wide as this machine has them, found out when the program runs.
//!
//! A program is compiled for any machine of its kind, with vectors of two numbers. Work is the same
//! code compiled for wider ones, too. No two operations are contracted to one, so that the bits do not
//! depend on the width.

/// How wide vector operations are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Width {
    /// As the program is compiled for.
    Compiled,
    /// Four numbers.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// Eight numbers.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

/// Something to be done at some width: inlined into code of that width, with all that it calls.
pub(crate) trait Work {
    fn run(self);
}

impl Width {
    /// The widest that this machine has.
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
    pub(crate) fn run(self, work: impl Work) {
        match self {
            Self::Compiled => work.run(),
            // SAFETY: only `widest` makes these, where the machine has what they need.
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => unsafe { run_avx2(work) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => unsafe { run_avx512(work) },
        }
    }
}

/// Does the work by four numbers where the machine can: for work on numbers that stand apart, which
/// compilers gather and scatter one by one where there are more.
#[inline]
#[allow(unsafe_code)]
pub(crate) fn run_by_fours(work: impl Work) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the machine has what it needs.
        unsafe { run_avx2(work) };
        return;
    }
    work.run();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_avx2(work: impl Work) {
    work.run();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn run_avx512(work: impl Work) {
    work.run();
}
