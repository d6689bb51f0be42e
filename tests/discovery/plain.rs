//! Wrong numbers of the file and faults of recordings, which come before any effect.

use dgd_discover::{Discovery, PlainCause, PlainKind, Verdict};

use crate::examined::{Samples, Texts};
use crate::random::Random;

/// A motor behind an amplifier: der(w) = (torque u − brake w − drag w |w|)/inertia, read with noise and an offset by a
/// clock that goes at a rate. The voltage swings about a level.
#[derive(Debug, Clone, Copy)]
struct Motor {
    inertia: f64,
    torque: f64,
    brake: f64,
    drag: f64,
    offset: f64,
    rate: f64,
    level: f64,
}

const TRUTH: Motor = Motor {
    inertia: 0.056,
    torque: 1.3,
    brake: 0.11,
    drag: 0.0,
    offset: 0.0,
    rate: 1.0,
    level: 0.0,
};
const NOISE: f64 = 0.02;

impl Motor {
    /// Readings at 10 Hz for 40 s, by Runge–Kutta steps of 1 ms; time and speed in these units.
    fn record(self, seed: u64, [second, radian]: [f64; 2]) -> Samples {
        const STEPS: usize = 100;
        let mut random = Random::new(seed, 5);
        let parts: Vec<[f64; 3]> = (0..4)
            .map(|_| {
                let (size, period) = (random.between(0.3, 0.9), random.between(2.0, 12.0));
                [size, std::f64::consts::TAU / period, random.between(0.0, 6.0)]
            })
            .collect();
        let times: Vec<f64> = (0..=400).map(|k| 0.1 * f64::from(k)).collect();
        let voltage = |t: &f64| {
            let t = t / self.rate;
            let swing: f64 = parts.iter().map(|[a, f, start]| a * (f * t + start).sin()).sum();
            self.level + swing
        };
        let u: Vec<f64> = times.iter().map(voltage).collect();
        let (mut w, mut read) = (0.0_f64, Vec::new());
        let h = 0.1 / self.rate / STEPS as f64;
        for k in 0..times.len() {
            read.push(radian * (w + self.offset + NOISE * random.normal()));
            let next = u[(k + 1).min(u.len() - 1)];
            for step in 0..STEPS {
                let rate = |w: f64, share: f64| {
                    let u = u[k] + (step as f64 + share) / STEPS as f64 * (next - u[k]);
                    (self.torque * u - self.brake * w - self.drag * w * w.abs()) / self.inertia
                };
                let a = rate(w, 0.0);
                let b = rate(w + 0.5 * h * a, 0.5);
                let c = rate(w + 0.5 * h * b, 0.5);
                w += h / 6.0 * (a + 2.0 * (b + c) + rate(w + h * c, 1.0));
            }
        }
        let times = times.iter().map(|t| second * t).collect();
        Samples { times, columns: vec![("u".to_owned(), u), ("w".to_owned(), read)] }
    }
}

fn found(model: &str, [train, valid]: [Samples; 2]) -> Discovery {
    let texts = Texts { model: ("motor.dgd".to_owned(), model.to_owned()), effects: Vec::new() };
    let examined = texts.read();
    let [train, valid] = [train, valid].map(|samples| examined.recording_without_start(&samples));
    examined.discover(&[train], &[valid], 1)
}

fn recorded(motor: Motor, units: [f64; 2]) -> [Samples; 2] {
    [1, 2].map(|seed| motor.record(seed, units))
}

#[track_caller]
fn causes(discovery: &Discovery) -> &[PlainCause] {
    assert_eq!(discovery.verdict, Verdict::Plain, "{}", discovery.reason);
    &discovery.plain.as_ref().expect("plain causes").causes
}

#[track_caller]
fn is_near(cause: &PlainCause, name: &str, kind: PlainKind, value: f64) {
    assert_eq!((&*cause.name, cause.kind), (name, kind));
    let found = cause.value.as_ref().expect("a number");
    let std = found.std.expect("the recordings determine it");
    let off = (found.unit.from_si(found.value) - value).abs();
    assert!(off < 4.0 * std / found.unit.factor && std < 0.01 * found.value, "{cause:?}");
}

