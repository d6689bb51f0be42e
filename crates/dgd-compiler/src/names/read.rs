//! Collects the names that expressions, clauses and items read.

use super::files::NamedFiles;
use super::{FileScope, NameTable, NameUse, SymbolId, SymbolKind};
use crate::source::{SourceId, SourceMap, Span};
use crate::syntax::ast::{
    ArrayAxis, Ast, Attribute, ClauseKind, CrossingCondition, EffectHeader, EffectTarget, Expr,
    ExprKind, FormalArgument, Item, ItemKind, LocalLet, LoopCounter, Name, PartArgument,
    ResetClause, StartRule, TransitionClause, WrittenUnit,
};
use crate::syntax::visit;

/// Records the names that a file reads.
pub(super) fn read(ast: &Ast, files: &NamedFiles<'_>, names: &mut NameTable, sources: &SourceMap) {
    let mut reader = NameReader { source: ast.source, files, names, sources, locals: Vec::new() };
    if let Some(header) = &ast.effect {
        reader.effect(header);
    }
    reader.items(&ast.items);
}

struct NameReader<'a> {
    source: SourceId,
    files: &'a NamedFiles<'a>,
    names: &'a mut NameTable,
    sources: &'a SourceMap,
    /// Arguments and indices that are open, innermost last.
    locals: Vec<(String, SymbolId)>,
}

