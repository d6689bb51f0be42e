//! Neither factors of equations nor units of unknowns change a solution: powers of two leave its bits alone.

use std::fmt::Write;

use dgd_runtime::{
    Inputs, Options, Problem, Solution, System, find_method, simulate_with_sensitivities,
};

use crate::inline::system;

const METHODS: [&str; 4] = ["rodas5p", "rodas4", "kencarp4", "bdf"];
/// Exponents of factors.
const POWERS: [i32; 4] = [-70, -9, 12, 90];

fn run(text: &str, method: &str, tolerance: f64, times: &[f64]) -> Solution {
    let system = system(text);
    let p: Vec<f64> = system.signature().parameters.iter().map(|p| p.value).collect();
    let options = Options {
        rtol: tolerance,
        atol: tolerance,
        method: find_method(method).expect("a method"),
        ..Options::default()
    };
    let problem = Problem { system: &system, p: &p, inputs: &Inputs::none(), start: &[] };
    simulate_with_sensitivities(&problem, times, &options).expect("a solution")
}

/// A system of `pairs` of a state and an algebraic unknown in a row. Algebraic equations are multiplied by `factor`, all
/// of them in a long row, whose functions are loops then as before, and else each second one; each second unknown is in
/// units of `unit`.
fn chain(pairs: usize, factor: f64, unit: f64) -> String {
    let mut text = String::from("model chain\nparameter a = 0.3\nparameter b = 2.5\n");
    let units = |i: usize| if i % 2 == 1 { unit } else { 1.0 };
    for i in 0..pairs {
        let u = units(i);
        let _ = writeln!(text, "state x{i} = {:?} nominal {u:?}", u * (0.5 + 0.1 * i as f64));
        let _ = writeln!(text, "unknown y{i} = {:?} nominal {:?}", 0.2 / u, 1.0 / u);
    }
    for i in 0..pairs {
        // In units of their own.
        let x = |i: usize| format!("(x{i}*{:?})", 1.0 / units(i));
        let y = |i: usize| format!("(y{i}*{:?})", units(i));
        let (before, after) = ((i + pairs - 1) % pairs, (i + 1) % pairs);
        let (before, after) = if i == 0 { (0, after) } else { (before, after) };
        let after = if i + 1 == pairs { i } else { after };
        let _ = writeln!(
            text,
            "equation dx{i}: 1 [s]*der(x{i}) = {:?}*({} - a*{}*{} - {})",
            units(i),
            y(before),
            x(i),
            x(after),
            x(i)
        );
        let factor = if pairs > 3 || i % 2 == 0 { factor } else { 1.0 };
        let _ = writeln!(
            text,
            "equation of_y{i}: 0 = {factor:?}*(b*{} + {}*{}*{} - 0.3*{} - {})",
            y(i),
            y(i),
            y(i),
            y(i),
            y(after),
            x(i)
        );
    }
    text
}

const TIMES: [f64; 4] = [0.0, 0.4, 1.0, 3.0];

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

/// Dense, banded by elimination, and by each method.
#[test]
fn factors_of_equations_that_are_powers_of_two_leave_all_bits() {
    for pairs in [3, 20] {
        for method in METHODS {
            // A factor of one is left out, and what is left is simplified to other sums, or makes other loops.
            let plain = run(&chain(pairs, 4.0, 1.0), method, 1e-7, &TIMES);
            for power in POWERS {
                let scaled = run(&chain(pairs, 2.0_f64.powi(power), 1.0), method, 1e-7, &TIMES);
                assert_eq!(bits(&scaled.y), bits(&plain.y), "{pairs} {method} {power}");
                assert_eq!(bits(&scaled.s), bits(&plain.s), "{pairs} {method} {power}");
            }
        }
    }
}

#[test]
fn unknowns_in_units_that_are_powers_of_two_have_the_scaled_bits() {
    for pairs in [3, 20] {
        for method in METHODS {
            let plain = run(&chain(pairs, 1.0, 1.0), method, 1e-7, &TIMES);
            for power in POWERS {
                let unit = 2.0_f64.powi(power);
                let mut scaled = run(&chain(pairs, 1.0, unit), method, 1e-7, &TIMES);
                let n = scaled.n;
                // x1 and x3 are larger by the unit, y1 and y3 smaller.
                for values in [&mut scaled.y, &mut scaled.s] {
                    for row in values.chunks_exact_mut(n) {
                        for i in (1..pairs).step_by(2) {
                            row[2 * i] /= unit;
                            row[2 * i + 1] *= unit;
                        }
                    }
                }
                assert_eq!(bits(&scaled.y), bits(&plain.y), "{pairs} {method} {power}");
                assert_eq!(bits(&scaled.s), bits(&plain.s), "{pairs} {method} {power}");
            }
        }
    }
}

