//! Arguments of `invert`.

use std::path::PathBuf;

use clap::Args;
use dgd_work::{InvertRequest, RunRequest};

use super::{ChoiceArgs, SolveArgs};
use crate::numbers::time;

/// Arguments of `invert`.
#[derive(Debug, Args)]
pub(crate) struct InvertArgs {
    /// The model file
    pub model: PathBuf,
    #[command(flatten)]
    pub choices: ChoiceArgs,
    /// Inputs and measured outputs
    #[arg(long, value_name = "FILE", required = true)]
    pub data: PathBuf,
    /// Label of the equation, as in `equation LABEL: …`
    #[arg(long = "for", value_name = "LABEL")]
    pub equation: String,
    /// Outputs whose readings are used [default: all measured ones]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub outputs: Vec<String>,
    /// Half the width of the averaging window, as in `20s` or `2min` [default: the most likely]
    #[arg(long, value_name = "TIME", value_parser = time, allow_hyphen_values = true)]
    pub bandwidth: Option<f64>,
    /// Unit of the missing term [default: that of the model's first quantity of the same dimension]
    #[arg(long, value_name = "UNIT")]
    pub unit: Option<String>,
    /// Add the estimate of a smoother with the whole model, as plotted by `discover`
    #[arg(long)]
    pub with_estimate: bool,
    #[command(flatten)]
    pub solve: SolveArgs,
}

impl InvertArgs {
    /// The request of an inversion.
    pub(crate) fn request(&self) -> InvertRequest {
        let mut run = RunRequest::new(&self.model);
        run.choices = self.solve.choices(&self.choices);
        run.data = Some(self.data.clone());
        run.solve = self.solve.request();
        let mut request = InvertRequest::new(run, &self.equation);
        request.outputs.clone_from(&self.outputs);
        request.bandwidth = self.bandwidth;
        request.unit.clone_from(&self.unit);
        request.with_estimate = self.with_estimate;
        request
    }
}
