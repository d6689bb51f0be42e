//! Figures of Haukanes 2015, from its models and from recordings.
//!
//! ```text
//! cargo run --release --example thesis [-- DIR]
//! ```
//!
//! identifies the thesis' parameters from the recordings in `examples/data/field/`, one after the other as the thesis
//! does, and draws its data figures (2.3, 3.1, 3.3–3.12, 3.14–3.24, 4.1, 4.2, B.1) into `thesis`, unless
//! said otherwise, with an index: beside each picture what must come out, what the thesis says of it,
//! what is found here, and a verdict. It ends with failure where a finding of the thesis does not come out.

mod booster;
mod chapters;
mod claims;
mod curves;
mod field;
mod flow_correction;
mod friction;
mod html;
mod inertia;
mod model;
mod page;
mod pump;
mod riser;
mod sensitivity;
mod sensors;
mod verification;

use std::path::PathBuf;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "thesis".into()));
    let sections = chapters::all()?;
    html::write(&folder, &sections)?;
    for finding in sections.iter().flat_map(|section| &section.findings) {
        println!("Fig {:<5} {}", finding.number, finding.here);
    }
    let index = folder.join("index.html");
    println!("wrote {}, of {} claims", index.display(), claims::count(&sections));
    Ok(claims::verdict(&sections)?)
}
