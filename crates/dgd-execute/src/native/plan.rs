//! Plans the native code of a function: checks it and cuts it into pieces.

use std::ops::Range;

use dgd_compiler::expr::intrinsics::IntrinsicDefinition;
use dgd_compiler::program::{FunctionArgument, Loop, ProgramFunction, ProgramOperation, ValueId};

use super::refusal::NativeRefusal;

/// Maximum number of operations in one piece of native code. The cost of register allocation grows faster than
/// linearly, and so does the stack that a piece needs.
const MOST_OPERATIONS: usize = 1500;

/// Arrays that functions read, in the order of their addresses in a frame.
pub(super) const ARGUMENTS: [FunctionArgument; 6] = [
    FunctionArgument::Y,
    FunctionArgument::U,
    FunctionArgument::P,
    FunctionArgument::Z,
    FunctionArgument::Udot,
    FunctionArgument::S,
];

/// Maximum number of results of a function.
pub(super) const MOST_RESULTS: usize = 6;

/// The kind of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ValueKind {
    Number,
    Condition,
}

/// Operations of one piece of native code: some of the body, then whole loops.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct CodePiece {
    pub(super) body: Range<usize>,
    pub(super) loops: Range<usize>,
}

/// A function that was checked for everything on which its native code relies.
#[derive(Debug)]
pub(super) struct NativePlan<'a> {
    pub(super) function: &'a ProgramFunction,
    /// Kinds of the values of the body.
    pub(super) kinds: Vec<ValueKind>,
    pub(super) pieces: Vec<CodePiece>,
    /// Which values of the body another piece needs: these are stored in memory, each in its own place.
    pub(super) kept: Vec<bool>,
    /// For each value of the body, the results and places to which it is stored.
    pub(super) stores: Vec<Vec<(usize, usize)>>,
    /// Number of values read from each of [`ARGUMENTS`].
    pub(super) reads: [usize; ARGUMENTS.len()],
}

impl<'a> NativePlan<'a> {
    /// Checks a function and cuts it into pieces.
    ///
    /// A valid plan guarantees that all operands are earlier values of the right kind, all places lie within their
    /// results, and all distances can be addressed.
    pub(super) fn new(function: &'a ProgramFunction) -> Result<Self, NativeRefusal> {
        let mut reads = ReadCounts::default();
        let kinds = kinds(&function.body, &[], None, &mut reads)?;
        for part in &function.loops {
            let of_loop = kinds_of_loop(part, &kinds, &mut reads)?;
            for store in &part.stores {
                let (first, by_round) = (store.first as i128, store.by_round as i128);
                let end = end_of(part, first, by_round, part.count)?;
                let length = function.lengths.get(store.result).ok_or(NativeRefusal::Malformed)?;
                if end > *length || number(&of_loop, store.value).is_err() {
                    return Err(NativeRefusal::Malformed);
                }
            }
        }
        let stores = stores(function, &kinds)?;
        let pieces = pieces(function);
        let kept = kept(function, &pieces);
        let lengths = function.lengths.iter().chain(&reads.0).copied();
        if lengths.chain([function.body.len()]).any(|length| distance(length).is_none()) {
            return Err(NativeRefusal::TooLarge);
        }
        Ok(NativePlan { function, kinds, pieces, kept, stores, reads: reads.0 })
    }

    /// Length of the memory in which pieces leave values for others.
    pub(super) fn scratch(&self) -> usize {
        self.kept.iter().rposition(|kept| *kept).map_or(0, |last| last + 1)
    }
}

/// Distance of a number from the first of its array, in bytes; `None` if no instruction reaches that far.
pub(super) fn distance(place: usize) -> Option<i32> {
    i32::try_from(place.checked_mul(size_of::<f64>())?).ok()
}

/// Whether a value is recomputed where it is used, because that is as cheap as storing it.
pub(super) fn is_immediate(operation: ProgramOperation) -> bool {
    matches!(
        operation,
        ProgramOperation::Constant(_) | ProgramOperation::Time | ProgramOperation::Load(..)
    )
}

