//! What can be hidden in a rig.

use super::Rig;
use super::plant::{Ageing, BoosterLine, Influx, LPM, Step, Valve};
use super::random::Random;

/// Speed at which pumps of different exponents have the same head, of the maximum.
const COMMON_SPEED: f64 = 0.52;
/// Flow at which friction of the fourth order takes the place of quadratic friction, m³/s.
const COMMON_FLOW: f64 = 2400.0 * LPM;

/// An effect and how large it is, in SI units unless said.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Effect {
    /// The booster line drains while its pump is slow, and must be filled before it delivers again.
    BoosterUTubing { inertia: f64, friction: f64 },
    /// True return flow over recorded.
    FlowMeterGain { theta: f64 },
    /// What the return flow meter reads without a flow.
    FlowMeterOffset { flow: f64 },
    /// How late the return flow meter reads.
    FlowMeterDelay { delay: f64 },
    /// True booster flow over recorded.
    BoosterFlowGain { gain: f64 },
    /// Flow from the well into the riser.
    WellInflux { flow: f64, onset: f64 },
    /// Flow from the riser into the well.
    MudLoss { flow: f64, onset: f64 },
    /// Flow from the riser into the well for a while.
    PassingLoss { flow: f64, begins: f64, ends: f64 },
    /// Exponent of the speed in the pump's head.
    PumpSpeedExponent { exponent: f64 },
    /// Time constant with which the pump follows its reference.
    PumpSpeedLag { lag: f64 },
    /// What the riser's gauge reads too much; the controller believes it.
    PressureSensorOffset { pressure: f64 },
    /// How late the recorder stamps the pressures; the controller has them in time.
    ClockShift { late: f64 },
    /// Share of the return line's friction that grows with the fourth power of the flow.
    FrictionHigherOrder { share: f64 },
    /// Share of the shut-off head that the pump loses in a second.
    PumpWear { rate: f64 },
    /// Cuttings raise the return line's friction by a share.
    ReturnLinePlugging { share: f64, onset: f64 },
    /// Mud of another density is everywhere, kg/m³.
    DensityChange { step: f64, onset: f64 },
    /// True top fill over recorded.
    TopFillGain { gain: f64 },
    /// What the riser's gauge reads more each second, Pa/s; the controller believes it.
    PressureSensorDrift { rate: f64 },
    /// The riser's gauge moves only when it is further off than that; the controller believes it.
    StickingGauge { band: f64 },
    /// A valve in the return line is half shut for a while.
    HalfShutValve { share: f64, shuts: f64, opens: f64 },
    /// The return line's friction settles on another value.
    AgeingFriction { share: f64, time_constant: f64 },
}

/// Effects that the library beside the model has a name for.
pub(crate) const LIBRARY: [&str; 17] = [
    "booster_u_tubing",
    "flow_meter_gain",
    "flow_meter_offset",
    "flow_meter_delay",
    "booster_flow_gain",
    "well_influx",
    "mud_loss",
    "pump_speed_exponent",
    "pump_speed_lag",
    "pressure_sensor_offset",
    "clock_shift",
    "friction_higher_order",
    "pump_wear",
    "return_line_plugging",
    "density_change",
    "top_fill_gain",
    "pressure_sensor_drift",
];

/// Effects that no library has a name for.
pub(crate) const OUTSIDE: [&str; 3] = ["sticking_gauge", "half_shut_valve", "ageing_friction"];

/// Effects that are hidden two at a time.
pub(crate) const PAIRS: [[&str; 2]; 8] = [
    ["booster_u_tubing", "flow_meter_gain"],
    ["booster_u_tubing", "pump_speed_lag"],
    ["flow_meter_gain", "pump_speed_exponent"],
    ["well_influx", "flow_meter_delay"],
    ["pressure_sensor_offset", "booster_u_tubing"],
    ["mud_loss", "flow_meter_gain"],
    ["pump_wear", "flow_meter_offset"],
    ["booster_flow_gain", "return_line_plugging"],
];

/// Where the truth lists a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Place {
    Parameters,
    Sensors,
}

