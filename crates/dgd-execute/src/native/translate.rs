//! Translates a piece of a function to Cranelift's intermediate representation.
//!
//! A piece receives t and the address of an [`ArrayFrame`](super::code::ArrayFrame) of addresses. Conditions are
//! integers, 0 or 1. Nothing is fused or reordered: each operation is the same IEEE 754 instruction that the
//! interpreter executes, or a call of the same function.

use std::collections::HashMap;
use std::ops::Range;

use cranelift_codegen::ir::condcodes::{FloatCC, IntCC};
use cranelift_codegen::ir::{
    AbiParam, Block, BlockArg, Function as Code, InstBuilder, MemFlagsData, SigRef, Signature,
    Type, Value, types,
};
use cranelift_codegen::isa::TargetIsa;
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use dgd_compiler::expr::graph::Comparison;
use dgd_compiler::expr::intrinsics::{Instruction, IntrinsicDefinition, IntrinsicId};
use dgd_compiler::program::{FunctionArgument, Loop, ProgramOperation, StridedPosition, ValueId};

use super::code::{ArrayFrame, call_curve, call_one, call_two};
use super::plan::{CodePiece, NativePlan, ValueKind, distance, is_immediate, position};

/// Addresses and distances; the compiler supports only machines on which they have 64 bits.
pub(super) const ADDRESS: Type = types::I64;

/// Bytes from one number of an array to the next.
const STRIDE: i64 = size_of::<f64>().cast_signed() as i64;

/// The signature of every piece.
pub(super) fn signature(isa: &dyn TargetIsa) -> Signature {
    let mut signature = Signature::new(isa.default_call_conv());
    signature.params.extend([AbiParam::new(types::F64), AbiParam::new(ADDRESS)]);
    signature
}

/// Writes a piece into `code`, which so far only has its signature.
pub(super) fn translate(
    plan: &NativePlan<'_>,
    piece: &CodePiece,
    code: &mut Code,
    context: &mut FunctionBuilderContext,
    isa: &dyn TargetIsa,
) {
    let mut builder = FunctionBuilder::new(code, context);
    let entry = builder.create_block();
    builder.append_block_params_for_function_params(entry);
    builder.switch_to_block(entry);
    let &[t, frame] = builder.block_params(entry) else {
        unreachable!("a piece takes t and a frame");
    };
    let calls = [1, 2].map(|arity| {
        let mut signature = Signature::new(isa.default_call_conv());
        signature.params.extend(vec![AbiParam::new(types::F64); arity]);
        signature.params.push(AbiParam::new(ADDRESS));
        signature.returns.push(AbiParam::new(types::F64));
        builder.import_signature(signature)
    });
    let mut translation = Translation {
        plan,
        builder,
        t,
        frame,
        calls,
        addresses: HashMap::new(),
        round: None,
        moved: HashMap::new(),
        values: HashMap::new(),
    };
    translation.body(piece.body.clone());
    for part in &plan.function.loops[piece.loops.clone()] {
        translation.repeat(part);
    }
    translation.builder.ins().return_(&[]);
    translation.builder.seal_all_blocks();
    translation.builder.finalize(isa.frontend_config());
}

/// An array whose address is in the frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum FrameArray {
    Argument(FunctionArgument),
    Result(usize),
    Scratch,
}

/// A passage of a loop.
#[derive(Debug, Clone, Copy)]
struct NativePassage {
    /// Byte offset of this passage's number in an array from that of the first.
    offset: Value,
}

/// Movement of a position in a loop.
#[derive(Debug, Clone, Copy, Default)]
struct LoopMovement {
    by_round: i64,
    passage: Option<NativePassage>,
}

struct Translation<'a, 'b> {
    plan: &'a NativePlan<'a>,
    builder: FunctionBuilder<'b>,
    t: Value,
    frame: Value,
    /// Signatures of functions of one argument and of two.
    calls: [SigRef; 2],
    /// Addresses of arrays, loaded in blocks that dominate every later one.
    addresses: HashMap<FrameArray, Value>,
    /// The current round of a loop, and addresses advanced by a constant number of elements in each round.
    round: Option<Value>,
    moved: HashMap<(FrameArray, i64), Value>,
    /// Values of the body, loaded in the same way, and in a loop those of the passage.
    values: HashMap<ValueId, Value>,
}

