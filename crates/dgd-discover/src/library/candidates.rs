//! Lists every way to apply the effects of a library to a model.

use dgd_compiler::effects::{Effect, EffectApplication, EffectReach, bind};
use dgd_compiler::model::Model;
use dgd_compiler::syntax::ast::Ast;
use dgd_compiler::syntax::ast::{
    Attribute, AttributeKind, ClauseKind, EffectKind, EffectTarget, Expr, ExprKind, ItemKind, Name,
    SlotKind,
};
use dgd_compiler::syntax::visit::{self, ItemPart};

use super::adapted::AdaptedTemplate;
use super::number::plain;

/// An effect with possible arguments.
#[derive(Debug, Clone)]
pub(crate) struct EffectCandidate<'a> {
    /// The effect and its arguments.
    pub application: EffectApplication<'a>,
    /// Parameters of the effect file that are compared with time: they give an onset.
    pub onsets: Vec<String>,
    /// Parameters of the effect file that are delays.
    pub delays: Vec<String>,
    /// Whether it is a template that fits any model.
    pub is_generic: bool,
    /// The parts of the model that it replaces and hides.
    pub reach: EffectReach,
    /// Whether it has constants without influence where the effect vanishes.
    pub has_inner: bool,
    /// Whether it brings unknowns of its own.
    pub brings_unknowns: bool,
}

impl<'a> EffectCandidate<'a> {
    /// An effect with these arguments, with an empty reach.
    pub(crate) fn new(effect: &'a Effect, arguments: &[String], is_generic: bool) -> Self {
        let span = effect.name.span;
        let name = |text: &String| Name { text: text.clone(), span };
        let arguments = arguments.iter().map(name).collect();
        let (onsets, delays) = moments(effect);
        EffectCandidate {
            application: EffectApplication { effect, arguments, span },
            onsets,
            delays,
            is_generic,
            reach: EffectReach::default(),
            has_inner: has_inner(effect),
            brings_unknowns: brings_unknowns(effect),
        }
    }
}

impl EffectCandidate<'_> {
    /// Its realisation, if its family has several.
    pub(crate) fn form(&self) -> Option<String> {
        self.application.effect.form.as_ref().map(|form| form.text.clone())
    }

    /// The name that a discovery reports: the family, or a template with its arguments.
    pub(crate) fn name(&self) -> String {
        let name = self.application.effect.name.text.clone();
        if !self.is_generic {
            return name;
        }
        let arguments = self.application.arguments.iter().map(|name| name.text.as_str());
        format!("{name}({})", arguments.collect::<Vec<_>>().join(", "))
    }

    /// Its subject: the family, or the place of a template.
    pub(crate) fn subject(&self) -> String {
        if self.is_generic { format!("at {}", self.target()) } else { self.name() }
    }

    /// Whether one of the two hides the other, so that they cannot be screened together.
    pub(crate) fn excludes(&self, other: &EffectCandidate<'_>) -> bool {
        self.reach.excludes(&other.reach)
    }

    /// Whether one of the two has a kink and both change the same name: at a kink without slope, such as a band of zero
    /// width, the other would seem to have no influence.
    pub(crate) fn bends(&self, other: &EffectCandidate<'_>) -> bool {
        self.target() == other.target() && (self.has_kink() || other.has_kink())
    }

    /// Whether its change of the model has a kink or a jump.
    pub(crate) fn has_kink(&self) -> bool {
        has_kink(self.application.effect)
    }

    /// Whether the period of an `every` in its file depends on a constant.
    pub(crate) fn is_clock(&self, constant: &str) -> bool {
        fn reads(expr: &Expr, name: &str) -> bool {
            matches!(&expr.kind, ExprKind::Name(own) if own == name)
                || visit::operands(expr).into_iter().any(|operand| reads(operand, name))
        }
        self.application.effect.ast.items.iter().any(|item| match &item.kind {
            ItemKind::Every { period, .. } => reads(period, constant),
            _ => false,
        })
    }

    /// The constants of its file that are not fixed.
    pub(crate) fn free_constants(&self) -> Vec<&str> {
        let items = self.application.effect.ast.items.iter();
        let free = items.filter_map(|item| match &item.kind {
            ItemKind::Parameter { name, attributes, .. } => {
                let mut attributes = attributes.iter();
                (!attributes.any(|one| one.kind == AttributeKind::Fixed))
                    .then_some(name.text.as_str())
            }
            _ => None,
        });
        free.collect()
    }

    /// Whether it scales its target: one of its parameters is one where it vanishes.
    pub(crate) fn scales(&self) -> bool {
        let clauses = self.application.effect.ast.effect.iter().flat_map(|header| &header.clauses);
        clauses.into_iter().any(|clause| match &clause.kind {
            ClauseKind::Null { value, .. } => plain(value) == Some(1.0),
            _ => false,
        })
    }

    /// Whether it is a template that takes an input.
    pub(crate) fn is_at_input(&self) -> bool {
        match &self.application.effect.target {
            EffectTarget::Template(slots) => slots.iter().any(|slot| slot.kind == SlotKind::Input),
            EffectTarget::Model(_) => false,
        }
    }

    /// Whether it is a template that takes any quantity of the model.
    pub(crate) fn depends_on_a_quantity(&self) -> bool {
        match &self.application.effect.target {
            EffectTarget::Template(slots) => {
                slots.iter().any(|slot| slot.kind == SlotKind::Quantity)
            }
            EffectTarget::Model(_) => false,
        }
    }

    /// Whether it is a template for a parameter.
    pub(crate) fn changes_a_parameter(&self) -> bool {
        match &self.application.effect.target {
            EffectTarget::Template(slots) => {
                slots.first().is_some_and(|slot| slot.kind == SlotKind::Parameter)
            }
            EffectTarget::Model(_) => false,
        }
    }

    /// `plant`, `sensor` or `input`.
    pub(crate) fn kind(&self) -> &'static str {
        match self.application.effect.kind {
            EffectKind::Plant => "plant",
            EffectKind::Sensor => "sensor",
            EffectKind::Input => "input",
        }
    }
}

