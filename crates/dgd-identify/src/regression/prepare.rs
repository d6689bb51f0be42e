//! Prepares the rows of a problem, or finds out why there are none.

use dgd_runtime::for_identify::{delay_sensitivities, parameter_size};
use dgd_runtime::{Direction, Output, Pattern, Problem};

use crate::error::verify_lengths;
use crate::noise::NoiseSource;
use crate::output_error::prior::Prior;
use crate::recording::Recording;
use crate::regression::error::{RegressionError, UnsteadyUnknown};
use crate::regression::known::modes::remembered;
use crate::regression::known::{RecordingSamples, SensorEquations};
use crate::regression::rows::{RegressionRows, RowKind, RowOf, delayed_reads, delaying};
use crate::regression::{RegressionMethod, RegressionProblem, structure};

/// A checked problem.
pub(crate) struct PreparedRegression<'a> {
    pub problem: &'a RegressionProblem<'a>,
    /// Positions of the free parameters.
    pub free: Vec<usize>,
    /// Their sizes.
    pub sizes: Vec<f64>,
    /// All parameters, first guesses.
    pub p: Vec<f64>,
}

impl<'a> PreparedRegression<'a> {
    pub(crate) fn new(problem: &'a RegressionProblem<'a>) -> Result<Self, RegressionError> {
        let system = problem.system;
        let signature = system.signature();
        let RegressionProblem { p, free, recordings, noise, .. } = problem;
        verify_lengths(signature, p, free, recordings, noise.len())?;
        let directions = signature.directions.iter().zip(&problem.free);
        let free: Vec<usize> = directions
            .filter_map(|(direction, free)| match direction {
                Direction::Parameter(i) if *free => Some(*i),
                Direction::Parameter(_) | Direction::Start(_) => None,
            })
            .collect();
        if free.is_empty() {
            return Err(RegressionError::NothingFree);
        }
        let is_other =
            |prior: &&Prior| prior.concerns(|i| free.contains(&i)) && prior.as_normal().is_none();
        if let Some(prior) = problem.priors.iter().find(is_other) {
            let names = prior.names(signature);
            return Err(RegressionError::Prior { of: names, law: prior.density.name() });
        }
        let prepared = Self {
            problem,
            sizes: free.iter().map(|i| parameter_size(&system, *i)).collect(),
            free,
            p: problem.p.to_vec(),
        };
        prepared.verify_delays()?;
        Ok(prepared)
    }

    /// Moves first guesses into their bounds, if the method respects these.
    pub(crate) fn clamp(&mut self, method: RegressionMethod) {
        for (i, (lower, upper)) in self.free.iter().zip(self.bounds(method)) {
            self.p[*i] = self.p[*i].clamp(lower, upper);
        }
    }

    /// Bounds of the free parameters, if the method respects these.
    pub(crate) fn bounds(&self, method: RegressionMethod) -> Vec<(f64, f64)> {
        let parameters = &self.problem.system.signature().parameters;
        let bounds_of = |i: &usize| {
            if method.has_bounds() {
                (parameters[*i].lower, parameters[*i].upper)
            } else {
                (f64::NEG_INFINITY, f64::INFINITY)
            }
        };
        self.free.iter().map(bounds_of).collect()
    }

    /// Determines the unknowns at each sample.
    pub(crate) fn known(&self) -> Result<Vec<RecordingSamples>, RegressionError> {
        let RegressionProblem { system, recordings, half_width, steady, .. } = self.problem;
        let used = |i: usize| self.uses(i);
        if !(0..self.problem.noise.len()).any(used) {
            return Err(RegressionError::NothingMeasured);
        }
        let sensors = self.sensors();
        let mut all_known = Vec::with_capacity(recordings.len());
        for (r, recording) in recordings.iter().enumerate() {
            let mut known =
                RecordingSamples::new(*system, &self.p, r, recording, &sensors, *half_width)?;
            known.keep_steady(steady);
            all_known.push(known);
        }
        let counts = |known: &RecordingSamples| (0..known.times.len()).any(|k| known.counts(k));
        if !steady.is_empty() && !all_known.iter().any(counts) {
            return Err(self.nothing_steady(&all_known));
        }
        Ok(all_known)
    }

