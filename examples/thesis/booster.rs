//! Section 3.7: U-tubing in the booster line.

use dgd_identify::{OutputErrorProblem, Recording, fit};

use crate::chapters::Fallible;
use crate::field::{A_B, A_R, Field, G, H_PR, LPM, P_ATM, RHO, mean, slopes, smoothed};
use crate::model::{Choices, Model, Run};
use crate::page::{Finding, Section, claim, computed, measured, over_time, panel, per};

/// A long stop of the booster pump and its restart, s.
const STOP: (f64, f64) = (440.0, 1440.0);

/// When the pump is started again, s after the beginning of that.
const RESTART: f64 = 480.0;

/// What 3.13 and 3.14 need.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Booster {
    pub(crate) tau_d: f64,
    pub(crate) tau_b: f64,
    pub(crate) theta_i: f64,
}

/// The riser whose return flow is metered, with any of the forms of its booster line.
struct Riser {
    field: Field,
    theta_1: f64,
    /// Level, m, by the riser's own gauge.
    level: Vec<f64>,
}

impl Riser {
    fn model(&self, form: &str, free: &[&str]) -> Fallible<Model> {
        let variants = [("line", form)];
        let choices = Choices { variants: &variants, free, ..Choices::default() };
        Model::load("examples/thesis/riser_and_booster.dgd", &choices)?
            .with(&[("theta_1", self.theta_1)])
    }

    fn recording(&self, model: &Model) -> Fallible<Recording> {
        let start = mean(&self.level[..30]);
        model.recording(&self.field.times, &self.field.columns(), &[("h_r", start)])
    }

    /// Simulates a form with parameters by name, SI.
    fn run(&self, form: &str, parameters: &[(&str, f64)]) -> Fallible<Run> {
        let model = self.model(form, &[])?.with(parameters)?;
        model.run(&self.recording(&model)?)
    }

    /// Parameters of a form that suit the level best, from where the thesis has them.
    fn fitted<const N: usize>(&self, form: &str, free: [&str; N]) -> Fallible<[f64; N]> {
        let model = self.model(form, &free)?;
        let recordings = [self.recording(&model)?];
        let found = fit(&OutputErrorProblem::new(&model.system, &model.p, &recordings))?;
        let mut values = [0.0; N];
        for (value, name) in values.iter_mut().zip(free) {
            *value = found.p[model.parameter(name)?];
        }
        Ok(values)
    }

    /// Errors of a computed level, m, between two times.
    fn errors(&self, run: &Run, from: f64, until: f64) -> Fallible<Vec<f64>> {
        let (level, measured) = (run.unknown("h_r")?, smoothed(&self.level, 5));
        let errors = level.iter().zip(&measured).map(|(a, b)| a - b);
        let samples = self.field.times.iter().zip(errors);
        Ok(samples.filter(|(t, _)| (from..until).contains(*t)).map(|(_, e)| e).collect())
    }

    /// Largest error of a computed level, m, between two times.
    fn error(&self, run: &Run, from: f64, until: f64) -> Fallible<f64> {
        Ok(self.errors(run, from, until)?.iter().fold(0.0, |most: f64, e| most.max(e.abs())))
    }

