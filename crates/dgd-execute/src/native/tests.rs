//! Compares native code with the interpreter, on programs that no model file contains.

#[path = "../../../../tests/support/normal.rs"]
mod normal;

use std::fmt::Write as _;

use cranelift_codegen::isa;
use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{SensitivityDirections, compile};
use dgd_compiler::program::{
    FUNCTIONS, FunctionArgument, FunctionKind, Loop, LoopStore, Program, ProgramFunction,
    ProgramOperation, StridedPosition, ValueId,
};
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_runtime::EvaluationPoint;

use normal::Noise;

use super::plan::{ARGUMENTS, NativePlan};
use super::{NativeFunctions, NativeRefusal};
use crate::system::FunctionExecutor;
use crate::{Engine, InterpretedSystem, LoadedSystem};

/// Special values of functions.
const SPECIAL: [f64; 8] =
    [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -0.0, f64::MIN_POSITIVE, 1e-310, -1e300];

fn program(text: &str) -> Program {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let main = SourceText { name: "model.dgd".to_owned(), text: text.to_owned() };
    let none = &mut |_: &str| Err("no file".to_owned());
    let options = ModelOptions::default();
    let compiled =
        compile(main, &options, &SensitivityDirections::All, none, &mut sources, &mut diagnostics);
    let Ok(compiled) = compiled else {
        let shown = render::render(&diagnostics.sorted(), &sources, render::RenderStyle::Plain);
        panic!("{shown}\n{text}")
    };
    compiled.program
}

/// A random expression of all forms of the language.
fn expression(noise: &mut Noise, depth: usize) -> String {
    if depth == 0 {
        let leaf = ["x", "v", "a", "b", "u", "time/1 [s]"][noise.below(6)];
        return match noise.below(3) {
            0 => format!("{:.3}*{leaf}", 3.0 * noise.next()),
            _ => leaf.to_owned(),
        };
    }
    let one = |noise: &mut Noise| expression(noise, depth - 1);
    let (first, second) = (one(noise), one(noise));
    match noise.below(12) {
        0 => format!("({first} + {second})"),
        1 => format!("({first} - {second})"),
        2 | 3 => format!("({first})*({second})"),
        4 => format!("({first})/({second})"),
        5 => {
            let unary =
                ["sqrt", "exp", "log", "log10", "sin", "cos", "tan", "atan", "asin", "acos"];
            format!("{}({first})", unary[noise.below(unary.len())])
        }
        6 => {
            let unary = [
                "sinh",
                "cosh",
                "tanh",
                "abs",
                "sign",
                "-",
                "floor",
                "ceil",
                "round",
                "erf",
                "erfc",
                "lgamma",
                "polygamma(1, 1)*",
            ];
            format!("{}({first})", unary[noise.below(unary.len())])
        }
        7 => format!(
            "{}({first}, {second})",
            ["min", "max", "atan2", "hypot", "mod"][noise.below(5)]
        ),
        8 => format!("({first})^{}", ["2", "3", "0.5", "(a)", "(-1)"][noise.below(5)]),
        _ => {
            let (third, fourth) = (one(noise), one(noise));
            let less = ["<", "<=", ">", ">="][noise.below(4)];
            let joint = ["and", "or", "and not"][noise.below(3)];
            format!(
                "(if {first} {less} {second} {joint} ({third} > {fourth}) then {third} else {fourth})"
            )
        }
    }
}

/// A model with such expressions in its outputs, and with loops.
fn model(noise: &mut Noise, outputs: usize) -> String {
    let mut text = "\
model random
size N = 7
parameter a = 0.7
parameter b = 1.3
input u linear
state x = 0.1 + a
state v = -b
state p[i in 1..N] = a*i
size M = 4
parameter c[i in 1..M] = 0.3*i
state T[1..M][1..N] = 1
for i in 1..M {
  equation left[i]: 1 [s]*der(T[i][1]) = c[i]*sqrt(c[i]) - T[i][1]*u
  equation right[i]: 1 [s]*der(T[i][N]) = T[i][N-1] - a*T[M+1-i][N]
}
for j in 2..N-1 { equation top[j]: 1 [s]*der(T[1][j]) = j*x - T[1][j] }
for i in 2..M, j in 2..N-1 {
  equation inner[i][j]: 1 [s]*der(T[i][j]) = exp(-c[i]*b)*(T[i-1][j] - T[i][j]) + p[j]*T[i][j-1]/c[i-1] - j*T[M+1-i][j+1]
}
equation one: 1 [s]*der(x) = a*v - b*x*x + u + p[3]
equation two: 1 [s]*der(v) = sin(b*x) - v*sqrt(1 + x^2)
equation first: 1 [s]*der(p[1]) = u - p[1]*abs(p[1])
for i in 2..N { equation cell[i]: 1 [s]*der(p[i]) = i*a*(p[i-1] - p[i]) + v*exp(-p[i]^2) + max(p[i], x) }
output p
"
    .to_owned();
    for k in 0..outputs {
        let _ = writeln!(text, "output w{k} = {}", expression(noise, 3));
    }
    text
}

