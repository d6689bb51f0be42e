//! The scale in which the noise of an output is even.
//!
//! ```text
//!   σ(y) = c √(a² + y²):   T(y) = g ln((y + √(a² + y²))/a),   g = √(a² + m²):   the noise of T(y) is c g throughout
//!   readings with σ_k, and recordings with a level l_r:   T(y) r,   r = σ̄/(σ_k l_r)
//! ```
//!
//! A search compares T(y) r of the readings with that of the model, so that an output has one standard deviation from
//! there on. m is the usual size of the readings, where T has the slope 1 and keeps the unit. r is a further input of
//! the model that only its output reads. For log-normal and for proportional noise, a is far below the smallest
//! reading: T is then g times the logarithm, and finite where a simulation begins at zero.
//!
//! Source of T: Bartlett, The use of transformations, Biometrics 3 (1947) 39–52.

use std::collections::BTreeSet;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::expr::intrinsics::IntrinsicId;
use dgd_compiler::expr::{ExprGraph, ExprId, Symbol};
use dgd_compiler::model::{DeclarationHeader, Density, Input, Interpolation, Model, resolve};
use dgd_compiler::source::Span;
use dgd_compiler::units::Unit;
use dgd_identify::{NoiseShape, OutputErrorProblem, Recording, evaluate};
use dgd_runtime::signature::Distribution;
use dgd_runtime::{InputError, Inputs, LimitSide, Observations, System};

use super::further_inputs::with_further_inputs;
use super::structure::BaseModel;
use super::structure_id::StructureId;

/// Largest a relative to the smallest reading where noise is proportional: T differs from a logarithm by a hundredth of
/// a per cent.
const FAR_BELOW: f64 = 0.01;

/// The scales of a model's outputs; outputs without a scale stay as they are.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OutputScales {
    outputs: Vec<OutputScale>,
    /// Number of outputs, and of those that compute standard deviations, which are left out.
    count: usize,
    deviations: usize,
    /// Parameters that only noise reads.
    pub(crate) of_noise: Vec<String>,
}

/// The scale of an output.
#[derive(Debug, Clone, PartialEq)]
struct OutputScale {
    output: usize,
    name: String,
    stretch: Option<ScaleStretch>,
    weight: Option<ReadingWeights>,
}

/// The weights of its readings, in addition to T.
#[derive(Debug, Clone, PartialEq)]
struct ReadingWeights {
    /// σ̄, if readings have standard deviations of their own.
    usual: Option<f64>,
    /// l of each recording, training recordings first.
    levels: Vec<f64>,
}

/// T of the module.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ScaleStretch {
    floor: f64,
    slope: f64,
    /// −1 where all readings are below zero.
    sign: f64,
}

impl ScaleStretch {
    fn new(floor: f64, readings: &[f64]) -> Self {
        let squares: f64 = readings.iter().map(|y| y * y).sum();
        let usual = squares / readings.len().max(1) as f64;
        let sign = if readings.iter().all(|y| *y < 0.0) { -1.0 } else { 1.0 };
        Self { floor, slope: (floor * floor + usual).sqrt(), sign }
    }

    fn compute(self, y: f64) -> f64 {
        let y = self.sign * y;
        self.sign * self.slope * ((y + (y * y + self.floor * self.floor).sqrt()) / self.floor).ln()
    }

    fn inverse(self, scaled: f64) -> f64 {
        self.floor * (scaled / self.slope).sinh()
    }

    fn expression(self, graph: &mut ExprGraph, y: ExprId) -> ExprId {
        let [floor, square, slope, sign] =
            [self.floor, self.floor * self.floor, self.sign * self.slope, self.sign]
                .map(|value| graph.constant(value));
        let y = graph.multiply(sign, y);
        let squares = graph.multiply(y, y);
        let sum = graph.add(squares, square);
        let root = call(graph, "sqrt", sum);
        let sum = graph.add(y, root);
        let ratio = graph.divide(sum, floor);
        let log = call(graph, "log", ratio);
        graph.multiply(slope, log)
    }
}

fn call(graph: &mut ExprGraph, name: &str, of: ExprId) -> ExprId {
    let function = IntrinsicId::find(name).expect("a function of the language");
    graph.call(function, &[of])
}

/// Whether an input is a weight r of the module: no user can declare its name.
pub(crate) fn is_weight(input: &str) -> bool {
    input.starts_with("weight(")
}

