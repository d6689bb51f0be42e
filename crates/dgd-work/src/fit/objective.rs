//! Residuals of a fit as a function of its estimates, for external optimisers and samplers.

use dgd_execute::LoadedSystem;
use dgd_identify::{
    NoiseSource, OutputErrorProblem, Prior, Recording, Starts, TrialFailure, evaluate,
    outputs_with_sensitivities,
};
use dgd_runtime::parallel::in_parallel_by_model;
use dgd_runtime::{Direction, Observations, Options, Problem, System, Unit, consistent_start};

use super::task::FitSetup;
use crate::error::{ComputationError, UsageError, WorkError};
use crate::request::{Estimator, FitRequest};
use crate::run::{densities, recording};
use crate::session::TaskContext;

/// An estimated variable, in its declared unit.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ObjectiveVariable {
    /// A parameter's name, or `x(0)` for an initial value; with several recordings, `x(0) of RECORDING`.
    pub name: String,
    /// Its unit.
    pub unit: Unit,
    /// Initial guess.
    pub value: f64,
    /// Lower bound; minus infinity without one.
    pub lower: f64,
    /// Upper bound; infinity without one.
    pub upper: f64,
    /// Whether a search should use its logarithm.
    pub is_log: bool,
    direction: usize,
    of: Direction,
    recording: usize,
}

/// Residuals (simulated − measured)/σ of all samples, then (wᵀp − mean)/std of all priors, as a function of the
/// variables θ in declared units.
///
/// Half the sum of their squares is the negative logarithm of the posterior density, up to a constant. σ is the
/// declared noise.
#[derive(Debug)]
pub struct Objective {
    system: LoadedSystem,
    p: Vec<f64>,
    recordings: Vec<Recording>,
    names: Vec<String>,
    /// SI; `None` for outputs that are not compared.
    noise: Vec<Option<f64>>,
    priors: Vec<NormalPrior>,
    options: Options,
    threads: usize,
    variables: Vec<ObjectiveVariable>,
}

/// A prior that adds a residual, SI.
#[derive(Debug)]
struct NormalPrior {
    prior: Prior,
    mean: f64,
    std: f64,
}

impl NormalPrior {
    fn residual(&self, p: &[f64]) -> f64 {
        (self.prior.value(p) - self.mean) / self.std
    }

    /// The derivative of its residual.
    fn slope(&self, by: &ObjectiveVariable) -> f64 {
        match by.of {
            Direction::Parameter(i) => self.prior.weight(i) * by.unit.factor / self.std,
            Direction::Start(_) => 0.0,
        }
    }
}

/// Prepares the residuals of a fit. `noise` replaces declared standard deviations of outputs, in their units.
///
/// # Errors
///
/// [`WorkError`]: mistakes in model or data, nothing to estimate, or an output without noise.
pub fn objective(
    request: &FitRequest,
    noise: &[(String, f64)],
    session: TaskContext<'_>,
) -> Result<Objective, WorkError> {
    if request.regression.estimator != Estimator::OutputError {
        return Err(UsageError::ObjectiveNotSimulated.into());
    }
    let task = FitSetup::load(request, session)?;
    let problem = task.problem();
    // The objective may be evaluated after the caller's listener is gone.
    let options = Options { watched: None, ..problem.options };
    let priors = problem.priors;
    let noise = noise_of(&task, noise)?;
    let names = recording::names(&request.data);
    let FitSetup { system, p, train: recordings, .. } = task;
    let variables = variables(&system, &p, &recordings, &names, &options)?;
    if variables.is_empty() {
        return Err(UsageError::NothingToEstimate.into());
    }
    // Priors of parameters that are not estimated do not count.
    let is_free = |i| variables.iter().any(|v| v.of == Direction::Parameter(i));
    let mut normal = Vec::new();
    for prior in priors.into_iter().filter(|prior| prior.concerns(is_free)) {
        let Some((mean, std)) = prior.as_normal() else {
            let names = prior.names(system.signature());
            let density = prior.density.name();
            return Err(UsageError::PriorNotResidual { names, density }.into());
        };
        normal.push(NormalPrior { prior, mean, std });
    }
    let priors = normal;
    let threads = session.threads;
    Ok(Objective { system, p, recordings, names, noise, priors, options, threads, variables })
}

