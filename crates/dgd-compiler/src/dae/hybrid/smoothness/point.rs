//! Random points, scaled by the sizes of symbols, and moving them to where a condition changes.

use crate::dae::{AutomatonKind, Dae, DaeDelayedUnknown, position};
use crate::expr::{Symbol, Tape};
use crate::model::Model;

/// Distance from the thresholds of other conditions at which points are drawn, relative to the size.
const BESIDE: f64 = 0.3;
/// Newton steps to a surface.
const MOST_NEWTON: usize = 50;
/// Nearest and farthest changes of sign searched for, relative to the size of the symbol.
const NEAREST: f64 = 1e-3;
const MOST_DOUBLINGS: i32 = 40;
/// Counts are drawn from this range on both sides of zero.
const COUNTED: f64 = 3.0;
/// Seed of the random numbers.
const SEED: u64 = 0x9E37_79B9_7F4A_7C15;

/// The threshold e = 0 of a condition: for each symbol v, e and ∂e/∂v.
pub(super) struct SwitchThreshold {
    pub(super) slopes: Vec<(Symbol, Tape<2>)>,
}

/// Sizes of symbols.
pub(in super::super) struct SymbolSizes {
    parameters: Vec<f64>,
    unknowns: Vec<f64>,
    /// Those of declared inputs, then those of delayed ones.
    inputs: Vec<f64>,
    /// Those of delayed unknowns.
    delayed_values: Vec<f64>,
    /// For each array, its first element and their size.
    arrays: Vec<(u32, f64)>,
    /// For each discrete number, its number of values; none for counts.
    modes: Vec<Option<usize>>,
}

impl SymbolSizes {
    pub(in super::super) fn estimate(dae: &Dae, model: &Model) -> SymbolSizes {
        let parameters: Vec<f64> = dae.parameters.iter().map(|parameter| parameter.value).collect();
        let at_start = |symbol| match symbol {
            Symbol::Parameter(i) | Symbol::SweptParameter(i, _) => parameters[i as usize],
            Symbol::Constant(i) => model.constants[i as usize].value,
            Symbol::Time | Symbol::Counter => 0.0,
            _ => f64::NAN,
        };
        let size = |nominal: Option<f64>, start: f64, factor: f64| match nominal {
            Some(nominal) => nominal,
            None if start.is_normal() => start.abs(),
            None => factor,
        };
        let unknowns: Vec<f64> = dae
            .unknowns
            .iter()
            .map(|x| size(x.nominal, dae.graph.evaluate(x.start, &at_start), x.unit.factor))
            .collect();
        let arrays = model.arrays.iter().map(|array| {
            let x = &array.unknown;
            let start = model.graph.evaluate(x.start, &at_start);
            (array.first, size(x.nominal, start, x.declared.unit.factor))
        });
        // A temperature in °C has a size of about 273 K.
        let input = |i: usize| {
            let unit = &model.inputs[i].declared.unit;
            unit.factor.abs().max(unit.offset.abs())
        };
        let arrays: Vec<(u32, f64)> = arrays.collect();
        let of_delayed = |delayed: &DaeDelayedUnknown| match delayed.unknown {
            Symbol::Element(i) => of_element(&arrays, i),
            unknown => unknowns[position(unknown)],
        };
        let delayed_inputs = dae.delayed_inputs.iter().map(|delayed| delayed.input);
        SymbolSizes {
            inputs: (0..model.inputs.len()).chain(delayed_inputs).map(input).collect(),
            delayed_values: dae.delayed_unknowns.iter().map(of_delayed).collect(),
            arrays,
            modes: values_of_discrete(dae),
            parameters,
            unknowns,
        }
    }

    /// Whether a discrete number has so few values that random points take all of them.
    pub(super) fn is_drawn(&self, symbol: Symbol) -> bool {
        let Symbol::Discrete(i) = symbol else { return false };
        self.modes.get(i as usize).is_some_and(Option::is_some)
    }

