//! Section 3.5: the subsea pump's head.

use dgd_identify::regression::{RegressionFit, RegressionMethod};
use dgd_plot::{MathText, PointLabel};

use crate::chapters::Fallible;
use crate::claims::claim;
use crate::field::{Field, LPM};
use crate::friction::{Polynomial, at, fitted, quality, steady};
use crate::model::{Choices, Model};
use crate::page::{
    Finding, Section, computed, input, less, measured, over, over_time, panel, per, points, rms,
};
use crate::verification::FLOW;

/// Speeds that are drawn, of maximum; samples within half a per cent of one belong to it.
const SPEEDS: [f64; 6] = [0.45, 0.52, 0.6, 0.7, 0.8, 0.9];

/// Flows that belong together at one speed differ by less than this, m³/s.
const CLUSTER: f64 = 100.0 * LPM;

/// c0 ω^k − c2 q².
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pump {
    pub(crate) c0: f64,
    pub(crate) k: f64,
    pub(crate) c2: f64,
}

impl Pump {
    fn head(self, w: f64, q: f64) -> f64 {
        self.c0 * w.powf(self.k) - self.c2 * q * q
    }

    fn of(model: &Model, fit: &RegressionFit) -> Fallible<Pump> {
        let value =
            |name: &str| Ok::<f64, Box<dyn std::error::Error>>(fit.p[model.parameter(name)?]);
        Ok(Pump { c0: value("c0")?, k: value("k")?, c2: value("c2")? })
    }
}

/// Steady readings of speed, rad/s over that of full speed, flow, m³/s, and head, m.
struct Readings {
    w: Vec<f64>,
    q: Vec<f64>,
    head: Vec<f64>,
}

impl Readings {
    fn columns(&self) -> [(&str, &[f64]); 3] {
        [("w_ssp", &self.w), ("q_ssp", &self.q), ("head", &self.head)]
    }

    /// Those at a speed.
    fn near(&self, speed: f64) -> Vec<usize> {
        (0..self.w.len()).filter(|k| (self.w[*k] - speed).abs() < 0.005).collect()
    }

    /// How far a head is off at a speed on average, of the head there.
    fn miss(&self, speed: f64, head: impl Fn(f64, f64) -> f64) -> f64 {
        self.off(speed, |k| (head(self.w[k], self.q[k]) - self.head[k]).abs())
    }

    /// The same with its sign.
    fn bias(&self, speed: f64, head: impl Fn(f64, f64) -> f64) -> f64 {
        self.off(speed, |k| head(self.w[k], self.q[k]) - self.head[k])
    }

    fn off(&self, speed: f64, error: impl Fn(usize) -> f64) -> f64 {
        let samples = self.near(speed);
        let head: f64 = samples.iter().map(|k| self.head[*k]).sum();
        samples.into_iter().map(error).sum::<f64>() / head
    }

    /// Only those at speeds at which the pump was tried with three flows or more (section 3.5.1).
    fn filtered(&self) -> Readings {
        let kept: Vec<usize> = SPEEDS
            .iter()
            .map(|speed| self.near(*speed))
            .filter(|samples| {
                let mut flows = at(&self.q, samples);
                flows.sort_by(f64::total_cmp);
                1 + flows.windows(2).filter(|pair| pair[1] - pair[0] > CLUSTER).count() >= 3
            })
            .flatten()
            .collect();
        Readings { w: at(&self.w, &kept), q: at(&self.q, &kept), head: at(&self.head, &kept) }
    }
}

fn load(law: &str, free: &[&str]) -> Fallible<Model> {
    let variants = [("law", law)];
    let choices = Choices { variants: &variants, free, ..Choices::default() };
    Model::load("examples/thesis/pump_head.dgd", &choices)
}

/// Head over flow at each speed: readings and curves.
fn characteristics(readings: &Readings, head: impl Fn(f64, f64) -> f64) -> dgd_plot::Figure {
    let mut series = Vec::new();
    let most = readings.q.iter().fold(0.0, |a: f64, b| a.max(*b));
    let grid: Vec<f64> = (0..=60).map(|k| f64::from(k) / 60.0 * most).collect();
    let mut tried = (Vec::new(), Vec::new());
    for speed in SPEEDS {
        for k in readings.near(speed) {
            tried.0.push(readings.q[k] / LPM);
            tried.1.push(readings.head[k]);
        }
    }
    series.push(points("measured", &tried.0, tried.1.clone()));
    let mut curves = computed("fitted, by speed", &[], Vec::new());
    for speed in SPEEDS {
        let heads: Vec<f64> = grid.iter().map(|q| head(speed, *q)).collect();
        let (x, y) = (most / LPM, heads[heads.len() - 1]);
        curves.labels.push(PointLabel {
            x,
            y,
            text: MathText::plain(&format!("{:.0} %", 100.0 * speed)),
        });
        curves.x.extend(per(&grid, LPM).into_iter().chain([f64::NAN]));
        curves.y.extend(heads.into_iter().chain([f64::NAN]));
    }
    series.push(curves);
    over("Return flow", "lpm", vec![panel("Head", "m", series)])
}