impl Effect {
    /// The effect of that name, with a size that an engineer would believe, in a recording of so
    /// many seconds.
    pub(crate) fn draw(name: &str, random: &mut Random, seconds: f64) -> Option<Self> {
        Some(match name {
            "booster_u_tubing" => Self::BoosterUTubing {
                inertia: random.between(3.8e7, 5.2e7),
                friction: random.between(5.2e7, 7.2e7),
            },
            "flow_meter_gain" => Self::FlowMeterGain { theta: 1.0 + random.either_sign(0.05, 0.1) },
            "flow_meter_offset" => {
                Self::FlowMeterOffset { flow: random.either_sign(60.0, 150.0) * LPM }
            }
            "flow_meter_delay" => Self::FlowMeterDelay { delay: random.between(10.0, 30.0) },
            "booster_flow_gain" => {
                Self::BoosterFlowGain { gain: 1.0 + random.either_sign(0.05, 0.1) }
            }
            "well_influx" => Self::WellInflux {
                flow: random.between(1.5e-3, 3.5e-3),
                onset: random.between(0.18, 0.4) * seconds,
            },
            "mud_loss" => Self::MudLoss {
                flow: random.between(1.5e-3, 3.5e-3),
                onset: random.between(0.18, 0.4) * seconds,
            },
            "passing_loss" => {
                let begins = random.between(0.2, 0.4) * seconds;
                let ends = begins + random.between(0.2, 0.4) * seconds;
                Self::PassingLoss { flow: random.between(1.5e-3, 3.5e-3), begins, ends }
            }
            "pump_speed_exponent" => {
                let steeper = random.chance(0.5);
                let (low, high) = if steeper { (2.4, 2.7) } else { (1.4, 1.7) };
                Self::PumpSpeedExponent { exponent: random.between(low, high) }
            }
            "pump_speed_lag" => Self::PumpSpeedLag { lag: random.between(8.0, 20.0) },
            "pressure_sensor_offset" => {
                Self::PressureSensorOffset { pressure: random.either_sign(0.2, 0.5) * 1e5 }
            }
            "clock_shift" => Self::ClockShift { late: random.between(8.0, 25.0) },
            "friction_higher_order" => {
                Self::FrictionHigherOrder { share: random.between(0.5, 0.8) }
            }
            "pump_wear" => Self::PumpWear { rate: random.between(0.08, 0.15) / seconds },
            "return_line_plugging" => Self::ReturnLinePlugging {
                share: random.between(0.2, 0.4),
                onset: random.between(0.18, 0.4) * seconds,
            },
            "density_change" => Self::DensityChange {
                step: random.either_sign(15.0, 35.0),
                onset: random.between(0.18, 0.4) * seconds,
            },
            "top_fill_gain" => Self::TopFillGain { gain: 1.0 + random.either_sign(0.3, 0.6) },
            "pressure_sensor_drift" => {
                Self::PressureSensorDrift { rate: random.either_sign(0.2, 0.5) * 1e5 / seconds }
            }
            "sticking_gauge" => Self::StickingGauge { band: random.between(0.1, 0.25) * 1e5 },
            "half_shut_valve" => {
                let shuts = random.between(0.2, 0.4) * seconds;
                let opens = shuts + random.between(0.2, 0.4) * seconds;
                Self::HalfShutValve { share: random.between(0.15, 0.4), shuts, opens }
            }
            "ageing_friction" => Self::AgeingFriction {
                share: random.between(0.2, 0.4),
                time_constant: random.between(0.2, 0.5) * seconds,
            },
            _ => return None,
        })
    }

