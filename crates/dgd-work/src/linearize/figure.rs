//! A plot of poles in the complex plane, labelled with time constants.

use dgd_plot::{Figure, MathText, Panel, PlotSeries, SeriesStyle};
use dgd_runtime::linearize::Pole;

use crate::output::quantity::short;

/// Labelled poles, the slowest first.
const MOST_NAMED: usize = 6;
/// Margin on either side of the poles, and half the size of a cross, relative to the plot's width.
const MARGIN: f64 = 0.08;
const ARM: f64 = 0.006;
/// Aspect ratio of the panel, width over height.
const SLENDER: f64 = 1.8;
/// Poles faster than the slowest by more than this factor are left out, because their scale would hide the slow ones.
const MOST_FASTER: f64 = 1000.0;

/// The poles in the complex plane. `conserved` of those at zero belong to conserved quantities.
pub(super) fn poles(title: &str, poles: &[Pole], conserved: usize) -> Figure {
    // One pole of each conjugate pair stands for both.
    let mut shown: Vec<Pole> = poles.iter().copied().filter(|pole| pole.im >= 0.0).collect();
    shown.sort_by(|a, b| a.frequency().total_cmp(&b.frequency()));
    let is_zero = |pole: &Pole| pole.im == 0.0 && pole.is_on_axis();
    let slowest = shown.iter().filter(|pole| !is_zero(pole)).map(|pole| pole.frequency()).next();
    let limit = slowest.map_or(f64::INFINITY, |slowest| slowest * MOST_FASTER);
    let (inside, faster): (Vec<Pole>, Vec<Pole>) =
        shown.into_iter().partition(|pole| pole.frequency() <= limit);

    let frame = PlaneFrame::around(&inside);
    let mut series = Vec::new();
    let mut left = conserved;
    for (k, pole) in inside.iter().enumerate().take(MOST_NAMED) {
        let is_conserved = is_zero(pole) && left > 0;
        left -= usize::from(is_conserved);
        let name = if is_conserved { "0, conserved".to_owned() } else { name(pole) };
        series.push(frame.crosses(&name, &inside[k..=k]));
    }
    if let Some(rest) = inside.get(MOST_NAMED..).filter(|rest| !rest.is_empty()) {
        let text = match rest {
            [one, other] => format!("{}; {}", name(one), name(other)),
            _ => format!("{} more, {}", rest.len(), span(rest)),
        };
        series.push(frame.crosses(&text, rest));
    }
    series.push(frame.axes());
    if !faster.is_empty() {
        let text = format!("{} outside, {}", faster.len(), span(&faster));
        series.push(frame.crosses(&text, &[]));
    }
    let panel = Panel {
        title: MathText::plain(title),
        y_label: MathText::plain("imaginary part").with_unit("rad/s"),
        series,
        ..Panel::default()
    };
    Figure::new(MathText::plain("Real part").with_unit("1/s"), vec![panel])
}

/// The visible part of the plane.
struct PlaneFrame {
    left: f64,
    right: f64,
    height: f64,
}

impl PlaneFrame {
    fn around(poles: &[Pole]) -> Self {
        let highest = poles.iter().map(|pole| pole.im).fold(0.0, f64::max);
        let least = poles.iter().map(|pole| pole.re).fold(0.0, f64::min);
        let most = poles.iter().map(|pole| pole.re).fold(0.0, f64::max);
        let width = match most - least {
            0.0 if highest > 0.0 => highest,
            0.0 => 1.0,
            width => width,
        };
        let height = if highest > 0.0 { highest } else { 0.5 * width };
        PlaneFrame {
            left: least - MARGIN * width,
            right: most + MARGIN * width,
            height: 1.2 * height,
        }
    }

    /// Both axes; poles left of the imaginary axis are stable.
    fn axes(&self) -> PlotSeries {
        let x = vec![0.0, 0.0, f64::NAN, self.left, self.right];
        let y = vec![-self.height, self.height, f64::NAN, 0.0, 0.0];
        PlotSeries::new(MathText::plain("axes"), SeriesStyle::ThinLine, x, y)
    }

