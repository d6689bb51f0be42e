//! The interpreter: performs a program's operations one after another.

use std::cell::RefCell;
use std::sync::Arc;

use dgd_compiler::expr::intrinsics::Definition;
use dgd_compiler::program::{
    self, Argument, Function, FunctionKind, Operation, Program, Series, Taylor,
};
use dgd_runtime::linalg::AutoLu;
use dgd_runtime::taylor::{KeptSeries, NoTaylor, Terms};
use dgd_runtime::{Point, Signature, System};

use crate::describe::signature;
use crate::taylor::{Expansion, expand};

/// A program as a system, run operation by operation.
///
/// The same bits as the generated Rust. Cloning shares the program; each clone has work space of
/// its own, so that one clone serves one thread.
#[derive(Debug, Clone)]
pub struct Interpreted {
    program: Arc<Program>,
    signature: Arc<Signature>,
    /// Values of the function being evaluated.
    registers: RefCell<Vec<f64>>,
    /// Coefficients of one order of the series being computed.
    coefficients: RefCell<Vec<f64>>,
}

impl Interpreted {
    /// Makes a system of a program.
    pub fn new(program: Program) -> Self {
        let length = |function: &Function| {
            let of_loops = function.loops.iter().map(|part| part.body.len()).max();
            function.body.len() + of_loops.unwrap_or(0)
        };
        let longest = program.functions.iter().map(length).max().unwrap_or(0);
        let longest_series = (program.taylor.as_ref())
            .map_or(0, |Taylor { unknowns, sensitivities }| {
                unknowns.body.len().max(sensitivities.body.len())
            });
        Interpreted {
            signature: Arc::new(signature(&program)),
            program: Arc::new(program),
            registers: RefCell::new(vec![0.0; longest.max(longest_series)]),
            coefficients: RefCell::new(vec![0.0; longest_series]),
        }
    }

    fn run(
        &self,
        kind: FunctionKind,
        at: Point<'_>,
        udot: &[f64],
        s: &[f64],
        results: &mut [&mut [f64]],
    ) {
        let function = self.program.function(kind);
        let mut registers = self.registers.borrow_mut();
        let read = Read { at, udot, s };
        evaluate(&function.body, 0, 0, &read, &mut registers);
        let places = function.results.iter().zip(&function.places).zip(&function.lengths);
        for (((values, places), length), result) in places.zip(results.iter_mut()) {
            assert_eq!(*length, result.len(), "length of a result of {kind:?}");
            match places {
                None => {
                    for (number, value) in result.iter_mut().zip(values) {
                        *number = registers[value.index()];
                    }
                }
                Some(places) => {
                    for (place, value) in places.iter().zip(values) {
                        result[*place] = registers[value.index()];
                    }
                }
            }
        }
        for part in &function.loops {
            for k in 0..part.count as usize {
                evaluate(&part.body, function.body.len(), k, &read, &mut registers);
                for store in &part.stores {
                    results[store.result][store.first + k] = registers[store.value.index()];
                }
            }
        }
    }
}

impl Interpreted {
    fn expand(&self, at: Point<'_>, of: impl Fn(&Taylor) -> &Series, mut expansion: Expansion<'_>) {
        let Ok(taylor) = &self.program.taylor else {
            unreachable!("nobody asks for series that there are not")
        };
        let series = of(taylor);
        let mut registers = self.registers.borrow_mut();
        let read = Read { at, udot: expansion.udot, s: &[] };
        evaluate(&series.body, 0, 0, &read, &mut registers);
        let fixed = &registers[..series.body.len()];
        expansion.y[..at.y.len()].copy_from_slice(at.y);
        let mut now = self.coefficients.borrow_mut();
        expand(&self.program, series, fixed, &mut now, &mut expansion);
    }
}

/// What operations read.
struct Read<'a> {
    at: Point<'a>,
    udot: &'a [f64],
    s: &'a [f64],
}

impl Read<'_> {
    fn array(&self, argument: Argument) -> &[f64] {
        match argument {
            Argument::Y => self.at.y,
            Argument::U => self.at.u,
            Argument::P => self.at.p,
            Argument::Udot => self.udot,
            Argument::S => self.s,
            Argument::Z => self.at.z,
        }
    }
}

