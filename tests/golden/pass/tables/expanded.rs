/// A table of each shape; one that is fitted, and one beyond which a run ends.
#[allow(
    non_snake_case,
    unused_variables,
    unused_doc_comments,
    dead_code,
    clippy::all,
    clippy::pedantic
)]
pub mod tables {
    /// The model `tables`.
    #[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
    pub struct Model;
    /// Parameters p; the default is the model file's. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Parameters {
        /// [kg*m^2/(s^2*K)], declared in kJ/K
        pub a: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Parameters {
        fn default() -> Self {
            Parameters { a: 2000.0 }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Parameters> for [f64; 1] {
        fn from(named: Parameters) -> [f64; 1] {
            [named.a]
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<&Parameters> for ::dgd::__runtime::codegen::HeapNumbers {
        fn from(named: &Parameters) -> ::dgd::__runtime::codegen::HeapNumbers {
            <[f64; 1]>::from(*named).to_vec()
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 1]> for Parameters {
        fn from([a]: [f64; 1]) -> Parameters {
            Parameters { a }
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
        pub x: f64,
        /// [J], declared in kJ
        pub y: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Unknowns {
        fn default() -> Self {
            Unknowns { x: 0.0, y: 0.0 }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Unknowns> for [f64; 2] {
        fn from(named: Unknowns) -> [f64; 2] {
            [named.x, named.y]
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
        fn from([x, y]: [f64; 2]) -> Unknowns {
            Unknowns { x, y }
        }
    }
    /// Outputs w. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Outputs {}
    #[automatically_derived]
    impl ::core::default::Default for Outputs {
        fn default() -> Self {
            Outputs {}
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Outputs> for [f64; 0] {
        fn from(named: Outputs) -> [f64; 0] {
            []
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<&Outputs> for ::dgd::__runtime::codegen::HeapNumbers {
        fn from(named: &Outputs) -> ::dgd::__runtime::codegen::HeapNumbers {
            <[f64; 0]>::from(*named).to_vec()
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 0]> for Outputs {
        fn from([]: [f64; 0]) -> Outputs {
            Outputs {}
        }
    }
    static SIGNATURE: ::dgd::__runtime::signature::Signature = {
        #[allow(unused_imports)]
        use ::dgd::__runtime::signature::{arrays::*, *};
        Signature {
            name: Text::Borrowed("tables"),
            unknowns: Unknowns::single(
                &[
                    Unknown {
                        name: Text::Borrowed("x"),
                        unit: Unit {
                            symbol: Text::Borrowed("m"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        nominal: ::core::option::Option::None,
                        differential: true,
                    },
                    Unknown {
                        name: Text::Borrowed("y"),
                        unit: Unit {
                            symbol: Text::Borrowed("kJ"),
                            factor: 1000.0,
                            offset: 0.0,
                        },
                        nominal: ::core::option::Option::None,
                        differential: true,
                    },
                ],
            ),
            equations: Labels::single(&[Text::Borrowed("x"), Text::Borrowed("y")]),
            parameters: List::Borrowed(
                &[
                    Parameter {
                        name: Text::Borrowed("a"),
                        unit: Unit {
                            symbol: Text::Borrowed("kJ/K"),
                            factor: 1000.0,
                            offset: 0.0,
                        },
                        value: 2000.0,
                        lower: -f64::INFINITY,
                        upper: f64::INFINITY,
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
            outputs: List::Borrowed(&[]),
            densities: List::Borrowed(&[]),
            directions: List::Borrowed(&[Direction::Parameter(0)]),
            jacobian: Pattern::single(&[0, 1], &[0, 0]),
            sensitivity_jacobian: Pattern::single(&[0, 1], &[0, 0]),
            parameter_jacobian: Pattern::single(&[1], &[0]),
            input_jacobian: Pattern::single(&[], &[]),
            output_jacobians: [
                Pattern::single(&[], &[]),
                Pattern::single(&[], &[]),
                Pattern::single(&[], &[]),
            ],
            discrete: Discrete {
                automata: List::Borrowed(
                    &[
                        Automaton {
                            kind: AutomatonKind::Knots,
                            name: Text::Borrowed("segment of line(x)"),
                            modes: List::Borrowed(&[Text::Borrowed("")]),
                            start: 0,
                            transitions: List::Borrowed(
                                &[
                                    Transition {
                                        from: 0,
                                        to: 0,
                                        crossing: Crossing::Rises,
                                        trigger: Trigger::Level,
                                        resets: List::Borrowed(&[]),
                                    },
                                    Transition {
                                        from: 0,
                                        to: 0,
                                        crossing: Crossing::Falls,
                                        trigger: Trigger::Level,
                                        resets: List::Borrowed(&[]),
                                    },
                                ],
                            ),
                        },
                        Automaton {
                            kind: AutomatonKind::Knots,
                            name: Text::Borrowed("segment of smooth(x)"),
                            modes: List::Borrowed(&[Text::Borrowed("")]),
                            start: 0,
                            transitions: List::Borrowed(
                                &[
                                    Transition {
                                        from: 0,
                                        to: 0,
                                        crossing: Crossing::Rises,
                                        trigger: Trigger::Level,
                                        resets: List::Borrowed(&[]),
                                    },
                                    Transition {
                                        from: 0,
                                        to: 0,
                                        crossing: Crossing::Falls,
                                        trigger: Trigger::Level,
                                        resets: List::Borrowed(&[]),
                                    },
                                ],
                            ),
                        },
                        Automaton {
                            kind: AutomatonKind::Limit,
                            name: Text::Borrowed(
                                "`x` leaves the table `line`, which goes from 0 to 100 cm",
                            ),
                            modes: List::Borrowed(&[Text::Borrowed("")]),
                            start: 0,
                            transitions: List::Borrowed(
                                &[
                                    Transition {
                                        from: 0,
                                        to: 0,
                                        crossing: Crossing::Rises,
                                        trigger: Trigger::Level,
                                        resets: List::Borrowed(&[]),
                                    },
                                    Transition {
                                        from: 0,
                                        to: 0,
                                        crossing: Crossing::Falls,
                                        trigger: Trigger::Level,
                                        resets: List::Borrowed(&[]),
                                    },
                                ],
                            ),
                        },
                    ],
                ),
                n_time_conditions: 0,
                clocks: List::Borrowed(&[]),
                event_formulas: Formulas {
                    operations: List::Borrowed(
                        &[
                            Operation::Constant(1.0),
                            Operation::Unknown(0),
                            Operation::Discrete(0),
                            Operation::Curve(&_CURVE_0D4E45D9439EF248, 1),
                            Operation::Subtract(3, 2),
                            Operation::Subtract(4, 0),
                            Operation::Discrete(1),
                            Operation::Curve(&_CURVE_990E65693DACB038, 1),
                            Operation::Subtract(7, 6),
                            Operation::Subtract(8, 0),
                            Operation::Constant(-1e-6),
                            Operation::Constant(1.000001),
                            Operation::Subtract(1, 11),
                            Operation::Subtract(1, 10),
                        ],
                    ),
                    results: List::Borrowed(&[5, 4, 9, 8, 12, 13]),
                },
                event_jacobian: Pattern::single(
                    &[0, 1, 2, 3, 4, 5],
                    &[0, 0, 0, 0, 0, 0],
                ),
                event_directions: Pattern::single(&[], &[]),
                reset_jacobian: Pattern::single(&[], &[]),
                reset_directions: Pattern::single(&[], &[]),
                by_mode: List::Borrowed(&[]),
                jump_jacobian: Pattern::single(&[], &[]),
                unlocated: List::Borrowed(&[]),
            },
            starts_at_rest: false,
            start_equations: List::Borrowed(&[]),
            conserved: List::Borrowed(&[]),
        }
    };
    /// `smooth''`
    static _CURVE_07036843808D01F9: ::dgd::__runtime::signature::Curve = ::dgd::__runtime::signature::Curve {
        knots: ::dgd::__runtime::signature::List::Borrowed(&[0.0, 1.0, 3.0]),
        pieces: ::dgd::__runtime::signature::List::Borrowed(
            &[
                [0.0, 0.0, 0.0, 0.0],
                [0.1428571428571429, -1.9285714285714284, 0.0, 0.0],
                [-0.1071428571428571, -0.10714285714285718, 0.0, 0.0],
                [0.0, 0.0, 0.0, 0.0],
            ],
        ),
    };
    /// `fitted[2]'''`
    static _CURVE_0792A1EE88FA0F97: ::dgd::__runtime::signature::Curve = ::dgd::__runtime::signature::Curve {
        knots: ::dgd::__runtime::signature::List::Borrowed(&[273.15, 293.15, 333.15]),
        pieces: ::dgd::__runtime::signature::List::Borrowed(
            &[
                [0.0, 0.0, 0.0, 0.0],
                [-0.00018749999999999976, 0.0, 0.0, 0.0],
                [9.375e-5, 0.0, 0.0, 0.0],
                [0.0, 0.0, 0.0, 0.0],
            ],
        ),
    };
    /// `segment of line`
    static _CURVE_0D4E45D9439EF248: ::dgd::__runtime::signature::Curve = ::dgd::__runtime::signature::Curve {
        knots: ::dgd::__runtime::signature::List::Borrowed(&[0.5]),
        pieces: ::dgd::__runtime::signature::List::Borrowed(
            &[[0.0, 1.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]],
        ),
    };
    /// `fitted'''`
    static _CURVE_17C2235D6DF8B963: ::dgd::__runtime::signature::Curve = ::dgd::__runtime::signature::Curve {
        knots: ::dgd::__runtime::signature::List::Borrowed(&[273.15, 293.15, 333.15]),
        pieces: ::dgd::__runtime::signature::List::Borrowed(
            &[
                [0.0, 0.0, 0.0, 0.0],
                [0.12500000000000014, 0.0, 0.0, 0.0],
                [-0.0625, 0.0, 0.0, 0.0],
                [0.0, 0.0, 0.0, 0.0],
            ],
        ),
    };
    /// `fitted[3]''`
    static _CURVE_3D35D2C72D078A32: ::dgd::__runtime::signature::Curve = ::dgd::__runtime::signature::Curve {
        knots: ::dgd::__runtime::signature::List::Borrowed(&[273.15, 293.15, 333.15]),
        pieces: ::dgd::__runtime::signature::List::Borrowed(
            &[
                [0.0, 0.0, 0.0, 0.0],
                [0.0, 6.25e-5, 0.0, 0.0],
                [0.0012500000000000005, -3.1249999999999994e-5, 0.0, 0.0],
                [0.0, 0.0, 0.0, 0.0],
            ],
        ),
    };
    /// `fitted[3]'''`
    static _CURVE_5E6DA538DC1F538E: ::dgd::__runtime::signature::Curve = ::dgd::__runtime::signature::Curve {
        knots: ::dgd::__runtime::signature::List::Borrowed(&[273.15, 293.15, 333.15]),
        pieces: ::dgd::__runtime::signature::List::Borrowed(
            &[
                [0.0, 0.0, 0.0, 0.0],
                [6.25e-5, 0.0, 0.0, 0.0],
                [-3.1249999999999994e-5, 0.0, 0.0, 0.0],
                [0.0, 0.0, 0.0, 0.0],
            ],
        ),
    };
    /// `fitted[3]'`
    static _CURVE_618233D7341B0F65: ::dgd::__runtime::signature::Curve = ::dgd::__runtime::signature::Curve {
        knots: ::dgd::__runtime::signature::List::Borrowed(&[273.15, 293.15, 333.15]),
        pieces: ::dgd::__runtime::signature::List::Borrowed(
            &[
                [-0.004166666666666667, 0.0, 0.0, 0.0],
                [-0.004166666666666667, 0.0, 3.125e-5, 0.0],
                [
                    0.008333333333333333,
                    0.0012500000000000005,
                    -1.5624999999999997e-5,
                    0.0,
                ],
                [0.03333333333333334, 0.0, 0.0, 0.0],
            ],
        ),
    };
    /// `line`
    static _CURVE_770D761AC2F20B4A: ::dgd::__runtime::signature::Curve = ::dgd::__runtime::signature::Curve {
        knots: ::dgd::__runtime::signature::List::Borrowed(&[0.0, 0.5, 1.0]),
        pieces: ::dgd::__runtime::signature::List::Borrowed(
            &[
                [0.1, 0.6000000000000001, 0.0, 0.0],
                [0.1, 0.6000000000000001, 0.0, 0.0],
                [0.4, -0.4, 0.0, 0.0],
                [0.2, -0.4, 0.0, 0.0],
            ],
        ),
    };
    /// `fitted`
    static _CURVE_7D63E84F1287598D: ::dgd::__runtime::signature::Curve = ::dgd::__runtime::signature::Curve {
        knots: ::dgd::__runtime::signature::List::Borrowed(&[273.15, 293.15, 333.15]),
        pieces: ::dgd::__runtime::signature::List::Borrowed(
            &[
                [1000.0, -58.333333333333336, 0.0, 0.0],
                [1000.0, -58.333333333333336, 0.0, 0.020833333333333356],
                [0.0, -33.33333333333333, 1.25, -0.010416666666666668],
                [0.0, 16.66666666666666, 0.0, 0.0],
            ],
        ),
    };
    /// `fitted[3]`
    static _CURVE_9100D6412B679B29: ::dgd::__runtime::signature::Curve = ::dgd::__runtime::signature::Curve {
        knots: ::dgd::__runtime::signature::List::Borrowed(&[273.15, 293.15, 333.15]),
        pieces: ::dgd::__runtime::signature::List::Borrowed(
            &[
                [0.0, -0.004166666666666667, 0.0, 0.0],
                [0.0, -0.004166666666666667, 0.0, 1.0416666666666666e-5],
                [
                    0.0,
                    0.008333333333333333,
                    0.0006250000000000002,
                    -5.208333333333332e-6,
                ],
                [1.0, 0.03333333333333334, 0.0, 0.0],
            ],
        ),
    };
    /// `segment of smooth'`
    static _CURVE_910B2C69320B2368: ::dgd::__runtime::signature::Curve = ::dgd::__runtime::signature::Curve {
        knots: ::dgd::__runtime::signature::List::Borrowed(&[0.0]),
        pieces: ::dgd::__runtime::signature::List::Borrowed(
            &[[0.3333333333333333, 0.0, 0.0, 0.0], [0.3333333333333333, 0.0, 0.0, 0.0]],
        ),
    };
    /// `segment of smooth`
    static _CURVE_990E65693DACB038: ::dgd::__runtime::signature::Curve = ::dgd::__runtime::signature::Curve {
        knots: ::dgd::__runtime::signature::List::Borrowed(&[0.0]),
        pieces: ::dgd::__runtime::signature::List::Borrowed(
            &[[0.0, 0.3333333333333333, 0.0, 0.0], [0.0, 0.3333333333333333, 0.0, 0.0]],
        ),
    };
    /// `smooth'`
    static _CURVE_A8A6FA88D07DCDEA: ::dgd::__runtime::signature::Curve = ::dgd::__runtime::signature::Curve {
        knots: ::dgd::__runtime::signature::List::Borrowed(&[0.0, 1.0, 3.0]),
        pieces: ::dgd::__runtime::signature::List::Borrowed(
            &[
                [0.0, 0.0, 0.0, 0.0],
                [1.25, 0.1428571428571429, -0.9642857142857142, 0.0],
                [0.42857142857142855, -0.1071428571428571, -0.05357142857142859, 0.0],
                [0.0, 0.0, 0.0, 0.0],
            ],
        ),
    };
    /// `smooth'''`
    static _CURVE_B6D308DC3751A8C1: ::dgd::__runtime::signature::Curve = ::dgd::__runtime::signature::Curve {
        knots: ::dgd::__runtime::signature::List::Borrowed(&[0.0, 1.0, 3.0]),
        pieces: ::dgd::__runtime::signature::List::Borrowed(
            &[
                [0.0, 0.0, 0.0, 0.0],
                [-1.9285714285714284, 0.0, 0.0, 0.0],
                [-0.10714285714285718, 0.0, 0.0, 0.0],
                [0.0, 0.0, 0.0, 0.0],
            ],
        ),
    };
    /// `fitted''`
    static _CURVE_BAF1F99B17AF57F5: ::dgd::__runtime::signature::Curve = ::dgd::__runtime::signature::Curve {
        knots: ::dgd::__runtime::signature::List::Borrowed(&[273.15, 293.15, 333.15]),
        pieces: ::dgd::__runtime::signature::List::Borrowed(
            &[
                [0.0, 0.0, 0.0, 0.0],
                [0.0, 0.12500000000000014, 0.0, 0.0],
                [2.5, -0.0625, 0.0, 0.0],
                [0.0, 0.0, 0.0, 0.0],
            ],
        ),
    };
    /// `fitted[2]`
    static _CURVE_BFC7E6A0667CD72C: ::dgd::__runtime::signature::Curve = ::dgd::__runtime::signature::Curve {
        knots: ::dgd::__runtime::signature::List::Borrowed(&[273.15, 293.15, 333.15]),
        pieces: ::dgd::__runtime::signature::List::Borrowed(
            &[
                [0.0, 0.06250000000000001, 0.0, 0.0],
                [
                    0.0,
                    0.06250000000000001,
                    -3.4694469519536144e-19,
                    -3.124999999999996e-5,
                ],
                [1.0, 0.025, -0.001875, 1.5625e-5],
                [0.0, -0.05, 0.0, 0.0],
            ],
        ),
    };
    /// `fitted[2]'`
    static _CURVE_C994445EBDC79BBD: ::dgd::__runtime::signature::Curve = ::dgd::__runtime::signature::Curve {
        knots: ::dgd::__runtime::signature::List::Borrowed(&[273.15, 293.15, 333.15]),
        pieces: ::dgd::__runtime::signature::List::Borrowed(
            &[
                [0.06250000000000001, 0.0, 0.0, 0.0],
                [
                    0.06250000000000001,
                    -6.938893903907229e-19,
                    -9.374999999999988e-5,
                    0.0,
                ],
                [0.025, -0.00375, 4.6875e-5, 0.0],
                [-0.05, 0.0, 0.0, 0.0],
            ],
        ),
    };
    /// `smooth`
    static _CURVE_CAED1217738FFF28: ::dgd::__runtime::signature::Curve = ::dgd::__runtime::signature::Curve {
        knots: ::dgd::__runtime::signature::List::Borrowed(&[0.0, 1.0, 3.0]),
        pieces: ::dgd::__runtime::signature::List::Borrowed(
            &[
                [1.0, 0.0, 0.0, 0.0],
                [1.0, 1.25, 0.07142857142857145, -0.3214285714285714],
                [2.0, 0.42857142857142855, -0.05357142857142855, -0.017857142857142863],
                [2.5, 0.0, 0.0, 0.0],
            ],
        ),
    };
    /// `line'`
    static _CURVE_D5998179509F345E: ::dgd::__runtime::signature::Curve = ::dgd::__runtime::signature::Curve {
        knots: ::dgd::__runtime::signature::List::Borrowed(&[0.0, 0.5, 1.0]),
        pieces: ::dgd::__runtime::signature::List::Borrowed(
            &[
                [0.6000000000000001, 0.0, 0.0, 0.0],
                [0.6000000000000001, 0.0, 0.0, 0.0],
                [-0.4, 0.0, 0.0, 0.0],
                [-0.4, 0.0, 0.0, 0.0],
            ],
        ),
    };
    /// `segment of line'`
    static _CURVE_DADF86D83DE97DF8: ::dgd::__runtime::signature::Curve = ::dgd::__runtime::signature::Curve {
        knots: ::dgd::__runtime::signature::List::Borrowed(&[0.5]),
        pieces: ::dgd::__runtime::signature::List::Borrowed(
            &[[1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]],
        ),
    };
    /// `fitted'`
    static _CURVE_E1224AD4F7ABE89C: ::dgd::__runtime::signature::Curve = ::dgd::__runtime::signature::Curve {
        knots: ::dgd::__runtime::signature::List::Borrowed(&[273.15, 293.15, 333.15]),
        pieces: ::dgd::__runtime::signature::List::Borrowed(
            &[
                [-58.333333333333336, 0.0, 0.0, 0.0],
                [-58.333333333333336, 0.0, 0.06250000000000007, 0.0],
                [-33.33333333333333, 2.5, -0.03125, 0.0],
                [16.66666666666666, 0.0, 0.0, 0.0],
            ],
        ),
    };
    /// `fitted[2]''`
    static _CURVE_EB3FFAB2D74CAB6B: ::dgd::__runtime::signature::Curve = ::dgd::__runtime::signature::Curve {
        knots: ::dgd::__runtime::signature::List::Borrowed(&[273.15, 293.15, 333.15]),
        pieces: ::dgd::__runtime::signature::List::Borrowed(
            &[
                [0.0, 0.0, 0.0, 0.0],
                [-6.938893903907229e-19, -0.00018749999999999976, 0.0, 0.0],
                [-0.00375, 9.375e-5, 0.0, 0.0],
                [0.0, 0.0, 0.0, 0.0],
            ],
        ),
    };
    #[automatically_derived]
    impl ::dgd::__runtime::System for Model {
        type Vector = [f64; 2];
        type Sensitivity = [f64; 2];
        type Inputs = [f64; 0];
        type Jacobian = [f64; 2];
        type SensitivityJacobian = [f64; 2];
        const FEATURES: ::dgd::__runtime::signature::Features = ::dgd::__runtime::signature::Features {
            events: true,
            past: false,
            algebraic: false,
            conserved: false,
        };
        #[inline]
        fn signature(&self) -> &::dgd::__runtime::signature::Signature {
            &SIGNATURE
        }
        #[inline]
        fn rhs(&self, _at: ::dgd::__runtime::EvaluationPoint<'_>, _f: &mut [f64]) {
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<1>(_at.p);
            let x = _y[0];
            let _v6 = 300.0 + x;
            let a = _p[0];
            /// `x` (model.dgd:13): der(x) =
            let _row_0: f64 = _CURVE_770D761AC2F20B4A.value(x)
                * _CURVE_CAED1217738FFF28.value(x);
            /// `y` (model.dgd:14): der(y) =
            let _row_1: f64 = _CURVE_7D63E84F1287598D.value(_v6)
                + a * _CURVE_BFC7E6A0667CD72C.value(_v6)
                + 2.0 * a * _CURVE_9100D6412B679B29.value(_v6);
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
            let _p = ::dgd::__runtime::codegen::fixed::<1>(_at.p);
            let x = _y[0];
            let _v2 = _CURVE_770D761AC2F20B4A.value(x);
            let _v3 = _CURVE_CAED1217738FFF28.value(x);
            let _v6 = 300.0 + x;
            let a = _p[0];
            let _v8 = 2.0 * a;
            *::dgd::__runtime::codegen::fixed_mut::<2>(_f) = [
                _v2 * _v3,
                _CURVE_7D63E84F1287598D.value(_v6)
                    + a * _CURVE_BFC7E6A0667CD72C.value(_v6)
                    + _v8 * _CURVE_9100D6412B679B29.value(_v6),
            ];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_jacobian) = [
                _v2 * _CURVE_A8A6FA88D07DCDEA.value(x)
                    + _v3 * _CURVE_D5998179509F345E.value(x),
                _v8 * _CURVE_618233D7341B0F65.value(_v6)
                    + a * _CURVE_C994445EBDC79BBD.value(_v6)
                    + _CURVE_E1224AD4F7ABE89C.value(_v6),
            ];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_dfdt) = [0.0, 0.0];
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
            let _p = ::dgd::__runtime::codegen::fixed::<1>(_at.p);
            let _s = ::dgd::__runtime::codegen::fixed::<2>(_s);
            let x = _y[0];
            let _v2 = _CURVE_770D761AC2F20B4A.value(x);
            let _v3 = _CURVE_CAED1217738FFF28.value(x);
            let _v6 = 300.0 + x;
            let a = _p[0];
            let _v8 = 2.0 * a;
            let _v10 = _CURVE_BFC7E6A0667CD72C.value(_v6);
            let _v13 = _CURVE_9100D6412B679B29.value(_v6);
            *::dgd::__runtime::codegen::fixed_mut::<2>(_f) = [
                _v2 * _v3,
                _CURVE_7D63E84F1287598D.value(_v6) + a * _v10 + _v8 * _v13,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_g) = [
                (_v2 * _CURVE_A8A6FA88D07DCDEA.value(x)
                    + _v3 * _CURVE_D5998179509F345E.value(x)) * _s[0],
                (_v8 * _CURVE_618233D7341B0F65.value(_v6)
                    + a * _CURVE_C994445EBDC79BBD.value(_v6)
                    + _CURVE_E1224AD4F7ABE89C.value(_v6)) * _s[0] + (_v10 + 2.0 * _v13),
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
            let _p = ::dgd::__runtime::codegen::fixed::<1>(_at.p);
            let _s = ::dgd::__runtime::codegen::fixed::<2>(_s);
            let x = _y[0];
            let _v2 = _CURVE_770D761AC2F20B4A.value(x);
            let _v3 = _CURVE_CAED1217738FFF28.value(x);
            let _v6 = 300.0 + x;
            let a = _p[0];
            let _v8 = 2.0 * a;
            let _v10 = _CURVE_BFC7E6A0667CD72C.value(_v6);
            let _v13 = _CURVE_9100D6412B679B29.value(_v6);
            let _v17 = _CURVE_A8A6FA88D07DCDEA.value(x);
            let _v19 = _CURVE_D5998179509F345E.value(x);
            let _v21 = _v2 * _v17 + _v3 * _v19;
            let _v22 = _CURVE_618233D7341B0F65.value(_v6);
            let _v24 = _CURVE_C994445EBDC79BBD.value(_v6);
            let _v28 = _v8 * _v22 + a * _v24 + _CURVE_E1224AD4F7ABE89C.value(_v6);
            let _v37 = _v19 * _v17;
            *::dgd::__runtime::codegen::fixed_mut::<2>(_f) = [
                _v2 * _v3,
                _CURVE_7D63E84F1287598D.value(_v6) + a * _v10 + _v8 * _v13,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_jacobian) = [_v21, _v28];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_dfdt) = [0.0, 0.0];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_g) = [
                _v21 * _s[0],
                _v28 * _s[0] + (_v10 + 2.0 * _v13),
            ];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_dgdy) = [
                (_v2 * _CURVE_07036843808D01F9.value(x) + _v37 + _v37) * _s[0],
                (_CURVE_BAF1F99B17AF57F5.value(_v6)
                    + a * _CURVE_EB3FFAB2D74CAB6B.value(_v6)
                    + _v8 * _CURVE_3D35D2C72D078A32.value(_v6)) * _s[0]
                    + (2.0 * _v22 + _v24),
            ];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_dgdt) = [0.0, 0.0];
        }
        #[inline]
        fn parameter_jacobian(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _values: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let x = _y[0];
            let _v3 = 300.0 + x;
            *::dgd::__runtime::codegen::fixed_mut::<1>(_values) = [
                _CURVE_BFC7E6A0667CD72C.value(_v3)
                    + 2.0 * _CURVE_9100D6412B679B29.value(_v3),
            ];
        }
        #[inline]
        fn input_jacobian(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _values: &mut [f64],
        ) {
            *::dgd::__runtime::codegen::fixed_mut::<0>(_values) = [];
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
            *::dgd::__runtime::codegen::fixed_mut::<0>(_w) = [];
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
            *::dgd::__runtime::codegen::fixed_mut::<0>(_dwdy) = [];
            *::dgd::__runtime::codegen::fixed_mut::<0>(_dwdu) = [];
            *::dgd::__runtime::codegen::fixed_mut::<0>(_dwdp) = [];
            *::dgd::__runtime::codegen::fixed_mut::<0>(_dwdt) = [];
        }
        #[inline]
        fn output_sensitivities(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _s: &[f64],
            _w: &mut [f64],
            _dw: &mut [f64],
        ) {
            *::dgd::__runtime::codegen::fixed_mut::<0>(_w) = [];
            *::dgd::__runtime::codegen::fixed_mut::<0>(_dw) = [];
        }
        #[inline]
        fn start(&self, _at: ::dgd::__runtime::EvaluationPoint<'_>, _y0: &mut [f64]) {
            *::dgd::__runtime::codegen::fixed_mut::<2>(_y0) = [0.5, 1000.0];
        }
        #[inline]
        fn start_sensitivities(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _s0: &mut [f64],
        ) {
            *::dgd::__runtime::codegen::fixed_mut::<2>(_s0) = [0.0, 0.0];
        }
        #[inline]
        fn mass(&self, _at: ::dgd::__runtime::EvaluationPoint<'_>, _mass: &mut [f64]) {
            *::dgd::__runtime::codegen::fixed_mut::<2>(_mass) = [1.0, 1.0];
        }
        #[inline]
        fn event_functions(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _e: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let _z = ::dgd::__runtime::codegen::fixed::<3>(_at.z);
            let x = _y[0];
            let _v4 = _CURVE_0D4E45D9439EF248.value(x) - _z[0];
            let _v8 = _CURVE_990E65693DACB038.value(x) - _z[1];
            *::dgd::__runtime::codegen::fixed_mut::<6>(_e) = [
                _v4 - 1.0,
                _v4,
                _v8 - 1.0,
                _v8,
                x - 1.000001,
                x - -1e-6,
            ];
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
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let x = _y[0];
            let _v3 = _CURVE_DADF86D83DE97DF8.value(x);
            let _v4 = _CURVE_910B2C69320B2368.value(x);
            *::dgd::__runtime::codegen::fixed_mut::<0>(_de) = [];
            *::dgd::__runtime::codegen::fixed_mut::<6>(_dedy) = [
                _v3,
                _v3,
                _v4,
                _v4,
                1.0,
                1.0,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<6>(_dedt) = [
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
            ];
        }
        #[inline]
        fn resets(&self, _at: ::dgd::__runtime::EvaluationPoint<'_>, _r: &mut [f64]) {
            *::dgd::__runtime::codegen::fixed_mut::<0>(_r) = [];
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
            *::dgd::__runtime::codegen::fixed_mut::<0>(_dr) = [];
            *::dgd::__runtime::codegen::fixed_mut::<0>(_drdy) = [];
            *::dgd::__runtime::codegen::fixed_mut::<0>(_drdt) = [];
        }
        #[inline]
        fn taylor_series(
            &self,
        ) -> ::core::result::Result<
            ::dgd::__runtime::taylor::KeptSeries,
            ::dgd::__runtime::taylor::NoTaylorSeries,
        > {
            ::core::result::Result::Ok(::dgd::__runtime::taylor::KeptSeries {
                unknowns: 12,
                sensitivities: 14,
                has_branches: true,
            })
        }
        #[inline]
        fn taylor(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _udot: &[f64],
            _h: f64,
            _order: usize,
            _kept: &mut [::dgd::__runtime::taylor::SeriesTerms],
            _series: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<1>(_at.p);
            let [_c0, _c1, _c2, _c3, _c4, _c5, _c6, _c7, _c8, _c9, _c10, _c11] = ::dgd::__runtime::taylor::kept::<
                12,
            >(_kept);
            let _series = ::dgd::__runtime::taylor::rows::<2>(_series);
            let x = _y[0];
            let _v2 = _CURVE_770D761AC2F20B4A.value(x);
            let _v3 = _CURVE_CAED1217738FFF28.value(x);
            let _v6 = 300.0 + x;
            let a = _p[0];
            let _v8 = 2.0 * a;
            let _v16 = _CURVE_A8A6FA88D07DCDEA.value(x);
            let _v17 = _CURVE_D5998179509F345E.value(x);
            let _v18 = _CURVE_618233D7341B0F65.value(_v6);
            let _v19 = _CURVE_C994445EBDC79BBD.value(_v6);
            let _v20 = _CURVE_E1224AD4F7ABE89C.value(_v6);
            let _v21 = _CURVE_07036843808D01F9.value(x);
            let _v22 = _CURVE_BAF1F99B17AF57F5.value(_v6);
            let _v23 = _CURVE_EB3FFAB2D74CAB6B.value(_v6);
            let _v24 = _CURVE_3D35D2C72D078A32.value(_v6);
            let _v25 = _CURVE_B6D308DC3751A8C1.value(x);
            let _v26 = _CURVE_17C2235D6DF8B963.value(_v6);
            let _v27 = _CURVE_0792A1EE88FA0F97.value(_v6);
            let _v28 = _CURVE_5E6DA538DC1F538E.value(_v6);
            ::dgd::__runtime::taylor::keep(_c0, 0, x);
            ::dgd::__runtime::taylor::keep(_c1, 0, _v2);
            ::dgd::__runtime::taylor::keep(_c2, 0, _v3);
            ::dgd::__runtime::taylor::keep(_c3, 0, _v6);
            ::dgd::__runtime::taylor::keep(_c4, 0, _v16);
            ::dgd::__runtime::taylor::keep(_c5, 0, _v18);
            ::dgd::__runtime::taylor::keep(_c6, 0, _v19);
            ::dgd::__runtime::taylor::keep(_c7, 0, _v20);
            ::dgd::__runtime::taylor::keep(_c8, 0, _v21);
            ::dgd::__runtime::taylor::keep(_c9, 0, _v22);
            ::dgd::__runtime::taylor::keep(_c10, 0, _v23);
            ::dgd::__runtime::taylor::keep(_c11, 0, _v24);
            let _f7 = a;
            let _f8 = _v8;
            let _f17 = _v17;
            let _f25 = _v25;
            let _f26 = _v26;
            let _f27 = _v27;
            let _f28 = _v28;
            let mut _f: [f64; 2] = [
                _v2 * _v3,
                _CURVE_7D63E84F1287598D.value(_v6)
                    + a * _CURVE_BFC7E6A0667CD72C.value(_v6)
                    + _v8 * _CURVE_9100D6412B679B29.value(_v6),
            ];
            _series[0] = *::dgd::__runtime::codegen::fixed::<2>(_at.y);
            for _k in 1..=_order {
                let _per = _h / _k as f64;
                _series[_k] = ::dgd::__runtime::taylor::advance(&_f, _per);
                if _k == _order {
                    break;
                }
                let _d1: f64 = _series[_k][0];
                ::dgd::__runtime::taylor::keep(_c0, _k, _d1);
                let _d2: f64 = _f17 * _d1;
                ::dgd::__runtime::taylor::keep(_c1, _k, _d2);
                let _d3: f64 = ::dgd::__runtime::taylor::chain(_c0, _c4, _k);
                ::dgd::__runtime::taylor::keep(_c2, _k, _d3);
                let _d4: f64 = ::dgd::__runtime::taylor::multiply(_c1, _c2, _k);
                let _d6: f64 = _d1;
                ::dgd::__runtime::taylor::keep(_c3, _k, _d6);
                let _d9: f64 = ::dgd::__runtime::taylor::chain(_c3, _c7, _k);
                let _d10: f64 = ::dgd::__runtime::taylor::chain(_c3, _c6, _k);
                let _d13: f64 = ::dgd::__runtime::taylor::chain(_c3, _c5, _k);
                let _d15: f64 = _d9 + _f7 * _d10 + _f8 * _d13;
                let _d16: f64 = ::dgd::__runtime::taylor::chain(_c0, _c8, _k);
                ::dgd::__runtime::taylor::keep(_c4, _k, _d16);
                let _d18: f64 = ::dgd::__runtime::taylor::chain(_c3, _c11, _k);
                ::dgd::__runtime::taylor::keep(_c5, _k, _d18);
                let _d19: f64 = ::dgd::__runtime::taylor::chain(_c3, _c10, _k);
                ::dgd::__runtime::taylor::keep(_c6, _k, _d19);
                let _d20: f64 = ::dgd::__runtime::taylor::chain(_c3, _c9, _k);
                ::dgd::__runtime::taylor::keep(_c7, _k, _d20);
                let _d21: f64 = _f25 * _d1;
                ::dgd::__runtime::taylor::keep(_c8, _k, _d21);
                let _d22: f64 = _f26 * _d6;
                ::dgd::__runtime::taylor::keep(_c9, _k, _d22);
                let _d23: f64 = _f27 * _d6;
                ::dgd::__runtime::taylor::keep(_c10, _k, _d23);
                let _d24: f64 = _f28 * _d6;
                ::dgd::__runtime::taylor::keep(_c11, _k, _d24);
                _f = [_d4, _d15];
            }
        }
        #[inline]
        fn sensitivity_taylor(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _udot: &[f64],
            _h: f64,
            _order: usize,
            _kept: &mut [::dgd::__runtime::taylor::SeriesTerms],
            _series: &mut [f64],
            _s: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<1>(_at.p);
            let [_c0, _c1, _c2, _c3, _c4, _c5, _c6, _c7, _c8, _c9, _c10, _c11, _c12, _c13,
            ] = ::dgd::__runtime::taylor::kept::<14>(_kept);
            let _series = ::dgd::__runtime::taylor::rows::<2>(_series);
            let _s = ::dgd::__runtime::taylor::rows::<1>(_s);
            let mut _g = [[0.0; 1]; 2];
            let x = _y[0];
            let _v2 = _CURVE_770D761AC2F20B4A.value(x);
            let _v3 = _CURVE_CAED1217738FFF28.value(x);
            let _v6 = 300.0 + x;
            let a = _p[0];
            let _v8 = 2.0 * a;
            let _v10 = _CURVE_BFC7E6A0667CD72C.value(_v6);
            let _v13 = _CURVE_9100D6412B679B29.value(_v6);
            let _v16 = _CURVE_A8A6FA88D07DCDEA.value(x);
            let _v18 = _CURVE_D5998179509F345E.value(x);
            let _v20 = _v2 * _v16 + _v3 * _v18;
            let _v21 = _CURVE_618233D7341B0F65.value(_v6);
            let _v23 = _CURVE_C994445EBDC79BBD.value(_v6);
            let _v26 = _CURVE_E1224AD4F7ABE89C.value(_v6);
            let _v27 = _v8 * _v21 + a * _v23 + _v26;
            let _v30 = _CURVE_07036843808D01F9.value(x);
            let _v31 = _CURVE_BAF1F99B17AF57F5.value(_v6);
            let _v32 = _CURVE_EB3FFAB2D74CAB6B.value(_v6);
            let _v33 = _CURVE_3D35D2C72D078A32.value(_v6);
            let _v34 = _CURVE_B6D308DC3751A8C1.value(x);
            let _v35 = _CURVE_17C2235D6DF8B963.value(_v6);
            let _v36 = _CURVE_0792A1EE88FA0F97.value(_v6);
            let _v37 = _CURVE_5E6DA538DC1F538E.value(_v6);
            ::dgd::__runtime::taylor::keep(_c0, 0, x);
            ::dgd::__runtime::taylor::keep(_c1, 0, _v2);
            ::dgd::__runtime::taylor::keep(_c2, 0, _v3);
            ::dgd::__runtime::taylor::keep(_c3, 0, _v6);
            ::dgd::__runtime::taylor::keep(_c4, 0, _v16);
            ::dgd::__runtime::taylor::keep(_c5, 0, _v20);
            ::dgd::__runtime::taylor::keep(_c6, 0, _v21);
            ::dgd::__runtime::taylor::keep(_c7, 0, _v23);
            ::dgd::__runtime::taylor::keep(_c8, 0, _v26);
            ::dgd::__runtime::taylor::keep(_c9, 0, _v27);
            ::dgd::__runtime::taylor::keep(_c10, 0, _v30);
            ::dgd::__runtime::taylor::keep(_c11, 0, _v31);
            ::dgd::__runtime::taylor::keep(_c12, 0, _v32);
            ::dgd::__runtime::taylor::keep(_c13, 0, _v33);
            let _f0 = 2.0;
            let _f7 = a;
            let _f8 = _v8;
            let _f18 = _v18;
            let _f34 = _v34;
            let _f35 = _v35;
            let _f36 = _v36;
            let _f37 = _v37;
            let mut _f: [f64; 2] = [
                _v2 * _v3,
                _CURVE_7D63E84F1287598D.value(_v6) + a * _v10 + _v8 * _v13,
            ];
            let _row = &mut _g[0];
            *_row = [0.0; 1];
            ::dgd::__runtime::taylor::add_scaled(_row, _v20, &_s[0]);
            let _row = &mut _g[1];
            *_row = [0.0; 1];
            ::dgd::__runtime::taylor::add_scaled(_row, _v27, &_s[0]);
            _row[0] += _v10 + 2.0 * _v13;
            _series[0] = *::dgd::__runtime::codegen::fixed::<2>(_at.y);
            for _k in 1..=_order {
                let _per = _h / _k as f64;
                _series[_k] = ::dgd::__runtime::taylor::advance(&_f, _per);
                _s[_k * 2 + 0] = ::dgd::__runtime::taylor::advance(&_g[0], _per);
                _s[_k * 2 + 1] = ::dgd::__runtime::taylor::advance(&_g[1], _per);
                if _k == _order {
                    break;
                }
                let _d1: f64 = _series[_k][0];
                ::dgd::__runtime::taylor::keep(_c0, _k, _d1);
                let _d2: f64 = _f18 * _d1;
                ::dgd::__runtime::taylor::keep(_c1, _k, _d2);
                let _d3: f64 = ::dgd::__runtime::taylor::chain(_c0, _c4, _k);
                ::dgd::__runtime::taylor::keep(_c2, _k, _d3);
                let _d4: f64 = ::dgd::__runtime::taylor::multiply(_c1, _c2, _k);
                let _d6: f64 = _d1;
                ::dgd::__runtime::taylor::keep(_c3, _k, _d6);
                let _d9: f64 = ::dgd::__runtime::taylor::chain(_c3, _c8, _k);
                let _d10: f64 = ::dgd::__runtime::taylor::chain(_c3, _c7, _k);
                let _d13: f64 = ::dgd::__runtime::taylor::chain(_c3, _c6, _k);
                let _d15: f64 = _d9 + _f7 * _d10 + _f8 * _d13;
                let _d16: f64 = ::dgd::__runtime::taylor::chain(_c0, _c10, _k);
                ::dgd::__runtime::taylor::keep(_c4, _k, _d16);
                let _d17: f64 = ::dgd::__runtime::taylor::multiply(_c1, _c4, _k);
                let _d20: f64 = _f18 * _d3 + _d17;
                ::dgd::__runtime::taylor::keep(_c5, _k, _d20);
                let _d21: f64 = ::dgd::__runtime::taylor::chain(_c3, _c13, _k);
                ::dgd::__runtime::taylor::keep(_c6, _k, _d21);
                let _d23: f64 = ::dgd::__runtime::taylor::chain(_c3, _c12, _k);
                ::dgd::__runtime::taylor::keep(_c7, _k, _d23);
                let _d26: f64 = ::dgd::__runtime::taylor::chain(_c3, _c11, _k);
                ::dgd::__runtime::taylor::keep(_c8, _k, _d26);
                let _d27: f64 = _f8 * _d21 + _f7 * _d23 + _d26;
                ::dgd::__runtime::taylor::keep(_c9, _k, _d27);
                let _d29: f64 = _d10 + _f0 * _d13;
                let _d30: f64 = _f34 * _d1;
                ::dgd::__runtime::taylor::keep(_c10, _k, _d30);
                let _d31: f64 = _f35 * _d6;
                ::dgd::__runtime::taylor::keep(_c11, _k, _d31);
                let _d32: f64 = _f36 * _d6;
                ::dgd::__runtime::taylor::keep(_c12, _k, _d32);
                let _d33: f64 = _f37 * _d6;
                ::dgd::__runtime::taylor::keep(_c13, _k, _d33);
                _f = [_d4, _d15];
                let _row = &mut _g[0];
                *_row = [0.0; 1];
                ::dgd::__runtime::taylor::add_product(_row, _c5, _s, 2, 0, _k);
                let _row = &mut _g[1];
                *_row = [0.0; 1];
                ::dgd::__runtime::taylor::add_product(_row, _c9, _s, 2, 0, _k);
                _row[0] += _d29;
            }
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