/// Figs 3.8 to 3.10 and 3.24, and the pump of section 3.5.1.
pub(crate) fn identify(
    tests: &Field,
    circulation: &Field,
    friction: &Polynomial,
) -> Fallible<(Section, Pump)> {
    let steady = steady(tests);
    let readings = Readings {
        w: at(tests.column("w_ssp"), &steady),
        q: at(tests.column("q_ssp"), &steady),
        head: at(&tests.head(), &steady),
    };

    let original = load("original", &["c0", "c1", "c2"])?;
    let free = fitted(&original, &readings.columns(), RegressionMethod::LeastSquares)?;
    let bounded = fitted(&original, &readings.columns(), RegressionMethod::Bounded)?;
    let c1 = original.parameter("c1")?;
    let of_square = Pump { k: 2.0, ..Pump::of(&original, &bounded)? };
    let (r_squared, mse) = quality(&bounded);
    let slowest = readings.miss(SPEEDS[0], |w, q| of_square.head(w, q));
    let bias = readings.bias(SPEEDS[0], |w, q| of_square.head(w, q));
    let claims = vec![
        claim(
            free.p[c1] < 0.0,
            "c1 by least squares is infeasible",
            "negative",
            format!("{:.0} s/m²", free.p[c1]),
        ),
        claim(
            bounded.p[c1] == 0.0,
            "c1 with c ≥ 0 is driven to its bound",
            "0",
            format!("{}", bounded.p[c1]),
        ),
        claim(
            (0.95..0.995).contains(&r_squared),
            "What is left then fits only roughly",
            "R² 0.9602",
            format!("R² {r_squared:.4}"),
        ),
        claim(
            slowest > 0.05 && bias.abs() > 0.9 * slowest,
            "Low speeds fit badly",
            "the curves of low speeds are off",
            format!(
                "{:.1} % of the head off at 45 % speed, {:.1} % to one side",
                100.0 * slowest,
                100.0 * bias.abs()
            ),
        ),
    ];
    let first = Finding {
        number: "3.8",
        title: "The pump's characteristics by c0 ω² − c1 ω q − c2 q²",
        thesis: "Least squares give c1 < 0, which is infeasible; with c ≥ 0 it is c1 = 0, R² 0.9602, MSE 213 m². Low speeds do not fit.",
        here: format!(
            "Least squares give c1 = {:.0} s/m², with R² {:.4}; within the bounds c1 = 0, R² {r_squared:.4}, MSE {mse:.2} m².",
            free.p[c1],
            quality(&free).0
        ),
        claims,
        figure: characteristics(&readings, |w, q| of_square.head(w, q)),
    };

    let revised = load("revised", &["c0", "c2", "k"])?;
    let simplex = fitted(&revised, &readings.columns(), RegressionMethod::NelderMead)?;
    let projected = fitted(&revised, &readings.columns(), RegressionMethod::VariableProjection)?;
    let pump = Pump::of(&revised, &simplex)?;
    let other = Pump::of(&revised, &projected)?;
    let (r_squared_k, mse_k) = quality(&simplex);
    let worst = SPEEDS
        .map(|speed| readings.miss(speed, |w, q| pump.head(w, q)))
        .into_iter()
        .fold(0.0, f64::max);
    let claims = vec![
        claim(
            mse > 10.0 * mse_k,
            "A free exponent cuts the MSE by more than ten",
            "from 213 to 4.754 m², 45 times",
            format!("from {mse:.1} to {mse_k:.3} m², {:.0} times", mse / mse_k),
        ),
        claim(
            worst < 0.02 && r_squared_k > 0.999,
            "All speeds fit",
            "R² 0.9991",
            format!("R² {r_squared_k:.5}, at most {:.1} % of the head off", 100.0 * worst),
        ),
        claim(
            (pump.k / other.k - 1.0).abs() < 1e-4 && (pump.k - 2.0).abs() > 0.05,
            "The exponent is another than 2, by two methods",
            "not printed",
            format!("{:.5} and {:.5}", pump.k, other.k),
        ),
    ];
    let second = Finding {
        number: "3.9",
        title: "The pump's characteristics by c0 ω^k − c2 q²",
        thesis: "Nelder and Mead's method on k over the inner least squares: R² 0.9991, MSE 4.754 m².",
        here: format!(
            "k = {:.3} by Nelder and Mead's method, {:.3} by variable projection; R² {r_squared_k:.5}, MSE {mse_k:.3} m², {:.0} times less.",
            pump.k,
            other.k,
            mse / mse_k
        ),
        claims,
        figure: characteristics(&readings, |w, q| pump.head(w, q)),
    };

    let filtered = readings.filtered();
    let fit = fitted(&revised, &filtered.columns(), RegressionMethod::NelderMead)?;
    let pump_filtered = Pump::of(&revised, &fit)?;
    let (r_squared, mse) = quality(&fit);
    let claims = vec![
        claim(
            r_squared < r_squared_k && mse < mse_k && mse > 0.3 * mse_k,
            "R² and the MSE both fall a little",
            "0.9991 to 0.9988, 4.754 to 4.412 m²",
            format!("{r_squared_k:.5} to {r_squared:.5}, {mse_k:.3} to {mse:.3} m²"),
        ),
        claim(
            filtered.w.len() < readings.w.len() && (pump_filtered.c2 / pump.c2 - 1.0).abs() < 0.1,
            "The pump is nearly the same",
            "c2 slightly lower",
            format!("c2 {:.0} for {:.0} s²/m⁵", pump_filtered.c2, pump.c2),
        ),
    ];
    let third = Finding {
        number: "3.10",
        title: "The same, from speeds with three clusters of flow or more",
        thesis: "R² 0.9988, MSE 4.4118 m²; in use it is worse at low flows.",
        here: format!(
            "k = {:.3}, R² {r_squared:.5}, MSE {mse:.3} m², from {} of {} steady samples. The form is exact here, so that the speeds that are left out change little.",
            pump_filtered.k,
            filtered.w.len(),
            readings.w.len()
        ),
        claims,
        figure: characteristics(&filtered, |w, q| pump_filtered.head(w, q)),
    };

    let fourth = compared(circulation, friction, pump, pump_filtered)?;
    let findings = vec![first, second, third, fourth];
    Ok((Section { title: "3.5 The subsea pump", findings }, pump))
}

