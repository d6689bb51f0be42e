//! Pushes delays down to names and turns delayed names into inputs and unknowns.

use std::collections::{BTreeMap, BTreeSet};

use crate::dae::{DaeDelayedUnknown, Delay, DelayedInput};
use crate::diagnostics::{Code, Diagnostic, Diagnostics};
use crate::expr::display::listing;
use crate::expr::hash::HashMap;
use crate::expr::{ExprGraph, ExprId, Node, Symbol};
use crate::model::Model;
use crate::source::Span;

/// Nested delays are expanded into at most this many expressions.
const MOST_WORK: usize = 1_000_000;

/// The summands of a delay, ascending; constants among them are added up.
type Summands = Vec<ExprId>;

/// Resolves delays and records the results.
pub(super) struct DelayResolver<'a> {
    model: &'a Model,
    /// Delayed symbols and their delays, by the number of their `Delayed` symbol.
    symbols: Vec<(Symbol, Summands)>,
    numbers: BTreeMap<(Symbol, Summands), u32>,
    work: usize,
    pub(super) delays: Vec<Delay>,
    pub(super) varying: Vec<Delay>,
    pub(super) inputs: Vec<DelayedInput>,
    pub(super) unknowns: Vec<DaeDelayedUnknown>,
    /// A symbol read before its time, whatever the parameters.
    early: Option<Symbol>,
    /// Delays that are unknowns of their own, with the positions of these.
    lags: BTreeMap<ExprId, u32>,
}

impl<'a> DelayResolver<'a> {
    pub(super) fn new(model: &'a Model, lags: BTreeMap<ExprId, u32>) -> Self {
        DelayResolver {
            model,
            symbols: Vec::new(),
            numbers: BTreeMap::new(),
            work: 0,
            delays: Vec::new(),
            varying: Vec::new(),
            inputs: Vec::new(),
            unknowns: Vec::new(),
            early: None,
            lags,
        }
    }

    /// The expressions with their delays pushed down to names; `None` if there are too many.
    pub(super) fn push_down(
        &mut self,
        graph: &mut ExprGraph,
        nodes: &[(ExprId, Node)],
    ) -> Option<HashMap<ExprId, ExprId>> {
        let mut built: HashMap<ExprId, ExprId> =
            HashMap::with_capacity_and_hasher(nodes.len(), <_>::default());
        for &(id, node) in nodes {
            let here = match node {
                Node::Symbol(_) => id,
                Node::Delay(x, tau) => {
                    let tau = match self.lags.get(&built[&tau]) {
                        Some(lag) => graph.symbol(Symbol::Unknown(*lag)),
                        None => built[&tau],
                    };
                    self.delayed(graph, built[&x], tau)?
                }
                _ => graph.simplified(node.map(|operand| built[&operand])),
            };
            built.insert(id, here);
        }
        Some(built)
    }

