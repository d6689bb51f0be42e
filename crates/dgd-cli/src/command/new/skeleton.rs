//! A runnable model made from the columns of a recording: each output follows the inputs with a lag, until physics
//! replaces it.
//!
//! ```text
//!   τ dy/dt = y₀ + Σ kᵤ (u − u₀) − y
//! ```
//!
//! y₀ and u₀ are means, kᵤ is 0, and τ is a twentieth of the recording, so that the model is finite from any start.

use std::fmt::Write as _;
use std::path::Path;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::source::SourceMap;
use dgd_compiler::units::{Unit, describe, parse_unit};
use dgd_data::files::ResultFolder;
use dgd_data::write::{OutputColumn, write_table_at};
use dgd_data::{DataColumn, DataTable, read_from};

use super::commands;
use super::names::{distinct, identifier};
use crate::failure::CommandError;

/// A project, with remarks on it.
pub(super) struct Skeleton {
    pub(super) files: ResultFolder,
    pub(super) remarks: Vec<String>,
}

/// Magic bytes of a Parquet file.
const PARQUET: &[u8] = b"PAR1";

/// A column used by the model.
struct SkeletonColumn<'a> {
    /// The column in the file.
    column: &'a DataColumn,
    name: String,
    unit: Unit,
    /// Whether the file has no unit.
    is_plain: bool,
    is_held: bool,
    is_output: bool,
}

/// Makes a project from a recording, whose bytes must be uncompressed.
///
/// # Errors
///
/// The recording cannot be read, has no time, or lacks the requested outputs.
pub(super) fn build(
    model: &str,
    path: &Path,
    bytes: &[u8],
    outputs: &[String],
) -> Result<Skeleton, CommandError> {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let name = path.display().to_string();
    let table = read_from(&name, bytes, &mut sources, &mut diagnostics);
    let table = table.map_err(|_| CommandError::diagnosed(&diagnostics, sources.clone()))?;
    let times = table.recording(&mut diagnostics).map(<[f64]>::to_vec);
    let times = times.map_err(|_| CommandError::diagnosed(&diagnostics, sources.clone()))?;
    let quantities = quantities(&table, outputs)?;
    let mut remarks: Vec<String> =
        table.time_note.iter().map(|note| note.message.clone()).collect();
    remarks.push(told(&quantities));
    let left_out = table.columns.iter().filter(|column| !is_usable(column));
    let left_out: Vec<String> = left_out.map(|column| format!("`{}`", column.name)).collect();
    if !left_out.is_empty() {
        remarks.push(format!("left out, as there are no numbers in them: {}", left_out.join(", ")));
    }
    let duration = times.last().copied().unwrap_or(0.0).max(1e-9);
    let text = text(model, path, &quantities, duration);
    let data = if bytes.starts_with(PARQUET) {
        written(&table, &times, &quantities)
    } else {
        copied(&table, &sources, &quantities, bytes)
    };
    let mut files = vec![
        (format!("{model}.dgd"), text.into_bytes()),
        ("data.csv".to_owned(), data),
        ("README.md".to_owned(), readme(model, path).into_bytes()),
    ];
    if let Some(output) = quantities.iter().find(|one| one.is_output) {
        let (name, text) = effect(model, output);
        files.push((format!("effects/{name}.dgd"), text.into_bytes()));
    }
    Ok(Skeleton { files: ResultFolder { written: files, removed: Vec::new() }, remarks })
}

/// The text of a CSV file with another header line.
fn copied(
    table: &DataTable,
    sources: &SourceMap,
    quantities: &[SkeletonColumn<'_>],
    bytes: &[u8],
) -> Vec<u8> {
    let header = header(table, sources, quantities);
    let span = table.header;
    let offset = bytes.len() - bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes).len();
    let (start, end) = (span.start as usize + offset, span.end as usize + offset);
    [&bytes[..start], header.as_bytes(), &bytes[end..]].concat()
}

