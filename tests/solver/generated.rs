//! Model files in their variants, as generated Rust: each once, as each brings a solver of its own.

pub(crate) mod mud_circulation {
    dgd::model!("models/mud_circulation.dgd", as dynamic_flow);
    dgd::model!("models/mud_circulation.dgd", flow = static, as static_flow);
}
pub(crate) mod bench_two_state {
    dgd::model!("models/bench_two_state.dgd", as dynamic_flow);
    dgd::model!("models/bench_two_state.dgd", flow = static, as static_flow);
}
dgd::model!("models/robertson.dgd", as robertson_ode);
dgd::model!("models/robertson.dgd", form = dae, as robertson_dae);
