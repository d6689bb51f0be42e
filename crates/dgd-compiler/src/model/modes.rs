//! Items that change at events: `modes`, with equations for each mode, `when`, `every` and `saturate`.

use std::collections::BTreeMap;

use super::check_units::ExprDimension;
use super::expression::{ExprLowering, NumberReading, TypedExpr};
use super::resolver::ModelResolver;
use super::scope::NameDefinition;
use super::{
    Array, Automaton, AutomatonOrigin, DeclarationHeader, Equation, Family, Mode, Reset,
    Saturation, Transition,
};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::{ExprId, Node, Symbol};
use crate::source::Span;
use crate::syntax::ast::{self, BoundSide, Crossing, Expr, Item, ItemKind, Name, VariantChoice};
use crate::syntax::print::{print_condition, print_every};
use crate::units::{Dimension, Unit};

impl<'a> ModelResolver<'a> {
    pub(super) fn automaton(
        &mut self,
        item: &Item,
        name: &Name,
        modes: &'a [VariantChoice],
        transitions: &'a [ast::TransitionClause],
        starts: &'a [ast::StartMode],
        diagnostics: &mut Diagnostics,
    ) -> Result<Automaton, ErrorReported> {
        let names = ModeNames { automaton: name, positions: mode_names(modes, diagnostics) };
        let always = starts.iter().find(|start| start.condition.is_none());
        let start = always.map_or(Ok(0), |start| names.position(&start.mode, diagnostics));
        // Each mode reports its own errors; the next is independent of them.
        let modes: Vec<Result<Mode, ErrorReported>> =
            modes.iter().map(|mode| self.mode(mode, diagnostics)).collect();
        let transitions: Vec<Result<Vec<Transition>, ErrorReported>> = transitions
            .iter()
            .map(|transition| self.transition(transition, &names, diagnostics))
            .collect();
        let transitions: Result<Vec<Vec<Transition>>, ErrorReported> =
            transitions.into_iter().collect();
        let starts: Vec<Result<Transition, ErrorReported>> = starts
            .iter()
            .filter_map(|start| Some((&start.mode, start.condition.as_ref()?)))
            .map(|(mode, condition)| self.start_mode(mode, condition, &names, diagnostics))
            .collect();
        let starts: Result<Vec<Transition>, ErrorReported> = starts.into_iter().collect();
        Ok(Automaton {
            origin: AutomatonOrigin::Modes,
            name: name.text.clone(),
            doc: item.doc.clone(),
            modes: modes.into_iter().collect::<Result<_, _>>()?,
            start: start?,
            transitions: transitions?.into_iter().flatten().chain(starts?).collect(),
            period: None,
        })
    }

    fn mode(
        &mut self,
        mode: &'a VariantChoice,
        diagnostics: &mut Diagnostics,
    ) -> Result<Mode, ErrorReported> {
        let mut equations = Vec::new();
        for item in &mode.items {
            let ItemKind::Equation { label, left, right, attributes } = &item.kind else {
                unreachable!("the parser lets only equations into a mode")
            };
            equations.push(self.equation(item, label, [left, right], attributes, diagnostics));
        }
        let equations = equations.into_iter().collect::<Result<_, _>>()?;
        Ok(Mode { name: mode.name.text.clone(), doc: mode.doc.clone(), equations })
    }

    fn transition(
        &mut self,
        transition: &'a ast::TransitionClause,
        names: &ModeNames<'_>,
        diagnostics: &mut Diagnostics,
    ) -> Result<Vec<Transition>, ErrorReported> {
        let from = names.position(&transition.from, diagnostics);
        let target = names.position(&transition.to, diagnostics);
        let (conditions, resets) = (&transition.conditions, &transition.resets);
        let transitions = self.reactions(transition.span, conditions, resets, diagnostics)?;
        let (from, target) = (Some(from?), target?);
        Ok(transitions.into_iter().map(|one| Transition { from, to: target, ..one }).collect())
    }

