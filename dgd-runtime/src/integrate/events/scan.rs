//! Scans a step for the first crossing of a threshold.
//!
//! Event functions are enclosed along the step, which is halved until each part is proven to be free of crossings, or
//! all event functions that may pass their thresholds in it are monotone. Parts are taken in their order, so that no
//! crossing comes before the one that is found.
//!
//! An excess over a threshold that is below the rounding error of the event function is not a crossing, but a touch,
//! from which on derivatives are undefined. If a part is as short as the rounding error of time, its ends decide.

use crate::integrate::enclosure::{Interval, StepInterval, Tube};
use crate::integrate::events::watch::CALM;
use crate::integrate::simulation::Simulation;
use crate::solved::SolvableSystem;
use crate::system::{Crossing, Trigger};

/// Halvings of a step: as many as separate any two numbers of it.
const MOST_HALVINGS: usize = 120;
/// Parts that are looked at in one scan.
const MOST_PARTS: usize = 1 << 11;

/// An excess of fewer roundings of the event function is a touch.
const NO_TOUCH: f64 = 4.0;
/// Parts of a step longer than this are halved where event functions read the past, which is sampled.
const SAMPLED: f64 = 0.25;

/// The result of a scan.
pub(super) enum ScanResult {
    /// No transition is due in the step.
    Nothing,
    /// At this fraction of the step a transition is due or can be armed.
    Until(f64),
    /// Up to this fraction no transition is due. From there to the other the k-th is indistinguishable from its
    /// threshold.
    Stuck { part: f64, to: f64, k: usize },
}

/// How a transition is watched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::integrate) enum TransitionWatch {
    /// It is not.
    No,
    /// It is due where its event function is beyond the threshold.
    Due,
    /// It is due if its event function is beyond the threshold at the end of the step.
    AtEnd,
    /// It is armed where its event function is not beyond the threshold.
    ToArm,
    /// It can be armed at this fraction of the step, and is due later where its event function is beyond the threshold.
    ArmedAt(f64),
}

impl TransitionWatch {
    /// Whether it is watched between the ends of the step, too.
    pub(in crate::integrate) fn is_within(self) -> bool {
        !matches!(self, Self::No | Self::AtEnd)
    }
}

/// An event function in a part of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ScannedEvent {
    /// Nothing happens.
    Clear,
    /// The transition is armed at the end.
    Arms,
    /// The transition is due at the end, and becomes due once.
    Due,
    /// A shorter part has to be looked at.
    Unclear,
}

impl StepPart {
    /// A part that can be halved.
    fn new(from: f64, to: f64) -> Self {
        Self { from, to, is_last: false }
    }
}

/// A transition that is due, and the fraction of the step at which the step ends for it.
#[derive(Debug, Clone, Copy)]
struct DueTransition {
    k: usize,
    at: f64,
}

/// A part of a step.
#[derive(Debug, Clone, Copy)]
struct StepPart {
    from: f64,
    to: f64,
    /// Whether it cannot be halved.
    is_last: bool,
}

