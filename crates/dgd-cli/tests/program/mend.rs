//! Mistakes of newcomers: messages show the corrected line, and `check --fix` writes it.

use std::fs;

use crate::support::{dgd, folder_with, path};

/// A motor written without having read the manual.
const FOREIGN: &[u8] = b"\
model motor

input u [V]
input load [N*m]

parameter R = 1.2 [ohm]  in 0.1 .. 10    /// of the winding
parameter L [mH] = 2
parameter K [N*m/A] = 0.05
parameter J [kg*m^2] = 1e-4
parameter b = 1.5e-4 [N*m*s]

state i [A] = 0
state w [rad/s] = 0

L*der(i) = u - R*i - K*w  # no label
J*w' = K*i - b*w - load

output i [A]
";

const MENDED: &str = "\
model motor

input u [V]
input load [N*m]

parameter R [ohm] = 1.2  in 0.1 .. 10    /// of the winding
parameter L [mH] = 2
parameter K [N*m/A] = 0.05
parameter J [kg*m^2] = 1e-4
parameter b [N*m*s] = 1.5e-4

state i [A] = 0
state w [rad/s] = 0

equation der_i: L*der(i) = u - R*i - K*w  # no label
equation der_w: J*der(w) = K*i - b*w - load

output i [A]
";

#[test]
fn foreign_notations_are_shown_and_written_as_they_should_stand() {
    let folder = folder_with(&[("motor.dgd", FOREIGN)]);
    let model = path(&folder, "motor.dgd");
    dgd(&["check", &model]).refused(
        1,
        &[
            "write `equation der_i: L*der(i) = u - R*i - K*w`",
            "write `equation der_w: J*der(w) = K*i - b*w - load`",
        ],
    );
    assert_eq!(fs::read(&model).expect("it is there"), FOREIGN, "only --fix writes");
    let run = dgd(&["check", &model, "--fix"]).done();
    assert!(run.err.contains("mended") && run.err.contains("is sound"), "{}", run.err);
    assert_eq!(fs::read_to_string(&model).expect("it is there"), MENDED);
}

#[test]
fn one_mistake_has_one_message() {
    let text = String::from_utf8_lossy(FOREIGN)
        .replace("L*der(i)", "equation a: L*der(i)")
        .replace("J*w'", "equation b: J*dw/dt");
    let folder = folder_with(&[("motor.dgd", text.as_bytes())]);
    let model = path(&folder, "motor.dgd");
    let run = dgd(&["check", &model, "--format", "json"]);
    let entries = run.json()["diagnostics"].as_array().expect("a list").clone();
    let helps: Vec<&str> = entries.iter().filter_map(|one| one["help"].as_str()).collect();
    assert_eq!(
        helps,
        [
            "write `parameter R [ohm] = 1.2  in 0.1 .. 10`",
            "write `parameter b [N*m*s] = 1.5e-4`",
            "write `equation b: J*der(w) = K*i - b*w - load`",
        ]
    );
    assert!(entries.iter().all(|one| one["fix"]["safe"] == true && one["fix"]["edits"].is_array()));
    dgd(&["check", &model, "--fix"]).done();
}

#[test]
fn what_is_not_clear_is_left_alone() {
    let text = b"model m\nparameter a [m] = 3 [s]\nstate x [1] = 1\nequation e: der(x) = -x*b\n";
    let folder = folder_with(&[("m.dgd", text)]);
    let model = path(&folder, "m.dgd");
    let run = dgd(&["check", &model, "--fix"]);
    run.refused(1, &["declared in `m`, but its value is in `s`", "nothing is called `b`"]);
    assert_eq!(fs::read(&model).expect("it is there"), text);
}

#[test]
fn a_torque_stays_a_torque_and_what_nothing_reads_is_noted() {
    let wrong = MENDED.replace("output i [A]", "output torque [N*m] = K*i + u");
    let unread = MENDED.replace("output i [A]", "parameter left_over [m] = 3\noutput i [A]");
    let folder = folder_with(&[("wrong.dgd", wrong.as_bytes()), ("unread.dgd", unread.as_bytes())]);
    let run = dgd(&["check", &path(&folder, "wrong.dgd")]);
    run.refused(1, &["cannot add `N*m` and `V`"]);
    assert!(!run.err.contains("`J`"), "{}", run.err);
    let run = dgd(&["check", &path(&folder, "unread.dgd")]).done();
    assert!(run.err.contains("note[E217]: nothing reads the parameter `left_over`"), "{}", run.err);
}
