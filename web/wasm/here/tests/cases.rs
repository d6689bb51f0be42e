//! The reference for WebAssembly: every short case runs on this machine, with the same result each time.

use std::process::Command;

use dgd_wasm::CASES;

#[test]
fn a_program_of_its_own_tells_what_the_cases_are() {
    for (position, case) in CASES.iter().enumerate().filter(|(_, case)| !case.is_long) {
        let output =
            Command::new(env!("CARGO_BIN_EXE_dgd-wasm")).arg(position.to_string()).output();
        let output = output.expect("it was built for this test");
        assert!(output.status.success(), "case {position}");
        assert!(!output.stdout.is_empty(), "case {position}");
        assert_eq!(String::from_utf8_lossy(&output.stdout), case.lines(), "case {position}");
    }
}
