//! A program as a system, independent of how its functions are executed.

use dgd_compiler::program::{self, FunctionKind, Program, TaylorSeries};
use dgd_runtime::integrate::integrate;
use dgd_runtime::linalg::Factorisation;
use dgd_runtime::linearize::find_start;
use dgd_runtime::taylor::{KeptSeries, NoTaylorSeries, SeriesTerms};
use dgd_runtime::{
    EvaluationPoint, Failure, InitialError, Options, Problem, Signature, Solution, SolvableSystem,
    Storage, System, WantedResults,
};

use crate::interpret::Interpreter;
use crate::taylor::SeriesComputation;

/// Executes the functions of a program.
pub trait FunctionExecutor {
    /// n numbers.
    type Vector: Storage;
    /// n · n_s numbers.
    type Sensitivity: Storage;
    /// n_u numbers.
    type Inputs: Storage;
    /// Non-zeros of ∂f/∂y.
    type Jacobian: Storage;
    /// Non-zeros of ∂g/∂y.
    type SensitivityJacobian: Storage;
    /// The factorisation of W = M c − ∂f/∂y.
    type Factorisation: Factorisation;

    /// The program.
    fn program(&self) -> &Program;

    /// The interpreter for Taylor series, which have few operations for the amount of data.
    fn interpreter(&self) -> &Interpreter;

    /// Executes one function.
    ///
    /// # Panics
    ///
    /// If an array is shorter than the part that is read, or a result has the wrong length.
    fn perform(
        &self,
        kind: FunctionKind,
        at: EvaluationPoint<'_>,
        udot: &[f64],
        s: &[f64],
        results: &mut [&mut [f64]],
    );

    /// Integrates the program with this kind of execution.
    ///
    /// # Errors
    ///
    /// Like [`SolvableSystem::integrate`].
    fn integrate(
        problem: &Problem<'_, ProgramSystem<Self>>,
        times: &[f64],
        options: &Options,
        wanted: WantedResults<'_>,
    ) -> Result<Solution, Failure>
    where
        Self: Sized,
    {
        integrate(problem, times, options, wanted)
    }
}

/// A program as a system.
#[derive(Debug, Clone)]
pub struct ProgramSystem<P>(pub(crate) P);

impl<P: FunctionExecutor> SolvableSystem for ProgramSystem<P> {
    type Factorisation = P::Factorisation;

    fn integrate(
        problem: &Problem<'_, Self>,
        times: &[f64],
        options: &Options,
        wanted: WantedResults<'_>,
    ) -> Result<Solution, Failure> {
        P::integrate(problem, times, options, wanted)
    }

    fn find_start(
        problem: &Problem<'_, Self>,
        t: f64,
        options: &Options,
        y: &mut [f64],
        s: Option<&mut [f64]>,
    ) -> Result<(), InitialError> {
        find_start(problem, t, options, y, s)
    }
}

impl<P: FunctionExecutor> System for ProgramSystem<P> {
    type Vector = P::Vector;
    type Sensitivity = P::Sensitivity;
    type Inputs = P::Inputs;
    type Jacobian = P::Jacobian;
    type SensitivityJacobian = P::SensitivityJacobian;

    #[inline]
    fn signature(&self) -> &Signature {
        &self.0.program().signature
    }

    #[inline]
    fn rhs(&self, at: EvaluationPoint<'_>, f: &mut [f64]) {
        self.0.perform(FunctionKind::Rhs, at, &[], &[], &mut [f]);
    }

    #[inline]
    fn linearize(
        &self,
        at: EvaluationPoint<'_>,
        udot: &[f64],
        f: &mut [f64],
        jacobian: &mut [f64],
        dfdt: &mut [f64],
    ) {
        self.0.perform(FunctionKind::Linearize, at, udot, &[], &mut [f, jacobian, dfdt]);
    }

    #[inline]
    fn sensitivity_rhs(&self, at: EvaluationPoint<'_>, s: &[f64], f: &mut [f64], g: &mut [f64]) {
        self.0.perform(FunctionKind::SensitivityRhs, at, &[], s, &mut [f, g]);
    }

    #[inline]
    fn sensitivity_linearize(
        &self,
        at: EvaluationPoint<'_>,
        udot: &[f64],
        s: &[f64],
        f: &mut [f64],
        jacobian: &mut [f64],
        dfdt: &mut [f64],
        g: &mut [f64],
        dgdy: &mut [f64],
        dgdt: &mut [f64],
    ) {
        let results = &mut [f, jacobian, dfdt, g, dgdy, dgdt];
        self.0.perform(FunctionKind::SensitivityLinearize, at, udot, s, results);
    }

