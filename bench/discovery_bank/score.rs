//! How good an answer is.

use serde_json::Value;

use crate::bank::{Case, Kind, Truth};
use crate::search::{Answer, parameter_over_time};

/// More alternatives than that do not count as an answer.
const MOST_ALTERNATIVES: usize = 2;
/// So many of the first descriptions count.
const MOST_DESCRIPTIONS: usize = 3;

/// Names of templates that mean one thing.
const SYNONYMS: &[&[&str]] = &[
    &["viscous_drag", "viscous_friction", "leak", "linear_loss"],
    &["quadratic_drag", "power_loss", "quadratic_loss"],
    &["dry_friction", "coulomb_friction"],
    &["unmeasured_flow", "step_disturbance", "constant_disturbance"],
    &["cubic_stiffness", "cubic_spring", "cubic_loss"],
    &["backlash", "play", "dead_zone"],
    &["input_delay", "delayed_input"],
    &["input_saturation", "input_limit"],
    &["rate_limit", "input_rate_limit"],
    &["dead_band", "input_dead_band"],
    &["periodic_disturbance", "sine_disturbance", "oscillation"],
];

/// What an answer says, as far as it is scored; a twin's in the names of its original.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Said {
    verdict: String,
    /// Of each effect that is named, its name and those of its alternatives.
    named: Vec<Vec<Name>>,
    described: Vec<Name>,
    /// Places in which something is unexplained, by rank.
    places: Vec<String>,
    /// How many of them are first, since the recordings cannot tell them from the first.
    tied: usize,
}

/// A name with what it is applied to.
#[derive(Debug, Clone, PartialEq)]
struct Name {
    name: String,
    targets: Vec<String>,
}

impl Name {
    /// From `name(target, …)`.
    fn read(text: &str) -> Self {
        let (name, targets) = text.split_once('(').unwrap_or((text, ""));
        let targets = targets.trim_end().trim_end_matches(')').split(',');
        let targets = targets.map(|target| plain(target).to_owned());
        Name {
            // Of an effect with forms, the name of the effect.
            name: name.split('/').next().unwrap_or_default().trim().to_owned(),
            targets: targets.filter(|target| !target.is_empty()).collect(),
        }
    }

    /// From an entry of a list: a text, or an object with a `name` and perhaps a `target`.
    fn of(entry: &Value) -> Option<Self> {
        let name = entry.as_str().or_else(|| entry["name"].as_str())?;
        let mut name = Name::read(name);
        let target = entry["target"].as_str().map(plain).unwrap_or_default();
        if name.targets.is_empty() && !target.is_empty() {
            name.targets.push(target.to_owned());
        }
        Some(name)
    }

    /// Whether this is one of the accepted names.
    fn is_one_of(&self, accepted: &[&str]) -> bool {
        accepted.iter().any(|accepted| {
            let accepted = Name::read(accepted);
            are_synonyms(&self.name, &accepted.name)
                && accepted.targets.iter().all(|target| self.targets.contains(target))
        })
    }

    /// Whether it says that this parameter changes.
    fn is_change_of(&self, parameter: &str) -> bool {
        self.name.starts_with("parameter") && self.targets.iter().any(|target| target == parameter)
    }

    fn text(&self) -> String {
        if self.targets.is_empty() {
            return self.name.clone();
        }
        format!("{}({})", self.name, self.targets.join(" "))
    }
}

/// `sensor NAME` and `NAME` are one place.
fn plain(place: &str) -> &str {
    let place = place.trim();
    place.strip_prefix("sensor ").unwrap_or(place)
}

fn are_synonyms(a: &str, b: &str) -> bool {
    a == b || SYNONYMS.iter().any(|names| names.contains(&a) && names.contains(&b))
}

