//! The range of an axis and the numbers along it.
//!
//! The range is that of the data with some margin; ticks are at multiples of 1, 2 or 5 times a power of ten, and their
//! labels are printed from integers, so that no label shows a rounding error. Common parts of labels are factored out:
//! a power of ten if they are large or small, an offset if the range is narrow and far from zero:
//!
//! ```text
//!   value = label · 10^exponent + offset
//! ```

use crate::text::{MathText, Script};

/// An axis: maps values to positions, and has ticks with labels.
#[derive(Debug)]
pub(crate) struct PlotAxis {
    /// Power of ten near the largest value; the limits are relative to it, so that no range of
    /// numbers overflows.
    unit: f64,
    low: f64,
    high: f64,
    pub(crate) ticks: Vec<AxisTick>,
    /// Common part of all labels, such as ×10⁻⁸; usually empty.
    pub(crate) common: MathText,
}

#[derive(Debug)]
pub(crate) struct AxisTick {
    /// Position along the axis, from 0 to 1.
    pub(crate) fraction: f64,
    pub(crate) label: MathText,
}

/// Ranges below this fraction of the values are rounding errors of a constant: a sum of thousands of terms is accurate
/// to 1e-12.
const CONSTANT: f64 = 1e-12;

/// Ranges below this fraction of the values would need labels of more than five digits: they are shown relative to an
/// offset.
const NARROW: f64 = 1e-4;

/// Fraction of a step that counts as rounding: above `f64::EPSILON / CONSTANT`, the relative error of the narrowest
/// range.
const SLACK: f64 = 1e-3;

/// Numbers below this are shown as zero: their reciprocals overflow.
const SMALLEST: f64 = 1e-300;

impl PlotAxis {
    /// The axis for values from `low` to `high`, with `room` times the range free at both ends and at most `intervals`
    /// intervals between ticks.
    ///
    /// Without values (`low > high`, as a minimum and a maximum over nothing) there are no ticks.
    pub(crate) fn new(low: f64, high: f64, room: f64, intervals: u32) -> PlotAxis {
        if !(low.is_finite() && high.is_finite() && low <= high) {
            let (ticks, common) = (Vec::new(), MathText::default());
            return PlotAxis { unit: 1.0, low: 0.0, high: 1.0, ticks, common };
        }
        let largest = low.abs().max(high.abs());
        let decade = if largest < SMALLEST { 0 } else { decade_of(largest) };
        let unit = power_of_ten(decade);
        let (mut low, mut high) = (low / unit, high / unit);
        let middle = f64::midpoint(low, high);
        if largest < SMALLEST || high - low <= CONSTANT * middle.abs() {
            let half = if largest < SMALLEST { 1.0 } else { 0.1 * middle.abs() };
            (low, high) = (middle - half, middle + half);
        } else {
            let free = room * (high - low);
            (low, high) = (low - free, high + free);
        }
        let mut axis = PlotAxis { unit, low, high, ticks: Vec::new(), common: MathText::default() };
        axis.place_ticks(decade, intervals.max(1));
        axis
    }

    /// Position of a value along the axis, from 0 to 1 inside its limits.
    pub(crate) fn fraction(&self, value: f64) -> f64 {
        (value / self.unit - self.low) / (self.high - self.low)
    }

    fn place_ticks(&mut self, decade: i32, intervals: u32) {
        let (low, high) = (self.low, self.high);
        let mut step = TickStep::at_least((high - low) / f64::from(intervals));
        let (mut first, mut last) = step.within(low, high);
        // Uses a finer step if its ticks still fit, and at least two ticks in any case.
        loop {
            let finer = step.finer();
            let within = finer.within(low, high);
            if last > first && within.1 - within.0 > i64::from(intervals) {
                break;
            }
            (step, (first, last)) = (finer, within);
        }

        // All in units of 10^power, relative to 10^decade: tick i stands at i·digit.
        let TickStep { digit, power } = step;
        let offset = TickOffset::choose(low, high, power);
        let numbers = (first..=last).map(|i| i * digit - offset.in_units_of(power));
        let numbers: Vec<i64> = numbers.collect();
        let largest = numbers.iter().map(|n| n.unsigned_abs()).max().unwrap_or(0);
        let exponent = decimal_length(largest) - 1 + power + decade;
        let exponent = if (-2..=4).contains(&exponent) { 0 } else { exponent };
        self.ticks = numbers
            .iter()
            .zip(first..=last)
            .map(|(&number, i)| AxisTick {
                fraction: ((i * digit) as f64 * power_of_ten(power) - low) / (high - low),
                label: MathText::plain(&decimal(number, power + decade - exponent)),
            })
            .collect();

        if exponent != 0 {
            self.common = power_text("×10", exponent);
        }
        if offset.number != 0 {
            let space = if exponent == 0 { "" } else { " " };
            let power = std::mem::take(&mut self.common);
            self.common = power.then(MathText::plain(space)).then(offset.text(decade));
        }
    }
}

