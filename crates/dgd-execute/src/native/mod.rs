//! Native code at run time, with Cranelift.
//!
//! ```text
//!   Function → Plan     checked, and cut into pieces
//!   Piece    → IR       one instruction for each operation
//!   IR       → Code     in memory, called from one place
//! ```
//!
//! Functions are compiled on demand: a program has more than twenty, of which most tasks use a few.

mod code;
mod plan;
mod refusal;
#[cfg(test)]
mod tests;
mod translate;

use std::fmt;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};

use cranelift_codegen::Context;
use cranelift_codegen::isa::{self, OwnedTargetIsa};
use cranelift_codegen::settings::{self, Configurable};
use cranelift_frontend::FunctionBuilderContext;
use cranelift_jit::{JITBuilder, JITModule};
use cranelift_module::{Module, default_libcall_names};
use dgd_compiler::program::{FunctionKind, Program, ProgramFunction};

use code::NativeCode;
use plan::NativePlan;
pub(crate) use refusal::NativeRefusal;

/// Native code of a program's functions, each compiled on demand.
pub(crate) struct NativeFunctions {
    /// The target machine.
    machine: fn() -> Result<isa::Builder, NativeRefusal>,
    isa: OnceLock<Result<OwnedTargetIsa, NativeRefusal>>,
    /// One for each function of the program.
    functions: Vec<FunctionSlot>,
}

/// A function.
struct FunctionSlot {
    /// Number of calls left before it is compiled.
    calls_left: AtomicU32,
    /// Its code, or the reason why there is none.
    code: OnceLock<Result<NativeCode, NativeRefusal>>,
}

impl fmt::Debug for NativeFunctions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let compiled = |slot: &&FunctionSlot| matches!(slot.code.get(), Some(Ok(_)));
        let count = self.functions.iter().filter(compiled).count();
        f.debug_struct("Native").field("compiled", &count).finish_non_exhaustive()
    }
}

impl NativeFunctions {
    /// Native code for this machine; a function is compiled after `calls_before` calls.
    pub(crate) fn for_host(program: &Program, calls_before: fn(&ProgramFunction) -> u32) -> Self {
        let host = || {
            cranelift_native::builder().map_err(|reason| NativeRefusal::Machine(reason.to_owned()))
        };
        Self::new(program, host, calls_before)
    }

    fn new(
        program: &Program,
        machine: fn() -> Result<isa::Builder, NativeRefusal>,
        calls_before: fn(&ProgramFunction) -> u32,
    ) -> Self {
        let slot = |function| FunctionSlot {
            calls_left: AtomicU32::new(calls_before(function)),
            code: OnceLock::new(),
        };
        let functions = program.functions.iter().map(slot).collect();
        NativeFunctions { machine, isa: OnceLock::new(), functions }
    }

    /// The code of a function if it exists or if this call compiles it.
    #[inline]
    pub(crate) fn called(&self, program: &Program, kind: FunctionKind) -> Option<&NativeCode> {
        match self.functions[kind as usize].code.get() {
            Some(code) => code.as_ref().ok(),
            None => self.count(program, kind),
        }
    }

    #[cold]
    fn count(&self, program: &Program, kind: FunctionKind) -> Option<&NativeCode> {
        let left = &self.functions[kind as usize].calls_left;
        // Threads that count at the same time delay the compilation slightly.
        match left.load(Ordering::Relaxed).checked_sub(1) {
            None => self.code(program, kind).ok(),
            Some(fewer) => {
                left.store(fewer, Ordering::Relaxed);
                None
            }
        }
    }

    /// The code of a function, compiled if necessary.
    pub(crate) fn code(
        &self,
        program: &Program,
        kind: FunctionKind,
    ) -> Result<&NativeCode, &NativeRefusal> {
        let compile = || self.compile(program.function(kind));
        self.functions[kind as usize].code.get_or_init(compile).as_ref()
    }

    fn compile(&self, function: &ProgramFunction) -> Result<NativeCode, NativeRefusal> {
        let isa =
            self.isa.get_or_init(|| target(&(self.machine)()?)).as_ref().map_err(Clone::clone)?;
        let plan = NativePlan::new(function)?;
        let failed = |error: &dyn fmt::Display| NativeRefusal::Failed(error.to_string());
        let mut module = JITModule::new(JITBuilder::with_isa(isa.clone(), default_libcall_names()));
        let (mut context, mut builder) = (Context::new(), FunctionBuilderContext::new());
        let mut pieces = Vec::with_capacity(plan.pieces.len());
        for piece in &plan.pieces {
            context.func.signature = translate::signature(&**isa);
            translate::translate(&plan, piece, &mut context.func, &mut builder, &**isa);
            let signature = context.func.signature.clone();
            let id = module.declare_anonymous_function(&signature).map_err(|e| failed(&e))?;
            module.define_function(id, &mut context).map_err(|e| failed(&e))?;
            pieces.push(id);
            context.clear();
        }
        module.finalize_definitions().map_err(|error| failed(&error))?;
        let addresses: Vec<*const u8> =
            pieces.into_iter().map(|id| module.get_finalized_function(id)).collect();
        Ok(NativeCode::new(&plan, &addresses, module))
    }
}

/// The Cranelift target for a machine.
fn target(machine: &isa::Builder) -> Result<OwnedTargetIsa, NativeRefusal> {
    let flags = [
        // The verifier is enabled only in debug builds.
        ("enable_verifier", if cfg!(debug_assertions) { "true" } else { "false" }),
        // Common expressions are already eliminated, and operations must not be rearranged.
        ("opt_level", "none"),
        ("enable_probestack", "true"),
        ("probestack_strategy", "inline"),
        ("unwind_info", "false"),
        ("is_pic", "false"),
    ];
    let refused = |error: &dyn fmt::Display| NativeRefusal::Machine(error.to_string());
    let mut settings = settings::builder();
    for (name, value) in flags {
        settings.set(name, value).map_err(|error| refused(&error))?;
    }
    let isa = machine.finish(settings::Flags::new(settings)).map_err(|error| refused(&error))?;
    if isa.pointer_bits() != 64 {
        return Err(NativeRefusal::Machine("its addresses do not have 64 bits".to_owned()));
    }
    Ok(isa)
}
