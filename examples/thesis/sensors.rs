//! Section 3.3.1: which pressures are to be believed, at no flow.

use crate::field::{BAR, Field, G, H_IN, H_OUT, H_PR, P_ATM, RHO, mean};
use crate::page::{Finding, Section, claim, less, measured, over_time, panel, per};

/// Figs 3.3 and 3.4.
pub(crate) fn screen(no_flow: &Field) -> Section {
    let t = &no_flow.times;
    let absolute =
        |name: &str| -> Vec<f64> { no_flow.column(name).iter().map(|p| p + P_ATM).collect() };
    let (a, b) = (absolute("p_in_A"), absolute("p_in_B"));
    let riser = no_flow.column("p_r");
    // The inlet lies h_in − h_pr deeper than the riser's gauge.
    let deeper: Vec<f64> = riser.iter().map(|p| p + RHO * G * (H_IN - H_PR)).collect();
    let (off_a, off_b) = (less(&a, &deeper), less(&b, &deeper));
    // Of a mean of 801 readings nothing is left below a tenth of a millibar.
    let offsets =
        [mean(&off_a), mean(&off_b)].map(|offset| (offset / BAR * 1e4).round() / 1e4 + 0.0);
    let is_off = claim(
        (offsets[1] - 0.5).abs() < 0.01 && offsets[0].abs() < 0.01,
        format!("Inlet A is right and B 0.5 bar off: {offsets:.4?} bar."),
    );
    let inlet = Finding {
        number: "3.3",
        title: "Inlet and riser pressures at no flow, and how far the inlet's are off",
        thesis: "With 2 m of mud between, 0.22 bar, inlet A agrees with the riser's gauge; B is 0.5 bar off and not used.",
        here: format!(
            "Inlet A is off by {:.4} bar and B by {:.4} bar, means of {} samples. B is not used.",
            offsets[0],
            offsets[1],
            t.len()
        ),
        claims: vec![is_off],
        figure: over_time(vec![
            panel(
                "Pressures",
                "bara",
                vec![
                    measured("inlet A", t, per(&a, BAR)),
                    measured("inlet B", t, per(&b, BAR)),
                    measured("riser", t, per(riser, BAR)),
                ],
            ),
            panel(
                "Inlet less riser and 2 m of mud",
                "bar",
                vec![
                    measured("inlet A", t, per(&off_a, BAR)),
                    measured("inlet B", t, per(&off_b, BAR)),
                ],
            ),
        ]),
    };

    let (a, b) = (absolute("p_out_A"), absolute("p_out_B"));
    let average: Vec<f64> = no_flow.outlet().iter().map(|p| p + P_ATM).collect();
    let weight = P_ATM + RHO * G * H_OUT;
    let off = [&a, &b, &average].map(|p| (mean(p) - weight) / BAR);
    let average_right = claim(
        off[2].abs() < 0.01 && off[0].abs() > 0.03 && off[1].abs() > 0.03,
        format!("The outlet's sensors differ and their mean is right: {off:.4?} bar."),
    );
    let outlet = Finding {
        number: "3.4",
        title: "Outlet pressures at no flow, and the weight of a full return line",
        thesis: "A and B differ; their average is the weight of the line, and is used.",
        here: format!(
            "A is off by {:.3} bar, B by {:.3} bar, their average by {:.4} bar. The average is used.",
            off[0], off[1], off[2]
        ),
        claims: vec![average_right],
        figure: over_time(vec![panel(
            "Pressures at the pump's outlet",
            "bara",
            vec![
                measured("outlet A", t, per(&a, BAR)),
                measured("outlet B", t, per(&b, BAR)),
                measured("average", t, per(&average, BAR)),
                crate::page::computed("ρ g h_out", t, vec![weight / BAR; t.len()]),
            ],
        )]),
    };
    Section { title: "3.3 Measurements", findings: vec![inlet, outlet] }
}
