//! A linear model, for programs and as text.

use std::fmt::Write as _;
use std::io;

use dgd_data::cell::{push_number, quoted};
use dgd_plot::Figure;
use dgd_runtime::linearize::{
    DMatrix, LinearDelay, LinearInput, OperatingPoint, Pole, Poles, Stability, StateSpace,
};
use dgd_runtime::{Output, Signature, Unit};
use serde::{Serialize, Serializer};
use serde_json::{Value, json};

use super::figure;
use crate::output::columns::{is_share, quotient};
use crate::output::conserved::ConservedQuantity;
use crate::output::provenance::Provenance;
use crate::output::quantity::of_differences;
use crate::output::table::{exact, push_table, significant};
use crate::request::LinearizeAt;
use crate::result::linearize::{
    DelayedUnknownEntry, EliminatedEntry, LinearInputEntry, LinearModeEntry, LinearOutputEntry,
    LinearStateEntry, LinearizeDocument, PointEntry, PoleEntry, StabilityOtherwise,
};

/// Significant digits of printed values.
const DIGITS: usize = 6;
/// Characters in a line of a matrix.
const WIDTH: usize = 110;
/// Largest number of rows or columns shown.
const MOST_SHOWN: usize = 24;

/// A quantity and its value at the point.
#[derive(Debug, Clone)]
struct PointQuantity {
    name: String,
    unit: Unit,
    /// Value at the point, SI.
    value: f64,
}

impl PointQuantity {
    fn entry(&self) -> PointEntry {
        PointEntry {
            name: self.name.clone(),
            unit: self.unit.symbol.to_string(),
            value: self.value(),
        }
    }

    fn value(&self) -> f64 {
        self.unit.from_si(self.value)
    }

    fn label(&self) -> String {
        format!("{} [{}]", self.name, of_differences(&self.unit).symbol)
    }

    /// Its time derivative.
    fn rate(&self, value: f64) -> Self {
        let seconds = Unit { symbol: "s".into(), factor: 1.0, offset: 0.0 };
        let unit = quotient(&of_differences(&self.unit), &seconds);
        Self { name: format!("d({})/dt", self.name), unit, value }
    }
}

/// A matrix with the quantities of its rows and columns.
struct LabelledMatrix<'a> {
    name: &'static str,
    about: &'static str,
    rows: &'a [PointQuantity],
    columns: &'a [PointQuantity],
    /// SI.
    entries: &'a DMatrix<f64>,
}

impl LabelledMatrix<'_> {
    /// An entry in the declared units.
    fn value(&self, i: usize, j: usize) -> f64 {
        let value = self.entries[(i, j)] * self.columns[j].unit.factor / self.rows[i].unit.factor;
        // Turns −0 into 0.
        value + 0.0
    }

    fn unit(&self, i: usize, j: usize) -> Unit {
        quotient(&of_differences(&self.rows[i].unit), &of_differences(&self.columns[j].unit))
    }

    fn is_empty(&self) -> bool {
        self.rows.is_empty() || self.columns.is_empty()
    }

    /// All entries in the declared units.
    fn rows_in_units(&self) -> Vec<Vec<Option<f64>>> {
        let row = |i: usize| (0..self.columns.len()).map(|j| Some(self.value(i, j))).collect();
        (0..self.rows.len()).map(row).collect()
    }

    fn push_text(&self, text: &mut String) {
        let (m, n) = (self.rows.len(), self.columns.len());
        let _ = writeln!(text, "\n{}: {}", self.name, self.about);
        if m.max(n) > MOST_SHOWN {
            let _ = writeln!(
                text,
                "{m} x {n}, too large to be shown here: see the result in a file, or as JSON"
            );
            return;
        }
        let labels: Vec<String> = self.rows.iter().map(PointQuantity::label).collect();
        let stub = labels.iter().map(|label| label.chars().count()).max().unwrap_or(0);
        let columns: Vec<Vec<String>> = (0..n)
            .map(|j| {
                let entries = (0..m).map(|i| exact(self.value(i, j), DIGITS));
                std::iter::once(self.columns[j].label()).chain(entries).collect()
            })
            .collect();
        let mut from = 0;
        while from < n {
            let mut width = stub;
            let mut until = from;
            while until < n {
                let column_width =
                    columns[until].iter().map(|cell| cell.chars().count()).max().unwrap_or(0);
                width += column_width + 2;
                if width > WIDTH && until > from {
                    break;
                }
                until += 1;
            }
            let mut table = Vec::with_capacity(m + 1);
            for i in 0..=m {
                let label = if i == 0 { String::new() } else { labels[i - 1].clone() };
                let cells = columns[from..until].iter().map(|column| column[i].clone());
                table.push(std::iter::once(label).chain(cells).collect::<Vec<String>>());
            }
            push_table(text, &table);
            from = until;
        }
    }
}

