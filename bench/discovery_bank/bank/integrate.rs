//! The classical Runge-Kutta method with equal steps.

/// Takes a state from `t` to `t + step` in so many equal steps.
pub(crate) fn rk4<const N: usize>(
    y: &mut [f64; N],
    t: f64,
    step: f64,
    substeps: usize,
    mut slope: impl FnMut(f64, &[f64; N]) -> [f64; N],
) {
    let h = step / substeps as f64;
    let moved = |y: &[f64; N], k: &[f64; N], h: f64| -> [f64; N] {
        std::array::from_fn(|i| y[i] + h * k[i])
    };
    for n in 0..substeps {
        let t = t + n as f64 * h;
        let k1 = slope(t, y);
        let k2 = slope(t + 0.5 * h, &moved(y, &k1, 0.5 * h));
        let k3 = slope(t + 0.5 * h, &moved(y, &k2, 0.5 * h));
        let k4 = slope(t + h, &moved(y, &k3, h));
        *y = std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
    }
}
