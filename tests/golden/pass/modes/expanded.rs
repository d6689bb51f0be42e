/// A tank that overflows, and is drained from some moment on.
#[allow(
    non_snake_case,
    unused_variables,
    unused_doc_comments,
    dead_code,
    clippy::all,
    clippy::pedantic
)]
pub mod tank {
    /// The model `tank`.
    #[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
    pub struct Model;
    /// Parameters p; the default is the model file's. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Parameters {
        /// [m]
        pub crest: f64,
        /// [s]
        pub t_open: f64,
        /// [1]
        pub part: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Parameters {
        fn default() -> Self {
            Parameters {
                crest: 2.0,
                t_open: 60.0,
                part: 0.1,
            }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Parameters> for [f64; 3] {
        fn from(named: Parameters) -> [f64; 3] {
            [named.crest, named.t_open, named.part]
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<&Parameters> for ::dgd::__runtime::codegen::HeapNumbers {
        fn from(named: &Parameters) -> ::dgd::__runtime::codegen::HeapNumbers {
            <[f64; 3]>::from(*named).to_vec()
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 3]> for Parameters {
        fn from([crest, t_open, part]: [f64; 3]) -> Parameters {
            Parameters { crest, t_open, part }
        }
    }
    /// Inputs u. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Inputs {
        /// [m^3/s]
        pub q_in: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Inputs {
        fn default() -> Self {
            Inputs { q_in: 0.0 }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Inputs> for [f64; 1] {
        fn from(named: Inputs) -> [f64; 1] {
            [named.q_in]
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<&Inputs> for ::dgd::__runtime::codegen::HeapNumbers {
        fn from(named: &Inputs) -> ::dgd::__runtime::codegen::HeapNumbers {
            <[f64; 1]>::from(*named).to_vec()
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 1]> for Inputs {
        fn from([q_in]: [f64; 1]) -> Inputs {
            Inputs { q_in }
        }
    }
    /// Unknowns y. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Unknowns {
        /// [m]
        pub h: f64,
        /// [m^3/s]
        pub q: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Unknowns {
        fn default() -> Self {
            Unknowns { h: 0.0, q: 0.0 }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Unknowns> for [f64; 2] {
        fn from(named: Unknowns) -> [f64; 2] {
            [named.h, named.q]
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<&Unknowns> for ::dgd::__runtime::codegen::HeapNumbers {
        fn from(named: &Unknowns) -> ::dgd::__runtime::codegen::HeapNumbers {
            <[f64; 2]>::from(*named).to_vec()
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 2]> for Unknowns {
        fn from([h, q]: [f64; 2]) -> Unknowns {
            Unknowns { h, q }
        }
    }
    /// Outputs w. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Outputs {
        /// [m], declared in cm
        pub h: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Outputs {
        fn default() -> Self {
            Outputs { h: 0.0 }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Outputs> for [f64; 1] {
        fn from(named: Outputs) -> [f64; 1] {
            [named.h]
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<&Outputs> for ::dgd::__runtime::codegen::HeapNumbers {
        fn from(named: &Outputs) -> ::dgd::__runtime::codegen::HeapNumbers {
            <[f64; 1]>::from(*named).to_vec()
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 1]> for Outputs {
        fn from([h]: [f64; 1]) -> Outputs {
            Outputs { h }
        }
    }
    static SIGNATURE: ::dgd::__runtime::signature::Signature = {
        #[allow(unused_imports)]
        use ::dgd::__runtime::signature::{arrays::*, *};
        Signature {
            name: Text::Borrowed("tank"),
            unknowns: Unknowns::single(
                &[
                    Unknown {
                        name: Text::Borrowed("h"),
                        unit: Unit {
                            symbol: Text::Borrowed("m"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        nominal: ::core::option::Option::None,
                        differential: true,
                    },
                    Unknown {
                        name: Text::Borrowed("q"),
                        unit: Unit {
                            symbol: Text::Borrowed("m^3/s"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        nominal: ::core::option::Option::None,
                        differential: false,
                    },
                ],
            ),
            equations: Labels::single(
                &[Text::Borrowed("level"), Text::Borrowed("spill")],
            ),
            parameters: List::Borrowed(
                &[
                    Parameter {
                        name: Text::Borrowed("crest"),
                        unit: Unit {
                            symbol: Text::Borrowed("m"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        value: 2.0,
                        lower: -f64::INFINITY,
                        upper: f64::INFINITY,
                        nominal: ::core::option::Option::None,
                        log: false,
                        fixed: false,
                    },
                    Parameter {
                        name: Text::Borrowed("t_open"),
                        unit: Unit {
                            symbol: Text::Borrowed("s"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        value: 60.0,
                        lower: -f64::INFINITY,
                        upper: f64::INFINITY,
                        nominal: ::core::option::Option::None,
                        log: false,
                        fixed: false,
                    },
                    Parameter {
                        name: Text::Borrowed("part"),
                        unit: Unit {
                            symbol: Text::Borrowed("1"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        value: 0.1,
                        lower: -f64::INFINITY,
                        upper: f64::INFINITY,
                        nominal: ::core::option::Option::None,
                        log: false,
                        fixed: false,
                    },
                ],
            ),
            inputs: List::Borrowed(
                &[
                    Input {
                        name: Text::Borrowed("q_in"),
                        unit: Unit {
                            symbol: Text::Borrowed("m^3/s"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        interpolation: Interpolation::Hold,
                    },
                ],
            ),
            delays: List::Borrowed(&[]),
            varying_delays: List::Borrowed(&[]),
            delayed_inputs: List::Borrowed(&[]),
            delayed_unknowns: List::Borrowed(&[]),
            differentiated_inputs: List::Borrowed(&[]),
            outputs: List::Borrowed(
                &[
                    Output {
                        name: Text::Borrowed("h"),
                        unit: Unit {
                            symbol: Text::Borrowed("cm"),
                            factor: 0.01,
                            offset: 0.0,
                        },
                        noise: ::core::option::Option::None,
                        delay: ::core::option::Option::None,
                    },
                ],
            ),
            densities: List::Borrowed(&[]),
            directions: List::Borrowed(
                &[
                    Direction::Parameter(0),
                    Direction::Parameter(1),
                    Direction::Parameter(2),
                ],
            ),
            jacobian: Pattern::single(&[0, 1], &[0, 1]),
            sensitivity_jacobian: Pattern::single(&[], &[]),
            parameter_jacobian: Pattern::single(&[0], &[0]),
            input_jacobian: Pattern::single(&[0, 1], &[0, 0]),
            output_jacobians: [
                Pattern::single(&[0], &[0]),
                Pattern::single(&[], &[]),
                Pattern::single(&[], &[]),
            ],
            discrete: Discrete {
                automata: List::Borrowed(
                    &[
                        Automaton {
                            kind: AutomatonKind::Modes,
                            name: Text::Borrowed("tank"),
                            modes: List::Borrowed(
                                &[Text::Borrowed("filling"), Text::Borrowed("full")],
                            ),
                            start: 0,
                            transitions: List::Borrowed(
                                &[
                                    Transition {
                                        from: 0,
                                        to: 1,
                                        crossing: Crossing::Rises,
                                        trigger: Trigger::Edge,
                                        resets: List::Borrowed(&[]),
                                    },
                                    Transition {
                                        from: 1,
                                        to: 0,
                                        crossing: Crossing::Falls,
                                        trigger: Trigger::Edge,
                                        resets: List::Borrowed(&[0]),
                                    },
                                ],
                            ),
                        },
                    ],
                ),
                n_time_conditions: 1,
                clocks: List::Borrowed(&[]),
                event_formulas: Formulas {
                    operations: List::Borrowed(
                        &[
                            Operation::Unknown(1),
                            Operation::Unknown(0),
                            Operation::Parameter(0),
                            Operation::Subtract(1, 2),
                        ],
                    ),
                    results: List::Borrowed(&[3, 0]),
                },
                event_jacobian: Pattern::single(&[0, 1], &[0, 1]),
                event_directions: Pattern::single(&[0], &[0]),
                reset_jacobian: Pattern::single(&[0], &[0]),
                reset_directions: Pattern::single(&[0], &[2]),
                by_mode: List::Borrowed(&[0]),
                jump_jacobian: Pattern::single(&[], &[]),
                unlocated: List::Borrowed(&[]),
            },
            starts_at_rest: false,
            start_equations: List::Borrowed(&[]),
            conserved: List::Borrowed(&[]),
        }
    };
    #[automatically_derived]
    impl ::dgd::__runtime::System for Model {
        type Vector = [f64; 2];
        type Sensitivity = [f64; 6];
        type Inputs = [f64; 1];
        type Jacobian = [f64; 2];
        type SensitivityJacobian = [f64; 0];
        const FEATURES: ::dgd::__runtime::signature::Features = ::dgd::__runtime::signature::Features {
            events: true,
            past: false,
            algebraic: true,
            conserved: false,
        };
        #[inline]
        fn signature(&self) -> &::dgd::__runtime::signature::Signature {
            &SIGNATURE
        }
        #[inline]
        fn rhs(&self, _at: ::dgd::__runtime::EvaluationPoint<'_>, _f: &mut [f64]) {
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<3>(_at.p);
            let _z = ::dgd::__runtime::codegen::fixed::<2>(_at.z);
            let q_in = _u[0];
            let q = _y[1];
            let h = _y[0];
            let crest = _p[0];
            let drain = if (_z[1] > 0.5) { 0.1 } else { 0.0 };
            let _v12 = q_in - drain;
            let _v15 = (_z[0] < 0.5);
            /// `level` (model.dgd:18): 0 or der(h) =
            let _row_0: f64 = if _v15 { _v12 } else { crest - h };
            /// `spill` (model.dgd:19): 0 =
            let _row_1: f64 = if _v15 { -q } else { _v12 - q };
            *::dgd::__runtime::codegen::fixed_mut::<2>(_f) = [_row_0, _row_1];
        }
        #[inline]
        fn linearize(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _udot: &[f64],
            _f: &mut [f64],
            _jacobian: &mut [f64],
            _dfdt: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<3>(_at.p);
            let _udot = ::dgd::__runtime::codegen::fixed::<1>(_udot);
            let _z = ::dgd::__runtime::codegen::fixed::<2>(_at.z);
            let q_in = _u[0];
            let q = _y[1];
            let h = _y[0];
            let crest = _p[0];
            let drain = if (_z[1] > 0.5) { 0.1 } else { 0.0 };
            let _v13 = q_in - drain;
            let _v17 = (_z[0] < 0.5);
            let _v22 = if _v17 { 0.0 } else { -1.0 };
            *::dgd::__runtime::codegen::fixed_mut::<2>(_f) = [
                if _v17 { _v13 } else { crest - h },
                if _v17 { -q } else { _v13 - q },
            ];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_jacobian) = [
                _v22,
                _v22 + (if _v17 { -1.0 } else { 0.0 }),
            ];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_dfdt) = [
                (if _v17 { 1.0 } else { 0.0 }) * _udot[0],
                (if _v17 { 0.0 } else { 1.0 }) * _udot[0],
            ];
        }
        #[inline]
        fn sensitivity_rhs(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _s: &[f64],
            _f: &mut [f64],
            _g: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<3>(_at.p);
            let _s = ::dgd::__runtime::codegen::fixed::<6>(_s);
            let _z = ::dgd::__runtime::codegen::fixed::<2>(_at.z);
            let q_in = _u[0];
            let q = _y[1];
            let h = _y[0];
            let crest = _p[0];
            let drain = if (_z[1] > 0.5) { 0.1 } else { 0.0 };
            let _v13 = q_in - drain;
            let _v17 = (_z[0] < 0.5);
            let _v21 = if _v17 { 0.0 } else { -1.0 };
            let _v23 = _v21 + (if _v17 { -1.0 } else { 0.0 });
            *::dgd::__runtime::codegen::fixed_mut::<2>(_f) = [
                if _v17 { _v13 } else { crest - h },
                if _v17 { -q } else { _v13 - q },
            ];
            *::dgd::__runtime::codegen::fixed_mut::<6>(_g) = [
                _v21 * _s[0] + (if _v17 { 0.0 } else { 1.0 }),
                _v23 * _s[1],
                _v21 * _s[2],
                _v23 * _s[3],
                _v21 * _s[4],
                _v23 * _s[5],
            ];
        }
        #[inline]
        fn sensitivity_linearize(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _udot: &[f64],
            _s: &[f64],
            _f: &mut [f64],
            _jacobian: &mut [f64],
            _dfdt: &mut [f64],
            _g: &mut [f64],
            _dgdy: &mut [f64],
            _dgdt: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<3>(_at.p);
            let _udot = ::dgd::__runtime::codegen::fixed::<1>(_udot);
            let _s = ::dgd::__runtime::codegen::fixed::<6>(_s);
            let _z = ::dgd::__runtime::codegen::fixed::<2>(_at.z);
            let q_in = _u[0];
            let q = _y[1];
            let h = _y[0];
            let crest = _p[0];
            let drain = if (_z[1] > 0.5) { 0.1 } else { 0.0 };
            let _v13 = q_in - drain;
            let _v17 = (_z[0] < 0.5);
            let _v21 = if _v17 { 0.0 } else { 1.0 };
            let _v22 = if _v17 { 0.0 } else { -1.0 };
            let _v24 = _v22 + (if _v17 { -1.0 } else { 0.0 });
            *::dgd::__runtime::codegen::fixed_mut::<2>(_f) = [
                if _v17 { _v13 } else { crest - h },
                if _v17 { -q } else { _v13 - q },
            ];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_jacobian) = [_v22, _v24];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_dfdt) = [
                (if _v17 { 1.0 } else { 0.0 }) * _udot[0],
                _v21 * _udot[0],
            ];
            *::dgd::__runtime::codegen::fixed_mut::<6>(_g) = [
                _v22 * _s[0] + _v21,
                _v24 * _s[1],
                _v22 * _s[2],
                _v24 * _s[3],
                _v22 * _s[4],
                _v24 * _s[5],
            ];
            *::dgd::__runtime::codegen::fixed_mut::<0>(_dgdy) = [];
            *::dgd::__runtime::codegen::fixed_mut::<6>(_dgdt) = [
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
            ];
        }
        #[inline]
        fn parameter_jacobian(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _values: &mut [f64],
        ) {
            let _z = ::dgd::__runtime::codegen::fixed::<2>(_at.z);
            *::dgd::__runtime::codegen::fixed_mut::<1>(_values) = [
                if (_z[0] < 0.5) { 0.0 } else { 1.0 },
            ];
        }
        #[inline]
        fn input_jacobian(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _values: &mut [f64],
        ) {
            let _z = ::dgd::__runtime::codegen::fixed::<2>(_at.z);
            let _v4 = (_z[0] < 0.5);
            *::dgd::__runtime::codegen::fixed_mut::<2>(_values) = [
                if _v4 { 1.0 } else { 0.0 },
                if _v4 { 0.0 } else { 1.0 },
            ];
        }
        #[inline]
        fn time_derivative(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _values: &mut [f64],
        ) {
            *::dgd::__runtime::codegen::fixed_mut::<2>(_values) = [0.0, 0.0];
        }
        #[inline]
        fn outputs(&self, _at: ::dgd::__runtime::EvaluationPoint<'_>, _w: &mut [f64]) {
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let h = _y[0];
            *::dgd::__runtime::codegen::fixed_mut::<1>(_w) = [h];
        }
        #[inline]
        fn output_jacobians(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _dwdy: &mut [f64],
            _dwdu: &mut [f64],
            _dwdp: &mut [f64],
            _dwdt: &mut [f64],
        ) {
            *::dgd::__runtime::codegen::fixed_mut::<1>(_dwdy) = [1.0];
            *::dgd::__runtime::codegen::fixed_mut::<0>(_dwdu) = [];
            *::dgd::__runtime::codegen::fixed_mut::<0>(_dwdp) = [];
            *::dgd::__runtime::codegen::fixed_mut::<1>(_dwdt) = [0.0];
        }
        #[inline]
        fn output_sensitivities(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _s: &[f64],
            _w: &mut [f64],
            _dw: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let _s = ::dgd::__runtime::codegen::fixed::<6>(_s);
            let h = _y[0];
            *::dgd::__runtime::codegen::fixed_mut::<1>(_w) = [h];
            *::dgd::__runtime::codegen::fixed_mut::<3>(_dw) = [_s[0], _s[2], _s[4]];
        }
        #[inline]
        fn start(&self, _at: ::dgd::__runtime::EvaluationPoint<'_>, _y0: &mut [f64]) {
            *::dgd::__runtime::codegen::fixed_mut::<2>(_y0) = [1.0, 0.0];
        }
        #[inline]
        fn start_sensitivities(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _s0: &mut [f64],
        ) {
            *::dgd::__runtime::codegen::fixed_mut::<6>(_s0) = [
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
            ];
        }
        #[inline]
        fn mass(&self, _at: ::dgd::__runtime::EvaluationPoint<'_>, _mass: &mut [f64]) {
            let _z = ::dgd::__runtime::codegen::fixed::<2>(_at.z);
            *::dgd::__runtime::codegen::fixed_mut::<2>(_mass) = [
                if (_z[0] < 0.5) { 1.0 } else { 0.0 },
                0.0,
            ];
        }
        #[inline]
        fn condition_times(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _times: &mut [f64],
            _after: &mut [f64],
        ) {
            let _p = ::dgd::__runtime::codegen::fixed::<3>(_at.p);
            let t_open = _p[1];
            *::dgd::__runtime::codegen::fixed_mut::<1>(_times) = [t_open];
            *::dgd::__runtime::codegen::fixed_mut::<1>(_after) = [1.0];
        }
        #[inline]
        fn condition_time_sensitivities(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _dtimes: &mut [f64],
        ) {
            *::dgd::__runtime::codegen::fixed_mut::<3>(_dtimes) = [0.0, 1.0, 0.0];
        }
        #[inline]
        fn event_functions(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _e: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<3>(_at.p);
            let q = _y[1];
            let h = _y[0];
            let crest = _p[0];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_e) = [h - crest, q];
        }
        #[inline]
        fn event_derivatives(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _udot: &[f64],
            _de: &mut [f64],
            _dedy: &mut [f64],
            _dedt: &mut [f64],
        ) {
            *::dgd::__runtime::codegen::fixed_mut::<1>(_de) = [-1.0];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_dedy) = [1.0, 1.0];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_dedt) = [0.0, 0.0];
        }
        #[inline]
        fn resets(&self, _at: ::dgd::__runtime::EvaluationPoint<'_>, _r: &mut [f64]) {
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<3>(_at.p);
            let h = _y[0];
            let part = _p[2];
            *::dgd::__runtime::codegen::fixed_mut::<1>(_r) = [h - part];
        }
        #[inline]
        fn reset_derivatives(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _udot: &[f64],
            _dr: &mut [f64],
            _drdy: &mut [f64],
            _drdt: &mut [f64],
        ) {
            *::dgd::__runtime::codegen::fixed_mut::<1>(_dr) = [-1.0];
            *::dgd::__runtime::codegen::fixed_mut::<1>(_drdy) = [1.0];
            *::dgd::__runtime::codegen::fixed_mut::<1>(_drdt) = [0.0];
        }
        #[inline]
        fn taylor_series(
            &self,
        ) -> ::core::result::Result<
            ::dgd::__runtime::taylor::KeptSeries,
            ::dgd::__runtime::taylor::NoTaylorSeries,
        > {
            ::core::result::Result::Err(
                ::dgd::__runtime::taylor::NoTaylorSeries::Algebraic,
            )
        }
    }
    #[automatically_derived]
    impl ::dgd::__runtime::SolvableSystem for Model {
        type Factorisation = ::dgd::__runtime::linalg::FixedLu<2>;
        fn integrate(
            problem: &::dgd::__runtime::Problem<'_, Self>,
            times: &[f64],
            options: &::dgd::__runtime::Options,
            wanted: ::dgd::__runtime::WantedResults<'_>,
        ) -> ::core::result::Result<
            ::dgd::__runtime::Solution,
            ::dgd::__runtime::Failure,
        > {
            ::dgd::__runtime::integrate::integrate(problem, times, options, wanted)
        }
    }
}
