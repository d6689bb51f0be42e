//! Arrays of constants, parameters and inputs, arrays of several indices, and sums over them, against
//! the same models written out element by element.

use std::fmt::Write as _;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::model::{ModelOptions, Setting};
use dgd_compiler::pipeline::{SensitivityDirections, compile};
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_compiler::syntax::parse_setting;
use dgd_runtime::{EvaluationPoint, System};

use crate::arrays::{assert_the_same, compiled, interpreted};

/// Arrays of all kinds, of one index and of two, read by indices that move with the row, by others, and
/// by both in one row; late inputs, sums and start values.
const PLATE: &str = "\
model plate
size N = 3
size M = 4
constant g[1..N] = (1, 2.5, -1)
constant w[1..N][1..M] = ((1, 2, 3, 4), (5, 6, 7, 8), (9, 1, 2, 3))
constant h[i in 0..2] = 0.5*i + 1
parameter a = 0.7
parameter k[1..N] [1/s] = (0.1, 0.2, 0.3)  in 0 ..
parameter r[1..N][1..M] = ((1, 1, 1.5, 1), 2, (3, 3, 3.5, 3))
parameter tau[1..N] [s] = 0.4
input u[1..N] linear
input v[1..M] hold
state x[1..N] = (1, a, 3)
state z[i in 1..N] = k[i]*2 [s] + u[i] - k[N+1-i]*1 [s]
state y[i in 1..2] = 0.1*k[i]*1 [s] + w[2][i]
state T[i in 1..N][j in 1..M] = a*i + 0.1*j
unknown q[0..N][1..M] = 0.2
for i in 1..N { let late[i] = delay(u[i], tau[i]) }
for i in 1..N, j in 1..M { let flux[i][j] = r[i][j]*T[i][j]*a }
function squares(b) = sum((b + l)^2*g[l] for l in 1..N)
for i in 1..N { equation z[i]: der(z[i]) = k[N+1-i]*a*z[i] + late[i]*g[i]/1 [s] }
for i in 1..N { equation x[i]: der(x[i]) = -k[i]*x[i]*g[i] + k[2]*u[i]*u[1]*g[N+1-i] + sin(k[i]*time)*a*x[2]/1 [s] }
for i in 1..2 { equation y[i]: der(y[i]) = 0 }
for j in 1..M { equation top[j]: q[0][j] = v[j]*h[2] + squares(a) }
for i in 1..N-1, j in 1..M { equation q[i][j]: q[i][j] = flux[i][j] - flux[i+1][j] + w[i][j]*v[j] }
for j in 1..M { equation bottom[j]: q[N][j] = prod(x[l]*r[l][j] for l in 1..N) }
for i in 1..N, j in 1..M { equation T[i][j]: der(T[i][j]) = (q[i-1][j] - q[i][j])/1 [s] + k[i]*mean(x[l]*w[l][j] for l in 1..N) }
output s = sum(T[i][j]*g[i] for i in 1..N, j in 1..M)
output rate [1/s] = der(T[2][3])
output T
";

const G: [f64; 3] = [1.0, 2.5, -1.0];
const W: [[f64; 4]; 3] = [[1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0], [9.0, 1.0, 2.0, 3.0]];
const R: [[f64; 4]; 3] = [[1.0, 1.0, 1.5, 1.0], [2.0; 4], [3.0, 3.0, 3.5, 3.0]];

/// What a closure writes for each index, with a sign between.
fn joined(
    range: std::ops::RangeInclusive<usize>,
    sign: &str,
    one: impl Fn(usize) -> String,
) -> String {
    range.map(one).collect::<Vec<_>>().join(sign)
}

