//! Functions in single assignment over f64, ready to run or to be written as code.

mod conserved;
mod derivation;
mod describe;
mod directions;
mod expressions;
mod formulas;
mod functions;
mod loops;
mod lower;
mod operation;
mod past;
mod rounds;
mod series;
mod taylor;
mod text;

use dgd_signature::arrays::OutputArray;
use dgd_signature::{Features, Pattern, Signature};

use crate::source::Span;
use crate::units::Dimension;

pub use dgd_signature::Direction;
pub use directions::{SensitivityDirections, choose};
pub use functions::{FUNCTIONS, FunctionArgument, FunctionKind, FunctionSpec, RUNS, ResultKind};
pub use lower::lower;
pub use operation::{Loop, LoopStore, ProgramFunction, ProgramOperation, StridedPosition, ValueId};
pub use series::{
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
