//! A program as a system, as fast as possible without rustc.

use std::fmt;

use dgd_compiler::program::{FunctionKind, Program};
#[cfg(feature = "native")]
use dgd_compiler::program::{Loop, ProgramFunction};
use dgd_runtime::integrate::integrate;
use dgd_runtime::linalg::AutoLu;
use dgd_runtime::model::Model;
use dgd_runtime::signature::choices;
use dgd_runtime::{EvaluationPoint, Failure, Options, Problem, Solution, WantedResults};

use crate::fixed;
use crate::interpret::Interpreter;
#[cfg(feature = "native")]
use crate::native::NativeFunctions;
use crate::on_demand::OnDemand;
use crate::system::{FunctionExecutor, ProgramSystem};

/// Time to compile an empty function, for each additional operation, and to interpret an operation, all in ns. They
/// affect only when functions are compiled.
#[cfg(feature = "native")]
const COMPILING: usize = 100_000;
#[cfg(feature = "native")]
const COMPILING_OPERATION: usize = 3000;
#[cfg(feature = "native")]
const INTERPRETING_OPERATION: usize = 2;

/// Number of times that a function is interpreted before it is compiled: until that has taken as long as compilation
/// would, so that both together take at most twice as long as the better choice.
#[cfg(feature = "native")]
fn calls_before(function: &ProgramFunction) -> u32 {
    let of_loops =
        |operations: fn(&Loop) -> usize| function.loops.iter().map(operations).sum::<usize>();
    let written = function.body.len() + of_loops(|part| part.operations().count());
    let performed = function.body.len() + of_loops(Loop::performed);
    let compiling = COMPILING + COMPILING_OPERATION * written;
    (compiling / (INTERPRETING_OPERATION * performed.max(1))) as u32
}

choices! {
    /// How the functions of a loaded model are executed. Results do not depend on it.
    pub enum Engine {
        /// Native code where it is available and worthwhile.
        Auto = "auto",
        /// Native code.
        Native = "native",
        /// Interpreter.
        Interpreter = "interpreter",
    }
}

/// Error: native code is not available.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NoNativeCode {
    reason: String,
}

impl fmt::Display for NoNativeCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "there is no native code: {}", self.reason)
    }
}

impl std::error::Error for NoNativeCode {}

/// A program as a system, compiled to native code as it is used.
///
/// Results equal those of generated Rust bit for bit. Cloning shares the program and its code; each clone has its own
/// work space and serves one thread.
pub type LoadedSystem = ProgramSystem<OnDemand>;

impl LoadedSystem {
    /// Makes a system of a program, with [`Engine::Auto`].
    pub fn new(program: Program) -> Self {
        Self::with_engine(program, Engine::default())
    }

    /// A system with a given engine.
    pub fn with_engine(program: Program, engine: Engine) -> Self {
        match engine {
            #[cfg(feature = "native")]
            Engine::Auto => {
                let native = NativeFunctions::for_host(&program, calls_before);
                Self::with_native(program, native)
            }
            #[cfg(feature = "native")]
            Engine::Native => {
                let native = NativeFunctions::for_host(&program, |_| 0);
                Self::with_native(program, native)
            }
            #[cfg(not(feature = "native"))]
            Engine::Auto | Engine::Native => Self::with_engine(program, Engine::Interpreter),
            Engine::Interpreter => Self::interpreted(Interpreter::new(program)),
        }
    }

    pub(crate) fn interpreted(interpreter: Interpreter) -> Self {
        ProgramSystem(OnDemand::interpreted(interpreter))
    }

    #[cfg(feature = "native")]
    pub(crate) fn with_native(program: Program, native: NativeFunctions) -> Self {
        ProgramSystem(OnDemand::with_native(program, native))
    }

    /// The model behind a pointer. Its solvers are compiled in this crate; creating the pointer elsewhere would compile
    /// them again.
    #[inline(never)]
    pub fn as_model(&self) -> &(dyn Model + 'static) {
        self
    }

    /// Compiles all functions now rather than when they are used.
    ///
    /// # Errors
    ///
    /// If native code was not requested, or the machine or the build does not support it: the interpreter is then used.
    pub fn compile(&self) -> Result<(), NoNativeCode> {
        self.0.compile().map_err(|reason| NoNativeCode { reason })
    }
}

impl FunctionExecutor for OnDemand {
    type Vector = Vec<f64>;
    type Sensitivity = Vec<f64>;
    type Inputs = Vec<f64>;
    type Jacobian = Vec<f64>;
    type SensitivityJacobian = Vec<f64>;
    type Factorisation = AutoLu;

    fn program(&self) -> &Program {
        self.program()
    }

    fn interpreter(&self) -> &Interpreter {
        self.interpreter()
    }

    #[inline]
    fn perform(
        &self,
        kind: FunctionKind,
        at: EvaluationPoint<'_>,
        udot: &[f64],
        s: &[f64],
        results: &mut [&mut [f64]],
    ) {
        self.perform(kind, at, udot, s, results);
    }

    fn integrate(
        problem: &Problem<'_, LoadedSystem>,
        times: &[f64],
        options: &Options,
        wanted: WantedResults<'_>,
    ) -> Result<Solution, Failure> {
        let Problem { p, inputs, start, .. } = *problem;
        let functions = Problem { system: &problem.system.0, p, inputs, start };
        fixed::run(&functions, times, options, wanted)
            .unwrap_or_else(|| integrate(problem, times, options, wanted))
    }
}
