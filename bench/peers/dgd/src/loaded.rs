//! A `.dgd` file compiled at run time instead of by rustc.

use std::fs;
use std::path::Path;

use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::model::{ModelOptions, Setting};
use dgd_compiler::pipeline::{SensitivityDirections, compile};
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_compiler::syntax::parse_setting;
use dgd_execute::LoadedSystem;
use peers_problems::request::Failure;

/// The model in a file of this package, with `settings` such as `N=100`.
pub(crate) fn model(
    file: &str,
    directions: &SensitivityDirections,
    settings: &[String],
) -> Result<LoadedSystem, Failure> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let mut options = ModelOptions::default();
    for setting in settings {
        let text = SourceText { name: "setting".to_owned(), text: setting.clone() };
        let source = sources.add(text);
        if let Ok((name, value)) = parse_setting(source, &sources, &mut diagnostics) {
            options.settings.push(Setting { name, value });
        }
    }
    let main = SourceText { name: path.display().to_string(), text: fs::read_to_string(&path)? };
    let mut read = |path: &str| fs::read_to_string(path).map_err(|error| error.to_string());
    let compiled = compile(main, &options, directions, &mut read, &mut sources, &mut diagnostics);
    let shown = |_| render::render(&diagnostics.sorted(), &sources, render::RenderStyle::Plain);
    Ok(LoadedSystem::new(compiled.map_err(shown)?.program))
}
