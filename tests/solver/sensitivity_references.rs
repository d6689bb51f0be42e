//! Sensitivities through everything that can happen in a run, against closed forms in 40 digits.
//!
//! Each case is a model text with a reference: the value of something at the end and its derivatives to
//! all parameters in their order. They are those of the closed form given with the case, differentiated
//! by mpmath's `diff` at 40 digits (`predator and prey`, which has none: `odefun` with 26 digits and
//! differences extrapolated once).
//!
//! A derivative may be off by 1e-7 of itself, or of |value/parameter| where it is smaller than that: a
//! sensitivity that vanishes is one to rounding of what it is taken of.

use dgd_execute::InterpretedSystem;
use dgd_runtime::{
    InputColumn, Inputs, Interpolation, Options, Problem, Solution, System, observe,
    simulate_with_sensitivities,
};

use crate::inline;

/// Two digits more than what is asked: errors of single steps add up.
const RTOL: f64 = 1e-11;
const CLOSE: f64 = 1e-7;

struct Case {
    name: &'static str,
    model: &'static str,
    /// Samples of the only input `u`: times and values.
    input: Option<(Interpolation, &'static [f64], &'static [f64])>,
    until: f64,
    /// Unknowns or outputs at the end: the value, and its derivative to each parameter.
    expected: &'static [(&'static str, &'static [f64])],
}

const HELD: Option<(Interpolation, &[f64], &[f64])> =
    Some((Interpolation::Hold, &[0.0, 2.0], &[1.0, 3.0]));
const LINEAR: Option<(Interpolation, &[f64], &[f64])> =
    Some((Interpolation::Linear, &[0.0, 2.0, 5.0], &[0.0, 4.0, 1.0]));

