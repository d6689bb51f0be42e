//! Effects that were hidden in recordings of a drilling rig are found by name, and nothing is found
//! where nothing was hidden.
//!
//! The rig is the independent simulator of `examples/drilling_rig`; a discovery sees nothing of it
//! but recordings. They are as short as leaves every effect time to show.

use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::syntax::layout;
use dgd_discover::{Discovery, Verdict};
use dgd_identify::Recording;
use dgd_runtime::{Options, Problem, System, observe, simulate};

use crate::drilling_rig::effects::Effect;
use crate::drilling_rig::plant::LPM;
use crate::drilling_rig::{Pair, Scenario, record};
use crate::examined;
use crate::examined::{Examined, Samples, Texts, start};
use crate::renaming;
use crate::renaming::Renaming;

const MINUTES: f64 = 22.0;
const SEED: u64 = 1;

/// How long after their stamps the instruments of the rig are read, s. To a model whose outputs are
/// read at the stamp, what is late is late by so much less.
const SCAN: f64 = 0.1;

const U_TUBING: Effect = Effect::BoosterUTubing { inertia: 4e7, friction: 6.3e7 };

/// Two recordings of a rig with some effects hidden in it.
pub(crate) fn hidden(seed: u64, minutes: f64, effects: &[Effect]) -> [Samples; 2] {
    let Pair { train, valid, .. } = record(&Scenario::new(seed, minutes, effects.to_vec()));
    [Samples::of_csv(&train.csv()), Samples::of_csv(&valid.csv())]
}

/// What is found in one recording, with another held out.
fn found_in(examined: &Examined, pair: &[Samples; 2], threads: usize) -> Discovery {
    let [train, valid] = pair.each_ref().map(|samples| examined.recording(samples));
    examined.discover(&[train], &[valid], threads)
}

fn found(examined: &Examined, effects: &[Effect]) -> Discovery {
    found_in(examined, &hidden(SEED, MINUTES, effects), 1)
}

/// What is found, by one thread, where one effect is hidden: once for all tests that look at it.
fn found_alone(effect: Effect) -> Arc<Discovery> {
    type Found = Arc<OnceLock<Arc<Discovery>>>;
    static ALL: Mutex<Vec<(Effect, Found)>> = Mutex::new(Vec::new());
    let own = {
        let mut all = ALL.lock().unwrap_or_else(PoisonError::into_inner);
        if !all.iter().any(|(other, _)| *other == effect) {
            all.push((effect, Found::default()));
        }
        let own = all.iter().find(|(other, _)| *other == effect);
        own.map(|(_, found)| found.clone()).expect("it is among them")
    };
    own.get_or_init(|| Arc::new(found(&Texts::of_the_repository().read(), &[effect]))).clone()
}

pub(crate) fn names(discovery: &Discovery) -> Vec<&str> {
    discovery.effects.iter().map(|effect| effect.name.as_str()).collect()
}

/// The corrected model predicts validation data nearly to the noise.
///
/// Over 1200 samples the root mean square of noise alone is known to 2 %, its estimate likewise, and
/// start values are known from a minute only.
#[track_caller]
fn predicts_to_the_noise(discovery: &Discovery) {
    assert_eq!(discovery.gap.len(), 4);
    for gap in &discovery.gap {
        let ratio = gap.valid_after / gap.noise;
        assert!(ratio < 1.2, "{}: {ratio}", gap.output);
    }
}

/// An effect hidden alone is what is found, with its own size.
///
/// `expected` has SI values of the parameters as the library defines them. They are to be within
/// four standard deviations, and `beyond`: what the rig has and the effect's file leaves out.
#[track_caller]
fn is_found(effect: Effect, expected: &[(&str, f64)], beyond: f64) {
    let discovery = found_alone(effect);
    assert_eq!(discovery.verdict, Verdict::Effects, "{}", discovery.reason);
    assert_eq!(names(&discovery), [effect.name()], "{}", discovery.reason);
    let found = &discovery.effects[0];

    let found_names: Vec<&str> = found.parameters.iter().map(|p| p.name.as_str()).collect();
    let expected_names: Vec<&str> = expected.iter().map(|(name, _)| *name).collect();
    assert_eq!(found_names, expected_names);
    for (parameter, (name, truth)) in found.parameters.iter().zip(expected) {
        let std = parameter.std.expect("the data determines it");
        let error = (parameter.value - truth).abs();
        assert!(error < 4.0 * std + beyond, "{name} = {} ± {std}, not {truth}", parameter.value);
        assert!(std < 0.05 * truth.abs(), "{name} is known to {std} only");
    }
    match (found.onset, effect.onset()) {
        (Some(found), Some(truth)) => assert!((found - truth).abs() < 60.0, "{found} {truth}"),
        (found, truth) => assert_eq!(found, truth),
    }
    predicts_to_the_noise(&discovery);
}

