//! A tank used as a part in many tests, and models compiled from several texts.

use crate::diagnostics::{Diagnostics, render};
use crate::model::{Model, ModelOptions, resolve};
use crate::pipeline::load;
use crate::source::{SourceMap, SourceText};
use crate::syntax::ast::Ast;

pub(crate) const TANK: &str = "\
model tank
constant g [m/s^2] = 9.81
constant A [m^2] = 2
constant V [m^3] = 3 [m]*A
input q_in [m^3/s]
parameter a [m^2] = 0.01 in 0 ..
state h [m] = 1
function speed(depth [m]) = sqrt(2*g*depth)
let q_out = a*speed(h)
equation level: A*der(h) = q_in - q_out
output h [cm]
output p [bar] = 1000 [kg/m^3]*g*h
";

/// A compilation of the first file, which can import the others.
pub(crate) struct TankCompilation {
    pub(crate) sources: SourceMap,
    pub(crate) diagnostics: Diagnostics,
    pub(crate) asts: Vec<Ast>,
}

impl TankCompilation {
    pub(crate) fn new(files: &[(&str, &str)]) -> TankCompilation {
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let main = SourceText { name: files[0].0.into(), text: files[0].1.into() };
        let mut read = |path: &str| {
            let file = files.iter().find(|(name, _)| *name == path);
            file.map(|(_, text)| (*text).to_owned()).ok_or_else(|| "not found".to_owned())
        };
        let asts = load(main, &mut read, &mut sources, &mut diagnostics).unwrap_or_default();
        TankCompilation { sources, diagnostics, asts }
    }

    pub(crate) fn shown(&self) -> String {
        render::render(&self.diagnostics.sorted(), &self.sources, render::RenderStyle::Plain)
    }

    pub(crate) fn model(&mut self) -> Model {
        let model = resolve(&self.asts, &ModelOptions::default(), &mut self.diagnostics);
        model.unwrap_or_else(|_| panic!("{}", self.shown()))
    }
}
