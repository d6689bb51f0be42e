//! Runs members, one in each lane.
//!
//! Each lane has its own time, step size and input segment, and accepts or rejects its own step: a member's result
//! depends neither on its neighbours nor on when it enters its lane. A lane whose member is done takes the next one.
//!
//! Rare operations, the start of a member and the end of a segment, are done for one lane with the integrator's own
//! functions. Any failure ends the lane: the member is then run by [`simulate`](crate::simulate), which finds the
//! error.

#![allow(clippy::inline_always)]

use super::EnsembleQuantities;
use super::control::StepControl;
use super::dense::{DensePolynomials, LaneStep};
use super::explicit::ExplicitLanes;
use super::first_step::{MemberStart, first_step};
use super::lanes::{LANES, LaneStorage, Lanes};
use super::observer::LaneObserver;
use super::rosenbrock::RosenbrockLanes;
use super::stage::{LaneInputs, LaneTrial, mean_square};
use super::times::PaddedTimes;
use crate::algebraic::{AlgebraicPoint, AlgebraicSystem};
use crate::integrate::catalogue::MethodKind;
use crate::integrate::drive::InputCursor;
use crate::integrate::fixed_step::Steps;
use crate::integrate::record::before_change;
use crate::integrate::record::projection::{Projection, StepRows};
use crate::integrate::start::consistent::start_values;
use crate::integrate::watched::RunMonitor;
use crate::integrate::{verify_inputs, verify_request};
use crate::linalg::norm::Tolerances;
use crate::linalg::width::{VectorWidth, WidthTask};
use crate::problem::{Options, Problem, unknown_sizes};
use crate::signal::{LimitSide, Segment};
use crate::solution::{Statistics, side};
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Storage};

/// The method with which lanes step.
enum LaneMethod<S: SolvableSystem> {
    Rosenbrock(Box<RosenbrockLanes<S>>),
    Explicit(Box<ExplicitLanes<S>>),
}

/// State of a lane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LaneStatus {
    /// It is running.
    UnderWay,
    /// All requested times are recorded.
    Done,
    /// It failed.
    Stopped,
}

/// The member in a lane.
struct LaneMember<'a, S> {
    problem: Problem<'a, S>,
    /// Its number.
    member: usize,
    segment: usize,
    /// Number of requested times recorded.
    recorded: usize,
    statistics: Statistics,
    /// Unknown by unknown, each at all requested times.
    rows: Vec<f64>,
    fate: LaneStatus,
}

/// Running members.
pub(super) struct LaneEngine<'a, S: SolvableSystem> {
    system: &'a S,
    times: PaddedTimes<'a>,
    options: &'a Options,
    tolerances: Tolerances,
    pub(super) width: VectorWidth,
    family: LaneMethod<S>,
    control: StepControl,
    inputs: LaneInputs<S>,
    t: Lanes,
    /// End of the segment of each lane, or of the run.
    end: Lanes,
    h: Lanes,
    t_new: Lanes,
    y: <S::Vector as Storage>::Lanes,
    y_new: <S::Vector as Storage>::Lanes,
    sizes: <S::Vector as Storage>::Lanes,
    p: Vec<Lanes>,
    mass: S::Vector,
    dense: DensePolynomials<S>,
    accepted: [bool; LANES],
    seats: [Option<LaneMember<'a, S>>; LANES],
    /// Work space.
    algebraic: AlgebraicSystem<S>,
    jacobian: S::Jacobian,
    row: S::Vector,
    slope: S::Vector,
    observer: LaneObserver<S>,
}

/// Results of a finished member.
pub(super) struct FinishedMember<'a> {
    pub(super) member: usize,
    pub(super) unknowns: &'a [f64],
    pub(super) outputs: &'a [f64],
    /// Length of one quantity; values beyond the requested times are meaningless.
    pub(super) stride: usize,
    pub(super) statistics: Statistics,
}