/// A linear model in declared units.
#[derive(Debug, Clone)]
pub struct LinearModelReport {
    /// Versions and digests of the inputs.
    pub provenance: Provenance,
    signature: Signature,
    place: LinearizeAt,
    at: OperatingPoint,
    system: StateSpace,
    poles: Poles,
    states: Vec<PointQuantity>,
    rates: Vec<PointQuantity>,
    /// Eliminated unknowns with their rows, without the shares of sliding modes, which `modes` reports.
    eliminated: Vec<(PointQuantity, usize)>,
    channels: Vec<PointQuantity>,
    late: Vec<PointQuantity>,
    /// Delayed terms, at their current values.
    sources: Vec<PointQuantity>,
    outputs: Vec<PointQuantity>,
    /// Quantities held constant in the search for the steady state.
    conserved: Vec<ConservedQuantity>,
}

impl LinearModelReport {
    /// The same model, at a steady state found with these quantities held.
    pub(super) fn holding(self, conserved: Vec<ConservedQuantity>) -> Self {
        Self { conserved, ..self }
    }

    pub(crate) fn new(
        signature: Signature,
        place: LinearizeAt,
        at: OperatingPoint,
        system: StateSpace,
        poles: Poles,
        provenance: Provenance,
    ) -> Self {
        let unknown = |i: &usize| PointQuantity {
            name: signature.unknowns.name(*i).into_owned(),
            unit: signature.unknowns.unit(*i).clone(),
            value: at.y[*i],
        };
        let states: Vec<PointQuantity> = system.states.iter().map(unknown).collect();
        let rates =
            states.iter().zip(&system.rates).map(|(state, rate)| state.rate(*rate)).collect();
        let eliminated = system.eliminated.iter().map(|row| (unknown(row), *row));
        let eliminated = eliminated.filter(|(quantity, _)| !is_share(&quantity.name)).collect();
        let sources = system.delayed_unknowns.iter().map(|late| unknown(&late.unknown)).collect();
        let late_input = |input: usize, tau: f64| {
            let name = &signature.inputs[input].name;
            if tau == 0.0 { name.to_string() } else { late_name(name, tau) }
        };
        let channel = |(channel, value): (&LinearInput, &f64)| {
            let unit = signature.inputs[channel.input()].unit.clone();
            let delayed = |tau| PointQuantity {
                name: late_input(channel.input(), tau),
                unit: unit.clone(),
                value: *value,
            };
            match *channel {
                LinearInput::Input(_) => delayed(0.0),
                LinearInput::Delayed { tau, .. } => delayed(tau),
                LinearInput::Slope { tau, .. } => {
                    let delayed = delayed(tau);
                    PointQuantity { name: format!("der({})", delayed.name), ..delayed.rate(*value) }
                }
            }
        };
        let channels = system.channels.iter().zip(&system.u).map(channel).collect();
        let late = |(late, value): (&LinearDelay, &f64)| {
            let source = unknown(&late.unknown);
            PointQuantity { name: late_name(&source.name, late.tau), value: *value, ..source }
        };
        let late = system.delayed_unknowns.iter().zip(&system.v).map(late).collect();
        let output = |(output, value): (&Output, &f64)| PointQuantity {
            name: output.name.to_string(),
            unit: output.unit.clone(),
            value: *value,
        };
        let outputs = signature.outputs.iter().zip(&system.w).map(output).collect();
        Self {
            provenance,
            signature,
            place,
            at,
            system,
            poles,
            states,
            rates,
            eliminated,
            channels,
            late,
            sources,
            outputs,
            conserved: Vec::new(),
        }
    }
}

impl Serialize for LinearModelReport {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.to_json().serialize(serializer)
    }
}

