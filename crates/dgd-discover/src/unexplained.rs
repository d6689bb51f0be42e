//! Where something without a name is missing: places in the order in which to examine them.
//!
//! ```text
//!   targets of rival laws ─► equations that lack something together ─► the likeliest plausible place
//!     ─► a sensor that a single output cannot distinguish from the plant ─► implausible places
//! ```
//!
//! A place with a formula comes before more likely ones if the formula leaves far less: it was compared with other
//! recordings, whereas a free input only follows readings.

use crate::conditions::Circumstances;
use crate::guess::{FormulaGuess, GuessData, MissingCourse};
use crate::law::FittedTerms;
use crate::missing_input::{self, FoundPlace, MissingInputs, PlaceKind, PlaceObjection, TIE};
use crate::report::{UnexplainedError, unexplained};
use crate::search::farthest_apart;

/// Number of places reported.
const TOLD: usize = 5;
/// Number of leading places at which a formula is sought, in addition to places that are about as likely as the first.
const GUESSED: usize = 3;
/// Largest mean square relative to the noise at which a place counts as explaining the recordings: that which a
/// structure with fewer effects may leave.
const EXPLAINED: f64 = 2.25;

/// Inputs of the ranking.
pub(crate) struct WithoutName<'a> {
    pub(crate) guessing: &'a GuessData<'a>,
    pub(crate) circumstances: &'a Circumstances,
    pub(crate) missing: &'a MissingInputs,
    /// Equations that lack something together, in a smoother with a free input in each.
    pub(crate) lacking: &'a [String],
    /// Laws in different equations that explain the recordings alike.
    pub(crate) rivals: &'a [FittedTerms],
}

/// The class of a place; the lowest comes first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum PlaceClass {
    /// A law there explains the recordings, and so does one elsewhere.
    Rival,
    /// It lacks something together with other equations.
    Joint,
    Plausible,
    /// A sensor that only another output could distinguish from the plant.
    OnlySensor,
    Implausible,
}

impl WithoutName<'_> {
    /// The places, each with the condition that coincides with it and the quantities that correlate with it, and a
    /// formula at the best place that has one.
    pub(crate) fn places(&self) -> Vec<UnexplainedError> {
        let WithoutName { guessing, circumstances, missing, .. } = self;
        let mut order: Vec<(PlaceClass, &FoundPlace)> =
            missing.ranked.iter().map(|found| (self.class(found), found)).collect();
        // Stable: within a class, the likeliest first.
        order.sort_by_key(|(class, _)| *class);
        order.truncate(TOLD);
        let Some(&(first, most)) = order.first() else { return Vec::new() };
        let followed = |found: &FoundPlace| {
            let terms = missing.terms.as_ref().filter(|_| !guessing.data.is_over())?;
            guessing.followed(terms, found)
        };
        let is_tied = |rank: usize, class: PlaceClass, found: &FoundPlace| match class {
            _ if rank == 0 => false,
            PlaceClass::Rival | PlaceClass::Joint => true,
            PlaceClass::Implausible => false,
            PlaceClass::Plausible | PlaceClass::OnlySensor => {
                first >= PlaceClass::Plausible && most.missing.gain - found.missing.gain < TIE
            }
        };
        let places = || order.iter().enumerate();
        let traced: Vec<Option<MissingCourse<'_>>> =
            places().map(|(_, (_, one))| followed(one)).collect();
        let is_looked_at = |rank: usize, class: PlaceClass, found: &FoundPlace| {
            // Laws are better than guesses.
            self.rivals.is_empty()
                && traced[rank].is_some()
                && (rank < GUESSED || is_tied(rank, class, found))
        };
        let looked_at: Vec<&MissingCourse<'_>> = places()
            .filter(|(rank, (class, found))| is_looked_at(*rank, *class, found))
            .filter_map(|(rank, _)| traced[rank].as_ref())
            .collect();
        let mut guesses = guessing.guesses(&looked_at).into_iter();
        let mut reported: Vec<(PlaceClass, UnexplainedError)> = places()
            .map(|(rank, &(class, found))| {
                let condition = circumstances.condition(&missing_input::windows(found));
                let followed = traced[rank].as_ref();
                let is_tied = is_tied(rank, class, found);
                let guess = if is_looked_at(rank, class, found) {
                    guesses.next().flatten()
                } else {
                    followed.and_then(|followed| self.of_law(found, followed))
                };
                let place = UnexplainedError {
                    together: followed.map_or_else(Vec::new, MissingCourse::together),
                    guess,
                    is_joint: class == PlaceClass::Joint,
                    left: Some(found.left),
                    objection: objection(found),
                    told_apart_by: self.told_apart_by(most, class, found).filter(|_| is_tied),
                    ..unexplained(&found.missing, condition, is_tied)
                };
                (class, place)
            })
            .collect();
        let follows = missing.ranked.first().is_some_and(FoundPlace::is_followed);
        lift(&mut reported, follows);
        reported.into_iter().map(|(_, one)| one).collect()
    }

    /// The formula of a rival law that changes this place only.
    fn of_law(&self, found: &FoundPlace, followed: &MissingCourse<'_>) -> Option<FormulaGuess> {
        let terms_there = |law: &FittedTerms| law.all_in(&found.missing.place);
        let terms = self.rivals.iter().find_map(terms_there)?;
        self.guessing.of_law(followed, &terms)
    }

    fn class(&self, found: &FoundPlace) -> PlaceClass {
        let place = &found.missing.place;
        let is_equation = place.kind == PlaceKind::Equation;
        let of_rival = |law: &FittedTerms| law.targets().contains(place.name.as_str());
        if self.rivals.iter().any(of_rival) {
            PlaceClass::Rival
        } else if is_equation && self.lacks_together() && self.lacking.contains(&place.name) {
            PlaceClass::Joint
        } else if found.objection.is_some() {
            PlaceClass::Implausible
        } else if place.kind == PlaceKind::Output && self.outputs() == 1 && self.equation_explains()
        {
            PlaceClass::OnlySensor
        } else {
            PlaceClass::Plausible
        }
    }

    /// Number of outputs that are read.
    fn outputs(&self) -> usize {
        self.guessing.data.noise.iter().flatten().count()
    }

    /// Whether several equations lack something that the readings can determine, and no single place explains the
    /// recordings.
    fn lacks_together(&self) -> bool {
        let explains = |found: &FoundPlace| found.objection.is_none() && found.left < EXPLAINED;
        (2..=self.outputs()).contains(&self.lacking.len())
            && !self.missing.ranked.iter().any(explains)
    }

    /// Whether a missing term of one equation explains the recordings as well as a sensor does.
    fn equation_explains(&self) -> bool {
        let left = |kind: PlaceKind| {
            let of_kind =
                self.missing.ranked.iter().filter(|found| found.missing.place.kind == kind);
            of_kind.map(|found| found.left).fold(f64::INFINITY, f64::min)
        };
        !is_clearly_less(left(PlaceKind::Output), left(PlaceKind::Equation))
    }

    /// The measurement that separates a place from the first one.
    fn told_apart_by(
        &self,
        first: &FoundPlace,
        class: PlaceClass,
        other: &FoundPlace,
    ) -> Option<String> {
        if class == PlaceClass::Joint {
            return None;
        }
        let sensor =
            [first, other].into_iter().find(|one| one.missing.place.kind == PlaceKind::Output);
        if let Some(sensor) = sensor {
            let name = &sensor.missing.place.name;
            return Some(format!("a second sensor of `{name}`"));
        }
        let system = self.missing.terms.as_ref()?.system();
        let both = first.course.as_ref().zip(other.course.as_ref());
        let apart = both.and_then(|(a, b)| farthest_apart([system, system], [a, b]));
        Some(apart.map_or_else(
            || "a test with other inputs".to_owned(),
            |apart| format!("a measurement of `{}`", apart.name),
        ))
    }
}

