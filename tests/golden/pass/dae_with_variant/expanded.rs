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
    impl ::core::convert::From<Parameters> for [f64; 3] {
        fn from(named: Parameters) -> [f64; 3] {
            [named.R, named.tau, named.k]
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
        fn from([R, tau, k]: [f64; 3]) -> Parameters {
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
    impl ::core::convert::From<Inputs> for [f64; 1] {
        fn from(named: Inputs) -> [f64; 1] {
            [named.opening]
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
        fn from([opening]: [f64; 1]) -> Inputs {
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
    impl ::core::convert::From<Unknowns> for [f64; 3] {
        fn from(named: Unknowns) -> [f64; 3] {
            [named.p, named.w, named.s]
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
        fn from([p, w, s]: [f64; 3]) -> Unknowns {
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
    impl ::core::convert::From<Outputs> for [f64; 2] {
        fn from(named: Outputs) -> [f64; 2] {
            [named.p, named.flow]
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
        fn from([p, flow]: [f64; 2]) -> Outputs {
            Outputs { p, flow }
        }
    }
    static SIGNATURE: ::dgd::__runtime::signature::Signature = {
        #[allow(unused_imports)]
        use ::dgd::__runtime::signature::{arrays::*, *};
        Signature {
            name: Text::Borrowed("vessel"),
            unknowns: Unknowns::single(
                &[
                    Unknown {
                        name: Text::Borrowed("p"),
                        unit: Unit {
                            symbol: Text::Borrowed("barg"),
                            factor: 100000.0,
                            offset: 0.0,
                        },
                        nominal: ::core::option::Option::None,
                        differential: true,
                    },
                    Unknown {
                        name: Text::Borrowed("w"),
                        unit: Unit {
                            symbol: Text::Borrowed("kg/s"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        nominal: ::core::option::Option::Some(0.1),
                        differential: false,
                    },
                    Unknown {
                        name: Text::Borrowed("s"),
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
            equations: Labels::single(
                &[
                    Text::Borrowed("mass"),
                    Text::Borrowed("outflow"),
                    Text::Borrowed("stem"),
                ],
            ),
            parameters: List::Borrowed(
                &[
                    Parameter {
                        name: Text::Borrowed("R"),
                        unit: Unit {
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
                    Parameter {
                        name: Text::Borrowed("tau"),
                        unit: Unit {
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
                    Parameter {
                        name: Text::Borrowed("k"),
                        unit: Unit {
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
                    Input {
                        name: Text::Borrowed("opening"),
                        unit: Unit {
                            symbol: Text::Borrowed("%"),
                            factor: 0.01,
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
                        name: Text::Borrowed("p"),
                        unit: Unit {
                            symbol: Text::Borrowed("barg"),
                            factor: 100000.0,
                            offset: 0.0,
                        },
                        noise: ::core::option::Option::None,
                        delay: ::core::option::Option::None,
                    },
                    Output {
                        name: Text::Borrowed("flow"),
                        unit: Unit {
                            symbol: Text::Borrowed("kg/min"),
                            factor: 0.016666666666666666,
                            offset: 0.0,
                        },
                        noise: ::core::option::Option::Some(0.0016666666666666668),
                        delay: ::core::option::Option::None,
                    },
                ],
            ),
            directions: List::Borrowed(
                &[Direction::Parameter(0), Direction::Parameter(1)],
            ),
            jacobian: Pattern::single(&[1, 0, 1, 1, 2], &[0, 1, 1, 2, 2]),
            sensitivity_jacobian: Pattern::single(
                &[1, 4, 1, 4, 1, 4, 5],
                &[0, 0, 1, 1, 2, 2, 2],
            ),
            parameter_jacobian: Pattern::single(&[1, 2, 0], &[0, 1, 2]),
            input_jacobian: Pattern::single(&[2], &[0]),
            output_jacobians: [
                Pattern::single(&[0, 1], &[0, 1]),
                Pattern::single(&[], &[]),
                Pattern::single(&[], &[]),
            ],
            discrete: Discrete::NONE,
        }
    };
    #[automatically_derived]
    impl ::dgd::__runtime::System for Model {
        type Vector = [f64; 3];
        type Sensitivity = [f64; 6];
        type Inputs = [f64; 1];
        type Jacobian = [f64; 5];
        type SensitivityJacobian = [f64; 7];
        type Factorisation = ::dgd::__runtime::linalg::FixedLu<3>;
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
            let _y = ::dgd::__runtime::codegen::fixed::<3>(_at.y);
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<3>(_at.p);
            let opening = _u[0];
            let k = _p[2];
            let w = _y[1];
            let R = _p[0];
            let s = _y[2];
            let p = _y[0];
            let tau = _p[1];
            /// `mass` (model.dgd:17): der(p) =
            let _row_0: f64 = -(w * (1.0 / (2.0 * k)));
            /// `outflow` (model.dgd:18): 0 =
            let _row_1: f64 = s * p
                - (R * w + 10000.0 * (w * ::core::primitive::f64::abs(w)));
            /// `stem` (model.dgd:22): der(s) =
            let _row_2: f64 = (opening - s) * (1.0 / tau);
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
            let _p = ::dgd::__runtime::codegen::fixed::<3>(_at.p);
            let _udot = ::dgd::__runtime::codegen::fixed::<1>(_udot);
            let opening = _u[0];
            let k = _p[2];
            let _v3 = 2.0 * k;
            let w = _y[1];
            let R = _p[0];
            let _v8 = ::core::primitive::f64::abs(w);
            let s = _y[2];
            let p = _y[0];
            let tau = _p[1];
            let _v24 = 1.0 / tau;
            *::dgd::__runtime::codegen::fixed_mut::<3>(_f) = [
                -(w * (1.0 / _v3)),
                s * p - (R * w + 10000.0 * (w * _v8)),
                (opening - s) * _v24,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<5>(_jacobian) = [
                s,
                -1.0 / _v3,
                -20000.0 * _v8 - R,
                p,
                -_v24,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<3>(_dfdt) = [
                0.0,
                0.0,
                _v24 * _udot[0],
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
            let _p = ::dgd::__runtime::codegen::fixed::<3>(_at.p);
            let _s = ::dgd::__runtime::codegen::fixed::<6>(_s);
            let opening = _u[0];
            let k = _p[2];
            let _v3 = 2.0 * k;
            let w = _y[1];
            let R = _p[0];
            let _v8 = ::core::primitive::f64::abs(w);
            let s = _y[2];
            let p = _y[0];
            let tau = _p[1];
            let _v23 = 1.0 / tau;
            let _v24 = (opening - s) * _v23;
            let _v25 = -1.0 / _v3;
            let _v28 = -20000.0 * _v8 - R;
            *::dgd::__runtime::codegen::fixed_mut::<3>(_f) = [
                -(w * (1.0 / _v3)),
                s * p - (R * w + 10000.0 * (w * _v8)),
                _v24,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<6>(_g) = [
                _v25 * _s[1],
                s * _s[0] + _v28 * _s[1] + p * _s[2] - w,
                -(_v23 * _s[2]),
                _v25 * _s[4],
                s * _s[3] + _v28 * _s[4] + p * _s[5],
                -(_v23 * _s[5]) - _v23 * _v24,
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
            let _p = ::dgd::__runtime::codegen::fixed::<3>(_at.p);
            let _udot = ::dgd::__runtime::codegen::fixed::<1>(_udot);
            let _s = ::dgd::__runtime::codegen::fixed::<6>(_s);
            let opening = _u[0];
            let k = _p[2];
            let _v3 = 2.0 * k;
            let w = _y[1];
            let R = _p[0];
            let _v8 = ::core::primitive::f64::abs(w);
            let s = _y[2];
            let p = _y[0];
            let tau = _p[1];
            let _v24 = 1.0 / tau;
            let _v25 = (opening - s) * _v24;
            let _v26 = -1.0 / _v3;
            let _v29 = -20000.0 * _v8 - R;
            let _v59 = -20000.0 * ::dgd::__runtime::math::sign(w);
            let _v63 = _v24 / tau;
            *::dgd::__runtime::codegen::fixed_mut::<3>(_f) = [
                -(w * (1.0 / _v3)),
                s * p - (R * w + 10000.0 * (w * _v8)),
                _v25,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<5>(_jacobian) = [
                s,
                _v26,
                _v29,
                p,
                -_v24,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<3>(_dfdt) = [
                0.0,
                0.0,
                _v24 * _udot[0],
            ];
            *::dgd::__runtime::codegen::fixed_mut::<6>(_g) = [
                _v26 * _s[1],
                s * _s[0] + _v29 * _s[1] + p * _s[2] - w,
                -(_v24 * _s[2]),
                _v26 * _s[4],
                s * _s[3] + _v29 * _s[4] + p * _s[5],
                -(_v24 * _s[5]) - _v24 * _v25,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<7>(_dgdy) = [
                _s[2],
                _s[5],
                _v59 * _s[1] + -1.0,
                _v59 * _s[4],
                _s[0],
                _s[3],
                _v63,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<6>(_dgdt) = [
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
                -(_v63 * _udot[0]),
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
            let _p = ::dgd::__runtime::codegen::fixed::<3>(_at.p);
            let opening = _u[0];
            let k = _p[2];
            let _v3 = 2.0 * k;
            let w = _y[1];
            let s = _y[2];
            let tau = _p[1];
            let _v14 = 1.0 / tau;
            *::dgd::__runtime::codegen::fixed_mut::<3>(_values) = [
                -w,
                -(_v14 * ((opening - s) * _v14)),
                -2.0 * (-1.0 / _v3 * (w * (1.0 / _v3))),
            ];
        }
        #[inline]
        fn input_jacobian(&self, _at: ::dgd::__runtime::Point<'_>, _values: &mut [f64]) {
            let _p = ::dgd::__runtime::codegen::fixed::<3>(_at.p);
            let tau = _p[1];
            *::dgd::__runtime::codegen::fixed_mut::<1>(_values) = [1.0 / tau];
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
            let w = _y[1];
            let p = _y[0];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_w) = [p, w];
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
            *::dgd::__runtime::codegen::fixed_mut::<2>(_dwdy) = [1.0, 1.0];
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
            let w = _y[1];
            let p = _y[0];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_w) = [p, w];
            *::dgd::__runtime::codegen::fixed_mut::<4>(_dw) = [
                _s[0],
                _s[1],
                _s[3],
                _s[4],
            ];
        }
        #[inline]
        fn start(&self, _at: ::dgd::__runtime::Point<'_>, _y0: &mut [f64]) {
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let opening = _u[0];
            *::dgd::__runtime::codegen::fixed_mut::<3>(_y0) = [600000.0, 0.5, opening];
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
        #[inline]
        fn taylor_series(
            &self,
        ) -> ::core::result::Result<
            ::dgd::__runtime::taylor::KeptSeries,
            ::dgd::__runtime::taylor::NoTaylor,
        > {
            ::core::result::Result::Err(::dgd::__runtime::taylor::NoTaylor::Algebraic)
        }
        #[inline(always)]
        fn rhs_lanes(
            &self,
            _at: ::dgd::__runtime::ensemble::lanes::LanePoint<'_>,
            _f: &mut [::dgd::__runtime::ensemble::lanes::Lanes],
        ) {
            ::dgd::__runtime::ensemble::lanes::rhs::<Self, 3, 1, 3>(self, _at, _f);
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
                3,
                5,
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
                3,
                2,
            >(self, _at, _w);
        }
    }
}
