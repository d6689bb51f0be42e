//! `dgd watch`: serves a page on this machine that is redrawn on every save.

use crate::args::WatchArgs;
use crate::console::Console;
use crate::failure::CommandError;

/// Serves until it is ended by Ctrl-C or with its terminal.
#[cfg(feature = "watch")]
pub(crate) fn run(args: &WatchArgs, console: Console<'_>) -> Result<(), CommandError> {
    use serde_json::json;

    use crate::console::print;

    if !args.run.plot.is_empty() {
        let why = "`--plot` writes a picture once; `dgd watch` draws a page again and again. Leave it out, or use `dgd simulate`";
        return Err(CommandError::Usage(why.to_owned()));
    }
    let files = [Some(&args.run.request.model), args.run.request.data.as_ref()];
    if let Some(missing) = files.into_iter().flatten().find(|path| !path.is_file()) {
        let why = format!("`{}` is not a file that could be watched", missing.display());
        return Err(CommandError::Found(why));
    }
    let mut printed = Ok(());
    let tell = |address: &str| {
        printed = if console.is_json() {
            print(&format!("{}\n", json!({ "address": address })))
        } else {
            print(&format!("{address}\n"))
        };
        console.remark("open this address in a browser; Ctrl-C ends it");
    };
    let served = dgd_watch::server::serve(args.run.request.clone(), args.port, tell);
    printed?;
    served.map_err(|error| {
        CommandError::Found(format!("cannot serve on port {} of this machine: {error}", args.port))
    })
}

/// Refuses: this build has no server.
#[cfg(not(feature = "watch"))]
pub(crate) fn run(_: &WatchArgs, _: Console<'_>) -> Result<(), CommandError> {
    Err(CommandError::not_built("`watch`", "`dgd simulate --plot` draws a picture once"))
}
