//! Delays that jump, and state-dependent delays, of signals in closed form.

use super::Draft;
use super::quadrature::{integral, root};

/// A delayed signal: its values before the start and after it, with their texts.
struct Signal {
    before: f64,
    slope: f64,
    omega: f64,
}

impl Signal {
    fn value(&self, t: f64) -> f64 {
        self.before + self.slope / self.omega * (self.omega * t.max(0.0)).sin()
    }

    fn largest(&self) -> f64 {
        self.before.abs() + self.slope / self.omega
    }
}

/// The delay as a function of time, and the times at which it is not smooth.
struct Length {
    text: String,
    at: Box<dyn Fn(f64) -> f64>,
    corners: Vec<f64>,
}

pub(super) fn write(draft: &mut Draft) {
    let signal = Signal {
        before: draft.number(-1.0, 2.0, 1),
        slope: draft.number(0.5, 2.0, 1),
        omega: draft.number(0.5, 3.0, 1),
    };
    let Signal { before, slope, omega } = signal;
    draft.until = draft.number(4.0, 15.0, 2);
    let until = draft.until;
    draft.item(format!("state x = {before}"));
    draft.item(format!("equation x: der(x) = {slope}/1 [s]*cos({omega}*time/1 [s])"));
    let length = match draft.random.below(4) {
        0 | 1 => by_input(draft),
        2 => by_held(draft),
        _ => by_state(draft),
    };
    let text = &length.text;
    draft.item("state z = 0");
    draft.item(format!("equation z: der(z) = delay(x, {text})/1 [s]"));
    if draft.chance(0.5) {
        draft.item("unknown late = 1");
        draft.item(format!("equation late: late = delay(x, {text})"));
    } else {
        draft.item(format!("output late = delay(x, {text})"));
    }
    draft.item(format!("output gained = x^2 - delay(x, {text})^2"));

    let late = |t: f64| signal.value(t - (length.at)(t));
    let size = signal.largest();
    for t in [0.31, 0.62, 1.0].map(|share| share * until) {
        if length.corners.iter().all(|corner| (corner - t).abs() > 1e-3) {
            draft.at("late", t, late(t), size);
            draft.at("gained", t, signal.value(t).powi(2) - late(t).powi(2), size * size);
        }
    }
    // The pieces end where the delay jumps, and where it reaches back to the start.
    let mut ends = length.corners.clone();
    ends.extend([0.0, until]);
    ends.sort_by(f64::total_cmp);
    let reaches = |t: f64| t - (length.at)(t);
    let mut sum = 0.0;
    for pair in ends.windows(2) {
        // Just inside, because the delay may jump at the ends.
        let (a, b) = (pair[0] + 1e-12, pair[1] - 1e-12);
        if a >= b {
            continue;
        }
        let mut cuts = vec![a];
        if reaches(a) < 0.0 && reaches(b) > 0.0 {
            cuts.push(root(&reaches, a, b));
        }
        cuts.push(b);
        sum += cuts.windows(2).map(|cut| integral(&late, cut[0], cut[1], 200)).sum::<f64>();
    }
    draft.at("z", until, sum, size * until);
}

/// A delay given by a recorded, held input.
fn by_input(draft: &mut Draft) -> Length {
    let steps = draft.whole(3, 8);
    let mut rows = vec![(0.0, draft.number(0.1, 2.0, 1))];
    for k in 1..steps {
        let time = draft.until * (k as f64 + draft.random.between(-0.3, 0.3)) / steps as f64;
        rows.push(((time * 1e3).round() / 1e3, draft.number(0.1, 3.0, 1)));
    }
    rows.push((draft.until, rows[steps - 1].1));
    draft.item("input w [s]");
    "time [s],w [s]\n".clone_into(&mut draft.data);
    draft.data.extend(rows.iter().map(|(t, w)| format!("{t},{w}\n")));
    let corners = rows[1..steps].iter().map(|row| row.0).collect();
    let delay = move |t: f64| rows[rows.partition_point(|row| row.0 <= t).max(1) - 1].1;
    Length { text: "w".to_owned(), at: Box::new(delay), corners }
}

/// A delay changed by an event or a condition on time.
fn by_held(draft: &mut Draft) -> Length {
    let (first, next) = (draft.number(0.1, 2.0, 1), draft.number(0.1, 2.0, 1));
    let when = draft.number(0.2 * draft.until, 0.8 * draft.until, 2);
    let text = if draft.chance(0.5) {
        draft.item(format!("held tau [s] = {first}"));
        draft.item(format!("when time rises above {when} [s] {{ reset tau = {next} [s] }}"));
        "tau".to_owned()
    } else {
        format!("if time < {when} [s] then {first} [s] else {next} [s]")
    };
    let delay = move |t: f64| if t < when { first } else { next };
    Length { text, at: Box::new(delay), corners: vec![when] }
}

/// A delay by a state that decays or oscillates.
fn by_state(draft: &mut Draft) -> Length {
    let (least, more) = (draft.number(0.2, 1.5, 1), draft.number(0.1, 0.9, 1));
    let rate = draft.number(0.2, 0.9, 1);
    if draft.chance(0.5) {
        draft.item("state s = 1");
        draft.item(format!("equation s: der(s) = -{rate}/1 [s]*s"));
        let delay = move |t: f64| least + more * (-rate * t).exp();
        let text = format!("{least} [s] + {more} [s]*s");
        return Length { text, at: Box::new(delay), corners: Vec::new() };
    }
    // The delay grows more slowly than time.
    draft.item("state s = 0");
    draft.item(format!("equation s: der(s) = {rate}/1 [s]*cos(time/1 [s])"));
    let delay = move |t: f64| least + more + more * rate * t.sin();
    let text = format!("{} [s] + {more} [s]*s", least + more);
    Length { text, at: Box::new(delay), corners: Vec::new() }
}
