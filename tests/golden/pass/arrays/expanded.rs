/// Cells in a row, with a feed.
#[allow(
    non_snake_case,
    unused_variables,
    unused_doc_comments,
    dead_code,
    clippy::all,
    clippy::pedantic
)]
pub mod cells {
    /// The model `cells`.
    #[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
    pub struct Model;
    /// Parameters p; the default is the model file's. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Parameters {
        /// [1/s]
        pub k: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Parameters {
        fn default() -> Self {
            Parameters { k: 2.0 }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Parameters> for [f64; 1] {
        fn from(named: Parameters) -> [f64; 1] {
            [named.k]
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
        fn from([k]: [f64; 1]) -> Parameters {
            Parameters { k }
        }
    }
    /// Inputs u. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Inputs {
        /// [1]
        pub feed: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Inputs {
        fn default() -> Self {
            Inputs { feed: 0.0 }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Inputs> for [f64; 1] {
        fn from(named: Inputs) -> [f64; 1] {
            [named.feed]
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
        fn from([feed]: [f64; 1]) -> Inputs {
            Inputs { feed }
        }
    }
    /// Unknowns y. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Unknowns {
        /// [1]
        pub held: f64,
        /// what is in each cell
        ///
        /// [1]
        pub x: [f64; 40],
        /// [1]
        pub y: [f64; 41],
    }
    #[automatically_derived]
    impl ::core::default::Default for Unknowns {
        fn default() -> Self {
            Unknowns {
                held: 0.0,
                x: [0.0; 40],
                y: [0.0; 41],
            }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Unknowns> for [f64; 82] {
        fn from(named: Unknowns) -> [f64; 82] {
            let mut all = [0.0; 82];
            all[0] = named.held;
            all[1..41].copy_from_slice(&named.x);
            all[41..82].copy_from_slice(&named.y);
            all
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<&Unknowns> for ::dgd::__runtime::codegen::HeapNumbers {
        fn from(named: &Unknowns) -> ::dgd::__runtime::codegen::HeapNumbers {
            <[f64; 82]>::from(*named).to_vec()
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 82]> for Unknowns {
        fn from(all: [f64; 82]) -> Unknowns {
            Unknowns {
                held: all[0],
                x: *::dgd::__runtime::codegen::fixed::<40>(&all[1..41]),
                y: *::dgd::__runtime::codegen::fixed::<41>(&all[41..82]),
            }
        }
    }
    /// Outputs w. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Outputs {
        /// [1]
        pub last: f64,
        /// [1]
        pub x: [f64; 40],
    }
    #[automatically_derived]
    impl ::core::default::Default for Outputs {
        fn default() -> Self {
            Outputs { last: 0.0, x: [0.0; 40] }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Outputs> for [f64; 41] {
        fn from(named: Outputs) -> [f64; 41] {
            let mut all = [0.0; 41];
            all[0] = named.last;
            all[1..41].copy_from_slice(&named.x);
            all
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<&Outputs> for ::dgd::__runtime::codegen::HeapNumbers {
        fn from(named: &Outputs) -> ::dgd::__runtime::codegen::HeapNumbers {
            <[f64; 41]>::from(*named).to_vec()
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 41]> for Outputs {
        fn from(all: [f64; 41]) -> Outputs {
            Outputs {
                last: all[0],
                x: *::dgd::__runtime::codegen::fixed::<40>(&all[1..41]),
            }
        }
    }
    static SIGNATURE: ::dgd::__runtime::codegen::Lazy<
        ::dgd::__runtime::signature::Signature,
    > = {
        #[allow(unused_imports)]
        use ::dgd::__runtime::signature::{arrays::*, *};
        ::dgd::__runtime::codegen::Lazy::new(|| with_arrays(
            Signature {
                name: Text::Borrowed("cells"),
                unknowns: Unknowns::single(
                    &[
                        Unknown {
                            name: Text::Borrowed("held"),
                            unit: Unit {
                                symbol: Text::Borrowed("1"),
                                factor: 1.0,
                                offset: 0.0,
                            },
                            nominal: ::core::option::Option::None,
                            differential: true,
                        },
                    ],
                ),
                equations: Labels::single(&[Text::Borrowed("memory")]),
                parameters: List::Borrowed(
                    &[
                        Parameter {
                            name: Text::Borrowed("k"),
                            unit: Unit {
                                symbol: Text::Borrowed("1/s"),
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
                    ],
                ),
                inputs: List::Borrowed(
                    &[
                        Input {
                            name: Text::Borrowed("feed"),
                            unit: Unit {
                                symbol: Text::Borrowed("1"),
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
                            name: Text::Borrowed("last"),
                            unit: Unit {
                                symbol: Text::Borrowed("1"),
                                factor: 1.0,
                                offset: 0.0,
                            },
                            noise: ::core::option::Option::Some(0.1),
                            delay: ::core::option::Option::None,
                        },
                    ],
                ),
                directions: List::Borrowed(&[Direction::Parameter(0)]),
                jacobian: Pattern::single(
                    &[0, 44, 44, 41, 44, 0],
                    &[0, 0, 3, 41, 44, 81],
                ),
                sensitivity_jacobian: Pattern::single(&[0, 44, 0], &[0, 3, 81]),
                parameter_jacobian: Pattern::single(&[0], &[0]),
                input_jacobian: Pattern::single(&[41], &[0]),
                output_jacobians: [
                    Pattern::single(&[0], &[40]),
                    Pattern::single(&[], &[]),
                    Pattern::single(&[], &[]),
                ],
                discrete: Discrete::NONE,
            },
            &Arrays {
                arrays: List::Borrowed(
                    &[
                        Array {
                            name: Text::Borrowed("x"),
                            lower: 1,
                            count: 40,
                            unit: Unit {
                                symbol: Text::Borrowed("1"),
                                factor: 1.0,
                                offset: 0.0,
                            },
                            nominal: ::core::option::Option::None,
                        },
                        Array {
                            name: Text::Borrowed("y"),
                            lower: 0,
                            count: 41,
                            unit: Unit {
                                symbol: Text::Borrowed("1"),
                                factor: 1.0,
                                offset: 0.0,
                            },
                            nominal: ::core::option::Option::Some(2.0),
                        },
                    ],
                ),
                families: List::Borrowed(
                    &[
                        Family {
                            count: 40,
                            differential: true,
                            equation: Text::Borrowed("cell"),
                            lower: ::core::option::Option::Some(1),
                        },
                        Family {
                            count: 1,
                            differential: false,
                            equation: Text::Borrowed("left"),
                            lower: ::core::option::Option::None,
                        },
                        Family {
                            count: 2,
                            differential: false,
                            equation: Text::Borrowed("share"),
                            lower: ::core::option::Option::Some(1),
                        },
                        Family {
                            count: 1,
                            differential: false,
                            equation: Text::Borrowed("share"),
                            lower: ::core::option::Option::Some(3),
                        },
                        Family {
                            count: 37,
                            differential: false,
                            equation: Text::Borrowed("share"),
                            lower: ::core::option::Option::Some(4),
                        },
                    ],
                ),
                outputs: List::Borrowed(
                    &[
                        OutputArray {
                            name: Text::Borrowed("x"),
                            lower: 1,
                            count: 40,
                            unit: Unit {
                                symbol: Text::Borrowed("1"),
                                factor: 1.0,
                                offset: 0.0,
                            },
                            noise: ::core::option::Option::None,
                        },
                    ],
                ),
                runs: [
                    List::Borrowed(
                        &[
                            Run {
                                row: 1,
                                column: 41,
                                diagonal: true,
                                count: 40,
                            },
                            Run {
                                row: 1,
                                column: 42,
                                diagonal: true,
                                count: 40,
                            },
                            Run {
                                row: 42,
                                column: 0,
                                diagonal: false,
                                count: 2,
                            },
                            Run {
                                row: 42,
                                column: 3,
                                diagonal: false,
                                count: 2,
                            },
                            Run {
                                row: 42,
                                column: 1,
                                diagonal: true,
                                count: 2,
                            },
                            Run {
                                row: 42,
                                column: 42,
                                diagonal: true,
                                count: 2,
                            },
                            Run {
                                row: 45,
                                column: 0,
                                diagonal: false,
                                count: 37,
                            },
                            Run {
                                row: 45,
                                column: 3,
                                diagonal: false,
                                count: 37,
                            },
                            Run {
                                row: 45,
                                column: 4,
                                diagonal: true,
                                count: 37,
                            },
                            Run {
                                row: 45,
                                column: 45,
                                diagonal: true,
                                count: 37,
                            },
                        ],
                    ),
                    List::Borrowed(
                        &[
                            Run {
                                row: 1,
                                column: 41,
                                diagonal: true,
                                count: 40,
                            },
                            Run {
                                row: 1,
                                column: 42,
                                diagonal: true,
                                count: 40,
                            },
                            Run {
                                row: 42,
                                column: 3,
                                diagonal: false,
                                count: 2,
                            },
                            Run {
                                row: 42,
                                column: 1,
                                diagonal: true,
                                count: 2,
                            },
                            Run {
                                row: 45,
                                column: 3,
                                diagonal: false,
                                count: 37,
                            },
                            Run {
                                row: 45,
                                column: 4,
                                diagonal: true,
                                count: 37,
                            },
                        ],
                    ),
                    List::Borrowed(
                        &[
                            Run {
                                row: 1,
                                column: 0,
                                diagonal: false,
                                count: 40,
                            },
                        ],
                    ),
                    List::Borrowed(&[]),
                    List::Borrowed(
                        &[
                            Run {
                                row: 1,
                                column: 1,
                                diagonal: true,
                                count: 40,
                            },
                        ],
                    ),
                    List::Borrowed(&[]),
                    List::Borrowed(&[]),
                ],
            },
        ))
    };
    #[automatically_derived]
    impl ::dgd::__runtime::System for Model {
        type Vector = ::dgd::__runtime::codegen::HeapNumbers;
        type Sensitivity = ::dgd::__runtime::codegen::HeapNumbers;
        type Inputs = ::dgd::__runtime::codegen::HeapNumbers;
        type Jacobian = ::dgd::__runtime::codegen::HeapNumbers;
        type SensitivityJacobian = ::dgd::__runtime::codegen::HeapNumbers;
        type Factorisation = ::dgd::__runtime::linalg::AutoLu;
        const FEATURES: ::dgd::__runtime::signature::Features = ::dgd::__runtime::signature::Features {
            events: false,
            past: false,
            algebraic: true,
        };
        #[inline]
        fn signature(&self) -> &::dgd::__runtime::signature::Signature {
            &SIGNATURE
        }
        #[inline]
        fn rhs(&self, _at: ::dgd::__runtime::Point<'_>, _f: &mut [f64]) {
            let _y = ::dgd::__runtime::codegen::fixed::<82>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<1>(_at.p);
            let feed = _u[0];
            let held = _y[0];
            let k = _p[0];
            let _f = ::dgd::__runtime::codegen::fixed_mut::<82>(_f);
            /// `memory` (model.dgd:24): der(held) =
            let _row: f64 = k * (_y[81] - held);
            _f[0] = _row;
            /// `left` (model.dgd:17): 0 =
            let _row: f64 = feed - _y[41];
            _f[41] = _row;
            /// `share` (model.dgd:19): 0 =
            let _row: f64 = _y[3] * _y[3] + 0.3333333333333333 * held - _y[44];
            _f[44] = _row;
            for _k in 0..2 {
                /// `share` (model.dgd:19): 0 =
                let _row: f64 = _y[1 + _k] * _y[3] + held / ((_k as f64) + 1.0)
                    - _y[42 + _k];
                _f[42 + _k] = _row;
            }
            for _k in 0..37 {
                /// `share` (model.dgd:19): 0 =
                let _row: f64 = _y[4 + _k] * _y[3] + held / ((_k as f64) + 3.0 + 1.0)
                    - _y[45 + _k];
                _f[45 + _k] = _row;
            }
            for _k in 0..40 {
                /// `cell` (model.dgd:22): der(x) =
                let _row: f64 = k * (_y[41 + _k] - _y[42 + _k]);
                _f[1 + _k] = _row;
            }
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
            let _y = ::dgd::__runtime::codegen::fixed::<82>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<1>(_at.p);
            let _udot = ::dgd::__runtime::codegen::fixed::<1>(_udot);
            let feed = _u[0];
            let held = _y[0];
            let k = _p[0];
            let _v20 = -k;
            let _f = ::dgd::__runtime::codegen::fixed_mut::<82>(_f);
            _f[0] = k * (_y[81] - held);
            _f[41] = feed - _y[41];
            _f[44] = _y[3] * _y[3] + 0.3333333333333333 * held - _y[44];
            let _jacobian = ::dgd::__runtime::codegen::fixed_mut::<242>(_jacobian);
            _jacobian[0] = _v20;
            _jacobian[1] = 0.3333333333333333;
            _jacobian[2] = 2.0 * _y[3];
            _jacobian[3] = -1.0;
            _jacobian[4] = -1.0;
            _jacobian[5] = k;
            let _dfdt = ::dgd::__runtime::codegen::fixed_mut::<82>(_dfdt);
            _dfdt[0] = 0.0;
            _dfdt[41] = _udot[0];
            _dfdt[44] = 0.0;
            for _k in 0..2 {
                let _v24 = (_k as f64) + 1.0;
                let _v27 = _y[1 + _k];
                _f[42 + _k] = _v27 * _y[3] + held / _v24 - _y[42 + _k];
                _jacobian[86 + _k] = 1.0 / _v24;
                _jacobian[88 + _k] = _v27;
                _jacobian[90 + _k] = _y[3];
                _jacobian[92 + _k] = -1.0;
                _dfdt[42 + _k] = 0.0;
            }
            for _k in 0..37 {
                let _v24 = _y[4 + _k];
                let _v27 = (_k as f64) + 3.0 + 1.0;
                _f[45 + _k] = _v24 * _y[3] + held / _v27 - _y[45 + _k];
                _jacobian[94 + _k] = 1.0 / _v27;
                _jacobian[131 + _k] = _v24;
                _jacobian[168 + _k] = _y[3];
                _jacobian[205 + _k] = -1.0;
                _dfdt[45 + _k] = 0.0;
            }
            for _k in 0..40 {
                _f[1 + _k] = k * (_y[41 + _k] - _y[42 + _k]);
                _jacobian[6 + _k] = k;
                _jacobian[46 + _k] = _v20;
                _dfdt[1 + _k] = 0.0;
            }
        }
        #[inline]
        fn sensitivity_rhs(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _s: &[f64],
            _f: &mut [f64],
            _g: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<82>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<1>(_at.p);
            let _s = ::dgd::__runtime::codegen::fixed::<82>(_s);
            let feed = _u[0];
            let held = _y[0];
            let k = _p[0];
            let _v5 = _y[81] - held;
            let _f = ::dgd::__runtime::codegen::fixed_mut::<82>(_f);
            _f[0] = k * _v5;
            _f[41] = feed - _y[41];
            _f[44] = _y[3] * _y[3] + 0.3333333333333333 * held - _y[44];
            let _g = ::dgd::__runtime::codegen::fixed_mut::<82>(_g);
            _g[0] = k * _s[81] - k * _s[0] + _v5;
            _g[41] = -_s[41];
            _g[44] = 0.3333333333333333 * _s[0] + 2.0 * _y[3] * _s[3] - _s[44];
            for _k in 0..2 {
                let _v34 = (_k as f64) + 1.0;
                let _v37 = _y[1 + _k];
                _f[42 + _k] = _v37 * _y[3] + held / _v34 - _y[42 + _k];
                _g[42 + _k] = 1.0 / _v34 * _s[0] + _v37 * _s[3] + _y[3] * _s[1 + _k]
                    - _s[42 + _k];
            }
            for _k in 0..37 {
                let _v34 = _y[4 + _k];
                let _v37 = (_k as f64) + 3.0 + 1.0;
                _f[45 + _k] = _v34 * _y[3] + held / _v37 - _y[45 + _k];
                _g[45 + _k] = 1.0 / _v37 * _s[0] + _v34 * _s[3] + _y[3] * _s[4 + _k]
                    - _s[45 + _k];
            }
            for _k in 0..40 {
                let _v35 = _y[41 + _k] - _y[42 + _k];
                _f[1 + _k] = k * _v35;
                _g[1 + _k] = k * _s[41 + _k] - k * _s[42 + _k] + _v35;
            }
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
            let _y = ::dgd::__runtime::codegen::fixed::<82>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<1>(_at.p);
            let _udot = ::dgd::__runtime::codegen::fixed::<1>(_udot);
            let _s = ::dgd::__runtime::codegen::fixed::<82>(_s);
            let feed = _u[0];
            let held = _y[0];
            let k = _p[0];
            let _v7 = _y[81] - held;
            let _v20 = -k;
            let _v21 = 2.0 * _y[3];
            let _f = ::dgd::__runtime::codegen::fixed_mut::<82>(_f);
            _f[0] = k * _v7;
            _f[41] = feed - _y[41];
            _f[44] = _y[3] * _y[3] + 0.3333333333333333 * held - _y[44];
            let _jacobian = ::dgd::__runtime::codegen::fixed_mut::<242>(_jacobian);
            _jacobian[0] = _v20;
            _jacobian[1] = 0.3333333333333333;
            _jacobian[2] = _v21;
            _jacobian[3] = -1.0;
            _jacobian[4] = -1.0;
            _jacobian[5] = k;
            let _dfdt = ::dgd::__runtime::codegen::fixed_mut::<82>(_dfdt);
            _dfdt[0] = 0.0;
            _dfdt[41] = _udot[0];
            _dfdt[44] = 0.0;
            let _g = ::dgd::__runtime::codegen::fixed_mut::<82>(_g);
            _g[0] = k * _s[81] - k * _s[0] + _v7;
            _g[41] = -_s[41];
            _g[44] = 0.3333333333333333 * _s[0] + _v21 * _s[3] - _s[44];
            let _dgdy = ::dgd::__runtime::codegen::fixed_mut::<161>(_dgdy);
            _dgdy[0] = -1.0;
            _dgdy[1] = 2.0 * _s[3];
            _dgdy[2] = 1.0;
            let _dgdt = ::dgd::__runtime::codegen::fixed_mut::<82>(_dgdt);
            _dgdt[0] = 0.0;
            _dgdt[41] = 0.0;
            _dgdt[44] = 0.0;
            for _k in 0..2 {
                let _v39 = (_k as f64) + 1.0;
                let _v42 = _y[1 + _k];
                let _v46 = 1.0 / _v39;
                let _v51 = _s[1 + _k];
                _f[42 + _k] = _v42 * _y[3] + held / _v39 - _y[42 + _k];
                _jacobian[86 + _k] = _v46;
                _jacobian[88 + _k] = _v42;
                _jacobian[90 + _k] = _y[3];
                _jacobian[92 + _k] = -1.0;
                _dfdt[42 + _k] = 0.0;
                _g[42 + _k] = _v46 * _s[0] + _v42 * _s[3] + _y[3] * _v51 - _s[42 + _k];
                _dgdy[83 + _k] = _v51;
                _dgdy[85 + _k] = _s[3];
                _dgdt[42 + _k] = 0.0;
            }
            for _k in 0..37 {
                let _v39 = _y[4 + _k];
                let _v42 = (_k as f64) + 3.0 + 1.0;
                let _v47 = 1.0 / _v42;
                let _v51 = _s[4 + _k];
                _f[45 + _k] = _v39 * _y[3] + held / _v42 - _y[45 + _k];
                _jacobian[94 + _k] = _v47;
                _jacobian[131 + _k] = _v39;
                _jacobian[168 + _k] = _y[3];
                _jacobian[205 + _k] = -1.0;
                _dfdt[45 + _k] = 0.0;
                _g[45 + _k] = _v47 * _s[0] + _v39 * _s[3] + _y[3] * _v51 - _s[45 + _k];
                _dgdy[87 + _k] = _v51;
                _dgdy[124 + _k] = _s[3];
                _dgdt[45 + _k] = 0.0;
            }
            for _k in 0..40 {
                let _v40 = _y[41 + _k] - _y[42 + _k];
                _f[1 + _k] = k * _v40;
                _jacobian[6 + _k] = k;
                _jacobian[46 + _k] = _v20;
                _dfdt[1 + _k] = 0.0;
                _g[1 + _k] = k * _s[41 + _k] - k * _s[42 + _k] + _v40;
                _dgdy[3 + _k] = 1.0;
                _dgdy[43 + _k] = -1.0;
                _dgdt[1 + _k] = 0.0;
            }
        }
        #[inline]
        fn parameter_jacobian(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _values: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<82>(_at.y);
            let held = _y[0];
            let _values = ::dgd::__runtime::codegen::fixed_mut::<41>(_values);
            _values[0] = _y[81] - held;
            for _k in 0..40 {
                _values[1 + _k] = _y[41 + _k] - _y[42 + _k];
            }
        }
        #[inline]
        fn input_jacobian(&self, _at: ::dgd::__runtime::Point<'_>, _values: &mut [f64]) {
            *::dgd::__runtime::codegen::fixed_mut::<1>(_values) = [1.0];
        }
        #[inline]
        fn time_derivative(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _values: &mut [f64],
        ) {
            let _values = ::dgd::__runtime::codegen::fixed_mut::<82>(_values);
            _values[0] = 0.0;
            _values[41] = 0.0;
            _values[44] = 0.0;
            for _k in 0..2 {
                _values[42 + _k] = 0.0;
            }
            for _k in 0..37 {
                _values[45 + _k] = 0.0;
            }
            for _k in 0..40 {
                _values[1 + _k] = 0.0;
            }
        }
        #[inline]
        fn outputs(&self, _at: ::dgd::__runtime::Point<'_>, _w: &mut [f64]) {
            let _y = ::dgd::__runtime::codegen::fixed::<82>(_at.y);
            let _w = ::dgd::__runtime::codegen::fixed_mut::<41>(_w);
            _w[0] = _y[40];
            for _k in 0..40 {
                _w[1 + _k] = _y[1 + _k];
            }
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
            let _dwdy = ::dgd::__runtime::codegen::fixed_mut::<41>(_dwdy);
            _dwdy[0] = 1.0;
            let _dwdu = ::dgd::__runtime::codegen::fixed_mut::<0>(_dwdu);
            let _dwdp = ::dgd::__runtime::codegen::fixed_mut::<0>(_dwdp);
            let _dwdt = ::dgd::__runtime::codegen::fixed_mut::<41>(_dwdt);
            _dwdt[0] = 0.0;
            for _k in 0..40 {
                _dwdy[1 + _k] = 1.0;
                _dwdt[1 + _k] = 0.0;
            }
        }
        #[inline]
        fn output_sensitivities(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _s: &[f64],
            _w: &mut [f64],
            _dw: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<82>(_at.y);
            let _s = ::dgd::__runtime::codegen::fixed::<82>(_s);
            let _w = ::dgd::__runtime::codegen::fixed_mut::<41>(_w);
            _w[0] = _y[40];
            let _dw = ::dgd::__runtime::codegen::fixed_mut::<41>(_dw);
            _dw[0] = _s[40];
            for _k in 0..40 {
                _w[1 + _k] = _y[1 + _k];
                _dw[1 + _k] = _s[1 + _k];
            }
        }
        #[inline]
        fn start(&self, _at: ::dgd::__runtime::Point<'_>, _y0: &mut [f64]) {
            let _y0 = ::dgd::__runtime::codegen::fixed_mut::<82>(_y0);
            _y0[0] = 1.0;
            for _k in 0..40 {
                _y0[1 + _k] = 0.1 * ((_k as f64) + 1.0);
            }
            for _k in 0..41 {
                _y0[41 + _k] = 0.2;
            }
        }
        #[inline]
        fn start_sensitivities(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _s0: &mut [f64],
        ) {
            let _s0 = ::dgd::__runtime::codegen::fixed_mut::<82>(_s0);
            _s0[0] = 0.0;
            for _k in 0..40 {
                _s0[1 + _k] = 0.0;
            }
            for _k in 0..41 {
                _s0[41 + _k] = 0.0;
            }
        }
        #[inline]
        fn taylor_series(
            &self,
        ) -> ::core::result::Result<
            ::dgd::__runtime::taylor::KeptSeries,
            ::dgd::__runtime::taylor::NoTaylor,
        > {
            ::core::result::Result::Err(::dgd::__runtime::taylor::NoTaylor::Arrays)
        }
    }
}
