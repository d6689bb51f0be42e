//! Taylor series of solutions, recurrence by recurrence.

use dgd_compiler::program::{
    ConstantFactor, MatrixEntry, Program, Recurrence, SharedSeries, ValueId,
};
use dgd_runtime::taylor::{self, MOST_ORDER, SeriesTerms};

/// Inputs of the computation of series, and their destinations.
pub(crate) struct SeriesComputation<'a> {
    /// Inputs' slopes.
    pub(crate) udot: &'a [f64],
    pub(crate) h: f64,
    pub(crate) order: usize,
    pub(crate) kept: &'a mut [SeriesTerms],
    pub(crate) y: &'a mut [f64],
    /// Series of the sensitivities, with order 0 given; empty without sensitivities.
    pub(crate) s: &'a mut [f64],
}

/// Extends series from their initial values, `fixed`; `now` is work space for the coefficients of one order.
pub(crate) fn expand(
    program: &Program,
    series: &SharedSeries,
    fixed: &[f64],
    now: &mut [f64],
    expansion: &mut SeriesComputation<'_>,
) {
    let (n, n_s) = (program.n(), program.signature.directions.len());
    let has_sensitivities = !expansion.s.is_empty();
    now[..fixed.len()].copy_from_slice(fixed);
    keep(series, now, 0, expansion.kept);
    let coefficient = |now: &[f64], value: ValueId, k: usize| {
        if k == 0 || series.moves(value) { now[value.index()] } else { 0.0 }
    };
    for k in 0..expansion.order {
        if k > 0 {
            for (i, recurrence) in series.recurrences.iter().enumerate() {
                if let Some(recurrence) = recurrence {
                    let kept = series.kept[i];
                    now[i] = continued(
                        *recurrence,
                        kept,
                        OrderValues { series, fixed, now },
                        k,
                        expansion,
                    );
                    if let Some(kept) = kept {
                        taylor::keep(&mut expansion.kept[kept], k, now[i]);
                    }
                }
            }
        }
        let per = expansion.h / (k + 1) as f64;
        for (i, f) in series.f.iter().enumerate() {
            expansion.y[(k + 1) * n + i] = per * coefficient(now, *f, k);
        }
        if !has_sensitivities {
            continue;
        }
        for i in 0..n {
            for j in 0..n_s {
                let mut g = 0.0;
                for MatrixEntry { column, value, .. } in
                    series.jacobian.iter().filter(|e| e.row == i)
                {
                    let place = |order: usize| (order * n + column) * n_s + j;
                    match series.kept[value.index()].filter(|_| series.moves(*value)) {
                        Some(own) if k > 0 => {
                            let mut lane: SeriesTerms = [0.0; MOST_ORDER + 1];
                            for (order, lane) in lane.iter_mut().enumerate().take(k + 1) {
                                *lane = expansion.s[place(order)];
                            }
                            g += taylor::multiply(&expansion.kept[own], &lane, k);
                        }
                        _ => g += fixed[value.index()] * expansion.s[place(k)],
                    }
                }
                for MatrixEntry { column, value, .. } in
                    series.directions.iter().filter(|e| e.row == i)
                {
                    if *column == j && (k == 0 || series.moves(*value)) {
                        g += now[value.index()];
                    }
                }
                expansion.s[((k + 1) * n + i) * n_s + j] = per * g;
            }
        }
    }
}

fn keep(series: &SharedSeries, now: &[f64], k: usize, kept: &mut [SeriesTerms]) {
    for (own, value) in series.kept.iter().zip(now) {
        if let Some(own) = own {
            taylor::keep(&mut kept[*own], k, *value);
        }
    }
}

/// Values of one order, and the storage of their series.
#[derive(Clone, Copy)]
struct OrderValues<'a> {
    series: &'a SharedSeries,
    fixed: &'a [f64],
    now: &'a [f64],
}

/// The coefficient of order k of a value.
fn continued(
    recurrence: Recurrence,
    own: Option<usize>,
    values: OrderValues<'_>,
    k: usize,
    expansion: &SeriesComputation<'_>,
) -> f64 {
    let OrderValues { series, fixed, now } = values;
    let kept = |value: ValueId| -> &SeriesTerms {
        let number = series.kept[value.index()];
        &expansion.kept[number.unwrap_or_else(|| unreachable!("what is read is kept"))]
    };
    let itself = || -> &SeriesTerms {
        &expansion.kept[own.unwrap_or_else(|| unreachable!("what reads itself is kept"))]
    };
    let now = |value: ValueId| now[value.index()];
    let fixed = |value: ValueId| fixed[value.index()];
    match recurrence {
        Recurrence::Time => taylor::line(expansion.h, k),
        Recurrence::Input(i) => taylor::line(expansion.h * expansion.udot[i as usize], k),
        Recurrence::Unknown(i) => expansion.y[k * series.f.len() + i as usize],
        Recurrence::Linear { first, count } => {
            let terms = series.terms[first..first + count].iter().map(|(factor, a)| match factor {
                ConstantFactor::One => now(*a),
                ConstantFactor::MinusOne => -now(*a),
                ConstantFactor::Of(c) => fixed(*c) * now(*a),
            });
            terms.reduce(|sum, term| sum + term).unwrap_or(0.0)
        }
        Recurrence::Multiply(a, b) => taylor::multiply(kept(a), kept(b), k),
        Recurrence::Square(a) => taylor::square(kept(a), k),
        Recurrence::MultiplyLine(a, b) => taylor::multiply_line(kept(a), kept(b), k),
        Recurrence::Divide(a, b, reciprocal) => {
            taylor::divide(a.map_or(0.0, now), kept(b), itself(), fixed(reciprocal), k)
        }
        Recurrence::Chain(x, d) => taylor::chain(kept(x), kept(d), k),
        Recurrence::Root(a, half) => taylor::root(now(a), itself(), fixed(half), k),
        Recurrence::Log(a, reciprocal) => taylor::log(kept(a), itself(), fixed(reciprocal), k),
        Recurrence::Power(a, exponent, reciprocal) => {
            taylor::power(kept(a), itself(), fixed(exponent), fixed(reciprocal), k)
        }
        Recurrence::Magnitude(a) => taylor::magnitude(kept(a), k),
        Recurrence::Select(c, a, b) => (if fixed(c) == 0.0 { b } else { a }).map_or(0.0, now),
    }
}
