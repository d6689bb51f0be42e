//! The rig as it is: mud circulation with the momentum of both lines and of the mud in the riser.
//!
//! Unknowns are the levels h_r, h_b and the flows q_ssp, q_bo. Of the riser's mud, what lies below
//! the subsea pump's inlet moves with q_bo, and what lies above rises and falls with h_r, so that
//! M_ssp(h_r) of (2.21) comes out, and with it a coupling between the two lines:
//!
//! ```text
//! A_r ḣ_r = q_ssp − q_bo − q_tf                                                    (2.14)
//! p_in    = ρ (h_in − h_r) (g − ḧ_r),   A_r ḧ_r = q̇_ssp − q̇_bo
//! ρ l_rl/A_rl q̇_ssp = p_in + ρ g h(ω, q_ssp) − F(q_ssp) − ρ g h_out                (2.21)
//! ρ (l_bo − h_b)/A_b q̇_bo = p_b + ρ g (l_bo − h_b) − F_b(q_bo) − p_bo              (2.19)
//! p_bo    = p_in + ρ (l_bo − h_in) (g + q̇_bo/A_r)
//! ```
//!
//! A full booster line has a pressure, `V_b/β ṗ_b = q_pump − q_bo` (2.11) and h_b = 0. It opens to
//! the air when that pressure falls below the air's; then p_b = 0 and `A_b ḣ_b = q_bo − q_pump`
//! (3.11), until it is full again. All pressures are above the atmosphere.
//!
//! The line may end in a non-return valve. Its spring takes a part of the pressure that drives the mud
//! out, and shuts the valve, q_bo = 0, when no more is left than that; a flow that lifts the disc all
//! the way is throttled by it as by an orifice:
//!
//! ```text
//! p_v(q_bo) = p_s max(1, (q_bo/q_l)²), beside F_b(q_bo)
//! ```
//!
//! And a charge pump may feed the booster pump and run while that runs. As long as the pressure in the
//! line is lower than its own, mud flows through the open valves of the booster pump's chambers, which
//! no count of strokes shows:
//!
//! ```text
//! q_pump = q_boost + q_c max(0, 1 − p_b/p_c)
//! ```

use std::f64::consts::PI;

use super::drilling_rig::plant::{A_B, A_R, G, H_IN, H_OUT, H_PR, L_B, RHO};

/// What the rig is made of.
#[derive(Debug, Clone)]
pub(crate) struct Plant {
    /// Shut-off head at full speed, m, exponent of the speed, and loss of head, s²/m⁵ (§3.5.1).
    pub(crate) c0: f64,
    pub(crate) exponent: f64,
    pub(crate) c2: f64,
    /// Time constant of the pump's speed (2.29), s.
    pub(crate) speed_lag: f64,
    pub(crate) return_line: Pipe,
    pub(crate) booster_line: Pipe,
    /// Valve at the outlet of the booster line; without it mud may flow either way.
    pub(crate) outlet: Option<OutletValve>,
    /// Bulk modulus of the booster line with its mud, Pa.
    pub(crate) bulk_modulus: f64,
    pub(crate) suction: Suction,
}

/// A pipe with bends, valves and an outlet, filled with the mud.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pipe {
    /// Length, inner diameter and roughness, m.
    pub(crate) length: f64,
    pub(crate) diameter: f64,
    pub(crate) roughness: f64,
    /// Pressure lost in bends, valves and outlet over ρ v²/2.
    pub(crate) minor_losses: f64,
    /// Viscosity of the mud, Pa s.
    pub(crate) viscosity: f64,
}

/// A non-return valve whose disc is held by a spring.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OutletValve {
    /// Difference of pressures that lifts the disc, Pa. A soft spring takes no more of a greater flow.
    pub(crate) spring: f64,
    /// Flow that lifts the disc all the way, m³/s. Beyond it the pressure loss grows as the square of the flow.
    pub(crate) full_lift: f64,
}

