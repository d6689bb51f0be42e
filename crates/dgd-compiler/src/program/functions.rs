//! The table of all functions of a program: names, arguments and results.

/// Which function.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum FunctionKind {
    /// f.
    Rhs,
    /// f, ∂f/∂y, df/dt.
    Linearize,
    /// f, g.
    SensitivityRhs,
    /// f, ∂f/∂y, df/dt, g, ∂g/∂y, dg/dt.
    SensitivityLinearize,
    /// ∂f/∂p.
    ParameterJacobian,
    /// ∂f/∂u.
    InputJacobian,
    /// ∂f/∂t.
    TimeDerivative,
    /// w.
    Outputs,
    /// ∂w/∂y, ∂w/∂u, ∂w/∂p, ∂w/∂t.
    OutputJacobians,
    /// w, dw/dθ.
    OutputSensitivities,
    /// y₀.
    Start,
    /// ∂y₀/∂θ.
    StartSensitivities,
    /// r, the residuals of start equations.
    StartEquations,
    /// dr/dθ and ∂r/∂y of start equations.
    StartEquationSensitivities,
    /// τ.
    Delays,
    /// ∂τ/∂θ.
    DelaySensitivities,
    /// Diagonal of M by the modes.
    Mass,
    /// Switching times of conditions on time, and their values afterwards.
    ConditionTimes,
    /// ∂/∂θ of those times.
    ConditionTimeSensitivities,
    /// e, the event functions.
    EventFunctions,
    /// ∂e/∂θ, ∂e/∂y, ∂e/∂t + ∂e/∂u u̇.
    EventDerivatives,
    /// r, the values of resets.
    Resets,
    /// ∂r/∂θ, ∂r/∂y, ∂r/∂t + ∂r/∂u u̇.
    ResetDerivatives,
    /// Jumps on entering modes: kinds, residuals of constraints, and the matrix of jumps.
    Jumps,
    /// Derivatives of the residuals and of the matrix, along directions and along t.
    JumpSensitivities,
    /// Histories of delayed unknowns before the start, with two derivatives with respect to t.
    Histories,
    /// ∂/∂θ of the histories and of their slopes.
    HistorySensitivities,
    /// τ of the delays that vary.
    VaryingDelays,
    /// dτ/dθ, ∂τ/∂y and ∂τ/∂t + ∂τ/∂u u̇ of them.
    VaryingDelaySensitivities,
}

/// An array that a function reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum FunctionArgument {
    /// Unknowns y.
    Y,
    /// Inputs u.
    U,
    /// Parameters p.
    P,
    /// Slopes of the inputs.
    Udot,
    /// Sensitivities S, column by column.
    S,
    /// Discrete numbers z.
    Z,
}