impl<'a, S: SolvableSystem> LaneEngine<'a, S> {
    /// Lanes for members of this system; `None` if its method has no lanes, or the request is invalid.
    pub(super) fn new(
        system: &'a S,
        times: &'a [f64],
        options: &'a Options,
        wanted: EnsembleQuantities,
    ) -> Option<Self> {
        verify_request(times, options).ok()?;
        let times = PaddedTimes::new(times);
        let of_outputs = if wanted == EnsembleQuantities::Unknowns { 0 } else { times.stride() };
        let signature = system.signature();
        let n = signature.unknowns.len();
        if let Steps::PerSample(_) = options.steps {
            return None;
        }
        // Lanes have no rows of conserved sums.
        if S::FEATURES.conserved && !signature.conserved.is_empty() {
            return None;
        }
        let family = match options.method.kind {
            MethodKind::Rosenbrock(_) => {
                LaneMethod::Rosenbrock(Box::new(RosenbrockLanes::new(system)))
            }
            MethodKind::Explicit(_) => LaneMethod::Explicit(Box::new(ExplicitLanes::new(n))),
            MethodKind::Esdirk(_) | MethodKind::Bdf(_) | MethodKind::Taylor(_) => return None,
        };
        let kind = options.method.kind;
        let zeros = || <S::Vector as Storage>::Lanes::zeros(n);
        let algebraic = AlgebraicSystem::new(system);
        Some(Self {
            system,
            times,
            options,
            tolerances: Tolerances { rtol: options.rtol, atol: options.atol },
            width: VectorWidth::widest(),
            family,
            control: StepControl::new(kind.estimate_order(options.rtol), kind.law()),
            inputs: LaneInputs::new(signature.n_u()),
            t: Lanes::ZERO,
            end: Lanes::ZERO,
            h: Lanes::ZERO,
            t_new: Lanes::ZERO,
            y: zeros(),
            y_new: zeros(),
            sizes: zeros(),
            p: vec![Lanes::ZERO; signature.parameters.len()],
            mass: algebraic.mass.clone(),
            dense: DensePolynomials::new(n),
            accepted: [false; LANES],
            seats: std::array::from_fn(|_| None),
            algebraic,
            jacobian: S::Jacobian::zeros(signature.jacobian.len()),
            row: S::Vector::zeros(n),
            slope: S::Vector::zeros(n),
            observer: LaneObserver::new(system, of_outputs),
        })
    }

