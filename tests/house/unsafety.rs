//! `unsafe` stands where ARCHITECTURE.md says, and nowhere else.

use crate::source::{CRATES, files, source};

#[test]
fn unsafe_code_stands_in_three_files() {
    let mut found = Vec::new();
    for name in CRATES {
        for file in files(name) {
            let has = |line: &str| {
                let code = line.split("//").next().unwrap_or_default();
                code.contains("unsafe {")
                    || code.contains("unsafe fn")
                    || code.contains("unsafe impl")
            };
            if file.text.lines().any(has) {
                found.push(format!("{}/{}.rs", source(name), file.path.join("/")));
            }
        }
    }
    assert_eq!(
        found,
        [
            "crates/dgd-scratch/src/arena.rs",
            "dgd-runtime/src/linalg/width.rs",
            "crates/dgd-execute/src/native/code.rs"
        ]
    );
}
