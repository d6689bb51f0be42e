//! The time to compile a model relative to the time to read it: a ratio of work, independent of the machine and of a
//! constant load.

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use dgd_compiler::dae::assemble;
use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::model::{ModelOptions, resolve};
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_compiler::syntax::imports;

/// Number of compilations of each model; the fastest is used.
const TIMES: usize = 7;
/// Limit on the time for equations, switches and events, as a multiple of that for reading, names and units. The models
/// with the most switches took 20 to 30 while each point of a switch was evaluated through hash tables.
const MOST: f64 = 12.0;

/// The times for a model up to names and units, and from there to its system.
fn times(path: &Path) -> [Duration; 2] {
    let begin = Instant::now();
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let text = fs::read_to_string(path).expect("a model");
    let main = SourceText { name: path.display().to_string(), text };
    let mut read = |path: &str| fs::read_to_string(path).map_err(|error| error.to_string());
    let loaded = imports::load(vec![main], &mut read, &mut sources, &mut diagnostics);
    let model = resolve(&loaded.asts, &ModelOptions::default(), &mut diagnostics);
    let model = model.expect("a sound model");
    let middle = Instant::now();
    assemble(&model, &mut diagnostics).expect("a solvable model");
    [middle - begin, middle.elapsed()]
}

#[test]
fn switches_do_not_dominate_the_time_of_a_compilation() {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models");
    for name in ["lines_of_the_well", "friction", "transmission_line", "dual_gradient_drilling"] {
        let path = models.join(name).with_extension("dgd");
        let mut fastest = [Duration::MAX; 2];
        for _ in 0..TIMES {
            let times = times(&path);
            fastest = [0, 1].map(|k| fastest[k].min(times[k]));
        }
        let [reading, rest] = fastest.map(|time| time.as_secs_f64());
        println!("{name}: {:.2} + {:.2} ms", 1e3 * reading, 1e3 * rest);
        assert!(rest < MOST * reading, "{name}: {:.1}", rest / reading);
    }
}