impl Translation<'_, '_> {
    /// Emits operations of the body, and stores values for results and for other pieces.
    fn body(&mut self, range: Range<usize>) {
        let plan = self.plan;
        for index in range {
            let id = ValueId(index as u32);
            let operation = plan.function.body[index];
            if !is_immediate(operation) {
                let value = self.perform(operation, None);
                self.values.insert(id, value);
            }
            for (result, place) in &plan.stores[index] {
                let value = self.operand(id);
                self.store(value, FrameArray::Result(*result), *place, LoopMovement::default());
            }
            if plan.kept[index] {
                let value = self.operand(id);
                self.store(value, FrameArray::Scratch, index, LoopMovement::default());
            }
        }
    }

    /// Emits a loop.
    fn repeat(&mut self, part: &Loop) {
        if part.count == 0 {
            return;
        }
        // Values that all passages read are computed before the first.
        let first = self.plan.function.body.len();
        for value in part.reads() {
            if value.index() < first {
                self.operand(value);
            }
        }
        for operation in part.operations() {
            if let ProgramOperation::Load(argument, _)
            | ProgramOperation::LoadSwept(argument, _)
            | ProgramOperation::LoadRound(argument, _) = operation
            {
                self.address(FrameArray::Argument(*argument));
            }
        }
        for store in &part.stores {
            self.address(FrameArray::Result(store.result));
        }

        if part.rounds == 1 {
            self.passages(part);
        } else {
            let (round, after) = (self.builder.create_block(), self.builder.create_block());
            let r = self.enter(round);
            self.begin_round(part, r);
            self.passages(part);
            self.again_unless(r, 1, i64::from(part.rounds), round, after);
            self.round = None;
            self.moved.clear();
        }
        for k in 0..part.operations().count() {
            self.values.remove(&ValueId((first + k) as u32));
        }
    }

    /// Emits the beginning of a round: the addresses that move with the rounds, and the head.
    fn begin_round(&mut self, part: &Loop, r: Value) {
        self.round = Some(r);
        let loads = part.operations().filter_map(|operation| match operation {
            ProgramOperation::LoadSwept(argument, place)
            | ProgramOperation::LoadRound(argument, place) => {
                Some((FrameArray::Argument(*argument), i64::from(place.by_round)))
            }
            _ => None,
        });
        let stores = part.stores.iter();
        let stores = stores.map(|store| (FrameArray::Result(store.result), store.by_round as i64));
        for (array, by_round) in loads.chain(stores) {
            if by_round != 0 && !self.moved.contains_key(&(array, by_round)) {
                let base = self.address(array);
                let offset = self.builder.ins().imul_imm_s(r, by_round * STRIDE);
                let address = self.builder.ins().iadd(base, offset);
                self.moved.insert((array, by_round), address);
            }
        }
        let first = self.plan.function.body.len();
        for (k, operation) in part.head.iter().enumerate() {
            let value = self.perform(*operation, None);
            self.values.insert(ValueId((first + k) as u32), value);
        }
    }

    /// Emits the passages of a round.
    fn passages(&mut self, part: &Loop) {
        if part.count == 1 {
            self.passage(part, None);
            return;
        }
        let (passage, after) = (self.builder.create_block(), self.builder.create_block());
        let offset = self.enter(passage);
        self.passage(part, Some(NativePassage { offset }));
        self.again_unless(offset, STRIDE, i64::from(part.count) * STRIDE, passage, after);
    }

    fn passage(&mut self, part: &Loop, now: Option<NativePassage>) {
        let first = self.plan.function.body.len() + part.head.len();
        for (k, operation) in part.body.iter().enumerate() {
            let value = self.perform(*operation, now);
            self.values.insert(ValueId((first + k) as u32), value);
        }
        for store in &part.stores {
            let value = self.operand(store.value);
            let movement = LoopMovement { by_round: store.by_round as i64, passage: now };
            self.store(value, FrameArray::Result(store.result), store.first, movement);
        }
    }

    /// Begins a repeated block, and returns its counter from zero.
    fn enter(&mut self, block: Block) -> Value {
        let counted = self.builder.append_block_param(block, ADDRESS);
        let zero = self.builder.ins().iconst(ADDRESS, 0);
        self.builder.ins().jump(block, &[BlockArg::Value(zero)]);
        self.builder.switch_to_block(block);
        counted
    }

