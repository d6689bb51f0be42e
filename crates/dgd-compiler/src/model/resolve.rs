//! Ast → Model: resolves names, checks units, chooses variants, converts values to SI.

use std::collections::BTreeMap;

use super::check_units::ExprDimension;
use super::choose::{check_settings, choose, leave_out_impossible, unknown_choice};
use super::define::{ModelScope, NameDefinition, in_order};
use super::density::reading::DensityFormula;
use super::expression::{ExprLowering, OpenArguments, TypedExpr, is_plain, unit_of};
use super::item::UnknownDeclaration;
use super::{Constant, DeclarationHeader, Input, Interpolation, Let, Model, Parameter};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::{ExprId, Symbol};
use crate::parts::{self, FlatModel, InnerModel};
use crate::sentence;
use crate::sentence::argument::Argument;
use crate::source::Span;
use crate::syntax::ast::{
    ArrayKind, Ast, AttributeKind, Expr, Item, ItemKind, Name, StartRule, UnknownKind, WrittenUnit,
};
use crate::syntax::own_units;
use crate::units::{Dimension, Unit, which_is_meant};

/// Choices and settings from outside the model file.
#[derive(Debug, Clone, Default)]
pub struct ModelOptions {
    /// Choices of variants; unnamed variants keep their first.
    pub variants: Vec<(Name, Name)>,
    /// New values of constants and parameters and start values of unknowns.
    pub settings: Vec<Setting>,
    /// Data columns. If they are known, an input that nothing reads is kept if it has a column, because additions to
    /// the model may read it, and left out otherwise.
    pub columns: Option<Vec<String>>,
    /// Place of the request that runs start at rest, if the model itself does not.
    pub starts_at_rest: Option<Span>,
}

/// `name = value`, given from outside; a plain number is in the declared unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// The name.
    pub name: Name,
    /// Its new value.
    pub value: Expr,
}

/// Makes a model of a file and the libraries that it imports.
///
/// # Errors
///
/// [`ErrorReported`] after at least one diagnostic; as many independent errors as possible are reported at once.
pub fn resolve(
    asts: &[Ast],
    options: &ModelOptions,
    diagnostics: &mut Diagnostics,
) -> Result<Model, ErrorReported> {
    resolve_noting(asts, options, None, diagnostics)
}

