//! One application of an effect, with its names in the model.

use super::declared::{NameDeclarations, namespace_of, noun};
use super::splice::mentions;
use super::{AddedItems, EffectApplication, EffectBlending, units};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported, suggestion};
use crate::source::Span;
use crate::syntax::ast::{
    Ast, Attribute, AttributeKind, ClauseKind, EffectClause, EffectKind, EffectTarget, Expr,
    ExprKind, Item, ItemKind, Name, SlotKind, TemplateSlot,
};
use crate::syntax::rename::Renaming;
use crate::syntax::visit::{self, ItemPart, Namespace, units_of_expression_mut, units_of_item_mut};
use crate::units::parse_unit;

/// A change made by an effect, in the names of the model.
#[derive(Debug, Clone)]
pub(super) struct AppliedChange {
    /// The clause's place.
    pub(super) span: Span,
    pub(super) kind: ChangeKind,
}

#[derive(Debug, Clone)]
pub(super) enum ChangeKind {
    /// Uses of a name, in one equation or everywhere.
    Replace { name: Name, arguments: Vec<Name>, equation: Option<Name>, by: Expr },
    /// The value of an output; `own` is its name within the expression.
    Output { output: Name, own: String, by: Expr },
    /// A term on the right of an equation.
    Add { equation: Name, value: Expr },
}

/// The items and changes of one application.
#[derive(Debug, Clone)]
pub(super) struct EffectInstance {
    pub(super) kind: EffectKind,
    pub(super) items: Vec<Item>,
    pub(super) changes: Vec<AppliedChange>,
    /// Names that represent the values of outputs, with the outputs.
    pub(super) readings: Vec<(String, Name)>,
    pub(super) brought: AddedItems,
}

impl EffectInstance {
    /// Names of the model that it replaces.
    pub(super) fn replaced(&self) -> impl Iterator<Item = &str> {
        self.changes.iter().filter_map(|change| match &change.kind {
            ChangeKind::Replace { name, .. } => Some(name.text.as_str()),
            ChangeKind::Output { .. } | ChangeKind::Add { .. } => None,
        })
    }

    /// Whether its items and changes mention a name.
    pub(super) fn mentions(&self, name: &str) -> bool {
        let is_it = |other: &str| other == name;
        self.changes.iter().any(|change| match &change.kind {
            ChangeKind::Replace { by, .. } | ChangeKind::Output { by, .. } => mentions(by, &is_it),
            ChangeKind::Add { value, .. } => mentions(value, &is_it),
        })
    }
}

impl EffectInstance {
    /// Translates an effect's names to their names in the model, and adds them to `declared`.
    pub(super) fn new(
        application: &EffectApplication<'_>,
        model: &Ast,
        declared: &mut NameDeclarations,
        blending: EffectBlending,
        diagnostics: &mut Diagnostics,
    ) -> Result<EffectInstance, ErrorReported> {
        let effect = application.effect;
        let bound = bound(application, model, declared, diagnostics)?;
        let mut names = Renaming::default();
        let mut readings = Vec::new();
        for (slot, argument) in &bound {
            let text = slot.name.text.clone();
            match slot.kind {
                SlotKind::Output => readings.push((text, (*argument).clone())),
                kind => {
                    names.insert(namespace_of(kind), text, argument.text.clone());
                }
            }
        }
        let mut brought = AddedItems {
            name: application.name(),
            doc: effect.doc.clone(),
            source: effect.ast.source,
            ..AddedItems::default()
        };
        let mut naming = EffectNaming { application, declared, blending, diagnostics };
        let mut items = effect.ast.items.clone();
        for item in &mut items {
            visit::parts_mut(item, &mut |part| {
                let ItemPart::Declares(namespace, name) = part else { return };
                if names.contains(namespace, &name.text) {
                    return; // declared in another choice of a variant
                }
                let new = naming.named(namespace, name);
                brought.names.push((name.text.clone(), new.clone()));
                names.insert(namespace, name.text.clone(), new);
            });
        }
        let clauses = effect.ast.effect.iter().flat_map(|header| &header.clauses);
        let mut nulls: Vec<(Name, Expr)> = Vec::new();
        let mut changes = Vec::new();
        for clause in clauses {
            match change(clause, &names, &readings) {
                TranslatedClause::Null(name, value) => nulls.push((name, value)),
                TranslatedClause::Change(kind) => {
                    changes.push(AppliedChange { span: clause.span, kind });
                }
                TranslatedClause::Nothing => {}
            }
        }
        if blending == EffectBlending::Blended {
            nulls.clear();
        }
        if blending != EffectBlending::Applied && nulls.is_empty() && effect.changes_model() {
            let blend =
                Name { text: format!("blend_{}", effect.name.text), span: effect.name.span };
            let text = naming.named(Namespace::Value, &blend);
            items.push(blend_parameter(Name { text: text.clone(), ..blend }));
            brought.blend = Some(text);
        }
        naming.diagnostics.check()?;

        let unit_of = |name: &str| {
            let (slot, argument) = bound.iter().find(|(slot, _)| slot.name.text == name)?;
            Some(declared.unit(namespace_of(slot.kind), &argument.text)?.text.clone())
        };
        for item in &mut items {
            names.rename_item(item);
            units_of_item_mut(item, &mut |unit| unit.text = units::opened(&unit.text, &unit_of));
        }
        for change in &mut changes {
            units_of_expression_mut(change.kind.expression_mut(), &mut |unit| {
                unit.text = units::opened(&unit.text, &unit_of);
            });
        }
        visit::items_mut(&mut items, &mut |item| {
            let ItemKind::Parameter { name, value, .. } = &mut item.kind else { return };
            if brought.blend.as_ref() != Some(&name.text) {
                brought.parameters.push(name.text.clone());
            }
            if let Some((_, null)) = nulls.iter().find(|(null, _)| null.text == name.text) {
                brought.null.push(name.text.clone());
                if blending == EffectBlending::Null {
                    *value = null.clone();
                }
            }
        });
        Ok(EffectInstance { kind: effect.kind, items, changes, readings, brought })
    }
}

