//! Section 3.3.1: which pressures are to be believed, at no flow.

use crate::claims::claim;
use crate::field::{BAR, Field, G, H_IN, H_OUT, H_PR, P_ATM, RHO, mean};
use crate::page::{Finding, Section, computed, less, over_time, panel, per, sensor};

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
    let gauge = mean(riser) / BAR;
    let claims = vec![
        claim(
            offsets[0].abs() < 0.01,
            "Inlet A agrees with the riser's gauge and 2 m of mud",
            "agrees",
            format!("{:.4} bar off", offsets[0]),
        ),
        claim(
            (offsets[1] - 0.5).abs() < 0.01,
            "Inlet B does not",
            "0.5 bar off",
            format!("{:.4} bar off", offsets[1]),
        ),
        claim(
            (gauge - 33.85).abs() < 0.2,
            "The riser balances the return line",
            "33.85 bara at its gauge",
            format!("{gauge:.2} bara"),
        ),
    ];
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
        claims,
        figure: over_time(vec![
            panel(
                "Pressures",
                "bara",
                vec![
                    sensor("inlet A", t, per(&a, BAR)),
                    sensor("inlet B", t, per(&b, BAR)),
                    sensor("riser", t, per(riser, BAR)),
                ],
            ),
            panel(
                "Inlet less riser and 2 m of mud",
                "bar",
                vec![
                    sensor("inlet A", t, per(&off_a, BAR)),
                    sensor("inlet B", t, per(&off_b, BAR)),
                ],
            ),
        ]),
    };

    let (a, b) = (absolute("p_out_A"), absolute("p_out_B"));
    let average: Vec<f64> = no_flow.outlet().iter().map(|p| p + P_ATM).collect();
    let weight = P_ATM + RHO * G * H_OUT;
    let off = [&a, &b, &average].map(|p| (mean(p) - weight) / BAR);
    let claims = vec![
        claim(
            off[0] * off[1] < 0.0 && (0.03..0.2).contains(&off[0].abs().min(off[1].abs())),
            "Outlets A and B differ somewhat, to either side",
            "they differ",
            format!("{:.3} and {:.3} bar off", off[0], off[1]),
        ),
        claim(
            off[2].abs() < 0.01,
            "Their average is the weight of a full return line",
            "ρ g h_out",
            format!("{:.4} bar off", off[2]),
        ),
    ];
    let outlet = Finding {
        number: "3.4",
        title: "Outlet pressures at no flow, and the weight of a full return line",
        thesis: "A and B differ; their average is the weight of the line, and is used.",
        here: format!(
            "A is off by {:.3} bar, B by {:.3} bar, their average by {:.4} bar. The average is used.",
            off[0], off[1], off[2]
        ),
        claims,
        figure: over_time(vec![panel(
            "Pressures at the pump's outlet",
            "bara",
            vec![
                sensor("outlet A", t, per(&a, BAR)),
                sensor("outlet B", t, per(&b, BAR)),
                sensor("average", t, per(&average, BAR)),
                computed("ρ g h_out", t, vec![weight / BAR; t.len()]),
            ],
        )]),
    };
    Section { title: "3.3 Measurements", findings: vec![inlet, outlet] }
}
