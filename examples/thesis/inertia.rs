//! Section 3.8: the inertia of the return line's mud.

use crate::chapters::Fallible;
use crate::claims::claim;
use crate::field::{Field, LPM, mean, slopes};
use crate::flow_correction::followed;
use crate::friction::{Polynomial, at};
use crate::model::{Choices, Model};
use crate::page::{
    Finding, Section, chosen, computed, less, measured, over_time, panel, per, range, rms,
};
use crate::pump::Pump;
use crate::verification::{FLOW, LEVEL};

/// A sample is in a transient where the flow changes faster than this, m³/s², and so are those this long
/// before and behind it, s.
const TRANSIENT: f64 = 3.0 * LPM;
const AROUND: f64 = 20.0;

/// The theoretical value of the thesis, about which its estimates begin, kg/m⁴.
const THEORETICAL: f64 = 2e7;

/// The return line with what is identified, levels being measured.
pub(crate) fn return_flow(friction: &Polynomial, pump: &Pump, inertia: f64) -> Fallible<Model> {
    Model::load("examples/thesis/return_flow.dgd", &Choices::default())?.with(&[
        ("c0", pump.c0),
        ("k", pump.k),
        ("c2", pump.c2),
        ("F1", friction[0]),
        ("F2", friction[1]),
        ("F3", friction[2]),
        ("F4", friction[3]),
        ("M_ssp", inertia),
    ])
}

/// Samples in and about transients.
fn transients(field: &Field) -> Vec<usize> {
    let slopes = slopes(&field.times, field.column("q_ssp"), 10);
    let fast: Vec<f64> = field
        .times
        .iter()
        .zip(&slopes)
        .filter(|(_, slope)| slope.abs() > TRANSIENT)
        .map(|(t, _)| *t)
        .collect();
    let is_near = |k: &usize| {
        let t = field.times[*k];
        let next = fast.partition_point(|fast| *fast < t - AROUND);
        fast.get(next).is_some_and(|fast| *fast <= t + AROUND)
    };
    (0..field.len()).filter(is_near).collect()
}

