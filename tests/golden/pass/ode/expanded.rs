/// A mass on a spring, with friction and a force.
#[allow(
    non_snake_case,
    unused_variables,
    unused_doc_comments,
    dead_code,
    clippy::all,
    clippy::pedantic
)]
pub mod spring {
    /// The model `spring`.
    #[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
    pub struct Model;
    /// Parameters p; the default is the model file's. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Parameters {
        /// stiffness
        ///
        /// [kg/s^2], declared in N/m
        pub k: f64,
        /// [kg/s], declared in N*s/m
        pub d: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Parameters {
        fn default() -> Self {
            Parameters { k: 8.0, d: 0.5 }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Parameters> for [f64; 2] {
        fn from(named: Parameters) -> [f64; 2] {
            [named.k, named.d]
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
        fn from([k, d]: [f64; 2]) -> Parameters {
            Parameters { k, d }
        }
    }
    /// Inputs u. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Inputs {
        /// downwards
        ///
        /// [N]
        pub force: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Inputs {
        fn default() -> Self {
            Inputs { force: 0.0 }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Inputs> for [f64; 1] {
        fn from(named: Inputs) -> [f64; 1] {
            [named.force]
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
        fn from([force]: [f64; 1]) -> Inputs {
            Inputs { force }
        }
    }
    /// Unknowns y. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Unknowns {
        /// downwards from rest
        ///
        /// [m], declared in mm
        pub x: f64,
        /// [m/s]
        pub v: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Unknowns {
        fn default() -> Self {
            Unknowns { x: 0.0, v: 0.0 }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Unknowns> for [f64; 2] {
        fn from(named: Unknowns) -> [f64; 2] {
            [named.x, named.v]
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
        fn from([x, v]: [f64; 2]) -> Unknowns {
            Unknowns { x, v }
        }
    }
    /// Outputs w. All in SI units.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Outputs {
        /// [m], declared in cm
        pub x: f64,
        /// [J]
        pub energy: f64,
    }
    #[automatically_derived]
    impl ::core::default::Default for Outputs {
        fn default() -> Self {
            Outputs { x: 0.0, energy: 0.0 }
        }
    }
    #[automatically_derived]
    impl ::core::convert::From<Outputs> for [f64; 2] {
        fn from(named: Outputs) -> [f64; 2] {
            [named.x, named.energy]
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
        fn from([x, energy]: [f64; 2]) -> Outputs {
            Outputs { x, energy }
        }
    }
    static SIGNATURE: ::dgd::__runtime::signature::Signature = {
        #[allow(unused_imports)]
        use ::dgd::__runtime::signature::{arrays::*, *};
        Signature {
            name: Text::Borrowed("spring"),
            unknowns: Unknowns::single(
                &[
                    Unknown {
                        name: Text::Borrowed("x"),
                        unit: Unit {
                            symbol: Text::Borrowed("mm"),
                            factor: 0.001,
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
                ],
            ),
            equations: Labels::single(
                &[Text::Borrowed("motion"), Text::Borrowed("newton")],
            ),
            parameters: List::Borrowed(
                &[
                    Parameter {
                        name: Text::Borrowed("k"),
                        unit: Unit {
                            symbol: Text::Borrowed("N/m"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        value: 8.0,
                        lower: 1.0,
                        upper: 1000.0,
                        nominal: ::core::option::Option::None,
                        log: true,
                        fixed: false,
                    },
                    Parameter {
                        name: Text::Borrowed("d"),
                        unit: Unit {
                            symbol: Text::Borrowed("N*s/m"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        value: 0.5,
                        lower: 0.0,
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
                        name: Text::Borrowed("force"),
                        unit: Unit {
                            symbol: Text::Borrowed("N"),
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
                        name: Text::Borrowed("x"),
                        unit: Unit {
                            symbol: Text::Borrowed("cm"),
                            factor: 0.01,
                            offset: 0.0,
                        },
                        noise: ::core::option::Option::Some(0.0001),
                        delay: ::core::option::Option::None,
                    },
                    Output {
                        name: Text::Borrowed("energy"),
                        unit: Unit {
                            symbol: Text::Borrowed("J"),
                            factor: 1.0,
                            offset: 0.0,
                        },
                        noise: ::core::option::Option::None,
                        delay: ::core::option::Option::None,
                    },
                ],
            ),
            densities: List::Borrowed(&[]),
            directions: List::Borrowed(
                &[Direction::Parameter(0), Direction::Parameter(1)],
            ),
            jacobian: Pattern::single(&[1, 0, 1], &[0, 1, 1]),
            sensitivity_jacobian: Pattern::single(&[1, 3], &[0, 1]),
            parameter_jacobian: Pattern::single(&[1, 1], &[0, 1]),
            input_jacobian: Pattern::single(&[1], &[0]),
            output_jacobians: [
                Pattern::single(&[0, 1, 1], &[0, 0, 1]),
                Pattern::single(&[], &[]),
                Pattern::single(&[1], &[0]),
            ],
            discrete: Discrete::NONE,
            starts_at_rest: false,
            start_equations: List::Borrowed(&[]),
            conserved: List::Borrowed(&[]),
        }
    };
    #[automatically_derived]
    impl ::dgd::__runtime::System for Model {
        type Vector = [f64; 2];
        type Sensitivity = [f64; 4];
        type Inputs = [f64; 1];
        type Jacobian = [f64; 3];
        type SensitivityJacobian = [f64; 2];
        const FEATURES: ::dgd::__runtime::signature::Features = ::dgd::__runtime::signature::Features {
            events: false,
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
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let v = _y[1];
            let force = _u[0];
            let k = _p[0];
            let x = _y[0];
            let d = _p[1];
            /// `motion` (model.dgd:14): der(x) =
            let _row_0: f64 = v;
            /// `newton` (model.dgd:15): der(v) =
            let _row_1: f64 = 0.5 * (force - k * x - d * v);
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
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let _udot = ::dgd::__runtime::codegen::fixed::<1>(_udot);
            let v = _y[1];
            let force = _u[0];
            let k = _p[0];
            let x = _y[0];
            let d = _p[1];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_f) = [
                v,
                0.5 * (force - k * x - d * v),
            ];
            *::dgd::__runtime::codegen::fixed_mut::<3>(_jacobian) = [
                -0.5 * k,
                1.0,
                -0.5 * d,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_dfdt) = [0.0, 0.5 * _udot[0]];
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
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let _s = ::dgd::__runtime::codegen::fixed::<4>(_s);
            let v = _y[1];
            let force = _u[0];
            let k = _p[0];
            let x = _y[0];
            let d = _p[1];
            let _v12 = -0.5 * d;
            let _v13 = -0.5 * k;
            *::dgd::__runtime::codegen::fixed_mut::<2>(_f) = [
                v,
                0.5 * (force - k * x - d * v),
            ];
            *::dgd::__runtime::codegen::fixed_mut::<4>(_g) = [
                _s[1],
                _v13 * _s[0] + _v12 * _s[1] + -0.5 * x,
                _s[3],
                _v13 * _s[2] + _v12 * _s[3] + -0.5 * v,
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
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let _udot = ::dgd::__runtime::codegen::fixed::<1>(_udot);
            let _s = ::dgd::__runtime::codegen::fixed::<4>(_s);
            let v = _y[1];
            let force = _u[0];
            let k = _p[0];
            let x = _y[0];
            let d = _p[1];
            let _v14 = -0.5 * d;
            let _v15 = -0.5 * k;
            *::dgd::__runtime::codegen::fixed_mut::<2>(_f) = [
                v,
                0.5 * (force - k * x - d * v),
            ];
            *::dgd::__runtime::codegen::fixed_mut::<3>(_jacobian) = [_v15, 1.0, _v14];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_dfdt) = [0.0, 0.5 * _udot[0]];
            *::dgd::__runtime::codegen::fixed_mut::<4>(_g) = [
                _s[1],
                _v15 * _s[0] + _v14 * _s[1] + -0.5 * x,
                _s[3],
                _v15 * _s[2] + _v14 * _s[3] + -0.5 * v,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_dgdy) = [-0.5, -0.5];
            *::dgd::__runtime::codegen::fixed_mut::<4>(_dgdt) = [0.0, 0.0, 0.0, 0.0];
        }
        #[inline]
        fn parameter_jacobian(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _values: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let v = _y[1];
            let x = _y[0];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_values) = [-0.5 * x, -0.5 * v];
        }
        #[inline]
        fn input_jacobian(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _values: &mut [f64],
        ) {
            *::dgd::__runtime::codegen::fixed_mut::<1>(_values) = [0.5];
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
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let v = _y[1];
            let k = _p[0];
            let x = _y[0];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_w) = [
                x,
                v * v + 0.5 * k * (x * x),
            ];
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
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let v = _y[1];
            let k = _p[0];
            let x = _y[0];
            *::dgd::__runtime::codegen::fixed_mut::<3>(_dwdy) = [
                1.0,
                2.0 * (0.5 * k * x),
                2.0 * v,
            ];
            *::dgd::__runtime::codegen::fixed_mut::<0>(_dwdu) = [];
            *::dgd::__runtime::codegen::fixed_mut::<1>(_dwdp) = [0.5 * (x * x)];
            *::dgd::__runtime::codegen::fixed_mut::<2>(_dwdt) = [0.0, 0.0];
        }
        #[inline]
        fn output_sensitivities(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _s: &[f64],
            _w: &mut [f64],
            _dw: &mut [f64],
        ) {
            let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let _s = ::dgd::__runtime::codegen::fixed::<4>(_s);
            let v = _y[1];
            let k = _p[0];
            let x = _y[0];
            let _v6 = 0.5 * k;
            let _v7 = x * x;
            let _v15 = 2.0 * (_v6 * x);
            let _v16 = 2.0 * v;
            *::dgd::__runtime::codegen::fixed_mut::<2>(_w) = [x, v * v + _v6 * _v7];
            *::dgd::__runtime::codegen::fixed_mut::<4>(_dw) = [
                _s[0],
                _v15 * _s[0] + _v16 * _s[1] + 0.5 * _v7,
                _s[2],
                _v15 * _s[2] + _v16 * _s[3],
            ];
        }
        #[inline]
        fn start(&self, _at: ::dgd::__runtime::EvaluationPoint<'_>, _y0: &mut [f64]) {
            *::dgd::__runtime::codegen::fixed_mut::<2>(_y0) = [0.1, 0.0];
        }
        #[inline]
        fn start_sensitivities(
            &self,
            _at: ::dgd::__runtime::EvaluationPoint<'_>,
            _s0: &mut [f64],
        ) {
            *::dgd::__runtime::codegen::fixed_mut::<4>(_s0) = [0.0, 0.0, 0.0, 0.0];
        }
        #[inline]
        fn taylor_series(
            &self,
        ) -> ::core::result::Result<
            ::dgd::__runtime::taylor::KeptSeries,
            ::dgd::__runtime::taylor::NoTaylorSeries,
        > {
            ::core::result::Result::Ok(::dgd::__runtime::taylor::KeptSeries {
                unknowns: 0,
                sensitivities: 0,
                has_branches: false,
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
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let _udot = ::dgd::__runtime::codegen::fixed::<1>(_udot);
            let [] = ::dgd::__runtime::taylor::kept::<0>(_kept);
            let _series = ::dgd::__runtime::taylor::rows::<2>(_series);
            let v = _y[1];
            let force = _u[0];
            let k = _p[0];
            let x = _y[0];
            let d = _p[1];
            let _v12 = -0.5 * d;
            let _v14 = -0.5 * k;
            let _f9 = 0.5;
            let _f12 = _v12;
            let _f14 = _v14;
            let mut _f: [f64; 2] = [v, 0.5 * (force - k * x - d * v)];
            _series[0] = *::dgd::__runtime::codegen::fixed::<2>(_at.y);
            for _k in 1..=_order {
                let _per = _h / _k as f64;
                _series[_k] = ::dgd::__runtime::taylor::advance(&_f, _per);
                if _k == _order {
                    break;
                }
                let _d0: f64 = _series[_k][1];
                let _d1: f64 = ::dgd::__runtime::taylor::line(_h * _udot[0], _k);
                let _d3: f64 = _series[_k][0];
                let _d10: f64 = _f12 * _d0 + _f9 * _d1 + _f14 * _d3;
                _f = [_d0, _d10];
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
            let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
            let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
            let _udot = ::dgd::__runtime::codegen::fixed::<1>(_udot);
            let [] = ::dgd::__runtime::taylor::kept::<0>(_kept);
            let _series = ::dgd::__runtime::taylor::rows::<2>(_series);
            let _s = ::dgd::__runtime::taylor::rows::<2>(_s);
            let mut _g = [[0.0; 2]; 2];
            let v = _y[1];
            let force = _u[0];
            let k = _p[0];
            let x = _y[0];
            let d = _p[1];
            let _v13 = -0.5 * d;
            let _v14 = -0.5 * k;
            let _v18 = -0.5 * d;
            let _v20 = -0.5 * k;
            let _f0 = 1.0;
            let _f10 = 0.5;
            let _f12 = -0.5;
            let _f13 = _v13;
            let _f14 = _v14;
            let _f18 = _v18;
            let _f20 = _v20;
            let mut _f: [f64; 2] = [v, 0.5 * (force - k * x - d * v)];
            let _row = &mut _g[0];
            *_row = [0.0; 2];
            ::dgd::__runtime::taylor::add_scaled(_row, 1.0, &_s[1]);
            let _row = &mut _g[1];
            *_row = [0.0; 2];
            ::dgd::__runtime::taylor::add_scaled(_row, _v14, &_s[0]);
            ::dgd::__runtime::taylor::add_scaled(_row, _v13, &_s[1]);
            _row[0] += -0.5 * x;
            _row[1] += -0.5 * v;
            _series[0] = *::dgd::__runtime::codegen::fixed::<2>(_at.y);
            for _k in 1..=_order {
                let _per = _h / _k as f64;
                _series[_k] = ::dgd::__runtime::taylor::advance(&_f, _per);
                _s[_k * 2 + 0] = ::dgd::__runtime::taylor::advance(&_g[0], _per);
                _s[_k * 2 + 1] = ::dgd::__runtime::taylor::advance(&_g[1], _per);
                if _k == _order {
                    break;
                }
                let _d1: f64 = _series[_k][1];
                let _d2: f64 = ::dgd::__runtime::taylor::line(_h * _udot[0], _k);
                let _d4: f64 = _series[_k][0];
                let _d11: f64 = _f18 * _d1 + _f10 * _d2 + _f20 * _d4;
                let _d15: f64 = _f12 * _d1;
                let _d16: f64 = _f12 * _d4;
                _f = [_d1, _d11];
                let _row = &mut _g[0];
                *_row = [0.0; 2];
                ::dgd::__runtime::taylor::add_scaled(_row, _f0, &_s[_k * 2 + 1]);
                let _row = &mut _g[1];
                *_row = [0.0; 2];
                ::dgd::__runtime::taylor::add_scaled(_row, _f14, &_s[_k * 2 + 0]);
                ::dgd::__runtime::taylor::add_scaled(_row, _f13, &_s[_k * 2 + 1]);
                _row[0] += _d16;
                _row[1] += _d15;
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