/// Fig 3.24: the flow that each of two pumps gives, levels being measured.
fn compared(field: &Field, friction: &Polynomial, all: Pump, filtered: Pump) -> Fallible<Finding> {
    let (t, q) = (&field.times, field.column("q_ssp"));
    let flow = |pump: Pump| -> Fallible<Vec<f64>> {
        let model = crate::inertia::return_flow(friction, &pump, 5e7)?;
        let recording = model.recording(t, &field.columns(), &[("q_ssp", q[0])])?;
        model.run(&recording)?.unknown("q_ssp")
    };
    let (with_all, with_filtered) = (flow(all)?, flow(filtered)?);
    let off = |flow: &[f64]| rms(&less(flow, q)) / LPM;
    let (of_all, of_filtered) = (off(&with_all), off(&with_filtered));
    let claims = vec![
        claim(
            of_filtered > of_all,
            "In use the pump of filtered data is the worse one",
            "clearly worse at low flow",
            format!("{of_filtered:.2} and {of_all:.2} lpm off, root mean square"),
        ),
        claim(
            of_all < 0.02 * FLOW / LPM,
            "That of all data follows the flow",
            "follows",
            format!(
                "within {:.1} % of {:.0} lpm, root mean square",
                100.0 * of_all * LPM / FLOW,
                FLOW / LPM
            ),
        ),
    ];
    Ok(Finding {
        number: "3.24",
        title: "Two identified pumps in use",
        thesis: "The pump from filtered data gives a flow that is worse at low flows.",
        here: format!(
            "The flow is off by {of_all:.1} lpm with all steady samples and by {of_filtered:.1} lpm with the filtered ones, root mean square."
        ),
        claims,
        figure: over_time(vec![
            panel(
                "Return flow",
                "lpm",
                vec![
                    measured("measured", t, per(q, LPM)),
                    computed("all steady samples", t, per(&with_all, LPM)),
                    computed("filtered", t, per(&with_filtered, LPM)),
                ],
            ),
            panel(
                "Speed of the pump",
                "%",
                vec![input(0, "reference", t, per(field.column("w_ssp"), 0.01))],
            ),
        ]),
    })
}