impl Said {
    pub(crate) fn of(answer: &Answer, case: &Case) -> Self {
        let mut json = answer.json.clone();
        if let Some(twin) = &case.twin {
            in_other_names(&mut json, &|text| twin.in_the_names_of_the_original(text));
        }
        let list = |value: &Value| value.as_array().cloned().unwrap_or_default();
        let class = |effect: &Value| -> Vec<Name> {
            let others = list(&effect["alternatives"]);
            // The library's effects go by their names alone.
            let own = Name::of(&effect["name"]).into_iter();
            own.chain(others.iter().filter_map(Name::of)).collect()
        };
        let unexplained = list(&json["unexplained"]);
        let places = unexplained.iter().filter_map(|entry| entry["target"].as_str());
        let tied = unexplained.iter().skip(1).take_while(|entry| entry["tied"] == true).count();
        let mut described: Vec<Value> = list(&json["described"]);
        described.extend(unexplained.iter().flat_map(|entry| list(&entry["described"])));
        Said {
            verdict: json["verdict"].as_str().unwrap_or_default().to_owned(),
            named: list(&json["effects"]).iter().map(class).collect(),
            described: described.iter().filter_map(Name::of).collect(),
            places: places.map(|place| plain(place).to_owned()).collect(),
            tied: 1 + tied,
        }
    }

    fn firsts(&self) -> Vec<&Name> {
        self.named.iter().filter_map(|class| class.first()).collect()
    }

    /// Places that come first.
    fn first_places(&self) -> &[String] {
        &self.places[..self.tied.min(self.places.len())]
    }

    /// What is said in short: names, or the verdict.
    fn text(&self) -> String {
        let names: Vec<String> = self.firsts().iter().map(|name| name.text()).collect();
        if !names.is_empty() {
            return names.join(" + ");
        }
        match self.places.first() {
            Some(place) => format!("{} in {place}", self.verdict),
            None => self.verdict.clone(),
        }
    }
}

/// All texts of a value in other names.
fn in_other_names(value: &mut Value, other: &dyn Fn(&str) -> String) {
    match value {
        Value::String(text) => *text = other(text),
        Value::Array(all) => all.iter_mut().for_each(|value| in_other_names(value, other)),
        Value::Object(all) => all.values_mut().for_each(|value| in_other_names(value, other)),
        _ => {}
    }
}

/// How good the answer to one case is.
#[derive(Debug, Clone)]
pub(crate) struct Score {
    case: String,
    pub(crate) kind: Kind,
    said: String,
    pub(crate) mark: Mark,
    /// Names beside or in place of the truth.
    pub(crate) is_misnamed: bool,
    /// Files of the library that the answer mentions nowhere.
    pub(crate) unmentioned: Vec<String>,
    pub(crate) seconds: f64,
}

/// The truth in an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Mark {
    /// The names are the truth, or nothing is said where nothing is hidden; a twin's answer is the original's.
    Right,
    /// The truth is among the alternatives of as many names.
    Within,
    /// Without a name the truth is among the first descriptions; a changing parameter may be the first place, too.
    Described,
    /// A law or a trace of the changing parameter is within a tenth of it.
    Traced,
    /// The place is right and nothing more.
    Placed,
    /// That something is missing was said, and nothing right about it.
    Noticed,
    /// Nothing was noticed, or what is not there was; a twin's answer is another.
    Missed,
    /// The search ended without an answer.
    Failed,
}

impl Mark {
    fn word(self) -> &'static str {
        match self {
            Mark::Right => "right",
            Mark::Within => "within",
            Mark::Described => "described",
            Mark::Traced => "traced",
            Mark::Placed => "placed",
            Mark::Noticed => "noticed",
            Mark::Missed => "MISSED",
            Mark::Failed => "FAILED",
        }
    }
}

impl Score {
    pub(crate) const HEADER: &str = "case,kind,mark,misnamed,said,unmentioned,seconds";

