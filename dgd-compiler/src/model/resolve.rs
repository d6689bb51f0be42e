//! Ast → Model: names are looked up, units checked, variants chosen, values brought to SI.

use std::collections::BTreeMap;

use super::check_units::Dim;
use super::define::{Definition, Scope, in_order};
use super::expression::{Lowering, Typed, is_plain, unit_of};
use super::{
    Constant, Declared, Equation, Input, Interpolation, Let, Model, Output, Parameter, Unknown,
    Variant,
};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, Reported, suggestion};
use crate::expr::{ExprId, Symbol};
use crate::source::Span;
use crate::syntax::ast::{
    Ast, Attribute, AttributeKind, Choice, Expr, Item, ItemKind, Name, Unit as WrittenUnit,
    UnknownKind,
};
use crate::units::{Unit, describe};

/// What is chosen and set from outside the model file.
#[derive(Debug, Clone, Default)]
pub struct ModelOptions {
    /// Choices of variants; those not named keep their first.
    pub variants: Vec<(Name, Name)>,
    /// New values of constants and parameters and start values of unknowns.
    pub settings: Vec<Setting>,
}

/// `name = value`, given from outside; a plain number is in the declared unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// What is set.
    pub name: Name,
    /// Its new value.
    pub value: Expr,
}

/// Makes a model of a file and the libraries that it imports.
///
/// # Errors
///
/// [`Reported`] after at least one diagnostic; as many independent mistakes as possible are
/// reported in one go.
pub fn resolve(
    asts: &[Ast],
    options: &ModelOptions,
    diagnostics: &mut Diagnostics,
) -> Result<Model, Reported> {
    let [main, libraries @ ..] = asts else {
        unreachable!("a compilation has a main file");
    };
    let Some(header) = &main.model else {
        let start = Span { source: main.source, start: 0, end: 0 };
        return Err(diagnostics.error(
            Diagnostic::new(Code::E113, start, "this file does not say which model it is").help(
                "begin it with `model NAME`; a library without that line can only be imported",
            ),
        ));
    };

    let mut variants = Vec::new();
    let mut items: Vec<&Item> = libraries.iter().flat_map(|library| &library.items).collect();
    choose(&main.items, options, &mut items, &mut variants, diagnostics);
    for (variant, _) in &options.variants {
        if !variants.iter().any(|v| v.name == variant.text) {
            diagnostics.error(unknown_choice(
                variant,
                &format!("there is no variant `{}`", variant.text),
                variants.iter().map(|v| v.name.as_str()),
            ));
        }
    }

    let scope = Scope::collect(&items, diagnostics);
    let settings = check_settings(&options.settings, &scope, diagnostics);
    let order = in_order(&items, &scope, &settings, diagnostics);
    let mut resolver = Resolver {
        lowering: Lowering::new(scope),
        settings,
        model: Model {
            name: header.name.text.clone(),
            doc: header.doc.clone(),
            ..Model::default()
        },
    };
    resolver.constants_and_lets(&order, diagnostics);
    for item in &items {
        // Each item reports its own mistakes; the next is independent of them.
        let _: Result<(), Reported> = resolver.item(item, diagnostics);
    }
    resolver.unused_functions(diagnostics);
    diagnostics.check()?;

    let mut model = resolver.model;
    model.graph = resolver.lowering.graph;
    model.variants = variants;
    Ok(model)
}

/// Puts the chosen variants' items in place.
fn choose<'a>(
    items: &'a [Item],
    options: &ModelOptions,
    chosen_items: &mut Vec<&'a Item>,
    variants: &mut Vec<Variant>,
    diagnostics: &mut Diagnostics,
) {
    for item in items {
        let ItemKind::Variant { name, choices } = &item.kind else {
            chosen_items.push(item);
            continue;
        };
        if variants.iter().any(|v| v.name == name.text) {
            diagnostics.error(Diagnostic::new(
                Code::E202,
                name.span,
                format!("two variants are called `{}`", name.text),
            ));
            continue;
        }
        for (i, choice) in choices.iter().enumerate() {
            let name = &choice.name;
            if let Some(first) = choices[..i].iter().find(|first| first.name.text == name.text) {
                let message = format!("two choices are called `{}`", name.text);
                diagnostics.error(
                    Diagnostic::new(Code::E202, name.span, message)
                        .label(first.name.span, "first here"),
                );
            }
        }
        let chosen = chosen_of(name, choices, options, diagnostics);
        variants.push(Variant {
            name: name.text.clone(),
            choices: choices.iter().map(|choice| choice.name.text.clone()).collect(),
            chosen,
        });
        if let Some(choice) = choices.get(chosen) {
            choose(&choice.items, options, chosen_items, variants, diagnostics);
        }
    }
}