impl OutputScales {
    /// The scales in which readings of a model have even noise, from the noise that its outputs declare and from
    /// recorded standard deviations. `levels` are those of each recording and output, if they differ.
    ///
    /// # Errors
    ///
    /// A reading that cannot have the declared noise, or a noise that cannot be computed, in a sentence.
    pub(crate) fn new(
        base: &BaseModel,
        train: &[Recording],
        valid: &[Recording],
        levels: Option<&[Vec<f64>]>,
    ) -> Result<Self, String> {
        let Ok(model) = resolve(&base.asts, &base.options, &mut Diagnostics::default()) else {
            return Ok(Self::default());
        };
        let count = model.outputs.len() - model.densities.len();
        let recordings: Vec<&Recording> = train.iter().chain(valid).collect();
        let spread = NoiseGrowth::new(base, &model, train)?;
        let mut outputs = Vec::new();
        for (output, declared) in model.outputs[..count].iter().enumerate() {
            let name = &declared.declared.name;
            let stretch = spread.stretch(output, name, &recordings)?;
            let usual = usual_deviation(output, name, &recordings)?.filter(|_| stretch.is_none());
            let levels: Vec<f64> = levels.map_or(Vec::new(), |levels| {
                levels.iter().map(|of_recording| of_recording[output]).collect()
            });
            let is_even = usual.is_none() && levels.iter().all(|level| *level == 1.0);
            let weight = (!is_even).then_some(ReadingWeights { usual, levels });
            if stretch.is_some() || weight.is_some() {
                outputs.push(OutputScale { output, name: name.clone(), stretch, weight });
            }
        }
        let of_noise = only_of_noise(&model, count);
        Ok(Self { outputs, count, deviations: model.densities.len(), of_noise })
    }

    /// Outputs whose noise grows with them or differs between readings or recordings.
    pub(crate) fn uneven(&self) -> Vec<String> {
        self.outputs.iter().map(|scale| scale.name.clone()).collect()
    }

    /// A model without outputs that compute standard deviations.
    pub(crate) fn without_deviations(&self, mut model: Model) -> Model {
        if self.deviations > 0 {
            model.densities.clear();
            model.outputs.truncate(self.count);
        }
        model
    }

    /// The model without these outputs and with the weights among its inputs, which nothing reads yet.
    pub(crate) fn declared(&self, model: Model) -> Model {
        let mut model = self.without_deviations(model);
        for scale in self.outputs.iter().filter(|scale| scale.weight.is_some()) {
            model.inputs.push(Input {
                declared: DeclarationHeader {
                    name: format!("weight({})", scale.name),
                    span: Span::default(),
                    unit: Unit::one(),
                    doc: Vec::new(),
                },
                interpolation: Interpolation::Linear,
            });
        }
        model
    }

    /// A model [with weights](Self::declared), whose outputs are in these scales.
    pub(crate) fn applied(&self, mut model: Model) -> Model {
        for scale in &self.outputs {
            let Some(output) = model.outputs.get(scale.output) else { continue };
            let mut value = output.value;
            if let Some(stretch) = scale.stretch {
                value = stretch.expression(&mut model.graph, value);
            }
            let name = format!("weight({})", scale.name);
            let weight = model.inputs.iter().position(|input| input.declared.name == name);
            if let Some(weight) = weight.and_then(|at| u32::try_from(at).ok()) {
                let weight = model.graph.symbol(Symbol::Input(weight));
                value = model.graph.multiply(value, weight);
            }
            model.outputs[scale.output].value = value;
        }
        model
    }

    /// A recording in these scales; `position` is its place among all, training recordings first.
    fn recording(&self, recording: &Recording, position: usize) -> Result<Recording, InputError> {
        let mut scaled = recording.clone();
        scaled.measured.drain(self.count..self.count + self.deviations);
        scaled.deviations.clear();
        let mut columns = Vec::new();
        for scale in &self.outputs {
            let weights = scale.weight.as_ref().map(|weight| {
                weight.compute(
                    recording.deviations_of(scale.output),
                    position,
                    recording.times.len(),
                )
            });
            for (k, y) in scaled.measured[scale.output].iter_mut().flatten().enumerate() {
                let stretched = scale.stretch.map_or(*y, |stretch| stretch.compute(*y));
                *y = stretched * weights.as_ref().map_or(1.0, |weights| weights[k]);
            }
            columns.extend(weights);
        }
        scaled.inputs = append_inputs(&recording.inputs, &recording.times, &columns)?;
        Ok(scaled)
    }

