//! A model's equations at single points, in declared units, for external solvers.

use dgd_compiler::pipeline::SensitivityDirections;
use dgd_execute::LoadedSystem;
use dgd_runtime::{
    EvaluationPoint, Inputs, IntegrateError, LimitSide, Pattern, Signature, System, Unit,
    consistent_start, discrete_numbers,
};

use crate::error::{ComputationError, UnusableFile, UsageError, WorkError};
use crate::model::load;
use crate::request::RunRequest;
use crate::run::ModelRun;
use crate::session::TaskContext;

/// The equations M ẏ = f(t, y, u(t), p) of a model and its outputs w(t, y, u(t), p), with recorded inputs, in the
/// initial modes.
///
/// | numbers | unit |
/// |---|---|
/// | t | s |
/// | y, u, p, w | as declared |
/// | row i of f, where Mᵢ is 1 | that of yᵢ over s |
/// | row i of f, where Mᵢ is 0 | SI |
#[derive(Debug)]
pub struct ModelEquations {
    system: LoadedSystem,
    /// SI.
    p: Vec<f64>,
    inputs: Inputs,
    times: Vec<f64>,
    /// Initial unknowns, SI, or the reason why they could not be computed.
    start: Result<Vec<f64>, IntegrateError>,
    z: Vec<f64>,
    mass: Vec<f64>,
}

/// A point, in declared units.
#[derive(Debug, Clone, Copy)]
pub struct EquationPoint<'a> {
    /// Time, s since the first sample of the data.
    pub t: f64,
    /// Unknowns.
    pub y: &'a [f64],
    /// Inputs; by default those of the data.
    pub u: Option<&'a [f64]>,
    /// All parameters; by default those of the model.
    pub p: Option<&'a [f64]>,
}

/// Numbers of a point, SI.
struct PointNumbers {
    t: f64,
    y: Vec<f64>,
    u: Vec<f64>,
    p: Vec<f64>,
}

/// Prepares the equations of a model; without data it has no inputs.
///
/// # Errors
///
/// [`WorkError`]: mistakes in model or data, or delayed equations, which are not functions of a single point.
pub fn equations(
    request: &RunRequest,
    session: TaskContext<'_>,
) -> Result<ModelEquations, WorkError> {
    let mut request = request.clone();
    if request.data.is_none() {
        // One row is enough.
        request.solve.until = request.solve.until.or(request.solve.from).or(Some(0.0));
    }
    let choices = request.choices.starting(&request.solve);
    let loaded = load(&request.model, &choices, &SensitivityDirections::None, session)?;
    let run = ModelRun::prepare(&request, loaded, session)?;
    let signature = run.signature();
    let is_late = !(signature.delayed_inputs.is_empty() && signature.delayed_unknowns.is_empty());
    if is_late || signature.outputs.iter().any(|output| output.delay.is_some()) {
        return Err(UsageError::ReadsPast(signature.name.to_string()).into());
    }
    let started = consistent_start(&run.problem(), run.times[0], &run.options);
    let (start, z) = match started {
        Ok(started) => (Ok(started.y), started.z),
        Err(error) => (Err(error), discrete_numbers(&run.system, &run.p, run.times[0])),
    };
    let ModelRun { system, p, inputs, times, .. } = run;
    let mut mass = vec![0.0; system.signature().unknowns.len()];
    let point = EvaluationPoint { t: times[0], y: &[], u: &[], p: &p, z: &z };
    system.mass(point, &mut mass);
    Ok(ModelEquations { system, p, inputs, times, start, z, mass })
}

impl ModelEquations {
    /// The signature of the model.
    pub fn signature(&self) -> &Signature {
        self.system.signature()
    }

    /// Times of the data, s since its first sample.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// The diagonal of M: 1 where an unknown is differential, 0 where it is algebraic.
    pub fn mass(&self) -> &[f64] {
        &self.mass
    }

    /// The parameters.
    pub fn parameters(&self) -> Vec<f64> {
        let values = self.signature().parameters.iter().zip(&self.p);
        values.map(|(parameter, p)| parameter.unit.from_si(*p)).collect()
    }

    /// Unknowns at the first time, consistent with the algebraic equations.
    ///
    /// # Errors
    ///
    /// [`WorkError::Computation`]: there are no consistent ones.
    pub fn start(&self) -> Result<Vec<f64>, WorkError> {
        let start = self.start.as_ref();
        let y = start.map_err(|error| ComputationError::Integration(error.clone()))?;
        let unit = |i: usize| self.signature().unknowns.unit(i);
        Ok(y.iter().enumerate().map(|(i, y)| unit(i).from_si(*y)).collect())
    }

    /// Inputs at a time.
    ///
    /// # Errors
    ///
    /// [`WorkError`]: the time is beyond the data.
    pub fn inputs(&self, t: f64) -> Result<Vec<f64>, WorkError> {
        let u = self.inputs_si(t)?;
        let declared = self.signature().inputs.iter();
        Ok(declared.zip(u).map(|(input, u)| input.unit.from_si(u)).collect())
    }