impl ChangeKind {
    /// The new expression.
    pub(super) fn expression_mut(&mut self) -> &mut Expr {
        match self {
            ChangeKind::Replace { by: expr, .. }
            | ChangeKind::Output { by: expr, .. }
            | ChangeKind::Add { value: expr, .. } => expr,
        }
    }
}

/// A clause in the model's names.
enum TranslatedClause {
    Null(Name, Expr),
    Change(ChangeKind),
    Nothing,
}

fn change(
    clause: &EffectClause,
    names: &Renaming,
    readings: &[(String, Name)],
) -> TranslatedClause {
    let renamed = |namespace: Namespace, name: &Name| {
        let mut name = name.clone();
        names.rename(namespace, &mut name);
        name
    };
    let expression = |expr: &Expr, hidden: &[Name]| {
        let hidden: Vec<&str> = hidden.iter().map(|name| name.text.as_str()).collect();
        let mut expr = expr.clone();
        names.rename_in(&mut expr, &hidden);
        expr
    };
    match &clause.kind {
        ClauseKind::Kind(_) | ClauseKind::Form(_) => TranslatedClause::Nothing,
        ClauseKind::Null { name, value } => {
            TranslatedClause::Null(renamed(Namespace::Value, name), expression(value, &[]))
        }
        ClauseKind::Replace { name, arguments, equation, by } => {
            TranslatedClause::Change(ChangeKind::Replace {
                name: renamed(Namespace::Value, name),
                arguments: arguments.clone(),
                equation: equation.as_ref().map(|label| renamed(Namespace::Equation, label)),
                by: expression(by, arguments),
            })
        }
        ClauseKind::ReplaceOutput { output, by } => {
            let argument = readings.iter().find(|(slot, _)| *slot == output.text);
            let text = argument.map_or(&output.text, |(_, argument)| &argument.text).clone();
            TranslatedClause::Change(ChangeKind::Output {
                output: Name { text, span: output.span },
                own: output.text.clone(),
                by: expression(by, &[]),
            })
        }
        ClauseKind::Add { value, equation } => TranslatedClause::Change(ChangeKind::Add {
            equation: renamed(Namespace::Equation, equation),
            value: expression(value, &[]),
        }),
    }
}

/// Finds names for the declarations of an effect.
struct EffectNaming<'a, 'd> {
    application: &'a EffectApplication<'a>,
    declared: &'d mut NameDeclarations,
    blending: EffectBlending,
    diagnostics: &'d mut Diagnostics,
}

impl EffectNaming<'_, '_> {
    /// The name of a declaration in the model, followed by the arguments.
    ///
    /// If many effects are tried at a time, a name that is taken is followed by the effect's.
    fn named(&mut self, namespace: Namespace, name: &Name) -> String {
        let effect = self.application.effect;
        let mut suffix = String::new();
        for argument in &self.application.arguments {
            suffix.push('_');
            suffix.push_str(&argument.text);
        }
        let first = Name { text: format!("{}{suffix}", name.text), span: name.span };
        let Err(earlier) = self.declared.insert(namespace, &first) else {
            return first.text;
        };
        if self.blending != EffectBlending::Applied {
            let effect_name = effect.full_name().replace('/', "_");
            let text = format!("{}_{effect_name}{suffix}", name.text);
            let second = Name { text, span: name.span };
            if self.declared.insert(namespace, &second).is_ok() {
                return second.text;
            }
        }
        let message = format!(
            "effect `{}` brings `{}`, which is there already",
            effect.full_name(),
            first.text
        );
        self.diagnostics.error(
            Diagnostic::new(Code::DuplicateName, name.span, message).label(earlier, "first here"),
        );
        first.text
    }
}