    /// A transition from mode 0 to itself for each condition.
    fn reactions(
        &mut self,
        span: Span,
        conditions: &'a [ast::CrossingCondition],
        resets: &'a [ast::ResetClause],
        diagnostics: &mut Diagnostics,
    ) -> Result<Vec<Transition>, ErrorReported> {
        let sides: Vec<Result<[TypedExpr; 2], ErrorReported>> =
            conditions.iter().map(|condition| self.sides(condition, diagnostics)).collect();
        let resets = self.resets(resets, diagnostics);
        let sides = sides.into_iter().collect::<Result<Vec<_>, _>>()?;
        let resets = resets?;
        let transitions =
            conditions.iter().zip(sides).map(|(condition, [left, right])| Transition {
                span,
                from: Some(0),
                to: 0,
                left: left.id,
                crossing: condition.crossing,
                right: right.id,
                resets: resets.clone(),
            });
        Ok(transitions.collect())
    }

    /// Both sides of a condition.
    fn sides(
        &mut self,
        condition: &'a ast::CrossingCondition,
        diagnostics: &mut Diagnostics,
    ) -> Result<[TypedExpr; 2], ErrorReported> {
        let left = self.lowering.value(&condition.left, diagnostics);
        let right = self.lowering.value(&condition.right, diagnostics);
        let (left, right) = (left?, right?);
        let sides = [left.locate(condition.left.span), right.locate(condition.right.span)];
        self.lowering
            .scope
            .spelling
            .same("compare", sides[0], sides[1])
            .map_err(|diagnostic| diagnostics.error(diagnostic))?;
        Ok([left, right])
    }

    /// `start MODE if CONDITION`: a transition at the start if the value, 1 or −1, is above zero.
    fn start_mode(
        &mut self,
        mode: &Name,
        condition: &'a Expr,
        names: &ModeNames<'_>,
        diagnostics: &mut Diagnostics,
    ) -> Result<Transition, ErrorReported> {
        let target = names.position(mode, diagnostics);
        let holds = self.lowering.truth(condition, diagnostics)?;
        self.check_start_condition(holds, condition, diagnostics)?;
        let graph = &mut self.lowering.graph;
        let (yes, no) = (graph.constant(1.0), graph.constant(-1.0));
        let left = graph.intern(Node::Select(holds, yes, no));
        let right = graph.constant(0.0);
        let (from, crossing, resets) = (None, Crossing::Rises, Vec::new());
        Ok(Transition { span: condition.span, from, to: target?, left, crossing, right, resets })
    }

    /// Checks that conditions at the start read only start values that are known.
    fn check_start_condition(
        &self,
        holds: ExprId,
        condition: &Expr,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        let ExprLowering { graph, scope, .. } = &self.lowering;
        let is_unsolved = |symbol: &Symbol| match symbol {
            Symbol::Unknown(_) | Symbol::Element(_) => !scope.is_state(*symbol),
            Symbol::Derivative(_) | Symbol::ElementRate(_) => true,
            _ => false,
        };
        let symbols = graph.symbols(holds);
        let culprit = match symbols.iter().find(|symbol| is_unsolved(symbol)) {
            Some(symbol) => scope.quoted_name(*symbol).unwrap_or_else(|| "an unknown".to_owned()),
            None if self.reads_past(holds) => "the past of a state".to_owned(),
            None => return Ok(()),
        };
        let message =
            format!("the mode to start in depends on {culprit}, which is not known before");
        Err(diagnostics.error(
            Diagnostic::new(Code::StartReadsUnknown, condition.span, message)
                .help("use states, parameters, constants, inputs and `time`"),
        ))
    }

    /// A `when` or an `every`.
    pub(super) fn reacting(
        &mut self,
        item: &'a Item,
        diagnostics: &mut Diagnostics,
    ) -> Result<Automaton, ErrorReported> {
        match &item.kind {
            ItemKind::When(reaction) => self.when(item, reaction, diagnostics),
            ItemKind::Every { period, offset, resets } => {
                self.every(item, (period, offset.as_ref()), resets, diagnostics)
            }
            _ => unreachable!("asked before"),
        }
    }

    /// A `when` is an automaton of one mode, with transitions back to it.
    fn when(
        &mut self,
        item: &Item,
        reaction: &'a ast::Reaction,
        diagnostics: &mut Diagnostics,
    ) -> Result<Automaton, ErrorReported> {
        let ast::Reaction { conditions, resets } = reaction;
        let transitions = self.reactions(item.span, conditions, resets, diagnostics)?;
        Ok(of_one_mode(item, AutomatonOrigin::When, print_condition(reaction), transitions))
    }