    pub(crate) fn new(case: &Case, answer: &Answer, said: &Said) -> Score {
        let (mark, is_misnamed) = match case.truth {
            Truth::Nothing => of_nothing(said),
            Truth::Library => of_library(case, said),
            Truth::Template(accepted) => of_template(accepted, said),
            Truth::Parameter { name, places, .. } => of_parameter(case, answer, said, name, places),
        };
        let mark = if said.verdict == "error" { Mark::Failed } else { mark };
        Score {
            case: case.name.clone(),
            kind: case.kind,
            said: shown(answer, said),
            mark,
            is_misnamed,
            unmentioned: unmentioned(case, answer),
            seconds: answer.seconds,
        }
    }

    /// A twin is right if it says what its original says.
    pub(crate) fn of_twin(case: &Case, answer: &Answer, said: &Said, original: &Said) -> Score {
        let is_alike = said.verdict == original.verdict
            && said.firsts() == original.firsts()
            && said.places.first() == original.places.first();
        let said_of_both = if is_alike {
            shown(answer, said)
        } else {
            format!("{} | original: {}", shown(answer, said), original.text())
        };
        let mark = match said.verdict.as_str() {
            "error" => Mark::Failed,
            _ if is_alike => Mark::Right,
            _ => Mark::Missed,
        };
        Score {
            case: case.name.clone(),
            kind: case.kind,
            said: said_of_both,
            mark,
            is_misnamed: false,
            unmentioned: unmentioned(case, answer),
            seconds: answer.seconds,
        }
    }

    /// For the terminal.
    pub(crate) fn line(&self) -> String {
        let Score { case, said, seconds, .. } = self;
        let misnamed = if self.is_misnamed { "  WRONG NAME" } else { "" };
        let unmentioned = if self.unmentioned.is_empty() {
            String::new()
        } else {
            format!("  nowhere: {}", self.unmentioned.join(" "))
        };
        let mark = self.mark.word();
        format!("{mark:9}  {case:52}  {seconds:6.1} s  {said}{misnamed}{unmentioned}")
    }

    /// For `cases.csv`.
    pub(crate) fn row(&self) -> String {
        let Score { case, is_misnamed, seconds, .. } = self;
        let said = self.said.replace([',', '\n'], ";");
        let unmentioned = self.unmentioned.join(" ");
        let (kind, mark) = (self.kind.word(), self.mark.word());
        format!("{case},{kind},{mark},{is_misnamed},{said},{unmentioned},{seconds:.2}")
    }
}

fn shown(answer: &Answer, said: &Said) -> String {
    match answer.json["error"].as_str() {
        Some(error) => format!("error: {}", error.lines().next().unwrap_or_default()),
        None => said.text(),
    }
}

fn of_nothing(said: &Said) -> (Mark, bool) {
    let is_right = said.verdict == "sufficient";
    (if is_right { Mark::Right } else { Mark::Missed }, !said.named.is_empty())
}

fn of_library(case: &Case, said: &Said) -> (Mark, bool) {
    let mut wanted: Vec<&str> = case.hidden.split('+').collect();
    let mut named: Vec<&str> = said.firsts().iter().map(|name| name.name.as_str()).collect();
    wanted.sort_unstable();
    named.sort_unstable();
    if named == wanted {
        return (Mark::Right, false);
    }
    let is_in = |name: &&str| {
        said.named.iter().any(|class| {
            class.len() <= 1 + MOST_ALTERNATIVES && class.iter().any(|other| other.name == **name)
        })
    };
    if named.len() == wanted.len() && wanted.iter().all(is_in) {
        return (Mark::Within, false);
    }
    let is_described = |name: &&str| said.described.iter().any(|other| other.name == **name);
    let mark = if named.is_empty() && wanted.iter().all(is_described) {
        Mark::Described
    } else {
        not_named(said)
    };
    (mark, !named.iter().all(|name| wanted.contains(name)))
}

