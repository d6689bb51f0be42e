impl System for Model {
    #[inline]
    fn rhs(&self, _at: ::dgd::__runtime::EvaluationPoint<'_>, _f: &mut [f64]) {
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
        _at: ::dgd::__runtime::EvaluationPoint<'_>,
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
        *::dgd::__runtime::codegen::fixed_mut::<3>(_dfdt) = [0.0, 0.0, _v24 * _udot[0]];
    }
}
