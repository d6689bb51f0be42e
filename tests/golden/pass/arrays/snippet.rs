impl System for Model {
    #[inline]
    fn rhs(&self, _at: ::dgd::__runtime::EvaluationPoint<'_>, _f: &mut [f64]) {
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
        _at: ::dgd::__runtime::EvaluationPoint<'_>,
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
    fn start(&self, _at: ::dgd::__runtime::EvaluationPoint<'_>, _y0: &mut [f64]) {
        let _y0 = ::dgd::__runtime::codegen::fixed_mut::<82>(_y0);
        _y0[0] = 1.0;
        for _k in 0..40 {
            _y0[1 + _k] = 0.1 * ((_k as f64) + 1.0);
        }
        for _k in 0..41 {
            _y0[41 + _k] = 0.2;
        }
    }
}
