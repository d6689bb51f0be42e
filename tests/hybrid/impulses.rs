//! Modes that tie states together: charge and momentum are kept where the equations keep them, with the derivatives of
//! closed forms.

use std::fmt::Write as _;

use dgd_execute::InterpretedSystem;
use dgd_runtime::{
    Inputs, JumpCause, METHODS, Options, Problem, Solution, System, consistent_start,
    simulate_with_sensitivities,
};

use crate::exact::{self, options, parameters, position, slopes, value};
use crate::inline;

/// How well closed forms are met, relative to the largest number of the case.
const CLOSE: f64 = 1e-8;

fn model(text: &str) -> InterpretedSystem {
    inline::system(&format!("model m\n{text}"))
}

#[track_caller]
fn assert_close(found: &[f64], expected: &[f64]) {
    exact::assert_close(found, expected, CLOSE);
}

/// A run by the n-th method that suits algebraic equations.
fn run_by(system: &InterpretedSystem, method: usize, times: &[f64]) -> Solution {
    let (p, inputs) = (parameters(system), Inputs::none());
    let problem = Problem { system, p: &p, inputs: &inputs, start: &[] };
    let options = Options { method: &METHODS[method], rtol: 1e-10, atol: 1e-10, ..options() };
    let solution = simulate_with_sensitivities(&problem, times, &options).expect("a solution");
    assert!(solution.undefined.is_empty(), "{:?}", solution.undefined);
    solution
}

fn run(system: &InterpretedSystem, times: &[f64]) -> Solution {
    run_by(system, 0, times)
}

fn last(system: &InterpretedSystem, solution: &Solution, names: &[&str]) -> Vec<f64> {
    let k = solution.len() - 1;
    names.iter().map(|name| value(system, solution, name, k)).collect()
}

#[test]
fn the_capacitors_of_the_report_share_their_charge() {
    let text = include_str!("found/caps2.dgd").replacen("model caps2", "", 1);
    let system = model(&text);
    for method in 0..4 {
        let solution = run_by(&system, method, &[0.0, 0.5, 2.0]);
        assert_close(&last(&system, &solution, &["v1", "v2"]), &[2.5, 2.5]);
        assert!(solution.jumps.is_empty(), "{:?}", solution.jumps);
    }
}

#[test]
fn the_order_of_items_and_their_units_do_not_matter() {
    let items = [
        "state v1 [V] = 10",
        "state v2 [mV] = 4000",
        "unknown i [uA] = 0",
        "equation first: C_1*der(v1) = -i",
        "equation second: C_2*der(v2) = i",
        "modes switch {
           open { equation link: i = 0 [A] }
           closed { equation link: v1 = v2 }
           open -> closed when time rises above t_1
         }",
    ];
    let head = "parameter C_1 [uF] = 2\nparameter C_2 [pF] = 6e6\nparameter t_1 [ms] = 300\n";
    for shift in 0..items.len() {
        let mut order = items;
        order.rotate_left(shift);
        let system = model(&format!("{head}{}", order.join("\n")));
        let solution = run(&system, &[0.0, 1.0]);
        // (2·10 + 6·4)/8
        let v = 5.5;
        assert_close(&last(&system, &solution, &["v1", "v2"]), &[v, v]);
        // ∂v/∂C = (v_own − v)/(C₁ + C₂), for C as large as it is.
        let by = slopes(&system, &solution, "v1", 1);
        assert_close(&[by[0] * 2e-6, by[1] * 6e-6, by[2]], &[4.5 / 4.0, -1.5 * 0.75, 0.0]);
    }
}

const ROTORS: &str = "
parameter J_1 [kg*m^2] = 2
parameter J_2 [kg*m^2] = 3
parameter T [N*m] = 0.5
parameter n = 4
parameter t_1 [s] = 1
state w_1 [rad/s] = 10
state w_2 [rad/s] = -4
state E [J] = 0
unknown T_c [N*m] = 0
unknown P [W] = 0
equation first: J_1*der(w_1) = T - T_c
equation second: J_2*der(w_2) = n*T_c
equation power: P = T_c*w_1
equation work: der(E) = P
modes clutch {
  open { equation clutch: T_c = 0 [N*m] }
  locked { equation clutch: w_1 = n*w_2 }
  open -> locked when time rises above t_1
}
";

