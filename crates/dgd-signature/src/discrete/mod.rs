//! Discrete state that changes only at events: automata with their modes and transitions, and conditions on time.

mod clock;
mod formula;

pub use clock::{Clock, ExactTicks};
pub use formula::{Curve, Formulas, Operation};

use crate::{List, Pattern, Text};

/// Modes, transitions and conditions on time.
#[derive(Debug, Clone, PartialEq)]
pub struct Discrete {
    /// Automata; z begins with their modes.
    pub automata: List<Automaton>,
    /// Number of conditions on time n_c, which follow in z.
    pub n_time_conditions: usize,
    /// Clocks, each of which occupies two conditions on time.
    pub clocks: List<Clock>,
    /// The event functions e as data, by which crossings are excluded between points.
    pub event_formulas: Formulas,
    /// Where ∂e/∂y is not zero: n_e × n.
    pub event_jacobian: Pattern,
    /// Where ∂e/∂θ is not zero: n_e × n_s.
    pub event_directions: Pattern,
    /// Where ∂r/∂y is not zero: n_r × n.
    pub reset_jacobian: Pattern,
    /// Where ∂r/∂θ is not zero: n_r × n_s.
    pub reset_directions: Pattern,
    /// Positions of the unknowns that are differential in some modes and algebraic in others.
    pub by_mode: List<usize>,
    /// Where the equations of jumps read jumps: n × n; empty if no mode ties states together.
    pub jump_jacobian: Pattern,
    /// Labels of loops whose rows jump without events, as they are too many: there are no sensitivities.
    pub unlocated: List<Text>,
}

/// The kind of an automaton.
///
/// Passes use these predicates on what a kind does, and rarely the kind itself:
///
/// | | `Modes` | `When` | `Every` | `Saturation` | `States` | `Switch` | `Corner` | `Step` | `Knots` | `Limit` | `Piece` |
/// |---|---|---|---|---|---|---|---|---|---|---|---|
/// | [`is_declared`](Self::is_declared) | yes | yes | yes | | | | | | | | |
/// | [`is_remembered`](Self::is_remembered) | yes | yes | yes | yes | | | | | | | |
/// | [`has_equations_by_mode`](Self::has_equations_by_mode) | yes | | | yes | | yes | | yes | | | yes |
/// | [`has_masses_by_mode`](Self::has_masses_by_mode) | yes | | | | yes | | | | | | |
/// | [`shows_modes`](Self::shows_modes) | yes | | | yes | yes | yes | | | | | |
/// | [`is_bound`](Self::is_bound) | | | | yes | | | | | | | |
/// | [`chooses_states`](Self::chooses_states) | | | | | yes | | | | | | |
/// | [`has_surface`](Self::has_surface) | | | | | | yes | | | | | |
/// | [`chooses_side`](Self::chooses_side) | | | | yes | | yes | | yes | yes | | yes |
/// | [`only_ends_steps`](Self::only_ends_steps) | | | | | | | yes | | yes | | |
/// | [`keeps_slopes`](Self::keeps_slopes) | | | | | yes | | yes | | yes | yes | yes |
/// | [`counts`](Self::counts) | | | | | | | | yes | yes | | |
/// | [`is_piece`](Self::is_piece) | | | | | | | | | | | yes |
/// | [`ends_runs`](Self::ends_runs) | | | | | | | | | | yes | |
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AutomatonKind {
    /// A `modes` block.
    Modes,
    /// A `when`: one mode, and transitions from it to itself.
    When,
    /// An `every`: one mode, and a transition from it to itself at each tick of a [`Clock`].
    Every,
    /// An unknown with bounds: free, or at one of them.
    Saturation,
    /// Selects which of the unknowns tied by constraints are states. The solution is the same in all modes; the mode
    /// changes to the one in which the constraints determine the other unknowns best.
    States,
    /// A switch whose value jumps: below its surface (0), above it (1), or sliding along it (2). Its
    /// first transition leads from below to above.
    Switch,
    /// A switch whose slope jumps: steps end at its surface, and nothing else happens there.
    Corner,
    /// ⌊x⌋ of a varying number x: its discrete number is ⌊x⌋. The event function of its first transition is x − ⌊x⌋ −
    /// 1, that of its second x − ⌊x⌋.
    Step,
    /// The knots of a table at which its slope jumps: steps end at them, and nothing else happens there. Its discrete
    /// number is the number of knots passed, minus one; event functions are those of a [`Step`](Self::Step) of a number
    /// that is an integer at each knot.
    Knots,
    /// The end of a table beyond which it is undefined: the run ends there with an error. Its name says which argument
    /// left which table.
    Limit,
    /// A switch of algebraic equations whose slope jumps: they are one smooth piece below its surface (0), another above
    /// it (1). Its first transition leads from below to above.
    Piece,
}