impl Objective {
    /// The variables θ.
    pub fn variables(&self) -> &[ObjectiveVariable] {
        &self.variables
    }

    /// Number of residuals.
    pub fn len(&self) -> usize {
        let counted = |recording: &Recording| {
            self.compared().map(|(i, _)| samples(recording, i).count()).sum::<usize>()
        };
        self.recordings.iter().map(counted).sum::<usize>() + self.priors.len()
    }

    /// Whether there are no residuals.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The residuals.
    ///
    /// # Errors
    ///
    /// [`WorkError::Computation`] if a recording cannot be simulated, [`WorkError::Usage`] if θ has the wrong length.
    pub fn residuals(&self, theta: &[f64]) -> Result<Vec<f64>, WorkError> {
        let (p, starts) = self.point(theta)?;
        let problem = OutputErrorProblem {
            options: self.options,
            threads: self.threads,
            ..OutputErrorProblem::new(self.system.as_model(), &self.p, &self.recordings)
        };
        let evaluated = evaluate(&problem, &p, &starts)
            .map_err(|failed| self.failed(failed.recording, &failed.reason))?;
        let mut residuals = Vec::with_capacity(self.len());
        for (recording, observations) in self.recordings.iter().zip(&evaluated.observations) {
            self.push_residuals(recording, observations, &mut residuals);
        }
        residuals.extend(self.priors.iter().map(|prior| prior.residual(&p)));
        Ok(residuals)
    }

    /// The residuals and their derivatives with respect to θ, row by row. Where the model is not differentiable,
    /// derivatives are 0, as in dgd's own fits.
    ///
    /// # Errors
    ///
    /// As [`Self::residuals`].
    pub fn linearised(&self, theta: &[f64]) -> Result<(Vec<f64>, Vec<f64>), WorkError> {
        let (p, starts) = self.point(theta)?;
        let Objective { system, recordings, options, threads, .. } = self;
        let computed =
            in_parallel_by_model(system.as_model(), recordings.len(), *threads, |system, r| {
                outputs_with_sensitivities(system, &recordings[r], &p, &starts[r], options)
            });
        let mut residuals = Vec::with_capacity(self.len());
        let mut rows = Vec::with_capacity(self.len() * self.variables.len());
        for (r, (recording, found)) in self.recordings.iter().zip(computed).enumerate() {
            let observations = found.map_err(|reason| self.failed(r, &reason))?;
            self.push_residuals(recording, &observations, &mut residuals);
            self.push_rows(r, &observations, &mut rows);
        }
        for prior in &self.priors {
            residuals.push(prior.residual(&p));
            rows.extend(self.variables.iter().map(|variable| prior.slope(variable)));
        }
        Ok((residuals, rows))
    }

    /// Compared outputs, with σ.
    fn compared(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.noise.iter().enumerate().filter_map(|(i, sigma)| Some((i, (*sigma)?)))
    }

    fn push_residuals(&self, recording: &Recording, found: &Observations, all: &mut Vec<f64>) {
        for (i, sigma) in self.compared() {
            let residual = |(k, measured): (usize, f64)| (found.w(k)[i] - measured) / sigma;
            all.extend(samples(recording, i).map(residual));
        }
    }

    fn push_rows(&self, r: usize, found: &Observations, rows: &mut Vec<f64>) {
        for (i, sigma) in self.compared() {
            for (k, _) in samples(&self.recordings[r], i) {
                rows.extend(self.variables.iter().map(|variable| {
                    let is_other =
                        matches!(variable.of, Direction::Start(_)) && variable.recording != r;
                    let slope = found.dw(k)[variable.direction * found.n_w + i];
                    let is_used = !is_other && slope.is_finite();
                    if is_used { slope * variable.unit.factor / sigma } else { 0.0 }
                }));
            }
        }
    }

