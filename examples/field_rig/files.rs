//! Recordings and the truth about them, as they go to files.

use std::fmt::Write;

use super::drilling_rig::plant::{A_B, A_R, G, H_IN, H_OUT, H_PR, L_B, LPM, P_ATM, RHO};
use super::plant::{Plant, Suction};
use super::schedule::{Course, Drive, Fitting, Schedule};
use super::{Recording, Rig};

/// Columns of a recording: Table 3.2, pressures from both of the redundant sensors.
pub(crate) const RECORDING: &str = "time [s],p_r [bara],p_in_A [barg],p_in_B [barg],\
     p_out_A [barg],p_out_B [barg],q_ssp [lpm],q_boost [lpm],q_tf [lpm],w_ssp [%]";

/// Columns of what was true at the same moments.
pub(crate) const TRUTH: &str = "time [s],h_r [m],h_b [m],q_ssp [lpm],q_bo [lpm],q_pumped [lpm],\
     q_tf [lpm],w [%],p_b [barg],p_r [bara],p_in [barg],p_out [barg]";

impl Recording {
    /// The text of the recording's file.
    pub(crate) fn csv(&self) -> String {
        let mut text = format!("{RECORDING}\n");
        for (time, row) in self.rows.iter().enumerate() {
            let ([in_a, in_b], [out_a, out_b]) = (row.p_in, row.p_out);
            // As many decimals as the counts have.
            writeln!(
                text,
                "{time},{:.2},{in_a:.2},{in_b:.2},{out_a:.2},{out_b:.2},{:.0},{:.0},{:.0},{:.1}",
                row.p_r,
                row.q_ssp + 0.0,
                row.q_boost,
                row.q_tf,
                row.w_ssp
            )
            .expect("a string takes all text");
        }
        text
    }

    /// The text of the truth's file: a tenth of what a sensor would see, or finer.
    pub(crate) fn truth_csv(&self) -> String {
        let mut text = format!("{TRUTH}\n");
        for (time, row) in self.truth.iter().enumerate() {
            let s = &row.state;
            let (lpm, bar) = (|q: f64| q / LPM, |p: f64| p / 1e5);
            writeln!(
                text,
                "{time},{:.3},{:.3},{:.1},{:.1},{:.1},{:.1},{:.2},{:.3},{:.3},{:.3},{:.3}",
                s.h_r,
                s.h_b,
                lpm(s.q_ssp),
                lpm(s.q_bo),
                lpm(row.pumped),
                lpm(row.top_fill),
                100.0 * s.speed,
                bar(s.p_b),
                bar(P_ATM + row.pressures.riser),
                bar(row.pressures.inlet),
                bar(row.pressures.outlet)
            )
            .expect("a string takes all text");
        }
        text
    }
}

/// Everything that was put into the recordings, as JSON.
pub(crate) fn truth_json(schedules: &[Schedule]) -> String {
    let Rig { plant, instruments: i, control, unrest } = Rig::field();
    let bar = |p: f64| p / 1e5;
    let [in_a, in_b, out_a, out_b] = i.offsets.map(bar);
    let pipe = |p: &super::plant::Pipe| {
        object(&[
            ("length [m]", p.length),
            ("diameter [m]", p.diameter),
            ("roughness [m]", p.roughness),
            ("minor_losses [1], over rho v^2/2", p.minor_losses),
            ("mud_viscosity [Pa*s]", p.viscosity),
        ])
    };
    let sections = [
        (
            "geometry",
            object(&[
                ("rho [kg/m^3]", RHO),
                ("g [m/s^2]", G),
                ("p_atm [Pa]", P_ATM),
                ("h_in [m]", H_IN),
                ("h_out [m]", H_OUT),
                ("h_pr [m]", H_PR),
                ("A_r [m^2]", A_R),
                ("A_b [m^2]", A_B),
                ("l_bo [m]", L_B),
            ]),
        ),
        (
            "subsea_pump",
            object(&[
                ("c0 [m]", plant.c0),
                ("k [1]", plant.exponent),
                ("c2 [s^2/m^5]", plant.c2),
                ("speed_lag [s]", plant.speed_lag),
            ]),
        ),
        ("return_line", pipe(&plant.return_line)),
        ("booster_line", pipe(&plant.booster_line)),
        ("booster_pump", object(&booster_pump(&plant))),
        ("booster_line_refitted", object(&refitted(&Rig::refitted().plant))),
        (
            "sensors",
            object(&[
                ("p_in_A offset [bar]", in_a),
                ("p_in_B offset [bar]", in_b),
                ("p_out_A offset [bar]", out_a),
                ("p_out_B offset [bar]", out_b),
                ("pressure noise [bar]", bar(i.pressure_noise)),
                ("pressure count [bar]", bar(i.pressure_count)),
                ("theta_1 [1], true over recorded return flow", i.theta_1),
                ("q_ssp time constant [s]", i.damping),
                ("q_ssp white noise [lpm]", i.flow_white / LPM),
                ("q_ssp coloured noise [lpm]", i.flow_coloured / LPM),
                ("q_ssp correlation time [s]", i.flow_correlation),
                ("q_ssp cut-off [lpm]", i.cut_off / LPM),
                ("q_tf noise [lpm]", i.top_fill_noise / LPM),
                ("q_tf unrest, true [lpm]", unrest / LPM),
                ("flow count [lpm]", i.flow_count / LPM),
                ("w_ssp count [%]", 100.0 * i.speed_count),
            ]),
        ),
        (
            "controller",
            object(&[
                ("K_p [%/bar]", 1e7 * control.gain),
                ("T_i [s]", control.integral_time),
                ("filter [s]", control.filter),
                ("least flow [lpm]", control.least_flow / LPM),
                ("highest speed [%]", 100.0 * control.high),
            ]),
        ),
    ];
    let mut text = String::from("{\n");
    for (name, section) in sections {
        write!(text, "  {name:?}: {section},\n\n").expect("a string takes all text");
    }
    let recordings: Vec<String> = schedules.iter().map(recording_json).collect();
    write!(text, "  \"recordings\": {{\n{}\n  }}\n}}\n", recordings.join(",\n"))
        .expect("a string takes all text");
    text
}

