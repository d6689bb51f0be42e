impl System for Model {
    #[inline]
    fn rhs(&self, _at: ::dgd::__runtime::EvaluationPoint<'_>, _f: &mut [f64]) {
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
        let _row_4: f64 = -2.0 * v_x * v_x + -2.0 * v_y * v_y - _v32 * _v5 + _v31 * _v11;
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
    fn mass(&self, _at: ::dgd::__runtime::EvaluationPoint<'_>, _mass: &mut [f64]) {
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
    fn event_functions(
        &self,
        _at: ::dgd::__runtime::EvaluationPoint<'_>,
        _e: &mut [f64],
    ) {
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
}