    /// Parameters and initial values of each recording, SI.
    fn point(&self, theta: &[f64]) -> Result<(Vec<f64>, Vec<Starts>), WorkError> {
        let (given, needed) = (theta.len(), self.variables.len());
        if given != needed {
            return Err(UsageError::VariableCount { needed, given }.into());
        }
        let mut p = self.p.clone();
        let mut starts: Vec<Starts> = self.recordings.iter().map(|r| r.start.clone()).collect();
        for (variable, value) in self.variables.iter().zip(theta) {
            let si = value * variable.unit.factor + variable.unit.offset;
            match variable.of {
                Direction::Parameter(i) => p[i] = si,
                Direction::Start(i) => {
                    let values = &mut starts[variable.recording];
                    values.retain(|(unknown, _)| *unknown != i);
                    values.push((i, si));
                }
            }
        }
        Ok((p, starts))
    }

    fn failed(&self, recording: usize, reason: &TrialFailure) -> WorkError {
        let name = self.names.get(recording).cloned().unwrap_or_default();
        ComputationError::Recording { name, reason: reason.clone() }.into()
    }
}

/// Samples of an output: position and value.
fn samples(recording: &Recording, output: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
    let values = recording.measured[output].as_deref().unwrap_or_default();
    values.iter().copied().enumerate().filter(|(_, value)| value.is_finite())
}

/// σ of each compared output, SI.
fn noise_of(task: &FitSetup<'_>, given: &[(String, f64)]) -> Result<Vec<Option<f64>>, WorkError> {
    let outputs = &task.system.signature().outputs;
    let names: Vec<&str> = outputs.iter().map(|output| &*output.name).collect();
    for (name, sigma) in given {
        if !names.contains(&name.as_str()) {
            let known = names.iter().map(|&name| name.to_owned()).collect();
            let (name, kind) = (name.clone(), "output");
            return Err(UsageError::Unknown { given: None, kind, name, known }.into());
        }
        if !(sigma.is_finite() && *sigma > 0.0) {
            let output = name.clone();
            return Err(UsageError::NoiseNotPositive { output, sigma: *sigma }.into());
        }
    }
    if outputs.iter().zip(&task.noise).any(|(_, used)| used.is_some_and(NoiseSource::is_likelihood))
    {
        densities::refuse(task.system.signature(), "the objective of a fit")?;
        return Err(UsageError::ObjectiveWithDeviations.into());
    }
    let mut without = Vec::new();
    let sigma = outputs.iter().zip(&task.noise).map(|(output, used)| {
        used.as_ref()?;
        let override_noise = given.iter().rev().find(|(name, _)| *name == output.name);
        let sigma =
            override_noise.map(|(_, sigma)| sigma * output.unit.factor.abs()).or(output.noise);
        if sigma.is_none() {
            without.push(output.name.to_string());
        }
        sigma
    });
    let sigma: Vec<Option<f64>> = sigma.collect();
    if !without.is_empty() {
        return Err(UsageError::ResidualsWithoutNoise(without).into());
    }
    Ok(sigma)
}

