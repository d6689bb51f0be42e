//! Functions in single assignment over f64, ready to run or to be written as code.

mod functions;
mod loops;
mod lower;
mod past;
mod taylor;
mod text;

use std::collections::BTreeMap;

use crate::expr::graph::Comparison;
use crate::expr::intrinsics::IntrinsicId;
use crate::source::Span;
use crate::units::Unit;

pub use crate::dae::{AutomatonKind, DelayedInput, DifferentiatedInput, Trigger};
pub use crate::model::{Crossing, Input, Interpolation, Parameter};
pub use functions::{Argument, FUNCTIONS, FunctionKind, FunctionSpec, RUNS, ResultKind};
pub use lower::lower;
pub use past::PastLayout;
pub use taylor::{Entry, Factor, NoTaylor, Recurrence, Series, Taylor, Term};

/// What `lower` promises:
///
/// - every function is a list of operations in execution order, each on earlier values,
/// - the patterns hold every place that can be non-zero and no other,
/// - nothing is left to decide: a back end that performs the operations as IEEE 754 double
///   precision, without contraction, gives the same bits as any other.
#[derive(Debug, Clone)]
pub struct Program {
    /// The model's name.
    pub name: String,
    /// The model's doc comment.
    pub doc: Vec<String>,
    /// Unknowns y.
    pub unknowns: Vec<Unknown>,
    /// Arrays of unknowns, which follow in y.
    pub arrays: Vec<Array>,
    /// Rows of the elements, ascending.
    pub families: Vec<Family>,
    /// Parameters p.
    pub parameters: Vec<Parameter>,
    /// Declared inputs; u has them first, then the delayed ones, then the slopes of the delayed ones,
    /// then what is known of delayed unknowns ([`Program::past`]).
    pub inputs: Vec<Input>,
    /// Distinct delays τ, as formulas write them.
    pub delays: Vec<String>,
    /// Distinct delays that vary, as formulas write them.
    pub varying_delays: Vec<String>,
    /// Declared inputs that arrive late.
    pub delayed_inputs: Vec<DelayedInput>,
    /// Unknowns that are read late.
    pub delayed_unknowns: Vec<DelayedUnknown>,
    /// Inputs that equations are differentiated through: they must not jump.
    pub differentiated_inputs: Vec<DifferentiatedInput>,
    /// Outputs w.
    pub outputs: Vec<Output>,
    /// Outputs for each element of an array, which follow in w.
    pub output_arrays: Vec<OutputArray>,
    /// Directions θ of the sensitivities.
    pub directions: Vec<Direction>,
    /// `modes` blocks. Event functions and resets stand transition by transition.
    pub automata: Vec<Automaton>,
    /// Number of conditions on time.
    pub n_time_conditions: usize,
    /// Where the matrices that are given by their non-zeros have them.
    pub patterns: BTreeMap<ResultKind, Pattern>,
    /// Places of the same matrices that follow those of `patterns`, a run for each expression of a
    /// family.
    pub runs: BTreeMap<ResultKind, Vec<Run>>,
    /// One function for each row of [`FUNCTIONS`], in its order.
    pub functions: Vec<Function>,
    /// Taylor series of the solutions, or why there are none.
    pub taylor: Result<Taylor, NoTaylor>,
}

/// A `modes` block, or what else changes at events.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Automaton {
    /// What it stands for.
    pub kind: AutomatonKind,
    /// Its name.
    pub name: String,
    /// Names of its modes.
    pub modes: Vec<String>,
    /// The mode it starts in.
    pub start: usize,
    /// Which mode follows which.
    pub transitions: Vec<Transition>,
}

/// A transition between modes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Transition {
    /// Position of the mode that it leaves.
    pub from: usize,
    /// Position of the mode that it enters.
    pub to: usize,
    /// In which direction its event function passes zero.
    pub crossing: Crossing,
    /// When it acts.
    pub trigger: Trigger,
    /// Positions of the unknowns that it resets.
    pub resets: Vec<usize>,
}

/// Something that sensitivities are taken to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// The parameter at this position.
    Parameter(usize),
    /// The start value of the unknown at this position.
    Start(usize),
}

/// An unknown x(t − τ).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DelayedUnknown {
    /// Which of the unknowns.
    pub unknown: usize,
    /// Which delay, or which of those that vary.
    pub delay: usize,
    /// Whether its delay varies.
    pub varies: bool,
    /// Whether the model says what it was before the start; otherwise that is what it starts with.
    pub has_history: bool,
}

