//! `dgd explain`: explains a diagnostic at length.

use dgd_compiler::diagnostics::Code;
use dgd_compiler::diagnostics::codes::CODES;
use serde_json::json;

use crate::args::ExplainArgs;
use crate::console::Console;
use crate::failure::CommandError;

pub(crate) fn run(args: &ExplainArgs, console: Console<'_>) -> Result<(), CommandError> {
    let Some(code) = Code::from_text(&args.code) else {
        let (first, last) = (CODES[0].code, CODES[CODES.len() - 1].code);
        return Err(CommandError::Usage(format!(
            "there is no code `{}`; codes go from {first} to {last}, as in `dgd explain E301`",
            args.code
        )));
    };
    let info = code.info();
    if console.writes_json() {
        return console.json(&json!({
            "code": code.to_string(),
            "title": info.title,
            "explanation": info.explanation.trim(),
        }));
    }
    console.result(&format!("{code}: {}\n\n{}\n", info.title, info.explanation.trim()))
}
