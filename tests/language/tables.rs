//! Tables of two arguments and from files, against SciPy and against the same points written out.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{CompiledStages, SensitivityDirections, compile};
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_compiler::syntax::edit::with_values;
use dgd_compiler::syntax::{parse, places, print};
use dgd_execute::InterpretedSystem;
use dgd_runtime::{Inputs, Options, Problem, observe, simulate};

/// Compiles a model in `models/m.dgd` with these other files.
fn compiled(text: &str, files: &[(&str, &str)]) -> Result<CompiledStages, String> {
    let files: BTreeMap<&str, &str> = files.iter().copied().collect();
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let compiled = compile(
        SourceText { name: "models/m.dgd".to_owned(), text: text.to_owned() },
        &ModelOptions::default(),
        &SensitivityDirections::All,
        &mut |path| files.get(path).map(|t| (*t).to_owned()).ok_or("not there".to_owned()),
        &mut sources,
        &mut diagnostics,
    );
    compiled
        .map_err(|_| render::render(&diagnostics.sorted(), &sources, render::RenderStyle::Plain))
}

/// Outputs of a model without unknowns of interest, at these times.
fn outputs(compiled: CompiledStages, times: &[f64]) -> Vec<Vec<f64>> {
    let system = InterpretedSystem::new(compiled.program);
    let inputs = Inputs::none();
    let problem = Problem { system: &system, p: &[], inputs: &inputs, start: &[] };
    let solution = simulate(&problem, times, &Options::default()).expect("a run");
    let observations = observe(&problem, &solution);
    (0..times.len()).map(|k| observations.w(k).to_vec()).collect()
}

const X: [f64; 4] = [0.0, 1.0, 2.5, 4.0];
const Y: [f64; 3] = [-1.0, 0.5, 3.0];
const F: [[f64; 3]; 4] = [[1.0, 2.0, -1.0], [0.5, 3.0, 2.0], [4.0, -2.0, 0.0], [1.0, 1.0, 2.5]];

/// The grid as a list of points.
fn points() -> String {
    let mut all = Vec::new();
    for (x, row) in X.iter().zip(F) {
        all.extend(Y.iter().zip(row).map(|(y, f)| format!("({x}, {y}, {f})")));
    }
    all.join(", ")
}

/// Along x = t, y = 3 − t: SciPy 1.17.1, `RegularGridInterpolator`, and `CubicSpline` with natural ends along x and then
/// along y (`tests/reference/make_grids.py`).
#[test]
fn grids_are_those_of_scipy() {
    let text = format!(
        "model m\nstate s = 0\nequation s: der(s) = 0\n\
         table f(x, y) = {points}\ntable g(x, y) = {points} cubic, beyond extend\n\
         output linear = f(time/1 [s], 3 - time/1 [s])\noutput cubic = g(time/1 [s], 3 - time/1 [s])",
        points = points()
    );
    let times = [0.0, 0.4, 1.7, 2.6, 3.9];
    let found = outputs(compiled(&text, &[]).expect("a model"), &times);
    for ((w, linear), cubic) in found.iter().zip(LINEAR).zip(CUBIC) {
        assert!((w[0] - linear).abs() < 1e-12 && (w[1] - cubic).abs() < 1e-12, "{w:?}");
    }
}

const LINEAR: [f64; 5] = [
    -1.0,
    0.551_999_999_999_999_9,
    0.794_666_666_666_667_1,
    -1.426_666_666_666_666,
    1.173_333_333_333_333_3,
];
const CUBIC: [f64; 5] = [
    -1.000_000_000_000_000_2,
    1.223_779_269_189_189_3,
    0.594_696_041_321_321_1,
    -1.879_212_302_079_857_2,
    1.270_751_982_204_426_9,
];

#[test]
fn a_file_says_the_same_as_points_that_are_written() {
    let mut file = "# by hand\nremark,y [1],f [%],x [cm]\n".to_owned();
    for (x, row) in X.iter().zip(F).rev() {
        for (y, f) in Y.iter().zip(row) {
            let _ = writeln!(file, "a,{y},{},{}", 100.0 * f, 100.0 * x);
        }
    }
    let model = |points: &str| {
        format!(
            "model m\nstate s = 0\nequation s: der(s) = 0\ntable f(x [m], y) {points} beyond hold\n\
             output w = f(time*1.1 [m/s], 2 - time*0.7 [1/s])"
        )
    };
    let times = [0.0, 0.3, 1.1, 2.2, 3.3, 7.0];
    let written = outputs(compiled(&model(&format!("= {}", points())), &[]).expect("it"), &times);
    let text = model("from \"../data/f.csv\"");
    let read = outputs(compiled(&text, &[("data/f.csv", &file)]).expect("it"), &times);
    for (a, b) in written.iter().flatten().zip(read.iter().flatten()) {
        assert!((a - b).abs() < 1e-14, "{a} {b}");
    }

    // What is read stays where it was read from.
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let id = sources.add(SourceText { name: "m.dgd".to_owned(), text: text.clone() });
    let ast = parse(id, &sources, &mut diagnostics).expect("a tree");
    let printed = sources.add(SourceText { name: "m.dgd".to_owned(), text: print::print(&ast) });
    let again = parse(printed, &sources, &mut diagnostics).expect("a tree");
    assert_eq!(places::without_places(&again), places::without_places(&ast));
    let moved = with_values(&ast, &text, &[], |path| Some(format!("../{path}")));
    assert!(moved.contains("table f(x [m], y) from \"../../data/f.csv\" beyond hold"), "{moved}");
}

#[test]
fn mistakes_in_a_file_are_shown_with_their_rows() {
    let text =
        "model m\nstate x = 0\ntable f(x) from \"f.csv.gz\"\nequation x: der(x) = f(x)/1 [s]";
    let said = |file: &str| match compiled(text, &[("models/f.csv.gz", file)]) {
        Ok(_) => panic!("it compiles"),
        Err(said) => said,
    };
    let repeated = said("x [1],f [1]\n0,1\n2,3\n0,4\n");
    assert!(repeated.contains("`f` has two points at x = 0"), "{repeated}");
    assert!(repeated.contains("models/f.csv.gz:4:1") && repeated.contains("4 | 0,4"), "{repeated}");
    assert!(said("x [1],f [1]\n0,1\n2\n").contains("1 cells and the header 2"));
    assert!(said("x [1],f [1]\n").contains("no rows"));
    assert!(said("").contains("no header"));
    assert!(said("x,f [1]\n0,1\n").contains("says no unit"));
    assert!(said("x [1],x [1],f [1]\n0,1,2\n").contains("two columns"));
    assert!(said("x [1],f [m]\n0,1\n1,2\n").contains("E302"));
}