/// An array of unknowns.
#[derive(Debug, Clone)]
pub struct Array {
    /// Its name.
    pub name: String,
    /// Unit of its elements.
    pub unit: Unit,
    /// Doc comment.
    pub doc: Vec<String>,
    /// Size for tolerances, SI.
    pub nominal: Option<f64>,
    /// Index of its first element.
    pub lower: i64,
    /// Position of its first element in y.
    pub first: usize,
    /// Number of elements.
    pub count: u32,
}

/// Rows of consecutive elements from one equation.
#[derive(Debug, Clone)]
pub struct Family {
    /// Position of the first row.
    pub first: usize,
    /// Number of rows.
    pub count: u32,
    /// ẏ = f, or 0 = f.
    pub differential: bool,
    /// Label of the equation.
    pub equation: String,
    /// First index of the equation's loop; none for an equation of its own.
    pub lower: Option<i64>,
    /// Where the equation stands.
    pub span: Span,
}

/// Places (row + k, column + k) or (row + k, column) for k from 0 to `count` − 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Run {
    /// Row of the first place.
    pub row: usize,
    /// Column of the first place.
    pub column: usize,
    /// Whether the column moves with the row.
    pub diagonal: bool,
    /// Number of places.
    pub count: u32,
}

/// Places that can be non-zero: (row, column), columns ascending, rows ascending within a column.
pub type Pattern = Vec<(usize, usize)>;

/// An unknown and its row.
#[derive(Debug, Clone)]
pub struct Unknown {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: Unit,
    /// Doc comment.
    pub doc: Vec<String>,
    /// Size for tolerances, SI.
    pub nominal: Option<f64>,
    /// ẏ = f, or 0 = f, in the modes it starts in.
    pub differential: bool,
    /// Whether other modes have it otherwise.
    pub by_mode: bool,
    /// Label of its equation.
    pub equation: String,
    /// Where the equation stands.
    pub span: Span,
}

/// An output.
#[derive(Debug, Clone)]
pub struct Output {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: Unit,
    /// Doc comment.
    pub doc: Vec<String>,
    /// Standard deviation of the sensor's white error, SI.
    pub noise: Option<f64>,
    /// Which delay it is read late by; none is zero.
    pub delay: Option<usize>,
}

/// Outputs for each element of an array.
#[derive(Debug, Clone)]
pub struct OutputArray {
    /// Their common name.
    pub name: String,
    /// Unit of each.
    pub unit: Unit,
    /// Doc comment.
    pub doc: Vec<String>,
    /// Standard deviation of the sensors' white error, SI.
    pub noise: Option<f64>,
    /// Index of the first.
    pub lower: i64,
    /// Position of the first in w.
    pub first: usize,
    /// Number of outputs.
    pub count: u32,
}

/// A function of the program.
#[derive(Debug, Clone)]
pub struct Function {
    /// Which one.
    pub kind: FunctionKind,
    /// Operations in order; value k is the result of operation k.
    pub body: Vec<Operation>,
    /// Names that the model gives to values, in ascending order of the value.
    pub names: Vec<(ValueId, String)>,
    /// For each result of the function, its numbers.
    pub results: Vec<Vec<ValueId>>,
    /// For each result, where its numbers go; without places one after the other from the first.
    pub places: Vec<Option<Vec<usize>>>,
    /// Length of each result.
    pub lengths: Vec<usize>,
    /// What is computed once for each row of a family, behind the body.
    pub loops: Vec<Loop>,
}

/// Operations for each k from 0 to `count` − 1.
#[derive(Debug, Clone)]
pub struct Loop {
    /// Number of passages.
    pub count: u32,
    /// Operations in order; values go on counting behind those of the function's body.
    pub body: Vec<Operation>,
    /// What goes where.
    pub stores: Vec<Store>,
}

/// A number of a result in each passage of a loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Store {
    /// Which result of the function.
    pub result: usize,
    /// Its place in the first passage; in the next it is the next.
    pub first: usize,
    /// The number.
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
pub enum Operation {
    /// A number.
    Constant(f64),
    /// t.
    Time,
    /// One number of an argument.
    Load(Argument, u32),
    /// In a loop, the number of an argument that is this one in the first passage and the next in
    /// the next.
    LoadSwept(Argument, u32),
    /// In a loop, k.
    Counter,
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
    /// Whether a < b and the like.
    Compare(Comparison, ValueId, ValueId),
    /// Both.
    And(ValueId, ValueId),
    /// Either.
    Or(ValueId, ValueId),
    /// Not.
    Not(ValueId),
    /// The second where the first is true, otherwise the third.
    Select(ValueId, ValueId, ValueId),
}

