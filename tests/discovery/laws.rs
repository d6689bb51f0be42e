//! Time in other units, other names, states that are a thousand times as large and items of the model in another
//! order: the same verdict and the same names.
//!
//! The whole is a program of some minutes; what runs with every change is one law for each of a few cases.

use std::path::Path;

use dgd_discover::Discovery;

use crate::drilling::{hidden, names};
use crate::drilling_rig::effects::Effect;
use crate::drilling_rig::plant::LPM;
use crate::examined::{Examined, Samples, Texts};
use crate::servo;
use crate::servo::Servo;
use crate::transformed::{LAWS, Law, Transformed};

/// A model, effects and two recordings.
struct Case {
    name: &'static str,
    texts: Texts,
    pair: [Samples; 2],
    /// States that may be scaled.
    states: &'static [&'static str],
    fix: &'static [&'static str],
    /// Whether recordings start as their first rows show.
    starts: bool,
}

impl Case {
    fn found(&self, texts: &Texts, pair: &[Samples; 2]) -> Discovery {
        let mut examined: Examined = texts.read();
        examined.base.fix = self.fix.iter().map(|name| (*name).to_owned()).collect();
        let [train, valid] = pair.each_ref().map(|samples| {
            if self.starts {
                examined.recording(samples)
            } else {
                examined.recording_without_start(samples)
            }
        });
        examined.discover(&[train], &[valid], 1)
    }

    /// The verdict and the names.
    fn said(&self, law: Option<Law>) -> (&'static str, Vec<String>) {
        let Some(law) = law else {
            let found = self.found(&self.texts, &self.pair);
            return (found.verdict.word(), names(&found).iter().map(|s| (*s).to_owned()).collect());
        };
        let other = Transformed::new(law, &self.texts, &self.pair, self.states);
        let found = self.found(&other.texts, &other.recordings);
        let mut all: Vec<String> = names(&found).iter().map(|name| other.back(name)).collect();
        all.sort();
        (found.verdict.word(), all)
    }

    #[track_caller]
    fn obeys(&self, laws: &[Law]) -> (&'static str, Vec<String>) {
        let (verdict, mut plain) = self.said(None);
        plain.sort();
        for law in laws {
            let other = self.said(Some(*law));
            assert_eq!(other, (verdict, plain.clone()), "{}: {law:?}", self.name);
        }
        (verdict, plain)
    }
}

fn a_servo(name: &'static str, hidden: Servo, seconds: usize) -> Case {
    Case {
        name,
        texts: Texts {
            model: ("servo.dgd".to_owned(), servo::MODEL.to_owned()),
            effects: Vec::new(),
        },
        pair: [hidden.record(1, seconds), hidden.record(2, seconds)],
        states: &["w", "phi"],
        fix: &[],
        starts: false,
    }
}

/// A folder of `tests/defects`: a model, its effects, and two recordings.
fn a_defect(
    folder: &'static str,
    model: &str,
    recordings: [&str; 2],
    states: &'static [&'static str],
) -> Case {
    let folder_path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/defects").join(folder);
    let read = |name: &str| {
        let path = folder_path.join(name);
        std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    };
    let mut effects: Vec<String> = std::fs::read_dir(folder_path.join("effects"))
        .map(|all| all.filter_map(|file| file.ok()?.file_name().into_string().ok()).collect())
        .unwrap_or_default();
    effects.sort();
    let effects = effects.into_iter().map(|name| {
        let path = format!("effects/{name}");
        let text = read(&path);
        (path, text)
    });
    let texts = Texts { model: (model.to_owned(), read(model)), effects: effects.collect() };
    let pair = recordings.map(|name| Samples::of_file(&folder_path.join(name)));
    Case { name: folder, texts, pair, states, fix: &[], starts: false }
}

/// Recordings at 0.1 h of a bioreactor in which too much substrate inhibits growth.
fn the_bioreactor() -> Case {
    a_defect("bioreactor", "bio.dgd", ["train.csv.gz", "valid.csv.gz"], &["X", "S"])
}

/// A tank with a heating element that burns out and a thermometer in a pocket. A temperature in °C is not a thousand
/// times as large in kelvin, and so it is not scaled.
fn the_tank() -> Case {
    a_defect("tank", "tank3.dgd", ["a.csv.gz", "b.csv.gz"], &[])
}

/// The first 100 s of a drive whose coupling has play.
fn the_drive() -> Case {
    let states = &["w1", "w2", "twist"];
    let drive = a_defect("drive", "drive.dgd", ["train.csv.gz", "valid.csv.gz"], states);
    Case { pair: drive.pair.each_ref().map(|one| one.until(100.0)), ..drive }
}

/// The first 12 s of 90 s of a motor at 100 Hz with a quadratic drag that its model lacks; its tachometer has a
/// noise of 0.50 rad/s.
fn the_motor() -> Case {
    let motor = a_defect("motor", "motor.dgd", ["long_a.csv", "long_b.csv"], &["i", "w"]);
    Case { fix: &["L"], ..motor }
}