impl<S: SolvableSystem> Simulation<'_, S> {
    /// Scans the last tried step, of size h. A touch ends it, too, with the transition in `touched`.
    pub(super) fn scan(&mut self, h: f64) -> ScanResult {
        self.discrete.touched = None;
        for reached in &mut self.discrete.reached {
            *reached = reached.map(|_| 0.0);
        }
        let mut scanned =
            if self.begin_scan() { self.scan_from(0.0, h) } else { ScanResult::Nothing };
        while let ScanResult::Stuck { part, to, k } = scanned
            && self.rides(k, h, StepPart::new(part, to))
        {
            self.discrete.watching[k] = TransitionWatch::AtEnd;
            scanned = self.scan_from(part, h);
        }
        match scanned {
            ScanResult::Nothing if self.is_due_at_end(h) => ScanResult::Until(1.0),
            scanned => scanned,
        }
    }

    /// Scans the last tried step from a fraction of it on.
    fn scan_from(&mut self, from: f64, h: f64) -> ScanResult {
        let mut ends = [0.0; MOST_HALVINGS];
        let mut halvings = 0;
        let (mut from, mut to) = (from, 1.0);
        for _ in 0..MOST_PARTS {
            let middle = 0.5 * (from + to);
            let furthest = (self.t + from * h).abs().max((self.t + to * h).abs());
            let shortest = 4.0 * f64::EPSILON * furthest.max(f64::EPSILON * h);
            let is_last = halvings == MOST_HALVINGS || (to - from) * h <= shortest;
            let part = StepPart { from, to, is_last };
            self.enclose(h, part);
            if self.first_unclear(part).is_some() {
                ends[halvings] = to;
                halvings += 1;
                to = middle;
                continue;
            }
            if let Some(DueTransition { k, at }) = self.first_due(h, part) {
                self.take_turn(k, h, part);
                return ScanResult::Until(at);
            }
            if let Some(DueTransition { k, at }) = self.first_touch(part) {
                self.discrete.touched = Some(k);
                return ScanResult::Until(at);
            }
            let Some(last) = halvings.checked_sub(1) else { return ScanResult::Nothing };
            (from, to, halvings) = (to, ends[last], last);
        }
        let part = StepPart::new(from, to);
        self.enclose(h, part);
        let k = self.first_unclear(part).unwrap_or(0);
        ScanResult::Stuck { part: from, to, k }
    }

    /// Whether a solution keeps to a threshold in a part of the step, within its error, as a fraction does that the others
    /// make up to one. Crossings there are no events.
    fn rides(&mut self, k: usize, h: f64, part: StepPart) -> bool {
        if !self.discrete.enclosures.reads(k).unknowns {
            return false;
        }
        let error = self.error_of_event(k, self.t + h);
        self.enclose(h, part);
        let Interval { lo, hi } = self.discrete.enclosures.value_of(k).range;
        lo.abs().max(hi.abs()) <= error
    }

    /// Whether a transition is due that is only watched at the end of the step. A corner that was passed a short while ago
    /// is left to error control, since a solution may flutter about it.
    fn is_due_at_end(&mut self, h: f64) -> bool {
        let discrete = &self.problem.system.signature().discrete;
        let hybrid = &mut self.discrete;
        let t_new = self.t + h;
        let mut is_due = false;
        for (k, (automaton, transition)) in discrete.transitions().enumerate() {
            if hybrid.watching[k] != TransitionWatch::AtEnd || !hybrid.armed[k] {
                continue;
            }
            let e = hybrid.e[k];
            if !discrete.automata[automaton].kind.only_ends_steps() {
                is_due |= hybrid.is_past(k, transition.crossing, e);
            } else if transition.crossing.is_past(e) {
                if hybrid.flutters(k, t_new, CALM * h) {
                    hybrid.pass_corner(k, t_new);
                } else {
                    is_due = true;
                }
            }
        }
        is_due
    }

    /// Decides how transitions are watched, and which algebraic unknowns with them.
    ///
    /// A solution that passes a corner and comes back within a step is seen by error control where its unknowns, or
    /// inputs, which are linear in a step, take it there, but not where time does.
    pub(in crate::integrate) fn choose_watching(&mut self) {
        let discrete = &self.problem.system.signature().discrete;
        for (k, (automaton, transition)) in discrete.transitions().enumerate() {
            let hybrid = &self.discrete;
            let acts = matches!(transition.trigger, Trigger::Edge | Trigger::Level)
                && hybrid.is_event(automaton)
                && hybrid.is_active(automaton, transition.from);
            let is_seen = discrete.automata[automaton].kind.only_ends_steps()
                && !hybrid.enclosures.reads(k).time;
            let watching = match (acts, hybrid.armed[k]) {
                (false, _) => TransitionWatch::No,
                (true, true) if is_seen => TransitionWatch::AtEnd,
                (true, false) if is_seen => TransitionWatch::No,
                (true, true) => TransitionWatch::Due,
                (true, false) => TransitionWatch::ToArm,
            };
            self.discrete.watching[k] = watching;
        }
        self.mark_watched();
    }

    /// Prepares enclosures of the event functions that are watched within the step. Returns whether there are any.
    fn begin_scan(&mut self) -> bool {
        if !self.discrete.watching.iter().any(|watching| watching.is_within()) {
            return false;
        }
        let p = self.problem.p;
        self.stepper.prepare_dense(self.y.as_ref(), None);
        let (stepper, y) = (&self.stepper, self.y.as_ref());
        let watching = &self.discrete.watching;
        self.discrete.enclosures.begin(
            |k| watching[k].is_within(),
            p,
            &self.discrete.schedule.z,
            |i, coefficients| stepper.polynomial(i, y[i], coefficients),
        );
        true
    }

    /// Encloses the event functions in a part of the step.
    fn enclose(&mut self, h: f64, StepPart { from, to, .. }: StepPart) {
        let time = |part: f64| {
            let (passed, t) = (part * h, self.t + part * h);
            Interval::around(t, f64::EPSILON * (t.abs() + passed.abs()))
        };
        let (left, right) = (time(from), time(to));
        let change = Interval::around(h * (to - from), 2.0 * f64::EPSILON * h * to);
        let time = Tube::moving(left, right, left.hull(right), change);
        if S::FEATURES.past {
            self.take_past(h, [from, to]);
        }
        let (drive, past) = (&self.drive, &self.discrete.past);
        let times = [self.t + from * h, self.t + to * h];
        let input = |i: usize| {
            let delayed = drive.past_tube(i, times).or_else(|| past.tube(i));
            delayed.unwrap_or_else(|| drive.tube(i, time))
        };
        self.discrete.enclosures.evaluate(&StepInterval { ends: [from, to], time, input: &input });
    }

    /// The first transition of which nothing is certain in a part.
    fn first_unclear(&self, part: StepPart) -> Option<usize> {
        if part.is_last {
            return None;
        }
        if part.to - part.from > SAMPLED && !self.discrete.past.is_empty() {
            return Some(0);
        }
        let transitions = self.problem.system.signature().discrete.transitions().enumerate();
        let mut crossings = transitions.map(|(k, (_, transition))| (k, transition.crossing));
        crossings
            .find(|(k, crossing)| {
                self.found(*k, *crossing, part) == ScannedEvent::Unclear
                    || self.short_of(*k, *crossing).is_some_and(SubthresholdEvent::may_touch_within)
            })
            .map(|(k, _)| k)
    }

    /// The first event function that has come to its threshold within its rounding and leaves it in a part of the step
    /// without having passed it, and where it was there.
    fn first_touch(&mut self, part: StepPart) -> Option<DueTransition> {
        self.directions.as_ref()?;
        let mut first: Option<DueTransition> = None;
        let discrete = &self.problem.system.signature().discrete;
        for (k, (_, transition)) in discrete.transitions().enumerate() {
            let e = self.short_of(k, transition.crossing);
            let reached = &mut self.discrete.reached[k];
            let Some(e) = e else {
                *reached = None;
                continue;
            };
            let (left, right) = (e.is_at_left(), e.is_at_right());
            if !left {
                *reached = right.then_some(part.to);
            }
            if let Some(at) = reached.filter(|_| !right)
                && first.is_none_or(|first| at < first.at)
            {
                first = Some(DueTransition { k, at });
            }
        }
        if let Some(DueTransition { k, .. }) = first {
            self.discrete.reached[k] = None;
        }
        first
    }

    /// An event function below the threshold that it may touch, where that would be of consequence.
    fn short_of(&self, k: usize, crossing: Crossing) -> Option<SubthresholdEvent> {
        let watching = self.discrete.watching[k];
        if self.directions.is_none() || !watching.is_within() || !self.discrete.jumps[k] {
            return None;
        }
        let e = beyond(self.discrete.enclosures.value_of(k), crossing);
        let slack = self.discrete.slack[k].max(0.0);
        Some(match watching {
            TransitionWatch::ToArm => SubthresholdEvent { e: e.negated(), threshold: -slack },
            _ => SubthresholdEvent { e, threshold: slack },
        })
    }

    /// The first transition that is due in a part; if there is none, arms those that can be armed there.
    fn first_due(&mut self, h: f64, part: StepPart) -> Option<DueTransition> {
        let discrete = &self.problem.system.signature().discrete;
        let mut first: Option<DueTransition> = None;
        for (k, (automaton, transition)) in discrete.transitions().enumerate() {
            let crossing = transition.crossing;
            match self.found(k, crossing, part) {
                ScannedEvent::Clear | ScannedEvent::Unclear => {}
                ScannedEvent::Arms => self.discrete.watching[k] = TransitionWatch::ArmedAt(part.to),
                ScannedEvent::Due => {
                    let is_corner = discrete.automata[automaton].kind.only_ends_steps();
                    if is_corner && self.is_left_to_error_control(k, crossing, h, part) {
                        self.discrete.watching[k] = TransitionWatch::No;
                        continue;
                    }
                    let watched = match self.discrete.watching[k] {
                        TransitionWatch::ArmedAt(armed) => armed,
                        _ => part.to,
                    };
                    if first.is_none_or(|first| watched < first.at) {
                        first = Some(DueTransition { k, at: watched });
                    }
                }
            }
        }
        first
    }

    /// Records how far the event function of a transition that is due in a part turns beyond its threshold, if it is
    /// not beyond it at the end of the step. Derivatives depend on whether that is more than a touch.
    fn take_turn(&mut self, k: usize, h: f64, part: StepPart) {
        let mut transitions = self.problem.system.signature().discrete.transitions();
        let Some((_, transition)) = transitions.nth(k) else { return };
        let crossing = transition.crossing;
        if self.directions.is_none() || crossing.is_past(self.discrete.e[k]) {
            return;
        }
        let slack = self.discrete.slack[k].max(0.0);
        let (mut depth, mut uncertain) = (0.0_f64, 0.0_f64);
        let (mut from, mut width) = (part.from, part.to - part.from);
        loop {
            let end = (from + width).min(1.0);
            self.enclose(h, StepPart::new(from, end));
            let e = beyond(self.discrete.enclosures.value_of(k), crossing);
            depth = depth.max(e.range.hi - slack);
            uncertain = uncertain.max(rounding(e));
            let is_back = from > part.from && e.right.lo <= slack;
            if end >= 1.0 || is_back {
                break;
            }
            (from, width) = (end, 2.0 * width);
        }
        let depth = if depth > NO_TOUCH * uncertain { depth } else { 0.0 };
        self.discrete.turned = Some((k, depth));
    }

    fn found(&self, k: usize, crossing: Crossing, part: StepPart) -> ScannedEvent {
        let watching = self.discrete.watching[k];
        if !watching.is_within() {
            return ScannedEvent::Clear;
        }
        let e = beyond(self.discrete.enclosures.value_of(k), crossing);
        let slack = self.discrete.slack[k].max(0.0);
        if watching == TransitionWatch::ToArm {
            found_to_arm(e, slack, part.is_last)
        } else {
            found_due(e, slack, part.is_last)
        }
    }

    /// Whether a corner that was passed a short while ago is left to error control, since a solution may flutter about
    /// it. One that time alone moves does not flutter, nor does one that is passed by more than errors of the solution.
    fn is_left_to_error_control(
        &mut self,
        k: usize,
        crossing: Crossing,
        h: f64,
        part: StepPart,
    ) -> bool {
        let t = self.t + part.to * h;
        if !self.discrete.flutters(k, t, CALM * h) {
            return false;
        }
        if !self.discrete.enclosures.reads(k).unknowns {
            return false;
        }
        let error = self.error_of_event(k, self.t + h);
        self.enclose(h, StepPart::new(part.from, 1.0));
        let excess = beyond(self.discrete.enclosures.value_of(k), crossing).range.hi;
        self.enclose(h, part);
        if excess > error {
            return false;
        }
        self.discrete.pass_corner(k, t);
        true
    }
}