fn chosen_of(
    variant: &Name,
    choices: &[Choice],
    options: &ModelOptions,
    diagnostics: &mut Diagnostics,
) -> usize {
    let Some((_, wanted)) = options.variants.iter().rev().find(|(v, _)| v.text == variant.text)
    else {
        return 0;
    };
    choices.iter().position(|choice| choice.name.text == wanted.text).unwrap_or_else(|| {
        diagnostics.error(unknown_choice(
            wanted,
            &format!("variant `{}` has no choice `{}`", variant.text, wanted.text),
            choices.iter().map(|choice| choice.name.text.as_str()),
        ));
        0
    })
}

fn unknown_choice<'a>(
    at: &Name,
    message: &str,
    known: impl Iterator<Item = &'a str>,
) -> Diagnostic {
    let known: Vec<&str> = known.collect();
    let diagnostic = Diagnostic::new(Code::E207, at.span, message);
    if known.is_empty() {
        return diagnostic.help("this model has no variants");
    }
    diagnostic.help(match suggestion(&at.text, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("there is `{}`", known.join("`, `")),
    })
}

/// Settings by name, each of something that can be set.
fn check_settings<'a>(
    settings: &'a [Setting],
    scope: &Scope<'a>,
    diagnostics: &mut Diagnostics,
) -> BTreeMap<&'a str, &'a Expr> {
    let mut checked = BTreeMap::new();
    for Setting { name, value } in settings {
        let entry = scope.names.get(name.text.as_str()).map(|entry| entry.definition);
        match entry {
            Some(
                Definition::Constant(_) | Definition::Parameter(_) | Definition::Unknown { .. },
            ) => {
                checked.insert(name.text.as_str(), value);
            }
            Some(other) => {
                diagnostics.error(cannot_be_set(name, other.noun()));
            }
            None if scope.outputs.contains_key(name.text.as_str()) => {
                diagnostics.error(cannot_be_set(name, "an output"));
            }
            None => {
                let mut diagnostic = Diagnostic::new(
                    Code::E201,
                    name.span,
                    format!("nothing is called `{}`", name.text),
                );
                if let Some(near) = suggestion(&name.text, scope.names.keys().copied()) {
                    diagnostic.help = Some(format!("did you mean `{near}`?"));
                }
                diagnostics.error(diagnostic);
            }
        }
    }
    checked
}

fn cannot_be_set(name: &Name, noun: &str) -> Diagnostic {
    let message = format!("`{}` is {noun}, which cannot be set", name.text);
    Diagnostic::new(Code::E205, name.span, message)
        .help("set a constant, a parameter or the start value of a state")
}

/// Whether a number is a value, with the zero of its unit, or a size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reading {
    /// 20 °C is 293.15 K.
    Value,
    /// 20 °C is 20 K.
    Size,
}

struct Resolver<'a> {
    lowering: Lowering<'a>,
    settings: BTreeMap<&'a str, &'a Expr>,
    model: Model,
}

