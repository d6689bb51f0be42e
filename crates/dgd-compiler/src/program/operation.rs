//! The functions of a program as operations in execution order.

use super::functions::{FunctionArgument, FunctionKind};
use crate::expr::curve::CurveId;
use crate::expr::graph::Comparison;
use crate::expr::intrinsics::IntrinsicId;

/// A function of the program.
#[derive(Debug, Clone)]
pub struct ProgramFunction {
    /// Its kind.
    pub kind: FunctionKind,
    /// Operations in order; value k is the result of operation k.
    pub body: Vec<ProgramOperation>,
    /// The model's names of values, in ascending order of the value.
    pub names: Vec<(ValueId, String)>,
    /// For each result of the function, its values.
    pub results: Vec<Vec<ValueId>>,
    /// For each result, the positions of its values; `None` if they are consecutive from the first.
    pub places: Vec<Option<Vec<usize>>>,
    /// Length of each result.
    pub lengths: Vec<usize>,
    /// Computations for each row of a family, after the body.
    pub loops: Vec<Loop>,
}

/// Operations for each r from 0 to `rounds` − 1, and in each of these for each k from 0 to `count` − 1.
///
/// Consecutive elements are passages of one round. A loop over several indices has several rounds, and so does one
/// whose elements are not consecutive.
#[derive(Debug, Clone)]
pub struct Loop {
    /// Number of rounds.
    pub rounds: u32,
    /// Operations of a round, in order; values are numbered after those of the function's body.
    pub head: Vec<ProgramOperation>,
    /// Number of passages in each round.
    pub count: u32,
    /// Operations of a passage, in order; values are numbered after those of the head.
    pub body: Vec<ProgramOperation>,
    /// Values to store, with their positions.
    pub stores: Vec<LoopStore>,
}

impl Loop {
    /// All its operations, those of the head first.
    pub fn operations(&self) -> impl Iterator<Item = &ProgramOperation> {
        self.head.iter().chain(&self.body)
    }

    /// The values that it reads, its own and the function's.
    pub fn reads(&self) -> impl Iterator<Item = ValueId> {
        let operands = self.operations().flat_map(|operation| operation.operands());
        operands.chain(self.stores.iter().map(|store| store.value))
    }

    /// Number of operations executed.
    pub fn performed(&self) -> usize {
        self.rounds as usize * (self.head.len() + self.count as usize * self.body.len())
    }
}

/// A position that moves with the rounds of a loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StridedPosition {
    /// Position in the first round.
    pub first: u32,
    /// Increment from one round to the next.
    pub by_round: i32,
}

/// A value stored in a result in each passage of a loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LoopStore {
    /// Position of the result in the function.
    pub result: usize,
    /// Position in the first passage of the first round; it increases by one with each passage.
    pub first: usize,
    /// Increment from one round to the next.
    pub by_round: isize,
    /// The value.
    pub value: ValueId,
}

/// The value of an operation: its position in the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ValueId(pub u32);

impl ValueId {
    /// Position in the body.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// One operation on earlier values. Conditions are values that are true or false.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ProgramOperation {
    /// A number.
    Constant(f64),
    /// t.
    Time,
    /// One number of an argument.
    Load(FunctionArgument, u32),
    /// In a loop, an argument's number that is at this position in the first passage of a round and moves by one with
    /// each passage.
    LoadSwept(FunctionArgument, StridedPosition),
    /// In a loop, an argument's number at the same position in all passages of a round.
    LoadRound(FunctionArgument, StridedPosition),
    /// In a loop, k.
    Counter,
    /// In a loop, r.
    Round,
    /// −a
    Negate(ValueId),
    /// a + b
    Add(ValueId, ValueId),
    /// a − b
    Subtract(ValueId, ValueId),
    /// a b
    Multiply(ValueId, ValueId),
    /// a / b
    Divide(ValueId, ValueId),
    /// f(a)
    Call1(IntrinsicId, ValueId),
    /// f(a, b)
    Call2(IntrinsicId, ValueId, ValueId),
    /// The curve of a table at a.
    Curve(CurveId, ValueId),
    /// Whether a < b, or another comparison.
    Compare(Comparison, ValueId, ValueId),
    /// Both.
    And(ValueId, ValueId),
    /// Either.
    Or(ValueId, ValueId),
    /// Not.
    Not(ValueId),
    /// The second if the first is true, otherwise the third.
    Select(ValueId, ValueId, ValueId),
}

impl ProgramOperation {
    /// The values it reads, in order.
    pub fn operands(self) -> impl Iterator<Item = ValueId> {
        let [a, b, c] = match self {
            ProgramOperation::Constant(_)
            | ProgramOperation::Time
            | ProgramOperation::Load(..)
            | ProgramOperation::LoadSwept(..)
            | ProgramOperation::LoadRound(..)
            | ProgramOperation::Counter
            | ProgramOperation::Round => [None; 3],
            ProgramOperation::Negate(a)
            | ProgramOperation::Call1(_, a)
            | ProgramOperation::Curve(_, a)
            | ProgramOperation::Not(a) => [Some(a), None, None],
            ProgramOperation::Add(a, b)
            | ProgramOperation::Subtract(a, b)
            | ProgramOperation::Multiply(a, b)
            | ProgramOperation::Divide(a, b)
            | ProgramOperation::Call2(_, a, b)
            | ProgramOperation::Compare(_, a, b)
            | ProgramOperation::And(a, b)
            | ProgramOperation::Or(a, b) => [Some(a), Some(b), None],
            ProgramOperation::Select(a, b, c) => [Some(a), Some(b), Some(c)],
        };
        [a, b, c].into_iter().flatten()
    }

    /// Whether its value is a condition.
    pub fn is_condition(self) -> bool {
        matches!(
            self,
            ProgramOperation::Compare(..)
                | ProgramOperation::And(..)
                | ProgramOperation::Or(..)
                | ProgramOperation::Not(_)
        )
    }
}