/// An event function that stays below a threshold.
#[derive(Debug, Clone, Copy)]
struct SubthresholdEvent {
    e: Tube,
    threshold: f64,
}

impl SubthresholdEvent {
    /// Whether it is at the threshold, within its rounding, at the beginning of the part.
    fn is_at_left(self) -> bool {
        self.is_at(self.e.left, self.e.left.width())
    }

    fn is_at_right(self) -> bool {
        self.is_at(self.e.right, self.e.right.width())
    }

    /// Whether it may be there between the ends, and not at both of them.
    fn may_touch_within(self) -> bool {
        let may_touch = self.is_at(self.e.range, rounding(self.e));
        may_touch && !self.e.is_monotone() && !(self.is_at_left() && self.is_at_right())
    }

    fn is_at(self, e: Interval, rounding: f64) -> bool {
        e.hi >= self.threshold - NO_TOUCH * rounding
    }
}

/// An event function that is due above zero.
fn beyond(e: Tube, crossing: Crossing) -> Tube {
    match crossing {
        Crossing::Rises => e,
        Crossing::Falls => e.negated(),
    }
}

/// Tolerance of a threshold due to rounding errors: the uncertainty of the event function at a point.
fn rounding(e: Tube) -> f64 {
    let width = e.left.width().min(e.right.width());
    if width.is_finite() { width } else { 0.0 }
}

