//! What a domain offers to the bank, and what all domains use.
//!
//! A domain is a folder `domains/FIELD/NAME` with
//!
//! - `mod.rs`: a simulator in plain Rust, and `pub(crate) static DOMAIN: Domain`;
//! - `model.dgd`: the model, which lacks what is hidden. Its parameters are 10 to 30 % off;
//! - `effects/*.dgd`: six or more near rivals, each of which can be hidden.
//!
//! [`Domain::record`] simulates one recording without noise. Noise, files, twins and the choice of what
//! is hidden with which seed are the bank's: see [`cases`].

pub(crate) mod cases;
pub(crate) mod files;
pub(crate) mod integrate;
pub(crate) mod noise;
pub(crate) mod random;
pub(crate) mod signal;
pub(crate) mod twin;
pub(crate) mod units;

use noise::Noise;
use random::Random;

/// A plant with its model and all that can be hidden in it.
#[derive(Debug)]
pub(crate) struct Domain {
    /// Name of its folder.
    pub(crate) name: &'static str,
    /// Text of `model.dgd`.
    pub(crate) model: &'static str,
    /// Names and texts of the files in `effects`, without `.dgd`.
    pub(crate) effects: &'static [(&'static str, &'static str)],
    /// What can be hidden: of each kind, a few are drawn by the seed.
    pub(crate) hidden: &'static [Hidden],
    /// The simulator.
    pub(crate) record: fn(&Plan) -> Recording,
}

/// Something that can be hidden in a plant.
#[derive(Debug)]
pub(crate) struct Hidden {
    /// Its name, unique in the domain, by which [`Plan::hides`] asks. Of the library it is the name of the
    /// effect, or two joined by `+`.
    pub(crate) name: &'static str,
    pub(crate) truth: Truth,
    /// The text of an effect file that is the truth: the model with it fits to the noise. Empty for effects
    /// of the library, whose files are there.
    pub(crate) effect: &'static str,
}

impl Hidden {
    /// One or two effects of the library, joined by `+`.
    pub(crate) const fn library(name: &'static str) -> Self {
        Hidden { name, truth: Truth::Library, effect: "" }
    }
}

/// What is to be found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Truth {
    /// Nothing.
    Nothing,
    /// The effects of the library that the name lists.
    Library,
    /// The library is withheld; one of these names, `name(target, …)`, is right. More than the first only
    /// where the model cannot tell them apart. `name(target)` accepts further targets, and `name` any.
    Template(&'static [&'static str]),
    /// The library is withheld; a parameter of the model is not constant. Its values are [`Recording::trace`].
    Parameter {
        /// Name of the parameter.
        name: &'static str,
        /// Other places that are as right: an equation's label, an input, or an effect `name(target)`.
        places: &'static [&'static str],
        /// How it changes, in words.
        law: &'static str,
    },
}

/// What kind of case it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Kind {
    /// Effects of the domain's own library are hidden.
    Library,
    /// The library is withheld; a general template has a name for what is hidden.
    Template,
    /// The library is withheld; a parameter changes.
    Parameter,
    /// Nothing is hidden, and the noise is odd.
    Nothing,
    /// A case again with other units, names, order or scales.
    Twin,
}

impl Kind {
    pub(crate) const ALL: [Kind; 5] =
        [Kind::Library, Kind::Template, Kind::Parameter, Kind::Nothing, Kind::Twin];

    pub(crate) fn word(self) -> &'static str {
        match self {
            Kind::Library => "library",
            Kind::Template => "template",
            Kind::Parameter => "parameter",
            Kind::Nothing => "nothing",
            Kind::Twin => "twin",
        }
    }
}

impl Truth {
    pub(crate) fn kind(&self) -> Kind {
        match self {
            Truth::Nothing => Kind::Nothing,
            Truth::Library => Kind::Library,
            Truth::Template(_) => Kind::Template,
            Truth::Parameter { .. } => Kind::Parameter,
        }
    }
}

/// Which of a case's two recordings it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Part {
    Train,
    Valid,
}

/// What is to be recorded.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plan {
    /// [`Hidden::name`], empty where nothing is hidden.
    pub(crate) hidden: &'static str,
    pub(crate) part: Part,
    pub(crate) seed: u64,
}

impl Plan {
    /// Whether this is hidden, alone or beside another.
    pub(crate) fn hides(&self, name: &str) -> bool {
        self.hidden.split('+').any(|hidden| hidden == name)
    }

    /// Numbers for the plant's true parameters and for sizes of what is hidden: the same in both recordings.
    /// Draw all parameters first, then sizes, so that equal seeds are equal plants.
    pub(crate) fn sizes(&self) -> Random {
        Random::new(self.seed, 0)
    }

    /// Numbers for inputs and start values, others in each recording.
    pub(crate) fn excitation(&self) -> Random {
        Random::new(self.seed, 1 + self.part as u64)
    }

    /// Numbers for noise.
    pub(crate) fn errors(&self) -> Random {
        Random::new(self.seed, 3 + self.part as u64)
    }

    pub(crate) fn is_train(&self) -> bool {
        self.part == Part::Train
    }
}

/// What a simulator records, without noise: 200 to 2000 rows.
#[derive(Debug, Clone)]
pub(crate) struct Recording {
    /// Unit of the times: `s`, `ms`, `min`, `h`.
    pub(crate) time_unit: &'static str,
    /// Times of the rows in that unit.
    pub(crate) times: Vec<f64>,
    /// Inputs, then outputs.
    pub(crate) columns: Vec<Column>,
    /// Values of the changing parameter at the rows, in the unit that the model declares; empty where none changes.
    pub(crate) trace: Vec<f64>,
    /// What is hidden in numbers, each as `name [unit]`; for the truth's file only.
    pub(crate) sizes: Vec<(&'static str, f64)>,
}

/// A column of a recording.
#[derive(Debug, Clone)]
pub(crate) struct Column {
    /// Name of the input or output.
    pub(crate) name: String,
    /// Unit of the values: the one that the model declares.
    pub(crate) unit: String,
    /// Standard deviation of the sensor's error; none for an input.
    pub(crate) noise: Option<f64>,
    pub(crate) values: Vec<f64>,
}

impl Column {
    pub(crate) fn input(name: &str, unit: &str, values: Vec<f64>) -> Self {
        Column { name: name.to_owned(), unit: unit.to_owned(), noise: None, values }
    }

    pub(crate) fn output(name: &str, unit: &str, noise: f64, values: Vec<f64>) -> Self {
        Column { name: name.to_owned(), unit: unit.to_owned(), noise: Some(noise), values }
    }
}

/// A case: files, and the truth.
#[derive(Debug, Clone)]
pub(crate) struct Case {
    /// Name of its folder.
    pub(crate) name: String,
    pub(crate) domain: &'static str,
    pub(crate) kind: Kind,
    /// Text of `model.dgd`.
    pub(crate) model: String,
    /// Names and texts of `effects/*.dgd`; empty where the library is withheld.
    pub(crate) effects: Vec<(String, String)>,
    pub(crate) train: Recording,
    pub(crate) valid: Recording,
    /// What is hidden, by name; empty for nothing.
    pub(crate) hidden: &'static str,
    pub(crate) truth: Truth,
    /// The truth as an effect file, where the library has none.
    pub(crate) effect: String,
    pub(crate) noise: Noise,
    /// For a twin, the case that it is again and what was changed.
    pub(crate) twin: Option<twin::Twin>,
}
