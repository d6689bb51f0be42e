//! Conditions on periodic functions of time: their switches are counted, and integrated in closed form between exact
//! crossings.

use std::f64::consts::TAU;

use super::Draft;
use super::quadrature::root;

/// Samples of a period in the search for crossings: functions with few harmonics have none in between.
const SAMPLES: usize = 800;
/// Least distance of an extremum from the level, so that rounding does not decide whether there is a crossing.
const CLEAR: f64 = 1e-3;
/// Samples closer to the level than this are at it.
const AT_LEVEL: f64 = 1e-9;

/// A periodic function of time around a level.
struct Wave {
    /// Text of the condition, and of the two sides of a `when`.
    condition: String,
    sides: [String; 2],
    period: f64,
    above: Box<dyn Fn(f64) -> f64>,
}

/// Units of a period, with their lengths in seconds.
const UNITS: [(&str, f64); 4] = [("s", 1.0), ("min", 60.0), ("h", 3600.0), ("d", 86400.0)];

pub(super) fn write(draft: &mut Draft) {
    let wave = wave(draft);
    let periods = *draft.random.pick(&[5, 20, 60, 100]);
    let Some(crossings) = crossings(&wave, periods) else { return write(draft) };
    // The end is not close to a crossing.
    let end = wave.period * (periods as f64 - 1.0 + draft.number(0.1, 0.9, 3));
    let near = crossings.iter().any(|(t, _)| (t - end).abs() < 1e-3 * wave.period);
    if near || crossings.is_empty() {
        return write(draft);
    }
    draft.until = end;
    let window = draft.chance(0.25).then(|| {
        let length = wave.period * draft.whole(2, 7) as f64;
        (length, length * draft.number(0.2, 0.8, 2))
    });
    let on = intervals(&wave, &crossings, end, window);

    let mut condition = wave.condition.clone();
    if let Some((length, open)) = window {
        condition = format!("({condition}) and mod(time, {length} [s]) < {open} [s]");
    }
    let base = draft.number(0.5, 3.0, 2);
    let ripple = draft.number(0.0, 0.4, 2);
    let ripple_period = wave.period * draft.number(1.3, 9.0, 2);
    let omega = TAU / ripple_period;
    draft.item(format!("parameter base [1/s] = {base}"));
    draft.item("state E = 0");
    draft.item(format!(
        "equation energy: der(E) = if {condition} then base*(1 + {ripple}*sin(2*pi*time/{ripple_period} [s])) else 0"
    ));
    draft.item("output E");
    let integral =
        |a: f64, b: f64| base * (b - a - ripple / omega * ((omega * b).cos() - (omega * a).cos()));
    let energy: f64 = on.iter().map(|(a, b)| integral(*a, *b)).sum();
    let size = base * wave.period;
    draft.at("E", end, energy, size.max(energy.abs()));
    // All switches have the same times.
    draft.at("d(E)/d(base)", end, energy / base, (size / base).max(energy.abs() / base));

    if draft.chance(0.5) {
        let tau = wave.period * draft.number(0.2, 3.0, 2);
        draft.item("state T = 0");
        draft.item(format!("equation room: {tau} [s]*der(T) = (if {condition} then 1 else 0) - T"));
        let mut level = 0.0;
        let mut t = 0.0;
        for (a, b) in &on {
            level *= (-(a - t) / tau).exp();
            level = 1.0 + (level - 1.0) * (-(b - a) / tau).exp();
            t = *b;
        }
        draft.at("T", end, level * (-(end - t) / tau).exp(), 1.0);
    }
    if draft.chance(0.7) {
        let rises = draft.chance(0.5);
        let word = if rises { "rises above" } else { "falls below" };
        draft.item("held n = 0");
        let [left, right] = &wave.sides;
        draft.item(format!("when {left} {word} {right} {{ reset n = n + 1 }}"));
        let count = crossings.iter().filter(|(t, up)| *up == rises && *t < end).count();
        draft.at("n", end, count as f64, 0.0);
    }
}