impl NameReader<'_> {
    fn reads(&mut self, symbol: SymbolId, span: Span) {
        self.names.uses.push(NameUse { span, symbol, declares: false });
    }

    /// The first match in the scopes of the file itself and the files that it sees.
    fn find(&self, in_scope: impl Fn(&FileScope) -> Option<SymbolId>) -> Option<SymbolId> {
        let seen_files = self.names.seen.get(&self.source).into_iter().flatten();
        let mut seen_and_own = std::iter::once(&self.source).chain(seen_files);
        seen_and_own.find_map(|id| self.names.scopes.get(id).and_then(&in_scope))
    }

    /// Records a name that an expression reads.
    fn value(&mut self, text: &str, span: Span) {
        let local = self.locals.iter().rev().find(|(name, _)| name == text);
        let local_symbol = local.map(|(_, symbol)| *symbol);
        let readable = local_symbol.or_else(|| self.find(|scope| scope.value(text)));
        match readable.or_else(|| self.find(|scope| scope.any(text))) {
            Some(symbol) => self.reads(symbol, span),
            None => self.member(text, span, FileScope::any),
        }
    }

    fn name(&mut self, name: &Name) {
        self.value(&name.text, name.span);
    }

    /// `pump.c0`: the part, and a member of its model.
    fn member(
        &mut self,
        text: &str,
        span: Span,
        find: impl Fn(&FileScope, &str) -> Option<SymbolId>,
    ) {
        let spans = self.segments(span);
        let segments: Vec<&str> = text.split('.').collect();
        if segments.len() < 2 || spans.len() != segments.len() {
            return;
        }
        let part_of = |scope: &FileScope| scope.parts.get(segments[0]).map(|(symbol, _)| *symbol);
        let Some(part) = self.find(part_of) else { return };
        self.reads(part, spans[0]);
        let mut file = self.names.symbol(part).declared.source;
        let mut part = segments[0];
        for (i, segment) in segments.iter().enumerate().skip(1) {
            let scope = self.names.scopes.get(&file);
            let Some((_, model)) = scope.and_then(|scope| scope.parts.get(part)) else { return };
            let Some(inner) = self.files.model(model, file) else { return };
            let Some(scope) = self.names.scopes.get(&inner) else { return };
            let nested = scope.parts.get(*segment).map(|(symbol, _)| *symbol);
            let is_last = i + 1 == segments.len();
            match if is_last { find(scope, segment).or(nested) } else { nested } {
                Some(symbol) => self.reads(symbol, spans[i]),
                None => return,
            }
            (file, part) = (inner, segment);
        }
    }

    /// The places of the words between the points of a name.
    fn segments(&self, span: Span) -> Vec<Span> {
        let text = self.sources.text(span);
        let mut start = span.start;
        let mut spans = Vec::new();
        for word in text.split('.') {
            let blanks = (word.len() - word.trim_start().len()) as u32;
            let begin = start + blanks;
            let end = begin + word.trim().len() as u32;
            spans.push(Span { source: span.source, start: begin, end });
            start += word.len() as u32 + 1;
        }
        spans
    }

    fn output(&mut self, name: &Name) {
        let text = name.text.as_str();
        match self.find(|scope| scope.outputs.get(text).copied()) {
            Some(symbol) => self.reads(symbol, name.span),
            None => self.name(name),
        }
    }

    fn equation(&mut self, label: &Name) {
        let text = label.text.as_str();
        let slot = |scope: &FileScope| scope.slots.get(text).copied();
        let equation = |scope: &FileScope| scope.equations.get(text).copied();
        match self.find(slot).or_else(|| self.find(equation)) {
            Some(symbol) => self.reads(symbol, label.span),
            None => self.member(text, label.span, |scope, name| scope.equations.get(name).copied()),
        }
    }

    fn expr(&mut self, expr: &Expr) {
        match &expr.kind {
            ExprKind::Name(name) => self.value(name, expr.span),
            ExprKind::Call { function, .. } => self.name(function),
            ExprKind::Number { unit, .. } => self.unit(unit.as_ref()),
            ExprKind::Reduce(reduction) => {
                self.ends(&reduction.counters);
                let indices = reduction.counters.iter().map(|counter| &counter.index);
                self.with_indices(indices, |this| this.expr(&reduction.body));
                return;
            }
            _ => {}
        }
        for operand in visit::operands(expr) {
            self.expr(operand);
        }
    }

    /// The ends of ranges, in which no index is defined.
    fn ends(&mut self, counters: &[LoopCounter]) {
        for LoopCounter { range, .. } in counters {
            self.exprs([&range.lower, &range.upper]);
        }
    }

    fn exprs<'e>(&mut self, all: impl IntoIterator<Item = &'e Expr>) {
        all.into_iter().for_each(|expr| self.expr(expr));
    }

    /// `[unit(y)]` names an argument of the effect.
    fn unit(&mut self, unit: Option<&WrittenUnit>) {
        let Some(unit) = unit else { return };
        let text = self.sources.text(unit.span);
        for (at, _) in text.match_indices("unit(") {
            let start = at + "unit(".len();
            let Some(len) = text[start..].find(')') else { return };
            let name = text[start..start + len].trim();
            let blanks = text[start..start + len].find(name).unwrap_or(0);
            let begin = unit.span.start + (start + blanks) as u32;
            let end = begin + name.len() as u32;
            let span = Span { source: unit.span.source, start: begin, end };
            if let Some(symbol) = self.find(|scope| scope.slots.get(name).copied()) {
                self.reads(symbol, span);
            }
        }
    }

    /// Reads an item with additional indices.
    fn with_indices<'n>(
        &mut self,
        indices: impl IntoIterator<Item = &'n Name>,
        read: impl FnOnce(&mut Self),
    ) {
        let open = self.locals.len();
        for name in indices {
            let symbol = self.names.add(&name.text, SymbolKind::Index, name.span);
            self.locals.push((name.text.clone(), symbol));
        }
        read(self);
        self.locals.truncate(open);
    }

    /// The indices in brackets after a label or name in a loop.
    fn indices_behind(&mut self, name: &Name) {
        let text = &self.sources.get(name.span.source).text;
        let mut begin = name.span.end as usize;
        let mut spans = Vec::new();
        while let Some(inside) =
            text[begin..].strip_prefix('[').and_then(|rest| rest.split(']').next())
        {
            let start = begin + 1 + (inside.len() - inside.trim_start().len());
            spans.push((inside.trim().to_owned(), start as u32));
            begin += inside.len() + 2;
        }
        for (index, start) in spans {
            let end = start + index.len() as u32;
            self.value(&index, Span { source: name.span.source, start, end });
        }
    }

    fn items(&mut self, items: &[Item]) {
        for item in items {
            self.item(item);
        }
    }

    fn item(&mut self, item: &Item) {
        match &item.kind {
            ItemKind::Import { .. } | ItemKind::Start(StartRule::Steady) => {}
            ItemKind::Start(StartRule::Equation { left, right, .. }) => self.exprs([left, right]),
            ItemKind::Size { value, .. } | ItemKind::Unit { value, .. } => self.expr(value),
            ItemKind::Constant { unit, value, .. } | ItemKind::Let { unit, value, .. } => {
                self.unit(unit.as_ref());
                self.expr(value);
            }
            ItemKind::Parameter { unit, value, attributes, .. } => {
                self.unit(unit.as_ref());
                self.expr(value);
                self.attributes(attributes);
            }
            ItemKind::Input { unit, attributes, .. } => {
                self.unit(unit.as_ref());
                self.attributes(attributes);
            }
            ItemKind::Unknown { unit, start, attributes, .. } => {
                self.unit(unit.as_ref());
                self.exprs(start);
                self.attributes(attributes);
            }
            ItemKind::Array { axes, unit, start, attributes, .. } => {
                self.axes(axes);
                self.unit(unit.as_ref());
                let indices = axes.iter().filter_map(|axis| axis.index.as_ref());
                self.with_indices(indices, |this| {
                    this.exprs(start);
                    this.attributes(attributes);
                });
            }
            ItemKind::For { counters, items } => {
                self.ends(counters);
                self.with_indices(counters.iter().map(|counter| &counter.index), |this| {
                    for item in items {
                        if let Some(name) = item.kind.name_with_indices() {
                            this.indices_behind(name);
                        }
                        this.item(item);
                    }
                });
            }
            ItemKind::Function { arguments, lets, body, .. } => {
                self.function(arguments, lets, body);
            }
            ItemKind::Table { arguments, unit, points, attributes, .. } => {
                for FormalArgument { name, unit } in arguments {
                    self.unit(unit.as_ref());
                    self.names.add(&name.text, SymbolKind::Argument, name.span);
                }
                self.unit(unit.as_ref());
                self.exprs(points.expressions());
                self.attributes(attributes);
            }
            ItemKind::Output { name, unit, value, attributes } => {
                if value.is_none() {
                    self.name(name);
                }
                self.unit(unit.as_ref());
                self.exprs(value);
                // Its noise may read it.
                let symbol = self.find(|scope| scope.outputs.get(name.text.as_str()).copied());
                let open = self.locals.len();
                self.locals.extend(symbol.map(|symbol| (name.text.clone(), symbol)));
                self.attributes(attributes);
                self.locals.truncate(open);
            }
            ItemKind::Equation { left, right, attributes, .. } => {
                self.exprs([left, right]);
                self.attributes(attributes);
            }
            ItemKind::Variant { choices, .. } => {
                for choice in choices {
                    self.items(&choice.items);
                }
            }
            ItemKind::Modes { name, modes, transitions, starts } => {
                for mode in modes {
                    self.items(&mode.items);
                }
                for transition in transitions {
                    self.transition(name, transition);
                }
                for start in starts {
                    self.mode(name, &start.mode);
                    self.exprs(&start.condition);
                }
            }
            ItemKind::Part { axes, model, arguments, .. } => {
                self.axes(axes);
                let indices = axes.iter().filter_map(|axis| axis.index.as_ref());
                self.with_indices(indices, |this| this.part(model, arguments));
            }
            ItemKind::Binding { input, indices, value } => {
                self.name(input);
                self.exprs(indices);
                self.expr(value);
            }
            ItemKind::When(reaction) => {
                self.conditions(&reaction.conditions);
                self.resets(&reaction.resets);
            }
            ItemKind::Every { period, offset, resets } => {
                self.expr(period);
                self.exprs(offset);
                self.resets(resets);
            }
            ItemKind::Saturate { name, indices, bound, .. } => {
                self.name(name);
                self.exprs(indices);
                self.expr(bound);
            }
        }
    }

    fn axes(&mut self, axes: &[ArrayAxis]) {
        for ArrayAxis { range, .. } in axes {
            self.exprs([&range.lower, &range.upper]);
        }
    }

    fn attributes(&mut self, all: &[Attribute]) {
        self.exprs(all.iter().flat_map(visit::attribute_expressions));
    }

    fn function(&mut self, arguments: &[FormalArgument], lets: &[LocalLet], body: &Expr) {
        let open = self.locals.len();
        for FormalArgument { name, unit } in arguments {
            self.unit(unit.as_ref());
            let symbol = self.names.add(&name.text, SymbolKind::Argument, name.span);
            self.locals.push((name.text.clone(), symbol));
        }
        for LocalLet { name, unit, value } in lets {
            self.unit(unit.as_ref());
            self.expr(value);
            let symbol = self.names.add(&name.text, SymbolKind::Let, name.span);
            self.locals.push((name.text.clone(), symbol));
        }
        self.expr(body);
        self.locals.truncate(open);
    }

    fn mode(&mut self, block: &Name, mode: &Name) {
        let key = (block.text.clone(), mode.text.clone());
        if let Some(symbol) = self.find(|scope| scope.choices.get(&key).copied()) {
            self.reads(symbol, mode.span);
        }
    }

    fn transition(&mut self, block: &Name, transition: &TransitionClause) {
        let TransitionClause { from, to, conditions, resets, .. } = transition;
        self.mode(block, from);
        self.mode(block, to);
        self.conditions(conditions);
        self.resets(resets);
    }

    fn conditions(&mut self, all: &[CrossingCondition]) {
        for CrossingCondition { left, right, .. } in all {
            self.exprs([left, right]);
        }
    }

    fn resets(&mut self, resets: &[ResetClause]) {
        for ResetClause { name, indices, value, .. } in resets {
            self.name(name);
            self.exprs(indices);
            self.expr(value);
        }
    }

    /// The model of a part, and the names that its arguments set.
    fn part(&mut self, model: &Name, arguments: &[PartArgument]) {
        let inner = self.files.model(&model.text, self.source);
        let scope = inner.and_then(|inner| self.names.scopes.get(&inner)).cloned();
        if let Some(symbol) = scope.as_ref().and_then(|scope| scope.model) {
            self.reads(symbol, model.span);
        }
        for PartArgument { name, value } in arguments {
            let Some(scope) = &scope else {
                self.expr(value);
                continue;
            };
            let text = name.text.as_str();
            if let Some(symbol) = scope.values.get(text) {
                self.reads(*symbol, name.span);
                self.expr(value);
            } else if let Some(symbol) = scope.variants.get(text) {
                self.reads(*symbol, name.span);
                if let ExprKind::Name(choice) = &value.kind
                    && let Some(choice) = scope.choices.get(&(text.to_owned(), choice.clone()))
                {
                    self.reads(*choice, value.span);
                }
            } else {
                self.expr(value);
            }
        }
    }

    /// The target of an effect, and its clauses.
    fn effect(&mut self, header: &EffectHeader) {
        match &header.target {
            EffectTarget::Model(model) => {
                let file = self.files.model(&model.text, self.source);
                let scope = file.and_then(|file| self.names.scopes.get(&file));
                if let Some(symbol) = scope.and_then(|scope| scope.model) {
                    self.reads(symbol, model.span);
                }
            }
            EffectTarget::Template(slots) => {
                for slot in slots {
                    self.unit(slot.unit.as_ref());
                }
            }
        }
        for clause in &header.clauses {
            match &clause.kind {
                ClauseKind::Kind(_) | ClauseKind::Form(_) => {}
                ClauseKind::Null { name, value } => {
                    self.name(name);
                    self.expr(value);
                }
                ClauseKind::Replace { name, arguments, equation, by } => {
                    self.name(name);
                    if let Some(equation) = equation {
                        self.equation(equation);
                    }
                    let none = |name: &Name| FormalArgument { name: name.clone(), unit: None };
                    let arguments: Vec<FormalArgument> = arguments.iter().map(none).collect();
                    self.function(&arguments, &[], by);
                }
                ClauseKind::ReplaceOutput { output, by } => {
                    self.output(output);
                    self.replaced_output(output, by);
                }
                ClauseKind::Add { value, equation } => {
                    self.expr(value);
                    self.equation(equation);
                }
            }
        }
    }

    /// The replacement of an output, in which its name is the old value.
    fn replaced_output(&mut self, output: &Name, by: &Expr) {
        let text = output.text.as_str();
        let symbol = self.find(|scope| scope.outputs.get(text).copied());
        let open = self.locals.len();
        self.locals.extend(symbol.map(|symbol| (text.to_owned(), symbol)));
        self.expr(by);
        self.locals.truncate(open);
    }
}