/// Prey that spreads over a square of N by N points, and a predator that follows at once: Brown, SIAM Journal on
/// Scientific and Statistical Computing 7 (1986) 40–91, as IDA's example has it. Equations of predators are 1e9 times as
/// large as those of prey.
fn food_web(n: usize) -> String {
    let mut text = String::from(
        "model food_web\nparameter alpha = 50\nparameter beta = 1000\nparameter d1 = 1\n\
         parameter d2 = 0.05\nparameter ee = 1e4\nparameter gg = 5e-7\nparameter aa = 1\n",
    );
    let h = 1.0 / (n - 1) as f64;
    let all = || (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    for (i, j) in all() {
        let (x, y) = (i as f64 * h, j as f64 * h);
        let start = 10.0 + (16.0 * x * (1.0 - x) * y * (1.0 - y)).powi(2);
        let _ = writeln!(text, "state c{i}_{j} = {start:?}\nunknown e{i}_{j} = 1e5");
    }
    // What is beyond an edge mirrors what is inside.
    let inside = |i: isize| match i {
        -1 => 1,
        i if i == n.cast_signed() => n - 2,
        i => i.cast_unsigned(),
    };
    for (i, j) in all() {
        let (x, y) = (i as f64 * h, j as f64 * h);
        let at = |of: &str, di: isize, dj: isize| {
            format!("{of}{}_{}", inside(i.cast_signed() + di), inside(j.cast_signed() + dj))
        };
        let spread = |of: &str| {
            let (own, points) = (at(of, 0, 0), (n - 1) * (n - 1));
            let along = [(-1, 0), (1, 0)].map(|(di, dj)| at(of, di, dj)).join(" + ");
            let across = [(0, -1), (0, 1)].map(|(di, dj)| at(of, di, dj)).join(" + ");
            format!("({along} - 2*{own} + ({across} - 2*{own}))*{points}")
        };
        let growth = format!("aa*(1 + alpha*{:?} + beta*sin(4*pi*{x:?})*sin(4*pi*{y:?}))", x * y);
        let (c, e) = (at("c", 0, 0), at("e", 0, 0));
        let _ = writeln!(
            text,
            "equation prey{i}_{j}: 1 [s]*der({c}) = {c}*({growth} - aa*{c} - gg*{e}) + d1*{}\n\
             equation predator{i}_{j}: 0 = {e}*(-{growth} + ee*{c} - aa*{e}) + d2*{}",
            spread("c"),
            spread("e")
        );
    }
    text
}

#[test]
fn cells_that_mirror_each_other_have_the_same_sensitivities() {
    for n in [4, 6] {
        let text = food_web(n);
        for tolerance in [1e-6, 1e-10] {
            let times: Vec<f64> = (0..=10).map(|k| 1e-4 * f64::from(k)).collect();
            let solution = run(&text, "rodas5p", tolerance, &times);
            assert!(solution.undefined.is_empty(), "{:?}", solution.undefined);
            let width = solution.n;
            let cell = |i: usize, j: usize| 2 * (i * n + j);
            for j in 0..solution.n_s {
                for (i, k) in (0..n).flat_map(|i| (0..i).map(move |k| (i, k))) {
                    for of in 0..2 {
                        let along = |at: usize| -> Vec<f64> {
                            let rows = solution.s.chunks_exact(width * solution.n_s);
                            rows.map(|row| row[j * width + at + of]).collect()
                        };
                        let (own, mirrored) = (along(cell(i, k)), along(cell(k, i)));
                        let largest = own.iter().fold(0.0_f64, |m, value| m.max(value.abs()));
                        for (a, b) in own.iter().zip(&mirrored) {
                            assert!(
                                (a - b).abs() <= 1e-9 * largest,
                                "{n}, {tolerance:e}: {a:e} and {b:e}, largest {largest:e}"
                            );
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn a_number_that_rests_keeps_its_bits_whatever_reads_it() {
    // In full, tridiagonal and banded matrices, with and without an algebraic equation.
    for (others, algebraic) in [(1, false), (1, true), (40, false), (40, true)] {
        let mut text = String::from("model rest\nstate a = 0.1\nequation a: der(a) = 0/1 [s]\n");
        let mut before = "a".to_owned();
        for i in 0..others {
            let _ = writeln!(text, "state x{i} = 0");
            let _ = writeln!(text, "equation x{i}: der(x{i}) = 1000*({before} - x{i}/3)/1 [s]");
            before = format!("x{i}");
        }
        if algebraic {
            let _ = writeln!(text, "unknown y = 0\nequation y: 0 = 100*a - y - y^3");
        }
        for method in METHODS {
            let found = run(&text, method, 1e-6, &[0.0, 0.3, 1.0, 7.0]);
            let n = others + 1 + usize::from(algebraic);
            let system = system(&text);
            let a = system.signature().unknowns.iter().position(|x| *x.name == *"a");
            let a = a.expect("an unknown");
            for row in found.y.chunks_exact(n) {
                assert_eq!(row[a].to_bits(), 0.1_f64.to_bits(), "{others} {algebraic} {method}");
            }
        }
    }
}
