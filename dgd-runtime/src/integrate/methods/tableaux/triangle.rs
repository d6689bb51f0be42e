//! Strictly lower triangles of coefficients.

/// Maximum number of stages of a method; work space is allocated for this many.
pub const MAX_STAGES: usize = 8;

/// A strictly lower triangle of coefficients, with zeros in and above the diagonal.
pub type LowerTriangle = [[f64; MAX_STAGES]; MAX_STAGES];

/// A triangle whose row i has i entries.
///
/// # Panics
///
/// If there are more than [`MAX_STAGES`] rows, or a row has the wrong number of entries.
pub const fn triangle(rows: &[&[f64]]) -> LowerTriangle {
    let mut triangle = [[0.0; MAX_STAGES]; MAX_STAGES];
    let mut i = 0;
    while i < rows.len() {
        assert!(rows[i].len() == i, "row i of a strictly lower triangle has i entries");
        let mut j = 0;
        while j < i {
            triangle[i][j] = rows[i][j];
            j += 1;
        }
        i += 1;
    }
    triangle
}
