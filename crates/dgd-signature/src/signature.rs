//! Everything that a solver knows about a model except its functions.

use crate::{
    DelayedInput, DelayedUnknown, Density, Discrete, Input, Labels, List, Output, Parameter,
    PastLayout, Pattern, Text, Unit, Unknowns,
};

/// Names, sizes, units, defaults and sparsity of a compiled model.
///
/// Borrowed and static for generated models, owned for loaded ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Signature {
    /// The model's name.
    pub name: Text,
    /// The n unknowns y.
    pub unknowns: Unknowns,
    /// Label of the equation behind row i of f.
    pub equations: Labels,
    /// Parameters p.
    pub parameters: List<Parameter>,
    /// Inputs, as declared.
    pub inputs: List<Input>,
    /// Distinct delays τ, as formulas write them.
    pub delays: List<Text>,
    /// Distinct variable delays, as formulas write them: functions of time, inputs and differential unknowns.
    pub varying_delays: List<Text>,
    /// Delayed inputs: in u they follow `inputs`, and are followed by their slopes.
    pub delayed_inputs: List<DelayedInput>,
    /// Delayed unknowns: in u their past ([`PastLayout`]) follows the inputs.
    pub delayed_unknowns: List<DelayedUnknown>,
    /// Inputs through which equations were differentiated to reduce the index to 1.
    pub differentiated_inputs: List<DifferentiatedInput>,
    /// Outputs w.
    pub outputs: List<Output>,
    /// How readings scatter around outputs whose `noise` is more than a number.
    pub densities: List<Density>,
    /// Chosen directions θ.
    pub directions: List<Direction>,
    /// Pattern of ∂f/∂y: n × n.
    pub jacobian: Pattern,
    /// Pattern of ∂g/∂y: (n · n_s) × n.
    pub sensitivity_jacobian: Pattern,
    /// Pattern of ∂f/∂p: n × n_p.
    pub parameter_jacobian: Pattern,
    /// Pattern of ∂f/∂u: n × n_u.
    pub input_jacobian: Pattern,
    /// Patterns of ∂w/∂y, ∂w/∂u and ∂w/∂p.
    pub output_jacobians: [Pattern; 3],
    /// Modes, transitions and conditions on time.
    pub discrete: Discrete,
    /// Whether a run begins at rest, and start values are where that is looked for.
    pub starts_at_rest: bool,
    /// What holds at the start besides the equations, and determines as many start values.
    pub start_equations: List<StartEquation>,
    /// Sums that the equations conserve in all modes and for all inputs.
    pub conserved: List<Conserved>,
}

/// A sum Σ cₖ yₖ of differential unknowns that the equations conserve.
#[derive(Debug, Clone, PartialEq)]
pub struct Conserved {
    /// Positions of the unknowns, ascending, with their coefficients.
    pub terms: List<(usize, f64)>,
}

/// An equation that holds at the start.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StartEquation {
    /// Its label.
    pub name: Text,
    /// Position of a state whose start value it determines, together with the other start equations.
    pub unknown: usize,
}

/// A direction of sensitivities.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// The parameter at this position.
    Parameter(usize),
    /// The start value of the unknown at this position.
    Start(usize),
}

/// An input through which an equation was differentiated: if it jumped, states would have to jump.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DifferentiatedInput {
    /// Position of the input.
    pub input: usize,
    /// Label of the equation.
    pub equation: Text,
}

impl Signature {
    /// Whether start values, or some of them, are found and only begin at those that are declared.
    pub fn start_is_found(&self) -> bool {
        self.starts_at_rest || !self.start_equations.is_empty()
    }

    /// n_u, the length of u.
    pub fn n_u(&self) -> usize {
        let past = self.past();
        past.first + past.len()
    }

    /// Layout in u of the past of delayed unknowns.
    pub fn past(&self) -> PastLayout {
        PastLayout {
            first: self.inputs.len() + 2 * self.delayed_inputs.len(),
            n_v: self.delayed_unknowns.len(),
            n_s: self.directions.len(),
        }
    }

    /// Writes the diagonal of M in the starting modes.
    ///
    /// # Panics
    ///
    /// If the length differs from the number of unknowns.
    pub fn write_mass(&self, mass: &mut [f64]) {
        self.unknowns.write_mass(mass);
    }

    /// How readings of an output scatter, where that is more than a number.
    pub fn density(&self, output: usize) -> Option<Density> {
        self.densities.iter().find(|density| density.output == output).copied()
    }

    /// Whether an output computes the standard deviation of another one: nobody measures it.
    pub fn is_deviation(&self, output: usize) -> bool {
        self.densities.iter().any(|density| density.deviation == output)
    }

    /// Name of the j-th direction: a parameter's name, or `x(0)` for a start value.
    ///
    /// # Panics
    ///
    /// If there is no such direction.
    pub fn direction_name(&self, j: usize) -> Text {
        match self.directions[j] {
            Direction::Parameter(i) => self.parameters[i].name.clone(),
            Direction::Start(i) => format!("{}(0)", self.unknowns.name(i)).into(),
        }
    }

    /// The unit of the j-th direction.
    ///
    /// # Panics
    ///
    /// If there is no such direction.
    pub fn direction_unit(&self, j: usize) -> &Unit {
        match self.directions[j] {
            Direction::Parameter(i) => &self.parameters[i].unit,
            Direction::Start(i) => self.unknowns.unit(i),
        }
    }
}
