//! Recorded inputs, and the points where they are not smooth.
//!
//! Samples that share their times become segments on which every input is a straight line, u(t) = u(t₀) + u̇ (t − t₀).
//! Adjacent intervals on the same line share a segment, so that constant inputs cost nothing and a solver restarts only
//! where it must.

mod delayed;

use std::fmt;

use crate::system::Interpolation;

pub use delayed::Delayed;

/// Inputs as functions of time.
#[derive(Debug, Clone, PartialEq)]
pub struct Inputs {
    n_u: usize,
    /// Start of each segment, ascending; the last has no end.
    starts: Vec<f64>,
    /// u and u̇ at the start of each segment, n_u numbers each.
    values: Vec<f64>,
    slopes: Vec<f64>,
    first: Option<Edge>,
    last_linear: Option<Edge>,
}

/// Where samples begin or end.
#[derive(Debug, Clone, PartialEq)]
struct Edge {
    t: f64,
    input: String,
}

/// Samples of one input.
#[derive(Debug, Clone, Copy)]
pub struct InputColumn<'a> {
    /// The input's name.
    pub name: &'a str,
    /// How values between samples follow.
    pub interpolation: Interpolation,
    /// One number per sample time, SI.
    pub values: &'a [f64],
}

/// A time interval on which inputs are straight lines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment<'a> {
    /// Its start, s; minus infinity for inputs that are constant at all times.
    pub t0: f64,
    /// Start of the next, s; infinity for the last.
    pub t1: f64,
    /// Inputs just after `t0`.
    pub u: &'a [f64],
    /// Their slopes.
    pub udot: &'a [f64],
}

/// Which limit to take where inputs jump.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LimitSide {
    /// Just before.
    Left,
    /// Just after.
    Right,
}

/// Samples that do not define a function of time, or do not cover the requested times.
#[derive(Debug, Clone, PartialEq)]
pub enum InputError {
    /// Inputs without a sample.
    NoSamples,
    /// The number of values of a column differs from the number of sample times.
    Length {
        /// The input.
        input: String,
        /// Number of its values.
        values: usize,
        /// Number of sample times.
        times: usize,
    },
    /// A sample is not a finite number.
    NotFinite {
        /// The input.
        input: String,
        /// Time of the sample, s.
        at: f64,
    },
    /// A sample time is not a finite number.
    TimeNotFinite {
        /// Position of the sample, from 0.
        sample: usize,
    },
    /// A sample time is before its predecessor.
    TimeBackwards {
        /// The sample time, s.
        at: f64,
        /// Its predecessor, s.
        previous: f64,
    },
    /// More than two samples at one time that differ.
    TimeRepeated {
        /// The time, s.
        at: f64,
        /// An input in which they differ.
        input: String,
    },
    /// A time before the first sample was asked for.
    InputStarts {
        /// The input.
        input: String,
        /// Time asked for, s.
        at: f64,
        /// Time of the first sample, s.
        first: f64,
    },
    /// A linear input was asked for beyond its last sample.
    InputEnds {
        /// The input.
        input: String,
        /// Time asked for, s.
        at: f64,
        /// Time of the last sample, s.
        last: f64,
    },
    /// The delay of an input is negative or not finite.
    Delay {
        /// The input.
        input: String,
        /// Its delay, as the model writes it.
        delay: String,
        /// Value of the delay, s.
        value: f64,
    },
    /// An input jumps through which an equation was differentiated.
    Jump {
        /// The input.
        input: String,
        /// Time, s.
        at: f64,
        /// The equation.
        equation: String,
    },
}

/// Distance up to which a sample counts as on the line through its predecessors, relative to its size: the rounding of
/// a slope, a product and a sum.
const ON_LINE: f64 = 8.0 * f64::EPSILON;
/// Jumps of an input up to this, relative to its size, are rounding of lines through samples.
const ROUNDING: f64 = 1e-12;

impl Inputs {
    /// Inputs of a model that has none.
    pub fn none() -> Self {
        Self::constant(&[])
    }

    /// Inputs that are the same at all times, in SI units.
    pub fn constant(values: &[f64]) -> Self {
        Self {
            n_u: values.len(),
            starts: vec![f64::NEG_INFINITY],
            values: values.to_vec(),
            slopes: vec![0.0; values.len()],
            first: None,
            last_linear: None,
        }
    }

