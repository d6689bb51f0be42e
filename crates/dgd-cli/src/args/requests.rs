//! Requests as parsed, with what only the command line knows: where the result goes, and how the command was written.

use std::path::{Path, PathBuf};

use clap::Args;
use dgd_work::{
    CompareRequest, DiscoverRequest, FitRequest, ScreenRequest, SimulateRequest, TrackRequest,
};

use crate::command_line::command_line;

/// A request, and the files for its figures.
#[derive(Debug, Args)]
pub(crate) struct DrawnArgs<R: Args> {
    #[command(flatten)]
    pub request: R,
    /// Plot the result as a picture (.svg, .pdf, .png) or a page to open in a browser (.html); repeatable
    #[arg(long, value_name = "FILE")]
    pub plot: Vec<PathBuf>,
}

/// Arguments of `screen`.
#[derive(Debug, Args)]
pub(crate) struct ScreenArgs {
    #[command(flatten)]
    pub request: ScreenRequest,
    /// Plot the columns, with findings shaded; a picture (.svg, .pdf, .png) or a page of all recordings (.html); repeatable
    #[arg(long, value_name = "FILE")]
    pub plot: Vec<PathBuf>,
}

impl DrawnArgs<SimulateRequest> {
    /// The request, with fields for figures.
    pub(crate) fn request(&self) -> SimulateRequest {
        let mut request = self.request.clone();
        request.fields = !self.plot.is_empty();
        request
    }
}

impl DrawnArgs<FitRequest> {
    /// The request; its journal is kept beside `out`.
    pub(crate) fn request(&self, out: Option<&Path>) -> FitRequest {
        let mut request = self.request.clone();
        request.keep.out = out.map(Path::to_owned);
        // The page in the folder shows the figures as well.
        request.figures = out.is_some() || !self.plot.is_empty();
        request.command = command_line();
        request
    }
}

impl DrawnArgs<CompareRequest> {
    /// The request; its journal is kept beside `out`.
    pub(crate) fn request(&self, out: Option<&Path>) -> CompareRequest {
        let mut request = self.request.clone();
        request.keep.out = out.map(Path::to_owned);
        request.command = command_line();
        request
    }
}

impl DrawnArgs<DiscoverRequest> {
    /// The request; its journal is kept beside `out`.
    pub(crate) fn request(&self, out: Option<&Path>) -> DiscoverRequest {
        let mut request = self.request.clone();
        request.keep.out = out.map(Path::to_owned);
        request.command = command_line();
        request
    }
}

impl DrawnArgs<TrackRequest> {
    /// The request; figures need the rows.
    pub(crate) fn request(&self) -> TrackRequest {
        let mut request = self.request.clone();
        request.keeps_rows = !self.plot.is_empty();
        request
    }
}

impl ScreenArgs {
    /// The request.
    pub(crate) fn request(&self) -> ScreenRequest {
        let mut request = self.request.clone();
        request.command = command_line();
        request
    }
}