impl<'a> Resolver<'a> {
    fn constants_and_lets(
        &mut self,
        order: &[(&'a Item, Result<(), Reported>)],
        diagnostics: &mut Diagnostics,
    ) {
        let mut constants = BTreeMap::new();
        for (item, sound) in order {
            match &item.kind {
                ItemKind::Constant { name, value, .. } => {
                    let done = sound.and_then(|()| self.constant(item, name, value, diagnostics));
                    if let (Ok(constant), Some(index)) = (done, self.constant_index(name)) {
                        self.lowering.constants.insert(index, constant.value);
                        constants.insert(index, constant);
                    }
                }
                ItemKind::Let { name, unit, value } => {
                    let done = sound.and_then(|()| self.let_(unit.as_ref(), value, diagnostics));
                    if let Ok(typed) = done {
                        self.model.lets.push(Let {
                            name: name.text.clone(),
                            value: typed.id,
                            dimension: typed.dim.dimension(),
                        });
                    }
                    self.lowering.lets.insert(&name.text, done);
                }
                _ => unreachable!("only constants and `let`s are put in order"),
            }
        }
        self.model.constants = constants.into_values().collect();
    }

    fn constant_index(&self, name: &Name) -> Option<u32> {
        match self.lowering.scope.names.get(name.text.as_str())?.definition {
            Definition::Constant(index) => Some(index),
            _ => None,
        }
    }

    fn constant(
        &mut self,
        item: &Item,
        name: &'a Name,
        value: &'a Expr,
        diagnostics: &mut Diagnostics,
    ) -> Result<Constant, Reported> {
        let declared = self.declared(item, name)?;
        let value = self.settings.get(name.text.as_str()).copied().unwrap_or(value);
        let value = self.known(value, &declared.unit, Reading::Value, diagnostics)?;
        Ok(Constant { declared, value })
    }

    fn let_(
        &mut self,
        unit: Option<&'a WrittenUnit>,
        value: &'a Expr,
        diagnostics: &mut Diagnostics,
    ) -> Result<Typed, Reported> {
        if unit.is_none() {
            return self.lowering.value(value, diagnostics);
        }
        let unit = unit_of(unit, diagnostics)?;
        self.in_unit(value, &unit, Reading::Value, diagnostics)
    }

    fn item(&mut self, item: &'a Item, diagnostics: &mut Diagnostics) -> Result<(), Reported> {
        match &item.kind {
            ItemKind::Parameter { name, value, attributes, .. } => {
                let parameter = self.parameter(item, name, value, attributes, diagnostics)?;
                self.model.parameters.push(parameter);
            }
            ItemKind::Input { name, attributes, .. } => {
                let declared = self.declared(item, name)?;
                let linear = attributes.iter().any(|a| a.kind == AttributeKind::Linear);
                let interpolation =
                    if linear { Interpolation::Linear } else { Interpolation::Hold };
                self.model.inputs.push(Input { declared, interpolation });
            }
            ItemKind::Unknown { declared, name, start, attributes, .. } => {
                let state = *declared == UnknownKind::State;
                let unknown =
                    self.unknown(item, name, state, start.as_ref(), attributes, diagnostics)?;
                self.model.unknowns.push(unknown);
            }
            ItemKind::Output { name, unit, value, attributes } => {
                let output = self.output(
                    item,
                    (name, unit.as_ref()),
                    value.as_ref(),
                    attributes,
                    diagnostics,
                )?;
                self.model.outputs.push(output);
            }
            ItemKind::Equation { label, left, right } => {
                let equation = self.equation(item, label, (left, right), diagnostics)?;
                self.model.equations.push(equation);
            }
            ItemKind::Constant { .. }
            | ItemKind::Let { .. }
            | ItemKind::Function { .. }
            | ItemKind::Import { .. }
            | ItemKind::Variant { .. } => {}
        }
        Ok(())
    }

    fn declared(&self, item: &Item, name: &Name) -> Result<Declared, Reported> {
        let entry = self.lowering.scope.names.get(name.text.as_str());
        // A second declaration of a name has been reported; the first one's unit would mislead.
        let unit = entry.and_then(|entry| entry.unit.clone());
        Ok(Declared {
            name: name.text.clone(),
            span: name.span,
            unit: unit.unwrap_or_else(|| Ok(Unit::one()))?,
            doc: item.doc.clone(),
        })
    }

    /// A declared value: plain numbers are in the declared unit, anything else must have it.
    fn in_unit(
        &mut self,
        expr: &'a Expr,
        unit: &Unit,
        reading: Reading,
        diagnostics: &mut Diagnostics,
    ) -> Result<Typed, Reported> {
        let typed = self.lowering.value(expr, diagnostics)?;
        let number = self.lowering.number(typed.id);
        if let (true, Some(number)) = (is_plain(expr), number) {
            let si = match reading {
                Reading::Value => unit.to_si(number),
                Reading::Size => number * unit.factor,
            };
            let id = self.lowering.graph.constant(si);
            return Ok(Typed { id, dim: Dim::Of(unit.dimension) });
        }
        if typed.dim.with(Dim::Of(unit.dimension)).is_none() {
            let found = describe(typed.dim.dimension());
            return Err(diagnostics.error(
                Diagnostic::new(
                    Code::E302,
                    expr.span,
                    format!("declared in {}, but the value is in {found}", unit.symbol),
                )
                .here(format!("this is in {found}")),
            ));
        }
        // A size given with a unit of its own: 0.5 °C is half a kelvin.
        if let (
            Reading::Size,
            crate::syntax::ast::ExprKind::Number { value, unit: Some(own), .. },
        ) = (reading, &expr.kind)
        {
            let own = unit_of(Some(own), diagnostics)?;
            let id = self.lowering.graph.constant(value * own.factor);
            return Ok(Typed { id, dim: typed.dim });
        }
        Ok(typed)
    }

    /// A number that must be known before anything runs.
    fn known(
        &mut self,
        expr: &'a Expr,
        unit: &Unit,
        reading: Reading,
        diagnostics: &mut Diagnostics,
    ) -> Result<f64, Reported> {
        let typed = self.in_unit(expr, unit, reading, diagnostics)?;
        match self.lowering.number(typed.id) {
            Some(value) if value.is_finite() => Ok(value),
            Some(value) => Err(diagnostics.error(Diagnostic::new(
                Code::E504,
                expr.span,
                format!("this comes to {value}, which is no finite number"),
            ))),
            None => {
                let culprit = self.first_unknown_beforehand(typed.id);
                Err(diagnostics.error(
                    Diagnostic::new(
                        Code::E504,
                        expr.span,
                        format!("this must be known before a run, but it depends on {culprit}"),
                    )
                    .help("use numbers and constants here"),
                ))
            }
        }
    }

    /// The first thing in an expression that is not known before a run.
    fn first_unknown_beforehand(&self, id: ExprId) -> String {
        let symbols = self.lowering.graph.symbols(id);
        let found = symbols.iter().find_map(|symbol| self.quoted_name(*symbol));
        found.unwrap_or_else(|| "a constant that is in error".to_owned())
    }

    /// What a symbol is called; nothing for a constant, of which others are named first.
    fn quoted_name(&self, symbol: Symbol) -> Option<String> {
        self.lowering.scope.names.iter().find_map(|(name, entry)| {
            let same = match (entry.definition, symbol) {
                (Definition::Time, Symbol::Time) => true,
                (Definition::Parameter(i), Symbol::Parameter(j))
                | (Definition::Input(i), Symbol::Input(j)) => i == j,
                (Definition::Unknown { index, .. }, Symbol::Unknown(j) | Symbol::Derivative(j)) => {
                    index == j
                }
                _ => false,
            };
            same.then(|| format!("`{name}`"))
        })
    }

    fn parameter(
        &mut self,
        item: &Item,
        name: &'a Name,
        value: &'a Expr,
        attributes: &'a [Attribute],
        diagnostics: &mut Diagnostics,
    ) -> Result<Parameter, Reported> {
        let declared = self.declared(item, name)?;
        let unit = declared.unit.clone();
        let set = self.settings.get(name.text.as_str()).copied();
        let expr = set.unwrap_or(value);
        let value = self.known(expr, &unit, Reading::Value, diagnostics);

        let mut parameter = Parameter {
            declared,
            value: 0.0,
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            log: false,
            fixed: false,
            nominal: None,
            prior: None,
        };
        let mut bounds_span = None;
        for attribute in attributes {
            match &attribute.kind {
                AttributeKind::Bounds(lower, upper) => {
                    bounds_span = Some(attribute.span);
                    if let Some(lower) = lower {
                        parameter.lower = self.known(lower, &unit, Reading::Value, diagnostics)?;
                    }
                    if let Some(upper) = upper {
                        parameter.upper = self.known(upper, &unit, Reading::Value, diagnostics)?;
                    }
                }
                AttributeKind::Log => parameter.log = true,
                AttributeKind::Fixed => parameter.fixed = true,
                AttributeKind::Nominal(nominal) => {
                    parameter.nominal =
                        Some(self.positive(nominal, &unit, "nominal size", diagnostics)?);
                }
                AttributeKind::PriorNormal(mean, std) => {
                    let mean = self.known(mean, &unit, Reading::Value, diagnostics)?;
                    let std =
                        self.positive(std, &unit, "standard deviation of a prior", diagnostics)?;
                    parameter.prior = Some((mean, std));
                }
                AttributeKind::Hold | AttributeKind::Linear | AttributeKind::Noise(_) => {}
            }
        }
        parameter.value = value?;
        check_bounds(&parameter, expr.span, bounds_span, diagnostics)?;
        Ok(parameter)
    }

    fn positive(
        &mut self,
        expr: &'a Expr,
        unit: &Unit,
        what: &str,
        diagnostics: &mut Diagnostics,
    ) -> Result<f64, Reported> {
        let value = self.known(expr, unit, Reading::Size, diagnostics)?;
        if value > 0.0 {
            return Ok(value);
        }
        let message = format!("the {what} must be above zero");
        Err(diagnostics.error(Diagnostic::new(Code::E505, expr.span, message)))
    }

    fn unknown(
        &mut self,
        item: &Item,
        name: &'a Name,
        state: bool,
        start: Option<&'a Expr>,
        attributes: &'a [Attribute],
        diagnostics: &mut Diagnostics,
    ) -> Result<Unknown, Reported> {
        let declared = self.declared(item, name)?;
        let unit = declared.unit.clone();
        let start = match self.settings.get(name.text.as_str()).copied().or(start) {
            None => self.lowering.graph.constant(0.0),
            Some(expr) => {
                let typed = self.in_unit(expr, &unit, Reading::Value, diagnostics)?;
                self.check_start(typed.id, expr, diagnostics)?;
                typed.id
            }
        };
        let mut nominal = None;
        let mut fixed = false;
        for attribute in attributes {
            match &attribute.kind {
                AttributeKind::Nominal(expr) => {
                    nominal = Some(self.positive(expr, &unit, "nominal size", diagnostics)?);
                }
                AttributeKind::Fixed => fixed = true,
                AttributeKind::Bounds(..)
                | AttributeKind::Log
                | AttributeKind::PriorNormal(..)
                | AttributeKind::Hold
                | AttributeKind::Linear
                | AttributeKind::Noise(_) => {}
            }
        }
        Ok(Unknown { declared, state, start, fixed, nominal })
    }

    fn check_start(
        &self,
        start: ExprId,
        expr: &Expr,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), Reported> {
        let graph = &self.lowering.graph;
        let depends =
            |s: &Symbol| matches!(s, Symbol::Unknown(_) | Symbol::Derivative(_) | Symbol::Time);
        if let Some(symbol) = graph.symbols(start).into_iter().find(depends) {
            let culprit = self.quoted_name(symbol).unwrap_or_else(|| "an unknown".to_owned());
            return Err(diagnostics.error(
                Diagnostic::new(
                    Code::E503,
                    expr.span,
                    format!("this start value depends on {culprit}, which is not known before"),
                )
                .help("use parameters, constants and inputs, which are known at the start"),
            ));
        }
        match self.lowering.number(start) {
            Some(value) if !value.is_finite() => Err(diagnostics.error(Diagnostic::new(
                Code::E504,
                expr.span,
                format!("this comes to {value}, which is no finite number"),
            ))),
            _ => Ok(()),
        }
    }

    fn output(
        &mut self,
        item: &Item,
        (name, unit): (&'a Name, Option<&'a WrittenUnit>),
        value: Option<&'a Expr>,
        attributes: &'a [Attribute],
        diagnostics: &mut Diagnostics,
    ) -> Result<Output, Reported> {
        let own_unit = unit.map(|unit| unit_of(Some(unit), diagnostics)).transpose()?;
        let (value, unit) = match value {
            Some(expr) => {
                let unit = own_unit.unwrap_or_else(Unit::one);
                (self.in_unit(expr, &unit, Reading::Value, diagnostics)?.id, unit)
            }
            None => self.unknown_read(name, own_unit, diagnostics)?,
        };
        let mut noise = None;
        for attribute in attributes {
            if let AttributeKind::Noise(expr) = &attribute.kind {
                noise = Some(self.positive(expr, &unit, "noise", diagnostics)?);
            }
        }
        let declared =
            Declared { name: name.text.clone(), span: name.span, unit, doc: item.doc.clone() };
        Ok(Output { declared, value, noise })
    }

    /// What an output without `=` reads: the unknown of its name.
    fn unknown_read(
        &mut self,
        name: &Name,
        own_unit: Option<Unit>,
        diagnostics: &mut Diagnostics,
    ) -> Result<(ExprId, Unit), Reported> {
        let entry = self.lowering.scope.names.get(name.text.as_str()).cloned();
        let Some(entry) = entry else {
            return Err(diagnostics.error(
                Diagnostic::new(
                    Code::E201,
                    name.span,
                    format!("output `{}` reads nothing: no unknown has its name", name.text),
                )
                .help(format!("say what it reads: `output {} = …`", name.text)),
            ));
        };
        let Definition::Unknown { index, .. } = entry.definition else {
            return Err(diagnostics.error(
                Diagnostic::new(
                    Code::E205,
                    name.span,
                    format!(
                        "output `{}` reads nothing: `{}` is {}, not an unknown",
                        name.text,
                        name.text,
                        entry.definition.noun()
                    ),
                )
                .label(entry.span, "declared here")
                .help(format!("say what it reads: `output {} = …`", name.text)),
            ));
        };
        let declared = entry.unit.unwrap_or_else(|| Ok(Unit::one()))?;
        let unit = own_unit.unwrap_or_else(|| declared.clone());
        if unit.dimension != declared.dimension {
            return Err(diagnostics.error(
                Diagnostic::new(
                    Code::E302,
                    name.span,
                    format!(
                        "output `{}` is declared in {}, but the unknown is in {}",
                        name.text, unit.symbol, declared.symbol
                    ),
                )
                .label(entry.span, "the unknown is declared here"),
            ));
        }
        Ok((self.lowering.graph.symbol(Symbol::Unknown(index)), unit))
    }

    fn equation(
        &mut self,
        item: &Item,
        label: &Name,
        (left, right): (&'a Expr, &'a Expr),
        diagnostics: &mut Diagnostics,
    ) -> Result<Equation, Reported> {
        let a = self.lowering.value(left, diagnostics);
        let b = self.lowering.value(right, diagnostics);
        let (a, b) = (a?, b?);
        if a.dim.with(b.dim).is_none() {
            let (l, r) = (describe(a.dim.dimension()), describe(b.dim.dimension()));
            return Err(diagnostics.error(
                Diagnostic::new(
                    Code::E302,
                    left.span,
                    format!("the sides of equation `{}` are in {l} and {r}", label.text),
                )
                .here(format!("this is in {l}"))
                .label(right.span, format!("this is in {r}")),
            ));
        }
        Ok(Equation {
            label: label.text.clone(),
            span: item.span,
            doc: item.doc.clone(),
            left: a.id,
            right: b.id,
        })
    }

    /// Checks functions that nothing calls, where their arguments say enough.
    fn unused_functions(&mut self, diagnostics: &mut Diagnostics) {
        for index in 0..self.lowering.scope.functions.len() {
            let function = self.lowering.scope.functions[index];
            if function.arguments.iter().all(|argument| argument.unit.is_some()) {
                // The result is of no interest, only the mistakes met on the way.
                let _: Result<(), Reported> = self.lowering.check_function(function, diagnostics);
            }
        }
    }
}

fn check_bounds(
    parameter: &Parameter,
    value_span: Span,
    bounds_span: Option<Span>,
    diagnostics: &mut Diagnostics,
) -> Result<(), Reported> {
    let Parameter { declared, value, lower, upper, .. } = parameter;
    let shown = |si: f64| crate::expr::display::number(declared.unit.from_si(si));
    let mut sound = Ok(());
    if let Some(span) = bounds_span {
        let empty = match (lower, upper) {
            (l, u) if l > u => {
                let unit = &declared.unit.symbol;
                Some(format!("from {} {unit} to {} {unit}", shown(*l), shown(*u)))
            }
            _ => None,
        };
        if let Some(range) = empty {
            sound = Err(diagnostics.error(
                Diagnostic::new(
                    Code::E502,
                    span,
                    format!("the bounds of `{}` leave nothing: {range}", declared.name),
                )
                .help("write the smaller bound first"),
            ));
        } else if value < lower || value > upper {
            let (bound, side) = if value < lower { (lower, "below") } else { (upper, "above") };
            sound = Err(diagnostics.error(
                Diagnostic::new(
                    Code::E501,
                    value_span,
                    format!(
                        "`{}` = {} {u} is {side} its bound of {} {u}",
                        declared.name,
                        shown(*value),
                        shown(*bound),
                        u = declared.unit.symbol,
                    ),
                )
                .label(span, "bounds declared here"),
            ));
        }
    }
    if parameter.log && *value <= 0.0 {
        sound = Err(diagnostics.error(
            Diagnostic::new(
                Code::E506,
                value_span,
                format!(
                    "`{}` is estimated by its logarithm, so it must be above zero",
                    declared.name
                ),
            )
            .help("leave out `log`, or give a positive value"),
        ));
    }
    sound
}
