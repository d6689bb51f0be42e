//! Algebraic equations made of pieces, such as `max(i, 0)`: which piece of each holds is found together with their
//! unknowns.
//!
//! A piece ends at a surface e = 0. Newton's correction δ with the present pieces is followed up to the first surface
//! that it reaches, where the piece beyond is taken and a new correction computed. If all pieces are linear, residuals
//! shrink in proportion along each correction, so that the way is the path of a homotopy
//!
//! ```text
//!   f(y(λ)) = (1 − λ) f(y₀),   λ from 0 to 1
//! ```
//!
//! which leads to the solution from any guess if the determinants of all pieces have one sign. Where the sign changes,
//! at a fold, the path goes on in the piece beyond with λ falling: against the correction, up to another fold. Where a
//! piece alone leaves unknowns undetermined, the correction is that of equations with a little of each unknown added.
//! If no path arrives, as may be with ideal diodes, equations are solved piece by piece, and the first piece that its
//! solution leaves is exchanged (Murty's rule), which ends for all matrices whose principal minors are positive.
//!
//! # Source
//!
//! Katzenelson, An algorithm for solving nonlinear resistor networks, Bell System Technical Journal 44 (1965)
//! 1605–1620. Chien and Kuh, Solving piecewise-linear equations for resistive networks, International Journal of
//! Circuit Theory and Applications 4 (1976) 3–24. Murty, Note on a Bard-type scheme for solving the complementarity
//! problem, Opsearch 11 (1974) 123–130.

use super::newton::{CorrectionWeights, LEAST_DAMPING};
use super::singularity::CONVERGED;
use super::{AlgebraicPoint, AlgebraicSystem, add_scaled, is_rounding, mask};
use crate::algebraic::readings::readings;
use crate::error::InitialError;
use crate::linalg::Factorisation;
use crate::linalg::norm::Tolerances;
use crate::solved::SolvableSystem;
use crate::system::{Discrete, EvaluationPoint};

/// Corrections without a change of pieces, and changes of each piece, that are allowed.
const MOST_CORRECTIONS: usize = 100;
const MOST_CHANGES: usize = 20;
/// How many starts are tried beside the guess, and how far the first is from it, in sizes of the unknowns. A path may
/// cycle only where it meets several surfaces at one point, as from a guess of zero; from points nearby it meets them
/// one by one.
const MOST_STARTS: u32 = 4;
const BESIDE: f64 = 1e-3;
/// Share of each unknown added to equations of a piece that leave it undetermined, relative to their largest
/// coefficients.
const A_LITTLE: f64 = 1e-9;
/// Tolerances need not be smaller for the choice of pieces, which is disturbed by rounding.
const LEAST: f64 = 1e-9;
/// Excess over a surface that is rounding, as a fraction of the largest value of its event function so far.
const ROUNDING: f64 = 1e-10;

/// The automata of a model that choose between pieces, and work space for their surfaces.
pub(crate) struct PieceAutomata {
    all: Vec<PieceAutomaton>,
    e: Vec<f64>,
    ahead: Vec<f64>,
    guess: Vec<f64>,
    /// Whether the last path went against corrections somewhere, or none arrived.
    has_turned: bool,
}

#[derive(Debug, Clone, Copy)]
struct PieceAutomaton {
    /// Position of its automaton.
    automaton: usize,
    /// Position of its first event function, e.
    event: usize,
}

/// Along or against Newton's correction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum NewtonHeading {
    Along,
    Against,
}

impl NewtonHeading {
    fn sign(self) -> f64 {
        match self {
            NewtonHeading::Along => 1.0,
            NewtonHeading::Against => -1.0,
        }
    }
}