    fn nothing_steady(&self, known: &[RecordingSamples]) -> RegressionError {
        let unknowns = &self.problem.system.signature().unknowns;
        let unsteady = |(i, limit): &(usize, f64)| {
            let unit = unknowns.unit(*i);
            let slowest = known.iter().map(|known| known.slowest(*i)).fold(f64::INFINITY, f64::min);
            UnsteadyUnknown {
                unknown: unknowns.name(*i).to_string(),
                slowest: slowest / unit.factor.abs(),
                limit: limit / unit.factor.abs(),
                unit: unit.symbol.to_string(),
            }
        };
        RegressionError::NothingSteady {
            unknowns: self.problem.steady.iter().map(unsteady).collect(),
        }
    }

    /// The rows, some of which depend on each free parameter.
    pub(crate) fn rows<'b>(
        &'b self,
        known: &'b [RecordingSamples],
    ) -> Result<RegressionRows<'b>, RegressionError> {
        let RegressionProblem { system, recordings, .. } = self.problem;
        let kinds = RowKind::all(*system, &self.free, |i| self.uses(i) && self.is_prompt(i));
        let mut rows = RegressionRows::new(*system, recordings, known, kinds, &self.free);
        let mut count = vec![0; rows.kinds.len()];
        for (recording, of_recording) in known.iter().enumerate() {
            for sample in 0..of_recording.times.len() {
                for (kind, count) in count.iter_mut().enumerate() {
                    *count += usize::from(!rows.target(kind, recording, sample, &self.p).is_nan());
                }
            }
        }
        for (j, i) in self.free.iter().enumerate() {
            let has = |kind: &RowKind| kind.has_parameter(j);
            let kinds = || rows.kinds.iter().zip(&count).filter(|(kind, _)| has(kind));
            if kinds().any(|(_, count)| *count > 0) {
                continue;
            }
            let parameter = system.signature().parameters[*i].name.to_string();
            return Err(match kinds().next() {
                None => RegressionError::NotRead { parameter },
                Some((kind, _)) => self.not_reconstructed(parameter, kind, known),
            });
        }
        let n_rows: usize = count.iter().sum();
        if n_rows < self.free.len() {
            return Err(RegressionError::TooFewRows { rows: n_rows, free: self.free.len() });
        }
        // Kinds without a row would have no noise.
        let mut has_rows = count.iter().map(|count| *count > 0);
        let mut kinds = std::mem::take(&mut rows.kinds);
        kinds.retain(|_| has_rows.next().unwrap_or(false));
        Ok(RegressionRows::new(*system, recordings, known, kinds, &self.free))
    }

    /// Whether an output is used and was measured.
    fn uses(&self, i: usize) -> bool {
        let measured = |recording: &Recording| recording.counted(i).next().is_some();
        self.problem.noise[i].is_some() && self.problem.recordings.iter().any(measured)
    }

    /// Outputs and equations that determine the unknowns.
    fn sensors(&self) -> SensorEquations {
        let signature = self.problem.system.signature();
        let system = self.problem.system;
        let delaying = delaying(system, &self.free);
        let has_free = |by_u: &Pattern, by_p: &Pattern, row: usize| {
            by_p.positions().any(|(r, c)| r == row && self.free.contains(&c))
                || delayed_reads(system, by_u, row).iter().any(|(k, _)| !delaying[*k].is_empty())
        };
        let [_, by_u, by_p] = &signature.output_jacobians;
        let outputs = signature
            .outputs
            .iter()
            .enumerate()
            .filter(|(i, _)| self.uses(*i) && self.is_prompt(*i) && !has_free(by_u, by_p, *i));
        let noise = |(i, output): (usize, &Output)| match self.problem.noise[i] {
            Some(NoiseSource::Known(sigma)) => (i, sigma),
            _ => (i, output.noise.unwrap_or(output.unit.factor.abs())),
        };
        SensorEquations {
            outputs: outputs.map(noise).collect(),
            equations: (0..signature.unknowns.len())
                .filter(|i| !has_free(&signature.input_jacobian, &signature.parameter_jacobian, *i))
                .collect(),
            free: self.free.clone(),
        }
    }

    /// Whether an output is not delayed.
    fn is_prompt(&self, i: usize) -> bool {
        self.problem.system.signature().outputs[i].delay.is_none()
    }

    fn not_reconstructed(
        &self,
        parameter: String,
        kind: &RowKind,
        known: &[RecordingSamples],
    ) -> RegressionError {
        let signature = self.problem.system.signature();
        let is_known = |i: usize| {
            known.iter().any(|known| {
                (known.first..known.times.len()).any(|k| !known.point(k, &self.p).y[i].is_nan())
            })
        };
        let row = kind.name.clone();
        let moved = match kind.of {
            RowOf::Equation(i) if signature.unknowns.is_differential(i) => Some(i),
            RowOf::Equation(_) | RowOf::Output(_) => None,
        };
        let Some(unknown) = kind.reads.iter().copied().chain(moved).find(|i| !is_known(*i)) else {
            return RegressionError::TooFewRows { rows: 0, free: self.free.len() };
        };
        let [by_y, _, by_p] = &signature.output_jacobians;
        let taken = (0..signature.outputs.len()).filter(|w| self.uses(*w)).filter_map(|w| {
            by_y.positions().find(|place| *place == (w, unknown))?;
            let (_, p) = by_p.positions().find(|(r, c)| *r == w && self.free.contains(c))?;
            let output = signature.outputs[w].name.to_string();
            Some((output, signature.parameters[p].name.to_string()))
        });
        let taken = taken.collect();
        let unknown = signature.unknowns.name(unknown).to_string();
        RegressionError::NotReconstructed { parameter, row, unknown, taken }
    }

    fn verify_delays(&self) -> Result<(), RegressionError> {
        let system = self.problem.system;
        let signature = system.signature();
        if let (Some(delayed), Some(name)) =
            (signature.delayed_unknowns.first(), remembered(system))
        {
            let unknown = signature.unknowns.name(delayed.unknown).to_string();
            return Err(RegressionError::ModesAndPast { name, unknown });
        }
        let Some(recording) = self.problem.recordings.first() else { return Ok(()) };
        let problem =
            Problem { system: &system, p: &self.p, inputs: &recording.inputs, start: &[] };
        let dtau = delay_sensitivities(&problem);
        let n = signature.delays.len();
        let of_inputs = |delay: usize| {
            signature.delayed_inputs.iter().any(|delayed| delayed.delay == delay)
                || signature.outputs.iter().any(|output| output.delay == Some(delay))
        };
        for (k, slope) in dtau.iter().enumerate() {
            let (j, delay) = (k / n, k % n);
            if *slope != 0.0
                && of_inputs(delay)
                && let Direction::Parameter(i) = signature.directions[j]
                && self.free.contains(&i)
            {
                return Err(RegressionError::FreeDelay {
                    parameter: signature.parameters[i].name.to_string(),
                    delay: signature.delays[delay].to_string(),
                });
            }
        }
        Ok(())
    }
}

/// Parameters that do not enter linearly, each with a row that shows it.
pub(crate) fn not_linear(
    problem: &RegressionProblem<'_>,
    rows: &mut RegressionRows<'_>,
    linear: &[bool],
) -> RegressionError {
    let parameters = (0..linear.len())
        .filter(|j| !linear[*j])
        .map(|j| {
            let kind = structure::where_nonlinear(problem.system, rows, problem.p, j);
            let name = problem.system.signature().parameters[rows.free[j]].name.to_string();
            (name, rows.kinds[kind].name.clone())
        })
        .collect();
    RegressionError::NotLinear { parameters }
}