/// An array that a function writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ResultKind {
    /// f, n.
    F,
    /// Non-zeros of ∂f/∂y.
    Jacobian,
    /// df/dt = ∂f/∂t + ∂f/∂u u̇, n.
    Dfdt,
    /// g = ∂f/∂y S + ∂f/∂θ, n n_s.
    G,
    /// Non-zeros of ∂g/∂y.
    Dgdy,
    /// dg/dt, n n_s.
    Dgdt,
    /// Non-zeros of ∂f/∂p.
    ParameterJacobian,
    /// Non-zeros of ∂f/∂u.
    InputJacobian,
    /// ∂f/∂t, n.
    TimeDerivative,
    /// w, n_w.
    W,
    /// Non-zeros of ∂w/∂y.
    Dwdy,
    /// Non-zeros of ∂w/∂u.
    Dwdu,
    /// Non-zeros of ∂w/∂p.
    Dwdp,
    /// ∂w/∂t, n_w.
    Dwdt,
    /// dw/dθ, n_w × n_s.
    Dw,
    /// y₀, n.
    Y0,
    /// ∂y₀/∂θ, n n_s.
    S0,
    /// r, one for each start equation.
    StartRest,
    /// dr/dθ = ∂r/∂y S + ∂r/∂θ of them, by columns.
    StartRestSensitivities,
    /// ∂r/∂y of them, dense by columns.
    StartRestJacobian,
    /// τ, one for each delay.
    Tau,
    /// ∂τ/∂θ, delays × n_s.
    Dtau,
    /// Diagonal of M, n; nothing without modes.
    Mass,
    /// Times at which conditions on time switch, n_c.
    ConditionTimes,
    /// Their discrete numbers from then on, n_c.
    ConditionAfter,
    /// ∂/∂θ of the times, n_c × n_s.
    ConditionTimeSensitivities,
    /// e, n_e.
    Events,
    /// Non-zeros of ∂e/∂θ at fixed unknowns.
    EventDirections,
    /// Non-zeros of ∂e/∂y.
    EventJacobian,
    /// ∂e/∂t + ∂e/∂u u̇, n_e.
    EventSlopes,
    /// r, n_r.
    Resets,
    /// Non-zeros of ∂r/∂θ at fixed unknowns.
    ResetDirections,
    /// Non-zeros of ∂r/∂y.
    ResetJacobian,
    /// ∂r/∂t + ∂r/∂u u̇, n_r.
    ResetSlopes,
    /// Kinds of jumps as numbers, one for each single unknown.
    JumpKinds,
    /// Residuals of constraints, one for each single unknown.
    JumpRests,
    /// Non-zeros of the matrix of jumps and impulses.
    JumpJacobian,
    /// ∂/∂y S + ∂/∂θ of the residuals of constraints, by columns.
    JumpRestSensitivities,
    /// ∂/∂t + ∂/∂u u̇ of these residuals.
    JumpRestSlopes,
    /// ∂/∂y S + ∂/∂θ of the non-zeros, by columns.
    JumpJacobianSensitivities,
    /// ∂/∂t + ∂/∂u u̇ of them.
    JumpJacobianSlopes,
    /// φ, the history of each delayed unknown before the start; 0 without a declared one.
    History,
    /// dφ/dt.
    HistoryRate,
    /// d²φ/dt².
    HistoryCurvature,
    /// ∂φ/∂θ, n_v × n_s.
    HistorySensitivities,
    /// ∂²φ/∂t∂θ, n_v × n_s.
    HistorySensitivityRates,
    /// τ of the delays that vary.
    VaryingTau,
    /// dτ/dθ = ∂τ/∂y S + ∂τ/∂θ of them, by columns.
    VaryingDtau,
    /// ∂τ/∂y of them, dense by columns.
    VaryingTauJacobian,
    /// ∂τ/∂t + ∂τ/∂u u̇ of them.
    VaryingTauSlopes,
}

/// A row of [`FUNCTIONS`].
#[derive(Debug)]
pub struct FunctionSpec {
    /// Its kind.
    pub kind: FunctionKind,
    /// Its method of `System`.
    pub name: &'static str,
    /// Arrays it takes in addition to t, y, u, p, z, in the order of the method's arguments.
    pub extra: &'static [FunctionArgument],
    /// Arrays it writes, in the order of the method's arguments.
    pub results: &'static [ResultKind],
}

const fn row(
    kind: FunctionKind,
    name: &'static str,
    extra: &'static [FunctionArgument],
    results: &'static [ResultKind],
) -> FunctionSpec {
    FunctionSpec { kind, name, extra, results }
}

