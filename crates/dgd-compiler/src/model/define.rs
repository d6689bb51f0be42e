//! The names of a model, and the order in which their values are evaluated.

use std::collections::BTreeMap;

use super::arrays::whole::NamedSizes;
use super::arrays::{ArrayPlace, ArrayShape, LetArray, Vector};
use super::check_units::{UnitSpelling, unit_of_declaration};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::Symbol;
use crate::expr::intrinsics::IntrinsicId;
use crate::source::Span;
use crate::syntax::ast::{
    ArrayKind, Attribute, AttributeKind, Expr, ExprKind, FormalArgument, Item, ItemKind, LocalLet,
    Name, StartRule, TablePoints, UnknownKind, VariantChoice, WrittenUnit,
};
use crate::syntax::visit;
use crate::units::{Dimension, Unit};

/// The definition of a name; numbers are positions among those of its kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NameDefinition {
    Time,
    Pi,
    Constant(u32),
    Parameter(u32),
    Input(u32),
    Unknown {
        index: u32,
        state: bool,
    },
    /// A size; its value is in [`ModelScope::sizes`].
    Size,
    /// An array of unknowns; its position is in [`ModelScope::arrays`].
    Array {
        index: usize,
        state: bool,
    },
    /// An array of constants, parameters or inputs, in [`ModelScope::vectors`].
    Vector(usize),
    /// A `let` of a loop, in [`ModelScope::let_arrays`].
    LetArray(usize),
    Let(usize),
    Function(usize),
    /// A table, in [`ModelScope::tables`].
    Table(usize),
}

impl NameDefinition {
    /// Its noun in messages.
    pub(super) fn noun(self) -> &'static str {
        match self {
            NameDefinition::Time => "the time",
            NameDefinition::Pi => "a number",
            NameDefinition::Constant(_) => "a constant",
            NameDefinition::Parameter(_) => "a parameter",
            NameDefinition::Input(_) => "an input",
            NameDefinition::Unknown { state: true, .. } => "a state",
            NameDefinition::Unknown { state: false, .. } => "an `unknown`",
            NameDefinition::Size => "a size",
            NameDefinition::Array { .. }
            | NameDefinition::Vector(_)
            | NameDefinition::LetArray(_) => "an array",
            NameDefinition::Let(_) => "a `let`",
            NameDefinition::Function(_) => "a function",
            NameDefinition::Table(_) => "a table",
        }
    }
}

/// A name, its definition and its place.
#[derive(Debug, Clone)]
pub(super) struct ScopeEntry {
    pub(super) definition: NameDefinition,
    pub(super) span: Span,
    /// Its unit, if it was declared with one.
    pub(super) unit: Option<Result<Unit, ErrorReported>>,
}

/// A function as declared.
#[derive(Debug, Clone, Copy)]
pub(super) struct FunctionDeclaration<'a> {
    pub(super) name: &'a str,
    pub(super) arguments: &'a [FormalArgument],
    pub(super) lets: &'a [LocalLet],
    pub(super) body: &'a Expr,
}

impl<'a> FunctionDeclaration<'a> {
    /// Names that its text reads and calls, except its own.
    fn names(&self) -> Vec<&'a str> {
        let mut names = Vec::new();
        for local in self.lets {
            names_in(&local.value, &mut names);
        }
        names_in(self.body, &mut names);
        let locals =
            self.arguments.iter().map(|a| &a.name).chain(self.lets.iter().map(|l| &l.name));
        let local_names: Vec<&str> = locals.map(|name| name.text.as_str()).collect();
        names.retain(|name| !local_names.contains(name));
        names
    }
}

/// A table as declared.
#[derive(Debug, Clone, Copy)]
pub(super) struct TableDeclaration<'a> {
    pub(super) name: &'a Name,
    pub(super) arguments: &'a [FormalArgument],
    pub(super) unit: Option<&'a WrittenUnit>,
    pub(super) points: &'a TablePoints,
    pub(super) attributes: &'a [Attribute],
}

impl<'a> TableDeclaration<'a> {
    /// Its `smooth` clause, with its place.
    pub(super) fn smooth(&self) -> Option<(&'a Expr, Span)> {
        self.attributes.iter().find_map(|attribute| match &attribute.kind {
            AttributeKind::Smooth(std) => Some((std, attribute.span)),
            _ => None,
        })
    }

