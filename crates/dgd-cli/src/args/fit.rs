//! Options of `fit`.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use dgd_identify::{DrawnFrom, Loss};
use dgd_work::{FitRequest, LinearizeAt};

use super::single::place;
use super::{ChoiceArgs, RecordingArgs, SolveArgs};
use crate::command_line::command_line;
use crate::numbers::{count, count_or_none, not_negative, positive, time, whole};

/// Arguments of `fit`.
#[derive(Debug, Args)]
pub(crate) struct FitArgs {
    /// The model file
    pub model: PathBuf,
    #[command(flatten)]
    pub choices: ChoiceArgs,
    #[command(flatten)]
    pub given: RecordingArgs,
    /// Outputs to fit [default: all measured ones]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub outputs: Vec<String>,
    /// Where the weights of the outputs come from
    #[arg(long, value_enum, default_value_t = NoiseArg::Estimated)]
    pub noise: NoiseArg,
    /// Maximum number of simulations in a search, or of evaluations without simulations [default: 200;
    /// regressions 2000, models without states 5000]
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    pub evaluations: Option<usize>,
    #[command(flatten)]
    pub search: SearchArgs,
    #[command(flatten)]
    pub intervals: IntervalArgs,
    #[command(flatten)]
    pub regression: RegressionArgs,
    #[command(flatten)]
    pub solve: SolveArgs,
}

/// Where the weights of the outputs come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum NoiseArg {
    /// The noise declared in the model; for outputs that declare none, the residuals of the fit
    Declared,
    /// The residuals of each output, refitted until the weights no longer change
    Estimated,
}

/// How parameters are estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum EstimatorArg {
    /// Output error: simulate each recording from its start; initial values are estimated too
    OutputError,
    /// Output error of the model linearised at an operating point, `--at`
    #[value(alias = "linearized")]
    Linearised,
    /// Prediction error of an extended Kalman filter; the process noise is estimated too
    PredictionError,
    /// Linear least squares on equations and outputs, without bounds
    LeastSquares,
    /// Linear least squares on equations and outputs, within the parameters' bounds
    Bounded,
    /// Linear parameters by least squares, the others by variable projection around them
    Separable,
    /// Linear parameters by least squares, the others by a Nelder–Mead simplex around them
    NelderMead,
    /// Recursive linear least squares, sample by sample, with optional forgetting
    Recursive,
}

/// The estimator, and options of single ones.
#[derive(Debug, Clone, Args)]
pub(crate) struct RegressionArgs {
    /// Parameter estimator
    #[arg(long, value_enum, value_name = "NAME", default_value_t = EstimatorArg::OutputError)]
    pub estimator: EstimatorArg,
    /// Linearised: operating point of each recording: a time in s since the data's first sample, `steady`
    /// (steady state with the inputs of the first time) or `mean` (steady state with the mean inputs)
    /// [default: mean]
    #[arg(long, value_name = "T|steady|mean", allow_negative_numbers = true, value_parser = place)]
    pub at: Option<LinearizeAt>,
    /// Regressions: half the width of the windows over which slopes of the measurements are taken, in s
    /// or as in `2min` [default: 5 samples]
    #[arg(long, value_name = "T", value_parser = time, allow_hyphen_values = true)]
    pub smoothing: Option<f64>,
    /// Regressions: use only samples at which this state changes no faster, in its unit per second, as in
    /// `q=5`; repeatable
    #[arg(long, value_name = "STATE=RATE")]
    pub steady: Vec<String>,
    /// Recursive: time constants of the filter 1/Λ(s), s: `5` gives Λ = 5s + 1, `5,5` gives (5s + 1)²
    #[arg(long, value_name = "SECONDS", value_delimiter = ',', default_value = "5", value_parser = positive, allow_hyphen_values = true)]
    pub filter: Vec<f64>,
    /// Recursive: forgetting rate β, 1/s
    #[arg(long, value_name = "RATE", default_value_t = 0.0, value_parser = not_negative, allow_hyphen_values = true)]
    pub forgetting: f64,
    /// Recursive: P₀, the initial variance of each parameter, relative to its size squared
    #[arg(long, value_name = "P0", default_value_t = 10.0, value_parser = positive, allow_hyphen_values = true)]
    pub start_variance: f64,
    /// Recursive: R₀, the maximum variance in P, relative to the parameters' sizes squared
    /// [default: none]
    #[arg(long, value_name = "R0", value_parser = positive, allow_hyphen_values = true)]
    pub most_variance: Option<f64>,
    /// Recursive: n_s² in the normalisation m² = 1 + n_s²
    #[arg(long, value_enum, value_name = "NAME", default_value_t = NormaliseArg::None)]
    pub normalise: NormaliseArg,
}

/// The definition of n_s².
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum NormaliseArg {
    /// Zero: m is 1
    None,
    /// φᵀφ
    Regressors,
    /// φᵀPφ
    Covariance,
}

