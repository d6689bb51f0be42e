//! A stub for a model with errors: its names without its physics.

use std::collections::BTreeSet;
use std::path::Path;

use dgd_compiler::codegen;
use dgd_compiler::dae::assemble;
use dgd_compiler::diagnostics::{Diagnostics, ErrorReported};
use dgd_compiler::model::{ModelOptions, resolve};
use dgd_compiler::parts;
use dgd_compiler::pipeline::{ReadImport, load};
use dgd_compiler::program::{Direction, lower};
use dgd_compiler::source::{SourceId, SourceMap, SourceText, Span};
use dgd_compiler::syntax::ast::{
    ArrayAxis, ArrayKind, Ast, Expr, ExprKind, Item, ItemKind, LoopCounter, ModelHeader, Name,
    UnknownKind,
};
use dgd_compiler::syntax::parse_what_is_sound;
use proc_macro2::TokenStream;

use crate::input::MacroInput;

/// A module with the names that user code reads, so that rustc reports the model's own error rather than missing names.
///
/// It is generated from a valid model with the same names, whose unknowns are constant, and so has every type and
/// function of the real one.
pub(crate) fn stub(input: &MacroInput, text: &str, read: &mut ReadImport<'_>) -> TokenStream {
    let mut sources = SourceMap::default();
    let main = SourceText { name: input.path.value(), text: text.to_owned() };
    let ast = with_parts(main.clone(), read, &mut sources).unwrap_or_else(|| {
        let source = sources.add(main);
        parse_what_is_sound(source, &sources)
    });
    let module = match (&input.module, &ast.model) {
        (Some(module), _) => module.to_string(),
        (None, Some(header)) => header.name.text.clone(),
        (None, None) => stem(&input.path.value()),
    };
    // If a size or a range is the error, the stub has no arrays.
    let with_arrays = generated(&still(&ast, true), &module, &sources);
    match with_arrays.or_else(|_| generated(&still(&ast, false), &module, &sources)) {
        Ok(tokens) => tokens,
        // An error is already reported.
        Err(_) => TokenStream::new(),
    }
}

/// The model with the contents of its parts, if the files can be read.
fn with_parts(main: SourceText, read: &mut ReadImport<'_>, sources: &mut SourceMap) -> Option<Ast> {
    let mut diagnostics = Diagnostics::default();
    let asts = load(main, read, sources, &mut diagnostics).ok()?;
    let expanded = parts::expand(&asts, &mut diagnostics).ok()?;
    expanded.asts.first().cloned()
}

/// The probable name of a model whose file lacks a `model` line.
fn stem(path: &str) -> String {
    let stem = Path::new(path).file_stem().map(|stem| stem.to_string_lossy());
    match stem {
        Some(stem) if syn::parse_str::<syn::Ident>(&stem).is_ok() => stem.into_owned(),
        Some(_) | None => "model".to_owned(),
    }
}

fn generated(ast: &Ast, module: &str, sources: &SourceMap) -> Result<TokenStream, ErrorReported> {
    let mut diagnostics = Diagnostics::default();
    let model = resolve(std::slice::from_ref(ast), &ModelOptions::default(), &mut diagnostics)?;
    let dae = assemble(&model, &mut diagnostics)?;
    let directions: Vec<Direction> = (0..dae.parameters.len()).map(Direction::Parameter).collect();
    Ok(codegen::generate(&lower(&dae, &directions), module, sources))
}

/// A model with the same names in which all numbers are zero and nothing changes.
fn still(ast: &Ast, with_arrays: bool) -> Ast {
    let mut still = Still {
        names: BTreeSet::from(["time", "pi"]),
        outputs: BTreeSet::new(),
        items: Vec::new(),
        with_arrays,
    };
    still.take(&ast.items);
    let model = ModelHeader { doc: Vec::new(), name: name("model") };
    Ast {
        source: ast.source,
        model: Some(model),
        effect: None,
        items: still.items,
        imports: Vec::new(),
    }
}