const MODEL: &str = "model motor
input u [V] linear
constant J [kg*m^2] = 0.05
constant radius [m] = 0.2
constant K [N*m/V] = 1.3
parameter b [N*m*s] = 0.1 in 0.001 .. 10, log
parameter F [N*m] = 0 in 0 .., fixed
state w [rad/s] = 0
let rim [m/s] = radius*w
equation motor: J*der(w) = K*u - b*w - F
output w [rad/s] noise 0.02
";

#[test]
fn a_constant_that_is_off_is_named_with_its_twin_before_a_gain() {
    let discovery = found(MODEL, recorded(TRUTH, [1.0, 1.0]));
    let all = causes(&discovery);
    assert_eq!(all.len(), 2, "{all:?}");
    is_near(&all[0], "J", PlainKind::Constant, 0.056);
    is_near(&all[1], "K", PlainKind::Constant, 1.3 * 0.05 / 0.056);
    let effects = &discovery.plain.as_ref().expect("causes").effects;
    assert!(effects.iter().any(|name| name == "sensor_gain(w)"), "{effects:?}");
    assert!(discovery.effects.is_empty() && discovery.unexplained.is_empty());
    // The corrected model is the model with its constant.
    let line = discovery.corrected.lines().find(|line| line.starts_with("constant J"));
    assert!(
        line.is_some_and(
            |line| line.starts_with("constant J [kg*m^2] = 0.05") && !line.ends_with("= 0.05")
        ),
        "{line:?}"
    );
}

#[test]
fn a_parameter_that_is_not_estimated_is_as_suspect_in_any_unit_and_by_any_name() {
    // The speed in revolutions per minute, time in minutes, inertia in kg cm².
    let text = "model drive
input u [V] hold
parameter inertia [kg*cm^2] = 500 fixed
parameter torque [N*m/V] = 1.3 in 0.1 .. 10, fixed
parameter brake [N*m*min] = 0.002 in 1e-6 .. 1, log
state speed [rpm] = 0
equation motor: inertia*der(speed) = torque*u - brake*speed
output w [rpm] = speed noise 0.2
";
    let text = text.replace("hold", "linear");
    let rpm = 30.0 / std::f64::consts::PI;
    let discovery = found(&text, recorded(TRUTH, [1.0, rpm]));
    let all = causes(&discovery);
    assert_eq!(all.len(), 2, "{all:?}");
    is_near(&all[0], "inertia", PlainKind::Parameter, 560.0);
    is_near(&all[1], "torque", PlainKind::Parameter, 1.3 * 0.05 / 0.056);
}

#[test]
fn a_number_in_another_unit_is_said_to_be_meant_in_it() {
    // 78 N m/min of a data sheet, for 1.3 N m/s.
    let text = MODEL
        .replace("constant K [N*m/V] = 1.3", "constant K [J/(s*V)] = 78")
        .replace("J*der(w) = K*u - b*w - F", "J*der(w) = 1 [s]*K*u - b*w - F")
        .replace("= 0.05\n", "= 0.056\n");
    let discovery = found(&text, recorded(TRUTH, [1.0, 1.0]));
    let all = causes(&discovery);
    let own = all.iter().find(|cause| cause.name == "K").expect("the constant");
    is_near(own, "K", PlainKind::Constant, 1.3);
    assert_eq!(own.meant_in.as_deref(), Some("J/(min*V)"));
}

#[test]
fn right_numbers_are_not_named() {
    let right = MODEL.replace("= 0.05\n", "= 0.056\n");
    let discovery = found(&right, recorded(TRUTH, [1.0, 1.0]));
    assert_eq!(discovery.verdict, Verdict::Sufficient, "{}", discovery.reason);
    assert!(discovery.plain.is_none());
}

#[test]
fn a_missing_drag_is_no_wrong_number() {
    let right = MODEL.replace("= 0.05\n", "= 0.056\n");
    let discovery = found(&right, recorded(Motor { drag: 0.02, ..TRUTH }, [1.0, 1.0]));
    assert_ne!(discovery.verdict, Verdict::Sufficient);
    assert!(discovery.plain.is_none(), "{:?}", discovery.plain);
}

