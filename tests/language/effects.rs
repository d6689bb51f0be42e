//! Every file of `models/effects/`: it is laid out canonically, fits its model in each variant, and
//! leaves the model as it is where it vanishes.

use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::effects::{self, Effect, EffectApplication, EffectBlending, ModelWithEffects};
use dgd_compiler::expr::{ExprId, Symbol};
use dgd_compiler::model::{Model, ModelOptions, resolve};
use dgd_compiler::pipeline::{CompiledStages, SensitivityDirections, compile_asts, load};
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_compiler::syntax::ast::Ast;
use dgd_compiler::syntax::layout;
use dgd_data::DiskFiles;
use dgd_work::load_folder;

use crate::support::{name, root};

/// The circulation model, and the effects beside it.
struct Library {
    sources: SourceMap,
    asts: Vec<Ast>,
    effects: Vec<Effect>,
}

fn shown(diagnostics: &Diagnostics, sources: &SourceMap) -> String {
    render::render(&diagnostics.sorted(), sources, render::RenderStyle::Plain)
}

impl Library {
    fn read() -> Library {
        let path = root().join("models/mud_circulation.dgd");
        let text = std::fs::read_to_string(&path).expect("the model");
        let main = SourceText { name: path.display().to_string(), text };
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let mut read = |_: &str| Err("this model imports nothing".to_owned());
        let asts = load(main, &mut read, &mut sources, &mut diagnostics);
        let folder = root().join("models/effects");
        let effects = load_folder(&DiskFiles, &folder, &mut sources, &mut diagnostics);
        match (asts, effects) {
            (Ok(asts), Ok(effects)) => Library { sources, asts, effects },
            _ => panic!("{}", shown(&diagnostics, &sources)),
        }
    }

    fn compiled(&self, asts: Vec<Ast>, flow: &str) -> CompiledStages {
        let mut diagnostics = Diagnostics::default();
        let options =
            ModelOptions { variants: vec![(name("flow"), name(flow))], ..ModelOptions::default() };
        compile_asts(asts, &options, &SensitivityDirections::All, &mut diagnostics)
            .unwrap_or_else(|_| panic!("{}", shown(&diagnostics, &self.sources)))
    }

    /// Every effect in every way that it can be bound.
    fn applications(&self) -> Vec<EffectApplication<'_>> {
        let mut diagnostics = Diagnostics::default();
        let model = resolve(&self.asts, &ModelOptions::default(), &mut diagnostics).expect("sound");
        let mut all = Vec::new();
        for effect in &self.effects {
            let lists = effects::bind(effect, &model);
            assert!(!lists.is_empty(), "{} fits nothing", effect.full_name());
            all.extend(lists.into_iter().map(|list| EffectApplication {
                effect,
                arguments: list.iter().map(|argument| name(argument)).collect(),
                span: effect.name.span,
            }));
        }
        all
    }

    fn applied(
        &self,
        applications: &[EffectApplication<'_>],
        blending: EffectBlending,
    ) -> ModelWithEffects {
        let mut diagnostics = Diagnostics::default();
        effects::apply(&self.asts, applications, blending, &mut diagnostics)
            .unwrap_or_else(|_| panic!("{}", shown(&diagnostics, &self.sources)))
    }
}

/// Both sides of the model's own equations, and what the outputs read, at one point.
fn values(model: &Model, n_equations: usize) -> Vec<f64> {
    let at = |id: ExprId| {
        model.graph.evaluate(id, &|symbol| match symbol {
            Symbol::Constant(i) => model.constants[i as usize].value,
            Symbol::Parameter(i) => model.parameters[i as usize].value,
            Symbol::Unknown(i) => [40.0, 0.03].get(i as usize).copied().unwrap_or(0.5),
            Symbol::Input(i) => [0.8, 0.01, 0.005][i as usize],
            Symbol::Time => 1000.0,
            Symbol::Derivative(_) => 0.001,
            Symbol::Element(_)
            | Symbol::Swept(_)
            | Symbol::ElementRate(_)
            | Symbol::SweptRate(_)
            | Symbol::SweptParameter(..)
            | Symbol::SweptInput(..)
            | Symbol::Counter => unreachable!("this model has no arrays"),
            Symbol::InputSlope(_)
            | Symbol::SweptInputSlope(..)
            | Symbol::Sensitivity(_)
            | Symbol::SweptSensitivity(_)
            | Symbol::Delayed(_)
            | Symbol::DelayedUnknown(_)
            | Symbol::Past(..)
            | Symbol::Discrete(_) => {
                unreachable!("only later stages have these")
            }
        })
    };
    let equations = model.equations.iter().take(n_equations);
    let sides = equations.flat_map(|equation| [equation.left, equation.right]);
    sides.chain(model.outputs.iter().map(|output| output.value)).map(at).collect()
}

#[test]
fn every_effect_fits_its_model_in_each_variant() {
    let library = Library::read();
    for application in library.applications() {
        let applied = library.applied(std::slice::from_ref(&application), EffectBlending::Applied);
        for flow in ["dynamic", "static"] {
            library.compiled(applied.asts.clone(), flow);
        }
    }
}

#[test]
fn every_effect_vanishes_at_its_null_alone_and_with_all_others() {
    let library = Library::read();
    let applications = library.applications();
    let alone = applications.iter().map(std::slice::from_ref);
    // Forms of one effect are not applied together: all effects, each in its first form, its second,
    // and so on.
    let forms = |a: &EffectApplication<'_>| {
        let of_it = applications
            .iter()
            .filter(|b| b.effect.name.text == a.effect.name.text && b.arguments == a.arguments);
        of_it.map(|b| b.effect.full_name()).collect::<Vec<String>>()
    };
    let most = applications.iter().map(|a| forms(a).len()).max().expect("an effect");
    let together: Vec<Vec<EffectApplication<'_>>> = (0..most)
        .map(|k| {
            let chosen = applications.iter().filter(|a| {
                let forms = forms(a);
                forms[k % forms.len()] == a.effect.full_name()
            });
            chosen.cloned().collect()
        })
        .collect();
    for flow in ["dynamic", "static"] {
        let base = library.compiled(library.asts.clone(), flow).model;
        let n_equations = base.equations.len();
        for some in alone.clone().chain(together.iter().map(Vec::as_slice)) {
            let applied = library.applied(some, EffectBlending::Null);
            let model = library.compiled(applied.asts, flow).model;
            assert_eq!(
                values(&model, n_equations),
                values(&base, n_equations),
                "{}",
                some[0].name()
            );
            for brought in &applied.brought {
                assert_eq!(brought.blend.is_some(), brought.null.is_empty(), "{}", brought.name);
            }
        }
    }
}

#[test]
fn effect_files_are_laid_out_canonically() {
    let library = Library::read();
    for effect in &library.effects {
        let text = &library.sources.get(effect.ast.source).text;
        let mut diagnostics = Diagnostics::default();
        let laid_out = layout::format(effect.ast.source, &library.sources, &mut diagnostics);
        assert_eq!(laid_out.as_ref(), Ok(text), "{}", effect.full_name());
    }
}
