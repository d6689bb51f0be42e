//! The cases, the peers with their methods, and the target ratios.

/// A problem with its outputs.
#[derive(Debug)]
pub(crate) struct Case {
    /// Its name in requests.
    pub(crate) name: &'static str,
    /// Its description.
    pub(crate) title: &'static str,
    /// Relative tolerances.
    pub(crate) tolerances: &'static [f64],
    /// Reference in `examples/data/field/`, without `.bin`.
    pub(crate) reference: &'static str,
    /// The layout of the reference, and the part that counts.
    pub(crate) outputs: Outputs,
    /// The error at which times are compared.
    pub(crate) equal_error: f64,
}

/// The outputs of a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outputs {
    /// Rows of two states and ten sensitivities; the states count.
    States,
    /// The same rows, of which programs compute everything; the sensitivities count.
    Sensitivities,
    /// Numbers whose errors are relative to the range of the reference.
    Series,
    /// Numbers whose errors are relative to each number itself.
    Numbers,
}

impl Case {
    /// Its label in a table.
    pub(crate) fn label(&self) -> String {
        match (self.states(), self.name) {
            (Some(states), _) => format!("P3, {:.0} cells", states / 2.0),
            (None, "fit") => "fit of M, c0 and c2".to_owned(),
            (None, "fit6") => "fit of six parameters".to_owned(),
            (None, name) => name.replacen('p', "P", 1),
        }
    }

    /// Number of states of a line; `None` for cases of fixed size.
    pub(crate) fn states(&self) -> Option<f64> {
        let cells: f64 = self.name.strip_prefix("p3-")?.parse().ok()?;
        Some(2.0 * cells)
    }
}

/// A program with its methods.
#[derive(Debug)]
pub(crate) struct Peer {
    /// Its name.
    pub(crate) name: &'static str,
    /// The program.
    pub(crate) program: Program,
    /// Cases, each with the methods to try.
    pub(crate) methods: &'static [(&'static str, &'static [&'static str])],
}

/// The kind of a program.
#[derive(Debug)]
pub(crate) enum Program {
    /// A member of this workspace.
    Rust {
        /// The dependency whose version is reported; `None` for this repository.
        dependency: Option<&'static str>,
    },
    /// Sources in C, and the libraries they need.
    C {
        /// Folder of the sources.
        folder: &'static str,
        /// Libraries, in the linker's notation.
        libraries: &'static [&'static str],
        /// How to install the requirements.
        advice: &'static str,
    },
    /// A script, and the module it needs.
    Python {
        /// The script in `python/`.
        script: &'static str,
        /// The module.
        module: &'static str,
        /// How to install the requirements.
        advice: &'static str,
    },
}

/// A target.
#[derive(Debug)]
pub(crate) enum Bar {
    /// Faster than a peer by this factor, at equal error.
    Faster {
        /// The case.
        case: &'static str,
        /// The peer.
        peer: &'static str,
        /// One of its methods; the best by default.
        method: Option<&'static str>,
        /// The peer's time over ours, at least.
        ratio: f64,
    },
    /// A case costs at most this factor of another.
    AtMost {
        /// The more expensive case.
        case: &'static str,
        /// The cheaper case.
        than: &'static str,
        /// Time over time, at most.
        ratio: f64,
    },
    /// The same work on all cores of the machine.
    Threads {
        /// The case on one core.
        one: &'static str,
        /// The case on all cores.
        all: &'static str,
    },
    /// A loaded model costs at most this factor of one compiled by rustc.
    Loaded {
        /// The case.
        case: &'static str,
        /// The method for the compiled model.
        compiled: &'static str,
        /// The method for the loaded one.
        loaded: &'static str,
        /// Time over time at the same tolerance, at most.
        ratio: f64,
    },
    /// Time and memory grow with the number of states.
    Linear {
        /// Cases by increasing size.
        cases: &'static [&'static str],
        /// The largest exponent.
        exponent: f64,
        /// Bytes of memory for each additional state, at most.
        bytes: f64,
    },
    /// A fit reports which of its parameters the data do not determine, and estimates the others.
    Says {
        /// The case.
        case: &'static str,
        /// Words that the report must contain.
        words: &'static [&'static str],
    },
    /// Build time of a user's crate in seconds, at most.
    Build {
        /// With its dependencies built.
        again: f64,
        /// From scratch.
        first: f64,
    },
}