/// `parameter blend_NAME [1] = 0 in 0 .. 1`
fn blend_parameter(name: Name) -> Item {
    let span = name.span;
    let number = |text: &str, value: f64| Expr {
        span,
        kind: ExprKind::Number { value, text: text.to_owned(), unit: None },
    };
    let bounds = AttributeKind::Bounds(Some(number("0", 0.0)), Some(number("1", 1.0)));
    let kind = ItemKind::Parameter {
        name,
        unit: None,
        value: number("0", 0.0),
        attributes: vec![Attribute { span, kind: bounds }],
    };
    Item { span, doc: Vec::new(), kind }
}

/// The slots of an effect with their arguments, after checking them.
fn bound<'a>(
    application: &'a EffectApplication<'_>,
    model: &Ast,
    declared: &NameDeclarations,
    diagnostics: &mut Diagnostics,
) -> Result<Vec<(&'a TemplateSlot, &'a Name)>, ErrorReported> {
    let effect = application.effect;
    let full_name = effect.full_name();
    let misfit = |span: Span, message: String| Diagnostic::new(Code::EffectMismatch, span, message);
    let slots = match &effect.target {
        EffectTarget::Model(target) => {
            let header = model.model.as_ref();
            if header.is_none_or(|header| header.name.text != target.text) {
                let message = format!("effect `{full_name}` is for model `{}`", target.text);
                let diagnostic = misfit(target.span, message);
                return Err(diagnostics.error(match header {
                    Some(header) => {
                        let text = format!("this is model `{}`", header.name.text);
                        diagnostic.label(header.name.span, text)
                    }
                    None => diagnostic,
                }));
            }
            &[]
        }
        EffectTarget::Template(slots) => slots.as_slice(),
    };
    if slots.len() != application.arguments.len() {
        let (wanted, given) = (slots.len(), application.arguments.len());
        let message = format!(
            "effect `{full_name}` takes {wanted} argument{}, not {given}",
            if wanted == 1 { "" } else { "s" }
        );
        let help = if slots.is_empty() {
            format!("write `{full_name}`")
        } else {
            let names: Vec<&str> = slots.iter().map(|slot| slot.name.text.as_str()).collect();
            let kinds: Vec<&str> = slots.iter().map(|slot| noun(slot.kind)).collect();
            let (names, kinds) = (names.join(", "), kinds.join(" and "));
            format!("write `{full_name}({names})` with {kinds} of the model")
        };
        return Err(diagnostics.error(misfit(application.span, message).help(help)));
    }
    let mut problems = Diagnostics::default();
    let bound: Vec<(&TemplateSlot, &Name)> = slots.iter().zip(&application.arguments).collect();
    for (slot, argument) in &bound {
        let declaration = declared.get(namespace_of(slot.kind), &argument.text);
        let fits = |kind: Option<SlotKind>| kind.is_some_and(|kind| kind.fits(slot.kind));
        if !fits(declaration.and_then(|declaration| declaration.kind)) {
            let is = noun(slot.kind);
            let message = format!(
                "`{}` is not {is} of the model, which `{}` must be",
                argument.text, slot.name.text
            );
            let known = declared.names_in(namespace_of(slot.kind)).filter(|name| {
                fits(declared.get(namespace_of(slot.kind), name).and_then(|d| d.kind))
            });
            let near =
                suggestion(&argument.text, known).map(|near| format!("did you mean `{near}`?"));
            problems.error(
                misfit(argument.span, message)
                    .label(slot.name.span, "asked for here")
                    .maybe_help(near),
            );
            continue;
        }
        verify_dimension(slot, argument, declared, &mut problems);
    }
    for diagnostic in problems.sorted() {
        diagnostics.error(diagnostic.clone());
    }
    problems.check()?;
    Ok(bound)
}

/// Checks that an argument has the dimension of its slot.
fn verify_dimension(
    slot: &TemplateSlot,
    argument: &Name,
    declared: &NameDeclarations,
    own: &mut Diagnostics,
) {
    if matches!(slot.kind, SlotKind::Equation | SlotKind::Let) {
        return; // which is known when its units are checked
    }
    let symbol = declared.unit(namespace_of(slot.kind), &argument.text);
    let symbol = symbol.map_or("1", |unit| unit.text.as_str());
    let wanted = slot.unit.as_ref().and_then(|unit| parse_unit(&unit.text).ok());
    if let (Some(wanted), Ok(found)) = (wanted, parse_unit(symbol))
        && wanted.dimension != found.dimension
    {
        let message = format!(
            "`{}` is in `{symbol}`, but `{}` must be in `{}` or the like",
            argument.text, slot.name.text, wanted.symbol
        );
        own.error(
            Diagnostic::new(Code::EffectMismatch, argument.span, message)
                .label(slot.name.span, "asked for here"),
        );
    }
}
