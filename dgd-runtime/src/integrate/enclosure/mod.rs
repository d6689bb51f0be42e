//! Guaranteed enclosures of formulas along an interval of time.
//!
//! | file | holds |
//! |---|---|
//! | `interval` | arithmetic of intervals, rounded outwards |
//! | `tube` | a quantity along an interval, with its slope |
//! | `polynomial` | tubes of polynomials |
//! | `functions` | THE table: tubes of the functions of the language |
//! | `curve` | tubes of curves of tables |
//!
//! [`Enclosures`] evaluates [`Formulas`] operation by operation, for interpreted, native and generated models alike.

mod curve;
mod functions;
mod interval;
mod polynomial;
mod tube;

#[cfg(test)]
mod tests;

pub(crate) use interval::Interval;
pub(crate) use polynomial::{PolynomialCoefficients, tube_of};
pub(crate) use tube::Tube;

use dgd_signature::{Curve, Formulas, Operation};
use polynomial::Polynomial;

/// Whether there is an enclosure of a function of the language.
pub fn encloses(function: &str) -> bool {
    functions::of_one(function).is_some() || functions::of_two(function).is_some()
}

/// An operation on tubes. Numbers are positions of earlier ones.
#[derive(Debug, Clone, Copy)]
enum TubeOperation {
    Constant(f64),
    Time,
    Unknown(usize),
    Input(usize),
    Parameter(usize),
    Discrete(usize),
    Negate(usize),
    Add(usize, usize),
    Subtract(usize, usize),
    Multiply(usize, usize),
    Divide(usize, usize),
    Call(functions::OfOne, usize),
    Call2(functions::OfTwo, usize, usize),
    Curve(&'static Curve, usize),
    Above(usize, usize),
    NotBelow(usize, usize),
    And(usize, usize),
    Or(usize, usize),
    Not(usize),
    Select(usize, usize, usize),
    Larger(usize, usize),
    Smaller(usize, usize),
    /// A function without an enclosure.
    Anything,
}

/// The inputs of an operation.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct TubeInputs {
    pub(crate) time: bool,
    pub(crate) inputs: bool,
    pub(crate) unknowns: bool,
}

impl TubeInputs {
    /// Whether it moves in a step.
    fn moves(self) -> bool {
        self.time || self.inputs || self.unknowns
    }
}

/// An interval of a step: its ends as fractions of the step, and its moving quantities.
pub(crate) struct StepInterval<'a, U: Fn(usize) -> Tube> {
    pub(crate) ends: [f64; 2],
    pub(crate) time: Tube,
    pub(crate) input: &'a U,
}

/// Formulas, and their values along an interval.
#[derive(Debug, Clone, Default)]
pub(crate) struct Enclosures {
    steps: Vec<TubeOperation>,
    reads: Vec<TubeInputs>,
    results: Vec<usize>,
    values: Vec<Tube>,
    wanted: Vec<bool>,
    /// Steps that are wanted and move.
    moving: Vec<usize>,
    /// For each step its polynomial in the fraction of the step, if it has one: a sum of multiples of unknowns, whose
    /// terms may cancel.
    polynomials: Vec<Option<usize>>,
    kept: Vec<Polynomial>,
    /// Inputs that formulas read, ascending.
    inputs: Vec<usize>,
}

impl Enclosures {
    pub(crate) fn new(formulas: &Formulas) -> Self {
        let mut all = Self::default();
        for operation in formulas.operations.iter() {
            let mut reads = TubeInputs {
                time: matches!(operation, Operation::Time),
                inputs: matches!(operation, Operation::Input(_)),
                unknowns: matches!(operation, Operation::Unknown(_)),
            };
            for operand in operation.operands() {
                let of = all.reads[operand as usize];
                reads.time |= of.time;
                reads.inputs |= of.inputs;
                reads.unknowns |= of.unknowns;
            }
            let step = all.step(*operation);
            all.steps.push(step);
            all.reads.push(reads);
            let polynomial = all.is_linear(step).then(|| {
                all.kept.push(Polynomial::ZERO);
                all.kept.len() - 1
            });
            all.polynomials.push(polynomial);
        }
        all.inputs.sort_unstable();
        all.inputs.dedup();
        all.results = formulas.results.iter().map(|at| *at as usize).collect();
        all.values = vec![Tube::EMPTY; all.steps.len()];
        all.wanted = vec![false; all.steps.len()];
        all.moving = Vec::with_capacity(all.steps.len());
        all
    }