    /// The size of an element of an array.
    fn of_element(&self, i: u32) -> f64 {
        of_element(&self.arrays, i)
    }
}

/// The number of values of each discrete number: those of automata, then those of conditions on time, which are 0 or
/// 1. Steps and the periods of a clock are counts.
fn values_of_discrete(dae: &Dae) -> Vec<Option<usize>> {
    let of_automata = dae.automata.iter().map(|automaton| match automaton.kind {
        AutomatonKind::Step => None,
        _ => Some(automaton.modes.len()),
    });
    let is_clock =
        |k: usize| dae.clocks.iter().any(|clock| k == clock.condition || k == clock.condition + 1);
    let of_time = (0..dae.time_conditions.len()).map(|k| (!is_clock(k)).then_some(2));
    of_automata.chain(of_time).collect()
}

/// The size of an element, by the first elements of arrays and their sizes.
fn of_element(arrays: &[(u32, f64)], i: u32) -> f64 {
    let after = arrays.partition_point(|(first, _)| *first <= i);
    after.checked_sub(1).map_or(1.0, |array| arrays[array].1)
}

/// A point: values of symbols, and their sizes.
pub(super) struct SamplePoint {
    /// Its symbols, ascending.
    keys: Vec<u128>,
    values: Vec<f64>,
    sizes: Vec<f64>,
}

impl SamplePoint {
    /// Values of up to two sizes, or up to `spread` decades more or less. Symbols ascend.
    pub(super) fn random(
        of: &SymbolSizes,
        symbols: &[Symbol],
        spread: f64,
        random: &mut SplitMix64,
    ) -> Self {
        let (mut values, mut sizes) = (Vec::new(), Vec::new());
        for symbol in symbols {
            let mut around_zero = |size: f64| {
                let decades = if spread == 0.0 { 0.0 } else { spread * random.next() };
                (size, size * 2.0 * random.next() * 10.0_f64.powf(decades))
            };
            let (size, value) = match *symbol {
                Symbol::Parameter(i) | Symbol::SweptParameter(i, _) => {
                    let value = of.parameters[i as usize];
                    let size = if value == 0.0 { 1.0 } else { value };
                    (size, size * (1.0 + 0.5 * random.next()))
                }
                Symbol::Unknown(i) => around_zero(of.unknowns[i as usize]),
                Symbol::DelayedUnknown(k) => around_zero(of.delayed_values[k as usize]),
                Symbol::Input(i) | Symbol::SweptInput(i, _) => {
                    around_zero(of.inputs.get(i as usize).copied().unwrap_or(1.0))
                }
                Symbol::Element(i) | Symbol::Swept(i) => around_zero(of.of_element(i)),
                Symbol::Discrete(i) => match of.modes.get(i as usize).copied().flatten() {
                    Some(modes) => {
                        let modes = modes as f64;
                        (1.0, (0.5 * (random.next() + 1.0) * modes).floor().min(modes - 1.0))
                    }
                    None => (1.0, (COUNTED * random.next()).round()),
                },
                _ => around_zero(1.0),
            };
            values.push(value);
            sizes.push(size);
        }
        let keys: Vec<u128> = symbols.iter().map(|symbol| symbol.key()).collect();
        debug_assert!(keys.is_sorted(), "keys are in the order of symbols");
        Self { keys, values, sizes }
    }

    fn position(&self, symbol: Symbol) -> usize {
        let index = self.keys.binary_search(&symbol.key());
        index.unwrap_or_else(|_| unreachable!("{symbol:?} has a value"))
    }

    pub(super) fn value(&self, symbol: Symbol) -> f64 {
        self.values[self.position(symbol)]
    }

    pub(super) fn set(&mut self, symbol: Symbol, value: f64) {
        let position = self.position(symbol);
        self.values[position] = value;
    }

    pub(super) fn size(&self, symbol: Symbol) -> f64 {
        let position = self.position(symbol);
        self.sizes[position].abs().max(self.values[position].abs())
    }