/// Figs 3.20 to 3.22, and M_ssp.
pub(crate) fn identify(
    field: &Field,
    friction: &Polynomial,
    pump: &Pump,
) -> Fallible<(Section, f64)> {
    let (t, q) = (&field.times, field.column("q_ssp"));
    let samples = transients(field);
    // Over ten samples, as one is mostly noise.
    let squares = |samples: &mut dyn Iterator<Item = usize>| -> f64 {
        samples.filter(|k| *k >= 10).map(|k| (q[k] - q[k - 10]).powi(2)).sum()
    };
    let share = squares(&mut samples.iter().copied()) / squares(&mut (0..q.len()));
    let kept = samples.len() as f64 / q.len() as f64;
    let level = field.level();
    let varies = range(&at(&level, &samples)) / LEVEL;
    let claims = vec![
        claim(
            kept < 0.6 && share > 0.95,
            "Transients are a part of the samples and have nearly all of the changes",
            "they are extracted",
            format!(
                "{:.0} % have {:.1} % of the flow's squared changes in 10 s",
                100.0 * kept,
                100.0 * share
            ),
        ),
        claim(
            varies < 0.04,
            "The level hardly varies in them, so M_ssp(h_r) cannot be told from M_ssp",
            "20 to 24 %",
            format!("by {:.1} % of {LEVEL} m", 100.0 * varies),
        ),
    ];
    let extracted = Finding {
        number: "3.20",
        title: "Transients of the flow, and the riser's level",
        thesis: "Only transients say anything of M_ssp; they are extracted.",
        here: format!(
            "{} of {} samples lie in transients or within 20 s of one.",
            samples.len(),
            t.len()
        ),
        claims,
        figure: over_time(vec![
            panel(
                "Return flow",
                "lpm",
                vec![
                    measured("measured", t, per(q, LPM)),
                    chosen("transients", &at(t, &samples), per(&at(q, &samples), LPM)),
                ],
            ),
            panel("Riser level", "m", vec![measured("measured", t, level)]),
        ]),
    };

    let model = return_flow(friction, pump, THEORETICAL)?;
    let mut only = vec![f64::NAN; q.len()];
    for &k in &samples {
        only[k] = q[k];
    }
    let estimate = |rate: f64| -> Fallible<(Vec<f64>, Vec<f64>)> {
        let mut columns = field.columns();
        columns.retain(|(name, _)| *name != "q_ssp");
        columns.push(("q_ssp", &only));
        let recording = model.recording(t, &columns, &[("q_ssp", q[0])])?;
        let found = followed(&model, recording, 5.0, 0.01, rate)?;
        let times = found.times.iter().map(|(_, t)| *t).collect();
        Ok((times, found.estimates.iter().map(|estimate| estimate[0]).collect()))
    };
    let (times, pure) = estimate(0.0)?;
    let (times_forgetting, forgetting) = estimate(0.1)?;
    let inertia = *pure.last().ok_or("no transient was found")?;
    let settled = |values: &[f64]| range(&values[values.len() / 2..]);
    let (still, wandering) = (settled(&pure), settled(&forgetting));
    let claims = vec![
        claim(
            (0.5e8..1.2e8).contains(&inertia),
            "M_ssp without forgetting, in the range that the thesis finds usable",
            "1.1·10⁸, usable from 0.5·10⁸",
            format!("{:.2}·10⁸ kg/m⁴", inertia / 1e8),
        ),
        claim(
            (2.0..8.0).contains(&(inertia / THEORETICAL)),
            "It is a multiple of the theoretical 2·10⁷",
            "five times",
            format!("{:.1} times", inertia / THEORETICAL),
        ),
        claim(
            still < 0.1 * inertia && wandering > 4.0 * still,
            "Without forgetting it settles, with forgetting it fluctuates",
            "fluctuates",
            format!(
                "over the second half by {:.0} and {:.0} %",
                100.0 * still / inertia,
                100.0 * wandering / inertia
            ),
        ),
    ];
    let estimates = Finding {
        number: "3.21",
        title: "M_ssp by recursive least squares, without and with forgetting",
        thesis: "1.1·10⁸ kg/m⁴, five times the theoretical 2·10⁷; with forgetting it wanders.",
        here: format!(
            "{inertia:.2e} kg/m⁴ without forgetting; with β = 0.1/s it wanders about {:.2e} kg/m⁴. A \
             flow meter and a pump that lag make the mud look heavier than it is.",
            mean(&forgetting)
        ),
        claims,
        figure: over_time(vec![
            panel("β = 0", "kg/m⁴", vec![computed("M_ssp", &times, pure)]),
            panel("β = 0.1 1/s", "kg/m⁴", vec![computed("M_ssp", &times_forgetting, forgetting)]),
        ]),
    };

    let values = [2e7, 5e7, 1.1e8, 5e8, 1e9];
    let window = field.between(440.0, 1440.0);
    let measured_flow = window.column("q_ssp");
    let mut series = vec![measured("measured", &window.times, per(measured_flow, LPM))];
    let mut errors = Vec::new();
    for value in values {
        let model = return_flow(friction, pump, value)?;
        let recording =
            model.recording(&window.times, &window.columns(), &[("q_ssp", measured_flow[0])])?;
        let flow = model.run(&recording)?.unknown("q_ssp")?;
        errors.push(rms(&less(&flow, measured_flow)) / LPM);
        series.push(computed(
            &format!("{:.1}·10⁸ kg/m⁴", value / 1e8),
            &window.times,
            per(&flow, LPM),
        ));
    }
    let percent = |error: f64| 100.0 * error * LPM / FLOW;
    let claims = vec![
        claim(
            errors[1] < errors[2],
            "0.5·10⁸ is better than 1.1·10⁸",
            "slight improvement",
            format!("{:.0} and {:.0} lpm off", errors[1], errors[2]),
        ),
        claim(
            percent(errors[0]) < 2.0 && percent(errors[1]) < 2.0,
            "Several values below 1·10⁸ are satisfactory",
            "satisfactory",
            format!(
                "0.2 and 0.5·10⁸: {:.1} and {:.1} % off",
                percent(errors[0]),
                percent(errors[1])
            ),
        ),
        claim(
            errors[3] > 3.0 * errors[2] && errors[4] > errors[3],
            "M_ssp is a time constant: the larger, the later the flow",
            "5 and 10·10⁸ lag visibly",
            format!("5 and 10·10⁸: {:.0} and {:.0} lpm off", errors[3], errors[4]),
        ),
    ];
    let compared = Finding {
        number: "3.22",
        title: "The flow with several values of M_ssp",
        thesis: "0.5·10⁸ is a little better than 1.1·10⁸; below 1·10⁸ nearly nothing changes.",
        here: format!(
            "With 0.2, 0.5, 1.1, 5 and 10·10⁸ kg/m⁴ the flow is off by {:.0}, {:.0}, {:.0}, {:.0} and {:.0} lpm, \
             root mean square.",
            errors[0], errors[1], errors[2], errors[3], errors[4]
        ),
        claims,
        figure: over_time(vec![panel("Return flow", "lpm", series)]),
    };
    let findings = vec![extracted, estimates, compared];
    Ok((Section { title: "3.8 Flow dynamics", findings }, inertia))
}