/// A distance between ticks, digit·10^power.
#[derive(Debug, Clone, Copy, PartialEq)]
struct TickStep {
    digit: i64,
    power: i32,
}

impl TickStep {
    fn at_least(distance: f64) -> TickStep {
        let power = decade_of(distance);
        let leading = distance / power_of_ten(power);
        // A distance that is 2 up to rounding must not become 5.
        match [1, 2, 5].into_iter().find(|&digit| leading <= digit as f64 * (1.0 + SLACK)) {
            Some(digit) => TickStep { digit, power },
            None => TickStep { digit: 1, power: power + 1 },
        }
    }

    fn finer(self) -> TickStep {
        match self.digit {
            5 => TickStep { digit: 2, ..self },
            2 => TickStep { digit: 1, ..self },
            _ => TickStep { digit: 5, power: self.power - 1 },
        }
    }

    /// First and last multiple of the step in a range.
    fn within(self, low: f64, high: f64) -> (i64, i64) {
        // A limit that is a multiple up to rounding gets its tick.
        let step = self.digit as f64 * power_of_ten(self.power);
        ((low / step - SLACK).ceil() as i64, (high / step + SLACK).floor() as i64)
    }
}

/// The offset of the labels of a narrow range, number·10^power; zero for a wide range.
#[derive(Debug, Clone, Copy)]
struct TickOffset {
    number: i64,
    power: i32,
}

impl TickOffset {
    /// The roundest number within five ranges of the range, a multiple of 10^finest.
    fn choose(low: f64, high: f64, finest: i32) -> TickOffset {
        let (middle, span) = (f64::midpoint(low, high), high - low);
        if span >= NARROW * middle.abs() {
            return TickOffset { number: 0, power: 0 };
        }
        let near = |power: i32| {
            let unit = power_of_ten(power);
            let number = (middle / unit).round();
            let near = (number * unit - middle).abs() <= 5.0 * span;
            near.then_some(TickOffset { number: number as i64, power })
        };
        let exact =
            TickOffset { number: (middle / power_of_ten(finest)).round() as i64, power: finest };
        (finest..=decade_of(middle.abs())).rev().find_map(near).unwrap_or(exact)
    }

    fn in_units_of(self, power: i32) -> i64 {
        let finer = u32::try_from(self.power - power).unwrap_or(0);
        self.number * 10_i64.pow(finer)
    }

    /// The offset after a sign, times 10^decade.
    fn text(self, decade: i32) -> MathText {
        let sign = if self.number < 0 { "− " } else { "+ " };
        let number = self.number.abs();
        let power = self.power + decade;
        let leading = decimal_length(number.unsigned_abs()) - 1;
        if (-4..=7).contains(&(leading + power)) {
            return MathText::plain(sign).then(MathText::plain(&decimal(number, power)));
        }
        let mantissa = decimal(number, -leading);
        MathText::plain(sign).then(power_text(&format!("{mantissa}×10"), leading + power))
    }
}

fn power_text(base: &str, exponent: i32) -> MathText {
    let mut text = MathText::plain(base);
    text.push(&exponent.to_string().replace('-', "−"), Script::Superscript);
    text
}

/// number·10^power in digits.
fn decimal(number: i64, power: i32) -> String {
    let sign = if number < 0 { "−" } else { "" };
    let digits = number.unsigned_abs().to_string();
    let Some(decimals) = usize::try_from(-power).ok().filter(|&decimals| decimals > 0) else {
        let zeros = if number == 0 { 0 } else { power as usize };
        return format!("{sign}{digits}{}", "0".repeat(zeros));
    };
    let digits = format!("{digits:0>width$}", width = decimals + 1);
    let (whole, fraction) = digits.split_at(digits.len() - decimals);
    format!("{sign}{whole}.{fraction}")
}

/// Number of decimal digits.
fn decimal_length(number: u64) -> i32 {
    number.checked_ilog10().unwrap_or(0).cast_signed() + 1
}

