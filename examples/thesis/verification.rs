//! Chapter 4: both states from the pump's speed and the inflows alone; and Fig 3.23.

use dgd_plot::Panel;

use crate::booster::Booster;
use crate::chapters::Fallible;
use crate::claims::claim;
use crate::field::{Field, LPM, mean, slopes, smoothed};
use crate::friction::Polynomial;
use crate::model::{Choices, Model, Run};
use crate::page::{
    Finding, Section, computed, ends, input, less, measured, over_time, panel, per, rms,
};
use crate::pump::Pump;

/// Scales of the thesis' per cent: of a level, on which 0.5 bar are less than 0.4 %, m; and of a flow,
/// m³/s.
pub(crate) const LEVEL: f64 = 1140.0;
pub(crate) const FLOW: f64 = 4500.0 * LPM;

/// What was identified in chapter 3.
pub(crate) struct Identified {
    pub(crate) friction: Polynomial,
    pub(crate) pump: Pump,
    pub(crate) theta_1: f64,
    pub(crate) booster: Booster,
    /// M_ssp of readings, kg/m⁴.
    pub(crate) inertia: f64,
}

/// What is known of the booster line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Line {
    /// Nothing.
    None,
    /// What comes out of it, 3.13 and 3.14.
    Outlet,
}

impl Identified {
    /// The final model; or, without what the booster line does, the reduced model with the effects that
    /// the thesis found before.
    fn model(&self, flow: &str, line: Line) -> Fallible<Model> {
        let Identified { friction: [f1, f2, f3, f4], pump, theta_1, booster, inertia } = *self;
        let variants = [("flow", flow)];
        if line == Line::Outlet {
            let choices = Choices { variants: &variants, ..Choices::default() };
            return Model::load("models/mud_circulation_u_tubing.dgd", &choices)?.with(&[
                ("theta_1", theta_1),
                ("M_ssp", inertia),
                ("c0", pump.c0),
                ("k", pump.k),
                ("c2", pump.c2),
                ("F1", f1),
                ("F2", f2),
                ("F3", f3),
                ("F4", f4),
                ("tau_d", booster.tau_d),
                ("tau_b", booster.tau_b),
                ("theta_i", booster.theta_i),
            ]);
        }
        let effects = [
            "models/effects/pump_speed_exponent.dgd",
            "models/effects/friction_higher_order.dgd",
            "models/effects/flow_meter_gain.dgd",
        ];
        let choices = Choices { variants: &variants, effects: &effects, ..Choices::default() };
        // Its flows are true ones, θ₁ times the readings that pump and friction were identified with.
        Model::load("models/mud_circulation.dgd", &choices)?.with(&[
            ("flow_gain", 1.0 / theta_1),
            ("M_ssp", inertia / theta_1),
            ("c0", pump.c0),
            ("speed_exponent", pump.k),
            ("c2", pump.c2 / theta_1.powi(2)),
            ("F1", f1 / theta_1),
            ("F2", f2 / theta_1.powi(2)),
            ("F3", f3 / theta_1.powi(3)),
            ("F4", f4 / theta_1.powi(4)),
        ])
    }

    fn run(&self, field: &Field, flow: &str, line: Line) -> Fallible<Case> {
        let model = self.model(flow, line)?;
        let level = field.level();
        let start = mean(&level[..30]);
        let recording = model.recording(&field.times, &field.columns(), &[("h_r", start)])?;
        let run = model.run(&recording)?;
        // Of the reading's own noise little is left in the mean of eleven.
        let level_error = less(&run.unknown("h_r")?, &smoothed(&level, 5));
        let flow_error = less(&run.output("q_ssp")?, &smoothed(field.column("q_ssp"), 5));
        Ok(Case { level_error, flow_error, run })
    }
}

/// A simulation of both states, and how far it is off.
struct Case {
    /// Computed less read, m.
    level_error: Vec<f64>,
    /// Computed less read, m³/s.
    flow_error: Vec<f64>,
    run: Run,
}

impl Case {
    /// Largest errors of level and flow, shares of their scales.
    fn largest(&self) -> [f64; 2] {
        let most = |errors: &[f64]| errors.iter().fold(0.0, |most: f64, e| most.max(e.abs()));
        [most(&self.level_error) / LEVEL, most(&self.flow_error) / FLOW]
    }

    fn said(&self) -> String {
        let [level, flow] = self.largest();
        format!(
            "the level is off by up to {:.3} % ({:.2} m) and the flow by up to {:.1} %",
            100.0 * level,
            level * LEVEL,
            100.0 * flow
        )
    }
}