    /// Inputs from samples at `times`, s.
    ///
    /// Exactly two samples at one time are the values left and right of a jump; more than two must agree. The last
    /// value of a held input applies from then on. A single sample means a constant.
    ///
    /// # Errors
    ///
    /// [`InputError`], all variants but `InputStarts` and `InputEnds`.
    pub fn recorded(times: &[f64], columns: &[InputColumn<'_>]) -> Result<Self, InputError> {
        verify_samples(times, columns)?;
        let Some(name) = columns.first().map(|column| column.name) else {
            return Ok(Self::none());
        };
        if times.len() == 1 {
            let values: Vec<f64> = columns.iter().map(|column| column.values[0]).collect();
            return Ok(Self::constant(&values));
        }

        let mut inputs = Self {
            n_u: columns.len(),
            starts: Vec::new(),
            values: Vec::new(),
            slopes: Vec::new(),
            first: Some(Edge { t: times[0], input: name.to_owned() }),
            last_linear: columns
                .iter()
                .find(|column| column.interpolation == Interpolation::Linear)
                .zip(times.last())
                .map(|(column, &t)| Edge { t, input: column.name.to_owned() }),
        };
        // The interval that starts at a sample ends at the next one; of two samples at one time, the first only ends an
        // interval and the second only starts one.
        for start in 0..times.len() {
            let end = start + 1;
            if end < times.len() && times[end] == times[start] {
                continue;
            }
            if !inputs.goes_on(times, columns, start, end) {
                inputs.starts.push(times[start]);
                for column in columns {
                    inputs.values.push(column.values[start]);
                    inputs.slopes.push(slope(times, column, start, end));
                }
            }
        }
        Ok(inputs)
    }

    /// Number of inputs.
    pub fn len(&self) -> usize {
        self.n_u
    }

    /// Whether there are no inputs.
    pub fn is_empty(&self) -> bool {
        self.n_u == 0
    }

    /// Number of segments.
    pub fn segments(&self) -> usize {
        self.starts.len()
    }

    /// The segment at a position.
    ///
    /// # Panics
    ///
    /// If there is no such segment.
    #[inline]
    pub fn segment(&self, index: usize) -> Segment<'_> {
        let range = index * self.n_u..(index + 1) * self.n_u;
        Segment {
            t0: self.starts[index],
            t1: self.starts.get(index + 1).copied().unwrap_or(f64::INFINITY),
            u: &self.values[range.clone()],
            udot: &self.slopes[range],
        }
    }

    /// Position of the segment that applies just before or just after `t`; the first one for times before it.
    pub fn segment_at(&self, t: f64, side: LimitSide) -> usize {
        let started = match side {
            LimitSide::Left => self.starts.partition_point(|&start| start < t),
            LimitSide::Right => self.starts.partition_point(|&start| start <= t),
        };
        started.saturating_sub(1)
    }

    /// Writes u just before or just after `t`.
    pub fn value(&self, t: f64, side: LimitSide, u: &mut [f64]) {
        self.segment(self.segment_at(t, side)).value(t, u);
    }

    /// Times in (from, until) at which some input jumps or kinks.
    pub fn breakpoints(&self, from: f64, until: f64) -> &[f64] {
        let begin = self.starts.partition_point(|&start| start <= from);
        let end = self.starts.partition_point(|&start| start < until);
        &self.starts[begin..end.max(begin)]
    }

    /// The mean of each input over a time interval; its value if the interval has no length.
    pub fn mean(&self, from: f64, until: f64) -> Vec<f64> {
        let mut mean = vec![0.0; self.n_u];
        if until <= from {
            self.value(from, LimitSide::Right, &mut mean);
            return mean;
        }
        let mut middle = vec![0.0; self.n_u];
        let ends = self.breakpoints(from, until).iter().copied().chain([until]);
        let mut begin = from;
        for end in ends {
            // The mean of a straight line is its value at the midpoint.
            let part = (end - begin) / (until - from);
            let segment = self.segment(self.segment_at(begin, LimitSide::Right));
            segment.value(begin + 0.5 * (end - begin), &mut middle);
            for (mean, middle) in mean.iter_mut().zip(&middle) {
                *mean += part * middle;
            }
            begin = end;
        }
        mean
    }

    /// Checks that the inputs are known from `from` to `until`.
    ///
    /// # Errors
    ///
    /// [`InputError::InputStarts`], [`InputError::InputEnds`].
    pub fn cover(&self, from: f64, until: f64) -> Result<(), InputError> {
        if let Some(Edge { t: first, input }) = &self.first
            && from < *first
        {
            return Err(InputError::InputStarts { input: input.clone(), at: from, first: *first });
        }
        if let Some(Edge { t: last, input }) = &self.last_linear
            && until > *last
        {
            return Err(InputError::InputEnds { input: input.clone(), at: until, last: *last });
        }
        Ok(())
    }

    /// Whether an input changes between samples.
    pub(crate) fn has_slopes(&self, input: usize) -> bool {
        // If all inputs are held there are no slopes.
        self.last_linear.is_some()
            && (0..self.segments()).any(|k| self.segment(k).udot[input] != 0.0)
    }

