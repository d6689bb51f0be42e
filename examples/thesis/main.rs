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
mod chapters;
mod field;
mod flow_correction;
mod friction;
mod inertia;
mod model;
mod page;
mod pump;
mod sensitivity;
mod sensors;
mod verification;

use std::path::PathBuf;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "thesis".into()));
    let sections = chapters::all()?;
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
