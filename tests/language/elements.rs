//! Elements that are reset, bounded, held, read late and determined at the start, against the same models
//! written out: runs with their sensitivities.

use std::fmt::Write as _;

use dgd_compiler::pipeline::SensitivityDirections;
use dgd_execute::InterpretedSystem;
use dgd_runtime::{
    Direction, InputColumn, Inputs, Interpolation, Options, Problem, SolvableSystem, System,
    find_method, observe, simulate_with_sensitivities,
};

use crate::arrays::interpreted;
use crate::support;

mod generated {
    dgd::model!("tests/parts/reacting_tanks.dgd");
    dgd::model!("models/pack_of_cells.dgd", sensitivities = [cell.R_0[2], cell.T[3], cell.T]);
}

/// Sums are taken in another order, which steps of the same size repeat.
const ROUNDING: f64 = 1e-10;

/// Asserts that outputs and their derivatives with respect to parameters are those of the other model,
/// whose outputs are in the same order.
fn assert_runs_agree(a: &InterpretedSystem, b: &InterpretedSystem, times: &[f64]) {
    for method in ["rodas5p", "bdf"] {
        let [(one, n), (other, m)] = [a, b].map(|system| run(system, times, method));
        assert_eq!(n, m, "outputs and derivatives");
        for (k, (x, y)) in one.iter().zip(&other).enumerate() {
            let (row, column) = (k / n, k % n);
            let off = (x - y).abs();
            assert!(
                off <= ROUNDING * (1.0 + x.abs()),
                "{method}, row {row}, {column}: {x} and {y}"
            );
        }
    }
}

/// Outputs and their derivatives, row by row, and how many there are in a row.
fn run(system: &impl SolvableSystem, times: &[f64], method: &str) -> (Vec<f64>, usize) {
    let signature = system.signature();
    let p: Vec<f64> = signature.parameters.iter().map(|parameter| parameter.value).collect();
    let values: Vec<f64> = (0..times.len()).map(|k| 1.0 + (k % 4) as f64).collect();
    let columns: Vec<InputColumn<'_>> = signature
        .inputs
        .iter()
        .map(|input| InputColumn {
            name: &input.name,
            interpolation: Interpolation::Hold,
            values: &values,
        })
        .collect();
    let inputs = Inputs::recorded(times, &columns).expect("samples in order");
    let problem = Problem { system, p: &p, inputs: &inputs, start: &[] };
    let method = find_method(method).expect("a method");
    let options = Options { rtol: 1e-9, atol: 1e-9, method, ..Options::default() };
    let solution = simulate_with_sensitivities(&problem, times, &options)
        .unwrap_or_else(|failure| panic!("{}", failure.error));
    let observed = observe(&problem, &solution);
    let directions: Vec<usize> = signature
        .directions
        .iter()
        .enumerate()
        .filter(|(_, direction)| matches!(direction, Direction::Parameter(_)))
        .map(|(j, _)| j)
        .collect();
    let n_w = signature.outputs.len();
    let mut all = Vec::new();
    for k in 0..times.len() {
        all.extend_from_slice(observed.w(k));
        for j in &directions {
            all.extend_from_slice(&observed.dw(k)[j * n_w..(j + 1) * n_w]);
        }
    }
    (all, n_w * (1 + directions.len()))
}

fn times() -> Vec<f64> {
    (0..=60).map(|k| 5.0 * f64::from(k)).collect()
}

/// What one basin has of its own, `#` for its index.
const BASIN: &str = "\
state h_# [m] = 0.1  fixed
state n_# = 0  fixed
held u_# [m/s] = 0
equation count_#: der(n_#) = 0 [1/s]
saturate h_# <= brim_#
saturate h_# >= 0 [m]
when h_# rises above 0.5 [m] or time rises above 100 [s]*# { reset n_# = n_# + h_#/1 [m] }
output h_# [m] = h_#
output n_# = n_#
output u_# [m/s] = u_#
";

