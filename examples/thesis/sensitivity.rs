//! Section 3.2: what the riser's level says of each parameter.

use dgd_plot::{Figure, MathText, Panel};
use dgd_runtime::{
    InputColumn, Inputs, Interpolation, Options, Problem, System, simulate_with_sensitivities,
};

use crate::chapters::Fallible;
use crate::claims::{Claim, claim};
use crate::model::{Choices, Model};
use crate::page::{Finding, Section, computed, ends};

/// Fig 3.1, with parameters by name, SI.
pub(crate) fn draw(settings: &[(&str, f64)]) -> Fallible<Section> {
    let names = ["M", "c0", "c1", "c2", "F"];
    let choices = Choices { free: &names, ..Choices::default() };
    let model = Model::load("models/pump_speed_step.dgd", &choices)?.with(settings)?;
    let times: Vec<f64> = (0..=1000).map(f64::from).collect();
    let omega: Vec<f64> = times.iter().map(|t| if *t < 50.0 { 10.0 / 1.1 } else { 10.0 }).collect();
    let flow = vec![0.02; times.len()];
    let hold = Interpolation::Hold;
    let inputs = Inputs::recorded(
        &times,
        &[
            InputColumn { name: "omega", interpolation: hold, values: &omega },
            InputColumn { name: "q_in", interpolation: hold, values: &flow },
        ],
    )?;
    let problem = Problem { system: &model.system, p: &model.p, inputs: &inputs, start: &[] };
    let solution = simulate_with_sensitivities(&problem, &times, &Options::default())
        .map_err(|f| f.to_string())?;
    let (h, n) = (model.unknown("h")?, model.signature().unknowns.len());
    let level: Vec<f64> = (0..times.len()).map(|k| solution.y(k)[h]).collect();
    let mut panels = vec![Panel {
        title: MathText::name("h"),
        y_label: MathText::default().with_unit("m"),
        series: vec![computed("h", &times, level.clone())],
        ..Panel::default()
    }];
    let mut courses = Vec::new();
    for (j, direction) in model.system.signature().directions.iter().enumerate() {
        let dgd_runtime::Direction::Parameter(i) = *direction else { continue };
        let parameter = &model.signature().parameters[i];
        let values: Vec<f64> = (0..times.len()).map(|k| solution.s(k)[j * n + h]).collect();
        courses.push((parameter.name.to_string(), values.clone()));
        panels.push(Panel {
            title: MathText::plain(&format!("dh/d{}", parameter.name)),
            series: vec![computed("dh/dp", &times, values)],
            ..Panel::default()
        });
    }
    let figure =
        Figure { columns: 2, ..Figure::new(MathText::plain("Time").with_unit("s"), panels) };
    let finding = Finding {
        number: "3.1",
        title: "The riser's level after a step in pump speed, and its sensitivities",
        thesis: "The level is sensitive to M_ssp in transients only, and to the others at rest as well.",
        here: "The same, by the model's own sensitivity equations. All panels but dh/dM fit the thesis' axes; the \
               dh/dM is some 60 times as large, which looks like minutes for seconds."
            .into(),
        claims: claims(&level, &courses),
        figure,
    };
    Ok(Section { title: "3.2 Sensitivities", findings: vec![finding] })
}

/// Ends of the thesis' axes: dh/dc0, dh/dc1, dh/dc2 and dh/dF, SI.
const AXES: [(&str, f64); 4] = [("c0", 100.0), ("c1", -0.2), ("c2", -4e-4), ("F", -4e-8)];

/// What must come out of the level, m, and of its derivatives over time.
fn claims(level: &[f64], courses: &[(String, Vec<f64>)]) -> Vec<Claim> {
    let course = |name: &str| {
        let found = courses.iter().find(|(other, _)| other == name);
        found.map_or(&[][..], |(_, values)| values.as_slice())
    };
    let last = |name: &str| course(name).last().copied().unwrap_or(f64::NAN);
    // At steady state h = h_in − h_out + c0 ω² − c1 ω q − c2 q² − F q²/(ρ g).
    let (w, q) = (10.0f64, 0.02f64);
    let limits = [("c0", w * w), ("c1", -w * q), ("c2", -q * q), ("F", -q * q / (1120.0 * 9.81))];
    let shares = limits.map(|(name, limit)| last(name) / limit);
    let (low, high) = ends(&shares);
    let on_axes = AXES.map(|(name, end)| last(name) / end);
    let (least, most) = ends(&on_axes);
    let (first, end) = ends(level);

    let of_mass = course("M");
    let (dip, top) = ends(of_mass);
    let at = |value: f64| of_mass.iter().position(|other| *other == value);
    vec![
        claim(
            (8.0..10.0).contains(&first) && (14.0..16.0).contains(&end),
            "The level rises by a step in pump speed",
            "within 8 to 16 m",
            format!("{first:.1} to {end:.1} m"),
        ),
        claim(
            low > 0.5 && high < 1.0,
            "dh/dc0, dh/dc1, dh/dc2 and dh/dF go to those of the steady state",
            "sensitive at rest as well",
            format!("{:.0} to {:.0} % of the closed form after 1000 s", 100.0 * low, 100.0 * high),
        ),
        claim(
            least > 0.7 && most < 1.0,
            "They end within the last tick of the axes",
            "axes end at 100, −0.2, −4·10⁻⁴, −4·10⁻⁸",
            format!("at {:.0} to {:.0} % of these", 100.0 * least, 100.0 * most),
        ),
        claim(
            dip < 0.0 && at(dip) < at(top) && (0.05..0.4).contains(&(top / -dip)),
            "dh/dM dips and then overshoots, by less",
            "a quarter of the dip",
            format!("{:.0} % of the dip", 100.0 * top / -dip),
        ),
        claim(
            (46.0..62.0).contains(&(20e-9 / -dip)),
            "The thesis' dh/dM is too large by a factor that nothing here explains",
            "−20·10⁻⁹ to 5·10⁻⁹",
            format!("a factor of {:.0} on the dip", 20e-9 / -dip),
        ),
    ]
}
