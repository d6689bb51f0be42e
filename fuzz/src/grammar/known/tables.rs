//! Tables of time, integrated in closed form.

use super::Draft;
use super::curve::Curve;
use super::quadrature::integral;

/// A function of time.
type Of<'a> = Box<dyn Fn(f64) -> f64 + 'a>;

pub(super) fn write(draft: &mut Draft) {
    let length = *draft.random.pick(&[1.0, 10.0, 100.0, 2000.0]);
    let points = points(draft, length);
    let (shape, curve) = match draft.random.below(3) {
        0 => ("linear", Curve::linear(&points)),
        1 => ("pchip", Curve::monotone(&points)),
        _ => ("natural", Curve::natural(&points)),
    };
    let texts: Vec<String> = points.iter().map(|(x, y)| format!("({x}, {y})")).collect();
    draft.item(format!("table flow(t [s]) = {} {shape}, beyond hold", texts.join(", ")));
    // Time itself, a shifted time, or a periodic one.
    let late = length * draft.number(0.1, 0.5, 2);
    let until = length * draft.number(0.7, 0.99, 3);
    let curve = &curve;
    let knots = || points.iter().map(|(x, _)| *x);
    let (argument, until, breaks, value, whole): (String, f64, Vec<f64>, Of<'_>, Of<'_>) =
        match draft.random.below(4) {
            0 => (
                format!("time - {late} [s]"),
                late + until,
                knots().map(|x| x + late).collect(),
                Box::new(move |t| curve.value(t - late)),
                Box::new(move |t| {
                    late.min(t) * curve.value(0.0) + curve.integral((t - late).max(0.0))
                }),
            ),
            1 => {
                let rounds = draft.whole(2, 12) as f64;
                (
                    format!("mod(time, {length} [s])"),
                    rounds * length + until,
                    (0..=rounds as usize)
                        .flat_map(|k| knots().map(move |x| x + k as f64 * length))
                        .collect(),
                    Box::new(move |t| curve.value(t.rem_euclid(length))),
                    Box::new(move |t| {
                        (t / length).floor() * curve.integral(length)
                            + curve.integral(t.rem_euclid(length))
                    }),
                )
            }
            2 => {
                let rate = draft.number(1.1, 4.0, 1);
                (
                    format!("{rate}*time"),
                    until / rate,
                    knots().map(|x| x / rate).collect(),
                    Box::new(move |t| curve.value(rate * t)),
                    Box::new(move |t| curve.integral(rate * t) / rate),
                )
            }
            _ => (
                "time".to_owned(),
                until,
                knots().collect(),
                Box::new(|t| curve.value(t)),
                Box::new(|t| curve.integral(t)),
            ),
        };
    let gain = draft.number(0.5, 2.0, 2);
    draft.item(format!("parameter gain [1/s] = {gain}"));
    draft.item("state V = 0");
    draft.item(format!("equation filling: der(V) = gain*flow({argument})"));
    draft.item("output V");
    draft.item(format!("output now = flow({argument})"));
    draft.until = until;
    let volume = gain * whole(until);
    let size = points.iter().fold(1e-3, |m: f64, point| m.max(point.1.abs()));
    draft.at("V", until, volume, (0.01 * gain * size * length).max(volume.abs()));
    draft.at("d(V)/d(gain)", until, volume / gain, (0.01 * size * length).max(volume.abs()));
    draft.at("now", until, value(until), size);
    if draft.chance(0.5) {
        let tau = length * draft.number(0.05, 0.3, 2);
        draft.item("state late = 0");
        draft.item(format!("equation lag: {tau} [s]*der(late) = flow({argument}) - late"));
        draft.at("late", until, lagged(&*value, &breaks, until, tau), size);
    }
}

/// Points that are level at both ends, with a peak, possibly narrow, and others.
fn points(draft: &mut Draft, length: f64) -> Vec<(f64, f64)> {
    let base = if draft.chance(0.5) { 0.0 } else { draft.number(-1.0, 1.0, 1) };
    let peak = draft.number(0.3, 0.7, 2);
    let width = *draft.random.pick(&[0.0005, 0.005, 0.05]);
    let height = draft.number(1.0, 5.0, 1);
    let mut points = vec![(0.0, base), (0.05, base)];
    if draft.chance(0.4) {
        points.push((0.15, draft.number(-2.0, 2.0, 1)));
        points.push((0.22, draft.number(-2.0, 2.0, 1)));
    }
    points.extend([(peak - width, base), (peak, base + height), (peak + width, base)]);
    if draft.chance(0.4) {
        points.push((0.8, draft.number(-2.0, 2.0, 1)));
    }
    points.extend([(0.95, base), (1.0, base)]);
    // Abscissae as rounded in the text.
    points.iter().map(|(x, y)| (((x * length) * 1e6).round() / 1e6, *y)).collect()
}

/// The solution of τ ẋ = f − x from 0, by variation of constants; f is a cubic between the breaks.
fn lagged(f: &dyn Fn(f64) -> f64, breaks: &[f64], until: f64, tau: f64) -> f64 {
    let weighed = |t: f64| f(t) * (-(until - t) / tau).exp() / tau;
    let mut start = 0.0;
    let mut sum = 0.0;
    for end in breaks.iter().copied().filter(|t| *t > 0.0 && *t < until).chain([until]) {
        sum += integral(&weighed, start, end, ((end - start) / (0.2 * tau)).ceil() as usize);
        start = end;
    }
    sum
}