/// The objection to a place, as a sentence.
fn objection(found: &FoundPlace) -> Option<String> {
    let name = &found.missing.place.name;
    Some(match found.objection? {
        PlaceObjection::Sign => format!("`{name}` would change its sign"),
        PlaceObjection::Bounds => format!("`{name}` would leave its bounds"),
        PlaceObjection::Size => format!("`{name}` would be off by more than its readings vary"),
    })
}

/// Moves the place to the front whose formula, or whose course, leaves much less than that of the first.
fn lift(all: &mut Vec<(PlaceClass, UnexplainedError)>, follows: bool) {
    let Some(&(first, _)) = all.first() else { return };
    if first < PlaceClass::Plausible {
        return;
    }
    let to_front = |all: &mut Vec<(PlaceClass, UnexplainedError)>, best: usize| {
        let moved = all.remove(best);
        all.insert(0, moved);
    };
    let best_by = |all: &[(PlaceClass, UnexplainedError)],
                   left: &dyn Fn(&UnexplainedError) -> f64| {
        let is_plausible = |k: &usize| all[*k].0 < PlaceClass::Implausible;
        let best = (0..all.len())
            .filter(is_plausible)
            .min_by(|a, b| left(&all[*a].1).total_cmp(&left(&all[*b].1)));
        best.filter(|best| *best > 0 && is_clearly_less(left(&all[*best].1), left(&all[0].1)))
    };
    // A formula has been tested on other recordings, whereas a trace only follows readings.
    let of_formula =
        |one: &UnexplainedError| one.guess.as_ref().map_or(f64::INFINITY, |g| g.left_after);
    if let Some(best) = best_by(all, &of_formula) {
        return to_front(all, best);
    }
    // The noise of a filter absorbs part of the missing term at each place, so its likelihoods distinguish places less
    // well than how closely a trace follows a curve over a quantity of the model; if places are tied, not at all.
    let beside =
        |one: &UnexplainedError| one.together.first().map_or(1.0, |closest| 1.0 - closest.r2);
    if let Some(best) = best_by(all, &beside)
        && (follows || all[best].1.is_tied)
    {
        to_front(all, best);
        for (_, one) in all.iter_mut() {
            one.is_tied = false;
            one.told_apart_by = None;
        }
    }
}

/// Whether a place leaves enough less than the likeliest one to come before it.
fn is_clearly_less(left: f64, of_first: f64) -> bool {
    left < 0.5 * of_first
}
