//! The table of cases.

use crate::discovery::Examination;
use crate::lines::Lines;
use crate::simulation::{Simulation, USUAL};

/// A computation whose results are compared between platforms.
#[derive(Debug)]
pub struct Case {
    /// Its name.
    pub name: &'static str,
    /// Whether it takes minutes.
    pub is_long: bool,
    work: Work,
}

#[derive(Debug)]
enum Work {
    Simulate(Simulation),
    Discover(Examination),
}

impl Case {
    const fn simulation(name: &'static str, simulation: Simulation) -> Self {
        Self { name, is_long: false, work: Work::Simulate(simulation) }
    }

    const fn discovery(name: &'static str, is_long: bool, examination: Examination) -> Self {
        Self { name, is_long, work: Work::Discover(examination) }
    }

    /// Computes its lines, which begin with its name.
    pub fn lines(&self) -> String {
        let mut lines = Lines::default();
        lines.text("case", self.name);
        match &self.work {
            Work::Simulate(simulation) => simulation.add_to(&mut lines),
            Work::Discover(examination) => examination.add_to(&mut lines),
        }
        lines.into_text()
    }
}

/// All cases.
pub const CASES: &[Case] = &[
    Case::simulation(
        "every function of the language, by an explicit method",
        Simulation {
            model: "every_intrinsic.dgd",
            until: 8.0,
            method: "tsit5",
            observed: false,
            ..USUAL
        },
    ),
    Case::simulation(
        "held and linear inputs",
        Simulation {
            model: "mud_circulation.dgd",
            inputs: "time,w_ssp,q_boost,q_tf
                     0,50,1500,200
                     60,50,1500,200
                     61,60,1500,200
                     300,60,1800,250
                     600,60,1500,250",
            until: 600.0,
            ..USUAL
        },
    ),
    Case::simulation(
        "an ignition",
        Simulation {
            model: "cstr.dgd",
            inputs: "time,q_f,T_c\n0,100,26.85\n60,100,31.85\n600,100,31.85",
            until: 600.0,
            // Thermal runaway amplifies earlier changes: on one machine, the last digit of `UA` moves d(T)/d(UA) by
            // 3.4e-12.
            close: 1e-11,
            ..USUAL
        },
    ),
    Case::simulation(
        "stiff kinetics by backward differentiation",
        Simulation { model: "robertson.dgd", until: 1e4, method: "bdf", ..USUAL },
    ),
    Case::simulation(
        "stiff kinetics with a balance",
        Simulation { model: "robertson.dgd", variants: &[("form", "dae")], until: 1e4, ..USUAL },
    ),
    Case::simulation(
        "an equation that gives a diode's voltage",
        Simulation {
            model: "rc_circuit.dgd",
            inputs: "time,v_s\n0,0\n0.005,5\n0.015,-5\n0.025,5",
            until: 0.025,
            ..USUAL
        },
    ),
    Case::simulation(
        "index 2",
        Simulation {
            model: "rigid_tanks.dgd",
            inputs: "time,q_in,path\n0,300,0\n50,600,0.3\n100,100,0.1",
            until: 100.0,
            ..USUAL
        },
    ),
    Case::simulation(
        "index 3, with states that change",
        Simulation { model: "pendulum_cartesian.dgd", until: 3.0, ..USUAL },
    ),
    Case::simulation(
        "modes with a reset and a condition on time",
        Simulation {
            model: "tank_with_weir.dgd",
            inputs: "time,q_in\n0,6\n1500,6\n1600,0\n6000,0\n6100,8\n9000,8",
            until: 9000.0,
            ..USUAL
        },
    ),
    Case::simulation(
        "sticking, slipping, saturation and a counter",
        Simulation {
            model: "dragged_load.dgd",
            inputs: "time,speed\n0,0.2\n10,0.2",
            until: 10.0,
            ..USUAL
        },
    ),
    Case::simulation(
        "a law that jumps",
        Simulation {
            model: "pipe_flow.dgd",
            inputs: "time,dp\n0,1\n10,1\n15,0.1\n40,0.1",
            until: 40.0,
            ..USUAL
        },
    ),
    Case::simulation(
        "delays that can be fitted",
        Simulation {
            model: "delayed_sensor.dgd",
            inputs: "time,q_pump,heat\n-100,300,0\n30,300,20\n60,360,20\n120,240,5\n300,240,5",
            until: 200.0,
            ..USUAL
        },
    ),
    Case::simulation(
        "a delay that varies, of unknowns",
        Simulation {
            model: "remote_level.dgd",
            inputs: "time,q_out\n0,300\n60,300\n70,360\n200,360",
            until: 200.0,
            // The number of steps, and with it an error of the size of the tolerance, depends on the last digits: on
            // one machine, the last digit of `gain` makes 375 of 376 steps and moves d(h)/d(tau_radio) by 8.0e-8.
            close: 2e-7,
            ..USUAL
        },
    ),
    Case::simulation(
        "arrays, by an implicit Runge–Kutta method",
        Simulation {
            model: "transmission_line.dgd",
            inputs: "time,q_in,p_out\n0,0.0333333,10\n1,0.03,10\n2,0.03,12\n10,0.03,12",
            until: 5.0,
            method: "kencarp4",
            ..USUAL
        },
    ),
    Case::simulation(
        "models inside a model",
        Simulation {
            model: "controlled_level.dgd",
            inputs: "time,demand\n0,7\n10,9\n400,9",
            until: 400.0,
            ..USUAL
        },
    ),
    Case::discovery(
        "a booster pump that stops, with its effect alone",
        false,
        Examination { until: 600.0, effects: &["column_with_momentum"] },
    ),
    Case::discovery(
        "a booster pump that stops",
        true,
        Examination { until: f64::INFINITY, effects: &[] },
    ),
];
