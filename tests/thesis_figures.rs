//! `cargo run --release --example thesis`: each finding of the thesis comes out of the recordings, and
//! the page has all of its data figures.

#[path = "../examples/thesis/booster.rs"]
mod booster;
#[path = "../examples/thesis/chapters.rs"]
mod chapters;
#[path = "../examples/thesis/field.rs"]
mod field;
#[path = "../examples/thesis/flow_correction.rs"]
mod flow_correction;
#[path = "../examples/thesis/friction.rs"]
mod friction;
#[path = "../examples/thesis/inertia.rs"]
mod inertia;
#[path = "../examples/thesis/model.rs"]
mod model;
#[path = "../examples/thesis/page.rs"]
mod page;
#[path = "../examples/thesis/pump.rs"]
mod pump;
#[path = "../examples/thesis/sensitivity.rs"]
mod sensitivity;
#[path = "../examples/thesis/sensors.rs"]
mod sensors;
#[path = "../examples/thesis/verification.rs"]
mod verification;

use std::path::Path;

#[test]
fn the_findings_of_the_thesis_come_out_of_the_recordings() {
    let sections = chapters::all().expect("every section can be identified");
    let findings = || sections.iter().flat_map(|section| &section.findings);
    for finding in findings() {
        for claim in &finding.claims {
            assert!(claim.holds, "Fig {}: {}", finding.number, claim.text);
        }
    }
    // All data figures of chapters 3 and 4 and of appendix B; 3.2 and 3.13 are drawings.
    let mut numbers: Vec<String> =
        (1..=24).filter(|n| *n != 2 && *n != 13).map(|n| format!("3.{n}")).collect();
    numbers.extend(["4.1", "4.2", "B.1"].map(String::from));
    let mut drawn: Vec<String> = findings().map(|finding| finding.number.to_owned()).collect();
    numbers.sort();
    drawn.sort();
    assert_eq!(drawn, numbers);

    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("thesis");
    page::write(&folder, &sections).expect("the folder is written");
    let index = std::fs::read_to_string(folder.join("index.html")).expect("the index");
    for number in numbers {
        let file = format!("fig_{}.svg", number.replace('.', "_"));
        assert!(index.contains(&format!("src=\"{file}\"")), "{file}");
        let svg = std::fs::read_to_string(folder.join(&file)).expect("a picture");
        assert!(svg.contains("<polyline") || svg.contains("<path"), "{file} is empty");
    }
    // The one that the README shows.
    let [drawn, shown] = [folder.join("fig_4_2.svg"), root.join("docs/fig_4_2.svg")]
        .map(|path| std::fs::read(path).expect("a picture"));
    assert!(
        drawn == shown,
        "`cargo run --release --example thesis` draws another docs/fig_4_2.svg"
    );
}