    /// Evaluates the roots of a tape; `values` receives those of all its nodes.
    pub(super) fn evaluate<const N: usize>(
        &self,
        tape: &Tape<N>,
        values: &mut Vec<f64>,
    ) -> [f64; N] {
        tape.evaluate(|symbol| self.value(symbol), values)
    }

    /// Evaluates the roots of a tape again after changes of the values at these positions.
    pub(super) fn evaluate_again<const N: usize>(
        &self,
        tape: &Tape<N>,
        positions: &[usize],
        values: &mut [f64],
    ) -> [f64; N] {
        tape.evaluate_again(positions, |symbol| self.value(symbol), values)
    }

    /// Moves v to where e = 0 by Newton's method or, if that fails as with `q^3` and `exp(-q) - 1e-9`, by bisection;
    /// returns the sign of ∂e/∂v there.
    pub(super) fn move_to_surface(&mut self, v: Symbol, surface: &Tape<2>) -> Option<f64> {
        let (from, mut room) = (self.value(v), Vec::new());
        for _ in 0..MOST_NEWTON {
            let [e, slope] = self.evaluate(surface, &mut room);
            let step = e / slope;
            if !step.is_finite() {
                break;
            }
            self.set(v, self.value(v) - step);
            if step.abs() <= 1e-14 * self.size(v) {
                return Some(slope.signum());
            }
        }
        self.set(v, from);
        self.halve_to_surface(v, surface)
    }

    /// Moves a symbol, other than `kept` if possible, close to a threshold.
    pub(super) fn move_near(
        &mut self,
        threshold: &SwitchThreshold,
        kept: Symbol,
        random: &mut SplitMix64,
    ) {
        let other = threshold.slopes.iter().rev().find(|(symbol, _)| *symbol != kept);
        let Some((v, tape)) = other.or(threshold.slopes.first()) else { return };
        let from = self.value(*v);
        if self.move_to_surface(*v, tape).is_some() {
            let beside = BESIDE * random.next() * self.size(*v);
            self.set(*v, self.value(*v) + beside);
        } else {
            self.set(*v, from);
        }
    }

    /// Searches for a change of the sign of e along v at increasing distances, then bisects.
    fn halve_to_surface(&mut self, v: Symbol, surface: &Tape<2>) -> Option<f64> {
        let (from, size) = (self.value(v), self.size(v));
        let mut room = Vec::new();
        let mut sign_at = |point: &mut Self, value: f64| {
            point.set(v, value);
            let [e, _] = point.evaluate(surface, &mut room);
            (e != 0.0 && !e.is_nan()).then_some(e.signum())
        };
        let mut ends = [(from, sign_at(self, from)); 2];
        for k in 0..MOST_DOUBLINGS {
            let distance = size * NEAREST * 2.0_f64.powi(k);
            for (end, side) in ends.iter_mut().zip([-1.0, 1.0]) {
                let next = (from + side * distance, sign_at(self, from + side * distance));
                let before = std::mem::replace(end, next);
                let (Some(a), Some(b)) = (before.1, next.1) else { continue };
                if a != b {
                    let (mut low, mut high) = (before.0, next.0);
                    loop {
                        let middle = f64::midpoint(low, high);
                        if middle == low || middle == high {
                            break;
                        }
                        match sign_at(self, middle) {
                            Some(sign) if sign == a => low = middle,
                            Some(_) => high = middle,
                            None => {
                                (low, high) = (middle, middle);
                            }
                        }
                    }
                    self.set(v, low);
                    return Some(side * b);
                }
            }
        }
        None
    }
}

/// Numbers in (−1, 1), the same in every run: SplitMix64 (Steele, Lea, Flood 2014).
pub(super) struct SplitMix64(u64);

impl Default for SplitMix64 {
    fn default() -> Self {
        Self(SEED)
    }
}

impl SplitMix64 {
    pub(super) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^= z >> 31;
        (z >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}
