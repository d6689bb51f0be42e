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
        /// How much of the side above acts, while it slides, of switch 40000*abs(v) - 2300 at 0.
        ///
        /// [1]
        pub _share_1: f64,
        /// How much of the side above acts, while it slides, of switch 40000*abs(v) - 1 at 0.
        ///
        /// [1]
        pub _share_2: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Unknowns {
        fn default() -> Self {
            Unknowns {
                h_1: 0.0,
                h_2: 0.0,
                v: 0.0,
                _share_1: 0.0,
                _share_2: 0.0,
            }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Unknowns> for [f64; 5] {
        fn from(named: Unknowns) -> [f64; 5] {
            [named.h_1, named.h_2, named.v, named._share_1, named._share_2]
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 5]> for Unknowns {
        fn from([h_1, h_2, v, _share_1, _share_2]: [f64; 5]) -> Unknowns {
            Unknowns {
                h_1,
                h_2,
                v,
                _share_1,
                _share_2,
            }
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
                ::dgd::__runtime::system::Unknown {
                    name: Text::Borrowed("share(1)"),
                    unit: ::dgd::__runtime::system::Unit {
                        symbol: Text::Borrowed("1"),
                        factor: 1.0,
                        offset: 0.0,
                    },
                    nominal: ::core::option::Option::Some(1.0),
                    differential: false,
                },
                ::dgd::__runtime::system::Unknown {
                    name: Text::Borrowed("share(2)"),
                    unit: ::dgd::__runtime::system::Unit {
                        symbol: Text::Borrowed("1"),
                        factor: 1.0,
                        offset: 0.0,
                    },
                    nominal: ::core::option::Option::Some(1.0),
                    differential: false,
                },
            ],
        ),
        equations: List::Borrowed(
            &[
                Text::Borrowed("upper"),
                Text::Borrowed("lower"),
                Text::Borrowed("pipe"),
                Text::Borrowed("switch 40000*abs(v) - 2300 at 0"),
                Text::Borrowed("switch 40000*abs(v) - 1 at 0"),
            ],
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
        delayed_inputs: List::Borrowed(&[]),
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
            rows: List::Borrowed(&[2, 3, 4, 2, 3, 4, 0, 1, 2, 3, 4, 2, 3, 4, 2, 3, 4]),
            columns: List::Borrowed(&[0, 0, 0, 1, 1, 1, 2, 2, 2, 2, 2, 3, 3, 3, 4, 4, 4]),
        },
        sensitivity_jacobian: ::dgd::__runtime::system::Pattern {
            rows: List::Borrowed(
                &[0, 2, 3, 4, 6, 7, 8, 9, 2, 3, 4, 7, 8, 9, 2, 3, 4, 7, 8, 9],
            ),
            columns: List::Borrowed(
                &[2, 2, 2, 2, 2, 2, 2, 2, 3, 3, 3, 3, 3, 3, 4, 4, 4, 4, 4, 4],
            ),
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
        discrete: ::dgd::__runtime::system::Discrete {
            automata: List::Borrowed(
                &[
                    ::dgd::__runtime::system::Automaton {
                        kind: ::dgd::__runtime::system::AutomatonKind::Switch,
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
                                ::dgd::__runtime::system::Transition {
                                    from: 0,
                                    to: 1,
                                    crossing: ::dgd::__runtime::system::Crossing::Rises,
                                    trigger: ::dgd::__runtime::system::Trigger::Level,
                                    resets: List::Borrowed(&[]),
                                },
                                ::dgd::__runtime::system::Transition {
                                    from: 1,
                                    to: 0,
                                    crossing: ::dgd::__runtime::system::Crossing::Falls,
                                    trigger: ::dgd::__runtime::system::Trigger::Level,
                                    resets: List::Borrowed(&[]),
                                },
                                ::dgd::__runtime::system::Transition {
                                    from: 1,
                                    to: 2,
                                    crossing: ::dgd::__runtime::system::Crossing::Falls,
                                    trigger: ::dgd::__runtime::system::Trigger::Entry,
                                    resets: List::Borrowed(&[]),
                                },
                                ::dgd::__runtime::system::Transition {
                                    from: 0,
                                    to: 2,
                                    crossing: ::dgd::__runtime::system::Crossing::Rises,
                                    trigger: ::dgd::__runtime::system::Trigger::Entry,
                                    resets: List::Borrowed(&[]),
                                },
                                ::dgd::__runtime::system::Transition {
                                    from: 2,
                                    to: 1,
                                    crossing: ::dgd::__runtime::system::Crossing::Rises,
                                    trigger: ::dgd::__runtime::system::Trigger::Level,
                                    resets: List::Borrowed(&[]),
                                },
                                ::dgd::__runtime::system::Transition {
                                    from: 2,
                                    to: 0,
                                    crossing: ::dgd::__runtime::system::Crossing::Falls,
                                    trigger: ::dgd::__runtime::system::Trigger::Level,
                                    resets: List::Borrowed(&[]),
                                },
                            ],
                        ),
                    },
                    ::dgd::__runtime::system::Automaton {
                        kind: ::dgd::__runtime::system::AutomatonKind::Switch,
                        name: Text::Borrowed("switch 40000*abs(v) - 1 at 0"),
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
                                ::dgd::__runtime::system::Transition {
                                    from: 0,
                                    to: 1,
                                    crossing: ::dgd::__runtime::system::Crossing::Rises,
                                    trigger: ::dgd::__runtime::system::Trigger::Level,
                                    resets: List::Borrowed(&[]),
                                },
                                ::dgd::__runtime::system::Transition {
                                    from: 1,
                                    to: 0,
                                    crossing: ::dgd::__runtime::system::Crossing::Falls,
                                    trigger: ::dgd::__runtime::system::Trigger::Level,
                                    resets: List::Borrowed(&[]),
                                },
                                ::dgd::__runtime::system::Transition {
                                    from: 1,
                                    to: 2,
                                    crossing: ::dgd::__runtime::system::Crossing::Falls,
                                    trigger: ::dgd::__runtime::system::Trigger::Entry,
                                    resets: List::Borrowed(&[]),
                                },
                                ::dgd::__runtime::system::Transition {
                                    from: 0,
                                    to: 2,
                                    crossing: ::dgd::__runtime::system::Crossing::Rises,
                                    trigger: ::dgd::__runtime::system::Trigger::Entry,
                                    resets: List::Borrowed(&[]),
                                },
                                ::dgd::__runtime::system::Transition {
                                    from: 2,
                                    to: 1,
                                    crossing: ::dgd::__runtime::system::Crossing::Rises,
                                    trigger: ::dgd::__runtime::system::Trigger::Level,
                                    resets: List::Borrowed(&[]),
                                },
                                ::dgd::__runtime::system::Transition {
                                    from: 2,
                                    to: 0,
                                    crossing: ::dgd::__runtime::system::Crossing::Falls,
                                    trigger: ::dgd::__runtime::system::Trigger::Level,
                                    resets: List::Borrowed(&[]),
                                },
                            ],
                        ),
                    },
                ],
            ),
            n_time_conditions: 0,
            event_jacobian: ::dgd::__runtime::system::Pattern {
                rows: List::Borrowed(
                    &[
                        2, 3, 8, 9, 2, 3, 8, 9, 0, 1, 2, 3, 6, 7, 8, 9, 2, 3, 4, 5, 8, 9,
                        2, 3, 8, 9, 10, 11,
                    ],
                ),
                columns: List::Borrowed(
                    &[
                        0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 2, 2, 2, 2, 3, 3, 3, 3, 3, 3,
                        4, 4, 4, 4, 4, 4,
                    ],
                ),
            },
            reset_jacobian: ::dgd::__runtime::system::Pattern {
                rows: List::Borrowed(&[]),
                columns: List::Borrowed(&[]),
            },
        },
    };
    #[automatically_derived]
    impl ::dgd::__runtime::System for Model {
        type Vector = [f64; 5];
        type Sensitivity = [f64; 10];
        type Inputs = [f64; 0];
        type Jacobian = [f64; 17];
        type SensitivityJacobian = [f64; 20];
        type Factorisation = ::dgd::__runtime::linalg::FixedLu<5>;
        #[inline]
        fn signature(&self) -> &::dgd::__runtime::Signature {
            &SIGNATURE
        }
        #[inline]
        fn rhs(&self, _at: ::dgd::__runtime::Point<'_>, _f: &mut [f64]) {
            let _y = ::dgd::__runtime::codegen::fixed::<5>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let _z = ::dgd::__runtime::codegen::fixed::<2>(_at.z);
            let A_1 = _p[0];
            let v = _y[2];
            let A_2 = _p[1];
            let h_1 = _y[0];
            let h_2 = _y[1];
            let _v13 = ::core::primitive::f64::abs(v);
            let _v15 = 40000.0 * _v13;
            let _v20 = 0.316 * ::dgd::__runtime::math::power(_v15, -0.25);
            let _share_1 = _y[3];
            let _share_2 = _y[4];
            let _v36 = (_z[0] > 1.5);
            let _v41 = ((_z[1] > 0.5) && (_z[1] < 1.5));
            let _v42 = (_z[1] > 1.5);
            let _v47 = 64.0
                / (if _v42 {
                    1.0 + _share_2 * (_v15 - 1.0)
                } else {
                    if _v41 { _v15 } else { 1.0 }
                });
            let _v57 = 0.3924
                * (h_1 - h_2
                    - 0.0509683995922528
                        * (625.0
                            * (if _v36 {
                                _v20 + (1.0 - _share_1) * (_v47 - _v20)
                            } else {
                                if (_z[0] < 0.5) { _v47 } else { _v20 }
                            }) * (v * _v13)));
            let _v60 = 40000.0 * ::dgd::__runtime::math::sign(v) * _v57;
            /// `upper` (model.dgd:21): der(h_1) =
            let _row_0: f64 = -0.0012566370614359172 * v / A_1;
            /// `lower` (model.dgd:22): der(h_2) =
            let _row_1: f64 = 0.0012566370614359172 * v / A_2;
            /// `pipe` (model.dgd:23): der(v) =
            let _row_2: f64 = _v57;
            /// `switch 40000*abs(v) - 2300 at 0` (model.dgd:21): 0 =
            let _row_3: f64 = if _v36 {
                _v60
            } else {
                (if ((_z[0] > 0.5) && (_z[0] < 1.5)) { 1.0 } else { 0.0 }) - _share_1
            };
            /// `switch 40000*abs(v) - 1 at 0` (model.dgd:21): 0 =
            let _row_4: f64 = if _v42 {
                _v60
            } else {
                (if _v41 { 1.0 } else { 0.0 }) - _share_2
            };
            *::dgd::__runtime::codegen::fixed_mut::<5>(_f) = [
                _row_0,
                _row_1,
                _row_2,
                _row_3,
                _row_4,
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
            let _y = ::dgd::__runtime::codegen::fixed::<5>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let _z = ::dgd::__runtime::codegen::fixed::<2>(_at.z);
            let A_1 = _p[0];
            let v = _y[2];
            let A_2 = _p[1];
            let h_1 = _y[0];
            let h_2 = _y[1];
            let _v14 = ::core::primitive::f64::abs(v);
            let _v16 = 40000.0 * _v14;
            let _v21 = 0.316 * ::dgd::__runtime::math::power(_v16, -0.25);
            let _v23 = v * _v14;
            let _v28 = _v16 - 1.0;
            let _share_1 = _y[3];
            let _share_2 = _y[4];
            let _v37 = (_z[0] > 1.5);
            let _v38 = 1.0 - _share_1;
            let _v39 = (_z[0] < 0.5);
            let _v42 = ((_z[1] > 0.5) && (_z[1] < 1.5));
            let _v43 = (_z[1] > 1.5);
            let _v47 = if _v43 {
                1.0 + _share_2 * _v28
            } else {
                if _v42 { _v16 } else { 1.0 }
            };
            let _v48 = 64.0 / _v47;
            let _v50 = _v48 - _v21;
            let _v53 = if _v37 {
                _v21 + _v38 * _v50
            } else {
                if _v39 { _v48 } else { _v21 }
            };
            let _v54 = 625.0 * _v53;
            let _v58 = 0.3924 * (h_1 - h_2 - 0.0509683995922528 * (_v54 * _v23));
            let _v59 = ::dgd::__runtime::math::sign(v);
            let _v60 = 40000.0 * _v59;
            let _v61 = _v60 * _v58;
            let _v74 = -12.5 * _v23;
            let _v75 = if _v37 { _v74 } else { 0.0 };
            let _v76 = if _v37 { 0.0 } else { _v74 };
            let _v78 = _v75 * _v38;
            let _v86 = -((_v78 + (if _v39 { _v76 } else { 0.0 })) / _v47 * _v48);
            let _v87 = if _v43 { _v86 } else { 0.0 };
            let _v94 = 2.0 * _v14;
            let _v99 = -0.25 * ::dgd::__runtime::math::power(_v16, -1.25);
            let _v108 = (if _v37 { 1.0 } else { 0.0 }) * _v60;
            let _v111 = -0.02 * _v108;
            let _v114 = 625.0 * (_v111 * _v23);
            let _v115 = if _v37 { _v114 } else { 0.0 };
            let _v116 = if _v37 { 0.0 } else { _v114 };
            let _v118 = _v115 * _v38;
            let _v126 = -((_v118 + (if _v39 { _v116 } else { 0.0 })) / _v47 * _v48);
            let _v127 = if _v43 { _v126 } else { 0.0 };
            let _v143 = (if _v43 { 1.0 } else { 0.0 }) * _v60;
            let _v146 = -0.02 * _v143;
            let _v149 = 625.0 * (_v146 * _v23);
            let _v150 = if _v37 { _v149 } else { 0.0 };
            let _v151 = if _v37 { 0.0 } else { _v149 };
            let _v153 = _v150 * _v38;
            let _v161 = -((_v153 + (if _v39 { _v151 } else { 0.0 })) / _v47 * _v48);
            let _v162 = if _v43 { _v161 } else { 0.0 };
            *::dgd::__runtime::codegen::fixed_mut::<5>(_f) = [
                -0.0012566370614359172 * v / A_1,
                0.0012566370614359172 * v / A_2,
                _v58,
                if _v37 {
                    _v61
                } else {
                    (if ((_z[0] > 0.5) && (_z[0] < 1.5)) { 1.0 } else { 0.0 }) - _share_1
                },
                if _v43 { _v61 } else { (if _v42 { 1.0 } else { 0.0 }) - _share_2 },
            ];
            *::dgd::__runtime::codegen::fixed_mut::<17>(_jacobian) = [
                0.3924,
                0.3924 * _v108,
                0.3924 * _v143,
                -0.3924,
                -0.3924 * _v108,
                -0.3924 * _v143,
                -0.0012566370614359172 / A_1,
                0.0012566370614359172 / A_2,
                -12.5 * _v53 * _v94
                    + 40000.0
                        * ((if _v42 { if _v43 { 0.0 } else { _v86 } } else { 0.0 })
                            + _v87 * _share_2
                            + 0.316 * (_v75 - _v78 + (if _v39 { 0.0 } else { _v76 }))
                                * _v99) * _v59,
                _v111 * _v54 * _v94
                    + 40000.0
                        * ((if _v42 { if _v43 { 0.0 } else { _v126 } } else { 0.0 })
                            + _v127 * _share_2
                            + 0.316 * (_v115 - _v118 + (if _v39 { 0.0 } else { _v116 }))
                                * _v99) * _v59,
                _v146 * _v54 * _v94
                    + 40000.0
                        * ((if _v42 { if _v43 { 0.0 } else { _v161 } } else { 0.0 })
                            + _v162 * _share_2
                            + 0.316 * (_v150 - _v153 + (if _v39 { 0.0 } else { _v151 }))
                                * _v99) * _v59,
                -(_v75 * _v50),
                -(if _v37 { 0.0 } else { 1.0 }) - _v115 * _v50,
                -(_v150 * _v50),
                _v87 * _v28,
                _v127 * _v28,
                _v162 * _v28 - (if _v43 { 0.0 } else { 1.0 }),
            ];
            *::dgd::__runtime::codegen::fixed_mut::<5>(_dfdt) = [
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
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
            let _y = ::dgd::__runtime::codegen::fixed::<5>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let _s = ::dgd::__runtime::codegen::fixed::<10>(_s);
            let _z = ::dgd::__runtime::codegen::fixed::<2>(_at.z);
            let A_1 = _p[0];
            let v = _y[2];
            let A_2 = _p[1];
            let h_1 = _y[0];
            let h_2 = _y[1];
            let _v14 = ::core::primitive::f64::abs(v);
            let _v16 = 40000.0 * _v14;
            let _v21 = 0.316 * ::dgd::__runtime::math::power(_v16, -0.25);
            let _v23 = v * _v14;
            let _v25 = -0.0012566370614359172 * v / A_1;
            let _v26 = 0.0012566370614359172 * v / A_2;
            let _v28 = _v16 - 1.0;
            let _share_1 = _y[3];
            let _share_2 = _y[4];
            let _v37 = (_z[0] > 1.5);
            let _v38 = 1.0 - _share_1;
            let _v39 = (_z[0] < 0.5);
            let _v42 = ((_z[1] > 0.5) && (_z[1] < 1.5));
            let _v43 = (_z[1] > 1.5);
            let _v47 = if _v43 {
                1.0 + _share_2 * _v28
            } else {
                if _v42 { _v16 } else { 1.0 }
            };
            let _v48 = 64.0 / _v47;
            let _v50 = _v48 - _v21;
            let _v53 = if _v37 {
                _v21 + _v38 * _v50
            } else {
                if _v39 { _v48 } else { _v21 }
            };
            let _v54 = 625.0 * _v53;
            let _v58 = 0.3924 * (h_1 - h_2 - 0.0509683995922528 * (_v54 * _v23));
            let _v59 = ::dgd::__runtime::math::sign(v);
            let _v60 = 40000.0 * _v59;
            let _v61 = _v60 * _v58;
            let _v69 = -0.0012566370614359172 / A_1;
            let _v71 = 0.0012566370614359172 / A_2;
            let _v76 = -12.5 * _v23;
            let _v77 = if _v37 { _v76 } else { 0.0 };
            let _v78 = if _v37 { 0.0 } else { _v76 };
            let _v79 = _v77 * _v50;
            let _v80 = _v77 * _v38;
            let _v88 = -((_v80 + (if _v39 { _v78 } else { 0.0 })) / _v47 * _v48);
            let _v89 = if _v43 { _v88 } else { 0.0 };
            let _v91 = _v89 * _v28;
            let _v95 = 2.0 * _v14;
            let _v100 = -0.25 * ::dgd::__runtime::math::power(_v16, -1.25);
            let _v105 = -12.5 * _v53 * _v95
                + 40000.0
                    * ((if _v42 { if _v43 { 0.0 } else { _v88 } } else { 0.0 })
                        + _v89 * _share_2
                        + 0.316 * (_v77 - _v80 + (if _v39 { 0.0 } else { _v78 }))
                            * _v100) * _v59;
            let _v109 = (if _v37 { 1.0 } else { 0.0 }) * _v60;
            let _v110 = 0.3924 * _v109;
            let _v111 = -0.3924 * _v109;
            let _v112 = -0.02 * _v109;
            let _v115 = 625.0 * (_v112 * _v23);
            let _v116 = if _v37 { _v115 } else { 0.0 };
            let _v117 = if _v37 { 0.0 } else { _v115 };
            let _v119 = _v116 * _v38;
            let _v127 = -((_v119 + (if _v39 { _v117 } else { 0.0 })) / _v47 * _v48);
            let _v128 = if _v43 { _v127 } else { 0.0 };
            let _v130 = _v128 * _v28;
            let _v133 = -(if _v37 { 0.0 } else { 1.0 }) - _v116 * _v50;
            let _v141 = _v112 * _v54 * _v95
                + 40000.0
                    * ((if _v42 { if _v43 { 0.0 } else { _v127 } } else { 0.0 })
                        + _v128 * _share_2
                        + 0.316 * (_v116 - _v119 + (if _v39 { 0.0 } else { _v117 }))
                            * _v100) * _v59;
            let _v144 = (if _v43 { 1.0 } else { 0.0 }) * _v60;
            let _v145 = 0.3924 * _v144;
            let _v146 = -0.3924 * _v144;
            let _v147 = -0.02 * _v144;
            let _v150 = 625.0 * (_v147 * _v23);
            let _v151 = if _v37 { _v150 } else { 0.0 };
            let _v152 = if _v37 { 0.0 } else { _v150 };
            let _v153 = _v151 * _v50;
            let _v154 = _v151 * _v38;
            let _v162 = -((_v154 + (if _v39 { _v152 } else { 0.0 })) / _v47 * _v48);
            let _v163 = if _v43 { _v162 } else { 0.0 };
            let _v167 = _v163 * _v28 - (if _v43 { 0.0 } else { 1.0 });
            let _v176 = _v147 * _v54 * _v95
                + 40000.0
                    * ((if _v42 { if _v43 { 0.0 } else { _v162 } } else { 0.0 })
                        + _v163 * _share_2
                        + 0.316 * (_v151 - _v154 + (if _v39 { 0.0 } else { _v152 }))
                            * _v100) * _v59;
            *::dgd::__runtime::codegen::fixed_mut::<5>(_f) = [
                _v25,
                _v26,
                _v58,
                if _v37 {
                    _v61
                } else {
                    (if ((_z[0] > 0.5) && (_z[0] < 1.5)) { 1.0 } else { 0.0 }) - _share_1
                },
                if _v43 { _v61 } else { (if _v42 { 1.0 } else { 0.0 }) - _share_2 },
            ];
            *::dgd::__runtime::codegen::fixed_mut::<10>(_g) = [
                _v69 * _s[2] - 1.0 / A_1 * _v25,
                _v71 * _s[2],
                0.3924 * _s[0] + -0.3924 * _s[1] + _v105 * _s[2] - _v79 * _s[3]
                    + _v91 * _s[4],
                _v110 * _s[0] + _v111 * _s[1] + _v141 * _s[2] + _v133 * _s[3]
                    + _v130 * _s[4],
                _v145 * _s[0] + _v146 * _s[1] + _v176 * _s[2] - _v153 * _s[3]
                    + _v167 * _s[4],
                _v69 * _s[7],
                _v71 * _s[7] - 1.0 / A_2 * _v26,
                0.3924 * _s[5] + -0.3924 * _s[6] + _v105 * _s[7] - _v79 * _s[8]
                    + _v91 * _s[9],
                _v110 * _s[5] + _v111 * _s[6] + _v141 * _s[7] + _v133 * _s[8]
                    + _v130 * _s[9],
                _v145 * _s[5] + _v146 * _s[6] + _v176 * _s[7] - _v153 * _s[8]
                    + _v167 * _s[9],
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
            let _y = ::dgd::__runtime::codegen::fixed::<5>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let _s = ::dgd::__runtime::codegen::fixed::<10>(_s);
            let _z = ::dgd::__runtime::codegen::fixed::<2>(_at.z);
            let A_1 = _p[0];
            let v = _y[2];
            let A_2 = _p[1];
            let h_1 = _y[0];
            let h_2 = _y[1];
            let _v14 = ::core::primitive::f64::abs(v);
            let _v16 = 40000.0 * _v14;
            let _v21 = 0.316 * ::dgd::__runtime::math::power(_v16, -0.25);
            let _v23 = v * _v14;
            let _v25 = -0.0012566370614359172 * v / A_1;
            let _v26 = 0.0012566370614359172 * v / A_2;
            let _v28 = _v16 - 1.0;
            let _share_1 = _y[3];
            let _share_2 = _y[4];
            let _v37 = (_z[0] > 1.5);
            let _v38 = 1.0 - _share_1;
            let _v39 = (_z[0] < 0.5);
            let _v42 = ((_z[1] > 0.5) && (_z[1] < 1.5));
            let _v43 = (_z[1] > 1.5);
            let _v47 = if _v43 {
                1.0 + _share_2 * _v28
            } else {
                if _v42 { _v16 } else { 1.0 }
            };
            let _v48 = 64.0 / _v47;
            let _v50 = _v48 - _v21;
            let _v53 = if _v37 {
                _v21 + _v38 * _v50
            } else {
                if _v39 { _v48 } else { _v21 }
            };
            let _v54 = 625.0 * _v53;
            let _v58 = 0.3924 * (h_1 - h_2 - 0.0509683995922528 * (_v54 * _v23));
            let _v59 = ::dgd::__runtime::math::sign(v);
            let _v60 = 40000.0 * _v59;
            let _v61 = _v60 * _v58;
            let _v68 = 1.0 / A_1;
            let _v69 = -0.0012566370614359172 / A_1;
            let _v70 = 1.0 / A_2;
            let _v71 = 0.0012566370614359172 / A_2;
            let _v76 = -12.5 * _v23;
            let _v77 = if _v37 { _v76 } else { 0.0 };
            let _v78 = if _v37 { 0.0 } else { _v76 };
            let _v79 = _v77 * _v50;
            let _v80 = _v77 * _v38;
            let _v86 = (_v80 + (if _v39 { _v78 } else { 0.0 })) / _v47;
            let _v88 = -(_v86 * _v48);
            let _v89 = if _v43 { _v88 } else { 0.0 };
            let _v91 = _v89 * _v28;
            let _v96 = 2.0 * _v14;
            let _v98 = 0.316 * (_v77 - _v80 + (if _v39 { 0.0 } else { _v78 }));
            let _v101 = -0.25 * ::dgd::__runtime::math::power(_v16, -1.25);
            let _v106 = -12.5 * _v53 * _v96
                + 40000.0
                    * ((if _v42 { if _v43 { 0.0 } else { _v88 } } else { 0.0 })
                        + _v89 * _share_2 + _v98 * _v101) * _v59;
            let _v110 = (if _v37 { 1.0 } else { 0.0 }) * _v60;
            let _v111 = 0.3924 * _v110;
            let _v112 = -0.3924 * _v110;
            let _v113 = -0.02 * _v110;
            let _v115 = _v113 * _v54;
            let _v116 = 625.0 * (_v113 * _v23);
            let _v117 = if _v37 { _v116 } else { 0.0 };
            let _v118 = if _v37 { 0.0 } else { _v116 };
            let _v120 = _v117 * _v38;
            let _v126 = (_v120 + (if _v39 { _v118 } else { 0.0 })) / _v47;
            let _v128 = -(_v126 * _v48);
            let _v129 = if _v43 { _v128 } else { 0.0 };
            let _v131 = _v129 * _v28;
            let _v134 = -(if _v37 { 0.0 } else { 1.0 }) - _v117 * _v50;
            let _v137 = 0.316 * (_v117 - _v120 + (if _v39 { 0.0 } else { _v118 }));
            let _v142 = _v115 * _v96
                + 40000.0
                    * ((if _v42 { if _v43 { 0.0 } else { _v128 } } else { 0.0 })
                        + _v129 * _share_2 + _v137 * _v101) * _v59;
            let _v145 = (if _v43 { 1.0 } else { 0.0 }) * _v60;
            let _v146 = 0.3924 * _v145;
            let _v147 = -0.3924 * _v145;
            let _v148 = -0.02 * _v145;
            let _v150 = _v148 * _v54;
            let _v151 = 625.0 * (_v148 * _v23);
            let _v152 = if _v37 { _v151 } else { 0.0 };
            let _v153 = if _v37 { 0.0 } else { _v151 };
            let _v154 = _v152 * _v50;
            let _v155 = _v152 * _v38;
            let _v161 = (_v155 + (if _v39 { _v153 } else { 0.0 })) / _v47;
            let _v163 = -(_v161 * _v48);
            let _v164 = if _v43 { _v163 } else { 0.0 };
            let _v168 = _v164 * _v28 - (if _v43 { 0.0 } else { 1.0 });
            let _v173 = 0.316 * (_v152 - _v155 + (if _v39 { 0.0 } else { _v153 }));
            let _v178 = _v150 * _v96
                + 40000.0
                    * ((if _v42 { if _v43 { 0.0 } else { _v163 } } else { 0.0 })
                        + _v164 * _share_2 + _v173 * _v101) * _v59;
            let _v255 = _v60 * _v101;
            let _v260 = -1.25 * ::dgd::__runtime::math::power(_v16, -2.25);
            let _v262 = 0.316 * _v255;
            let _v270 = (if _v43 { 0.0 } else { if _v42 { _v60 } else { 0.0 } })
                + (if _v43 { _v60 * _share_2 } else { 0.0 });
            let _v273 = _v270 * _v48 / _v47;
            let _v281 = -0.316 * _v255 - _v273;
            let _v287 = (if _v37 {
                0.0
            } else {
                (if _v39 { 0.0 } else { _v262 }) + (if _v39 { -_v273 } else { 0.0 })
            }) + (if _v37 { _v262 + _v281 * _v38 } else { 0.0 });
            let _v289 = -25.0 * _v14;
            let _v290 = if _v37 { _v289 } else { 0.0 };
            let _v291 = if _v37 { 0.0 } else { _v289 };
            let _v293 = _v290 * _v38;
            let _v294 = _v281 * _v77 + _v290 * _v50;
            let _v303 = _v273 * _v86
                - (_v293 - _v270 * _v86 + (if _v39 { _v291 } else { 0.0 })) / _v47
                    * _v48;
            let _v304 = if _v43 { _v303 } else { 0.0 };
            let _v308 = _v60 * _v89 + _v304 * _v28;
            let _v318 = (-25.0 * _v53
                + 40000.0
                    * (-0.25 * (_v60 * _v98) * _v260
                        + (if _v42 { if _v43 { 0.0 } else { _v303 } } else { 0.0 })
                        + _v304 * _share_2
                        + 0.316 * (_v290 - _v293 + (if _v39 { 0.0 } else { _v291 }))
                            * _v101)) * _v59;
            let _v319 = -12.5 * _v287 * _v96 + _v318;
            let _v321 = if _v37 { _v21 - _v48 } else { 0.0 };
            let _v324 = _v77 / _v47 * _v48;
            let _v325 = if _v43 { _v324 } else { 0.0 };
            let _v327 = _v325 * _v28;
            let _v337 = -12.5 * _v321 * _v96
                + 40000.0
                    * ((if _v42 { if _v43 { 0.0 } else { _v324 } } else { 0.0 })
                        + _v325 * _share_2 + 0.316 * _v77 * _v101) * _v59;
            let _v338 = if _v43 { _v28 } else { 0.0 };
            let _v341 = _v338 * _v48 / _v47;
            let _v347 = _v341 * _v77;
            let _v350 = (if _v37 { 0.0 } else { if _v39 { -_v341 } else { 0.0 } })
                + (if _v37 { -(_v341 * _v38) } else { 0.0 });
            let _v354 = _v341 * _v86 + _v338 * _v86 / _v47 * _v48;
            let _v355 = if _v43 { _v354 } else { 0.0 };
            let _v357 = _v355 * _v28;
            let _v365 = -12.5 * _v350 * _v96
                + 40000.0
                    * ((if _v42 { if _v43 { 0.0 } else { _v354 } } else { 0.0 })
                        + (_v89 + _v355 * _share_2)) * _v59;
            let _v397 = 625.0 * _v287;
            let _v403 = 625.0 * (_v96 * _v113);
            let _v404 = if _v37 { _v403 } else { 0.0 };
            let _v405 = if _v37 { 0.0 } else { _v403 };
            let _v407 = _v404 * _v38;
            let _v408 = _v281 * _v117 + _v404 * _v50;
            let _v417 = _v273 * _v126
                - (_v407 - _v270 * _v126 + (if _v39 { _v405 } else { 0.0 })) / _v47
                    * _v48;
            let _v418 = if _v43 { _v417 } else { 0.0 };
            let _v422 = _v60 * _v129 + _v418 * _v28;
            let _v432 = (2.0 * _v115
                + 40000.0
                    * (-0.25 * (_v60 * _v137) * _v260
                        + (if _v42 { if _v43 { 0.0 } else { _v417 } } else { 0.0 })
                        + _v418 * _share_2
                        + 0.316 * (_v404 - _v407 + (if _v39 { 0.0 } else { _v405 }))
                            * _v101)) * _v59;
            let _v433 = _v397 * _v113 * _v96 + _v432;
            let _v434 = 625.0 * _v321;
            let _v437 = _v117 / _v47 * _v48;
            let _v438 = if _v43 { _v437 } else { 0.0 };
            let _v440 = _v438 * _v28;
            let _v450 = _v434 * _v113 * _v96
                + 40000.0
                    * ((if _v42 { if _v43 { 0.0 } else { _v437 } } else { 0.0 })
                        + _v438 * _share_2 + 0.316 * _v117 * _v101) * _v59;
            let _v453 = _v341 * _v117;
            let _v454 = 625.0 * _v350;
            let _v458 = _v341 * _v126 + _v338 * _v126 / _v47 * _v48;
            let _v459 = if _v43 { _v458 } else { 0.0 };
            let _v461 = _v459 * _v28;
            let _v469 = _v454 * _v113 * _v96
                + 40000.0
                    * ((if _v42 { if _v43 { 0.0 } else { _v458 } } else { 0.0 })
                        + (_v129 + _v459 * _share_2)) * _v59;
            let _v506 = 625.0 * (_v96 * _v148);
            let _v507 = if _v37 { _v506 } else { 0.0 };
            let _v508 = if _v37 { 0.0 } else { _v506 };
            let _v510 = _v507 * _v38;
            let _v511 = _v281 * _v152 + _v507 * _v50;
            let _v520 = _v273 * _v161
                - (_v510 - _v270 * _v161 + (if _v39 { _v508 } else { 0.0 })) / _v47
                    * _v48;
            let _v521 = if _v43 { _v520 } else { 0.0 };
            let _v525 = _v60 * _v164 + _v521 * _v28;
            let _v535 = (2.0 * _v150
                + 40000.0
                    * (-0.25 * (_v60 * _v173) * _v260
                        + (if _v42 { if _v43 { 0.0 } else { _v520 } } else { 0.0 })
                        + _v521 * _share_2
                        + 0.316 * (_v507 - _v510 + (if _v39 { 0.0 } else { _v508 }))
                            * _v101)) * _v59;
            let _v536 = _v397 * _v148 * _v96 + _v535;
            let _v539 = _v152 / _v47 * _v48;
            let _v540 = if _v43 { _v539 } else { 0.0 };
            let _v542 = _v540 * _v28;
            let _v552 = _v434 * _v148 * _v96
                + 40000.0
                    * ((if _v42 { if _v43 { 0.0 } else { _v539 } } else { 0.0 })
                        + _v540 * _share_2 + 0.316 * _v152 * _v101) * _v59;
            let _v555 = _v341 * _v152;
            let _v559 = _v341 * _v161 + _v338 * _v161 / _v47 * _v48;
            let _v560 = if _v43 { _v559 } else { 0.0 };
            let _v562 = _v560 * _v28;
            let _v570 = _v454 * _v148 * _v96
                + 40000.0
                    * ((if _v42 { if _v43 { 0.0 } else { _v559 } } else { 0.0 })
                        + (_v164 + _v560 * _share_2)) * _v59;
            *::dgd::__runtime::codegen::fixed_mut::<5>(_f) = [
                _v25,
                _v26,
                _v58,
                if _v37 {
                    _v61
                } else {
                    (if ((_z[0] > 0.5) && (_z[0] < 1.5)) { 1.0 } else { 0.0 }) - _share_1
                },
                if _v43 { _v61 } else { (if _v42 { 1.0 } else { 0.0 }) - _share_2 },
            ];
            *::dgd::__runtime::codegen::fixed_mut::<17>(_jacobian) = [
                0.3924,
                _v111,
                _v146,
                -0.3924,
                _v112,
                _v147,
                _v69,
                _v71,
                _v106,
                _v142,
                _v178,
                -_v79,
                _v134,
                -_v154,
                _v91,
                _v131,
                _v168,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<5>(_dfdt) = [
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<10>(_g) = [
                _v69 * _s[2] - _v68 * _v25,
                _v71 * _s[2],
                0.3924 * _s[0] + -0.3924 * _s[1] + _v106 * _s[2] - _v79 * _s[3]
                    + _v91 * _s[4],
                _v111 * _s[0] + _v112 * _s[1] + _v142 * _s[2] + _v134 * _s[3]
                    + _v131 * _s[4],
                _v146 * _s[0] + _v147 * _s[1] + _v178 * _s[2] - _v154 * _s[3]
                    + _v168 * _s[4],
                _v69 * _s[7],
                _v71 * _s[7] - _v70 * _v26,
                0.3924 * _s[5] + -0.3924 * _s[6] + _v106 * _s[7] - _v79 * _s[8]
                    + _v91 * _s[9],
                _v111 * _s[5] + _v112 * _s[6] + _v142 * _s[7] + _v134 * _s[8]
                    + _v131 * _s[9],
                _v146 * _s[5] + _v147 * _s[6] + _v178 * _s[7] - _v154 * _s[8]
                    + _v168 * _s[9],
            ];
            *::dgd::__runtime::codegen::fixed_mut::<20>(_dgdy) = [
                0.0012566370614359172 * (_v68 / A_1),
                _v319 * _s[2] + _v337 * _s[3] + _v365 * _s[4],
                _v433 * _s[2] + _v450 * _s[3] + _v469 * _s[4],
                _v536 * _s[2] + _v552 * _s[3] + _v570 * _s[4],
                -0.0012566370614359172 * (_v70 / A_2),
                _v319 * _s[7] + _v337 * _s[8] + _v365 * _s[9],
                _v433 * _s[7] + _v450 * _s[8] + _v469 * _s[9],
                _v536 * _s[7] + _v552 * _s[8] + _v570 * _s[9],
                _v347 * _s[4] - _v294 * _s[2],
                _v453 * _s[4] - _v408 * _s[2],
                _v555 * _s[4] - _v511 * _s[2],
                _v347 * _s[9] - _v294 * _s[7],
                _v453 * _s[9] - _v408 * _s[7],
                _v555 * _s[9] - _v511 * _s[7],
                _v308 * _s[2] + _v327 * _s[3] + _v357 * _s[4],
                _v422 * _s[2] + _v440 * _s[3] + _v461 * _s[4],
                _v525 * _s[2] + _v542 * _s[3] + _v562 * _s[4],
                _v308 * _s[7] + _v327 * _s[8] + _v357 * _s[9],
                _v422 * _s[7] + _v440 * _s[8] + _v461 * _s[9],
                _v525 * _s[7] + _v542 * _s[8] + _v562 * _s[9],
            ];
            *::dgd::__runtime::codegen::fixed_mut::<10>(_dgdt) = [
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
            ];
        }
        #[inline]
        fn parameter_jacobian(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _values: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<5>(_at.y);
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
            *::dgd::__runtime::codegen::fixed_mut::<5>(_values) = [
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
            ];
        }
        #[inline]
        fn outputs(&self, _at: ::dgd::__runtime::Point<'_>, _w: &mut [f64]) {
            let _y = ::dgd::__runtime::codegen::fixed::<5>(_at.y);
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
            let _y = ::dgd::__runtime::codegen::fixed::<5>(_at.y);
            let v = _y[2];
            let h_1 = _y[0];
            let h_2 = _y[1];
            let _v10 = if ((h_1 > h_2) && !(v < 0.0)) { 1.0 } else { 0.0 };
            *::dgd::__runtime::codegen::fixed_mut::<3>(_dwdy) = [
                _v10,
                -_v10,
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
            let _y = ::dgd::__runtime::codegen::fixed::<5>(_at.y);
            let _s = ::dgd::__runtime::codegen::fixed::<10>(_s);
            let v = _y[2];
            let h_1 = _y[0];
            let h_2 = _y[1];
            let _v11 = ((h_1 > h_2) && !(v < 0.0));
            let _v19 = if _v11 { 1.0 } else { 0.0 };
            *::dgd::__runtime::codegen::fixed_mut::<2>(_w) = [
                0.0012566370614359172 * v,
                if _v11 { h_1 - h_2 } else { 0.0 },
            ];
            *::dgd::__runtime::codegen::fixed_mut::<4>(_dw) = [
                0.0012566370614359172 * _s[2],
                _v19 * _s[0] - _v19 * _s[1],
                0.0012566370614359172 * _s[7],
                _v19 * _s[5] - _v19 * _s[6],
            ];
        }
        #[inline]
        fn start(&self, _at: ::dgd::__runtime::Point<'_>, _y0: &mut [f64]) {
            *::dgd::__runtime::codegen::fixed_mut::<5>(_y0) = [2.0, 0.5, 0.0, 0.5, 0.5];
        }
        #[inline]
        fn start_sensitivities(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _s0: &mut [f64],
        ) {
            *::dgd::__runtime::codegen::fixed_mut::<10>(_s0) = [
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
            ];
        }
        #[inline]
        fn mass(&self, _at: ::dgd::__runtime::Point<'_>, _mass: &mut [f64]) {
            *::dgd::__runtime::codegen::fixed_mut::<5>(_mass) = [
                1.0,
                1.0,
                1.0,
                0.0,
                0.0,
            ];
        }
        #[inline]
        fn event_functions(&self, _at: ::dgd::__runtime::Point<'_>, _e: &mut [f64]) {
            let _y = ::dgd::__runtime::codegen::fixed::<5>(_at.y);
            let _z = ::dgd::__runtime::codegen::fixed::<2>(_at.z);
            let v = _y[2];
            let h_1 = _y[0];
            let h_2 = _y[1];
            let _v6 = ::core::primitive::f64::abs(v);
            let _v8 = 40000.0 * _v6;
            let _v14 = 0.316 * ::dgd::__runtime::math::power(_v8, -0.25);
            let _v19 = _v8 - 2300.0;
            let _v20 = _v8 - 1.0;
            let _share_1 = _y[3];
            let _share_2 = _y[4];
            let _v37 = 64.0
                / (if (_z[1] > 1.5) {
                    1.0 + _share_2 * _v20
                } else {
                    if ((_z[1] > 0.5) && (_z[1] < 1.5)) { _v8 } else { 1.0 }
                });
            let _v47 = 0.3924
                * (h_1 - h_2
                    - 0.0509683995922528
                        * (625.0
                            * (if (_z[0] > 1.5) {
                                _v14 + (1.0 - _share_1) * (_v37 - _v14)
                            } else {
                                if (_z[0] < 0.5) { _v37 } else { _v14 }
                            }) * (v * _v6)));
            let _v50 = 40000.0 * ::dgd::__runtime::math::sign(v) * _v47;
            *::dgd::__runtime::codegen::fixed_mut::<12>(_e) = [
                _v19,
                _v19,
                _v50,
                _v50,
                _share_1 - 1.0,
                _share_1,
                _v20,
                _v20,
                _v50,
                _v50,
                _share_2 - 1.0,
                _share_2,
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
            let _y = ::dgd::__runtime::codegen::fixed::<5>(_at.y);
            let _s = ::dgd::__runtime::codegen::fixed::<10>(_s);
            let _z = ::dgd::__runtime::codegen::fixed::<2>(_at.z);
            let v = _y[2];
            let _v5 = ::core::primitive::f64::abs(v);
            let _v7 = 40000.0 * _v5;
            let _v12 = 0.316 * ::dgd::__runtime::math::power(_v7, -0.25);
            let _v15 = _v7 - 1.0;
            let _share_1 = _y[3];
            let _share_2 = _y[4];
            let _v21 = (_z[0] > 1.5);
            let _v22 = 1.0 - _share_1;
            let _v23 = (_z[0] < 0.5);
            let _v26 = ((_z[1] > 0.5) && (_z[1] < 1.5));
            let _v27 = (_z[1] > 1.5);
            let _v31 = if _v27 {
                1.0 + _share_2 * _v15
            } else {
                if _v26 { _v7 } else { 1.0 }
            };
            let _v32 = 64.0 / _v31;
            let _v34 = _v32 - _v12;
            let _v39 = ::dgd::__runtime::math::sign(v);
            let _v40 = 40000.0 * _v39;
            let _v57 = _v40 * _s[2];
            let _v58 = _v40 * _s[7];
            let _v59 = 15696.000000000002 * _v39;
            let _v60 = -15696.000000000002 * _v39;
            let _v62 = -800.0 * _v39;
            let _v65 = 625.0 * (_v62 * (v * _v5));
            let _v66 = if _v21 { _v65 } else { 0.0 };
            let _v67 = if _v21 { 0.0 } else { _v65 };
            let _v68 = _v66 * _v34;
            let _v69 = _v66 * _v22;
            let _v77 = -((_v69 + (if _v23 { _v67 } else { 0.0 })) / _v31 * _v32);
            let _v78 = if _v27 { _v77 } else { 0.0 };
            let _v80 = _v78 * _v15;
            let _v83 = -_v68;
            let _v91 = _v62
                * (625.0
                    * (if _v21 {
                        _v12 + _v22 * _v34
                    } else {
                        if _v23 { _v32 } else { _v12 }
                    })) * (2.0 * _v5)
                + 40000.0
                    * ((if _v26 { if _v27 { 0.0 } else { _v77 } } else { 0.0 })
                        + _v78 * _share_2
                        + 0.316 * (_v66 - _v69 + (if _v23 { 0.0 } else { _v67 }))
                            * (-0.25 * ::dgd::__runtime::math::power(_v7, -1.25)))
                    * _v39;
            let _v100 = _v59 * _s[0] + _v60 * _s[1] + _v91 * _s[2] - _v68 * _s[3]
                + _v80 * _s[4];
            let _v109 = _v59 * _s[5] + _v60 * _s[6] + _v91 * _s[7] - _v68 * _s[8]
                + _v80 * _s[9];
            *::dgd::__runtime::codegen::fixed_mut::<24>(_de) = [
                _v57,
                _v57,
                _v100,
                _v100,
                _s[3],
                _s[3],
                _v57,
                _v57,
                _v100,
                _v100,
                _s[4],
                _s[4],
                _v58,
                _v58,
                _v109,
                _v109,
                _s[8],
                _s[8],
                _v58,
                _v58,
                _v109,
                _v109,
                _s[9],
                _s[9],
            ];
            *::dgd::__runtime::codegen::fixed_mut::<28>(_dedy) = [
                _v59,
                _v59,
                _v59,
                _v59,
                _v60,
                _v60,
                _v60,
                _v60,
                _v40,
                _v40,
                _v91,
                _v91,
                _v40,
                _v40,
                _v91,
                _v91,
                _v83,
                _v83,
                1.0,
                1.0,
                _v83,
                _v83,
                _v80,
                _v80,
                _v80,
                _v80,
                1.0,
                1.0,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<12>(_dedt) = [
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
    }
}