#[test]
fn elements_are_reset_bounded_and_held_like_single_unknowns() {
    let rows = interpreted(
        "model basins
         size N = 3
         parameter k [1/s] = 0.02
         parameter gain [1/s] = 0.01
         parameter brim[1..N] [m] = (1, 0.8, 1.2)
         input q [mm/s]
         state h[1..N] [m] = 0.1
         state n[1..N] = 0
         held u[1..N] [m/s] = 0
         equation first: der(h[1]) = q*10 - k*h[1] + u[1]
         for i in 2..N { equation level[i]: der(h[i]) = k*h[i-1] - k*h[i] + u[i] }
         for i in 1..N {
             equation count[i]: der(n[i]) = 0 [1/s]
             saturate h[i] <= brim[i]
             saturate h[i] >= 0 [m]
             when h[i] rises above 0.5 [m] or time rises above 100 [s]*i {
                 reset n[i] = n[i] + h[i]/1 [m]
             }
             every 10 [s] { reset u[i] = gain*(0.3 [m] - h[i]) - 0.02 [m/s]*(i - 1) }
         }
         output h_1 [m] = h[1]
         output n_1 = n[1]
         output u_1 [m/s] = u[1]
         output h_2 [m] = h[2]
         output n_2 = n[2]
         output u_2 [m/s] = u[2]
         output h_3 [m] = h[3]
         output n_3 = n[3]
         output u_3 [m/s] = u[3]",
    );
    let mut text = "\
model basins
parameter k [1/s] = 0.02
parameter gain [1/s] = 0.01
parameter brim_1 [m] = 1
parameter brim_2 [m] = 0.8
parameter brim_3 [m] = 1.2
input q [mm/s]
equation level_1: der(h_1) = q*10 - k*h_1 + u_1
equation level_2: der(h_2) = k*h_1 - k*h_2 + u_2
equation level_3: der(h_3) = k*h_2 - k*h_3 + u_3
every 10 [s] {
  reset u_1 = gain*(0.3 [m] - h_1)
  reset u_2 = gain*(0.3 [m] - h_2) - 0.02 [m/s]
  reset u_3 = gain*(0.3 [m] - h_3) - 0.04 [m/s]
}
"
    .to_owned();
    for i in 1..=3 {
        text += &BASIN.replace('#', &i.to_string());
    }
    let whole = interpreted(&text);
    let automata = |system: &InterpretedSystem| system.signature().discrete.automata.len();
    assert_eq!(automata(&rows), 7, "one clock, three `when`s, three saturations");
    assert_eq!(automata(&rows), automata(&whole));
    assert_runs_agree(&rows, &whole, &times());
}

/// Flows through check valves: each is what its own equation says, but never negative.
#[test]
fn algebraic_elements_have_bounds() {
    let text = |head: &str, valves: &str| {
        format!(
            "model valves
             parameter c [m^3/s] = 0.3
             input p [bar]
             {head}
             {valves}"
        )
    };
    let rows = text(
        "size N = 3
         state V[1..N] [m^3] = 1
         unknown q[1..N] [m^3/s] = 0.1",
        "for i in 1..N {
             equation q[i]: q[i]/c*(1 + abs(q[i]/c)) = p/1 [bar] - V[i]/1 [m^3]*i/2
             saturate q[i] >= 0 [m^3/s]
             equation V[i]: der(V[i]) = q[i] - 0.02 [1/s]*V[i]
         }
         output V_1 [m^3] = V[1]
         output q_1 [m^3/s] = q[1]
         output V_2 [m^3] = V[2]
         output q_2 [m^3/s] = q[2]
         output V_3 [m^3] = V[3]
         output q_3 [m^3/s] = q[3]",
    );
    let of_one = "\
state V_# [m^3] = 1  fixed
unknown q_# [m^3/s] = 0.1
equation q_#: q_#/c*(1 + abs(q_#/c)) = p/1 [bar] - V_#/1 [m^3]*#/2
saturate q_# >= 0 [m^3/s]
equation V_#: der(V_#) = q_# - 0.02 [1/s]*V_#
output V_# [m^3] = V_#
output q_# [m^3/s] = q_#
";
    let whole: String = (1..=3).map(|i| of_one.replace('#', &i.to_string())).collect();
    // p is in Pa there.
    let with_pressure = |text: String| text.replace("p/1 [bar]", "(p*1e5)/1 [bar]");
    let [rows, whole] = [rows, text("", &whole)].map(|text| interpreted(&with_pressure(text)));
    assert_runs_agree(&rows, &whole, &times());
}

