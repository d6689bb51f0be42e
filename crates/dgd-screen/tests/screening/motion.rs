//! Steady periods, transients, operating points and balances of known records.

use dgd_screen::balance::{Balance, ImbalanceCause, imbalance};
use dgd_screen::{Channel, ScreenOptions, ScreenedRecord, Screening, sampling, screen};

use crate::support::{Normal, seconds};

/// A flow that stays at 1000, 2000 and 1000 again, with ramps of 60 s in between.
fn flow(k: usize) -> f64 {
    let ramp = |at: f64| ((k as f64 - at) / 60.0).clamp(0.0, 1.0);
    1000.0 + 1000.0 * (ramp(1200.0) - ramp(2400.0))
}

fn screened(values: &[f64]) -> Screening {
    let times = seconds(values.len());
    let channels = vec![Channel { name: "q", unit: "lpm", values }];
    screen(&ScreenedRecord { times: &times, channels }, &ScreenOptions::default())
}

#[test]
fn rest_and_motion_are_told_apart() {
    for seed in 0..20 {
        let mut normal = Normal::new(seed);
        let values: Vec<f64> = (0..3600).map(|k| flow(k) + 10.0 * normal.next()).collect();
        let screening = screened(&values);
        let motion = &screening.motion;
        assert_eq!(motion.steady.len(), 3, "seed {seed}: {:?}", motion.steady);
        assert_eq!(motion.transients.len(), 2, "seed {seed}: {:?}", motion.transients);
        for (steady, truth) in motion.steady.iter().zip([1000.0, 2000.0, 1000.0]) {
            let mean = steady.means[0].expect("many samples");
            // Five standard errors, plus the remainder of a ramp at the ends.
            assert!((mean.value - truth).abs() < 5.0 * mean.std_error + 1.0, "{mean:?}");
        }
        for (transient, from) in motion.transients.iter().zip([1200.0, 2400.0]) {
            assert!((transient.stretch.from - from).abs() < 30.0, "{transient:?}");
            assert!((transient.stretch.until - from - 60.0).abs() < 30.0, "{transient:?}");
            let (_, before, after) = transient.changes[0];
            assert!(((after - before).abs() - 1000.0).abs() < 150.0, "{transient:?}");
        }
        let points: Vec<Vec<usize>> =
            screening.points.iter().map(|point| point.stretches.clone()).collect();
        assert_eq!(points, [vec![0, 2], vec![1]], "seed {seed}");
    }
}

#[test]
fn rest_and_motion_are_the_same_at_any_rate() {
    let mut normal = Normal::new(1);
    let values: Vec<f64> = (0..3600).map(|k| flow(k) + 10.0 * normal.next()).collect();
    let steady = |spacing: f64| -> Vec<[f64; 2]> {
        let times: Vec<f64> = (0..3600).map(|k| f64::from(k) * spacing).collect();
        let channels = vec![Channel { name: "q", unit: "lpm", values: &values }];
        let screening =
            screen(&ScreenedRecord { times: &times, channels }, &ScreenOptions::default());
        let steady = screening.motion.steady.iter();
        steady.map(|one| [one.stretch.from / spacing, one.stretch.until / spacing]).collect()
    };
    let plain = steady(1.0);
    // Powers of two, so that times differ only in their exponents.
    for spacing in [1.0 / 128.0, 512.0] {
        assert_eq!(steady(spacing), plain, "a reading in {spacing} s");
    }
}

#[test]
fn gaps_and_uneven_spacing_are_counted() {
    let mut times: Vec<f64> = (0..1000).map(f64::from).collect();
    for t in &mut times[500..] {
        *t += 60.0;
    }
    let found = sampling(&times);
    assert_eq!(found.gaps.len(), 1);
    assert_eq!((found.gaps[0].from, found.gaps[0].until), (499.0, 560.0));
    assert_eq!((found.usual, found.uneven), (Some(1.0), 0.0));
    let uneven: Vec<f64> = (0..1000).map(|k| f64::from(k) + 0.3 * f64::from(k % 2)).collect();
    // The median spacing is one of the two.
    assert!(sampling(&uneven).uneven > 0.4);
}

/// The measured level of a tank with two flows, A ẋ = q_in − q_out.
struct Tank {
    level: Vec<f64>,
    rate: Vec<f64>,
    shares: Vec<Vec<f64>>,
}

const AREA: f64 = 200.0;

/// `gain` multiplies the reading of the outflow, `late` is its lag, s.
fn tank(seed: u64, gain: f64, late: f64) -> Tank {
    let n: usize = 3600;
    let mut normal = Normal::new(seed);
    let out = |t: f64| 30.0 + 12.0 * (t / 90.0).sin() + 5.0 * (t / 31.0).cos();
    let inflow = |t: f64| 30.0 + 8.0 * (t / 57.0).cos();
    let (mut x, mut level) = (50.0, Vec::new());
    for k in 0..n {
        level.push(x + 0.005 * normal.next());
        // Simpson's rule over a second.
        let t = k as f64;
        let net = |t: f64| inflow(t) - out(t);
        x += (net(t) + 4.0 * net(t + 0.5) + net(t + 1.0)) / 6.0 / AREA;
    }
    let reads: Vec<f64> =
        (0..n).map(|k| gain * out(k as f64 - late) + 0.3 * normal.next()).collect();
    let fills: Vec<f64> = (0..n).map(|k| inflow(k as f64)).collect();
    let rate = reads.iter().zip(&fills).map(|(out, fill)| (fill - out) / AREA).collect();
    let share = |sign: f64, flow: &[f64]| flow.iter().map(|q| sign * q / AREA).collect();
    let shares = vec![share(-1.0, &reads), share(1.0, &fills)];
    Tank { level, rate, shares }
}

#[test]
fn a_balance_tells_a_gain_from_a_delay_and_claims_nothing_where_nothing_is_wrong() {
    let times = seconds(3600);
    let mut false_claims = 0;
    for seed in 0..50 {
        let of = |tank: &Tank| {
            let balance = Balance {
                times: &times,
                unknown: &tank.level,
                rate: &tank.rate,
                shares: &tank.shares,
            };
            imbalance(&balance).expect("an hour")
        };
        let sound = of(&tank(seed, 1.0, 0.0));
        false_claims += usize::from(sound.drift.p_value() < dgd_screen::RARE);

        // The true value is the reading divided by `gain`: the share should be multiplied by 1 + size = 1/1.05.
        let gain = of(&tank(seed, 1.05, 0.0));
        assert!(gain.drift.p_value() < dgd_screen::RARE, "seed {seed}");
        let best = &gain.explanations[0];
        assert_eq!(best.cause, ImbalanceCause::Gain(0), "seed {seed}: {:?}", gain.explanations);
        let error = best.size.value - (1.0 / 1.05 - 1.0);
        assert!(error.abs() < 4.0 * best.size.std_error.max(2e-4), "{best:?}");

        let late = of(&tank(seed, 1.0, 3.0));
        let best = &late.explanations[0];
        assert_eq!(best.cause, ImbalanceCause::Lag(0), "seed {seed}: {:?}", late.explanations);
        assert!((best.size.value - 3.0).abs() < 0.3, "{best:?}");
    }
    assert_eq!(false_claims, 0);
}