    /// An `every` is an automaton of one mode, too; its transition occurs at the ticks of a clock.
    fn every(
        &mut self,
        item: &Item,
        (period, offset): (&'a Expr, Option<&'a Expr>),
        resets: &'a [ast::ResetClause],
        diagnostics: &mut Diagnostics,
    ) -> Result<Automaton, ErrorReported> {
        let clock = self.period(period, diagnostics);
        let first = offset.map(|offset| self.time_of_clock("offset", offset, diagnostics));
        let resets = self.resets(resets, diagnostics);
        let zero = self.lowering.graph.constant(0.0);
        let transition = Transition {
            span: item.span,
            from: Some(0),
            to: 0,
            left: zero,
            crossing: Crossing::Rises,
            right: zero,
            resets: resets?,
        };
        let name = print_every(period, offset);
        let name = name.strip_prefix("every ").unwrap_or(&name).to_owned();
        let automaton = of_one_mode(item, AutomatonOrigin::Every, name, vec![transition]);
        Ok(Automaton { period: Some([first.unwrap_or(Ok(zero))?, clock?]), ..automaton })
    }

    /// A positive time, in terms of parameters.
    fn period(
        &mut self,
        expr: &'a Expr,
        diagnostics: &mut Diagnostics,
    ) -> Result<ExprId, ErrorReported> {
        let id = self.time_of_clock("period", expr, diagnostics)?;
        if self.lowering.number(id).is_some_and(|value| value.is_nan() || value <= 0.0) {
            let message = "a period must be above zero";
            return Err(diagnostics.error(Diagnostic::new(
                Code::SizeNotPositive,
                expr.span,
                message,
            )));
        }
        Ok(id)
    }

    /// A period or an offset: a time, in terms of parameters.
    fn time_of_clock(
        &mut self,
        what: &str,
        expr: &'a Expr,
        diagnostics: &mut Diagnostics,
    ) -> Result<ExprId, ErrorReported> {
        let typed = self.lowering.value(expr, diagnostics)?;
        let ExprLowering { graph, scope, .. } = &self.lowering;
        if typed.dim.unify(ExprDimension::Of(scope.second)).is_none() {
            let dimension = typed.dim.dimension();
            let message = format!(
                "the {what} of an `every` is a time, but this is {}",
                scope.spelling.being(dimension)
            );
            return Err(diagnostics.error(
                Diagnostic::new(Code::UnitsOfSides, expr.span, message)
                    .help("give it a unit of time: `every 10 [s] offset 2 [s]`"),
            ));
        }
        let varies =
            |symbol: &&Symbol| !matches!(symbol, Symbol::Parameter(_) | Symbol::Constant(_));
        let symbols = graph.symbols(typed.id);
        if let Some(symbol) = symbols.iter().find(varies) {
            let varying = scope.quoted_name(*symbol).unwrap_or_else(|| "what varies".to_owned());
            let message = format!("the {what} of an `every` cannot depend on {varying}");
            return Err(diagnostics.error(
                Diagnostic::new(Code::VaryingPeriod, expr.span, message)
                    .help("make it of parameters and constants"),
            ));
        }
        Ok(typed.id)
    }

    /// The equation of a held value: its rate is zero.
    pub(super) fn held(&mut self, item: &Item, name: &Name) -> Result<Equation, ErrorReported> {
        let entry = self.lowering.scope.names.get(name.text.as_str());
        let Some(NameDefinition::Unknown { index, .. }) = entry.map(|entry| entry.definition)
        else {
            unreachable!("a held value is an unknown")
        };
        let declared = self.declared(item, name)?;
        Ok(self.still(item.span, &declared, Symbol::Derivative(index)))
    }

    /// The equations of an array of held values, one for each of its rows.
    pub(super) fn held_rows(&mut self, item: &Item, rows: &[Array]) {
        for Array { unknown, lower, first, count } in rows {
            let (rate, is_one) = match count {
                1 => (Symbol::ElementRate(*first), true),
                _ => (Symbol::SweptRate(*first), false),
            };
            let equation = self.still(item.span, &unknown.declared, rate);
            if is_one {
                self.model.equations.push(equation);
            } else {
                let (lower, count) = (*lower, *count);
                let index = "i".to_owned();
                self.model.families.push(Family { equation, index, lower, count });
            }
        }
    }

