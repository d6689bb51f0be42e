impl System for Model {
    #[inline]
    fn rhs(&self, _at: ::dgd::__runtime::EvaluationPoint<'_>, _f: &mut [f64]) {
        let _y = ::dgd::__runtime::codegen::fixed::<3>(_at.y);
        let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
        let _p = ::dgd::__runtime::codegen::fixed::<4>(_at.p);
        let gain = _p[3];
        let q_in = _u[0];
        let q_pump = _y[2];
        let k = _p[0];
        let h = _y[0];
        let tau = _p[1];
        /// `level` (model.dgd:17): der(h) =
        let _row_0: f64 = 0.5 * (q_pump - k * ::core::primitive::f64::sqrt(h));
        /// `total` (model.dgd:18): der(v) =
        let _row_1: f64 = q_pump;
        /// `drive` (effects/lag.dgd:9): der(q_pump) =
        let _row_2: f64 = (gain * q_in - q_pump) * (1.0 / tau);
        *::dgd::__runtime::codegen::fixed_mut::<3>(_f) = [_row_0, _row_1, _row_2];
    }
    #[inline]
    fn outputs(&self, _at: ::dgd::__runtime::EvaluationPoint<'_>, _w: &mut [f64]) {
        let _y = ::dgd::__runtime::codegen::fixed::<3>(_at.y);
        let _p = ::dgd::__runtime::codegen::fixed::<4>(_at.p);
        let k = _p[0];
        let h = _y[0];
        let offset_level = _p[2];
        *::dgd::__runtime::codegen::fixed_mut::<2>(_w) = [
            h + offset_level,
            k * ::core::primitive::f64::sqrt(h),
        ];
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
        let _y = ::dgd::__runtime::codegen::fixed::<3>(_at.y);
        let _u = ::dgd::__runtime::codegen::fixed::<1>(_at.u);
        let _p = ::dgd::__runtime::codegen::fixed::<4>(_at.p);
        let _udot = ::dgd::__runtime::codegen::fixed::<1>(_udot);
        let [_c0] = ::dgd::__runtime::taylor::kept::<1>(_kept);
        let _series = ::dgd::__runtime::taylor::rows::<3>(_series);
        let gain = _p[3];
        let q_in = _u[0];
        let q_pump = _y[2];
        let k = _p[0];
        let h = _y[0];
        let _v7 = ::core::primitive::f64::sqrt(h);
        let _v9 = 0.5 / _v7;
        let tau = _p[1];
        let _v16 = 1.0 / tau;
        let _v19 = -0.5 * k;
        let _v20 = -_v16;
        let _v21 = _v16 * gain;
        ::dgd::__runtime::taylor::keep(_c0, 0, _v7);
        let _f9 = _v9;
        let _f14 = 0.5;
        let _f19 = _v19;
        let _f20 = _v20;
        let _f21 = _v21;
        let mut _f: [f64; 3] = [
            0.5 * (q_pump - k * _v7),
            q_pump,
            (gain * q_in - q_pump) * _v16,
        ];
        _series[0] = *::dgd::__runtime::codegen::fixed::<3>(_at.y);
        for _k in 1..=_order {
            let _per = _h / _k as f64;
            _series[_k] = ::dgd::__runtime::taylor::advance(&_f, _per);
            if _k == _order {
                break;
            }
            let _d2: f64 = ::dgd::__runtime::taylor::line(_h * _udot[0], _k);
            let _d4: f64 = _series[_k][2];
            let _d6: f64 = _series[_k][0];
            let _d7: f64 = ::dgd::__runtime::taylor::root(_d6, _c0, _f9, _k);
            ::dgd::__runtime::taylor::keep(_c0, _k, _d7);
            let _d15: f64 = _f14 * _d4 + _f19 * _d7;
            let _d17: f64 = _f21 * _d2 + _f20 * _d4;
            _f = [_d15, _d4, _d17];
        }
    }
}