#[test]
fn a_clutch_with_a_gear_keeps_the_momentum_that_the_gear_keeps() {
    let system = model(ROTORS);
    // (n J₁ 10 − 4 J₂ + n T t)/(n² J₁ + J₂) = w₂, w₁ = n w₂
    let at = |[j1, j2, torque, n, _]: [f64; 5], t: f64| {
        let w2 = (n * (10.0 * j1 + torque * t) - 4.0 * j2) / (n * n * j1 + j2);
        [n * w2, w2]
    };
    let p = [2.0, 3.0, 0.5, 4.0, 1.0];
    for method in 0..4 {
        let solution = run_by(&system, method, &[0.0, 1.0, 3.0]);
        assert_close(&last(&system, &solution, &["w_1", "w_2"]), &at(p, 3.0));
        for (row, name) in ["w_1", "w_2"].into_iter().enumerate() {
            let differences: Vec<f64> = (0..5)
                .map(|j| {
                    let moved = |by: f64| {
                        let mut p = p;
                        p[j] += by;
                        at(p, 3.0)[row]
                    };
                    (8.0 * (moved(1e-3) - moved(-1e-3)) - (moved(2e-3) - moved(-2e-3))) / 12e-3
                })
                .collect();
            assert_close(&slopes(&system, &solution, name, 2), &differences);
        }
        // The work over the instant is no integral of these equations: it is said.
        let [jump] = solution.jumps[..] else { panic!("{:?}", solution.jumps) };
        assert_eq!((jump.unknown, jump.cause), (position(&system, "E"), JumpCause::Lost));
    }
}

#[test]
fn what_flows_during_the_instant_is_counted() {
    let system = model(
        "parameter C_1 [F] = 1
         parameter C_2 [F] = 3
         parameter C_3 [F] = 2
         state v1 [V] = 10
         state v2 [V] = 0
         state v3 [V] = 4
         state q [C] = 1
         unknown i [A] = 0
         unknown k [A] = 0
         unknown total [A] = 0
         equation q: der(q) = total - 2*k
         equation total: total = i + k
         equation first: C_1*der(v1) = -i
         equation second: C_2*der(v2) = i - k
         equation third: C_3*der(v3) = k
         modes left {
           open { equation left: i = 0 [A] }
           closed { equation left: v1 = v2 }
           open -> closed when time rises above 1 [s]
         }
         modes right {
           open { equation right: k = 0 [A] }
           closed { equation right: v2 = v3 }
           open -> closed when time rises above 2 [s]
         }",
    );
    let solution = run(&system, &[0.0, 1.5, 3.0]);
    let names = ["v1", "v2", "v3", "q"];
    let at = |k: usize| names.map(|name| value(&system, &solution, name, k));
    // v = 10/4, then (10 + 8)/6; q counts i − k: 7.5 C, then −0.5 C + 2 C.
    assert_close(&at(1), &[2.5, 2.5, 4.0, 8.5]);
    assert_close(&at(2), &[3.0, 3.0, 3.0, 10.0]);
    assert!(solution.jumps.is_empty());
}

#[test]
fn clutches_that_close_at_one_time_share_all_momentum() {
    let system = model(
        "parameter J [kg*m^2] = 2
         state a [rad/s] = 9
         state b [rad/s] = 0
         state c [rad/s] = -3
         unknown T_1 [N*m] = 0
         unknown T_2 [N*m] = 0
         equation a: J*der(a) = -T_1
         equation b: J*der(b) = T_1 - T_2
         equation c: 2*J*der(c) = T_2
         modes first {
           open { equation first: T_1 = 0 [N*m] }
           locked { equation first: a = b }
           open -> locked when time rises above 1 [s]
         }
         modes second {
           open { equation second: T_2 = 0 [N*m] }
           locked { equation second: b = c }
           open -> locked when time rises above 1 [s]
         }",
    );
    let solution = run(&system, &[0.0, 2.0]);
    // (9 + 0 − 2·3)/4
    assert_close(&last(&system, &solution, &["a", "b", "c"]), &[0.75; 3]);
}