/// What the booster pump sucks from.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Suction {
    /// A tank. The pump's chambers fill less at a low outlet pressure (§3.3.2).
    Tank {
        /// Share of the calculated flow that is missing against the air's pressure.
        missing: f64,
        /// Pressure over which that decays, Pa.
        pressure: f64,
    },
    /// A charge pump, which runs while the booster pump does and fills the chambers. Against less than
    /// its own pressure it opens their valves and flows through, between the strokes that are counted.
    ChargePump {
        /// What flows through against the air's pressure, m³/s.
        through: f64,
        /// Pressure against which nothing does, Pa.
        pressure: f64,
    },
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
    /// Pressure at the top of the booster line, Pa.
    pub(crate) p_b: f64,
    /// Flow as the damped meter in the return line has it, m³/s.
    pub(crate) metered: f64,
    /// Speed of the subsea pump, of its maximum.
    pub(crate) speed: f64,
    /// Whether the booster line is full.
    pub(crate) full: bool,
    /// Whether the valve at its outlet is shut.
    pub(crate) shut: bool,
}

/// What is done to the rig during a second.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Controls {
    /// When the second began, s.
    pub(crate) since: f64,
    /// Reference of the subsea pump's speed, and its speed at `since`.
    pub(crate) reference: f64,
    pub(crate) speed_before: f64,
    /// Calculated flow of the booster pump at `since`, m³/s, and its slope, m³/s².
    pub(crate) boost: f64,
    pub(crate) boost_slope: f64,
    /// Top fill, m³/s.
    pub(crate) top_fill: f64,
    /// Time constant of the return flow meter, s.
    pub(crate) damping: f64,
}

/// Pressures where the instruments are, Pa.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pressures {
    pub(crate) riser: f64,
    pub(crate) inlet: f64,
    pub(crate) outlet: f64,
}

impl Controls {
    pub(crate) fn boost_at(&self, t: f64) -> f64 {
        self.boost + self.boost_slope * (t - self.since)
    }

    /// Whether the booster pump runs within the second.
    pub(crate) fn boosting(&self) -> bool {
        self.boost > 0.0 || self.boost_slope > 0.0
    }

    /// The solution of τ dω/dt = ω_ref − ω, which nothing feeds back into.
    fn speed_at(&self, t: f64, lag: f64) -> f64 {
        self.reference + (self.speed_before - self.reference) * ((self.since - t) / lag).exp()
    }
}

impl Pipe {
    pub(crate) fn area(&self) -> f64 {
        PI / 4.0 * self.diameter * self.diameter
    }

    /// Pressure lost to a flow, Pa (2.23).
    pub(crate) fn loss(&self, q: f64) -> f64 {
        let v = q / self.area();
        let reynolds = RHO * v.abs() * self.diameter / self.viscosity;
        // 64/Re · l/d · ρ v²/2, which is linear in v.
        let laminar = 32.0 * self.viscosity * self.length * v / (self.diameter * self.diameter);
        let dynamic = RHO * v * v.abs() / 2.0;
        let turbulent = |reynolds| self.haaland(reynolds) * self.length / self.diameter * dynamic;
        let wall = if reynolds <= LAMINAR {
            laminar
        } else if reynolds >= TURBULENT {
            turbulent(reynolds)
        } else {
            // Between the two, the flow is turbulent for a part of the time that grows with Re.
            let share = (reynolds - LAMINAR) / (TURBULENT - LAMINAR);
            (1.0 - share) * laminar + share * turbulent(reynolds)
        };
        wall + self.minor_losses * dynamic
    }

    /// Haaland's friction factor.
    fn haaland(&self, reynolds: f64) -> f64 {
        let roughness = (self.roughness / (3.7 * self.diameter)).powf(1.11);
        (-1.8 * (6.9 / reynolds + roughness).log10()).powi(-2)
    }
}

/// Reynolds numbers below which a flow is laminar, and above which it is turbulent.
const LAMINAR: f64 = 2300.0;
const TURBULENT: f64 = 4000.0;

impl OutletValve {
    /// Pressure lost to a flow outwards, Pa; of none, what the spring holds.
    fn loss(&self, q: f64) -> f64 {
        self.spring * (q / self.full_lift).powi(2).max(1.0)
    }
}

