//! Arrays over place and time: the elements that a run keeps for their picture, and the picture.

use dgd_plot::{HeatMap, MathText, Panel};
use dgd_runtime::{Signature, Solution, Unit};

use crate::output::columns::{in_unit, is_added, is_element};
use crate::output::{ColumnKind, NamedColumn, TimeTable};

/// Smallest array drawn as a picture; the elements of smaller ones are drawn as curves.
const FEWEST: usize = 4;

/// Places and times kept of an array: about as many as its picture has cells.
const PLACES: usize = 64;
const TIMES: usize = 300;

/// An array of unknowns over place and time.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct SpaceTimeField {
    /// Its name.
    pub name: String,
    /// The unit of its values.
    pub unit: Unit,
    /// Indices of the kept elements.
    pub indices: Vec<i64>,
    /// Times, s.
    pub times: Vec<f64>,
    /// For each index, the values at the times, in the unit.
    pub values: Vec<Vec<f64>>,
}

/// Arrays of unknowns whose elements a run keeps.
#[derive(Debug, Default)]
pub(super) struct WantedArrays {
    /// Indices of the elements among the unknowns, array by array.
    pub(super) elements: Vec<usize>,
    arrays: Vec<(String, Unit, Vec<i64>)>,
}

impl WantedArrays {
    /// All arrays that are large enough and not shown by an output.
    pub(super) fn collect(signature: &Signature) -> WantedArrays {
        let arrays = &signature.unknowns.arrays;
        let in_arrays: usize = arrays.iter().map(|array| array.count).sum();
        let mut first = signature.unknowns.len() - in_arrays;
        let mut wanted = WantedArrays::default();
        for array in arrays.iter() {
            let is_shown = || {
                let mut outputs = signature.outputs.iter();
                outputs.any(|output| base(&output.name) == Some(&*array.name))
            };
            if array.count >= FEWEST && !is_added(&array.name) && !is_shown() {
                let kept = thinned(array.count, PLACES);
                wanted.elements.extend(kept.iter().map(|k| first + k));
                let index = |k: &usize| array.lower + i64::try_from(*k).unwrap_or(i64::MAX);
                let indices = kept.iter().map(index).collect();
                wanted.arrays.push((array.name.to_string(), array.unit.clone(), indices));
            }
            first += array.count;
        }
        wanted
    }

    /// The kept elements in a solution, after `single` single unknowns.
    pub(super) fn found(self, solution: &Solution, single: usize) -> Vec<SpaceTimeField> {
        let rows = thinned(solution.len(), TIMES);
        let times: Vec<f64> = rows.iter().map(|k| solution.times[*k]).collect();
        let mut next = single;
        let arrays = self.arrays.into_iter().map(|(name, unit, indices)| {
            let elements = next..next + indices.len();
            next = elements.end;
            let value = |i: usize, k: &usize| unit.from_si(solution.y(*k)[i]);
            let values = elements.map(|i| rows.iter().map(|k| value(i, k)).collect()).collect();
            SpaceTimeField { name, times: times.clone(), values, indices, unit }
        });
        arrays.collect()
    }
}

/// The array of an element.
fn base(name: &str) -> Option<&str> {
    is_element(name).then(|| name.split('[').next()).flatten()
}

/// At most `most` evenly spaced indices below `count`, including the last.
fn thinned(count: usize, most: usize) -> Vec<usize> {
    let stride = count.div_ceil(most).max(1);
    let mut kept: Vec<usize> = (0..count).step_by(stride).collect();
    match (kept.last().copied(), count.checked_sub(1)) {
        (Some(last), Some(end)) if last != end => kept.push(end),
        _ => {}
    }
    kept
}

impl SpaceTimeField {
    fn panel(&self) -> Panel {
        let places = self.indices.iter().map(|i| *i as f64).collect();
        panel(&self.name, &self.unit, places, self.times.clone(), self.values.clone())
    }
}