#[test]
fn a_capacitor_on_a_source_jumps_and_the_jump_is_told() {
    let system = model(
        "parameter V_0 [V] = 12
         state v [V] = 3
         unknown i [A] = 0
         equation charge: 1 [mF]*der(v) = i
         modes switch {
           open { equation link: i = 0 [A] }
           closed { equation link: v = V_0 }
           open -> closed when time rises above 1 [s]
         }",
    );
    let solution = run(&system, &[0.0, 2.0]);
    assert_close(&last(&system, &solution, &["v", "i"]), &[12.0, 0.0]);
    assert_close(&slopes(&system, &solution, "v", 1), &[1.0]);
    let [jump] = solution.jumps[..] else { panic!("{:?}", solution.jumps) };
    assert_eq!((jump.unknown, jump.cause), (position(&system, "v"), JumpCause::Forced));
    assert_close(&[jump.from, jump.to, jump.t], &[3.0, 12.0, 1.0]);
}

#[test]
fn a_reset_acts_first_and_wins() {
    let with = |resets: &str| {
        let system = model(&format!(
            "state v1 [V] = 10
             state v2 [V] = 0
             unknown i [A] = 0
             equation first: 1 [mF]*der(v1) = -i
             equation second: 3 [mF]*der(v2) = i
             modes switch {{
               open {{ equation link: i = 0 [A] }}
               closed {{ equation link: v1 = v2 }}
               open -> closed when time rises above 1 [s] {{ {resets} }}
             }}"
        ));
        last(&system, &run(&system, &[0.0, 2.0]), &["v1", "v2"])
    };
    assert_close(&with("reset v1 = 6 [V]"), &[6.0, 6.0]);
    assert_close(&with("reset v2 = 7 [V]"), &[7.0, 7.0]);
    // Where all are reset, and contradict each other, their charge is kept: (4 + 3·8)/4.
    assert_close(&with("reset v1 = 4 [V]\nreset v2 = 8 [V]"), &[7.0, 7.0]);
}

#[test]
fn bodies_that_collide_and_stick_keep_their_momentum() {
    let system = model(
        "parameter m_1 [kg] = 2
         parameter m_2 [kg] = 1
         parameter gap [m] = 3
         state x_1 [m] = 0
         state x_2 [m] = gap
         state v_1 [m/s] = 2
         state v_2 [m/s] = -1
         unknown F [N] = 0
         equation way_1: der(x_1) = v_1
         equation way_2: der(x_2) = v_2
         equation body_1: m_1*der(v_1) = -F
         equation body_2: m_2*der(v_2) = F
         modes contact {
           apart { equation contact: F = 0 [N] }
           stuck { equation contact: x_1 = x_2 }
           apart -> stuck when x_1 - x_2 rises above 0 [m]
         }",
    );
    let solution = run(&system, &[0.0, 3.0]);
    // They meet at t = gap/3 at x = 2 gap/3, and go on at v = (2 m₁ − m₂)/(m₁ + m₂) = 1.
    let (v, t) = (1.0, 3.0 - 1.0);
    let names = ["x_1", "x_2", "v_1", "v_2"];
    assert_close(&last(&system, &solution, &names), &[2.0 + v * t, 2.0 + v * t, v, v]);
    // ∂v/∂m₁ = (2 − v)/3, ∂v/∂m₂ = (−1 − v)/3; ∂x/∂gap = 2/3 − v/3.
    assert_close(&slopes(&system, &solution, "v_2", 1), &[1.0 / 3.0, -2.0 / 3.0, 0.0]);
    assert_close(&slopes(&system, &solution, "x_1", 1), &[t / 3.0, -2.0 * t / 3.0, 1.0 / 3.0]);
    assert!(solution.jumps.is_empty());
}

