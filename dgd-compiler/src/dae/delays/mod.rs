//! Delays taken apart: outputs that are read late, inputs that arrive late, unknowns that act late.
//!
//! A delay of an expression is the expression of what varies in it, each delayed:
//! delay(f(x, u, p), τ) = f(delay(x, τ), delay(u, τ), p), delay(time, τ) = time − τ, and
//! delay(delay(x, a), b) = delay(x, a + b). Once delays stand at names only,
//!
//! - an output whose states are all late by τ is read at t − τ as a whole,
//! - any other delayed input is an input of its own, behind those that are declared,
//! - any other delayed unknown is a symbol of its own.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use crate::dae::transfer::Transferred;
use crate::dae::{Delay, DelayedInput, DelayedUnknown, Unknown};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, Reported};
use crate::expr::display::listing;
use crate::expr::{ExprId, Graph, Node, Symbol};
use crate::model::Model;
use crate::source::Span;

/// Delays of delays open at most this many expressions.
const MOST_WORK: usize = 1_000_000;

/// The summands of a delay, ascending; numbers among them are added up.
type Summands = Vec<ExprId>;

/// What became of the delays of a model.
#[derive(Debug, Default)]
pub(super) struct Resolved {
    pub(super) delays: Vec<Delay>,
    pub(super) varying: Vec<Delay>,
    pub(super) inputs: Vec<DelayedInput>,
    pub(super) unknowns: Vec<DelayedUnknown>,
    /// For each output, how late it is read as a whole.
    pub(super) of_outputs: Vec<Option<usize>>,
}

impl Resolved {
    /// Reports delays that vary with what is known only once equations are solved.
    pub(super) fn verify_varying(
        &self,
        model: &Model,
        graph: &Graph,
        unknowns: &[Unknown],
        diagnostics: &mut Diagnostics,
    ) {
        for delay in &self.varying {
            let solved_for = graph.symbols(delay.tau).into_iter().find_map(|symbol| match symbol {
                Symbol::Unknown(i) if graph.value(unknowns[i as usize].mass) != Some(1.0) => {
                    Some(i)
                }
                _ => None,
            });
            if let Some(i) = solved_for {
                let declared = &model.unknowns[i as usize].declared;
                let message = format!(
                    "the delay `{}` depends on `{}`, which is algebraic",
                    delay.text, declared.name
                );
                diagnostics.error(
                    Diagnostic::new(Code::E215, declared.span, message)
                        .help("use states that have a derivative, inputs, time and parameters"),
                );
            }
        }
    }
}

