//! Items used by `dgd-identify` in addition to the public interface.

pub use crate::discrete::state_selection::select_states;
pub use crate::discrete::{changes_by_mode, choose_sides, differential_somewhere};
pub use crate::integrate::fixed_step::{can_stream, inputs_change_by_sample, stiffness};
pub use crate::integrate::start::consistent::start_values;
pub use crate::integrate::{
    HatFunction, HistoryPerturbation, NODES, PastSolution, held_by_bounds, verify_inputs,
    verify_request,
};
pub use crate::linearize::{LinearMatrices, ParametricModel, Responses};
pub use crate::observe::delay::{DelayedOutputTimes, delay_sensitivities, delays};
pub use crate::problem::{parameter_size, unknown_sizes};
