//! The missing terms of the mud circulation when the booster pump stops: the verdict and the estimates.

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::effects::Effect;
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::SensitivityDirections;
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_compiler::syntax::parse;
use dgd_discover::{
    BaseModel, Discovery, DiscoveryOptions, OutputScales, ParameterValue, discover, templates,
};
use dgd_execute::{Engine, LoadedSystem};
use dgd_identify::journal::NoJournal;
use dgd_identify::{NoMonitor, Recording};
use dgd_runtime::{Options, Problem, System, start_from_outputs};

use crate::lines::Lines;
use crate::table::Table;
use crate::texts::{BOOSTER_STOP, EFFECTS, compiled, shown};

/// Tolerance for the errors of rejected structures. Some have a parameter that the recordings do not determine, and the
/// end of their fits depends on the last digits; those of the booster's weighted column, of which the chosen one is a
/// special case, differed by 1.3e-7.
const RIVALS: f64 = 1e-6;

/// The used part of the recordings and of the library.
#[derive(Debug)]
pub(crate) struct Examination {
    /// Rows before this time are used, s.
    pub(crate) until: f64,
    /// Names of the effects' files; all if empty.
    pub(crate) effects: &'static [&'static str],
}

impl Examination {
    pub(crate) fn add_to(&self, lines: &mut Lines) {
        add(&self.discover(), lines);
    }

    fn discover(&self) -> Discovery {
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let compiled =
            compiled("mud_circulation.dgd", &[], &SensitivityDirections::None, &mut sources);
        let library = self.library(&mut sources, &mut diagnostics);
        let templates = templates(&mut sources, &mut diagnostics).expect("the library's texts");
        let base = BaseModel {
            asts: compiled.asts,
            options: ModelOptions::default(),
            free: Vec::new(),
            fix: Vec::new(),
            engine: Engine::Interpreter,
            scales: OutputScales::default(),
        };
        let system = LoadedSystem::with_engine(compiled.program, Engine::Interpreter);
        let [train, valid] = BOOSTER_STOP.map(|text| [self.recording(&system, text)]);
        let names = ["train", "valid"].map(|name| [name.to_owned()]);
        let request = DiscoveryOptions {
            base: &base,
            library: &library,
            templates: &templates,
            sources: &sources,
            train: (&train, &names[0]),
            valid: (&valid, &names[1]),
            options: Options::default(),
            is_method_named: false,
            threads: 1,
            seed: 1,
            budget: None,
            journal: &NoJournal,
            watch: &NoMonitor,
        };
        discover(&request, &mut diagnostics)
            .unwrap_or_else(|error| panic!("{error}\n{}", shown(&diagnostics, &sources)))
    }

    fn library(&self, sources: &mut SourceMap, diagnostics: &mut Diagnostics) -> Vec<Effect> {
        let is_used = |path: &str| {
            let is_named = |name: &&str| path.ends_with(&format!("/{name}.dgd"));
            self.effects.is_empty() || self.effects.iter().any(is_named)
        };
        let used = EFFECTS.iter().filter(|(path, _)| is_used(path));
        used.map(|(path, text)| {
            let source = SourceText { name: (*path).to_owned(), text: (*text).to_owned() };
            let ast = parse(sources.add(source), sources, diagnostics);
            let effect = ast.and_then(|ast| Effect::read(ast, diagnostics));
            effect.expect("an effect of the repository")
        })
        .collect()
    }

    /// The used rows, in SI, with initial values from the first.
    fn recording(&self, system: &LoadedSystem, text: &str) -> Recording {
        let table = Table::read(text, self.until);
        let signature = system.signature();
        let inputs = table.inputs(signature);
        let outputs = signature.outputs.iter();
        let measured: Vec<Option<Vec<f64>>> =
            outputs.map(|output| table.in_si(&output.name, &output.unit)).collect();
        let first: Vec<Option<f64>> =
            measured.iter().map(|values| values.as_ref().map(|values| values[0])).collect();
        let noise: Vec<f64> = (signature.outputs.iter())
            .map(|output| output.noise.expect("the model says how noisy its outputs are"))
            .collect();
        let p: Vec<f64> = signature.parameters.iter().map(|parameter| parameter.value).collect();
        let problem = Problem { system, p: &p, inputs: &inputs, start: &[] };
        let start = start_from_outputs(&problem, 0.0, &first, &noise, &Options::default())
            .expect("outputs that determine the start");
        Recording { start, ..Recording::new(table.times().to_vec(), inputs, measured) }
    }
}

fn add(discovery: &Discovery, lines: &mut Lines) {
    lines.text("verdict", discovery.verdict.word());
    lines.text("reason", &discovery.reason);
    lines.numbers("p", discovery.p_value);
    for effect in &discovery.effects {
        let form = effect.form.as_deref().unwrap_or("only");
        lines.text("effect", &format!("{} ({form}) in {}", effect.name, effect.target));
        for alternative in &effect.alternatives {
            lines.text("alternative", &alternative.name);
            lines.numbers("its validation error", [alternative.valid_ratio]);
        }
        lines.numbers("windows", effect.windows.iter().flatten().copied());
        if let Some(condition) = &effect.condition {
            lines.text("condition", &format!("{} {:?}", condition.quantity, condition.kind));
            lines.numbers("threshold", condition.threshold);
        }
        let evidence = &effect.evidence;
        lines.numbers("its p", [evidence.p_value]);
        lines.numbers("gain", [evidence.bic_gain]);
        lines.numbers("inclusion", [evidence.inclusion]);
        add_parameters("brought", &effect.parameters, lines);
    }
    for rival in &discovery.rivals {
        let targets: Vec<&str> = rival.terms.iter().map(|term| &*term.target).collect();
        lines.text("rival", &targets.join(" + "));
    }
    for unexplained in &discovery.unexplained {
        lines.text("unexplained", &unexplained.target);
        lines.numbers("unexplained in", unexplained.windows.iter().flatten().copied());
    }
    add_parameters("base", &discovery.base_parameters, lines);
    add_parameters("corrected", &discovery.corrected_parameters, lines);
    for gap in &discovery.gap {
        let errors = [gap.train_before, gap.train_after, gap.valid_before, gap.valid_after];
        lines.numbers(&format!("noise of {}", gap.output), [gap.noise]);
        lines.numbers(&format!("errors of {}", gap.output), errors);
    }
    let structures = discovery.ranking.iter();
    for ranked in structures.clone() {
        lines.text(&format!("structure {}", ranked.effects.join(" + ")), &ranked.note);
    }
    lines.numbers("their criteria", structures.clone().map(|ranked| ranked.bic));
    for screened in &discovery.screened {
        lines.numbers(&format!("screened {}", screened.name), [screened.share]);
    }
    lines.hold_to(RIVALS);
    lines.numbers("errors in training", structures.clone().map(|ranked| ranked.train));
    lines.numbers("errors in validation", structures.filter_map(|ranked| ranked.valid));
}

fn add_parameters(of: &str, parameters: &[ParameterValue], lines: &mut Lines) {
    for parameter in parameters {
        lines.numbers(&format!("{of} {}", parameter.name), [parameter.value]);
        lines.numbers(&format!("{of} std of {}", parameter.name), parameter.std);
    }
}
