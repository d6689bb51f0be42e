//! The interpreter: executes a program's operations one after another.

use std::cell::RefCell;
#[cfg(feature = "native")]
use std::cell::RefMut;
use std::sync::Arc;

use dgd_compiler::expr::intrinsics::IntrinsicDefinition;
use dgd_compiler::program::{
    FunctionArgument, FunctionKind, Program, ProgramFunction, ProgramOperation, SharedSeries,
    StridedPosition, TaylorSeries,
};
use dgd_runtime::EvaluationPoint;

use crate::taylor::{SeriesComputation, expand};

/// Executes a program's operations one after another.
#[derive(Debug, Clone)]
pub struct Interpreter {
    program: Arc<Program>,
    /// Values of the function being evaluated.
    registers: RefCell<Vec<f64>>,
    /// Coefficients of one order of the current series.
    coefficients: RefCell<Vec<f64>>,
}

impl Interpreter {
    pub(crate) fn new(program: Program) -> Self {
        let length = |function: &ProgramFunction| {
            let of_loops = function.loops.iter().map(|part| part.operations().count()).max();
            function.body.len() + of_loops.unwrap_or(0)
        };
        let longest = program.functions.iter().map(length).max().unwrap_or(0);
        let longest_series = program
            .taylor
            .as_ref()
            .map_or(0, |taylor| taylor.unknowns.body.len().max(taylor.sensitivities.body.len()));
        Interpreter {
            program: Arc::new(program),
            registers: RefCell::new(vec![0.0; longest.max(longest_series)]),
            coefficients: RefCell::new(vec![0.0; longest_series]),
        }
    }

    pub(crate) fn program(&self) -> &Program {
        &self.program
    }

    /// Work space with a place for each value of any function.
    #[cfg(feature = "native")]
    pub(crate) fn registers(&self) -> RefMut<'_, Vec<f64>> {
        self.registers.borrow_mut()
    }

    /// Expands a solution into its series.
    pub(crate) fn expand(
        &self,
        at: EvaluationPoint<'_>,
        of: impl Fn(&TaylorSeries) -> &SharedSeries,
        mut expansion: SeriesComputation<'_>,
    ) {
        let Ok(taylor) = &self.program.taylor else {
            unreachable!("nobody asks for series that there are not")
        };
        let series = of(taylor);
        let len = series.body.len();
        let mut registers = self.registers.borrow_mut();
        let read = OperationData { at, udot: expansion.udot, s: &[] };
        evaluate(&series.body, 0, LoopPassage::default(), &read, &mut registers);
        expansion.y[..at.y.len()].copy_from_slice(at.y);
        let mut now = self.coefficients.borrow_mut();
        expand(&self.program, series, &registers[..len], &mut now, &mut expansion);
    }

    /// Executes one function, as [`FunctionExecutor::perform`](crate::FunctionExecutor::perform) does.
    pub(crate) fn perform(
        &self,
        kind: FunctionKind,
        at: EvaluationPoint<'_>,
        udot: &[f64],
        s: &[f64],
        results: &mut [&mut [f64]],
    ) {
        let function = self.program.function(kind);
        let mut registers = self.registers.borrow_mut();
        let read = OperationData { at, udot, s };
        evaluate(&function.body, 0, LoopPassage::default(), &read, &mut registers);
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
            let head = function.body.len();
            let body = head + part.head.len();
            for round in 0..part.rounds as usize {
                let begin = LoopPassage { round, k: 0 };
                evaluate(&part.head, head, begin, &read, &mut registers);
                for k in 0..part.count as usize {
                    let passage = LoopPassage { round, k };
                    evaluate(&part.body, body, passage, &read, &mut registers);
                    for store in &part.stores {
                        let place = moved(store.first, store.by_round, round) + k;
                        results[store.result][place] = registers[store.value.index()];
                    }
                }
            }
        }
    }
}

/// The data that operations read.
struct OperationData<'a> {
    at: EvaluationPoint<'a>,
    udot: &'a [f64],
    s: &'a [f64],
}

impl OperationData<'_> {
    fn array(&self, argument: FunctionArgument) -> &[f64] {
        match argument {
            FunctionArgument::Y => self.at.y,
            FunctionArgument::U => self.at.u,
            FunctionArgument::P => self.at.p,
            FunctionArgument::Udot => self.udot,
            FunctionArgument::S => self.s,
            FunctionArgument::Z => self.at.z,
        }
    }
}

/// A passage of a loop, the k-th of its round.
#[derive(Clone, Copy, Default)]
struct LoopPassage {
    round: usize,
    k: usize,
}

/// A place of a loop in one of its rounds.
fn moved(first: usize, by_round: isize, round: usize) -> usize {
    first.wrapping_add_signed(by_round * round.cast_signed())
}

/// Executes operations whose values begin at `begin`, in a passage of their loop.
fn evaluate(
    body: &[ProgramOperation],
    begin: usize,
    passage: LoopPassage,
    read: &OperationData<'_>,
    registers: &mut [f64],
) {
    let LoopPassage { round, k } = passage;
    let place =
        |StridedPosition { first, by_round }| moved(first as usize, by_round as isize, round);
    let truth = |condition: bool| f64::from(u8::from(condition));
    for (i, operation) in body.iter().enumerate() {
        let (done, rest) = registers.split_at_mut(begin + i);
        rest[0] = match *operation {
            ProgramOperation::Constant(value) => value,
            ProgramOperation::Time => read.at.t,
            ProgramOperation::Load(argument, index) => read.array(argument)[index as usize],
            ProgramOperation::LoadSwept(argument, at) => read.array(argument)[place(at) + k],
            ProgramOperation::LoadRound(argument, at) => read.array(argument)[place(at)],
            ProgramOperation::Counter => k as f64,
            ProgramOperation::Round => round as f64,
            ProgramOperation::Negate(a) => -done[a.index()],
            ProgramOperation::Add(a, b) => done[a.index()] + done[b.index()],
            ProgramOperation::Subtract(a, b) => done[a.index()] - done[b.index()],
            ProgramOperation::Multiply(a, b) => done[a.index()] * done[b.index()],
            ProgramOperation::Divide(a, b) => done[a.index()] / done[b.index()],
            ProgramOperation::Call1(f, a) => match f.get().definition {
                IntrinsicDefinition::One { value, .. } => value(done[a.index()]),
                IntrinsicDefinition::Two { .. } | IntrinsicDefinition::Expansion(..) => {
                    unreachable!("a function of one argument")
                }
            },
            ProgramOperation::Call2(f, a, b) => match f.get().definition {
                IntrinsicDefinition::Two { value, .. } => value(done[a.index()], done[b.index()]),
                IntrinsicDefinition::One { .. } | IntrinsicDefinition::Expansion(..) => {
                    unreachable!("a function of two arguments")
                }
            },
            ProgramOperation::Curve(curve, a) => curve.value(done[a.index()]),
            ProgramOperation::Compare(comparison, a, b) => {
                truth(comparison.holds(done[a.index()], done[b.index()]))
            }
            ProgramOperation::And(a, b) => truth(done[a.index()] != 0.0 && done[b.index()] != 0.0),
            ProgramOperation::Or(a, b) => truth(done[a.index()] != 0.0 || done[b.index()] != 0.0),
            ProgramOperation::Not(a) => truth(done[a.index()] == 0.0),
            ProgramOperation::Select(c, a, b) => {
                if done[c.index()] == 0.0 {
                    done[b.index()]
                } else {
                    done[a.index()]
                }
            }
        };
    }
}
