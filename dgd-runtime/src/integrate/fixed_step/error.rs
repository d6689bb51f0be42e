//! Why a run cannot use equal steps per sample.

use std::fmt;

use dgd_signature::number::short;

use crate::integrate::methods::catalogue::{Method, MethodKind};
use crate::integrate::methods::tableaux::RungeKuttaTableau;
use crate::integrate::methods::taylor;
use crate::problem::Problem;
use crate::solved::SolvableSystem;
use crate::system::Signature;

/// Why a run with equal steps per sample is not possible, or not accurate enough.
#[derive(Debug, Clone, PartialEq)]
pub enum PerSampleError {
    /// Modes change at times that depend on the solution, not at ends of steps.
    Modes {
        /// A `modes` block, `when`, bound or switch.
        automaton: String,
    },
    /// A condition on time switches between samples.
    TimeCondition,
    /// Something has a delay.
    Delay {
        /// Its name.
        name: String,
    },
    /// The method cannot make steps of a given size.
    Method {
        /// The method.
        method: &'static str,
    },
    /// The method needs Taylor series, and the model has none, or none for these inputs.
    Series {
        /// The method.
        method: &'static str,
    },
    /// The method cannot solve algebraic unknowns, and the model has some.
    Algebraic {
        /// The method.
        method: &'static str,
        /// The equation that determines one.
        equation: String,
    },
    /// The solution becomes non-finite: the steps are too long, or the model has no solution.
    NotFinite {
        /// Start of the step at which that happens, s.
        t: f64,
        /// Steps per sample.
        per_sample: u32,
        /// The method.
        method: &'static str,
    },
    /// Errors stay above the tolerance with the maximum number of steps.
    Inaccurate {
        /// Steps per sample.
        per_sample: u32,
        /// The method.
        method: &'static str,
        /// The largest local error, in units of the tolerance.
        error: f64,
    },
}

/// Checks that a method can run a model with equal steps per sample.
pub(crate) fn verify<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    method: &Method,
) -> Result<(), PerSampleError> {
    if let Some(reason) = refusal(problem.system.signature()) {
        return Err(reason);
    }
    match method.kind {
        MethodKind::Rosenbrock(_) => Ok(()),
        MethodKind::Explicit(RungeKuttaTableau { equal_steps: Some(_), .. }) => {
            let signature = problem.system.signature();
            match signature.unknowns.iter().position(|unknown| !unknown.differential) {
                None => Ok(()),
                Some(row) => Err(PerSampleError::Algebraic {
                    method: method.name,
                    equation: signature.equations.get(row).to_string(),
                }),
            }
        }
        MethodKind::Taylor(_) => taylor::verify(problem, method.name)
            .map_err(|_| PerSampleError::Series { method: method.name }),
        MethodKind::Explicit(_) | MethodKind::Esdirk(_) | MethodKind::Bdf(_) => {
            Err(PerSampleError::Method { method: method.name })
        }
    }
}

/// The feature of a model that needs steps to end elsewhere, if any.
fn refusal(signature: &Signature) -> Option<PerSampleError> {
    if let Some(automaton) = signature.discrete.automata.first() {
        return Some(PerSampleError::Modes { automaton: automaton.name.to_string() });
    }
    if let Some(rows) = signature.discrete.unlocated.first() {
        return Some(PerSampleError::Modes { automaton: rows.to_string() });
    }
    if signature.discrete.n_time_conditions > 0 {
        return Some(PerSampleError::TimeCondition);
    }
    let delayed_input = signature
        .delayed_inputs
        .first()
        .map(|delayed| signature.inputs[delayed.input].name.clone());
    let delayed_unknown =
        signature.delayed_unknowns.first().map(|delayed| signature.unknowns.name(delayed.unknown));
    let mut outputs = signature.outputs.iter();
    let delayed_output = outputs.find(|output| output.delay.is_some());
    let delayed_output = delayed_output.map(|output| output.name.clone());
    delayed_input
        .or(delayed_unknown)
        .or(delayed_output)
        .map(|name| PerSampleError::Delay { name: name.to_string() })
}

impl PerSampleError {
    /// Whether adaptive steps would not fail so, with the same method or another.
    pub fn is_of_equal_steps(&self) -> bool {
        matches!(
            self,
            Self::Modes { .. }
                | Self::TimeCondition
                | Self::Delay { .. }
                | Self::Method { .. }
                | Self::Inaccurate { .. }
        )
    }
}

impl fmt::Display for PerSampleError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const INSTEAD: &str = "use adaptive steps";
        match self {
            Self::Modes { automaton } => write!(
                f,
                "steps per sample cannot end where `{automaton}` changes, which is between \
                 samples; {INSTEAD}"
            ),
            Self::TimeCondition => write!(
                f,
                "steps per sample cannot end where the model's condition on time switches, which \
                 is between samples; {INSTEAD}"
            ),
            Self::Delay { name } => write!(
                f,
                "with steps per sample nothing is read late, and the model reads `{name}` late; \
                 {INSTEAD}"
            ),
            Self::Method { method } => write!(
                f,
                "`{method}` makes no steps of given size; {INSTEAD}, or `rodas5p`, or `tsit5` \
                 where the model is neither stiff nor algebraic"
            ),
            Self::Series { method } => write!(
                f,
                "`{method}` goes along Taylor series, and the model has none, or none for these inputs; \
                 `rodas5p` needs none"
            ),
            Self::Algebraic { method, equation } => write!(
                f,
                "`{method}` cannot solve `{equation}`, which has no derivative; `rodas5p` can"
            ),
            Self::NotFinite { t, per_sample, method } => write!(
                f,
                "the step from t = {t} s, of {per_sample} per sample by `{method}`, leads beyond \
                 all numbers: it is too long, or the model cannot go on there; adaptive steps say \
                 which"
            ),
            Self::Inaccurate { per_sample, method, error } => write!(
                f,
                "with {per_sample} steps per sample by `{method}` the local error is still \
                 {} times the tolerance; {INSTEAD}",
                short(*error, 2)
            ),
        }
    }
}

impl std::error::Error for PerSampleError {}