/// All free parameters, then the initial values of each recording.
fn variables(
    system: &LoadedSystem,
    p: &[f64],
    recordings: &[Recording],
    names: &[String],
    options: &Options,
) -> Result<Vec<ObjectiveVariable>, WorkError> {
    let signature = system.signature();
    let directions = || signature.directions.iter().copied().enumerate();
    let mut variables = Vec::new();
    for (direction, of) in directions() {
        let Direction::Parameter(i) = of else { continue };
        let parameter = &signature.parameters[i];
        let declared = |si: f64| parameter.unit.from_si(si);
        variables.push(ObjectiveVariable {
            name: parameter.name.to_string(),
            unit: parameter.unit.clone(),
            value: declared(p[i].clamp(parameter.lower, parameter.upper)),
            lower: declared(parameter.lower),
            upper: declared(parameter.upper),
            is_log: parameter.log,
            direction,
            of,
            recording: 0,
        });
    }
    for (r, recording) in recordings.iter().enumerate() {
        let Recording { inputs, start, times, .. } = recording;
        let problem = Problem { system, p, inputs, start };
        let first = times.first().copied().unwrap_or(0.0);
        let started = consistent_start(&problem, first, options).map_err(|error| {
            ComputationError::Recording {
                name: names[r].clone(),
                reason: TrialFailure::Simulation(error),
            }
        })?;
        for (direction, of) in directions() {
            let Direction::Start(i) = of else { continue };
            let unit = signature.unknowns.unit(i);
            let name = signature.direction_name(direction);
            variables.push(ObjectiveVariable {
                name: match recordings.len() {
                    1 => name.into_owned(),
                    _ => format!("{name} of {}", names[r]),
                },
                unit: unit.clone(),
                value: unit.from_si(started.y[i]),
                lower: f64::NEG_INFINITY,
                upper: f64::INFINITY,
                is_log: false,
                direction,
                of,
                recording: r,
            });
        }
    }
    Ok(variables)
}

#[cfg(test)]
mod tests {
    use dgd_data::InMemory;

    use super::*;
    use crate::request::NoiseFrom;
    use crate::session::SilentReporter;
    use crate::{RunRequest, SimulateRequest, fit, simulate};

    const MODEL: &str = "\
model tank
input q_in [lpm] hold
parameter A [m^2] = 2 in 0.1 .. 10
parameter k [lpm] = 330 in 0 .., prior normal(300, 20)
state h [m] = 1
equation level: A * der(h) = q_in - k * sqrt(max(h, 0) / 1 [m])
output h [cm] noise 1 [mm]
output flow [lpm] = k * sqrt(max(h, 0) / 1 [m])
";

    fn files() -> InMemory {
        let inputs = |phase: usize| {
            let rows =
                (0..60).map(|k| format!("{},{}\n", 40 * k, [300, 420, 180][(k / 9 + phase) % 3]));
            rows.fold("time [s],q_in [lpm]\n".to_owned(), |all, row| all + &row)
        };
        let mut files = InMemory::default().with_file("tank.dgd", MODEL).with_file(
            "truth.dgd",
            MODEL.replace("= 330", "= 290").replace("A [m^2] = 2", "A [m^2] = 2.2"),
        );
        for (name, phase) in [("monday", 0), ("tuesday", 1)] {
            let inputs = files.clone().with_file("inputs.csv", inputs(phase));
            let mut run = RunRequest::new("truth.dgd");
            run.data = Some("inputs.csv".into());
            let mut request = SimulateRequest::new(run);
            request.noise_seed = Some(phase as u64);
            let session = TaskContext::new(&SilentReporter).with_files(&inputs);
            let simulated = simulate(&request, session).unwrap_or_else(|error| panic!("{error}"));
            let mut csv = Vec::new();
            simulated.table.write_csv(&mut csv).expect("memory can be written to");
            files = files.with_file(format!("{name}.csv"), csv);
        }
        files
    }

    fn request() -> FitRequest {
        let mut request =
            FitRequest::new("tank.dgd", vec!["monday.csv".into(), "tuesday.csv".into()]);
        request.outputs = vec!["h".to_owned()];
        request.noise = NoiseFrom::Declared;
        request
    }