    fn delayed(&mut self, graph: &mut ExprGraph, x: ExprId, tau: ExprId) -> Option<ExprId> {
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

    /// The undelayed symbol and its delay; `None` for a parameter.
    fn source(&self, symbol: Symbol) -> Option<(Symbol, Summands)> {
        match symbol {
            Symbol::Delayed(k) => Some(self.symbols[k as usize].clone()),
            Symbol::Time
            | Symbol::Input(_)
            | Symbol::Unknown(_)
            | Symbol::Derivative(_)
            | Symbol::Element(_)
            | Symbol::Swept(_)
            | Symbol::SweptInput(..)
            | Symbol::ElementRate(_)
            | Symbol::SweptRate(_) => Some((symbol, Summands::new())),
            Symbol::SweptSensitivity(_)
            | Symbol::Counter
            | Symbol::Constant(_)
            | Symbol::Parameter(_)
            | Symbol::SweptParameter(..)
            | Symbol::InputSlope(_)
            | Symbol::SweptInputSlope(..)
            | Symbol::Sensitivity(_)
            | Symbol::Discrete(_)
            | Symbol::DelayedUnknown(_)
            | Symbol::Past(..) => None,
        }
    }

    fn symbol(&mut self, graph: &mut ExprGraph, source: Symbol, summands: Summands) -> ExprId {
        if summands.is_empty() {
            return graph.symbol(source);
        }
        let next = u32::try_from(self.symbols.len()).unwrap_or(u32::MAX);
        let number = *self.numbers.entry((source, summands)).or_insert_with_key(|delay| {
            self.symbols.push(delay.clone());
            next
        });
        graph.symbol(Symbol::Delayed(number))
    }

    /// The expression, if it reads only present and past values; otherwise the delayed derivative, which is unknown.
    pub(super) fn instantaneous(
        &mut self,
        graph: &mut ExprGraph,
        id: ExprId,
    ) -> Result<ExprId, Symbol> {
        let mut replaced = BTreeMap::new();
        for symbol in graph.symbols(id) {
            let Symbol::Delayed(k) = symbol else { continue };
            let (source, summands) = self.symbols[k as usize].clone();
            let now = match source {
                Symbol::Input(i) => self.delayed_input(graph, i, &summands),
                Symbol::Time => shifted_time(graph, &[], &summands),
                Symbol::Unknown(_) | Symbol::Element(_) => {
                    self.delayed_unknown(graph, source, &summands)
                }
                other => return Err(other),
            };
            replaced.insert(symbol, now);
        }
        Ok(graph.substitute(id, |symbol| replaced.get(&symbol).copied()))
    }

    /// Unknowns in the delays of an expression's delayed values.
    pub(super) fn unknowns_in_delays(&self, graph: &ExprGraph, id: ExprId) -> Vec<u32> {
        let delayed = graph.symbols(id).into_iter().filter_map(|symbol| match symbol {
            Symbol::DelayedUnknown(k) => Some(self.unknowns[k as usize]),
            _ => None,
        });
        let varying = delayed.filter(|delayed| delayed.varies);
        let read = varying.flat_map(|delayed| graph.symbols(self.varying[delayed.delay].tau));
        let unknowns = read.filter_map(|symbol| match symbol {
            Symbol::Unknown(i) => Some(i),
            _ => None,
        });
        unknowns.collect()
    }

    /// The undelayed expression of an output and its delay; otherwise two symbols that it reads at different times.
    pub(super) fn output(
        &mut self,
        graph: &mut ExprGraph,
        id: ExprId,
    ) -> Result<(ExprId, Option<usize>), [Symbol; 2]> {
        let read: Vec<(Symbol, Symbol, Summands)> = graph
            .symbols(id)
            .into_iter()
            .filter_map(|symbol| self.source(symbol).map(|(source, delay)| (symbol, source, delay)))
            .collect();
        // A varying delay does not delay an output as a whole.
        if let Some((_, source, _)) = read.iter().find(|(_, _, delay)| varies(graph, delay)) {
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
        let whole = if let Some((_, first, delay)) = unknowns.next() {
            if let Some((_, other, _)) = unknowns.find(|(_, _, other)| other != delay) {
                return Err([*first, *other]);
            }
            Some((*first, delay.clone()))
        } else {
            // Only inputs: read as a whole with a delay if all of them are delayed.
            let inputs = read.iter().filter(|(_, s, _)| matches!(s, Symbol::Input(_)));
            let distinct: BTreeSet<&Summands> = inputs.map(|(_, _, delay)| delay).collect();
            let source = read.first().map(|(_, source, _)| *source);
            match (distinct.len(), distinct.first(), source) {
                (1, Some(delay), Some(source)) => Some((source, (*delay).clone())),
                _ => None,
            }
        };
        let Some((first, whole)) = whole else {
            let now = self.instantaneous(graph, id);
            return Ok((now.unwrap_or_else(|_| unreachable!("it reads no unknowns")), None));
        };

        let mut replaced = BTreeMap::new();
        for (symbol, source, delay) in read {
            let now = match source {
                Symbol::Input(i) => {
                    let (early, rest) = difference(&whole, &delay);
                    if !early.is_empty() {
                        return Err([first, source]);
                    }
                    self.delayed_input(graph, i, &rest)
                }
                Symbol::Time => {
                    let (early, rest) = difference(&whole, &delay);
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

    /// An expression whose delayed values have all been resolved before; otherwise `None`.
    pub(super) fn known(&self, graph: &mut ExprGraph, id: ExprId) -> Option<ExprId> {
        let mut replaced = BTreeMap::new();
        for symbol in graph.symbols(id) {
            let Symbol::Delayed(k) = symbol else { continue };
            let (source, summands) = &self.symbols[k as usize];
            let tau = sum(graph, summands);
            let varies = varies(graph, summands);
            let list = if varies { &self.varying } else { &self.delays };
            let delay = list.iter().position(|delay| delay.tau == tau)?;
            let now = match *source {
                Symbol::Input(i) => {
                    let wanted = DelayedInput { input: i as usize, delay };
                    self.input_symbol(self.inputs.iter().position(|x| *x == wanted)?)
                }
                unknown @ (Symbol::Unknown(_) | Symbol::Element(_)) => {
                    let wanted = DaeDelayedUnknown { unknown, delay, varies };
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

    fn delayed_input(&mut self, graph: &mut ExprGraph, i: u32, summands: &[ExprId]) -> ExprId {
        if summands.is_empty() {
            return graph.symbol(Symbol::Input(i));
        }
        self.note_the_future(graph, Symbol::Input(i), summands);
        let wanted = DelayedInput { input: i as usize, delay: self.delay(graph, summands) };
        let known = self.inputs.iter().position(|x| *x == wanted);
        let position = known.unwrap_or_else(|| {
            self.inputs.push(wanted);
            self.inputs.len() - 1
        });
        graph.symbol(self.input_symbol(position))
    }

    /// An unknown or an element.
    fn delayed_unknown(
        &mut self,
        graph: &mut ExprGraph,
        unknown: Symbol,
        summands: &[ExprId],
    ) -> ExprId {
        if summands.is_empty() {
            return graph.symbol(unknown);
        }
        self.note_the_future(graph, unknown, summands);
        let (delay, varies) = (self.delay(graph, summands), varies(graph, summands));
        let wanted = DaeDelayedUnknown { unknown, delay, varies };
        let known = self.unknowns.iter().position(|x| *x == wanted);
        let position = known.unwrap_or_else(|| {
            self.unknowns.push(wanted);
            self.unknowns.len() - 1
        });
        graph.symbol(delayed_unknown_symbol(position))
    }

    fn delay(&mut self, graph: &mut ExprGraph, summands: &[ExprId]) -> usize {
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

    fn note_the_future(&mut self, graph: &mut ExprGraph, symbol: Symbol, summands: &[ExprId]) {
        let tau = sum(graph, summands);
        if graph.value(tau).is_some_and(|tau| tau < 0.0) {
            self.early = Some(symbol);
        }
    }

    /// Reports a value that is read before its time.
    pub(super) fn refuse_the_future(&mut self, span: Span, diagnostics: &mut Diagnostics) {
        let Some(symbol) = self.early.take() else { return };
        let message =
            format!("this reads the future of {}: its delay is negative", self.name(symbol));
        diagnostics.error(
            Diagnostic::new(Code::InvalidDelay, span, message)
                .help("only an output can read ahead, and all of it by one time"),
        );
    }

    /// The error for a delayed derivative in the dynamics.
    pub(super) fn delayed_rate(&self, symbol: Symbol, reader: &str, span: Span) -> Diagnostic {
        let name = self.name(symbol);
        let message =
            format!("{reader} reads {name} as it was some time ago, which only outputs can");
        let diagnostic = Diagnostic::new(Code::DelayedDerivative, span, message).help(
            "a delayed derivative cannot act on the model; declare an `unknown` that \
             equals the derivative, and delay that",
        );
        match symbol {
            Symbol::Unknown(i) | Symbol::Derivative(i) => {
                diagnostic.label(self.model.unknowns[i as usize].declared.span, "declared here")
            }
            _ => diagnostic,
        }
    }

    /// The name of a symbol, in quotes.
    pub(super) fn name(&self, symbol: Symbol) -> String {
        match symbol {
            Symbol::Unknown(i) => format!("`{}`", self.model.unknowns[i as usize].declared.name),
            Symbol::Derivative(i) => {
                format!("`der({})`", self.model.unknowns[i as usize].declared.name)
            }
            Symbol::Input(i) | Symbol::SweptInput(i, _) => {
                format!("`{}`", self.model.inputs[i as usize].declared.name)
            }
            Symbol::Element(i) | Symbol::Swept(i) => format!("`{}`", self.model.element_name(i)),
            Symbol::ElementRate(i) | Symbol::SweptRate(i) => {
                format!("`der({})`", self.model.element_name(i))
            }
            Symbol::Time
            | Symbol::SweptSensitivity(_)
            | Symbol::Counter
            | Symbol::Constant(_)
            | Symbol::Parameter(_)
            | Symbol::SweptParameter(..)
            | Symbol::InputSlope(_)
            | Symbol::SweptInputSlope(..)
            | Symbol::Sensitivity(_)
            | Symbol::Discrete(_)
            | Symbol::Delayed(_)
            | Symbol::DelayedUnknown(_)
            | Symbol::Past(..) => unreachable!("only inputs and unknowns are named"),
        }
    }
}

fn delayed_unknown_symbol(position: usize) -> Symbol {
    Symbol::DelayedUnknown(u32::try_from(position).unwrap_or(u32::MAX))
}

/// Whether a delay varies with time.
fn varies(graph: &ExprGraph, summands: &[ExprId]) -> bool {
    let moves = |s: &Symbol| matches!(s, Symbol::Time | Symbol::Input(_) | Symbol::Unknown(_));
    summands.iter().any(|summand| graph.symbols(*summand).iter().any(moves))
}

/// Adds a summand to a delay.
fn include(graph: &mut ExprGraph, summands: &mut Summands, tau: ExprId) {
    let mut tau = tau;
    if graph.value(tau).is_some()
        && let Some(at) = summands.iter().position(|other| graph.value(*other).is_some())
    {
        tau = graph.add(summands.remove(at), tau);
    }
    if graph.value(tau) != Some(0.0) {
        let position = summands.partition_point(|other| *other <= tau);
        summands.insert(position, tau);
    }
}

fn sum(graph: &mut ExprGraph, summands: &[ExprId]) -> ExprId {
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
fn shifted_time(graph: &mut ExprGraph, early: &[ExprId], delayed: &[ExprId]) -> ExprId {
    let time = graph.symbol(Symbol::Time);
    let (early, delayed) = (sum(graph, early), sum(graph, delayed));
    let time = graph.add(time, early);
    graph.subtract(time, delayed)
}