/// The columns of the model as CSV, in the units of the file.
fn written(table: &DataTable, times: &[f64], quantities: &[SkeletonColumn<'_>]) -> Vec<u8> {
    let unit = |one: &SkeletonColumn<'_>| dgd_runtime::Unit {
        symbol: one.unit.symbol.clone().into(),
        factor: 1.0,
        offset: 0.0,
    };
    let units: Vec<dgd_runtime::Unit> = quantities.iter().map(unit).collect();
    let columns: Vec<OutputColumn<'_>> = quantities
        .iter()
        .zip(&units)
        .map(|(one, unit)| OutputColumn::new(&one.name, unit, &one.column.values))
        .collect();
    let mut text = Vec::new();
    // Writing to memory cannot fail.
    let _ = write_table_at(&mut text, times, table.epoch, &columns);
    text
}

fn is_usable(column: &DataColumn) -> bool {
    column.fault.is_none() && column.values.iter().any(|value| value.is_finite())
}

/// Classifies columns as inputs or outputs.
fn quantities<'a>(
    table: &'a DataTable,
    outputs: &[String],
) -> Result<Vec<SkeletonColumn<'a>>, CommandError> {
    let columns: Vec<&DataColumn> =
        table.columns.iter().filter(|column| is_usable(column)).collect();
    if let Some(unknown) = outputs.iter().find(|name| !columns.iter().any(|c| c.name == **name)) {
        let known: Vec<String> =
            columns.iter().map(|column| format!("`{}`", column.name)).collect();
        return Err(CommandError::Usage(format!(
            "`--outputs {unknown}`: the file has no such column; it has {}",
            known.join(", ")
        )));
    }
    let names = distinct(columns.iter().map(|column| identifier(&column.name, "input")).collect());
    let mut quantities: Vec<SkeletonColumn<'_>> = columns
        .into_iter()
        .zip(names)
        .map(|(column, name)| SkeletonColumn {
            column,
            name,
            unit: column.unit.clone().unwrap_or_else(Unit::one),
            is_plain: column.unit.is_none(),
            is_held: column.is_held(),
            is_output: outputs.contains(&column.name),
        })
        .collect();
    if outputs.is_empty() {
        for one in &mut quantities {
            // Columns with missing values are measurements.
            one.is_output = !one.is_held || one.column.missing.is_some();
        }
        // If all columns are of one kind, the last one is taken as the output.
        let n_outputs = quantities.iter().filter(|one| one.is_output).count();
        if n_outputs == 0 || n_outputs == quantities.len() && quantities.len() > 1 {
            let last = quantities.len().saturating_sub(1);
            for (k, one) in quantities.iter_mut().enumerate() {
                one.is_output = k == last || one.column.missing.is_some();
            }
        }
    }
    if quantities.is_empty() {
        return Err(CommandError::Found("the file has no column of numbers".to_owned()));
    }
    Ok(quantities)
}

