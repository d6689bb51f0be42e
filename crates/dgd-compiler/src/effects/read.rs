//! Turns a parsed file into a complete effect.

use std::collections::BTreeMap;

use super::Effect;
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported, suggestion};
use crate::source::Span;
use crate::syntax::ast::{
    Ast, ClauseKind, EffectClause, EffectHeader, EffectTarget, ItemKind, Name, TemplateSlot,
};
use crate::syntax::visit::{self, ItemPart};
use crate::units::parse_unit;

impl Effect {
    /// Makes an effect of a parsed file.
    ///
    /// # Errors
    ///
    /// [`ErrorReported`] if the file is not an effect, lacks its `kind`, repeats a clause that is allowed only once,
    /// changes nothing, or refers to arguments and parameters that it does not have.
    pub fn read(ast: Ast, diagnostics: &mut Diagnostics) -> Result<Effect, ErrorReported> {
        let Some(header) = &ast.effect else {
            let start = Span { source: ast.source, start: 0, end: 0 };
            return Err(diagnostics.error(
                Diagnostic::new(
                    Code::NoModelLine,
                    start,
                    "this file does not say which effect it is",
                )
                .help("begin it with `effect NAME on MODEL` or `effect NAME(y: output)`"),
            ));
        };
        let mut problems = Diagnostics::default();
        let mut kind = None;
        let mut form: Option<Name> = None;
        for clause in &header.clauses {
            match &clause.kind {
                ClauseKind::Kind(this) => {
                    once(
                        kind.replace((*this, clause.span)).map(|(_, span)| span),
                        clause.span,
                        &mut problems,
                    );
                }
                ClauseKind::Form(this) => {
                    once(
                        form.replace(this.clone()).map(|name| name.span),
                        this.span,
                        &mut problems,
                    );
                }
                ClauseKind::Null { .. }
                | ClauseKind::Replace { .. }
                | ClauseKind::ReplaceOutput { .. }
                | ClauseKind::Add { .. } => {}
            }
        }
        if kind.is_none() {
            problems.error(
                incomplete(header.name.span, format!("effect `{}` has no kind", header.name.text))
                    .help(
                        "write `kind plant`, `kind sensor` or `kind input` behind its first line",
                    ),
            );
        }
        verify_changes(&ast, header, &mut problems);
        verify_nulls(&ast, header, &mut problems);
        verify_items(&ast, &mut problems);
        let slots = match &header.target {
            EffectTarget::Model(_) => &[],
            EffectTarget::Template(slots) => slots.as_slice(),
        };
        verify_slots(&ast, slots, &mut problems);
        for diagnostic in problems.sorted() {
            diagnostics.error(diagnostic.clone());
        }
        problems.check()?;
        let Some((kind, _)) = kind else {
            unreachable!("an effect without a kind has been reported");
        };
        Ok(Effect {
            name: header.name.clone(),
            form,
            kind,
            doc: header.doc.clone(),
            target: header.target.clone(),
            ast,
        })
    }
}

fn incomplete(span: Span, message: impl Into<String>) -> Diagnostic {
    Diagnostic::new(Code::IncompleteEffect, span, message)
}

/// Reports a clause that is repeated although it is allowed only once.
fn once(earlier: Option<Span>, span: Span, diagnostics: &mut Diagnostics) {
    if let Some(earlier) = earlier {
        let message = "an effect says this once";
        diagnostics.error(incomplete(span, message).label(earlier, "first here"));
    }
}

/// Checks that an effect does more than declare: that it changes something, or adds an output or an equation.
fn verify_changes(ast: &Ast, header: &EffectHeader, diagnostics: &mut Diagnostics) {
    let mut acts = header.clauses.iter().any(is_change);
    visit::items(&ast.items, &mut |item| {
        acts |= matches!(
            item.kind,
            ItemKind::Output { .. }
                | ItemKind::Equation { .. }
                | ItemKind::When(_)
                | ItemKind::Every { .. }
                | ItemKind::Saturate { .. }
                | ItemKind::Start(_)
        );
    });
    if !acts {
        let message = format!("effect `{}` changes nothing", header.name.text);
        diagnostics.error(
            incomplete(header.name.span, message).help(
                "write `replace … by …` or `add … to EQUATION`, or an `output` or `equation`",
            ),
        );
    }
}

