//! Noise proportional to an output, a time constant or a parameter: the standard deviation is an output, in closed
//! form.

use super::Draft;

pub(super) fn write(draft: &mut Draft) {
    let (start, rate) = (draft.number(1.0, 9.0, 1), draft.number(0.1, 2.0, 2));
    // The output passes zero if this exceeds its start.
    let less = if draft.chance(0.5) { 0.0 } else { draft.number(0.1, 12.0, 1) };
    let (share, floor) = (draft.number(0.01, 0.2, 2), draft.number(0.1, 0.5, 1));
    draft.until = draft.number(0.5, 5.0, 2);
    let until = draft.until;
    draft.item(format!("parameter rate [1/s] = {rate}"));
    draft.item(format!("parameter share = {share}"));
    draft.item(format!("state x = {start}"));
    draft.item("equation x: der(x) = -rate*x");
    let kind = draft.random.below(4);
    let noise = match kind {
        0 => "noise share*abs(y)".to_owned(),
        1 => format!("noise {floor} + share*abs(y)"),
        2 => format!("noise hypot({floor}, share*y)"),
        _ => "noise lognormal(share)".to_owned(),
    };
    let less = if kind == 3 { 0.0 } else { less };
    draft.item(format!("output y = x - {less}  {noise}"));
    let x = start * (-rate * until).exp();
    let (y, slope) = (x - less, -until * x);
    // The standard deviation, and its derivatives with respect to y and to the share.
    let (std, by_y, by_share) = match kind {
        0 => (share * y.abs(), share * y.signum(), y.abs()),
        1 => (floor + share * y.abs(), share * y.signum(), y.abs()),
        2 => {
            let std = floor.hypot(share * y);
            (std, share * share * y / std, share * y * y / std)
        }
        _ => (share, 0.0, 1.0),
    };
    let size = start.max(less).max(1.0);
    draft.at("y", until, y, size);
    draft.at("std(y)", until, std, size);
    // Not near the corner at zero.
    if y.abs() > 1e-3 * size {
        draft.at("d(std(y))/d(rate)", until, by_y * slope, size * until);
        draft.at("d(std(y))/d(share)", until, by_share, size);
    }
}