/// The motor whose constants are right.
fn right() -> String {
    MODEL.replace("= 0.05\n", "= 0.056\n")
}

fn column<'a>(samples: &'a mut Samples, name: &str) -> &'a mut Vec<f64> {
    let found = samples.columns.iter_mut().find(|(own, _)| own == name);
    &mut found.expect("a column").1
}

#[test]
fn a_column_in_another_unit_is_named() {
    let mut pair = recorded(TRUTH, [1.0, 1.0]);
    for samples in &mut pair {
        for w in column(samples, "w") {
            *w *= 30.0 / std::f64::consts::PI;
        }
    }
    let discovery = found(&right(), pair);
    let all = causes(&discovery);
    let own = all
        .iter()
        .find(|cause| cause.kind == PlainKind::Unit)
        .unwrap_or_else(|| panic!("{all:?} {}", discovery.reason));
    assert_eq!((&*own.name, own.meant_in.as_deref()), ("w", Some("rpm")));
}

#[test]
fn times_in_minutes_are_said_to_be() {
    let mut pair = recorded(TRUTH, [1.0, 1.0]);
    for samples in &mut pair {
        for t in &mut samples.times {
            *t /= 60.0;
        }
    }
    let discovery = found(&right(), pair);
    let all = causes(&discovery);
    let own = all
        .iter()
        .find(|cause| cause.kind == PlainKind::Clock)
        .unwrap_or_else(|| panic!("{all:?} {}", discovery.reason));
    assert_eq!(own.meant_in.as_deref(), Some("min"));
}

#[test]
fn an_input_that_is_a_line_between_rows_is_not_held() {
    let discovery = found(&right().replace("linear", "hold"), recorded(TRUTH, [1.0, 1.0]));
    let own = &causes(&discovery)[0];
    assert_eq!((&*own.name, own.kind), ("u", PlainKind::Interpolation));
    assert_eq!(own.meant_in.as_deref(), Some("linear"));
    assert!(discovery.corrected.contains("input u [V] linear"), "{}", discovery.corrected);
}

/// The discovery from two training recordings and a validation recording.
fn found_in(model: &str, motors: [Motor; 3], units: [f64; 2]) -> Discovery {
    let recorded = |k: usize| motors[k].record(k as u64 + 1, units);
    found_in_recordings(model, &[recorded(0), recorded(1)], &recorded(2))
}

fn found_in_recordings(model: &str, train: &[Samples], valid: &Samples) -> Discovery {
    let texts = Texts { model: ("motor.dgd".to_owned(), model.to_owned()), effects: Vec::new() };
    let examined = texts.read();
    let train: Vec<_> = train.iter().map(|one| examined.recording_without_start(one)).collect();
    examined.discover(&train, &[examined.recording_without_start(valid)], 1)
}

/// Names of the recordings of a group, those that are held out, its value in the declared unit and its uncertainty.
type Group<'a> = (Vec<&'a str>, Vec<&'a str>, f64, Option<f64>);

fn groups(cause: &PlainCause) -> Vec<Group<'_>> {
    cause
        .values
        .iter()
        .map(|own| {
            let value = &own.value;
            (
                own.recordings.iter().map(String::as_str).collect(),
                own.held_out.iter().map(String::as_str).collect(),
                value.unit.from_si(value.value),
                value.std.map(|std| std / value.unit.factor),
            )
        })
        .collect()
}

#[track_caller]
fn are_near(cause: &PlainCause, expected: &[(&[&str], &[&str], f64)]) {
    let found = groups(cause);
    assert_eq!(found.len(), expected.len(), "{cause:?}");
    for ((recordings, held_out, value, std), (own, own_held_out, truth)) in
        found.into_iter().zip(expected)
    {
        assert_eq!((&*recordings, &*held_out), (*own, *own_held_out), "{cause:?}");
        let std = std.unwrap_or(1e-12);
        assert!((value - truth).abs() < 4.0 * std, "{value} ± {std}, in truth {truth}");
    }
}