    /// f.
    ///
    /// # Errors
    ///
    /// Those of [`Self::inputs`], and [`WorkError::Usage`] if a list has the wrong length.
    pub fn rhs(&self, at: EquationPoint<'_>) -> Result<Vec<f64>, WorkError> {
        let numbers = self.numbers(at)?;
        let mut f = vec![0.0; numbers.y.len()];
        self.system.rhs(self.point(&numbers), &mut f);
        for (i, f) in f.iter_mut().enumerate() {
            *f /= self.factor_of_row(i);
        }
        Ok(f)
    }

    /// ∂f/∂y, row by row.
    ///
    /// # Errors
    ///
    /// Those of [`Self::rhs`].
    pub fn jacobian(&self, at: EquationPoint<'_>) -> Result<Vec<f64>, WorkError> {
        let numbers = self.numbers(at)?;
        let (signature, n) = (self.signature(), numbers.y.len());
        let (mut f, mut dfdt) = (vec![0.0; n], vec![0.0; n]);
        let mut values = vec![0.0; signature.jacobian.len()];
        let udot = vec![0.0; numbers.u.len()];
        self.system.linearize(self.point(&numbers), &udot, &mut f, &mut values, &mut dfdt);
        let factor = |j: usize| signature.unknowns.unit(j).factor;
        Ok(self.dense(&signature.jacobian, &values, n, factor))
    }

    /// ∂f/∂p, row by row.
    ///
    /// # Errors
    ///
    /// Those of [`Self::rhs`].
    pub fn parameter_jacobian(&self, at: EquationPoint<'_>) -> Result<Vec<f64>, WorkError> {
        let numbers = self.numbers(at)?;
        let signature = self.signature();
        let mut values = vec![0.0; signature.parameter_jacobian.len()];
        self.system.parameter_jacobian(self.point(&numbers), &mut values);
        let factor = |j: usize| signature.parameters[j].unit.factor;
        let columns = signature.parameters.len();
        Ok(self.dense(&signature.parameter_jacobian, &values, columns, factor))
    }

    /// w.
    ///
    /// # Errors
    ///
    /// Those of [`Self::rhs`].
    pub fn outputs(&self, at: EquationPoint<'_>) -> Result<Vec<f64>, WorkError> {
        let numbers = self.numbers(at)?;
        let outputs = &self.signature().outputs;
        let mut w = vec![0.0; outputs.len()];
        self.system.outputs(self.point(&numbers), &mut w);
        Ok(outputs.iter().zip(w).map(|(output, w)| output.unit.from_si(w)).collect())
    }

    fn point<'a>(&'a self, numbers: &'a PointNumbers) -> EvaluationPoint<'a> {
        let PointNumbers { t, y, u, p } = numbers;
        EvaluationPoint { t: *t, y, u, p, z: &self.z }
    }

    /// Number of SI units in the unit of a row of f.
    fn factor_of_row(&self, i: usize) -> f64 {
        if self.mass[i] == 0.0 { 1.0 } else { self.signature().unknowns.unit(i).factor }
    }

    /// A matrix of rows of f in declared units; `factor` gives the number of SI units in the unit of a column.
    fn dense(
        &self,
        pattern: &Pattern,
        values: &[f64],
        columns: usize,
        factor: impl Fn(usize) -> f64,
    ) -> Vec<f64> {
        let mut matrix = vec![0.0; self.mass.len() * columns];
        pattern.for_each(values, |i, j, value| {
            matrix[i * columns + j] = value * factor(j) / self.factor_of_row(i);
        });
        matrix
    }

    fn numbers(&self, at: EquationPoint<'_>) -> Result<PointNumbers, WorkError> {
        let signature = self.signature();
        let unknowns = (0..signature.unknowns.len()).map(|i| signature.unknowns.unit(i));
        let y = in_si("unknowns", at.y, unknowns)?;
        let u = match at.u {
            Some(u) => in_si("inputs", u, signature.inputs.iter().map(|input| &input.unit))?,
            None => self.inputs_si(at.t)?,
        };
        let p = match at.p {
            Some(p) => in_si("parameters", p, signature.parameters.iter().map(|p| &p.unit))?,
            None => self.p.clone(),
        };
        Ok(PointNumbers { t: at.t, y, u, p })
    }

    fn inputs_si(&self, t: f64) -> Result<Vec<f64>, WorkError> {
        self.inputs.cover(t, t).map_err(UnusableFile::Inputs)?;
        let mut u = vec![0.0; self.inputs.len()];
        self.inputs.value(t, LimitSide::Right, &mut u);
        Ok(u)
    }
}

/// Values in declared units as SI.
fn in_si<'a>(
    what: &'static str,
    values: &[f64],
    units: impl ExactSizeIterator<Item = &'a Unit>,
) -> Result<Vec<f64>, WorkError> {
    if values.len() != units.len() {
        let (given, needed) = (values.len(), units.len());
        return Err(UsageError::ValueCount { what, needed, given }.into());
    }
    let si = values.iter().zip(units).map(|(value, unit)| value * unit.factor + unit.offset);
    Ok(si.collect())
}

#[cfg(test)]
mod tests {
    use dgd_data::InMemory;