/// The peer that the others are compared with.
pub(crate) const OURS: &str = "dgd";

/// A larger error means a different answer instead of a lack of accuracy.
pub(crate) const DISAGREEMENT: f64 = 1e-2;

const USUAL: &[f64] = &[1e-4, 1e-6, 1e-8];

/// P3 by size.
const LINES: &[&str] = &["p3-1000", "p3-10000", "p3-100000", "p3-1000000"];

/// All cases.
pub(crate) static CASES: &[Case] = &[
    Case {
        name: "p5a",
        title: "P5a: a recording, 6000 s at 1 Hz, inputs that change every second",
        tolerances: USUAL,
        reference: "p5",
        outputs: Outputs::States,
        equal_error: 1e-6,
    },
    Case {
        name: "p5b",
        title: "P5b: the recording with five sensitivities",
        tolerances: USUAL,
        reference: "p5",
        outputs: Outputs::Sensitivities,
        equal_error: 2e-6,
    },
    Case {
        name: "fit",
        title: "A fit of M, c0 and c2 to the recording, 6000 × 2 samples with noise",
        tolerances: &[1e-4, 1e-6],
        reference: "fit",
        outputs: Outputs::Numbers,
        equal_error: 1e-4,
    },
    Case {
        name: "fit6",
        title: "A fit of six parameters to four instruments, 6000 × 4 samples with noise",
        tolerances: USUAL,
        reference: "fit6",
        outputs: Outputs::Numbers,
        equal_error: 1e-6,
    },
    Case {
        name: "rank",
        title: "The fit with F free, too, of which data determines only a sum with c2",
        tolerances: &[1e-4],
        reference: "rank",
        outputs: Outputs::Numbers,
        equal_error: 1e-4,
    },
    Case {
        name: "p1a",
        title: "P1a: two-state ODE, a jump of the input, 1001 outputs",
        tolerances: USUAL,
        reference: "p1",
        outputs: Outputs::States,
        equal_error: 1e-6,
    },
    Case {
        name: "p1b",
        title: "P1b: the ODE with five sensitivities",
        tolerances: USUAL,
        reference: "p1",
        outputs: Outputs::Sensitivities,
        equal_error: 1e-5,
    },
    Case {
        name: "p2a",
        title: "P2a: the same as index-1 DAE",
        tolerances: USUAL,
        reference: "p2",
        outputs: Outputs::States,
        equal_error: 1e-6,
    },
    Case {
        name: "p2b",
        title: "P2b: the DAE with five sensitivities",
        tolerances: USUAL,
        reference: "p2",
        outputs: Outputs::Sensitivities,
        equal_error: 1e-6,
    },
    Case {
        name: "p3-1000",
        title: "P3: a hydraulic line of 1000 cells",
        tolerances: &[1e-4, 1e-5],
        reference: "p3-1000",
        outputs: Outputs::Series,
        equal_error: 2e-4,
    },
    Case {
        name: "p3-10000",
        title: "P3: a hydraulic line of 10 000 cells",
        tolerances: &[1e-4, 1e-5],
        reference: "p3-10000",
        outputs: Outputs::Series,
        equal_error: 2e-4,
    },
    Case {
        name: "p3-100000",
        title: "P3: a hydraulic line of 100 000 cells",
        tolerances: &[1e-5],
        reference: "p3-100000",
        outputs: Outputs::Series,
        equal_error: 2e-4,
    },
    Case {
        name: "p3-1000000",
        title: "P3: a hydraulic line of 1 000 000 cells",
        tolerances: &[1e-5],
        reference: "p3-1000000",
        outputs: Outputs::Series,
        equal_error: 2e-4,
    },
    Case {
        name: "p4",
        title: "P4: 10 000 parameter sets of P1a, one core",
        tolerances: &[1e-4, 1e-6],
        reference: "p4",
        outputs: Outputs::Numbers,
        equal_error: 2e-6,
    },
    Case {
        name: "p4-threads",
        title: "P4 on all cores",
        tolerances: &[1e-4, 1e-6],
        reference: "p4",
        outputs: Outputs::Numbers,
        equal_error: 2e-6,
    },
];