    #[inline]
    fn parameter_jacobian(&self, at: EvaluationPoint<'_>, values: &mut [f64]) {
        self.0.perform(FunctionKind::ParameterJacobian, at, &[], &[], &mut [values]);
    }

    #[inline]
    fn input_jacobian(&self, at: EvaluationPoint<'_>, values: &mut [f64]) {
        self.0.perform(FunctionKind::InputJacobian, at, &[], &[], &mut [values]);
    }

    #[inline]
    fn time_derivative(&self, at: EvaluationPoint<'_>, values: &mut [f64]) {
        self.0.perform(FunctionKind::TimeDerivative, at, &[], &[], &mut [values]);
    }

    #[inline]
    fn outputs(&self, at: EvaluationPoint<'_>, w: &mut [f64]) {
        self.0.perform(FunctionKind::Outputs, at, &[], &[], &mut [w]);
    }

    #[inline]
    fn output_jacobians(
        &self,
        at: EvaluationPoint<'_>,
        dwdy: &mut [f64],
        dwdu: &mut [f64],
        dwdp: &mut [f64],
        dwdt: &mut [f64],
    ) {
        self.0.perform(FunctionKind::OutputJacobians, at, &[], &[], &mut [dwdy, dwdu, dwdp, dwdt]);
    }

    #[inline]
    fn output_sensitivities(
        &self,
        at: EvaluationPoint<'_>,
        s: &[f64],
        w: &mut [f64],
        dw: &mut [f64],
    ) {
        self.0.perform(FunctionKind::OutputSensitivities, at, &[], s, &mut [w, dw]);
    }

    #[inline]
    fn start(&self, at: EvaluationPoint<'_>, y: &mut [f64]) {
        self.0.perform(FunctionKind::Start, at, &[], &[], &mut [y]);
    }

    #[inline]
    fn start_sensitivities(&self, at: EvaluationPoint<'_>, s: &mut [f64]) {
        self.0.perform(FunctionKind::StartSensitivities, at, &[], &[], &mut [s]);
    }

    #[inline]
    fn delays(&self, at: EvaluationPoint<'_>, tau: &mut [f64]) {
        self.0.perform(FunctionKind::Delays, at, &[], &[], &mut [tau]);
    }

    #[inline]
    fn delay_sensitivities(&self, at: EvaluationPoint<'_>, dtau: &mut [f64]) {
        self.0.perform(FunctionKind::DelaySensitivities, at, &[], &[], &mut [dtau]);
    }

    #[inline]
    fn histories(
        &self,
        at: EvaluationPoint<'_>,
        values: &mut [f64],
        rates: &mut [f64],
        curvatures: &mut [f64],
    ) {
        self.0.perform(FunctionKind::Histories, at, &[], &[], &mut [values, rates, curvatures]);
    }

    #[inline]
    fn history_sensitivities(&self, at: EvaluationPoint<'_>, s: &mut [f64], rates: &mut [f64]) {
        self.0.perform(FunctionKind::HistorySensitivities, at, &[], &[], &mut [s, rates]);
    }

    #[inline]
    fn start_equations(&self, at: EvaluationPoint<'_>, rest: &mut [f64]) {
        self.0.perform(FunctionKind::StartEquations, at, &[], &[], &mut [rest]);
    }

    #[inline]
    fn start_equation_sensitivities(
        &self,
        at: EvaluationPoint<'_>,
        s: &[f64],
        drest: &mut [f64],
        drestdy: &mut [f64],
    ) {
        let results = &mut [drest, drestdy];
        self.0.perform(FunctionKind::StartEquationSensitivities, at, &[], s, results);
    }

    #[inline]
    fn varying_delays(&self, at: EvaluationPoint<'_>, tau: &mut [f64]) {
        self.0.perform(FunctionKind::VaryingDelays, at, &[], &[], &mut [tau]);
    }

    #[inline]
    fn varying_delay_sensitivities(
        &self,
        at: EvaluationPoint<'_>,
        udot: &[f64],
        s: &[f64],
        dtau: &mut [f64],
        dtaudy: &mut [f64],
        dtaudt: &mut [f64],
    ) {
        let results = &mut [dtau, dtaudy, dtaudt];
        self.0.perform(FunctionKind::VaryingDelaySensitivities, at, udot, s, results);
    }

