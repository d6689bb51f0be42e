//! A coil whose iron saturates: its inductance falls with the current as L/(1 + c i²).

/// L, and c, which is zero without iron.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Coil {
    pub(super) inductance: f64,
    pub(super) softness: f64,
}

impl Coil {
    /// Without iron.
    pub(super) fn of_air(inductance: f64) -> Coil {
        Coil { inductance, softness: 0.0 }
    }

    /// The inductance that di/dt sees.
    pub(super) fn inductance(self, i: f64) -> f64 {
        self.inductance / (1.0 + self.softness * i * i)
    }

    /// The flux of a current, L arctan(i √c)/√c.
    pub(super) fn flux(self, i: f64) -> f64 {
        if self.softness == 0.0 {
            return self.inductance * i;
        }
        let root = self.softness.sqrt();
        self.inductance * (i * root).atan() / root
    }

    /// The current at a flux.
    pub(super) fn current(self, flux: f64) -> f64 {
        if self.softness == 0.0 {
            return flux / self.inductance;
        }
        let root = self.softness.sqrt();
        // The arctangent ends at a right angle; neither plant comes near it.
        (flux / self.inductance * root).clamp(-1.5, 1.5).tan() / root
    }
}
