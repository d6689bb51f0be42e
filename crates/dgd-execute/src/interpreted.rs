//! A program as a system of the interpreter alone.

use dgd_compiler::program::{FunctionKind, Program};
use dgd_runtime::linalg::AutoLu;
use dgd_runtime::{EvaluationPoint, Failure, Options, Problem, Solution, WantedResults};

use crate::interpret::Interpreter;
use crate::loaded::LoadedSystem;
use crate::on_demand::OnDemand;
use crate::system::{FunctionExecutor, ProgramSystem};

/// A program as a system, executed operation by operation.
///
/// Results equal those of the generated Rust bit for bit. Cloning shares the program; each clone has its own work space
/// and serves one thread.
pub type InterpretedSystem = ProgramSystem<Interpreter>;

impl InterpretedSystem {
    /// Makes a system of a program.
    pub fn new(program: Program) -> Self {
        ProgramSystem(Interpreter::new(program))
    }
}

impl FunctionExecutor for Interpreter {
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
        self
    }

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

    /// Integrates as a loaded model without native code, so that users of the interpreter need not compile a solver.
    fn integrate(
        problem: &Problem<'_, InterpretedSystem>,
        times: &[f64],
        options: &Options,
        wanted: WantedResults<'_>,
    ) -> Result<Solution, Failure> {
        let system = LoadedSystem::interpreted(problem.system.0.clone());
        let Problem { p, inputs, start, .. } = *problem;
        OnDemand::integrate(&Problem { system: &system, p, inputs, start }, times, options, wanted)
    }
}