impl AutomatonKind {
    /// Its name in the source of a generated model.
    pub fn ident(self) -> &'static str {
        match self {
            Self::Modes => "Modes",
            Self::When => "When",
            Self::Every => "Every",
            Self::Saturation => "Saturation",
            Self::States => "States",
            Self::Switch => "Switch",
            Self::Corner => "Corner",
            Self::Step => "Step",
            Self::Knots => "Knots",
            Self::Limit => "Limit",
            Self::Piece => "Piece",
        }
    }
}

impl AutomatonKind {
    /// Whether the model's text declares it: a `modes` block, a `when` or an `every`.
    pub fn is_declared(self) -> bool {
        matches!(self, Self::Modes | Self::When | Self::Every)
    }

    /// Whether its mode does not follow from the values at one time.
    pub fn is_remembered(self) -> bool {
        matches!(self, Self::Modes | Self::When | Self::Every | Self::Saturation)
    }

    /// Whether other equations hold in another of its modes.
    pub fn has_equations_by_mode(self) -> bool {
        matches!(self, Self::Modes | Self::Saturation | Self::Switch | Self::Step | Self::Piece)
    }

    /// Whether an unknown can be differential in one of its modes and algebraic in another.
    pub fn has_masses_by_mode(self) -> bool {
        matches!(self, Self::Modes | Self::States)
    }

    /// Whether its mode is shown to users.
    pub fn shows_modes(self) -> bool {
        !matches!(
            self,
            Self::When
                | Self::Every
                | Self::Corner
                | Self::Step
                | Self::Knots
                | Self::Limit
                | Self::Piece
        )
    }

    /// Whether it holds an unknown at a bound.
    pub fn is_bound(self) -> bool {
        self == Self::Saturation
    }

    /// Whether its modes are choices of states.
    pub fn chooses_states(self) -> bool {
        self == Self::States
    }

    /// Whether a value jumps at its surface, so that a solution may slide along it.
    pub fn has_surface(self) -> bool {
        self == Self::Switch
    }

    /// Whether a run begins on its side according to the start values.
    pub fn chooses_side(self) -> bool {
        matches!(self, Self::Switch | Self::Saturation | Self::Step | Self::Knots | Self::Piece)
    }

    /// Whether its discrete number is a count rather than the position of a mode.
    pub fn counts(self) -> bool {
        matches!(self, Self::Step | Self::Knots)
    }

    /// Whether it only ends steps where it switches.
    pub fn only_ends_steps(self) -> bool {
        matches!(self, Self::Corner | Self::Knots)
    }

    /// Whether ẏ is the same on both sides of its transitions.
    pub fn keeps_slopes(self) -> bool {
        matches!(self, Self::States | Self::Corner | Self::Knots | Self::Limit | Self::Piece)
    }

    /// Whether it chooses between pieces of algebraic equations, which are found together with their unknowns.
    pub fn is_piece(self) -> bool {
        self == Self::Piece
    }

    /// Whether a run ends where it switches, with an error.
    pub fn ends_runs(self) -> bool {
        self == Self::Limit
    }
}

/// When a transition acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trigger {
    /// When its condition becomes true, but not if it has been true since the mode was entered.
    Edge,
    /// Whenever its condition is true.
    Level,
    /// If its condition is true immediately in the mode that the solution enters at a surface.
    Entry,
    /// If its condition is true at the start of a run: the first such transition gives the starting mode.
    Start,
    /// At the ticks of a [`Clock`], whatever its event function is.
    Clock,
}

impl Trigger {
    /// Its name in the source of a generated model.
    pub fn ident(self) -> &'static str {
        match self {
            Self::Edge => "Edge",
            Self::Level => "Level",
            Self::Entry => "Entry",
            Self::Start => "Start",
            Self::Clock => "Clock",
        }
    }
}

/// A `modes` block of the model, or another source of events.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Automaton {
    /// Its kind.
    pub kind: AutomatonKind,
    /// Its name.
    pub name: Text,
    /// Names of its modes.
    pub modes: List<Text>,
    /// The mode in which it starts, unless a transition at the start chooses another.
    pub start: usize,
    /// Its transitions.
    pub transitions: List<Transition>,
}