fn of_template(accepted: &[&str], said: &Said) -> (Mark, bool) {
    let is_right = |name: &&Name| name.is_one_of(accepted);
    let firsts = said.firsts();
    if let ([first], [class]) = (firsts.as_slice(), said.named.as_slice()) {
        if is_right(first) {
            return (Mark::Right, false);
        }
        let is_few = class.len() <= 1 + MOST_ALTERNATIVES;
        if is_few && class.iter().any(|name| name.is_one_of(accepted)) {
            return (Mark::Within, false);
        }
    }
    let is_misnamed = !firsts.iter().all(is_right);
    let mut described = said.described.iter().take(MOST_DESCRIPTIONS);
    let places = accepted.iter().flat_map(|name| Name::read(name).targets);
    let is_placed = said.first_places().iter().any(|first| places.clone().any(|p| p == *first));
    let mark = if described.any(|name| name.is_one_of(accepted)) {
        Mark::Described
    } else if firsts.is_empty() && is_placed {
        Mark::Placed
    } else {
        not_named(said)
    };
    (mark, is_misnamed)
}

fn of_parameter(
    case: &Case,
    answer: &Answer,
    said: &Said,
    parameter: &str,
    places: &[&str],
) -> (Mark, bool) {
    let firsts = said.firsts();
    let is_right = |name: &&Name| name.is_change_of(parameter) || name.is_one_of(places);
    let is_misnamed = !firsts.iter().all(is_right);
    let first: Vec<&str> = said.first_places().iter().map(String::as_str).collect();
    let is_described = |name: &Name| name.is_change_of(parameter);
    let traces = || parameter_over_time(case, answer, parameter);
    let mark = if !firsts.is_empty() && firsts.iter().all(is_right) {
        Mark::Right
    } else if traces().iter().any(|values| is_near(values, &case.train.trace)) {
        Mark::Traced
    } else if first.contains(&parameter)
        || said.described.iter().take(MOST_DESCRIPTIONS).any(is_described)
    {
        Mark::Described
    } else if first.iter().any(|first| places.contains(first)) {
        Mark::Placed
    } else {
        not_named(said)
    };
    (mark, is_misnamed)
}

/// Whether values are within a tenth of the truth, and follow its changes: a constant does not.
fn is_near(values: &[f64], truth: &[f64]) -> bool {
    if values.len() != truth.len() || truth.is_empty() {
        return false;
    }
    let known: Vec<(f64, f64)> = (values.iter().copied().zip(truth.iter().copied()))
        .filter(|(value, _)| value.is_finite())
        .collect();
    if 2 * known.len() < truth.len() {
        return false;
    }
    let mean_of =
        |f: &dyn Fn(&(f64, f64)) -> f64| known.iter().map(f).sum::<f64>() / known.len() as f64;
    let off = mean_of(&|(value, truth)| (value - truth).powi(2));
    let size = mean_of(&|(_, truth)| truth * truth);
    let mean = mean_of(&|(_, truth)| *truth);
    let change = mean_of(&|(_, truth)| (truth - mean).powi(2));
    off <= 0.01 * size && off <= 0.25 * change
}

fn not_named(said: &Said) -> Mark {
    if said.verdict == "sufficient" { Mark::Missed } else { Mark::Noticed }
}

/// Files of the library whose names are nowhere in the answer.
fn unmentioned(case: &Case, answer: &Answer) -> Vec<String> {
    let mut json = answer.json.clone();
    // The command and the list of files that were read mention all of them.
    if let Some(object) = json.as_object_mut() {
        object.retain(|key, _| {
            let keys =
                ["effects", "ranking", "screened", "not_tried", "reservations", "unexplained"];
            keys.contains(&key.as_str()) || key == "described"
        });
    }
    let text = json.to_string();
    let is_in = |name: &str| {
        let is_part = |c: char| c.is_alphanumeric() || c == '_';
        text.match_indices(name).any(|(at, _)| {
            !text[..at].ends_with(is_part) && !text[at + name.len()..].starts_with(is_part)
        })
    };
    let names = case.effects.iter().map(|(name, _)| name.clone());
    names.filter(|name| !is_in(name)).collect()
}
