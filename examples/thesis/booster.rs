//! Section 3.7: U-tubing in the booster line.

use dgd_plot::{PlotSeries, SeriesMeaning};

use crate::chapters::Fallible;
use crate::claims::claim;
use crate::field::{A_B, Field, G, H_PR, LPM, P_ATM, RHO, mean, smoothed};
use crate::model::Run;
use crate::page::{Finding, Section, computed, ends, input, measured, over_time, panel, per};
use crate::riser::Riser;
use crate::verification::LEVEL;

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

/// The stop, with what all figures compare with.
struct Stop {
    riser: Riser,
    /// The level without U-tubing, and how far it is off at most, m.
    none: Run,
    without: f64,
    end: f64,
}

/// Figs 3.14 to 3.19, and the outlet's constants.
pub(crate) fn identify(restarts: &Field, theta_1: f64) -> Fallible<(Section, Booster)> {
    let field = restarts.between(STOP.0, STOP.1);
    let level = field.column("p_r").iter().map(|p| H_PR - (p - P_ATM) / (RHO * G)).collect();
    let end = field.len() as f64;
    let riser = Riser { field, theta_1, level };
    let none = riser.run("none", &[])?;
    let without = riser.error(&none, 0.0, end)?;
    let stop = Stop { riser, none, without, end };
    let missing = stop.missing_flow()?;
    let (column, of_column) = stop.column()?;
    let (weighted, of_weighted) = stop.weighted(of_column)?;
    let names = ["tau_d", "tau_b", "theta_i"];
    let [tau_d, tau_b, theta_i] = stop.riser.fitted("outlet", names)?;
    let booster = Booster { tau_d, tau_b, theta_i };
    let findings = vec![
        missing,
        column,
        weighted,
        stop.ramp_down(booster)?,
        stop.ramp_up(booster)?,
        stop.both(booster, of_weighted)?,
    ];
    Ok((Section { title: "3.7 U-tubing", findings }, booster))
}

/// How far the line drains, m, and the riser's level then.
fn lowest(run: &Run) -> Fallible<(f64, f64)> {
    let levels = run.unknown("h_b")?;
    let deepest = ends(&levels).1;
    let at = levels.iter().position(|level| *level == deepest).unwrap_or_default();
    Ok((deepest, run.unknown("h_r")?[at]))
}

impl Stop {
    /// Fig 3.14.
    fn missing_flow(&self) -> Fallible<Finding> {
        let Stop { riser, none, without, .. } = self;
        let t = &riser.field.times;
        let missing = riser.missing();
        let stopped = t.partition_point(|t| *t < RESTART);
        let drained: f64 = missing[..stopped].iter().sum();
        let drop = drained / A_B;
        let uncounted: f64 = missing.iter().sum();
        // From when the pump is ramped down until a minute later; levels count downwards.
        let pump = riser.field.column("q_boost");
        let begin = pump.iter().position(|q| *q < 0.95 * pump[0]).unwrap_or_default();
        let rises = |level: &[f64]| level[begin + 60] - level[begin];
        let (computed_rise, read_rise) =
            (rises(&none.unknown("h_r")?), rises(&smoothed(&riser.level, 5)));
        let claims = vec![
            claim(
                (140.0..180.0).contains(&drop),
                "The missing flow drops the column in the line",
                "roughly 160 m",
                format!("{drop:.0} m"),
            ),
            claim(
                uncounted > 0.5,
                "More comes out on ramp-up than is calculated to go in",
                "exceeds the calculated flow",
                format!("{uncounted:.2} m³ more in all"),
            ),
            claim(
                computed_rise > 2.0 && read_rise < 0.3 * computed_rise,
                "Without U-tubing the estimated h_r rises at once, and the real one does not",
                "the real level stays",
                format!("within a minute {computed_rise:.1} m, read {read_rise:.1} m"),
            ),
        ];
        let q_ssp = measured("q_ssp", t, per(riser.field.column("q_ssp"), LPM));
        let of = |place, name: &str| input(place, name, t, per(riser.field.column(name), LPM));
        let not_counted = PlotSeries {
            meaning: SeriesMeaning::Variant(1),
            ..computed("missing, 3.10", t, per(&missing, LPM))
        };
        let mut panels = riser.panels(&[("without U-tubing", none)], false)?;
        panels.truncate(1);
        let flows = vec![q_ssp, of(1, "q_boost"), of(2, "q_tf"), not_counted];
        panels.push(panel("Flows", "lpm", flows));
        Ok(Finding {
            number: "3.14",
            title: "U-tubing: the flow that the level misses",
            thesis: "The flow that keeps the measured level drops the column in the booster line by roughly 160 m. \
                     The level is about 21 %, which is 240 m.",
            here: format!(
                "Until the pump is started again {drained:.2} m³ are missing, a column of {drop:.0} m. When the line \
                 is full again {uncounted:.2} m³ are: nobody has counted what filled the most of it. Without U-tubing \
                 the level is off by up to {without:.1} m, {:.2} % of {LEVEL} m; it lies near {:.0} m, {:.0} %.",
                100.0 * without / LEVEL,
                riser.level[0],
                100.0 * riser.level[0] / LEVEL
            ),
            claims,
            figure: over_time(panels),
        })
    }

