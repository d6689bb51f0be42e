//! Models made of parts against the same models written out.

use std::cell::RefCell;
use std::path::Path;

use dgd_execute::InterpretedSystem;
use dgd_runtime::{EvaluationPoint, System, discrete_numbers};

use crate::support::{Noise, compiled, input_values, interpreted};

dgd::model!("tests/parts/mud_circulation.dgd", line.flow = static, sensitivities = [pump.c0]);

/// A system at a place, and what it makes of it.
struct Evaluated {
    start: Vec<f64>,
    f: Vec<f64>,
    w: Vec<f64>,
}

/// Evaluates a system at a place near its start; parameters are asked for by name.
fn evaluated(system: &InterpretedSystem, seed: u64, p: &dyn Fn(&str) -> f64) -> Evaluated {
    let signature = system.signature();
    let noise = RefCell::new(Noise::new(seed));
    let u = input_values(
        signature,
        |_, input| input.unit.factor * (20.0 + 5.0 * noise.borrow_mut().next()),
        |_, input| input.unit.factor * noise.borrow_mut().next(),
    );
    let mut noise = noise.into_inner();
    let p: Vec<f64> = signature.parameters.iter().map(|parameter| p(&parameter.name)).collect();
    let z = discrete_numbers(system, &p, 0.0);
    let mut y = vec![0.0; signature.unknowns.len()];
    system.start(EvaluationPoint { t: 0.0, y: &[], u: &u, p: &p, z: &z }, &mut y);
    let start = y.clone();
    for y in &mut y {
        *y *= 1.0 + 0.3 * noise.next();
    }
    let at = EvaluationPoint { t: 0.0, y: &y, u: &u, p: &p, z: &z };
    let (mut f, mut w) = (vec![0.0; y.len()], vec![0.0; signature.outputs.len()]);
    system.rhs(at, &mut f);
    system.outputs(at, &mut w);
    Evaluated { start, f, w }
}

fn declared(system: &InterpretedSystem, name: &str) -> f64 {
    let mut all = system.signature().parameters.iter();
    all.find(|p| &*p.name == name).unwrap_or_else(|| panic!("no parameter `{name}`")).value
}

#[test]
fn a_cascade_of_two_tanks_is_the_model_written_out() {
    let whole = interpreted("models/two_tanks.dgd", &[]);
    let parts = interpreted("tests/parts/two_tanks.dgd", &[]);
    // The lower tank's overflow is zero below its rim, and adding it changes no bit.
    let written_out = |name: &str| match name {
        "upper.a" => declared(&whole, "a_1"),
        "lower.a" => declared(&whole, "a_2"),
        "upper.spill" | "lower.spill" => declared(&whole, "spill"),
        other => panic!("no parameter `{other}`"),
    };
    for seed in 0..50 {
        let a = evaluated(&whole, seed, &|name| declared(&whole, name));
        let b = evaluated(&parts, seed, &written_out);
        assert_eq!((a.start, a.f, a.w), (b.start, b.f, b.w));
    }
}

#[test]
fn the_circulation_of_parts_is_the_model_written_out() {
    for choice in ["dynamic", "static"] {
        let whole = interpreted("models/mud_circulation.dgd", &[("flow", choice)]);
        let parts = interpreted("tests/parts/mud_circulation.dgd", &[("line.flow", choice)]);
        let written_out = |name: &str| match name {
            "line.M" => declared(&whole, "M_ssp"),
            other => declared(&whole, other.rsplit_once('.').map_or(other, |(_, name)| name)),
        };
        for seed in 0..50 {
            let a = evaluated(&whole, seed, &|name| declared(&whole, name));
            let b = evaluated(&parts, seed, &written_out);
            assert_eq!((&a.start, a.f[0], &a.w), (&b.start, b.f[0], &b.w));
            // The balance of the line is the same sum in another order: four terms of at most
            // rho g h_in = 3.4e6 Pa and three additions each, over the mass in the dynamic variant.
            let mass = if choice == "dynamic" { declared(&whole, "M_ssp") } else { 1.0 };
            let rounding = 6.0 * f64::EPSILON * 3.4e6 / mass;
            assert!((a.f[1] - b.f[1]).abs() <= rounding, "{} and {}", a.f[1], b.f[1]);
        }
    }
}

#[test]
fn every_part_runs_alone() {
    for part in [
        "battery_cell",
        "heated_room",
        "tank",
        "return_line",
        "pi_controller",
        "riser",
        "pressurised_line",
    ] {
        let path = format!("models/parts/{part}.dgd");
        let system = interpreted(&path, &[]);
        let a = evaluated(&system, 1, &|name| declared(&system, name));
        assert!(a.f.iter().chain(&a.w).all(|x| x.is_finite()), "{part}");
    }
}

#[test]
fn generated_code_has_the_names_of_parts_with_underscores() {
    let parameters = mud_circulation::Parameters::default();
    assert_eq!(parameters.pump_c0, 275.0);
    let signature = mud_circulation::Model.signature();
    assert_eq!(&*signature.parameters[0].name, "pump.c0");
    let static_variant =
        compiled(Path::new("tests/parts/mud_circulation.dgd"), &[("line.flow", "static")]);
    let generated: Vec<String> = signature.unknowns.iter().map(|x| x.name.into_owned()).collect();
    let interpreted: Vec<&str> =
        static_variant.dae.unknowns.iter().map(|x| x.name.as_str()).collect();
    assert_eq!(generated, interpreted);
    assert_eq!(signature.directions.len(), 1);
}

#[test]
fn rows_of_tanks_are_the_model_written_out() {
    let whole = interpreted("tests/parts/rows_written_out.dgd", &[]);
    let parts = interpreted("tests/parts/rows_of_tanks.dgd", &[]);
    let written_out = |name: &str| declared(&whole, name.strip_prefix("row.tank.").unwrap_or(name));
    for seed in 0..50 {
        let a = evaluated(&whole, seed, &|name| declared(&whole, name));
        let b = evaluated(&parts, seed, &written_out);
        assert_eq!((&a.start, &a.f), (&b.start, &b.f));
        // The sums of outflows go over rows first.
        let off = a.w.iter().zip(&b.w).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f64::max) < 1e-15, "{:?} and {:?}", a.w, b.w);
    }
}