/// Modes, and the sides of switches and bounds, at a point.
pub fn modes<'a>(
    signature: &'a Signature,
    at: &'a OperatingPoint,
) -> impl Iterator<Item = (&'a str, &'a str)> {
    let automata = signature.discrete.automata.iter().zip(&at.z);
    automata.filter(|(automaton, _)| automaton.kind.shows_modes()).filter_map(
        |(automaton, mode)| Some((&*automaton.name, &**automaton.modes.get(*mode as usize)?)),
    )
}

/// Whether disturbances fade, if that is known.
fn fades(stability: Stability) -> Option<bool> {
    match stability {
        Stability::Stable => Some(true),
        Stability::Marginal | Stability::Unknown => None,
        Stability::Unstable => Some(false),
    }
}

/// The name of a delayed value.
fn late_name(name: &str, tau: f64) -> String {
    // A variable delay has many digits.
    let tau: f64 = significant(tau, DIGITS).parse().unwrap_or(tau);
    format!("{name}(t - {tau} s)")
}

impl LinearModelReport {
    /// Its poles in the complex plane, named by their time constants.
    pub fn figure(&self) -> Figure {
        figure::poles(&self.signature.name, &self.poles.poles, self.conserved.len())
    }

    /// A, B, C and D, SI.
    pub fn state_space(&self) -> &StateSpace {
        &self.system
    }

    /// Its poles.
    pub fn poles(&self) -> &Poles {
        &self.poles
    }

    /// The point itself, SI.
    pub fn point(&self) -> &OperatingPoint {
        &self.at
    }

    /// The nonempty matrices.
    fn matrices(&self) -> [LabelledMatrix<'_>; 9] {
        let StateSpace {
            a, b, c, d, delayed_a, delayed_c, delayed_x, delayed_u, delayed_v, ..
        } = &self.system;
        let Self { states, rates, channels, late, sources, outputs, .. } = self;
        // A delayed state has no entry of its own.
        let of_states = self.system.delayed_unknowns.iter();
        let all_states =
            of_states.map(|late| late.unknown).all(|i| self.system.states.contains(&i));
        let sources: &[PointQuantity] = if all_states { &[] } else { sources };
        let matrices: [(_, _, &[PointQuantity], &[PointQuantity], _); 9] = [
            ("A", "slopes of the states by the states", rates, states, a),
            ("B", "slopes of the states by the inputs", rates, channels, b),
            ("C", "outputs by the states", outputs, states, c),
            ("D", "outputs by the inputs", outputs, channels, d),
            ("A1", "slopes of the states by what acts late", rates, late, delayed_a),
            ("C1", "outputs by what acts late", outputs, late, delayed_c),
            ("E", "what will act late by the states", sources, states, delayed_x),
            ("F", "what will act late by the inputs", sources, channels, delayed_u),
            ("G", "what will act late by what does", sources, late, delayed_v),
        ];
        let matrix = |(name, about, rows, columns, entries)| LabelledMatrix {
            name,
            about,
            rows,
            columns,
            entries,
        };
        matrices.map(matrix)
    }

    /// Modes, and the sides of switches and bounds.
    fn modes(&self) -> impl Iterator<Item = (&str, &str)> {
        modes(&self.signature, &self.at)
    }

    /// Delayed outputs, and their delays.
    fn late_outputs(&self) -> impl Iterator<Item = (&PointQuantity, f64)> {
        let outputs = self.outputs.iter().zip(self.system.output_delays.iter().copied());
        outputs.filter(|(_, tau)| *tau != 0.0)
    }

    /// Tables.
    pub fn to_text(&self) -> String {
        let mut text = format!("{}, linear close to ", self.signature.name);
        let t = self.at.t;
        let _ = match self.place {
            LinearizeAt::Time(_) => writeln!(text, "t = {t} s"),
            LinearizeAt::Steady => writeln!(text, "its steady state with the inputs of t = {t} s"),
            LinearizeAt::Mean => writeln!(text, "its steady state with the means of the inputs"),
        };
        self.push_point(&mut text);
        for held in &self.conserved {
            held.push_text(&mut text);
        }
        for matrix in self.matrices().iter().filter(|matrix| !matrix.is_empty()) {
            matrix.push_text(&mut text);
        }
        self.push_poles(&mut text);
        text
    }

