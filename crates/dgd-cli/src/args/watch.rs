//! Options of `watch`.

use clap::Args;
use dgd_work::RunRequest;

use super::DrawnArgs;
use super::values::port;

/// Arguments of `watch`.
#[derive(Debug, Args)]
pub(crate) struct WatchArgs {
    #[command(flatten)]
    pub run: DrawnArgs<RunRequest>,
    /// Port on which the page is served on this machine [default: a free one]
    #[arg(long, value_name = "N", value_parser = port, default_value_t = 0, hide_default_value = true, allow_negative_numbers = true)]
    pub port: u16,
}
