//! Machine code at run time, by Cranelift.
//!
//! ```text
//!   Function → Plan     checked, and cut into pieces
//!   Piece    → IR       one instruction for each operation
//!   IR       → Code     in memory, called from one place
//! ```
//!
//! A function is compiled when it is asked for: of the twenty and more that a program has, most tasks
//! use a few.

mod code;
mod plan;
mod translate;

use std::fmt;
use std::sync::OnceLock;

use cranelift_codegen::Context;
use cranelift_codegen::isa::{self, OwnedTargetIsa};
use cranelift_codegen::settings::{self, Configurable};
use cranelift_frontend::FunctionBuilderContext;
use cranelift_jit::{JITBuilder, JITModule};
use cranelift_module::{Module, default_libcall_names};
use dgd_compiler::program::{FUNCTIONS, Function, FunctionKind, Program};

pub(crate) use code::Code;
use plan::Plan;

/// Why there is no machine code.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Refused {
    /// Cranelift does not compile for such machines.
    Machine(String),
    /// The operations are not those of a program.
    Malformed,
    /// Its numbers are further apart than instructions reach.
    TooLarge,
    /// Cranelift failed, or the memory for the code was not given.
    Failed(String),
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Refused::Machine(reason) => write!(f, "not for this machine: {reason}"),
            Refused::Malformed => write!(f, "the program is malformed"),
            Refused::TooLarge => write!(f, "the model is too large"),
            Refused::Failed(reason) => write!(f, "{reason}"),
        }
    }
}

/// Machine code of a program's functions, each compiled when it is first asked for.
pub(crate) struct Native {
    isa: OwnedTargetIsa,
    /// One for each row of [`FUNCTIONS`]; none where a function is refused.
    functions: Vec<OnceLock<Option<Code>>>,
}

impl fmt::Debug for Native {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Native").field("target", &self.isa.triple()).finish_non_exhaustive()
    }
}

impl Native {
    /// For the machine that this runs on.
    pub(crate) fn for_host() -> Result<Self, Refused> {
        Self::new(cranelift_native::builder().map_err(|reason| Refused::Machine(reason.to_owned())))
    }

    fn new(machine: Result<isa::Builder, Refused>) -> Result<Self, Refused> {
        let flags = [
            // What is asked of the intermediate representation is tested, not checked in every run.
            ("enable_verifier", if cfg!(debug_assertions) { "true" } else { "false" }),
            // Programs have no common expressions left, and are not to be rearranged.
            ("opt_level", "none"),
            ("enable_probestack", "true"),
            ("probestack_strategy", "inline"),
            ("unwind_info", "false"),
            ("is_pic", "false"),
        ];
        let machine = machine?;
        let refused = |error: &dyn fmt::Display| Refused::Machine(error.to_string());
        let mut settings = settings::builder();
        for (name, value) in flags {
            settings.set(name, value).map_err(|error| refused(&error))?;
        }
        let isa =
            machine.finish(settings::Flags::new(settings)).map_err(|error| refused(&error))?;
        if isa.pointer_bits() != 64 {
            return Err(Refused::Machine("addresses have not 64 bits".to_owned()));
        }
        let functions = FUNCTIONS.iter().map(|_| OnceLock::new()).collect();
        Ok(Native { isa, functions })
    }

    /// The code of a function, compiled if it is not there yet; none where it is refused.
    pub(crate) fn function(&self, program: &Program, kind: FunctionKind) -> Option<&Code> {
        let compiled = &self.functions[kind as usize];
        compiled.get_or_init(|| self.compile(program.function(kind)).ok()).as_ref()
    }

    /// Compiles a function, and says why if that is refused.
    pub(crate) fn try_compile(&self, program: &Program, kind: FunctionKind) -> Result<(), Refused> {
        let code = self.compile(program.function(kind))?;
        // Where it is there already, it is the same.
        self.functions[kind as usize].set(Some(code)).unwrap_or_default();
        Ok(())
    }

    /// The code of a function if it has been compiled.
    #[inline]
    pub(crate) fn compiled(&self, kind: FunctionKind) -> Option<&Code> {
        self.functions[kind as usize].get()?.as_ref()
    }

    /// Compiles a function.
    fn compile(&self, function: &Function) -> Result<Code, Refused> {
        let plan = Plan::new(function)?;
        let failed = |error: &dyn fmt::Display| Refused::Failed(error.to_string());
        let mut module =
            JITModule::new(JITBuilder::with_isa(self.isa.clone(), default_libcall_names()));
        let isa = &*self.isa;
        let (mut context, mut builder) = (Context::new(), FunctionBuilderContext::new());
        let mut pieces = Vec::with_capacity(plan.pieces.len());
        for piece in &plan.pieces {
            context.func.signature = translate::signature(isa);
            translate::translate(&plan, piece, &mut context.func, &mut builder, isa);
            let signature = context.func.signature.clone();
            let id = module
                .declare_anonymous_function(&signature)
                .and_then(|id| module.define_function(id, &mut context).map(|()| id));
            pieces.push(id.map_err(|error| failed(&error))?);
            context.clear();
        }
        module.finalize_definitions().map_err(|error| failed(&error))?;
        let addresses: Vec<*const u8> =
            pieces.into_iter().map(|id| module.get_finalized_function(id)).collect();
        Ok(Code::new(&plan, &addresses, module))
    }
}
