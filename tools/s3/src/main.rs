//! The `dgd` command with support for job results in buckets: `--into s3://bucket/folder`.

mod bucket;

use std::process::ExitCode;

fn main() -> ExitCode {
    dgd_job::set_opens(bucket::open);
    dgd_cli::run()
}