struct Still<'a> {
    names: BTreeSet<&'a str>,
    outputs: BTreeSet<&'a str>,
    items: Vec<Item>,
    with_arrays: bool,
}

impl<'a> Still<'a> {
    fn take(&mut self, items: &'a [Item]) {
        for item in items {
            match &item.kind {
                ItemKind::Parameter { name, .. } if self.is_new(name) => {
                    self.push(ItemKind::Parameter {
                        name: name.clone(),
                        unit: None,
                        value: zero(),
                        attributes: Vec::new(),
                    });
                }
                ItemKind::Input { name, .. } if self.is_new(name) => {
                    let (name, attributes) = (name.clone(), Vec::new());
                    self.push(ItemKind::Input { name, unit: None, attributes });
                }
                ItemKind::Unknown { name, .. } if self.is_new(name) => self.unknown(name),
                ItemKind::Output { name, .. } if self.outputs.insert(&name.text) => {
                    self.push(ItemKind::Output {
                        name: name.clone(),
                        unit: None,
                        value: Some(zero()),
                        attributes: Vec::new(),
                    });
                }
                ItemKind::Size { name, value } if self.with_arrays && self.is_new(name) => {
                    self.push(ItemKind::Size { name: name.clone(), value: value.clone() });
                }
                ItemKind::Array { declared, name, axes, .. }
                    if declared.is_unknown() && self.with_arrays && self.is_new(name) =>
                {
                    self.array(name, axes);
                }
                ItemKind::Array { declared: ArrayKind::Parameter, name, axes, .. }
                    if self.with_arrays && self.is_new(name) =>
                {
                    self.vector(ArrayKind::Parameter, name, axes, Some(zero()));
                }
                ItemKind::Array { declared: ArrayKind::Input, name, axes, .. }
                    if self.with_arrays && self.is_new(name) =>
                {
                    self.vector(ArrayKind::Input, name, axes, None);
                }
                ItemKind::Variant { choices, .. } => {
                    for choice in choices {
                        self.take(&choice.items);
                    }
                }
                // The first declaration of a name counts.
                ItemKind::Parameter { .. }
                | ItemKind::Input { .. }
                | ItemKind::Unknown { .. }
                | ItemKind::Output { .. }
                | ItemKind::Import { .. }
                | ItemKind::Constant { .. }
                | ItemKind::Let { .. }
                | ItemKind::Function { .. }
                | ItemKind::Table { .. }
                | ItemKind::Equation { .. }
                | ItemKind::Modes { .. }
                | ItemKind::Part { .. }
                | ItemKind::Binding { .. }
                | ItemKind::When(_)
                | ItemKind::Every { .. }
                | ItemKind::Unit { .. }
                | ItemKind::Start(_)
                | ItemKind::Saturate { .. }
                | ItemKind::Size { .. }
                | ItemKind::Array { .. }
                | ItemKind::For { .. } => {}
            }
        }
    }

    fn is_new(&mut self, name: &'a Name) -> bool {
        self.names.insert(&name.text)
    }

    /// `state x = 0` and `equation x: der(x) = 0`
    fn unknown(&mut self, unknown: &Name) {
        let x = expr(ExprKind::Name(unknown.text.clone()));
        let left = expr(ExprKind::Call { function: name("der"), arguments: vec![x] });
        self.push(ItemKind::Equation {
            label: unknown.clone(),
            left,
            right: zero(),
            attributes: Vec::new(),
        });
        self.push(ItemKind::Unknown {
            declared: UnknownKind::State,
            name: unknown.clone(),
            unit: None,
            start: None,
            attributes: Vec::new(),
        });
    }