    use super::*;
    use crate::session::SilentReporter;

    const MODEL: &str = "\
model oven
input q [kW] hold
input T_a [degC] linear
parameter C [kJ/K] = 20 in 1 .. 100
parameter k [W/K] = 5 in 0 ..
state T [degC] = 30
state loss [W]
equation heat: C * der(T) = q - loss
equation wall: loss = k * (T - T_a) + 1e-3 [W/K^2] * (T - T_a)^2
output T_s [degF] = T
";

    fn oven() -> ModelEquations {
        let files = InMemory::default()
            .with_file("oven.dgd", MODEL)
            .with_file("run.csv", "time [min],q [kW],T_a [degC]\n0,1.5,20\n10,0,26\n");
        let mut request = RunRequest::new("oven.dgd");
        request.data = Some("run.csv".into());
        let session = TaskContext::new(&SilentReporter).with_files(&files);
        equations(&request, session).unwrap_or_else(|error| panic!("{error}"))
    }

    fn close(found: f64, expected: f64) {
        assert!((found - expected).abs() <= 1e-12 * expected.abs().max(1.0), "{found} {expected}");
    }

    #[test]
    fn equations_are_those_of_the_text_in_its_units() {
        let oven = oven();
        assert_eq!(oven.mass(), [1.0, 0.0]);
        assert_eq!(oven.times(), [0.0, 600.0]);
        let start = oven.start().unwrap_or_else(|error| panic!("{error}"));
        close(start[0], 30.0);
        close(start[1], 5.0 * 10.0 + 0.1);
        let inputs = oven.inputs(300.0).unwrap_or_else(|error| panic!("{error}"));
        close(inputs[0], 1.5);
        close(inputs[1], 23.0);
        let first = EquationPoint { t: 300.0, y: &[33.0, 40.0], u: None, p: None };
        let f = oven.rhs(first).unwrap_or_else(|error| panic!("{error}"));
        close(f[0], (1500.0 - 40.0) / 20e3);
        close(f[1].abs(), (5.0 * 10.0 + 0.1 - 40.0_f64).abs());
        let w = oven.outputs(first).unwrap_or_else(|error| panic!("{error}"));
        close(w[0], 33.0 * 1.8 + 32.0);
        let other = EquationPoint { u: Some(&[0.04, 23.0]), p: Some(&[10.0, 5.0]), ..first };
        close(oven.rhs(other).unwrap_or_else(|error| panic!("{error}"))[0], 0.0);
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let oven = oven();
        let y = [33.0, 40.0];
        let p = oven.parameters();
        let rhs = |y: &[f64], p: &[f64]| {
            let moved = EquationPoint { t: 300.0, y, u: None, p: Some(p) };
            oven.rhs(moved).unwrap_or_else(|error| panic!("{error}"))
        };
        let point = EquationPoint { t: 300.0, y: &y, u: None, p: Some(&p) };
        let of_y = oven.jacobian(point).unwrap_or_else(|error| panic!("{error}"));
        let of_p = oven.parameter_jacobian(point).unwrap_or_else(|error| panic!("{error}"));
        for j in 0..2 {
            let moved = |list: &[f64], h: f64| {
                let mut moved = list.to_vec();
                moved[j] += h;
                moved
            };
            let h = 1e-3;
            let (up, down) = (rhs(&moved(&y, h), &p), rhs(&moved(&y, -h), &p));
            let (more, less) = (rhs(&y, &moved(&p, h)), rhs(&y, &moved(&p, -h)));
            for i in 0..2 {
                let of_unknown = (up[i] - down[i]) / (2.0 * h);
                let of_parameter = (more[i] - less[i]) / (2.0 * h);
                for (exact, difference) in
                    [(of_y[i * 2 + j], of_unknown), (of_p[i * 2 + j], of_parameter)]
                {
                    let error = (exact - difference).abs();
                    assert!(error <= 1e-7 * exact.abs().max(1e-3), "{i} {j}: {exact} {difference}");
                }
            }
        }
        assert!(of_y.iter().any(|x| *x != 0.0) && of_p.iter().any(|x| *x != 0.0));
    }

    #[test]
    fn what_cannot_be_evaluated_is_refused() {
        let oven = oven();
        let late = oven.rhs(EquationPoint { t: 700.0, y: &[30.0, 0.0], u: None, p: None });
        assert!(matches!(late, Err(WorkError::Unusable(_))), "{late:?}");
        let short = oven.rhs(EquationPoint { t: 0.0, y: &[30.0], u: None, p: None });
        let message = short.expect_err("one number is missing").to_string();
        assert_eq!(message, "the model has 2 unknowns, and 1 are given");
        let text = "model m\nstate x [1] = 1\nequation e: der(x) = -delay(x, 1 [s]) / 1 [s]\n";
        let files = InMemory::default().with_file("m.dgd", text);
        let session = TaskContext::new(&SilentReporter).with_files(&files);
        let refused = equations(&RunRequest::new("m.dgd"), session).expect_err("it reads late");
        assert!(refused.to_string().contains("what was earlier"), "{refused}");
    }
}
