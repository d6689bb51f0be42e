//! The mud circulation of a dual gradient drilling riser, as it is and not as anyone models it.
//!
//! Haukanes 2015: riser level (2.14), return line (2.21) with the inertia of (3.15), pump (2.27) with
//! the lag of (2.29), booster line (3.11). Depths and levels are downwards from the rig floor.

use std::f64::consts::PI;

/// Acceleration of gravity, m/s².
pub(crate) const G: f64 = 9.81;
/// Standard atmosphere, Pa.
pub(crate) const P_ATM: f64 = 101_325.0;
/// Density of the mud, kg/m³.
pub(crate) const RHO: f64 = 1120.0;
/// Inlet and outlet of the subsea pump and the gauge in the riser, m.
pub(crate) const H_IN: f64 = 307.0;
pub(crate) const H_OUT: f64 = 302.0;
pub(crate) const H_PR: f64 = 305.0;
/// Cross-section of the riser, 19.75 in wide, m².
pub(crate) const A_R: f64 = PI / 4.0 * (19.75 * 0.0254) * (19.75 * 0.0254);
/// Cross-section, m², and length, m, of the booster line.
pub(crate) const A_B: f64 = 0.0103;
pub(crate) const L_B: f64 = 340.0;
/// One litre per minute, m³/s.
pub(crate) const LPM: f64 = 1e-3 / 60.0;

/// What the rig is made of.
#[derive(Debug, Clone)]
pub(crate) struct Plant {
    /// Inertia of the mud in the return line at a riser level of 50 m, kg/m⁴.
    pub(crate) inertia: f64,
    /// Shut-off head at full speed, m, and the exponent of the speed.
    pub(crate) c0: f64,
    pub(crate) exponent: f64,
    /// Loss of head in the pump, s²/m⁵.
    pub(crate) c2: f64,
    /// Friction of the return line, Pa s²/m⁶.
    pub(crate) f2: f64,
    /// Time constant of the subsea pump's speed, s.
    pub(crate) speed_lag: f64,
    /// What lets the booster line drain; without it, it always delivers what is pumped in.
    pub(crate) booster_line: Option<BoosterLine>,
    /// Flow out of the well into the riser since an onset.
    pub(crate) influx: Option<Influx>,
    /// Friction of the return line that is not constant.
    pub(crate) ageing: Option<Ageing>,
    /// Valve in the return line that somebody half shut for a while.
    pub(crate) valve: Option<Valve>,
    /// Friction that grows with the fourth power of the flow, Pa s⁴/m¹².
    pub(crate) f4: f64,
    /// Share of the shut-off head that is lost in a second.
    pub(crate) wear: f64,
    /// Share by which friction is higher since an onset.
    pub(crate) plugging: Option<Step>,
    /// Density after less density before an onset, kg/m³.
    pub(crate) density_step: Option<Step>,
}

/// Something that is so much since an onset, s.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Step {
    pub(crate) size: f64,
    pub(crate) onset: f64,
}

impl Step {
    fn at(step: Option<Step>, t: f64) -> f64 {
        step.map_or(0.0, |step| if t >= step.onset { step.size } else { 0.0 })
    }
}

/// Inertia, kg/m⁴, and friction, Pa s/m³, of a booster line that is open to the air.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BoosterLine {
    pub(crate) inertia: f64,
    pub(crate) friction: f64,
}

/// A flow, m³/s, and when it begins, s.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Influx {
    pub(crate) flow: f64,
    pub(crate) onset: f64,
    /// When it is over.
    pub(crate) end: f64,
}

/// Friction goes from F to (1 + share) F, with a time constant, s.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ageing {
    pub(crate) share: f64,
    pub(crate) time_constant: f64,
}

/// Friction is (1 + share) F between two times, s.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Valve {
    pub(crate) share: f64,
    pub(crate) shuts: f64,
    pub(crate) opens: f64,
}

/// Where the rig is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct State {
    /// Levels of riser and booster line, m.
    pub(crate) h_r: f64,
    pub(crate) h_b: f64,
    /// Flows through the return line and out of the booster line, m³/s.
    pub(crate) q_ssp: f64,
    pub(crate) q_bo: f64,
    /// Speed of the subsea pump, of its maximum.
    pub(crate) speed: f64,
    /// Whether the booster line is not full.
    pub(crate) draining: bool,
}