/// A point at which functions are evaluated.
struct At {
    t: f64,
    arrays: [Vec<f64>; ARGUMENTS.len()],
}

impl At {
    fn random(program: &Program, noise: &mut Noise) -> At {
        let n = program.n();
        let lengths = [
            n,
            program.signature.n_u(),
            program.signature.parameters.len(),
            program.signature.discrete.len(),
            program.signature.n_u(),
            n * program.signature.directions.len(),
        ];
        let mut number = || 2.0 * noise.next();
        let arrays = lengths.map(|len| (0..len).map(|_| number()).collect());
        At { t: number(), arrays }
    }

    /// Bits of all results of a function; all NaNs count as equal.
    fn bits(&self, performed: &impl FunctionExecutor, function: &ProgramFunction) -> Vec<Vec<u64>> {
        let mut results: Vec<Vec<f64>> =
            function.lengths.iter().map(|length| vec![0.25; *length]).collect();
        let mut slices: Vec<&mut [f64]> = results.iter_mut().map(Vec::as_mut_slice).collect();
        let [y, u, p, z, udot, s] = &self.arrays;
        performed.perform(
            function.kind,
            EvaluationPoint { t: self.t, y, u, p, z },
            udot,
            s,
            &mut slices,
        );
        let bits = |x: &f64| if x.is_nan() { f64::NAN.to_bits() } else { x.to_bits() };
        results.iter().map(|result| result.iter().map(bits).collect()).collect()
    }
}

/// Compares every function at random points and at special values.
fn compare(program: &Program, noise: &mut Noise) {
    let interpreted = InterpretedSystem::new(program.clone());
    let native = LoadedSystem::with_engine(program.clone(), Engine::Native);
    native.compile().expect("native code where tests run");
    for round in 0..20 {
        let mut point = At::random(program, noise);
        if round > 0 {
            for array in &mut point.arrays {
                let special = SPECIAL[noise.below(SPECIAL.len())];
                if !array.is_empty() {
                    let k = noise.below(array.len());
                    array[k] = special;
                }
            }
        }
        for function in &program.functions {
            let expected = point.bits(&interpreted.0, function);
            assert_eq!(point.bits(&native.0, function), expected, "{:?}", function.kind);
        }
    }
}

#[test]
fn random_expressions_and_loops_give_the_bits_of_the_interpreter() {
    for seed in 0..40 {
        let mut noise = Noise::new(seed);
        let program = program(&model(&mut noise, 6));
        let loops = &program.function(FunctionKind::Rhs).loops;
        let in_rounds = loops.iter().filter(|part| part.rounds > 1);
        assert!(in_rounds.map(|part| part.count).any(|count| count > 1), "rows are rounds");
        compare(&program, &mut noise);
    }
}

#[test]
fn functions_of_several_pieces_give_the_bits_of_the_interpreter() {
    let mut noise = Noise::new(99);
    let program = program(&model(&mut noise, 150));
    let plan = NativePlan::new(program.function(FunctionKind::OutputJacobians)).expect("a plan");
    assert!(plan.pieces.len() > 2, "{} pieces", plan.pieces.len());
    assert!(plan.kept.contains(&true), "no piece reads what another has computed");
    let loops = plan.function.loops.len();
    assert_eq!(plan.pieces.last().map(|piece| piece.loops.end), Some(loops));
    compare(&program, &mut noise);
}

#[test]
fn a_function_is_compiled_when_it_has_been_called_often() {
    let program = program(&model(&mut Noise::new(3), 1));
    let native = NativeFunctions::for_host(&program, |_| 2);
    let compiled = |kind| native.called(&program, kind).is_some();
    let calls = [(); 4].map(|()| compiled(FunctionKind::Rhs));
    assert_eq!(calls, [false, false, true, true]);
    assert!(!compiled(FunctionKind::Linearize), "each function counts for itself");
}

#[test]
fn the_interpreter_takes_over_on_other_machines() {
    let program = program(&model(&mut Noise::new(3), 2));
    let unknown = || {
        isa::lookup_by_name("sparc-unknown-linux-gnu")
            .map_err(|error| NativeRefusal::Machine(error.to_string()))
    };
    let native = NativeFunctions::new(&program, unknown, |_| 0);
    assert!(matches!(native.code(&program, FunctionKind::Rhs), Err(NativeRefusal::Machine(_))));
    let loaded = LoadedSystem::with_native(program.clone(), native);
    let message = loaded.compile().expect_err("no code").to_string();
    assert!(message.starts_with("there is no native code: not for this machine"), "{message}");
    let interpreted = InterpretedSystem::new(program.clone());
    let point = At::random(&program, &mut Noise::new(1));
    for function in &program.functions {
        assert_eq!(point.bits(&loaded.0, function), point.bits(&interpreted.0, function));
    }
}