/// Whether an event function may exceed a threshold by more than rounding errors. False if it is undefined: NaN
/// compares false.
fn may_be_beyond(e: Tube, slack: f64) -> bool {
    e.range.hi > slack + rounding(e)
}

/// The result for an armed transition that is due above `slack`.
fn found_due(e: Tube, slack: f64, is_last: bool) -> ScannedEvent {
    let due = |is: bool| if is { ScannedEvent::Due } else { ScannedEvent::Clear };
    if !may_be_beyond(e, slack) {
        return ScannedEvent::Clear;
    }
    let (left, right) = (e.left.lo > slack, e.right.lo > slack);
    if e.change.lo >= 0.0 {
        due(right)
    } else if is_last {
        due(left || right)
    } else if e.change.hi <= 0.0 && !left {
        ScannedEvent::Clear
    } else {
        ScannedEvent::Unclear
    }
}

/// The result for a transition that is armed when its event function is certainly not above `slack`: one that has just
/// occurred is above it by less than rounding errors.
fn found_to_arm(e: Tube, slack: f64, is_last: bool) -> ScannedEvent {
    if e.range.lo > slack {
        ScannedEvent::Clear
    } else if e.is_monotone() || is_last || !may_be_beyond(e, slack) {
        if e.right.hi <= slack { ScannedEvent::Arms } else { ScannedEvent::Clear }
    } else {
        ScannedEvent::Unclear
    }
}
