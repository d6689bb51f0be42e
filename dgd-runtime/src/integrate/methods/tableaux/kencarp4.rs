//! The implicit half of Kennedy and Carpenter's additive pair of order 4(3).

use crate::integrate::methods::tableaux::RungeKuttaTableau;
use crate::integrate::methods::tableaux::triangle;

/// ESDIRK4(3)6L\[2\]SA: L-stable, stiffly accurate, of stage order 2, with an embedded method of
/// order 3.
///
/// The dense output is derived here: its weights b(θ) are the only ones that satisfy
///
/// ```text
///   b·1 = θ,  b·c = θ²/2,  b·c² = θ³/3,  b·c³ = θ⁴/4,  b·A c² = θ⁴/12,  b·A⁻¹ c³ = θ³
/// ```
///
/// with A⁻¹ over the implicit stages. The first five are the conditions for order 4 of a method of stage order 2; the
/// last gives order 3 of algebraic unknowns at index 1. So every error between step ends is at most of order h⁴, as is
/// the global error. b(1) is the method's own.
///
/// The slopes of algebraic unknowns at the end of a step are also derived here: s = Aᵀ W, with the weights W of the
/// stages Y₂ … Y₆ in the derivative at θ = 1 of the interpolant that satisfies
///
/// ```text
///   W·c = θ,  W·c² = θ²,  W·c³ = θ³,  W·A c² = θ³/3,  W·A c³ = θ⁴/4
/// ```
///
/// Stages satisfy the equations, so that no error of k₁ enters, as it would through k₆.
///
/// # Source
///
/// Kennedy and Carpenter, Additive Runge–Kutta schemes for convection–diffusion–reaction equations,
/// Applied Numerical Mathematics 44 (2003) 139–181, appendix C.
pub static KENCARP4: RungeKuttaTableau = RungeKuttaTableau {
    gamma: 0.25,
    a: triangle(&[
        &[],
        &[0.25],
        &[8_611.0 / 62_500.0, -1_743.0 / 31_250.0],
        &[5_012_029.0 / 34_652_500.0, -654_441.0 / 2_922_500.0, 174_375.0 / 388_108.0],
        &[
            15_267_082_809.0 / 155_376_265_600.0,
            -71_443_401.0 / 120_774_400.0,
            730_878_875.0 / 902_184_768.0,
            2_285_395.0 / 8_070_912.0,
        ],
        &[82_889.0 / 524_892.0, 0.0, 15_625.0 / 83_664.0, 69_875.0 / 102_672.0, -2_260.0 / 8_211.0],
    ]),
    c: &[0.0, 0.5, 83.0 / 250.0, 31.0 / 50.0, 17.0 / 20.0, 1.0],
    // b − b̂
    error: &[
        82_889.0 / 524_892.0 - 4_586_570_599.0 / 29_645_900_160.0,
        0.0,
        15_625.0 / 83_664.0 - 178_811_875.0 / 945_068_544.0,
        69_875.0 / 102_672.0 - 814_220_225.0 / 1_159_782_912.0,
        -2_260.0 / 8_211.0 + 3_700_637.0 / 11_593_932.0,
        0.25 - 61_727.0 / 225_920.0,
    ],
    dense: &[
        [
            1.0,
            -8_654_778_351_587.0 / 3_044_238_702_756.0,
            23_490_423_355_186.0 / 6_849_537_081_201.0,
            -19_570_111_251_761.0 / 13_699_074_162_402.0,
        ],
        [
            0.0,
            569_183_833.0 / 1_096_151_427.0,
            -1_065_402_494.0 / 9_865_362_843.0,
            -579_607_429.0 / 1_409_337_549.0,
        ],
        [
            0.0,
            3_060_383_234_375.0 / 623_866_755_024.0,
            -48_399_440_421_875.0 / 4_912_950_695_814.0,
            100_865_839_671_875.0 / 19_651_802_783_256.0,
        ],
        [
            0.0,
            -18_195_737_481_125.0 / 5_359_240_919_664.0,
            58_358_958_045_875.0 / 6_029_146_034_622.0,
            -135_142_103_312_375.0 / 24_116_584_138_488.0,
        ],
        [
            0.0,
            30_691_882_540.0 / 47_621_689_773.0,
            -1_351_384_844_960.0 / 428_595_207_957.0,
            957_191_129_480.0 / 428_595_207_957.0,
        ],
        [0.0, 3_919_521.0 / 23_198_972.0, 60_658.0 / 17_399_229.0, 2_699_017.0 / 34_798_458.0],
    ],
    end_slope: &[
        -1_128_019_409.0 / 11_950_566_092.0,
        -5_852_635.0 / 8_606_178.0,
        11_014_109_375.0 / 17_143_506_576.0,
        -5_552_727_875.0 / 21_038_416_848.0,
        131_538_780.0 / 186_945_311.0,
        189_141.0 / 273_212.0,
    ],
    order: 4,
    estimate_order: 3,
    stability: f64::INFINITY,
    equal_steps: None,
};
