//! The history of delayed unknowns in a run, looked up at α = t − τ.
//!
//! Every accepted step leaves a polynomial ([`polynomial`]) of the delayed unknowns and their sensitivities. Before the
//! start an unknown has the history that the model gives, otherwise its start value.
//!
//! Points where a solution is not smooth are *marked*. When a delay reaches a mark, the delayed value changes its
//! piece: a *discontinuity* of the run, at which a step ends ([`super::discontinuities`]). Between two discontinuities
//! a delay reads only values between two marks, however α is rounded.
//!
//! A mark of level l has a jump in the l-th derivative. The solution integrates delayed values, so a discontinuity at a
//! mark of level l is a mark of level l + 1. Marks are followed up to [`MOST_LEVEL`]; the error estimates of all
//! methods are blind to higher ones. If very many are in transit, as with recordings of every second and a long delay,
//! only levels 0 and 1 are followed, at which values or sensitivities jump.

mod along;
mod given;
mod look_up;
mod passing;
mod polynomial;

use crate::error::{BadRequest, IntegrateError};
use crate::linalg::norm::Tolerances;
use crate::observe::delay::{delay_sensitivities, delays};
use crate::problem::Problem;
use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, PastLayout};
use polynomial::divide;

pub use given::{HatFunction, HistoryPerturbation, PastSolution};
pub use polynomial::NODES;

/// Highest level of marks that are followed.
const MOST_LEVEL: u32 = 6;
/// With this many marks in transit over the longest delay, weak ones are not followed.
const MANY: usize = 32;
/// Marks below this level are always followed.
const WEAK: u32 = 2;
/// Times closer than this, relative to themselves, count as equal: the rounding of t + τ.
pub(in crate::integrate) const ONE_TIME: f64 = 4.0 * f64::EPSILON;
/// Differences below this fraction of the tolerance are not jumps: algebraic unknowns are solved iteratively.
const NO_JUMP: f64 = 1e-2;
/// Number of passed pieces, which no delay reaches any more, at which they are dropped.
const MANY_PASSED: usize = 1024;

/// The past of a run.
pub(in crate::integrate) struct DelayHistory {
    layout: PastLayout,
    from: f64,
    /// Tolerances for jumps, and sizes of all unknowns.
    tolerances: Tolerances,
    sizes: Vec<f64>,
    /// Number of recorded directions.
    n_s: usize,
    /// Delayed unknowns, each once.
    watched: Vec<usize>,
    lags: Vec<DelayReads>,
    begun: HistoryStart,
    /// The model's history of delayed unknowns before the start.
    before: PrehistoryValues,
    /// Watched values, then their sensitivities direction by direction: before the start, and now.
    origin: Vec<f64>,
    now: Vec<f64>,
    /// Number of the first piece kept; then start, end and divided differences of each piece.
    first: usize,
    ends: Vec<[f64; 2]>,
    differences: Vec<f64>,
    /// Number of the first mark kept; then the marks, ascending.
    first_mark: usize,
    marks: Vec<Breakpoint>,
    /// The shortest constant non-zero delay.
    shortest: f64,
    /// Variable delays at the last look-up.
    varying: Vec<f64>,
    /// Whether a value was read that the solution has not reached yet.
    reads_beyond: bool,
    /// Whether the last piece is that of a trial step.
    is_trial: bool,
    /// Whether delays read wherever they lead, and not only between two marks: where they may jump.
    is_free: bool,
    /// A variable delay that reaches a mark within the step: its position, the time, and whether backwards.
    crossing: Option<(usize, f64, bool)>,
}

/// Whether a history has begun.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum HistoryStart {
    /// The run has no consistent start values.
    NotYet,
    /// At the start, with the model's history.
    Anew,
    /// A given past.
    FromAPast,
}

/// A delay, and the unknowns that it reads.
struct DelayReads {
    /// Its value, or its position among the variable delays.
    tau: DelayTime,
    /// ∂τ/∂θ.
    dtau: Vec<f64>,
    reads: Vec<DelayedRead>,
    /// The mark that it reaches next.
    mark: usize,
    /// The piece that it read last.
    piece: usize,
    /// How far before the last mark, and behind the next one, it still reads between them: by the excess when a step
    /// ended at a mark.
    slack: [f64; 2],
    /// Whether a variable delay is zero since the last instant, so that it reads the present.
    is_none: bool,
}

/// A delay.
#[derive(Clone, Copy)]
enum DelayTime {
    Constant(f64),
    Varying(usize),
}

/// A delayed unknown.
#[derive(Clone, Copy)]
struct DelayedRead {
    /// Its position among the delayed unknowns, and that of the unknown among the watched ones.
    delayed: usize,
    watched: usize,
    has_history: bool,
}