    /// Names in its numbers.
    fn names(&self) -> Vec<&'a str> {
        let mut names = Vec::new();
        let smooth = self.smooth().map(|(std, _)| std);
        for number in self.points.expressions().into_iter().chain(smooth) {
            names_in(number, &mut names);
        }
        names
    }
}

/// All names of a model.
#[derive(Debug, Clone)]
pub(super) struct ModelScope<'a> {
    pub(super) names: BTreeMap<&'a str, ScopeEntry>,
    pub(super) functions: Vec<FunctionDeclaration<'a>>,
    pub(super) tables: Vec<TableDeclaration<'a>>,
    /// Filled in once settings are known, like the lists below.
    pub(super) sizes: NamedSizes<'a>,
    pub(super) arrays: Vec<Result<ArrayPlace<'a>, ErrorReported>>,
    pub(super) loops: Vec<Result<ArrayShape, ErrorReported>>,
    pub(super) let_arrays: Vec<LetArray<'a>>,
    /// Arrays of constants, parameters and inputs.
    pub(super) vectors: Vec<Vector<'a>>,
    /// Constants, parameters and inputs outside arrays; the elements of arrays follow them.
    pub(super) n_scalars: [u32; 3],
    /// Outputs have a namespace of their own: an output may have the name of its unknown.
    pub(super) outputs: BTreeMap<&'a str, Span>,
    /// The dimension of time.
    pub(super) second: Dimension,
    /// How units are spelt in messages.
    pub(super) spelling: UnitSpelling,
}

impl<'a> ModelScope<'a> {
    /// The dimension of a name declared with a unit.
    pub(super) fn dimension(&self, name: &str) -> Result<Dimension, ErrorReported> {
        match self.names.get(name).and_then(|entry| entry.unit.as_ref()) {
            Some(Ok(unit)) => Ok(unit.dimension),
            Some(Err(reported)) => Err(*reported),
            None => unreachable!("`{name}` is declared with a unit"),
        }
    }

