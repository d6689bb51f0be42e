//! Section 3.2: what the riser's level says of each parameter.

use dgd_plot::{Figure, Panel, Text};
use dgd_runtime::{
    Column, Inputs, Interpolation, Options, Problem, System, simulate_with_sensitivities,
};

use crate::chapters::Fallible;
use crate::model::{Choices, Model};
use crate::page::{Finding, Section, claim, computed};

/// Fig 3.1.
pub(crate) fn draw() -> Fallible<Section> {
    let names = ["M", "c0", "c1", "c2", "F"];
    let choices = Choices { free: &names, ..Choices::default() };
    let model = Model::load("models/pump_speed_step.dgd", &choices)?;
    let times: Vec<f64> = (0..=1000).map(f64::from).collect();
    let omega: Vec<f64> = times.iter().map(|t| if *t < 50.0 { 10.0 / 1.1 } else { 10.0 }).collect();
    let flow = vec![0.02; times.len()];
    let hold = Interpolation::Hold;
    let inputs = Inputs::recorded(
        &times,
        &[
            Column { name: "omega", interpolation: hold, values: &omega },
            Column { name: "q_in", interpolation: hold, values: &flow },
        ],
    )?;
    let problem = Problem { system: &model.system, p: &model.p, inputs: &inputs, start: &[] };
    let solution = simulate_with_sensitivities(&problem, &times, &Options::default())
        .map_err(|f| f.to_string())?;
    let (h, n) = (model.unknown("h")?, model.signature().unknowns.len());
    let mut panels = vec![Panel {
        title: Text::name("h"),
        y_label: Text::default().with_unit("m"),
        series: vec![computed("h", &times, (0..times.len()).map(|k| solution.y(k)[h]).collect())],
        ..Panel::default()
    }];
    let mut last = Vec::new();
    for (j, direction) in model.system.signature().directions.iter().enumerate() {
        let dgd_runtime::Direction::Parameter(i) = *direction else { continue };
        let parameter = &model.signature().parameters[i];
        let values: Vec<f64> = (0..times.len()).map(|k| solution.s(k)[j * n + h]).collect();
        last.push((parameter.name.to_string(), *values.last().ok_or("a run has rows")?));
        panels.push(Panel {
            title: Text::plain(&format!("dh/d{}", parameter.name)),
            series: vec![computed("dh/dp", &times, values)],
            ..Panel::default()
        });
    }
    // At steady state h = h_in − h_out + c0 ω² − c1 ω q − c2 q² − F q²/(ρ g).
    let (w, q) = (10.0f64, 0.02f64);
    let limits = [("c0", w * w), ("c1", -w * q), ("c2", -q * q), ("F", -q * q / (1120.0 * 9.81))];
    let towards = limits.iter().all(|(name, limit)| {
        let found = last.iter().find(|(other, _)| other == name);
        found.is_some_and(|(_, value)| value / limit > 0.5 && value / limit < 1.0)
    });
    let go_to_rest =
        claim(towards, "Sensitivities go to those of the steady state, in closed form.".to_owned());
    let figure = Figure { columns: 2, ..Figure::new(Text::plain("Time").with_unit("s"), panels) };
    let finding = Finding {
        number: "3.1",
        title: "The riser's level after a step in pump speed, and its sensitivities",
        thesis: "The level is sensitive to M_ssp in transients only, and to the others at rest as well.",
        here: "The same, by the model's own sensitivity equations. Limits of all panels but dh/dM are those \
               of the thesis; its dh/dM is about 60 times as large, which looks like minutes for seconds."
            .into(),
        claims: vec![go_to_rest],
        figure,
    };
    Ok(Section { title: "3.2 Sensitivities", findings: vec![finding] })
}
