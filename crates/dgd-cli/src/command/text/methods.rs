//! `dgd methods`: the integration methods.

use std::fmt::Write;

use dgd_runtime::METHODS;
use dgd_runtime::integrate::catalogue::{AUTOMATIC, DEFAULT, MOST_FOR_DEFAULT};
use serde_json::{Value, json};

use crate::console::Console;
use crate::failure::CommandError;

pub(crate) fn run(console: Console<'_>) -> Result<(), CommandError> {
    if console.writes_json() {
        let methods: Vec<Value> = METHODS
            .iter()
            .map(|m| {
                json!({ "name": m.name, "order": m.order, "about": m.description, "source": m.source })
            })
            .collect();
        return console.json(&json!({ "methods": methods }));
    }
    let mut text = String::new();
    for method in METHODS {
        let (name, order, about) = (method.name, method.order, method.description);
        let _ = writeln!(text, "{name:<12} order {order}  {about}\n{:21}{}", "", method.source);
    }
    let _ = writeln!(
        text,
        "{AUTOMATIC:<12} {}; bdf for more than {MOST_FOR_DEFAULT} unknowns, none of them algebraic, and no band",
        DEFAULT.name
    );
    console.result(&text)
}