/// Makes a model like [`resolve`] and records the dimension of every expression that has one, by its place, even if
/// other expressions have errors.
///
/// # Errors
///
/// [`ErrorReported`] after at least one diagnostic.
pub fn resolve_noting(
    asts: &[Ast],
    options: &ModelOptions,
    dimensions: Option<&mut BTreeMap<Span, Dimension>>,
    diagnostics: &mut Diagnostics,
) -> Result<Model, ErrorReported> {
    let main = asts.first().unwrap_or_else(|| unreachable!("a compilation has a main file"));
    let Some(header) = &main.model else {
        let start = Span { source: main.source, start: 0, end: 0 };
        if let Some(effect) = &main.effect {
            let message = format!("`{}` is an effect, not a model", effect.name.text);
            return Err(diagnostics.error(
                Diagnostic::new(Code::NoModelLine, effect.name.span, message)
                    .about(&effect.name.text)
                    .help(sentence!["give the model, and the effect with ", Argument::Apply]),
            ));
        }
        return Err(diagnostics.error(
            Diagnostic::new(Code::NoModelLine, start, "this file does not say which model it is")
                .help(
                    "begin it with `model NAME`; a library without that line can only be imported",
                ),
        ));
    };

    let mut set = options.settings.clone();
    let units = own_units::all(asts);
    for setting in set.iter_mut().filter(|_| !units.is_empty()) {
        own_units::know_in(&mut setting.value, &units);
    }
    let asts = own_units::known_where_used(asts, diagnostics);
    let FlatModel { asts, parts, .. } = parts::expand(&asts, diagnostics)?;
    let [main, libraries @ ..] = &*asts else {
        unreachable!("a compilation has a main file");
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

    // Unbound inputs have been reported, and are then inputs of the model.
    let _: Result<(), ErrorReported> =
        parts::leave_out_unbound(&mut items, main, &parts, diagnostics);
    leave_out_impossible(&mut variants, main, libraries, options);
    parts::leave_out_unread_inputs(&mut items, main, options.columns.as_deref());

    let mut scope = ModelScope::collect(&items, diagnostics);
    let settings = check_settings(&set, &scope, diagnostics);
    scope.place_arrays(&items, &settings, diagnostics);
    let order = in_order(&items, &scope, &settings, diagnostics);
    let mut resolver = ModelResolver {
        lowering: ExprLowering::new(scope),
        settings,
        next_loop: 0,
        formulas: Vec::new(),
        elements: (Vec::new(), Vec::new()),
        model: Model {
            name: header.name.text.clone(),
            doc: header.doc.clone(),
            parts: once(parts),
            ..Model::default()
        },
    };
    resolver.lowering.dimensions = dimensions.is_some().then(BTreeMap::new);
    resolver.constants_and_lets(&order, diagnostics);
    for item in &items {
        // Each item reports its own errors; the next is independent of them.
        let _: Result<(), ErrorReported> = resolver.item(item, diagnostics);
    }
    let (parameters, inputs) = std::mem::take(&mut resolver.elements);
    resolver.model.parameters.extend(parameters);
    resolver.model.inputs.extend(inputs);
    resolver.unused_functions(diagnostics);
    resolver.smoothness_of_tables(diagnostics);
    resolver.unused_lets(diagnostics);
    if let Some(dimensions) = dimensions {
        dimensions.extend(resolver.lowering.dimensions.take().into_iter().flatten());
    }
    diagnostics.check()?;
    resolver.open_starts(diagnostics)?;

    let mut model = resolver.model;
    verify_start(&model, header.name.span, diagnostics)?;
    model.starts_at_rest = model.starts_at_rest.or(options.starts_at_rest);
    model.add_deviations(resolver.formulas);
    for (name, size) in &resolver.lowering.scope.sizes {
        let span = resolver.lowering.scope.names.get(name).map(|entry| entry.span);
        let name = Name { text: (*name).to_owned(), span: span.unwrap_or_default() };
        model.sizes.push((name, (*size)?));
    }
    model.graph = resolver.lowering.graph;
    model.variants = variants;
    Ok(model)
}

/// Refuses a part that starts at rest: only the whole model can, because a part rests only if the others do.
fn verify_start(
    model: &Model,
    main: Span,
    diagnostics: &mut Diagnostics,
) -> Result<(), ErrorReported> {
    let Some(span) = model.starts_at_rest.filter(|span| span.source != main.source) else {
        return Ok(());
    };
    let message =
        format!("only the whole model can start at rest, and this is not `{}`", model.name);
    Err(diagnostics.error(
        Diagnostic::new(Code::StartNotSteady, span, message)
            .about(&model.name)
            .help("move `start steady` to the model that is simulated"),
    ))
}

/// Parts without duplicates: one may occur in several choices of a variant.
fn once(parts: Vec<InnerModel>) -> Vec<InnerModel> {
    let mut distinct: Vec<InnerModel> = Vec::with_capacity(parts.len());
    for part in parts {
        if !distinct.iter().any(|other| other.name == part.name && other.model == part.model) {
            distinct.push(part);
        }
    }
    distinct
}

/// Whether a number is a value, including the offset of its unit, or a size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NumberReading {
    /// 20 °C is 293.15 K.
    Value,
    /// 20 °C is 20 K.
    Size,
}

pub(super) struct ModelResolver<'a> {
    pub(super) lowering: ExprLowering<'a>,
    pub(super) settings: BTreeMap<&'a str, &'a Expr>,
    /// Position of the next loop.
    pub(super) next_loop: usize,
    /// Formulas of noise, by position of the output.
    pub(super) formulas: Vec<(usize, DensityFormula)>,
    /// Parameters and inputs that are elements of arrays: they follow the others.
    pub(super) elements: (Vec<Parameter>, Vec<Input>),
    pub(super) model: Model,
}

