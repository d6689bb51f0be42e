//! Properties that must hold for every model.

mod ends;
mod engines;
mod facts;
mod points;
mod printed;
mod rewritten;
mod runs;
mod shifted;
mod written;

pub(crate) use engines::generated_agrees;

use std::cell::RefCell;
use std::panic::{self, AssertUnwindSafe};

use crate::case::Case;
use crate::prepared::Prepared;

/// A violated property.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The oracle that found it.
    pub oracle: &'static str,
    /// The symptom, without names and numbers: findings with the same symptom may have the same cause.
    pub symptom: String,
    /// All details.
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

/// An oracle, with its name for `--oracle`.
pub struct Oracle {
    /// Its name.
    pub name: &'static str,
    /// Its description, for help.
    pub what: &'static str,
    judge: fn(&Case, &Prepared, &mut Vec<Finding>),
}

/// All oracles, the cheapest first.
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
    Oracle {
        name: "facts",
        what: "all methods give what is known from how the model was written",
        judge: facts::judge,
    },
    Oracle { name: "methods", what: "all methods come to one solution", judge: runs::methods },
    Oracle {
        name: "ends",
        what: "neither the end of a run nor its rows change what they have in common",
        judge: ends::judge,
    },
    Oracle {
        name: "rewritten",
        what: "other units, names and orders change nothing",
        judge: rewritten::judge,
    },
    Oracle { name: "shifted", what: "a later clock changes nothing", judge: shifted::judge },
];

thread_local! {
    static PANIC: RefCell<Option<(String, String)>> = const { RefCell::new(None) };
}

/// Keeps the location of panics for [`judged`] instead of printing them.
pub fn keep_panics() {
    panic::set_hook(Box::new(|info| {
        let place = info.location().map_or_else(String::new, |place| {
            // Without machine-specific folders.
            let file = place.file();
            let file = file.rsplit_once("/src/").map_or(file, |(_, file)| file);
            format!("{file}:{}", place.line())
        });
        PANIC.with(|kept| *kept.borrow_mut() = Some((place, info.to_string())));
    }));
}

/// The result of a function, or a finding if it panics.
fn guarded<T>(oracle: &'static str, judge: impl FnOnce() -> T) -> Result<T, Finding> {
    panic::catch_unwind(AssertUnwindSafe(judge)).map_err(|_| {
        let (place, text) = PANIC.with(|kept| kept.borrow_mut().take()).unwrap_or_default();
        Finding::new(oracle, format!("panic at {place}"), text)
    })
}

/// All findings for a case, by the named oracles, or by all if none are named.
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
        let mut new = Vec::new();
        if let Err(panic) = guarded(oracle.name, || (oracle.judge)(case, &prepared, &mut new)) {
            new.push(panic);
        }
        findings.extend(new);
    }
    findings
}
