//! Dae → Program: takes derivatives, finds sparsity patterns, puts expressions in execution order.

use std::collections::BTreeMap;

use dgd_signature::arrays::PatternRun;
use dgd_signature::{Direction, PastLayout, Pattern};

use super::derivation::{
    Derivation, MOVING, RowRange, direction, input, parameter, rows, time, unknown,
};
use super::expressions::{ResultNumber, SystemExpressions};
use super::functions::{FUNCTIONS, FunctionKind, ResultKind};
use super::loops::schedule;
use super::operation::ProgramFunction;
use super::past::{begin, opened};
use super::taylor::{NonZero, SystemDerivatives, obstacle, taylor};
use super::{Program, describe, rounds};
use crate::dae::{self, Dae};
use crate::expr::{DelayedValue, ExprGraph, ExprId, Symbol};

/// Makes a program of a system, with sensitivities in these directions.
///
/// # Panics
///
/// If a direction is a position that the system does not have.
pub fn lower(dae: &Dae, directions: &[Direction]) -> Program {
    let exists = |direction: &Direction| match *direction {
        Direction::Parameter(i) => i < dae.parameters.len(),
        Direction::Start(i) => i < dae.n(),
    };
    assert!(directions.iter().all(exists), "directions are parameters and unknowns of the system");
    let dae = &*opened(dae);
    let past = PastLayout {
        first: dae.inputs.len() + 2 * dae.delayed_inputs.len(),
        n_v: dae.delayed_unknowns.len(),
        n_s: directions.len(),
    };
    let mut derivation = Derivation::new(dae, directions, past);
    let kinds = rounds::of_one_kind(dae);
    let functions: Vec<ProgramFunction> = FUNCTIONS
        .iter()
        .map(|spec| {
            let results: Vec<Vec<ResultNumber>> =
                spec.results.iter().map(|result| derivation.numbers(*result)).collect();
            let Derivation { graph, names, .. } = &derivation;
            let expressions = SystemExpressions { graph, dae, past };
            schedule(expressions, names, &kinds, spec.kind, &results)
        })
        .collect();
    let taylor = if let Some(reason) = obstacle(dae) {
        Err(reason)
    } else {
        let derivatives = derivation.for_taylor();
        let Derivation { graph, names, .. } = &mut derivation;
        taylor(dae, graph, names, &derivatives)
    };
    let events = &functions[FunctionKind::EventFunctions as usize];
    let signature = describe::signature(dae, directions, &derivation.patterns, events);
    Program {
        output_arrays: describe::output_arrays(dae),
        features: describe::features(dae, &signature),
        signature,
        source: describe::source(dae),
        functions,
        taylor,
    }
}