    /// Fig 3.15, and how far that is off, m.
    fn column(&self) -> Fallible<(Finding, f64)> {
        let Stop { riser, without, end, .. } = self;
        let column = riser.run("column", &[("M_b", 4e7), ("F_b", 6e7)])?;
        let [down, up] =
            [riser.error(&column, 0.0, RESTART)?, riser.error(&column, RESTART, *end)?];
        let (in_line, in_riser) = lowest(&column)?;
        let claims = vec![
            claim(
                down < 0.5 * without,
                "It is not far off on ramp-down",
                "not far off",
                format!("{down:.1} m off, without U-tubing {without:.1} m"),
            ),
            claim(
                up > 1.5 * down,
                "It is far off on ramp-up",
                "deviates greatly",
                format!("{up:.1} m off"),
            ),
            claim(
                (in_line - in_riser).abs() < 0.03 * in_riser,
                "The line drains to equilibrium with the riser",
                "levels become equal",
                format!("{in_line:.0} m, riser {in_riser:.0} m"),
            ),
        ];
        let finding = Finding {
            number: "3.15",
            title: "The column of the booster line, 3.11",
            thesis: "With M_b 4·10⁷ kg/m⁴ and F_b 6·10⁷ Pa s/m³ by hand it is not far off on ramp-down and far off on ramp-up.",
            here: format!(
                "With these numbers the level is off by up to {down:.1} m on ramp-down and {up:.1} m on ramp-up; without U-tubing by {without:.1} m."
            ),
            claims,
            figure: over_time(riser.panels(&[("3.11", &column)], true)?),
        };
        Ok((finding, down.max(up)))
    }

    /// Fig 3.16, and how far that is off, m.
    fn weighted(&self, of_column: f64) -> Fallible<(Finding, f64)> {
        let Stop { riser, end, .. } = self;
        let names = ["F_b", "theta_hb", "theta_b"];
        let [friction, theta_hb, theta_b] = riser.fitted("weighted", names)?;
        let settings = [("F_b", friction), ("theta_hb", theta_hb), ("theta_b", theta_b)];
        let weighted = riser.run("weighted", &settings)?;
        let error = riser.error(&weighted, 0.0, *end)?;
        let (in_line, in_riser) = lowest(&weighted)?;
        let above = in_riser - in_line;
        let before = riser.field.times.partition_point(|t| *t < RESTART);
        let out = weighted.unknown("q_bo")?;
        let more = out.iter().zip(riser.field.column("q_boost")).skip(before);
        let exceeds = more.fold(0.0, |most: f64, (out, pump)| most.max(out - pump)) / LPM;
        let claims = vec![
            claim(
                (1.3..2.0).contains(&theta_hb) && (2.0..5.0).contains(&theta_b),
                "Both weights, θ_hb and θ_b, are well above 1",
                "1.5 and 3.6",
                format!("{theta_hb:.2} and {theta_b:.2}"),
            ),
            claim(
                error < 0.5 * of_column,
                "The level fits, better than by 3.11",
                "fits",
                format!("{error:.1} m off, by 3.11 {of_column:.1} m"),
            ),
            claim(
                above > 50.0,
                "The line stops short of equilibrium",
                "80 m above the riser's level",
                format!("{above:.0} m above it"),
            ),
            claim(
                exceeds > 10.0,
                "On ramp-up more flows out than is calculated",
                "exceeds it clearly",
                format!("by up to {exceeds:.0} lpm"),
            ),
        ];
        let finding = Finding {
            number: "3.16",
            title: "The column with two weights, 3.12",
            thesis: "θ_hb = 1.5 and θ_b = 3.6 fit the level, and the physics fade.",
            here: format!(
                "θ_hb = {theta_hb:.2} and θ_b = {theta_b:.2} fit best, with F_b = {:.1}·10⁷ Pa s/m³. The level is off by up to {error:.1} m.",
                friction / 1e7
            ),
            claims,
            figure: over_time(riser.panels(&[("3.12", &weighted)], true)?),
        };
        Ok((finding, error))
    }

    /// The level by 3.13 and 3.14.
    fn outlet(&self, tau_d: f64, tau_b: f64, theta_i: f64) -> Fallible<Run> {
        self.riser.run("outlet", &[("tau_d", tau_d), ("tau_b", tau_b), ("theta_i", theta_i)])
    }

