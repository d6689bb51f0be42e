//! Times at equal error.

use crate::catalogue::Case;
use crate::measure::Row;

/// The time in which a peer reaches an error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Reach {
    /// Interpolated between two tolerances.
    Between(f64),
    /// All results are more accurate, the cheapest with this error: a looser tolerance might take less.
    AtMost(f64, f64),
}

impl Reach {
    /// Seconds.
    pub(crate) fn seconds(self) -> f64 {
        match self {
            Self::Between(time) | Self::AtMost(time, _) => time,
        }
    }
}

/// The time in which the peer's best method, or the given one, reaches the case's error; `None` if no method does.
pub(crate) fn best(
    rows: &[Row],
    case: &str,
    peer: &str,
    method: Option<&str>,
) -> Option<(Reach, &'static str)> {
    rows.iter()
        .filter(|row| row.case.name == case && row.peer == peer)
        .filter(|row| method.is_none_or(|method| method == row.method))
        .filter_map(|row| Some((reach(row)?, row.method)))
        .min_by(|(a, _), (b, _)| a.seconds().total_cmp(&b.seconds()))
}

/// The time in which a method reaches the case's error.
///
/// ln time is linear in ln error between neighbours; a method may be faster at a tighter tolerance.
pub(crate) fn reach(row: &Row) -> Option<Reach> {
    let Case { equal_error, .. } = row.case;
    let points = row.cells.iter().filter_map(|cell| cell.as_ref().ok());
    let mut points: Vec<(f64, f64)> = points.map(|cell| (cell.error, cell.least)).collect();
    points.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
    let mut shortest: Option<Reach> = None;
    let mut take = |reach: Reach| {
        if shortest.is_none_or(|shortest| reach.seconds() < shortest.seconds()) {
            shortest = Some(reach);
        }
    };
    for pair in points.windows(2) {
        let ((error, time), (next_error, next_time)) = (pair[0], pair[1]);
        if error > *equal_error && next_error <= *equal_error {
            let part = (error / equal_error).ln() / (error / next_error).ln();
            take(Reach::Between((time.ln() + part * (next_time / time).ln()).exp()));
        }
    }
    for (error, time) in &points {
        if error <= equal_error {
            take(Reach::AtMost(*time, *error));
        }
    }
    shortest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::CASES;
    use crate::measure::Cell;

    fn row(points: &[(f64, f64)]) -> Row {
        let case = CASES.iter().find(|case| case.name == "p1a").expect("a case");
        let cells =
            points.iter().map(|(error, least)| Ok(Cell::new(*least, *least, 1, *error))).collect();
        Row { case, peer: "a", method: "b", cells }
    }

    #[test]
    fn between_two_tolerances_the_logarithms_are_linear() {
        // The midpoint of 1e-5 and 1e-7 is 1e-6, that of 1 s and 100 s is 10 s.
        let Some(Reach::Between(time)) = reach(&row(&[(1e-5, 1.0), (1e-7, 100.0)])) else {
            panic!("not between")
        };
        assert!((time - 10.0).abs() < 1e-12, "{time}");
    }

    #[test]
    fn what_is_more_accurate_throughout_takes_at_most_its_least_time() {
        assert_eq!(reach(&row(&[(1e-7, 3.0), (1e-8, 5.0)])), Some(Reach::AtMost(3.0, 1e-7)));
    }

    #[test]
    fn what_is_never_that_accurate_is_not_compared() {
        assert_eq!(reach(&row(&[(1e-3, 3.0), (1e-4, 5.0)])), None);
    }
}
