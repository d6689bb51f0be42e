//! A model as a page in Markdown: its documentation, tables of its declarations, and
//! its typeset equations.
//!
//! Formulas use the fences and inline marks that GitHub and most Markdown readers support; names in the text stay as
//! they are.

use std::fmt::Write;

use super::formula::{
    DocumentedLine, Formula, FormulaLine, MathSymbol, documented, expression, for_each_item,
};
use super::latex;
use crate::diagnostics::Diagnostics;
use crate::model::Model;
use crate::parts;
use crate::syntax::ast::{
    ArrayAxis, ArrayKind, Ast, Attribute, AttributeKind, Expr, Item, ItemKind, Name,
    TableExtrapolation, TablePoints, UnknownKind, WrittenUnit,
};

/// Writes the page of a model; `commands` are the lines that run it.
pub fn write(asts: &[Ast], model: &Model, commands: &[String]) -> String {
    let mut text = format!("# {}\n", escaped(&model.name));
    push_doc(&mut text, &model.doc);
    // The model was made from these trees, so they expand without errors.
    let expanded = parts::expand(asts, &mut Diagnostics::default());
    let mut declarations = DeclarationRows::default();
    for ast in expanded.iter().flat_map(|expanded| expanded.asts.iter()).rev() {
        for_each_item(&ast.items, model, &mut |item| declarations.add(item));
    }
    push_run(&mut text, model, commands);
    for (title, table) in declarations.tables() {
        if table.len() > 1 {
            let _ = writeln!(text, "\n## {title}\n");
            push_table(&mut text, &table);
        }
    }
    let lines = documented(asts, model);
    let (outputs, equations): (Vec<DocumentedLine>, Vec<DocumentedLine>) =
        lines.into_iter().partition(|line| line.is_output);
    for (title, lines) in [("Equations", equations), ("What the outputs are", outputs)] {
        if !lines.is_empty() {
            let _ = writeln!(text, "\n## {title}");
            push_equations(&mut text, &lines);
        }
    }
    text
}

/// How to run it, the choices made, and its parts.
fn push_run(text: &mut String, model: &Model, commands: &[String]) {
    let _ = write!(text, "\n```sh\n{}\n```\n", commands.join("\n"));
    // A variant without alternatives needs no mention.
    for variant in model.variants.iter().filter(|variant| variant.choices.len() > 1) {
        let choices: Vec<String> =
            variant.choices.iter().map(|choice| format!("`{choice}`")).collect();
        let chosen = variant.choice();
        let _ = writeln!(
            text,
            "\nVariant `{}`: {}. This page shows `{chosen}`.",
            variant.name,
            choices.join(", ")
        );
    }
    if !model.parts.is_empty() {
        text.push_str("\nIts parts:\n\n");
        for part in &model.parts {
            let doc = inline_doc(&part.doc);
            let doc = if doc.is_empty() { doc } else { format!(": {doc}") };
            let _ = writeln!(text, "- `{}` is a `{}`{doc}", part.name, part.model);
        }
    }
}

/// Rows of the tables, heads first.
struct DeclarationRows {
    inputs: Vec<Vec<String>>,
    unknowns: Vec<Vec<String>>,
    parameters: Vec<Vec<String>>,
    constants: Vec<Vec<String>>,
    outputs: Vec<Vec<String>>,
    curves: Vec<Vec<String>>,
    units: Vec<Vec<String>>,
}

impl Default for DeclarationRows {
    fn default() -> Self {
        let heads = |heads: &[&str]| vec![heads.iter().map(|&head| head.to_owned()).collect()];
        Self {
            inputs: heads(&["", "name", "unit", "between samples", ""]),
            unknowns: heads(&["", "name", "unit", "starts at", ""]),
            parameters: heads(&["", "name", "value", "unit", "bounds", ""]),
            constants: heads(&["", "name", "value", "unit", ""]),
            outputs: heads(&["", "name", "unit", "noise", ""]),
            curves: heads(&["", "name", "argument", "unit", "points", "beyond", ""]),
            units: heads(&["name", "value", ""]),
        }
    }
}

