//! Arrays of parts, `part cell[1..N]: battery_cell`.
//!
//! Varying items get an index: unknowns and inputs become arrays, their equations loops, and so do all values that read
//! them. Constants, parameters, tables and functions stay single, unless an argument makes them vary. So all parts
//! share one text, however many they are.

use std::collections::BTreeSet;

use super::indices::{counters, indices_in, rename_index};
use super::names::names_in;
use crate::diagnostics::{Code, Diagnostic};
use crate::source::Span;
use crate::syntax::ast::{
    ArrayAxis, ArrayKind, Attribute, Expr, ExprKind, Item, ItemKind, LoopCounter, Name,
    PartArgument, Reaction, ResetClause, StartRule, VariantChoice, WrittenUnit,
};
use crate::syntax::visit;

/// Names and ranges of the indices of a part.
#[derive(Debug, Clone)]
pub(super) struct PartIndices {
    counters: Vec<LoopCounter>,
    /// Names of the indices in arguments, if they have any.
    written: Vec<Option<String>>,
}

impl PartIndices {
    /// The indices of a part with these items in its model, with names that are not `taken`.
    pub(super) fn new(
        part: &Name,
        axes: &[ArrayAxis],
        items: &mut [Item],
        taken: &BTreeSet<String>,
    ) -> PartIndices {
        if axes.is_empty() {
            return PartIndices { counters: Vec::new(), written: Vec::new() };
        }
        let mut taken = taken.clone();
        // A name that clashes with one of the whole is an error, as in a loop.
        for index in axes.iter().filter_map(|axis| axis.index.as_ref()) {
            taken.remove(&index.text);
        }
        taken.extend(indices_in(items));
        let counters = counters(axes, part.span, taken);
        let written = axes.iter().map(|axis| axis.index.as_ref().map(|name| name.text.clone()));
        PartIndices { counters, written: written.collect() }
    }

    pub(super) fn is_one(&self) -> bool {
        self.counters.is_empty()
    }

    /// An argument, with the indices renamed to those in the part.
    pub(super) fn argument(&self, argument: &PartArgument) -> PartArgument {
        let mut argument = argument.clone();
        for (counter, written) in self.counters.iter().zip(&self.written) {
            if let Some(written) = written {
                rename_index(&mut argument.value, written, &counter.index.text);
            }
        }
        argument
    }

    /// Whether an argument varies between parts. A list for an array has a value for each of its elements.
    pub(super) fn differs(&self, value: &Expr, is_array: bool) -> bool {
        let is_list = matches!(value.kind, ExprKind::List(_)) && !is_array;
        !self.is_one() && (self.reads_index(value) || is_list)
    }

    fn reads_index(&self, value: &Expr) -> bool {
        let mut names = BTreeSet::new();
        names_in(value, &mut names);
        self.counters.iter().any(|counter| names.contains(&counter.index.text))
    }

    /// Adds indices to varying names; initially, `given` are the names with varying arguments.
    pub(super) fn spread(
        &self,
        items: Vec<Item>,
        part: &Name,
        given: BTreeSet<String>,
    ) -> Result<Vec<Item>, Vec<Diagnostic>> {
        let each = what_differs(&items, given);
        let mut spreading =
            IndexSpreading { several: self, part, each: &each, mistakes: Vec::new() };
        let items = spreading.items(items);
        if spreading.mistakes.is_empty() { Ok(items) } else { Err(spreading.mistakes) }
    }
}

/// Varying names: unknowns, inputs, names with varying arguments, and values computed from these.
fn what_differs(items: &[Item], given: BTreeSet<String>) -> BTreeSet<String> {
    let mut each = given;
    let mut values: Vec<(&Name, BTreeSet<String>)> = Vec::new();
    visit::items(items, &mut |item| match &item.kind {
        ItemKind::Unknown { name, .. } | ItemKind::Input { name, .. } => {
            each.insert(name.text.clone());
        }
        ItemKind::Array { declared, name, start, .. } => {
            if declared.is_unknown() || *declared == ArrayKind::Input {
                each.insert(name.text.clone());
            } else if let Some(value) = start {
                let mut read = BTreeSet::new();
                names_in(value, &mut read);
                values.push((name, read));
            }
        }
        ItemKind::Constant { name, value, .. }
        | ItemKind::Parameter { name, value, .. }
        | ItemKind::Let { name, value, .. } => {
            let mut read = BTreeSet::new();
            names_in(value, &mut read);
            values.push((name, read));
        }
        _ => {}
    });
    loop {
        let n = each.len();
        for (name, read) in &values {
            if !read.is_disjoint(&each) {
                each.insert(name.text.clone());
            }
        }
        if each.len() == n {
            return each;
        }
    }
}

struct IndexSpreading<'a> {
    several: &'a PartIndices,
    part: &'a Name,
    each: &'a BTreeSet<String>,
    mistakes: Vec<Diagnostic>,
}