/// What is done to the rig while a setting is held.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Controls {
    /// When the setting was made, s.
    pub(crate) since: f64,
    /// Reference of the subsea pump's speed, and the speed when it was set.
    pub(crate) reference: f64,
    pub(crate) speed_before: f64,
    /// Booster flow at `since`, m³/s, and its slope, m³/s².
    pub(crate) boost: f64,
    pub(crate) boost_slope: f64,
    /// Top fill, m³/s.
    pub(crate) top_fill: f64,
}

/// What does not change within a step.
#[derive(Debug, Clone, Copy)]
struct Piece {
    draining: bool,
    /// Flow from the well, m³/s.
    well_flow: f64,
    /// Share of friction that the valve and cuttings add.
    shut: f64,
    /// Density of the mud, kg/m³.
    density: f64,
}

impl Controls {
    fn boost_at(&self, t: f64) -> f64 {
        self.boost + self.boost_slope * (t - self.since)
    }

    /// The solution of τ dω/dt = ω_ref − ω, which nothing feeds back into.
    fn speed_at(&self, t: f64, lag: f64) -> f64 {
        self.reference + (self.speed_before - self.reference) * ((self.since - t) / lag).exp()
    }
}

impl Plant {
    /// Density of the mud, kg/m³.
    pub(crate) fn density(&self, t: f64) -> f64 {
        RHO + Step::at(self.density_step, t)
    }

    /// Pressure at the pump's inlet with mud of a density, Pa above the atmosphere.
    pub(crate) fn inlet_pressure(density: f64, h_r: f64) -> f64 {
        density * G * (H_IN - h_r)
    }

    /// Pressure that the riser's gauge should read, Pa.
    pub(crate) fn riser_pressure(&self, t: f64, h_r: f64) -> f64 {
        P_ATM + self.density(t) * G * (H_PR - h_r)
    }

    /// Pressure at the pump's outlet, Pa above the atmosphere.
    pub(crate) fn outlet_pressure(&self, t: f64, state: &State) -> f64 {
        let density = self.density(t);
        Self::inlet_pressure(density, state.h_r)
            + self.pump_pressure(t, density, state.speed, state.q_ssp)
    }

    /// Speed at which the pump holds a flow at a riser level for ever.
    pub(crate) fn steady_speed(&self, h_r: f64, q: f64) -> f64 {
        // c0 ω^k = h_r − (h_in − h_out) + c2 q² + (F2 q² + F4 q⁴)/(ρ g)
        let friction = (self.f2 + self.f4 * q * q) * q * q;
        let head = h_r - (H_IN - H_OUT) + self.c2 * q * q + friction / (RHO * G);
        (head.max(0.0) / self.c0).powf(1.0 / self.exponent)
    }

    fn pump_pressure(&self, t: f64, density: f64, speed: f64, q: f64) -> f64 {
        let c0 = self.c0 * (1.0 - self.wear * t);
        density * G * (c0 * speed.powf(self.exponent) - self.c2 * q * q.abs())
    }

    /// Pressure lost in the return line, with the share that a valve or cuttings add.
    fn friction(&self, t: f64, q: f64, shut: f64) -> f64 {
        let aged = self.ageing.map_or(0.0, |a| a.share * (1.0 - (-t / a.time_constant).exp()));
        (1.0 + aged + shut) * (self.f2 + self.f4 * q * q) * q * q.abs()
    }

    fn shut(&self, t: f64) -> f64 {
        let valve = |v: Valve| if v.shuts <= t && t < v.opens { v.share } else { 0.0 };
        self.valve.map_or(0.0, valve) + Step::at(self.plugging, t)
    }

    fn well_flow(&self, t: f64) -> f64 {
        self.influx.map_or(0.0, |i| if t >= i.onset && t < i.end { i.flow } else { 0.0 })
    }

    /// Times at which the equations jump, s.
    fn jumps(&self) -> impl Iterator<Item = f64> {
        let influx = self.influx.map(|i| [i.onset, i.end]);
        let valve = self.valve.map(|v| [v.shuts, v.opens]);
        let steps = self.plugging.into_iter().chain(self.density_step);
        let steps = steps.map(|step| step.onset);
        influx.into_iter().flatten().chain(valve.into_iter().flatten()).chain(steps)
    }

    /// Negative where the booster line must leave the mode it is in, if it has modes at all.
    ///
    /// A full line opens when the pressure at its top falls below the atmosphere's; an open one is
    /// full again when its level is back at the rig floor.
    fn stays(&self, state: &State, controls: &Controls, t: f64) -> f64 {
        match self.booster_line {
            // F_b q + M_b dq/dt − ρ g h_r
            Some(line) if !state.draining => {
                line.friction * controls.boost_at(t) + line.inertia * controls.boost_slope
                    - RHO * G * state.h_r
            }
            Some(_) if state.q_bo < controls.boost_at(t) => state.h_b,
            _ => 1.0,
        }
    }

