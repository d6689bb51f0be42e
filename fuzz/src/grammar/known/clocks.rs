//! Clocks with commensurable periods: at common ticks they act in the order of the file.

use super::Draft;

/// Resets of the held values a, b and c.
type Act = fn(&mut [f64; 3]);

/// Texts of resets that read each other and stay bounded, and the corresponding functions.
const ACTS: [(&str, Act); 5] = [
    ("reset a = a + 1", |x| x[0] += 1.0),
    ("reset b = 0.5*b + a", |x| x[1] = 0.5 * x[1] + x[0]),
    ("reset a = a - 0.25*b", |x| x[0] -= 0.25 * x[1]),
    ("reset c = if a > b then c + 1 else 0.5*c", |x| {
        x[2] = if x[0] > x[1] { x[2] + 1.0 } else { 0.5 * x[2] };
    }),
    ("reset a = 0.1*c\n  reset c = a", |x| (x[0], x[2]) = (0.1 * x[2], x[0])),
];

pub(super) fn write(draft: &mut Draft) {
    draft.is_ordered = true;
    let (unit, seconds) = *draft.random.pick(&[("s", 1.0), ("min", 60.0), ("h", 3600.0)]);
    let base = *draft.random.pick(&[10, 7, 30, 1]);
    let by_parameter = draft.chance(0.4);
    if by_parameter {
        draft.item(format!("parameter T [{unit}] = {}", hundredths(base)));
    }
    for name in ["a", "b", "c"] {
        draft.item(format!("held {name} = 0"));
    }
    let count = draft.whole(2, 4);
    // Periods in hundredths of the unit.
    let mut clocks: Vec<(u64, Act)> = Vec::new();
    for _ in 0..count {
        let times = *draft.random.pick(&[1, 1, 2, 3, 5, 6, 10]);
        let text = match (by_parameter, times) {
            (true, 1) => "T".to_owned(),
            (true, times) if draft.chance(0.5) => format!("{times}*T"),
            _ => format!("{} [{unit}]", hundredths(base * times)),
        };
        let (does, act) = *draft.random.pick(&ACTS);
        draft.item(format!("every {text} {{\n  {does}\n}}"));
        clocks.push((base * times, act));
    }
    draft.item("state area = 0");
    draft.item("equation area: der(area) = a/1 [s]");
    for name in ["a", "b", "c"] {
        draft.item(format!("output {name}"));
    }
    // Ends between two ticks.
    let last = base * draft.whole(20, 300) as u64;
    let end = hundredths(last) * seconds + 0.37 * hundredths(base) * seconds;
    draft.until = end;
    let mut values = [0.0; 3];
    let (mut area, mut since, mut largest) = (0.0, 0.0, 1.0_f64);
    for tick in 0..=last {
        for (period, act) in &clocks {
            if tick % period == 0 {
                let now = hundredths(tick) * seconds;
                area += values[0] * (now - since);
                since = now;
                act(&mut values);
                largest = values.iter().fold(largest, |m, value| m.max(value.abs()));
            }
        }
    }
    area += values[0] * (end - since);
    for (name, value) in ["a", "b", "c"].iter().zip(values) {
        draft.at(name, end, value, 0.0);
    }
    draft.at("area", end, area, (largest * hundredths(base) * seconds).max(area.abs()));
}

fn hundredths(count: u64) -> f64 {
    count as f64 / 100.0
}