fn panel(name: &str, unit: &Unit, places: Vec<f64>, x: Vec<f64>, values: Vec<Vec<f64>>) -> Panel {
    Panel {
        title: MathText::name(name).with_unit(&unit.symbol),
        y_label: MathText::plain("index"),
        map: Some(HeatMap { x, places, values }),
        ..Panel::default()
    }
}

/// Arrays of outputs drawn as pictures, by name.
pub(super) fn arrays_of(table: &TimeTable) -> Vec<String> {
    let outputs = table.columns.iter().filter(|column| column.kind == ColumnKind::Output);
    let mut counted: Vec<(&str, usize)> = Vec::new();
    for array in outputs.filter_map(|output| base(&output.name)) {
        match counted.iter_mut().find(|(name, _)| *name == array) {
            Some((_, count)) => *count += 1,
            None => counted.push((array, 1)),
        }
    }
    let large = counted.into_iter().filter(|(_, count)| *count >= FEWEST);
    large.map(|(name, _)| name.to_owned()).collect()
}

/// Whether an output is an element of one of these arrays.
pub(super) fn is_of(output: &str, arrays: &[String]) -> bool {
    base(output).is_some_and(|array| arrays.iter().any(|name| name == array))
}

/// A panel for each array: of unknowns, then of outputs.
pub(super) fn panels(
    fields: &[SpaceTimeField],
    table: &TimeTable,
    arrays: &[String],
) -> Vec<Panel> {
    let of_outputs = arrays.iter().filter_map(|array| {
        let elements: Vec<&NamedColumn> = (table.columns.iter())
            .filter(|column| column.kind == ColumnKind::Output && base(&column.name) == Some(array))
            .collect();
        let unit = &elements.first()?.unit;
        let index = |column: &NamedColumn| -> Option<f64> {
            column.name[array.len()..].trim_matches(['[', ']']).parse().ok()
        };
        let rows = thinned(table.times.len(), TIMES);
        let kept = thinned(elements.len(), PLACES);
        let places = kept.iter().map(|k| index(elements[*k])).collect::<Option<Vec<f64>>>()?;
        let values = kept.iter().map(|k| {
            let column: Vec<f64> = rows.iter().map(|row| elements[*k].values[*row]).collect();
            in_unit(&column, unit)
        });
        let x = rows.iter().map(|row| table.times[*row]).collect();
        Some(panel(array, unit, places, x, values.collect()))
    });
    fields.iter().map(SpaceTimeField::panel).chain(of_outputs).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_thinned_keeps_its_ends() {
        assert_eq!(thinned(5, 64), [0, 1, 2, 3, 4]);
        let kept = thinned(1001, 64);
        assert!(kept.len() <= 65 && kept[0] == 0 && kept.last() == Some(&1000), "{kept:?}");
        assert!(thinned(0, 64).is_empty());
    }

    #[test]
    fn large_arrays_of_outputs_are_pictures_in_their_unit() {
        let unit = Unit { symbol: "bar".into(), factor: 1e5, offset: 0.0 };
        let column = |name: &str, value: f64| {
            NamedColumn::new(name, &unit, ColumnKind::Output, vec![value, 2.0 * value])
        };
        let elements = (0..4).map(|i| column(&format!("p[{i}]"), f64::from(i) * 1e5));
        let others = ["q[1]", "q[2]", "r"].map(|name| column(name, 1.0));
        let columns = elements.chain(others).collect();
        let table = TimeTable { times: vec![0.0, 1.0], epoch: None, columns };
        let arrays = arrays_of(&table);
        assert_eq!(arrays, ["p"]);
        assert!(is_of("p[3]", &arrays) && !is_of("q[1]", &arrays) && !is_of("p", &arrays));
        let panels = panels(&[], &table, &arrays);
        let map = panels[0].map.as_ref().expect("a map");
        assert_eq!(map.places, [0.0, 1.0, 2.0, 3.0]);
        assert_eq!(map.values[3], [3.0, 6.0]);
        assert_eq!(panels[0].title.to_plain(), "p [bar]");
    }
}