/// All peers, with the methods found best for a case, or close to it.
pub(crate) static PEERS: &[Peer] = &[
    Peer {
        name: OURS,
        program: Program::Rust { dependency: None },
        methods: &[
            ("p1a", &["rodas5p", "tsit5", "rodas5p, loaded"]),
            ("p1b", &["rodas5p", "tsit5", "rodas5p, loaded"]),
            ("p2a", &["rodas5p"]),
            ("p2b", &["rodas5p"]),
            ("p3-1000", &["rodas5p, loaded"]),
            ("p3-10000", &["rodas5p, loaded"]),
            ("p3-100000", &["rodas5p, loaded"]),
            ("p3-1000000", &["rodas5p, loaded"]),
            ("p4", &["rodas5p", "tsit5"]),
            ("p4-threads", &["rodas5p", "tsit5"]),
            ("p5a", &["rodas5p", "tsit5 1 per sample", "taylor per sample", "taylor4 1 per sample"]),
            ("p5b", &["rodas5p", "tsit5 1 per sample", "taylor per sample", "taylor7 1 per sample"]),
            ("fit", &["rodas5p", "auto", "taylor per sample"]),
            ("fit6", &["rodas5p", "auto", "taylor per sample"]),
            ("rank", &["auto"]),
        ],
    },
    Peer {
        name: "diffsol",
        program: Program::Rust { dependency: Some("diffsol") },
        methods: &[
            ("p1a", &["bdf", "tr_bdf2", "esdirk34"]),
            ("p1b", &["bdf", "tr_bdf2", "esdirk34"]),
            ("p2a", &["bdf", "tr_bdf2", "esdirk34"]),
            ("p2b", &["bdf", "tr_bdf2", "esdirk34"]),
            ("p3-1000", &["tr_bdf2", "esdirk34"]),
            // Set-up takes nearly all of the time, and 94 bytes for each pair of cells.
            ("p3-10000", &["esdirk34"]),
            ("p4", &["bdf", "esdirk34"]),
            ("p5a", &["bdf", "tr_bdf2", "esdirk34"]),
            ("p5b", &["bdf", "tr_bdf2", "esdirk34"]),
        ],
    },
    Peer {
        name: "differential-equations",
        program: Program::Rust { dependency: Some("differential-equations") },
        methods: &[
            ("p1a", &["radau5", "dopri5"]),
            ("p1b", &["radau5", "dopri5"]),
            ("p2a", &["radau5"]),
            ("p4", &["radau5"]),
            ("p5a", &["dopri5", "radau5"]),
            ("p5b", &["dopri5"]),
        ],
    },
    Peer {
        name: "sundials",
        program: Program::C {
            folder: "sundials",
            libraries: &[
                "sundials_cvodes",
                "sundials_idas",
                "sundials_nvecserial",
                "sundials_sunmatrixdense",
                "sundials_sunmatrixband",
                "sundials_sunlinsoldense",
                "sundials_sunlinsolband",
                "sundials_sunnonlinsolfixedpoint",
                "m",
            ],
            advice: "apt-get install gcc libsundials-dev, or --install, or SUNDIALS_DIR=PREFIX where it is",
        },
        methods: &[
            ("p1a", &["bdf"]),
            ("p1b", &["staggered", "simultaneous"]),
            ("p2a", &["bdf"]),
            // Simultaneous corrections give wrong sensitivities here: 3e-3 at every tolerance.
            ("p2b", &["staggered"]),
            ("p3-1000", &["band"]),
            ("p3-10000", &["band"]),
            ("p3-100000", &["band"]),
            ("p3-1000000", &["band"]),
            ("p4", &["bdf"]),
            ("p5a", &["bdf", "adams"]),
            ("p5b", &["adams"]),
        ],
    },
    Peer {
        name: "casadi",
        program: Program::Python {
            script: "casadi_peer.py",
            module: "casadi",
            advice: "pip install casadi, or --install, or PYTHON=PROGRAM that has it",
        },
        methods: &[
            ("p1a", &["cvodes"]),
            ("p1b", &["cvodes"]),
            ("p2a", &["idas"]),
            ("p2b", &["idas"]),
            ("p5a", &["rk4"]),
            ("p5b", &["rk4"]),
            ("fit", &["lm", "ipopt"]),
            ("fit6", &["lm", "ipopt"]),
            ("rank", &["lm", "ipopt"]),
        ],
    },
    Peer {
        name: "scipy",
        program: Program::Python {
            script: "scipy_peer.py",
            module: "scipy",
            advice: "pip install scipy, or --install, or PYTHON=PROGRAM that has it",
        },
        methods: &[
            ("p1a", &["LSODA"]),
            ("p1b", &["LSODA"]),
            ("p5a", &["RK45"]),
            ("p5b", &["RK45"]),
            ("fit", &["trf"]),
            ("fit6", &["trf"]),
            ("rank", &["trf"]),
        ],
    },
];