    /// Ends a block that is repeated until its counter has reached `end`.
    fn again_unless(&mut self, counted: Value, by: i64, end: i64, block: Block, after: Block) {
        let next = self.builder.ins().iadd_imm_s(counted, by);
        let more = self.builder.ins().icmp_imm_s(IntCC::NotEqual, next, end);
        self.builder.ins().brif(more, block, &[BlockArg::Value(next)], after, &[]);
        self.builder.switch_to_block(after);
    }

    /// Emits an operation whose operands are available, and returns its value.
    fn perform(&mut self, operation: ProgramOperation, passage: Option<NativePassage>) -> Value {
        match operation {
            ProgramOperation::Constant(number) => self.builder.ins().f64const(number),
            ProgramOperation::Time => self.t,
            ProgramOperation::Load(argument, index) => self.load(
                types::F64,
                FrameArray::Argument(argument),
                index as usize,
                LoopMovement::default(),
            ),
            ProgramOperation::LoadSwept(argument, StridedPosition { first, by_round }) => {
                let movement = LoopMovement { by_round: by_round.into(), passage };
                self.load(types::F64, FrameArray::Argument(argument), first as usize, movement)
            }
            ProgramOperation::LoadRound(argument, StridedPosition { first, by_round }) => {
                let movement = LoopMovement { by_round: by_round.into(), passage: None };
                self.load(types::F64, FrameArray::Argument(argument), first as usize, movement)
            }
            ProgramOperation::Counter => match passage {
                None => self.builder.ins().f64const(0.0),
                Some(NativePassage { offset }) => {
                    let shift = i64::from(STRIDE.trailing_zeros());
                    let k = self.builder.ins().ushr_imm_u(offset, shift);
                    self.builder.ins().fcvt_from_sint(types::F64, k)
                }
            },
            ProgramOperation::Round => match self.round {
                None => self.builder.ins().f64const(0.0),
                Some(r) => self.builder.ins().fcvt_from_sint(types::F64, r),
            },
            ProgramOperation::Negate(a) => {
                let a = self.operand(a);
                self.builder.ins().fneg(a)
            }
            ProgramOperation::Add(a, b) => {
                let (a, b) = (self.operand(a), self.operand(b));
                self.builder.ins().fadd(a, b)
            }
            ProgramOperation::Subtract(a, b) => {
                let (a, b) = (self.operand(a), self.operand(b));
                self.builder.ins().fsub(a, b)
            }
            ProgramOperation::Multiply(a, b) => {
                let (a, b) = (self.operand(a), self.operand(b));
                self.builder.ins().fmul(a, b)
            }
            ProgramOperation::Divide(a, b) => {
                let (a, b) = (self.operand(a), self.operand(b));
                self.builder.ins().fdiv(a, b)
            }
            ProgramOperation::Call1(function, a) => {
                let a = self.operand(a);
                self.call_one(function, a)
            }
            ProgramOperation::Call2(function, a, b) => {
                let (a, b) = (self.operand(a), self.operand(b));
                self.call_two(function, a, b)
            }
            ProgramOperation::Curve(curve, a) => {
                let a = self.operand(a);
                // Curves live as long as the process.
                let curve = (&raw const curve.get().curve).cast();
                self.call(0, call_curve as *const (), curve, &[a])
            }
            ProgramOperation::Compare(comparison, a, b) => {
                let (a, b) = (self.operand(a), self.operand(b));
                // False if either is NaN.
                let holds = match comparison {
                    Comparison::Less => FloatCC::LessThan,
                    Comparison::LessEqual => FloatCC::LessThanOrEqual,
                    Comparison::Greater => FloatCC::GreaterThan,
                    Comparison::GreaterEqual => FloatCC::GreaterThanOrEqual,
                };
                self.builder.ins().fcmp(holds, a, b)
            }
            ProgramOperation::And(a, b) => {
                let (a, b) = (self.operand(a), self.operand(b));
                self.builder.ins().band(a, b)
            }
            ProgramOperation::Or(a, b) => {
                let (a, b) = (self.operand(a), self.operand(b));
                self.builder.ins().bor(a, b)
            }
            ProgramOperation::Not(a) => {
                let a = self.operand(a);
                self.builder.ins().bxor_imm_u(a, 1)
            }
            ProgramOperation::Select(c, a, b) => {
                let (c, a, b) = (self.operand(c), self.operand(a), self.operand(b));
                self.builder.ins().select(c, a, b)
            }
        }
    }

