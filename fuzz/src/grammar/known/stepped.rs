//! Loops of step functions: each row has its own ramp, integrated and differentiated in closed form.

use super::Draft;

pub(super) fn write(draft: &mut Draft) {
    let n = *draft.random.pick(&[2, 3, 5]);
    let rates: Vec<f64> = (0..n).map(|_| draft.number(0.5, 3.0, 2)).collect();
    let lev = draft.number(0.3, 1.2, 2);
    draft.until = draft.number(2.0, 6.0, 2);
    let until = draft.until;
    let list: Vec<String> = rates.iter().map(f64::to_string).collect();
    draft.item(format!("size N = {n}"));
    draft.item(format!("parameter k[1..N] [1/s] = ({})", list.join(", ")));
    draft.item(format!("parameter lev = {lev}"));
    draft.item("state x[1..N] = 0");
    draft.item("state y[1..N] = 0");
    let kind = draft.random.below(4);
    let step = match kind {
        0 => "floor(x[i]/lev)",
        1 => "if x[i] > lev then 2 else 0.5",
        2 => "mod(x[i], lev)",
        _ => "max(x[i] - lev, 0)",
    };
    draft.item(format!(
        "for i in 1..N {{\n  equation x[i]: der(x[i]) = k[i]\n  equation y[i]: der(y[i]) = ({step})/1 [s]\n}}"
    ));
    draft.item("output y");
    for (i, k) in rates.iter().enumerate() {
        // The value, and its derivatives with respect to lev and to the row's own rate.
        let steps = (k * until / lev).floor();
        if (k * until / lev - steps).min(steps + 1.0 - k * until / lev) < 0.02 {
            continue;
        }
        let time_of = |m: f64| m * lev / k;
        let each = |f: &dyn Fn(f64) -> f64| (1..=steps as u64).map(|m| f(m as f64)).sum::<f64>();
        let counted =
            [each(&|m| until - time_of(m)), -each(&|m| m / k), each(&|m| m * lev / (k * k))];
        let passed = steps >= 1.0;
        let [value, by_lev, by_k] = match kind {
            0 => counted,
            1 if passed => {
                [2.0 * (until - time_of(1.0)) + 0.5 * time_of(1.0), -1.5 / k, 1.5 * lev / (k * k)]
            }
            1 => [0.5 * until, 0.0, 0.0],
            // x − lev·floor(x/lev)
            2 => [
                0.5 * k * until * until - lev * counted[0],
                -counted[0] - lev * counted[1],
                0.5 * until * until - lev * counted[2],
            ],
            _ if passed => {
                let left = until - time_of(1.0);
                [0.5 * k * left * left, -left, 0.5 * left * left + lev / k * left]
            }
            _ => [0.0, 0.0, 0.0],
        };
        let name = format!("y[{}]", i + 1);
        let size = until.max(value.abs());
        draft.at(&name, until, value, size);
        draft.at(&format!("d({name})/d(lev)"), until, by_lev, size / lev + by_lev.abs());
        let derivative = format!("d({name})/d(k[{}])", i + 1);
        draft.at(&derivative, until, by_k, size / k + by_k.abs());
    }
}