    fn step(&mut self, operation: Operation) -> TubeOperation {
        let at = |position: u32| position as usize;
        match operation {
            Operation::Constant(value) => TubeOperation::Constant(value),
            Operation::Time => TubeOperation::Time,
            Operation::Unknown(i) => TubeOperation::Unknown(at(i)),
            Operation::Input(i) => {
                self.inputs.push(at(i));
                TubeOperation::Input(at(i))
            }
            Operation::Parameter(i) => TubeOperation::Parameter(at(i)),
            Operation::Discrete(i) => TubeOperation::Discrete(at(i)),
            Operation::Negate(a) => TubeOperation::Negate(at(a)),
            Operation::Add(a, b) => TubeOperation::Add(at(a), at(b)),
            Operation::Subtract(a, b) => TubeOperation::Subtract(at(a), at(b)),
            Operation::Multiply(a, b) => TubeOperation::Multiply(at(a), at(b)),
            Operation::Divide(a, b) => TubeOperation::Divide(at(a), at(b)),
            Operation::Call(name, a) => functions::of_one(name)
                .map_or(TubeOperation::Anything, |f| TubeOperation::Call(f, at(a))),
            Operation::Call2(name, a, b) => functions::of_two(name)
                .map_or(TubeOperation::Anything, |f| TubeOperation::Call2(f, at(a), at(b))),
            Operation::Curve(curve, a) => TubeOperation::Curve(curve, at(a)),
            Operation::Above(a, b) => TubeOperation::Above(at(a), at(b)),
            Operation::NotBelow(a, b) => TubeOperation::NotBelow(at(a), at(b)),
            Operation::And(a, b) => TubeOperation::And(at(a), at(b)),
            Operation::Or(a, b) => TubeOperation::Or(at(a), at(b)),
            Operation::Not(a) => TubeOperation::Not(at(a)),
            Operation::Select(c, a, b) => self.selected(at(c), at(a), at(b)),
        }
    }

    /// Whether a step is an unknown, or a sum of constants and of multiples of these.
    fn is_linear(&self, step: TubeOperation) -> bool {
        let is_still = |at: usize| !self.reads[at].moves();
        let is_linear = |at: usize| self.polynomials[at].is_some();
        match step {
            TubeOperation::Unknown(_) => true,
            TubeOperation::Negate(a) => is_linear(a),
            TubeOperation::Add(a, b) | TubeOperation::Subtract(a, b) => {
                (is_linear(a) && (is_linear(b) || is_still(b))) || (is_still(a) && is_linear(b))
            }
            TubeOperation::Multiply(a, b) => {
                (is_linear(a) && is_still(b)) || (is_still(a) && is_linear(b))
            }
            _ => false,
        }
    }

    /// Computes the polynomial of a linear step from those of its operands.
    fn add_up(&mut self, step: TubeOperation, slot: usize) {
        let mut sum = std::mem::replace(&mut self.kept[slot], Polynomial::ZERO);
        // A number that does not move, exact or to rounding.
        let number = |at: usize| {
            let Interval { lo, hi } = self.values[at].range;
            if lo == hi { lo } else { 0.5 * (lo + hi) }
        };
        let constant = |at: usize| {
            let value = number(at);
            let mut constant = Polynomial::ZERO;
            constant.coefficients[0] = value;
            constant.size = value.abs();
            constant
        };
        let polynomial = |at: usize| self.polynomials[at].map(|slot| &self.kept[slot]);
        let mut combine = |a: usize, f: f64, b: usize| match (polynomial(a), polynomial(b)) {
            (Some(a), Some(b)) => sum.add_multiple(a, f, b),
            (Some(a), None) => sum.add_multiple(a, f, &constant(b)),
            (None, Some(b)) => sum.add_multiple(&constant(a), f, b),
            (None, None) => {}
        };
        match step {
            TubeOperation::Add(a, b) => combine(a, 1.0, b),
            TubeOperation::Subtract(a, b) => combine(a, -1.0, b),
            TubeOperation::Negate(a) => {
                if let Some(a) = polynomial(a) {
                    sum.add_multiple(&Polynomial::ZERO, -1.0, a);
                }
            }
            TubeOperation::Multiply(a, b) => {
                let (of, factor) = if polynomial(a).is_some() { (a, b) } else { (b, a) };
                if let Some(of) = polynomial(of) {
                    sum.add_multiple(&Polynomial::ZERO, number(factor), of);
                }
            }
            _ => {}
        }
        self.kept[slot] = sum;
    }

    /// A choice; if the operands of the comparison are chosen themselves, the larger or the smaller one, which does not
    /// jump.
    fn selected(&self, c: usize, a: usize, b: usize) -> TubeOperation {
        match self.steps[c] {
            TubeOperation::Above(x, y) | TubeOperation::NotBelow(x, y) if (x, y) == (a, b) => {
                TubeOperation::Larger(a, b)
            }
            TubeOperation::Above(x, y) | TubeOperation::NotBelow(x, y) if (x, y) == (b, a) => {
                TubeOperation::Smaller(a, b)
            }
            _ => TubeOperation::Select(c, a, b),
        }
    }

    /// The inputs of the k-th formula.
    pub(crate) fn reads(&self, k: usize) -> TubeInputs {
        self.results.get(k).map_or_else(TubeInputs::default, |at| self.reads[*at])
    }

    /// The inputs that formulas read, ascending.
    pub(crate) fn inputs(&self) -> &[usize] {
        &self.inputs
    }