impl Derivation<'_> {
    /// f, and the non-zeros of ∂f/∂y and ∂f/∂θ with their positions.
    pub(super) fn for_taylor(&mut self) -> SystemDerivatives {
        let f = self.f();
        let values = self.result(ResultKind::Jacobian);
        let values = self.by_reciprocals(&values);
        let places =
            self.patterns.get(&ResultKind::Jacobian).into_iter().flat_map(Pattern::positions);
        let jacobian =
            places.zip(values).map(|((row, column), value)| NonZero { row, column, value });
        let jacobian = jacobian.collect();
        let mut directions = Vec::new();
        for (row, f) in f.iter().enumerate() {
            let slopes = self.by_direction(*f);
            let values: Vec<ExprId> = slopes.iter().map(|(_, value)| *value).collect();
            let values = self.by_reciprocals(&values);
            let columns = slopes.into_iter().map(|(column, _)| column);
            directions.extend(columns.zip(values).map(|(column, value)| NonZero {
                row,
                column,
                value,
            }));
        }
        let f = self.by_reciprocals(&f);
        SystemDerivatives { f, jacobian, directions }
    }

    /// The numbers of a result with their positions.
    fn numbers(&mut self, result: ResultKind) -> Vec<ResultNumber> {
        let values = self.result(result);
        let values = self.by_reciprocals(&values);
        let single = |(place, value)| ResultNumber { value, place, rows: None, family: None };
        if let Some(Pattern { runs, rows, .. }) = self.patterns.get(&result) {
            // Rows of f, direction by direction.
            let family = |row: usize| match result {
                ResultKind::Jacobian
                | ResultKind::ParameterJacobian
                | ResultKind::InputJacobian
                | ResultKind::Dgdy => self.family_of(row % self.n()),
                _ => None,
            };
            let n_single = values.len() - runs.len();
            let singles = values[..n_single].iter().copied().enumerate().zip(rows.iter());
            let mut numbers: Vec<ResultNumber> = singles
                .map(|(one, row)| ResultNumber { family: family(*row), ..single(one) })
                .collect();
            let mut place = n_single;
            for (value, run) in values[n_single..].iter().zip(runs.iter()) {
                let rows = u32::try_from(run.count).unwrap_or(u32::MAX);
                let family = family(run.row);
                numbers.push(ResultNumber { value: *value, place, rows: Some(rows), family });
                place += run.count;
            }
            return numbers;
        }
        let n_families = self.dae.families.len();
        let n_single = self.dae.unknowns.len();
        // The rows after the single ones that are families, or arrays, which are counted after these.
        let (rows, stride, behind) = match result {
            ResultKind::F
            | ResultKind::Dfdt
            | ResultKind::TimeDerivative
            | ResultKind::G
            | ResultKind::Dgdt
            | ResultKind::Mass => (self.rows_of_f(), self.n(), Some(0)),
            ResultKind::W | ResultKind::Dwdt | ResultKind::Dw => {
                (self.rows_of_w(), self.n_w(), None)
            }
            ResultKind::Y0 | ResultKind::S0 => {
                let arrays = self.dae.arrays.iter().map(|array| (array.first, array.count));
                (rows(n_single, arrays), self.n(), Some(n_families))
            }
            _ => return values.into_iter().enumerate().map(single).collect(),
        };
        let in_row = |(i, value): (usize, ExprId)| {
            let row = i % rows.len();
            let (place, count) = rows[row];
            let family = behind.zip(row.checked_sub(n_single)).map(|(first, k)| first + k);
            ResultNumber { value, place: i / rows.len() * stride + place, rows: count, family }
        };
        values.into_iter().enumerate().map(in_row).collect()
    }

    /// φ of each delayed unknown, zero without a declared one.
    fn histories(&mut self) -> Vec<ExprId> {
        let zero = self.graph.constant(0.0);
        let dae = self.dae;
        let past = |delayed: &dae::DaeDelayedUnknown| {
            let (history, row) = dae.history(dae::position(delayed.unknown))?;
            Some(dae::row_of(&mut self.graph, history, row))
        };
        let histories: Vec<Option<ExprId>> = dae.delayed_unknowns.iter().map(past).collect();
        histories.into_iter().map(|history| history.unwrap_or(zero)).collect()
    }

    /// The matrix of jumps, one row for each single unknown.
    fn jump_jacobian(&mut self) -> Vec<ExprId> {
        let n = self.dae.unknowns.len();
        let mut rows = vec![Vec::new(); n];
        for entry in &self.dae.impulses.entries {
            rows[entry.row].push((entry.column, entry.value));
        }
        let places: Vec<RowRange> = (0..n).map(|row| (row, None)).collect();
        self.non_zeros(ResultKind::JumpJacobian, rows, &places)
    }

    /// The numbers of a result, which several functions may share.
    fn result(&mut self, result: ResultKind) -> Vec<ExprId> {
        if let Some(numbers) = self.results.get(&result) {
            return numbers.clone();
        }
        let numbers = self.derive(result);
        self.results.insert(result, numbers.clone());
        numbers
    }

    fn derive(&mut self, result: ResultKind) -> Vec<ExprId> {
        let (f, w) = (self.f(), self.w());
        match result {
            ResultKind::F => f,
            ResultKind::W => w,
            ResultKind::Y0 => {
                let arrays = self.dae.arrays.iter().map(|array| array.start);
                self.dae.unknowns.iter().map(|unknown| unknown.start).chain(arrays).collect()
            }
            ResultKind::G => self.sensitivities_of(&f),
            ResultKind::Dfdt => f.iter().map(|f| self.along_time(*f)).collect(),
            ResultKind::Dgdt => {
                let zero = self.graph.constant(0.0);
                let slopes = self.derivatives_of_g(|derivation, e| {
                    let slope = derivation.along_time(e);
                    if slope == zero { Vec::new() } else { vec![(0, slope)] }
                });
                slopes.iter().map(|row| row.first().map_or(zero, |(_, slope)| *slope)).collect()
            }
            ResultKind::TimeDerivative => self.by_time(&f),
            ResultKind::Dwdt => self.by_time(&w),
            ResultKind::Dw => self.sensitivities_of(&w),
            ResultKind::S0 => {
                let start = self.result(ResultKind::Y0);
                let directions = self.directions;
                let n = start.len();
                let mut matrix = self.along_directions(&start);
                for (j, direction) in directions.iter().enumerate() {
                    // An element shares its expression with the others of its array; the caller adds its own
                    // contribution.
                    if let Direction::Start(i) = *direction
                        && i < self.dae.unknowns.len()
                    {
                        matrix[j * n + i] = self.graph.constant(1.0);
                    }
                }
                matrix
            }
            ResultKind::StartRest => self.start_rests(),
            ResultKind::StartRestSensitivities => self.sensitivities_of(&self.start_rests()),
            ResultKind::StartRestJacobian => self.dense(&self.start_rests(), self.n(), unknown),
            ResultKind::Tau => self.tau(),
            ResultKind::Dtau => {
                let tau = self.tau();
                self.along_directions(&tau)
            }
            ResultKind::Mass if self.dae.automata.is_empty() => Vec::new(),
            ResultKind::Mass => {
                let families = self.dae.families.iter().map(|family| family.mass);
                self.dae.unknowns.iter().map(|unknown| unknown.mass).chain(families).collect()
            }
            ResultKind::ConditionTimes => self.dae.time_conditions.iter().map(|c| c.at).collect(),
            ResultKind::ConditionAfter => {
                self.dae.time_conditions.iter().map(|condition| condition.after).collect()
            }
            ResultKind::ConditionTimeSensitivities => {
                let times = self.result(ResultKind::ConditionTimes);
                self.dense(&times, self.directions.len(), direction(self.directions))
            }
            ResultKind::Events => self.events(),
            ResultKind::EventDirections => self.by_directions(result, &self.events()),
            ResultKind::EventJacobian => self.sparse(result, &self.events(), unknown),
            ResultKind::EventSlopes => {
                self.events().iter().map(|event| self.along_time(*event)).collect()
            }
            ResultKind::Resets => self.resets(),
            ResultKind::ResetDirections => self.by_directions(result, &self.resets()),
            ResultKind::ResetJacobian => self.sparse(result, &self.resets(), unknown),
            ResultKind::ResetSlopes => {
                self.resets().iter().map(|reset| self.along_time(*reset)).collect()
            }
            ResultKind::JumpKinds => self.dae.impulses.kinds.clone(),
            ResultKind::JumpRests => self.dae.impulses.rests.clone(),
            ResultKind::JumpJacobian => self.jump_jacobian(),
            ResultKind::JumpRestSensitivities => self.sensitivities_of(&self.dae.impulses.rests),
            ResultKind::JumpRestSlopes => {
                let rests = &self.dae.impulses.rests;
                rests.iter().map(|rest| self.along_time(*rest)).collect()
            }
            ResultKind::JumpJacobianSensitivities => {
                let entries = self.result(ResultKind::JumpJacobian);
                self.sensitivities_of(&entries)
            }
            ResultKind::JumpJacobianSlopes => {
                let entries = self.result(ResultKind::JumpJacobian);
                entries.iter().map(|entry| self.along_time(*entry)).collect()
            }
            ResultKind::VaryingTau => self.varying_tau(),
            ResultKind::VaryingDtau => self.sensitivities_of(&self.varying_tau()),
            ResultKind::VaryingTauJacobian => self.dense(&self.varying_tau(), self.n(), unknown),
            ResultKind::VaryingTauSlopes => {
                self.varying_tau().iter().map(|tau| self.along_time(*tau)).collect()
            }
            ResultKind::History => self.histories(),
            ResultKind::HistoryRate => {
                let histories = self.histories();
                self.by_time(&histories)
            }
            ResultKind::HistoryCurvature => {
                let rates = self.result(ResultKind::HistoryRate);
                self.by_time(&rates)
            }
            ResultKind::HistorySensitivities => {
                let histories = self.histories();
                self.along_directions(&histories)
            }
            ResultKind::HistorySensitivityRates => {
                let rates = self.result(ResultKind::HistoryRate);
                self.along_directions(&rates)
            }
            ResultKind::Jacobian => self.sparse(result, &f, unknown),
            ResultKind::ParameterJacobian => self.partials(result, &f, parameter),
            ResultKind::InputJacobian => self.partials(result, &f, self.any_input()),
            ResultKind::Dwdy => self.sparse(result, &w, unknown),
            ResultKind::Dwdu => self.partials(result, &w, self.any_input()),
            ResultKind::Dwdp => self.partials(result, &w, parameter),
            ResultKind::Dgdy => {
                let rows = self.derivatives_of_g(|derivation, e| derivation.gradient(e, &unknown));
                let (own, n) = (self.rows_of_f(), self.n());
                let of_direction =
                    |j| own.iter().map(move |(first, count)| (j * n + first, *count));
                let places: Vec<RowRange> =
                    (0..self.directions.len()).flat_map(of_direction).collect();
                self.non_zeros(result, rows, &places)
            }
        }
    }

    /// ∂expressions/∂(symbols numbered by `wanted`): the non-zeros by columns.
    fn sparse(
        &mut self,
        kind: ResultKind,
        expressions: &[ExprId],
        wanted: impl Fn(Symbol) -> Option<usize>,
    ) -> Vec<ExprId> {
        let rows = expressions.iter().map(|e| self.gradient(*e, &wanted)).collect();
        let places = self.places_of(kind, expressions.len());
        self.non_zeros(kind, rows, &places)
    }

    /// ∂expressions/∂θ at fixed unknowns: the non-zeros by columns.
    fn by_directions(&mut self, kind: ResultKind, expressions: &[ExprId]) -> Vec<ExprId> {
        let rows = expressions.iter().map(|e| self.by_direction(*e)).collect();
        let places = self.places_of(kind, expressions.len());
        self.non_zeros(kind, rows, &places)
    }

    /// Like [`Self::sparse`], with all delayed values and inputs fixed.
    fn partials(
        &mut self,
        kind: ResultKind,
        expressions: &[ExprId],
        wanted: impl Fn(Symbol) -> Option<usize>,
    ) -> Vec<ExprId> {
        let rows = expressions.iter().map(|e| self.graph.gradient(*e, &wanted)).collect();
        let places = self.places_of(kind, expressions.len());
        self.non_zeros(kind, rows, &places)
    }

    /// The rows of a matrix of `n` expressions.
    fn places_of(&self, kind: ResultKind, n: usize) -> Vec<RowRange> {
        match kind {
            ResultKind::Jacobian | ResultKind::ParameterJacobian | ResultKind::InputJacobian => {
                self.rows_of_f()
            }
            ResultKind::Dwdy | ResultKind::Dwdu | ResultKind::Dwdp => self.rows_of_w(),
            _ => (0..n).map(|row| (row, None)).collect(),
        }
    }

    /// ∂expressions/∂t with all delayed values fixed.
    fn by_time(&mut self, expressions: &[ExprId]) -> Vec<ExprId> {
        let zero = self.graph.constant(0.0);
        let slope =
            |e: &ExprId| self.graph.gradient(*e, time).first().map_or(zero, |(_, slope)| *slope);
        expressions.iter().map(slope).collect()
    }

    /// Positions in u.
    fn any_input(&self) -> impl Fn(Symbol) -> Option<usize> + use<> {
        let past = self.past;
        move |symbol| match symbol {
            Symbol::Past(DelayedValue::Present, _) => None,
            Symbol::Past(kind, k) => Some(begin(past, kind) + k as usize),
            _ => input(symbol),
        }
    }

    /// The non-zeros of a matrix given by rows of (column, value): those of single rows by columns, then those of
    /// families; records its pattern.
    fn non_zeros(
        &mut self,
        kind: ResultKind,
        rows: Vec<Vec<(usize, ExprId)>>,
        places: &[RowRange],
    ) -> Vec<ExprId> {
        let mut matrix: Vec<(usize, usize, ExprId)> = Vec::new();
        let (mut runs, mut of_runs) = (Vec::new(), Vec::new());
        for (gradient, (row, count)) in rows.into_iter().zip(places) {
            for (column, value) in gradient {
                let Some(count) = *count else {
                    matrix.push((*row, column, value));
                    continue;
                };
                let (column, diagonal) = (column & !MOVING, column & MOVING != 0);
                runs.push(PatternRun { row: *row, column, diagonal, count: count as usize });
                of_runs.push(value);
            }
        }
        matrix.sort_unstable_by_key(|(row, column, _)| (*column, *row));
        let places: Vec<(usize, usize)> =
            matrix.iter().map(|(row, column, _)| (*row, *column)).collect();
        self.patterns.insert(kind, Pattern { runs: runs.into(), ..Pattern::from_places(&places) });
        matrix.into_iter().map(|(_, _, value)| value).chain(of_runs).collect()
    }

    /// Derivatives D of g, for each row j n + i: D gᵢⱼ = Σₖ D(∂fᵢ/∂yₖ) Sₖⱼ + D(∂fᵢ/∂θⱼ).
    ///
    /// Second derivatives of f are taken once for all directions.
    fn derivatives_of_g(
        &mut self,
        derive: impl Fn(&mut Self, ExprId) -> Vec<(usize, ExprId)>,
    ) -> Vec<Vec<(usize, ExprId)>> {
        let directions = self.directions;
        let rhs = self.f();
        let n = rhs.len();
        let mut rows = vec![Vec::new(); n * directions.len()];
        if directions.is_empty() {
            return rows;
        }
        for (i, f) in rhs.into_iter().enumerate() {
            let mut by_unknown = Vec::new();
            for (k, slope) in self.gradient(f, &unknown) {
                by_unknown.push((k, derive(self, slope)));
            }
            let mut by_direction = BTreeMap::new();
            for (j, slope) in self.by_direction(f) {
                by_direction.insert(j, derive(self, slope));
            }
            for j in 0..directions.len() {
                let mut sums: BTreeMap<usize, ExprId> = BTreeMap::new();
                for (k, parts) in &by_unknown {
                    for (position, part) in parts {
                        let s = self.sensitivity(*k, j);
                        let term = self.graph.multiply(*part, s);
                        self.accumulate(&mut sums, *position, term);
                    }
                }
                for (position, part) in by_direction.get(&j).into_iter().flatten() {
                    self.accumulate(&mut sums, *position, *part);
                }
                sums.retain(|_, sum| self.graph.value(*sum) != Some(0.0));
                rows[j * n + i] = sums.into_iter().collect();
            }
        }
        rows
    }

    /// ∂expressions/∂(symbols numbered by `wanted`): dense by columns.
    fn dense(
        &mut self,
        expressions: &[ExprId],
        columns: usize,
        wanted: impl Fn(Symbol) -> Option<usize>,
    ) -> Vec<ExprId> {
        let zero = self.graph.constant(0.0);
        let mut matrix = vec![zero; expressions.len() * columns];
        for (row, expression) in expressions.iter().enumerate() {
            for (column, value) in self.gradient(*expression, &wanted) {
                matrix[column * expressions.len() + row] = value;
            }
        }
        matrix
    }

    /// ∂e/∂y S + ∂e/∂θ for each expression e: dense by columns.
    fn sensitivities_of(&mut self, expressions: &[ExprId]) -> Vec<ExprId> {
        let directions = self.directions;
        let mut matrix = self.along_directions(expressions);
        if directions.is_empty() {
            return matrix;
        }
        for (row, expression) in expressions.iter().enumerate() {
            let gradient = self.gradient(*expression, &unknown);
            for j in 0..directions.len() {
                let mut sum = self.graph.constant(0.0);
                for (k, slope) in &gradient {
                    let s = self.sensitivity(*k, j);
                    let term = self.graph.multiply(*slope, s);
                    sum = self.graph.add(sum, term);
                }
                let entry = &mut matrix[j * expressions.len() + row];
                *entry = self.graph.add(sum, *entry);
            }
        }
        matrix
    }

    /// ∂e/∂θ at fixed unknowns for each expression e: dense by columns.
    fn along_directions(&mut self, expressions: &[ExprId]) -> Vec<ExprId> {
        let zero = self.graph.constant(0.0);
        let mut matrix = vec![zero; expressions.len() * self.directions.len()];
        for (row, expression) in expressions.iter().enumerate() {
            for (j, slope) in self.by_direction(*expression) {
                matrix[j * expressions.len() + row] = slope;
            }
        }
        matrix
    }

    /// The nonzero ∂e/∂θ at fixed unknowns, directions ascending.
    ///
    /// A delayed input v(t) = u(t − τ) depends on θ through its delay: ∂v/∂θ = −v̇ ∂τ/∂θ.
    fn by_direction(&mut self, expression: ExprId) -> Vec<(usize, ExprId)> {
        let directions = self.directions;
        let direct = self.own_directions(expression);
        let nothing_is_late =
            self.dae.delayed_inputs.is_empty() && self.dae.delayed_unknowns.is_empty();
        if nothing_is_late || directions.is_empty() {
            return direct;
        }
        let mut sums: BTreeMap<usize, ExprId> = direct.into_iter().collect();
        self.add_past_sensitivities(expression, &mut sums);
        let declared = self.dae.inputs.len();
        let n_delayed = self.dae.delayed_inputs.len();
        // Slopes are constant wherever inputs are smooth.
        let delayed =
            |symbol| input(symbol)?.checked_sub(declared).filter(|delayed| *delayed < n_delayed);
        for (position, slope) in self.gradient(expression, &delayed) {
            let tau = self.dae.delays[self.dae.delayed_inputs[position].delay].tau;
            let rate = self.rate_symbol(position);
            for (j, by_tau) in self.gradient(tau, &direction(directions)) {
                let moved = self.graph.multiply(rate, by_tau);
                let part = self.graph.multiply(slope, moved);
                let part = self.graph.negate(part);
                self.accumulate(&mut sums, j, part);
            }
        }
        sums.into_iter().collect()
    }

    /// ∂e/∂θ without delays, directions ascending. In a family, a parameter that moves with the row is θ in one of the
    /// rows.
    fn own_directions(&mut self, expression: ExprId) -> Vec<(usize, ExprId)> {
        let directions = self.directions;
        let swept: Vec<(u32, u32)> = (self.graph.symbols(expression).into_iter())
            .filter_map(|symbol| match symbol {
                Symbol::SweptParameter(first, count) => Some((first, count)),
                _ => None,
            })
            .collect();
        let single = direction(directions);
        let n = directions.len();
        let slopes = self.gradient(expression, &|symbol| match symbol {
            Symbol::SweptParameter(first, count) => {
                swept.iter().position(|other| *other == (first, count)).map(|at| n + at)
            }
            other => single(other),
        });
        if swept.is_empty() {
            return slopes;
        }
        let mut sums = BTreeMap::new();
        for (position, slope) in slopes {
            let Some(at) = position.checked_sub(n) else {
                self.accumulate(&mut sums, position, slope);
                continue;
            };
            let (first, count) = swept[at];
            for (j, direction) in directions.iter().enumerate() {
                let Direction::Parameter(p) = *direction else { continue };
                let row = u32::try_from(p).ok().and_then(|p| p.checked_sub(first));
                if let Some(row) = row.filter(|row| *row < count) {
                    let there = self.in_row(row, slope);
                    self.accumulate(&mut sums, j, there);
                }
            }
        }
        sums.into_iter().collect()
    }

    /// de/dt at fixed unknowns: ∂e/∂t + ∂e/∂u u̇.
    fn along_time(&mut self, expression: ExprId) -> ExprId {
        let with_slopes = self.dae.inputs.len() + self.dae.delayed_inputs.len();
        // Time first, then inputs; delayed values may depend on time without showing it.
        let moving = |symbol| match symbol {
            Symbol::Time => Some(0),
            Symbol::Input(i) if (i as usize) < with_slopes => Some(2 * i as usize + 1),
            Symbol::SweptInput(i, _) => Some(2 * i as usize + 2),
            _ => None,
        };
        let rows_of = |graph: &ExprGraph, first: u32| {
            let count = |symbol: &Symbol| match *symbol {
                Symbol::SweptInput(i, count) if i == first => Some(count),
                _ => None,
            };
            graph.symbols(expression).iter().find_map(count).unwrap_or(0)
        };
        let mut sum = self.graph.constant(0.0);
        for (position, slope) in self.gradient(expression, &moving) {
            let input = position.checked_sub(1).and_then(|k| u32::try_from(k / 2).ok());
            let udot = input.map(|input| match position % 2 {
                1 => Symbol::InputSlope(input),
                _ => Symbol::SweptInputSlope(input, rows_of(&self.graph, input)),
            });
            let term = match udot {
                None => slope,
                Some(udot) => {
                    let udot = self.graph.symbol(udot);
                    self.graph.multiply(slope, udot)
                }
            };
            sum = self.graph.add(sum, term);
        }
        sum
    }
}