    /// Training and validation recordings in these scales; `None` if they stay as they are.
    pub(crate) fn recordings(
        &self,
        train: &[Recording],
        valid: &[Recording],
    ) -> Result<Option<[Vec<Recording>; 2]>, InputError> {
        if self.outputs.is_empty() && self.deviations == 0 {
            return Ok(None);
        }
        let scaled = |some: &[Recording], first: usize| -> Result<Vec<Recording>, InputError> {
            let numbered = some.iter().enumerate();
            numbered.map(|(r, recording)| self.recording(recording, first + r)).collect()
        };
        Ok(Some([scaled(train, 0)?, scaled(valid, train.len())?]))
    }

    /// A value of an output in its unit, from that in its scale at a time of a recording [in these
    /// scales](Self::recording).
    pub(crate) fn unscaled(&self, output: usize, inputs: &Inputs, t: f64, value: f64) -> f64 {
        let Some(scale) = self.outputs.iter().find(|scale| scale.output == output) else {
            return value;
        };
        let mut value = value;
        if scale.weight.is_some() {
            let weighted = self.outputs.iter().filter(|scale| scale.weight.is_some());
            let behind = weighted.clone().filter(|other| other.output >= output).count();
            let mut u = vec![0.0; inputs.len()];
            inputs.value(t, LimitSide::Right, &mut u);
            value /= u[inputs.len() - behind];
        }
        scale.stretch.map_or(value, |stretch| stretch.inverse(value))
    }

    /// Readings of an output of a recording in these scales, in its unit.
    pub(crate) fn readings(&self, output: usize, recording: &Recording) -> Option<Vec<f64>> {
        let measured = recording.measured[output].as_ref()?;
        let readings = recording.times.iter().zip(measured);
        Some(readings.map(|(t, y)| self.unscaled(output, &recording.inputs, *t, *y)).collect())
    }
}

impl ReadingWeights {
    fn compute(&self, deviations: Option<&[f64]>, position: usize, samples: usize) -> Vec<f64> {
        let level = self.levels.get(position).copied().unwrap_or(1.0);
        let weight = |k: usize| match (self.usual, deviations) {
            (Some(usual), Some(all)) if all[k].is_finite() && all[k] > 0.0 => usual / all[k],
            _ => 1.0,
        };
        (0..samples).map(|k| weight(k) / level).collect()
    }
}

/// How the noise that a model declares grows with its outputs.
struct NoiseGrowth<'m> {
    model: &'m Model,
    /// Outputs at each sample of the recordings, if a σ is computed from them.
    simulated: Vec<Observations>,
    failure: Option<String>,
}

impl<'m> NoiseGrowth<'m> {
    fn new(base: &BaseModel, model: &'m Model, train: &[Recording]) -> Result<Self, String> {
        let is_computed = |density: &Density| {
            density.distribution != Distribution::LogNormal
                && model.graph.value(model.outputs[density.deviation].value).is_none()
        };
        let mut spread = NoiseGrowth { model, simulated: Vec::new(), failure: None };
        if !model.densities.iter().any(is_computed) {
            return Ok(spread);
        }
        let structure =
            base.structure(&[], StructureId::BASE).map_err(|refused| refused.to_string())?;
        let parameters = structure.system.signature().parameters.iter();
        let p: Vec<f64> = parameters.map(|parameter| parameter.value).collect();
        let starts: Vec<_> = train.iter().map(|recording| recording.start.clone()).collect();
        let problem = OutputErrorProblem::new(structure.system.as_model(), &p, train);
        match evaluate(&problem, &p, &starts) {
            Ok(found) => spread.simulated = found.observations,
            Err(error) => spread.failure = Some(error.to_string()),
        }
        Ok(spread)
    }