/// THE table.
pub static FUNCTIONS: &[FunctionSpec] = {
    use FunctionArgument::{S, Udot};
    use FunctionKind as K;
    use ResultKind as R;
    &[
        row(K::Rhs, "rhs", &[], &[R::F]),
        row(K::Linearize, "linearize", &[Udot], &[R::F, R::Jacobian, R::Dfdt]),
        row(K::SensitivityRhs, "sensitivity_rhs", &[S], &[R::F, R::G]),
        row(
            K::SensitivityLinearize,
            "sensitivity_linearize",
            &[Udot, S],
            &[R::F, R::Jacobian, R::Dfdt, R::G, R::Dgdy, R::Dgdt],
        ),
        row(K::ParameterJacobian, "parameter_jacobian", &[], &[R::ParameterJacobian]),
        row(K::InputJacobian, "input_jacobian", &[], &[R::InputJacobian]),
        row(K::TimeDerivative, "time_derivative", &[], &[R::TimeDerivative]),
        row(K::Outputs, "outputs", &[], &[R::W]),
        row(K::OutputJacobians, "output_jacobians", &[], &[R::Dwdy, R::Dwdu, R::Dwdp, R::Dwdt]),
        row(K::OutputSensitivities, "output_sensitivities", &[S], &[R::W, R::Dw]),
        row(K::Start, "start", &[], &[R::Y0]),
        row(K::StartSensitivities, "start_sensitivities", &[], &[R::S0]),
        row(K::StartEquations, "start_equations", &[], &[R::StartRest]),
        row(
            K::StartEquationSensitivities,
            "start_equation_sensitivities",
            &[S],
            &[R::StartRestSensitivities, R::StartRestJacobian],
        ),
        row(K::Delays, "delays", &[], &[R::Tau]),
        row(K::DelaySensitivities, "delay_sensitivities", &[], &[R::Dtau]),
        row(K::Mass, "mass", &[], &[R::Mass]),
        row(K::ConditionTimes, "condition_times", &[], &[R::ConditionTimes, R::ConditionAfter]),
        row(
            K::ConditionTimeSensitivities,
            "condition_time_sensitivities",
            &[],
            &[R::ConditionTimeSensitivities],
        ),
        row(K::EventFunctions, "event_functions", &[], &[R::Events]),
        row(
            K::EventDerivatives,
            "event_derivatives",
            &[Udot],
            &[R::EventDirections, R::EventJacobian, R::EventSlopes],
        ),
        row(K::Resets, "resets", &[], &[R::Resets]),
        row(
            K::ResetDerivatives,
            "reset_derivatives",
            &[Udot],
            &[R::ResetDirections, R::ResetJacobian, R::ResetSlopes],
        ),
        row(K::Jumps, "jumps", &[], &[R::JumpKinds, R::JumpRests, R::JumpJacobian]),
        row(
            K::JumpSensitivities,
            "jump_sensitivities",
            &[Udot, S],
            &[
                R::JumpRestSensitivities,
                R::JumpRestSlopes,
                R::JumpJacobianSensitivities,
                R::JumpJacobianSlopes,
            ],
        ),
        row(K::Histories, "histories", &[], &[R::History, R::HistoryRate, R::HistoryCurvature]),
        row(
            K::HistorySensitivities,
            "history_sensitivities",
            &[],
            &[R::HistorySensitivities, R::HistorySensitivityRates],
        ),
        row(K::VaryingDelays, "varying_delays", &[], &[R::VaryingTau]),
        row(
            K::VaryingDelaySensitivities,
            "varying_delay_sensitivities",
            &[Udot, S],
            &[R::VaryingDtau, R::VaryingTauJacobian, R::VaryingTauSlopes],
        ),
    ]
};

/// The sparse matrices with rows of arrays, in the order of the signature.
pub const RUNS: [ResultKind; 7] = [
    ResultKind::Jacobian,
    ResultKind::Dgdy,
    ResultKind::ParameterJacobian,
    ResultKind::InputJacobian,
    ResultKind::Dwdy,
    ResultKind::Dwdu,
    ResultKind::Dwdp,
];

impl FunctionKind {
    /// Its row of the table.
    pub fn spec(self) -> &'static FunctionSpec {
        &FUNCTIONS[self as usize]
    }
}

impl ResultKind {
    /// Whether it is a matrix that only models with modes have.
    pub fn is_of_modes(self) -> bool {
        matches!(
            self,
            ResultKind::EventJacobian
                | ResultKind::EventDirections
                | ResultKind::ResetJacobian
                | ResultKind::ResetDirections
                | ResultKind::JumpJacobian
        )
    }
}

#[cfg(test)]
mod tests {
    use super::FUNCTIONS;

    #[test]
    fn kinds_and_rows_have_one_order() {
        for (row, spec) in FUNCTIONS.iter().enumerate() {
            assert_eq!(spec.kind as usize, row, "{}", spec.name);
        }
    }
}