    /// The first time in (from, until] at which an input jumps, if it does.
    pub(crate) fn first_jump(&self, input: usize, from: f64, until: f64) -> Option<f64> {
        let begin = self.starts.partition_point(|&start| start <= from).max(1);
        let end = self.starts.partition_point(|&start| start <= until);
        let jumps = |k: &usize| {
            let (before, after) = (self.segment(k - 1), self.segment(*k));
            let left = before.u[input] + before.udot[input] * (after.t0 - before.t0);
            let right = after.u[input];
            (right - left).abs() > ROUNDING * (left.abs() + right.abs() + before.u[input].abs())
        };
        (begin..end.max(begin)).find(jumps).map(|k| self.starts[k])
    }

    /// The last time at which all inputs are known; infinity where all of them are held.
    pub fn last_known(&self) -> f64 {
        self.last_linear.as_ref().map_or(f64::INFINITY, |edge| edge.t)
    }

    /// Whether the last segment also describes the interval between two samples.
    fn goes_on(
        &self,
        times: &[f64],
        columns: &[InputColumn<'_>],
        start: usize,
        end: usize,
    ) -> bool {
        let Some(last) = self.starts.len().checked_sub(1) else {
            return false;
        };
        let segment = self.segment(last);
        columns.iter().enumerate().all(|(j, column)| {
            let on_line = |sample: usize| {
                let (t, value) = (times[sample], column.values[sample]);
                let line = segment.u[j] + segment.udot[j] * (t - segment.t0);
                (value - line).abs() <= ON_LINE * value.abs().max(segment.u[j].abs())
            };
            match column.interpolation {
                Interpolation::Hold => column.values[start] == segment.u[j],
                Interpolation::Linear => {
                    on_line(start) && if end < times.len() { on_line(end) } else { false }
                }
            }
        })
    }
}

impl Segment<'_> {
    /// Writes u(t) = u(t₀) + u̇ (t − t₀).
    #[inline]
    pub fn value(&self, t: f64, u: &mut [f64]) {
        for ((u, u0), udot) in u.iter_mut().zip(self.u).zip(self.udot) {
            // A constant is defined at all times, and t₀ may be minus infinity.
            *u = if *udot == 0.0 { *u0 } else { u0 + udot * (t - self.t0) };
        }
    }

    /// Whether no input changes.
    #[inline]
    pub fn is_constant(&self) -> bool {
        self.udot.iter().all(|&udot| udot == 0.0)
    }
}

fn slope(times: &[f64], column: &InputColumn<'_>, start: usize, end: usize) -> f64 {
    match column.interpolation {
        Interpolation::Linear if end < times.len() => {
            (column.values[end] - column.values[start]) / (times[end] - times[start])
        }
        Interpolation::Linear | Interpolation::Hold => 0.0,
    }
}

fn verify_samples(times: &[f64], columns: &[InputColumn<'_>]) -> Result<(), InputError> {
    if times.is_empty() {
        return if columns.is_empty() { Ok(()) } else { Err(InputError::NoSamples) };
    }
    if let Some(sample) = times.iter().position(|t| !t.is_finite()) {
        return Err(InputError::TimeNotFinite { sample });
    }
    if let Some(pair) = times.windows(2).find(|pair| pair[1] < pair[0]) {
        return Err(InputError::TimeBackwards { at: pair[1], previous: pair[0] });
    }
    for column in columns {
        if column.values.len() != times.len() {
            return Err(InputError::Length {
                input: column.name.to_owned(),
                values: column.values.len(),
                times: times.len(),
            });
        }
        if let Some((&at, _)) = times.iter().zip(column.values).find(|(_, v)| !v.is_finite()) {
            return Err(InputError::NotFinite { input: column.name.to_owned(), at });
        }
        let differs = |three: &(&[f64], &[f64])| {
            let (t, u) = three;
            t[0] == t[2] && (u[0] != u[1] || u[1] != u[2])
        };
        if let Some((three, _)) = times.windows(3).zip(column.values.windows(3)).find(differs) {
            let input = column.name.to_owned();
            return Err(InputError::TimeRepeated { at: three[0], input });
        }
    }
    Ok(())
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoSamples => write!(f, "the inputs have no samples"),
            Self::Length { input, values, times } => {
                write!(f, "input `{input}` has {values} values for {times} sample times")
            }
            Self::NotFinite { input, at } => {
                write!(f, "input `{input}` is not a finite number at t = {at} s")
            }
            Self::TimeNotFinite { sample } => {
                write!(f, "the time of sample {sample} is not a finite number")
            }
            Self::TimeBackwards { at, previous } => {
                write!(f, "input samples go back in time, from t = {previous} s to t = {at} s")
            }
            Self::TimeRepeated { at, input } => write!(
                f,
                "more than two samples at t = {at} s differ in input `{input}`; two are the values left \
                 and right of a jump"
            ),
            Self::InputStarts { input, at, first } => write!(
                f,
                "input `{input}` is asked for at t = {at} s, before its first sample at \
                 t = {first} s"
            ),
            Self::InputEnds { input, at, last } => write!(
                f,
                "linear input `{input}` is asked for at t = {at} s, beyond its last sample at \
                 t = {last} s"
            ),
            Self::Delay { input, delay, value } => write!(
                f,
                "`delay({input}, {delay})` would be {value} s late; the delay of an input is a \
                 finite time and not below zero"
            ),
            Self::Jump { input, at, equation } => write!(
                f,
                "input `{input}` jumps at t = {at} s, but `{equation}` ties states to it, which \
                 cannot follow at once"
            ),
        }
    }
}