fn written_out() -> String {
    let mut text = "model plate\nparameter a = 0.7\n".to_owned();
    let mut line = |text_of: String| {
        let _ = writeln!(text, "{text_of}");
    };
    for (i, k) in (1..=3).zip([0.1, 0.2, 0.3]) {
        line(format!("parameter k_{i} [1/s] = {k}  in 0 ..\ninput u_{i} linear"));
    }
    for i in 1..=3 {
        line(format!("state z_{i} = k_{i}*2 [s] + u_{i} - k_{}*1 [s]", 4 - i));
    }
    for i in 1..=2 {
        line(format!("state y_{i} = 0.1*k_{i}*1 [s] + {}", W[1][i - 1]));
        line(format!("equation y_{i}: der(y_{i}) = 0"));
    }
    for (i, start) in (1..=3).zip(["1", "a", "3"]) {
        line(format!("state x_{i} = {start}"));
        for j in 1..=4 {
            line(format!("parameter r_{i}_{j} = {}", R[i - 1][j - 1]));
            line(format!("state T_{i}_{j} = a*{i} + 0.1*{j}"));
            line(format!("let flux_{i}_{j} = r_{i}_{j}*T_{i}_{j}*a"));
        }
    }
    for i in 1..=3 {
        let (g, back) = (G[i - 1], 4 - i);
        line(format!("parameter tau_{i} [s] = 0.4\nlet late_{i} = delay(u_{i}, tau_{i})"));
        line(format!("equation z_{i}: der(z_{i}) = k_{back}*a*z_{i} + late_{i}*({g})/1 [s]"));
        line(format!(
            "equation x_{i}: der(x_{i}) = -k_{i}*x_{i}*({g}) + k_2*u_{i}*u_1*({}) + \
             sin(k_{i}*time)*a*x_2/1 [s]",
            G[back - 1]
        ));
    }
    let squares = joined(1..=3, " + ", |l| format!("(a + {l})^2*({})", G[l - 1]));
    for j in 1..=4 {
        line(format!("input v_{j} hold\nunknown q_0_{j} = 0.2"));
        line(format!("equation top_{j}: q_0_{j} = v_{j}*2 + ({squares})"));
        let product = joined(1..=3, "*", |l| format!("x_{l}*r_{l}_{j}"));
        line(format!("equation bottom_{j}: q_3_{j} = {product}"));
    }
    for i in 1..=3 {
        for j in 1..=4 {
            line(format!("unknown q_{i}_{j} = 0.2"));
            if i < 3 {
                let (next, w) = (i + 1, W[i - 1][j - 1]);
                line(format!(
                    "equation q_{i}_{j}: q_{i}_{j} = flux_{i}_{j} - flux_{next}_{j} + {w}*v_{j}"
                ));
            }
            let mean = joined(1..=3, " + ", |l| format!("x_{l}*{}", W[l - 1][j - 1]));
            let before = i - 1;
            line(format!(
                "equation T_{i}_{j}: der(T_{i}_{j}) = (q_{before}_{j} - q_{i}_{j})/1 [s] + \
                 k_{i}*({mean})/3"
            ));
        }
    }
    let of_row = |i: usize| joined(1..=4, " + ", |j| format!("T_{i}_{j}*({})", G[i - 1]));
    line(format!("output s = {}\noutput rate [1/s] = der(T_2_3)", joined(1..=3, " + ", of_row)));
    for i in 1..=3 {
        for j in 1..=4 {
            line(format!("output T_{i}_{j}"));
        }
    }
    text
}

/// The lines that declare something come first where others need an order.
fn in_order(text: &str) -> String {
    let rank = |line: &str| {
        let order = ["model", "parameter a", "parameter k", "parameter r", "parameter tau"];
        let declared = order.iter().position(|begin| line.starts_with(begin));
        declared.unwrap_or(order.len() + usize::from(line.starts_with("input v")))
    };
    let mut lines: Vec<&str> = text.lines().collect();
    lines.sort_by_key(|line| rank(line));
    lines.join("\n") + "\n"
}

#[test]
fn a_model_with_vectors_is_the_model_written_out() {
    assert_the_same(&interpreted(PLATE), &interpreted(&in_order(&written_out())));
}

#[test]
fn a_table_has_its_values_from_an_array() {
    let text = |declared: &str, values: &str| {
        format!(
            "model m\n{declared}\ninput u linear\nstate x = 0.3\n\
             table c(z) at (0, 0.5, 1, 4) = {values} linear, beyond extend\n\
             equation x: der(x) = (c(u) - x*c(x))/1 [s]\noutput y = c(2*x)\n"
        )
    };
    let names = [1, 2, 3, 4].map(|i| format!("y_{i}"));
    let numbers = [1.0, 2.5, -1.0, 0.5];
    let pairs = names.iter().zip(numbers);
    let scalars: Vec<String> = pairs.map(|(y, value)| format!("parameter {y} = {value}")).collect();
    let by_name = text(&scalars.join("\n"), &format!("({})", names.join(", ")));
    let by_array = text("parameter y[0..3] = (1, 2.5, -1, 0.5)", "y");
    assert_the_same(&interpreted(&by_array), &interpreted(&by_name));
}

#[test]
fn elements_have_names_wherever_they_are_shown() {
    let (compiled, _) = compiled(PLATE);
    let signature = &compiled.program.signature;
    let parameters: Vec<&str> = signature.parameters.iter().map(|p| &*p.name).collect();
    assert_eq!(parameters[..6], ["a", "k[1]", "k[2]", "k[3]", "r[1][1]", "r[1][2]"]);
    assert_eq!(signature.parameters[7].value, 1.0);
    assert_eq!(signature.parameters[1].lower, 0.0);
    let inputs: Vec<&str> = signature.inputs.iter().map(|input| &*input.name).collect();
    assert_eq!(inputs, ["u[1]", "u[2]", "u[3]", "v[1]", "v[2]", "v[3]", "v[4]"]);
    let unknowns: Vec<String> = signature.unknowns.iter().map(|x| x.name.to_string()).collect();
    assert!(unknowns.contains(&"T[2][3]".to_owned()), "{unknowns:?}");
    let equations: Vec<String> = signature.equations.iter().map(|e| e.to_string()).collect();
    for label in ["T[3][4]", "q[2][1]", "z[2]", "bottom[4]"] {
        assert!(equations.contains(&label.to_owned()), "{equations:?}");
    }
}