/// Pipes in a row: what leaves one arrives at the next some time later, by parameters and by the index.
#[test]
fn elements_are_read_late() {
    let rows = interpreted(
        "model line
         size N = 4
         parameter k [1/s] = 0.05
         parameter lag[1..N] [s] = (4, 6, 3, 5)
         input q
         state T[1..N] = 0.5
         unknown mix[1..N] = 0
         equation first: der(T[1]) = k*(q - T[1])
         for i in 2..N { equation next[i]: der(T[i]) = k*(delay(T[i-1], lag[i-1]) - T[i]) }
         for i in 1..N { equation mix[i]: mix[i] = 0.5*delay(mix[1], 2 [s]*i) + T[i] }
         output T_4 = T[4]
         output mix_3 = mix[3]
         output late = delay(T[2]*q, 7 [s])
         output both = delay(T[2], 7 [s]) - T[1]",
    );
    let mut text = "\
model line
parameter k [1/s] = 0.05
parameter lag_1 [s] = 4
parameter lag_2 [s] = 6
parameter lag_3 [s] = 3
parameter lag_4 [s] = 5
input q
equation next_1: der(T_1) = k*(q - T_1)
output T_4 = T_4
output mix_3 = mix_3
output late = delay(T_2*q, 7 [s])
output both = delay(T_2, 7 [s]) - T_1
"
    .to_owned();
    for i in 1..=4 {
        let _ = writeln!(text, "state T_{i} = 0.5  fixed\nunknown mix_{i} = 0");
        let _ =
            writeln!(text, "equation mix_{i}: mix_{i} = 0.5*delay(mix_1, {} [s]) + T_{i}", 2 * i);
        let j = i - 1;
        if i > 1 {
            let _ =
                writeln!(text, "equation next_{i}: der(T_{i}) = k*(delay(T_{j}, lag_{j}) - T_{i})");
        }
    }
    assert_runs_agree(&rows, &interpreted(&text), &times());
}

/// Before the start each was what its history says, as a list of starts, by the index, or by parameters.
#[test]
fn elements_have_histories() {
    let rows = interpreted(
        "model line
         size N = 3
         parameter k [1/s] = 0.05
         parameter before = 0.3
         constant w[1..N] = (1, 0.5, -1)
         input q
         state x[i in 1..N] = (0.2, 0.4, 0.6)  history before*i + w[4-i]*time/100 [s]
         state y[i in 1..N] = 0.1*i  history before*w[i]
         unknown z[1..N] = 0  history 0.7
         for i in 1..N {
             equation x[i]: der(x[i]) = k*(q - delay(x[i], 12 [s]*i))
             equation y[i]: der(y[i]) = k*(q - delay(y[i], 20 [s]) - y[i]*delay(z[i], 7 [s]))
             equation z[i]: z[i] = 0.1*x[i]
         }
         output x_1 = x[1]
         output x_3 = x[3]
         output y_1 = y[1]
         output y_2 = y[2]
         output y_3 = y[3]",
    );
    let mut text = "\
model line
parameter k [1/s] = 0.05
parameter before = 0.3
input q
output x_1
output x_3
output y_1
output y_2
output y_3
"
    .to_owned();
    for (i, w) in [1.0, 0.5, -1.0].into_iter().enumerate() {
        let (other, i) = ([-1.0, 0.5, 1.0][i], i + 1);
        let _ = write!(
            text,
            "state x_{i} = 0.2*{i}  fixed, history before*{i} + ({other})*time/100 [s]\n\
             state y_{i} = 0.1*{i}  fixed, history before*({w})\n\
             unknown z_{i} = 0  history 0.7\n\
             equation x_{i}: der(x_{i}) = k*(q - delay(x_{i}, 12 [s]*{i}))\n\
             equation y_{i}: der(y_{i}) = k*(q - delay(y_{i}, 20 [s]) - y_{i}*delay(z_{i}, 7 [s]))\n\
             equation z_{i}: z_{i} = 0.1*x_{i}\n"
        );
    }
    assert_runs_agree(&rows, &interpreted(&text), &times());
}

#[test]
fn elements_begin_where_start_equations_say() {
    for guess in ["  guess", ""] {
        let rows = interpreted(&format!(
            "model line
             size N = 3
             parameter k[1..N] [1/s] = (0.05, 0.02, 0.03)
             input q
             state T[1..N] = 0.5{guess}
             equation first: der(T[1]) = k[1]*(q - T[1])
             for i in 2..N {{ equation next[i]: der(T[i]) = k[i]*(T[i-1] - T[i]*abs(T[i])) }}
             start equation here: der(T[1]) = 0.01 [1/s]
             for i in 2..N {{ start equation rest[i]: der(T[i]) = 0 }}
             output T_1 = T[1]
             output T_2 = T[2]
             output T_3 = T[3]"
        ));
        let whole = interpreted(
            "model line
             parameter k_1 [1/s] = 0.05
             parameter k_2 [1/s] = 0.02
             parameter k_3 [1/s] = 0.03
             input q
             state T_1 = 0.5  guess
             state T_2 = 0.5  guess
             state T_3 = 0.5  guess
             equation first: der(T_1) = k_1*(q - T_1)
             equation next_2: der(T_2) = k_2*(T_1 - T_2*abs(T_2))
             equation next_3: der(T_3) = k_3*(T_2 - T_3*abs(T_3))
             start equation here: der(T_1) = 0.01 [1/s]
             start equation rest_2: der(T_2) = 0
             start equation rest_3: der(T_3) = 0
             output T_1
             output T_2
             output T_3",
        );
        let (values, _) = run(&rows, &times(), "rodas5p");
        // k₁ (1 − T₁) = 0.01, T₂² = T₁, T₃² = T₂.
        let wanted = [0.8, 0.8_f64.sqrt(), 0.8_f64.sqrt().sqrt()];
        for (found, wanted) in values.iter().zip(wanted) {
            assert!((found - wanted).abs() < 1e-9, "{found} for {wanted}");
        }
        assert_runs_agree(&rows, &whole, &times());
    }
}