/// All candidates, in the order of the library and of the model's items. Effects that only add to a model without
/// changing it are left out.
pub(crate) fn candidates<'a>(
    library: &'a [Effect],
    asts: &[Ast],
    model: &Model,
) -> Vec<EffectCandidate<'a>> {
    let mut candidates = Vec::new();
    for effect in library.iter().filter(|effect| effect.changes_model()) {
        for arguments in bind(effect, model) {
            let candidate = EffectCandidate::new(effect, &arguments, false);
            // An effect that cannot be applied is refused later, and not screened together with others.
            let reach = EffectReach::find(asts, &candidate.application).unwrap_or_default();
            candidates.push(EffectCandidate { reach, ..candidate });
        }
    }
    candidates
}

/// Effects that cannot be applied anywhere, with the reasons.
pub(crate) fn unbound(library: &[Effect], model: &Model) -> Vec<(String, String)> {
    let why = |effect: &Effect| {
        if !effect.changes_model() {
            return Some("only adds to the model and changes nothing in it".to_owned());
        }
        bind(effect, model).is_empty().then(|| match &effect.target {
            EffectTarget::Model(name) => format!("is for the model `{}`", name.text),
            EffectTarget::Template(_) => {
                "finds nothing in the model that it could be applied to".to_owned()
            }
        })
    };
    library.iter().filter_map(|effect| Some((effect.full_name(), why(effect)?))).collect()
}

/// Candidates of templates that fit any model.
pub(crate) fn generic<'a>(
    templates: &'a [AdaptedTemplate],
    asts: &[Ast],
) -> Vec<EffectCandidate<'a>> {
    let mut candidates = Vec::new();
    for AdaptedTemplate { effect, arguments } in templates {
        if !effect.changes_model() {
            continue;
        }
        let candidate = EffectCandidate::new(effect, arguments, true);
        let reach = EffectReach::find(asts, &candidate.application).unwrap_or_default();
        candidates.push(EffectCandidate { reach, ..candidate });
    }
    candidates
}

/// Whether an effect declares states or unknowns.
fn brings_unknowns(effect: &Effect) -> bool {
    effect.ast.items.iter().any(|item| matches!(item.kind, ItemKind::Unknown { .. }))
}

/// Whether an effect has free parameters other than those in its `null`.
fn has_inner(effect: &Effect) -> bool {
    let clauses = effect.ast.effect.iter().flat_map(|header| &header.clauses);
    let nulls: Vec<&str> = clauses
        .filter_map(|clause| match &clause.kind {
            ClauseKind::Null { name, .. } => Some(name.text.as_str()),
            _ => None,
        })
        .collect();
    let is_fixed =
        |attributes: &[Attribute]| attributes.iter().any(|a| a.kind == AttributeKind::Fixed);
    effect.ast.items.iter().any(|item| match &item.kind {
        ItemKind::Parameter { name, attributes, .. } => {
            !nulls.contains(&name.text.as_str()) && !is_fixed(attributes)
        }
        _ => false,
    })
}

/// Functions of the language that have kinks or jumps.
const KINKED: [&str; 9] = ["min", "max", "abs", "sign", "clamp", "floor", "ceil", "round", "mod"];

/// Whether an expression with which an effect changes a model has a kink: one of [`KINKED`] or a choice.
fn has_kink(effect: &Effect) -> bool {
    fn is_in(expr: &Expr) -> bool {
        let is_kinked = match &expr.kind {
            ExprKind::Call { function, .. } => KINKED.contains(&function.text.as_str()),
            ExprKind::If { .. } => true,
            _ => false,
        };
        is_kinked || visit::operands(expr).into_iter().any(is_in)
    }
    changes(effect).any(is_in)
}

