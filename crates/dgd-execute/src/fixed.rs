//! Solvers for loaded models of a few unknowns, with their number as a constant.
//!
//! The steps of a small model are a few dozen operations on vectors of n numbers. With n constant at compile time they
//! need no loops, bounds checks or heap memory, which removes most of the overhead of a loaded model compared with a
//! generated one. The solver is compiled here once for each n of the table in [`run`], not where models are loaded.

use dgd_compiler::program::{FunctionKind, Program};
use dgd_runtime::integrate::integrate;
use dgd_runtime::linalg::FixedLu;
use dgd_runtime::{EvaluationPoint, Failure, Options, Problem, Solution, WantedResults};

use crate::interpret::{InterpretedSystem, Interpreter};
use crate::loaded::{LoadedSystem, OnDemand};
use crate::system::{FunctionExecutor, ProgramSystem};

/// Whether these solvers are built; otherwise the one for any n serves all, with the same bits.
const SIZED: bool = cfg!(feature = "sized");

/// A loaded model of N unknowns.
struct FixedSizeModel<'a, const N: usize>(&'a OnDemand);

impl<const N: usize> FunctionExecutor for FixedSizeModel<'_, N> {
    type Vector = [f64; N];
    type Sensitivity = Vec<f64>;
    type Inputs = Vec<f64>;
    type Jacobian = Vec<f64>;
    type SensitivityJacobian = Vec<f64>;
    type Factorisation = FixedLu<N>;

    fn program(&self) -> &Program {
        self.0.program()
    }

    fn interpreter(&self) -> &Interpreter {
        self.0.interpreter()
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
        self.0.perform(kind, at, udot, s, results);
    }
}

/// Integrates a loaded model.
pub(crate) fn run(
    problem: &Problem<'_, LoadedSystem>,
    times: &[f64],
    options: &Options,
    wanted: WantedResults<'_>,
) -> Result<Solution, Failure> {
    match problem.system.0.program().n() {
        1 if SIZED => run_fixed::<1>(problem, times, options, wanted),
        2 if SIZED => run_fixed::<2>(problem, times, options, wanted),
        3 if SIZED => run_fixed::<3>(problem, times, options, wanted),
        4 if SIZED => run_fixed::<4>(problem, times, options, wanted),
        _ => integrate(problem, times, options, wanted),
    }
}

/// Integrates an interpreted model as a loaded one without native code, so that users of the interpreter need not
/// compile a solver.
pub(crate) fn run_interpreted(
    problem: &Problem<'_, InterpretedSystem>,
    times: &[f64],
    options: &Options,
    wanted: WantedResults<'_>,
) -> Result<Solution, Failure> {
    let system = LoadedSystem::interpreted(problem.system.0.clone());
    let Problem { p, inputs, start, .. } = *problem;
    run(&Problem { system: &system, p, inputs, start }, times, options, wanted)
}

fn run_fixed<const N: usize>(
    problem: &Problem<'_, LoadedSystem>,
    times: &[f64],
    options: &Options,
    wanted: WantedResults<'_>,
) -> Result<Solution, Failure> {
    let system = ProgramSystem(FixedSizeModel::<N>(&problem.system.0));
    let Problem { p, inputs, start, .. } = *problem;
    integrate(&Problem { system: &system, p, inputs, start }, times, options, wanted)
}