const CASES: &[Case] = &[
    Case {
        // x = K/(1 + (K/x₀ − 1) e^(−r t))
        name: "a start value",
        model: "
            parameter r [1/s] = 0.8
            parameter K = 2
            parameter x0 = 0.1
            state x = x0
            equation growth: der(x) = r*x*(1 - x/K)",
        input: None,
        until: 3.0,
        expected: &[(
            "x",
            &[
                0.734_311_136_229_352_8,
                1.394_114_141_502_393_7,
                0.122_574_139_780_923_13,
                4.891_628_566_675_066,
            ],
        )],
    },
    Case {
        name: "predator and prey",
        model: "
            parameter a [1/s] = 1.1
            parameter b [1/s] = 0.4
            parameter c [1/s] = 0.4
            parameter d [1/s] = 0.1
            state x = 1.5
            state y = 1
            equation prey: der(x) = a*x - b*x*y
            equation predator: der(y) = d*x*y - c*y",
        input: None,
        until: 5.0,
        expected: &[
            (
                "x",
                &[
                    3.818_550_314_414_919,
                    -23.418_144_015_622_175,
                    14.373_690_395_899_137,
                    3.245_257_220_364_671_5,
                    -99.561_841_092_726_06,
                ],
            ),
            (
                "y",
                &[
                    6.503_854_358_253_243,
                    7.628_190_793_543_006,
                    -23.543_833_299_615_585,
                    4.114_127_039_869_445,
                    -12.091_885_331_969_55,
                ],
            ),
        ],
    },
    Case {
        // Between samples x = k u + (x − k u) e^(−t/T).
        name: "jumps of a held input",
        model: "
            input u hold
            parameter k = 0.7
            parameter T [s] = 1.5
            parameter x0 = 0.2
            state x = x0
            equation lag: T*der(x) = k*u - x",
        input: HELD,
        until: 4.0,
        expected: &[(
            "x",
            &[
                1.696_222_281_026_582,
                2.403_322_272_545_745,
                -0.389_795_061_853_172_5,
                0.069_483_451_222_801_53,
            ],
        )],
    },
    Case {
        // Where u = u₀ + m t: x = k (u − m T) + (x₀ − k (u₀ − m T)) e^(−t/T).
        name: "kinks of a linear input",
        model: "
            input u linear
            parameter k = 0.7
            parameter T [s] = 1.5
            parameter x0 = 0.2
            state x = x0
            equation lag: T*der(x) = k*u - x",
        input: LINEAR,
        until: 4.0,
        expected: &[(
            "x",
            &[
                1.779_480_952_747_904_3,
                2.522_263_232_147_634,
                -0.210_239_033_388_572_75,
                0.069_483_451_222_801_53,
            ],
        )],
    },
    Case {
        // z + a z³ = k u, and x follows it as above.
        name: "an algebraic unknown that sees jumps",
        model: "
            input u hold
            parameter a = 0.5
            parameter k = 0.9
            parameter x0 = 0.3
            state x = x0
            unknown z = 1
            equation follow: 1 [s] * der(x) = z - x
            equation cubic: 0 = z + a*z^3 - k*u",
        input: HELD,
        until: 4.0,
        expected: &[
            (
                "x",
                &[
                    1.283_885_139_449_000_3,
                    -0.614_526_421_254_320_4,
                    0.737_626_696_142_288_4,
                    0.018_315_638_888_734_18,
                ],
            ),
            (
                "z",
                &[1.381_545_157_912_047_7, -0.682_606_606_399_626_4, 0.776_598_391_017_391_6, 0.0],
            ),
        ],
    },
    Case {
        // x = 2 e^(−t/T) + r T e^(−(t − on)/T) (e^(length/T) − 1)
        name: "a pulse at a time of its own",
        model: "
            parameter on [s] = 1.5
            parameter length [s] = 0.25
            parameter r [1/s] = 3
            parameter T [s] = 2
            state x = 2
            let pulse = if time > on and time <= on + length then r else 0
            equation balance: der(x) = -x/T + pulse",
        input: None,
        until: 6.0,
        expected: &[(
            "x",
            &[
                0.183_776_598_964_859_57,
                0.042_101_231_114_565_846,
                0.358_298_904_800_158_86,
                0.028_067_487_409_710_563,
                0.241_402_843_125_910_93,
            ],
        )],
    },
    Case {
        // x = d + (b − d) e^(−c (t − (x₀ − b)/a))
        name: "a mode that a state's threshold ends",
        model: "
            parameter a [1/s] = 0.2
            parameter b = 1.5
            parameter c [1/s] = 0.4
            parameter d = 0.3
            parameter x0 = 4
            state x = x0
            modes tank {
              full { equation level: der(x) = -a }
              low { equation level: der(x) = -c*(x - d) }
              full -> low when x falls below b
            }",
        input: None,
        until: 20.0,
        expected: &[(
            "x",
            &[
                0.359_744_482_041_436_7,
                -1.493_612_051_035_918_3,
                -0.069_701_895_715_009_52,
                -0.448_083_613_310_775_5,
                0.950_212_931_632_136,
                0.119_488_964_082_863_73,
            ],
        )],
    },
    Case {
        // x = te e^(−c (t − te)) with te = b/k, where k u = k t passes b.
        name: "a threshold that an input passes",
        model: "
            input u linear
            parameter k = 0.8
            parameter b = 1.2
            parameter c [1/s] = 0.5
            state x [s] = 0
            modes gate {
              open { equation e: der(x) = 1 }
              shut { equation e: der(x) = -c*x }
              open -> shut when k*u rises above b
            }",
        input: Some((Interpolation::Linear, &[0.0, 4.0], &[0.0, 4.0])),
        until: 3.0,
        expected: &[(
            "x",
            &[
                0.708_549_829_111_522_1,
                -1.549_952_751_181_454_6,
                1.033_301_834_120_969_7,
                -1.062_824_743_667_283,
            ],
        )],
    },
    Case {
        // Four resets at d to d + n: x = (d + n) e^(−a (t − t₄)).
        name: "repeated resets",
        model: "
            parameter a [1/s] = 0.9
            parameter d = 0.5
            parameter n = 0.8
            parameter x0 = 2
            state x = x0
            modes refill {
              falling { equation e: der(x) = -a*x }
              falling -> falling when x falls below d { reset x = x + n }
            }",
        input: None,
        until: 5.0,
        expected: &[(
            "x",
            &[
                1.015_308_960_411_963_2,
                -5.076_544_802_059_816,
                -4.998_444_112_797_357,
                3.124_027_570_498_348_4,
                0.507_654_480_205_980_6,
            ],
        )],
    },
    Case {
        // Parabolas between impacts at √(2 h₀/g), and 2 vₖ/g apart, vₖ = eᵏ √(2 g h₀).
        name: "a ball after four impacts",
        model: "
            parameter g [m/s^2] = 9.81
            parameter h0 [m] = 10
            parameter e = 0.8
            state h [m] = h0
            state v [m/s] = 0
            equation way: der(h) = v
            modes ball {
              flying { equation weight: der(v) = -g }
              flying -> flying when h falls below 0 [m] {
                reset h = 0 [m]
                reset v = -e*v
              }
            }",
        input: None,
        until: 8.0,
        expected: &[
            (
                "h",
                &[
                    0.841_028_867_482_400_5,
                    -1.652_051_128_059_001,
                    1.704_765_043_374_12,
                    80.922_718_449_760_03,
                ],
            ),
            (
                "v",
                &[
                    -4.051_655_391_564_7,
                    -4.206_506_391_007_375,
                    3.721_417_230_421_765,
                    155.311_179_806_22,
                ],
            ),
        ],
    },
    Case {
        // Before: ẋ = −z, so t = P(z₀) − P(z) with P = ln z + 3/2 a z²; then x = b e^(−c (t − te)).
        name: "a mode change inside a DAE",
        model: "
            parameter a = 0.5
            parameter b = 0.8
            parameter c = 1.7
            parameter x0 = 2
            state x = x0
            unknown z = 1
            equation outflow: 1 [s] * der(x) = -z
            modes valve {
              wide { equation flow: 0 = z + a*z^3 - x }
              narrow { equation flow: 0 = z - c*x }
              wide -> narrow when x falls below b
            }",
        input: None,
        until: 3.0,
        expected: &[(
            "x",
            &[
                0.044_690_840_802_630_395,
                0.036_415_785_739_850_69,
                -0.059_646_492_304_219_7,
                -0.075_838_862_348_494_1,
                0.064_411_910_192_928_43,
            ],
        )],
    },
    Case {
        // w = (x₀ e^(−k (t − τ)))²
        name: "an output that is read late",
        model: "
            parameter k [1/s] = 0.4
            parameter tau [s] = 0.7
            parameter x0 = 1.3
            state x = x0
            equation decay: der(x) = -k*x
            output w = delay(x, tau)^2",
        input: None,
        until: 3.0,
        expected: &[(
            "w",
            &[
                0.268_401_450_120_696,
                -1.234_646_670_555_201_5,
                0.214_721_160_096_556_78,
                0.412_925_307_877_993_8,
            ],
        )],
    },
    Case {
        // The jump comes at 2 s + τ.
        name: "a held input that is read late",
        model: "
            input u hold
            parameter k = 0.7
            parameter T [s] = 1.5
            parameter x0 = 0.2
            parameter tau [s] = 0.6
            state x = x0
            equation lag: T*der(x) = k*delay(u, tau) - x",
        input: HELD,
        until: 4.0,
        expected: &[(
            "x",
            &[
                1.514_721_265_172_561_7,
                2.144_035_107_040_002,
                -0.404_319_429_043_580_3,
                0.069_483_451_222_801_53,
                -0.367_024_672_810_691_7,
            ],
        )],
    },
    Case {
        name: "a linear input that is read late",
        model: "
            input u linear
            parameter k = 0.7
            parameter T [s] = 1.5
            parameter x0 = 0.2
            parameter tau [s] = 0.6
            state x = x0
            equation lag: T*der(x) = k*delay(u, tau) - x",
        input: LINEAR,
        until: 4.0,
        expected: &[(
            "x",
            &[
                1.862_868_389_592_684_3,
                2.641_388_125_921_891,
                -0.397_793_498_108_347_7,
                0.069_483_451_222_801_53,
                0.019_314_466_232_082_65,
            ],
        )],
    },
    Case {
        // x = x₀ (1 − a t + a² (t − τ)²/2! − a³ (t − 2τ)³/3! + …) as far as there are powers above zero
        name: "what a state was some time ago",
        model: "
            parameter a [1/s] = 0.8
            parameter tau [s] = 1
            parameter x0 = 1.5
            state x = x0
            equation decay: der(x) = -a*delay(x, tau)",
        input: None,
        until: 3.5,
        expected: &[("x", &[-0.130_4, 0.638, -0.710_4, -0.086_933_333_333_333_33])],
    },
    Case {
        // The threshold is passed at te = (b − x₀)/v + τ; behind it x = (b + v τ) e^(−c (t − te)).
        name: "a delay inside an event",
        model: "
            parameter v [1/s] = 0.7
            parameter b = 1.2
            parameter c [1/s] = 0.5
            parameter x0 = 0.1
            parameter tau [s] = 0.6
            state x = x0
            modes motor {
              on { equation e: der(x) = v }
              off { equation e: der(x) = -c*x }
              on -> off when delay(x, tau) rises above b
            }",
        input: None,
        until: 5.0,
        expected: &[(
            "x",
            &[
                0.393_820_693_842_017_34,
                -0.296_184_119_707_337_3,
                0.524_399_689_331_081_3,
                -1.113_949_962_581_706_2,
                -0.281_300_495_601_441,
                0.367_079_782_531_756_94,
            ],
        )],
    },
    Case {
        // x falls to zero at te = x₀/(a − d) and stays there, where sign(x) acts as d/a.
        name: "a solution that slides along a switch",
        model: "
            parameter a [1/s] = 2
            parameter d [1/s] = 0.5
            parameter x0 = 1
            state x = x0
            state y [s] = 0
            state z [s] = 0
            equation relay: der(x) = d - a*sign(x)
            equation area: der(y) = x
            equation chatter: der(z) = sign(x)",
        input: None,
        until: 4.0,
        expected: &[
            (
                "y",
                &[
                    0.333_333_333_333_333_3,
                    -0.222_222_222_222_222_2,
                    0.222_222_222_222_222_2,
                    0.666_666_666_666_666_6,
                ],
            ),
            ("z", &[1.5, -0.75, 2.0, 0.5]),
        ],
    },
    Case {
        // q = q₀ + k (b t − t²/2) until it is zero at te = b + √(b² + 2 q₀/k), and v its integral.
        name: "a non-return valve",
        model: "
            parameter k [1/s] = 0.9
            parameter b [s] = 1.1
            parameter q0 [s] = 0.4
            state q [s] = q0
            state v [s^2] = 0
            equation speed: der(q) = k*(b - time)
            equation volume: der(v) = q
            saturate q >= 0 [s]",
        input: None,
        until: 5.0,
        expected: &[(
            "v",
            &[
                1.751_532_262_023_517_2,
                0.813_367_289_297_219_8,
                2.923_266_711_598_648_4,
                2.548_754_254_140_048_7,
            ],
        )],
    },
    Case {
        // y = y₀ e^(−c t) + m e^(−c (t − b/v))
        name: "a reset without modes",
        model: "
            parameter v [1/s] = 0.8
            parameter b = 1.6
            parameter c [1/s] = 0.3
            parameter m = 0.7
            parameter y0 = 1.5
            state x = 0
            state y = y0
            equation way: der(x) = v
            equation decay: der(y) = -c*y
            when x rises above b { reset y = y + m }",
        input: None,
        until: 4.0,
        expected: &[(
            "y",
            &[
                0.835_959_463_134_121_6,
                -0.288_126_108_949_363_86,
                0.144_063_054_474_681_93,
                -2.575_501_562_004_85,
                0.548_811_636_094_026_4,
                0.301_194_211_912_202_1,
            ],
        )],
    },
];