fn wave(draft: &mut Draft) -> Wave {
    let (unit, seconds) = *draft.random.pick(&UNITS);
    let count = draft.number(0.4, 3.0, 1);
    let period = count * seconds;
    let phase = draft.number(0.0, 1.0, 3);
    let angle_text = format!("2*pi*(time/{count} [{unit}] - {phase})");
    let angle = move |t: f64| TAU * (t / period - phase);
    let (text, value): (String, Box<dyn Fn(f64) -> f64>) = match draft.random.below(4) {
        0 | 1 => (format!("cos({angle_text})"), Box::new(move |t| angle(t).cos())),
        2 => {
            let (share, times) = (draft.number(0.2, 0.8, 2), draft.whole(2, 4));
            let text = format!("sin({angle_text}) + {share}*cos({times}*{angle_text})");
            (text, Box::new(move |t| angle(t).sin() + share * (times as f64 * angle(t)).cos()))
        }
        _ => (format!("abs(sin({angle_text}))"), Box::new(move |t| angle(t).sin().abs())),
    };
    // Most of the range, and sometimes little more than a peak.
    let level =
        if draft.chance(0.3) { draft.number(0.97, 0.9985, 4) } else { draft.number(-0.9, 0.9, 2) };
    let swapped = draft.chance(0.3);
    let condition = match (swapped, draft.chance(0.5)) {
        (false, _) => format!("{text} > {level}"),
        (true, true) => format!("{level} <= {text}"),
        (true, false) => format!("not ({text} < {level})"),
    };
    let sides = [text, level.to_string()];
    Wave { condition, sides, period, above: Box::new(move |t| value(t) - level) }
}

/// Crossings in the first periods, and whether they rise; `None` if an extremum is close to the level.
fn crossings(wave: &Wave, periods: usize) -> Option<Vec<(f64, bool)>> {
    let time = |k: usize| k as f64 * wave.period / SAMPLES as f64;
    let values: Vec<f64> = (0..=SAMPLES + 2).map(|k| (wave.above)(time(k))).collect();
    for three in values.windows(3) {
        let is_extremum = (three[1] - three[0]) * (three[2] - three[1]) <= 0.0;
        if is_extremum && three.iter().any(|value| value.abs() < CLEAR) {
            return None;
        }
    }
    // A sample at the level may be on either side in another period.
    if values[0].abs() < CLEAR || values.iter().any(|value| value.abs() < AT_LEVEL) {
        return None;
    }
    let mut crossings = Vec::new();
    for period in 0..periods {
        for k in 0..SAMPLES {
            let start = period as f64 * wave.period;
            if (values[k] > 0.0) != (values[k + 1] > 0.0) {
                let root = root(&wave.above, start + time(k), start + time(k + 1));
                crossings.push((root, values[k + 1] > 0.0));
            }
        }
    }
    Some(crossings)
}

/// The intervals up to the end in which the condition holds.
fn intervals(
    wave: &Wave,
    crossings: &[(f64, bool)],
    end: f64,
    window: Option<(f64, f64)>,
) -> Vec<(f64, f64)> {
    let mut intervals = Vec::new();
    let mut since = ((wave.above)(0.0) > 0.0).then_some(0.0);
    for (t, rises) in crossings.iter().filter(|(t, _)| *t < end) {
        match since.take() {
            Some(start) if !rises => intervals.push((start, *t)),
            _ => since = Some(*t),
        }
    }
    intervals.extend(since.map(|start| (start, end)));
    let Some((length, open)) = window else { return intervals };
    let windows = (0..).map(|k| f64::from(k) * length).take_while(|start| *start < end);
    windows
        .flat_map(|start| intervals.iter().map(move |(a, b)| (a.max(start), b.min(start + open))))
        .filter(|(a, b)| a < b)
        .collect()
}