/// Whether a clause changes the model.
fn is_change(clause: &EffectClause) -> bool {
    matches!(
        clause.kind,
        ClauseKind::Replace { .. } | ClauseKind::ReplaceOutput { .. } | ClauseKind::Add { .. }
    )
}

impl Effect {
    /// Whether it changes an item of the model. Otherwise it only adds outputs, or equations of unknowns of its own,
    /// which cannot improve the model's predictions.
    pub fn changes_model(&self) -> bool {
        self.ast.effect.iter().flat_map(|header| &header.clauses).any(is_change)
    }
}

/// Checks that every `null` names a parameter of the effect, and no parameter twice.
fn verify_nulls(ast: &Ast, header: &EffectHeader, diagnostics: &mut Diagnostics) {
    let mut parameters: Vec<&str> = Vec::new();
    visit::items(&ast.items, &mut |item| {
        if let ItemKind::Parameter { name, .. } = &item.kind {
            parameters.push(&name.text);
        }
    });
    let mut spans: BTreeMap<&str, Span> = BTreeMap::new();
    for clause in &header.clauses {
        let ClauseKind::Null { name, .. } = &clause.kind else { continue };
        once(spans.insert(&name.text, name.span), name.span, diagnostics);
        if !parameters.contains(&name.text.as_str()) {
            let message = format!("this effect has no parameter `{}`", name.text);
            let help = match suggestion(&name.text, parameters.iter().copied()) {
                Some(near) => format!("did you mean `{near}`?"),
                None => {
                    "`null` gives a parameter of the effect the value at which the effect vanishes"
                        .to_owned()
                }
            };
            diagnostics.error(Diagnostic::new(Code::UnknownName, name.span, message).help(help));
        }
    }
}

/// Refuses items that an effect cannot add to a model.
fn verify_items(ast: &Ast, diagnostics: &mut Diagnostics) {
    visit::items(&ast.items, &mut |item| {
        if let ItemKind::Import { path_span, .. } = &item.kind {
            diagnostics.error(
                Diagnostic::new(
                    Code::UnusableImport,
                    *path_span,
                    "an effect does not import anything",
                )
                .help("it can use what the model imports"),
            );
        }
        if matches!(item.kind, ItemKind::Part { .. } | ItemKind::Binding { .. }) {
            let message = "an effect has no parts";
            diagnostics.error(
                Diagnostic::new(Code::UnusableImport, item.span, message)
                    .help("write what the part would do into the effect"),
            );
        }
    });
}

/// Checks that the arguments of a template differ, have valid units, and are not declared again; `[unit(y)]` is the
/// unit of one of them.
fn verify_slots(ast: &Ast, slots: &[TemplateSlot], diagnostics: &mut Diagnostics) {
    let mut spans: BTreeMap<&str, Span> = BTreeMap::new();
    for slot in slots {
        if let Some(first) = spans.insert(&slot.name.text, slot.name.span) {
            let message = format!("two arguments are called `{}`", slot.name.text);
            diagnostics.error(
                Diagnostic::new(Code::DuplicateName, slot.name.span, message)
                    .label(first, "first here"),
            );
        }
        if let Some(unit) = &slot.unit
            && let Err(error) = parse_unit(&unit.text)
        {
            diagnostics.error(error.locate(&unit.text, unit.span));
        }
    }
    for mut item in ast.items.iter().cloned() {
        visit::parts_mut(&mut item, &mut |part| {
            if let ItemPart::Declares(_, name) = part
                && let Some(argument) = spans.get(name.text.as_str())
            {
                let message = format!("`{}` is an argument of the effect", name.text);
                diagnostics.error(
                    Diagnostic::new(Code::DuplicateName, name.span, message)
                        .label(*argument, "declared here"),
                );
            }
        });
    }
    let has_unit = |name: &str| slots.iter().any(|slot| slot.name.text == name);
    super::units::each(ast, &mut |unit| {
        for name in super::units::arguments_in(&unit.text) {
            if !has_unit(name) {
                let message = format!("`{name}` is no argument of this effect");
                diagnostics.error(
                    Diagnostic::new(Code::UnknownUnit, unit.span, message)
                        .help("`unit(y)` is the unit of an argument, as in `y: output`"),
                );
            }
        }
    });
}