/// Panels as in Figs 4.1, 4.2 and B.1.
fn panels(field: &Field, cases: &[(&str, &Case)]) -> Fallible<Vec<Panel>> {
    let t = &field.times;
    let mut levels = vec![measured("measured", t, field.level())];
    let mut flows = vec![measured("measured", t, per(field.column("q_ssp"), LPM))];
    let (mut level_errors, mut flow_errors) = (Vec::new(), Vec::new());
    for (name, case) in cases {
        levels.push(computed(name, t, case.run.unknown("h_r")?));
        flows.push(computed(name, t, per(&case.run.output("q_ssp")?, LPM)));
        level_errors.push(computed(name, t, per(&case.level_error, LEVEL / 100.0)));
        flow_errors.push(computed(name, t, per(&case.flow_error, FLOW / 100.0)));
    }
    Ok(vec![
        panel("Riser level", "m", levels),
        panel("Its error", "%", level_errors),
        panel("Return flow", "lpm", flows),
        panel("Its error", "%", flow_errors),
    ])
}

/// The booster's flow, as calculated of its pump and out of its line.
fn booster_flow(field: &Field, cases: &[(&str, &Case)]) -> Fallible<Panel> {
    let t = &field.times;
    let calculated = per(field.column("q_boost"), LPM);
    let mut series = vec![input(1, "calculated of the pump", t, calculated)];
    for (name, case) in cases {
        series.push(computed(name, t, per(&case.run.unknown("q_bo")?, LPM)));
    }
    Ok(panel("Booster flow", "lpm", series))
}

/// Figs 3.23, 4.1, 4.2 and B.1.
pub(crate) fn draw(
    circulation: &Field,
    restarts: &Field,
    identified: &Identified,
) -> Fallible<Section> {
    let t = &restarts.times;
    let flows =
        |case: &Case| Ok::<_, Box<dyn std::error::Error>>(per(&case.run.output("q_ssp")?, LPM));
    let (case_2, case_static) = (
        identified.run(restarts, "dynamic", Line::Outlet)?,
        identified.run(restarts, "static", Line::Outlet)?,
    );
    let apart = less(&flows(&case_2)?, &flows(&case_static)?);
    let dynamic = flows(&case_2)?;
    let varied: Vec<f64> = dynamic.iter().map(|q| q - mean(&dynamic)).collect();
    let share = (rms(&apart) / rms(&varied)).powi(2);
    let rest = at_rest(t, restarts.column("w_ssp"), &dynamic);
    let steady: Vec<f64> = rest.iter().map(|k| apart[*k]).collect();
    let claims = vec![
        claim(
            share < 0.01,
            "The flow without dynamics is almost the same",
            "almost identical",
            format!("it has all but {:.2} % of the variance", 100.0 * share),
        ),
        claim(
            steady.len() >= 60 && rms(&steady) < 0.1 * rms(&apart),
            "What is off at steady flow is a steady state problem, not one of dynamics",
            "low at low flow, \"a steady state problem\"",
            format!(
                "{} steady samples differ by {:.1} lpm, all by {:.0} lpm",
                steady.len(),
                rms(&steady),
                rms(&apart)
            ),
        ),
    ];
    let rms = rms(&apart);
    let fig_23 = Finding {
        number: "3.23",
        title: "Dynamic and static return flow",
        thesis: "Without its dynamics the flow is nearly identical, a little low at low flow.",
        here: format!(
            "The two differ by {rms:.1} lpm, root mean square: in ramps, where the mud is slow to follow."
        ),
        claims,
        figure: over_time(vec![
            panel(
                "Return flow",
                "lpm",
                vec![
                    measured("measured", t, per(restarts.column("q_ssp"), LPM)),
                    computed("dynamic, 2.33", t, flows(&case_2)?),
                    computed("static, 3.18", t, flows(&case_static)?),
                ],
            ),
            panel("Dynamic less static", "lpm", vec![computed("difference", t, apart)]),
        ]),
    };

    let case_1 = identified.run(circulation, "dynamic", Line::Outlet)?;
    let [level, flow] = case_1.largest();
    let claims = vec![
        claim(
            level < 1e-3,
            "The level is spot on",
            "within ±0.1 % (1.1 m)",
            format!("within {:.3} % ({:.2} m)", 100.0 * level, level * LEVEL),
        ),
        claim(
            flow < 0.05,
            "So is the flow",
            "−5 to 10 %",
            format!("within {:.1} % ({:.0} lpm)", 100.0 * flow, flow * FLOW / LPM),
        ),
    ];
    let fig_41 = Finding {
        number: "4.1",
        title: "Case 1: normal circulation",
        thesis: "Height within ±0.1 % and flow within ±5 % of their scales.",
        here: format!("Simulated from the pump's speed and the inflows alone, {}.", case_1.said()),
        claims,
        figure: over_time(panels(circulation, &[("simulated", &case_1)])?),
    };

    let without = identified.run(restarts, "dynamic", Line::None)?;
    let [with_level, without_level] = [&case_2, &without].map(|case| case.largest()[0]);
    let times = without_level / with_level;
    let (high, low) = ends(&without.level_error);
    let worse = vec![
        claim(
            times > 4.0,
            "Without U-tubing the level is four times as far off or more",
            "five times",
            format!("{times:.1} times"),
        ),
        claim(
            (0.003..0.02).contains(&without_level),
            "The error shows on the scale of the levels",
            "up to 2 %",
            format!("up to {:.2} % ({:.2} m)", 100.0 * without_level, without_level * LEVEL),
        ),
        claim(
            low.max(-high) > 3.0 * low.min(-high),
            "It goes to one side: mud that came out of the line is not counted",
            "0 to 2 %",
            format!("{:.2} to {:.2} %", 100.0 * high / LEVEL, 100.0 * low / LEVEL),
        ),
    ];
    let tied = tied_to_ramps(restarts, &case_2.level_error);
    let small = vec![
        claim(
            with_level < 0.004,
            "The level is within 0.4 %, less than 0.5 bar",
            "−0.2 to 0.4 %",
            format!("within {:.3} % ({:.2} m)", 100.0 * with_level, with_level * LEVEL),
        ),
        claim(
            tied > 0.98,
            "Its larger errors are tied to U-tubing",
            "clearly tied to it",
            format!(
                "{:.1} % of those above 0.03 % lie within five minutes of a ramp",
                100.0 * tied
            ),
        ),
    ];
    let shown = [("3.13, 3.14", &case_2)];
    let mut of_case_2 = panels(restarts, &shown)?;
    of_case_2.push(booster_flow(restarts, &shown)?);
    let fig_42 = Finding {
        number: "4.2",
        title: "Case 2: the booster pump ramped down and up",
        thesis: "Height within −0.2 … 0.4 %, less than 0.5 bar, its error clearly tied to U-tubing.",
        here: format!("With what one stop has taught of 3.13 and 3.14, {}.", case_2.said()),
        claims: small,
        figure: over_time(of_case_2),
    };
    let mut of_none = panels(restarts, &[("simulated", &without)])?;
    of_none.push(booster_flow(restarts, &[])?);
    let fig_b1 = Finding {
        number: "B.1",
        title: "Case 2 without U-tubing",
        thesis: "Height error up to 2 %, five times that with the model of the booster line.",
        here: format!("Without it {}: {times:.1} times that with it.", without.said()),
        claims: worse,
        figure: over_time(of_none),
    };
    let findings = vec![fig_23, fig_41, fig_42, fig_b1];
    Ok(Section { title: "3.8.1, 4 and B: verification", findings })
}

