//! Compares the machine's vector widths with each other.

#![allow(clippy::duplicate_mod, reason = "the steppers' tests have the same problems")]

use super::pack::LaneEngine;
use super::{EnsembleQuantities, Member, Trajectory, run_part};
use crate::linalg::width::VectorWidth;
use crate::{Failure, Inputs, IntegrateError, Options, RunMonitor, find_method};
use support::problems::{Logistic, LogisticStacked};

#[path = "../../tests/support/mod.rs"]
mod support;

#[test]
fn all_widths_give_the_same_bits() {
    let system = LogisticStacked::of::<Logistic>();
    let inputs = Inputs::constant(&[0.0]);
    let sets: Vec<[f64; 3]> = (0..11).map(|k| [1.0 + 0.1 * f64::from(k), 2.0, 0.1]).collect();
    let times: Vec<f64> = (0..50).map(|k| 0.1 * f64::from(k)).collect();
    for method in ["rodas5p", "tsit5"] {
        let method = find_method(method).expect("a method");
        let options = Options { method, ..Options::default() };
        let members = |width: VectorWidth| {
            let mut rows = vec![Vec::new(); sets.len()];
            let pack = LaneEngine::new(&system, &times, &options, EnsembleQuantities::Unknowns);
            let mut pack = pack.expect("a method with lanes");
            pack.width = width;
            let mut waiting = sets.iter().enumerate();
            let next = || {
                let (k, p) = waiting.next()?;
                Some((k, Member { p, inputs: &inputs, start: &[] }.to_problem(&system)))
            };
            pack.run(next, |done| {
                let done = done.expect("a run to the end");
                rows[done.member] = done.unknowns[..times.len()].to_vec();
            });
            rows
        };
        let widest = members(VectorWidth::widest());
        assert_eq!(members(VectorWidth::Compiled), widest);
        #[cfg(target_arch = "x86_64")]
        if VectorWidth::widest() == VectorWidth::Avx512 {
            assert_eq!(members(VectorWidth::Avx2), widest);
        }
    }
}

#[test]
fn members_stop_when_they_are_asked_to() {
    static WATCHED: RunMonitor = RunMonitor::new();
    let system = LogisticStacked::of::<Logistic>();
    let inputs = Inputs::constant(&[0.0]);
    let p = [1.0, 2.0, 0.1];
    let members = [Member { p: &p, inputs: &inputs, start: &[] }; 20];
    let options = Options { watched: Some(&WATCHED), ..Options::default() };
    let times = [0.0, 5.0];
    let run = || {
        let kept = |_, outcome: Result<Trajectory<'_>, Failure>| outcome.map(|one| one.to_kept());
        run_part(&system, &members, &times, &options, EnsembleQuantities::Values, kept)
    };
    assert!(run().iter().all(Result::is_ok));
    WATCHED.stop();
    for outcome in run() {
        let error = outcome.expect_err("it is stopped").error;
        assert!(matches!(error, IntegrateError::Stopped { t: 0.0 }), "{error}");
    }
}