#[test]
fn a_parameter_that_was_changed_between_recordings_is_named_with_its_values() {
    let worn = Motor { brake: 0.14, ..TRUTH };
    let discovery = found_in(&right(), [TRUTH, worn, worn], [1.0, 1.0]);
    let own = &causes(&discovery)[0];
    assert_eq!((&*own.name, own.kind), ("b", PlainKind::DiffersNumber));
    are_near(own, &[(&["train1"], &[], 0.11), (&["train2"], &["valid1"], 0.14)]);
    // The corrected model has the value of the first recordings, and no line of its own for the others.
    assert_eq!(discovery.corrected.lines().count(), right().lines().count());

    // In hours, by other names, and in another order.
    let text = "model drive
input u [V] linear
constant inertia [kg*m^2] = 0.056
constant torque [N*m/V] = 1.3
parameter brake [N*m*h] = 3e-5 in 1e-7 .. 1, log
state speed [rpm] = 0
equation motor: inertia*der(speed) = torque*u - brake*speed
output w [rpm] = speed noise 0.2
";
    let rpm = 30.0 / std::f64::consts::PI;
    let discovery = found_in(text, [worn, TRUTH, worn], [1.0, rpm]);
    let own = &causes(&discovery)[0];
    assert_eq!((&*own.name, own.kind), ("brake", PlainKind::DiffersNumber));
    let hour = 3600.0;
    are_near(own, &[(&["train1"], &["valid1"], 0.14 / hour), (&["train2"], &[], 0.11 / hour)]);
}

#[test]
fn one_recording_unlike_the_others_is_named() {
    let heavy = Motor { inertia: 0.064, ..TRUTH };
    let all = [heavy, TRUTH, TRUTH].into_iter().enumerate();
    let train: Vec<Samples> = all.map(|(k, one)| one.record(k as u64 + 1, [1.0, 1.0])).collect();
    let discovery = found_in_recordings(&right(), &train, &TRUTH.record(4, [1.0, 1.0]));
    let own = &causes(&discovery)[0];
    assert_eq!((&*own.name, own.kind), ("J", PlainKind::DiffersNumber));
    let found = groups(own);
    assert_eq!(found.len(), 2);
    are_near(own, &[(&["train2", "train3"], &["valid1"], 0.056), (&["train1"], &[], 0.064)]);
}

#[test]
fn a_sensor_whose_zero_differs_between_recordings_is_named() {
    let moved = Motor { offset: 0.15, ..TRUTH };
    let discovery = found_in(&right(), [moved, TRUTH, TRUTH], [1.0, 1.0]);
    let own = &causes(&discovery)[0];
    assert_eq!((&*own.name, own.kind), ("w", PlainKind::DiffersOffset));
    are_near(own, &[(&["train2"], &["valid1"], 0.0), (&["train1"], &[], 0.15)]);
}

#[test]
fn a_recording_that_resembles_none_of_the_others_is_no_proof_that_they_differ() {
    let motors = [TRUTH, Motor { brake: 0.14, ..TRUTH }, Motor { brake: 0.2, ..TRUTH }];
    let discovery = found_in(&right(), motors, [1.0, 1.0]);
    let differs = |cause: &PlainCause| cause.kind == PlainKind::DiffersNumber && cause.name == "b";
    assert!(!discovery.plain.iter().flat_map(|plain| &plain.causes).any(differs));
}

#[test]
fn recordings_alike_but_for_their_noise_do_not_differ() {
    let discovery = found_in(&right(), [TRUTH; 3], [1.0, 1.0]);
    assert_eq!(discovery.verdict, Verdict::Sufficient, "{}", discovery.reason);
}

#[test]
fn a_drag_that_is_missing_at_different_speeds_is_no_difference_between_recordings() {
    let at = |level: f64| Motor { drag: 0.004, level, ..TRUTH };
    let discovery = found_in(&right(), [at(0.1), at(0.6), at(0.4)], [1.0, 1.0]);
    assert_ne!(discovery.verdict, Verdict::Sufficient);
    assert!(discovery.plain.is_none(), "{:?}", discovery.plain);
}

