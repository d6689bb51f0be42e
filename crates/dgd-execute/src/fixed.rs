//! Solvers for loaded models of a few unknowns, with their number as a constant.
//!
//! The steps of a small model are a few dozen operations on vectors of n numbers. With n constant at compile time they
//! need no loops, bounds checks or heap memory, which removes most of the overhead of a loaded model compared with a
//! generated one. The solver is compiled here once for each n of the table in [`run`], not where models are loaded.

use dgd_compiler::program::{FunctionKind, Program};
use dgd_runtime::integrate::integrate;
use dgd_runtime::linalg::FixedLu;
use dgd_runtime::{EvaluationPoint, Failure, Options, Problem, Solution, WantedResults};

use crate::interpret::Interpreter;
use crate::on_demand::OnDemand;
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

/// Integrates a loaded model if its number of unknowns has a solver of its own.
pub(crate) fn run(
    problem: &Problem<'_, OnDemand>,
    times: &[f64],
    options: &Options,
    wanted: WantedResults<'_>,
) -> Option<Result<Solution, Failure>> {
    let run = match problem.system.program().n() {
        1 if SIZED => run_fixed::<1>,
        2 if SIZED => run_fixed::<2>,
        3 if SIZED => run_fixed::<3>,
        4 if SIZED => run_fixed::<4>,
        _ => return None,
    };
    Some(run(problem, times, options, wanted))
}

fn run_fixed<const N: usize>(
    problem: &Problem<'_, OnDemand>,
    times: &[f64],
    options: &Options,
    wanted: WantedResults<'_>,
) -> Result<Solution, Failure> {
    let system = ProgramSystem(FixedSizeModel::<N>(problem.system));
    let Problem { p, inputs, start, .. } = *problem;
    integrate(&Problem { system: &system, p, inputs, start }, times, options, wanted)
}
