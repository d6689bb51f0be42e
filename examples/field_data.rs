//! The recordings in `examples/data/field/`, which stand in for the field data of Haukanes 2015.
//!
//! ```text
//! cargo run --release --example field_data [-- DIR]
//! ```
//!
//! writes for each recording `NAME.csv.gz` with the readings and `NAME.truth.csv.gz` with the true values, and
//! `truth.json` with every number behind them; into `examples/data/field` unless DIR is given.
//! Every run writes the same bytes. `examples/data/field/README.md` describes the recordings.

mod drilling_rig;
mod field_rig;

use std::error::Error;
use std::fs;
use std::path::PathBuf;

use dgd_data::write::save;

use field_rig::{files::truth_json, schedule::schedules};

fn main() -> Result<(), Box<dyn Error>> {
    let folder =
        PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "examples/data/field".into()));
    fs::create_dir_all(&folder)?;
    for schedule in schedules() {
        let recording = schedule.rig().record(&schedule);
        let name = schedule.name;
        for (file, text) in [
            (format!("{name}.csv.gz"), recording.csv()),
            (format!("{name}.truth.csv.gz"), recording.truth_csv()),
        ] {
            save(&folder.join(&file), |out| out.write_all(text.as_bytes()))?;
            println!("{file}");
        }
    }
    fs::write(folder.join("truth.json"), truth_json(&schedules()))?;
    println!("truth.json");
    Ok(())
}