    /// Whether a symbol is a state, or an element of an array of states.
    pub(super) fn is_state(&self, symbol: Symbol) -> bool {
        let holds = |array: &Result<ArrayPlace<'_>, ErrorReported>, i: u32| {
            array.as_ref().is_ok_and(|a| (a.first..a.first + a.count()).contains(&i))
        };
        self.names.values().any(|entry| match (entry.definition, symbol) {
            (NameDefinition::Unknown { index, state }, Symbol::Unknown(i)) => state && index == i,
            (NameDefinition::Array { index, state }, Symbol::Element(i)) => {
                state && self.arrays.get(index).is_some_and(|array| holds(array, i))
            }
            _ => false,
        })
    }

    pub(super) fn function_names(&self) -> impl Iterator<Item = &'a str> + '_ {
        let tables = self.tables.iter().map(|table| table.name.text.as_str());
        self.functions.iter().map(|function| function.name).chain(tables)
    }

    /// Name of a symbol; `None` for a constant because other symbols are named first.
    pub(super) fn quoted_name(&self, symbol: Symbol) -> Option<String> {
        let element = self.quoted_element(symbol);
        element.or_else(|| self.quoted_scalar(symbol))
    }

    fn quoted_scalar(&self, symbol: Symbol) -> Option<String> {
        self.names.iter().find_map(|(name, entry)| {
            let same = match (entry.definition, symbol) {
                (NameDefinition::Time, Symbol::Time) => true,
                (NameDefinition::Parameter(i), Symbol::Parameter(j))
                | (NameDefinition::Input(i), Symbol::Input(j)) => i == j,
                (
                    NameDefinition::Unknown { index, .. },
                    Symbol::Unknown(j) | Symbol::Derivative(j),
                ) => index == j,
                _ => false,
            };
            same.then(|| format!("`{name}`"))
        })
    }

    /// Collects what the items declare.
    pub(super) fn collect(items: &[&'a Item], diagnostics: &mut Diagnostics) -> ModelScope<'a> {
        let mut scope = ModelScope {
            names: BTreeMap::new(),
            functions: Vec::new(),
            tables: Vec::new(),
            sizes: NamedSizes::new(),
            arrays: Vec::new(),
            loops: Vec::new(),
            let_arrays: Vec::new(),
            vectors: Vec::new(),
            n_scalars: [0; 3],
            outputs: BTreeMap::new(),
            second: Dimension::from_exponents([0, 0, 1, 0, 0, 0, 0]),
            spelling: UnitSpelling::default(),
        };
        for (name, definition) in [("time", NameDefinition::Time), ("pi", NameDefinition::Pi)] {
            let entry = ScopeEntry { definition, span: Span::default(), unit: None };
            scope.names.insert(name, entry);
        }
        let mut labels: BTreeMap<&str, Span> = BTreeMap::new();
        let mut automata: BTreeMap<&str, Span> = BTreeMap::new();
        let mut counts = [0u32; 4];
        let mut next = |kind: usize| {
            counts[kind] += 1;
            counts[kind] - 1
        };
        let mut lets = 0;
        let (mut arrays, mut let_arrays) = (0, 0);
        for item in items {
            let (name, definition, unit) = match &item.kind {
                ItemKind::Constant { name, unit, value } => {
                    (name, NameDefinition::Constant(next(0)), Some((unit, Some(value))))
                }
                ItemKind::Parameter { name, unit, value, .. } => {
                    (name, NameDefinition::Parameter(next(1)), Some((unit, Some(value))))
                }
                ItemKind::Input { name, unit, .. } => {
                    (name, NameDefinition::Input(next(2)), Some((unit, None)))
                }
                ItemKind::Unknown { declared, name, unit, start, .. } => {
                    let state = *declared != UnknownKind::Unknown;
                    let definition = NameDefinition::Unknown { index: next(3), state };
                    (name, definition, Some((unit, start.as_ref())))
                }
                ItemKind::Let { name, .. } => {
                    lets += 1;
                    (name, NameDefinition::Let(lets - 1), None)
                }
                ItemKind::Size { name, .. } => (name, NameDefinition::Size, None),
                ItemKind::Array { declared, name, unit, .. } if declared.is_unknown() => {
                    arrays += 1;
                    let state = *declared == ArrayKind::State;
                    (name, NameDefinition::Array { index: arrays - 1, state }, Some((unit, None)))
                }
                ItemKind::Array { declared, name, axes, unit, start, .. } => {
                    scope.vectors.push(Vector {
                        kind: *declared,
                        name,
                        axes,
                        value: start.as_ref(),
                        place: Ok(ArrayPlace::nowhere(name)),
                    });
                    (
                        name,
                        NameDefinition::Vector(scope.vectors.len() - 1),
                        Some((unit, start.as_ref())),
                    )
                }
                ItemKind::For { items, .. } => {
                    scope.collect_loop(items, &mut let_arrays, &mut labels, diagnostics);
                    continue;
                }
                ItemKind::Function { name, arguments, lets, body } => {
                    scope.functions.push(FunctionDeclaration {
                        name: &name.text,
                        arguments,
                        lets,
                        body,
                    });
                    check_function(name, arguments, lets, diagnostics);
                    (name, NameDefinition::Function(scope.functions.len() - 1), None)
                }
                ItemKind::Table { name, arguments, unit, points, attributes } => {
                    scope.tables.push(TableDeclaration {
                        name,
                        arguments,
                        unit: unit.as_ref(),
                        points,
                        attributes,
                    });
                    check_function(name, arguments, &[], diagnostics);
                    (name, NameDefinition::Table(scope.tables.len() - 1), None)
                }
                ItemKind::Output { name, unit, .. } => {
                    unique(&mut scope.outputs, name, "output", diagnostics);
                    // Invalid ones are reported with the output.
                    if let Some(Ok(unit)) = unit.as_ref().map(WrittenUnit::read) {
                        scope.spelling.learn(&unit);
                    }
                    continue;
                }
                ItemKind::Equation { label, .. }
                | ItemKind::Start(StartRule::Equation { label, .. }) => {
                    unique(&mut labels, label, "equation", diagnostics);
                    continue;
                }
                ItemKind::Modes { name, modes, .. } => {
                    unique(&mut automata, name, "`modes` block", diagnostics);
                    labels_of_modes(modes, &mut labels, diagnostics);
                    continue;
                }
                ItemKind::Import { .. }
                | ItemKind::Variant { .. }
                | ItemKind::Part { .. }
                | ItemKind::Binding { .. }
                | ItemKind::When(_)
                | ItemKind::Every { .. }
                | ItemKind::Unit { .. }
                | ItemKind::Start(StartRule::Steady)
                | ItemKind::Saturate { .. } => continue,
            };
            let unit = unit
                .map(|(unit, value)| unit_of_declaration(name, unit.as_ref(), value, diagnostics));
            if let Some(Ok(unit)) = &unit {
                scope.spelling.learn(unit);
            }
            scope.insert(name, ScopeEntry { definition, span: name.span, unit }, diagnostics);
        }
        scope.n_scalars = [counts[0], counts[1], counts[2]];
        scope.verify_points(diagnostics);
        scope
    }

    /// Collects the declarations in a loop.
    fn collect_loop(
        &mut self,
        items: &'a [Item],
        let_arrays: &mut usize,
        labels: &mut BTreeMap<&'a str, Span>,
        diagnostics: &mut Diagnostics,
    ) {
        for item in items {
            match &item.kind {
                ItemKind::Equation { label, .. }
                | ItemKind::Start(StartRule::Equation { label, .. }) => {
                    unique(labels, label, "equation", diagnostics);
                }
                ItemKind::Let { name, .. } => {
                    let definition = NameDefinition::LetArray(*let_arrays);
                    *let_arrays += 1;
                    let entry = ScopeEntry { definition, span: name.span, unit: None };
                    self.insert(name, entry, diagnostics);
                }
                _ => {}
            }
        }
    }

    /// Checks that no other name is `pump_c0`, the name of `pump.c0` in generated code.
    fn verify_points(&self, diagnostics: &mut Diagnostics) {
        let values = self.names.iter().map(|(name, entry)| (*name, entry.span));
        let outputs = self.outputs.iter().map(|(name, span)| (*name, *span));
        let sets: [Vec<(&str, Span)>; 2] = [values.collect(), outputs.collect()];
        for names in sets.iter().filter(|names| names.iter().any(|(name, _)| name.contains('.'))) {
            let mut written: BTreeMap<String, (&str, Span)> = BTreeMap::new();
            for (name, span) in names {
                let Some((first, place)) = written.insert(name.replace('.', "_"), (name, *span))
                else {
                    continue;
                };
                let message = format!("`{first}` and `{name}` are one name in generated code");
                let meant = if first.contains('.') { first } else { name };
                diagnostics.error(
                    Diagnostic::new(Code::DuplicateName, *span, message).about(&first).about(&name)
                        .label(place, "the other one")
                        .help(format!(
                            "rename one of them, as `_` stands for the point there; or is `{meant}` meant?"
                        )),
                );
            }
        }
    }

    fn insert(&mut self, name: &'a Name, entry: ScopeEntry, diagnostics: &mut Diagnostics) {
        match self.names.get(name.text.as_str()) {
            None => {
                self.names.insert(&name.text, entry);
            }
            Some(ScopeEntry { definition: NameDefinition::Time | NameDefinition::Pi, .. }) => {
                diagnostics.error(
                    Diagnostic::new(
                        Code::DuplicateName,
                        name.span,
                        format!("`{}` has a meaning in every model", name.text),
                    )
                    .about(&name.text)
                    .help("choose another name"),
                );
            }
            Some(earlier) => {
                diagnostics.error(
                    Diagnostic::new(
                        Code::DuplicateName,
                        name.span,
                        format!("`{}` is declared twice", name.text),
                    )
                    .about(&name.text)
                    .label(earlier.span, "first here"),
                );
            }
        }
    }
}

/// Checks the names of a function and its arguments.
fn check_function(
    name: &Name,
    arguments: &[FormalArgument],
    lets: &[LocalLet],
    diagnostics: &mut Diagnostics,
) {
    let is_taken = |function: IntrinsicId| !function.get().yields;
    if name.text == "der" || IntrinsicId::find(&name.text).is_some_and(is_taken) {
        diagnostics.error(
            Diagnostic::new(
                Code::DuplicateName,
                name.span,
                format!("`{}` is a function of the language", name.text),
            )
            .about(&name.text)
            .help("choose another name"),
        );
    }
    let mut spans_by_name = BTreeMap::new();
    for argument in arguments {
        unique(&mut spans_by_name, &argument.name, "argument", diagnostics);
    }
    for (i, local) in lets.iter().enumerate() {
        unique(&mut spans_by_name, &local.name, "value", diagnostics);
        let early = lets[i..]
            .iter()
            .find_map(|later| read_of(&later.name.text, &local.value).map(|place| (later, place)));
        if let Some((later, place)) = early {
            let message = format!("`{}` is read before its own line", later.name.text);
            diagnostics.error(
                Diagnostic::new(Code::CircularDefinition, place, message)
                    .about(&later.name.text)
                    .label(later.name.span, "declared here")
                    .help("a `let` of a function reads those above it"),
            );
        }
    }
}

/// The place where a value reads a name.
fn read_of(name: &str, expr: &Expr) -> Option<Span> {
    if matches!(&expr.kind, ExprKind::Name(read) if read == name) {
        return Some(expr.span);
    }
    visit::operands(expr).into_iter().find_map(|operand| read_of(name, operand))
}

/// Labels in a `modes` block. Modes exclude each other, so another mode may use the same label.
fn labels_of_modes<'a>(
    modes: &'a [VariantChoice],
    labels: &mut BTreeMap<&'a str, Span>,
    diagnostics: &mut Diagnostics,
) {
    let common = labels.clone();
    for mode in modes {
        let mut labels_of_mode = common.clone();
        for item in &mode.items {
            if let ItemKind::Equation { label, .. } = &item.kind {
                unique(&mut labels_of_mode, label, "equation", diagnostics);
            }
        }
        labels.extend(labels_of_mode);
    }
}

