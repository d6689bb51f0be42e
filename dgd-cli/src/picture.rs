//! Figures as files, by their ending.

use std::path::{Path, PathBuf};

use dgd_data::files::write_whole;
use dgd_plot::{Figure, render_png, render_svg};

use crate::console::Console;
use crate::failure::CommandError;

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
