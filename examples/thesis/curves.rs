//! Section 2.4: the curves of a pump, and where they meet that of its system.

use dgd_plot::{MathText, PlotSeries, PointLabel, SeriesMeaning, SeriesStyle};

use crate::chapters::Fallible;
use crate::claims::claim;
use crate::field::LPM;
use crate::model::{Choices, Model};
use crate::page::{Finding, Section, computed, over, panel, per};

/// Curves of the figure.
const CURVES: usize = 6;

/// Along the curves: 10 lpm in a row.
const ROWS: usize = 600;

/// Highest flow, m³/s; full speed, rad/s; the riser's level, m.
const MOST: f64 = 6000.0 * LPM;
const FULL: f64 = 2000.0 * std::f64::consts::PI / 30.0;
const LEVEL: f64 = 50.0;

/// What the curves are.
struct Curves {
    flows: Vec<f64>,
    heads: Vec<Vec<f64>>,
    system: Vec<f64>,
    /// Operating points: flow, m³/s, and head, m.
    points: Vec<(f64, f64)>,
}

impl Curves {
    fn simulated(settings: &[(&str, f64)]) -> Fallible<Curves> {
        let model = Model::load("models/subsea_pump.dgd", &Choices::default())?.with(settings)?;
        let times: Vec<f64> = (0..=ROWS).map(|k| k as f64).collect();
        let flows: Vec<f64> = times.iter().map(|t| MOST * t / ROWS as f64).collect();
        let columns = [
            ("q", flows.as_slice()),
            ("n", &vec![FULL; times.len()]),
            ("h_r", &vec![LEVEL; times.len()]),
        ];
        let run = model.run(&model.recording(&times, &columns, &[])?)?;
        let each = |name: &str| -> Fallible<Vec<Vec<f64>>> {
            (1..=CURVES).map(|i| run.output(&format!("{name}[{i}]"))).collect()
        };
        let points = each("q_at")?.iter().zip(each("h_at")?).map(|(q, h)| (q[0], h[0])).collect();
        Ok(Curves { heads: each("head")?, system: run.output("h_sys")?, points, flows })
    }

    /// Where the drawn curves cross, by the signs of their difference, without the solver's points.
    fn crossing(&self, curve: usize) -> Option<f64> {
        let apart: Vec<f64> =
            self.heads[curve].iter().zip(&self.system).map(|(a, b)| a - b).collect();
        let k = apart.windows(2).position(|pair| pair[0] > 0.0 && pair[1] <= 0.0)?;
        let share = apart[k] / (apart[k] - apart[k + 1]);
        Some(self.flows[k] + share * (self.flows[k + 1] - self.flows[k]))
    }

    /// Whether every curve falls, the steeper the farther out.
    fn bend_down(&self) -> bool {
        self.heads.iter().all(|head| {
            let fall = |k: usize| head[k] - head[k + 1];
            (1..ROWS).all(|k| fall(k) > fall(k - 1) && fall(k) > 0.0)
        })
    }
}

/// Fig 2.3, with parameters by name, SI.
pub(crate) fn draw(settings: &[(&str, f64)]) -> Fallible<Section> {
    let curves = Curves::simulated(settings)?;
    let flows = per(&curves.flows, LPM);
    let mut pump = PlotSeries { name: MathText::plain("pump"), ..PlotSeries::default() };
    for (i, head) in curves.heads.iter().enumerate() {
        pump.x.extend(flows.iter().copied().chain([f64::NAN]));
        pump.y.extend(head.iter().copied().chain([f64::NAN]));
        let (x, y) = (flows[ROWS], head[ROWS]);
        pump.labels.push(PointLabel {
            x,
            y,
            text: MathText::plain(&format!("{} rpm", 1000 + 200 * i)),
        });
    }
    let system = PlotSeries {
        meaning: SeriesMeaning::Variant(1),
        ..computed("system", &flows, curves.system.clone())
    };
    let points = PlotSeries {
        meaning: SeriesMeaning::Variant(2),
        ..PlotSeries::new(
            MathText::plain("operating points"),
            SeriesStyle::Marks,
            curves.points.iter().map(|(q, _)| q / LPM).collect(),
            curves.points.iter().map(|(_, h)| *h).collect(),
        )
    };

    let [(slow, _), .., (fast, high)] = curves.points.as_slice() else {
        return Err("the figure has operating points".into());
    };
    let farthest = (0..CURVES)
        .map(|i| curves.crossing(i).map_or(f64::NAN, |q| (q - curves.points[i].0).abs() / LPM))
        .fold(0.0, f64::max);
    let in_order =
        curves.points.windows(2).all(|pair| pair[0].0 < pair[1].0 && pair[0].1 < pair[1].1);
    let claims = vec![
        claim(
            curves.bend_down(),
            "Each curve falls, the steeper the higher the flow",
            "curves that bend downwards",
            format!(
                "full speed: {:.0} m at no flow, {:.0} m at 6000 lpm",
                curves.heads[5][0], curves.heads[5][ROWS]
            ),
        ),
        claim(
            farthest < 1.0,
            "An operating point lies where a curve meets the system's",
            "h_sys = h_pump (2.30)",
            format!("six points, each within {farthest:.2} lpm of where the drawn curves cross"),
        ),
        claim(
            in_order,
            "The faster the pump, the higher flow and head",
            "points go up along the system's curve",
            format!("{:.0} to {:.0} lpm", slow / LPM, fast / LPM),
        ),
    ];
    let finding = Finding {
        number: "2.3",
        title: "Curves of a subsea pump at 1000 to 2000 rpm, with its operating points",
        thesis: "Each speed has a curve of its own, and the pump works where that meets what the system asks for.",
        here: format!(
            "The same shape. The thesis lists no coefficients, so the sizes are ours: {:.0} lpm and {high:.0} m at full speed.",
            fast / LPM
        ),
        claims,
        figure: over("Flow", "lpm", vec![panel("Head", "m", vec![pump, system, points])]),
    };
    Ok(Section { title: "2.4 The subsea pump", findings: vec![finding] })
}
