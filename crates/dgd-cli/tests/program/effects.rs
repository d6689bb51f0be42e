//! Effects on the command line: `--apply`, and `dgd check` of an effect file.

use std::fs;

use serde_json::Value;

use crate::support::{column, dgd, folder_with, path, root};

const MODEL: &str = "models/mud_circulation.dgd";
const DATA: &str = "examples/data/booster_stop.train.csv";
const U_TUBING: &str = "booster_u_tubing/column_with_momentum";

/// Runs a command on the model with data of its first 700 s, in which the booster line drains.
fn simulated(more: &[&str]) -> String {
    let args = ["simulate", MODEL, "--data", DATA, "--until", "700"];
    dgd(&[&args, more].concat()).done().out
}

#[test]
fn an_effect_by_name_by_form_and_by_file_is_the_same() {
    let by_form = simulated(&["--apply", U_TUBING]);
    // The line is full while the pump runs, and drains when it stops.
    let level = column(&by_form, "h_b [m]");
    assert_eq!(level[380], 0.0);
    assert!(level[450] > 5.0, "{}", level[450]);

    assert_eq!(by_form, simulated(&["--apply", &format!("models/effects/{U_TUBING}.dgd")]));
    assert_ne!(column(&by_form, "q_ssp [lpm]"), column(&simulated(&[]), "q_ssp [lpm]"));

    let by_name = simulated(&["--apply", "pump_speed_lag"]);
    assert_eq!(by_name, simulated(&["--apply", "models/effects/pump_speed_lag.dgd"]));
    assert_ne!(column(&by_name, "q_ssp [lpm]"), column(&simulated(&[]), "q_ssp [lpm]"));
}

#[test]
fn the_text_of_a_model_with_an_effect_is_that_model() {
    let folder = folder_with(&[]);
    let with = ["--apply", U_TUBING, "--apply", "pressure_sensor_offset(p_in)"];
    let set = ["--set", "offset_p_in=0.2", "--set", "F_b=7e7"];
    let written = path(&folder, "written.dgd");
    let emitted = dgd(&[&["emit", MODEL, "--stage", "ast"][..], &with].concat()).done().out;
    fs::write(&written, emitted).expect("the folder is writable");
    dgd(&["check", &written]).done();
    dgd(&["fmt", "--check", &written]).done();

    let args = ["simulate", &written, "--data", DATA, "--until", "700"];
    let by_itself = dgd(&[&args[..], &set].concat()).done().out;
    assert_eq!(by_itself, simulated(&[with, set].concat()));
}

#[test]
fn stages_show_what_an_effect_brings() {
    let more = ["--apply", U_TUBING, "--stage"];
    let shown = |stage: &str| dgd(&[&["emit", MODEL][..], &more, &[stage]].concat()).done().out;
    let model = shown("model");
    assert!(model.contains("equation riser: A_r*der(h_r) = q_ssp - q_bo - q_tf"), "{model}");
    assert!(model.contains("modes booster_line, starts in full"), "{model}");
    for stage in ["dae", "program", "rust", "latex"] {
        assert!(shown(stage).contains("F_b") || shown(stage).contains("F_{b}"), "{stage}");
    }
}

#[test]
fn a_fit_estimates_what_an_effect_brings() {
    let folder = folder_with(&[]);
    let goal = path(&folder, "fitted");
    let args = ["fit", MODEL, "--data", DATA, "--until", "700", "--start", "measured"];
    let more = ["--apply", U_TUBING, "-o", &goal];
    dgd(&[&args[..], &more].concat()).done();
    let result = fs::read_to_string(format!("{goal}/result.json")).expect("a result");
    let result: Value = serde_json::from_str(&result).expect("JSON");
    let friction = result["parameters"]["F_b"]["value"].as_f64().expect("a number");
    // The true value, with an inertia of the line that differs by 20 % from the effect's.
    assert!((friction / 6.8148e7 - 1.0).abs() < 0.05, "{friction}");

    // The fitted model contains the effect and needs no library.
    let fitted = format!("{goal}/mud_circulation.dgd");
    let again = dgd(&["simulate", &fitted, "--data", DATA, "--until", "700"]).done().out;
    assert!(column(&again, "h_b [m]")[450] > 5.0);
}