/// Values of the model's history before the start, one for each delayed unknown.
#[derive(Default)]
struct PrehistoryValues {
    values: Vec<f64>,
    rates: Vec<f64>,
    curvatures: Vec<f64>,
    s: Vec<f64>,
    s_rates: Vec<f64>,
}

/// A point at which the solution is not smooth.
struct Breakpoint {
    t: f64,
    /// The first piece after it.
    piece: usize,
    level: u32,
    /// dt/dθ.
    dt: Vec<f64>,
    /// Watched values just before it, if some of them jump.
    left: Vec<f64>,
}

/// A discontinuity: a delay reaches a mark.
pub(in crate::integrate) struct Discontinuity {
    lag: usize,
    /// Whether the delay passes the mark backwards.
    back: bool,
    pub(in crate::integrate) level: u32,
    /// Derivatives of its time; for a variable delay, those of the mark.
    pub(in crate::integrate) dt: Vec<f64>,
    /// Position of the variable delay, if it is one.
    pub(in crate::integrate) varying: Option<usize>,
}

/// Checks that the delays of unknowns are valid.
pub(in crate::integrate) fn verify<S: SolvableSystem>(
    problem: &Problem<'_, S>,
    with_sensitivities: bool,
) -> Result<(), IntegrateError> {
    let signature = problem.system.signature();
    if signature.delayed_unknowns.is_empty() {
        return Ok(());
    }
    let (tau, dtau) = (delays(problem), delay_sensitivities(problem));
    for delayed in signature.delayed_unknowns.iter().filter(|delayed| !delayed.varies) {
        let unknown = signature.unknowns.get(delayed.unknown);
        let value = tau[delayed.delay];
        let moves = || dtau.chunks_exact(tau.len()).any(|column| column[delayed.delay] != 0.0);
        let is_known = value.is_finite() && value >= 0.0;
        // The derivative with respect to a delay of zero is −ẋ, which only an equation of x itself gives.
        let has_rate = unknown.differential && signature.discrete.automata.is_empty();
        if is_known && (value > 0.0 || has_rate || !with_sensitivities || !moves()) {
            continue;
        }
        let unknown = unknown.name.to_string();
        let delay = signature.delays[delayed.delay].to_string();
        return Err(IntegrateError::BadRequest(if is_known {
            BadRequest::DerivativeToNoDelay { unknown, delay }
        } else {
            BadRequest::UnknownDelay { unknown, delay, value }
        }));
    }
    Ok(())
}

impl DelayReads {
    fn constant(&self) -> Option<f64> {
        match self.tau {
            DelayTime::Constant(tau) => Some(tau),
            DelayTime::Varying(_) => None,
        }
    }
}

impl DelayHistory {
    /// `None` if no unknown has a non-zero delay.
    pub(in crate::integrate) fn new<S: SolvableSystem>(
        problem: &Problem<'_, S>,
        from: f64,
        n_s: usize,
        tolerances: Tolerances,
    ) -> Option<Box<Self>> {
        let signature = problem.system.signature();
        let layout = signature.past();
        if layout.is_empty() {
            return None;
        }
        let (tau, dtau) = (delays(problem), delay_sensitivities(problem));
        let mut watched: Vec<usize> =
            signature.delayed_unknowns.iter().map(|delayed| delayed.unknown).collect();
        watched.sort_unstable();
        watched.dedup();
        let reads = |varies: bool, delay: usize| {
            let delayed = signature.delayed_unknowns.iter().enumerate();
            let these = delayed.filter(|(_, read)| read.varies == varies && read.delay == delay);
            let reads = these.map(|(k, read)| DelayedRead {
                delayed: k,
                watched: watched.partition_point(|unknown| *unknown < read.unknown),
                has_history: read.has_history,
            });
            reads.collect::<Vec<_>>()
        };
        let constant = (0..tau.len()).map(|delay| DelayReads {
            tau: DelayTime::Constant(tau[delay]),
            dtau: (0..n_s).map(|j| dtau[j * tau.len() + delay]).collect(),
            reads: reads(false, delay),
            mark: 0,
            piece: 0,
            slack: [0.0; 2],
            is_none: false,
        });
        let n_varying = signature.varying_delays.len();
        let varying = (0..n_varying).map(|delay| DelayReads {
            tau: DelayTime::Varying(delay),
            dtau: Vec::new(),
            reads: reads(true, delay),
            mark: 0,
            piece: 0,
            slack: [0.0; 2],
            is_none: false,
        });
        // An unknown whose delay is zero whatever the parameters has its current value.
        let is_late = |lag: &DelayReads| match lag.tau {
            DelayTime::Constant(tau) => tau > 0.0 || lag.dtau.iter().any(|dtau| *dtau != 0.0),
            DelayTime::Varying(_) => true,
        };
        let lags = constant.chain(varying).filter(|lag| !lag.reads.is_empty() && is_late(lag));
        let lags: Vec<DelayReads> = lags.collect();
        if lags.is_empty() {
            return None;
        }
        let n = watched.len() * (1 + n_s);
        Some(Box::new(Self {
            layout,
            from,
            tolerances,
            sizes: Vec::new(),
            n_s,
            begun: HistoryStart::NotYet,
            origin: vec![0.0; n],
            now: vec![0.0; n],
            first: 0,
            ends: Vec::new(),
            differences: Vec::new(),
            first_mark: 0,
            marks: Vec::new(),
            shortest: lags
                .iter()
                .filter_map(DelayReads::constant)
                .filter(|tau| *tau > 0.0)
                .fold(f64::INFINITY, f64::min),
            varying: vec![0.0; n_varying],
            reads_beyond: false,
            is_trial: false,
            is_free: false,
            crossing: None,
            before: PrehistoryValues {
                values: vec![0.0; layout.n_v],
                rates: vec![0.0; layout.n_v],
                curvatures: vec![0.0; layout.n_v],
                s: vec![0.0; layout.n_v * layout.n_s],
                s_rates: vec![0.0; layout.n_v * layout.n_s],
            },
            lags,
            watched,
        }))
    }

