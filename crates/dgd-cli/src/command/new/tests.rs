//! Skeletons of recordings compile, whatever their columns are called and measured in.

use std::path::Path;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::diagnostics::render::{RenderStyle, render};
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{SensitivityDirections, compile};
use dgd_compiler::source::{SourceMap, SourceText};

use super::skeleton;

/// The model made from a recording, which has to compile, the recording in the project, and the remarks.
fn made(csv: &str, outputs: &[&str]) -> (String, String, Vec<String>) {
    let outputs: Vec<String> = outputs.iter().map(|name| (*name).to_owned()).collect();
    let skeleton = skeleton::build("plant", Path::new("run.csv"), csv.as_bytes(), &outputs)
        .unwrap_or_else(|error| panic!("{csv}: {error:?}"));
    let text = |name: &str| {
        let file = skeleton.files.written.iter().find(|(path, _)| path == name);
        String::from_utf8(file.expect("a file").1.clone()).expect("text")
    };
    let model = text("plant.dgd");
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let main = SourceText { name: "plant.dgd".into(), text: model.clone() };
    let options = ModelOptions::default();
    let mut read = |_: &str| Err("nothing is imported".to_owned());
    let compiled = compile(
        main,
        &options,
        &SensitivityDirections::None,
        &mut read,
        &mut sources,
        &mut diagnostics,
    );
    let shown = render(&diagnostics.sorted(), &sources, RenderStyle::Plain);
    assert!(compiled.is_ok(), "{model}\n{shown}");
    (model, text("data.csv"), skeleton.remarks)
}

#[test]
fn held_columns_are_inputs_and_the_others_outputs() {
    let csv =
        "t,u [V],i [A],w [rad/s]\n0,5,0.1,0.2\n1,5,0.3,0.5\n2,5,0.2,0.7\n3,1,0.1,0.9\n4,1,0.4,1\n";
    let (model, data, remarks) = made(csv, &[]);
    assert!(model.contains("input u [V] hold"), "{model}");
    assert!(model.contains("state i [A] = 0.1") && model.contains("state w [rad/s] = 0.2"));
    assert!(data.starts_with("time [s],u [V],i [A],w [rad/s]\n0,5,0.1"), "{data}");
    assert!(remarks[1].contains("inputs: `u`; outputs: `i`, `w`"), "{remarks:?}");
    let (model, _, _) = made(csv, &["w"]);
    assert!(model.contains("input i [A] linear") && !model.contains("state i"), "{model}");
}

#[test]
fn odd_columns_and_units_make_sound_models() {
    let csv = "# a remark\nTime [min],Motor Speed (rpm),T in [°C],p[1] [barg],note,q [m^3/h]\n\
        0,100,20.5,1.2,on,3\n1,100,20.7,1.3,off,4\n2,100,21,,off,5\n3,120,21.5,1.1,on,3\n";
    let (model, data, remarks) = made(csv, &[]);
    assert!(model.contains("input Motor_Speed_rpm [1] hold"), "{model}");
    assert!(model.contains("state T_in [°C] = 20.5") && model.contains("state p_1 [barg] = 1.2"));
    let header =
        "# a remark\ntime [min],Motor_Speed_rpm [1],T_in [°C],p_1 [barg],\"note\",q [m^3/h]\n";
    assert!(data.starts_with(header), "{data}");
    assert!(remarks.iter().any(|remark| remark.contains("left out") && remark.contains("`note`")));
}

#[test]
fn stamps_stay_and_a_single_column_is_an_output() {
    let csv =
        "time,level [m]\n2026-11-21T10:00:00Z,1\n2026-11-21T10:00:01Z,1\n2026-11-21T10:00:02Z,1\n";
    let (model, data, _) = made(csv, &[]);
    assert!(model.contains("state level [m] = 1"), "{model}");
    assert!(data.starts_with("time,level [m]\n2026-11-21T10:00:00Z"), "{data}");
}
