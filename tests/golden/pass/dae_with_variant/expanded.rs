/// A vessel blown off through a valve: the outflow is algebraic.
#[allow(
    non_snake_case,
    unused_variables,
    unused_doc_comments,
    dead_code,
    clippy::all,
    clippy::pedantic
)]
pub mod vessel {
    /// The model `vessel`.
    #[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
    pub struct Model;
    /// Parameters p; the default is the model file's. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Parameters {
        /// [1/(m*s)], declared in bar*s/kg
        pub R: f64,
        /// [s]
        pub tau: f64,
        /// [s^2/m^2], declared in kg/m^3/bar
        pub k: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Parameters {
        fn default() -> Self {
            Parameters {
                R: 1200000.0,
                tau: 5.0,
                k: 1.2e-5,
            }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Parameters> for [f64; 3usize] {
        fn from(named: Parameters) -> [f64; 3usize] {
            [named.R, named.tau, named.k]
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 3usize]> for Parameters {
        fn from([R, tau, k]: [f64; 3usize]) -> Parameters {
            Parameters { R, tau, k }
        }
    }
    /// Inputs u. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Inputs {
        /// [1], declared in %
        pub opening: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Inputs {
        fn default() -> Self {
            Inputs { opening: 0.0 }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Inputs> for [f64; 1usize] {
        fn from(named: Inputs) -> [f64; 1usize] {
            [named.opening]
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 1usize]> for Inputs {
        fn from([opening]: [f64; 1usize]) -> Inputs {
            Inputs { opening }
        }
    }
    /// Unknowns y. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Unknowns {
        /// [Pa], declared in barg
        pub p: f64,
        /// [kg/s]
        pub w: f64,
        /// [1]
        pub s: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Unknowns {
        fn default() -> Self {
            Unknowns { p: 0.0, w: 0.0, s: 0.0 }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Unknowns> for [f64; 3usize] {
        fn from(named: Unknowns) -> [f64; 3usize] {
            [named.p, named.w, named.s]
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 3usize]> for Unknowns {
        fn from([p, w, s]: [f64; 3usize]) -> Unknowns {
            Unknowns { p, w, s }
        }
    }
    /// Outputs w. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Outputs {
        /// [Pa], declared in barg
        pub p: f64,
        /// [kg/s], declared in kg/min
        pub flow: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Outputs {
        fn default() -> Self {
            Outputs { p: 0.0, flow: 0.0 }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Outputs> for [f64; 2usize] {
        fn from(named: Outputs) -> [f64; 2usize] {
            [named.p, named.flow]
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<[f64; 2usize]> for Outputs {
        fn from([p, flow]: [f64; 2usize]) -> Outputs {
            Outputs { p, flow }
        }
    }
    use ::dgd::__runtime::system::{List, Text};
    static SIGNATURE: ::dgd::__runtime::Signature = ::dgd::__runtime::Signature {
        name: Text::Borrowed("vessel"),
        unknowns: List::Borrowed(
            &[
                ::dgd::__runtime::system::Unknown {
                    name: Text::Borrowed("p"),
                    unit: ::dgd::__runtime::system::Unit {
                        symbol: Text::Borrowed("barg"),
                        factor: 100000.0,
                        offset: 0.0,
                    },
                    nominal: ::core::option::Option::None,
                    differential: true,
                },
                ::dgd::__runtime::system::Unknown {
                    name: Text::Borrowed("w"),
                    unit: ::dgd::__runtime::system::Unit {
                        symbol: Text::Borrowed("kg/s"),
                        factor: 1.0,
                        offset: 0.0,
                    },
                    nominal: ::core::option::Option::Some(0.1),
                    differential: false,
                },
                ::dgd::__runtime::system::Unknown {
                    name: Text::Borrowed("s"),
                    unit: ::dgd::__runtime::system::Unit {
                        symbol: Text::Borrowed("1"),
                        factor: 1.0,
                        offset: 0.0,
                    },
                    nominal: ::core::option::Option::None,
                    differential: true,
                },
            ],
        ),
        equations: List::Borrowed(
            &[Text::Borrowed("mass"), Text::Borrowed("outflow"), Text::Borrowed("stem")],
        ),
        parameters: List::Borrowed(
            &[
                ::dgd::__runtime::system::Parameter {
                    name: Text::Borrowed("R"),
                    unit: ::dgd::__runtime::system::Unit {
                        symbol: Text::Borrowed("bar*s/kg"),
                        factor: 100000.0,
                        offset: 0.0,
                    },
                    value: 1200000.0,
                    lower: 100.0,
                    upper: 100000000.0,
                    nominal: ::core::option::Option::None,
                    log: true,
                    fixed: false,
                },
                ::dgd::__runtime::system::Parameter {
                    name: Text::Borrowed("tau"),
                    unit: ::dgd::__runtime::system::Unit {
                        symbol: Text::Borrowed("s"),
                        factor: 1.0,
                        offset: 0.0,
                    },
                    value: 5.0,
                    lower: 0.1,
                    upper: f64::INFINITY,
                    nominal: ::core::option::Option::None,
                    log: false,
                    fixed: false,
                },
                ::dgd::__runtime::system::Parameter {
                    name: Text::Borrowed("k"),
                    unit: ::dgd::__runtime::system::Unit {
                        symbol: Text::Borrowed("kg/m^3/bar"),
                        factor: 1e-5,
                        offset: 0.0,
                    },
                    value: 1.2e-5,
                    lower: -f64::INFINITY,
                    upper: f64::INFINITY,
                    nominal: ::core::option::Option::None,
                    log: false,
                    fixed: true,
                },
            ],
        ),
        inputs: List::Borrowed(
            &[
                ::dgd::__runtime::system::Input {
                    name: Text::Borrowed("opening"),
                    unit: ::dgd::__runtime::system::Unit {
                        symbol: Text::Borrowed("%"),
                        factor: 0.01,
                        offset: 0.0,
                    },
                    interpolation: ::dgd::__runtime::system::Interpolation::Hold,
                },
            ],
        ),
        outputs: List::Borrowed(
            &[
                ::dgd::__runtime::system::Output {
                    name: Text::Borrowed("p"),
                    unit: ::dgd::__runtime::system::Unit {
                        symbol: Text::Borrowed("barg"),
                        factor: 100000.0,
                        offset: 0.0,
                    },
                    noise: ::core::option::Option::None,
                },
                ::dgd::__runtime::system::Output {
                    name: Text::Borrowed("flow"),
                    unit: ::dgd::__runtime::system::Unit {
                        symbol: Text::Borrowed("kg/min"),
                        factor: 0.016666666666666666,
                        offset: 0.0,
                    },
                    noise: ::core::option::Option::Some(0.0016666666666666668),
                },
            ],
        ),
        directions: List::Borrowed(&[0usize, 1usize]),
        jacobian: ::dgd::__runtime::system::Pattern {
            rows: List::Borrowed(&[1usize, 0usize, 1usize, 1usize, 2usize]),
            columns: List::Borrowed(&[0usize, 1usize, 1usize, 2usize, 2usize]),
        },
        sensitivity_jacobian: ::dgd::__runtime::system::Pattern {
            rows: List::Borrowed(
                &[1usize, 4usize, 1usize, 4usize, 1usize, 4usize, 5usize],
            ),
            columns: List::Borrowed(
                &[0usize, 0usize, 1usize, 1usize, 2usize, 2usize, 2usize],
            ),
        },
        parameter_jacobian: ::dgd::__runtime::system::Pattern {
            rows: List::Borrowed(&[1usize, 2usize, 0usize]),
            columns: List::Borrowed(&[0usize, 1usize, 2usize]),
        },
        input_jacobian: ::dgd::__runtime::system::Pattern {
            rows: List::Borrowed(&[2usize]),
            columns: List::Borrowed(&[0usize]),
        },
        output_jacobians: [
            ::dgd::__runtime::system::Pattern {
                rows: List::Borrowed(&[0usize, 1usize]),
                columns: List::Borrowed(&[0usize, 1usize]),
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
    };
    #[automatically_derived]
    impl ::dgd::__runtime::System for Model {
        type Vector = [f64; 3usize];
        type Sensitivity = [f64; 6usize];
        type Inputs = [f64; 1usize];
        type Jacobian = [f64; 5usize];
        type SensitivityJacobian = [f64; 7usize];
        type Factorisation = ::dgd::__runtime::linalg::FixedLu<3usize>;
        #[inline]
        fn signature(&self) -> &::dgd::__runtime::Signature {
            &SIGNATURE
        }
        #[inline]
        fn rhs(&self, _at: ::dgd::__runtime::Point<'_>, _f: &mut [f64]) {
            let _y = ::dgd::__runtime::codegen::fixed::<3usize>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1usize>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<3usize>(_at.p);
            let opening = _u[0usize];
            let k = _p[2usize];
            let w = _y[1usize];
            let R = _p[0usize];
            let s = _y[2usize];
            let p = _y[0usize];
            let tau = _p[1usize];
            /// `mass`: der(p) =  (model.dgd:17)
            let _row_0: f64 = -(w / (2.0 * k));
            /// `outflow`: 0 =  (model.dgd:18)
            let _row_1: f64 = s * p
                - (R * w + 10000.0 * (w * ::core::primitive::f64::abs(w)));
            /// `stem`: der(s) =  (model.dgd:22)
            let _row_2: f64 = (opening - s) / tau;
            *::dgd::__runtime::codegen::fixed_mut::<3usize>(_f) = [
                _row_0,
                _row_1,
                _row_2,
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
            let _y = ::dgd::__runtime::codegen::fixed::<3usize>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1usize>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<3usize>(_at.p);
            let _udot = ::dgd::__runtime::codegen::fixed::<1usize>(_udot);
            let opening = _u[0usize];
            let k = _p[2usize];
            let _v3 = 2.0 * k;
            let w = _y[1usize];
            let R = _p[0usize];
            let _v8 = ::core::primitive::f64::abs(w);
            let s = _y[2usize];
            let p = _y[0usize];
            let tau = _p[1usize];
            let _v28 = 1.0 / tau;
            *::dgd::__runtime::codegen::fixed_mut::<3usize>(_f) = [
                -(w / _v3),
                s * p - (R * w + 10000.0 * (w * _v8)),
                (opening - s) / tau,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<5usize>(_jacobian) = [
                s,
                -1.0 / _v3,
                -20000.0 * _v8 - R,
                p,
                -_v28,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<3usize>(_dfdt) = [
                0.0,
                0.0,
                _v28 * _udot[0usize],
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
            let _y = ::dgd::__runtime::codegen::fixed::<3usize>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1usize>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<3usize>(_at.p);
            let _s = ::dgd::__runtime::codegen::fixed::<6usize>(_s);
            let opening = _u[0usize];
            let k = _p[2usize];
            let _v3 = 2.0 * k;
            let w = _y[1usize];
            let R = _p[0usize];
            let _v8 = ::core::primitive::f64::abs(w);
            let s = _y[2usize];
            let p = _y[0usize];
            let tau = _p[1usize];
            let _v22 = (opening - s) / tau;
            let _v23 = -1.0 / _v3;
            let _v26 = -20000.0 * _v8 - R;
            let _v27 = 1.0 / tau;
            *::dgd::__runtime::codegen::fixed_mut::<3usize>(_f) = [
                -(w / _v3),
                s * p - (R * w + 10000.0 * (w * _v8)),
                _v22,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<6usize>(_g) = [
                _v23 * _s[1usize],
                s * _s[0usize] + _v26 * _s[1usize] + p * _s[2usize] - w,
                -(_v27 * _s[2usize]),
                _v23 * _s[4usize],
                s * _s[3usize] + _v26 * _s[4usize] + p * _s[5usize],
                -(_v27 * _s[5usize]) - _v27 * _v22,
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
            let _y = ::dgd::__runtime::codegen::fixed::<3usize>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1usize>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<3usize>(_at.p);
            let _udot = ::dgd::__runtime::codegen::fixed::<1usize>(_udot);
            let _s = ::dgd::__runtime::codegen::fixed::<6usize>(_s);
            let opening = _u[0usize];
            let k = _p[2usize];
            let _v3 = 2.0 * k;
            let w = _y[1usize];
            let R = _p[0usize];
            let _v8 = ::core::primitive::f64::abs(w);
            let s = _y[2usize];
            let p = _y[0usize];
            let tau = _p[1usize];
            let _v23 = (opening - s) / tau;
            let _v24 = -1.0 / _v3;
            let _v27 = -20000.0 * _v8 - R;
            let _v28 = 1.0 / tau;
            let _v58 = -20000.0 * ::dgd::__runtime::math::sign(w);
            let _v62 = _v28 / tau;
            *::dgd::__runtime::codegen::fixed_mut::<3usize>(_f) = [
                -(w / _v3),
                s * p - (R * w + 10000.0 * (w * _v8)),
                _v23,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<5usize>(_jacobian) = [
                s,
                _v24,
                _v27,
                p,
                -_v28,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<3usize>(_dfdt) = [
                0.0,
                0.0,
                _v28 * _udot[0usize],
            ];
            *::dgd::__runtime::codegen::fixed_mut::<6usize>(_g) = [
                _v24 * _s[1usize],
                s * _s[0usize] + _v27 * _s[1usize] + p * _s[2usize] - w,
                -(_v28 * _s[2usize]),
                _v24 * _s[4usize],
                s * _s[3usize] + _v27 * _s[4usize] + p * _s[5usize],
                -(_v28 * _s[5usize]) - _v28 * _v23,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<7usize>(_dgdy) = [
                _s[2usize],
                _s[5usize],
                _v58 * _s[1usize] + -1.0,
                _v58 * _s[4usize],
                _s[0usize],
                _s[3usize],
                _v62,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<6usize>(_dgdt) = [
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
                -(_v62 * _udot[0usize]),
            ];
        }
        #[inline]
        fn parameter_jacobian(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _values: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<3usize>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1usize>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<3usize>(_at.p);
            let opening = _u[0usize];
            let k = _p[2usize];
            let _v3 = 2.0 * k;
            let w = _y[1usize];
            let s = _y[2usize];
            let tau = _p[1usize];
            *::dgd::__runtime::codegen::fixed_mut::<3usize>(_values) = [
                -w,
                -(1.0 / tau * ((opening - s) / tau)),
                -2.0 * (-1.0 / _v3 * (w / _v3)),
            ];
        }
        #[inline]
        fn input_jacobian(&self, _at: ::dgd::__runtime::Point<'_>, _values: &mut [f64]) {
            let _p = ::dgd::__runtime::codegen::fixed::<3usize>(_at.p);
            let tau = _p[1usize];
            *::dgd::__runtime::codegen::fixed_mut::<1usize>(_values) = [1.0 / tau];
        }
        #[inline]
        fn time_derivative(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _values: &mut [f64],
        ) {
            *::dgd::__runtime::codegen::fixed_mut::<3usize>(_values) = [0.0, 0.0, 0.0];
        }
        #[inline]
        fn outputs(&self, _at: ::dgd::__runtime::Point<'_>, _w: &mut [f64]) {
            let _y = ::dgd::__runtime::codegen::fixed::<3usize>(_at.y);
            let w = _y[1usize];
            let p = _y[0usize];
            *::dgd::__runtime::codegen::fixed_mut::<2usize>(_w) = [p, w];
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
            *::dgd::__runtime::codegen::fixed_mut::<2usize>(_dwdy) = [1.0, 1.0];
            *::dgd::__runtime::codegen::fixed_mut::<0usize>(_dwdu) = [];
            *::dgd::__runtime::codegen::fixed_mut::<0usize>(_dwdp) = [];
            *::dgd::__runtime::codegen::fixed_mut::<2usize>(_dwdt) = [0.0, 0.0];
        }
        #[inline]
        fn output_sensitivities(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _s: &[f64],
            _w: &mut [f64],
            _dw: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<3usize>(_at.y);
            let _s = ::dgd::__runtime::codegen::fixed::<6usize>(_s);
            let w = _y[1usize];
            let p = _y[0usize];
            *::dgd::__runtime::codegen::fixed_mut::<2usize>(_w) = [p, w];
            *::dgd::__runtime::codegen::fixed_mut::<4usize>(_dw) = [
                _s[0usize],
                _s[1usize],
                _s[3usize],
                _s[4usize],
            ];
        }
        #[inline]
        fn start(&self, _at: ::dgd::__runtime::Point<'_>, _y0: &mut [f64]) {
            let _u = ::dgd::__runtime::codegen::fixed::<1usize>(_at.u);
            let opening = _u[0usize];
            *::dgd::__runtime::codegen::fixed_mut::<3usize>(_y0) = [
                600000.0,
                0.5,
                opening,
            ];
        }
        #[inline]
        fn start_sensitivities(
            &self,
            _at: ::dgd::__runtime::Point<'_>,
            _s0: &mut [f64],
        ) {
            *::dgd::__runtime::codegen::fixed_mut::<6usize>(_s0) = [
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