#[test]
fn asked_for_the_interpreter_there_is_no_native_code() {
    let program = program(&model(&mut Noise::new(3), 1));
    let loaded = LoadedSystem::with_engine(program, Engine::Interpreter);
    let message = loaded.compile().expect_err("no code").to_string();
    assert_eq!(message, "there is no native code: it was not asked for");
}

#[test]
fn clones_share_code_and_outlive_the_first() {
    let program = program(&model(&mut Noise::new(8), 2));
    let first = LoadedSystem::with_engine(program.clone(), Engine::Native);
    first.compile().expect("native code");
    let point = At::random(&program, &mut Noise::new(4));
    let function = program.function(FunctionKind::SensitivityLinearize);
    let expected = point.bits(&first.0, function);
    let clones = [first.clone(), first.clone()];
    drop(first);
    std::thread::scope(|scope| {
        for clone in clones {
            scope.spawn(|| {
                let clone = clone;
                for _ in 0..100 {
                    assert_eq!(point.bits(&clone.0, function), expected);
                }
            });
        }
    });
}

#[test]
#[should_panic(expected = "lengths of arguments and results")]
fn short_slices_are_refused_before_the_code_runs() {
    let program = program(&model(&mut Noise::new(3), 1));
    let loaded = LoadedSystem::with_engine(program.clone(), Engine::Native);
    let mut point = At::random(&program, &mut Noise::new(1));
    point.arrays[0].pop();
    point.bits(&loaded.0, program.function(FunctionKind::Rhs));
}

/// A function with one result of one number.
fn function(body: Vec<ProgramOperation>, loops: Vec<Loop>) -> ProgramFunction {
    ProgramFunction {
        kind: FunctionKind::Rhs,
        results: vec![vec![ValueId(body.len() as u32 - 1)]],
        body,
        names: Vec::new(),
        places: vec![None],
        lengths: vec![1],
        loops,
    }
}

#[test]
fn what_is_no_program_is_refused() {
    use ProgramOperation::{
        Add, Compare, Constant, Counter, Load, LoadRound, LoadSwept, Not, Select,
    };
    use dgd_compiler::expr::graph::Comparison::Less;
    let v = ValueId;
    let one = Constant(1.0);
    let bodies = [
        // An operand that is not computed yet.
        vec![one, Add(v(0), v(1))],
        // A number used as a condition, and a condition used as a number.
        vec![one, Compare(Less, v(0), v(0)), Add(v(0), v(1))],
        vec![one, Not(v(0)), Select(v(1), v(0), v(0))],
        // A result that is a condition.
        vec![one, Compare(Less, v(0), v(0))],
        // Parts of loops outside a loop.
        vec![Counter],
        vec![LoadSwept(FunctionArgument::Y, StridedPosition { first: 0, by_round: 0 })],
        vec![LoadRound(FunctionArgument::Y, StridedPosition { first: 0, by_round: 0 })],
    ];
    for body in bodies {
        let refused = NativePlan::new(&function(body.clone(), Vec::new())).err();
        assert_eq!(refused, Some(NativeRefusal::Malformed), "{body:?}");
    }
    let far = vec![Load(FunctionArgument::Y, u32::MAX)];
    assert_eq!(NativePlan::new(&function(far, Vec::new())).err(), Some(NativeRefusal::TooLarge));
    // A loop that writes beyond its result.
    let store = LoopStore { result: 0, first: 0, by_round: 0, value: v(1) };
    let place_at = |by_round| StridedPosition { first: 0, by_round };
    let part = |rounds, count, place, store| Loop {
        rounds,
        head: Vec::new(),
        count,
        body: vec![LoadSwept(FunctionArgument::Y, place)],
        stores: vec![store],
    };
    let refused = |part| NativePlan::new(&function(vec![one], vec![part])).err();
    assert_eq!(refused(part(1, 2, place_at(0), store)), Some(NativeRefusal::Malformed));
    // Rounds that read or write before the first number, or write beyond the last.
    assert_eq!(refused(part(2, 1, place_at(1), store)), None);
    assert_eq!(refused(part(2, 1, place_at(-1), store)), Some(NativeRefusal::Malformed));
    for by_round in [-1, 1] {
        let store = LoopStore { by_round, ..store };
        assert_eq!(refused(part(2, 1, place_at(1), store)), Some(NativeRefusal::Malformed));
    }
}

#[test]
fn the_table_fits_into_a_frame() {
    use super::plan::MOST_RESULTS;
    let most = FUNCTIONS.iter().map(|spec| spec.results.len()).max();
    assert_eq!(most, Some(MOST_RESULTS));
}
