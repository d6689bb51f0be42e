//! All that a solver knows of a model but its functions.

use crate::{
    DelayedInput, DelayedUnknown, Discrete, Input, Labels, List, Output, Parameter, PastLayout,
    Pattern, Text, Unit, Unknowns,
};

/// Names, sizes, units, defaults and sparsity of a compiled model.
///
/// Borrowed and static for generated models, owned for loaded ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Signature {
    /// The model's name.
    pub name: Text,
    /// Unknowns y, n of them.
    pub unknowns: Unknowns,
    /// Label of the equation behind row i of f.
    pub equations: Labels,
    /// Parameters p.
    pub parameters: List<Parameter>,
    /// Inputs, as declared.
    pub inputs: List<Input>,
    /// Distinct delays τ, as formulas write them.
    pub delays: List<Text>,
    /// Distinct delays that vary, as formulas write them: of time, inputs and differential unknowns.
    pub varying_delays: List<Text>,
    /// Inputs that the equations read late: u has them, and then their slopes, behind `inputs`.
    pub delayed_inputs: List<DelayedInput>,
    /// Unknowns that the equations read late: u has what is known of them ([`PastLayout`]) behind the
    /// inputs.
    pub delayed_unknowns: List<DelayedUnknown>,
    /// Inputs that equations are differentiated through to bring the index to 1.
    pub differentiated_inputs: List<DifferentiatedInput>,
    /// Outputs w.
    pub outputs: List<Output>,
    /// Chosen directions θ.
    pub directions: List<Direction>,
    /// Where ∂f/∂y is not zero: n × n.
    pub jacobian: Pattern,
    /// Where ∂g/∂y is not zero: (n · n_s) × n.
    pub sensitivity_jacobian: Pattern,
    /// Where ∂f/∂p is not zero: n × n_p.
    pub parameter_jacobian: Pattern,
    /// Where ∂f/∂u is not zero: n × n_u.
    pub input_jacobian: Pattern,
    /// Where ∂w/∂y, ∂w/∂u and ∂w/∂p are not zero.
    pub output_jacobians: [Pattern; 3],
    /// Modes, transitions and conditions on time.
    pub discrete: Discrete,
}

/// Something that sensitivities are taken to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// The parameter at this position.
    Parameter(usize),
    /// The start value of the unknown at this position.
    Start(usize),
}

/// An input that an equation is differentiated through: where it jumps, states would have to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DifferentiatedInput {
    /// Position of the input.
    pub input: usize,
    /// Label of the equation.
    pub equation: Text,
}

impl Signature {
    /// n_u, the length of u.
    pub fn n_u(&self) -> usize {
        let past = self.past();
        past.first + past.len()
    }

    /// Where u has what is known of delayed unknowns.
    pub fn past(&self) -> PastLayout {
        PastLayout {
            first: self.inputs.len() + 2 * self.delayed_inputs.len(),
            n_v: self.delayed_unknowns.len(),
            n_s: self.directions.len(),
        }
    }

    /// The diagonal of M in the modes that the model starts in.
    ///
    /// # Panics
    ///
    /// If there are not as many numbers as unknowns.
    pub fn write_mass(&self, mass: &mut [f64]) {
        self.unknowns.write_mass(mass);
    }

    /// What the j-th direction is called: a parameter by its name, a start value as `x(0)`.
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