/// Parameters and start values with these settings.
fn set(settings: &[&str]) -> Result<(Vec<f64>, Vec<f64>), String> {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let mut all = Vec::new();
    for text in settings {
        let id = sources.add(SourceText { name: (*text).to_owned(), text: (*text).to_owned() });
        let (name, value) = parse_setting(id, &sources, &mut diagnostics).expect("a setting");
        all.push(Setting { name, value });
    }
    let options = ModelOptions { settings: all, ..ModelOptions::default() };
    let main = SourceText { name: "plate.dgd".to_owned(), text: PLATE.to_owned() };
    let none = &mut |_: &str| Err("no file".to_owned());
    let directions = SensitivityDirections::None;
    let compiled = compile(main, &options, &directions, none, &mut sources, &mut diagnostics)
        .map_err(|_| diagnostics.sorted()[0].message.clone())?;
    let system = dgd_execute::InterpretedSystem::new(compiled.program);
    let signature = system.signature();
    let p: Vec<f64> = signature.parameters.iter().map(|p| p.value).collect();
    let u = vec![1.0; signature.n_u()];
    let mut y = vec![0.0; signature.unknowns.len()];
    system.start(EvaluationPoint { t: 0.0, y: &[], u: &u, p: &p, z: &[] }, &mut y);
    Ok((p, y))
}

#[test]
fn elements_are_set_from_outside() {
    let (p, y) =
        set(&["k[2]=5", "r=(1, (1, 2, 3, 4), 7)", "r[3][1]=9", "x=(4, 5, 6)"]).expect("sound");
    assert_eq!(p[1..4], [0.1, 5.0, 0.3]);
    assert_eq!(p[4..16], [1.0, 1.0, 1.0, 1.0, 1.0, 2.0, 3.0, 4.0, 9.0, 7.0, 7.0, 7.0]);
    assert_eq!(y[..3], [4.0, 5.0, 6.0]);
    let (p, y) = set(&["k=0.5", "z=2"]).expect("sound");
    assert_eq!(p[1..4], [0.5; 3]);
    assert_eq!(y[3..6], [2.0; 3]);
    assert_eq!(y[6..8], [0.1 * 0.5 + 5.0, 0.1 * 0.5 + 6.0]);
    for (setting, what) in [
        ("k[4]=1", "`k` has no element [4]: it runs over [1..3]"),
        ("k=(1, 2)", "`k` runs from 1 to 3, and here are 2 values"),
        ("a=(1, 2)", "a list of values stands only for an array"),
        ("a[1]=2", "`a` is a parameter, not an array"),
        ("u[1]=2", "`u[1]` is an array, which cannot be set"),
        ("x[2]=2", "`x[2]` is an element of an array of unknowns"),
    ] {
        assert_eq!(set(&[setting]).expect_err(setting), what);
    }
}

#[test]
fn noise_of_an_array_is_that_of_each_element() {
    let text = |outputs: &str| {
        format!(
            "model m\nparameter s [bar] = 0.1\ninput u linear\nstate p[i in 1..3] [bar] = i*s\nstate x = 0.3\n\
             for i in 1..3 {{ equation p[i]: der(p[i]) = (u*1 [bar] - p[i])/1 [s] }}\n\
             equation x: der(x) = -x/1 [s]\n{outputs}"
        )
    };
    for noise in ["s + 2 [%]*abs(p)", "lognormal(0.1*x)", "student(4, s)", "s"] {
        let single = |i: usize| {
            let noise = noise.replace("abs(p)", &format!("abs(p[{i}])"));
            format!("output q{i} [bar] = p[{i}]  noise {noise}\n")
        };
        let [of_array, single] =
            [format!("output p [mbar]  noise {noise}\n"), joined(1..=3, "", single)]
                .map(|outputs| interpreted(&text(&outputs)));
        let names: Vec<String> =
            of_array.signature().outputs.iter().map(|output| output.name.to_string()).collect();
        assert_eq!(names, ["p[1]", "p[2]", "p[3]", "std(p[1])", "std(p[2])", "std(p[3])"]);
        assert_eq!(of_array.signature().densities, single.signature().densities, "{noise}");
        assert_the_same(&of_array, &single);
    }
}