    /// Prepares the requested formulas for a step: evaluates constants, and takes the polynomials of the unknowns that
    /// are read, each from `polynomial`, which returns the number of coefficients.
    pub(crate) fn begin(
        &mut self,
        wanted: impl Fn(usize) -> bool,
        p: &[f64],
        z: &[f64],
        mut polynomial: impl FnMut(usize, &mut PolynomialCoefficients) -> usize,
    ) {
        self.wanted.fill(false);
        for (k, at) in self.results.iter().enumerate() {
            self.wanted[*at] |= wanted(k);
        }
        for i in (0..self.steps.len()).rev() {
            if self.wanted[i] {
                let (step, wanted) = (self.steps[i], &mut self.wanted);
                step.each_operand(|operand| wanted[operand] = true);
            }
        }
        self.moving.clear();
        for i in 0..self.steps.len() {
            if !self.wanted[i] {
                continue;
            }
            match (self.steps[i], self.polynomials[i]) {
                (TubeOperation::Unknown(unknown), Some(slot)) => {
                    let of = &mut self.kept[slot];
                    of.len = polynomial(unknown, &mut of.coefficients);
                    of.measure();
                }
                (step, Some(slot)) => self.add_up(step, slot),
                _ => {}
            }
            if self.reads[i].moves() {
                self.moving.push(i);
                continue;
            }
            self.values[i] = match self.steps[i] {
                TubeOperation::Parameter(at) => Tube::still(Interval::point(p[at])),
                TubeOperation::Discrete(at) => Tube::still(Interval::point(z[at])),
                step => self.value(step),
            };
        }
    }

    /// Evaluates the formulas along an interval.
    pub(crate) fn evaluate<U: Fn(usize) -> Tube>(&mut self, along: &StepInterval<'_, U>) {
        for at in 0..self.moving.len() {
            let i = self.moving[at];
            self.values[i] = match (self.steps[i], self.polynomials[i]) {
                (_, Some(slot)) => self.kept[slot].tube(along.ends[0], along.ends[1]),
                (TubeOperation::Time, None) => along.time,
                (TubeOperation::Input(input), None) => (along.input)(input),
                (step, None) => self.value(step),
            };
        }
    }

    /// The k-th formula along the interval evaluated last.
    #[inline]
    pub(crate) fn value_of(&self, k: usize) -> Tube {
        self.values[self.results[k]]
    }

    fn value(&self, step: TubeOperation) -> Tube {
        let v = &self.values;
        match step {
            TubeOperation::Constant(value) => Tube::still(Interval::point(value)),
            TubeOperation::Negate(a) => v[a].negated(),
            TubeOperation::Add(a, b) => v[a].plus(v[b]),
            TubeOperation::Subtract(a, b) => v[a].minus(v[b]),
            TubeOperation::Multiply(a, b) => v[a].times(v[b]),
            TubeOperation::Divide(a, b) => v[a].divide(v[b]),
            TubeOperation::Call(f, a) => f(v[a]),
            TubeOperation::Call2(f, a, b) => f(v[a], v[b]),
            TubeOperation::Curve(curve, a) => curve::along(curve, v[a]),
            TubeOperation::Above(a, b) => v[a].minus(v[b]).above_zero(),
            TubeOperation::NotBelow(a, b) => v[a].minus(v[b]).not_below_zero(),
            TubeOperation::And(a, b) => v[a].and(v[b]),
            TubeOperation::Or(a, b) => v[a].not().and(v[b].not()).not(),
            TubeOperation::Not(a) => v[a].not(),
            TubeOperation::Select(c, a, b) => v[c].select(v[a], v[b]),
            TubeOperation::Larger(a, b) => v[a].larger(v[b]),
            TubeOperation::Smaller(a, b) => v[a].smaller(v[b]),
            TubeOperation::Anything
            | TubeOperation::Time
            | TubeOperation::Unknown(_)
            | TubeOperation::Input(_)
            | TubeOperation::Parameter(_)
            | TubeOperation::Discrete(_) => Tube::ANY,
        }
    }
}

impl TubeOperation {
    #[inline]
    fn each_operand(self, mut f: impl FnMut(usize)) {
        match self {
            Self::Negate(a) | Self::Call(_, a) | Self::Curve(_, a) | Self::Not(a) => f(a),
            Self::Add(a, b)
            | Self::Subtract(a, b)
            | Self::Multiply(a, b)
            | Self::Divide(a, b)
            | Self::Call2(_, a, b)
            | Self::Above(a, b)
            | Self::NotBelow(a, b)
            | Self::And(a, b)
            | Self::Or(a, b)
            | Self::Larger(a, b)
            | Self::Smaller(a, b) => {
                f(a);
                f(b);
            }
            Self::Select(c, a, b) => {
                f(c);
                f(a);
                f(b);
            }
            Self::Constant(_)
            | Self::Time
            | Self::Unknown(_)
            | Self::Input(_)
            | Self::Parameter(_)
            | Self::Discrete(_)
            | Self::Anything => {}
        }
    }
}
