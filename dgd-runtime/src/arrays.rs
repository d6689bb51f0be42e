//! The description of a model with arrays, from one that does not grow with them.

use crate::system::{List, Output, Signature, Text, Unit, Unknown};

/// An array of unknowns; in y its elements follow what is in front of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Its name.
    pub name: Text,
    /// Index of its first element.
    pub lower: i64,
    /// Number of elements.
    pub count: usize,
    /// Declared unit.
    pub unit: Unit,
    /// Size for tolerances, SI.
    pub nominal: Option<f64>,
}

/// Outputs for each element of an array; in w they follow what is in front of them.
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

/// Rows of consecutive elements from one equation; families follow each other as the elements do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Family {
    /// Number of rows.
    pub count: usize,
    /// Whether its rows are ẏ = f.
    pub differential: bool,
    /// Label of the equation.
    pub equation: Text,
    /// First index of the equation's loop; none for an equation of its own.
    pub lower: Option<i64>,
}

/// Places (row + k, column + k) or (row + k, column) of a matrix, for k from 0 to `count` − 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Run {
    /// Row of the first place.
    pub row: usize,
    /// Column of the first place.
    pub column: usize,
    /// Whether the column moves with the row.
    pub diagonal: bool,
    /// Number of places.
    pub count: usize,
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
    pub runs: [List<Run>; 7],
}

/// The unknowns y: single ones, then the elements of arrays, whose descriptions are made on demand.
#[derive(Debug, Clone, PartialEq)]
pub struct Unknowns {
    single: List<Unknown>,
    arrays: List<Array>,
    /// Rows of the elements.
    families: List<Family>,
}

impl Unknowns {
    /// Single unknowns.
    pub const fn single(single: &'static [Unknown]) -> Self {
        Self {
            single: List::Borrowed(single),
            arrays: List::Borrowed(&[]),
            families: List::Borrowed(&[]),
        }
    }

    /// Number of unknowns n.
    pub fn len(&self) -> usize {
        self.single.len() + self.arrays.iter().map(|array| array.count).sum::<usize>()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The i-th of them.
    ///
    /// # Panics
    ///
    /// If there are not so many.
    pub fn at(&self, i: usize) -> Unknown {
        let Some(element) = i.checked_sub(self.single.len()) else {
            return self.single[i].clone();
        };
        let (array, index) = self.element(element);
        Unknown {
            name: element_name(&array.name, index),
            unit: array.unit.clone(),
            nominal: array.nominal,
            differential: self.is_differential(i),
        }
    }

    /// All of them, one by one.
    pub fn iter(&self) -> impl Iterator<Item = Unknown> + '_ {
        let elements = self.arrays.iter().flat_map(|array| {
            let indices = array.lower..;
            indices.take(array.count).map(move |index| (array, index))
        });
        let rows = self.families.iter();
        let rows = rows.flat_map(|family| std::iter::repeat_n(family.differential, family.count));
        let elements = elements.zip(rows).map(|((array, index), differential)| Unknown {
            name: element_name(&array.name, index),
            unit: array.unit.clone(),
            nominal: array.nominal,
            differential,
        });
        self.single.iter().cloned().chain(elements)
    }

    /// Name of the i-th.
    ///
    /// # Panics
    ///
    /// As [`Unknowns::at`].
    pub fn name(&self, i: usize) -> Text {
        match i.checked_sub(self.single.len()) {
            None => self.single[i].name.clone(),
            Some(element) => {
                let (array, index) = self.element(element);
                element_name(&array.name, index)
            }
        }
    }

    /// Declared unit of the i-th.
    ///
    /// # Panics
    ///
    /// As [`Unknowns::at`].
    pub fn unit(&self, i: usize) -> &Unit {
        match i.checked_sub(self.single.len()) {
            None => &self.single[i].unit,
            Some(element) => &self.element(element).0.unit,
        }
    }

    /// Declared nominal value of the i-th.
    ///
    /// # Panics
    ///
    /// As [`Unknowns::at`].
    pub fn nominal(&self, i: usize) -> Option<f64> {
        match i.checked_sub(self.single.len()) {
            None => self.single[i].nominal,
            Some(element) => self.element(element).0.nominal,
        }
    }

    /// Whether row i is ẏᵢ = fᵢ in the modes that the model starts in.
    ///
    /// # Panics
    ///
    /// As [`Unknowns::at`].
    pub fn is_differential(&self, i: usize) -> bool {
        match i.checked_sub(self.single.len()) {
            None => self.single[i].differential,
            Some(row) => row_of(&self.families, row).0.differential,
        }
    }

    /// How many rows are 0 = fᵢ in the modes that the model starts in.
    pub fn n_algebraic(&self) -> usize {
        let single = self.single.iter().filter(|unknown| !unknown.differential).count();
        let families = self.families.iter().filter(|family| !family.differential);
        single + families.map(|family| family.count).sum::<usize>()
    }