    /// The longest step that needs only known delayed values.
    pub(in crate::integrate) fn reach(&self) -> f64 {
        self.shortest
    }

    /// Begins with consistent start values.
    pub(in crate::integrate) fn begin<S: SolvableSystem>(
        &mut self,
        problem: &Problem<'_, S>,
        t: f64,
        y: &[f64],
        s: Option<&[f64]>,
        sizes: &[f64],
        u: &[f64],
    ) {
        self.sizes = sizes.to_vec();
        if self.begun == HistoryStart::FromAPast {
            gather(&self.watched, self.n_s, y, s, &mut self.now);
            self.mark(t, 1, &[], y, s);
            self.pass_all_until(t);
            self.locate(problem, t, y, u);
            self.is_free = false;
            return;
        }
        gather(&self.watched, self.n_s, y, s, &mut self.origin);
        // The values just before the start serve as the current ones.
        self.now.copy_from_slice(&self.origin);
        let point = EvaluationPoint { t: self.from, y: &[], u: &[], p: problem.p, z: &[] };
        let PrehistoryValues { values, rates, curvatures, .. } = &mut self.before;
        problem.system.histories(point, values, rates, curvatures);
        for read in self.lags.iter().flat_map(|lag| &lag.reads).filter(|read| read.has_history) {
            self.now[read.watched] = self.before.values[read.delayed];
        }
        self.begun = HistoryStart::Anew;
        self.mark(self.from, 1, &[], y, s);
        // A delay that is zero at the start reads the values that follow it.
        self.locate(problem, self.from, y, u);
    }

    /// Whether the predicate holds for one of the delayed unknowns.
    pub(in crate::integrate) fn watches(&self, is_one: impl Fn(usize) -> bool) -> bool {
        self.watched.iter().any(|unknown| is_one(*unknown))
    }

    /// Whether it continues a given past.
    pub(in crate::integrate) fn is_resumed(&self) -> bool {
        self.begun == HistoryStart::FromAPast
    }

    /// Sets the sensitivities at the start.
    pub(in crate::integrate) fn begin_sensitivities(&mut self, y: &[f64], s: &[f64]) {
        gather(&self.watched, self.n_s, y, Some(s), &mut self.now);
        let n_w = self.watched.len();
        self.origin[n_w..].copy_from_slice(&self.now[n_w..]);
    }

    /// Whether this trial read a value that the solution has not reached yet.
    pub(in crate::integrate) fn has_read_beyond(&self) -> bool {
        self.reads_beyond
    }

    /// Whether the last tried step reads itself.
    pub(in crate::integrate) fn has_trial(&self) -> bool {
        self.is_trial
    }

    /// Discards the data of the previous trial, before a step is tried.
    pub(in crate::integrate) fn forget_trial(&mut self) {
        self.remove_trial();
        self.reads_beyond = false;
    }

    fn remove_trial(&mut self) {
        if std::mem::take(&mut self.is_trial) && self.ends.pop().is_some() {
            self.differences.truncate(self.ends.len() * self.now.len() * NODES.len());
        }
    }

    /// Makes room for a step from `t0` to `t1`, temporarily if `for_now`; its values at the nodes follow.
    pub(in crate::integrate) fn begin_piece(&mut self, t0: f64, t1: f64, for_now: bool) {
        self.remove_trial();
        self.is_trial = for_now;
        self.drop_passed(t0);
        self.ends.push([t0, t1]);
        let n = self.now.len();
        self.differences.resize(self.ends.len() * n * NODES.len(), 0.0);
    }