impl IndexSpreading<'_> {
    fn items(&mut self, items: Vec<Item>) -> Vec<Item> {
        items.into_iter().flat_map(|item| self.item(item)).collect()
    }

    fn item(&mut self, item: Item) -> Vec<Item> {
        let Item { span, doc, kind } = item;
        let with = |kind| vec![Item { span, doc: doc.clone(), kind }];
        match kind {
            ItemKind::Constant { ref name, .. } | ItemKind::Parameter { ref name, .. }
                if self.is_each(name) =>
            {
                let (declared, name, unit, value, attributes) = match kind {
                    ItemKind::Parameter { name, unit, value, attributes } => {
                        (ArrayKind::Parameter, name, unit, value, attributes)
                    }
                    ItemKind::Constant { name, unit, value } => {
                        (ArrayKind::Constant, name, unit, value, Vec::new())
                    }
                    _ => return Vec::new(),
                };
                if matches!(value.kind, ExprKind::List(_)) || self.is_made_of_indices(&value) {
                    let axes = self.axes(&[], [&value]);
                    let start = Some(value);
                    with(ItemKind::Array { declared, name, axes, unit, start, attributes })
                } else {
                    let unit = unit.unwrap_or_else(|| WrittenUnit::one(name.span));
                    let kind = ItemKind::Let { name, unit: Some(unit), value: self.expr(value) };
                    vec![self.in_loop(&[], vec![Item { span, doc, kind }], span)]
                }
            }
            ItemKind::Let { ref name, .. } if !self.is_each(name) => with(kind),
            ItemKind::Let { .. }
            | ItemKind::Equation { .. }
            | ItemKind::Start(StartRule::Equation { .. })
            | ItemKind::When(_)
            | ItemKind::Every { .. }
            | ItemKind::Saturate { .. } => {
                let item = self.indexed(Item { span, doc, kind });
                vec![self.in_loop(&[], vec![item], span)]
            }
            ItemKind::For { counters, items } => {
                let is_each = |item: &Item| match &item.kind {
                    ItemKind::Let { name, .. } => self.is_each(name),
                    _ => true,
                };
                let (each, same): (Vec<Item>, Vec<Item>) = items.into_iter().partition(is_each);
                let each: Vec<Item> = each.into_iter().map(|item| self.indexed(item)).collect();
                let mut bounds = Vec::new();
                if !same.is_empty() {
                    let kind = ItemKind::For { counters: counters.clone(), items: same };
                    bounds.extend(with(kind));
                }
                if !each.is_empty() {
                    bounds.push(self.in_loop(&counters, each, span));
                }
                bounds
            }
            ItemKind::Unknown { declared, name, unit, start, attributes } => {
                let declared = declared.of_elements();
                let start = start.map(|start| self.expr(start));
                let (attributes, read) = self.attributes(attributes);
                let axes = self.axes(&[], start.iter().chain(&read));
                with(ItemKind::Array { declared, name, axes, unit, start, attributes })
            }
            ItemKind::Input { name, unit, attributes } => {
                let (declared, axes) = (ArrayKind::Input, self.axes(&[], []));
                with(ItemKind::Array { declared, name, axes, unit, start: None, attributes })
            }
            ItemKind::Array { declared, name, axes, unit, start, attributes }
                if self.is_each(&name) =>
            {
                if let Some(Expr { kind: ExprKind::List(_), span }) = &start {
                    let message = format!(
                        "a list gives the elements of `{}` their values, not the parts `{}`",
                        name.text, self.part.text
                    );
                    self.mistakes.push(
                        Diagnostic::new(Code::ValueCount, *span, message)
                            .about(&name.text)
                            .about(&self.part.text)
                            .help("read an array with an index for each: `T_0[i][j]`"),
                    );
                }
                let start = start.map(|start| self.expr(start));
                let (attributes, read) = self.attributes(attributes);
                let axes = self.axes(&axes, start.iter().chain(&read));
                with(ItemKind::Array { declared, name, axes, unit, start, attributes })
            }
            ItemKind::Function { ref name, .. } | ItemKind::Table { ref name, .. } => {
                self.verify_shared(name, &kind);
                with(kind)
            }
            ItemKind::Variant { name, choices } => {
                let choices = choices
                    .into_iter()
                    .map(|choice| VariantChoice { items: self.items(choice.items), ..choice });
                let choices = choices.collect();
                with(ItemKind::Variant { name, choices })
            }
            ItemKind::Modes { name, .. } => self.refuse("`modes`", name.span),
            ItemKind::Constant { .. }
            | ItemKind::Parameter { .. }
            | ItemKind::Array { .. }
            | ItemKind::Import { .. }
            | ItemKind::Size { .. }
            | ItemKind::Unit { .. }
            | ItemKind::Output { .. }
            | ItemKind::Start(StartRule::Steady)
            | ItemKind::Part { .. }
            | ItemKind::Binding { .. } => with(kind),
        }
    }

    fn is_each(&self, name: &Name) -> bool {
        self.each.contains(&name.text)
    }

    /// Whether a value reads only indices, so that it can still be set.
    fn is_made_of_indices(&self, value: &Expr) -> bool {
        let mut names = BTreeSet::new();
        names_in(value, &mut names);
        let is_index =
            |name: &String| self.several.counters.iter().any(|counter| counter.index.text == *name);
        names.iter().all(is_index)
    }

    /// The part's indices in front of these, named if a value reads them.
    fn axes<'e>(
        &self,
        own: &[ArrayAxis],
        values: impl IntoIterator<Item = &'e Expr>,
    ) -> Vec<ArrayAxis> {
        let is_read = values.into_iter().any(|value| self.several.reads_index(value));
        let outer = self.several.counters.iter().map(|LoopCounter { index, range }| ArrayAxis {
            index: is_read.then(|| index.clone()),
            range: range.clone(),
        });
        outer.chain(own.iter().cloned()).collect()
    }

    /// Attributes with indices added to the varying names, and the expressions in them.
    fn attributes(&self, mut attributes: Vec<Attribute>) -> (Vec<Attribute>, Vec<Expr>) {
        let mut read = Vec::new();
        for attribute in &mut attributes {
            for expr in visit::attribute_expressions_mut(attribute) {
                self.index_names(expr);
                read.push(expr.clone());
            }
        }
        (attributes, read)
    }

    /// An item of a loop, with indices added to its names.
    fn indexed(&self, mut item: Item) -> Item {
        visit::parts_mut(&mut item, &mut |part| {
            if let visit::ItemPart::Expr(_, expr) = part {
                self.index_names(expr);
            }
        });
        match &mut item.kind {
            ItemKind::When(Reaction { resets, .. }) | ItemKind::Every { resets, .. } => {
                for ResetClause { name, indices, .. } in resets {
                    self.index_name(name, indices);
                }
            }
            ItemKind::Saturate { name, indices, .. } => self.index_name(name, indices),
            _ => {}
        }
        item
    }

    /// Adds the part's indices in front of those of a name.
    fn index_name(&self, name: &Name, indices: &mut Vec<Expr>) {
        if self.is_each(name) {
            indices.splice(0..0, self.indices(name.span));
        }
    }

    /// The part's indices as expressions.
    fn indices(&self, span: Span) -> impl Iterator<Item = Expr> {
        let counters = self.several.counters.iter();
        counters.map(move |c| Expr { span, kind: ExprKind::Name(c.index.text.clone()) })
    }

    fn in_loop(&self, inner: &[LoopCounter], items: Vec<Item>, span: Span) -> Item {
        let counters = self.several.counters.iter().chain(inner).cloned().collect();
        Item { span, doc: Vec::new(), kind: ItemKind::For { counters, items } }
    }

    /// An expression with indices added to the varying names.
    fn expr(&self, mut expr: Expr) -> Expr {
        self.index_names(&mut expr);
        expr
    }

    fn index_names(&self, expr: &mut Expr) {
        if let ExprKind::Name(name) = &expr.kind
            && self.each.contains(name)
        {
            for index in self.indices(expr.span) {
                let array = std::mem::replace(expr, index.clone());
                expr.kind = ExprKind::Element(Box::new(array), Box::new(index));
            }
            return;
        }
        for operand in visit::operands_mut(expr) {
            self.index_names(operand);
        }
    }

    /// Checks that functions and tables do not vary.
    fn verify_shared(&mut self, name: &Name, kind: &ItemKind) {
        let (what, values) = match kind {
            ItemKind::Function { lets, body, .. } => {
                ("function", lets.iter().map(|local| &local.value).chain([body]).collect())
            }
            ItemKind::Table { points, .. } => ("table", points.expressions()),
            _ => return,
        };
        let mut read = BTreeSet::new();
        for value in values {
            names_in(value, &mut read);
        }
        if let Some(differs) = read.intersection(self.each).next() {
            let part = &self.part.text;
            let name_text = &name.text;
            let message =
                format!("{what} `{name_text}` reads `{differs}`, which differs among `{part}`");
            self.mistakes.push(
                Diagnostic::new(Code::ArrayAsNumber, self.part.span, message)
                    .about(name_text)
                    .about(differs)
                    .about(part)
                    .label(name.span, "one for all of them")
                    .help("a function gets as an argument what differs from one to the next"),
            );
        }
    }

    fn refuse(&mut self, what: &str, place: Span) -> Vec<Item> {
        let part = &self.part.text;
        let message = format!("there cannot be several of part `{part}`, whose model has {what}");
        let help = format!("write a part for each: `part {part}_1: …`");
        self.mistakes.push(
            Diagnostic::new(Code::ItemInLoop, self.part.span, message)
                .about(part)
                .label(place, "here")
                .help(help),
        );
        Vec::new()
    }
}
