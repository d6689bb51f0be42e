//! Results as figures: which panels there are, and files by their ending.

use std::path::{Path, PathBuf};

use crate::console::Console;
use crate::data::write_whole;
use crate::failure::CommandError;
use crate::plot::{Figure, Panel, Series, Style, Text, render_png, render_svg};

/// What one panel shows.
#[derive(Debug, Clone)]
pub(crate) struct Subject {
    pub title: Text,
    /// Unit of its axis.
    pub unit: String,
    pub lines: Vec<Line>,
}

/// One line of a panel, in the panel's unit.
#[derive(Debug, Clone)]
pub(crate) struct Line {
    pub name: Text,
    pub times: Vec<f64>,
    pub values: Vec<f64>,
    /// Recorded rather than computed.
    pub measured: bool,
}

/// A figure with one panel for each subject over a common time axis.
pub(crate) fn panels(subjects: &[Subject]) -> Figure {
    let panels = subjects
        .iter()
        .map(|subject| Panel {
            title: subject.title.clone(),
            y_label: Text::default().with_unit(&subject.unit),
            series: subject
                .lines
                .iter()
                .map(|line| Series {
                    name: line.name.clone(),
                    style: if line.measured { Style::ThinLine } else { Style::Line },
                    x: line.times.clone(),
                    y: line.values.clone(),
                })
                .collect(),
            ..Panel::default()
        })
        .collect();
    Figure::new(Text::plain("Time").with_unit("s"), panels)
}

/// Formats of pictures, by ending.
#[derive(Debug, Clone, Copy)]
enum Picture {
    Svg,
    Png,
}

fn picture(path: &Path) -> Result<Picture, CommandError> {
    let ending = path.extension().and_then(|ending| ending.to_str()).map(str::to_ascii_lowercase);
    match ending.as_deref() {
        Some("svg") => Ok(Picture::Svg),
        Some("png") => Ok(Picture::Png),
        _ => Err(CommandError::Usage(format!(
            "`--plot {}`: a picture ends in .svg or .png",
            path.display()
        ))),
    }
}

/// Checks the endings before anything is computed.
pub(crate) fn verify_formats(paths: &[PathBuf]) -> Result<(), CommandError> {
    paths.iter().try_for_each(|path| picture(path).map(|_| ()))
}

/// Draws a figure into a file.
pub(crate) fn save(figure: &Figure, path: &Path, console: Console<'_>) -> Result<(), CommandError> {
    let bytes = match picture(path)? {
        Picture::Svg => render_svg(figure).into_bytes(),
        Picture::Png => {
            render_png(figure).map_err(|error| CommandError::Found(error.to_string()))?
        }
    };
    write_whole(path, |out| out.write_all(&bytes))?;
    console.remark(&format!("drew {}", path.display()));
    Ok(())
}