    /// Sets the values at a node of the step begun last.
    pub(in crate::integrate) fn set_node(&mut self, node: usize, y: &[f64], s: Option<&[f64]>) {
        let n = self.now.len();
        let entry = ((self.ends.len() - 1) * NODES.len() + node) * n;
        gather(&self.watched, self.n_s, y, s, &mut self.differences[entry..entry + n]);
        if node == 1 && !self.is_trial {
            self.now.copy_from_slice(&self.differences[entry..entry + n]);
        }
    }

    /// Completes the step once all values at the nodes are set.
    pub(in crate::integrate) fn end_piece(&mut self) {
        let n = self.now.len();
        let entry = (self.ends.len() - 1) * NODES.len() * n;
        divide(&mut self.differences[entry..], n);
    }

    /// Marks `t`, where the solution continues with these values. The level is 0 if they jump.
    pub(in crate::integrate) fn mark(
        &mut self,
        t: f64,
        level: u32,
        dt: &[f64],
        y: &[f64],
        s: Option<&[f64]>,
    ) {
        self.crossing = None;
        let jumps = self.watched.iter().zip(&self.now).any(|(unknown, before)| {
            let after = y[*unknown];
            let allowed =
                self.tolerances.weight(after.abs().max(before.abs()), self.sizes[*unknown]);
            (after - before).abs() > NO_JUMP * allowed
        });
        let level = if jumps { 0 } else { level };
        let left = if jumps { self.now[..self.watched.len()].to_vec() } else { Vec::new() };
        let piece = self.first + self.ends.len();
        let again = self.marks.last().is_some_and(|last| last.t == t && last.piece == piece);
        if again && !jumps {
            if let Some(last) = self.marks.last_mut() {
                last.level = last.level.min(level);
            }
            gather(&self.watched, self.n_s, y, s, &mut self.now);
            return;
        }
        let passed = self.lags.iter().map(|lag| lag.mark).min().unwrap_or(0);
        let on_their_way = self.first_mark + self.marks.len() - passed;
        let most = if on_their_way < MANY { MOST_LEVEL } else { WEAK - 1 };
        if level > most {
            gather(&self.watched, self.n_s, y, s, &mut self.now);
            return;
        }
        if again {
            // Between two jumps at one time there is a piece of zero length.
            self.ends.push([t, t]);
            let n = self.now.len();
            self.differences.extend_from_slice(&self.now);
            self.differences.resize(self.ends.len() * n * NODES.len(), 0.0);
        }
        gather(&self.watched, self.n_s, y, s, &mut self.now);
        let piece = self.first + self.ends.len();
        let mut dt = dt.to_vec();
        dt.resize(self.n_s, 0.0);
        self.marks.push(Breakpoint { t, piece, level, dt, left });
    }

    /// Occasionally drops the pieces that no delay reaches any more from `t` on.
    fn drop_passed(&mut self, t: f64) {
        // A variable delay may grow without bound.
        if self.ends.len() < 2 * MANY_PASSED || self.varies() {
            return;
        }
        // A delay that is still before the start will read the very first piece.
        let oldest = self.lags.iter().map(|lag| self.piece_at(lag, t)).min().unwrap_or(self.first);
        let passed = oldest - self.first;
        if passed < MANY_PASSED {
            return;
        }
        self.ends.drain(..passed);
        self.differences.drain(..passed * self.now.len() * NODES.len());
        self.first = oldest;
        let behind = self.lags.iter().map(|lag| lag.mark.saturating_sub(1)).min();
        let mark = behind.unwrap_or(self.first_mark);
        self.marks.drain(..mark - self.first_mark);
        self.first_mark = mark;
    }

    /// The piece that a delay reads at `t`, which may precede the piece read last: rows within a step are recorded
    /// after its last stage.
    fn piece_at(&self, lag: &DelayReads, t: f64) -> usize {
        let alpha = t - lag.constant().unwrap_or(0.0) - self.rounding(t);
        let read = lag.piece.saturating_sub(self.first).min(self.ends.len());
        let before = self.ends[..read].iter().rev().take_while(|[_, end]| *end >= alpha).count();
        self.first + read - before
    }
}

/// Watched values, then their sensitivities; zeros once these are undefined.
fn gather(watched: &[usize], n_s: usize, y: &[f64], s: Option<&[f64]>, out: &mut [f64]) {
    let (values, sensitivities) = out.split_at_mut(watched.len());
    for (value, unknown) in values.iter_mut().zip(watched) {
        *value = y[*unknown];
    }
    for j in 0..n_s {
        let column = &mut sensitivities[j * watched.len()..(j + 1) * watched.len()];
        for (value, unknown) in column.iter_mut().zip(watched) {
            *value = s.map_or(0.0, |s| s[j * y.len() + unknown]);
        }
    }
}
