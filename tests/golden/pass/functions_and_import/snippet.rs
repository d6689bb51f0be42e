impl System for Model {
    #[inline]
    fn rhs(&self, _at: ::dgd::__runtime::EvaluationPoint<'_>, _f: &mut [f64]) {
        let _y = ::dgd::__runtime::codegen::fixed::<4>(_at.y);
        let _p = ::dgd::__runtime::codegen::fixed::<2>(_at.p);
        let _z = ::dgd::__runtime::codegen::fixed::<2>(_at.z);
        let A_1 = _p[0];
        let v = _y[2];
        let A_2 = _p[1];
        let h_1 = _y[0];
        let h_2 = _y[1];
        let _v14 = ::core::primitive::f64::abs(v);
        let _v16 = 40000.0 * _v14;
        let _v20 = 64.0 / (if (_v16 > 1.0) { _v16 } else { 1.0 });
        let _v25 = 0.316 * ::dgd::__runtime::math::power(_v16, -0.25);
        let _v27 = v * _v14;
        let _share_1 = _y[3];
        let _v36 = (_z[0] > 1.5);
        let _v40 = _v20 - _v25;
        let _v48 = 0.3924
            * (h_1 - h_2
                - 0.0509683995922528
                    * (625.0
                        * (if _v36 {
                            _v25 + (1.0 - _share_1) * _v40
                        } else {
                            if (_z[0] < 0.5) { _v20 } else { _v25 }
                        }) * _v27));
        let _v49 = ::dgd::__runtime::math::sign(v);
        let _v51 = 40000.0 * _v49 * _v48;
        /// `upper` (model.dgd:21): der(h_1) =
        let _row_0: f64 = -0.0012566370614359172 * v * (1.0 / A_1);
        /// `lower` (model.dgd:22): der(h_2) =
        let _row_1: f64 = 0.0012566370614359172 * v * (1.0 / A_2);
        /// `pipe` (model.dgd:23): der(v) =
        let _row_2: f64 = _v48;
        /// `switch 40000*abs(v) - 2300 at 0` (model.dgd:21): 0 =
        let _row_3: f64 = if _v36 {
            if (::core::primitive::f64::abs(625.0 * (-800.0 * _v49 * _v27) * _v40) > 0.0)
            {
                _v51
            } else {
                (if (_v51 > 0.0) { 2.0 } else { -1.0 }) - _share_1
            }
        } else {
            (if ((_z[0] > 0.5) && (_z[0] < 1.5)) { 1.0 } else { 0.0 }) - _share_1
        };
        *::dgd::__runtime::codegen::fixed_mut::<4>(_f) = [
            _row_0,
            _row_1,
            _row_2,
            _row_3,
        ];
    }
    #[inline]
    fn event_functions(
        &self,
        _at: ::dgd::__runtime::EvaluationPoint<'_>,
        _e: &mut [f64],
    ) {
        let _y = ::dgd::__runtime::codegen::fixed::<4>(_at.y);
        let _z = ::dgd::__runtime::codegen::fixed::<2>(_at.z);
        let v = _y[2];
        let h_1 = _y[0];
        let h_2 = _y[1];
        let _v6 = ::core::primitive::f64::abs(v);
        let _v8 = 40000.0 * _v6;
        let _v13 = 64.0 / (if (_v8 > 1.0) { _v8 } else { 1.0 });
        let _v17 = 0.316 * ::dgd::__runtime::math::power(_v8, -0.25);
        let _v22 = _v8 - 2300.0;
        let _v23 = _v8 - 1.0;
        let _share_1 = _y[3];
        let _v39 = 0.3924
            * (h_1 - h_2
                - 0.0509683995922528
                    * (625.0
                        * (if (_z[0] > 1.5) {
                            _v17 + (1.0 - _share_1) * (_v13 - _v17)
                        } else {
                            if (_z[0] < 0.5) { _v13 } else { _v17 }
                        }) * (v * _v6)));
        let _v42 = 40000.0 * ::dgd::__runtime::math::sign(v) * _v39;
        *::dgd::__runtime::codegen::fixed_mut::<8>(_e) = [
            _v22,
            _v22,
            _v42,
            _v42,
            _share_1 - 1.0,
            _share_1,
            _v23,
            _v23,
        ];
    }
    #[inline]
    fn outputs(&self, _at: ::dgd::__runtime::EvaluationPoint<'_>, _w: &mut [f64]) {
        let _y = ::dgd::__runtime::codegen::fixed::<4>(_at.y);
        let v = _y[2];
        let h_1 = _y[0];
        let h_2 = _y[1];
        *::dgd::__runtime::codegen::fixed_mut::<2>(_w) = [
            0.0012566370614359172 * v,
            if ((h_1 > h_2) && !(v < 0.0)) { h_1 - h_2 } else { 0.0 },
        ];
    }
}