impl std::error::Error for InputError {}

#[cfg(test)]
mod tests {
    use super::*;

    fn held(values: &[f64]) -> InputColumn<'_> {
        InputColumn { name: "u", interpolation: Interpolation::Hold, values }
    }

    fn linear(values: &[f64]) -> InputColumn<'_> {
        InputColumn { name: "v", interpolation: Interpolation::Linear, values }
    }

    fn evaluate(inputs: &Inputs, t: f64, side: LimitSide) -> Vec<f64> {
        let mut u = vec![0.0; inputs.len()];
        inputs.value(t, side, &mut u);
        u
    }

    #[test]
    fn nothing_changes_nothing_is_split() {
        let times: Vec<f64> = (0..1000).map(f64::from).collect();
        let ramp: Vec<f64> = times.iter().map(|t| 0.1 + 0.3 * t).collect();
        let inputs = Inputs::recorded(&times, &[held(&[2.0; 1000]), linear(&[5.0; 1000])]);
        // The linear input ends at the last sample, the held one continues.
        assert_eq!(inputs.unwrap().segments(), 2);
        let inputs = Inputs::recorded(&times, &[linear(&ramp)]).unwrap();
        assert!(inputs.segments() < 20, "{}", inputs.segments());
        for (t, v) in times.iter().zip(&ramp) {
            let u = evaluate(&inputs, *t, LimitSide::Right)[0];
            assert!((u - v).abs() <= 2.0 * ON_LINE * v, "{u} {v}");
        }
    }

    #[test]
    fn two_rows_are_a_jump() {
        let inputs =
            Inputs::recorded(&[0.0, 1.0, 1.0, 2.0], &[linear(&[0.0, 1.0, 5.0, 6.0])]).unwrap();
        assert_eq!(evaluate(&inputs, 1.0, LimitSide::Left), [1.0]);
        assert_eq!(evaluate(&inputs, 1.0, LimitSide::Right), [5.0]);
        assert_eq!(evaluate(&inputs, 1.5, LimitSide::Right), [5.5]);
        assert_eq!(inputs.breakpoints(0.0, 2.0), [1.0]);
    }

    #[test]
    fn held_values_go_on_and_linear_ones_end() {
        let inputs = Inputs::recorded(&[0.0, 1.0], &[held(&[1.0, 2.0])]).unwrap();
        assert_eq!(evaluate(&inputs, 9.0, LimitSide::Left), [2.0]);
        assert_eq!(evaluate(&inputs, 1.0, LimitSide::Left), [1.0]);
        assert_eq!(inputs.cover(0.0, 9.0), Ok(()));
        let inputs = Inputs::recorded(&[0.0, 1.0], &[linear(&[1.0, 2.0])]).unwrap();
        assert!(matches!(inputs.cover(0.0, 1.1), Err(InputError::InputEnds { .. })));
        assert!(matches!(inputs.cover(-0.1, 1.0), Err(InputError::InputStarts { .. })));
    }

    #[test]
    fn wrong_samples_are_refused() {
        let refused = |times: &[f64], values: &[f64]| {
            Inputs::recorded(times, &[held(values)]).unwrap_err().to_string()
        };
        let third = refused(&[0.0, 1.0, 1.0, 1.0], &[0.0, 1.0, 1.0, 2.0]);
        assert!(third.contains("more than two"), "{third}");
        let agreeing = Inputs::recorded(&[0.0, 1.0, 1.0, 1.0], &[held(&[0.0, 1.0, 1.0, 1.0])]);
        assert_eq!(evaluate(&agreeing.expect("replicates"), 1.0, LimitSide::Left), [0.0]);
        assert!(refused(&[0.0, 2.0, 1.0], &[0.0; 3]).contains("go back in time"));
        assert!(refused(&[0.0, 1.0], &[0.0, f64::NAN]).contains("`u` is not a finite number"));
        assert!(refused(&[0.0, 1.0], &[0.0]).contains("1 values for 2 sample times"));
        assert!(refused(&[], &[]).contains("no samples"));
    }
}