#[test]
fn a_draining_booster_line_is_found() {
    // The inertia of the column is that of a full line in the effect's file: a line emptied to 50 m
    // of its 340 m has 15 % less, of a term that is a tenth of the friction.
    is_found(U_TUBING, &[("F_b", 6.3e7)], 0.015 * 6.3e7);
}

#[test]
fn wrong_factors_are_found() {
    // The rig's factor is of the true flow, the effect's of the reading.
    is_found(Effect::FlowMeterGain { theta: 0.93 }, &[("flow_gain", 1.0 / 0.93)], 0.0);
    is_found(Effect::BoosterFlowGain { gain: 1.07 }, &[("booster_gain", 1.07)], 0.0);
}

#[test]
fn shifted_zeros_are_found() {
    let flow = 100.0 * LPM;
    is_found(Effect::FlowMeterOffset { flow }, &[("flow_offset", flow)], 0.0);
    let pressure = 0.35e5;
    is_found(Effect::PressureSensorOffset { pressure }, &[("offset_p_r", pressure)], 0.0);
}

#[test]
fn what_is_late_is_found() {
    is_found(Effect::FlowMeterDelay { delay: 20.0 }, &[("flow_delay", 20.0 - SCAN)], 0.0);
    // To first order, a lag is a delay.
    is_found(Effect::PumpSpeedLag { lag: 14.0 }, &[("tau_speed", 14.0 - SCAN)], 0.0);
}

#[test]
fn unmeasured_flows_and_their_onsets_are_found() {
    let (flow, onset) = (2.5e-3, 400.0);
    let influx = [("q_influx", flow), ("t_influx", onset - SCAN)];
    is_found(Effect::WellInflux { flow, onset }, &influx, 0.0);
    let loss = [("q_loss", flow), ("t_loss", onset - SCAN)];
    is_found(Effect::MudLoss { flow, onset }, &loss, 0.0);
}

#[test]
fn another_pump_curve_is_found() {
    is_found(Effect::PumpSpeedExponent { exponent: 2.5 }, &[("speed_exponent", 2.5)], 0.0);
}

#[test]
fn an_effect_brings_no_second_that_noise_suggests() {
    // A recording in whose noise a pressure offset of three standard deviations can be seen.
    let examined = Texts::of_the_repository().read();
    let pair = hidden(2, MINUTES, &[Effect::PumpSpeedExponent { exponent: 2.5 }]);
    let discovery = found_in(&examined, &pair, 1);
    assert_eq!(names(&discovery), ["pump_speed_exponent"], "{}", discovery.reason);
}

#[test]
fn an_effect_that_cannot_be_applied_is_said_to_be_one() {
    let mut texts = Texts::of_the_repository().without("pump_speed_lag");
    let wrong = "effect rain on mud_circulation\nkind plant\nparameter rain [m] = 0\nnull rain = 0\n\
                 add rain to riser\n";
    texts.effects.push(("effects/rain.dgd".to_owned(), wrong.to_owned()));
    let discovery = found(&texts.read(), &[Effect::FlowMeterGain { theta: 0.95 }]);
    assert_eq!(names(&discovery), ["flow_meter_gain"], "{}", discovery.reason);
    let refused = discovery.ranking.iter().find(|ranked| ranked.effects == ["rain"]);
    let refused = refused.expect("it is in the ranking");
    assert!(refused.note.starts_with("cannot be applied: "), "{}", refused.note);
    assert_eq!(discovery.left_out, [("rain".to_owned(), refused.note.clone())]);
}

#[test]
fn two_effects_together_are_found() {
    let theta = 0.93;
    let both = [U_TUBING, Effect::FlowMeterGain { theta }];
    let discovery = found(&Texts::of_the_repository().read(), &both);
    assert_eq!(discovery.verdict, Verdict::Effects);
    let mut names = names(&discovery);
    names.sort_unstable();
    assert_eq!(names, ["booster_u_tubing", "flow_meter_gain"], "{}", discovery.reason);
    predicts_to_the_noise(&discovery);
}

#[test]
fn nothing_is_found_where_nothing_is_hidden() {
    let examined = Texts::of_the_repository().read();
    for seed in 1..=3 {
        let discovery = found_in(&examined, &hidden(seed, MINUTES, &[]), 1);
        assert_eq!(discovery.verdict, Verdict::Sufficient, "{seed}: {}", discovery.reason);
        assert!(discovery.effects.is_empty() && discovery.unexplained.is_empty());
        predicts_to_the_noise(&discovery);
    }
}