/// The exponent e of 10^e ≤ x < 10^(e+1), for x > 0.
fn decade_of(x: f64) -> i32 {
    // The logarithm may be off by a rounding error at a power of ten.
    let e = x.log10().floor() as i32;
    if power_of_ten(e + 1) <= x {
        e + 1
    } else if power_of_ten(e) > x {
        e - 1
    } else {
        e
    }
}

/// The double nearest to 10^e: products of rounded powers would differ in the last digit.
fn power_of_ten(e: i32) -> f64 {
    format!("1e{e}").parse().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &MathText) -> String {
        text.runs().iter().map(|run| run.text.as_str()).collect()
    }

    fn show(axis: &PlotAxis) -> String {
        let labels: Vec<_> = axis.ticks.iter().map(|tick| words(&tick.label)).collect();
        format!("{} | {}", labels.join(" "), words(&axis.common))
    }

    #[test]
    fn labels_are_short_numbers_and_what_they_have_in_common() {
        for (low, high, intervals, shown) in [
            (0.0, 1000.0, 6, "0 200 400 600 800 1000 | "),
            (9.12, 14.6, 6, "10 11 12 13 14 | "),
            (-0.171, 0.0, 4, "−0.15 −0.10 −0.05 0.00 | "),
            (-3.3e-10, 4.6e-11, 4, "−3 −2 −1 0 | ×10−10"),
            (-3.3e-8, 0.0, 4, "−3 −2 −1 0 | ×10−8"),
            (0.0, 3.2e7, 4, "0 1 2 3 | ×107"),
            (0.0, 1.0, 1, "0 1 | "),
            (0.011, 0.019, 4, "0.012 0.014 0.016 0.018 | "),
            (20000.0, 60000.0, 4, "20000 30000 40000 50000 60000 | "),
        ] {
            let axis = PlotAxis::new(low, high, 0.0, intervals);
            assert_eq!(show(&axis), shown, "{low} {high}");
        }
    }

    #[test]
    fn a_constant_lies_in_the_middle_of_a_readable_range() {
        for value in [101_325.0, -2.5e-9, 0.0, 5e-324, 1e308] {
            let axis = PlotAxis::new(value, value, 0.05, 4);
            assert!((axis.fraction(value) - 0.5).abs() < 1e-9, "{value}");
            assert!(axis.ticks.len() >= 2, "{value}: {}", show(&axis));
        }
        // The last digit of a double is rounding.
        let axis = PlotAxis::new(1.0, 1.0 + f64::EPSILON, 0.05, 4);
        assert_eq!(show(&axis), "0.90 0.95 1.00 1.05 1.10 | ");
    }

    #[test]
    fn narrow_ranges_are_shown_relative_to_an_offset() {
        for (low, high, shown) in [
            (101_325.0, 101_325.000_4, "0 1 2 3 4 | ×10−4 + 101325"),
            (-9.120_001, -9.120_000_6, "−1.0 −0.9 −0.8 −0.7 −0.6 | ×10−6 − 9.12"),
            (1e9, 1e9 + 30.0, "0 10 20 30 | + 1×109"),
        ] {
            assert_eq!(show(&PlotAxis::new(low, high, 0.0, 4)), shown);
        }
    }

    #[test]
    fn any_range_of_doubles_has_ticks_inside_its_limits() {
        let ends = [0.0, 1e-310, 1e-300, 1e-15, 1.0, 1.0 + 1e-11, 1e300, f64::MAX];
        let signed = || ends.iter().flat_map(|&x| [x, -x]);
        for low in signed() {
            for high in signed().filter(|&high| high >= low) {
                for intervals in [0, 1, 3, 12] {
                    let axis = PlotAxis::new(low, high, 0.05, intervals);
                    assert!(axis.ticks.len() >= 2, "{low} {high}");
                    assert!(axis.ticks.len() <= intervals.max(2) as usize + 4, "{low} {high}");
                    for tick in &axis.ticks {
                        assert!((-1e-3..=1.001).contains(&tick.fraction), "{low} {high}");
                    }
                    assert!((0.0..=1.0).contains(&axis.fraction(low)), "{low} {high}");
                    assert!((0.0..=1.0).contains(&axis.fraction(high)), "{low} {high}");
                }
            }
        }
    }

    #[test]
    fn without_values_there_are_no_ticks() {
        for (low, high) in
            [(f64::INFINITY, f64::NEG_INFINITY), (f64::NAN, f64::NAN), (0.0, f64::INFINITY)]
        {
            assert!(PlotAxis::new(low, high, 0.05, 4).ticks.is_empty());
        }
    }
}