fn unique<'a>(
    seen: &mut BTreeMap<&'a str, Span>,
    name: &'a Name,
    what: &str,
    diagnostics: &mut Diagnostics,
) {
    match seen.get(name.text.as_str()) {
        None => {
            seen.insert(&name.text, name.span);
        }
        Some(first) => {
            diagnostics.error(
                Diagnostic::new(
                    Code::DuplicateName,
                    name.span,
                    format!("two {what}s are called `{}`", name.text),
                )
                .about(&name.text)
                .label(*first, "first here"),
            );
        }
    }
}

/// Constants and `let`s, ordered so that each needs only earlier ones.
///
/// A cycle is reported with its chain; its members are left out.
pub(super) fn in_order<'a>(
    items: &[&'a Item],
    scope: &ModelScope<'a>,
    replaced: &BTreeMap<&str, &'a Expr>,
    diagnostics: &mut Diagnostics,
) -> Vec<(&'a Item, Result<(), ErrorReported>)> {
    let mut values: Vec<(&'a Item, &'a Name, &'a Expr)> = Vec::new();
    for item in items {
        if let ItemKind::Constant { name, value, .. }
        | ItemKind::Let { name, value, .. }
        | ItemKind::Array { declared: ArrayKind::Constant, name, start: Some(value), .. } =
            &item.kind
        {
            let value = replaced.get(name.text.as_str()).copied().unwrap_or(value);
            values.push((item, name, value));
        }
    }
    let position: BTreeMap<&str, usize> =
        values.iter().enumerate().map(|(i, (_, name, _))| (name.text.as_str(), i)).collect();
    let bodies: BTreeMap<&str, Vec<&str>> = scope
        .functions
        .iter()
        .map(|function| (function.name, function.names()))
        .chain(scope.tables.iter().map(|table| (table.name.text.as_str(), table.names())))
        .chain(scope.let_arrays.iter().map(|array| {
            let mut names = Vec::new();
            names_in(array.value, &mut names);
            names.retain(|n| array.counters.iter().all(|counter| counter.index.text != *n));
            (array.name, names)
        }))
        .collect();

    // The values that each value needs, also through the functions that it calls.
    let needs: Vec<Vec<usize>> = values
        .iter()
        .map(|(_, _, value)| {
            let mut pending = Vec::new();
            names_in(value, &mut pending);
            let mut visited = std::collections::BTreeSet::new();
            let mut needed = Vec::new();
            while let Some(name) = pending.pop() {
                if !visited.insert(name) {
                    continue;
                }
                needed.extend(position.get(name).copied());
                if let Some(names) = bodies.get(name) {
                    pending.extend(names.iter().copied());
                }
            }
            needed.sort_unstable();
            needed
        })
        .collect();

    // Depth first, without recursion; a value met again while it is on the path closes a cycle.
    let mut state = vec![VisitState::New; values.len()];
    let mut order = Vec::with_capacity(values.len());
    for start in 0..values.len() {
        if state[start] != VisitState::New {
            continue;
        }
        let mut path = vec![(start, 0)];
        state[start] = VisitState::Open;
        while let Some((value, next)) = path.last_mut() {
            let value = *value;
            let Some(&needed) = needs[value].get(*next) else {
                if state[value] == VisitState::Open {
                    order.push((values[value].0, Ok(())));
                    state[value] = VisitState::Done;
                }
                path.pop();
                continue;
            };
            *next += 1;
            match state[needed] {
                VisitState::New => {
                    state[needed] = VisitState::Open;
                    path.push((needed, 0));
                }
                VisitState::Done | VisitState::Failed => {}
                VisitState::Open => {
                    let from = path.iter().position(|(v, _)| *v == needed).unwrap_or(0);
                    let cycle: Vec<usize> = path[from..].iter().map(|(v, _)| *v).collect();
                    let reported = report_cycle(&cycle, &values, diagnostics);
                    for v in cycle {
                        if state[v] == VisitState::Open {
                            order.push((values[v].0, Err(reported)));
                            state[v] = VisitState::Failed;
                        }
                    }
                }
            }
        }
    }
    order
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum VisitState {
    New,
    Open,
    Done,
    Failed,
}

fn report_cycle(
    cycle: &[usize],
    values: &[(&Item, &Name, &Expr)],
    diagnostics: &mut Diagnostics,
) -> ErrorReported {
    let chain: Vec<String> =
        cycle.iter().chain(cycle.first()).map(|v| format!("`{}`", values[*v].1.text)).collect();
    let first = values[cycle[0]].1;
    let shown = if chain.len() > 8 {
        format!("{} → … → {}", chain[..3].join(" → "), chain[chain.len() - 2..].join(" → "))
    } else {
        chain.join(" → ")
    };
    let mut diagnostic = Diagnostic::new(
        Code::CircularDefinition,
        first.span,
        format!("`{}` depends on itself: {shown}", first.text),
    )
    .about(&first.text)
    .help("an unknown that an equation determines can depend on itself; a `let` cannot");
    for v in cycle.iter().skip(1).take(3) {
        diagnostic = diagnostic.label(values[*v].1.span, "through this");
    }
    diagnostics.error(diagnostic)
}

/// Every name read or called in an expression.
pub(super) fn names_in<'a>(expr: &'a Expr, names: &mut Vec<&'a str>) {
    match &expr.kind {
        ExprKind::Number { .. } => {}
        ExprKind::Name(name) => names.push(name),
        ExprKind::Call { function, arguments } => {
            names.push(&function.text);
            for argument in arguments {
                names_in(argument, names);
            }
        }
        ExprKind::List(values) => values.iter().for_each(|value| names_in(value, names)),
        ExprKind::Reduce(reduction) => {
            let mut names_in_body = Vec::new();
            names_in(&reduction.body, &mut names_in_body);
            names_in_body
                .retain(|n| reduction.counters.iter().all(|counter| counter.index.text != *n));
            names.extend(names_in_body);
            for range in reduction.counters.iter().map(|counter| &counter.range) {
                names_in(&range.lower, names);
                names_in(&range.upper, names);
            }
        }
        ExprKind::Group(a) | ExprKind::Negate(a) | ExprKind::Not(a) => names_in(a, names),
        ExprKind::Sum(terms) => terms.iter().for_each(|(_, term)| names_in(term, names)),
        ExprKind::Product(factors) => factors.iter().for_each(|(_, f)| names_in(f, names)),
        ExprKind::Element(a, b) | ExprKind::Power(a, b) | ExprKind::Compare(_, a, b) => {
            names_in(a, names);
            names_in(b, names);
        }
        ExprKind::If(a, b, c) => {
            for part in [a, b, c] {
                names_in(part, names);
            }
        }
        ExprKind::And(parts) | ExprKind::Or(parts) => {
            for part in parts {
                names_in(part, names);
            }
        }
    }
}