/// Performs operations whose values begin at `begin`, in the k-th passage of their loop.
fn evaluate(body: &[Operation], begin: usize, k: usize, read: &Read<'_>, registers: &mut [f64]) {
    let truth = |condition: bool| f64::from(u8::from(condition));
    for (i, operation) in body.iter().enumerate() {
        let (done, rest) = registers.split_at_mut(begin + i);
        rest[0] = match *operation {
            Operation::Constant(value) => value,
            Operation::Time => read.at.t,
            Operation::Load(argument, index) => read.array(argument)[index as usize],
            Operation::LoadSwept(argument, first) => read.array(argument)[first as usize + k],
            Operation::Counter => k as f64,
            Operation::Negate(a) => -done[a.index()],
            Operation::Add(a, b) => done[a.index()] + done[b.index()],
            Operation::Subtract(a, b) => done[a.index()] - done[b.index()],
            Operation::Multiply(a, b) => done[a.index()] * done[b.index()],
            Operation::Divide(a, b) => done[a.index()] / done[b.index()],
            Operation::Call1(f, a) => match f.get().definition {
                Definition::One { value, .. } => value(done[a.index()]),
                Definition::Two { .. } | Definition::Expansion(_) => {
                    unreachable!("a function of one argument")
                }
            },
            Operation::Call2(f, a, b) => match f.get().definition {
                Definition::Two { value, .. } => value(done[a.index()], done[b.index()]),
                Definition::One { .. } | Definition::Expansion(_) => {
                    unreachable!("a function of two arguments")
                }
            },
            Operation::Compare(comparison, a, b) => {
                truth(comparison.holds(done[a.index()], done[b.index()]))
            }
            Operation::And(a, b) => truth(done[a.index()] != 0.0 && done[b.index()] != 0.0),
            Operation::Or(a, b) => truth(done[a.index()] != 0.0 || done[b.index()] != 0.0),
            Operation::Not(a) => truth(done[a.index()] == 0.0),
            Operation::Select(c, a, b) => {
                if done[c.index()] == 0.0 {
                    done[b.index()]
                } else {
                    done[a.index()]
                }
            }
        };
    }
}

impl System for Interpreted {
    type Vector = Vec<f64>;
    type Sensitivity = Vec<f64>;
    type Inputs = Vec<f64>;
    type Jacobian = Vec<f64>;
    type SensitivityJacobian = Vec<f64>;
    type Factorisation = AutoLu;

    fn signature(&self) -> &Signature {
        &self.signature
    }

    fn rhs(&self, at: Point<'_>, f: &mut [f64]) {
        self.run(FunctionKind::Rhs, at, &[], &[], &mut [f]);
    }

    fn linearize(
        &self,
        at: Point<'_>,
        udot: &[f64],
        f: &mut [f64],
        jacobian: &mut [f64],
        dfdt: &mut [f64],
    ) {
        self.run(FunctionKind::Linearize, at, udot, &[], &mut [f, jacobian, dfdt]);
    }

    fn sensitivity_rhs(&self, at: Point<'_>, s: &[f64], f: &mut [f64], g: &mut [f64]) {
        self.run(FunctionKind::SensitivityRhs, at, &[], s, &mut [f, g]);
    }

    fn sensitivity_linearize(
        &self,
        at: Point<'_>,
        udot: &[f64],
        s: &[f64],
        f: &mut [f64],
        jacobian: &mut [f64],
        dfdt: &mut [f64],
        g: &mut [f64],
        dgdy: &mut [f64],
        dgdt: &mut [f64],
    ) {
        let results = &mut [f, jacobian, dfdt, g, dgdy, dgdt];
        self.run(FunctionKind::SensitivityLinearize, at, udot, s, results);
    }

    fn parameter_jacobian(&self, at: Point<'_>, values: &mut [f64]) {
        self.run(FunctionKind::ParameterJacobian, at, &[], &[], &mut [values]);
    }

    fn input_jacobian(&self, at: Point<'_>, values: &mut [f64]) {
        self.run(FunctionKind::InputJacobian, at, &[], &[], &mut [values]);
    }

    fn time_derivative(&self, at: Point<'_>, values: &mut [f64]) {
        self.run(FunctionKind::TimeDerivative, at, &[], &[], &mut [values]);
    }

    fn outputs(&self, at: Point<'_>, w: &mut [f64]) {
        self.run(FunctionKind::Outputs, at, &[], &[], &mut [w]);
    }

    fn output_jacobians(
        &self,
        at: Point<'_>,
        dwdy: &mut [f64],
        dwdu: &mut [f64],
        dwdp: &mut [f64],
        dwdt: &mut [f64],
    ) {
        self.run(FunctionKind::OutputJacobians, at, &[], &[], &mut [dwdy, dwdu, dwdp, dwdt]);
    }

    fn output_sensitivities(&self, at: Point<'_>, s: &[f64], w: &mut [f64], dw: &mut [f64]) {
        self.run(FunctionKind::OutputSensitivities, at, &[], s, &mut [w, dw]);
    }

    fn start(&self, at: Point<'_>, y: &mut [f64]) {
        self.run(FunctionKind::Start, at, &[], &[], &mut [y]);
    }