    /// `state x[1..N] = 0` and `for i in 1..N { equation x[i]: der(x[i]) = 0 }`
    fn array(&mut self, array: &Name, axes: &[ArrayAxis]) {
        let mut element = expr(ExprKind::Name(array.text.clone()));
        let mut counters = Vec::new();
        for (k, ArrayAxis { range, .. }) in axes.iter().enumerate() {
            // Names of models cannot begin with an underscore.
            let index = name(&format!("_i{k}"));
            let at = Box::new(expr(ExprKind::Name(index.text.clone())));
            element = expr(ExprKind::Element(Box::new(element), at));
            counters.push(LoopCounter { index, range: range.clone() });
        }
        let arguments = vec![element];
        let left = expr(ExprKind::Call { function: name("der"), arguments });
        let equation = ItemKind::Equation {
            label: array.clone(),
            left,
            right: zero(),
            attributes: Vec::new(),
        };
        let items = vec![Item { span: NOWHERE, doc: Vec::new(), kind: equation }];
        self.push(ItemKind::For { counters, items });
        self.vector(ArrayKind::State, array, axes, None);
    }

    fn vector(
        &mut self,
        declared: ArrayKind,
        name: &Name,
        axes: &[ArrayAxis],
        start: Option<Expr>,
    ) {
        let plain = |axis: &ArrayAxis| ArrayAxis { index: None, range: axis.range.clone() };
        self.push(ItemKind::Array {
            declared,
            name: name.clone(),
            axes: axes.iter().map(plain).collect(),
            unit: None,
            start,
            attributes: Vec::new(),
        });
    }

    fn push(&mut self, kind: ItemKind) {
        self.items.push(Item { span: NOWHERE, doc: Vec::new(), kind });
    }
}

const NOWHERE: Span = Span { source: SourceId(0), start: 0, end: 0 };

fn name(text: &str) -> Name {
    Name { text: text.to_owned(), span: NOWHERE }
}

fn expr(kind: ExprKind) -> Expr {
    Expr { span: NOWHERE, kind }
}

fn zero() -> Expr {
    expr(ExprKind::Number { value: 0.0, text: "0".to_owned(), unit: None })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nothing(_: &str) -> Result<String, String> {
        Err("not found".to_owned())
    }

    #[test]
    fn a_stub_has_the_fields_of_parts() {
        let input = syn::parse_str("\"pond.dgd\"").expect("arguments of the macro");
        let text = "model pond\nimport \"tank.dgd\"\npart one: tank\nlet x = 3 [m] + 2 [s]\n";
        let tank = "model tank\nparameter k = 1\nstate h [m] = 1\n";
        let stub = stub(&input, text, &mut |_| Ok(tank.to_owned())).to_string();
        for field in ["pub one_k : f64", "pub one_h : f64", "pub mod pond"] {
            assert!(stub.contains(field), "no {field} in {stub}");
        }
    }

    #[test]
    fn a_stub_has_the_fields_that_can_be_read() {
        let input = syn::parse_str("\"tank.dgd\"").expect("arguments of the macro");
        let text = "model tank\nparameter A [ft2\nparameter k [furlong] = 1\ninput q\n\
                    variant v { a { state h = 1 } b { unknown h } }\noutput h = nothing\n";
        let stub = stub(&input, text, &mut nothing).to_string();
        for field in ["pub k : f64", "pub q : f64", "pub h : f64", "pub mod tank"] {
            assert!(stub.contains(field), "no {field} in {stub}");
        }
        assert!(!stub.contains("pub A"), "{stub}");
    }

    #[test]
    fn a_stub_has_the_arrays_that_can_be_read() {
        let input = syn::parse_str("\"line.dgd\"").expect("arguments of the macro");
        let text =
            "model line\nsize N = 3\nstate x = 1\nstate p[0..N] = 1 [furlong]\noutput y = z\n";
        let sound = stub(&input, text, &mut nothing).to_string();
        assert!(sound.contains("pub p : [f64 ; 4]"), "{sound}");
        let unsound = stub(&input, &text.replace("N = 3", "N = M"), &mut nothing).to_string();
        assert!(unsound.contains("pub x : f64") && !unsound.contains("pub p"), "{unsound}");
    }

    #[test]
    fn no_text_leaves_a_model_without_fields() {
        let input = syn::parse_str("\"a b.dgd\"").expect("arguments of the macro");
        assert!(stub(&input, "", &mut nothing).to_string().contains("pub mod model"));
    }
}
