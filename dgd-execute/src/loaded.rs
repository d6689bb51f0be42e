//! A program as a system, as fast as it can be had without rustc.

#[cfg(feature = "native")]
use std::cell::Cell;
use std::fmt;
#[cfg(feature = "native")]
use std::sync::Arc;

#[cfg(feature = "native")]
use dgd_compiler::program::FUNCTIONS;
use dgd_compiler::program::{FunctionKind, Program};
use dgd_runtime::linalg::AutoLu;
use dgd_runtime::{Point, Signature};

use crate::interpret::Interpreter;
#[cfg(feature = "native")]
use crate::native::{Code, Native, Refused};
use crate::system::{Executed, Perform};

/// So often a function is interpreted before it is compiled: then both have cost about the same.
#[cfg(feature = "native")]
const CALLS_BEFORE: u32 = 500;

/// How the functions of a loaded model are performed. The bits do not depend on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Engine {
    /// A function that is called often as machine code, where that can be had; others by the
    /// interpreter.
    #[default]
    Auto,
    /// As machine code, compiled at the first call.
    Native,
    /// By the interpreter.
    Interpreter,
}

/// Native code was asked for, and cannot be had.
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

/// A program as a system, compiled to machine code as it is used.
///
/// The same bits as generated Rust. Cloning shares the program and its code; each clone has work space
/// of its own, so that one clone serves one thread.
pub type Loaded = Executed<OnDemand>;

/// Performs functions by machine code where it is there, by the interpreter otherwise.
#[derive(Debug, Clone)]
pub struct OnDemand {
    interpreter: Interpreter,
    #[cfg(feature = "native")]
    compiling: Option<Compiling>,
}

impl Loaded {
    /// Makes a system of a program, with [`Engine::Auto`].
    pub fn new(program: Program) -> Self {
        Executed(OnDemand {
            interpreter: Interpreter::new(program),
            #[cfg(feature = "native")]
            compiling: Native::for_host().ok().map(|native| Compiling::new(native, CALLS_BEFORE)),
        })
    }

    /// The same with an engine of one's choice.
    ///
    /// # Errors
    ///
    /// When that is [`Engine::Native`], and the machine, or how this was built, does not allow it.
    pub fn with_engine(program: Program, engine: Engine) -> Result<Self, NoNativeCode> {
        match engine {
            Engine::Auto => Ok(Self::new(program)),
            Engine::Interpreter => Ok(Executed(OnDemand {
                interpreter: Interpreter::new(program),
                #[cfg(feature = "native")]
                compiling: None,
            })),
            Engine::Native => Self::native(program),
        }
    }

    #[cfg(feature = "native")]
    fn native(program: Program) -> Result<Self, NoNativeCode> {
        let no_code = |refused: Refused| NoNativeCode { reason: refused.to_string() };
        let native = Native::for_host().map_err(no_code)?;
        // Whether memory for code is given is known when there is some.
        native.try_compile(&program, FunctionKind::Rhs).map_err(no_code)?;
        let compiling = Some(Compiling::new(native, 0));
        Ok(Executed(OnDemand { interpreter: Interpreter::new(program), compiling }))
    }

    #[cfg(not(feature = "native"))]
    fn native(_: Program) -> Result<Self, NoNativeCode> {
        Err(NoNativeCode { reason: "this was built without it".to_owned() })
    }
}

impl Perform for OnDemand {
    type Vector = Vec<f64>;
    type Sensitivity = Vec<f64>;
    type Inputs = Vec<f64>;
    type Jacobian = Vec<f64>;
    type SensitivityJacobian = Vec<f64>;
    type Factorisation = AutoLu;

    fn program(&self) -> &Program {
        self.interpreter.program()
    }

    fn signature(&self) -> &Signature {
        self.interpreter.signature()
    }

    fn interpreter(&self) -> &Interpreter {
        &self.interpreter
    }

    #[inline]
    fn perform(
        &self,
        kind: FunctionKind,
        at: Point<'_>,
        udot: &[f64],
        s: &[f64],
        results: &mut [&mut [f64]],
    ) {
        #[cfg(feature = "native")]
        if let Some(compiling) = &self.compiling
            && let Some(code) = compiling.code(self.program(), kind)
        {
            match code.scratch() {
                0 => code.call(at, udot, s, results, &mut []),
                len => code.call(at, udot, s, results, &mut self.interpreter.registers(len)),
            }
            return;
        }
        self.interpreter.perform(kind, at, udot, s, results);
    }
}

/// Machine code of functions that have been called often enough.
#[cfg(feature = "native")]
#[derive(Debug, Clone)]
struct Compiling {
    native: Arc<Native>,
    /// How often each function is still interpreted before it is compiled.
    calls_left: Vec<Cell<u32>>,
}

#[cfg(feature = "native")]
impl Compiling {
    fn new(native: Native, calls_before: u32) -> Self {
        let calls_left = FUNCTIONS.iter().map(|_| Cell::new(calls_before)).collect();
        Compiling { native: Arc::new(native), calls_left }
    }

    #[inline]
    fn code(&self, program: &Program, kind: FunctionKind) -> Option<&Code> {
        self.native.compiled(kind).or_else(|| self.count(program, kind))
    }

    #[cold]
    fn count(&self, program: &Program, kind: FunctionKind) -> Option<&Code> {
        let left = &self.calls_left[kind as usize];
        match left.get().checked_sub(1) {
            None => self.native.function(program, kind),
            Some(fewer) => {
                left.set(fewer);
                None
            }
        }
    }
}