    /// T of an output; `None` where its noise is even.
    fn stretch(
        &self,
        output: usize,
        name: &str,
        all: &[&Recording],
    ) -> Result<Option<ScaleStretch>, String> {
        let Some(density) = self.model.densities.iter().find(|density| density.output == output)
        else {
            return Ok(None);
        };
        let readings: Vec<f64> = all.iter().flat_map(|recording| read(recording, output)).collect();
        let smallest = readings.iter().map(|y| y.abs()).fold(f64::INFINITY, f64::min);
        if readings.is_empty() {
            return Ok(None);
        }
        if density.distribution == Distribution::LogNormal {
            if let Some(y) = readings.iter().find(|y| **y <= 0.0) {
                return Err(format!(
                    "a reading of `{name}` is {y} in SI units, and readings with log-normal noise are above zero"
                ));
            }
            return Ok(Some(ScaleStretch::new(FAR_BELOW * smallest, &readings)));
        }
        if let Some(why) = &self.failure {
            return Err(format!("the noise of `{name}` cannot be computed: {why}"));
        }
        let samples = all.iter().zip(&self.simulated).flat_map(|(recording, observations)| {
            (0..recording.times.len()).map(|k| observations.w(k))
        });
        let pairs: Vec<(f64, f64)> = samples.map(|w| (w[output], w[density.deviation])).collect();
        let grows = NoiseShape::fit(&pairs, &readings);
        Ok(grows.map(|shape| {
            let floor = shape.bend().max(FAR_BELOW * smallest);
            ScaleStretch::new(floor, &readings)
        }))
    }
}

/// The finite readings of an output.
fn read(recording: &Recording, output: usize) -> impl Iterator<Item = f64> + '_ {
    let measured = recording.measured[output].iter().flatten();
    measured.copied().filter(|y| y.is_finite())
}

/// The geometric mean of the recorded standard deviations of an output; `None` without any, or if they are all alike.
fn usual_deviation(output: usize, name: &str, all: &[&Recording]) -> Result<Option<f64>, String> {
    let measuring = || all.iter().filter(|recording| recording.measured[output].is_some());
    if measuring().all(|recording| recording.deviations_of(output).is_none()) {
        return Ok(None);
    }
    let mut logarithms = Vec::new();
    for recording in measuring() {
        let Some(deviations) = recording.deviations_of(output) else {
            return Err(format!(
                "a recording has no column `std({name})`, which others have: give it to all or none"
            ));
        };
        let measured = recording.measured[output].iter().flatten();
        for ((t, y), sigma) in recording.times.iter().zip(measured).zip(deviations) {
            if y.is_finite() && !(*sigma > 0.0 && sigma.is_finite()) {
                return Err(format!(
                    "`std({name})` is {sigma} at {t} s: a standard deviation is above zero"
                ));
            }
            logarithms.extend(y.is_finite().then(|| sigma.ln()));
        }
    }
    let is_even = logarithms.windows(2).all(|pair| pair[0] == pair[1]);
    let mean = logarithms.iter().sum::<f64>() / logarithms.len().max(1) as f64;
    Ok((!is_even).then(|| mean.exp()))
}

/// Parameters that only standard deviations read.
fn only_of_noise(model: &Model, count: usize) -> Vec<String> {
    let equations = model.all_equations().chain(&model.start_equations);
    let others = equations.flat_map(|equation| [equation.left, equation.right]);
    let others = others.chain(model.outputs[..count].iter().map(|output| output.value));
    let symbols_in = |roots: &mut dyn Iterator<Item = ExprId>| -> BTreeSet<Symbol> {
        roots.flat_map(|root| model.graph.symbols(root)).collect()
    };
    let read = symbols_in(&mut others.into_iter());
    let of_noise = symbols_in(&mut model.outputs[count..].iter().map(|output| output.value));
    let is_only_there = |i: usize| {
        u32::try_from(i).is_ok_and(|i| {
            let symbol = Symbol::Parameter(i);
            of_noise.contains(&symbol) && !read.contains(&symbol)
        })
    };
    let parameters = model.parameters.iter().enumerate();
    let noise_parameters = parameters.filter(|(i, _)| is_only_there(*i));
    noise_parameters.map(|(_, parameter)| parameter.declared.name.clone()).collect()
}

/// Inputs followed by `further` others, which are linear between samples at `times`.
fn append_inputs(
    inputs: &Inputs,
    times: &[f64],
    further: &[Vec<f64>],
) -> Result<Inputs, InputError> {
    if times.is_empty() || further.is_empty() {
        return Ok(inputs.clone());
    }
    with_further_inputs(inputs, times, further.len(), |t, _, behind| {
        let after = times.partition_point(|sample| *sample < t).min(times.len() - 1);
        let before = if times[after] > t { after.saturating_sub(1) } else { after };
        let part =
            if after > before { (t - times[before]) / (times[after] - times[before]) } else { 0.0 };
        for (value, all) in behind.iter_mut().zip(further) {
            *value = all[before] + part * (all[after] - all[before]);
        }
    })
}
