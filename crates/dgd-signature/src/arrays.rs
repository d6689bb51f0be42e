//! Expands the description of a model with arrays from one whose size does not depend on them.

pub use crate::pattern::PatternRun;
use crate::unknowns::element_name;
pub use crate::unknowns::{Array, Family, Labels, Unknowns};
use crate::{List, Output, Signature, Text, Unit};

/// Outputs for each element of an array; in w they follow the preceding outputs.
#[derive(Debug, Clone, PartialEq)]
pub struct OutputArray {
    /// Their common name.
    pub name: Text,
    /// Index of the first.
    pub lower: i64,
    /// Number of outputs.
    pub count: usize,
    /// Declared unit.
    pub unit: Unit,
    /// Standard deviation of the sensors' white error, SI.
    pub noise: Option<f64>,
}

/// What a model's arrays add to its description.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrays {
    /// Arrays, as declared.
    pub arrays: List<Array>,
    /// Their rows.
    pub families: List<Family>,
    /// Outputs for each element.
    pub outputs: List<OutputArray>,
    /// Non-zeros in the rows of families of ∂f/∂y, ∂g/∂y, ∂f/∂p, ∂f/∂u, ∂w/∂y, ∂w/∂u and ∂w/∂p,
    /// which follow those of other rows.
    pub runs: [List<PatternRun>; 7],
}

/// The description of a whole model, from that of its single unknowns and the additions by arrays.
///
/// Its size does not depend on the arrays, except for outputs of each element.
pub fn with_arrays(mut signature: Signature, added: &Arrays) -> Signature {
    signature.unknowns.arrays.clone_from(&added.arrays);
    signature.unknowns.families.clone_from(&added.families);
    signature.equations.families.clone_from(&added.families);
    let outputs = signature.outputs.to_mut();
    for array in added.outputs.iter() {
        outputs.extend((array.lower..).take(array.count).map(|i| Output {
            name: element_name(&array.name, i),
            unit: array.unit.clone(),
            noise: array.noise,
            delay: None,
        }));
    }
    let [dwdy, dwdu, dwdp] = &mut signature.output_jacobians;
    let patterns = [
        &mut signature.jacobian,
        &mut signature.sensitivity_jacobian,
        &mut signature.parameter_jacobian,
        &mut signature.input_jacobian,
        dwdy,
        dwdu,
        dwdp,
    ];
    for (pattern, runs) in patterns.into_iter().zip(&added.runs) {
        pattern.runs.clone_from(runs);
    }
    signature
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Discrete, Pattern, Unknown};

    #[test]
    fn elements_and_places_follow_those_of_single_unknowns() {
        let unit = Unit { symbol: "m".into(), factor: 1.0, offset: 0.0 };
        let none = || Pattern::EMPTY;
        let single =
            Unknown { name: "x".into(), unit: unit.clone(), nominal: None, differential: false };
        let signature = Signature {
            name: "test".into(),
            unknowns: std::iter::once(single).collect(),
            equations: std::iter::once(Text::Borrowed("own")).collect(),
            parameters: List::Borrowed(&[]),
            inputs: List::Borrowed(&[]),
            delays: List::Borrowed(&[]),
            varying_delays: List::Borrowed(&[]),
            delayed_inputs: List::Borrowed(&[]),
            delayed_unknowns: List::Borrowed(&[]),
            differentiated_inputs: List::Borrowed(&[]),
            outputs: List::Borrowed(&[]),
            densities: List::Borrowed(&[]),
            directions: List::Borrowed(&[]),
            jacobian: Pattern::from_places(&[(0, 0)]),
            sensitivity_jacobian: none(),
            parameter_jacobian: none(),
            input_jacobian: none(),
            output_jacobians: [none(), none(), none()],
            discrete: Discrete::NONE,
            starts_at_rest: false,
            start_equations: List::Borrowed(&[]),
            conserved: List::Borrowed(&[]),
        };
        let family = |count, differential, lower| Family {
            count,
            differential,
            equation: "row".into(),
            lower,
        };
        let run = |row, column, diagonal| PatternRun { row, column, diagonal, count: 2 };
        let empty = || List::Borrowed(&[][..]);
        let added = Arrays {
            outputs: vec![OutputArray {
                name: "p".into(),
                lower: 3,
                count: 3,
                unit: unit.clone(),
                noise: None,
            }]
            .into(),
            arrays: vec![Array { name: "p".into(), lower: 3, count: 3, unit, nominal: Some(2.0) }]
                .into(),
            families: vec![family(1, false, None), family(2, true, Some(7))].into(),
            runs: [
                vec![run(2, 1, true), run(2, 0, false)].into(),
                empty(),
                empty(),
                empty(),
                vec![PatternRun { count: 3, ..run(0, 1, true) }].into(),
                empty(),
                empty(),
            ],
        };
        let whole = with_arrays(signature, &added);
        let names: Vec<Text> = whole.unknowns.iter().map(|unknown| unknown.name).collect();
        assert_eq!(names, ["x", "p[3]", "p[4]", "p[5]"]);
        let labels: Vec<Text> = whole.equations.iter().collect();
        assert_eq!(labels, ["own", "row", "row[7]", "row[8]"]);
        let differential: Vec<bool> = whole.unknowns.iter().map(|u| u.differential).collect();
        assert_eq!(differential, [false, false, true, true]);
        let mut mass = [f64::NAN; 4];
        whole.write_mass(&mut mass);
        assert_eq!(mass, [0.0, 0.0, 1.0, 1.0]);
        assert_eq!((whole.unknowns.len(), whole.unknowns.n_algebraic()), (4, 2));
        for (i, unknown) in whole.unknowns.iter().enumerate() {
            assert_eq!(unknown, whole.unknowns.get(i));
            let named = Unknown {
                name: whole.unknowns.name(i),
                unit: whole.unknowns.unit(i).clone(),
                nominal: whole.unknowns.nominal(i),
                differential: whole.unknowns.is_differential(i),
            };
            assert_eq!((named, &labels[i]), (unknown, &whole.equations.get(i)));
        }
        let places: Vec<_> = whole.jacobian.positions().collect();
        assert_eq!(places, [(0, 0), (2, 1), (3, 2), (2, 0), (3, 0)]);
        let read: Vec<_> = whole.output_jacobians[0].positions().collect();
        assert_eq!((read, &*whole.outputs[2].name), (vec![(0, 1), (1, 2), (2, 3)], "p[5]"));
    }
}