    fn push_point(&self, text: &mut String) {
        let cells = |quantity: &PointQuantity| {
            [
                quantity.name.clone(),
                exact(quantity.value(), DIGITS),
                quantity.unit.symbol.to_string(),
            ]
        };
        if !self.states.is_empty() {
            // At a steady state, slopes are rounding errors.
            let columns = if self.place.is_rest() { 3 } else { 5 };
            let heads = ["state", "value", "unit", "slope", ""].map(str::to_owned);
            let mut table = vec![heads[..columns].to_vec()];
            for (state, rate) in self.states.iter().zip(&self.rates) {
                let [name, value, unit] = cells(state);
                let slope = exact(rate.value(), 3);
                let row = [name, value, unit, slope, rate.unit.symbol.to_string()];
                table.push(row[..columns].to_vec());
            }
            text.push('\n');
            push_table(text, &table);
        }
        let lists = [("input", &self.channels), ("late", &self.late), ("output", &self.outputs)];
        for (title, quantities) in lists.into_iter().filter(|(_, all)| !all.is_empty()) {
            let mut table = vec![[title, "value", "unit"].map(str::to_owned)];
            table.extend(quantities.iter().map(cells));
            text.push('\n');
            push_table(text, &table);
        }
        if !self.eliminated.is_empty() {
            let mut table = vec![["eliminated", "value", "unit", "by"].map(str::to_owned)];
            for (quantity, row) in &self.eliminated {
                let [name, value, unit] = cells(quantity);
                table.push([name, value, unit, self.signature.equations.get(*row).to_string()]);
            }
            text.push('\n');
            push_table(text, &table);
        }
        let modes: Vec<String> =
            self.modes().map(|(name, mode)| format!("{name}: {mode}")).collect();
        if !modes.is_empty() {
            let _ = writeln!(text, "\nthe linear model stays in these modes: {}", modes.join("; "));
        }
        for (output, tau) in self.late_outputs() {
            let late = if tau > 0.0 { "late" } else { "early" };
            let _ = writeln!(
                text,
                "\n`{}` is read {} s {late}: its value and its rows are without that",
                output.name,
                tau.abs()
            );
        }
    }

    fn push_poles(&self, text: &mut String) {
        text.push('\n');
        if self.poles.poles.is_empty() && self.poles.complete {
            text.push_str("no poles: nothing has a derivative\n");
            return;
        }
        let heads = ["pole", "", "time constant", "damping", "period", ""];
        let mut table = vec![heads.map(str::to_owned)];
        let mut conserved = self.conserved.iter();
        // One line for a conjugate pair.
        for pole in self.poles.poles.iter().filter(|pole| pole.im >= 0.0) {
            let im = if pole.im == 0.0 {
                String::new()
            } else {
                format!("± {}i", exact(pole.im, DIGITS))
            };
            let seconds = |value: f64| format!("{} s", exact(value, 5));
            let is_zero = pole.is_on_axis();
            let pole = if is_zero { &Pole { re: 0.0, ..*pole } } else { pole };
            let time = if is_zero { "-".to_owned() } else { seconds(pole.time_constant().abs()) };
            let or_none = |value: Option<String>| value.unwrap_or_default();
            let remark = match (is_zero, pole.re > 0.0) {
                (true, _) if pole.im == 0.0 => conserved
                    .next()
                    .map_or_else(|| "integrates".to_owned(), ConservedQuantity::pole),
                (true, _) => "oscillates for ever".to_owned(),
                (false, true) => "grows".to_owned(),
                (false, false) => String::new(),
            };
            table.push([
                format!("{} 1/s", exact(pole.re, DIGITS)),
                im,
                time,
                or_none(pole.damping().map(|damping| exact(damping, 4))),
                or_none(pole.period().map(seconds)),
                remark,
            ]);
        }
        push_table(text, &table);
        text.push_str(match self.stability_otherwise() {
            Stability::Stable if !self.conserved.is_empty() => {
                "stable otherwise: disturbances that leave what is conserved as it is fade\n"
            }
            Stability::Stable => "stable\n",
            Stability::Marginal => "on the border: poles on the imaginary axis, to rounding\n",
            Stability::Unstable => "unstable\n",
            Stability::Unknown => "no pole was found right of the imaginary axis\n",
        });
        if !self.poles.complete {
            text.push_str(
                "there are infinitely many poles, as unknowns act late; these are furthest to the right\n",
            );
        }
    }

