//! Section 3.8: the inertia of the return line's mud.

use crate::chapters::Fallible;
use crate::field::{Field, LPM, mean, slopes};
use crate::flow_correction::followed;
use crate::friction::{Polynomial, at};
use crate::model::{Choices, Model};
use crate::page::{Finding, Section, claim, computed, dots, measured, over_time, panel, per};
use crate::pump::Pump;

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
    let chosen = transients(field);
    // Over ten samples, as one is mostly noise.
    let squares = |samples: &mut dyn Iterator<Item = usize>| -> f64 {
        samples.filter(|k| *k >= 10).map(|k| (q[k] - q[k - 10]).powi(2)).sum()
    };
    let share = squares(&mut chosen.iter().copied()) / squares(&mut (0..q.len()));
    let telling = claim(
        chosen.len() < q.len() * 3 / 5 && share > 0.95,
        format!(
            "{:.0} % of the samples have {:.1} % of the changes of the flow in ten seconds, squared.",
            100.0 * chosen.len() as f64 / q.len() as f64,
            100.0 * share
        ),
    );
    let extracted = Finding {
        number: "3.20",
        title: "Transients of the flow, and the riser's level",
        thesis: "Only transients say anything of M_ssp; they are extracted.",
        here: format!(
            "{} of {} samples lie in transients or within 20 s of one.",
            chosen.len(),
            t.len()
        ),
        claims: vec![telling],
        figure: over_time(vec![
            panel(
                "Return flow",
                "lpm",
                vec![
                    measured("measured", t, per(q, LPM)),
                    dots("transients", &at(t, &chosen), per(&at(q, &chosen), LPM)),
                ],
            ),
            panel("Riser level", "m", vec![measured("measured", t, field.level())]),
        ]),
    };

    let model = return_flow(friction, pump, THEORETICAL)?;
    let mut only = vec![f64::NAN; q.len()];
    for &k in &chosen {
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
    let plausible = claim(
        (1e7..2e8).contains(&inertia),
        format!("M_ssp is of the order of the thesis' 0.5 to 1.1·10⁸ kg/m⁴: {inertia:.2e} kg/m⁴."),
    );
    let estimates = Finding {
        number: "3.21",
        title: "M_ssp by recursive least squares, without and with forgetting",
        thesis: "1.1·10⁸ kg/m⁴, five times the theoretical 2·10⁷; with forgetting it wanders.",
        here: format!(
            "{inertia:.2e} kg/m⁴ without forgetting; with β = 0.1/s it wanders about {:.2e} kg/m⁴. A \
             flow meter and a pump that lag make the mud look heavier than it is.",
            mean(&forgetting)
        ),
        claims: vec![plausible],
        figure: over_time(vec![
            panel("β = 0", "kg/m⁴", vec![computed("M_ssp", &times, pure)]),
            panel("β = 0.1 1/s", "kg/m⁴", vec![computed("M_ssp", &times_forgetting, forgetting)]),
        ]),
    };

    let values = [2e7, 5e7, 1.1e8, 5e8];
    let window = field.between(440.0, 1440.0);
    let measured_flow = window.column("q_ssp");
    let mut series = vec![measured("measured", &window.times, per(measured_flow, LPM))];
    let mut errors = Vec::new();
    for value in values {
        let model = return_flow(friction, pump, value)?;
        let recording =
            model.recording(&window.times, &window.columns(), &[("q_ssp", measured_flow[0])])?;
        let flow = model.run(&recording)?.unknown("q_ssp")?;
        let squares = flow.iter().zip(measured_flow).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        errors.push((squares / flow.len() as f64).sqrt() / LPM);
        series.push(computed(&format!("{value:.1e} kg/m⁴"), &window.times, per(&flow, LPM)));
    }
    let insensitive = claim(
        (errors[1] - errors[0]).abs() < 0.3 * (errors[3] - errors[1]),
        format!("The flow hardly depends on M_ssp below 1·10⁸ kg/m⁴: errors of {errors:.1?} lpm."),
    );
    let compared = Finding {
        number: "3.22",
        title: "The flow with several values of M_ssp",
        thesis: "0.5·10⁸ is a little better than 1.1·10⁸; below 1·10⁸ nearly nothing changes.",
        here: format!(
            "With 0.2, 0.5, 1.1 and 5·10⁸ kg/m⁴ the flow is off by {:.1}, {:.1}, {:.1} and {:.1} lpm, root \
             mean square.",
            errors[0], errors[1], errors[2], errors[3]
        ),
        claims: vec![insensitive],
        figure: over_time(vec![panel("Return flow", "lpm", series)]),
    };
    let findings = vec![extracted, estimates, compared];
    Ok((Section { title: "3.8 Flow dynamics", findings }, inertia))
}