/// All targets.
pub(crate) static BARS: &[Bar] = &[
    Bar::Faster { case: "p5a", peer: "diffsol", method: None, ratio: 20.0 },
    Bar::Faster { case: "p5a", peer: "sundials", method: None, ratio: 120.0 },
    Bar::Faster { case: "p5a", peer: "differential-equations", method: None, ratio: 9.0 },
    Bar::Faster { case: "p5b", peer: "diffsol", method: None, ratio: 50.0 },
    Bar::Faster { case: "p5b", peer: "sundials", method: None, ratio: 150.0 },
    Bar::Faster { case: "p5b", peer: "differential-equations", method: None, ratio: 4.0 },
    Bar::AtMost { case: "p5b", than: "p5a", ratio: 4.0 },
    Bar::Faster { case: "fit", peer: "casadi", method: Some("lm"), ratio: 7.0 },
    Bar::Faster { case: "fit", peer: "casadi", method: Some("ipopt"), ratio: 50.0 },
    Bar::Faster { case: "fit", peer: "scipy", method: None, ratio: 4000.0 },
    Bar::Faster { case: "fit6", peer: "casadi", method: Some("lm"), ratio: 5.0 },
    Bar::Faster { case: "fit6", peer: "casadi", method: Some("ipopt"), ratio: 30.0 },
    Bar::Faster { case: "fit6", peer: "scipy", method: None, ratio: 2000.0 },
    Bar::Says { case: "rank", words: &["c2", "F"] },
    Bar::Faster { case: "p1a", peer: "diffsol", method: None, ratio: 8.0 },
    Bar::Faster { case: "p1a", peer: "sundials", method: None, ratio: 25.0 },
    Bar::Faster { case: "p1a", peer: "differential-equations", method: None, ratio: 2.5 },
    Bar::Faster { case: "p1b", peer: "diffsol", method: None, ratio: 10.0 },
    Bar::Faster { case: "p1b", peer: "sundials", method: None, ratio: 40.0 },
    Bar::AtMost { case: "p1b", than: "p1a", ratio: 5.0 },
    Bar::Faster { case: "p2a", peer: "diffsol", method: None, ratio: 13.0 },
    Bar::Faster { case: "p2a", peer: "sundials", method: None, ratio: 40.0 },
    Bar::Faster { case: "p2b", peer: "diffsol", method: None, ratio: 20.0 },
    Bar::Faster { case: "p2b", peer: "sundials", method: None, ratio: 60.0 },
    Bar::Faster { case: "p3-1000", peer: "sundials", method: None, ratio: 6.0 },
    Bar::Faster { case: "p3-10000", peer: "sundials", method: None, ratio: 6.0 },
    Bar::Faster { case: "p3-100000", peer: "sundials", method: None, ratio: 6.0 },
    Bar::Faster { case: "p3-1000000", peer: "sundials", method: None, ratio: 6.0 },
    Bar::Linear { cases: LINES, exponent: 1.05, bytes: 200.0 },
    Bar::Faster { case: "p4", peer: "diffsol", method: None, ratio: 20.0 },
    Bar::Faster { case: "p4", peer: "sundials", method: None, ratio: 70.0 },
    Bar::Threads { one: "p4", all: "p4-threads" },
    Bar::Loaded { case: "p1a", compiled: "rodas5p", loaded: "rodas5p, loaded", ratio: 1.5 },
    Bar::Loaded { case: "p1b", compiled: "rodas5p", loaded: "rodas5p, loaded", ratio: 1.5 },
    Bar::Build { again: 15.0, first: 90.0 },
];
