//! The riser and its booster line over a stop of the booster pump, by any of the thesis' forms.

use dgd_identify::{OutputErrorProblem, Recording, fit};
use dgd_plot::Panel;

use crate::chapters::Fallible;
use crate::field::{A_R, Field, LPM, mean, slopes, smoothed};
use crate::model::{Choices, Model, Run};
use crate::page::{computed, input, measured, panel, per, rms};

/// The riser whose return flow is metered, with any of the forms of its booster line.
pub(crate) struct Riser {
    pub(crate) field: Field,
    pub(crate) theta_1: f64,
    /// Level, m, by the riser's own gauge.
    pub(crate) level: Vec<f64>,
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
    pub(crate) fn run(&self, form: &str, parameters: &[(&str, f64)]) -> Fallible<Run> {
        let model = self.model(form, &[])?.with(parameters)?;
        model.run(&self.recording(&model)?)
    }

    /// Parameters of a form that suit the level best, from where the thesis has them.
    pub(crate) fn fitted<const N: usize>(&self, form: &str, free: [&str; N]) -> Fallible<[f64; N]> {
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
    pub(crate) fn errors(&self, run: &Run, from: f64, until: f64) -> Fallible<Vec<f64>> {
        let (level, measured) = (run.unknown("h_r")?, smoothed(&self.level, 5));
        let errors = level.iter().zip(&measured).map(|(a, b)| a - b);
        let samples = self.field.times.iter().zip(errors);
        Ok(samples.filter(|(t, _)| (from..until).contains(*t)).map(|(_, e)| e).collect())
    }

    /// Largest error of a computed level, m, between two times.
    pub(crate) fn error(&self, run: &Run, from: f64, until: f64) -> Fallible<f64> {
        Ok(self.errors(run, from, until)?.iter().fold(0.0, |most: f64, e| most.max(e.abs())))
    }

    /// Root mean square of the same, m.
    pub(crate) fn rms(&self, run: &Run, from: f64, until: f64) -> Fallible<f64> {
        Ok(rms(&self.errors(run, from, until)?))
    }

    /// Panels of the level, the booster's flow and, where it has one, the level in its line.
    pub(crate) fn panels(&self, runs: &[(&str, &Run)], has_level: bool) -> Fallible<Vec<Panel>> {
        let t = &self.field.times;
        let mut levels = vec![measured("measured", t, smoothed(&self.level, 2))];
        let mut flows = vec![
            input(1, "calculated of the pump", t, per(self.field.column("q_boost"), LPM)),
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
    pub(crate) fn missing(&self) -> Vec<f64> {
        let [q, boost, fill] = ["q_ssp", "q_boost", "q_tf"].map(|name| self.field.column(name));
        let rise = slopes(&self.field.times, &self.level, 10);
        (0..q.len()).map(|k| self.theta_1 * q[k] - boost[k] - fill[k] - A_R * rise[k]).collect()
    }

    /// What must have come out of the booster line.
    pub(crate) fn delivered(&self) -> Vec<f64> {
        let missing = self.missing();
        missing.iter().zip(self.field.column("q_boost")).map(|(q, boost)| q + boost).collect()
    }
}
