//! Equations whose values end: a run stays at the end or stops there, by every method, and says what to write.

use dgd_runtime::{Inputs, IntegrateError, Options, Problem, find_method, simulate};

use crate::inline::system;

const METHODS: [&str; 6] = ["rodas5p", "rodas4", "kencarp4", "bdf", "tsit5", "taylor"];

/// Runs a model of one state to `until`, by way of where its solution ends. Returns the last value of the state, or the
/// message.
fn run(text: &str, until: f64, name: &str) -> Result<f64, String> {
    let system = system(text);
    let Ok(method) = find_method(name) else { panic!("{name} is a method") };
    let p: Vec<f64> =
        dgd_runtime::System::signature(&system).parameters.iter().map(|p| p.value).collect();
    let inputs = Inputs::none();
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let options = Options { method, ..Options::default() };
    match simulate(&problem, &[0.0, until], &options) {
        Ok(solution) => Ok(solution.y(1)[0]),
        Err(failure) => {
            assert!(
                matches!(failure.error, IntegrateError::NotFinite { .. }),
                "{name}: {}",
                failure.error
            );
            Err(failure.error.to_string())
        }
    }
}

/// h' = −k √h is empty at 2/k √h₀ = 100 s, where the series of the root goes on as its negative.
#[test]
fn an_empty_tank_does_not_fill_up() {
    for (k, h_0, until) in
        [(0.02, 1.0, 200.0), (0.02, 1.0, 400.0), (2.0, 3e-4, 1.0), (1e-5, 4.0, 1e6)]
    {
        for power in ["sqrt(h)", "h^0.5"] {
            let text = format!(
                "model drain\nparameter k [m^(1/2)/s] = {k}\nstate h [m] = {h_0}\nequation h: der(h) = -k*{power}"
            );
            for name in METHODS {
                match run(&text, until, name) {
                    Ok(h) => {
                        assert!(h.abs() <= 1e-5 * f64::max(h_0, 1.0), "{name} {power} {k}: {h}");
                    }
                    Err(message) => assert!(
                        message.ends_with(
                            "it has no value for `h` below 0 m: write `max(h, 0)` in it"
                        ),
                        "{name}: {message}"
                    ),
                }
            }
        }
    }
}

#[test]
fn the_end_is_told_in_the_unit_of_the_unknown() {
    // Below a sill of 20 cm nothing flows.
    let sill = "model sill\nstate h [cm] = 100\nequation h: der(h) = -0.01 [m^(1/2)/s]*sqrt(h - 20 [cm]) - 1 [mm/s]";
    // Above 1 there is no angle.
    let angle = "model angle\nstate x = 0\nequation x: der(x) = (1 + asin(x))/1 [s]";
    for name in METHODS {
        let Err(message) = run(sill, 1000.0, name) else { panic!("{name}") };
        assert!(
            message.contains("it has no value for `h` below 20 cm: write `max(h, 20 [cm])` in it"),
            "{name}: {message}"
        );
        let Err(message) = run(angle, 10.0, name) else { panic!("{name}") };
        assert!(
            message.contains("it has no value for `x` above 1: write `min(x, 1)` in it"),
            "{name}: {message}"
        );
    }
}
