//! Chooses the directions of a program's sensitivities.

use super::Direction;
use crate::dae::{Dae, DaeUnknown};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported, suggestion};
use crate::syntax::ast::Name;

/// Directions of the sensitivities of a program.
#[derive(Debug, Clone, Default)]
pub enum SensitivityDirections {
    /// None: only states and outputs.
    #[default]
    None,
    /// All parameters.
    All,
    /// These parameters, and the start values of these states.
    Named(Vec<Name>),
    /// The directions that a fit estimates.
    Estimated {
        /// These parameters; if no parameter is named, all that are not `fixed`. Start values of these states, in
        /// addition to those that are not `fixed`.
        free: Vec<Name>,
        /// None of these, parameters and states.
        fixed: Vec<Name>,
    },
    /// The directions that a filter tracks: parameters as in a fit, and all unknowns that are states in some mode, even
    /// `fixed` ones.
    Tracked {
        /// These parameters; if no parameter is named, all that are not `fixed`.
        free: Vec<Name>,
        /// None of these parameters.
        fixed: Vec<Name>,
    },
}

/// The directions in which a program is differentiated, each once.
///
/// # Errors
///
/// [`ErrorReported`] if a name is neither a parameter nor a state.
pub fn choose(
    dae: &Dae,
    directions: &SensitivityDirections,
    diagnostics: &mut Diagnostics,
) -> Result<Vec<Direction>, ErrorReported> {
    let chosen = match directions {
        SensitivityDirections::None => Vec::new(),
        SensitivityDirections::All => (0..dae.parameters.len()).map(Direction::Parameter).collect(),
        SensitivityDirections::Named(names) => named(dae, names, diagnostics),
        SensitivityDirections::Estimated { free, fixed } => {
            let directions = named(dae, free, diagnostics);
            let fixed = named(dae, fixed, diagnostics);
            refuse_starts(dae, free, diagnostics);
            estimated(dae, &directions, &fixed)
        }
        SensitivityDirections::Tracked { free, fixed } => {
            let free = named(dae, free, diagnostics);
            let fixed = named(dae, fixed, diagnostics);
            tracked(dae, &free, &fixed)
        }
    };
    diagnostics.check()?;
    Ok(chosen)
}

/// Refuses to estimate start values of a model that starts at rest or by start equations: they follow from its
/// parameters.
fn refuse_starts(dae: &Dae, free: &[Name], diagnostics: &mut Diagnostics) {
    for name in free {
        let states = dae.positions(&name.text);
        if dae.starts_at_rest && !states.is_empty() {
            let message = format!(
                "the model starts at rest, so the start value of `{}` is not free",
                name.text
            );
            diagnostics.error(
                Diagnostic::new(Code::StartNotSteady, name.span, message)
                    .help("leave out `start steady` to estimate start values"),
            );
        }
        let mut equations = dae.start_equations.iter();
        if let Some(equation) = equations.find(|equation| states.contains(&equation.unknown)) {
            let state = dae.unknown_name(equation.unknown);
            let (which, what) = match dae.start_equations.len() {
                1 => (format!("start equation `{}`", equation.name), "this one"),
                _ => ("the start equations".to_owned(), "one of them"),
            };
            let message =
                format!("the start value of `{state}` follows from {which}, so it is not free");
            diagnostics.error(
                Diagnostic::new(Code::UndeterminedStart, name.span, message)
                    .label(equation.span, what)
                    .help("leave out a start equation to estimate a start value in its place"),
            );
        }
    }
}

/// The directions that a fit estimates: parameters and start values, except those in `fixed`.
fn estimated(dae: &Dae, free: &[Direction], fixed: &[Direction]) -> Vec<Direction> {
    let states = dae.unknowns.iter().enumerate().filter(|(_, x)| x.differential);
    let starts = states
        .map(|(i, state)| (Direction::Start(i), state.fixed))
        .filter(|(start, is_fixed)| !is_fixed || free.contains(start))
        .map(|(start, _)| start);
    // Elements of arrays are estimated on request only.
    let elements = free
        .iter()
        .filter(|of| matches!(of, Direction::Start(i) if *i >= dae.unknowns.len()))
        .copied();
    let starts = starts.chain(elements);
    free_parameters(dae, free).chain(starts).filter(|of| !fixed.contains(of)).collect()
}

/// The directions that a filter tracks: parameters except those in `fixed`, and every state.
fn tracked(dae: &Dae, free: &[Direction], fixed: &[Direction]) -> Vec<Direction> {
    let parameters = free_parameters(dae, free).filter(|of| !fixed.contains(of));
    // A filter also carries unknowns that are differential only in modes other than the initial one.
    let is_state = |x: &DaeUnknown| x.differential || dae.graph.value(x.mass) != Some(0.0);
    let states = dae.unknowns.iter().enumerate().filter(|(_, x)| is_state(x)).map(|(i, _)| i);
    let families = dae.families.iter().filter(|family| family.differential);
    let elements = families.flat_map(|family| family.first..family.first + family.count as usize);
    parameters.chain(states.chain(elements).map(Direction::Start)).collect()
}

/// The parameters among `free`; if there are none, all that are not `fixed`.
fn free_parameters(dae: &Dae, free: &[Direction]) -> impl Iterator<Item = Direction> {
    let is_named = free.iter().any(|of| matches!(of, Direction::Parameter(_)));
    let parameters = dae.parameters.iter().enumerate();
    parameters
        .map(|(i, parameter)| (Direction::Parameter(i), parameter.fixed))
        .filter(move |(of, is_fixed)| if is_named { free.contains(of) } else { !is_fixed })
        .map(|(of, _)| of)
}

/// Parameters and start values of states, found by name.
fn named(dae: &Dae, names: &[Name], diagnostics: &mut Diagnostics) -> Vec<Direction> {
    // A parameter, or all elements of an array.
    let parameters = |name: &str| -> Vec<Direction> {
        let is_it = |own: &str| {
            let rest = own.strip_prefix(name);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('['))
        };
        let numbered = dae.parameters.iter().enumerate();
        let matching = numbered.filter(|(_, parameter)| is_it(&parameter.declared.name));
        matching.map(|(i, _)| Direction::Parameter(i)).collect()
    };
    let mut chosen: Vec<Direction> = Vec::with_capacity(names.len());
    for Name { text, span } in names {
        let mut directions = parameters(text);
        if directions.is_empty() {
            let states = dae.positions(text).into_iter().filter(|i| dae.is_differential(*i));
            directions.extend(states.map(Direction::Start));
        }
        if directions.is_empty() {
            let message = format!("there is no parameter and no state `{text}`");
            let help = what_there_is(dae, text);
            diagnostics.error(Diagnostic::new(Code::UnknownName, *span, message).help(help));
        }
        for direction in directions {
            if !chosen.contains(&direction) {
                chosen.push(direction);
            }
        }
    }
    chosen
}

/// Help for an unknown name.
fn what_there_is(dae: &Dae, text: &str) -> String {
    let parameters = dae.parameters.iter().map(|p| p.declared.name.as_str());
    let states = dae.unknowns.iter().filter(|x| x.differential).map(|x| x.name.as_str());
    let arrays = dae.arrays.iter().filter(|array| dae.is_differential(array.first));
    let known: Vec<&str> =
        parameters.chain(states).chain(arrays.map(|array| array.name.as_str())).collect();
    match suggestion(text, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None if known.is_empty() => "this model has no parameters".to_owned(),
        None => format!("there is `{}`", known.join("`, `")),
    }
}