    #[test]
    fn derivatives_of_residuals_are_those_of_differences() {
        let files = files();
        let session = TaskContext::new(&SilentReporter).with_files(&files);
        let mut request = request();
        request.solve.rtol = 1e-10;
        let objective = objective(&request, &[], session).unwrap_or_else(|error| panic!("{error}"));
        let names: Vec<&str> = objective.variables().iter().map(|v| v.name.as_str()).collect();
        assert_eq!(names, ["A", "k", "h(0) of monday.csv", "h(0) of tuesday.csv"]);
        assert_eq!(objective.variables()[2].value, 1.0);
        let theta: Vec<f64> = objective.variables().iter().map(|v| 1.01 * v.value).collect();
        let (residuals, rows) = objective.linearised(&theta).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(residuals.len(), objective.len());
        assert_eq!(objective.len(), 2 * 60 + 1);
        let residuals_at =
            |theta: &[f64]| objective.residuals(theta).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(residuals.len(), residuals_at(&theta).len());
        for j in 0..theta.len() {
            let moved = |h: f64| {
                let mut moved = theta.clone();
                moved[j] += h * theta[j];
                residuals_at(&moved)
            };
            let h = 1e-5;
            let (up, down) = (moved(h), moved(-h));
            let slope = |k: usize| rows[k * theta.len() + j] * theta[j];
            let size = (0..residuals.len()).map(|k| slope(k).abs()).fold(0.0, f64::max);
            assert!(size > 0.0);
            for k in 0..residuals.len() {
                let error = (slope(k) - (up[k] - down[k]) / (2.0 * h)).abs();
                assert!(error <= 1e-5 * size, "{k} {j}: {error} of {size}");
            }
        }
    }

    #[test]
    fn what_a_smooth_table_says_is_one_residual_for_each_inner_point() {
        let model = "model curve\ninput x [m] linear\nparameter y[1..3] [g] = (1, 2, 4)\n\
                     table f(x [m]) [g] at (0, 10, 30) = y  linear, smooth 0.5\n\
                     output w [g] = f(x) noise 0.1\n";
        // Data after the second point is not read.
        let data = "time [s],x [m],w [g]\n0,0,1\n1,5,1.5\n2,10,2\n";
        let files = InMemory::default().with_file("curve.dgd", model).with_file("data.csv", data);
        let session = TaskContext::new(&SilentReporter).with_files(&files);
        let mut request = FitRequest::new("curve.dgd", vec!["data.csv".into()]);
        request.noise = NoiseFrom::Declared;
        let objective = objective(&request, &[], session).unwrap_or_else(|error| panic!("{error}"));
        let (residuals, rows) =
            objective.linearised(&[1.0, 2.0, 4.0]).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(
            residuals,
            objective.residuals(&[1.0, 2.0, 4.0]).unwrap_or_else(|e| panic!("{e}"))
        );
        assert_eq!((residuals.len(), rows.len()), (4, 12));
        // 2 g on a line at 1 g + (4 g - 1 g)/3.
        assert!(residuals[3].abs() < 1e-12, "{residuals:?}");
        for (slope, wanted) in rows[9..].iter().zip([-2.0 / 3.0, 1.0, -1.0 / 3.0]) {
            assert!((slope - wanted / 0.5).abs() < 1e-12, "{rows:?}");
        }
        let fitted = fit(&request, session).unwrap_or_else(|error| panic!("{error}"));
        let result = fitted.result();
        let details = result.simulation.as_ref().expect("a fit by simulation");
        assert_eq!(details.degrees_of_freedom, 3 + 1 - 3);
        assert!(result.cost.expect("a fit has a cost") < 1e-9, "{result:?}");
    }