    /// Nominal values and units of consecutive unknowns that have them in common.
    pub(crate) fn groups(&self) -> impl Iterator<Item = (usize, Option<f64>, &Unit)> {
        let single = self.single.iter().map(|unknown| (1, unknown.nominal, &unknown.unit));
        single.chain(self.arrays.iter().map(|array| (array.count, array.nominal, &array.unit)))
    }

    /// Writes ones for differential unknowns and zeros for algebraic ones.
    pub(crate) fn write_mass(&self, mass: &mut [f64]) {
        assert_eq!(mass.len(), self.len(), "one number for each unknown");
        let number = |differential: bool| f64::from(u8::from(differential));
        let (single, mut rest) = mass.split_at_mut(self.single.len());
        for (mass, unknown) in single.iter_mut().zip(self.single.iter()) {
            *mass = number(unknown.differential);
        }
        for family in self.families.iter() {
            let (rows, after) = rest.split_at_mut(family.count);
            rows.fill(number(family.differential));
            rest = after;
        }
    }

    /// The array of an element, counted over all arrays, and its index there.
    fn element(&self, mut k: usize) -> (&Array, i64) {
        for array in self.arrays.iter() {
            if k < array.count {
                return (array, array.lower + k as i64);
            }
            k -= array.count;
        }
        panic!("no unknown at this position")
    }
}

impl FromIterator<Unknown> for Unknowns {
    fn from_iter<T: IntoIterator<Item = Unknown>>(unknowns: T) -> Self {
        Self { single: unknowns.into_iter().collect(), ..Self::single(&[]) }
    }
}

/// Labels of the equations behind the rows of f, those of families made on demand.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Labels {
    single: List<Text>,
    families: List<Family>,
}

impl Labels {
    /// Labels of single equations.
    pub const fn single(single: &'static [Text]) -> Self {
        Self { single: List::Borrowed(single), families: List::Borrowed(&[]) }
    }

    /// Label of the equation behind this row.
    ///
    /// # Panics
    ///
    /// If there are not so many.
    pub fn at(&self, row: usize) -> Text {
        let Some(row) = row.checked_sub(self.single.len()) else {
            return self.single[row].clone();
        };
        let (family, k) = row_of(&self.families, row);
        family.label(k)
    }

    /// All of them, row by row.
    pub fn iter(&self) -> impl Iterator<Item = Text> + '_ {
        let of_families = |family: &'_ Family| {
            let family = family.clone();
            (0..family.count).map(move |k| family.label(k))
        };
        self.single.iter().cloned().chain(self.families.iter().flat_map(of_families))
    }
}

impl FromIterator<Text> for Labels {
    fn from_iter<T: IntoIterator<Item = Text>>(labels: T) -> Self {
        Self { single: labels.into_iter().collect(), families: List::Borrowed(&[]) }
    }
}

impl Family {
    /// Label of its k-th row.
    fn label(&self, k: usize) -> Text {
        match self.lower {
            Some(lower) => element_name(&self.equation, lower + k as i64),
            None => self.equation.clone(),
        }
    }
}

/// The family of a row, counted over all families, and which of its rows it is.
fn row_of(families: &[Family], mut row: usize) -> (&Family, usize) {
    for family in families {
        if row < family.count {
            return (family, row);
        }
        row -= family.count;
    }
    panic!("no row at this position")
}

/// The description of a whole model, given that of its single unknowns and what arrays add.
///
/// It does not grow with the arrays, outputs for each element aside.
pub fn with_arrays(mut signature: Signature, added: &Arrays) -> Signature {
    signature.unknowns.arrays = added.arrays.clone();
    signature.unknowns.families = added.families.clone();
    signature.equations.families = added.families.clone();
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
        pattern.runs = runs.clone();
    }
    signature
}

/// `p[3]`
fn element_name(name: &str, index: i64) -> Text {
    format!("{name}[{index}]").into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::{Discrete, Pattern};

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
            directions: List::Borrowed(&[]),
            jacobian: Pattern::of(&[(0, 0)]),
            sensitivity_jacobian: none(),
            parameter_jacobian: none(),
            input_jacobian: none(),
            output_jacobians: [none(), none(), none()],
            discrete: Discrete::NONE,
        };
        let family = |count, differential, lower| Family {
            count,
            differential,
            equation: "row".into(),
            lower,
        };
        let run = |row, column, diagonal| Run { row, column, diagonal, count: 2 };
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
                vec![Run { count: 3, ..run(0, 1, true) }].into(),
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
            assert_eq!(unknown, whole.unknowns.at(i));
            let named = Unknown {
                name: whole.unknowns.name(i),
                unit: whole.unknowns.unit(i).clone(),
                nominal: whole.unknowns.nominal(i),
                differential: whole.unknowns.is_differential(i),
            };
            assert_eq!((named, &labels[i]), (unknown, &whole.equations.at(i)));
        }
        let places: Vec<_> = whole.jacobian.positions().collect();
        assert_eq!(places, [(0, 0), (2, 1), (3, 2), (2, 0), (3, 0)]);
        let read: Vec<_> = whole.output_jacobians[0].positions().collect();
        assert_eq!((read, &*whole.outputs[2].name), (vec![(0, 1), (1, 2), (2, 3)], "p[5]"));
    }
}
