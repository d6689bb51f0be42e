//! Generates a Rust program of many models, which compares them with the interpreter.

use std::fmt::Write;

use dgd_compiler::codegen::generate;
use dgd_compiler::pipeline::SensitivityDirections;
use dgd_runtime::SolvableSystem;

use crate::grammar;
use crate::oracle::generated_agrees;
use crate::prepared::compiled;

/// Whether a generated model disagrees with the one of its seed, which is then reported; called by generated programs.
pub fn disagrees(seed: u64, without: &[String], system: &impl SolvableSystem) -> bool {
    let result = generated_agrees(&grammar::case(seed, without), system);
    if let Err(reason) = &result {
        println!("seed {seed}: {reason}");
    }
    result.is_err()
}

/// The text of a program that compares the models of these seeds, and their number. Models that do not compile are left
/// to other oracles.
pub fn program(seeds: std::ops::Range<u64>, without: &[String]) -> (String, usize) {
    let (mut modules, mut calls, mut count) = (String::new(), String::new(), 0);
    for seed in seeds {
        let case = grammar::case(seed, without);
        let made = std::panic::catch_unwind(|| compiled(&case, &SensitivityDirections::All));
        let Ok(Ok((compiled, sources))) = made else { continue };
        let tokens = generate(&compiled.program, &format!("m{seed}"), &sources).to_string();
        // Formatted, so that rustc's messages are readable.
        let text = syn::parse_file(&tokens).map_or(tokens, |file| prettyplease::unparse(&file));
        modules.push_str(&text);
        let check = "dgd_fuzz::generated::disagrees";
        let _ = writeln!(calls, "    failed |= {check}({seed}, &without, &m{seed}::Model);");
        count += 1;
    }
    let without: Vec<String> = without.iter().map(|name| format!("{name:?}.to_owned()")).collect();
    let text = format!(
        "//! Made by `dgd-fuzz rust`.\n\
         #![allow(clippy::all, clippy::pedantic, missing_docs, unused_parens)]\n\n\
         fn main() {{\n    let without: Vec<String> = vec![{}];\n    let mut failed = false;\n{calls}    \
             std::process::exit(i32::from(failed));\n}}\n\n{modules}",
        without.join(", ")
    );
    (text, count)
}