    #[test]
    fn with_every_estimator_a_smooth_table_goes_on_straight_where_nothing_is_read() {
        let model = "model curve\nparameter y[1..4] [g] = (1, 2, 4, 5)\nstate x [m] = 0 fixed\n\
                     table f(x [m]) [g] at (0, 10, 30, 40) = y  linear, beyond extend, smooth 0.5\n\
                     equation e: der(x) = 1 [m/s]\noutput x [m] noise 0.01\n\
                     output w [g] = f(x) noise 0.1\n";
        let row =
            |k: i32| format!("{k},{k},{}\n", 1.0 + 0.1 * f64::from(k) + 0.05 * f64::from(k % 3));
        let data =
            (0..=20).map(row).fold("time [s],x [m],w [g]\n".to_owned(), |all, row| all + &row);
        let files = InMemory::default().with_file("curve.dgd", model).with_file("data.csv", data);
        let session = TaskContext::new(&SilentReporter).with_files(&files);
        for estimator in [
            Estimator::OutputError,
            Estimator::PredictionError,
            Estimator::LeastSquares,
            Estimator::Bounded,
            Estimator::Separable,
            Estimator::NelderMead,
        ] {
            let mut request = FitRequest::new("curve.dgd", vec!["data.csv".into()]);
            request.noise = NoiseFrom::Declared;
            request.regression.estimator = estimator;
            let fitted =
                fit(&request, session).unwrap_or_else(|error| panic!("{estimator:?}: {error}"));
            let value = |name: &str| {
                let mut estimates = fitted.estimates.iter();
                estimates.find(|estimate| estimate.name == name).map_or(f64::NAN, |e| 1e3 * e.value)
            };
            let [second, third, fourth] = ["y[2]", "y[3]", "y[4]"].map(value);
            let straight = third + (third - second) / 2.0;
            assert!(
                (fourth - straight).abs() < 1e-4,
                "{estimator:?}: {fourth}, and not {straight}"
            );
            assert!((value("y[1]") - 1.05).abs() < 0.05, "{estimator:?}: {}", value("y[1]"));
            assert!(fitted.estimates.iter().all(|e| e.std.is_some()), "{estimator:?}");
        }
    }

    #[test]
    fn it_is_flat_where_a_fit_ends_and_has_its_cost() {
        let files = files();
        let session = TaskContext::new(&SilentReporter).with_files(&files);
        let request = request();
        let fitted = fit(&request, session).unwrap_or_else(|error| panic!("{error}"));
        let objective = objective(&request, &[], session).unwrap_or_else(|error| panic!("{error}"));
        let theta: Vec<f64> = (fitted.estimates.iter().zip(objective.variables()))
            .map(|(estimate, variable)| variable.unit.from_si(estimate.value))
            .collect();
        let (residuals, rows) = objective.linearised(&theta).unwrap_or_else(|e| panic!("{e}"));
        let cost: f64 = residuals.iter().map(|r| r * r).sum();
        let of_fit = fitted.result().cost.expect("a fit has a cost");
        assert!((cost - of_fit).abs() <= 1e-4 * of_fit, "{cost} {of_fit}");
        // Within one standard deviation of a variable the change is far below 1.
        let n = theta.len();
        for j in 0..n {
            let column = || (0..residuals.len()).map(|k| rows[k * n + j]);
            let gradient: f64 = column().zip(&residuals).map(|(slope, r)| slope * r).sum();
            let curvature: f64 = column().map(|slope| slope * slope).sum();
            assert!((gradient / curvature.sqrt()).abs() < 0.05, "{j}: {gradient} {curvature}");
        }
    }

    #[test]
    fn an_output_without_noise_is_told_and_given_one() {
        let files = files();
        let session = TaskContext::new(&SilentReporter).with_files(&files);
        let mut request = request();
        request.outputs.clear();
        let refused = objective(&request, &[], session).expect_err("`flow` declares no noise");
        assert!(refused.to_string().starts_with("`flow` declares no noise"), "{refused}");
        let noise = [("flow".to_owned(), 0.5)];
        let objective_of_all =
            objective(&request, &noise, session).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(objective_of_all.len(), 4 * 60 + 1);
        let none =
            objective(&request, &[("flaw".to_owned(), 1.0)], session).expect_err("no output");
        assert!(none.to_string().contains("did you mean `flow`"), "{none}");
        let short = objective_of_all.residuals(&[1.0]).expect_err("too few values");
        assert_eq!(short.to_string(), "there are 4 variables, and 1 values are given");
    }
}
