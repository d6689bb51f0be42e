//! Names of a model's unknowns and equations; those of array elements are created on demand.

use crate::{List, Text, Unit, Unknown};

/// The unknowns y: single ones, then the elements of arrays, whose descriptions are created on demand.
#[derive(Debug, Clone, PartialEq)]
pub struct Unknowns {
    /// Single unknowns, which are not elements of arrays; they come first.
    pub single: List<Unknown>,
    /// Arrays, whose elements follow.
    pub arrays: List<Array>,
    /// Rows of the elements.
    pub families: List<Family>,
}

/// An array of unknowns; in y its elements follow the preceding unknowns.
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

/// Rows of consecutive elements from one equation; families follow each other as the elements do.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Family {
    /// Number of rows.
    pub count: usize,
    /// Whether its rows are ẏ = f.
    pub differential: bool,
    /// Label of the equation.
    pub equation: Text,
    /// First index of the equation's loop; `None` for a single equation.
    pub lower: Option<i64>,
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
    /// If there are fewer.
    pub fn get(&self, i: usize) -> Unknown {
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
    /// Like [`Unknowns::get`].
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
    /// Like [`Unknowns::get`].
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
    /// Like [`Unknowns::get`].
    pub fn nominal(&self, i: usize) -> Option<f64> {
        match i.checked_sub(self.single.len()) {
            None => self.single[i].nominal,
            Some(element) => self.element(element).0.nominal,
        }
    }

    /// Whether row i is ẏᵢ = fᵢ in the starting modes.
    ///
    /// # Panics
    ///
    /// Like [`Unknowns::get`].
    pub fn is_differential(&self, i: usize) -> bool {
        match i.checked_sub(self.single.len()) {
            None => self.single[i].differential,
            Some(row) => row_of(&self.families, row).0.differential,
        }
    }

    /// Positions of the differential unknowns, the states, in ascending order.
    pub fn differential(&self) -> impl Iterator<Item = usize> + Clone + '_ {
        (0..self.len()).filter(|i| self.is_differential(*i))
    }

    /// Number of rows 0 = fᵢ in the starting modes.
    pub fn n_algebraic(&self) -> usize {
        let single = self.single.iter().filter(|unknown| !unknown.differential).count();
        let families = self.families.iter().filter(|family| !family.differential);
        single + families.map(|family| family.count).sum::<usize>()
    }

    /// Groups of consecutive unknowns with the same nominal value and unit.
    pub fn groups(&self) -> impl Iterator<Item = (usize, Option<f64>, &Unit)> {
        let single = self.single.iter().map(|unknown| (1, unknown.nominal, &unknown.unit));
        single.chain(self.arrays.iter().map(|array| (array.count, array.nominal, &array.unit)))
    }

    /// Writes ones for differential unknowns and zeros for algebraic ones.
    pub fn write_mass(&self, mass: &mut [f64]) {
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
                return (array, index(array.lower, k));
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

/// Labels of the equations behind the rows of f, those of families created on demand.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Labels {
    /// Labels of rows that do not belong to elements; they come first.
    pub single: List<Text>,
    /// Rows of elements, which follow.
    pub families: List<Family>,
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
    /// If there are fewer.
    pub fn get(&self, row: usize) -> Text {
        let Some(row) = row.checked_sub(self.single.len()) else {
            return self.single[row].clone();
        };
        let (family, k) = row_of(&self.families, row);
        family.label(k)
    }

    /// All labels, row by row.
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
            Some(lower) => element_name(&self.equation, index(lower, k)),
            None => self.equation.clone(),
        }
    }
}

/// The family of a row, counted over all families, and the row's position in it.
fn row_of(families: &[Family], mut row: usize) -> (&Family, usize) {
    for family in families {
        if row < family.count {
            return (family, row);
        }
        row -= family.count;
    }
    panic!("no row at this position")
}

/// The k-th index from `lower`.
fn index(lower: i64, k: usize) -> i64 {
    lower.saturating_add_unsigned(k as u64)
}

/// `p[3]`
pub(crate) fn element_name(name: &str, index: i64) -> Text {
    format!("{name}[{index}]").into()
}