/// How a fit of simulations searches.
#[derive(Debug, Clone, Args)]
pub(crate) struct SearchArgs {
    /// Loss function; all but `squares` are robust to outliers
    #[arg(long, value_enum, value_name = "NAME", default_value_t = LossName::Squares)]
    pub loss: LossName,
    /// Run N fits from different starting points, the model's own and others drawn with `--seed`, and keep
    /// the best
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100_000), allow_negative_numbers = true)]
    pub starts: u32,
    /// Run only the fit from point K of `--starts N`, counted from 0, to share the work between machines
    #[arg(long, value_name = "K", value_parser = whole::<u32>, allow_negative_numbers = true)]
    pub start_point: Option<u32>,
    /// Distribution of the starting points
    #[arg(long, value_enum, value_name = "WHAT", default_value_t = SpreadOf::Values)]
    pub spread: SpreadOf,
}

/// The distribution of starting points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum SpreadOf {
    /// Around the model's values: from a tenth to ten times each value, within its bounds; with a prior, two standard
    /// deviations around its mean
    Values,
    /// The whole range between the bounds; a parameter with a missing bound, or with a prior, as with `values`
    Bounds,
}

/// Loss functions of a residual, in standard deviations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum LossName {
    /// Squared residual: the most precise with Gaussian noise
    Squares,
    /// Squared up to 1.345 standard deviations, linear beyond: limits the pull of outliers
    Huber,
    /// Logarithmic: the further away an outlier, the less it pulls
    Cauchy,
    /// Constant beyond 4.685 standard deviations: residuals further away have no influence
    Tukey,
}

/// Options for intervals.
#[derive(Debug, Clone, Args)]
pub(crate) struct IntervalArgs {
    /// Compute confidence intervals of these estimates by profile likelihood: parameters, initial values as
    /// `x(0)`, or `all` for all parameters
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub profile: Vec<String>,
    /// Refit to N data sets with resampled residuals, for intervals that account for autocorrelated noise
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = count_or_none, allow_negative_numbers = true)]
    pub bootstrap: usize,
    /// First of these data sets, counted from 0, to share the work between machines; the result lists all estimates
    #[arg(long, value_name = "K", value_parser = count_or_none, allow_negative_numbers = true)]
    pub bootstrap_from: Option<usize>,
    /// Report which samples and outputs determine each parameter
    #[arg(long)]
    pub information: bool,
}

impl EstimatorArg {
    fn request(self) -> dgd_work::Estimator {
        use dgd_work::Estimator as Work;
        match self {
            EstimatorArg::OutputError => Work::OutputError,
            EstimatorArg::Linearised => Work::Linearised,
            EstimatorArg::PredictionError => Work::PredictionError,
            EstimatorArg::LeastSquares => Work::LeastSquares,
            EstimatorArg::Bounded => Work::Bounded,
            EstimatorArg::Separable => Work::Separable,
            EstimatorArg::NelderMead => Work::NelderMead,
            EstimatorArg::Recursive => Work::Recursive,
        }
    }
}

impl NormaliseArg {
    fn request(self) -> dgd_work::Normalise {
        match self {
            NormaliseArg::None => dgd_work::Normalise::None,
            NormaliseArg::Regressors => dgd_work::Normalise::Regressors,
            NormaliseArg::Covariance => dgd_work::Normalise::Covariance,
        }
    }
}

impl LossName {
    fn request(self) -> Loss {
        match self {
            Self::Squares => Loss::Squares,
            Self::Huber => Loss::Huber,
            Self::Cauchy => Loss::Cauchy,
            Self::Tukey => Loss::Tukey,
        }
    }
}

impl FitArgs {
    /// The request of a fit; its journal is kept beside `out`.
    pub(crate) fn request(&self, out: Option<&Path>) -> FitRequest {
        let mut request = FitRequest::new(&self.model, self.given.data.clone());
        request.choices = self.solve.choices(&self.choices);
        request.valid.clone_from(&self.given.valid);
        request.sought = self.given.sought.request();
        request.outputs.clone_from(&self.outputs);
        request.noise = match self.noise {
            NoiseArg::Declared => dgd_work::NoiseFrom::Declared,
            NoiseArg::Estimated => dgd_work::NoiseFrom::Estimated,
        };
        request.keep = self.given.keep(out);
        request.evaluations = self.evaluations;
        request.search.loss = self.search.loss.request();
        request.search.starts = self.search.starts;
        request.search.start_point = self.search.start_point;
        request.search.spread = match self.search.spread {
            SpreadOf::Values => DrawnFrom::Values,
            SpreadOf::Bounds => DrawnFrom::Bounds,
        };
        request.intervals.profile.clone_from(&self.intervals.profile);
        request.intervals.bootstrap = self.intervals.bootstrap;
        request.intervals.bootstrap_from = self.intervals.bootstrap_from;
        request.intervals.information = self.intervals.information;
        let (options, args) = (&mut request.regression, &self.regression);
        options.estimator = args.estimator.request();
        options.at = args.at;
        options.smoothing = args.smoothing;
        options.steady.clone_from(&args.steady);
        options.filter.clone_from(&args.filter);
        options.forgetting = args.forgetting;
        options.start_variance = args.start_variance;
        options.most_variance = args.most_variance;
        options.normalise = args.normalise.request();
        request.solve = self.solve.request();
        // The page in the folder shows the figures as well.
        request.figures = out.is_some() || !self.solve.plot.is_empty();
        request.command = command_line();
        request
    }
}