/// What is found with effects of drawn sizes, by sensors with coloured noise if it is to be hard.
fn found_drawn(seed: u64, names: &[&str], is_hard: bool) -> Discovery {
    let scenario = Scenario::drawn(seed, 40.0, names).expect("known effects");
    let pair = record(&if is_hard { scenario.hardened() } else { scenario });
    let pair = [&pair.train, &pair.valid].map(|recording| Samples::of_csv(&recording.csv()));
    found_in(&Texts::of_the_repository().read(), &pair, 2)
}

#[test]
fn effects_of_other_sizes_are_found() {
    for (seed, name) in [(31, "clock_shift"), (32, "density_change"), (33, "top_fill_gain")] {
        let discovery = found_drawn(seed, &[name], false);
        assert_eq!(names(&discovery), [name], "{}", discovery.reason);
        predicts_to_the_noise(&discovery);
    }
}

#[test]
fn a_plainer_form_comes_before_one_with_a_parameter_at_its_bound() {
    // The booster line of the rig has no weight of the pump's flow: in the form that has one it ends at 1.
    let discovery = found_drawn(3, &["booster_u_tubing", "pump_speed_lag"], false);
    assert_eq!(names(&discovery), ["booster_u_tubing", "pump_speed_lag"], "{}", discovery.reason);
    assert_eq!(discovery.effects[0].form.as_deref(), Some("column_with_momentum"));
    predicts_to_the_noise(&discovery);
}

#[test]
fn coloured_noise_is_no_effect_and_hides_none() {
    let discovery = found_drawn(41, &[], true);
    assert_eq!(discovery.verdict, Verdict::Sufficient, "{}", discovery.reason);
    predicts_to_the_noise(&discovery);
    for gap in &discovery.gap {
        // White noise and as much coloured noise, a time constant's worth of which is one value: known to
        // some per cent.
        let white = match gap.output.as_str() {
            "p_r" => 800.0,
            "q_ssp" => 14.0 * LPM,
            _ => 1e3,
        };
        let ratio = gap.noise / (2.0_f64.sqrt() * white);
        assert!((0.9..1.15).contains(&ratio), "{}: {ratio}", gap.output);
    }
    for (seed, name) in [(42, "flow_meter_gain"), (43, "mud_loss")] {
        let discovery = found_drawn(seed, &[name], true);
        assert_eq!(names(&discovery), [name], "{}", discovery.reason);
        predicts_to_the_noise(&discovery);
    }
}

#[track_caller]
fn has_no_name(discovery: &Discovery) {
    assert_eq!(discovery.verdict, Verdict::Unexplained, "{:?}", names(discovery));
    assert!(discovery.effects.is_empty());
    let Some(left_over) = discovery.unexplained.first() else {
        panic!("the place that lacks most is named")
    };
    assert!(!left_over.windows.is_empty() && !left_over.description.is_empty());
    // Where nothing has a name, nothing is corrected.
    for gap in &discovery.gap {
        assert_eq!(gap.train_before.to_bits(), gap.train_after.to_bits(), "{}", gap.output);
    }
}

#[test]
fn what_no_library_knows_is_given_no_name() {
    // A valve in the return line that somebody half shut for a while: nothing in the library.
    let valve = Effect::HalfShutValve { share: 0.3, shuts: 250.0, opens: 500.0 };
    let pair = hidden(SEED, 14.0, &[valve]);
    has_no_name(&found_in(&Texts::of_the_repository().read(), &pair, 2));
}

#[test]
fn a_loss_that_ends_is_no_loss_with_an_influx() {
    // The two together, from two moments on, are as good as the truth, and both are wrong.
    let loss = Effect::PassingLoss { flow: 2.5e-3, begins: 300.0, ends: 600.0 };
    let mut examined = Texts::of_the_repository().read();
    examined.templates.clear();
    let discovery = found(&examined, &[loss]);
    assert_eq!(discovery.verdict, Verdict::Unexplained, "{:?}", names(&discovery));
    assert!(discovery.effects.is_empty(), "{:?}", names(&discovery));
    assert!(discovery.reason.contains("largely cancels"), "{}", discovery.reason);
    let pair = discovery.ranking.iter().find(|r| r.effects == ["mud_loss", "well_influx"]);
    let pair = pair.expect("it was tried");
    assert!(pair.train < 1.1 && pair.note.contains("largely cancels"), "{pair:?}");
}

#[test]
fn an_effect_that_the_library_lacks_is_given_no_other_name() {
    let examined = Texts::of_the_repository().without("booster_u_tubing").read();
    has_no_name(&found_in(&examined, &hidden(SEED, MINUTES, &[U_TUBING]), 2));
}