    #[inline]
    fn mass(&self, at: EvaluationPoint<'_>, mass: &mut [f64]) {
        if self.0.program().computes(FunctionKind::Mass) {
            self.0.perform(FunctionKind::Mass, at, &[], &[], &mut [mass]);
        } else {
            self.0.program().signature.write_mass(mass);
        }
    }

    #[inline]
    fn condition_times(&self, at: EvaluationPoint<'_>, times: &mut [f64], after: &mut [f64]) {
        self.0.perform(FunctionKind::ConditionTimes, at, &[], &[], &mut [times, after]);
    }

    #[inline]
    fn condition_time_sensitivities(&self, at: EvaluationPoint<'_>, dtimes: &mut [f64]) {
        self.0.perform(FunctionKind::ConditionTimeSensitivities, at, &[], &[], &mut [dtimes]);
    }

    #[inline]
    fn event_functions(&self, at: EvaluationPoint<'_>, e: &mut [f64]) {
        self.0.perform(FunctionKind::EventFunctions, at, &[], &[], &mut [e]);
    }

    #[inline]
    fn event_derivatives(
        &self,
        at: EvaluationPoint<'_>,
        udot: &[f64],
        de: &mut [f64],
        dedy: &mut [f64],
        dedt: &mut [f64],
    ) {
        self.0.perform(FunctionKind::EventDerivatives, at, udot, &[], &mut [de, dedy, dedt]);
    }

    #[inline]
    fn resets(&self, at: EvaluationPoint<'_>, r: &mut [f64]) {
        self.0.perform(FunctionKind::Resets, at, &[], &[], &mut [r]);
    }

    #[inline]
    fn reset_derivatives(
        &self,
        at: EvaluationPoint<'_>,
        udot: &[f64],
        dr: &mut [f64],
        drdy: &mut [f64],
        drdt: &mut [f64],
    ) {
        self.0.perform(FunctionKind::ResetDerivatives, at, udot, &[], &mut [dr, drdy, drdt]);
    }

    #[inline]
    fn jumps(
        &self,
        at: EvaluationPoint<'_>,
        kinds: &mut [f64],
        rests: &mut [f64],
        jacobian: &mut [f64],
    ) {
        self.0.perform(FunctionKind::Jumps, at, &[], &[], &mut [kinds, rests, jacobian]);
    }

    #[inline]
    fn jump_sensitivities(
        &self,
        at: EvaluationPoint<'_>,
        udot: &[f64],
        s: &[f64],
        drests: &mut [f64],
        drestsdt: &mut [f64],
        djacobian: &mut [f64],
        djacobiandt: &mut [f64],
    ) {
        let results = &mut [drests, drestsdt, djacobian, djacobiandt];
        self.0.perform(FunctionKind::JumpSensitivities, at, udot, s, results);
    }

    fn taylor_series(&self) -> Result<KeptSeries, NoTaylorSeries> {
        match &self.0.program().taylor {
            Ok(TaylorSeries { unknowns, sensitivities }) => Ok(KeptSeries {
                unknowns: unknowns.n_kept(),
                sensitivities: sensitivities.n_kept(),
                has_branches: sensitivities.has_branches,
            }),
            Err(program::NoTaylor::Algebraic) => Err(NoTaylorSeries::Algebraic),
            Err(program::NoTaylor::Delays) => Err(NoTaylorSeries::Delays),
            Err(program::NoTaylor::Arrays) => Err(NoTaylorSeries::Arrays),
            Err(program::NoTaylor::Functions) => Err(NoTaylorSeries::Functions),
        }
    }

    fn taylor(
        &self,
        at: EvaluationPoint<'_>,
        udot: &[f64],
        h: f64,
        order: usize,
        kept: &mut [SeriesTerms],
        y: &mut [f64],
    ) {
        let expansion = SeriesComputation { udot, h, order, kept, y, s: &mut [] };
        self.0.interpreter().expand(at, |taylor| &taylor.unknowns, expansion);
    }

    fn sensitivity_taylor(
        &self,
        at: EvaluationPoint<'_>,
        udot: &[f64],
        h: f64,
        order: usize,
        kept: &mut [SeriesTerms],
        y: &mut [f64],
        s: &mut [f64],
    ) {
        let expansion = SeriesComputation { udot, h, order, kept, y, s };
        self.0.interpreter().expand(at, |taylor| &taylor.sensitivities, expansion);
    }
}