    /// Stability with respect to disturbances that do not change conserved quantities.
    fn stability_otherwise(&self) -> Stability {
        let mut others = self.poles.clone();
        let mut zeros = self.conserved.len();
        others.poles.retain(|pole| {
            let is_own = zeros > 0 && pole.im == 0.0 && pole.is_on_axis();
            zeros -= usize::from(is_own);
            !is_own
        });
        others.stability()
    }

    /// The result, for programs.
    pub fn result(&self) -> LinearizeDocument {
        let states = self.states.iter().zip(&self.rates);
        let eliminated = self.eliminated.iter().map(|(own, row)| EliminatedEntry {
            quantity: own.entry(),
            by: self.signature.equations.get(*row).to_string(),
        });
        let channels = self.channels.iter().zip(&self.system.channels).map(|(own, channel)| {
            let (delay, slope) = match *channel {
                LinearInput::Input(_) => (0.0, false),
                LinearInput::Delayed { tau, .. } => (tau, false),
                LinearInput::Slope { tau, .. } => (tau, true),
            };
            let input = self.signature.inputs[channel.input()].name.to_string();
            LinearInputEntry { quantity: own.entry(), input, delay, slope }
        });
        let late = self.late.iter().zip(&self.system.delayed_unknowns).map(|(own, late)| {
            DelayedUnknownEntry {
                quantity: own.entry(),
                unknown: self.signature.unknowns.name(late.unknown).to_string(),
                delay: late.tau,
            }
        });
        let outputs = self.outputs.iter().zip(&self.system.output_delays);
        let modes = self.modes().map(|(modes, mode)| LinearModeEntry {
            modes: modes.to_owned(),
            mode: mode.to_owned(),
        });
        let poles = self.poles.poles.iter().map(|pole: &Pole| PoleEntry {
            re: pole.re,
            im: pole.im,
            time_constant: Some(pole.time_constant()).filter(|tau| tau.is_finite()),
            damping: pole.damping(),
            period: pole.period(),
        });
        let [a, b, c, d, a1, c1, e, f, g] = self.matrices().map(|matrix| matrix.rows_in_units());
        let is_conserving = !self.conserved.is_empty();
        LinearizeDocument {
            model: self.signature.name.to_string(),
            t: self.at.t,
            steady: self.place.is_rest(),
            states: states
                .map(|(state, rate)| LinearStateEntry {
                    quantity: state.entry(),
                    slope: rate.value(),
                })
                .collect(),
            inputs: channels.collect(),
            outputs: outputs
                .map(|(own, delay)| LinearOutputEntry { quantity: own.entry(), delay: *delay })
                .collect(),
            eliminated: eliminated.collect(),
            late: late.collect(),
            modes: modes.collect(),
            a,
            b,
            c,
            d,
            a1,
            c1,
            e,
            f,
            g,
            poles: poles.collect(),
            all_poles: self.poles.complete,
            stable: fades(self.poles.stability()),
            conserved: is_conserving
                .then(|| self.conserved.iter().map(ConservedQuantity::entry).collect()),
            otherwise: is_conserving.then(|| StabilityOtherwise {
                stable_otherwise: fades(self.stability_otherwise()),
            }),
            provenance: self.provenance.clone(),
        }
    }

    /// As JSON.
    pub fn to_json(&self) -> Value {
        json!(self.result())
    }

    /// A line for each entry of each matrix.
    pub fn write_csv(&self, out: &mut dyn io::Write) -> io::Result<()> {
        writeln!(out, "matrix,row,column,value,unit")?;
        for matrix in self.matrices() {
            for (i, row) in matrix.rows.iter().enumerate() {
                for (j, column) in matrix.columns.iter().enumerate() {
                    let mut number = String::new();
                    push_number(&mut number, matrix.value(i, j));
                    let cells = [&row.name, &column.name].map(|name| quoted(name));
                    let unit = quoted(&matrix.unit(i, j).symbol);
                    writeln!(out, "{},{},{number},{unit}", matrix.name, cells.join(","))?;
                }
            }
        }
        Ok(())
    }
}
