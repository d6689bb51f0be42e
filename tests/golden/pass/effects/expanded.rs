/// A tank that a pump fills.
#[allow(
    non_snake_case,
    unused_variables,
    unused_doc_comments,
    dead_code,
    clippy::all,
    clippy::pedantic
)]
pub mod filled_tank {
    /// The model `filled_tank`.
    #[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
    pub struct Model;
    /// Parameters p; the default is the model file's. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Parameters {
        /// [m^(5/2)/s]
        pub k: f64,
        /// of the drive
        ///
        /// [s]
        pub tau: f64,
        /// [m], declared in cm
        pub offset_level: f64,
        /// [1]
        pub gain: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Parameters {
        fn default() -> Self {
            Parameters {
                k: 0.1,
                tau: 5.0,
                offset_level: 0.0,
                gain: 1.0,
            }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Parameters> for [f64; 4] {
        fn from(named: Parameters) -> [f64; 4] {
            [named.k, named.tau, named.offset_level, named.gain]
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<&Parameters> for ::dgd::__runtime::codegen::HeapNumbers {
        fn from(named: &Parameters) -> ::dgd::__runtime::codegen::HeapNumbers {
            <[f64; 4]>::from(*named).to_vec()
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 4]> for Parameters {
        fn from([k, tau, offset_level, gain]: [f64; 4]) -> Parameters {
            Parameters {
                k,
                tau,
                offset_level,
                gain,
            }
        }
    }
    /// Inputs u. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Inputs {
        /// Demanded, not measured.
        ///
        /// [m^3/s], declared in m^3/h
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
        /// [m^3]
        pub v: f64,
        /// [m^3/s], declared in m^3/h
        pub q_pump: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Unknowns {
        fn default() -> Self {
            Unknowns {
                h: 0.0,
                v: 0.0,
                q_pump: 0.0,
            }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Unknowns> for [f64; 3] {
        fn from(named: Unknowns) -> [f64; 3] {
            [named.h, named.v, named.q_pump]
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<&Unknowns> for ::dgd::__runtime::codegen::HeapNumbers {
        fn from(named: &Unknowns) -> ::dgd::__runtime::codegen::HeapNumbers {
            <[f64; 3]>::from(*named).to_vec()
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 3]> for Unknowns {
        fn from([h, v, q_pump]: [f64; 3]) -> Unknowns {
            Unknowns { h, v, q_pump }
        }
    }
    /// Outputs w. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Outputs {
        /// [m], declared in cm
        pub level: f64,
        /// [m^3/s], declared in m^3/h
        pub out: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Outputs {
        fn default() -> Self {
            Outputs { level: 0.0, out: 0.0 }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Outputs> for [f64; 2] {
        fn from(named: Outputs) -> [f64; 2] {
            [named.level, named.out]
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
        fn from([level, out]: [f64; 2]) -> Outputs {
            Outputs { level, out }
        }
    }
    static SIGNATURE: ::dgd::__runtime::signature::Signature = {
        #[allow(unused_imports)]
        use ::dgd::__runtime::signature::{arrays::*, *};
        Signature {
            name: Text::Borrowed("filled_tank"),
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
                        name: Text::Borrowed("v"),
                        unit: Unit {
                            symbol: Text::Borrowed("m^3"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        nominal: ::core::option::Option::None,
                        differential: true,
                    },
                    Unknown {
                        name: Text::Borrowed("q_pump"),
                        unit: Unit {
                            symbol: Text::Borrowed("m^3/h"),
                            factor: 0.0002777777777777778,
                            offset: 0.0,
                        },
                        nominal: ::core::option::Option::None,
                        differential: true,
                    },
                ],
            ),
            equations: Labels::single(
                &[
                    Text::Borrowed("level"),
                    Text::Borrowed("total"),
                    Text::Borrowed("drive"),
                ],
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
                        name: Text::Borrowed("tau"),
                        unit: Unit {
                            symbol: Text::Borrowed("s"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        value: 5.0,
                        lower: 0.1,
                        upper: 100.0,
                        nominal: ::core::option::Option::None,
                        log: true,
                        fixed: false,
                    },
                    Parameter {
                        name: Text::Borrowed("offset_level"),
                        unit: Unit {
                            symbol: Text::Borrowed("cm"),
                            factor: 0.01,
                            offset: 0.0,
                        },
                        value: 0.0,
                        lower: -0.1,
                        upper: 0.1,
                        nominal: ::core::option::Option::None,
                        log: false,
                        fixed: false,
                    },
                    Parameter {
                        name: Text::Borrowed("gain"),
                        unit: Unit {
                            symbol: Text::Borrowed("1"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        value: 1.0,
                        lower: 0.5,
                        upper: 2.0,
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
                            symbol: Text::Borrowed("m^3/h"),
                            factor: 0.0002777777777777778,
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
                        name: Text::Borrowed("level"),
                        unit: Unit {
                            symbol: Text::Borrowed("cm"),
                            factor: 0.01,
                            offset: 0.0,
                        },
                        noise: ::core::option::Option::Some(0.01),
                        delay: ::core::option::Option::None,
                    },
                    Output {
                        name: Text::Borrowed("out"),
                        unit: Unit {
                            symbol: Text::Borrowed("m^3/h"),
                            factor: 0.0002777777777777778,
                            offset: 0.0,
                        },
                        noise: ::core::option::Option::None,
                        delay: ::core::option::Option::None,
                    },
                ],
            ),
            directions: List::Borrowed(
                &[
                    Direction::Parameter(0),
                    Direction::Parameter(1),
                    Direction::Parameter(2),
                    Direction::Parameter(3),
                ],
            ),
            jacobian: Pattern::single(&[0, 0, 1, 2], &[0, 2, 2, 2]),
            sensitivity_jacobian: Pattern::single(&[0, 3, 6, 9, 5], &[0, 0, 0, 0, 2]),
            parameter_jacobian: Pattern::single(&[0, 2, 2], &[0, 1, 3]),
            input_jacobian: Pattern::single(&[2], &[0]),
            output_jacobians: [
                Pattern::single(&[0, 1], &[0, 0]),
                Pattern::single(&[], &[]),
                Pattern::single(&[1, 0], &[0, 2]),
            ],
            discrete: Discrete::NONE,
        }
    };
    #[automatically_derived]
    impl ::dgd::__runtime::System for Model {
        type Vector = [f64; 3];
        type Sensitivity = [f64; 12];
        type Inputs = [f64; 1];
        type Jacobian = [f64; 4];
        type SensitivityJacobian = [f64; 5];
        type Factorisation = ::dgd::__runtime::linalg::FixedLu<3>;
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
            let _y = ::dgd::__runtime::codegen::fixed::<3>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<4>(_at.p);
            let gain = _p[3];
            let q_in = _u[0];
            let q_pump = _y[2];
            let k = _p[0];
            let h = _y[0];
            let tau = _p[1];
            /// `level` (model.dgd:17): der(h) =
            let _row_0: f64 = 0.5 * (q_pump - k * ::core::primitive::f64::sqrt(h));
            /// `total` (model.dgd:18): der(v) =
            let _row_1: f64 = q_pump;
            /// `drive` (effects/lag.dgd:9): der(q_pump) =
            let _row_2: f64 = (gain * q_in - q_pump) * (1.0 / tau);
            *::dgd::__runtime::codegen::fixed_mut::<3>(_f) = [_row_0, _row_1, _row_2];
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
            let _y = ::dgd::__runtime::codegen::fixed::<3>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<4>(_at.p);
            let _udot = ::dgd::__runtime::codegen::fixed::<1>(_udot);
            let gain = _p[3];
            let q_in = _u[0];
            let q_pump = _y[2];
            let k = _p[0];
            let h = _y[0];
            let _v7 = ::core::primitive::f64::sqrt(h);
            let tau = _p[1];
            let _v15 = 1.0 / tau;
            *::dgd::__runtime::codegen::fixed_mut::<3>(_f) = [
                0.5 * (q_pump - k * _v7),
                q_pump,
                (gain * q_in - q_pump) * _v15,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<4>(_jacobian) = [
                -0.5 * k * (0.5 / _v7),
                0.5,
                1.0,
                -_v15,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<3>(_dfdt) = [
                0.0,
                0.0,
                _v15 * gain * _udot[0],
            ];
        }
        #[inline]
        fn sensitivity_rhs(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _s: &[f64],
            _f: &mut [f64],
            _g: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<3>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<4>(_at.p);
            let _s = ::dgd::__runtime::codegen::fixed::<12>(_s);
            let gain = _p[3];
            let q_in = _u[0];
            let q_pump = _y[2];
            let k = _p[0];
            let h = _y[0];
            let _v7 = ::core::primitive::f64::sqrt(h);
            let tau = _p[1];
            let _v14 = 1.0 / tau;
            let _v15 = (gain * q_in - q_pump) * _v14;
            let _v19 = -0.5 * k * (0.5 / _v7);
            *::dgd::__runtime::codegen::fixed_mut::<3>(_f) = [
                0.5 * (q_pump - k * _v7),
                q_pump,
                _v15,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<12>(_g) = [
                _v19 * _s[0] + 0.5 * _s[2] + -0.5 * _v7,
                _s[2],
                -(_v14 * _s[2]),
                _v19 * _s[3] + 0.5 * _s[5],
                _s[5],
                -(_v14 * _s[5]) - _v14 * _v15,
                _v19 * _s[6] + 0.5 * _s[8],
                _s[8],
                -(_v14 * _s[8]),
                _v19 * _s[9] + 0.5 * _s[11],
                _s[11],
                _v14 * q_in - _v14 * _s[11],
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
            let _y = ::dgd::__runtime::codegen::fixed::<3>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<4>(_at.p);
            let _udot = ::dgd::__runtime::codegen::fixed::<1>(_udot);
            let _s = ::dgd::__runtime::codegen::fixed::<12>(_s);
            let gain = _p[3];
            let q_in = _u[0];
            let q_pump = _y[2];
            let k = _p[0];
            let h = _y[0];
            let _v7 = ::core::primitive::f64::sqrt(h);
            let tau = _p[1];
            let _v15 = 1.0 / tau;
            let _v16 = (gain * q_in - q_pump) * _v15;
            let _v18 = -0.5 * k;
            let _v19 = 0.5 / _v7;
            let _v20 = _v18 * _v19;
            let _v60 = _v18 / _v7 * _v19 * _v19;
            let _v71 = _v15 / tau;
            *::dgd::__runtime::codegen::fixed_mut::<3>(_f) = [
                0.5 * (q_pump - k * _v7),
                q_pump,
                _v16,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<4>(_jacobian) = [
                _v20,
                0.5,
                1.0,
                -_v15,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<3>(_dfdt) = [
                0.0,
                0.0,
                _v15 * gain * _udot[0],
            ];
            *::dgd::__runtime::codegen::fixed_mut::<12>(_g) = [
                _v20 * _s[0] + 0.5 * _s[2] + -0.5 * _v7,
                _s[2],
                -(_v15 * _s[2]),
                _v20 * _s[3] + 0.5 * _s[5],
                _s[5],
                -(_v15 * _s[5]) - _v15 * _v16,
                _v20 * _s[6] + 0.5 * _s[8],
                _s[8],
                -(_v15 * _s[8]),
                _v20 * _s[9] + 0.5 * _s[11],
                _s[11],
                _v15 * q_in - _v15 * _s[11],
            ];
            *::dgd::__runtime::codegen::fixed_mut::<5>(_dgdy) = [
                -0.25 / _v7 - _v60 * _s[0],
                -(_v60 * _s[3]),
                -(_v60 * _s[6]),
                -(_v60 * _s[9]),
                _v71,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<12>(_dgdt) = [
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
                -(_v71 * gain * _udot[0]),
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
                _v15 * _udot[0],
            ];
        }
        #[inline]
        fn parameter_jacobian(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _values: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<3>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<4>(_at.p);
            let gain = _p[3];
            let q_in = _u[0];
            let q_pump = _y[2];
            let h = _y[0];
            let tau = _p[1];
            let _v9 = 1.0 / tau;
            *::dgd::__runtime::codegen::fixed_mut::<3>(_values) = [
                -0.5 * ::core::primitive::f64::sqrt(h),
                -(_v9 * ((gain * q_in - q_pump) * _v9)),
                _v9 * q_in,
            ];
        }
        #[inline]
        fn input_jacobian(&self, _at: ::dgd::__runtime::Point<'_>, _values: &mut [f64]) {
            let _p = ::dgd::__runtime::codegen::fixed::<4>(_at.p);
            let gain = _p[3];
            let tau = _p[1];
            *::dgd::__runtime::codegen::fixed_mut::<1>(_values) = [1.0 / tau * gain];
        }
        #[inline]
        fn time_derivative(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _values: &mut [f64],
        ) {
            *::dgd::__runtime::codegen::fixed_mut::<3>(_values) = [0.0, 0.0, 0.0];
        }
        #[inline]
        fn outputs(&self, _at: ::dgd::__runtime::Point<'_>, _w: &mut [f64]) {
            let _y = ::dgd::__runtime::codegen::fixed::<3>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<4>(_at.p);
            let k = _p[0];
            let h = _y[0];
            let offset_level = _p[2];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_w) = [
                h + offset_level,
                k * ::core::primitive::f64::sqrt(h),
            ];
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
            let _y = ::dgd::__runtime::codegen::fixed::<3>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<4>(_at.p);
            let k = _p[0];
            let h = _y[0];
            let _v3 = ::core::primitive::f64::sqrt(h);
            *::dgd::__runtime::codegen::fixed_mut::<2>(_dwdy) = [1.0, k * (0.5 / _v3)];
            *::dgd::__runtime::codegen::fixed_mut::<0>(_dwdu) = [];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_dwdp) = [_v3, 1.0];
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
            let _y = ::dgd::__runtime::codegen::fixed::<3>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<4>(_at.p);
            let _s = ::dgd::__runtime::codegen::fixed::<12>(_s);
            let k = _p[0];
            let h = _y[0];
            let _v3 = ::core::primitive::f64::sqrt(h);
            let offset_level = _p[2];
            let _v13 = k * (0.5 / _v3);
            *::dgd::__runtime::codegen::fixed_mut::<2>(_w) = [h + offset_level, k * _v3];
            *::dgd::__runtime::codegen::fixed_mut::<8>(_dw) = [
                _s[0],
                _v13 * _s[0] + _v3,
                _s[3],
                _v13 * _s[3],
                _s[6] + 1.0,
                _v13 * _s[6],
                _s[9],
                _v13 * _s[9],
            ];
        }
        #[inline]
        fn start(&self, _at: ::dgd::__runtime::Point<'_>, _y0: &mut [f64]) {
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<4>(_at.p);
            let gain = _p[3];
            let q_in = _u[0];
            let _v3 = gain * q_in;
            *::dgd::__runtime::codegen::fixed_mut::<3>(_y0) = [1.0, 60.0 * _v3, _v3];
        }
        #[inline]
        fn start_sensitivities(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _s0: &mut [f64],
        ) {
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let q_in = _u[0];
            *::dgd::__runtime::codegen::fixed_mut::<12>(_s0) = [
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
                60.0 * q_in,
                q_in,
            ];
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
                sensitivities: 3,
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
            let _y = ::dgd::__runtime::codegen::fixed::<3>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<4>(_at.p);
            let _udot = ::dgd::__runtime::codegen::fixed::<1>(_udot);
            let [_c0] = ::dgd::__runtime::taylor::kept::<1>(_kept);
            let _series = ::dgd::__runtime::taylor::rows::<3>(_series);
            let gain = _p[3];
            let q_in = _u[0];
            let q_pump = _y[2];
            let k = _p[0];
            let h = _y[0];
            let _v7 = ::core::primitive::f64::sqrt(h);
            let _v9 = 0.5 / _v7;
            let tau = _p[1];
            let _v16 = 1.0 / tau;
            let _v19 = -0.5 * k;
            let _v20 = -_v16;
            let _v21 = _v16 * gain;
            ::dgd::__runtime::taylor::keep(_c0, 0, _v7);
            let _f9 = _v9;
            let _f14 = 0.5;
            let _f19 = _v19;
            let _f20 = _v20;
            let _f21 = _v21;
            let mut _f: [f64; 3] = [
                0.5 * (q_pump - k * _v7),
                q_pump,
                (gain * q_in - q_pump) * _v16,
            ];
            _series[0] = *::dgd::__runtime::codegen::fixed::<3>(_at.y);
            for _k in 1..=_order {
                let _per = _h / _k as f64;
                _series[_k] = ::dgd::__runtime::taylor::advance(&_f, _per);
                if _k == _order {
                    break;
                }
                let _d2: f64 = ::dgd::__runtime::taylor::line(_h * _udot[0], _k);
                let _d4: f64 = _series[_k][2];
                let _d6: f64 = _series[_k][0];
                let _d7: f64 = ::dgd::__runtime::taylor::root(_d6, _c0, _f9, _k);
                ::dgd::__runtime::taylor::keep(_c0, _k, _d7);
                let _d15: f64 = _f14 * _d4 + _f19 * _d7;
                let _d17: f64 = _f21 * _d2 + _f20 * _d4;
                _f = [_d15, _d4, _d17];
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
            let _y = ::dgd::__runtime::codegen::fixed::<3>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<4>(_at.p);
            let _udot = ::dgd::__runtime::codegen::fixed::<1>(_udot);
            let [_c0, _c1, _c2] = ::dgd::__runtime::taylor::kept::<3>(_kept);
            let _series = ::dgd::__runtime::taylor::rows::<3>(_series);
            let _s = ::dgd::__runtime::taylor::rows::<4>(_s);
            let mut _g = [[0.0; 4]; 3];
            let gain = _p[3];
            let q_in = _u[0];
            let q_pump = _y[2];
            let k = _p[0];
            let h = _y[0];
            let _v7 = ::core::primitive::f64::sqrt(h);
            let _v9 = 0.5 / _v7;
            let tau = _p[1];
            let _v16 = 1.0 / tau;
            let _v19 = -0.5 * k;
            let _v20 = 0.5 / _v7;
            let _v22 = 1.0 / _v7;
            let _v23 = _v19 * _v20;
            let _v24 = -_v16;
            let _v30 = -0.5 * k;
            let _v31 = -_v16;
            let _v32 = _v16 * gain;
            let _v33 = -_v16;
            ::dgd::__runtime::taylor::keep(_c0, 0, _v7);
            ::dgd::__runtime::taylor::keep(_c1, 0, _v20);
            ::dgd::__runtime::taylor::keep(_c2, 0, _v23);
            let _f0 = 1.0;
            let _f9 = _v9;
            let _f14 = 0.5;
            let _f16 = _v16;
            let _f18 = -0.5;
            let _f19 = _v19;
            let _f22 = _v22;
            let _f24 = _v24;
            let _f30 = _v30;
            let _f31 = _v31;
            let _f32 = _v32;
            let _f33 = _v33;
            let mut _f: [f64; 3] = [
                0.5 * (q_pump - k * _v7),
                q_pump,
                (gain * q_in - q_pump) * _v16,
            ];
            let _row = &mut _g[0];
            *_row = [0.0; 4];
            ::dgd::__runtime::taylor::add_scaled(_row, _v23, &_s[0]);
            ::dgd::__runtime::taylor::add_scaled(_row, 0.5, &_s[2]);
            _row[0] += -0.5 * _v7;
            let _row = &mut _g[1];
            *_row = [0.0; 4];
            ::dgd::__runtime::taylor::add_scaled(_row, 1.0, &_s[2]);
            let _row = &mut _g[2];
            *_row = [0.0; 4];
            ::dgd::__runtime::taylor::add_scaled(_row, _v24, &_s[2]);
            _row[1] += -(_v16 * ((gain * q_in - q_pump) * _v16));
            _row[3] += _v16 * q_in;
            _series[0] = *::dgd::__runtime::codegen::fixed::<3>(_at.y);
            for _k in 1..=_order {
                let _per = _h / _k as f64;
                _series[_k] = ::dgd::__runtime::taylor::advance(&_f, _per);
                _s[_k * 3 + 0] = ::dgd::__runtime::taylor::advance(&_g[0], _per);
                _s[_k * 3 + 1] = ::dgd::__runtime::taylor::advance(&_g[1], _per);
                _s[_k * 3 + 2] = ::dgd::__runtime::taylor::advance(&_g[2], _per);
                if _k == _order {
                    break;
                }
                let _d2: f64 = ::dgd::__runtime::taylor::line(_h * _udot[0], _k);
                let _d4: f64 = _series[_k][2];
                let _d6: f64 = _series[_k][0];
                let _d7: f64 = ::dgd::__runtime::taylor::root(_d6, _c0, _f9, _k);
                ::dgd::__runtime::taylor::keep(_c0, _k, _d7);
                let _d15: f64 = _f14 * _d4 + _f30 * _d7;
                let _d17: f64 = _f32 * _d2 + _f31 * _d4;
                let _d20: f64 = ::dgd::__runtime::taylor::divide(
                    0.0,
                    _c0,
                    _c1,
                    _f22,
                    _k,
                );
                ::dgd::__runtime::taylor::keep(_c1, _k, _d20);
                let _d23: f64 = _f19 * _d20;
                ::dgd::__runtime::taylor::keep(_c2, _k, _d23);
                let _d25: f64 = _f18 * _d7;
                let _d26: f64 = _f16 * _d2;
                let _d28: f64 = _f33 * _d17;
                _f = [_d15, _d4, _d17];
                let _row = &mut _g[0];
                *_row = [0.0; 4];
                ::dgd::__runtime::taylor::add_product(_row, _c2, _s, (3, 0), _k);
                ::dgd::__runtime::taylor::add_scaled(_row, _f14, &_s[_k * 3 + 2]);
                _row[0] += _d25;
                let _row = &mut _g[1];
                *_row = [0.0; 4];
                ::dgd::__runtime::taylor::add_scaled(_row, _f0, &_s[_k * 3 + 2]);
                let _row = &mut _g[2];
                *_row = [0.0; 4];
                ::dgd::__runtime::taylor::add_scaled(_row, _f24, &_s[_k * 3 + 2]);
                _row[1] += _d28;
                _row[3] += _d26;
            }
        }
        #[inline(always)]
        fn rhs_lanes(
            &self,
            _at: ::dgd::__runtime::ensemble::lanes::LanePoint<'_>,
            _f: &mut [::dgd::__runtime::ensemble::lanes::Lanes],
        ) {
            ::dgd::__runtime::ensemble::lanes::rhs::<Self, 3, 1, 4>(self, _at, _f);
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
                3,
                1,
                4,
                4,
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
                3,
                1,
                4,
                2,
            >(self, _at, _w);
        }
    }
}