    /// Runs all members that `next` gives; `done` receives each finished member, and the number of each that could not
    /// be finished here.
    pub(super) fn run(
        &mut self,
        mut next: impl FnMut() -> Option<(usize, Problem<'a, S>)>,
        mut done: impl FnMut(Result<FinishedMember<'_>, usize>),
    ) {
        loop {
            let mut is_empty = true;
            for l in 0..LANES {
                // A member may be finished immediately.
                while self.seats[l].as_ref().is_none_or(|seat| seat.fate != LaneStatus::UnderWay) {
                    if let Some(seat) = &self.seats[l] {
                        let (member, fate) = (seat.member, seat.fate);
                        match fate {
                            LaneStatus::Done => done(Ok(self.show(l))),
                            LaneStatus::Stopped | LaneStatus::UnderWay => done(Err(member)),
                        }
                    }
                    let Some((member, problem)) = next() else {
                        self.vacate(l);
                        break;
                    };
                    self.seat(l, member, problem);
                }
                is_empty &= self.seats[l].is_none();
            }
            // Remaining members are run one by one, and stop at once.
            if is_empty || self.options.watched.is_some_and(RunMonitor::is_stopped) {
                return;
            }
            self.width.run(LaneSteps(self));
            for l in 0..LANES {
                self.follow_up(l);
            }
        }
    }

    /// Leaves lane l empty, with numbers that are cheap to compute with.
    fn vacate(&mut self, l: usize) {
        self.seats[l] = None;
        self.control.begin(l, 1.0);
        self.end.0[l] = self.t.0[l];
    }

    /// Begins a member in lane l.
    fn seat(&mut self, l: usize, member: usize, problem: Problem<'a, S>) {
        let before = self.seats[l].take();
        let n = self.system.signature().unknowns.len();
        let rows = before.map_or_else(|| vec![0.0; n * self.times.stride()], |seat| seat.rows);
        self.seats[l] = Some(LaneMember {
            problem,
            member,
            segment: 0,
            recorded: 0,
            statistics: Statistics { segments: 1, ..Statistics::default() },
            rows,
            fate: LaneStatus::UnderWay,
        });
        let fate = self.begin(l, problem).unwrap_or(LaneStatus::Stopped);
        if let Some(seat) = &mut self.seats[l] {
            seat.fate = fate;
        }
    }

    /// Computes start values and the first step; `None` on failure.
    fn begin(&mut self, l: usize, problem: Problem<'a, S>) -> Option<LaneStatus> {
        problem.verify().ok()?;
        verify_inputs(&problem, self.times.asked).ok()?;
        let (Some(&from), Some(&until)) = (self.times.asked.first(), self.times.asked.last())
        else {
            return Some(LaneStatus::Done);
        };
        if !matches!(self.options.method.kind, MethodKind::Rosenbrock(_))
            && !self.algebraic.is_empty()
        {
            return None;
        }
        let index = problem.inputs.segment_at(from, LimitSide::Right);
        let segment = problem.inputs.segment(index);
        let mut u = S::Inputs::zeros(problem.inputs.len());
        segment.value(from, u.as_mut());
        let point = EvaluationPoint { t: from, y: &[], u: u.as_ref(), p: problem.p, z: &[] };
        if self.system.signature().start_is_found() {
            return None;
        }
        start_values(&problem, point, self.row.as_mut()).ok()?;
        unknown_sizes(self.system, self.row.as_ref(), self.slope.as_mut());
        set_lane(&mut self.sizes, l, self.slope.as_ref());
        let point = AlgebraicPoint { t: from, u: u.as_ref(), p: problem.p, z: &[] };
        let (y, sizes) = (self.row.as_mut(), self.slope.as_ref());
        let jacobian = self.jacobian.as_mut();
        self.algebraic.enter_modes(self.mass.as_ref());
        let consistent =
            self.algebraic.make_consistent(self.system, point, y, jacobian, sizes, self.tolerances);
        consistent.ok()?;

        set_lane(&mut self.y, l, self.row.as_ref());
        for (lanes, p) in self.p.iter_mut().zip(problem.p) {
            lanes.0[l] = *p;
        }
        self.t.0[l] = from;
        self.end.0[l] = segment.t1.min(until);
        self.inputs.enter(l, segment);
        if let Some(seat) = &mut self.seats[l] {
            seat.segment = index;
        }
        if let LaneMethod::Explicit(explicit) = &mut self.family {
            explicit.is_fresh[l] = true;
        }
        self.record_now(l);
        if from == until {
            return Some(LaneStatus::Done);
        }
        let span = self.end.0[l] - from;
        let h = self.options.initial_step.unwrap_or_else(|| {
            let sizes = self.slope.as_ref();
            let order = self.options.method.kind.estimate_order(self.options.rtol);
            let start =
                MemberStart { t: from, y: self.row.as_ref(), sizes, mass: self.mass.as_ref() };
            first_step(&problem, segment, start, self.tolerances, order, span)
        });
        self.control.begin(l, h);
        if let Some(seat) = &mut self.seats[l] {
            seat.statistics.evaluations += 2;
        }
        Some(LaneStatus::UnderWay)
    }

    /// Tries a step in each lane, and records requested values if it is accepted.
    #[inline(always)]
    fn step(&mut self) {
        let Self { system, family, control, inputs, t, end, h, t_new, y, y_new, p, mass, .. } =
            self;
        let (tolerances, sizes) = (self.tolerances, &self.sizes);
        let kind = self.options.method.kind;
        let remaining = *end - *t;
        *h = control.propose(remaining);
        let is_inside = h.lanes_where(remaining, |h, remaining| h < remaining);
        *t_new = end.choose(*t + *h, is_inside);
        let mass = mass.as_ref();
        let (y_now, of_size) = (y.lanes(), sizes.lanes());
        let trial = LaneTrial { system: *system, p, mass, t, y: y_now, h, sizes: of_size };
        let y_new = y_new.lanes_mut();
        let e = match (&mut *family, kind) {
            (LaneMethod::Rosenbrock(family), MethodKind::Rosenbrock(tableau)) => {
                family.attempt(tableau, &trial, inputs, y_new);
                family.error(tableau)
            }
            (LaneMethod::Explicit(family), MethodKind::Explicit(tableau)) => {
                family.attempt(tableau, &trial, inputs, y_new);
                family.error()
            }
            _ => unreachable!("work space is that of the method"),
        };
        let errors = mean_square(tolerances, e, y.lanes(), y_new, sizes.lanes());
        control.judge(*h, errors);
        for (l, accepted) in self.accepted.iter_mut().enumerate() {
            *accepted = errors.0[l] <= 1.0;
        }
        self.record_steps();

        let Self { family, t, t_new, y, y_new, accepted, .. } = self;
        for (y, y_new) in y.lanes_mut().iter_mut().zip(y_new.lanes()) {
            *y = y.choose(*y_new, *accepted);
        }
        *t = t.choose(*t_new, *accepted);
        if let (LaneMethod::Explicit(family), MethodKind::Explicit(tableau)) = (family, kind) {
            family.advance(tableau, *accepted);
        }
    }

    /// Records the requested times in (t, t⁺] of the lanes whose steps are accepted.
    #[inline(always)]
    fn record_steps(&mut self) {
        let mut is_prepared = false;
        for l in 0..LANES {
            let Some(seat) = &self.seats[l] else { continue };
            let (t, t_new) = (self.t.0[l], self.t_new.0[l]);
            let requested = &self.times.all()[seat.recorded..];
            if !self.accepted[l] || requested[0] > t_new {
                continue;
            }
            if !is_prepared {
                self.write_dense();
                is_prepared = true;
            }
            let Some(seat) = &mut self.seats[l] else { continue };
            let step = LaneStep { lane: l, t, per_h: 1.0 / (t_new - t) };
            let (stride, first) = (self.times.stride(), seat.recorded);
            let count = self.times.count_before(first, t_new);
            // The next step overwrites values beyond this one.
            let eights = first..first + count.next_multiple_of(LANES);
            let requested = &self.times.all()[eights.clone()];
            for (i, y) in self.y.lanes().iter().enumerate() {
                let row = &mut seat.rows[i * stride..][eights.clone()];
                self.dense.write(i, y.0[l], step, requested, row);
            }
            seat.recorded += count;
            let requested = &self.times.all()[seat.recorded..];
            let mut at_end = requested.iter().take_while(|&&t| t == t_new).count();
            if t_new == seat.problem.inputs.segment(seat.segment).t1 {
                at_end = before_change(at_end);
            }
            for _ in 0..at_end {
                for (row, y_new) in seat.rows.chunks_exact_mut(stride).zip(self.y_new.lanes()) {
                    row[seat.recorded] = y_new.0[l];
                }
                seat.recorded += 1;
            }
        }
    }

    /// Writes the dense output of the last tried steps.
    #[inline(always)]
    fn write_dense(&mut self) {
        let Self { family, y, y_new, h, dense, .. } = self;
        match (family, self.options.method.kind) {
            (LaneMethod::Rosenbrock(family), MethodKind::Rosenbrock(tableau)) => {
                family.write_dense(tableau, y.lanes(), y_new.lanes(), dense);
            }
            (LaneMethod::Explicit(family), MethodKind::Explicit(tableau)) => {
                family.write_dense(tableau, *h, dense);
            }
            _ => unreachable!("work space is that of the method"),
        }
    }

    /// Records the requested times equal to the current one.
    fn record_now(&mut self, l: usize) {
        let Some(seat) = &mut self.seats[l] else { return };
        let stride = self.times.stride();
        while self.times.all()[seat.recorded] == self.t.0[l] {
            for (row, y) in seat.rows.chunks_exact_mut(stride).zip(self.y.lanes()) {
                row[seat.recorded] = y.0[l];
            }
            seat.recorded += 1;
        }
    }

    /// Acts on the outcome of the step that lane l tried.
    #[inline]
    fn follow_up(&mut self, l: usize) {
        let Some(seat) = &mut self.seats[l] else { return };
        let (t, end) = (self.t.0[l], self.end.0[l]);
        if self.accepted[l] {
            seat.statistics.steps += 1;
        } else {
            seat.statistics.rejected += 1;
            // The same limit as in the integrator.
            let least = 4.0 * f64::EPSILON * t.abs().max(f64::EPSILON * self.times.span);
            if self.control.h.0[l].is_nan() || self.control.h.0[l] <= least {
                seat.fate = LaneStatus::Stopped;
                return;
            }
        }
        if t < end {
            if seat.statistics.steps + seat.statistics.rejected >= self.options.max_steps {
                seat.fate = LaneStatus::Stopped;
            }
        } else {
            let fate = self.end_segment(l).unwrap_or(LaneStatus::Stopped);
            if let Some(seat) = &mut self.seats[l] {
                seat.fate = fate;
            }
        }
    }

    /// Continues with the next segment in lane l; `None` on failure.
    fn end_segment(&mut self, l: usize) -> Option<LaneStatus> {
        let (t, until) = (self.t.0[l], *self.times.asked.last()?);
        let seat = self.seats[l].as_mut()?;
        if seat.recorded == self.times.asked.len() {
            return Some(LaneStatus::Done);
        }
        let inputs = seat.problem.inputs;
        let before = inputs.segment(seat.segment);
        if t == before.t1 {
            seat.segment += 1;
            seat.statistics.segments += 1;
            let after = inputs.segment(seat.segment);
            if !self.algebraic.is_empty() {
                self.make_consistent(l, before, after)?;
            }
            self.inputs.enter(l, after);
            self.end.0[l] = after.t1.min(until);
            if let LaneMethod::Explicit(explicit) = &mut self.family {
                explicit.is_fresh[l] = true;
            }
        }
        self.record_now(l);
        let seat = self.seats[l].as_ref()?;
        Some(if seat.recorded == self.times.asked.len() {
            LaneStatus::Done
        } else {
            LaneStatus::UnderWay
        })
    }

    /// Makes algebraic unknowns of lane l consistent if a jump of the inputs affects their equations.
    fn make_consistent(&mut self, l: usize, before: Segment<'_>, after: Segment<'_>) -> Option<()> {
        let seat = self.seats[l].as_mut()?;
        let (t, p) = (self.t.0[l], seat.problem.p);
        let y = &mut self.row;
        for (y, lanes) in y.as_mut().iter_mut().zip(self.y.lanes()) {
            *y = lanes.0[l];
        }
        let mut u = S::Inputs::zeros(after.u.len());
        let (mut f, mut f_new) = (self.slope.clone(), self.slope.clone());
        before.value(t, u.as_mut());
        let point = EvaluationPoint { t, y: y.as_ref(), u: u.as_ref(), p, z: &[] };
        self.system.rhs(point, f.as_mut());
        after.value(t, u.as_mut());
        let point = EvaluationPoint { t, y: y.as_ref(), u: u.as_ref(), p, z: &[] };
        self.system.rhs(point, f_new.as_mut());
        seat.statistics.evaluations += 2;
        if !self.algebraic.differs(f.as_ref(), f_new.as_ref()) {
            return Some(());
        }
        for (size, lanes) in self.slope.as_mut().iter_mut().zip(self.sizes.lanes()) {
            *size = lanes.0[l];
        }
        let point = AlgebraicPoint { t, u: u.as_ref(), p, z: &[] };
        let (sizes, jacobian) = (self.slope.as_ref(), self.jacobian.as_mut());
        // Sizes of equations are determined again for each member.
        self.algebraic.enter_modes(self.mass.as_ref());
        let (system, tolerances) = (self.system, self.tolerances);
        let algebraic = &mut self.algebraic;
        algebraic.make_consistent(system, point, y.as_mut(), jacobian, sizes, tolerances).ok()?;
        set_lane(&mut self.y, l, self.row.as_ref());
        Some(())
    }

    /// Moves the rows of the member in lane l onto the algebraic equations.
    fn project(&mut self, l: usize) {
        let requested = self.times.asked;
        let (Some(seat), Some(&from)) = (&mut self.seats[l], requested.first()) else { return };
        if self.algebraic.is_empty() {
            return;
        }
        let LaneMember { problem, rows, .. } = seat;
        let (system, inputs, stride) = (self.system, problem.inputs, self.times.stride());
        for (size, lanes) in self.slope.as_mut().iter_mut().zip(self.sizes.lanes()) {
            *size = lanes.0[l];
        }
        self.algebraic.enter_modes(self.mass.as_ref());
        let mut segment = inputs.segment_at(from, LimitSide::Right);
        let mut drive =
            InputCursor::new(problem, inputs.segment(segment), from, 0, self.tolerances);
        // The matrix of one row usually serves the next.
        let mut projection = Projection::new(system, 0);
        let (sizes, tolerances) = (self.slope.as_ref(), self.tolerances);
        let of_member = StepRows { system, p: problem.p, z: &[], sizes, tolerances };
        for (k, &t) in requested.iter().enumerate() {
            let now = inputs.segment_at(t, side(requested, k));
            if now != segment {
                segment = now;
                drive.enter(inputs.segment(now));
            }
            let y = self.row.as_mut();
            for (y, row) in y.iter_mut().zip(rows.chunks_exact(stride)) {
                *y = row[k];
            }
            projection.begin_far_row();
            projection.project(&mut self.algebraic, &of_member, &mut drive, t, y);
            for (y, row) in y.iter().zip(rows.chunks_exact_mut(stride)) {
                row[k] = *y;
            }
        }
    }

    /// The finished member in lane l, with its outputs.
    fn show(&mut self, l: usize) -> FinishedMember<'_> {
        self.project(l);
        self.width.run(LaneOutputs(self, l));
        let Some(seat) = &mut self.seats[l] else {
            unreachable!("a lane that is shown has a member")
        };
        let stages = match self.options.method.kind {
            MethodKind::Rosenbrock(tableau) => tableau.stages() - 1,
            MethodKind::Explicit(tableau) => tableau.stages() - 1,
            MethodKind::Esdirk(_) | MethodKind::Bdf(_) | MethodKind::Taylor(_) => 0,
        };
        let statistics = &mut seat.statistics;
        let tried = statistics.steps + statistics.rejected;
        statistics.evaluations += stages * tried;
        if matches!(self.family, LaneMethod::Rosenbrock(_)) {
            statistics.linearizations = tried;
            statistics.factorisations = tried;
        }
        FinishedMember {
            member: seat.member,
            unknowns: &seat.rows,
            outputs: &self.observer.outputs,
            stride: self.times.stride(),
            statistics: *statistics,
        }
    }

    /// Evaluates the outputs of the member in lane l.
    #[inline(always)]
    fn observe(&mut self, l: usize) {
        if let Some(LaneMember { problem, rows, .. }) = &self.seats[l] {
            self.observer.observe(problem, &self.times, rows);
        }
    }
}

/// A step of each lane.
struct LaneSteps<'p, 'a, S: SolvableSystem>(&'p mut LaneEngine<'a, S>);

impl<S: SolvableSystem> WidthTask for LaneSteps<'_, '_, S> {
    #[inline(always)]
    fn run(self) {
        self.0.step();
    }
}

/// The outputs of a lane.
struct LaneOutputs<'p, 'a, S: SolvableSystem>(&'p mut LaneEngine<'a, S>, usize);

impl<S: SolvableSystem> WidthTask for LaneOutputs<'_, '_, S> {
    #[inline(always)]
    fn run(self) {
        self.0.observe(self.1);
    }
}

fn set_lane<V: LaneStorage>(lanes: &mut V, l: usize, values: &[f64]) {
    for (lanes, value) in lanes.lanes_mut().iter_mut().zip(values) {
        lanes.0[l] = *value;
    }
}
