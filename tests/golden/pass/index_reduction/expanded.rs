/// A bead on a ring, its voltage against a probe through a capacitor.
#[allow(
    non_snake_case,
    unused_variables,
    unused_doc_comments,
    dead_code,
    clippy::all,
    clippy::pedantic
)]
pub mod bead {
    /// The model `bead`.
    #[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
    pub struct Model;
    /// Parameters p; the default is the model file's. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Parameters {}
    #[automatically_derived]
    impl ::core::default::Default for Parameters {
        fn default() -> Self {
            Parameters {}
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Parameters> for [f64; 0] {
        fn from(named: Parameters) -> [f64; 0] {
            []
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<&Parameters> for ::dgd::__runtime::codegen::HeapNumbers {
        fn from(named: &Parameters) -> ::dgd::__runtime::codegen::HeapNumbers {
            <[f64; 0]>::from(*named).to_vec()
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 0]> for Parameters {
        fn from([]: [f64; 0]) -> Parameters {
            Parameters {}
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
        /// [m]
        pub y: f64,
        /// [m/s]
        pub v_x: f64,
        /// [m/s]
        pub v_y: f64,
        /// of the ring, over mass and radius
        ///
        /// [1/s^2]
        pub push: f64,
        /// [V]
        pub u_1: f64,
        /// [V]
        pub u_2: f64,
        /// [V]
        pub _u_1_minus_u_2: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Unknowns {
        fn default() -> Self {
            Unknowns {
                x: 0.0,
                y: 0.0,
                v_x: 0.0,
                v_y: 0.0,
                push: 0.0,
                u_1: 0.0,
                u_2: 0.0,
                _u_1_minus_u_2: 0.0,
            }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Unknowns> for [f64; 8] {
        fn from(named: Unknowns) -> [f64; 8] {
            [
                named.x,
                named.y,
                named.v_x,
                named.v_y,
                named.push,
                named.u_1,
                named.u_2,
                named._u_1_minus_u_2,
            ]
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<&Unknowns> for ::dgd::__runtime::codegen::HeapNumbers {
        fn from(named: &Unknowns) -> ::dgd::__runtime::codegen::HeapNumbers {
            <[f64; 8]>::from(*named).to_vec()
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 8]> for Unknowns {
        fn from([x, y, v_x, v_y, push, u_1, u_2, _u_1_minus_u_2]: [f64; 8]) -> Unknowns {
            Unknowns {
                x,
                y,
                v_x,
                v_y,
                push,
                u_1,
                u_2,
                _u_1_minus_u_2,
            }
        }
    }
    /// Outputs w. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Outputs {
        /// [m]
        pub x: f64,
        /// [m/s^2], declared in N/kg
        pub force: f64,
        /// [m/s]
        pub velocity: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Outputs {
        fn default() -> Self {
            Outputs {
                x: 0.0,
                force: 0.0,
                velocity: 0.0,
            }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Outputs> for [f64; 3] {
        fn from(named: Outputs) -> [f64; 3] {
            [named.x, named.force, named.velocity]
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<&Outputs> for ::dgd::__runtime::codegen::HeapNumbers {
        fn from(named: &Outputs) -> ::dgd::__runtime::codegen::HeapNumbers {
            <[f64; 3]>::from(*named).to_vec()
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 3]> for Outputs {
        fn from([x, force, velocity]: [f64; 3]) -> Outputs {
            Outputs { x, force, velocity }
        }
    }
    static SIGNATURE: ::dgd::__runtime::signature::Signature = {
        #[allow(unused_imports)]
        use ::dgd::__runtime::signature::{arrays::*, *};
        Signature {
            name: Text::Borrowed("bead"),
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
                            symbol: Text::Borrowed("m"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        nominal: ::core::option::Option::None,
                        differential: false,
                    },
                    Unknown {
                        name: Text::Borrowed("v_x"),
                        unit: Unit {
                            symbol: Text::Borrowed("m/s"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        nominal: ::core::option::Option::None,
                        differential: true,
                    },
                    Unknown {
                        name: Text::Borrowed("v_y"),
                        unit: Unit {
                            symbol: Text::Borrowed("m/s"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        nominal: ::core::option::Option::None,
                        differential: false,
                    },
                    Unknown {
                        name: Text::Borrowed("push"),
                        unit: Unit {
                            symbol: Text::Borrowed("1/s^2"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        nominal: ::core::option::Option::None,
                        differential: false,
                    },
                    Unknown {
                        name: Text::Borrowed("u_1"),
                        unit: Unit {
                            symbol: Text::Borrowed("V"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        nominal: ::core::option::Option::None,
                        differential: false,
                    },
                    Unknown {
                        name: Text::Borrowed("u_2"),
                        unit: Unit {
                            symbol: Text::Borrowed("V"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        nominal: ::core::option::Option::None,
                        differential: false,
                    },
                    Unknown {
                        name: Text::Borrowed("u_1 - u_2"),
                        unit: Unit {
                            symbol: Text::Borrowed("V"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        nominal: ::core::option::Option::None,
                        differential: true,
                    },
                ],
            ),
            equations: Labels::single(
                &[
                    Text::Borrowed("right / ring"),
                    Text::Borrowed("ring / up"),
                    Text::Borrowed("der(ring) / force_x"),
                    Text::Borrowed("der(ring) / force_y"),
                    Text::Borrowed("der(der(ring))"),
                    Text::Borrowed("bead"),
                    Text::Borrowed("probe"),
                    Text::Borrowed("bead"),
                ],
            ),
            parameters: List::Borrowed(&[]),
            inputs: List::Borrowed(&[]),
            delays: List::Borrowed(&[]),
            varying_delays: List::Borrowed(&[]),
            delayed_inputs: List::Borrowed(&[]),
            delayed_unknowns: List::Borrowed(&[]),
            differentiated_inputs: List::Borrowed(&[]),
            outputs: List::Borrowed(
                &[
                    Output {
                        name: Text::Borrowed("x"),
                        unit: Unit {
                            symbol: Text::Borrowed("m"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        noise: ::core::option::Option::None,
                        delay: ::core::option::Option::None,
                    },
                    Output {
                        name: Text::Borrowed("force"),
                        unit: Unit {
                            symbol: Text::Borrowed("N/kg"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        noise: ::core::option::Option::None,
                        delay: ::core::option::Option::None,
                    },
                    Output {
                        name: Text::Borrowed("velocity"),
                        unit: Unit {
                            symbol: Text::Borrowed("m/s"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        noise: ::core::option::Option::None,
                        delay: ::core::option::Option::None,
                    },
                ],
            ),
            directions: List::Borrowed(&[]),
            jacobian: Pattern::single(
                &[
                    0, 1, 2, 3, 4, 0, 1, 2, 3, 4, 0, 2, 3, 4, 1, 2, 3, 4, 2, 3, 4, 5, 6,
                    7, 5, 6, 5,
                ],
                &[
                    0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 4, 5, 5,
                    5, 6, 6, 7,
                ],
            ),
            sensitivity_jacobian: Pattern::single(&[], &[]),
            parameter_jacobian: Pattern::single(&[], &[]),
            input_jacobian: Pattern::single(&[], &[]),
            output_jacobians: [
                Pattern::single(&[0, 2, 1], &[0, 3, 4]),
                Pattern::single(&[], &[]),
                Pattern::single(&[], &[]),
            ],
            discrete: Discrete {
                automata: List::Borrowed(
                    &[
                        Automaton {
                            kind: AutomatonKind::States,
                            name: Text::Borrowed("states of ring"),
                            modes: List::Borrowed(
                                &[Text::Borrowed("x, v_x"), Text::Borrowed("y, v_y")],
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
                                        crossing: Crossing::Rises,
                                        trigger: Trigger::Level,
                                        resets: List::Borrowed(&[]),
                                    },
                                ],
                            ),
                        },
                    ],
                ),
                n_time_conditions: 0,
                event_jacobian: Pattern::single(&[0, 1, 0, 1], &[0, 0, 1, 1]),
                reset_jacobian: Pattern::single(&[], &[]),
            },
        }
    };
    #[automatically_derived]
    impl ::dgd::__runtime::System for Model {
        type Vector = [f64; 8];
        type Sensitivity = [f64; 0];
        type Inputs = [f64; 0];
        type Jacobian = [f64; 27];
        type SensitivityJacobian = [f64; 0];
        type Factorisation = ::dgd::__runtime::linalg::FixedLu<8>;
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
            let _y = ::dgd::__runtime::codegen::fixed::<8>(_at.y);
            let _z = ::dgd::__runtime::codegen::fixed::<1>(_at.z);
            let v_x = _y[2];
            let v_y = _y[3];
            let push = _y[4];
            let x = _y[0];
            let _v5 = push * x;
            let y = _y[1];
            let _v11 = -(push * y) - 9.81;
            let u_1 = _y[5];
            let _v18 = 1.0 - u_1;
            let u_2 = _y[6];
            let _v22 = 0.25 - (x * x + y * y);
            let _u_1_minus_u_2 = _y[7];
            let _v31 = -2.0 * y;
            let _v32 = -2.0 * x;
            let _v35 = _v32 * v_x + _v31 * v_y;
            let _v46 = (_z[0] < 0.5);
            /// `right / ring` (model.dgd:17): 0 or der(x) =
            let _row_0: f64 = if _v46 { v_x } else { _v22 };
            /// `ring / up` (model.dgd:21): 0 or der(y) =
            let _row_1: f64 = if _v46 { _v22 } else { v_y };
            /// `der(ring) / force_x` (model.dgd:19): 0 or der(v_x) =
            let _row_2: f64 = if _v46 { -_v5 } else { _v35 };
            /// `der(ring) / force_y` (model.dgd:21): 0 or der(v_y) =
            let _row_3: f64 = if _v46 { _v35 } else { _v11 };
            /// `der(der(ring))` (model.dgd:21): 0 =
            let _row_4: f64 = -2.0 * v_x * v_x + -2.0 * v_y * v_y - _v32 * _v5
                + _v31 * _v11;
            /// `bead` (model.dgd:23): 0 =
            let _row_5: f64 = u_1 - u_2 - _u_1_minus_u_2;
            /// `probe` (model.dgd:24): 0 =
            let _row_6: f64 = -0.0001 * u_2 - -0.0001 * _v18;
            /// `bead` (model.dgd:23): der(u_1 - u_2) =
            let _row_7: f64 = 50.0 * _v18;
            *::dgd::__runtime::codegen::fixed_mut::<8>(_f) = [
                _row_0,
                _row_1,
                _row_2,
                _row_3,
                _row_4,
                _row_5,
                _row_6,
                _row_7,
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
            let _y = ::dgd::__runtime::codegen::fixed::<8>(_at.y);
            let _z = ::dgd::__runtime::codegen::fixed::<1>(_at.z);
            let v_x = _y[2];
            let v_y = _y[3];
            let push = _y[4];
            let _v6 = -push;
            let x = _y[0];
            let _v8 = push * x;
            let y = _y[1];
            let _v14 = -(push * y) - 9.81;
            let u_1 = _y[5];
            let _v21 = 1.0 - u_1;
            let u_2 = _y[6];
            let _v25 = 0.25 - (x * x + y * y);
            let _u_1_minus_u_2 = _y[7];
            let _v34 = -y;
            let _v35 = 2.0 * y;
            let _v37 = -2.0 * y;
            let _v38 = -x;
            let _v39 = 2.0 * x;
            let _v40 = -2.0 * x;
            let _v43 = _v40 * v_x + _v37 * v_y;
            let _v44 = -2.0 * v_x;
            let _v45 = -2.0 * v_y;
            let _v54 = (_z[0] < 0.5);
            let _v61 = if _v54 { 0.0 } else { _v34 };
            let _v67 = if _v54 { _v38 } else { 0.0 };
            *::dgd::__runtime::codegen::fixed_mut::<8>(_f) = [
                if _v54 { v_x } else { _v25 },
                if _v54 { _v25 } else { v_y },
                if _v54 { -_v8 } else { _v43 },
                if _v54 { _v43 } else { _v14 },
                _v44 * v_x + _v45 * v_y - _v40 * _v8 + _v37 * _v14,
                u_1 - u_2 - _u_1_minus_u_2,
                -0.0001 * u_2 - -0.0001 * _v21,
                50.0 * _v21,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<27>(_jacobian) = [
                2.0 * (if _v54 { 0.0 } else { _v38 }),
                2.0 * _v67,
                (if _v54 { 0.0 } else { _v44 }) + (if _v54 { _v6 } else { 0.0 }),
                if _v54 { _v44 } else { 0.0 },
                2.0 * _v8 + _v39 * push,
                2.0 * _v61,
                2.0 * (if _v54 { _v34 } else { 0.0 }),
                if _v54 { 0.0 } else { _v45 },
                (if _v54 { _v45 } else { 0.0 }) + (if _v54 { 0.0 } else { _v6 }),
                -2.0 * _v14 + _v35 * push,
                if _v54 { 1.0 } else { 0.0 },
                if _v54 { 0.0 } else { _v40 },
                if _v54 { _v40 } else { 0.0 },
                -4.0 * v_x,
                if _v54 { 0.0 } else { 1.0 },
                if _v54 { 0.0 } else { _v37 },
                if _v54 { _v37 } else { 0.0 },
                -4.0 * v_y,
                _v67,
                _v61,
                _v35 * y + _v39 * x,
                1.0,
                -0.0001,
                -50.0,
                -1.0,
                -0.0001,
                -1.0,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<8>(_dfdt) = [
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
        fn sensitivity_rhs(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _s: &[f64],
            _f: &mut [f64],
            _g: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<8>(_at.y);
            let _z = ::dgd::__runtime::codegen::fixed::<1>(_at.z);
            let v_x = _y[2];
            let v_y = _y[3];
            let push = _y[4];
            let x = _y[0];
            let _v5 = push * x;
            let y = _y[1];
            let _v11 = -(push * y) - 9.81;
            let u_1 = _y[5];
            let _v18 = 1.0 - u_1;
            let u_2 = _y[6];
            let _v22 = 0.25 - (x * x + y * y);
            let _u_1_minus_u_2 = _y[7];
            let _v31 = -2.0 * y;
            let _v32 = -2.0 * x;
            let _v35 = _v32 * v_x + _v31 * v_y;
            let _v46 = (_z[0] < 0.5);
            *::dgd::__runtime::codegen::fixed_mut::<8>(_f) = [
                if _v46 { v_x } else { _v22 },
                if _v46 { _v22 } else { v_y },
                if _v46 { -_v5 } else { _v35 },
                if _v46 { _v35 } else { _v11 },
                -2.0 * v_x * v_x + -2.0 * v_y * v_y - _v32 * _v5 + _v31 * _v11,
                u_1 - u_2 - _u_1_minus_u_2,
                -0.0001 * u_2 - -0.0001 * _v18,
                50.0 * _v18,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<0>(_g) = [];
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
            let _y = ::dgd::__runtime::codegen::fixed::<8>(_at.y);
            let _z = ::dgd::__runtime::codegen::fixed::<1>(_at.z);
            let v_x = _y[2];
            let v_y = _y[3];
            let push = _y[4];
            let _v6 = -push;
            let x = _y[0];
            let _v8 = push * x;
            let y = _y[1];
            let _v14 = -(push * y) - 9.81;
            let u_1 = _y[5];
            let _v21 = 1.0 - u_1;
            let u_2 = _y[6];
            let _v25 = 0.25 - (x * x + y * y);
            let _u_1_minus_u_2 = _y[7];
            let _v34 = -y;
            let _v35 = 2.0 * y;
            let _v37 = -2.0 * y;
            let _v38 = -x;
            let _v39 = 2.0 * x;
            let _v40 = -2.0 * x;
            let _v43 = _v40 * v_x + _v37 * v_y;
            let _v44 = -2.0 * v_x;
            let _v45 = -2.0 * v_y;
            let _v54 = (_z[0] < 0.5);
            let _v61 = if _v54 { 0.0 } else { _v34 };
            let _v67 = if _v54 { _v38 } else { 0.0 };
            *::dgd::__runtime::codegen::fixed_mut::<8>(_f) = [
                if _v54 { v_x } else { _v25 },
                if _v54 { _v25 } else { v_y },
                if _v54 { -_v8 } else { _v43 },
                if _v54 { _v43 } else { _v14 },
                _v44 * v_x + _v45 * v_y - _v40 * _v8 + _v37 * _v14,
                u_1 - u_2 - _u_1_minus_u_2,
                -0.0001 * u_2 - -0.0001 * _v21,
                50.0 * _v21,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<27>(_jacobian) = [
                2.0 * (if _v54 { 0.0 } else { _v38 }),
                2.0 * _v67,
                (if _v54 { 0.0 } else { _v44 }) + (if _v54 { _v6 } else { 0.0 }),
                if _v54 { _v44 } else { 0.0 },
                2.0 * _v8 + _v39 * push,
                2.0 * _v61,
                2.0 * (if _v54 { _v34 } else { 0.0 }),
                if _v54 { 0.0 } else { _v45 },
                (if _v54 { _v45 } else { 0.0 }) + (if _v54 { 0.0 } else { _v6 }),
                -2.0 * _v14 + _v35 * push,
                if _v54 { 1.0 } else { 0.0 },
                if _v54 { 0.0 } else { _v40 },
                if _v54 { _v40 } else { 0.0 },
                -4.0 * v_x,
                if _v54 { 0.0 } else { 1.0 },
                if _v54 { 0.0 } else { _v37 },
                if _v54 { _v37 } else { 0.0 },
                -4.0 * v_y,
                _v67,
                _v61,
                _v35 * y + _v39 * x,
                1.0,
                -0.0001,
                -50.0,
                -1.0,
                -0.0001,
                -1.0,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<8>(_dfdt) = [
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<0>(_g) = [];
            *::dgd::__runtime::codegen::fixed_mut::<0>(_dgdy) = [];
            *::dgd::__runtime::codegen::fixed_mut::<0>(_dgdt) = [];
        }
        #[inline]
        fn parameter_jacobian(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _values: &mut [f64],
        ) {
            *::dgd::__runtime::codegen::fixed_mut::<0>(_values) = [];
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
            *::dgd::__runtime::codegen::fixed_mut::<8>(_values) = [
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
        fn outputs(&self, _at: ::dgd::__runtime::Point<'_>, _w: &mut [f64]) {
            let _y = ::dgd::__runtime::codegen::fixed::<8>(_at.y);
            let v_y = _y[3];
            let push = _y[4];
            let x = _y[0];
            *::dgd::__runtime::codegen::fixed_mut::<3>(_w) = [x, 0.5 * push, v_y];
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
            *::dgd::__runtime::codegen::fixed_mut::<3>(_dwdy) = [1.0, 1.0, 0.5];
            *::dgd::__runtime::codegen::fixed_mut::<0>(_dwdu) = [];
            *::dgd::__runtime::codegen::fixed_mut::<0>(_dwdp) = [];
            *::dgd::__runtime::codegen::fixed_mut::<3>(_dwdt) = [0.0, 0.0, 0.0];
        }
        #[inline]
        fn output_sensitivities(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _s: &[f64],
            _w: &mut [f64],
            _dw: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<8>(_at.y);
            let v_y = _y[3];
            let push = _y[4];
            let x = _y[0];
            *::dgd::__runtime::codegen::fixed_mut::<3>(_w) = [x, 0.5 * push, v_y];
            *::dgd::__runtime::codegen::fixed_mut::<0>(_dw) = [];
        }
        #[inline]
        fn start(&self, _at: ::dgd::__runtime::Point<'_>, _y0: &mut [f64]) {
            *::dgd::__runtime::codegen::fixed_mut::<8>(_y0) = [
                0.3,
                -0.4,
                0.0,
                0.0,
                0.0,
                1.0,
                0.0,
                1.0,
            ];
        }
        #[inline]
        fn start_sensitivities(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _s0: &mut [f64],
        ) {
            *::dgd::__runtime::codegen::fixed_mut::<0>(_s0) = [];
        }
        #[inline]
        fn mass(&self, _at: ::dgd::__runtime::Point<'_>, _mass: &mut [f64]) {
            let _z = ::dgd::__runtime::codegen::fixed::<1>(_at.z);
            let _v4 = (_z[0] < 0.5);
            let _v5 = if _v4 { 1.0 } else { 0.0 };
            let _v6 = if _v4 { 0.0 } else { 1.0 };
            *::dgd::__runtime::codegen::fixed_mut::<8>(_mass) = [
                _v5,
                _v6,
                _v5,
                _v6,
                0.0,
                0.0,
                0.0,
                1.0,
            ];
        }
        #[inline]
        fn event_functions(&self, _at: ::dgd::__runtime::Point<'_>, _e: &mut [f64]) {
            let _y = ::dgd::__runtime::codegen::fixed::<8>(_at.y);
            let x = _y[0];
            let y = _y[1];
            let _v3 = -2.0 * y;
            let _v4 = -2.0 * x;
            let _v5 = _v3 * _v3;
            let _v6 = _v4 * _v4;
            *::dgd::__runtime::codegen::fixed_mut::<2>(_e) = [
                _v6 - 4.0 * _v5,
                _v5 - 4.0 * _v6,
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
            let _y = ::dgd::__runtime::codegen::fixed::<8>(_at.y);
            let x = _y[0];
            let y = _y[1];
            *::dgd::__runtime::codegen::fixed_mut::<0>(_de) = [];
            *::dgd::__runtime::codegen::fixed_mut::<4>(_dedy) = [
                8.0 * x,
                -32.0 * x,
                -32.0 * y,
                8.0 * y,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_dedt) = [0.0, 0.0];
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