impl DeclarationRows {
    fn tables(self) -> [(&'static str, Vec<Vec<String>>); 7] {
        [
            ("Inputs", self.inputs),
            ("States and unknowns", self.unknowns),
            ("Outputs", self.outputs),
            ("Parameters", self.parameters),
            ("Constants", self.constants),
            ("Tables", self.curves),
            ("Units", self.units),
        ]
    }

    fn add(&mut self, item: &Item) {
        let doc = inline_doc(&item.doc);
        let first = |name: &Name, unit: &Option<WrittenUnit>| {
            let unit = unit.as_ref().map_or("1", |unit| &unit.text);
            [symbol(&name.text), format!("`{}`", name.text), cell(unit)]
        };
        match &item.kind {
            ItemKind::Input { name, unit, attributes } => {
                let goes = goes_on(attributes);
                self.inputs.push([&first(name, unit)[..], &[goes, doc]].concat());
            }
            ItemKind::Unknown { declared, name, unit, start, .. } => {
                let start = [start_of(*declared, start.as_ref()), doc];
                self.unknowns.push([&first(name, unit)[..], &start].concat());
            }
            ItemKind::Array { declared, name, axes, unit, start, attributes } => {
                let [symbol, _, unit] = first(name, unit);
                let range = |ArrayAxis { range, .. }: &ArrayAxis| {
                    format!("{} to {}", math(&range.lower), math(&range.upper))
                };
                let ranges: Vec<String> = axes.iter().map(range).collect();
                let name = format!("`{}`, {}", name.text, ranges.join(" × "));
                let start = start.as_ref();
                match declared {
                    ArrayKind::State | ArrayKind::Unknown | ArrayKind::Held => {
                        let kind = match declared {
                            ArrayKind::State => UnknownKind::State,
                            ArrayKind::Held => UnknownKind::Held,
                            _ => UnknownKind::Unknown,
                        };
                        self.unknowns.push(vec![symbol, name, unit, start_of(kind, start), doc]);
                    }
                    ArrayKind::Parameter => {
                        let (value, bounds) =
                            (start.map_or_else(String::new, math), bounds(attributes));
                        let doc = with_fixed(attributes, doc);
                        self.parameters.push(vec![symbol, name, value, unit, bounds, doc]);
                    }
                    ArrayKind::Constant => {
                        let value = start.map_or_else(String::new, math);
                        self.constants.push(vec![symbol, name, value, unit, doc]);
                    }
                    ArrayKind::Input => {
                        self.inputs.push(vec![symbol, name, unit, goes_on(attributes), doc]);
                    }
                }
            }
            ItemKind::Parameter { name, unit, value, attributes } => {
                let [symbol, name, unit] = first(name, unit);
                let bounds = bounds(attributes);
                let doc = with_fixed(attributes, doc);
                self.parameters.push(vec![symbol, name, math(value), unit, bounds, doc]);
            }
            ItemKind::Constant { name, unit, value } => {
                let [symbol, name, unit] = first(name, unit);
                self.constants.push(vec![symbol, name, math(value), unit, doc]);
            }
            ItemKind::Unit { name, value } => {
                let name = format!("`[{}]`", name.text);
                self.units.push(vec![name, math(value), doc]);
            }
            ItemKind::Size { name, value } => {
                let [symbol, name, unit] = first(name, &None);
                self.constants.push(vec![symbol, name, math(value), unit, doc]);
            }
            ItemKind::Table { name, arguments, unit, points, attributes } => {
                let [symbol, name, unit] = first(name, unit);
                let arguments = arguments.iter().map(|a| {
                    let unit = a.unit.as_ref().map_or("1", |unit| &unit.text);
                    format!("`{}` in {}", a.name.text, cell(unit))
                });
                let arguments = arguments.collect::<Vec<_>>().join(", ");
                let n = match points {
                    TablePoints::Written(points) => points.len(),
                    TablePoints::Columns([x, _]) => x.len(),
                    TablePoints::File { rows, .. } => rows.iter().flatten().flatten().count(),
                };
                let beyond = attributes.iter().find_map(|attribute| match attribute.kind {
                    AttributeKind::Beyond(beyond) => Some(beyond),
                    _ => None,
                });
                let beyond = beyond.unwrap_or(TableExtrapolation::Refuse).word().to_owned();
                self.curves.push(vec![symbol, name, arguments, unit, n.to_string(), beyond, doc]);
            }
            ItemKind::Output { name, unit, attributes, .. } => {
                let noise = attributes.iter().find_map(|attribute| match &attribute.kind {
                    AttributeKind::Noise(noise) => Some(math(noise)),
                    _ => None,
                });
                let [symbol, name, _] = first(name, unit);
                // An output without a unit has that of the unknown.
                let unit = unit.as_ref().map_or_else(String::new, |unit| cell(&unit.text));
                self.outputs.push(vec![symbol, name, unit, noise.unwrap_or_default(), doc]);
            }
            _ => {}
        }
    }
}

fn start_of(declared: UnknownKind, start: Option<&Expr>) -> String {
    let start = start.map_or_else(|| "0".to_owned(), math);
    match declared {
        UnknownKind::State => start,
        UnknownKind::Held => format!("{start}, held"),
        UnknownKind::Unknown => format!("{start} (a guess)"),
    }
}

/// Interpolation of an input between samples.
fn goes_on(attributes: &[Attribute]) -> String {
    let is_linear = attributes.iter().any(|a| matches!(a.kind, AttributeKind::Linear));
    if is_linear { "a straight line" } else { "holds" }.to_owned()
}

/// A parameter's doc comment, extended by whether it is fixed.
fn with_fixed(attributes: &[Attribute], doc: String) -> String {
    let is_fixed = attributes.iter().any(|a| matches!(a.kind, AttributeKind::Fixed));
    match (is_fixed, doc.is_empty()) {
        (false, _) => doc,
        (true, true) => "fixed".to_owned(),
        (true, false) => format!("{doc}; fixed"),
    }
}

fn bounds(attributes: &[Attribute]) -> String {
    let interval = attributes.iter().find_map(|attribute| match &attribute.kind {
        AttributeKind::Bounds(lower, upper) => Some((lower, upper)),
        _ => None,
    });
    match interval {
        Some((Some(lower), Some(upper))) => format!("{} to {}", math(lower), math(upper)),
        Some((Some(lower), None)) => format!("from {}", math(lower)),
        Some((None, Some(upper))) => format!("up to {}", math(upper)),
        Some((None, None)) | None => String::new(),
    }
}

/// Blocks of equations; a line with a doc comment starts a new block after it.
fn push_equations(text: &mut String, lines: &[DocumentedLine]) {
    let mut from = 0;
    while from < lines.len() {
        let more = lines[from + 1..].iter().take_while(|line| line.doc.is_empty()).count();
        let until = from + 1 + more;
        push_doc(text, &lines[from].doc);
        let rows: Vec<String> = lines[from..until].iter().map(row).collect();
        let _ = writeln!(
            text,
            "\n```math\n\\begin{{aligned}}\n  {}\n\\end{{aligned}}\n```",
            rows.join(" \\\\\n  ")
        );
        from = until;
    }
}

/// A line, followed by its label and the indices for which it holds.
fn row(DocumentedLine { line, counters, .. }: &DocumentedLine) -> String {
    let (mut text, label) = match line {
        FormulaLine::Equation { left, right, label } => {
            let unlabelled =
                FormulaLine::Equation { left: left.clone(), right: right.clone(), label: None };
            (latex::line(&unlabelled), label.as_deref())
        }
        FormulaLine::Mode(_) | FormulaLine::Transition(_) | FormulaLine::Bound { .. } => {
            (latex::line(line), None)
        }
    };
    for [index, first, last] in counters {
        let [index, first, last] = [index, first, last].map(latex::formula);
        let _ = write!(text, ", \\quad {index} = {first}, \\dots, {last}");
    }
    if let Some(label) = label {
        let _ = write!(text, " && {}", latex::upright(label));
    }
    text
}

fn push_doc(text: &mut String, doc: &[String]) {
    if doc.iter().any(|line| !line.trim().is_empty()) {
        text.push('\n');
        for line in doc {
            let _ = writeln!(text, "{}", escaped(line.trim()));
        }
    }
}

fn inline_doc(doc: &[String]) -> String {
    let lines: Vec<&str> = doc.iter().map(|line| line.trim()).collect();
    cell(lines.join(" ").trim())
}

fn push_table(text: &mut String, rows: &[Vec<String>]) {
    for (i, row) in rows.iter().enumerate() {
        let _ = writeln!(text, "| {} |", row.join(" | "));
        if i == 0 {
            let _ = writeln!(text, "|{}", "---|".repeat(row.len()));
        }
    }
}

fn symbol(name: &str) -> String {
    inline(&Formula::Symbol(MathSymbol::from_name(name)))
}

fn math(expr: &Expr) -> String {
    match expression(expr) {
        // No typesetting needed.
        Formula::Number { digits, exponent: None, unit: None } => digits,
        formula => inline(&formula),
    }
}

fn inline(formula: &Formula) -> String {
    format!("$`{}`$", latex::formula(formula).replace('|', "\\vert "))
}

/// Text in a table.
fn cell(text: &str) -> String {
    escaped(text).replace('|', "\\|")
}

/// Text with the special characters of Markdown escaped.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        if matches!(c, '\\' | '*' | '_' | '<' | '$' | '#' | '[' | ']') {
            escaped.push('\\');
        }
        escaped.push(c);
    }
    escaped
}