/// Number of values read from each argument.
#[derive(Default)]
struct ReadCounts([usize; ARGUMENTS.len()]);

impl ReadCounts {
    /// Records that the first `end` values are read.
    fn note(&mut self, argument: FunctionArgument, end: usize) {
        let reads = &mut self.0[position(argument)];
        *reads = (*reads).max(end);
    }
}

/// One past the last of the places that a loop visits, `count` in each round; none may lie before the first of all.
fn end_of(part: &Loop, first: i128, by_round: i128, count: u32) -> Result<usize, NativeRefusal> {
    let last = first + by_round * (i128::from(part.rounds) - 1);
    let end = first.max(last) + i128::from(count);
    if part.rounds == 0 || first.min(last) < 0 {
        return Err(NativeRefusal::Malformed);
    }
    usize::try_from(end).map_err(|_| NativeRefusal::TooLarge)
}

/// Position in [`ARGUMENTS`].
pub(super) fn position(argument: FunctionArgument) -> usize {
    match argument {
        FunctionArgument::Y => 0,
        FunctionArgument::U => 1,
        FunctionArgument::P => 2,
        FunctionArgument::Z => 3,
        FunctionArgument::Udot => 4,
        FunctionArgument::S => 5,
    }
}

fn kinds_of_loop(
    part: &Loop,
    before: &[ValueKind],
    reads: &mut ReadCounts,
) -> Result<Vec<ValueKind>, NativeRefusal> {
    let of_head = kinds(&part.head, before, Some((part, 1)), reads)?;
    kinds(&part.body, &of_head, Some((part, part.count)), reads)
}

/// The kinds of the values, including those `before`; checks that operands have the kinds that operations expect. In a
/// loop, `part` has the loop and the number of passages in each round.
fn kinds(
    body: &[ProgramOperation],
    before: &[ValueKind],
    part: Option<(&Loop, u32)>,
    reads: &mut ReadCounts,
) -> Result<Vec<ValueKind>, NativeRefusal> {
    let mut kinds = before.to_vec();
    kinds.reserve(body.len());
    for operation in body {
        let kind = match *operation {
            ProgramOperation::Constant(_) | ProgramOperation::Time => ValueKind::Number,
            ProgramOperation::Load(argument, index) => {
                reads.note(argument, index as usize + 1);
                ValueKind::Number
            }
            ProgramOperation::LoadSwept(argument, place)
            | ProgramOperation::LoadRound(argument, place) => {
                let (part, passages) = part.ok_or(NativeRefusal::Malformed)?;
                let moves = matches!(operation, ProgramOperation::LoadSwept(..));
                let count = if moves { passages } else { 1 };
                let end = end_of(part, place.first.into(), place.by_round.into(), count)?;
                reads.note(argument, end);
                ValueKind::Number
            }
            ProgramOperation::Counter | ProgramOperation::Round => {
                part.ok_or(NativeRefusal::Malformed)?;
                ValueKind::Number
            }
            ProgramOperation::Call1(function, a) => {
                match function.get().definition {
                    IntrinsicDefinition::One { .. } => number(&kinds, a)?,
                    IntrinsicDefinition::Two { .. } | IntrinsicDefinition::Expansion(..) => {
                        return Err(NativeRefusal::Malformed);
                    }
                }
                ValueKind::Number
            }
            ProgramOperation::Call2(function, a, b) => {
                match function.get().definition {
                    IntrinsicDefinition::Two { .. } => {
                        number(&kinds, a)?;
                        number(&kinds, b)?;
                    }
                    IntrinsicDefinition::One { .. } | IntrinsicDefinition::Expansion(..) => {
                        return Err(NativeRefusal::Malformed);
                    }
                }
                ValueKind::Number
            }
            ProgramOperation::Negate(a) | ProgramOperation::Curve(_, a) => {
                number(&kinds, a)?;
                ValueKind::Number
            }
            ProgramOperation::Add(a, b)
            | ProgramOperation::Subtract(a, b)
            | ProgramOperation::Multiply(a, b)
            | ProgramOperation::Divide(a, b) => {
                number(&kinds, a)?;
                number(&kinds, b)?;
                ValueKind::Number
            }
            ProgramOperation::Compare(_, a, b) => {
                number(&kinds, a)?;
                number(&kinds, b)?;
                ValueKind::Condition
            }
            ProgramOperation::And(a, b) | ProgramOperation::Or(a, b) => {
                condition(&kinds, a)?;
                condition(&kinds, b)?;
                ValueKind::Condition
            }
            ProgramOperation::Not(a) => {
                condition(&kinds, a)?;
                ValueKind::Condition
            }
            ProgramOperation::Select(c, a, b) => {
                condition(&kinds, c)?;
                match (kinds.get(a.index()), kinds.get(b.index())) {
                    (Some(a), Some(b)) if a == b => *a,
                    _ => return Err(NativeRefusal::Malformed),
                }
            }
        };
        kinds.push(kind);
    }
    Ok(kinds)
}