/// Replaces delays in everything that was transferred.
///
/// After this no expression holds a delay or anything late: delayed inputs are inputs, and delayed
/// unknowns symbols of their own.
pub(super) fn resolve(
    model: &Model,
    graph: &mut Graph,
    transferred: &mut Transferred<'_>,
    diagnostics: &mut Diagnostics,
) -> Result<Resolved, Reported> {
    let Transferred { equations, starts, histories, outputs, transitions, bounds, names, .. } =
        transferred;
    let rests = equations.iter().map(|equation| equation.rest);
    let of_transitions = transitions.iter().flatten();
    let roots: Vec<ExprId> = rests
        .chain(starts.iter().copied())
        .chain(histories.iter().flatten().copied())
        .chain(outputs.iter().copied())
        .chain(bounds.iter().copied())
        .chain(
            of_transitions.flat_map(|(event, resets)| [event].into_iter().chain(resets)).copied(),
        )
        .chain(names.keys().copied())
        .collect();
    let nodes = graph.listed(roots);
    if !nodes.iter().any(|(_, node)| matches!(node, Node::Delay(..))) {
        let of_outputs = vec![None; outputs.len()];
        return Ok(Resolved { of_outputs, ..Resolved::default() });
    }

    let mut resolver = Resolver::new(model);
    let Some(at_names) = resolver.push_down(graph, &nodes) else {
        let span = model.outputs.first().map(|output| output.declared.span);
        let span = span.or(model.equations.first().map(|e| e.span)).unwrap_or_default();
        let message = "delays of delays open too many expressions";
        return Err(diagnostics.error(
            Diagnostic::new(Code::E211, span, message)
                .help("delay each part once, by the sum of its delays"),
        ));
    };
    for equation in equations.iter_mut() {
        match resolver.instantaneous(graph, at_names[&equation.rest]) {
            Ok(rest) => equation.rest = rest,
            Err(symbol) => {
                let reader = format!("equation `{}`", equation.label);
                diagnostics.error(resolver.late_rate(symbol, &reader, equation.span));
            }
        }
        resolver.refuse_the_future(equation.span, diagnostics);
    }
    for (automaton, values) in model.automata.iter().zip(transitions) {
        let reader = automaton.reader();
        for (transition, (event, resets)) in automaton.transitions.iter().zip(values) {
            let reset_spans = transition.resets.iter().map(|reset| reset.span);
            let spans = [transition.span].into_iter().chain(reset_spans);
            for (value, span) in [event].into_iter().chain(resets).zip(spans) {
                match resolver.instantaneous(graph, at_names[value]) {
                    Ok(now) => *value = now,
                    Err(symbol) => {
                        diagnostics.error(resolver.late_rate(symbol, &reader, span));
                    }
                }
                resolver.refuse_the_future(span, diagnostics);
            }
        }
    }
    for start in starts.iter_mut() {
        *start = resolver
            .instantaneous(graph, at_names[start])
            .unwrap_or_else(|_| unreachable!("start values read no unknowns"));
    }
    for history in histories.iter_mut().flatten() {
        *history = resolver
            .instantaneous(graph, at_names[history])
            .unwrap_or_else(|_| unreachable!("histories read no unknowns"));
    }
    for bound in bounds.iter_mut() {
        *bound = resolver
            .instantaneous(graph, at_names[bound])
            .unwrap_or_else(|_| unreachable!("bounds read no unknowns"));
    }
    let mut of_outputs = Vec::with_capacity(outputs.len());
    for (value, output) in outputs.iter_mut().zip(&model.outputs) {
        let mut delay = None;
        let at_once = resolver.output(graph, at_names[value]);
        // What is read at several times is read now, of a past that the run keeps.
        let read = at_once.or_else(|read| {
            let now = resolver.instantaneous(graph, at_names[value]);
            now.map(|now| (now, None)).map_err(|_| read)
        });
        match read {
            Ok((read, late)) => (*value, delay) = (read, late),
            Err([a, b]) => {
                let declared = &output.declared;
                let (a, b) = (resolver.name(a), resolver.name(b));
                let read = if a == b { a } else { format!("{a} and {b}") };
                let message = format!("output `{}` reads {read} at different times", declared.name);
                diagnostics.error(
                    Diagnostic::new(Code::E408, declared.span, message)
                        .help("declare an `unknown` that equals the derivative, and delay that"),
                );
            }
        }
        resolver.refuse_the_future(output.declared.span, diagnostics);
        of_outputs.push(delay);
    }
    diagnostics.check()?;
    let mut kept = BTreeMap::new();
    for (id, name) in names.iter() {
        if let Some(id) = resolver.known(graph, at_names[id])
            && graph.node(id).operands().next().is_some()
        {
            kept.insert(id, name.clone());
        }
    }
    *names = kept;
    let Resolver { delays, varying, inputs, unknowns, .. } = resolver;
    Ok(Resolved { delays, varying, inputs, unknowns, of_outputs })
}

struct Resolver<'a> {
    model: &'a Model,
    /// What is late, and by how much, by the number of its `Late` symbol.
    late: Vec<(Symbol, Summands)>,
    numbers: BTreeMap<(Symbol, Summands), u32>,
    work: usize,
    delays: Vec<Delay>,
    varying: Vec<Delay>,
    inputs: Vec<DelayedInput>,
    unknowns: Vec<DelayedUnknown>,
    /// What was read earlier than it is, whatever the parameters.
    early: Option<Symbol>,
}

impl<'a> Resolver<'a> {
    fn new(model: &'a Model) -> Self {
        Resolver {
            model,
            late: Vec::new(),
            numbers: BTreeMap::new(),
            work: 0,
            delays: Vec::new(),
            varying: Vec::new(),
            inputs: Vec::new(),
            unknowns: Vec::new(),
            early: None,
        }
    }

    /// The expressions with delays at names only; `None` where there are too many.
    fn push_down(
        &mut self,
        graph: &mut Graph,
        nodes: &[(ExprId, Node)],
    ) -> Option<HashMap<ExprId, ExprId>> {
        let mut built: HashMap<ExprId, ExprId> = HashMap::with_capacity(nodes.len());
        for &(id, node) in nodes {
            let here = match node {
                Node::Symbol(_) => id,
                Node::Delay(x, tau) => self.delayed(graph, built[&x], built[&tau])?,
                _ => graph.simplified(node.map(|operand| built[&operand])),
            };
            built.insert(id, here);
        }
        Some(built)
    }