impl Plant {
    /// What the booster pump delivers at its calculated flow, running or not, against a pressure.
    pub(crate) fn pumped(&self, calculated: f64, runs: bool, p_b: f64) -> f64 {
        match self.suction {
            Suction::Tank { missing, pressure } => {
                (1.0 - missing * (-p_b / pressure).exp()) * calculated
            }
            Suction::ChargePump { through, pressure } if runs => {
                calculated + through * (1.0 - p_b / pressure).max(0.0)
            }
            Suction::ChargePump { .. } => calculated,
        }
    }

    /// Pressure that the booster line with its outlet loses to a flow, Pa.
    pub(crate) fn booster_loss(&self, q: f64) -> f64 {
        self.booster_line.loss(q) + self.outlet.map_or(0.0, |valve| valve.loss(q))
    }

    /// Head of the subsea pump, m.
    fn head(&self, speed: f64, q: f64) -> f64 {
        self.c0 * speed.powf(self.exponent) - self.c2 * q * q.abs()
    }

    /// Speed at which the pump holds a flow at a riser level for ever (2.28).
    pub(crate) fn steady_speed(&self, h_r: f64, q: f64) -> f64 {
        let head = h_r - (H_IN - H_OUT) + self.return_line.loss(q) / (RHO * G) + self.c2 * q * q;
        (head.max(0.0) / self.c0).powf(1.0 / self.exponent)
    }

    /// At rest at a riser level with a calculated booster flow and a top fill.
    pub(crate) fn at_rest(&self, h_r: f64, boost: f64, top_fill: f64) -> State {
        // p_b = F_b(q_bo) − ρ g h_r where that is positive, and where not, ρ g (h_r − h_b) = F_b.
        // What is pumped less q_bo falls with q_bo: half the interval until no number is left in it.
        let net = |q_bo: f64| self.booster_loss(q_bo) - RHO * G * h_r;
        let pumped = |q_bo: f64| self.pumped(boost, boost > 0.0, net(q_bo).max(0.0));
        let (mut low, mut q_bo) = (0.0, pumped(0.0).max(boost));
        loop {
            let middle = q_bo.midpoint(low);
            if middle <= low || middle >= q_bo {
                break;
            }
            if middle < pumped(middle) {
                low = middle;
            } else {
                q_bo = middle;
            }
        }
        let net = net(q_bo);
        let (full, shut) = (net > 0.0, q_bo == 0.0 && self.outlet.is_some());
        // A shut valve holds what is above it without a pressure.
        let p_b = if shut { 0.0 } else { net.max(0.0) };
        let h_b = (-net).max(0.0) / (RHO * G);
        let q_ssp = q_bo + top_fill;
        let speed = self.steady_speed(h_r, q_ssp);
        State { h_r, h_b, q_ssp, q_bo, p_b, metered: q_ssp, speed, full, shut }
    }

    /// Derivatives of q_ssp and q_bo.
    fn accelerations(&self, s: &State) -> [f64; 2] {
        // Inertia of the mud above the inlet, which both flows accelerate; of the rest, each its own.
        let riser = RHO * (H_IN - s.h_r) / A_R;
        let m_ssp = RHO * self.return_line.length / self.return_line.area() + riser;
        let m_b = RHO * (L_B - s.h_b) / A_B + RHO * (L_B - H_IN) / A_R + riser;

        let net = RHO * G * (H_IN - s.h_r + self.head(s.speed, s.q_ssp) - H_OUT)
            - self.return_line.loss(s.q_ssp);
        if s.shut {
            return [net / m_ssp, 0.0];
        }
        let booster_net = s.p_b + RHO * G * (s.h_r - s.h_b) - self.booster_loss(s.q_bo);

        // | m_ssp  −riser |  | q̇_ssp |     | net         |
        // | −riser   m_b  |  | q̇_bo  |  =  | booster_net |
        let determinant = m_ssp * m_b - riser * riser;
        [
            (net * m_b + booster_net * riser) / determinant,
            (booster_net * m_ssp + net * riser) / determinant,
        ]
    }

    /// Pressures where the instruments are.
    pub(crate) fn pressures(&self, s: &State) -> Pressures {
        let [dq_ssp, dq_bo] = self.accelerations(s);
        let felt = RHO * (G - (dq_ssp - dq_bo) / A_R);
        let inlet = felt * (H_IN - s.h_r);
        let outlet = inlet + RHO * G * self.head(s.speed, s.q_ssp);
        Pressures { riser: felt * (H_PR - s.h_r), inlet, outlet }
    }

