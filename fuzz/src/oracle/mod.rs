//! What must hold of every model.

mod engines;
mod points;
mod printed;
mod rewritten;
mod runs;
mod written;

pub use engines::generated_agrees;

use std::cell::RefCell;
use std::panic::{self, AssertUnwindSafe};

use crate::case::Case;
use crate::prepared::Prepared;

/// Something that does not hold.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Which oracle says so.
    pub oracle: &'static str,
    /// What is wrong, without names and numbers: findings of one symptom may have one cause.
    pub symptom: String,
    /// All that can be said.
    pub detail: String,
}

impl Finding {
    pub(crate) fn new(
        oracle: &'static str,
        symptom: impl Into<String>,
        detail: impl Into<String>,
    ) -> Self {
        Self { oracle, symptom: symptom.into(), detail: detail.into() }
    }

    /// Whether another finding may have the same cause.
    pub fn is_like(&self, other: &Finding) -> bool {
        self.oracle == other.oracle && self.symptom == other.symptom
    }
}

/// An oracle, by the name that `--oracle` chooses it by.
pub struct Oracle {
    /// Its name.
    pub name: &'static str,
    /// What it says, for help.
    pub what: &'static str,
    judge: fn(&Case, &Prepared, &mut Vec<Finding>),
}

/// All of them, the cheapest first.
pub const ORACLES: &[Oracle] = &[
    Oracle {
        name: "printed",
        what: "print ∘ parse = id, fmt is idempotent",
        judge: printed::judge,
    },
    Oracle {
        name: "engines",
        what: "interpreter and native code give the same bits",
        judge: engines::judge,
    },
    Oracle {
        name: "points",
        what: "derivatives of functions agree with differences",
        judge: points::judge,
    },
    Oracle {
        name: "runs",
        what: "runs end, outputs and equations hold, sensitivities agree with differences",
        judge: runs::judge,
    },
    Oracle { name: "methods", what: "all methods come to one solution", judge: runs::methods },
    Oracle {
        name: "rewritten",
        what: "other units, names and orders change nothing",
        judge: rewritten::judge,
    },
];

thread_local! {
    static PANIC: RefCell<Option<(String, String)>> = const { RefCell::new(None) };
}

/// Keeps the place of panics for [`judged`] instead of printing them.
pub fn keep_panics() {
    panic::set_hook(Box::new(|info| {
        let place = info.location().map_or_else(String::new, |place| {
            // Without the machine's own folders.
            let file = place.file();
            let file = file.rsplit_once("/src/").map_or(file, |(_, file)| file);
            format!("{file}:{}", place.line())
        });
        PANIC.with(|kept| *kept.borrow_mut() = Some((place, info.to_string())));
    }));
}

/// What a function finds, or that it panics.
fn guarded<T>(oracle: &'static str, judge: impl FnOnce() -> T) -> Result<T, Finding> {
    panic::catch_unwind(AssertUnwindSafe(judge)).map_err(|_| {
        let (place, text) = PANIC.with(|kept| kept.borrow_mut().take()).unwrap_or_default();
        Finding::new(oracle, format!("panic at {place}"), text)
    })
}

/// All that is wrong with a case, by the oracles of these names; by all without a name.
pub fn judged(case: &Case, chosen: &[String]) -> Vec<Finding> {
    let prepared = match guarded("accepted", || Prepared::new(case)) {
        Ok(Ok(prepared)) => prepared,
        Ok(Err(finding)) | Err(finding) => return vec![finding],
    };
    let mut findings = Vec::new();
    for oracle in ORACLES {
        if !chosen.is_empty() && !chosen.iter().any(|name| name == oracle.name) {
            continue;
        }
        let mut own = Vec::new();
        if let Err(panic) = guarded(oracle.name, || (oracle.judge)(case, &prepared, &mut own)) {
            own.push(panic);
        }
        findings.extend(own);
    }
    findings
}