    /// The equation that a rate is zero.
    fn still(&mut self, span: Span, declared: &DeclarationHeader, rate: Symbol) -> Equation {
        let ExprLowering { graph, scope, .. } = &mut self.lowering;
        Equation {
            label: format!("held {}", declared.name),
            span,
            doc: Vec::new(),
            left: graph.symbol(rate),
            right: graph.constant(0.0),
            dimension: declared.unit.dimension.divide(scope.second).unwrap_or(Dimension::ONE),
            is_exact: true,
        }
    }

    fn resets(
        &mut self,
        all: &'a [ast::ResetClause],
        diagnostics: &mut Diagnostics,
    ) -> Result<Vec<Reset>, ErrorReported> {
        let resets: Vec<Result<Reset, ErrorReported>> =
            all.iter().map(|reset| self.reset(reset, diagnostics)).collect();
        let mut once = Vec::new();
        for reset in resets {
            self.add_reset(&mut once, reset?, diagnostics)?;
        }
        Ok(once)
    }

    /// Adds a reset to those of the same event.
    pub(super) fn add_reset(
        &self,
        resets: &mut Vec<Reset>,
        reset: Reset,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        if let Some(first) = resets.iter().find(|first| first.unknown == reset.unknown) {
            let name = self.lowering.scope.quoted_name(reset.unknown).unwrap_or_default();
            let diagnostic =
                Diagnostic::new(Code::DuplicateName, reset.span, format!("{name} is reset twice"));
            return Err(diagnostics.error(if first.span == reset.span {
                diagnostic.help("let each index of the loop reset an element of its own")
            } else {
                diagnostic.label(first.span, "first here")
            }));
        }
        resets.push(reset);
        Ok(())
    }

    fn reset(
        &mut self,
        reset: &'a ast::ResetClause,
        diagnostics: &mut Diagnostics,
    ) -> Result<Reset, ErrorReported> {
        let (unknown, unit) =
            self.unknown_named(&reset.name, &reset.indices, "reset", diagnostics)?;
        let value = self.in_unit(&reset.value, &unit, NumberReading::Value, diagnostics)?.id;
        Ok(Reset { span: reset.span, unknown, value })
    }

    /// `saturate x >= e`
    pub(super) fn saturation(
        &mut self,
        item: &Item,
        (name, indices): (&'a Name, &'a [Expr]),
        side: BoundSide,
        bound: &'a Expr,
        diagnostics: &mut Diagnostics,
    ) -> Result<Saturation, ErrorReported> {
        let (unknown, unit) = self.unknown_named(name, indices, "saturated", diagnostics)?;
        let bound_span = bound.span;
        let bound = self.in_unit(bound, &unit, NumberReading::Value, diagnostics)?.id;
        let symbols = self.lowering.graph.symbols(bound);
        if let Some(symbol) = symbols.iter().find(|symbol| symbol.is_of_unknown()) {
            let varying = self.lowering.scope.quoted_name(*symbol).unwrap_or_default();
            let message = format!("a bound cannot depend on {varying}");
            return Err(diagnostics.error(
                Diagnostic::new(Code::BoundReadsUnknown, bound_span, message)
                    .help("make it of parameters, constants, inputs and time"),
            ));
        }
        let same = |other: &&Saturation| other.unknown == unknown && other.side == side;
        if let Some(first) = self.model.saturations.iter().find(same) {
            let name = self.lowering.scope.quoted_name(unknown).unwrap_or_default();
            let message = format!("{name} has two bounds on one side");
            let diagnostic = Diagnostic::new(Code::DuplicateName, item.span, message);
            return Err(diagnostics.error(if first.span == item.span {
                diagnostic.help("let each index of the loop bound an element of its own")
            } else {
                diagnostic.label(first.span, "first here")
            }));
        }
        Ok(Saturation { span: item.span, unknown, side, bound })
    }