    /// A cross for each pole, two for a pair.
    fn crosses(&self, name: &str, poles: &[Pole]) -> PlotSeries {
        let (mut x, mut y) = (Vec::new(), Vec::new());
        let (dx, dy) = (ARM * (self.right - self.left), 2.0 * ARM * SLENDER * self.height);
        for pole in poles {
            let re = if pole.is_on_axis() { 0.0 } else { pole.re };
            for im in [pole.im, -pole.im].into_iter().take(1 + usize::from(pole.im != 0.0)) {
                x.extend([re - dx, re + dx, f64::NAN, re - dx, re + dx, f64::NAN]);
                y.extend([im - dy, im + dy, f64::NAN, im + dy, im - dy, f64::NAN]);
            }
        }
        PlotSeries::new(MathText::plain(name), SeriesStyle::Line, x, y)
    }
}

/// The time constant of a pole: `69 s`, `0.74 s, period 2.1 s`.
fn name(pole: &Pole) -> String {
    let time = || duration(pole.time_constant().abs());
    match (pole.is_on_axis(), pole.period()) {
        (true, None) => "0, integrates".to_owned(),
        (true, Some(period)) => format!("undamped, period {}", duration(period)),
        (false, period) => {
            let grows = if pole.re > 0.0 { "grows in " } else { "" };
            let period =
                period.map_or_else(String::new, |period| format!(", period {}", duration(period)));
            format!("{grows}{}{period}", time())
        }
    }
}

/// Time constants from the slowest to the fastest, by |s|.
fn span(poles: &[Pole]) -> String {
    let time = |pole: Option<&Pole>| {
        pole.map_or_else(String::new, |pole| duration(1.0 / pole.frequency()))
    };
    let (first, last) = (time(poles.first()), time(poles.last()));
    if first == last { first } else { format!("{first} to {last}") }
}

/// A time in a readable unit.
fn duration(seconds: f64) -> String {
    let (factor, unit) = match seconds {
        s if s < 1e-4 => (1e-6, "µs"),
        s if s < 0.1 => (1e-3, "ms"),
        s if s < 120.0 => (1.0, "s"),
        s if s < 7200.0 => (60.0, "min"),
        s if s < 172_800.0 => (3600.0, "h"),
        _ => (86_400.0, "days"),
    };
    format!("{} {unit}", short(seconds / factor, 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pole(re: f64, im: f64) -> Pole {
        Pole { re, im, rounding: 1e-15 }
    }

    #[test]
    fn times_are_said_as_people_say_them() {
        let durations: Vec<String> =
            [3e-6, 0.02, 0.74, 69.1, 150.0, 9000.0, 1e6].map(duration).into();
        assert_eq!(durations, ["3 µs", "20 ms", "0.74 s", "69 s", "2.5 min", "2.5 h", "12 days"]);
    }

    #[test]
    fn each_pole_is_named_by_its_time_and_a_pair_is_drawn_twice() {
        let plane =
            [pole(0.0, 0.0), pole(-0.01, 0.0), pole(-1.0, 3.0), pole(-1.0, -3.0), pole(-1e6, 0.0)];
        let figure = poles("loop", &plane, 1);
        let series = &figure.panels[0].series;
        let names: Vec<&MathText> = series.iter().map(|series| &series.name).collect();
        let expected = ["0, conserved", "100 s", "1 s, period 2.1 s", "axes", "1 outside, 1 µs"];
        assert_eq!(names, expected.map(MathText::plain).iter().collect::<Vec<_>>());
        // The midpoints of two crosses.
        let middle = |k: usize| {
            let crosses = &series[2];
            (0.5 * (crosses.x[k] + crosses.x[k + 1]), 0.5 * (crosses.y[k] + crosses.y[k + 1]))
        };
        assert!([middle(0), middle(3)] == [(-1.0, 3.0); 2], "{:?}", middle(0));
        assert!([middle(6), middle(9)] == [(-1.0, -3.0); 2], "{:?}", middle(6));
        assert!(series[4].x.is_empty());
        // The imaginary axis spans the pair, and the real one reaches it.
        assert!(series[3].y[1] > 3.0 && series[3].x[3] < -1.0);
    }
}