impl<'a> ModelResolver<'a> {
    fn constants_and_lets(
        &mut self,
        order: &[(&'a Item, Result<(), ErrorReported>)],
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
                ItemKind::Array { name, .. } => {
                    let done = sound.and_then(|()| {
                        let vector = self.vector(name, diagnostics)?;
                        let constants = self.constants_of(item, vector, diagnostics)?;
                        let place = self.lowering.scope.vectors[vector].place.clone()?;
                        Ok((place.first..).zip(constants))
                    });
                    for (index, constant) in done.into_iter().flatten() {
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

    /// The start value set from outside, or else the declared one.
    fn start_of(&self, name: &Name, declared: Option<&'a Expr>) -> Option<&'a Expr> {
        self.settings.get(name.text.as_str()).copied().or(declared)
    }

    /// The position of an array of constants, parameters or inputs.
    fn vector(&self, name: &Name, diagnostics: &mut Diagnostics) -> Result<usize, ErrorReported> {
        let entry = self.lowering.scope.names.get(name.text.as_str());
        match entry.map(|entry| entry.definition) {
            Some(NameDefinition::Vector(vector)) => Ok(vector),
            // A duplicate declaration of a name has been reported.
            _ => diagnostics.check().map(|()| unreachable!("arrays are collected")),
        }
    }

    fn constant_index(&self, name: &Name) -> Option<u32> {
        match self.lowering.scope.names.get(name.text.as_str())?.definition {
            NameDefinition::Constant(index) => Some(index),
            _ => None,
        }
    }

    fn constant(
        &mut self,
        item: &Item,
        name: &'a Name,
        value: &'a Expr,
        diagnostics: &mut Diagnostics,
    ) -> Result<Constant, ErrorReported> {
        let declared = self.declared(item, name)?;
        let value = self.settings.get(name.text.as_str()).copied().unwrap_or(value);
        let value =
            self.lowering.known(value, &declared.unit, NumberReading::Value, diagnostics)?;
        Ok(Constant { declared, value })
    }

    fn let_(
        &mut self,
        unit: Option<&'a WrittenUnit>,
        value: &'a Expr,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        if unit.is_none() {
            return self.lowering.value(value, diagnostics);
        }
        let unit = unit_of(unit, diagnostics)?;
        self.in_unit(value, &unit, NumberReading::Value, diagnostics)
    }

    fn item(&mut self, item: &'a Item, diagnostics: &mut Diagnostics) -> Result<(), ErrorReported> {
        match &item.kind {
            ItemKind::Parameter { name, value, attributes, .. } => {
                let declared = self.declared(item, name)?;
                let set = self.settings.get(name.text.as_str()).copied();
                let value = set.unwrap_or(value);
                let parameter = self.parameter(declared, value, attributes, diagnostics)?;
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
                let state = *declared != UnknownKind::Unknown;
                let start = self.start_of(name, start.as_ref());
                let declaration = UnknownDeclaration { name, state, start, attributes };
                let unknown = self.unknown(item, &declaration, diagnostics)?;
                self.model.unknowns.push(unknown);
                if *declared == UnknownKind::Held {
                    let equation = self.held(item, name)?;
                    self.model.equations.push(equation);
                }
            }
            ItemKind::Output { name, unit, value: None, attributes } if self.is_array(name) => {
                self.output_array(item, name, unit.as_ref(), attributes, diagnostics)?;
            }
            ItemKind::Output { name, unit, value, attributes } => {
                let output = self.output(
                    item,
                    name,
                    unit.as_ref(),
                    value.as_ref(),
                    attributes,
                    diagnostics,
                )?;
                self.model.outputs.push(output);
            }
            ItemKind::Equation { label, left, right, attributes } => {
                let equation =
                    self.equation(item, label, [left, right], attributes, diagnostics)?;
                self.model.equations.push(equation);
            }
            ItemKind::Modes { name, modes, transitions, starts } => {
                let automaton =
                    self.automaton(item, name, modes, transitions, starts, diagnostics)?;
                self.model.automata.push(automaton);
            }
            ItemKind::When(_) | ItemKind::Every { .. } => {
                let automaton = self.reacting(item, diagnostics)?;
                self.model.automata.push(automaton);
            }
            ItemKind::Start(StartRule::Steady) => {
                self.model.starts_at_rest = Some(item.span);
            }
            ItemKind::Start(StartRule::Equation { label, left, right }) => {
                let equation = self.equation(item, label, [left, right], &[], diagnostics)?;
                self.model.start_equations.push(equation);
            }
            ItemKind::Saturate { name, indices, side, bound } => {
                let saturation =
                    self.saturation(item, (name, indices), *side, bound, diagnostics)?;
                self.model.saturations.push(saturation);
            }
            ItemKind::Array { declared, name, axes, start, attributes, .. } => match declared {
                ArrayKind::State | ArrayKind::Unknown | ArrayKind::Held => {
                    let state = *declared != ArrayKind::Unknown;
                    let start = self.start_of(name, start.as_ref());
                    let declaration = UnknownDeclaration { name, state, start, attributes };
                    let rows = self.array(item, axes, &declaration, diagnostics)?;
                    if *declared == ArrayKind::Held {
                        self.held_rows(item, &rows);
                    }
                    self.model.arrays.extend(rows);
                }
                ArrayKind::Parameter => {
                    let vector = self.vector(name, diagnostics)?;
                    let parameters = self.parameters_of(item, vector, attributes, diagnostics)?;
                    self.elements.0.extend(parameters);
                }
                ArrayKind::Input => {
                    let vector = self.vector(name, diagnostics)?;
                    let inputs = self.inputs_of(item, vector, attributes, diagnostics)?;
                    self.elements.1.extend(inputs);
                }
                ArrayKind::Constant => {}
            },
            ItemKind::For { counters, items } => self.loop_(counters, items, diagnostics)?,
            ItemKind::Constant { .. }
            | ItemKind::Size { .. }
            | ItemKind::Unit { .. }
            | ItemKind::Let { .. }
            | ItemKind::Function { .. }
            | ItemKind::Table { .. }
            | ItemKind::Import { .. }
            | ItemKind::Variant { .. }
            | ItemKind::Part { .. }
            | ItemKind::Binding { .. } => {}
        }
        Ok(())
    }

    pub(super) fn declared(
        &self,
        item: &Item,
        name: &Name,
    ) -> Result<DeclarationHeader, ErrorReported> {
        let entry = self.lowering.scope.names.get(name.text.as_str());
        // A duplicate declaration of a name has been reported; the unit of the first would mislead.
        let unit = entry.and_then(|entry| entry.unit.clone());
        Ok(DeclarationHeader {
            name: name.text.clone(),
            span: name.span,
            unit: unit.unwrap_or_else(|| Ok(Unit::one()))?,
            doc: item.doc.clone(),
        })
    }

    /// A declared value: plain numbers are in the declared unit, anything else must have its dimension.
    pub(super) fn in_unit(
        &mut self,
        expr: &'a Expr,
        unit: &Unit,
        reading: NumberReading,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        self.lowering.in_unit(expr, unit, reading, &OpenArguments::new(), diagnostics)
    }

    /// Checks functions that nothing calls if their arguments have units.
    fn unused_functions(&mut self, diagnostics: &mut Diagnostics) {
        for index in 0..self.lowering.scope.functions.len() {
            let function = self.lowering.scope.functions[index];
            if function.arguments.iter().all(|argument| argument.unit.is_some()) {
                // Only the errors matter, not the result.
                let _: Result<(), ErrorReported> =
                    self.lowering.check_function(function, diagnostics);
            }
        }
    }
}

impl<'a> ExprLowering<'a> {
    /// A number that must be constant.
    pub(super) fn known(
        &mut self,
        expr: &'a Expr,
        unit: &Unit,
        reading: NumberReading,
        diagnostics: &mut Diagnostics,
    ) -> Result<f64, ErrorReported> {
        let typed = self.in_unit(expr, unit, reading, &OpenArguments::new(), diagnostics)?;
        match self.number(typed.id) {
            Some(value) if value.is_finite() => Ok(value),
            Some(value) => Err(diagnostics.error(not_finite(value, expr.span))),
            None => {
                let culprit = self.first_unknown(typed.id, |_| true);
                Err(diagnostics.error(
                    Diagnostic::new(
                        Code::ValueNotConstant,
                        expr.span,
                        format!("this must be known before a run, but it depends on {culprit}"),
                    )
                    .help("use numbers and constants here"),
                ))
            }
        }
    }

    /// A size that must be constant and positive.
    pub(super) fn positive(
        &mut self,
        expr: &'a Expr,
        unit: &Unit,
        what: &str,
        diagnostics: &mut Diagnostics,
    ) -> Result<f64, ErrorReported> {
        let value = self.known(expr, unit, NumberReading::Size, diagnostics)?;
        if value > 0.0 {
            return Ok(value);
        }
        let message = format!("the {what} must be above zero");
        Err(diagnostics.error(Diagnostic::new(Code::SizeNotPositive, expr.span, message)))
    }

    /// The first relevant symbol that an expression depends on.
    pub(super) fn first_unknown(&self, id: ExprId, matters: impl Fn(Symbol) -> bool) -> String {
        let mut symbols = self.graph.symbols(id).into_iter().filter(|symbol| matters(*symbol));
        let name = symbols.find_map(|symbol| self.scope.quoted_name(symbol));
        name.unwrap_or_else(|| "a constant that is in error".to_owned())
    }

    /// A declared value: plain numbers are in the declared unit, anything else must have its dimension. Inside a
    /// function its arguments are available.
    pub(super) fn in_unit(
        &mut self,
        expr: &'a Expr,
        unit: &Unit,
        reading: NumberReading,
        arguments: &OpenArguments<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        let typed = self.lower(expr, arguments, diagnostics)?;
        let number = self.number(typed.id);
        let is_plain = is_plain(expr, &|name| self.scope.names.contains_key(name));
        if let (true, Some(number)) = (is_plain, number) {
            let si = match reading {
                NumberReading::Value => unit.to_si(number),
                NumberReading::Size => number * unit.factor,
            };
            let id = self.graph.constant(si);
            return Ok(TypedExpr { id, dim: ExprDimension::Of(unit.dimension) });
        }
        if typed.dim.unify(ExprDimension::Of(unit.dimension)).is_none() {
            let dimension = typed.dim.dimension();
            return Err(diagnostics.error(
                Diagnostic::new(
                    Code::UnitsOfSides,
                    expr.span,
                    format!(
                        "declared in `{}`, but the value is {}",
                        unit.symbol,
                        self.scope.spelling.being(dimension)
                    ),
                )
                .here(self.scope.spelling.this_is(dimension))
                .maybe_help(which_is_meant(dimension, unit.dimension)),
            ));
        }
        // A size with a unit of its own: 0.5 °C is half a kelvin.
        if let (
            NumberReading::Size,
            crate::syntax::ast::ExprKind::Number { value, unit: Some(own), .. },
        ) = (reading, &expr.kind)
        {
            let unit_of_value = unit_of(Some(own), diagnostics)?;
            let id = self.graph.constant(value * unit_of_value.factor);
            return Ok(TypedExpr { id, dim: typed.dim });
        }
        Ok(typed)
    }
}

/// The error for a value that is infinite or not a number.
pub(super) fn not_finite(value: f64, span: Span) -> Diagnostic {
    let message = format!("this comes to {value}, which is not a finite number");
    Diagnostic::new(Code::ValueNotConstant, span, message)
}