    fn delayed(&mut self, graph: &mut Graph, x: ExprId, tau: ExprId) -> Option<ExprId> {
        let nodes = graph.listed([x]);
        self.work += nodes.len();
        if self.work > MOST_WORK {
            return None;
        }
        let built = graph.rebuild(&nodes, |graph, symbol| match self.source(symbol) {
            None => graph.symbol(symbol),
            Some((source, mut summands)) => {
                include(graph, &mut summands, tau);
                self.symbol(graph, source, summands)
            }
        });
        Some(built[&x])
    }

    /// What varies, and how late it is; nothing for a parameter.
    fn source(&self, symbol: Symbol) -> Option<(Symbol, Summands)> {
        match symbol {
            Symbol::Late(k) => Some(self.late[k as usize].clone()),
            Symbol::Time
            | Symbol::Input(_)
            | Symbol::Unknown(_)
            | Symbol::Derivative(_)
            | Symbol::Element(_)
            | Symbol::Swept(_)
            | Symbol::ElementRate(_)
            | Symbol::SweptRate(_) => Some((symbol, Summands::new())),
            Symbol::SweptSensitivity(_)
            | Symbol::Counter
            | Symbol::Constant(_)
            | Symbol::Parameter(_)
            | Symbol::InputSlope(_)
            | Symbol::Sensitivity(_)
            | Symbol::Discrete(_)
            | Symbol::DelayedUnknown(_)
            | Symbol::Past(..) => None,
        }
    }

    fn symbol(&mut self, graph: &mut Graph, source: Symbol, summands: Summands) -> ExprId {
        if summands.is_empty() {
            return graph.symbol(source);
        }
        let next = u32::try_from(self.late.len()).unwrap_or(u32::MAX);
        let number = *self.numbers.entry((source, summands)).or_insert_with_key(|late| {
            self.late.push(late.clone());
            next
        });
        graph.symbol(Symbol::Late(number))
    }

    /// An expression of what is known now of what is and was; otherwise the late derivative, of which
    /// nothing is.
    fn instantaneous(&mut self, graph: &mut Graph, id: ExprId) -> Result<ExprId, Symbol> {
        let mut replaced = BTreeMap::new();
        for symbol in graph.symbols(id) {
            let Symbol::Late(k) = symbol else { continue };
            let (source, summands) = self.late[k as usize].clone();
            let now = match source {
                Symbol::Input(i) => self.delayed_input(graph, i, &summands),
                Symbol::Time => shifted_time(graph, &[], &summands),
                Symbol::Unknown(i) => self.delayed_unknown(graph, i, &summands),
                other => return Err(other),
            };
            replaced.insert(symbol, now);
        }
        Ok(graph.substitute(id, |symbol| replaced.get(&symbol).copied()))
    }

    /// What an output reads at one time, and how late that is; otherwise two things that it reads
    /// at different times.
    fn output(
        &mut self,
        graph: &mut Graph,
        id: ExprId,
    ) -> Result<(ExprId, Option<usize>), [Symbol; 2]> {
        let read: Vec<(Symbol, Symbol, Summands)> = graph
            .symbols(id)
            .into_iter()
            .filter_map(|symbol| self.source(symbol).map(|(source, late)| (symbol, source, late)))
            .collect();
        // What varies is not the same for the whole of an output.
        if let Some((_, source, _)) = read.iter().find(|(_, _, late)| varies(graph, late)) {
            return Err([*source, *source]);
        }
        let is_unknown = |source: Symbol| {
            matches!(
                source,
                Symbol::Unknown(_)
                    | Symbol::Derivative(_)
                    | Symbol::Element(_)
                    | Symbol::ElementRate(_)
            )
        };
        let mut unknowns = read.iter().filter(|(_, source, _)| is_unknown(*source));
        let whole = if let Some((_, first, late)) = unknowns.next() {
            if let Some((_, other, _)) = unknowns.find(|(_, _, other)| other != late) {
                return Err([*first, *other]);
            }
            Some((*first, late.clone()))
        } else {
            // Inputs alone: read late as a whole where all of them are.
            let inputs = read.iter().filter(|(_, s, _)| matches!(s, Symbol::Input(_)));
            let distinct: BTreeSet<&Summands> = inputs.map(|(_, _, late)| late).collect();
            let source = read.first().map(|(_, source, _)| *source);
            match (distinct.len(), distinct.first(), source) {
                (1, Some(late), Some(source)) => Some((source, (*late).clone())),
                _ => None,
            }
        };
        let Some((first, whole)) = whole else {
            let now = self.instantaneous(graph, id);
            return Ok((now.unwrap_or_else(|_| unreachable!("it reads no unknowns")), None));
        };

        let mut replaced = BTreeMap::new();
        for (symbol, source, late) in read {
            let now = match source {
                Symbol::Input(i) => {
                    let (early, rest) = difference(&whole, &late);
                    if !early.is_empty() {
                        return Err([first, source]);
                    }
                    self.delayed_input(graph, i, &rest)
                }
                Symbol::Time => {
                    let (early, rest) = difference(&whole, &late);
                    shifted_time(graph, &early, &rest)
                }
                _ => graph.symbol(source),
            };
            replaced.insert(symbol, now);
        }
        let value = graph.substitute(id, |symbol| replaced.get(&symbol).copied());
        let delay = (!whole.is_empty()).then(|| self.delay(graph, &whole));
        Ok((value, delay))
    }

