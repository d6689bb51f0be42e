//! `dgd screen`: what is wrong with recordings, before anything is fitted to them.

use std::path::PathBuf;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::pipeline::Directions;
use dgd_compiler::source::Sources;
use dgd_runtime::Options;
use dgd_screen::Weight;

use crate::command_line::command_line;
use crate::console::{Console, print, print_text};
use crate::data::{Table, read_as_it_is};
use crate::failure::{CommandError, meant};
use crate::figure;
use crate::load::{Loaded, load};
use crate::screening::against_model::Model;
use crate::screening::args::ScreenArgs;
use crate::screening::{self, Wishes, units};

pub(crate) fn run(args: &ScreenArgs, console: Console<'_>) -> Result<(), CommandError> {
    figure::verify_formats(&args.plot)?;
    if args.plot.len() > 1 && args.data.len() > 1 && args.plot.len() != args.data.len() {
        return Err(CommandError::Usage("give one `--plot`, or one for each `--data`".to_owned()));
    }
    let (mut sources, mut diagnostics) = (Sources::default(), Diagnostics::default());
    let mut tables = read(args, &mut sources, &mut diagnostics);
    if diagnostics.check().is_err() {
        return Err(CommandError::diagnosed(&diagnostics, sources));
    }
    let wishes = wishes(args, &tables)?;
    if units::unify(&mut tables, &wishes.same, &mut diagnostics).is_err() {
        return Err(CommandError::diagnosed(&diagnostics, sources));
    }
    let mut screened = screening::screen_all(tables, &wishes);
    if let Some(model) = &args.model {
        let Loaded { compiled, sources, .. } = load(model, &args.choices, |_| Directions::None)?;
        console.spare(&sources)?;
        let system = dgd_execute::Loaded::new(compiled.program);
        let model = Model { system: &system, dae: &compiled.dae, options: Options::default() };
        for one in &mut screened {
            model.look_at(one);
        }
    }
    if let Some(folder) = console.out() {
        screening::write(folder, &screened, &command_line())?;
        console.remark(&format!("wrote {}", folder.display()));
    }
    for (at, path) in args.plot.iter().enumerate() {
        figure::save(
            &screening::figure::figure(&screened[at.min(screened.len() - 1)]),
            path,
            console,
        )?;
    }
    if console.is_json() {
        print(&format!("{:#}\n", screening::to_json(&screened)))?;
    } else if !(console.is_quiet() && console.out().is_some()) {
        print_text(&screening::text(&screened, console.out()))?;
    }
    let faults: usize = screened.iter().map(|one| one.count(Weight::Fault)).sum();
    match faults {
        0 => Ok(()),
        _ if !args.check => Ok(()),
        1 => Err(CommandError::Shown("one fault was found".to_owned())),
        n => Err(CommandError::Shown(format!("{n} faults were found"))),
    }
}

/// All recordings, with the names that the user gives to columns; mistakes are reported.
fn read(
    args: &ScreenArgs,
    sources: &mut Sources,
    diagnostics: &mut Diagnostics,
) -> Vec<(PathBuf, Table)> {
    let mut tables = Vec::with_capacity(args.data.len());
    for path in &args.data {
        let Ok(table) = read_as_it_is(path, &args.rename, sources, diagnostics) else {
            continue;
        };
        // Rows without a time are not a recording.
        if table.recording(diagnostics).is_ok() {
            tables.push((path.clone(), table));
        }
    }
    tables
}

/// What the options say, with names that are there.
fn wishes(args: &ScreenArgs, tables: &[(PathBuf, Table)]) -> Result<Wishes, CommandError> {
    let mut known: Vec<&str> =
        tables.iter().flat_map(|(_, table)| &table.columns).map(|c| c.name.as_str()).collect();
    known.sort_unstable();
    known.dedup();
    let verify = |flag: &str, name: &str| {
        if known.contains(&name) {
            return Ok(name.to_owned());
        }
        let meant = meant(name, &known);
        Err(CommandError::Usage(format!("`{flag}`: there is no column `{name}`; {meant}")))
    };
    let mut same = Vec::new();
    for text in &args.same {
        let names: Vec<String> = text
            .split(',')
            .map(|name| verify("--same", name.trim()))
            .collect::<Result<_, CommandError>>()?;
        if names.len() < 2 {
            let message = format!("`--same {text}` needs two names or more, with commas");
            return Err(CommandError::Usage(message));
        }
        for (at, one) in names.iter().enumerate() {
            for other in &names[at + 1..] {
                let has_both = |(_, table): &(PathBuf, Table)| {
                    table.column(one).is_some() && table.column(other).is_some()
                };
                if !tables.iter().any(has_both) {
                    let message = format!("`--same`: no recording has both `{one}` and `{other}`");
                    return Err(CommandError::Usage(message));
                }
                same.push([one.clone(), other.clone()]);
            }
        }
    }
    let mut rest = Vec::new();
    for text in &args.rest {
        let parsed = text.split_once('=').and_then(|(name, rate)| {
            let rate: f64 = rate.trim().parse().ok()?;
            (rate.is_finite() && rate > 0.0).then_some((name.trim(), rate))
        });
        let Some((name, rate)) = parsed else {
            return Err(CommandError::Usage(format!(
                "`--rest {text}` needs the form NAME=RATE, a positive change per second in the \
                 column's unit, as in `--rest q_ssp=2`"
            )));
        };
        rest.push((verify("--rest", name)?, rate));
    }
    Ok(Wishes { same, window: args.window, rest })
}