/// The booster pump and what it sucks from.
fn booster_pump(plant: &Plant) -> Vec<(&'static str, f64)> {
    let mut entries = vec![("bulk_modulus_of_the_line [Pa]", plant.bulk_modulus)];
    entries.extend(match plant.suction {
        Suction::Tank { missing, pressure } => [
            ("missing_share_at_0_barg [1]", missing),
            ("pressure_over_which_it_decays [bar]", pressure / 1e5),
        ],
        Suction::ChargePump { through, pressure } => [
            ("uncounted_flow_at_0_barg [lpm]", through / LPM),
            ("pressure_of_the_charge_pump [bar]", pressure / 1e5),
        ],
    });
    entries
}

/// The booster line and its pump as they were refitted, in what is not as it was.
fn refitted(plant: &Plant) -> Vec<(&'static str, f64)> {
    let mut entries = vec![("minor_losses [1], over rho v^2/2", plant.booster_line.minor_losses)];
    if let Some(valve) = plant.outlet {
        entries.push(("spring_of_the_outlet_valve [bar]", valve.spring / 1e5));
        entries.push(("flow_that_lifts_its_disc [lpm]", valve.full_lift / LPM));
    }
    entries.extend(booster_pump(plant));
    entries
}

fn object(entries: &[(&str, f64)]) -> String {
    let lines: Vec<String> = entries
        .iter()
        .map(|(name, value)| format!("\n    {name:?}: {}", six_digits(*value)))
        .collect();
    format!("{{{}\n  }}", lines.join(","))
}

/// A number that was calculated from others, without their last bits.
fn six_digits(value: f64) -> f64 {
    format!("{value:.5e}").parse().expect("a number reads back")
}

fn recording_json(schedule: &Schedule) -> String {
    let course = |course: &Course| {
        let changes: Vec<String> =
            course.changes.iter().map(|c| format!("[{}, {}, {}]", c.at, c.within, c.to)).collect();
        format!("{{\"first\": {}, \"changes\": [{}]}}", course.first, changes.join(", "))
    };
    let drive = match &schedule.drive {
        Drive::Manual(percent) => format!("\"w_ssp [%], by hand\": {}", course(percent)),
        Drive::Pressure(above) => {
            format!("\"set point of p_r [bar], above the first\": {}", course(above))
        }
    };
    let Schedule { name, about, fitting, seconds, level, boost, top_fill, .. } = schedule;
    let line = match fitting {
        Fitting::AsBuilt => "as built",
        Fitting::Refitted => "refitted",
    };
    format!(
        "    {name:?}: {{\n      \"about\": {about:?},\n      \"booster line\": {line:?},\n      \"seconds\": {seconds},\n      \
         \"h_r at the start [m]\": {level},\n      \
         \"changes\": \"at [s], within [s], to\",\n      \
         \"q_boost [lpm], calculated\": {},\n      \"q_tf [lpm]\": {},\n      {drive}\n    }}",
        course(boost),
        course(top_fill)
    )
}
