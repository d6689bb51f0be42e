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
    impl ::core::convert::From<&Parameters> for ::dgd::__runtime::codegen::HeapNumbers {
        fn from(named: &Parameters) -> ::dgd::__runtime::codegen::HeapNumbers {
            <[f64; 2]>::from(*named).to_vec()
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
    impl ::core::convert::From<&Inputs> for ::dgd::__runtime::codegen::HeapNumbers {
        fn from(named: &Inputs) -> ::dgd::__runtime::codegen::HeapNumbers {
            <[f64; 0]>::from(*named).to_vec()
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
        /// How much of the side above acts, while it slides, of switch 40000*abs(v) - 2300 at 0.
        ///
        /// [1]
        pub _share_1: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Unknowns {
        fn default() -> Self {
            Unknowns {
                h_1: 0.0,
                h_2: 0.0,
                v: 0.0,
                _share_1: 0.0,
            }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Unknowns> for [f64; 4] {
        fn from(named: Unknowns) -> [f64; 4] {
            [named.h_1, named.h_2, named.v, named._share_1]
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<&Unknowns> for ::dgd::__runtime::codegen::HeapNumbers {
        fn from(named: &Unknowns) -> ::dgd::__runtime::codegen::HeapNumbers {
            <[f64; 4]>::from(*named).to_vec()
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 4]> for Unknowns {
        fn from([h_1, h_2, v, _share_1]: [f64; 4]) -> Unknowns {
            Unknowns { h_1, h_2, v, _share_1 }
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
    impl ::core::convert::From<&Outputs> for ::dgd::__runtime::codegen::HeapNumbers {
        fn from(named: &Outputs) -> ::dgd::__runtime::codegen::HeapNumbers {
            <[f64; 2]>::from(*named).to_vec()
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 2]> for Outputs {
        fn from([flow, gap]: [f64; 2]) -> Outputs {
            Outputs { flow, gap }
        }
    }
    static SIGNATURE: ::dgd::__runtime::signature::Signature = {
        #[allow(unused_imports)]
        use ::dgd::__runtime::signature::{arrays::*, *};
        Signature {
            name: Text::Borrowed("basins"),
            unknowns: Unknowns::single(
                &[
                    Unknown {
                        name: Text::Borrowed("h_1"),
                        unit: Unit {
                            symbol: Text::Borrowed("m"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        nominal: ::core::option::Option::None,
                        differential: true,
                    },
                    Unknown {
                        name: Text::Borrowed("h_2"),
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
                            symbol: Text::Borrowed("m/s"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        nominal: ::core::option::Option::Some(1.0),
                        differential: true,
                    },
                    Unknown {
                        name: Text::Borrowed("share(1)"),
                        unit: Unit {
                            symbol: Text::Borrowed("1"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        nominal: ::core::option::Option::Some(1.0),
                        differential: false,
                    },
                ],
            ),
            equations: Labels::single(
                &[
                    Text::Borrowed("upper"),
                    Text::Borrowed("lower"),
                    Text::Borrowed("pipe"),
                    Text::Borrowed("switch 40000*abs(v) - 2300 at 0"),
                ],
            ),
            parameters: List::Borrowed(
                &[
                    Parameter {
                        name: Text::Borrowed("A_1"),
                        unit: Unit {
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
                    Parameter {
                        name: Text::Borrowed("A_2"),
                        unit: Unit {
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
                    Output {
                        name: Text::Borrowed("flow"),
                        unit: Unit {
                            symbol: Text::Borrowed("l/min"),
                            factor: 1.6666666666666667e-5,
                            offset: 0.0,
                        },
                        noise: ::core::option::Option::None,
                        delay: ::core::option::Option::None,
                    },
                    Output {
                        name: Text::Borrowed("gap"),
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
            directions: List::Borrowed(
                &[Direction::Parameter(0), Direction::Parameter(1)],
            ),
            jacobian: Pattern::single(
                &[2, 3, 2, 3, 0, 1, 2, 3, 2, 3],
                &[0, 0, 1, 1, 2, 2, 2, 2, 3, 3],
            ),
            sensitivity_jacobian: Pattern::single(
                &[0, 2, 3, 5, 6, 7, 2, 3, 6, 7],
                &[2, 2, 2, 2, 2, 2, 3, 3, 3, 3],
            ),
            parameter_jacobian: Pattern::single(&[0, 1], &[0, 1]),
            input_jacobian: Pattern::single(&[], &[]),
            output_jacobians: [
                Pattern::single(&[1, 1, 0], &[0, 1, 2]),
                Pattern::single(&[], &[]),
                Pattern::single(&[], &[]),
            ],
            discrete: Discrete {
                automata: List::Borrowed(
                    &[
                        Automaton {
                            kind: AutomatonKind::Switch,
                            name: Text::Borrowed("switch 40000*abs(v) - 2300 at 0"),
                            modes: List::Borrowed(
                                &[
                                    Text::Borrowed("below"),
                                    Text::Borrowed("above"),
                                    Text::Borrowed("sliding"),
                                ],
                            ),
                            start: 0,
                            transitions: List::Borrowed(
                                &[
                                    Transition {
                                        from: 0,
                                        to: 1,
                                        crossing: Crossing::Rises,
                                        trigger: Trigger::Level,
                                        resets: List::Borrowed(&[]),
                                    },
                                    Transition {
                                        from: 1,
                                        to: 0,
                                        crossing: Crossing::Falls,
                                        trigger: Trigger::Level,
                                        resets: List::Borrowed(&[]),
                                    },
                                    Transition {
                                        from: 1,
                                        to: 2,
                                        crossing: Crossing::Falls,
                                        trigger: Trigger::Entry,
                                        resets: List::Borrowed(&[]),
                                    },
                                    Transition {
                                        from: 0,
                                        to: 2,
                                        crossing: Crossing::Rises,
                                        trigger: Trigger::Entry,
                                        resets: List::Borrowed(&[]),
                                    },
                                    Transition {
                                        from: 2,
                                        to: 1,
                                        crossing: Crossing::Rises,
                                        trigger: Trigger::Level,
                                        resets: List::Borrowed(&[]),
                                    },
                                    Transition {
                                        from: 2,
                                        to: 0,
                                        crossing: Crossing::Falls,
                                        trigger: Trigger::Level,
                                        resets: List::Borrowed(&[]),
                                    },
                                ],
                            ),
                        },
                        Automaton {
                            kind: AutomatonKind::Corner,
                            name: Text::Borrowed("switch 40000*abs(v) - 1 at 0"),
                            modes: List::Borrowed(&[Text::Borrowed("")]),
                            start: 0,
                            transitions: List::Borrowed(
                                &[
                                    Transition {
                                        from: 0,
                                        to: 0,
                                        crossing: Crossing::Rises,
                                        trigger: Trigger::Edge,
                                        resets: List::Borrowed(&[]),
                                    },
                                    Transition {
                                        from: 0,
                                        to: 0,
                                        crossing: Crossing::Falls,
                                        trigger: Trigger::Edge,
                                        resets: List::Borrowed(&[]),
                                    },
                                ],
                            ),
                        },
                    ],
                ),
                n_time_conditions: 0,
                event_jacobian: Pattern::single(
                    &[2, 3, 2, 3, 0, 1, 2, 3, 6, 7, 2, 3, 4, 5],
                    &[0, 0, 1, 1, 2, 2, 2, 2, 2, 2, 3, 3, 3, 3],
                ),
                reset_jacobian: Pattern::single(&[], &[]),
            },
        }
    };
    #[automatically_derived]
    impl ::dgd::__runtime::System for Model {
        type Vector = [f64; 4];
        type Sensitivity = [f64; 8];
        type Inputs = [f64; 0];
        type Jacobian = [f64; 10];
        type SensitivityJacobian = [f64; 10];
        type Factorisation = ::dgd::__runtime::linalg::FixedLu<4>;
        const FEATURES: ::dgd::__runtime::signature::Features = ::dgd::__runtime::signature::Features {
            events: true,
            past: false,
            algebraic: true,
        };
        #[inline]
        fn signature(&self) -> &::dgd::__runtime::signature::Signature {
            &SIGNATURE
        }
        #[inline]
        fn rhs(&self, _at: ::dgd::__runtime::Point<'_>, _f: &mut [f64]) {
            let _y = ::dgd::__runtime::codegen::fixed::<4>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let _z = ::dgd::__runtime::codegen::fixed::<2>(_at.z);
            let A_1 = _p[0];
            let v = _y[2];
            let A_2 = _p[1];
            let h_1 = _y[0];
            let h_2 = _y[1];
            let _v14 = ::core::primitive::f64::abs(v);
            let _v16 = 40000.0 * _v14;
            let _v20 = 64.0 / (if (_v16 > 1.0) { _v16 } else { 1.0 });
            let _v25 = 0.316 * ::dgd::__runtime::math::power(_v16, -0.25);
            let _v27 = v * _v14;
            let _share_1 = _y[3];
            let _v36 = (_z[0] > 1.5);
            let _v40 = _v20 - _v25;
            let _v48 = 0.3924
                * (h_1 - h_2
                    - 0.0509683995922528
                        * (625.0
                            * (if _v36 {
                                _v25 + (1.0 - _share_1) * _v40
                            } else {
                                if (_z[0] < 0.5) { _v20 } else { _v25 }
                            }) * _v27));
            let _v49 = ::dgd::__runtime::math::sign(v);
            let _v51 = 40000.0 * _v49 * _v48;
            /// `upper` (model.dgd:21): der(h_1) =
            let _row_0: f64 = -0.0012566370614359172 * v * (1.0 / A_1);
            /// `lower` (model.dgd:22): der(h_2) =
            let _row_1: f64 = 0.0012566370614359172 * v * (1.0 / A_2);
            /// `pipe` (model.dgd:23): der(v) =
            let _row_2: f64 = _v48;
            /// `switch 40000*abs(v) - 2300 at 0` (model.dgd:21): 0 =
            let _row_3: f64 = if _v36 {
                if (::core::primitive::f64::abs(625.0 * (-800.0 * _v49 * _v27) * _v40)
                    > 0.0)
                {
                    _v51
                } else {
                    (if (_v51 > 0.0) { 2.0 } else { -1.0 }) - _share_1
                }
            } else {
                (if ((_z[0] > 0.5) && (_z[0] < 1.5)) { 1.0 } else { 0.0 }) - _share_1
            };
            *::dgd::__runtime::codegen::fixed_mut::<4>(_f) = [
                _row_0,
                _row_1,
                _row_2,
                _row_3,
            ];
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
            let _y = ::dgd::__runtime::codegen::fixed::<4>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let _z = ::dgd::__runtime::codegen::fixed::<2>(_at.z);
            let A_1 = _p[0];
            let v = _y[2];
            let A_2 = _p[1];
            let h_1 = _y[0];
            let h_2 = _y[1];
            let _v14 = ::core::primitive::f64::abs(v);
            let _v16 = 40000.0 * _v14;
            let _v18 = (_v16 > 1.0);
            let _v19 = if _v18 { _v16 } else { 1.0 };
            let _v20 = 64.0 / _v19;
            let _v25 = 0.316 * ::dgd::__runtime::math::power(_v16, -0.25);
            let _v27 = v * _v14;
            let _share_1 = _y[3];
            let _v36 = (_z[0] > 1.5);
            let _v37 = 1.0 - _share_1;
            let _v38 = (_z[0] < 0.5);
            let _v40 = _v20 - _v25;
            let _v43 = if _v36 {
                _v25 + _v37 * _v40
            } else {
                if _v38 { _v20 } else { _v25 }
            };
            let _v44 = 625.0 * _v43;
            let _v48 = 0.3924 * (h_1 - h_2 - 0.0509683995922528 * (_v44 * _v27));
            let _v49 = ::dgd::__runtime::math::sign(v);
            let _v51 = 40000.0 * _v49 * _v48;
            let _v59 = -800.0 * _v49;
            let _v61 = 625.0 * (_v59 * _v27);
            let _v63 = _v61 * _v40;
            let _v67 = (::core::primitive::f64::abs(_v63) > 0.0);
            let _v82 = -12.5 * _v27;
            let _v84 = if _v36 { 0.0 } else { _v82 };
            let _v86 = _v82 * _v37;
            let _v97 = 2.0 * _v14;
            let _v102 = -0.25 * ::dgd::__runtime::math::power(_v16, -1.25);
            let _v110 = 40000.0
                * (0.316
                    * ((if _v36 { _v82 } else { 0.0 }) + (if _v36 { -_v86 } else { 0.0 })
                        + (if _v38 { 0.0 } else { _v84 })) * _v102
                    + (if _v18 {
                        -(((if _v36 { _v86 } else { 0.0 })
                            + (if _v38 { _v84 } else { 0.0 })) / _v19 * _v20)
                    } else {
                        0.0
                    })) * _v49;
            let _v121 = if _v67 { if _v36 { _v61 } else { 0.0 } } else { 0.0 };
            let _v123 = if _v36 { 0.0 } else { _v121 };
            let _v124 = _v61 * _v37;
            let _v149 = 0.316
                * ((if _v36 { _v121 } else { 0.0 })
                    + (if _v36 {
                        if _v67 { if _v36 { -_v124 } else { 0.0 } } else { 0.0 }
                    } else {
                        0.0
                    }) + (if _v38 { 0.0 } else { _v123 })) * _v102
                + (if _v18 {
                    -(((if _v36 {
                        if _v67 { if _v36 { _v124 } else { 0.0 } } else { 0.0 }
                    } else {
                        0.0
                    }) + (if _v38 { _v123 } else { 0.0 })) / _v19 * _v20)
                } else {
                    0.0
                });
            *::dgd::__runtime::codegen::fixed_mut::<4>(_f) = [
                -0.0012566370614359172 * v * (1.0 / A_1),
                0.0012566370614359172 * v * (1.0 / A_2),
                _v48,
                if _v36 {
                    if _v67 {
                        _v51
                    } else {
                        (if (_v51 > 0.0) { 2.0 } else { -1.0 }) - _share_1
                    }
                } else {
                    (if ((_z[0] > 0.5) && (_z[0] < 1.5)) { 1.0 } else { 0.0 }) - _share_1
                },
            ];
            *::dgd::__runtime::codegen::fixed_mut::<10>(_jacobian) = [
                0.3924,
                if _v67 {
                    if _v36 { 15696.000000000002 * _v49 } else { 0.0 }
                } else {
                    0.0
                },
                -0.3924,
                if _v67 {
                    if _v36 { -15696.000000000002 * _v49 } else { 0.0 }
                } else {
                    0.0
                },
                -0.0012566370614359172 / A_1,
                0.0012566370614359172 / A_2,
                -12.5 * _v43 * _v97 + _v110,
                (if _v67 { if _v36 { _v59 * _v44 * _v97 } else { 0.0 } } else { 0.0 })
                    + 40000.0 * _v149 * _v49,
                if _v36 { -(_v82 * _v40) } else { 0.0 },
                (if _v67 { 0.0 } else { if _v36 { -1.0 } else { 0.0 } })
                    + (if _v36 { 0.0 } else { -1.0 })
                    + (if _v36 {
                        if _v67 { if _v36 { -_v63 } else { 0.0 } } else { 0.0 }
                    } else {
                        0.0
                    }),
            ];
            *::dgd::__runtime::codegen::fixed_mut::<4>(_dfdt) = [0.0, 0.0, 0.0, 0.0];
        }
        #[inline]
        fn sensitivity_rhs(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _s: &[f64],
            _f: &mut [f64],
            _g: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<4>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let _s = ::dgd::__runtime::codegen::fixed::<8>(_s);
            let _z = ::dgd::__runtime::codegen::fixed::<2>(_at.z);
            let A_1 = _p[0];
            let v = _y[2];
            let A_2 = _p[1];
            let h_1 = _y[0];
            let h_2 = _y[1];
            let _v14 = ::core::primitive::f64::abs(v);
            let _v16 = 40000.0 * _v14;
            let _v18 = (_v16 > 1.0);
            let _v19 = if _v18 { _v16 } else { 1.0 };
            let _v20 = 64.0 / _v19;
            let _v25 = 0.316 * ::dgd::__runtime::math::power(_v16, -0.25);
            let _v27 = v * _v14;
            let _share_1 = _y[3];
            let _v36 = (_z[0] > 1.5);
            let _v37 = 1.0 - _share_1;
            let _v38 = (_z[0] < 0.5);
            let _v40 = _v20 - _v25;
            let _v43 = if _v36 {
                _v25 + _v37 * _v40
            } else {
                if _v38 { _v20 } else { _v25 }
            };
            let _v44 = 625.0 * _v43;
            let _v48 = 0.3924 * (h_1 - h_2 - 0.0509683995922528 * (_v44 * _v27));
            let _v49 = ::dgd::__runtime::math::sign(v);
            let _v51 = 40000.0 * _v49 * _v48;
            let _v59 = -800.0 * _v49;
            let _v61 = 625.0 * (_v59 * _v27);
            let _v63 = _v61 * _v40;
            let _v67 = (::core::primitive::f64::abs(_v63) > 0.0);
            let _v73 = 1.0 / A_1;
            let _v74 = -0.0012566370614359172 * v * _v73;
            let _v75 = 1.0 / A_2;
            let _v76 = 0.0012566370614359172 * v * _v75;
            let _v77 = -0.0012566370614359172 / A_1;
            let _v78 = 0.0012566370614359172 / A_2;
            let _v82 = -12.5 * _v27;
            let _v84 = if _v36 { 0.0 } else { _v82 };
            let _v86 = _v82 * _v37;
            let _v96 = if _v36 { -(_v82 * _v40) } else { 0.0 };
            let _v97 = 2.0 * _v14;
            let _v102 = -0.25 * ::dgd::__runtime::math::power(_v16, -1.25);
            let _v110 = 40000.0
                * (0.316
                    * ((if _v36 { _v82 } else { 0.0 }) + (if _v36 { -_v86 } else { 0.0 })
                        + (if _v38 { 0.0 } else { _v84 })) * _v102
                    + (if _v18 {
                        -(((if _v36 { _v86 } else { 0.0 })
                            + (if _v38 { _v84 } else { 0.0 })) / _v19 * _v20)
                    } else {
                        0.0
                    })) * _v49;
            let _v111 = -12.5 * _v43 * _v97 + _v110;
            let _v117 = if _v67 {
                if _v36 { 15696.000000000002 * _v49 } else { 0.0 }
            } else {
                0.0
            };
            let _v119 = if _v67 {
                if _v36 { -15696.000000000002 * _v49 } else { 0.0 }
            } else {
                0.0
            };
            let _v121 = if _v67 { if _v36 { _v61 } else { 0.0 } } else { 0.0 };
            let _v123 = if _v36 { 0.0 } else { _v121 };
            let _v124 = _v61 * _v37;
            let _v139 = (if _v67 { 0.0 } else { if _v36 { -1.0 } else { 0.0 } })
                + (if _v36 { 0.0 } else { -1.0 })
                + (if _v36 {
                    if _v67 { if _v36 { -_v63 } else { 0.0 } } else { 0.0 }
                } else {
                    0.0
                });
            let _v149 = 0.316
                * ((if _v36 { _v121 } else { 0.0 })
                    + (if _v36 {
                        if _v67 { if _v36 { -_v124 } else { 0.0 } } else { 0.0 }
                    } else {
                        0.0
                    }) + (if _v38 { 0.0 } else { _v123 })) * _v102
                + (if _v18 {
                    -(((if _v36 {
                        if _v67 { if _v36 { _v124 } else { 0.0 } } else { 0.0 }
                    } else {
                        0.0
                    }) + (if _v38 { _v123 } else { 0.0 })) / _v19 * _v20)
                } else {
                    0.0
                });
            let _v152 = (if _v67 {
                if _v36 { _v59 * _v44 * _v97 } else { 0.0 }
            } else {
                0.0
            }) + 40000.0 * _v149 * _v49;
            *::dgd::__runtime::codegen::fixed_mut::<4>(_f) = [
                _v74,
                _v76,
                _v48,
                if _v36 {
                    if _v67 {
                        _v51
                    } else {
                        (if (_v51 > 0.0) { 2.0 } else { -1.0 }) - _share_1
                    }
                } else {
                    (if ((_z[0] > 0.5) && (_z[0] < 1.5)) { 1.0 } else { 0.0 }) - _share_1
                },
            ];
            *::dgd::__runtime::codegen::fixed_mut::<8>(_g) = [
                _v77 * _s[2] - _v73 * _v74,
                _v78 * _s[2],
                0.3924 * _s[0] + -0.3924 * _s[1] + _v111 * _s[2] + _v96 * _s[3],
                _v117 * _s[0] + _v119 * _s[1] + _v152 * _s[2] + _v139 * _s[3],
                _v77 * _s[6],
                _v78 * _s[6] - _v75 * _v76,
                0.3924 * _s[4] + -0.3924 * _s[5] + _v111 * _s[6] + _v96 * _s[7],
                _v117 * _s[4] + _v119 * _s[5] + _v152 * _s[6] + _v139 * _s[7],
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
            let _y = ::dgd::__runtime::codegen::fixed::<4>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let _s = ::dgd::__runtime::codegen::fixed::<8>(_s);
            let _z = ::dgd::__runtime::codegen::fixed::<2>(_at.z);
            let A_1 = _p[0];
            let v = _y[2];
            let A_2 = _p[1];
            let h_1 = _y[0];
            let h_2 = _y[1];
            let _v14 = ::core::primitive::f64::abs(v);
            let _v16 = 40000.0 * _v14;
            let _v18 = (_v16 > 1.0);
            let _v19 = if _v18 { _v16 } else { 1.0 };
            let _v20 = 64.0 / _v19;
            let _v25 = 0.316 * ::dgd::__runtime::math::power(_v16, -0.25);
            let _v27 = v * _v14;
            let _share_1 = _y[3];
            let _v36 = (_z[0] > 1.5);
            let _v37 = 1.0 - _share_1;
            let _v38 = (_z[0] < 0.5);
            let _v40 = _v20 - _v25;
            let _v43 = if _v36 {
                _v25 + _v37 * _v40
            } else {
                if _v38 { _v20 } else { _v25 }
            };
            let _v44 = 625.0 * _v43;
            let _v48 = 0.3924 * (h_1 - h_2 - 0.0509683995922528 * (_v44 * _v27));
            let _v49 = ::dgd::__runtime::math::sign(v);
            let _v50 = 40000.0 * _v49;
            let _v51 = _v50 * _v48;
            let _v59 = -800.0 * _v49;
            let _v60 = _v59 * _v27;
            let _v61 = 625.0 * _v60;
            let _v63 = _v61 * _v40;
            let _v67 = (::core::primitive::f64::abs(_v63) > 0.0);
            let _v73 = 1.0 / A_1;
            let _v74 = -0.0012566370614359172 * v * _v73;
            let _v75 = 1.0 / A_2;
            let _v76 = 0.0012566370614359172 * v * _v75;
            let _v77 = -0.0012566370614359172 / A_1;
            let _v78 = 0.0012566370614359172 / A_2;
            let _v82 = -12.5 * _v27;
            let _v84 = if _v36 { 0.0 } else { _v82 };
            let _v86 = _v82 * _v37;
            let _v96 = if _v36 { -(_v82 * _v40) } else { 0.0 };
            let _v97 = 2.0 * _v14;
            let _v99 = 0.316
                * ((if _v36 { _v82 } else { 0.0 }) + (if _v36 { -_v86 } else { 0.0 })
                    + (if _v38 { 0.0 } else { _v84 }));
            let _v102 = -0.25 * ::dgd::__runtime::math::power(_v16, -1.25);
            let _v104 = ((if _v36 { _v86 } else { 0.0 })
                + (if _v38 { _v84 } else { 0.0 })) / _v19;
            let _v111 = -12.5 * _v43 * _v97
                + 40000.0 * (_v99 * _v102 + (if _v18 { -(_v104 * _v20) } else { 0.0 }))
                    * _v49;
            let _v117 = if _v67 {
                if _v36 { 15696.000000000002 * _v49 } else { 0.0 }
            } else {
                0.0
            };
            let _v119 = if _v67 {
                if _v36 { -15696.000000000002 * _v49 } else { 0.0 }
            } else {
                0.0
            };
            let _v120 = _v59 * _v44;
            let _v121 = if _v67 { if _v36 { _v61 } else { 0.0 } } else { 0.0 };
            let _v123 = if _v36 { 0.0 } else { _v121 };
            let _v124 = _v61 * _v37;
            let _v139 = (if _v67 { 0.0 } else { if _v36 { -1.0 } else { 0.0 } })
                + (if _v36 { 0.0 } else { -1.0 })
                + (if _v36 {
                    if _v67 { if _v36 { -_v63 } else { 0.0 } } else { 0.0 }
                } else {
                    0.0
                });
            let _v143 = 0.316
                * ((if _v36 { _v121 } else { 0.0 })
                    + (if _v36 {
                        if _v67 { if _v36 { -_v124 } else { 0.0 } } else { 0.0 }
                    } else {
                        0.0
                    }) + (if _v38 { 0.0 } else { _v123 }));
            let _v145 = ((if _v36 {
                if _v67 { if _v36 { _v124 } else { 0.0 } } else { 0.0 }
            } else {
                0.0
            }) + (if _v38 { _v123 } else { 0.0 })) / _v19;
            let _v152 = (if _v67 { if _v36 { _v120 * _v97 } else { 0.0 } } else { 0.0 })
                + 40000.0 * (_v143 * _v102 + (if _v18 { -(_v145 * _v20) } else { 0.0 }))
                    * _v49;
            let _v202 = -40000.0 * _v49;
            let _v206 = _v202 * _v20 / _v19;
            let _v207 = if _v18 { _v206 } else { 0.0 };
            let _v211 = _v50 * _v102;
            let _v216 = -1.25 * ::dgd::__runtime::math::power(_v16, -2.25);
            let _v218 = 0.316 * _v211;
            let _v224 = if _v36 { _v218 } else { 0.0 };
            let _v227 = if _v36 { -0.316 * _v211 } else { 0.0 };
            let _v228 = if _v36 { _v207 } else { 0.0 };
            let _v229 = _v227 + _v228;
            let _v232 = if _v36 {
                0.0
            } else {
                (if _v38 { 0.0 } else { _v218 }) + (if _v38 { _v207 } else { 0.0 })
            };
            let _v236 = -25.0 * _v14;
            let _v238 = if _v36 { 0.0 } else { _v236 };
            let _v241 = _v236 * _v37;
            let _v243 = _v229 * _v82 + (if _v36 { _v236 * _v40 } else { 0.0 });
            let _v260 = -0.25 * (_v50 * _v99) * _v216
                + 0.316
                    * ((if _v36 { _v236 } else { 0.0 })
                        + (if _v36 { -_v241 } else { 0.0 })
                        + (if _v38 { 0.0 } else { _v238 })) * _v102
                + (if _v18 {
                    (if _v18 { -(_v206 * _v104) } else { 0.0 })
                        - ((if _v18 { _v202 * _v104 } else { 0.0 })
                            + (if _v36 { _v241 } else { 0.0 })
                            + (if _v38 { _v238 } else { 0.0 })) / _v19 * _v20
                } else {
                    0.0
                });
            let _v264 = -12.5 * (_v229 * _v37 + _v232 + _v224) * _v97
                + (-25.0 * _v43 + 40000.0 * _v260) * _v49;
            let _v265 = _v25 - _v20;
            let _v282 = 40000.0
                * ((if _v36 { -3.95 * _v27 * _v102 } else { 0.0 })
                    + (if _v18 {
                        if _v36 { -(12.5 * _v27 / _v19 * _v20) } else { 0.0 }
                    } else {
                        0.0
                    })) * _v49;
            let _v283 = (if _v36 { -12.5 * _v265 * _v97 } else { 0.0 }) + _v282;
            let _v304 = (if _v36 { if _v67 { _v227 } else { 0.0 } } else { 0.0 })
                + (if _v36 { if _v67 { _v228 } else { 0.0 } } else { 0.0 });
            let _v319 = 625.0 * (_v97 * _v59);
            let _v321 = if _v36 { if _v67 { _v319 } else { 0.0 } } else { 0.0 };
            let _v323 = if _v36 { 0.0 } else { _v321 };
            let _v328 = _v319 * _v37;
            let _v332 = _v304 * _v61
                + (if _v36 {
                    if _v36 { if _v67 { _v319 * _v40 } else { 0.0 } } else { 0.0 }
                } else {
                    0.0
                });
            let _v346 = -0.25 * (_v50 * _v143) * _v216
                + 0.316
                    * ((if _v36 { _v321 } else { 0.0 })
                        + (if _v36 {
                            if _v36 { if _v67 { -_v328 } else { 0.0 } } else { 0.0 }
                        } else {
                            0.0
                        }) + (if _v38 { 0.0 } else { _v323 })) * _v102;
            let _v350 = if _v18 {
                (if _v18 { -(_v206 * _v145) } else { 0.0 })
                    - ((if _v18 { _v202 * _v145 } else { 0.0 })
                        + (if _v36 {
                            if _v36 { if _v67 { _v328 } else { 0.0 } } else { 0.0 }
                        } else {
                            0.0
                        }) + (if _v38 { _v323 } else { 0.0 })) / _v19 * _v20
            } else {
                0.0
            };
            let _v355 = 625.0
                * (_v304 * _v37
                    + (if _v36 { if _v67 { _v232 + _v224 } else { 0.0 } } else { 0.0 }))
                * _v59 * _v97
                + ((if _v36 { if _v67 { 2.0 * _v120 } else { 0.0 } } else { 0.0 })
                    + 40000.0 * (_v346 + _v350)) * _v49;
            let _v377 = (if _v36 {
                if _v67 { if _v36 { 197.5 * _v60 * _v102 } else { 0.0 } } else { 0.0 }
            } else {
                0.0
            })
                + (if _v18 {
                    if _v36 {
                        if _v67 {
                            if _v36 { -(-625.0 * _v60 / _v19 * _v20) } else { 0.0 }
                        } else {
                            0.0
                        }
                    } else {
                        0.0
                    }
                } else {
                    0.0
                });
            let _v380 = (if _v36 {
                if _v67 {
                    if _v36 { 625.0 * _v265 * _v59 * _v97 } else { 0.0 }
                } else {
                    0.0
                }
            } else {
                0.0
            }) + 40000.0 * _v377 * _v49;
            *::dgd::__runtime::codegen::fixed_mut::<4>(_f) = [
                _v74,
                _v76,
                _v48,
                if _v36 {
                    if _v67 {
                        _v51
                    } else {
                        (if (_v51 > 0.0) { 2.0 } else { -1.0 }) - _share_1
                    }
                } else {
                    (if ((_z[0] > 0.5) && (_z[0] < 1.5)) { 1.0 } else { 0.0 }) - _share_1
                },
            ];
            *::dgd::__runtime::codegen::fixed_mut::<10>(_jacobian) = [
                0.3924,
                _v117,
                -0.3924,
                _v119,
                _v77,
                _v78,
                _v111,
                _v152,
                _v96,
                _v139,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<4>(_dfdt) = [0.0, 0.0, 0.0, 0.0];
            *::dgd::__runtime::codegen::fixed_mut::<8>(_g) = [
                _v77 * _s[2] - _v73 * _v74,
                _v78 * _s[2],
                0.3924 * _s[0] + -0.3924 * _s[1] + _v111 * _s[2] + _v96 * _s[3],
                _v117 * _s[0] + _v119 * _s[1] + _v152 * _s[2] + _v139 * _s[3],
                _v77 * _s[6],
                _v78 * _s[6] - _v75 * _v76,
                0.3924 * _s[4] + -0.3924 * _s[5] + _v111 * _s[6] + _v96 * _s[7],
                _v117 * _s[4] + _v119 * _s[5] + _v152 * _s[6] + _v139 * _s[7],
            ];
            *::dgd::__runtime::codegen::fixed_mut::<10>(_dgdy) = [
                0.0012566370614359172 * (_v73 / A_1),
                _v264 * _s[2] + _v283 * _s[3],
                _v355 * _s[2] + _v380 * _s[3],
                -0.0012566370614359172 * (_v75 / A_2),
                _v264 * _s[6] + _v283 * _s[7],
                _v355 * _s[6] + _v380 * _s[7],
                -(_v243 * _s[2]),
                -(_v332 * _s[2]),
                -(_v243 * _s[6]),
                -(_v332 * _s[6]),
            ];
            *::dgd::__runtime::codegen::fixed_mut::<8>(_dgdt) = [
                0.0,
                0.0,
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
            let _y = ::dgd::__runtime::codegen::fixed::<4>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let A_1 = _p[0];
            let v = _y[2];
            let A_2 = _p[1];
            let _v8 = 1.0 / A_1;
            let _v10 = 1.0 / A_2;
            *::dgd::__runtime::codegen::fixed_mut::<2>(_values) = [
                -(_v8 * (-0.0012566370614359172 * v * _v8)),
                -(_v10 * (0.0012566370614359172 * v * _v10)),
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
            *::dgd::__runtime::codegen::fixed_mut::<4>(_values) = [0.0, 0.0, 0.0, 0.0];
        }
        #[inline]
        fn outputs(&self, _at: ::dgd::__runtime::Point<'_>, _w: &mut [f64]) {
            let _y = ::dgd::__runtime::codegen::fixed::<4>(_at.y);
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
            let _y = ::dgd::__runtime::codegen::fixed::<4>(_at.y);
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
            let _y = ::dgd::__runtime::codegen::fixed::<4>(_at.y);
            let _s = ::dgd::__runtime::codegen::fixed::<8>(_s);
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
                0.0012566370614359172 * _s[6],
                _v20 * _s[4] + _v21 * _s[5],
            ];
        }
        #[inline]
        fn start(&self, _at: ::dgd::__runtime::Point<'_>, _y0: &mut [f64]) {
            *::dgd::__runtime::codegen::fixed_mut::<4>(_y0) = [2.0, 0.5, 0.0, 0.5];
        }
        #[inline]
        fn start_sensitivities(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _s0: &mut [f64],
        ) {
            *::dgd::__runtime::codegen::fixed_mut::<8>(_s0) = [
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
            ];
        }
        #[inline]
        fn mass(&self, _at: ::dgd::__runtime::Point<'_>, _mass: &mut [f64]) {
            *::dgd::__runtime::codegen::fixed_mut::<4>(_mass) = [1.0, 1.0, 1.0, 0.0];
        }
        #[inline]
        fn event_functions(&self, _at: ::dgd::__runtime::Point<'_>, _e: &mut [f64]) {
            let _y = ::dgd::__runtime::codegen::fixed::<4>(_at.y);
            let _z = ::dgd::__runtime::codegen::fixed::<2>(_at.z);
            let v = _y[2];
            let h_1 = _y[0];
            let h_2 = _y[1];
            let _v6 = ::core::primitive::f64::abs(v);
            let _v8 = 40000.0 * _v6;
            let _v13 = 64.0 / (if (_v8 > 1.0) { _v8 } else { 1.0 });
            let _v17 = 0.316 * ::dgd::__runtime::math::power(_v8, -0.25);
            let _v22 = _v8 - 2300.0;
            let _v23 = _v8 - 1.0;
            let _share_1 = _y[3];
            let _v39 = 0.3924
                * (h_1 - h_2
                    - 0.0509683995922528
                        * (625.0
                            * (if (_z[0] > 1.5) {
                                _v17 + (1.0 - _share_1) * (_v13 - _v17)
                            } else {
                                if (_z[0] < 0.5) { _v13 } else { _v17 }
                            }) * (v * _v6)));
            let _v42 = 40000.0 * ::dgd::__runtime::math::sign(v) * _v39;
            *::dgd::__runtime::codegen::fixed_mut::<8>(_e) = [
                _v22,
                _v22,
                _v42,
                _v42,
                _share_1 - 1.0,
                _share_1,
                _v23,
                _v23,
            ];
        }
        #[inline]
        fn event_sensitivities(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _udot: &[f64],
            _s: &[f64],
            _de: &mut [f64],
            _dedy: &mut [f64],
            _dedt: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<4>(_at.y);
            let _s = ::dgd::__runtime::codegen::fixed::<8>(_s);
            let _z = ::dgd::__runtime::codegen::fixed::<2>(_at.z);
            let v = _y[2];
            let _v5 = ::core::primitive::f64::abs(v);
            let _v7 = 40000.0 * _v5;
            let _v9 = (_v7 > 1.0);
            let _v10 = if _v9 { _v7 } else { 1.0 };
            let _v11 = 64.0 / _v10;
            let _v15 = 0.316 * ::dgd::__runtime::math::power(_v7, -0.25);
            let _share_1 = _y[3];
            let _v21 = (_z[0] > 1.5);
            let _v22 = 1.0 - _share_1;
            let _v23 = (_z[0] < 0.5);
            let _v25 = _v11 - _v15;
            let _v30 = ::dgd::__runtime::math::sign(v);
            let _v31 = 40000.0 * _v30;
            let _v33 = 15696.000000000002 * _v30;
            let _v35 = -15696.000000000002 * _v30;
            let _v37 = -800.0 * _v30;
            let _v39 = 625.0 * (_v37 * (v * _v5));
            let _v43 = if _v21 { -(_v39 * _v25) } else { 0.0 };
            let _v49 = _v39 * _v22;
            let _v62 = _v31 * _s[2];
            let _v63 = _v31 * _s[6];
            let _v64 = if _v21 { 0.0 } else { _v39 };
            let _v78 = 40000.0
                * (0.316
                    * ((if _v21 { _v39 } else { 0.0 }) + (if _v21 { -_v49 } else { 0.0 })
                        + (if _v23 { 0.0 } else { _v64 }))
                    * (-0.25 * ::dgd::__runtime::math::power(_v7, -1.25))
                    + (if _v9 {
                        -(((if _v21 { _v49 } else { 0.0 })
                            + (if _v23 { _v64 } else { 0.0 })) / _v10 * _v11)
                    } else {
                        0.0
                    })) * _v30;
            let _v79 = _v37
                * (625.0
                    * (if _v21 {
                        _v15 + _v22 * _v25
                    } else {
                        if _v23 { _v11 } else { _v15 }
                    })) * (2.0 * _v5) + _v78;
            let _v86 = _v33 * _s[0] + _v35 * _s[1] + _v79 * _s[2] + _v43 * _s[3];
            let _v93 = _v33 * _s[4] + _v35 * _s[5] + _v79 * _s[6] + _v43 * _s[7];
            *::dgd::__runtime::codegen::fixed_mut::<16>(_de) = [
                _v62,
                _v62,
                _v86,
                _v86,
                _s[3],
                _s[3],
                _v62,
                _v62,
                _v63,
                _v63,
                _v93,
                _v93,
                _s[7],
                _s[7],
                _v63,
                _v63,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<14>(_dedy) = [
                _v33,
                _v33,
                _v35,
                _v35,
                _v31,
                _v31,
                _v79,
                _v79,
                _v31,
                _v31,
                _v43,
                _v43,
                1.0,
                1.0,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<8>(_dedt) = [
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
            ];
        }
        #[inline]
        fn resets(&self, _at: ::dgd::__runtime::Point<'_>, _r: &mut [f64]) {
            *::dgd::__runtime::codegen::fixed_mut::<0>(_r) = [];
        }
        #[inline]
        fn reset_sensitivities(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _udot: &[f64],
            _s: &[f64],
            _dr: &mut [f64],
            _drdy: &mut [f64],
            _drdt: &mut [f64],
        ) {
            *::dgd::__runtime::codegen::fixed_mut::<0>(_dr) = [];
            *::dgd::__runtime::codegen::fixed_mut::<0>(_drdy) = [];
            *::dgd::__runtime::codegen::fixed_mut::<0>(_drdt) = [];
        }
        #[inline]
        fn taylor_series(
            &self,
        ) -> ::core::result::Result<
            ::dgd::__runtime::taylor::KeptSeries,
            ::dgd::__runtime::taylor::NoTaylor,
        > {
            ::core::result::Result::Err(::dgd::__runtime::taylor::NoTaylor::Algebraic)
        }
    }
}