    /// An expression of which all that is late has been met already; nothing where it has not.
    fn known(&self, graph: &mut Graph, id: ExprId) -> Option<ExprId> {
        let mut replaced = BTreeMap::new();
        for symbol in graph.symbols(id) {
            let Symbol::Late(k) = symbol else { continue };
            let (source, summands) = &self.late[k as usize];
            let tau = sum(graph, summands);
            let varies = varies(graph, summands);
            let list = if varies { &self.varying } else { &self.delays };
            let delay = list.iter().position(|delay| delay.tau == tau)?;
            let now = match *source {
                Symbol::Input(i) => {
                    let wanted = DelayedInput { input: i as usize, delay };
                    self.input_symbol(self.inputs.iter().position(|x| *x == wanted)?)
                }
                Symbol::Unknown(i) => {
                    let wanted = DelayedUnknown { unknown: i as usize, delay, varies };
                    delayed_unknown_symbol(self.unknowns.iter().position(|x| *x == wanted)?)
                }
                _ => return None,
            };
            replaced.insert(symbol, graph.symbol(now));
        }
        Some(graph.substitute(id, |symbol| replaced.get(&symbol).copied()))
    }

    fn input_symbol(&self, position: usize) -> Symbol {
        let index = self.model.inputs.len() + position;
        Symbol::Input(u32::try_from(index).unwrap_or(u32::MAX))
    }

    fn delayed_input(&mut self, graph: &mut Graph, i: u32, summands: &[ExprId]) -> ExprId {
        if summands.is_empty() {
            return graph.symbol(Symbol::Input(i));
        }
        self.note_the_future(graph, Symbol::Input(i), summands);
        let wanted = DelayedInput { input: i as usize, delay: self.delay(graph, summands) };
        let found = self.inputs.iter().position(|x| *x == wanted);
        let position = found.unwrap_or_else(|| {
            self.inputs.push(wanted);
            self.inputs.len() - 1
        });
        graph.symbol(self.input_symbol(position))
    }

    fn delayed_unknown(&mut self, graph: &mut Graph, i: u32, summands: &[ExprId]) -> ExprId {
        if summands.is_empty() {
            return graph.symbol(Symbol::Unknown(i));
        }
        self.note_the_future(graph, Symbol::Unknown(i), summands);
        let (delay, varies) = (self.delay(graph, summands), varies(graph, summands));
        let wanted = DelayedUnknown { unknown: i as usize, delay, varies };
        let found = self.unknowns.iter().position(|x| *x == wanted);
        let position = found.unwrap_or_else(|| {
            self.unknowns.push(wanted);
            self.unknowns.len() - 1
        });
        graph.symbol(delayed_unknown_symbol(position))
    }

    fn delay(&mut self, graph: &mut Graph, summands: &[ExprId]) -> usize {
        let tau = sum(graph, summands);
        let list = if varies(graph, summands) { &mut self.varying } else { &mut self.delays };
        if let Some(position) = list.iter().position(|delay| delay.tau == tau) {
            return position;
        }
        let model = self.model;
        let text = listing(graph, &[tau], &BTreeMap::new(), &|symbol| match symbol {
            Symbol::Parameter(i) => model.parameters[i as usize].declared.name.clone(),
            Symbol::Time => "time".to_owned(),
            Symbol::Input(i) => model.inputs[i as usize].declared.name.clone(),
            Symbol::Unknown(i) => model.unknowns[i as usize].declared.name.clone(),
            _ => unreachable!("a delay is made of parameters, time, inputs and unknowns"),
        });
        let text = if text.lines.is_empty() { text.roots[0].clone() } else { "…".to_owned() };
        list.push(Delay { tau, text });
        list.len() - 1
    }

