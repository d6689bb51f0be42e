//! Vector operations as wide as this machine has them, found out when the program runs.
//!
//! A program is compiled for any machine of its kind, with vectors of two numbers. The functions
//! here are the same code compiled for wider ones. No two operations are contracted to one, so that
//! the bits do not depend on the width.

use super::pack::Pack;
use crate::system::System;

/// How wide vector operations are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Width {
    /// As the program is compiled for.
    Compiled,
    /// Four numbers.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// Eight numbers.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Width {
    /// The widest that this machine has.
    pub(super) fn widest() -> Self {
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

    /// [`Pack::step`] at this width.
    #[allow(unsafe_code)]
    pub(super) fn step<S: System>(self, pack: &mut Pack<'_, S>) {
        match self {
            Self::Compiled => pack.step(),
            // SAFETY: only `widest` makes these, where the machine has what they need.
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => unsafe { step_avx2(pack) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => unsafe { step_avx512(pack) },
        }
    }

    /// [`Pack::observe`] at this width.
    #[allow(unsafe_code)]
    pub(super) fn observe<S: System>(self, pack: &mut Pack<'_, S>, l: usize) {
        match self {
            Self::Compiled => pack.observe(l),
            // SAFETY: as in `step`.
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => unsafe { observe_avx2(pack, l) },
            // SAFETY: as in `step`.
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => unsafe { observe_avx512(pack, l) },
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn step_avx2<S: System>(pack: &mut Pack<'_, S>) {
    pack.step();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn step_avx512<S: System>(pack: &mut Pack<'_, S>) {
    pack.step();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn observe_avx2<S: System>(pack: &mut Pack<'_, S>, l: usize) {
    pack.observe(l);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn observe_avx512<S: System>(pack: &mut Pack<'_, S>, l: usize) {
    pack.observe(l);
}
