//! Chapters 3 and 4 of Haukanes 2015, from recordings.
//!
//! ```text
//! cargo run --release --example thesis [-- DIR]
//! ```
//!
//! identifies the thesis' parameters from the recordings in `data/`, one after the other as the thesis
//! does, and draws its data figures (3.1, 3.3–3.12, 3.14–3.24, 4.1, 4.2, B.1) into `thesis`, unless said
//! otherwise, with an index: beside each picture what the thesis found and what is found here. It ends
//! with an error where a finding of the thesis does not come out.

mod booster;
mod field;

mod friction;
mod inertia;
mod model;
mod page;
mod pump;
mod sensitivity;
mod sensors;
mod verification;

use std::error::Error;
use std::path::PathBuf;

/// What may fail, and says why.
pub(crate) type Fallible<T> = Result<T, Box<dyn Error>>;

fn main() -> Fallible<()> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "thesis".into()));
    let pump_tests = field::Field::read("pump_tests")?;
    let circulation = field::Field::read("normal_circulation")?;
    let ramps = field::Field::read("booster_ramps")?;

    let (friction_section, friction) = friction::identify(&pump_tests)?;
    let (pump_section, pump) = pump::identify(&pump_tests, &circulation, &friction)?;
    let theta_1 = 0.951;
    let (booster_section, booster) = booster::identify(&ramps, theta_1)?;
    let inertia = 5e7;
    let identified = verification::Identified { friction, pump, theta_1, booster, inertia };
    let sections = [
        sensitivity::draw()?,
        sensors::screen(&field::Field::read("no_flow")?)?,
        friction_section,
        pump_section,
        booster_section,
        verification::draw(&circulation, &ramps, &identified)?,
    ];
    page::write(&folder, &sections)?;
    let mut missed = 0;
    for finding in sections.iter().flat_map(|section| &section.findings) {
        println!("Fig {:<5} {}", finding.number, finding.here);
        for claim in finding.claims.iter().filter(|claim| !claim.holds) {
            println!("          does not come out: {}", claim.text);
            missed += 1;
        }
    }
    println!("wrote {}", folder.join("index.html").display());
    if missed == 0 { Ok(()) } else { Err(format!("{missed} findings do not come out").into()) }
}