    /// A value that is available, or that is recomputed where it is used.
    fn operand(&mut self, id: ValueId) -> Value {
        if let Some(value) = self.values.get(&id) {
            return *value;
        }
        let plan = self.plan;
        let operation = plan.function.body[id.index()];
        let value = match operation {
            // Processors load it from memory as an operand.
            ProgramOperation::Constant(number) => return self.builder.ins().f64const(number),
            _ if is_immediate(operation) => self.perform(operation, None),
            _ => {
                let kind = match plan.kinds[id.index()] {
                    ValueKind::Number => types::F64,
                    ValueKind::Condition => types::I8,
                };
                self.load(kind, FrameArray::Scratch, id.index(), LoopMovement::default())
            }
        };
        self.values.insert(id, value);
        value
    }

    fn call_one(&mut self, function: IntrinsicId, a: Value) -> Value {
        let IntrinsicDefinition::One { value, instruction, .. } = function.get().definition else {
            unreachable!("a function of one argument, as the plan has checked")
        };
        let builder = &mut self.builder;
        match instruction {
            Some(Instruction::SquareRoot) => builder.ins().sqrt(a),
            Some(Instruction::Absolute) => builder.ins().fabs(a),
            Some(Instruction::Sign) => {
                let [zero, one, minus_one] =
                    [0.0, 1.0, -1.0].map(|number: f64| builder.ins().f64const(number));
                let above = builder.ins().fcmp(FloatCC::GreaterThan, a, zero);
                let below = builder.ins().fcmp(FloatCC::LessThan, a, zero);
                let otherwise = builder.ins().select(below, minus_one, a);
                builder.ins().select(above, one, otherwise)
            }
            None => self.call(0, call_one as *const (), value as *const (), &[a]),
        }
    }

    fn call_two(&mut self, function: IntrinsicId, a: Value, b: Value) -> Value {
        let IntrinsicDefinition::Two { value, .. } = function.get().definition else {
            unreachable!("a function of two arguments, as the plan has checked")
        };
        self.call(1, call_two as *const (), value as *const (), &[a, b])
    }

    /// Calls a function of the table through one of the two functions that native code can call.
    fn call(
        &mut self,
        signature: usize,
        through: *const (),
        function: *const (),
        of: &[Value],
    ) -> Value {
        let mut arguments = of.to_vec();
        arguments.push(self.builder.ins().iconst(ADDRESS, function.addr().cast_signed() as i64));
        let through = self.builder.ins().iconst(ADDRESS, through.addr().cast_signed() as i64);
        let call = self.builder.ins().call_indirect(self.calls[signature], through, &arguments);
        self.builder.inst_results(call)[0]
    }

    fn load(&mut self, kind: Type, array: FrameArray, place: usize, at: LoopMovement) -> Value {
        let (address, distance) = self.place(array, place, at);
        let flags = match array {
            FrameArray::Argument(_) => MemFlagsData::trusted().with_readonly().with_can_move(),
            FrameArray::Result(_) | FrameArray::Scratch => MemFlagsData::trusted(),
        };
        self.builder.ins().load(kind, flags, address, distance)
    }

    fn store(&mut self, value: Value, array: FrameArray, place: usize, at: LoopMovement) {
        let (address, distance) = self.place(array, place, at);
        self.builder.ins().store(MemFlagsData::trusted(), value, address, distance);
    }

    /// The location of a number: an address and an offset.
    fn place(&mut self, array: FrameArray, place: usize, at: LoopMovement) -> (Value, i32) {
        let base = match at.by_round {
            0 => self.address(array),
            by_round => self.moved[&(array, by_round)],
        };
        let address = match at.passage {
            None => base,
            Some(NativePassage { offset }) => self.builder.ins().iadd(base, offset),
        };
        let Some(distance) = distance(place) else {
            unreachable!("a place within reach, as the plan has checked")
        };
        (address, distance)
    }

    fn address(&mut self, array: FrameArray) -> Value {
        if let Some(address) = self.addresses.get(&array) {
            return *address;
        }
        let base = match array {
            FrameArray::Argument(argument) => ArrayFrame::argument(position(argument)),
            FrameArray::Result(result) => ArrayFrame::result(result),
            FrameArray::Scratch => ArrayFrame::scratch(),
        };
        let flags = MemFlagsData::trusted().with_readonly().with_can_move();
        let address = self.builder.ins().load(ADDRESS, flags, self.frame, base);
        self.addresses.insert(array, address);
        address
    }
}