#[test]
fn a_rope_that_goes_taut_takes_the_speed_along_it() {
    let system = model(
        "parameter l [m] = 2
         state x [m] = 0
         state y [m] = 1
         state u [m/s] = 1
         state v [m/s] = 0
         unknown tension [1/s^2] = 0
         equation right: der(x) = u
         equation up: der(y) = v
         equation force_x: der(u) = -tension*x
         equation force_y: der(v) = -tension*y
         modes rope {
           slack { equation rope: tension = 0 [1/s^2] }
           taut { equation rope: x^2 + y^2 = l^2 }
           slack -> taut when x^2 + y^2 rises above l^2
         }",
    );
    for method in 0..4 {
        let solution = run_by(&system, method, &[0.0, 1.0, 3.0]);
        // At 30° and t = √3; half the speed is left, at a right angle to the rope.
        let angle = std::f64::consts::FRAC_PI_6 - 0.25 * (3.0 - 3.0_f64.sqrt());
        let expected =
            [2.0 * angle.cos(), 2.0 * angle.sin(), 0.5 * angle.sin(), -0.5 * angle.cos()];
        let found = last(&system, &solution, &["x", "y", "u", "v"]);
        exact::assert_close(&found, &expected, 1e-7);
        // θ = asin(1/l) − (t − t_e)/l², as the speed after is 1/l; t_e = √(l² − 1).
        let by_l = -1.0 / (2.0 * 3.0_f64.sqrt())
            + 2.0 / 3.0_f64.sqrt() / 4.0
            + 2.0 * (3.0 - 3.0_f64.sqrt()) / 8.0;
        let slope = slopes(&system, &solution, "x", 2)[0];
        exact::assert_close(&[slope], &[angle.cos() - 2.0 * angle.sin() * by_l], 1e-6);
    }
}

#[test]
fn an_inertia_may_depend_on_what_does_not_jump() {
    let system = model(
        "parameter J [kg*m^2] = 2
         parameter m [kg] = 1.5
         parameter r_0 [m] = 0.7
         state r [m] = r_0
         state a [rad/s] = 5
         state b [rad/s] = 1
         unknown T [N*m] = 0
         unknown I [kg*m^2] = 1
         equation way: der(r) = 0.1 [m/s]
         equation inertia: I = m*r^2
         equation table: J*der(a) = -T
         equation body: I*der(b) = T
         modes clutch {
           open { equation clutch: T = 0 [N*m] }
           locked { equation clutch: a = b }
           open -> locked when time rises above 2 [s]
         }",
    );
    let solution = run(&system, &[0.0, 3.0]);
    let (j, m, r) = (2.0, 1.5, 0.9_f64);
    let i = m * r * r;
    let w = (j * 5.0 + i) / (j + i);
    assert_close(&last(&system, &solution, &["a", "b"]), &[w, w]);
    let by_i = (1.0 - w) / (j + i);
    let expected = [(5.0 - w) / (j + i), by_i * r * r, by_i * 2.0 * m * r];
    assert_close(&slopes(&system, &solution, "a", 1), &expected);
}

#[test]
fn a_start_has_no_impulse_and_the_start_value_that_is_dropped_is_told() {
    let text = include_str!("found/caps3.dgd").replacen("model caps3", "", 1);
    let system = model(&text);
    let inputs = Inputs::none();
    let problem = Problem { system: &system, p: &[], inputs: &inputs, start: &[] };
    let start = consistent_start(&problem, 0.0, &options()).expect("a start");
    let v = ["v1", "v2"].map(|name| start.y[position(&system, name)]);
    assert_close(&v, &[10.0, 10.0]);
    assert_eq!(start.dropped, [(position(&system, "v2"), 0.0)]);
}

/// So many pairs of bodies, each with a link that closes at a time of its own.
fn links(n: usize) -> String {
    let mut text = String::new();
    for k in 1..=n {
        let _ = write!(
            text,
            "
            state a{k} [m/s] = {k}
            state b{k} [m/s] = -1
            unknown F{k} [N] = 0
            equation a{k}: 1 [kg]*der(a{k}) = -F{k}
            equation b{k}: {k} [kg]*der(b{k}) = F{k}
            modes link{k} {{
              open {{ equation link{k}: F{k} = 0 [N] }}
              shut {{ equation link{k}: a{k} = b{k} }}
              open -> shut when time rises above {k}/20*1 [s]
            }}
            "
        );
    }
    text
}

#[test]
fn links_that_do_not_meet_are_not_multiplied() {
    let n = 24;
    let system = model(&links(n));
    let (p, inputs) = (Vec::new(), Inputs::none());
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let solution = dgd_runtime::simulate(&problem, &[0.0, 2.0], &options()).expect("a solution");
    assert_eq!(system.signature().discrete.automata.len(), n);
    for k in 1..=n {
        // (k − k)/(1 + k) = 0
        let found = last(&system, &solution, &[&format!("a{k}"), &format!("b{k}")]);
        assert_close(&found, &[0.0, 0.0]);
    }
}