/// A transition between modes, due when its event function passes zero.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Transition {
    /// Position of the mode that it leaves; the number of modes for transitions at the start, which leave none.
    pub from: usize,
    /// Position of the mode that it enters.
    pub to: usize,
    /// The direction in which its event function passes zero.
    pub crossing: Crossing,
    /// Its trigger.
    pub trigger: Trigger,
    /// Positions of the unknowns that it resets.
    pub resets: List<usize>,
}

/// The direction in which an event function passes zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Crossing {
    /// From below.
    Rises,
    /// From above.
    Falls,
}

impl Crossing {
    /// Its name in the source of a generated model.
    pub fn ident(self) -> &'static str {
        match self {
            Self::Rises => "Rises",
            Self::Falls => "Falls",
        }
    }

    /// Its notation in models.
    pub fn words(self) -> &'static str {
        match self {
            Crossing::Rises => "rises above",
            Crossing::Falls => "falls below",
        }
    }

    /// Whether this value of the event function lies beyond the threshold.
    #[inline]
    pub fn is_past(self, e: f64) -> bool {
        match self {
            Crossing::Rises => e > 0.0,
            Crossing::Falls => e < 0.0,
        }
    }
}

/// What entering a combination of modes does to an unknown, if the modes tie states together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JumpKind {
    /// It is algebraic, and has no impulse.
    None,
    /// It is algebraic, and may have an impulse: its variable is the integral over the instant.
    Impulse,
    /// It has a derivative, and no impulse moves it.
    Kept,
    /// It has a derivative and jumps, and takes part in no sum that is conserved.
    Forced,
    /// It has a derivative and jumps, and a sum that it takes part in is conserved.
    Shared,
    /// It has a derivative and jumps, but the equations do not say by how much: it keeps its value.
    Lost,
    /// It is algebraic, and jumps with the states that it follows from.
    Following,
}

impl JumpKind {
    const ALL: [Self; 7] = [
        Self::None,
        Self::Impulse,
        Self::Kept,
        Self::Forced,
        Self::Shared,
        Self::Lost,
        Self::Following,
    ];

    /// Its number among the results of a system.
    pub fn number(self) -> f64 {
        f64::from(self as u8)
    }

    /// The kind with this number.
    pub fn of_number(number: f64) -> Self {
        Self::ALL.into_iter().find(|kind| kind.number() == number).unwrap_or(Self::None)
    }

    /// Whether the unknown has a derivative, and so a value just before the instant that counts.
    pub fn has_rate(self) -> bool {
        matches!(self, Self::Kept | Self::Forced | Self::Shared | Self::Lost)
    }

    /// Whether the system has an equation for the jump or impulse.
    pub fn has_equation(self) -> bool {
        self == Self::Impulse || self.jumps()
    }

    /// Whether its value changes by the jump.
    pub fn jumps(self) -> bool {
        matches!(self, Self::Forced | Self::Shared | Self::Following)
    }
}

impl Discrete {
    /// No modes and no conditions on time.
    pub const NONE: Self = Self {
        automata: List::Borrowed(&[]),
        n_time_conditions: 0,
        clocks: List::Borrowed(&[]),
        event_formulas: Formulas::NONE,
        event_jacobian: Pattern::EMPTY,
        event_directions: Pattern::EMPTY,
        reset_jacobian: Pattern::EMPTY,
        reset_directions: Pattern::EMPTY,
        by_mode: List::Borrowed(&[]),
        jump_jacobian: Pattern::EMPTY,
        unlocated: List::Borrowed(&[]),
    };

    /// Number of discrete numbers n_z.
    pub fn len(&self) -> usize {
        self.automata.len() + self.n_time_conditions
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Transitions of all automata, each with its automaton's position, in the order of the event
    /// functions and resets.
    pub fn transitions(&self) -> impl Iterator<Item = (usize, &Transition)> {
        let automata = self.automata.iter().enumerate();
        automata.flat_map(|(k, automaton)| automaton.transitions.iter().map(move |t| (k, t)))
    }
}

#[cfg(test)]
mod tests {
    use super::JumpKind;

    #[test]
    fn numbers_lead_back_to_their_kinds() {
        for kind in JumpKind::ALL {
            assert_eq!(JumpKind::of_number(kind.number()), kind);
        }
        assert_eq!(JumpKind::of_number(f64::NAN), JumpKind::None);
    }
}