impl Operation {
    /// The values it reads, in order.
    pub fn operands(self) -> impl Iterator<Item = ValueId> {
        let [a, b, c] = match self {
            Operation::Constant(_)
            | Operation::Time
            | Operation::Load(..)
            | Operation::LoadSwept(..)
            | Operation::Counter => [None; 3],
            Operation::Negate(a) | Operation::Call1(_, a) | Operation::Not(a) => {
                [Some(a), None, None]
            }
            Operation::Add(a, b)
            | Operation::Subtract(a, b)
            | Operation::Multiply(a, b)
            | Operation::Divide(a, b)
            | Operation::Call2(_, a, b)
            | Operation::Compare(_, a, b)
            | Operation::And(a, b)
            | Operation::Or(a, b) => [Some(a), Some(b), None],
            Operation::Select(a, b, c) => [Some(a), Some(b), Some(c)],
        };
        [a, b, c].into_iter().flatten()
    }

    /// Whether its value is a condition.
    pub fn is_condition(self) -> bool {
        matches!(
            self,
            Operation::Compare(..) | Operation::And(..) | Operation::Or(..) | Operation::Not(_)
        )
    }
}

impl Program {
    /// Length of y.
    pub fn n(&self) -> usize {
        let elements = self.arrays.iter().map(|array| array.count as usize);
        self.unknowns.len() + elements.sum::<usize>()
    }

    /// Length of w.
    pub fn n_w(&self) -> usize {
        let of_arrays = self.output_arrays.iter().map(|array| array.count as usize);
        self.outputs.len() + of_arrays.sum::<usize>()
    }

    /// What the unknowns are called, elements of arrays included.
    pub fn unknown_names(&self) -> Vec<String> {
        let elements = self.arrays.iter().flat_map(|a| elements(&a.name, a.lower, a.count));
        self.unknowns.iter().map(|unknown| unknown.name.clone()).chain(elements).collect()
    }

    /// What the outputs are called, those of arrays included.
    pub fn output_names(&self) -> Vec<String> {
        let elements = self.output_arrays.iter().flat_map(|a| elements(&a.name, a.lower, a.count));
        self.outputs.iter().map(|output| output.name.clone()).chain(elements).collect()
    }

    /// Number of places of a matrix that is given by its non-zeros.
    pub fn n_places(&self, kind: ResultKind) -> usize {
        let runs = self.runs.get(&kind).into_iter().flatten().map(|run| run.count as usize);
        self.patterns.get(&kind).map_or(0, Vec::len) + runs.sum::<usize>()
    }

    /// Length of u.
    pub fn n_u(&self) -> usize {
        let past = self.past();
        past.first + past.len()
    }

    /// Where u has what is known of delayed unknowns.
    pub fn past(&self) -> PastLayout {
        PastLayout {
            first: self.inputs.len() + 2 * self.delayed_inputs.len(),
            n_v: self.delayed_unknowns.len(),
            n_s: self.directions.len(),
        }
    }

    /// Number of discrete numbers z.
    pub fn n_discrete(&self) -> usize {
        self.automata.len() + self.n_time_conditions
    }

    /// Whether it has functions of a kind: without modes, conditions on time or delays, those about
    /// them would compute nothing.
    pub fn computes(&self, kind: FunctionKind) -> bool {
        match kind {
            FunctionKind::Mass
            | FunctionKind::EventFunctions
            | FunctionKind::EventSensitivities
            | FunctionKind::Resets
            | FunctionKind::ResetSensitivities => !self.automata.is_empty(),
            FunctionKind::ConditionTimes | FunctionKind::ConditionTimeSensitivities => {
                self.n_time_conditions > 0
            }
            FunctionKind::Delays | FunctionKind::DelaySensitivities => !self.delays.is_empty(),
            FunctionKind::VaryingDelays | FunctionKind::VaryingDelaySensitivities => {
                !self.varying_delays.is_empty()
            }
            FunctionKind::Histories | FunctionKind::HistorySensitivities => {
                self.delayed_unknowns.iter().any(|delayed| delayed.has_history)
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

    /// Every place of a matrix that is given by its non-zeros, in the order of its numbers.
    pub fn places(&self, kind: ResultKind) -> impl Iterator<Item = (usize, usize)> + '_ {
        let single = self.patterns.get(&kind).into_iter().flatten().copied();
        let runs = self.runs.get(&kind).into_iter().flatten();
        single.chain(runs.flat_map(|run| {
            let column = move |k| if run.diagonal { run.column + k } else { run.column };
            (0..run.count as usize).map(move |k| (run.row + k, column(k)))
        }))
    }

    /// The function of a kind.
    pub fn function(&self, kind: FunctionKind) -> &Function {
        // Kinds, table and list have one order.
        &self.functions[kind as usize]
    }
}

/// `p[1]`, `p[2]` and so on.
fn elements(name: &str, lower: i64, count: u32) -> impl Iterator<Item = String> + '_ {
    (0..count).map(move |i| format!("{name}[{}]", lower + i64::from(i)))
}
