//! Tests of completion and quick fixes.

use std::path::Path;

use dgd_compiler::source::LineStarts;
use serde_json::{Value, json};

use super::{Editor, address, edited, model, models};

fn labels(answer: &Value) -> Vec<String> {
    let items = answer.as_array().expect("a list").iter();
    items.filter_map(|one| Some(one["label"].as_str()?.to_owned())).collect()
}

#[test]
fn what_can_be_written_is_proposed() {
    let mut editor = Editor::new(&models(), "utf-16");
    let (path, text) = model("booster_line.dgd");
    assert_eq!(editor.open(&path, &text), json!([]));
    for (what, skip, expected) in [
        ("theta_1*q_ssp - q_tf", 0, "rho"),
        ("theta_1*q_ssp - q_tf", 0, "sqrt"),
        ("line.q_pump = q_boost", 5, "q_pump"),
        ("[m/s^2]", 1, "bar"),
        ("constant g", 3, "parameter"),
    ] {
        let position = editor.ask_at(&path, &text, what, skip);
        let completions = labels(&editor.ask("textDocument/completion", position));
        assert!(completions.iter().any(|label| label == expected), "{expected}: {completions:?}");
    }
    editor.end();
}

#[test]
fn an_effect_is_completed_word_by_word() {
    let mut editor = Editor::new(&models(), "utf-16");
    let path = models().join("effects/not saved.dgd");
    for (line, expected, not) in [
        ("effect x on ", "mud_circulation", "h_r"),
        ("effect x ", "on", "h_r"),
        ("ki", "kind", "model"),
        ("kind ", "sensor", "h_r"),
        ("null ", "wear", "h_r"),
        ("replace ", "c0", "riser"),
        ("replace ", "output", "riser"),
        ("replace output ", "p_in", "riser"),
        ("replace c0 in ", "riser", "c0"),
        ("replace c0 in riser ", "by", "c0"),
        ("replace c0 in riser by ", "q_boost", "riser"),
        ("add wear*q_boost to ", "riser", "c0"),
    ] {
        let head = if line.starts_with("effect") { "" } else { "effect x on mud_circulation\n" };
        let text = format!("{head}parameter wear [1/h] = 0\n{line}");
        let text = if head.is_empty() { line.to_owned() } else { text };
        editor.open(&path, &text);
        let position = editor.ask_at(&path, &format!("{text}\u{0}"), "\u{0}", 0);
        let completions = labels(&editor.ask("textDocument/completion", position));
        assert!(
            completions.iter().any(|label| label == expected),
            "{line}{expected}: {completions:?}"
        );
        assert!(!completions.iter().any(|label| label == not), "{line}{not}: {completions:?}");
    }
    for (line, expected) in [("import \"", "lib/"), ("part p: ", "mud_circulation")] {
        let path = models().join("not saved.dgd");
        let text = format!("model m\n{line}");
        editor.open(&path, &text);
        let position = editor.ask_at(&path, &format!("{text}\u{0}"), "\u{0}", 0);
        let completions = labels(&editor.ask("textDocument/completion", position));
        assert!(
            completions.iter().any(|label| label.starts_with(expected)),
            "{line}: {completions:?}"
        );
    }
    editor.end();
}

/// The titles of the proposals for the first error of a text, and the text after each.
fn proposals(editor: &mut Editor, path: &Path, text: &str) -> Vec<(String, String)> {
    let diagnostics = editor.open(path, text);
    let range = diagnostics[0]["range"].clone();
    let document = json!({ "uri": address(path) });
    let context = json!({ "diagnostics": [], "only": ["quickfix"] });
    let params = json!({ "textDocument": document, "range": range, "context": context });
    let actions = editor.ask("textDocument/codeAction", params);
    let titles = actions.as_array().expect("a list").iter().map(|action| {
        let title = action["title"].as_str().expect("a title").to_owned();
        let edits = &action["edit"]["changes"][address(path)];
        (title, edited(text, edits, editor.columns))
    });
    titles.collect()
}

#[test]
fn a_correction_that_is_taken_leaves_the_text_sound() {
    let mut editor = Editor::new(&models(), "utf-16");
    let path = models().join("not saved.dgd");
    let head = "model m\nconstant ρ [kg/m^3] = 1e3\nconstant A [m^2] = 2\nparameter τ [s] = 3\n\
                input q [m^3/s]\nstate h [m] = 1\nstate mass [kg] = 1\n";
    for (line, title, fixed) in [
        // A volume flow where a mass flow is meant.
        ("equation e: der(mass) = q + 2*q", "Multiply `q + 2*q` by `ρ`", "der(mass) = (q + 2*q)*ρ"),
        // A number without a unit.
        ("let x = h + 5", "Write `5 [m]`", "h + 5 [m]"),
        // A declared value of another dimension.
        ("let x [m] = A*h/A/A", "Multiply `A*h/A/A` by `A`", "= A*h/A/A*A"),
        ("let x = exp(2*τ)", "Divide `2*τ` by `τ`", "exp(2*τ/τ)"),
        ("equation der(h) = q/A", "Label it `der_h`", "equation der_h: der(h)"),
        ("let x = hh", "Write `h`", "let x = h"),
        ("let x [kkg] = 2 [kg]", "Write `kg`", "x [kg]"),
        ("let x [kgm] = 2 [kg*m]", "Write `kg*m`", "x [kg*m]"),
    ] {
        let text = format!("{head}{line}\n");
        let offered = proposals(&mut editor, &path, &text);
        let proposal = offered.iter().find(|(own, _)| own == title);
        let (_, new) =
            proposal.unwrap_or_else(|| panic!("{line}: {title} is not among {offered:?}"));
        assert!(new.contains(fixed), "{new}");
        let left = editor.open(&path, new);
        let units = |one: &Value| {
            let code = one["code"].as_str().expect("a code");
            code.starts_with("E1") || code.starts_with("E2") || code.starts_with("E3")
        };
        let wrong: Vec<&Value> =
            left.as_array().expect("a list").iter().filter(|one| units(one)).collect();
        assert!(wrong.is_empty(), "{new}{wrong:?}");
    }
    editor.end();
}

#[test]
fn a_mistake_in_another_choice_can_be_corrected() {
    let mut editor = Editor::new(&models(), "utf-16");
    let path = models().join("not saved/choices.dgd");
    let text = "model choices\nstate x [m] = 1\nvariant v {\n  a { let r = 1 [m/s] }\n  \
                b { let r = 1 [m/s] + 2 }\n}\nequation e: der(x) = r\n";
    assert_eq!(editor.open(&path, text), json!([]));
    let later = editor.wait_for(&address(&path));
    assert_eq!(later[0]["code"], "E301", "{later}");
    let place = text.find("2 }").expect("the mistake");
    let (line, character) = LineStarts::from_text(text).position(text, place, editor.columns);
    let position = json!({ "line": line, "character": character });
    let params = json!({ "textDocument": { "uri": address(&path) }, "context": { "diagnostics": [] },
                         "range": { "start": position, "end": position } });
    let actions = editor.ask("textDocument/codeAction", params);
    assert_eq!(actions[0]["title"], "Write `2 [m/s]`", "{actions}");
    editor.end();
}
