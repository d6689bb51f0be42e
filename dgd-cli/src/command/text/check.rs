//! `dgd check`: syntax, names, units and structure, in every variant.

use dgd_work::{CheckRequest, Checked, Ended, check};

use crate::args::CheckArgs;
use crate::console::Console;
use crate::failure::CommandError;
use crate::tail::{Printed, Saved, Shown, finish};

pub(crate) fn run(args: &CheckArgs, console: Console<'_>) -> Result<(), CommandError> {
    let mut request = CheckRequest::new(&args.model);
    request.choices = args.choices.request();
    let checked = check(&request, console.session())?;
    let summary = checked.summary();
    let json = checked.to_json();
    let shown = Shown::new(Ended::Done);
    // A sentence without a result, on standard error.
    let is_remark = matches!(checked, Checked::Effect { .. })
        || console.out().is_none() && !console.writes_json();
    let shown = if is_remark {
        Shown { saved: Saved::Nothing, closing: Some(summary), ..shown }
    } else {
        Shown { json, printed: Printed::Text(summary), ..shown }
    };
    finish(shown, console)
}
