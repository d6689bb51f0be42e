//! Modes that join states: conserved quantities do not change at the switch.

use super::Draft;

/// Two stores, their levels, and the flow from the first to the second.
struct Pair {
    words: [&'static str; 4],
    units: [&'static str; 4],
}

/// Names of the two levels, of the flow and of the sum; units of a capacity, a level, a flow and the sum.
const PAIRS: [Pair; 3] = [
    Pair { words: ["v1", "v2", "i", "charge"], units: ["F", "V", "A", "A*s"] },
    Pair { words: ["w1", "w2", "torque", "momentum"], units: ["kg*m^2", "rad/s", "N*m", "N*m*s"] },
    Pair { words: ["h1", "h2", "q", "volume"], units: ["m^2", "m", "m^3/s", "m^3"] },
];

pub(super) fn write(draft: &mut Draft) {
    let pair = draft.random.pick(&PAIRS);
    let [first, second, flow, sum] = pair.words;
    let [capacity, level, rate, total] = pair.units;
    let (c1, c2) = (draft.number(0.5, 4.0, 1), draft.number(0.5, 4.0, 1));
    let (start1, start2) = (draft.number(2.0, 10.0, 1), draft.number(-3.0, 1.0, 1));
    // The constant outflow of the first store, and the transmission ratio.
    let leaves = if draft.chance(0.5) { 0.0 } else { draft.number(0.1, 1.0, 2) };
    let ratio = if draft.chance(0.6) { 1.0 } else { draft.number(0.5, 3.0, 1) };
    draft.item(format!("parameter c1 [{capacity}] = {c1}"));
    draft.item(format!("constant c2 [{capacity}] = {c2}"));
    draft.item(format!("state {first} [{level}] = {start1}"));
    draft.item(format!("state {second} [{level}] = {start2}"));
    draft.item(format!("unknown {flow} [{rate}] = 0"));
    draft.item(format!("equation one: c1*der({first}) = -{flow} - {leaves} [{rate}]"));
    draft.item(format!("equation two: c2*der({second}) = {ratio}*{flow}"));
    let tie = if ratio == 1.0 {
        format!("{first} = {second}")
    } else {
        format!("{first} = {ratio}*{second}")
    };
    // Joined at a time, or at a level, and possibly separated again.
    let by_level = leaves > 0.0 && draft.chance(0.5);
    let joins = if by_level {
        let share = draft.number(0.2, 0.8, 2);
        (share * (start1 * c1 / leaves).min(20.0)).max(0.1)
    } else {
        draft.number(0.3, 3.0, 2)
    };
    let (joins, condition) = if by_level {
        let threshold: f64 =
            format!("{:.2}", start1 - leaves * joins / c1).parse().unwrap_or(start1);
        (c1 * (start1 - threshold) / leaves, format!("{first} falls below {threshold} [{level}]"))
    } else {
        (joins, format!("time rises above {joins} [s]"))
    };
    if joins < 1e-3 {
        return restart(draft);
    }
    let parts = draft.chance(0.4).then(|| joins + draft.number(0.2, 2.0, 2));
    let parted = match parts {
        Some(at) => format!("\n  joined -> open when time rises above {at} [s]"),
        None => String::new(),
    };
    let label = draft.one_of(&["clutch", "valve", "sw"]);
    draft.item(format!(
        "modes {label} {{\n  open {{ equation {label}: {flow} = 0 [{rate}] }}\n  \
         joined {{ equation {label}: {tie} }}\n  open -> joined when {condition}{parted}\n}}"
    ));
    draft.item(format!("state lost [{total}] = 0"));
    draft.item(format!("equation lost: der(lost) = {leaves} [{rate}]"));
    draft.item(format!("output {sum} [{total}] = {ratio}*c1*{first} + c2*{second} + {ratio}*lost"));
    draft.item(format!("output {first}"));
    draft.item(format!("output {second}"));

    // An impulse J takes J/c1 from the first and adds ratio·J/c2 to the second.
    let before = start1 - leaves * joins / c1;
    let give = 1.0 / c1 + ratio * ratio / c2;
    let impulse = (before - ratio * start2) / give;
    let after = [before - impulse / c1, start2 + ratio * impulse / c2];
    draft.until = joins + draft.number(0.5, 4.0, 2);
    if parts.is_some_and(|at| (at - draft.until).abs() < 0.01) {
        draft.until += 0.05;
    }
    let until = draft.until;
    let together = parts.map_or(until, |at| at.min(until)) - joins;
    // When joined, both levels move together.
    let falls = leaves / c1 - leaves / (c1 * c1) / give;
    let both = [after[0] - falls * together, (after[0] - falls * together) / ratio];
    let alone = (until - joins - together).max(0.0);
    let end = both[0] - leaves * alone / c1;
    // Separated above the level, the first falls below it again.
    if by_level && both[0] > before && end < before {
        return restart(draft);
    }
    let size = start1.abs().max(start2.abs());
    draft.at(first, until, end, size);
    draft.at(second, until, both[1], size);
    let conserved = ratio * c1 * start1 + c2 * start2;
    draft.always(sum, conserved, (ratio * c1 * start1).abs() + (c2 * start2).abs());
}

/// Writes another model instead.
fn restart(draft: &mut Draft) {
    draft.items.clear();
    draft.facts.clear();
    write(draft);
}
