//! What WebAssembly is compared with: every short case runs here, and tells the same each time.

use std::process::Command;

use dgd_wasm::CASES;

#[test]
fn a_program_of_its_own_tells_what_the_cases_are() {
    for (position, case) in CASES.iter().enumerate().filter(|(_, case)| !case.is_long) {
        let told = Command::new(env!("CARGO_BIN_EXE_dgd-wasm")).arg(position.to_string()).output();
        let told = told.expect("it was built for this test");
        assert!(told.status.success(), "case {position}");
        assert!(!told.stdout.is_empty(), "case {position}");
        assert_eq!(String::from_utf8_lossy(&told.stdout), case.lines(), "case {position}");
    }
}