    /// Fig 3.17.
    fn ramp_down(&self, Booster { tau_d, tau_b, theta_i }: Booster) -> Fallible<Finding> {
        let riser = &self.riser;
        let lag = self.outlet(0.0, tau_d + tau_b, theta_i)?;
        let delayed = self.outlet(30.0, 10.0, theta_i)?;
        let [of_lag, of_delayed] =
            [riser.error(&lag, 0.0, RESTART)?, riser.error(&delayed, 0.0, RESTART)?];
        let (below, above) = ends(&riser.errors(&lag, 0.0, RESTART)?);
        let claims = vec![
            claim(
                of_delayed < of_lag,
                "A delay and a lag are better than a lag alone",
                "30 s and 10 s fit, 40 s do not",
                format!("{of_delayed:.1} m off, a lag of {:.0} s {of_lag:.1} m", tau_d + tau_b),
            ),
            claim(
                above > 1.0 && above > -3.0 * below,
                "By the lag alone h_r rises too early",
                "rises before the measured one",
                format!("up to {above:.1} m ahead, {:.1} m behind", -below),
            ),
        ];
        Ok(Finding {
            number: "3.17",
            title: "Ramp-down as a lag, and as a delay and a lag, 3.13",
            thesis: "By a lag of 40 s alone the level rises before the measured one does; a delay of 30 s and a lag of 10 s fit.",
            here: format!(
                "On ramp-down a lag of {:.0} s alone is off by up to {of_lag:.1} m, the thesis' delay and lag by {of_delayed:.1} m.",
                tau_d + tau_b
            ),
            claims,
            figure: over_time(riser.panels(&[("lag", &lag), ("30 s and 10 s", &delayed)], false)?),
        })
    }

    /// Fig 3.18.
    fn ramp_up(&self, Booster { tau_d, tau_b, theta_i }: Booster) -> Fallible<Finding> {
        let Stop { riser, end, .. } = self;
        let growths = [0.6, 1.0, 1.4].map(|factor| factor * theta_i);
        let runs: Vec<Run> = growths
            .iter()
            .map(|growth| self.outlet(tau_d, tau_b, *growth))
            .collect::<Fallible<_>>()?;
        let titles = growths.map(|growth| format!("{growth:.3} 1/s"));
        let shown: Vec<(&str, &Run)> = titles.iter().map(String::as_str).zip(&runs).collect();
        let mut errors = Vec::new();
        let mut sides = Vec::new();
        for run in &runs {
            errors.push(riser.rms(run, RESTART, *end)?);
            sides.push(mean(&riser.errors(run, RESTART, *end)?));
        }
        let claims = vec![
            claim(
                errors[1] < errors[0] && errors[1] < errors[2],
                "Of three growths the one in the middle is best",
                "0.05 of 0.03, 0.05 and 0.07 1/s",
                format!("{:.2}, {:.2}, {:.2} m off", errors[0], errors[1], errors[2]),
            ),
            claim(
                sides[0] > sides[1] && sides[1] > sides[2],
                "The faster the growth, the fuller the riser",
                "in this order",
                format!("{:.2}, {:.2}, {:.2} m too low", sides[0], sides[1], sides[2]),
            ),
        ];
        Ok(Finding {
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
            claims,
            figure: over_time(riser.panels(&shown, false)?),
        })
    }

    /// Fig 3.19.
    fn both(&self, booster: Booster, of_weighted: f64) -> Fallible<Finding> {
        let Stop { riser, without, end, .. } = self;
        let Booster { tau_d, tau_b, theta_i } = booster;
        let run = self.outlet(tau_d, tau_b, theta_i)?;
        let with = riser.error(&run, 0.0, *end)?;
        let claims = vec![
            claim(
                *without > 4.0 * with,
                "Without U-tubing the level is four times as far off or more",
                "five times",
                format!("{:.1} times, {without:.1} and {with:.1} m", without / with),
            ),
            claim(
                with < of_weighted,
                "3.13 and 3.14 are better than 3.12",
                "better",
                format!("{with:.2} and {of_weighted:.2} m off"),
            ),
            claim(
                (20.0..35.0).contains(&tau_d) && (8.0..20.0).contains(&tau_b),
                "τ_d and τ_b on ramp-down",
                "30 s and 10 s",
                format!("{tau_d:.0} s and {tau_b:.0} s"),
            ),
            claim(
                (0.04..0.07).contains(&theta_i),
                "θ_i on ramp-up",
                "0.05 1/s",
                format!("{theta_i:.3} 1/s"),
            ),
        ];
        Ok(Finding {
            number: "3.19",
            title: "Ramp-down and ramp-up together, 3.13 and 3.14",
            thesis: "Level and flow follow what was measured.",
            here: format!(
                "τ_d = {tau_d:.0} s, τ_b = {tau_b:.0} s and θ_i = {theta_i:.4} 1/s by output error: the level is off by up to {with:.1} m, without U-tubing by {without:.1} m."
            ),
            claims,
            figure: over_time(riser.panels(&[("3.13, 3.14", &run)], false)?),
        })
    }
}