    /// Root mean square of the same, m.
    fn rms(&self, run: &Run, from: f64, until: f64) -> Fallible<f64> {
        let errors = self.errors(run, from, until)?;
        Ok((errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt())
    }

    /// Panels of the level, the booster's flow and, where it has one, the level in its line.
    fn panels(&self, runs: &[(&str, &Run)], has_level: bool) -> Fallible<Vec<dgd_plot::Panel>> {
        let t = &self.field.times;
        let mut levels = vec![measured("measured", t, smoothed(&self.level, 2))];
        let mut flows = vec![
            measured("calculated of the pump", t, per(self.field.column("q_boost"), LPM)),
            measured("into the riser by 3.10", t, per(&self.delivered(), LPM)),
        ];
        let mut columns = Vec::new();
        for (name, run) in runs {
            levels.push(computed(name, t, run.unknown("h_r")?));
            flows.push(computed(name, t, per(&run.unknown("q_bo")?, LPM)));
            columns.push(computed(name, t, run.unknown("h_b")?));
        }
        let mut panels =
            vec![panel("Riser level", "m", levels), panel("Booster flow", "lpm", flows)];
        if has_level {
            panels.push(panel("Level in the booster line", "m", columns));
        }
        Ok(panels)
    }

    /// q_U of 3.10, m³/s: what flows in beside what is calculated.
    fn missing(&self) -> Vec<f64> {
        let [q, boost, fill] = ["q_ssp", "q_boost", "q_tf"].map(|name| self.field.column(name));
        let rise = slopes(&self.field.times, &self.level, 10);
        (0..q.len()).map(|k| self.theta_1 * q[k] - boost[k] - fill[k] - A_R * rise[k]).collect()
    }

    /// What must have come out of the booster line.
    fn delivered(&self) -> Vec<f64> {
        let missing = self.missing();
        missing.iter().zip(self.field.column("q_boost")).map(|(q, boost)| q + boost).collect()
    }
}

/// Figs 3.14 to 3.19, and the outlet's constants.
pub(crate) fn identify(restarts: &Field, theta_1: f64) -> Fallible<(Section, Booster)> {
    let field = restarts.between(STOP.0, STOP.1);
    let level = field.column("p_r").iter().map(|p| H_PR - (p - P_ATM) / (RHO * G)).collect();
    let riser = Riser { field, theta_1, level };
    let t = riser.field.times.clone();
    let end = t.len() as f64;

    let none = riser.run("none", &[])?;
    let missing = riser.missing();
    let stopped = t.partition_point(|t| *t < RESTART);
    let drained: f64 = missing[..stopped].iter().sum();
    let drop = drained / A_B;
    let drops = claim(
        (140.0..180.0).contains(&drop),
        format!("The line drops by about 160 m: {drop:.0} m."),
    );
    let uncounted: f64 = missing.iter().sum();
    let more = claim(
        uncounted > 0.5,
        format!("More comes out of the line than is calculated to go in: {uncounted:.2} m³."),
    );
    let flow = |name: &str| measured(name, &t, per(riser.field.column(name), LPM));
    let mut panels = riser.panels(&[("without U-tubing", &none)], false)?;
    panels.truncate(1);
    panels.push(panel(
        "Flows",
        "lpm",
        vec![
            flow("q_ssp"),
            flow("q_boost"),
            flow("q_tf"),
            computed("missing, 3.10", &t, per(&missing, LPM)),
        ],
    ));
    let fig_14 = Finding {
        number: "3.14",
        title: "U-tubing: the flow that the level misses",
        thesis: "The flow that keeps the measured level drops the column in the booster line by roughly 160 m.",
        here: format!(
            "Until the pump is started again {drained:.2} m³ are missing, a column of {drop:.0} m. When the line is \
             full again {uncounted:.2} m³ are: nobody has counted what filled the most of it."
        ),
        claims: vec![drops, more],
        figure: over_time(panels),
    };

    let column = riser.run("column", &[("M_b", 4e7), ("F_b", 6e7)])?;
    let [down, up] = [riser.error(&column, 0.0, RESTART)?, riser.error(&column, RESTART, end)?];
    let too_slow = claim(
        up > 1.5 * down,
        format!(
            "It is farther off on ramp-up than on ramp-down, by half or more: {up:.1} and {down:.1} m."
        ),
    );
    let fig_15 = Finding {
        number: "3.15",
        title: "The column of the booster line, 3.11",
        thesis: "With M_b 4·10⁷ kg/m⁴ and F_b 6·10⁷ Pa s/m³ by hand it is not far off on ramp-down and far off on ramp-up.",
        here: format!(
            "With these numbers the level is off by up to {down:.1} m on ramp-down and {up:.1} m on ramp-up; without U-tubing by {:.1} m.",
            riser.error(&none, 0.0, end)?
        ),
        claims: vec![too_slow],
        figure: over_time(riser.panels(&[("3.11", &column)], true)?),
    };

    let names = ["F_b", "theta_hb", "theta_b"];
    let weights = riser.fitted("weighted", names)?;
    let settings: Vec<(&str, f64)> = names.into_iter().zip(weights).collect();
    let weighted = riser.run("weighted", &settings)?;
    let weigh = claim(
        (1.3..2.0).contains(&weights[1]) && (2.0..5.0).contains(&weights[2]),
        format!(
            "Both weights are well above 1, as in the thesis: {:.2} and {:.2}.",
            weights[1], weights[2]
        ),
    );
    let fig_16 = Finding {
        number: "3.16",
        title: "The column with two weights, 3.12",
        thesis: "θ_hb = 1.5 and θ_b = 3.6 fit the level, and the physics fade.",
        here: format!(
            "θ_hb = {:.2} and θ_b = {:.2} fit best, with F_b = {:.2e} Pa s/m³. The level is off by up to {:.1} m.",
            weights[1],
            weights[2],
            weights[0],
            riser.error(&weighted, 0.0, end)?
        ),
        claims: vec![weigh],
        figure: over_time(riser.panels(&[("3.12", &weighted)], true)?),
    };

    let [tau_d, tau_b, theta_i] = riser.fitted("outlet", ["tau_d", "tau_b", "theta_i"])?;
    let booster = Booster { tau_d, tau_b, theta_i };
    let outlet = |tau_d: f64, tau_b: f64, theta_i: f64| {
        riser.run("outlet", &[("tau_d", tau_d), ("tau_b", tau_b), ("theta_i", theta_i)])
    };
    let (lag, delayed) = (outlet(0.0, tau_d + tau_b, theta_i)?, outlet(30.0, 10.0, theta_i)?);
    let lag_error = riser.error(&lag, 0.0, RESTART)?;
    let delayed_error = riser.error(&delayed, 0.0, RESTART)?;
    let sooner = claim(
        delayed_error < lag_error,
        format!(
            "A delay and a lag are better than a lag alone: {delayed_error:.1} and {lag_error:.1} m."
        ),
    );
    let fig_17 = Finding {
        number: "3.17",
        title: "Ramp-down as a lag, and as a delay and a lag, 3.13",
        thesis: "By a lag of 40 s alone the level rises before the measured one does; a delay of 30 s and a lag of 10 s fit.",
        here: format!(
            "On ramp-down a lag of {:.0} s alone is off by up to {lag_error:.1} m, the thesis' delay and lag by {delayed_error:.1} m.",
            tau_d + tau_b
        ),
        claims: vec![sooner],
        figure: over_time(riser.panels(&[("lag", &lag), ("30 s and 10 s", &delayed)], false)?),
    };

    let factors = [0.6, 1.0, 1.4];
    let runs: Vec<Run> = factors
        .iter()
        .map(|factor| outlet(tau_d, tau_b, factor * theta_i))
        .collect::<Fallible<_>>()?;
    let titles: Vec<String> = factors.iter().map(|f| format!("{:.4} 1/s", f * theta_i)).collect();
    let shown: Vec<(&str, &Run)> = titles.iter().map(String::as_str).zip(&runs).collect();
    let errors =
        runs.iter().map(|run| riser.rms(run, RESTART, end)).collect::<Fallible<Vec<_>>>()?;
    let is_best = claim(
        errors[1] < errors[0] && errors[1] < errors[2],
        format!(
            "Of three growths the one in the middle is best: {errors:.2?} m, root mean square."
        ),
    );
    let fig_18 = Finding {
        number: "3.18",
        title: "Ramp-up as an integrator, 3.14, with three values of θ_i",
        thesis: "Of 0.03, 0.05 and 0.07 the middle one is best.",
        here: format!(
            "Of {} the middle one is best: off by {:.2}, {:.2} and {:.2} m, root mean square.",
            titles.join(", "),
            errors[0],
            errors[1],
            errors[2]
        ),
        claims: vec![is_best],
        figure: over_time(riser.panels(&shown, false)?),
    };
    let all = &runs[1];
    let (with, without) = (riser.error(all, 0.0, end)?, riser.error(&none, 0.0, end)?);
    let describes = claim(
        without > 4.0 * with,
        format!(
            "Without U-tubing the level is four times as far off or more: {without:.1} and {with:.1} m."
        ),
    );
    let alike = claim(
        (20.0..35.0).contains(&tau_d)
            && (8.0..20.0).contains(&tau_b)
            && (0.04..0.07).contains(&theta_i),
        format!(
            "The constants are near the thesis' 30 s, 10 s and 0.05 1/s: {tau_d:.0} s, {tau_b:.0} s and {theta_i:.3} 1/s."
        ),
    );
    let fig_19 = Finding {
        number: "3.19",
        title: "Ramp-down and ramp-up together, 3.13 and 3.14",
        thesis: "Level and flow follow what was measured.",
        here: format!(
            "τ_d = {tau_d:.0} s, τ_b = {tau_b:.0} s and θ_i = {theta_i:.4} 1/s by output error: the level is off by up to {with:.1} m, without U-tubing by {without:.1} m."
        ),
        claims: vec![describes, alike],
        figure: over_time(riser.panels(&[("3.13, 3.14", all)], false)?),
    };
    let findings = vec![fig_14, fig_15, fig_16, fig_17, fig_18, fig_19];
    Ok((Section { title: "3.7 U-tubing", findings }, booster))
}