impl PieceAutomata {
    pub(crate) fn new(discrete: &Discrete, n: usize) -> Self {
        let mut pieces: Vec<PieceAutomaton> = Vec::new();
        for (event, (automaton, _)) in discrete.transitions().enumerate() {
            let is_first = pieces.last().is_none_or(|piece| piece.automaton != automaton);
            if is_first && discrete.automata[automaton].kind.is_piece() {
                pieces.push(PieceAutomaton { automaton, event });
            }
        }
        let n_e = if pieces.is_empty() { 0 } else { discrete.transitions().count() };
        let n = if pieces.is_empty() { 0 } else { n };
        Self {
            all: pieces,
            e: vec![0.0; n_e],
            ahead: vec![0.0; n_e],
            guess: vec![0.0; n],
            has_turned: false,
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Whether the last solution was found beyond a fold, judging by its path: a determinant changed its sign.
    pub(crate) fn has_turned(&self) -> bool {
        self.has_turned
    }

    /// Counts whether an earlier path of the same search turned.
    pub(crate) fn count_turn(&mut self, has_turned: bool) {
        self.has_turned |= has_turned;
    }

    /// Chooses the pieces that `y` lies in. Surfaces may depend on other pieces.
    fn choose<S: SolvableSystem>(
        &mut self,
        system: &S,
        at: AlgebraicPoint<'_>,
        z: &mut [f64],
        y: &[f64],
    ) {
        let AlgebraicPoint { t, u, p, .. } = at;
        for _ in 0..=self.all.len() {
            system.event_functions(EvaluationPoint { t, y, u, p, z }, &mut self.e);
            let mut changed = false;
            for piece in &self.all {
                let side = f64::from(u8::from(self.e[piece.event] > 0.0));
                changed |= z[piece.automaton] != side;
                z[piece.automaton] = side;
            }
            if !changed {
                return;
            }
        }
    }

    /// The piece that is left first on the way from `e` towards `ahead`, and the part of the way to its surface.
    fn first_left(&self, z: &[f64]) -> Option<(PieceAutomaton, f64)> {
        let mut first: Option<(PieceAutomaton, f64)> = None;
        for piece in &self.all {
            let outwards = if z[piece.automaton] > 0.5 { -1.0 } else { 1.0 };
            let rate = outwards * (self.ahead[piece.event] - self.e[piece.event]);
            let left = -outwards * self.e[piece.event];
            let part = left.max(0.0) / rate;
            // NaN compares false.
            if rate > 0.0 && first.is_none_or(|(_, earliest)| part < earliest) {
                first = Some((*piece, part));
            }
        }
        first
    }

    /// The first piece that the point of `e` is not in; `sizes` has the largest values of each event function so far.
    fn first_outside(&self, z: &[f64], sizes: &mut [f64]) -> Option<PieceAutomaton> {
        for (size, e) in sizes.iter_mut().zip(&self.e) {
            *size = size.max(e.abs());
        }
        let is_outside = |piece: &&PieceAutomaton| {
            let outwards = if z[piece.automaton] > 0.5 { -1.0 } else { 1.0 };
            outwards * self.e[piece.event] > ROUNDING * sizes[piece.event]
        };
        self.all.iter().find(is_outside).copied()
    }

    /// Whether `ahead` is further into the piece just entered than `e`.
    fn leads_into(&self, piece: PieceAutomaton, z: &[f64]) -> bool {
        let inwards = if z[piece.automaton] > 0.5 { 1.0 } else { -1.0 };
        inwards * (self.ahead[piece.event] - self.e[piece.event]) >= 0.0
    }
}

impl<S: SolvableSystem> AlgebraicSystem<S> {
    /// Solves 0 = f_a for the algebraic unknowns and the pieces in `z`, from the guess in `y`, to the tolerance or
    /// nearly to rounding; `jacobian` is work space.
    #[expect(clippy::too_many_arguments)]
    pub(crate) fn solve_pieces(
        &mut self,
        system: &S,
        pieces: &mut PieceAutomata,
        at: AlgebraicPoint<'_>,
        z: &mut [f64],
        y: &mut [f64],
        jacobian: &mut [f64],
        weights: CorrectionWeights<'_>,
    ) -> Result<(), InitialError> {
        let Tolerances { rtol, atol } = weights.tolerances;
        let tolerances = Tolerances { rtol: rtol.max(LEAST), atol: atol.max(LEAST) };
        let weights = CorrectionWeights { tolerances, ..weights };
        let mut guess = std::mem::take(&mut pieces.guess);
        guess.copy_from_slice(y);
        let mut failed = None;
        let headings = [NewtonHeading::Along, NewtonHeading::Against];
        let starts = (0..=MOST_STARTS).flat_map(|start| headings.map(|heading| (start, heading)));
        for (start, heading) in starts {
            y.copy_from_slice(&guess);
            self.move_beside(y, weights.sizes, start);
            match self.follow(system, pieces, at, z, y, jacobian, weights, heading) {
                Ok(()) => {
                    failed = None;
                    break;
                }
                Err(error) => failed = failed.or(Some(error)),
            }
        }
        if failed.is_some() {
            y.copy_from_slice(&guess);
            if self.exchange(system, pieces, at, z, y, jacobian, weights).is_ok() {
                failed = None;
            } else {
                y.copy_from_slice(&guess);
            }
        }
        pieces.guess = guess;
        failed.map_or(Ok(()), Err)
    }

    /// Moves algebraic unknowns off the guess, each by another part of its size.
    fn move_beside(&self, y: &mut [f64], sizes: &[f64], start: u32) {
        if start == 0 {
            return;
        }
        let far = BESIDE * 8.0_f64.powf(f64::from(start) - 1.0);
        // Multiples of the golden ratio, modulo 1, come near to none of each other.
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        for (i, ((y, size), mass)) in y.iter_mut().zip(sizes).zip(self.mass.as_ref()).enumerate() {
            let part = ((i + 1) as f64 * golden * f64::from(start)).fract() - 0.5;
            *y += (1.0 - mass) * far * size * part;
        }
    }

    /// Follows corrections from piece to piece.
    #[expect(clippy::too_many_arguments)]
    fn follow(
        &mut self,
        system: &S,
        pieces: &mut PieceAutomata,
        at: AlgebraicPoint<'_>,
        z: &mut [f64],
        y: &mut [f64],
        jacobian: &mut [f64],
        weights: CorrectionWeights<'_>,
        mut heading: NewtonHeading,
    ) -> Result<(), InitialError> {
        let AlgebraicPoint { t, u, p, .. } = at;
        pieces.choose(system, at, z, y);
        pieces.has_turned = false;
        let mut entered: Option<PieceAutomaton> = None;
        let most = MOST_CORRECTIONS + MOST_CHANGES * pieces.all.len();
        for iteration in 1..=most {
            let here = EvaluationPoint { t, y, u, p, z };
            self.linearize_algebraic(system, here, jacobian)?;
            if self.f.as_ref().iter().all(|f| *f == 0.0) {
                return Ok(());
            }
            let norm = self.correct_any(system, here, jacobian, weights)?;
            // Beyond this, corrections and the surfaces that they reach are rounding.
            if norm <= CONVERGED * CONVERGED {
                add_scaled(y, 1.0, self.correction.as_ref());
                return Ok(());
            }
            let pattern = &system.signature().jacobian;
            if is_rounding(&self.f, &self.mass, &mut self.trial, pattern, jacobian, y) {
                return Ok(());
            }
            self.look_ahead(system, pieces, here, heading);
            if let Some(piece) = entered.take()
                && !pieces.leads_into(piece, z)
            {
                heading = match heading {
                    NewtonHeading::Along => NewtonHeading::Against,
                    NewtonHeading::Against => NewtonHeading::Along,
                };
                self.look_ahead(system, pieces, here, heading);
            }
            pieces.has_turned |= heading == NewtonHeading::Against;
            match pieces.first_left(z) {
                Some((piece, part)) if heading == NewtonHeading::Against || part < 1.0 => {
                    add_scaled(y, heading.sign() * part, self.correction.as_ref());
                    z[piece.automaton] = 1.0 - z[piece.automaton];
                    entered = Some(piece);
                }
                _ if heading == NewtonHeading::Along && self.damp(system, here, norm, weights) => {
                    y.copy_from_slice(self.trial.as_ref());
                }
                _ => return Err(self.not_converged(system, here, weights, jacobian, iteration)),
            }
        }
        Err(self.not_converged(system, EvaluationPoint { t, y, u, p, z }, weights, jacobian, most))
    }

    /// Solves the equations of the present pieces, and exchanges the first that the solution leaves, until none is left.
    #[expect(clippy::too_many_arguments)]
    fn exchange(
        &mut self,
        system: &S,
        pieces: &mut PieceAutomata,
        at: AlgebraicPoint<'_>,
        z: &mut [f64],
        y: &mut [f64],
        jacobian: &mut [f64],
        weights: CorrectionWeights<'_>,
    ) -> Result<(), InitialError> {
        let AlgebraicPoint { t, u, p, .. } = at;
        pieces.choose(system, at, z, y);
        pieces.has_turned = true;
        let mut sizes = std::mem::take(&mut pieces.ahead);
        sizes.fill(0.0);
        let most = MOST_CORRECTIONS + MOST_CHANGES * pieces.all.len();
        let mut solved = Ok(());
        for iteration in 1..=most {
            let here = EvaluationPoint { t, y, u, p, z };
            let corrected = self
                .linearize_algebraic(system, here, jacobian)
                .and_then(|()| self.correct_any(system, here, jacobian, weights));
            let norm = match corrected {
                Ok(norm) => norm,
                Err(error) => {
                    solved = Err(error);
                    break;
                }
            };
            let is_solved = norm <= CONVERGED * CONVERGED;
            if is_solved || !self.damp(system, here, norm, weights) {
                self.trial.as_mut().copy_from_slice(y);
                add_scaled(self.trial.as_mut(), 1.0, self.correction.as_ref());
            }
            y.copy_from_slice(self.trial.as_ref());
            system.event_functions(EvaluationPoint { t, y, u, p, z }, &mut pieces.e);
            match pieces.first_outside(z, &mut sizes) {
                Some(piece) => z[piece.automaton] = 1.0 - z[piece.automaton],
                None if is_solved => break,
                None => {}
            }
            if iteration == most {
                let here = EvaluationPoint { t, y, u, p, z };
                solved = Err(self.not_converged(system, here, weights, jacobian, most));
            }
        }
        pieces.ahead = sizes;
        solved
    }

    /// Evaluates f_a, and J in `jacobian`.
    fn linearize_algebraic(
        &mut self,
        system: &S,
        at: EvaluationPoint<'_>,
        jacobian: &mut [f64],
    ) -> Result<(), InitialError> {
        let (f, dfdt) = (self.f.as_mut(), self.dfdt.as_mut());
        system.linearize(at, self.zero_slopes.as_ref(), f, jacobian, dfdt);
        mask(self.f.as_mut(), self.mass.as_ref());
        let signature = system.signature();
        let not_finite = self.f.as_ref().iter().position(|f| !f.is_finite()).or_else(|| {
            let mut entries = signature.jacobian.positions().zip(jacobian.iter());
            let mass = self.mass.as_ref();
            let undefined = entries.find(|((row, _), j)| mass[*row] == 0.0 && !j.is_finite());
            undefined.map(|((row, _), _)| row)
        });
        let Some(row) = not_finite else { return Ok(()) };
        let equation = signature.equations.get(row).to_string();
        let readings = readings(system, at, row);
        Err(InitialError::NotFinite { equation, t: at.t, at: readings })
    }

    /// Solves for the correction from the residuals in `f`, with the matrix last factorised. Returns the square of its
    /// norm.
    fn solve_correction(&mut self, y: &[f64], weights: CorrectionWeights<'_>) -> f64 {
        self.correction.as_mut().copy_from_slice(self.f.as_ref());
        self.factorisation.solve(self.correction.as_mut());
        // Keeps rounding of the elimination out of the given values.
        mask(self.correction.as_mut(), self.mass.as_ref());
        weights.tolerances.mean_square(self.correction.as_ref(), y, y, weights.sizes)
    }

    /// Looks for a λ for which the next correction with this matrix is smaller, and leaves y + λ δ in `trial`.
    /// Returns whether there is one.
    fn damp(
        &mut self,
        system: &S,
        at: EvaluationPoint<'_>,
        norm: f64,
        weights: CorrectionWeights<'_>,
    ) -> bool {
        let CorrectionWeights { sizes, tolerances } = weights;
        let y = at.y;
        let mut lambda = 1.0;
        while lambda >= LEAST_DAMPING {
            self.trial.as_mut().copy_from_slice(y);
            add_scaled(self.trial.as_mut(), lambda, self.correction.as_ref());
            system.rhs(EvaluationPoint { y: self.trial.as_ref(), ..at }, self.next.as_mut());
            mask(self.next.as_mut(), self.mass.as_ref());
            self.factorisation.solve(self.next.as_mut());
            let next = tolerances.mean_square(self.next.as_ref(), y, y, sizes);
            let contraction = 1.0 - 0.25 * lambda;
            if next <= contraction * contraction * norm {
                return true;
            }
            lambda *= 0.5;
        }
        false
    }

    /// Newton's correction at a point where the equations are linearised, and the square of its norm. Where they leave
    /// unknowns undetermined, a little of each unknown is added to its equation.
    fn correct_any(
        &mut self,
        system: &S,
        at: EvaluationPoint<'_>,
        jacobian: &[f64],
        weights: CorrectionWeights<'_>,
    ) -> Result<f64, InitialError> {
        let pattern = &system.signature().jacobian;
        let factorised = self.factorise(pattern, jacobian, weights.sizes);
        if factorised.is_ok() {
            let norm = self.solve_correction(at.y, weights);
            if norm.is_finite() {
                return Ok(norm);
            }
        }
        let largest = self.rows.as_ref().iter().fold(0.0, |largest: f64, j| largest.max(j.abs()));
        let little = A_LITTLE * largest;
        if self.factorisation.factorise(little, |_| true, pattern, self.rows.as_ref(), None).is_ok()
        {
            let norm = self.solve_correction(at.y, weights);
            if norm.is_finite() {
                return Ok(norm);
            }
        }
        let row = factorised.err().map_or(0, |singular| singular.row);
        Err(self.singular(system, at, row, jacobian, weights.sizes))
    }

    /// Evaluates the surfaces at `get` and where the correction leads.
    fn look_ahead(
        &mut self,
        system: &S,
        pieces: &mut PieceAutomata,
        at: EvaluationPoint<'_>,
        heading: NewtonHeading,
    ) {
        system.event_functions(at, &mut pieces.e);
        self.trial.as_mut().copy_from_slice(at.y);
        add_scaled(self.trial.as_mut(), heading.sign(), self.correction.as_ref());
        system.event_functions(EvaluationPoint { y: self.trial.as_ref(), ..at }, &mut pieces.ahead);
    }
}
