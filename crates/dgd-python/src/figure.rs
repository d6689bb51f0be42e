//! Figures as dictionaries of data and colours, for any drawing library.

use dgd_plot::{Figure, HeatMap, Panel, SeriesStyle, scale_of_colours};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::numbers::PyNumbers;

/// A colour as `#rrggbb`.
fn colour([red, green, blue]: [u8; 3]) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

fn style(style: SeriesStyle) -> &'static str {
    match style {
        SeriesStyle::Line => "line",
        SeriesStyle::ThinLine => "thin",
        SeriesStyle::Dots => "dots",
        SeriesStyle::Marks => "marks",
    }
}

/// A figure: its title, columns, label of the common axis and panels.
pub(crate) fn dictionary<'py>(py: Python<'py>, figure: &Figure) -> PyResult<Bound<'py, PyDict>> {
    let dictionary = PyDict::new(py);
    dictionary.set_item("title", figure.title.to_plain())?;
    dictionary.set_item("columns", figure.columns)?;
    dictionary.set_item("x_label", figure.x_label.to_plain())?;
    let panels = PyList::empty(py);
    for one in &figure.panels {
        panels.append(panel(py, one)?)?;
    }
    dictionary.set_item("panels", panels)?;
    Ok(dictionary)
}

fn panel<'py>(py: Python<'py>, panel: &Panel) -> PyResult<Bound<'py, PyDict>> {
    let dictionary = PyDict::new(py);
    dictionary.set_item("title", panel.title.to_plain())?;
    dictionary.set_item("y_label", panel.y_label.to_plain())?;
    dictionary.set_item("bands", panel.bands.iter().map(|b| (b.from, b.to)).collect::<Vec<_>>())?;
    let many = PyList::empty(py);
    for (series, look) in panel.series.iter().zip(panel.looks()) {
        let one = PyDict::new(py);
        one.set_item("name", series.name.to_plain())?;
        one.set_item("style", style(series.style))?;
        one.set_item("colour", colour(look.colour))?;
        one.set_item("dashes", look.dashes.to_vec())?;
        one.set_item("x", PyNumbers(series.x.clone()))?;
        one.set_item("y", PyNumbers(series.y.clone()))?;
        many.append(one)?;
    }
    dictionary.set_item("series", many)?;
    let many = PyList::empty(py);
    for (envelope, surface) in panel.envelopes.iter().zip(panel.surfaces()) {
        let one = PyDict::new(py);
        one.set_item("name", envelope.name.to_plain())?;
        one.set_item("colour", colour(surface))?;
        one.set_item("x", PyNumbers(envelope.x.clone()))?;
        one.set_item("low", PyNumbers(envelope.low.clone()))?;
        one.set_item("high", PyNumbers(envelope.high.clone()))?;
        many.append(one)?;
    }
    dictionary.set_item("envelopes", many)?;
    if let Some(map) = &panel.map {
        dictionary.set_item("map", cells(py, map)?)?;
    }
    Ok(dictionary)
}

/// A heat map: its axes, a list of values for each position, and the colours from the lowest value to the highest.
fn cells<'py>(py: Python<'py>, map: &HeatMap) -> PyResult<Bound<'py, PyDict>> {
    let dictionary = PyDict::new(py);
    dictionary.set_item("x", PyNumbers(map.x.clone()))?;
    dictionary.set_item("places", PyNumbers(map.places.clone()))?;
    dictionary.set_item("values", map.values.iter().cloned().map(PyNumbers).collect::<Vec<_>>())?;
    let colours: Vec<String> = scale_of_colours().into_iter().map(colour).collect();
    dictionary.set_item("colours", colours)?;
    Ok(dictionary)
}