#[test]
fn an_input_that_is_stuck_is_named_with_the_moment() {
    let [mut train, valid] = recorded(TRUTH, [1.0, 1.0]);
    let u = column(&mut train, "u");
    let stays = u[251];
    u[251..].fill(stays);
    let discovery = found(&right(), [train, valid]);
    let own = &causes(&discovery)[0];
    assert_eq!((&*own.name, own.kind), ("u", PlainKind::Stuck));
    assert_eq!(own.since.len(), 1);
    assert_eq!((&*own.since[0].recording, own.since[0].value.value), ("train1", stays));
    assert!((own.since[0].time - 25.1).abs() < 1e-9, "{own:?}");
}

#[test]
fn an_input_that_is_switched_off_is_not_stuck() {
    // What the model lacks only acts then: a brake that holds the motor.
    let [mut train, valid] = recorded(TRUTH, [1.0, 1.0]);
    column(&mut train, "u")[300..].fill(0.0);
    column(&mut train, "w")[300..].iter_mut().for_each(|w| *w *= 0.2);
    let discovery = found(&right(), [train, valid]);
    assert!(discovery.plain.is_none(), "{:?}", discovery.plain);
}

#[test]
fn recordings_that_begin_elsewhere_than_the_model_holds_are_named() {
    let text = right().replace("state w [rad/s] = 0", "state w [rad/s] = 0 fixed");
    // The rows before are lost.
    let late = |samples: Samples| -> Samples {
        let columns = samples.columns.into_iter().map(|(name, all)| (name, all[50..].to_vec()));
        let times = samples.times[50..].iter().map(|t| t - samples.times[50]).collect();
        Samples { times, columns: columns.collect() }
    };
    let discovery = found(&text, recorded(TRUTH, [1.0, 1.0]).map(late));
    let own = &causes(&discovery)[0];
    assert_eq!((&*own.name, own.kind), ("w", PlainKind::Start));
    let [only] = &*own.values else { panic!("{own:?}") };
    assert!(
        only.recordings == ["train1"] && only.value.std.is_some_and(|std| std < 0.1),
        "{own:?}"
    );
}

#[test]
fn a_clock_that_is_off_by_a_thousandth_is_named_where_the_model_fixes_the_time() {
    // A float in a harbour: the sum of two tides whose periods are known.
    let text = "model tide
constant moon [h] = 12.4206012
constant sun [h] = 12
parameter a [m] = 0.8
parameter b [m] = 0.3
parameter lag [s] = 5000 in 10 .. 1e6, log
state h [m] = 0
equation basin: lag*der(h) = a*sin(2*pi*time/moon) + b*sin(2*pi*time/sun) - h
output h [m] noise 0.03
";
    let record = |seed: u64| {
        let mut random = Random::new(seed, 5);
        let (mut h, mut read) = (0.0, Vec::new());
        let times: Vec<f64> = (0..1500).map(|k| 1200.0 * f64::from(k)).collect();
        for t in &times {
            read.push(h + 0.03 * random.normal());
            let step = 1200.0 / 1.001 / 20.0;
            for k in 0..20 {
                let rate = |share: f64, h: f64| {
                    let t = t / 1.001 + (f64::from(k) + share) * step;
                    let of = |hours: f64| (std::f64::consts::TAU * t / (3600.0 * hours)).sin();
                    (of(12.420_601_2) + 0.4 * of(12.0) - h) / 7200.0
                };
                let a = rate(0.0, h);
                let b = rate(0.5, h + 0.5 * step * a);
                let c = rate(0.5, h + 0.5 * step * b);
                h += step / 6.0 * (a + 2.0 * (b + c) + rate(1.0, h + step * c));
            }
        }
        Samples { times, columns: vec![("h".to_owned(), read)] }
    };
    let discovery = found(text, [1, 2].map(record));
    let own = &causes(&discovery)[0];
    is_near(own, "time", PlainKind::Clock, 1.001);
}
