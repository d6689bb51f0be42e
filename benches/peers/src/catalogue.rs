//! What is compared: the cases, the peers with their methods, and the ratios to reach.

/// A problem with its outputs.
#[derive(Debug)]
pub(crate) struct Case {
    /// What programs are asked for.
    pub(crate) name: &'static str,
    /// What it is.
    pub(crate) title: &'static str,
    /// Relative tolerances.
    pub(crate) tolerances: &'static [f64],
    /// Reference in `data/`, without `.bin`.
    pub(crate) reference: &'static str,
    /// How the reference is laid out, and which of it counts.
    pub(crate) outputs: Outputs,
    /// The error at which times are compared.
    pub(crate) equal_error: f64,
}

/// What a case has for outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outputs {
    /// Rows of two states and ten sensitivities, of which the states count.
    States,
    /// The same; programs give all of it, and the sensitivities count.
    Sensitivities,
    /// Numbers that are compared with the range of the reference.
    Series,
    /// Numbers that are each compared with the size of their own.
    Numbers,
}

/// A program and what it is asked for.
#[derive(Debug)]
pub(crate) struct Peer {
    /// What it is called.
    pub(crate) name: &'static str,
    /// What there is to run.
    pub(crate) program: Program,
    /// Cases, each with the methods that are tried.
    pub(crate) methods: &'static [(&'static str, &'static [&'static str])],
}

/// What there is to run.
#[derive(Debug)]
pub(crate) enum Program {
    /// A member of this workspace.
    Rust {
        /// The dependency whose version is told; none for this repository's own.
        dependency: Option<&'static str>,
    },
    /// Sources in C, and the libraries they need.
    C {
        /// Folder of the sources.
        folder: &'static str,
        /// Libraries, as the linker names them.
        libraries: &'static [&'static str],
        /// How to get what it needs.
        advice: &'static str,
    },
    /// A script, and the module it needs.
    Python {
        /// The script in `python/`.
        script: &'static str,
        /// The module.
        module: &'static str,
        /// How to get what it needs.
        advice: &'static str,
    },
}

/// How many times faster than a peer to be.
#[derive(Debug)]
pub(crate) struct Target {
    /// The case.
    pub(crate) case: &'static str,
    /// The peer.
    pub(crate) peer: &'static str,
    /// One of its methods; the best of all where none is named.
    pub(crate) method: Option<&'static str>,
    /// The peer's time over ours, at least.
    pub(crate) ratio: f64,
}

/// How much dearer one case may be than another.
#[derive(Debug)]
pub(crate) struct Limit {
    /// The dearer case.
    pub(crate) case: &'static str,
    /// The cheaper.
    pub(crate) than: &'static str,
    /// Time over time, at most.
    pub(crate) ratio: f64,
}

/// The peer that all others are compared with.
pub(crate) const OURS: &str = "dgd";

/// An error beyond this is no lack of accuracy but another answer.
pub(crate) const DISAGREEMENT: f64 = 1e-2;

const USUAL: &[f64] = &[1e-4, 1e-6, 1e-8];

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
        name: "p3-100",
        title: "P3: a hydraulic line of 100 cells",
        tolerances: &[1e-5],
        reference: "p3-100",
        outputs: Outputs::Series,
        equal_error: 2e-4,
    },
    Case {
        name: "p3-1000",
        title: "P3: a hydraulic line of 1000 cells",
        tolerances: &[1e-5],
        reference: "p3-1000",
        outputs: Outputs::Series,
        equal_error: 2e-4,
    },
    Case {
        name: "p4",
        title: "P4: 10 000 parameter sets of P1a, one core",
        tolerances: &[1e-6],
        reference: "p4",
        outputs: Outputs::Numbers,
        equal_error: 1e-5,
    },
];