/// The classification, as a remark.
fn told(quantities: &[SkeletonColumn<'_>]) -> String {
    let named = |is_output: bool| {
        let of_kind = quantities.iter().filter(|one| one.is_output == is_output);
        let names: Vec<String> = of_kind.map(|one| format!("`{}`", one.name)).collect();
        if names.is_empty() { "none".to_owned() } else { names.join(", ") }
    };
    format!("inputs: {}; outputs: {}; `--outputs` says it otherwise", named(false), named(true))
}

/// The header line, with names of the model.
fn header(table: &DataTable, sources: &SourceMap, quantities: &[SkeletonColumn<'_>]) -> String {
    let line = sources.text(table.header);
    let first = table
        .columns
        .first()
        .map_or(line.len(), |column| (column.place.start - table.header.start) as usize);
    let time = line[..first].trim_end_matches(['"', ',', ' ']);
    let time = match (time.find('['), &table.epoch) {
        (Some(unit), _) => format!("time {}", time[unit..].trim_end()),
        (None, Some(_)) => "time".to_owned(),
        (None, None) => "time [s]".to_owned(),
    };
    let mut cells = vec![time];
    for column in &table.columns {
        let known = quantities.iter().find(|one| std::ptr::eq(one.column, column));
        cells.push(match known {
            Some(one) => format!("{} [{}]", one.name, one.unit.symbol),
            None => format!("\"{}\"", sources.text(column.place).replace('"', "")),
        });
    }
    cells.join(",")
}

/// The model's text.
fn text(model: &str, path: &Path, quantities: &[SkeletonColumn<'_>], duration: f64) -> String {
    let inputs: Vec<&SkeletonColumn<'_>> = quantities.iter().filter(|one| !one.is_output).collect();
    let outputs: Vec<&SkeletonColumn<'_>> = quantities.iter().filter(|one| one.is_output).collect();
    let mut text = format!("/// A first model of {}.\nmodel {model}\n\n", path.display());
    // Writing to a string cannot fail.
    for one in &inputs {
        let kind = if one.is_held { "hold" } else { "linear" };
        let _ = writeln!(text, "input {} [{}] {kind}{}", one.name, one.unit.symbol, remark(one));
    }
    text.push_str(
        "\n# Until the physics stands here, each output follows the inputs with a lag, which runs and can be fitted.\n\
         # States are what is stored: charge, momentum, mass, heat. Replace each equation by a balance such as\n\
         #     equation mechanical: J*der(w) = K*i - b*w\n\n",
    );
    for one in &inputs {
        let mean = mean(&one.column.values);
        let _ = writeln!(text, "constant {}_0 [{}] = {mean}", one.name, one.unit.symbol);
    }
    for one in &outputs {
        declare_lag(&mut text, one, &inputs, duration);
    }
    text.push('\n');
    for one in &outputs {
        let first = one.column.values.iter().find(|value| value.is_finite()).unwrap_or(&0.0);
        let (symbol, nominal) = (&one.unit.symbol, short(spread(&one.column.values)));
        let _ = writeln!(text, "state {} [{symbol}] = {first}  nominal {nominal}", one.name);
    }
    text.push('\n');
    for one in &outputs {
        let y = &one.name;
        let gain = |u: &&SkeletonColumn<'_>| format!(" + k_{y}_{0}*({0} - {0}_0)", u.name);
        let gains: String = inputs.iter().map(gain).collect();
        let _ = writeln!(text, "equation {y}_lag: tau_{y}*der({y}) = {y}_0{gains} - {y}");
    }
    text.push('\n');
    for one in &outputs {
        let noise = short(noise(&one.column.values));
        let _ = writeln!(
            text,
            "output {} [{}]  noise {noise}{}",
            one.name,
            one.unit.symbol,
            remark(one)
        );
    }
    text
}

fn remark(one: &SkeletonColumn<'_>) -> &'static str {
    if one.is_plain { "    # the file has no unit: put it between the brackets" } else { "" }
}

/// Declares the parameters of an output's lag.
fn declare_lag(
    text: &mut String,
    one: &SkeletonColumn<'_>,
    inputs: &[&SkeletonColumn<'_>],
    duration: f64,
) {
    let (y, unit) = (&one.name, &one.unit.symbol);
    let mean = mean(&one.column.values);
    let size = short(spread(&one.column.values));
    let (tau, least, most) =
        (short(duration / 20.0), short(duration / 2e4), short(duration * 10.0));
    let _ = writeln!(text, "parameter {y}_0 [{unit}] = {mean}  nominal {size}");
    let _ = writeln!(text, "parameter tau_{y} [s] = {tau}  in {least} .. {most}, log");
    for input in inputs {
        let gain = gain_unit(&one.unit, &input.unit);
        let in_unit = |q: &SkeletonColumn<'_>| spread(&q.column.values) * q.unit.factor;
        let factor = parse_unit(&gain).map_or(1.0, |unit| unit.factor);
        let nominal = short(in_unit(one) / in_unit(input) / factor);
        let _ = writeln!(text, "parameter k_{y}_{} [{gain}] = 0  nominal {nominal}", input.name);
    }
}

/// The unit of an output's change over that of an input.
fn gain_unit(output: &Unit, input: &Unit) -> String {
    let difference = |unit: &Unit| {
        if unit.offset == 0.0 && unit.datum.is_none() {
            unit.symbol.clone()
        } else {
            describe(unit.dimension)
        }
    };
    let (above, below) = (difference(output), difference(input));
    let is_simple = |symbol: &str| symbol.chars().all(char::is_alphanumeric);
    let within = |symbol: String| if is_simple(&symbol) { symbol } else { format!("({symbol})") };
    let quotient = match below.as_str() {
        "1" => above,
        _ => format!("{}/{}", within(above), within(below)),
    };
    // A unit that cannot be written as a quotient is written in SI.
    if parse_unit(&quotient).is_ok() {
        return quotient;
    }
    let dimension = output.dimension.divide(input.dimension);
    dimension.map_or_else(|| "1".to_owned(), describe)
}

/// An example effect.
fn effect(model: &str, output: &SkeletonColumn<'_>) -> (String, String) {
    let y = &output.name;
    let unit = gain_unit(&output.unit, &Unit::one());
    let factor = parse_unit(&unit).map_or(1.0, |unit| unit.factor);
    let size = short(spread(&output.column.values) * output.unit.factor / factor);
    let name = format!("{y}_sensor_offset");
    let text = format!(
        "/// The sensor of `{y}` reads too much or too little. Effects of your own go into files like this one.\n\
         effect {name} on {model}\nkind sensor\n\n\
         parameter {y}_offset [{unit}] = 0  in -{size} .. {size}\nnull {y}_offset = 0\n\n\
         replace output {y} by {y} + {y}_offset\n"
    );
    (name, text)
}

fn readme(model: &str, path: &Path) -> String {
    format!(
        "# {model}\n\n\
         Made by `dgd new` from `{}`. `{model}.dgd` runs as it is and knows no physics yet: each output follows the inputs\n\
         with a lag. Fill in what is stored and what flows, one equation after the other, and check after each.\n\n\
         {}\n\
         A second recording behind `--valid` tells whether a fit or a discovery holds elsewhere. `effects` holds what may\n\
         be missing: `dgd discover` tries every file in it, and general templates besides.\n",
        path.display(),
        commands(model, "data.csv", None)
    )
}

fn finite(values: &[f64]) -> impl Iterator<Item = f64> + '_ {
    values.iter().copied().filter(|value| value.is_finite())
}

/// The mean, with digits according to the spread.
fn mean(values: &[f64]) -> f64 {
    let n = finite(values).count().max(1) as f64;
    let mean = finite(values).sum::<f64>() / n;
    let digit = 10f64.powf((spread(values) / 1000.0).log10().floor());
    rounded(if digit.is_normal() { (mean / digit).round() * digit } else { mean }, 6)
}

/// Range of the values; if it is zero, the size of a value, or 1.
fn spread(values: &[f64]) -> f64 {
    let (low, high) = finite(values)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    let size = if high > low { high - low } else { high.abs() };
    if size > 0.0 && size.is_finite() { size } else { 1.0 }
}

/// The noise of a sensor from second differences, whose variance is six times that of white noise; a thousandth of the
/// spread if they vanish.
fn noise(values: &[f64]) -> f64 {
    let second = |w: &[f64]| w[0] - 2.0 * w[1] + w[2];
    let squares: Vec<f64> =
        values.windows(3).map(|w| second(w).powi(2)).filter(|d| d.is_finite()).collect();
    let mean = squares.iter().sum::<f64>() / squares.len().max(1) as f64;
    (mean / 6.0).sqrt().max(spread(values) / 1000.0)
}

/// A number with two digits.
fn short(value: f64) -> f64 {
    rounded(value, 2)
}

fn rounded(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value)
}