    /// The state at `to`, from that at `from`, by Runge–Kutta steps that end where the equations
    /// jump or the booster line changes its mode.
    pub(crate) fn advance(&self, from: f64, state: &State, controls: &Controls, to: f64) -> State {
        let (mut t, mut state) = (from, *state);
        while t < to {
            if !state.draining && self.stays(&state, controls, t) < 0.0 {
                state = State { draining: true, h_b: 0.0, q_bo: controls.boost_at(t), ..state };
            }
            let end = self.jumps().filter(|&jump| t < jump && jump < to).fold(to, f64::min);
            let mut next = self.step(t, &state, controls, end);
            let mut reached = end;
            if self.stays(&next, controls, end) < 0.0 {
                // Half the interval until no number is left in it; the line changes at its end.
                let mut before = t;
                loop {
                    let middle = before.midpoint(reached);
                    if middle <= before || middle >= reached {
                        break;
                    }
                    let there = self.step(t, &state, controls, middle);
                    if self.stays(&there, controls, middle) < 0.0 {
                        (reached, next) = (middle, there);
                    } else {
                        before = middle;
                    }
                }
                let draining = !next.draining;
                next = State { draining, h_b: 0.0, q_bo: controls.boost_at(reached), ..next };
            }
            (t, state) = (reached, next);
        }
        state
    }

    /// One step of the classical Runge–Kutta method, without a change of mode.
    fn step(&self, t: f64, state: &State, controls: &Controls, end: f64) -> State {
        let h = end - t;
        let x = [state.h_r, state.q_ssp, state.h_b, state.q_bo];
        let along =
            |k: &[f64; 4], c: f64| -> [f64; 4] { std::array::from_fn(|i| x[i] + c * h * k[i]) };
        // A step that begins or ends at a jump lies on the side of it on which its middle lies.
        let middle = t.midpoint(end);
        let piece = Piece {
            draining: state.draining,
            well_flow: self.well_flow(middle),
            shut: self.shut(middle),
            density: self.density(middle),
        };
        let slope = |x: &[f64; 4], c: f64| self.slope(t + c * h, x, piece, controls);
        let k1 = slope(&x, 0.0);
        let k2 = slope(&along(&k1, 0.5), 0.5);
        let k3 = slope(&along(&k2, 0.5), 0.5);
        let k4 = slope(&along(&k3, 1.0), 1.0);
        let mean = std::array::from_fn(|i| (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]) / 6.0);
        let [h_r, q_ssp, h_b, q_bo] = along(&mean, 1.0);
        let speed = controls.speed_at(end, self.speed_lag);
        let q_bo = if state.draining { q_bo } else { controls.boost_at(end) };
        State { h_r, h_b, q_ssp, q_bo, speed, draining: state.draining }
    }

    /// Derivatives of h_r, q_ssp, h_b, q_bo.
    fn slope(&self, t: f64, x: &[f64; 4], piece: Piece, controls: &Controls) -> [f64; 4] {
        let &[h_r, q_ssp, h_b, q_bo] = x;
        let Piece { draining, well_flow, shut, density } = piece;
        let boost = controls.boost_at(t);
        let delivered = if draining { q_bo } else { boost };

        // A_r dh_r/dt = q_ssp − q_bo − q_tf − q_res
        let riser = (q_ssp - delivered - controls.top_fill - well_flow) / A_R;

        // M dq/dt = ρ g (h_in − h_r) + Δp(ω, q) − F(q) − ρ g h_out,  M = M₅₀ − 5600 kg/m⁵ (h_r − 50 m)
        let speed = controls.speed_at(t, self.speed_lag);
        let net = Self::inlet_pressure(density, h_r) + self.pump_pressure(t, density, speed, q_ssp)
            - self.friction(t, q_ssp, shut)
            - density * G * H_OUT;
        let return_line = net / (self.inertia - 5.6e3 * (h_r - 50.0));

        // M_b (1 − h_b/l) dq_bo/dt = ρ g (h_r − h_b) − F_b q_bo,  A_b dh_b/dt = q_bo − q_boost
        let (level, outlet) = match self.booster_line {
            Some(line) if draining => {
                let inertia = line.inertia * (1.0 - h_b / L_B);
                let driving = RHO * G * (h_r - h_b) - line.friction * q_bo;
                ((q_bo - boost) / A_B, driving / inertia)
            }
            _ => (0.0, controls.boost_slope),
        };
        [riser, return_line, level, outlet]
    }
}