/// All peers; methods are those that were found best for a case, or close to it.
pub(crate) static PEERS: &[Peer] = &[
    Peer {
        name: OURS,
        program: Program::Rust { dependency: None },
        methods: &[
            ("p1a", &["rodas5p"]),
            ("p1b", &["rodas5p"]),
            ("p2a", &["rodas5p"]),
            ("p2b", &["rodas5p"]),
            ("p5a", &["rodas5p"]),
            ("p5b", &["rodas5p"]),
            ("fit", &["rodas5p"]),
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
            ("p3-100", &["tr_bdf2", "esdirk34"]),
            ("p3-1000", &["tr_bdf2", "esdirk34"]),
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
            advice: "apt-get install gcc libsundials-dev, or SUNDIALS_DIR=PREFIX where it is installed",
        },
        methods: &[
            ("p1a", &["bdf"]),
            ("p1b", &["staggered", "simultaneous"]),
            ("p2a", &["bdf"]),
            // Simultaneous corrections give wrong sensitivities here: 3e-3 at every tolerance.
            ("p2b", &["staggered"]),
            ("p3-100", &["band"]),
            ("p3-1000", &["band"]),
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
            advice: "pip install casadi",
        },
        methods: &[
            ("p1a", &["cvodes"]),
            ("p1b", &["cvodes"]),
            ("p2a", &["idas"]),
            ("p2b", &["idas"]),
            ("p5a", &["rk4"]),
            ("p5b", &["rk4"]),
            ("fit", &["lm", "ipopt"]),
        ],
    },
    Peer {
        name: "scipy",
        program: Program::Python {
            script: "scipy_peer.py",
            module: "scipy",
            advice: "pip install scipy",
        },
        methods: &[
            ("p1a", &["LSODA"]),
            ("p1b", &["LSODA"]),
            ("p5a", &["RK45"]),
            ("p5b", &["RK45"]),
            ("fit", &["trf"]),
        ],
    },
];

/// All ratios to reach.
pub(crate) static TARGETS: &[Target] = &[
    Target { case: "p5a", peer: "diffsol", method: None, ratio: 20.0 },
    Target { case: "p5a", peer: "sundials", method: None, ratio: 120.0 },
    Target { case: "p5a", peer: "differential-equations", method: None, ratio: 9.0 },
    Target { case: "p5b", peer: "diffsol", method: None, ratio: 50.0 },
    Target { case: "p5b", peer: "sundials", method: None, ratio: 150.0 },
    Target { case: "p5b", peer: "differential-equations", method: None, ratio: 4.0 },
    Target { case: "fit", peer: "casadi", method: None, ratio: 7.0 },
    Target { case: "fit", peer: "casadi", method: Some("ipopt"), ratio: 50.0 },
    Target { case: "fit", peer: "scipy", method: None, ratio: 4000.0 },
    Target { case: "p1a", peer: "diffsol", method: None, ratio: 8.0 },
    Target { case: "p1a", peer: "sundials", method: None, ratio: 25.0 },
    Target { case: "p1a", peer: "differential-equations", method: None, ratio: 2.5 },
    Target { case: "p1b", peer: "diffsol", method: None, ratio: 10.0 },
    Target { case: "p1b", peer: "sundials", method: None, ratio: 40.0 },
    Target { case: "p2a", peer: "diffsol", method: None, ratio: 13.0 },
    Target { case: "p2a", peer: "sundials", method: None, ratio: 40.0 },
    Target { case: "p2b", peer: "diffsol", method: None, ratio: 20.0 },
    Target { case: "p2b", peer: "sundials", method: None, ratio: 60.0 },
    Target { case: "p3-1000", peer: "sundials", method: None, ratio: 6.0 },
    Target { case: "p4", peer: "diffsol", method: None, ratio: 20.0 },
    Target { case: "p4", peer: "sundials", method: None, ratio: 70.0 },
];

/// What sensitivities may cost.
pub(crate) static LIMITS: &[Limit] = &[
    Limit { case: "p1b", than: "p1a", ratio: 5.0 },
    Limit { case: "p5b", than: "p5a", ratio: 4.0 },
];
