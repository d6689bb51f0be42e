//! Functions in single assignment over f64, ready to run or to be written as code.

mod conserved;
mod describe;
mod directions;
mod expressions;
mod formulas;
mod functions;
mod loops;
mod lower;
mod past;
mod rounds;
mod taylor;
mod text;

use dgd_signature::arrays::OutputArray;
use dgd_signature::{Features, Pattern, Signature};

use crate::expr::curve::CurveId;
use crate::expr::graph::Comparison;
use crate::expr::intrinsics::IntrinsicId;
use crate::source::Span;
use crate::units::Dimension;

pub use dgd_signature::Direction;
pub use directions::{SensitivityDirections, choose};
pub use functions::{FUNCTIONS, FunctionArgument, FunctionKind, FunctionSpec, RUNS, ResultKind};
pub use lower::lower;
pub use taylor::{
    ConstantFactor, MatrixEntry, NoTaylor, Recurrence, ScaledOperand, SharedSeries, TaylorSeries,
};

/// `lower` guarantees that
///
/// - every function is a list of operations in execution order, each on earlier values,
/// - the patterns contain exactly the positions that can be non-zero,
/// - results are deterministic: a back end that performs the operations in IEEE 754 double precision, without
///   contraction, gives the same bits as any other.
#[derive(Debug, Clone)]
pub struct Program {
    /// Names, sizes, units, defaults and sparsity, for solvers.
    pub signature: Signature,
    /// Outputs for each element of an array, the last in the signature.
    pub output_arrays: Vec<OutputArray>,
    /// Features that the model does not use, so that solvers can skip them.
    pub features: Features,
    /// Further parts of its text.
    pub source: ProgramSource,
    /// One function for each row of [`FUNCTIONS`], in its order.
    pub functions: Vec<ProgramFunction>,
    /// Taylor series of the solutions, or the reason why there are none.
    pub taylor: Result<TaylorSeries, NoTaylor>,
}

/// Parts of a model's text that no solver needs, in the order of the signature's lists.
#[derive(Debug, Clone)]
pub struct ProgramSource {
    /// The model's doc comment.
    pub doc: Vec<String>,
    /// Unknowns that are not elements of arrays.
    pub unknowns: Vec<QuantityDescription>,
    /// Their rows.
    pub rows: Vec<UnknownRow>,
    /// Arrays of unknowns.
    pub arrays: Vec<QuantityDescription>,
    /// Place of the equation of each family of rows.
    pub families: Vec<Span>,
    /// Parameters.
    pub parameters: Vec<QuantityDescription>,
    /// Inputs.
    pub inputs: Vec<QuantityDescription>,
    /// Outputs that are not elements of arrays.
    pub outputs: Vec<QuantityDescription>,
    /// Outputs for each element of an array.
    pub output_arrays: Vec<QuantityDescription>,
}

/// A declared quantity.
#[derive(Debug, Clone)]
pub struct QuantityDescription {
    /// Doc comment.
    pub doc: Vec<String>,
    /// Its dimension.
    pub dimension: Dimension,
}

/// The row of an unknown.
#[derive(Debug, Clone, Copy)]
pub struct UnknownRow {
    /// Whether it is ẏ = f in some modes and 0 = f in others.
    pub by_mode: bool,
    /// Place of the equation.
    pub span: Span,
}

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

impl Program {
    /// Length of y.
    pub fn n(&self) -> usize {
        self.signature.unknowns.len()
    }

    /// Outputs that are not elements of arrays.
    pub fn single_outputs(&self) -> &[dgd_signature::Output] {
        let elements = self.output_arrays.iter().map(|array| array.count);
        let single = self.signature.outputs.len() - elements.sum::<usize>();
        &self.signature.outputs[..single]
    }

    /// The pattern of a sparse matrix; `None` for other results.
    pub fn pattern(&self, kind: ResultKind) -> Option<&Pattern> {
        let signature = &self.signature;
        let [dwdy, dwdu, dwdp] = &signature.output_jacobians;
        match kind {
            ResultKind::Jacobian => Some(&signature.jacobian),
            ResultKind::Dgdy => Some(&signature.sensitivity_jacobian),
            ResultKind::ParameterJacobian => Some(&signature.parameter_jacobian),
            ResultKind::InputJacobian => Some(&signature.input_jacobian),
            ResultKind::Dwdy => Some(dwdy),
            ResultKind::Dwdu => Some(dwdu),
            ResultKind::Dwdp => Some(dwdp),
            ResultKind::EventJacobian => Some(&signature.discrete.event_jacobian),
            ResultKind::EventDirections => Some(&signature.discrete.event_directions),
            ResultKind::ResetJacobian => Some(&signature.discrete.reset_jacobian),
            ResultKind::ResetDirections => Some(&signature.discrete.reset_directions),
            ResultKind::JumpJacobian => Some(&signature.discrete.jump_jacobian),
            _ => None,
        }
    }

    /// Whether it has functions of a kind: without modes, conditions on time or delays, the corresponding functions
    /// would be empty.
    pub fn computes(&self, kind: FunctionKind) -> bool {
        match kind {
            FunctionKind::Mass
            | FunctionKind::EventFunctions
            | FunctionKind::EventDerivatives
            | FunctionKind::Resets
            | FunctionKind::ResetDerivatives => !self.signature.discrete.automata.is_empty(),
            FunctionKind::Jumps | FunctionKind::JumpSensitivities => {
                !self.signature.discrete.jump_jacobian.is_empty()
            }
            FunctionKind::ConditionTimes | FunctionKind::ConditionTimeSensitivities => {
                self.signature.discrete.n_time_conditions > 0
            }
            FunctionKind::StartEquations | FunctionKind::StartEquationSensitivities => {
                !self.signature.start_equations.is_empty()
            }
            FunctionKind::Delays | FunctionKind::DelaySensitivities => {
                !self.signature.delays.is_empty()
            }
            FunctionKind::VaryingDelays | FunctionKind::VaryingDelaySensitivities => {
                !self.signature.varying_delays.is_empty()
            }
            FunctionKind::Histories | FunctionKind::HistorySensitivities => {
                self.signature.delayed_unknowns.iter().any(|delayed| delayed.has_history)
            }
            FunctionKind::Rhs
            | FunctionKind::Linearize
            | FunctionKind::SensitivityRhs
            | FunctionKind::SensitivityLinearize
            | FunctionKind::ParameterJacobian
            | FunctionKind::InputJacobian
            | FunctionKind::TimeDerivative
            | FunctionKind::Outputs
            | FunctionKind::OutputJacobians
            | FunctionKind::OutputSensitivities
            | FunctionKind::Start
            | FunctionKind::StartSensitivities => true,
        }
    }

    /// The function of a kind.
    pub fn function(&self, kind: FunctionKind) -> &ProgramFunction {
        // Kinds, table and list have the same order.
        &self.functions[kind as usize]
    }
}
