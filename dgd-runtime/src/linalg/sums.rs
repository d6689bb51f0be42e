//! Sums that equations conserve, as rows of the matrix of a step.
//!
//! ```text
//!   Σ cₖ yₖ = C,   Σ cₖ Sₖ = dC/dθ,   Σ cₖ fₖ = 0
//! ```
//!
//! The combination c of the rows of c M − J is that of M alone. Where ‖J‖ exceeds c by many digits, that is lost in the
//! rounding of J, and with it the slow motion along the sum. So the row of one of the unknowns is replaced by the
//! combination, written down instead of computed: the unknown with the largest share, which is the one that loses least
//! by being computed from the others.

use crate::system::Conserved;

/// An unknown keeps its row until its share falls below this fraction of the largest.
const STAYS: f64 = 0.5;
/// Sums that differ by less than this fraction of their terms are equal.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// A sum that is kept.
#[derive(Debug, Clone)]
pub struct KeptSum {
    /// The unknown whose row is replaced, which has the coefficient one here and none in other sums.
    pub(crate) row: usize,
    /// Coefficients of all n unknowns.
    pub(crate) shares: Vec<f64>,
    /// C, and dC/dθ for each direction.
    value: f64,
    slopes: Vec<f64>,
}

impl KeptSum {
    const NONE: Self = Self { row: usize::MAX, shares: Vec::new(), value: 0.0, slopes: Vec::new() };

    /// The sums of a model of n unknowns, for n_s directions; nothing is known of their values.
    pub(crate) fn all(conserved: &[Conserved], n: usize, n_s: usize) -> Vec<Self> {
        let sum = |conserved: &Conserved| {
            let mut shares = vec![0.0; n];
            for (unknown, share) in conserved.terms.iter() {
                shares[*unknown] = *share;
            }
            Self { row: usize::MAX, shares, value: f64::NAN, slopes: vec![f64::NAN; n_s] }
        };
        conserved.iter().map(sum).collect()
    }

    /// The sum of these values.
    pub(crate) fn sum(&self, values: &[f64]) -> f64 {
        self.shares.iter().zip(values).map(|(share, value)| share * value).sum()
    }

    /// Overwrites the unknown of the row by the value that follows from the others.
    fn close(&self, values: &mut [f64], sum: f64) {
        values[self.row] = 0.0;
        values[self.row] = sum - self.sum(values);
    }

    /// `before`, unless these values have another sum.
    fn taken(&self, before: f64, values: &[f64]) -> f64 {
        let now = self.sum(values);
        let terms: f64 =
            self.shares.iter().zip(values).map(|(share, value)| (share * value).abs()).sum();
        // NaN compares false.
        if (now - before).abs() <= ROUNDING * terms { before } else { now }
    }

    /// Subtracts a multiple of another sum.
    fn subtract(&mut self, other: &Self, times: f64) {
        for (share, other) in self.shares.iter_mut().zip(&other.shares) {
            *share -= times * other;
        }
        self.value -= times * other.value;
        for (slope, other) in self.slopes.iter_mut().zip(&other.slopes) {
            *slope -= times * other;
        }
        self.shares[other.row] = 0.0;
    }

    fn divide(&mut self, by: f64) {
        self.shares.iter_mut().for_each(|share| *share /= by);
        self.slopes.iter_mut().for_each(|slope| *slope /= by);
        self.value /= by;
        self.shares[self.row] = 1.0;
    }
}

/// Takes the sums of y and S, which differ from those before where something was reset, and chooses their rows.
pub(crate) fn begin(sums: &mut [KeptSum], y: &[f64], s: Option<&[f64]>) {
    for k in 0..sums.len() {
        let sum = &mut sums[k];
        sum.value = sum.taken(sum.value, y);
        if let Some(s) = s {
            for j in 0..sum.slopes.len() {
                sum.slopes[j] = sum.taken(sum.slopes[j], &s[j * y.len()..(j + 1) * y.len()]);
            }
        }
        choose(sums, k, y);
    }
}

/// Gives a sum the row of the unknown with the largest share in it.
fn choose(sums: &mut [KeptSum], k: usize, y: &[f64]) {
    let is_free =
        |i: usize| !sums.iter().enumerate().any(|(other, sum)| other != k && sum.row == i);
    let share = |i: usize| (sums[k].shares[i] * y[i]).abs();
    // Where all is zero, any unknown with a coefficient.
    let weight = |i: usize| (share(i), sums[k].shares[i].abs());
    let candidates = (0..y.len()).filter(|i| sums[k].shares[*i] != 0.0 && is_free(*i));
    let by_weight = |a: &usize, b: &usize| {
        let (a_own, b_own) = (weight(*a), weight(*b));
        a_own.0.total_cmp(&b_own.0).then(a_own.1.total_cmp(&b_own.1)).then(b.cmp(a))
    };
    let Some(best) = candidates.max_by(by_weight) else { return };
    let row = sums[k].row;
    if row != usize::MAX && share(row) >= STAYS * share(best) {
        return;
    }
    sums[k].row = best;
    let coefficient = sums[k].shares[best];
    sums[k].divide(coefficient);
    // Taken out, not copied: steps do not allocate.
    let removed = std::mem::replace(&mut sums[k], KeptSum::NONE);
    for (other, sum) in sums.iter_mut().enumerate() {
        let times = sum.shares.get(best).copied().unwrap_or(0.0);
        if other != k && times != 0.0 {
            sum.subtract(&removed, times);
        }
    }
    sums[k] = removed;
}

/// Puts y and S at the end of a step onto the sums.
pub(crate) fn close(sums: &[KeptSum], y: &mut [f64], s: Option<&mut [f64]>) {
    let n = y.len();
    for sum in sums {
        sum.close(y, sum.value);
    }
    if let Some(s) = s {
        for sum in sums {
            for (column, slope) in s.chunks_exact_mut(n).zip(&sum.slopes) {
                sum.close(column, *slope);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sums(terms: &[&[(usize, f64)]], n: usize) -> Vec<KeptSum> {
        let all: Vec<Conserved> =
            terms.iter().map(|terms| Conserved { terms: terms.to_vec().into() }).collect();
        KeptSum::all(&all, n, 0)
    }

    #[test]
    fn the_largest_share_follows_from_the_others() {
        let mut sums = sums(&[&[(0, 1.0), (1, -1.0), (2, -1.0)]], 3);
        begin(&mut sums, &[0.0; 3], None);
        let mut y = [3.1e-20, 1e-20, 2e-20];
        begin(&mut sums, &y, None);
        // Quantities that are not conserved are sums of their own.
        close(&sums, &mut y, None);
        assert!((y[0] - 3.1e-20).abs() < 1e-34 && y[1..] == [1e-20, 2e-20]);
        y[0] += 1e-36;
        begin(&mut sums, &y, None);
        close(&sums, &mut y, None);
        assert_eq!(sums[0].row, 0);
    }

    #[test]
    fn sums_that_share_unknowns_have_rows_of_their_own() {
        let mut sums = sums(&[&[(0, 1.0), (1, 1.0)], &[(0, 1.0), (2, 2.0)]], 3);
        let y = [5.0, 1.0, 0.25];
        begin(&mut sums, &y, None);
        assert_ne!(sums[0].row, sums[1].row);
        for (sum, other) in [(0, 1), (1, 0)] {
            assert_eq!(sums[sum].shares[sums[other].row], 0.0);
        }
        let mut disturbed = [5.0 + 1e-15, 1.0, 0.25];
        close(&sums, &mut disturbed, None);
        assert!((disturbed[0] + disturbed[1] - 6.0).abs() < 1e-15);
    }
}
