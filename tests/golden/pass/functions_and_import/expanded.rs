/// Water runs from one basin into another through a long pipe.
#[allow(
    non_snake_case,
    unused_variables,
    unused_doc_comments,
    dead_code,
    clippy::all,
    clippy::pedantic
)]
pub mod basins {
    /// The model `basins`.
    #[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
    pub struct Model;
    /// Parameters p; the default is the model file's. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Parameters {
        /// [m^2]
        pub A_1: f64,
        /// [m^2]
        pub A_2: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Parameters {
        fn default() -> Self {
            Parameters { A_1: 1.5, A_2: 3.0 }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Parameters> for [f64; 2] {
        fn from(named: Parameters) -> [f64; 2] {
            [named.A_1, named.A_2]
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 2]> for Parameters {
        fn from([A_1, A_2]: [f64; 2]) -> Parameters {
            Parameters { A_1, A_2 }
        }
    }
    /// Inputs u. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Inputs {}
    #[automatically_derived]
    impl ::core::default::Default for Inputs {
        fn default() -> Self {
            Inputs {}
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Inputs> for [f64; 0] {
        fn from(named: Inputs) -> [f64; 0] {
            []
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 0]> for Inputs {
        fn from([]: [f64; 0]) -> Inputs {
            Inputs {}
        }
    }
    /// Unknowns y. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Unknowns {
        /// [m]
        pub h_1: f64,
        /// [m]
        pub h_2: f64,
        /// in the pipe
        ///
        /// [m/s]
        pub v: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Unknowns {
        fn default() -> Self {
            Unknowns {
                h_1: 0.0,
                h_2: 0.0,
                v: 0.0,
            }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Unknowns> for [f64; 3] {
        fn from(named: Unknowns) -> [f64; 3] {
            [named.h_1, named.h_2, named.v]
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 3]> for Unknowns {
        fn from([h_1, h_2, v]: [f64; 3]) -> Unknowns {
            Unknowns { h_1, h_2, v }
        }
    }
    /// Outputs w. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Outputs {
        /// [m^3/s], declared in l/min
        pub flow: f64,
        /// [m], declared in cm
        pub gap: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Outputs {
        fn default() -> Self {
            Outputs { flow: 0.0, gap: 0.0 }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Outputs> for [f64; 2] {
        fn from(named: Outputs) -> [f64; 2] {
            [named.flow, named.gap]
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 2]> for Outputs {
        fn from([flow, gap]: [f64; 2]) -> Outputs {
            Outputs { flow, gap }
        }
    }
    use ::dgd::__runtime::system::{List, Text};
    static SIGNATURE: ::dgd::__runtime::Signature = ::dgd::__runtime::Signature {
        name: Text::Borrowed("basins"),
        unknowns: List::Borrowed(
            &[
                ::dgd::__runtime::system::Unknown {
                    name: Text::Borrowed("h_1"),
                    unit: ::dgd::__runtime::system::Unit {
                        symbol: Text::Borrowed("m"),
                        factor: 1.0,
                        offset: 0.0,
                    },
                    nominal: ::core::option::Option::None,
                    differential: true,
                },
                ::dgd::__runtime::system::Unknown {
                    name: Text::Borrowed("h_2"),
                    unit: ::dgd::__runtime::system::Unit {
                        symbol: Text::Borrowed("m"),
                        factor: 1.0,
                        offset: 0.0,
                    },
                    nominal: ::core::option::Option::None,
                    differential: true,
                },
                ::dgd::__runtime::system::Unknown {
                    name: Text::Borrowed("v"),
                    unit: ::dgd::__runtime::system::Unit {
                        symbol: Text::Borrowed("m/s"),
                        factor: 1.0,
                        offset: 0.0,
                    },
                    nominal: ::core::option::Option::Some(1.0),
                    differential: true,
                },
            ],
        ),
        equations: List::Borrowed(
            &[Text::Borrowed("upper"), Text::Borrowed("lower"), Text::Borrowed("pipe")],
        ),
        parameters: List::Borrowed(
            &[
                ::dgd::__runtime::system::Parameter {
                    name: Text::Borrowed("A_1"),
                    unit: ::dgd::__runtime::system::Unit {
                        symbol: Text::Borrowed("m^2"),
                        factor: 1.0,
                        offset: 0.0,
                    },
                    value: 1.5,
                    lower: 0.1,
                    upper: 10.0,
                    nominal: ::core::option::Option::None,
                    log: false,
                    fixed: false,
                },
                ::dgd::__runtime::system::Parameter {
                    name: Text::Borrowed("A_2"),
                    unit: ::dgd::__runtime::system::Unit {
                        symbol: Text::Borrowed("m^2"),
                        factor: 1.0,
                        offset: 0.0,
                    },
                    value: 3.0,
                    lower: 0.1,
                    upper: 10.0,
                    nominal: ::core::option::Option::None,
                    log: false,
                    fixed: false,
                },
            ],
        ),
        inputs: List::Borrowed(&[]),
        delays: List::Borrowed(&[]),
        varying_delays: List::Borrowed(&[]),
        delayed_inputs: List::Borrowed(&[]),
        delayed_unknowns: List::Borrowed(&[]),
        differentiated_inputs: List::Borrowed(&[]),
        outputs: List::Borrowed(
            &[
                ::dgd::__runtime::system::Output {
                    name: Text::Borrowed("flow"),
                    unit: ::dgd::__runtime::system::Unit {
                        symbol: Text::Borrowed("l/min"),
                        factor: 1.6666666666666667e-5,
                        offset: 0.0,
                    },
                    noise: ::core::option::Option::None,
                    delay: ::core::option::Option::None,
                },
                ::dgd::__runtime::system::Output {
                    name: Text::Borrowed("gap"),
                    unit: ::dgd::__runtime::system::Unit {
                        symbol: Text::Borrowed("cm"),
                        factor: 0.01,
                        offset: 0.0,
                    },
                    noise: ::core::option::Option::None,
                    delay: ::core::option::Option::None,
                },
            ],
        ),
        directions: List::Borrowed(
            &[
                ::dgd::__runtime::system::Direction::Parameter(0),
                ::dgd::__runtime::system::Direction::Parameter(1),
            ],
        ),
        jacobian: ::dgd::__runtime::system::Pattern {
            rows: List::Borrowed(&[2, 2, 0, 1, 2]),
            columns: List::Borrowed(&[0, 1, 2, 2, 2]),
        },
        sensitivity_jacobian: ::dgd::__runtime::system::Pattern {
            rows: List::Borrowed(&[0, 2, 4, 5]),
            columns: List::Borrowed(&[2, 2, 2, 2]),
        },
        parameter_jacobian: ::dgd::__runtime::system::Pattern {
            rows: List::Borrowed(&[0, 1]),
            columns: List::Borrowed(&[0, 1]),
        },
        input_jacobian: ::dgd::__runtime::system::Pattern {
            rows: List::Borrowed(&[]),
            columns: List::Borrowed(&[]),
        },
        output_jacobians: [
            ::dgd::__runtime::system::Pattern {
                rows: List::Borrowed(&[1, 1, 0]),
                columns: List::Borrowed(&[0, 1, 2]),
            },
            ::dgd::__runtime::system::Pattern {
                rows: List::Borrowed(&[]),
                columns: List::Borrowed(&[]),
            },
            ::dgd::__runtime::system::Pattern {
                rows: List::Borrowed(&[]),
                columns: List::Borrowed(&[]),
            },
        ],
        discrete: ::dgd::__runtime::system::Discrete::NONE,
    };
    #[automatically_derived]
    impl ::dgd::__runtime::System for Model {
        type Vector = [f64; 3];
        type Sensitivity = [f64; 6];
        type Inputs = [f64; 0];
        type Jacobian = [f64; 5];
        type SensitivityJacobian = [f64; 4];
        type Factorisation = ::dgd::__runtime::linalg::FixedLu<3>;
        #[inline]
        fn signature(&self) -> &::dgd::__runtime::Signature {
            &SIGNATURE
        }
        #[inline]
        fn rhs(&self, _at: ::dgd::__runtime::Point<'_>, _f: &mut [f64]) {
            let _y = ::dgd::__runtime::codegen::fixed::<3>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let A_1 = _p[0];
            let v = _y[2];
            let A_2 = _p[1];
            let h_1 = _y[0];
            let h_2 = _y[1];
            let _v11 = ::core::primitive::f64::abs(v);
            let _v13 = 40000.0 * _v11;
            let _v35 = 0.3924
                * (h_1 - h_2
                    - 0.0509683995922528
                        * (625.0
                            * (if (_v13 < 2300.0) {
                                64.0 / (if (_v13 > 1.0) { _v13 } else { 1.0 })
                            } else {
                                0.316 * ::dgd::__runtime::math::power(_v13, -0.25)
                            }) * (v * _v11)));
            /// `upper` (model.dgd:21): der(h_1) =
            let _row_0: f64 = -0.0012566370614359172 * v / A_1;
            /// `lower` (model.dgd:22): der(h_2) =
            let _row_1: f64 = 0.0012566370614359172 * v / A_2;
            /// `pipe` (model.dgd:23): der(v) =
            let _row_2: f64 = _v35;
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
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let A_1 = _p[0];
            let v = _y[2];
            let A_2 = _p[1];
            let h_1 = _y[0];
            let h_2 = _y[1];
            let _v13 = ::core::primitive::f64::abs(v);
            let _v15 = 40000.0 * _v13;
            let _v17 = (_v15 < 2300.0);
            let _v19 = (_v15 > 1.0);
            let _v20 = if _v19 { _v15 } else { 1.0 };
            let _v21 = 64.0 / _v20;
            let _v26 = if _v17 {
                _v21
            } else {
                0.316 * ::dgd::__runtime::math::power(_v15, -0.25)
            };
            let _v29 = v * _v13;
            let _v61 = 40000.0
                * ((if _v17 {
                    0.0
                } else {
                    -3.95 * _v29 * (-0.25 * ::dgd::__runtime::math::power(_v15, -1.25))
                })
                    + (if _v19 {
                        if _v17 { -(-12.5 * _v29 / _v20 * _v21) } else { 0.0 }
                    } else {
                        0.0
                    })) * ::dgd::__runtime::math::sign(v);
            *::dgd::__runtime::codegen::fixed_mut::<3>(_f) = [
                -0.0012566370614359172 * v / A_1,
                0.0012566370614359172 * v / A_2,
                0.3924 * (h_1 - h_2 - 0.0509683995922528 * (625.0 * _v26 * _v29)),
            ];
            *::dgd::__runtime::codegen::fixed_mut::<5>(_jacobian) = [
                0.3924,
                -0.3924,
                -0.0012566370614359172 / A_1,
                0.0012566370614359172 / A_2,
                -12.5 * _v26 * (2.0 * _v13) + _v61,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<3>(_dfdt) = [0.0, 0.0, 0.0];
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
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let _s = ::dgd::__runtime::codegen::fixed::<6>(_s);
            let A_1 = _p[0];
            let v = _y[2];
            let A_2 = _p[1];
            let h_1 = _y[0];
            let h_2 = _y[1];
            let _v13 = ::core::primitive::f64::abs(v);
            let _v15 = 40000.0 * _v13;
            let _v17 = (_v15 < 2300.0);
            let _v19 = (_v15 > 1.0);
            let _v20 = if _v19 { _v15 } else { 1.0 };
            let _v21 = 64.0 / _v20;
            let _v26 = if _v17 {
                _v21
            } else {
                0.316 * ::dgd::__runtime::math::power(_v15, -0.25)
            };
            let _v29 = v * _v13;
            let _v34 = -0.0012566370614359172 * v / A_1;
            let _v35 = 0.0012566370614359172 * v / A_2;
            let _v39 = -0.0012566370614359172 / A_1;
            let _v41 = 0.0012566370614359172 / A_2;
            let _v63 = 40000.0
                * ((if _v17 {
                    0.0
                } else {
                    -3.95 * _v29 * (-0.25 * ::dgd::__runtime::math::power(_v15, -1.25))
                })
                    + (if _v19 {
                        if _v17 { -(-12.5 * _v29 / _v20 * _v21) } else { 0.0 }
                    } else {
                        0.0
                    })) * ::dgd::__runtime::math::sign(v);
            let _v64 = -12.5 * _v26 * (2.0 * _v13) + _v63;
            *::dgd::__runtime::codegen::fixed_mut::<3>(_f) = [
                _v34,
                _v35,
                0.3924 * (h_1 - h_2 - 0.0509683995922528 * (625.0 * _v26 * _v29)),
            ];
            *::dgd::__runtime::codegen::fixed_mut::<6>(_g) = [
                _v39 * _s[2] - 1.0 / A_1 * _v34,
                _v41 * _s[2],
                0.3924 * _s[0] + -0.3924 * _s[1] + _v64 * _s[2],
                _v39 * _s[5],
                _v41 * _s[5] - 1.0 / A_2 * _v35,
                0.3924 * _s[3] + -0.3924 * _s[4] + _v64 * _s[5],
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
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let _s = ::dgd::__runtime::codegen::fixed::<6>(_s);
            let A_1 = _p[0];
            let v = _y[2];
            let A_2 = _p[1];
            let h_1 = _y[0];
            let h_2 = _y[1];
            let _v13 = ::core::primitive::f64::abs(v);
            let _v15 = 40000.0 * _v13;
            let _v17 = (_v15 < 2300.0);
            let _v19 = (_v15 > 1.0);
            let _v20 = if _v19 { _v15 } else { 1.0 };
            let _v21 = 64.0 / _v20;
            let _v26 = if _v17 {
                _v21
            } else {
                0.316 * ::dgd::__runtime::math::power(_v15, -0.25)
            };
            let _v29 = v * _v13;
            let _v34 = -0.0012566370614359172 * v / A_1;
            let _v35 = 0.0012566370614359172 * v / A_2;
            let _v38 = 1.0 / A_1;
            let _v39 = -0.0012566370614359172 / A_1;
            let _v40 = 1.0 / A_2;
            let _v41 = 0.0012566370614359172 / A_2;
            let _v45 = 2.0 * _v13;
            let _v49 = -3.95 * _v29;
            let _v52 = -0.25 * ::dgd::__runtime::math::power(_v15, -1.25);
            let _v55 = -12.5 * _v29 / _v20;
            let _v62 = ::dgd::__runtime::math::sign(v);
            let _v64 = -12.5 * _v26 * _v45
                + 40000.0
                    * ((if _v17 { 0.0 } else { _v49 * _v52 })
                        + (if _v19 {
                            if _v17 { -(_v55 * _v21) } else { 0.0 }
                        } else {
                            0.0
                        })) * _v62;
            let _v93 = 40000.0 * _v62;
            let _v95 = -40000.0 * _v62;
            let _v100 = _v95 * _v21 / _v20;
            let _v134 = (if _v17 {
                0.0
            } else {
                -0.25 * (_v93 * _v49)
                    * (-1.25 * ::dgd::__runtime::math::power(_v15, -2.25))
            }) + (if _v17 { 0.0 } else { -7.9 * _v13 * _v52 })
                + (if _v19 {
                    (if _v17 { if _v19 { -(_v100 * _v55) } else { 0.0 } } else { 0.0 })
                        - ((if _v17 {
                            if _v19 { _v95 * _v55 } else { 0.0 }
                        } else {
                            0.0
                        }) + (if _v17 { -25.0 * _v13 } else { 0.0 })) / _v20 * _v21
                } else {
                    0.0
                });
            let _v138 = ((if _v17 { 0.0 } else { -3.95 * (_v93 * _v52) })
                + (if _v17 { if _v19 { -12.5 * _v100 } else { 0.0 } } else { 0.0 }))
                * _v45 + (-25.0 * _v26 + 40000.0 * _v134) * _v62;
            *::dgd::__runtime::codegen::fixed_mut::<3>(_f) = [
                _v34,
                _v35,
                0.3924 * (h_1 - h_2 - 0.0509683995922528 * (625.0 * _v26 * _v29)),
            ];
            *::dgd::__runtime::codegen::fixed_mut::<5>(_jacobian) = [
                0.3924,
                -0.3924,
                _v39,
                _v41,
                _v64,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<3>(_dfdt) = [0.0, 0.0, 0.0];
            *::dgd::__runtime::codegen::fixed_mut::<6>(_g) = [
                _v39 * _s[2] - _v38 * _v34,
                _v41 * _s[2],
                0.3924 * _s[0] + -0.3924 * _s[1] + _v64 * _s[2],
                _v39 * _s[5],
                _v41 * _s[5] - _v40 * _v35,
                0.3924 * _s[3] + -0.3924 * _s[4] + _v64 * _s[5],
            ];
            *::dgd::__runtime::codegen::fixed_mut::<4>(_dgdy) = [
                0.0012566370614359172 * (_v38 / A_1),
                _v138 * _s[2],
                -0.0012566370614359172 * (_v40 / A_2),
                _v138 * _s[5],
            ];
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
            _at: ::dgd::__runtime::Point<'_>,
            _values: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<3>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let A_1 = _p[0];
            let v = _y[2];
            let A_2 = _p[1];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_values) = [
                -(1.0 / A_1 * (-0.0012566370614359172 * v / A_1)),
                -(1.0 / A_2 * (0.0012566370614359172 * v / A_2)),
            ];
        }
        #[inline]
        fn input_jacobian(&self, _at: ::dgd::__runtime::Point<'_>, _values: &mut [f64]) {
            *::dgd::__runtime::codegen::fixed_mut::<0>(_values) = [];
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
            let v = _y[2];
            let h_1 = _y[0];
            let h_2 = _y[1];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_w) = [
                0.0012566370614359172 * v,
                if ((h_1 > h_2) && !(v < 0.0)) { h_1 - h_2 } else { 0.0 },
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
            let v = _y[2];
            let h_1 = _y[0];
            let h_2 = _y[1];
            let _v10 = ((h_1 > h_2) && !(v < 0.0));
            *::dgd::__runtime::codegen::fixed_mut::<3>(_dwdy) = [
                if _v10 { 1.0 } else { 0.0 },
                if _v10 { -1.0 } else { 0.0 },
                0.0012566370614359172,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<0>(_dwdu) = [];
            *::dgd::__runtime::codegen::fixed_mut::<0>(_dwdp) = [];
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
            let _s = ::dgd::__runtime::codegen::fixed::<6>(_s);
            let v = _y[2];
            let h_1 = _y[0];
            let h_2 = _y[1];
            let _v12 = ((h_1 > h_2) && !(v < 0.0));
            let _v20 = if _v12 { 1.0 } else { 0.0 };
            let _v21 = if _v12 { -1.0 } else { 0.0 };
            *::dgd::__runtime::codegen::fixed_mut::<2>(_w) = [
                0.0012566370614359172 * v,
                if _v12 { h_1 - h_2 } else { 0.0 },
            ];
            *::dgd::__runtime::codegen::fixed_mut::<4>(_dw) = [
                0.0012566370614359172 * _s[2],
                _v20 * _s[0] + _v21 * _s[1],
                0.0012566370614359172 * _s[5],
                _v20 * _s[3] + _v21 * _s[4],
            ];
        }
        #[inline]
        fn start(&self, _at: ::dgd::__runtime::Point<'_>, _y0: &mut [f64]) {
            *::dgd::__runtime::codegen::fixed_mut::<3>(_y0) = [2.0, 0.5, 0.0];
        }
        #[inline]
        fn start_sensitivities(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
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
    }
}