fn drilling(name: &'static str, effects: &[Effect]) -> Case {
    let texts = Texts::of_the_repository();
    let pair = hidden(1, 22.0, effects);
    Case { name, texts, pair, states: &["h_r"], fix: &[], starts: true }
}

#[test]
fn a_drag_is_no_noise_of_a_sensor() {
    let motor = the_motor();
    let found = motor.found(&motor.texts, &motor.pair);
    assert_eq!(names(&found), ["power_loss(w, mechanical)"], "{}", found.reason);
    let speed = &found.gap[0];
    assert!((speed.noise / 0.5 - 1.0).abs() < 0.05, "{}", speed.noise);
    // Sixty readings at 100 Hz.
    let from = found.traces[1].counts_from.expect("the first readings do not count");
    assert!((from - 0.6).abs() < 1e-9, "{from}");
    assert!(speed.valid_after < 1.1 * speed.noise, "{}", speed.valid_after);
}

#[test]
fn a_servo_says_the_same_in_other_units_of_time() {
    let lag = a_servo("lag", Servo { lag: 0.4, ..Servo::default() }, 50);
    let said = lag.obeys(&[Law::Time]);
    assert_eq!(said, ("effects", vec!["sensor_lag(w)".to_owned()]));
}

#[test]
fn a_servo_says_the_same_with_larger_states() {
    let friction = a_servo("friction", Servo { friction: 1.2, ..Servo::default() }, 50);
    let said = friction.obeys(&[Law::States]);
    assert_eq!(said, ("effects", vec!["dry_friction(w, motor)".to_owned()]));
}

#[test]
fn a_motor_says_the_same_the_other_way_round() {
    the_motor().obeys(&[Law::Order]);
}

#[test]
fn a_drilling_rig_says_the_same_in_other_units_of_time() {
    let loss = drilling("mud_loss", &[Effect::MudLoss { flow: 2.5e-3, onset: 400.0 }]);
    assert_eq!(loss.obeys(&[Law::Time]), ("effects", vec!["mud_loss".to_owned()]));
}

#[test]
fn a_bioreactor_says_the_same_with_other_names() {
    let said = the_bioreactor().obeys(&[Law::Names]);
    assert_eq!(said, ("effects", vec!["haldane".to_owned()]));
}

#[test]
fn a_drive_says_the_same_with_larger_states() {
    let said = the_drive().obeys(&[Law::States]);
    assert_eq!(said, ("effects", vec!["backlash".to_owned()]));
}

#[test]
#[ignore = "some minutes: all laws on all cases"]
fn all_say_the_same() {
    let u_tubing = Effect::BoosterUTubing { inertia: 4e7, friction: 6.3e7 };
    let loss = Effect::MudLoss { flow: 2.5e-3, onset: 400.0 };
    let offset = Effect::FlowMeterOffset { flow: 100.0 * LPM };
    let mut cases = vec![
        the_motor(),
        a_servo("nothing", Servo::default(), 50),
        a_servo("coloured", Servo { memory: Some(0.5), ..Servo::default() }, 50),
        a_servo("lag", Servo { lag: 0.4, ..Servo::default() }, 50),
        a_servo("friction", Servo { friction: 1.2, ..Servo::default() }, 50),
        a_servo("dead band", Servo { dead_band: 0.2, ..Servo::default() }, 50),
        drilling("nothing", &[]),
        drilling("u_tubing", &[u_tubing]),
        drilling("mud_loss", &[loss]),
        drilling("flow_meter_offset", &[offset]),
        drilling("mud_loss and flow_meter_offset", &[loss, offset]),
    ];
    for (seed, name) in [
        (31, "clock_shift"),
        (32, "density_change"),
        (33, "top_fill_gain"),
        (34, "pump_speed_exponent"),
        (35, "pump_speed_lag"),
        (36, "return_line_plugging"),
        (37, "pressure_sensor_drift"),
        (38, "well_influx"),
    ] {
        let scenario =
            crate::drilling_rig::Scenario::drawn(seed, 40.0, &[name]).expect("an effect");
        let pair = crate::drilling_rig::record(&scenario);
        let pair = [&pair.train, &pair.valid].map(|one| Samples::of_csv(&one.csv()));
        cases.push(Case { name, pair, ..drilling(name, &[]) });
    }
    all_obey(&cases);
}

#[test]
#[ignore = "a minute: all laws on the slow defects"]
fn defects_say_the_same() {
    all_obey(&[the_bioreactor(), the_tank(), the_drive()]);
}

fn all_obey(cases: &[Case]) {
    let mut broken = Vec::new();
    for case in cases {
        let (verdict, mut plain) = case.said(None);
        plain.sort();
        println!("{}: {verdict} {plain:?}", case.name);
        let laws = LAWS.iter().filter(|law| **law != Law::States || !case.states.is_empty());
        for &law in laws {
            let other = case.said(Some(law));
            if other != (verdict, plain.clone()) {
                broken.push(format!("{} {law:?}: {other:?}, not {verdict} {plain:?}", case.name));
            }
        }
    }
    assert!(broken.is_empty(), "{broken:#?}");
}