fn number(kinds: &[ValueKind], value: ValueId) -> Result<(), NativeRefusal> {
    is(ValueKind::Number, kinds, value)
}

fn condition(kinds: &[ValueKind], value: ValueId) -> Result<(), NativeRefusal> {
    is(ValueKind::Condition, kinds, value)
}

fn is(kind: ValueKind, kinds: &[ValueKind], value: ValueId) -> Result<(), NativeRefusal> {
    if kinds.get(value.index()) == Some(&kind) { Ok(()) } else { Err(NativeRefusal::Malformed) }
}

/// For each value of the body, its destinations.
fn stores(
    function: &ProgramFunction,
    kinds: &[ValueKind],
) -> Result<Vec<Vec<(usize, usize)>>, NativeRefusal> {
    let ProgramFunction { results, places, lengths, .. } = function;
    let same = results.len() == places.len() && results.len() == lengths.len();
    if !same || results.len() > MOST_RESULTS {
        return Err(NativeRefusal::Malformed);
    }
    let mut stores = vec![Vec::new(); function.body.len()];
    for (result, (values, places)) in results.iter().zip(places).enumerate() {
        for (k, value) in values.iter().enumerate() {
            let place = match places {
                None => k,
                Some(places) => *places.get(k).ok_or(NativeRefusal::Malformed)?,
            };
            number(kinds, *value)?;
            if place >= lengths[result] {
                return Err(NativeRefusal::Malformed);
            }
            stores[value.index()].push((result, place));
        }
    }
    Ok(stores)
}

fn pieces(function: &ProgramFunction) -> Vec<CodePiece> {
    let n = function.body.len();
    let mut pieces: Vec<CodePiece> = (0..n)
        .step_by(MOST_OPERATIONS)
        .map(|begin| CodePiece { body: begin..n.min(begin + MOST_OPERATIONS), loops: 0..0 })
        .collect();
    // Loops are added to the last piece while there is room.
    let mut size = pieces.last().map_or(0, |piece| piece.body.len());
    for (k, part) in function.loops.iter().enumerate() {
        let size_of_part = part.operations().count();
        size += size_of_part;
        match pieces.last_mut() {
            Some(piece) if size <= MOST_OPERATIONS => {
                piece.loops =
                    if piece.loops.is_empty() { k..k + 1 } else { piece.loops.start..k + 1 };
            }
            _ => {
                pieces.push(CodePiece { body: n..n, loops: k..k + 1 });
                size = size_of_part;
            }
        }
    }
    pieces
}

/// Which values of the body are used in later pieces.
fn kept(function: &ProgramFunction, pieces: &[CodePiece]) -> Vec<bool> {
    let n = function.body.len();
    let mut kept = vec![false; n];
    for piece in pieces {
        let of_loops = function.loops[piece.loops.clone()].iter();
        let in_loops = of_loops.flat_map(Loop::reads);
        let in_body = function.body[piece.body.clone()].iter().flat_map(|o| o.operands());
        for value in in_body.chain(in_loops) {
            let earlier = value.index() < n && !piece.body.contains(&value.index());
            if earlier && !is_immediate(function.body[value.index()]) {
                kept[value.index()] = true;
            }
        }
    }
    kept
}