    fn start_sensitivities(&self, at: Point<'_>, s: &mut [f64]) {
        self.run(FunctionKind::StartSensitivities, at, &[], &[], &mut [s]);
    }

    fn delays(&self, at: Point<'_>, tau: &mut [f64]) {
        self.run(FunctionKind::Delays, at, &[], &[], &mut [tau]);
    }

    fn delay_sensitivities(&self, at: Point<'_>, dtau: &mut [f64]) {
        self.run(FunctionKind::DelaySensitivities, at, &[], &[], &mut [dtau]);
    }

    fn histories(
        &self,
        at: Point<'_>,
        values: &mut [f64],
        rates: &mut [f64],
        curvatures: &mut [f64],
    ) {
        self.run(FunctionKind::Histories, at, &[], &[], &mut [values, rates, curvatures]);
    }

    fn history_sensitivities(&self, at: Point<'_>, s: &mut [f64], rates: &mut [f64]) {
        self.run(FunctionKind::HistorySensitivities, at, &[], &[], &mut [s, rates]);
    }

    fn varying_delays(&self, at: Point<'_>, tau: &mut [f64]) {
        self.run(FunctionKind::VaryingDelays, at, &[], &[], &mut [tau]);
    }

    fn varying_delay_sensitivities(
        &self,
        at: Point<'_>,
        udot: &[f64],
        s: &[f64],
        dtau: &mut [f64],
        dtaudy: &mut [f64],
        dtaudt: &mut [f64],
    ) {
        let results = &mut [dtau, dtaudy, dtaudt];
        self.run(FunctionKind::VaryingDelaySensitivities, at, udot, s, results);
    }

    fn mass(&self, at: Point<'_>, mass: &mut [f64]) {
        if self.program.computes(FunctionKind::Mass) {
            self.run(FunctionKind::Mass, at, &[], &[], &mut [mass]);
        } else {
            self.signature.write_mass(mass);
        }
    }

    fn condition_times(&self, at: Point<'_>, times: &mut [f64], after: &mut [f64]) {
        self.run(FunctionKind::ConditionTimes, at, &[], &[], &mut [times, after]);
    }

    fn condition_time_sensitivities(&self, at: Point<'_>, dtimes: &mut [f64]) {
        self.run(FunctionKind::ConditionTimeSensitivities, at, &[], &[], &mut [dtimes]);
    }

    fn event_functions(&self, at: Point<'_>, e: &mut [f64]) {
        self.run(FunctionKind::EventFunctions, at, &[], &[], &mut [e]);
    }

    fn event_sensitivities(
        &self,
        at: Point<'_>,
        udot: &[f64],
        s: &[f64],
        de: &mut [f64],
        dedy: &mut [f64],
        dedt: &mut [f64],
    ) {
        self.run(FunctionKind::EventSensitivities, at, udot, s, &mut [de, dedy, dedt]);
    }

    fn resets(&self, at: Point<'_>, r: &mut [f64]) {
        self.run(FunctionKind::Resets, at, &[], &[], &mut [r]);
    }

    fn reset_sensitivities(
        &self,
        at: Point<'_>,
        udot: &[f64],
        s: &[f64],
        dr: &mut [f64],
        drdy: &mut [f64],
        drdt: &mut [f64],
    ) {
        self.run(FunctionKind::ResetSensitivities, at, udot, s, &mut [dr, drdy, drdt]);
    }

    fn taylor_series(&self) -> Result<KeptSeries, NoTaylor> {
        match &self.program.taylor {
            Ok(Taylor { unknowns, sensitivities }) => Ok(KeptSeries {
                unknowns: unknowns.n_kept(),
                sensitivities: sensitivities.n_kept(),
                has_branches: sensitivities.has_branches,
            }),
            Err(program::NoTaylor::Algebraic) => Err(NoTaylor::Algebraic),
            Err(program::NoTaylor::Delays) => Err(NoTaylor::Delays),
            Err(program::NoTaylor::Arrays) => Err(NoTaylor::Arrays),
        }
    }

    fn taylor(
        &self,
        at: Point<'_>,
        udot: &[f64],
        h: f64,
        order: usize,
        kept: &mut [Terms],
        y: &mut [f64],
    ) {
        let expansion = Expansion { udot, h, order, kept, y, s: &mut [] };
        self.expand(at, |taylor| &taylor.unknowns, expansion);
    }

    fn sensitivity_taylor(
        &self,
        at: Point<'_>,
        udot: &[f64],
        h: f64,
        order: usize,
        kept: &mut [Terms],
        y: &mut [f64],
        s: &mut [f64],
    ) {
        let expansion = Expansion { udot, h, order, kept, y, s };
        self.expand(at, |taylor| &taylor.sensitivities, expansion);
    }
}
