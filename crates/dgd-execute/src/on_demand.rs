//! Functions of a program as native code if it exists, otherwise interpreted.

#[cfg(feature = "native")]
use std::sync::Arc;

use dgd_compiler::program::{FunctionKind, Program};
use dgd_runtime::EvaluationPoint;

use crate::interpret::Interpreter;
#[cfg(feature = "native")]
use crate::native::NativeFunctions;

/// Executes functions with native code if it exists, otherwise with the interpreter.
#[derive(Debug, Clone)]
pub struct OnDemand {
    interpreter: Interpreter,
    #[cfg(feature = "native")]
    native: Option<Arc<NativeFunctions>>,
}

impl OnDemand {
    pub(crate) fn interpreted(interpreter: Interpreter) -> Self {
        OnDemand {
            interpreter,
            #[cfg(feature = "native")]
            native: None,
        }
    }

    #[cfg(feature = "native")]
    pub(crate) fn with_native(program: Program, native: NativeFunctions) -> Self {
        OnDemand { interpreter: Interpreter::new(program), native: Some(Arc::new(native)) }
    }

    pub(crate) fn program(&self) -> &Program {
        self.interpreter.program()
    }

    pub(crate) fn interpreter(&self) -> &Interpreter {
        &self.interpreter
    }

    /// Compiles all functions now, or returns the reason why they are interpreted.
    pub(crate) fn compile(&self) -> Result<(), String> {
        #[cfg(feature = "native")]
        if let Some(native) = &self.native {
            let program = self.interpreter.program();
            for function in &program.functions {
                let code = native.code(program, function.kind);
                code.map_err(ToString::to_string)?;
            }
            return Ok(());
        }
        let reason =
            if cfg!(feature = "native") { "it was not asked for" } else { "it was not built" };
        Err(reason.to_owned())
    }

    /// Executes one function, as [`FunctionExecutor::perform`](crate::FunctionExecutor::perform) does.
    #[inline]
    pub(crate) fn perform(
        &self,
        kind: FunctionKind,
        at: EvaluationPoint<'_>,
        udot: &[f64],
        s: &[f64],
        results: &mut [&mut [f64]],
    ) {
        #[cfg(feature = "native")]
        if let Some(native) = &self.native
            && let Some(code) = native.called(self.program(), kind)
        {
            if code.scratch() == 0 {
                code.call(at, udot, s, results, &mut []);
            } else {
                code.call(at, udot, s, results, &mut self.interpreter.registers());
            }
            return;
        }
        self.interpreter.perform(kind, at, udot, s, results);
    }
}
