//! Ast → Model: resolves names, checks units, chooses variants, converts values to SI.

use std::collections::BTreeMap;

use super::check_units::unit_of;
use super::choose::{check_settings, choose, leave_out_impossible, unknown_choice};
use super::expression::{ExprLowering, NumberReading, TypedExpr};
use super::item::UnknownDeclaration;
use super::options::ModelOptions;
use super::resolver::ModelResolver;
use super::scope::{ModelScope, NameDefinition, in_order};
use super::{Constant, Input, Interpolation, Let, Model};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::parts::{self, FlatModel, InnerModel};
use crate::sentence;
use crate::sentence::argument::Argument;
use crate::source::Span;
use crate::syntax::ast::{
    ArrayKind, Ast, AttributeKind, Expr, Item, ItemKind, Name, StartRule, UnknownKind, WrittenUnit,
};
use crate::syntax::own_units;
use crate::units::Dimension;

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

    /// Collects the smoothness of tables. Tables that nothing calls are also read, to find their errors.
    fn smoothness_of_tables(&mut self, diagnostics: &mut Diagnostics) {
        for index in 0..self.lowering.scope.tables.len() {
            // Errors have been reported.
            let table = self.lowering.table(index, diagnostics);
            self.model.smoothness.extend(table.into_iter().flat_map(|table| table.smoothness));
        }
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
