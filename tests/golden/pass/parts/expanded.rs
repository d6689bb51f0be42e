/// Two tanks, one below the other.
#[allow(
    non_snake_case,
    unused_variables,
    unused_doc_comments,
    dead_code,
    clippy::all,
    clippy::pedantic
)]
pub mod cascade {
    /// The model `cascade`.
    #[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
    pub struct Model;
    /// Parameters p; the default is the model file's. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Parameters {
        /// [m^(5/2)/s]
        pub k: f64,
        /// [1]
        pub clog: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Parameters {
        fn default() -> Self {
            Parameters { k: 0.1, clog: 0.1 }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Parameters> for [f64; 2] {
        fn from(named: Parameters) -> [f64; 2] {
            [named.k, named.clog]
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<&Parameters> for ::dgd::__runtime::codegen::HeapNumbers {
        fn from(named: &Parameters) -> ::dgd::__runtime::codegen::HeapNumbers {
            <[f64; 2]>::from(*named).to_vec()
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 2]> for Parameters {
        fn from([k, clog]: [f64; 2]) -> Parameters {
            Parameters { k, clog }
        }
    }
    /// Inputs u. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Inputs {
        /// [m^3/s]
        pub rain: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Inputs {
        fn default() -> Self {
            Inputs { rain: 0.0 }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Inputs> for [f64; 1] {
        fn from(named: Inputs) -> [f64; 1] {
            [named.rain]
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
        fn from([rain]: [f64; 1]) -> Inputs {
            Inputs { rain }
        }
    }
    /// Unknowns y. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Unknowns {
        /// [m]
        pub upper_h: f64,
        /// [m]
        pub lower_h: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Unknowns {
        fn default() -> Self {
            Unknowns {
                upper_h: 0.0,
                lower_h: 0.0,
            }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Unknowns> for [f64; 2] {
        fn from(named: Unknowns) -> [f64; 2] {
            [named.upper_h, named.lower_h]
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
        fn from([upper_h, lower_h]: [f64; 2]) -> Unknowns {
            Unknowns { upper_h, lower_h }
        }
    }
    /// Outputs w. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Outputs {
        /// [m], declared in cm
        pub upper_h: f64,
        /// [m^3/s]
        pub run_off: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Outputs {
        fn default() -> Self {
            Outputs {
                upper_h: 0.0,
                run_off: 0.0,
            }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Outputs> for [f64; 2] {
        fn from(named: Outputs) -> [f64; 2] {
            [named.upper_h, named.run_off]
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<&Outputs> for ::dgd::__runtime::codegen::HeapNumbers {
        fn from(named: &Outputs) -> ::dgd::__runtime::codegen::HeapNumbers {
            <[f64; 2]>::from(*named).to_vec()
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 2]> for Outputs {
        fn from([upper_h, run_off]: [f64; 2]) -> Outputs {
            Outputs { upper_h, run_off }
        }
    }
    static SIGNATURE: ::dgd::__runtime::signature::Signature = {
        #[allow(unused_imports)]
        use ::dgd::__runtime::signature::{arrays::*, *};
        Signature {
            name: Text::Borrowed("cascade"),
            unknowns: Unknowns::single(
                &[
                    Unknown {
                        name: Text::Borrowed("upper.h"),
                        unit: Unit {
                            symbol: Text::Borrowed("m"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        nominal: ::core::option::Option::None,
                        differential: true,
                    },
                    Unknown {
                        name: Text::Borrowed("lower.h"),
                        unit: Unit {
                            symbol: Text::Borrowed("m"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        nominal: ::core::option::Option::None,
                        differential: true,
                    },
                ],
            ),
            equations: Labels::single(
                &[Text::Borrowed("upper.level"), Text::Borrowed("lower.level")],
            ),
            parameters: List::Borrowed(
                &[
                    Parameter {
                        name: Text::Borrowed("k"),
                        unit: Unit {
                            symbol: Text::Borrowed("m^(5/2)/s"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        value: 0.1,
                        lower: 0.0,
                        upper: 1.0,
                        nominal: ::core::option::Option::None,
                        log: false,
                        fixed: false,
                    },
                    Parameter {
                        name: Text::Borrowed("clog"),
                        unit: Unit {
                            symbol: Text::Borrowed("1"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        value: 0.1,
                        lower: 0.0,
                        upper: 1.0,
                        nominal: ::core::option::Option::None,
                        log: false,
                        fixed: false,
                    },
                ],
            ),
            inputs: List::Borrowed(
                &[
                    Input {
                        name: Text::Borrowed("rain"),
                        unit: Unit {
                            symbol: Text::Borrowed("m^3/s"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        interpolation: Interpolation::Linear,
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
                        name: Text::Borrowed("upper.h"),
                        unit: Unit {
                            symbol: Text::Borrowed("cm"),
                            factor: 0.01,
                            offset: 0.0,
                        },
                        noise: ::core::option::Option::None,
                        delay: ::core::option::Option::None,
                    },
                    Output {
                        name: Text::Borrowed("run_off"),
                        unit: Unit {
                            symbol: Text::Borrowed("m^3/s"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        noise: ::core::option::Option::None,
                        delay: ::core::option::Option::None,
                    },
                ],
            ),
            directions: List::Borrowed(&[Direction::Parameter(0)]),
            jacobian: Pattern::single(&[0, 1, 1], &[0, 0, 1]),
            sensitivity_jacobian: Pattern::single(&[0, 1, 1], &[0, 0, 1]),
            parameter_jacobian: Pattern::single(&[0, 1, 1], &[0, 0, 1]),
            input_jacobian: Pattern::single(&[0], &[0]),
            output_jacobians: [
                Pattern::single(&[0, 1], &[0, 1]),
                Pattern::single(&[], &[]),
                Pattern::single(&[1], &[0]),
            ],
            discrete: Discrete::NONE,
        }
    };
    #[automatically_derived]
    impl ::dgd::__runtime::System for Model {
        type Vector = [f64; 2];
        type Sensitivity = [f64; 2];
        type Inputs = [f64; 1];
        type Jacobian = [f64; 3];
        type SensitivityJacobian = [f64; 3];
        type Factorisation = ::dgd::__runtime::linalg::FixedLu<2>;
        const FEATURES: ::dgd::__runtime::signature::Features = ::dgd::__runtime::signature::Features {
            events: false,
            past: false,
            algebraic: false,
        };
        #[inline]
        fn signature(&self) -> &::dgd::__runtime::signature::Signature {
            &SIGNATURE
        }
        #[inline]
        fn rhs(&self, _at: ::dgd::__runtime::Point<'_>, _f: &mut [f64]) {
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let k = _p[0];
            let upper_h = _y[0];
            let lower_q_in = k * ::core::primitive::f64::sqrt(upper_h);
            let lower_k = 0.5 * k;
            let lower_h = _y[1];
            let lower_q_out = lower_k * lower_h;
            let rain = _u[0];
            let clog = _p[1];
            /// `upper.level` (tank.dgd:19): der(upper.h) =
            let _row_0: f64 = 0.5 * (rain - lower_q_in);
            /// `lower.level` (tank.dgd:19): der(lower.h) =
            let _row_1: f64 = 0.5 * (lower_q_in - (1.0 - clog) * lower_q_out);
            *::dgd::__runtime::codegen::fixed_mut::<2>(_f) = [_row_0, _row_1];
        }
        #[inline]
        fn linearize(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _udot: &[f64],
            _f: &mut [f64],
            _jacobian: &mut [f64],
            _dfdt: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let _udot = ::dgd::__runtime::codegen::fixed::<1>(_udot);
            let k = _p[0];
            let upper_h = _y[0];
            let _v4 = ::core::primitive::f64::sqrt(upper_h);
            let lower_q_in = k * _v4;
            let lower_k = 0.5 * k;
            let lower_h = _y[1];
            let lower_q_out = lower_k * lower_h;
            let rain = _u[0];
            let clog = _p[1];
            let _v13 = 1.0 - clog;
            let _v20 = 0.5 / _v4;
            *::dgd::__runtime::codegen::fixed_mut::<2>(_f) = [
                0.5 * (rain - lower_q_in),
                0.5 * (lower_q_in - _v13 * lower_q_out),
            ];
            *::dgd::__runtime::codegen::fixed_mut::<3>(_jacobian) = [
                -0.5 * k * _v20,
                lower_k * _v20,
                -0.5 * _v13 * lower_k,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_dfdt) = [0.5 * _udot[0], 0.0];
        }
        #[inline]
        fn sensitivity_rhs(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _s: &[f64],
            _f: &mut [f64],
            _g: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let _s = ::dgd::__runtime::codegen::fixed::<2>(_s);
            let k = _p[0];
            let upper_h = _y[0];
            let _v3 = ::core::primitive::f64::sqrt(upper_h);
            let lower_q_in = k * _v3;
            let lower_k = 0.5 * k;
            let lower_h = _y[1];
            let lower_q_out = lower_k * lower_h;
            let rain = _u[0];
            let clog = _p[1];
            let _v12 = 1.0 - clog;
            let _v19 = 0.5 / _v3;
            let _v21 = -0.5 * _v12;
            *::dgd::__runtime::codegen::fixed_mut::<2>(_f) = [
                0.5 * (rain - lower_q_in),
                0.5 * (lower_q_in - _v12 * lower_q_out),
            ];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_g) = [
                -0.5 * k * _v19 * _s[0] + -0.5 * _v3,
                lower_k * _v19 * _s[0] + _v21 * lower_k * _s[1]
                    + (0.5 * (_v21 * lower_h) + 0.5 * _v3),
            ];
        }
        #[inline]
        fn sensitivity_linearize(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
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
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let _udot = ::dgd::__runtime::codegen::fixed::<1>(_udot);
            let _s = ::dgd::__runtime::codegen::fixed::<2>(_s);
            let k = _p[0];
            let upper_h = _y[0];
            let _v4 = ::core::primitive::f64::sqrt(upper_h);
            let lower_q_in = k * _v4;
            let lower_k = 0.5 * k;
            let lower_h = _y[1];
            let lower_q_out = lower_k * lower_h;
            let rain = _u[0];
            let clog = _p[1];
            let _v13 = 1.0 - clog;
            let _v19 = -0.5 * k;
            let _v20 = 0.5 / _v4;
            let _v21 = _v19 * _v20;
            let _v22 = -0.5 * _v13;
            let _v23 = _v22 * lower_k;
            let _v24 = lower_k * _v20;
            *::dgd::__runtime::codegen::fixed_mut::<2>(_f) = [
                0.5 * (rain - lower_q_in),
                0.5 * (lower_q_in - _v13 * lower_q_out),
            ];
            *::dgd::__runtime::codegen::fixed_mut::<3>(_jacobian) = [_v21, _v24, _v23];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_dfdt) = [0.5 * _udot[0], 0.0];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_g) = [
                _v21 * _s[0] + -0.5 * _v4,
                _v24 * _s[0] + _v23 * _s[1] + (0.5 * (_v22 * lower_h) + 0.5 * _v4),
            ];
            *::dgd::__runtime::codegen::fixed_mut::<3>(_dgdy) = [
                -0.25 / _v4 - _v19 / _v4 * _v20 * _v20 * _s[0],
                0.25 / _v4 - lower_k / _v4 * _v20 * _v20 * _s[0],
                -0.25 * _v13,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_dgdt) = [0.0, 0.0];
        }
        #[inline]
        fn parameter_jacobian(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _values: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let k = _p[0];
            let upper_h = _y[0];
            let _v3 = ::core::primitive::f64::sqrt(upper_h);
            let lower_k = 0.5 * k;
            let lower_h = _y[1];
            let lower_q_out = lower_k * lower_h;
            let clog = _p[1];
            *::dgd::__runtime::codegen::fixed_mut::<3>(_values) = [
                -0.5 * _v3,
                0.5 * (-0.5 * (1.0 - clog) * lower_h) + 0.5 * _v3,
                0.5 * lower_q_out,
            ];
        }
        #[inline]
        fn input_jacobian(&self, _at: ::dgd::__runtime::Point<'_>, _values: &mut [f64]) {
            *::dgd::__runtime::codegen::fixed_mut::<1>(_values) = [0.5];
        }
        #[inline]
        fn time_derivative(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _values: &mut [f64],
        ) {
            *::dgd::__runtime::codegen::fixed_mut::<2>(_values) = [0.0, 0.0];
        }
        #[inline]
        fn outputs(&self, _at: ::dgd::__runtime::Point<'_>, _w: &mut [f64]) {
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let k = _p[0];
            let upper_h = _y[0];
            let lower_k = 0.5 * k;
            let lower_h = _y[1];
            let lower_q_out = lower_k * lower_h;
            *::dgd::__runtime::codegen::fixed_mut::<2>(_w) = [upper_h, lower_q_out];
        }
        #[inline]
        fn output_jacobians(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _dwdy: &mut [f64],
            _dwdu: &mut [f64],
            _dwdp: &mut [f64],
            _dwdt: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let k = _p[0];
            let lower_k = 0.5 * k;
            let lower_h = _y[1];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_dwdy) = [1.0, lower_k];
            *::dgd::__runtime::codegen::fixed_mut::<0>(_dwdu) = [];
            *::dgd::__runtime::codegen::fixed_mut::<1>(_dwdp) = [0.5 * lower_h];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_dwdt) = [0.0, 0.0];
        }
        #[inline]
        fn output_sensitivities(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _s: &[f64],
            _w: &mut [f64],
            _dw: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let _s = ::dgd::__runtime::codegen::fixed::<2>(_s);
            let k = _p[0];
            let upper_h = _y[0];
            let lower_k = 0.5 * k;
            let lower_h = _y[1];
            let lower_q_out = lower_k * lower_h;
            *::dgd::__runtime::codegen::fixed_mut::<2>(_w) = [upper_h, lower_q_out];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_dw) = [
                _s[0],
                lower_k * _s[1] + 0.5 * lower_h,
            ];
        }
        #[inline]
        fn start(&self, _at: ::dgd::__runtime::Point<'_>, _y0: &mut [f64]) {
            *::dgd::__runtime::codegen::fixed_mut::<2>(_y0) = [2.0, 1.0];
        }
        #[inline]
        fn start_sensitivities(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _s0: &mut [f64],
        ) {
            *::dgd::__runtime::codegen::fixed_mut::<2>(_s0) = [0.0, 0.0];
        }
        #[inline]
        fn taylor_series(
            &self,
        ) -> ::core::result::Result<
            ::dgd::__runtime::taylor::KeptSeries,
            ::dgd::__runtime::taylor::NoTaylor,
        > {
            ::core::result::Result::Ok(::dgd::__runtime::taylor::KeptSeries {
                unknowns: 1,
                sensitivities: 4,
                has_branches: false,
            })
        }
        #[inline]
        fn taylor(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _udot: &[f64],
            _h: f64,
            _order: usize,
            _kept: &mut [::dgd::__runtime::taylor::Terms],
            _series: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let _udot = ::dgd::__runtime::codegen::fixed::<1>(_udot);
            let [_c0] = ::dgd::__runtime::taylor::kept::<1>(_kept);
            let _series = ::dgd::__runtime::taylor::rows::<2>(_series);
            let k = _p[0];
            let upper_h = _y[0];
            let _v3 = ::core::primitive::f64::sqrt(upper_h);
            let _v5 = 0.5 / _v3;
            let lower_q_in = k * _v3;
            let lower_k = 0.5 * k;
            let lower_h = _y[1];
            let lower_q_out = lower_k * lower_h;
            let rain = _u[0];
            let clog = _p[1];
            let _v14 = 1.0 - clog;
            let _v19 = -0.5;
            let _v22 = -0.5 * _v14 * lower_k;
            ::dgd::__runtime::taylor::keep(_c0, 0, _v3);
            let _f1 = k;
            let _f5 = _v5;
            let _f7 = 0.5;
            let _f19 = _v19;
            let _f22 = _v22;
            let mut _f: [f64; 2] = [
                0.5 * (rain - lower_q_in),
                0.5 * (lower_q_in - _v14 * lower_q_out),
            ];
            _series[0] = *::dgd::__runtime::codegen::fixed::<2>(_at.y);
            for _k in 1..=_order {
                let _per = _h / _k as f64;
                _series[_k] = ::dgd::__runtime::taylor::advance(&_f, _per);
                if _k == _order {
                    break;
                }
                let _d2: f64 = _series[_k][0];
                let _d3: f64 = ::dgd::__runtime::taylor::root(_d2, _c0, _f5, _k);
                ::dgd::__runtime::taylor::keep(_c0, _k, _d3);
                let _d6: f64 = _f1 * _d3;
                let _d9: f64 = _series[_k][1];
                let _d11: f64 = ::dgd::__runtime::taylor::line(_h * _udot[0], _k);
                let _d17: f64 = _f7 * _d11 + _f19 * _d6;
                let _d18: f64 = _f22 * _d9 + _f7 * _d6;
                _f = [_d17, _d18];
            }
        }
        #[inline]
        fn sensitivity_taylor(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _udot: &[f64],
            _h: f64,
            _order: usize,
            _kept: &mut [::dgd::__runtime::taylor::Terms],
            _series: &mut [f64],
            _s: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let _udot = ::dgd::__runtime::codegen::fixed::<1>(_udot);
            let [_c0, _c1, _c2, _c3] = ::dgd::__runtime::taylor::kept::<4>(_kept);
            let _series = ::dgd::__runtime::taylor::rows::<2>(_series);
            let _s = ::dgd::__runtime::taylor::rows::<1>(_s);
            let mut _g = [[0.0; 1]; 2];
            let k = _p[0];
            let upper_h = _y[0];
            let _v3 = ::core::primitive::f64::sqrt(upper_h);
            let _v5 = 0.5 / _v3;
            let lower_q_in = k * _v3;
            let lower_k = 0.5 * k;
            let lower_h = _y[1];
            let lower_q_out = lower_k * lower_h;
            let rain = _u[0];
            let clog = _p[1];
            let _v14 = 1.0 - clog;
            let _v20 = -0.5 * k;
            let _v21 = 0.5 / _v3;
            let _v23 = 1.0 / _v3;
            let _v24 = _v20 * _v21;
            let _v25 = -0.5 * _v14;
            let _v26 = _v25 * lower_k;
            let _v27 = lower_k * _v21;
            let _v33 = -0.5;
            let _v36 = -0.5 * _v14 * lower_k;
            let _v37 = 0.5 * _v25;
            ::dgd::__runtime::taylor::keep(_c0, 0, _v3);
            ::dgd::__runtime::taylor::keep(_c1, 0, _v21);
            ::dgd::__runtime::taylor::keep(_c2, 0, _v24);
            ::dgd::__runtime::taylor::keep(_c3, 0, _v27);
            let _f1 = k;
            let _f5 = _v5;
            let _f7 = 0.5;
            let _f8 = lower_k;
            let _f19 = -0.5;
            let _f20 = _v20;
            let _f23 = _v23;
            let _f26 = _v26;
            let _f33 = _v33;
            let _f36 = _v36;
            let _f37 = _v37;
            let mut _f: [f64; 2] = [
                0.5 * (rain - lower_q_in),
                0.5 * (lower_q_in - _v14 * lower_q_out),
            ];
            let _row = &mut _g[0];
            *_row = [0.0; 1];
            ::dgd::__runtime::taylor::add_scaled(_row, _v24, &_s[0]);
            _row[0] += -0.5 * _v3;
            let _row = &mut _g[1];
            *_row = [0.0; 1];
            ::dgd::__runtime::taylor::add_scaled(_row, _v27, &_s[0]);
            ::dgd::__runtime::taylor::add_scaled(_row, _v26, &_s[1]);
            _row[0] += 0.5 * (_v25 * lower_h) + 0.5 * _v3;
            _series[0] = *::dgd::__runtime::codegen::fixed::<2>(_at.y);
            for _k in 1..=_order {
                let _per = _h / _k as f64;
                _series[_k] = ::dgd::__runtime::taylor::advance(&_f, _per);
                _s[_k * 2 + 0] = ::dgd::__runtime::taylor::advance(&_g[0], _per);
                _s[_k * 2 + 1] = ::dgd::__runtime::taylor::advance(&_g[1], _per);
                if _k == _order {
                    break;
                }
                let _d2: f64 = _series[_k][0];
                let _d3: f64 = ::dgd::__runtime::taylor::root(_d2, _c0, _f5, _k);
                ::dgd::__runtime::taylor::keep(_c0, _k, _d3);
                let _d6: f64 = _f1 * _d3;
                let _d9: f64 = _series[_k][1];
                let _d11: f64 = ::dgd::__runtime::taylor::line(_h * _udot[0], _k);
                let _d17: f64 = _f7 * _d11 + _f33 * _d6;
                let _d18: f64 = _f36 * _d9 + _f7 * _d6;
                let _d21: f64 = ::dgd::__runtime::taylor::divide(
                    0.0,
                    _c0,
                    _c1,
                    _f23,
                    _k,
                );
                ::dgd::__runtime::taylor::keep(_c1, _k, _d21);
                let _d24: f64 = _f20 * _d21;
                ::dgd::__runtime::taylor::keep(_c2, _k, _d24);
                let _d27: f64 = _f8 * _d21;
                ::dgd::__runtime::taylor::keep(_c3, _k, _d27);
                let _d28: f64 = _f19 * _d3;
                let _d32: f64 = _f37 * _d9 + _f7 * _d3;
                _f = [_d17, _d18];
                let _row = &mut _g[0];
                *_row = [0.0; 1];
                ::dgd::__runtime::taylor::add_product(_row, _c2, _s, (2, 0), _k);
                _row[0] += _d28;
                let _row = &mut _g[1];
                *_row = [0.0; 1];
                ::dgd::__runtime::taylor::add_product(_row, _c3, _s, (2, 0), _k);
                ::dgd::__runtime::taylor::add_scaled(_row, _f26, &_s[_k * 2 + 1]);
                _row[0] += _d32;
            }
        }
        #[inline(always)]
        fn rhs_lanes(
            &self,
            _at: ::dgd::__runtime::ensemble::lanes::LanePoint<'_>,
            _f: &mut [::dgd::__runtime::ensemble::lanes::Lanes],
        ) {
            ::dgd::__runtime::ensemble::lanes::rhs::<Self, 2, 1, 2>(self, _at, _f);
        }
        #[inline(always)]
        fn linearize_lanes(
            &self,
            _at: ::dgd::__runtime::ensemble::lanes::LanePoint<'_>,
            _udot: &[::dgd::__runtime::ensemble::lanes::Lanes],
            _f: &mut [::dgd::__runtime::ensemble::lanes::Lanes],
            _jacobian: &mut [::dgd::__runtime::ensemble::lanes::Lanes],
            _dfdt: &mut [::dgd::__runtime::ensemble::lanes::Lanes],
        ) {
            ::dgd::__runtime::ensemble::lanes::linearize::<
                Self,
                2,
                1,
                2,
                3,
            >(self, _at, _udot, _f, _jacobian, _dfdt);
        }
        #[inline(always)]
        fn outputs_lanes(
            &self,
            _at: ::dgd::__runtime::ensemble::lanes::LanePoint<'_>,
            _w: &mut [::dgd::__runtime::ensemble::lanes::Lanes],
        ) {
            ::dgd::__runtime::ensemble::lanes::outputs::<
                Self,
                2,
                1,
                2,
                2,
            >(self, _at, _w);
        }
    }
}