#[test]
fn an_effect_that_cannot_be_applied_is_explained() {
    let apply = |effect: &str| dgd(&["simulate", MODEL, "--data", DATA, "--apply", effect]);
    apply("booster_u_tubin")
        .refused(1, &["no effect `booster_u_tubin`", "did you mean `booster_u_tubing`?"]);
    apply("booster_u_tubing/colum")
        .refused(1, &["no effect", "did you mean `booster_u_tubing/column_with_momentum`?"]);
    apply("ghost").refused(1, &["no effect `ghost` in `models/effects`", "`well_influx`"]);
    apply("ghost.dgd").refused(1, &["cannot read `ghost.dgd`"]);
    apply("pressure_sensor_offset").refused(1, &["E212", "1 argument, not 0"]);
    apply("pressure_sensor_offset(p_x)").refused(1, &["E212", "did you mean `p_r`?"]);
    apply("pressure_sensor_offset(q_ssp)").refused(1, &["q_ssp", "Pa"]);
    for malformed in ["mud_loss(", "mud_loss(a", "mud_loss()", "mud_loss(a,)", "mud_loss((a))"] {
        apply(malformed).refused(2, &["EFFECT(NAME, …)"]);
    }
    let file = "models/effects/well_influx.dgd";
    dgd(&["simulate", "models/tank_with_weir.dgd", "--until", "1", "--apply", file])
        .refused(1, &["well_influx.dgd:2", "mud_circulation"]);
}

#[test]
fn a_family_of_several_forms_wants_one_named() {
    let model = "model tank\n\nstate h [m] = 1\n\nequation level: der(h) = 0 [m/s]\n";
    let form = |name: &str, flow: &str| {
        format!(
            "effect leak on tank\nkind plant\nform {name}\n\nparameter v [m/s] = 1  in 0 ..\n\
             null v = 0\n\nadd -v*{flow} to level\n"
        )
    };
    let folder = folder_with(&[("tank.dgd", model.as_bytes())]);
    let forms = folder.path().join("effects/leak");
    fs::create_dir_all(&forms).expect("the folder is writable");
    for (name, flow) in [("slow", "1"), ("fast", "2")] {
        let text = form(name, flow);
        fs::write(forms.join(format!("{name}.dgd")), text).expect("the folder is writable");
    }
    let tank = path(&folder, "tank.dgd");
    let level = |more: &[&str]| {
        let args = ["simulate", &tank, "--until", "1"];
        dgd(&[&args[..], more].concat())
    };
    level(&["--apply", "leak"]).refused(1, &["several forms", "leak/fast", "leak/slow"]);
    // Constant slopes: every method is exact up to rounding.
    for (form, end) in [("slow", 0.0), ("fast", -1.0)] {
        let out = level(&["--apply", &format!("leak/{form}")]).done().out;
        let h = *column(&out, "h [m]").last().expect("rows");
        assert!((h - end).abs() < 1e-9, "{form}: {h}");
    }
    // The only form of a family need not be named.
    fs::remove_file(forms.join("fast.dgd")).expect("the file is there");
    let alone = level(&["--apply", "leak"]).done().out;
    assert_eq!(alone, level(&["--apply", "leak/slow"]).done().out);
}

#[test]
fn the_file_of_an_effect_is_checked_with_its_model() {
    let check = |file: &str| dgd(&["check", file]);
    let with_model = check("models/effects/booster_u_tubing/column_with_momentum.dgd").done();
    assert!(with_model.err.contains("modes booster_line"), "{}", with_model.err);
    let alone = check("models/effects/pressure_sensor_offset.dgd").done();
    assert!(alone.err.contains("sound by itself"), "{}", alone.err);

    // The effect adds a flow to a level, which is an error.
    let model = fs::read(root().join(MODEL)).expect("the model");
    let wrong = b"effect leak on mud_circulation\nkind plant\n\nparameter leak_level [m] = 0\n\
                  null leak_level = 0\n\nadd leak_level to riser\n";
    let broken = b"effect leak on mud_circulation\nkind plant\n\nadd k k to riser\n";
    for (text, parts) in [
        (wrong.as_slice(), ["E301", "leak.dgd:7", "m^3/s"]),
        (broken.as_slice(), ["E105", "leak.dgd:4", "to"]),
    ] {
        let folder = folder_with(&[("mud_circulation.dgd", &model)]);
        fs::create_dir(folder.path().join("effects")).expect("the folder is writable");
        let file = path(&folder, "effects/leak.dgd");
        fs::write(&file, text).expect("the folder is writable");
        check(&file).refused(1, &parts);
    }
}