#[test]
fn names_are_of_no_account() {
    let texts = Texts::of_the_repository();
    let all = texts.effects.iter().chain([&texts.model]);
    let renaming = Renaming::of(all.map(|(_, text)| text.as_str()));
    let renamed = texts.map(&|text| renaming.forth(text));
    let loss = Effect::MudLoss { flow: 2.5e-3, onset: 400.0 };
    let renamed_pair = hidden(SEED, MINUTES, &[loss]).map(|samples| Samples {
        columns: samples.columns.into_iter().map(|(n, v)| (renaming.forth(&n), v)).collect(),
        ..samples
    });

    let plain = found_alone(loss);
    let renamed = found_in(&renamed.read(), &renamed_pair, 1);
    assert_eq!(names(&plain), ["mud_loss"]);
    assert_eq!(names(&renamed), [renaming.forth("mud_loss")]);
    let shown = format!("{renamed:?}");
    for old in renaming.old_names().filter(|name| name.contains('_')) {
        assert!(!renaming::words(&shown).any(|word| word == old), "{old} is still there");
    }

    // Every number is the same to the last bit, every list in the same order.
    assert_eq!(renaming.back(&renamed.corrected), plain.corrected);
    assert_eq!(renaming.back(&shown), format!("{plain:?}"));
}

#[test]
fn threads_are_of_no_account() {
    let examined = Texts::of_the_repository().read();
    let offset = Effect::FlowMeterOffset { flow: 100.0 * LPM };
    let three = found_in(&examined, &hidden(SEED, MINUTES, &[offset]), 3);
    assert_eq!(format!("{:?}", found_alone(offset)), format!("{three:?}"));
}

#[test]
fn the_corrected_model_stands_by_itself() {
    let texts = Texts::of_the_repository();
    let pair = hidden(SEED, MINUTES, &[U_TUBING]);
    let discovery = found_alone(U_TUBING);
    let corrected = Texts { model: (texts.model.0.clone(), discovery.corrected.clone()), ..texts };
    let examined = corrected.read();

    let source = examined.base.asts[0].source;
    let laid_out = layout::format(source, &examined.sources, &mut Diagnostics::default());
    assert_eq!(laid_out.as_ref(), Ok(&discovery.corrected));

    // It does what the fitted model does, from the same start. Its parameters have nine digits and
    // both are integrated to 1e-6, of 30 bar: a few per cent of the noise.
    let system = examined.system();
    let recording: Recording = examined.recording(&pair[0]);
    let trace = &discovery.traces[0];
    assert!(!trace.held_out);
    let p = examined::declared(system.signature());
    let first: Vec<f64> = trace.outputs.iter().map(|output| output.after[0]).collect();
    let start = start(&system, &p, &recording.inputs, &first);
    let problem = Problem { system: &system, p: &p, inputs: &recording.inputs, start: &start };
    let options = Options { rtol: 1e-6, atol: 1e-6, ..Options::default() };
    let solution = simulate(&problem, &recording.times, &options).expect("a run");
    let simulated = observe(&problem, &solution);
    for (i, output) in trace.outputs.iter().enumerate() {
        let gaps = output.after.iter().enumerate().map(|(k, w)| (w - simulated.w(k)[i]).abs());
        let largest = gaps.fold(0.0, f64::max);
        assert!(largest < 0.03 * output.noise, "{}: {largest}", output.name);
    }

    // With the same data, nothing is missing from it.
    let again = found_in(&examined, &pair, 1);
    assert_eq!(again.verdict, Verdict::Sufficient, "{}", again.reason);
    predicts_to_the_noise(&again);
}

#[test]
fn long_recordings_of_other_rigs_are_seen_through() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/hidden_effects");
    if !folder.is_dir() {
        println!("skipped: there are no recordings in {}", folder.display());
        return;
    }
    let examined = Texts::of_the_repository().read();
    let cases: [(&str, &[&str]); 2] =
        [("case007", &[]), ("case019", &["booster_u_tubing", "flow_meter_gain"])];
    for (case, expected) in cases {
        let pair = ["train", "valid"].map(|part| {
            let path = folder.join(format!("{case}.{part}.csv"));
            Samples::of_csv(&std::fs::read_to_string(path).expect("a recording"))
        });
        let discovery = found_in(&examined, &pair, 2);
        let mut names = names(&discovery);
        names.sort_unstable();
        assert_eq!(names, expected, "{case}: {}", discovery.reason);
        assert_eq!(discovery.verdict == Verdict::Sufficient, expected.is_empty(), "{case}");
        predicts_to_the_noise(&discovery);
    }
}
