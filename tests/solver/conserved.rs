//! Sums that equations conserve, and what they keep accurate.

use dgd_runtime::{
    Inputs, Options, Problem, Solution, System, find_method, simulate_with_sensitivities,
};

use crate::inline::system;

/// Problem E5 of Enright, Hull and Lindberg, BIT 15 (1975) 10–48: chemical pyrolysis. Its rows cancel in y₂ − y₃ − y₄.
const E5: &str = "model e5
    parameter A [1/s] = 7.89e-10
    parameter B [1/s] = 1.1e7
    parameter C [1/s] = 1.13e3
    parameter M = 1e6
    state y1 = 1.76e-3
    state y2 = 0
    state y3 = 0
    state y4 = 0
    equation e1: der(y1) = -A*y1 - B*y1*y3
    equation e2: der(y2) = A*y1 - M*C*y2*y3
    equation e3: der(y3) = A*y1 - y3*(B*y1 + M*C*y2) + C*y4
    equation e4: der(y4) = B*y1*y3 - C*y4";

fn run(text: &str, options: &Options, times: &[f64]) -> Solution {
    let system = system(text);
    let p: Vec<f64> = system.signature().parameters.iter().map(|p| p.value).collect();
    let problem = Problem { system: &system, p: &p, inputs: &Inputs::none(), start: &[] };
    simulate_with_sensitivities(&problem, times, options).expect("a solution")
}

/// The sums that are found, by names and shares.
fn sums(text: &str) -> Vec<Vec<(String, f64)>> {
    let system = system(text);
    let signature = system.signature();
    let named = |(i, share): &(usize, f64)| (signature.unknowns.name(*i).to_string(), *share);
    signature.conserved.iter().map(|sum| sum.terms.iter().map(named).collect()).collect()
}

#[test]
fn sums_are_found_where_all_terms_cancel() {
    let of = |names: &[(&str, f64)]| -> Vec<(String, f64)> {
        names.iter().map(|(name, share)| ((*name).to_owned(), *share)).collect()
    };
    assert_eq!(sums(E5), [of(&[("y2", 1.0), ("y3", -1.0), ("y4", -1.0)])]);
    let tanks = "model tanks
        parameter k [m^2/s] = 0.1
        state h1 [m] = 2
        state h2 [m] = 1
        state v [m^3] = 0
        let q = k*(if h1 > h2 then h1 - h2 else 0 [m])
        equation one: 2 [m^2]*der(h1) = -q
        equation two: 4 [m^2]*der(h2) = q
        equation three: der(v) = q - k*v/1 [m^2]";
    assert_eq!(sums(tanks), [of(&[("h1", 0.5), ("h2", 1.0)])]);
    let open = "model open
        parameter k [1/s] = 0.1
        state a = 2
        state b = 1
        equation one: der(a) = -k*a
        equation two: der(b) = k*a - 2*k*b";
    assert!(sums(open).is_empty());
}

/// y₂ = y₃ + y₄ while they fall by nine decades. At 1e11 s, y₁ and y₄ are gone, and 1/y₂ grows by M C t from then on.
#[test]
fn small_components_that_a_sum_ties_stay_accurate() {
    for method in ["rodas5p", "rodas4", "kencarp4", "bdf"] {
        let options = Options {
            rtol: 1e-8,
            atol: 1e-26,
            method: find_method(method).expect("a method"),
            ..Options::default()
        };
        let times = [0.0, 1e9, 1e11, 1e13];
        let solution = run(E5, &options, &times);
        let last = 1.0 / (1.0 / 1.019_26e-20 + 1.13e9 * (1e13 - 1e11));
        for (k, expected) in [(2, 1.019_26e-20), (3, last)] {
            let y = solution.y(k);
            assert!((y[1] / expected - 1.0).abs() < 1e-3, "{method} at {:e}: {y:?}", times[k]);
            assert!((y[1] / (y[2] + y[3]) - 1.0).abs() < 1e-12, "{method}: {y:?}");
            for s in solution.s(k).chunks_exact(4) {
                let size = s[1].abs().max(s[2].abs());
                assert!((s[1] - s[2] - s[3]).abs() <= 1e-12 * size, "{method}: {s:?}");
            }
        }
    }
}

/// What a reset adds stays: a = 1/4 + 3/4 exp(−4 t) falls to 0.3 when exp(−4 t) = 1/15.
#[test]
fn a_reset_begins_another_sum() {
    let text = "model m
        parameter k [1/s] = 3
        state a = 1
        state b = 0
        equation one: der(a) = -k*a + 1 [1/s]*b
        equation two: der(b) = k*a - 1 [1/s]*b
        when a falls below 0.3 { reset a = a + 2 }";
    let options = Options { rtol: 1e-10, atol: 1e-10, ..Options::default() };
    let solution = run(text, &options, &[0.0, 0.5, 1.5, 4.0]);
    for (k, sum) in [(0, 1.0), (1, 1.0), (2, 3.0), (3, 3.0)] {
        let found: f64 = solution.y(k).iter().sum();
        assert!((found - sum).abs() < 1e-14, "{:?}", solution.y(k));
    }
    let expected = 0.75 + 1.55 * 15.0 * f64::exp(-16.0);
    assert!((solution.y(3)[0] - expected).abs() < 1e-8, "{:?}", solution.y(3));
}
