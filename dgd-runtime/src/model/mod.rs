//! A compiled model behind a pointer, for code that is compiled once for all models.
//!
//! [`System`] is a bound: solvers are compiled for each model, with its sizes as constants. [`Model`] is for trait
//! objects: code that runs a model many times and does little between the runs makes one virtual call for each run or
//! function evaluation, and none within a run.
//!
//! `&dyn Model` is also [`SolvableSystem`], so that functions generic over systems accept it. Functions that would be
//! slow that way have a namesake here, which runs the model's own compiled code: [`observe`], [`stream`], [`measure`],
//! [`per_sample_of_head`] and [`choose_per_sample`].

#[doc(hidden)]
pub mod for_identify;

use std::fmt;

use crate::codegen::taylor::{KeptSeries, NoTaylorSeries, SeriesTerms};
use crate::error::{Failure, InitialError, IntegrateError};
use crate::integrate::fixed_step::{self, PerSampleChoice, RunErrors};
use crate::linalg::AutoLu;
use crate::observe::{self, Observations};
use crate::problem::{Options, Problem, WantedResults};
use crate::signal::{Inputs, Segment};
use crate::solution::Solution;
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Signature, Storage, System};

/// The data of a run: a [`Problem`] without its system.
#[derive(Debug, Clone, Copy)]
pub struct RunData<'a> {
    /// All parameters, SI.
    pub p: &'a [f64],
    /// Inputs, in the order of the signature.
    pub inputs: &'a Inputs,
    /// Start values that replace the model's, by position of the unknown, SI.
    pub start: &'a [(usize, f64)],
}

impl<'a> RunData<'a> {
    fn from_problem<S>(problem: &Problem<'a, S>) -> Self {
        let Problem { p, inputs, start, .. } = *problem;
        Self { p, inputs, start }
    }

    fn to_problem<S>(self, system: &'a S) -> Problem<'a, S> {
        let Self { p, inputs, start } = self;
        Problem { system, p, inputs, start }
    }
}

/// Receives the outputs of a run as it reaches the samples.
pub trait SampleReceiver {
    /// Whether outputs are wanted at the k-th requested time. Called in the order of the times.
    fn wants(&mut self, k: usize) -> bool;