/// What slides along a switch adds an unknown in front of all elements.
#[test]
fn elements_are_reset_where_a_solution_may_slide() {
    let switch = "state s = 1  fixed\nequation s: der(s) = (if s > 0.5 then -1 else 1)*0.1 [1/s]\n";
    let rows = format!(
        "model m
         input q
         {switch}
         state x[1..3] = 0.1
         held u[1..3] = 1
         for i in 1..3 {{
             equation x[i]: der(x[i]) = 0.05 [1/s]*(u[i]*q + delay(x[i], 2 [s])*0.1 - x[i])
             saturate x[i] <= 0.5*i
             when x[i] rises above 0.4*i {{ reset u[i] = 0.1*i }}
         }}
         output x_1 = x[1]
         output x_2 = x[2]
         output x_3 = x[3]
         output u_2 = u[2]
         output s"
    );
    let mut whole = format!("model m\ninput q\n{switch}");
    for i in 1..=3 {
        let _ = writeln!(whole, "state x_{i} = 0.1  fixed\nheld u_{i} = 1");
        let _ = writeln!(
            whole,
            "equation x_{i}: der(x_{i}) = 0.05 [1/s]*(u_{i}*q + delay(x_{i}, 2 [s])*0.1 - x_{i})"
        );
        let _ = writeln!(whole, "saturate x_{i} <= 0.5*{i}");
        let _ = writeln!(whole, "when x_{i} rises above 0.4*{i} {{\n  reset u_{i} = 0.1*{i}\n}}");
        let _ = writeln!(whole, "output x_{i}");
    }
    whole += "output u_2\noutput s\n";
    let n_shares = interpreted(&rows).signature().unknowns.len() - 7;
    assert_eq!(n_shares, 1, "an unknown for what slides");
    assert_runs_agree(&interpreted(&rows), &interpreted(&whole), &times());
}

#[test]
fn generated_code_has_sensitivities_to_elements() {
    let signature = generated::pack_of_cells::Model.signature();
    let name = |direction: &Direction| match *direction {
        Direction::Parameter(i) => signature.parameters[i].name.to_string(),
        Direction::Start(i) => format!("{}(0)", signature.unknowns.name(i)),
    };
    let names: Vec<String> = signature.directions.iter().map(name).collect();
    let elements = ["cell.R_0[2]", "cell.T[3](0)", "cell.T[1](0)", "cell.T[2](0)"];
    assert_eq!(names[..4], elements, "each once");
}

#[test]
fn parts_that_react_can_be_several() {
    let [several, single] = ["reacting_tanks", "reacting_tanks_one_by_one"]
        .map(|name| support::interpreted(&format!("tests/parts/{name}.dgd"), &[]));
    assert_runs_agree(&several, &single, &times());
}

#[test]
fn generated_code_runs_as_the_interpreter_does() {
    let interpreted = support::interpreted("tests/parts/reacting_tanks.dgd", &[]);
    for method in ["rodas5p", "bdf"] {
        let generated = run(&generated::reacting_tanks::Model, &times(), method);
        assert_eq!(generated, run(&interpreted, &times(), method), "{method}");
    }
}

#[test]
fn an_array_of_parameters_is_named_as_a_whole_or_by_element() {
    let directions = |names: &[&str]| {
        let names =
            SensitivityDirections::Named(names.iter().map(|name| support::name(name)).collect());
        let path = std::path::Path::new("models/pack_of_cells.dgd");
        support::compiled_with(path, &[], &names).program.signature.directions.len()
    };
    assert_eq!((directions(&["cell.R_0"]), directions(&["cell.R_0[2]"])), (6, 1));
    assert_eq!(directions(&["cell.R_0[2]", "cell.R_0"]), 6, "each once");
}