    /// The unknown or element that an item names, and its unit.
    fn unknown_named(
        &mut self,
        name: &'a Name,
        indices: &'a [Expr],
        done: &str,
        diagnostics: &mut Diagnostics,
    ) -> Result<(Symbol, Unit), ErrorReported> {
        let entry = self.lowering.scope.names.get(name.text.as_str()).cloned();
        let what = entry.as_ref().map(|entry| entry.definition);
        let (Some(entry), Some(NameDefinition::Unknown { .. } | NameDefinition::Array { .. })) =
            (&entry, what)
        else {
            let message = match what {
                Some(other) => {
                    format!("`{}` is {}, which cannot be {done}", name.text, other.noun())
                }
                None => format!("nothing is called `{}`", name.text),
            };
            let code = if what.is_some() { Code::MisusedName } else { Code::UnknownName };
            let diagnostic = Diagnostic::new(code, name.span, message).about(&name.text);
            let near =
                diagnostics.suggestion(&name.text, self.lowering.scope.names.keys().copied());
            return Err(diagnostics.error(match near.filter(|_| what.is_none()) {
                Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
                None => diagnostic.help("name a `state` or an `unknown`"),
            }));
        };
        let (unit, declared) = (entry.unit.clone(), entry.span);
        let wrong = |message: String| {
            Diagnostic::new(Code::ArrayAsNumber, name.span, message)
                .about(&name.text)
                .label(declared, "declared here")
        };
        let symbol = match what {
            Some(NameDefinition::Unknown { index, .. }) if indices.is_empty() => {
                Symbol::Unknown(index)
            }
            Some(NameDefinition::Array { .. }) if !indices.is_empty() => {
                self.lowering.element_named(name, indices, diagnostics)?
            }
            Some(NameDefinition::Array { .. }) => {
                let message = format!("`{}` is an array: say which element is {done}", name.text);
                return Err(diagnostics.error(wrong(message).help(format!(
                    "name one, as in `{0}[1]`, or all in a loop: `for i in 1..N {{ … {0}[i] … }}`",
                    name.text
                ))));
            }
            _ => {
                let message =
                    format!("`{}` is {}, not an array", name.text, entry.definition.noun());
                return Err(diagnostics.error(wrong(message).help("leave out the brackets")));
            }
        };
        Ok((symbol, unit.unwrap_or_else(|| Ok(Unit::one()))?))
    }
}

/// An automaton of one mode without equations.
fn of_one_mode(
    item: &Item,
    origin: AutomatonOrigin,
    name: String,
    transitions: Vec<Transition>,
) -> Automaton {
    let mode = Mode { name: String::new(), doc: Vec::new(), equations: Vec::new() };
    let (doc, modes) = (item.doc.clone(), vec![mode]);
    Automaton { origin, name, doc, modes, start: 0, transitions, period: None }
}

/// Positions of modes by name; of two with one name the first is used.
fn mode_names<'a>(
    modes: &'a [VariantChoice],
    diagnostics: &mut Diagnostics,
) -> BTreeMap<&'a str, usize> {
    let mut names = BTreeMap::new();
    for (i, mode) in modes.iter().enumerate() {
        if let Some(first) = names.get(mode.name.text.as_str()).copied() {
            let first: &VariantChoice = &modes[first];
            let message = format!("two modes are called `{}`", mode.name.text);
            diagnostics.error(
                Diagnostic::new(Code::DuplicateName, mode.name.span, message)
                    .about(&mode.name.text)
                    .label(first.name.span, "first here"),
            );
        } else {
            names.insert(mode.name.text.as_str(), i);
        }
    }
    names
}

/// The modes of an automaton.
struct ModeNames<'a> {
    automaton: &'a Name,
    positions: BTreeMap<&'a str, usize>,
}

impl ModeNames<'_> {
    fn position(&self, mode: &Name, diagnostics: &mut Diagnostics) -> Result<usize, ErrorReported> {
        self.positions.get(mode.text.as_str()).copied().ok_or_else(|| {
            let message = format!("`{}` has no mode `{}`", self.automaton.text, mode.text);
            let diagnostic = Diagnostic::new(Code::UnknownMode, mode.span, message)
                .about(&self.automaton.text)
                .about(&mode.text);
            let known: Vec<&str> = self.positions.keys().copied().collect();
            let help = diagnostics.suggestion(&mode.text, known.iter().copied()).map_or_else(
                || format!("there is `{}`", known.join("`, `")),
                |near| format!("did you mean `{near}`?"),
            );
            diagnostics.error(diagnostic.help(help))
        })
    }
}