    /// Receives the outputs w there, and ∂w/∂θ, n_w × n_s dense by columns.
    fn take(&mut self, k: usize, w: &[f64], dw: &[f64]);
}

/// Passes a list of the point functions of [`System`] to another macro.
macro_rules! for_point_functions {
    ($use:ident) => {
        $use! {
            rhs(f: &mut [f64]);
            linearize(udot: &[f64], f: &mut [f64], jacobian: &mut [f64], dfdt: &mut [f64]);
            sensitivity_rhs(s: &[f64], f: &mut [f64], g: &mut [f64]);
            sensitivity_linearize(
                udot: &[f64], s: &[f64], f: &mut [f64], jacobian: &mut [f64], dfdt: &mut [f64],
                g: &mut [f64], dgdy: &mut [f64], dgdt: &mut [f64]
            );
            parameter_jacobian(values: &mut [f64]);
            input_jacobian(values: &mut [f64]);
            time_derivative(values: &mut [f64]);
            outputs(w: &mut [f64]);
            output_jacobians(
                dwdy: &mut [f64], dwdu: &mut [f64], dwdp: &mut [f64], dwdt: &mut [f64]
            );
            output_sensitivities(s: &[f64], w: &mut [f64], dw: &mut [f64]);
            start(y: &mut [f64]);
            start_sensitivities(s: &mut [f64]);
            start_equations(rest: &mut [f64]);
            start_equation_sensitivities(s: &[f64], drest: &mut [f64], drestdy: &mut [f64]);
            delays(tau: &mut [f64]);
            delay_sensitivities(dtau: &mut [f64]);
            varying_delays(tau: &mut [f64]);
            varying_delay_sensitivities(
                udot: &[f64], s: &[f64], dtau: &mut [f64], dtaudy: &mut [f64], dtaudt: &mut [f64]
            );
            histories(values: &mut [f64], rates: &mut [f64], curvatures: &mut [f64]);
            history_sensitivities(s: &mut [f64], rates: &mut [f64]);
            mass(mass: &mut [f64]);
            condition_times(times: &mut [f64], after: &mut [f64]);
            condition_time_sensitivities(dtimes: &mut [f64]);
            event_functions(e: &mut [f64]);
            event_derivatives(
                udot: &[f64], de: &mut [f64], dedy: &mut [f64], dedt: &mut [f64]
            );
            resets(r: &mut [f64]);
            reset_derivatives(
                udot: &[f64], dr: &mut [f64], drdy: &mut [f64], drdt: &mut [f64]
            );
            jumps(kinds: &mut [f64], rests: &mut [f64], jacobian: &mut [f64]);
            jump_sensitivities(
                udot: &[f64], s: &[f64], drests: &mut [f64], drestsdt: &mut [f64],
                djacobian: &mut [f64], djacobiandt: &mut [f64]
            );
            taylor(udot: &[f64], h: f64, order: usize, kept: &mut [SeriesTerms], y: &mut [f64]);
            sensitivity_taylor(
                udot: &[f64], h: f64, order: usize, kept: &mut [SeriesTerms], y: &mut [f64], s: &mut [f64]
            );
        }
    };
}

macro_rules! declare {
    ($($name:ident($($argument:ident: $type:ty),*);)*) => {
        /// A compiled model that can be copied for another thread. Implemented for every [`SolvableSystem`] type that
        /// is `Clone` and `Send`.
        ///
        /// Functions at a point are those of the same name in [`System`].
        #[allow(missing_docs, clippy::too_many_arguments)]
        pub trait Model: Send {
            /// Names, sizes, units, defaults and sparsity.
            fn signature(&self) -> &Signature;

            /// A copy, for another thread.
            fn copied(&self) -> Box<dyn Model>;

            $(fn $name(&self, at: EvaluationPoint<'_>, $($argument: $type),*);)*

            #[doc(hidden)]
            fn taylor_series(&self) -> Result<KeptSeries, NoTaylorSeries>;

            /// Integrates, like [`SolvableSystem::integrate`].
            ///
            /// # Errors
            ///
            /// [`Failure`], with the part of the solution that was reached.
            fn integrate(
                &self,
                given: RunData<'_>,
                times: &[f64],
                options: &Options,
                wanted: WantedResults<'_>,
            ) -> Result<Solution, Failure>;

            /// Start values at rest, as [`SolvableSystem::find_start`].
            ///
            /// # Errors
            ///
            /// [`InitialError`]: there is no rest.
            fn find_start(
                &self,
                given: RunData<'_>,
                t: f64,
                options: &Options,
                y: &mut [f64],
                s: Option<&mut [f64]>,
            ) -> Result<(), InitialError>;

            #[doc(hidden)]
            fn observe(&self, given: RunData<'_>, solution: &Solution) -> Observations;

            #[doc(hidden)]
            fn stream(
                &self,
                given: RunData<'_>,
                times: &[f64],
                options: &Options,
                samples: &mut dyn SampleReceiver,
            ) -> Result<(), IntegrateError>;

            #[doc(hidden)]
            fn measure(
                &self,
                given: RunData<'_>,
                times: &[f64],
                per_sample: u32,
                options: &Options,
            ) -> Result<RunErrors, IntegrateError>;

            #[doc(hidden)]
            fn per_sample_of_head(
                &self,
                given: RunData<'_>,
                times: &[f64],
                options: &Options,
            ) -> Result<u32, IntegrateError>;

            #[doc(hidden)]
            fn choose_per_sample(
                &self,
                given: RunData<'_>,
                times: &[f64],
                options: &Options,
            ) -> Result<PerSampleChoice, IntegrateError>;
        }
    };
}

for_point_functions!(declare);

macro_rules! implement {
    ($($name:ident($($argument:ident: $type:ty),*);)*) => {
        impl<S: SolvableSystem + Clone + Send + 'static> Model for S {
            fn signature(&self) -> &Signature {
                System::signature(self)
            }

            fn copied(&self) -> Box<dyn Model> {
                Box::new(self.clone())
            }

            $(fn $name(&self, at: EvaluationPoint<'_>, $($argument: $type),*) {
                System::$name(self, at, $($argument),*);
            })*

            fn taylor_series(&self) -> Result<KeptSeries, NoTaylorSeries> {
                System::taylor_series(self)
            }

            fn integrate(
                &self,
                given: RunData<'_>,
                times: &[f64],
                options: &Options,
                wanted: WantedResults<'_>,
            ) -> Result<Solution, Failure> {
                <S as SolvableSystem>::integrate(&given.to_problem(self), times, options, wanted)
            }

            fn find_start(
                &self,
                given: RunData<'_>,
                t: f64,
                options: &Options,
                y: &mut [f64],
                s: Option<&mut [f64]>,
            ) -> Result<(), InitialError> {
                <S as SolvableSystem>::find_start(&given.to_problem(self), t, options, y, s)
            }

            fn observe(&self, given: RunData<'_>, solution: &Solution) -> Observations {
                observe::observe(&given.to_problem(self), solution)
            }

            fn stream(
                &self,
                given: RunData<'_>,
                times: &[f64],
                options: &Options,
                samples: &mut dyn SampleReceiver,
            ) -> Result<(), IntegrateError> {
                let problem = given.to_problem(self);
                fixed_step::stream(&problem, times, options, &mut SampleEvaluator::new(problem, samples))
            }

            fn measure(
                &self,
                given: RunData<'_>,
                times: &[f64],
                per_sample: u32,
                options: &Options,
            ) -> Result<RunErrors, IntegrateError> {
                fixed_step::measure(&given.to_problem(self), times, per_sample, options)
            }

            fn per_sample_of_head(
                &self,
                given: RunData<'_>,
                times: &[f64],
                options: &Options,
            ) -> Result<u32, IntegrateError> {
                fixed_step::per_sample_of_head(&given.to_problem(self), times, options)
            }

            fn choose_per_sample(
                &self,
                given: RunData<'_>,
                times: &[f64],
                options: &Options,
            ) -> Result<PerSampleChoice, IntegrateError> {
                fixed_step::choose_per_sample(&given.to_problem(self), times, options)
            }
        }

        impl System for &dyn Model {
            type Vector = Vec<f64>;
            type Sensitivity = Vec<f64>;
            type Inputs = Vec<f64>;
            type Jacobian = Vec<f64>;
            type SensitivityJacobian = Vec<f64>;

            fn signature(&self) -> &Signature {
                Model::signature(*self)
            }

            $(fn $name(&self, at: EvaluationPoint<'_>, $($argument: $type),*) {
                Model::$name(*self, at, $($argument),*);
            })*

            fn taylor_series(&self) -> Result<KeptSeries, NoTaylorSeries> {
                Model::taylor_series(*self)
            }
        }

        impl SolvableSystem for &dyn Model {
            type Factorisation = AutoLu;

            fn integrate(
                problem: &Problem<'_, Self>,
                times: &[f64],
                options: &Options,
                wanted: WantedResults<'_>,
            ) -> Result<Solution, Failure> {
                Model::integrate(*problem.system, RunData::from_problem(problem), times, options, wanted)
            }

            fn find_start(
                problem: &Problem<'_, Self>,
                t: f64,
                options: &Options,
                y: &mut [f64],
                s: Option<&mut [f64]>,
            ) -> Result<(), InitialError> {
                Model::find_start(*problem.system, RunData::from_problem(problem), t, options, y, s)
            }
        }
    };
}

for_point_functions!(implement);

impl fmt::Debug for dyn Model + '_ {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Model")
    }
}

/// A [`Problem`] with a model behind a pointer.
pub type ModelProblem<'a> = Problem<'a, &'a dyn Model>;

/// Evaluates outputs, like [`crate::observe`].
pub fn observe(problem: &ModelProblem<'_>, solution: &Solution) -> Observations {
    problem.system.observe(RunData::from_problem(problem), solution)
}

/// Runs with sensitivities and a fixed number of steps per sample, and stores nothing: the outputs at each wanted time
/// are passed to `samples` as the run reaches it.
///
/// # Errors
///
/// [`IntegrateError`] if the run fails.
pub fn stream(
    problem: &ModelProblem<'_>,
    times: &[f64],
    options: &Options,
    samples: &mut dyn SampleReceiver,
) -> Result<(), IntegrateError> {
    problem.system.stream(RunData::from_problem(problem), times, options, samples)
}

/// The unknowns' errors in a run with a fixed number of steps per sample.
///
/// # Errors
///
/// [`IntegrateError`] if the run fails.
pub fn measure(
    problem: &ModelProblem<'_>,
    times: &[f64],
    per_sample: u32,
    options: &Options,
) -> Result<RunErrors, IntegrateError> {
    problem.system.measure(RunData::from_problem(problem), times, per_sample, options)
}

/// The number of steps per sample that the beginning of a run needs for the unknowns to meet the tolerance.
///
/// # Errors
///
/// [`IntegrateError`] if it cannot be determined.
pub fn per_sample_of_head(
    problem: &ModelProblem<'_>,
    times: &[f64],
    options: &Options,
) -> Result<u32, IntegrateError> {
    problem.system.per_sample_of_head(RunData::from_problem(problem), times, options)
}

/// Chooses the steps per sample, like [`crate::choose_per_sample`].
///
/// # Errors
///
/// The same as there.
pub fn choose_per_sample(
    problem: &ModelProblem<'_>,
    times: &[f64],
    options: &Options,
) -> Result<PerSampleChoice, IntegrateError> {
    problem.system.choose_per_sample(RunData::from_problem(problem), times, options)
}

/// Evaluates outputs for [`SampleReceiver`] with the model's own compiled code.
struct SampleEvaluator<'a, S: SolvableSystem> {
    problem: Problem<'a, S>,
    samples: &'a mut dyn SampleReceiver,
    /// Position of the next time.
    k: usize,
    u: S::Inputs,
    w: Vec<f64>,
    dw: Vec<f64>,
}

impl<'a, S: SolvableSystem> SampleEvaluator<'a, S> {
    fn new(problem: Problem<'a, S>, samples: &'a mut dyn SampleReceiver) -> Self {
        let signature = problem.system.signature();
        let n_w = signature.outputs.len();
        let dw = vec![0.0; n_w * signature.directions.len()];
        let u = S::Inputs::zeros(signature.n_u());
        Self { problem, samples, k: 0, u, w: vec![0.0; n_w], dw }
    }
}

impl<S: SolvableSystem> fixed_step::SampleSink for SampleEvaluator<'_, S> {
    #[inline]
    fn take(&mut self, t: f64, segment: Segment<'_>, y: &[f64], s: &[f64]) {
        let k = self.k;
        self.k += 1;
        if !self.samples.wants(k) {
            return;
        }
        let Problem { system, p, .. } = self.problem;
        segment.value(t, self.u.as_mut());
        let point = EvaluationPoint { t, y, u: self.u.as_ref(), p, z: &[] };
        system.output_sensitivities(point, s, &mut self.w, &mut self.dw);
        self.samples.take(k, &self.w, &self.dw);
    }
}
