use std::ops::{Add, Div, Mul, Neg, Sub};

/// Numbers with which equations compute.
pub trait Number:
    Copy
    + From<f64>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Mul<f64, Output = Self>
{
    fn value(self) -> f64;
    /// The function with this value, slope and curvature.
    fn chain(self, value: f64, slope: f64, curvature: f64) -> Self;

    fn abs(self) -> Self {
        let sign = if self.value() < 0.0 { -1.0 } else { 1.0 };
        self.chain(self.value().abs(), sign, 0.0)
    }

    fn sqrt(self) -> Self {
        let root = self.value().sqrt();
        self.chain(root, 0.5 / root, -0.25 / (root * self.value()))
    }

    fn exp(self) -> Self {
        let e = self.value().exp();
        self.chain(e, e, e)
    }

    fn sin(self) -> Self {
        let (sin, cos) = self.value().sin_cos();
        self.chain(sin, cos, -sin)
    }
}

impl Number for f64 {
    fn value(self) -> f64 {
        self
    }

    fn chain(self, value: f64, _: f64, _: f64) -> f64 {
        value
    }
}

/// value + a ε₁ + b ε₂ + ab ε₁ε₂ with ε₁² = ε₂² = 0: exact first and mixed second derivatives.
#[derive(Debug, Clone, Copy)]
pub struct HyperDual {
    pub value: f64,
    pub a: f64,
    pub b: f64,
    pub ab: f64,
}

impl From<f64> for HyperDual {
    fn from(value: f64) -> Self {
        Self { value, a: 0.0, b: 0.0, ab: 0.0 }
    }
}

impl Number for HyperDual {
    fn value(self) -> f64 {
        self.value
    }

    fn chain(self, value: f64, slope: f64, curvature: f64) -> Self {
        Self {
            value,
            a: slope * self.a,
            b: slope * self.b,
            ab: slope * self.ab + curvature * self.a * self.b,
        }
    }
}

impl Add for HyperDual {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { value: self.value + o.value, a: self.a + o.a, b: self.b + o.b, ab: self.ab + o.ab }
    }
}

impl Neg for HyperDual {
    type Output = Self;
    fn neg(self) -> Self {
        self * -1.0
    }
}

impl Sub for HyperDual {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        self + -o
    }
}

impl Mul<f64> for HyperDual {
    type Output = Self;
    fn mul(self, k: f64) -> Self {
        Self { value: self.value * k, a: self.a * k, b: self.b * k, ab: self.ab * k }
    }
}

impl Mul for HyperDual {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self {
            value: self.value * o.value,
            a: self.value * o.a + self.a * o.value,
            b: self.value * o.b + self.b * o.value,
            ab: self.value * o.ab + self.a * o.b + self.b * o.a + self.ab * o.value,
        }
    }
}

impl Div for HyperDual {
    type Output = Self;
    fn div(self, o: Self) -> Self {
        let r = o.value.recip();
        self * o.chain(r, -r * r, 2.0 * r * r * r)
    }
}