    /// The rig's state at `end`, from that at `t` on.
    pub(crate) fn advance(&self, t: f64, state: &State, controls: &Controls, end: f64) -> State {
        let (mut t, mut state) = (t, *state);
        while t < end {
            let mut reached = end;
            let mut next = self.step(t, &state, controls, end);
            if self.leaves(&next) {
                // Half the interval until no number is left in it; the line changes at its end.
                let mut before = t;
                loop {
                    let middle = before.midpoint(reached);
                    if middle <= before || middle >= reached {
                        break;
                    }
                    let there = self.step(t, &state, controls, middle);
                    if self.leaves(&there) {
                        (reached, next) = (middle, there);
                    } else {
                        before = middle;
                    }
                }
                next = self.changed(&next);
            }
            (t, state) = (reached, next);
        }
        state
    }

    /// One step of the classical Runge–Kutta method, without a change of mode.
    fn step(&self, t: f64, state: &State, controls: &Controls, end: f64) -> State {
        let h = end - t;
        let at = |k: &[f64; 6], c: f64| {
            state.plus(k, c * h, controls.speed_at(t + c * h, self.speed_lag))
        };
        let slope = |s: &State, c: f64| self.slope(t + c * h, s, controls);
        let k1 = slope(&at(&[0.0; 6], 0.0), 0.0);
        let k2 = slope(&at(&k1, 0.5), 0.5);
        let k3 = slope(&at(&k2, 0.5), 0.5);
        let k4 = slope(&at(&k3, 1.0), 1.0);
        let mean = std::array::from_fn(|i| (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]) / 6.0);
        at(&mean, 1.0)
    }

    /// Derivatives of h_r, h_b, q_ssp, q_bo, p_b and the metered flow.
    fn slope(&self, t: f64, s: &State, controls: &Controls) -> [f64; 6] {
        let [dq_ssp, dq_bo] = self.accelerations(s);
        let riser = (s.q_ssp - s.q_bo - controls.top_fill) / A_R;
        let pumped = self.pumped(controls.boost_at(t), controls.boosting(), s.p_b);
        let surplus = pumped - s.q_bo;
        let (level, pressure) = if s.full {
            (0.0, self.bulk_modulus / (A_B * L_B) * surplus)
        } else {
            (-surplus / A_B, 0.0)
        };
        [riser, level, dq_ssp, dq_bo, pressure, (s.q_ssp - s.metered) / controls.damping]
    }

    /// Whether the booster line is in another mode than it says, at its top or at its outlet.
    fn leaves(&self, s: &State) -> bool {
        s.top_leaves() || self.outlet_leaves(s)
    }

    /// Whether mud would flow back through the valve at the outlet, or pushes a shut one open.
    fn outlet_leaves(&self, s: &State) -> bool {
        if s.shut {
            self.accelerations(&State { shut: false, ..*s })[1] > 0.0
        } else {
            self.outlet.is_some() && s.q_bo < 0.0
        }
    }

    /// The state in the mode that it goes to.
    fn changed(&self, s: &State) -> State {
        let mut next = *s;
        if s.top_leaves() {
            next = State { full: !s.full, h_b: 0.0, p_b: 0.0, ..next };
        }
        if self.outlet_leaves(s) {
            next = State { shut: !s.shut, q_bo: 0.0, ..next };
        }
        next
    }
}

impl State {
    /// This state and a slope's share of the way on, at a speed.
    fn plus(&self, slope: &[f64; 6], h: f64, speed: f64) -> Self {
        Self {
            h_r: self.h_r + h * slope[0],
            h_b: self.h_b + h * slope[1],
            q_ssp: self.q_ssp + h * slope[2],
            q_bo: self.q_bo + h * slope[3],
            p_b: self.p_b + h * slope[4],
            metered: self.metered + h * slope[5],
            speed,
            full: self.full,
            shut: self.shut,
        }
    }

    /// Whether the booster line would suck while full, or hold more than it can.
    fn top_leaves(&self) -> bool {
        if self.full { self.p_b < 0.0 } else { self.h_b < 0.0 }
    }
}
