//! Figures as files, with the format given by the extension.

use std::path::{Path, PathBuf};

use dgd_data::files::write_whole;
use dgd_plot::{Figure, render_pdf, render_png, render_svg};
use dgd_work::WorkError;

use crate::command_line::command_line;
use crate::console::Console;
use crate::failure::CommandError;

/// Image formats, by extension.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ImageFormat {
    Svg,
    Pdf,
    Png,
    Html,
}

/// Content of an image file.
pub(crate) enum ImageContent {
    /// A figure.
    Figure(Figure),
    /// The text of a page.
    Page(String),
}

/// The drawings of a result for these files: the figure for images, the page for HTML. Each is only made if a file
/// needs it; the page gets the command line.
pub(crate) fn drawings<'a>(
    paths: impl IntoIterator<Item = &'a PathBuf>,
    figure: impl Fn() -> Figure,
    page: impl Fn(&str) -> Result<String, WorkError>,
) -> Result<Vec<(PathBuf, ImageContent)>, CommandError> {
    let drawing = |path: &PathBuf| {
        let drawing = if is_page(path) {
            ImageContent::Page(page(&command_line())?)
        } else {
            ImageContent::Figure(figure())
        };
        Ok((path.clone(), drawing))
    };
    paths.into_iter().map(drawing).collect()
}

/// Whether a file is a page, by its extension.
pub(crate) fn is_page(path: &Path) -> bool {
    picture(path).is_ok_and(|format| format == ImageFormat::Html)
}

fn picture(path: &Path) -> Result<ImageFormat, CommandError> {
    let ending = path.extension().and_then(|ending| ending.to_str()).map(str::to_ascii_lowercase);
    match ending.as_deref() {
        Some("svg") => Ok(ImageFormat::Svg),
        Some("pdf") => Ok(ImageFormat::Pdf),
        Some("png") => Ok(ImageFormat::Png),
        Some("html" | "htm") => Ok(ImageFormat::Html),
        _ => Err(CommandError::Usage(format!(
            "`--plot {}`: a picture ends in .svg, .pdf or .png, a page in .html",
            path.display()
        ))),
    }
}

/// Checks the extensions before anything is computed.
pub(crate) fn verify_formats(paths: &[PathBuf]) -> Result<(), CommandError> {
    paths.iter().try_for_each(|path| picture(path).map(|_| ()))
}

/// Draws into a file.
pub(crate) fn save(
    drawing: &ImageContent,
    path: &Path,
    console: Console<'_>,
) -> Result<(), CommandError> {
    let bytes = match drawing {
        ImageContent::Page(text) => text.clone().into_bytes(),
        ImageContent::Figure(figure) => match picture(path)? {
            ImageFormat::Svg => render_svg(figure).into_bytes(),
            ImageFormat::Pdf => render_pdf(figure),
            ImageFormat::Png | ImageFormat::Html => {
                render_png(figure).map_err(|error| CommandError::Found(error.to_string()))?
            }
        },
    };
    write_whole(path, |out| out.write_all(&bytes))?;
    console.remark(&format!("drew {}", path.display()));
    Ok(())
}