    fn note_the_future(&mut self, graph: &mut Graph, symbol: Symbol, summands: &[ExprId]) {
        let tau = sum(graph, summands);
        if graph.value(tau).is_some_and(|tau| tau < 0.0) {
            self.early = Some(symbol);
        }
    }

    /// Reports what reads the future.
    fn refuse_the_future(&mut self, span: Span, diagnostics: &mut Diagnostics) {
        let Some(symbol) = self.early.take() else { return };
        let message =
            format!("this reads the future of {}: its delay is negative", self.name(symbol));
        diagnostics.error(
            Diagnostic::new(Code::E215, span, message)
                .help("only an output can be early, the whole of it by one time"),
        );
    }

    /// A late derivative where it acts on the model.
    fn late_rate(&self, symbol: Symbol, reader: &str, span: Span) -> Diagnostic {
        let name = self.name(symbol);
        let message =
            format!("{reader} reads {name} as it was some time ago, which only outputs can");
        let diagnostic = Diagnostic::new(Code::E407, span, message).help(
            "derivatives that act late are not part of the language; declare an `unknown` that \
             equals the derivative, and delay that",
        );
        match symbol {
            Symbol::Unknown(i) | Symbol::Derivative(i) => {
                diagnostic.label(self.model.unknowns[i as usize].declared.span, "declared here")
            }
            _ => diagnostic,
        }
    }

    /// What a symbol is called, in quotes.
    fn name(&self, symbol: Symbol) -> String {
        match symbol {
            Symbol::Unknown(i) => format!("`{}`", self.model.unknowns[i as usize].declared.name),
            Symbol::Derivative(i) => {
                format!("`der({})`", self.model.unknowns[i as usize].declared.name)
            }
            Symbol::Input(i) => format!("`{}`", self.model.inputs[i as usize].declared.name),
            Symbol::Element(i) | Symbol::Swept(i) => format!("`{}`", self.model.element_name(i)),
            Symbol::ElementRate(i) | Symbol::SweptRate(i) => {
                format!("`der({})`", self.model.element_name(i))
            }
            Symbol::Time
            | Symbol::SweptSensitivity(_)
            | Symbol::Counter
            | Symbol::Constant(_)
            | Symbol::Parameter(_)
            | Symbol::InputSlope(_)
            | Symbol::Sensitivity(_)
            | Symbol::Discrete(_)
            | Symbol::Late(_)
            | Symbol::DelayedUnknown(_)
            | Symbol::Past(..) => unreachable!("only inputs and unknowns are named"),
        }
    }
}

fn delayed_unknown_symbol(position: usize) -> Symbol {
    Symbol::DelayedUnknown(u32::try_from(position).unwrap_or(u32::MAX))
}

/// Whether a delay is not the same at all times.
fn varies(graph: &Graph, summands: &[ExprId]) -> bool {
    let moves = |s: &Symbol| matches!(s, Symbol::Time | Symbol::Input(_) | Symbol::Unknown(_));
    summands.iter().any(|summand| graph.symbols(*summand).iter().any(moves))
}

/// Adds a summand to a delay.
fn include(graph: &mut Graph, summands: &mut Summands, tau: ExprId) {
    let mut tau = tau;
    if graph.value(tau).is_some()
        && let Some(at) = summands.iter().position(|other| graph.value(*other).is_some())
    {
        tau = graph.add(summands.remove(at), tau);
    }
    if graph.value(tau) != Some(0.0) {
        let at = summands.partition_point(|other| *other <= tau);
        summands.insert(at, tau);
    }
}

fn sum(graph: &mut Graph, summands: &[ExprId]) -> ExprId {
    let zero = graph.constant(0.0);
    summands.iter().fold(zero, |sum, summand| graph.add(sum, *summand))
}

/// Summands of `a` that `b` lacks, and the other way round.
fn difference(a: &[ExprId], b: &[ExprId]) -> (Summands, Summands) {
    let mut rest = b.to_vec();
    let mut lacking = Summands::new();
    for summand in a {
        match rest.iter().position(|other| other == summand) {
            Some(at) => {
                rest.remove(at);
            }
            None => lacking.push(*summand),
        }
    }
    (lacking, rest)
}

/// time + Σ early − Σ late
fn shifted_time(graph: &mut Graph, early: &[ExprId], late: &[ExprId]) -> ExprId {
    let time = graph.symbol(Symbol::Time);
    let (early, late) = (sum(graph, early), sum(graph, late));
    let time = graph.add(time, early);
    graph.subtract(time, late)
}