/// Expressions with which an effect changes a model.
fn changes(effect: &Effect) -> impl Iterator<Item = &Expr> {
    let clauses = effect.ast.effect.iter().flat_map(|header| &header.clauses);
    clauses.filter_map(|clause| match &clause.kind {
        ClauseKind::Replace { by, .. } | ClauseKind::ReplaceOutput { by, .. } => Some(by),
        ClauseKind::Add { value, .. } => Some(value),
        ClauseKind::Kind(_) | ClauseKind::Form(_) | ClauseKind::Null { .. } => None,
    })
}

/// Parameters of an effect that are compared with time, and those that are delays.
fn moments(effect: &Effect) -> (Vec<String>, Vec<String>) {
    let mut expressions: Vec<Expr> = changes(effect).cloned().collect();
    let mut parameters: Vec<String> = Vec::new();
    for item in &effect.ast.items {
        if let ItemKind::Parameter { name, .. } = &item.kind {
            parameters.push(name.text.clone());
        }
        visit::parts_mut(&mut item.clone(), &mut |part| {
            if let ItemPart::Expr(_, expr) = part {
                expressions.push(expr.clone());
            }
        });
    }
    let (mut compared, mut delays) = (Vec::new(), Vec::new());
    for expr in &expressions {
        collect_compared(expr, &mut compared);
        collect_delays(expr, &mut delays);
    }
    let those = |among: &[String]| -> Vec<String> {
        parameters.iter().filter(|name| among.contains(name)).cloned().collect()
    };
    (those(&compared), those(&delays))
}

/// Collects names that are the second argument of `delay`.
fn collect_delays(expr: &Expr, names: &mut Vec<String>) {
    if let ExprKind::Call { function, arguments } = &expr.kind
        && let ("delay", [_, Expr { kind: ExprKind::Name(name), .. }]) =
            (function.text.as_str(), arguments.as_slice())
    {
        names.push(name.clone());
    }
    for operand in visit::operands(expr) {
        collect_delays(operand, names);
    }
}

/// Collects names that are the other side of a comparison with `time`.
fn collect_compared(expr: &Expr, names: &mut Vec<String>) {
    if let ExprKind::Compare(_, left, right) = &expr.kind {
        match (&left.kind, &right.kind) {
            (ExprKind::Name(time), ExprKind::Name(name))
            | (ExprKind::Name(name), ExprKind::Name(time))
                if time == "time" =>
            {
                names.push(name.clone());
            }
            _ => {}
        }
    }
    for operand in visit::operands(expr) {
        collect_compared(operand, names);
    }
}

impl EffectCandidate<'_> {
    /// Whether the declared value of a parameter of the effect file is its null.
    pub(crate) fn is_declared_at_null(&self, parameter: &str) -> bool {
        let ast = &self.application.effect.ast;
        let declared = ast.items.iter().find_map(|item| match &item.kind {
            ItemKind::Parameter { name, value, .. } if name.text == parameter => plain(value),
            _ => None,
        });
        let mut clauses = ast.effect.iter().flat_map(|header| &header.clauses);
        let null = clauses.find_map(|clause| match &clause.kind {
            ClauseKind::Null { name, value } if name.text == parameter => plain(value),
            _ => None,
        });
        declared.is_some() && declared == null
    }

    /// Its target: an equation, an output, or a name of the model. The target of a template that replaces a name in
    /// equations is that name.
    pub(crate) fn target(&self) -> String {
        let effect = self.application.effect;
        let slots = match &effect.target {
            EffectTarget::Template(slots) => slots.as_slice(),
            EffectTarget::Model(_) => &[],
        };
        let is_slot = |name: &Name| slots.iter().any(|slot| slot.name.text == name.text);
        let changed =
            effect.ast.effect.iter().flat_map(|header| &header.clauses).find_map(|clause| {
                match &clause.kind {
                    ClauseKind::Replace { name, .. } if is_slot(name) => Some(&name.text),
                    ClauseKind::Replace { equation: Some(equation), .. }
                    | ClauseKind::Add { equation, .. } => Some(&equation.text),
                    ClauseKind::Replace { name, .. } => Some(&name.text),
                    ClauseKind::ReplaceOutput { output, .. } => Some(&output.text),
                    ClauseKind::Kind(_) | ClauseKind::Form(_) | ClauseKind::Null { .. } => None,
                }
            });
        let Some(name) = changed else { return String::new() };
        let slot = slots.iter().position(|slot| slot.name.text == *name);
        let argument = slot.and_then(|slot| self.application.arguments.get(slot));
        argument.map_or_else(|| name.clone(), |argument| argument.text.clone())
    }
}