/// The value of an unknown or output at the last time, and its derivatives.
fn found(
    problem: &Problem<'_, InterpretedSystem>,
    solution: &Solution,
    name: &str,
) -> (f64, Vec<f64>) {
    let signature = problem.system.signature();
    let last = solution.len() - 1;
    if let Some(i) = signature.unknowns.iter().position(|unknown| unknown.name == name) {
        let slopes = solution.s(last).chunks(solution.n).map(|column| column[i]);
        return (solution.y(last)[i], slopes.collect());
    }
    let observations = observe(problem, solution);
    let i = signature.outputs.iter().position(|output| output.name == name);
    let i = i.unwrap_or_else(|| panic!("nothing is called `{name}`"));
    let slopes = observations.dw(last).chunks(observations.n_w).map(|column| column[i]);
    (observations.w(last)[i], slopes.collect())
}

#[test]
fn sensitivities_are_those_of_the_closed_forms() {
    for Case { name, model, input, until, expected } in CASES {
        let system = inline::system(&format!("model m\n{model}\n"));
        let p: Vec<f64> = system.signature().parameters.iter().map(|x| x.value).collect();
        let inputs = match input {
            None => Inputs::none(),
            Some((interpolation, times, values)) => {
                let column = InputColumn { name: "u", interpolation: *interpolation, values };
                Inputs::recorded(times, &[column]).expect("samples")
            }
        };
        let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
        let options = Options { rtol: RTOL, atol: RTOL, ..Options::default() };
        let solution = simulate_with_sensitivities(&problem, &[0.0, *until], &options)
            .unwrap_or_else(|failure| panic!("{name}: {failure}"));
        assert!(solution.undefined.is_empty(), "{name}: {:?}", solution.undefined);
        for (of, reference) in *expected {
            let (value, slopes) = found(&problem, &solution, of);
            let [exact, exact_slopes @ ..] = reference else { unreachable!("no value") };
            assert!((value - exact).abs() <= CLOSE * exact.abs(), "{name}: {of} = {value}");
            assert_eq!(slopes.len(), exact_slopes.len(), "{name}: one for each parameter");
            for (j, (slope, exact_slope)) in slopes.iter().zip(exact_slopes).enumerate() {
                let size = exact_slope.abs().max((exact / p[j]).abs());
                assert!(
                    (slope - exact_slope).abs() <= CLOSE * size,
                    "{name}: d({of})/d({}) = {slope} is not {exact_slope}",
                    system.signature().direction_name(j)
                );
            }
        }
    }
}