/// Samples since which nothing has been ramped for two minutes: neither the pump's speed nor the flow.
fn at_rest(times: &[f64], speed: &[f64], flow: &[f64]) -> Vec<usize> {
    const STILL: usize = 120;
    let (of_speed, of_flow) = (slopes(times, speed, 10), slopes(times, flow, 10));
    // A change of half a per cent of full speed, or of 30 lpm, in a minute.
    let is_still = |k: usize| of_speed[k].abs() < 0.005 / 60.0 && of_flow[k].abs() < 0.5;
    (STILL..times.len()).filter(|k| (k - STILL..=*k).all(is_still)).collect()
}

/// Of the errors of a level above 0.03 % of its scale, the share in a ramp of the booster pump or within five
/// minutes of one.
fn tied_to_ramps(field: &Field, errors: &[f64]) -> f64 {
    const AFTER: f64 = 300.0;
    let t = &field.times;
    // Faster than 60 lpm in a minute.
    let of_pump = slopes(t, field.column("q_boost"), 5);
    let ramped: Vec<f64> = (0..t.len()).filter(|k| of_pump[*k].abs() > LPM).map(|k| t[k]).collect();
    let large: Vec<f64> =
        (0..t.len()).filter(|k| errors[*k].abs() > 3e-4 * LEVEL).map(|k| t[k]).collect();
    let is_near = |t: f64| {
        let before = ramped.partition_point(|ramp| *ramp <= t);
        before > 0 && t - ramped[before - 1] <= AFTER
    };
    large.iter().filter(|t| is_near(**t)).count() as f64 / large.len() as f64
}