    /// The name under which the effect is found, or `?` where no library has one.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::BoosterUTubing { .. } => "booster_u_tubing",
            Self::FlowMeterGain { .. } => "flow_meter_gain",
            Self::FlowMeterOffset { .. } => "flow_meter_offset",
            Self::FlowMeterDelay { .. } => "flow_meter_delay",
            Self::BoosterFlowGain { .. } => "booster_flow_gain",
            Self::WellInflux { .. } => "well_influx",
            Self::MudLoss { .. } => "mud_loss",
            Self::PumpSpeedExponent { .. } => "pump_speed_exponent",
            Self::PumpSpeedLag { .. } => "pump_speed_lag",
            Self::PressureSensorOffset { .. } => "pressure_sensor_offset",
            Self::ClockShift { .. } => "clock_shift",
            Self::FrictionHigherOrder { .. } => "friction_higher_order",
            Self::PumpWear { .. } => "pump_wear",
            Self::ReturnLinePlugging { .. } => "return_line_plugging",
            Self::DensityChange { .. } => "density_change",
            Self::TopFillGain { .. } => "top_fill_gain",
            Self::PressureSensorDrift { .. } => "pressure_sensor_drift",
            Self::PassingLoss { .. }
            | Self::StickingGauge { .. }
            | Self::HalfShutValve { .. }
            | Self::AgeingFriction { .. } => "?",
        }
    }

    /// Effects that a recording can hardly tell from this one.
    pub(crate) fn near_twins(&self) -> &'static [&'static str] {
        match self {
            Self::FlowMeterGain { .. } => &["booster_flow_gain"],
            Self::FlowMeterOffset { .. } | Self::BoosterFlowGain { .. } => &["flow_meter_gain"],
            _ => &[],
        }
    }

    /// When the effect begins, s, if it does not act from the start.
    pub(crate) fn onset(&self) -> Option<f64> {
        match *self {
            Self::WellInflux { onset, .. }
            | Self::MudLoss { onset, .. }
            | Self::ReturnLinePlugging { onset, .. }
            | Self::DensityChange { onset, .. } => Some(onset),
            Self::PassingLoss { begins, .. } => Some(begins),
            Self::HalfShutValve { shuts, .. } => Some(shuts),
            _ => None,
        }
    }

    /// The effect at a share of its size. A draining line is as large as its line is.
    #[must_use]
    pub(crate) fn reduced(self, share: f64) -> Self {
        let factor = |x: f64| 1.0 + share * (x - 1.0);
        match self {
            Self::BoosterUTubing { .. } => self,
            Self::FlowMeterGain { theta } => Self::FlowMeterGain { theta: factor(theta) },
            Self::FlowMeterOffset { flow } => Self::FlowMeterOffset { flow: share * flow },
            Self::FlowMeterDelay { delay } => Self::FlowMeterDelay { delay: share * delay },
            Self::BoosterFlowGain { gain } => Self::BoosterFlowGain { gain: factor(gain) },
            Self::WellInflux { flow, onset } => Self::WellInflux { flow: share * flow, onset },
            Self::MudLoss { flow, onset } => Self::MudLoss { flow: share * flow, onset },
            Self::PassingLoss { flow, begins, ends } => {
                Self::PassingLoss { flow: share * flow, begins, ends }
            }
            Self::PumpSpeedExponent { exponent } => {
                Self::PumpSpeedExponent { exponent: 2.0 + share * (exponent - 2.0) }
            }
            Self::PumpSpeedLag { lag } => Self::PumpSpeedLag { lag: share * lag },
            Self::PressureSensorOffset { pressure } => {
                Self::PressureSensorOffset { pressure: share * pressure }
            }
            Self::ClockShift { late } => Self::ClockShift { late: share * late },
            Self::FrictionHigherOrder { share: own } => {
                Self::FrictionHigherOrder { share: share * own }
            }
            Self::PumpWear { rate } => Self::PumpWear { rate: share * rate },
            Self::ReturnLinePlugging { share: own, onset } => {
                Self::ReturnLinePlugging { share: share * own, onset }
            }
            Self::DensityChange { step, onset } => {
                Self::DensityChange { step: share * step, onset }
            }
            Self::TopFillGain { gain } => Self::TopFillGain { gain: factor(gain) },
            Self::PressureSensorDrift { rate } => Self::PressureSensorDrift { rate: share * rate },
            Self::StickingGauge { band } => Self::StickingGauge { band: share * band },
            Self::HalfShutValve { share: own, shuts, opens } => {
                Self::HalfShutValve { share: share * own, shuts, opens }
            }
            Self::AgeingFriction { share: own, time_constant } => {
                Self::AgeingFriction { share: share * own, time_constant }
            }
        }
    }

    /// Hides the effect in a rig.
    pub(crate) fn hide(&self, rig: &mut Rig) {
        match *self {
            Self::BoosterUTubing { inertia, friction } => {
                rig.plant.booster_line = Some(BoosterLine { inertia, friction });
                rig.stops = true;
            }
            Self::FlowMeterGain { theta } => rig.sensors.theta = theta,
            Self::FlowMeterOffset { flow } => rig.sensors.flow_offset = flow,
            Self::FlowMeterDelay { delay } => rig.sensors.flow_delay = delay,
            Self::BoosterFlowGain { gain } => rig.booster_gain = gain,
            Self::WellInflux { flow, onset } => {
                rig.plant.influx = Some(Influx { flow, onset, end: f64::INFINITY });
            }
            Self::MudLoss { flow, onset } => {
                rig.plant.influx = Some(Influx { flow: -flow, onset, end: f64::INFINITY });
            }
            Self::PassingLoss { flow, begins, ends } => {
                rig.plant.influx = Some(Influx { flow: -flow, onset: begins, end: ends });
            }
            Self::PumpSpeedExponent { exponent } => {
                rig.plant.c0 *= COMMON_SPEED.powf(rig.plant.exponent - exponent);
                rig.plant.exponent = exponent;
            }
            Self::PumpSpeedLag { lag } => rig.plant.speed_lag = lag,
            Self::PressureSensorOffset { pressure } => rig.sensors.riser_offset = pressure,
            Self::ClockShift { late } => rig.sensors.pressures_late = late,
            Self::FrictionHigherOrder { share } => {
                rig.plant.f4 = share * rig.plant.f2 / COMMON_FLOW.powi(2);
                rig.plant.f2 *= 1.0 - share;
            }
            Self::PumpWear { rate } => rig.plant.wear = rate,
            Self::ReturnLinePlugging { share, onset } => {
                rig.plant.plugging = Some(Step { size: share, onset });
            }
            Self::DensityChange { step, onset } => {
                rig.plant.density_step = Some(Step { size: step, onset });
            }
            Self::TopFillGain { gain } => rig.fill_gain = gain,
            Self::PressureSensorDrift { rate } => rig.sensors.riser_drift = rate,
            Self::StickingGauge { band } => rig.sensors.riser_band = band,
            Self::HalfShutValve { share, shuts, opens } => {
                rig.plant.valve = Some(Valve { share, shuts, opens });
            }
            Self::AgeingFriction { share, time_constant } => {
                rig.plant.ageing = Some(Ageing { share, time_constant });
            }
        }
    }

    /// The effect's numbers as the truth lists them.
    pub(crate) fn sizes(&self) -> Vec<(Place, &'static str, f64)> {
        use Place::{Parameters, Sensors};
        match *self {
            Self::BoosterUTubing { inertia, friction } => vec![
                (Parameters, "M_b [kg/m^4]", inertia),
                (Parameters, "F_b [Pa*s/m^3]", friction),
            ],
            Self::FlowMeterGain { theta } => {
                vec![(Sensors, "theta [1], true over recorded return flow", theta)]
            }
            Self::FlowMeterOffset { flow } => vec![(Sensors, "flow_offset [lpm]", flow / LPM)],
            Self::FlowMeterDelay { delay } => vec![(Sensors, "flow_delay [s]", delay)],
            Self::BoosterFlowGain { gain } => {
                vec![(Parameters, "booster_gain [1], true over recorded", gain)]
            }
            Self::WellInflux { flow, onset } => vec![
                (Parameters, "q_res [m^3/s], into the riser", flow),
                (Parameters, "t_res [s]", onset),
            ],
            Self::MudLoss { flow, onset } => vec![
                (Parameters, "q_res [m^3/s], into the riser", -flow),
                (Parameters, "t_res [s]", onset),
            ],
            Self::PassingLoss { flow, begins, ends } => vec![
                (Parameters, "q_res [m^3/s], into the riser", -flow),
                (Parameters, "t_res [s]", begins),
                (Parameters, "t_end [s]", ends),
            ],
            Self::PumpSpeedExponent { exponent } => vec![(Parameters, "k [1]", exponent)],
            Self::PumpSpeedLag { lag } => vec![(Parameters, "tau_pump [s]", lag)],
            Self::PressureSensorOffset { pressure } => {
                vec![(Sensors, "p_r_offset [bar]", pressure / 1e5)]
            }
            Self::ClockShift { late } => vec![(Sensors, "pressures_late [s]", late)],
            Self::FrictionHigherOrder { share } => {
                vec![(Parameters, "fourth_order [1], share of friction at 2400 lpm", share)]
            }
            Self::PumpWear { rate } => vec![(Parameters, "wear [1/s], of c0", rate)],
            Self::ReturnLinePlugging { share, onset } => vec![
                (Parameters, "plugging [1], added share of friction", share),
                (Parameters, "t_plug [s]", onset),
            ],
            Self::DensityChange { step, onset } => {
                vec![(Parameters, "rho_step [kg/m^3]", step), (Parameters, "t_rho [s]", onset)]
            }
            Self::TopFillGain { gain } => {
                vec![(Sensors, "top_fill_gain [1], true over recorded", gain)]
            }
            Self::PressureSensorDrift { rate } => {
                vec![(Sensors, "p_r_drift [bar/h]", rate * 3600.0 / 1e5)]
            }
            Self::StickingGauge { band } => vec![(Sensors, "p_r_band [bar]", band / 1e5)],
            Self::HalfShutValve { share, shuts, opens } => vec![
                (Parameters, "valve [1], added share of friction", share),
                (Parameters, "t_shut [s]", shuts),
                (Parameters, "t_open [s]", opens),
            ],
            Self::AgeingFriction { share, time_constant } => vec![
                (Parameters, "ageing [1], added share of friction", share),
                (Parameters, "tau_ageing [s]", time_constant),
            ],
        }
    }
}
