impl System for Model {
    #[inline]
    fn rhs(&self, _at: ::dgd::__runtime::EvaluationPoint<'_>, _f: &mut [f64]) {
        let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
        let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
        let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
        let k = _p[0];
        let upper_h = _y[0];
        let lower_q_in = k * ::core::primitive::f64::sqrt(upper_h);
        let lower_k = 0.5 * k;
        let lower_h = _y[1];
        let lower_q_out = lower_k * lower_h;
        let rain = _u[0];
        let clog = _p[1];
        /// `upper.level` (tank.dgd:19): der(upper.h) =
        let _row_0: f64 = 0.5 * (rain - lower_q_in);
        /// `lower.level` (tank.dgd:19): der(lower.h) =
        let _row_1: f64 = 0.5 * (lower_q_in - (1.0 - clog) * lower_q_out);
        *::dgd::__runtime::codegen::fixed_mut::<2>(_f) = [_row_0, _row_1];
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
    #[inline]
    fn outputs(&self, _at: ::dgd::__runtime::EvaluationPoint<'_>, _w: &mut [f64]) {
        let _y = ::dgd::__runtime::codegen::fixed::<2>(_at.y);
        let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
        let k = _p[0];
        let upper_h = _y[0];
        let lower_k = 0.5 * k;
        let lower_h = _y[1];
        let lower_q_out = lower_k * lower_h;
        *::dgd::__runtime::codegen::fixed_mut::<2>(_w) = [upper_h, lower_q_out];
    }
}
