//! The syntax tree of a model file.
//!
//! Printing an [`Ast`] and parsing the text again gives the same tree, apart from places. Names and units are not
//! resolved.

use crate::diagnostics::ErrorReported;
use crate::source::{SourceId, Span};
use crate::units::{self, OwnUnits, UnitError, parse_unit_with};

pub use dgd_signature::Crossing;

/// One parsed file.
#[derive(Debug, Clone, PartialEq)]
pub struct Ast {
    /// Where it was read.
    pub source: SourceId,
    /// `model NAME`; a file with neither this nor `effect` is a library of constants, `let`s and
    /// functions.
    pub model: Option<ModelHeader>,
    /// `effect NAME …` and the clauses with its changes to a model.
    pub effect: Option<EffectHeader>,
    /// Items in the order written.
    pub items: Vec<Item>,
    /// Sources of the imports among the items, in their order; empty until [`load`](super::imports::load) has read
    /// them.
    pub imports: Vec<SourceId>,
}

/// `model NAME` with the doc comment above it.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelHeader {
    /// Lines of the doc comment, without `///`.
    pub doc: Vec<String>,
    /// The model's name.
    pub name: Name,
}

/// `effect NAME on MODEL` or `effect NAME(y: output [Pa])`, with the doc comment above it.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectHeader {
    /// Lines of the doc comment, without `///`.
    pub doc: Vec<String>,
    /// The effect's name.
    pub name: Name,
    /// Its possible targets.
    pub target: EffectTarget,
    /// `kind`, `form`, `null`, `replace` and `add`, in the order written. Their order relative to the items is
    /// irrelevant and not stored.
    pub clauses: Vec<EffectClause>,
}

/// The possible targets of an effect.
#[derive(Debug, Clone, PartialEq)]
pub enum EffectTarget {
    /// `on MODEL`: this model and no other.
    Model(Name),
    /// `(y: output [Pa], x: state)`: any model with items of these kinds.
    Template(Vec<TemplateSlot>),
}

/// An argument of a template.
#[derive(Debug, Clone, PartialEq)]
pub struct TemplateSlot {
    /// Its name in the effect.
    pub name: Name,
    /// Its kind.
    pub kind: SlotKind,
    /// A unit of its dimension; any dimension without one.
    pub unit: Option<WrittenUnit>,
}

/// The kind of an argument of a template.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SlotKind {
    /// `input`
    Input,
    /// `output`
    Output,
    /// `state`
    State,
    /// `equation`
    Equation,
    /// `parameter`
    Parameter,
    /// `quantity`: an input, a state or an unknown
    Quantity,
    /// `let`
    Let,
}

impl SlotKind {
    /// Every kind, with its word.
    pub const ALL: [(&'static str, SlotKind); 7] = [
        ("input", SlotKind::Input),
        ("output", SlotKind::Output),
        ("state", SlotKind::State),
        ("equation", SlotKind::Equation),
        ("parameter", SlotKind::Parameter),
        ("quantity", SlotKind::Quantity),
        ("let", SlotKind::Let),
    ];

    /// Whether an item of this kind fits a slot of another kind.
    pub fn fits(self, asked: SlotKind) -> bool {
        self == asked
            || (asked == SlotKind::Quantity && matches!(self, SlotKind::Input | SlotKind::State))
    }
}

/// A line of an effect that is not a declaration.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectClause {
    /// Its place, from the keyword to the last token.
    pub span: Span,
    /// Doc comment lines.
    pub doc: Vec<String>,
    /// Its kind.
    pub kind: ClauseKind,
}

/// A clause of an effect, in addition to its items.
#[derive(Debug, Clone, PartialEq)]
pub enum ClauseKind {
    /// `kind plant`
    Kind(EffectKind),
    /// `form column`
    Form(Name),
    /// `null gain = 1`: the value without effect.
    Null {
        /// A parameter of the effect.
        name: Name,
        /// Its null value.
        value: Expr,
    },
    /// `replace x by e`, `replace x in EQ by e` or `replace f(a, b) by e`
    Replace {
        /// The name to replace.
        name: Name,
        /// Names of a function's arguments within `e`.
        arguments: Vec<Name>,
        /// The equation in which it is replaced; `None` means everywhere.
        equation: Option<Name>,
        /// The replacement; in it, the name is the old value.
        by: Expr,
    },
    /// `replace output y by e`
    ReplaceOutput {
        /// The output.
        output: Name,
        /// Its new value; in it, the output's name is its old value.
        by: Expr,
    },
    /// `add e to EQ`: to its right-hand side.
    Add {
        /// The term to add.
        value: Expr,
        /// The equation's label.
        equation: Name,
    },
}

/// The part of a model that an effect corrects: the plant, a sensor, or an input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum EffectKind {
    /// Physics that the model lacks.
    Plant,
    /// A sensor whose reading differs from the model's output.
    Sensor,
    /// An input that differs from its recording.
    Input,
}

impl EffectKind {
    /// Every kind, with its word.
    pub const ALL: [(&'static str, EffectKind); 3] = [
        ("plant", EffectKind::Plant),
        ("sensor", EffectKind::Sensor),
        ("input", EffectKind::Input),
    ];

    /// Its word.
    pub fn word(self) -> &'static str {
        match self {
            EffectKind::Plant => "plant",
            EffectKind::Sensor => "sensor",
            EffectKind::Input => "input",
        }
    }
}

/// A name and its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Name {
    /// The name.
    pub text: String,
    /// Its place.
    pub span: Span,
}

/// One item: a declaration, an equation or a block.
#[derive(Debug, Clone, PartialEq)]
pub struct Item {
    /// Its place, from the keyword to the last token.
    pub span: Span,
    /// Doc comment lines: those above it, then the one at the end of its line.
    pub doc: Vec<String>,
    /// Its kind.
    pub kind: ItemKind,
}

/// The items of the language.
#[derive(Debug, Clone, PartialEq)]
pub enum ItemKind {
    /// `import "friction.dgd"`: constants, `let`s and functions of a library file.
    Import {
        /// The path as written, without quotes.
        path: String,
        /// Its place, quotes included.
        path_span: Span,
    },
    /// `constant g [m/s^2] = 9.81`
    Constant {
        /// Name.
        name: Name,
        /// Unit in brackets; dimensionless without one.
        unit: Option<WrittenUnit>,
        /// Value.
        value: Expr,
    },
    /// `parameter c0 [m] = 275 in 0 .. 1e3, log, fixed, nominal 300, prior normal(275, 10)`
    Parameter {
        /// Name.
        name: Name,
        /// Unit in brackets.
        unit: Option<WrittenUnit>,
        /// Value.
        value: Expr,
        /// Attributes in the order written.
        attributes: Vec<Attribute>,
    },
    /// `input q_boost [lpm] linear`
    Input {
        /// Name.
        name: Name,
        /// Unit in brackets.
        unit: Option<WrittenUnit>,
        /// `hold` or `linear`, and attributes.
        attributes: Vec<Attribute>,
    },
    /// `state h_r [m] = 50`, `unknown f [1] = 0.02` or `held u [%] = 50`
    Unknown {
        /// Whether it was declared `state` (it may have a derivative), `unknown` or `held`.
        declared: UnknownKind,
        /// Name.
        name: Name,
        /// Unit in brackets.
        unit: Option<WrittenUnit>,
        /// Start value or guess; without one it is zero.
        start: Option<Expr>,
        /// Attributes in the order written.
        attributes: Vec<Attribute>,
    },
    /// `unit stroke = 0.118 [l]`: a unit that the file uses.
    Unit {
        /// Its symbol.
        name: Name,
        /// Its value: a number with a unit.
        value: Expr,
    },
    /// `size N = 100`: a whole number for ranges.
    Size {
        /// Name.
        name: Name,
        /// Value.
        value: Expr,
    },
    /// `state p[1..N] [bar] = 60`, `unknown v[i in 1..N] = 2*i` or `parameter k[1..2] = (0.1, 0.2)`.
    Array {
        /// Kind of its elements.
        declared: ArrayKind,
        /// Name.
        name: Name,
        /// Ranges of its indices, the first outermost.
        axes: Vec<ArrayAxis>,
        /// Unit in brackets.
        unit: Option<WrittenUnit>,
        /// Value, start value or guess: one for all elements, or an [`ExprKind::List`] with one for each. Inputs have
        /// none; the default for unknowns is zero.
        start: Option<Expr>,
        /// Attributes in the order written.
        attributes: Vec<Attribute>,
    },
    /// `for i in 1..N, j in 1..M { equation mass[i][j]: … }`: items for each index. The indices after their names,
    /// which are the loop's, are not stored.
    For {
        /// Its indices, the first outermost; at least one.
        counters: Vec<LoopCounter>,
        /// Equations and `let`s.
        items: Vec<Item>,
    },
    /// `let net = …`; a unit, if given, is checked.
    Let {
        /// Name.
        name: Name,
        /// Unit in brackets.
        unit: Option<WrittenUnit>,
        /// Value.
        value: Expr,
    },
    /// `function friction(q [m^3/s]) = …`, optionally with `let`s in a block
    Function {
        /// Name.
        name: Name,
        /// Arguments; one with a unit is checked against it.
        arguments: Vec<FormalArgument>,
        /// Local values, each of which may read those before it.
        lets: Vec<LocalLet>,
        /// Value.
        body: Expr,
    },
    /// `table head(q [lpm]) [m] = (0, 305), (1200, 301)  pchip, beyond refuse`
    Table {
        /// Name.
        name: Name,
        /// Its arguments: one, or two for a grid.
        arguments: Vec<FormalArgument>,
        /// Unit of the values in brackets.
        unit: Option<WrittenUnit>,
        /// Its points.
        points: TablePoints,
        /// Attributes in the order written.
        attributes: Vec<Attribute>,
    },
    /// `output p_r [bara] = …  noise 0.01 [bar]`
    Output {
        /// Name.
        name: Name,
        /// Unit in brackets.
        unit: Option<WrittenUnit>,
        /// Its value; without one, the unknown of its name.
        value: Option<Expr>,
        /// Attributes in the order written.
        attributes: Vec<Attribute>,
    },
    /// `equation riser: A_r * der(h_r) = q_ssp - q_boost`
    Equation {
        /// Label.
        label: Name,
        /// Left of `=`.
        left: Expr,
        /// Right of `=`.
        right: Expr,
        /// Attributes in the order written.
        attributes: Vec<Attribute>,
    },
    /// `variant flow { dynamic { … } static { … } }`
    Variant {
        /// Name.
        name: Name,
        /// Choices; the first is the default.
        choices: Vec<VariantChoice>,
    },
    /// `modes line { full { … } draining { … } full -> draining when a falls below b }`
    Modes {
        /// Name.
        name: Name,
        /// Modes with their equations; it starts in the first unless `starts` selects another.
        modes: Vec<VariantChoice>,
        /// Its transitions.
        transitions: Vec<TransitionClause>,
        /// `start MODE if CONDITION`, in the order written, and `start MODE`.
        starts: Vec<StartMode>,
    },
    /// `part pump: subsea_pump(c0 = 275 [m])`: a model inside this one, or with `cell[i in 1..N]` one for each index.
    Part {
        /// Its name here.
        name: Name,
        /// Ranges of the indices of an array of parts, the first outermost.
        axes: Vec<ArrayAxis>,
        /// Its model.
        model: Name,
        /// New values for declarations of the model.
        arguments: Vec<PartArgument>,
    },
    /// `pump.q = q_ssp` or `cell.i[1] = i_pack`: the value of an input of a part. The indices of a loop are not stored.
    Binding {
        /// The part's name, a point, and its input's.
        input: Name,
        /// The element of an array; empty for the whole.
        indices: Vec<Expr>,
        /// The value.
        value: Expr,
    },
    /// `when x rises above a { reset x = e }`
    When(Reaction),
    /// `every 10 [s] offset 2 [s] { reset u = e }`: at the times t₀, t₀ + T, t₀ + 2 T and so on.
    Every {
        /// T.
        period: Expr,
        /// t₀; zero if omitted.
        offset: Option<Expr>,
        /// Unknowns that it resets, with their new values.
        resets: Vec<ResetClause>,
    },
    /// The start of a run.
    Start(StartRule),
    /// `saturate q >= 0` or `saturate h[i] <= h_max`
    Saturate {
        /// The bounded unknown.
        name: Name,
        /// The element of an array.
        indices: Vec<Expr>,
        /// The side on which the bound lies.
        side: BoundSide,
        /// The bound.
        bound: Expr,
    },
}

impl ItemKind {
    /// The name that an item declares for expressions to read or call.
    pub fn value_name(&self) -> Option<&Name> {
        match self {
            ItemKind::Constant { name, .. }
            | ItemKind::Parameter { name, .. }
            | ItemKind::Input { name, .. }
            | ItemKind::Unknown { name, .. }
            | ItemKind::Size { name, .. }
            | ItemKind::Array { name, .. }
            | ItemKind::Let { name, .. }
            | ItemKind::Function { name, .. }
            | ItemKind::Table { name, .. } => Some(name),
            _ => None,
        }
    }

    /// The name of an item in a loop that the loop's indices follow.
    pub fn name_with_indices(&self) -> Option<&Name> {
        match self {
            ItemKind::Equation { label: name, .. }
            | ItemKind::Start(StartRule::Equation { label: name, .. })
            | ItemKind::Let { name, .. }
            | ItemKind::Binding { input: name, .. } => Some(name),
            _ => None,
        }
    }

    /// [`Self::name_with_indices`], mutable.
    pub fn name_with_indices_mut(&mut self) -> Option<&mut Name> {
        match self {
            ItemKind::Equation { label: name, .. }
            | ItemKind::Start(StartRule::Equation { label: name, .. })
            | ItemKind::Let { name, .. }
            | ItemKind::Binding { input: name, .. } => Some(name),
            _ => None,
        }
    }
}

/// `c0 = 275 [m]` between the parentheses of a part.
#[derive(Debug, Clone, PartialEq)]
pub struct PartArgument {
    /// A constant, parameter, unknown or variant of the part's model.
    pub name: Name,
    /// Its value, start value or choice.
    pub value: Expr,
}

/// A rule for the initial state of a run, in addition to start values.
#[derive(Debug, Clone, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "a model has few of them")]
pub enum StartRule {
    /// `start steady`: a run starts with the whole model at rest.
    Steady,
    /// `start equation level: der(h) = 0`
    Equation {
        /// Its label.
        label: Name,
        /// The left side.
        left: Expr,
        /// The right side.
        right: Expr,
    },
}

/// Conditions to watch, and the resets that they trigger.
#[derive(Debug, Clone, PartialEq)]
pub struct Reaction {
    /// The conditions: one or several, joined by `or`.
    pub conditions: Vec<CrossingCondition>,
    /// Unknowns that it resets, with their new values.
    pub resets: Vec<ResetClause>,
}

/// `x rises above a` or `x falls below a`
#[derive(Debug, Clone, PartialEq)]
pub struct CrossingCondition {
    /// The watched expression.
    pub left: Expr,
    /// Direction in which it passes `right`.
    pub crossing: Crossing,
    /// The expression that it is compared with.
    pub right: Expr,
}

/// The side of an unknown on which its bound lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum BoundSide {
    /// `x >= e`
    Lower,
    /// `x <= e`
    Upper,
}

/// `a..b`: all whole numbers from one to the other, both included.
#[derive(Debug, Clone, PartialEq)]
pub struct NumberRange {
    /// Its place.
    pub span: Span,
    /// The first.
    pub lower: Expr,
    /// The last.
    pub upper: Expr,
}

/// `1..N` or `i in 1..N` between the brackets of a declared array.
#[derive(Debug, Clone, PartialEq)]
pub struct ArrayAxis {
    /// Name of the index in the value.
    pub index: Option<Name>,
    /// Indices of the elements.
    pub range: NumberRange,
}

/// `i in 1..N` of a loop or a sum.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopCounter {
    /// Name of the index.
    pub index: Name,
    /// Its values.
    pub range: NumberRange,
}

/// Kind of the elements of an array.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ArrayKind {
    /// `constant`
    Constant,
    /// `parameter`
    Parameter,
    /// `input`
    Input,
    /// `state`
    State,
    /// `unknown`
    Unknown,
    /// `held`: changed only by resets.
    Held,
}

impl ArrayKind {
    /// Its keyword.
    pub fn word(self) -> &'static str {
        match self {
            ArrayKind::Constant => "constant",
            ArrayKind::Parameter => "parameter",
            ArrayKind::Input => "input",
            ArrayKind::State => "state",
            ArrayKind::Unknown => "unknown",
            ArrayKind::Held => "held",
        }
    }

    /// Whether its elements are unknowns.
    pub fn is_unknown(self) -> bool {
        matches!(self, ArrayKind::State | ArrayKind::Unknown | ArrayKind::Held)
    }
}

/// Kind of an unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UnknownKind {
    /// `state`
    State,
    /// `unknown`
    Unknown,
    /// `held`: changed only by resets.
    Held,
}

impl UnknownKind {
    /// Its keyword.
    pub fn word(self) -> &'static str {
        match self {
            UnknownKind::State => "state",
            UnknownKind::Unknown => "unknown",
            UnknownKind::Held => "held",
        }
    }

    /// The kind of an array with such elements.
    pub fn of_elements(self) -> ArrayKind {
        match self {
            UnknownKind::State => ArrayKind::State,
            UnknownKind::Unknown => ArrayKind::Unknown,
            UnknownKind::Held => ArrayKind::Held,
        }
    }
}

/// `let y [m] = x*x` within a function.
#[derive(Debug, Clone, PartialEq)]
pub struct LocalLet {
    /// Name, local to the function.
    pub name: Name,
    /// Unit in brackets.
    pub unit: Option<WrittenUnit>,
    /// Value.
    pub value: Expr,
}

/// An argument of a function.
#[derive(Debug, Clone, PartialEq)]
pub struct FormalArgument {
    /// Name.
    pub name: Name,
    /// Unit in brackets; any unit without one.
    pub unit: Option<WrittenUnit>,
}

/// The points of a table.
#[derive(Debug, Clone, PartialEq)]
pub enum TablePoints {
    /// `(0, 305), (1200, 301)`: the arguments of each point, then its value.
    Written(Vec<TablePoint>),
    /// `at (0, 20, 80) = (c_0, c_20, c_80)`: abscissae, then as many values.
    Columns([Vec<Expr>; 2]),
    /// `from "eta.csv"`: points in a file.
    File {
        /// The path as written, without quotes.
        path: String,
        /// Its place, quotes included.
        path_span: Span,
        /// The points, once the file has been read.
        rows: Option<Result<Vec<TablePoint>, ErrorReported>>,
    },
}

/// A point of a table: its arguments, then its value.
#[derive(Debug, Clone, PartialEq)]
pub struct TablePoint {
    /// Its place.
    pub span: Span,
    /// The numbers, in the units of their arguments and of the value.
    pub numbers: Vec<Expr>,
}

impl TablePoints {
    /// All expressions, in the order written.
    pub fn expressions(&self) -> Vec<&Expr> {
        match self {
            TablePoints::Written(points) | TablePoints::File { rows: Some(Ok(points)), .. } => {
                points.iter().flat_map(|point| &point.numbers).collect()
            }
            TablePoints::Columns(columns) => columns.iter().flatten().collect(),
            TablePoints::File { .. } => Vec::new(),
        }
    }

    /// [`Self::expressions`], mutable.
    pub fn expressions_mut(&mut self) -> Vec<&mut Expr> {
        match self {
            TablePoints::Written(points) | TablePoints::File { rows: Some(Ok(points)), .. } => {
                points.iter_mut().flat_map(|point| &mut point.numbers).collect()
            }
            TablePoints::Columns(columns) => columns.iter_mut().flatten().collect(),
            TablePoints::File { .. } => Vec::new(),
        }
    }
}

/// Interpolation of a table between its points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableInterpolation {
    /// `linear`: piecewise linear.
    Linear,
    /// `pchip`: cubics that are monotone between points.
    Pchip,
    /// `natural`: cubics with a continuous curvature that is zero at both ends.
    Natural,
    /// `cubic`: natural cubics along both arguments of a grid.
    Cubic,
}

impl TableInterpolation {
    /// Every shape, with its word.
    pub const ALL: [(&'static str, TableInterpolation); 4] = [
        ("linear", TableInterpolation::Linear),
        ("pchip", TableInterpolation::Pchip),
        ("natural", TableInterpolation::Natural),
        ("cubic", TableInterpolation::Cubic),
    ];

    /// Its word.
    pub fn word(self) -> &'static str {
        Self::ALL.iter().find(|(_, shape)| *shape == self).map_or("", |(word, _)| word)
    }
}

/// Extrapolation of a table beyond its first and last point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableExtrapolation {
    /// `beyond refuse`: a run ends there.
    Refuse,
    /// `beyond hold`: it keeps the value of its end.
    Hold,
    /// `beyond extend`: it keeps the slope of its end.
    Extend,
}

impl TableExtrapolation {
    /// Every choice, with its word.
    pub const ALL: [(&'static str, TableExtrapolation); 3] = [
        ("refuse", TableExtrapolation::Refuse),
        ("hold", TableExtrapolation::Hold),
        ("extend", TableExtrapolation::Extend),
    ];

    /// Its word.
    pub fn word(self) -> &'static str {
        Self::ALL.iter().find(|(_, beyond)| *beyond == self).map_or("", |(word, _)| word)
    }
}

/// One choice of a variant.
#[derive(Debug, Clone, PartialEq)]
pub struct VariantChoice {
    /// Doc comment lines: those above it, then the one at the end of its line.
    pub doc: Vec<String>,
    /// Name.
    pub name: Name,
    /// Its items.
    pub items: Vec<Item>,
}

/// `start MODE if CONDITION`, or `start MODE` for the case that no condition holds.
#[derive(Debug, Clone, PartialEq)]
pub struct StartMode {
    /// The mode.
    pub mode: Name,
    /// Condition under which a run starts in it.
    pub condition: Option<Expr>,
}

/// `full -> draining when a falls below b { reset x = e }`
#[derive(Debug, Clone, PartialEq)]
pub struct TransitionClause {
    /// Its place, from the first mode's name to the last token.
    pub span: Span,
    /// Doc comment lines: those above it, then the one at the end of its line.
    pub doc: Vec<String>,
    /// The mode that it leaves.
    pub from: Name,
    /// The mode that it enters.
    pub to: Name,
    /// The conditions: one or several, joined by `or`.
    pub conditions: Vec<CrossingCondition>,
    /// Unknowns that it resets, with their new values.
    pub resets: Vec<ResetClause>,
}

/// `reset x = e` or `reset h[i] = e`
#[derive(Debug, Clone, PartialEq)]
pub struct ResetClause {
    /// Its place.
    pub span: Span,
    /// The unknown that gets a new value.
    pub name: Name,
    /// The element of an array.
    pub indices: Vec<Expr>,
    /// The value.
    pub value: Expr,
}

/// An attribute after a value.
#[derive(Debug, Clone, PartialEq)]
pub struct Attribute {
    /// Its place.
    pub span: Span,
    /// Its kind.
    pub kind: AttributeKind,
}

/// A law of priors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PriorLaw {
    /// `normal(mean, standard deviation)`
    Normal,
    /// `lognormal(median, standard deviation of the logarithm)`
    LogNormal,
    /// `uniform(lower, upper)`
    Uniform,
    /// `laplace(median, scale)`
    Laplace,
    /// `gamma(shape, scale)`
    Gamma,
}

impl PriorLaw {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::Normal, Self::LogNormal, Self::Uniform, Self::Laplace, Self::Gamma];

    /// Its word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::LogNormal => "lognormal",
            Self::Uniform => "uniform",
            Self::Laplace => "laplace",
            Self::Gamma => "gamma",
        }
    }

    /// Names of its two numbers.
    pub fn numbers(self) -> [&'static str; 2] {
        match self {
            Self::Normal => ["mean", "standard deviation"],
            Self::LogNormal => ["median", "standard deviation of the logarithm"],
            Self::Uniform => ["lower end", "upper end"],
            Self::Laplace => ["median", "scale"],
            Self::Gamma => ["shape", "scale"],
        }
    }
}

/// The attributes of the language.
#[derive(Debug, Clone, PartialEq)]
pub enum AttributeKind {
    /// `in a .. b`, each end optional: bounds of validity and of estimation.
    Bounds(Option<Expr>, Option<Expr>),
    /// `log`: the logarithm is estimated.
    Log,
    /// `fixed`: not estimated unless requested.
    Fixed,
    /// `guess`: start equations determine the start value, starting from this guess.
    Guess,
    /// `nominal V`: size for tolerances and scaling.
    Nominal(Expr),
    /// `prior normal(mean, std)`
    Prior(PriorLaw, Expr, Expr),
    /// `hold`: a sample holds until the next.
    Hold,
    /// `linear` between samples.
    Linear,
    /// `noise V`: standard deviation of the sensor's white noise.
    Noise(Expr),
    /// `history V`: its values before the start.
    History(Expr),
    /// `exact`: the equation lacks no term.
    Exact,
    /// `pchip`, `natural` or `cubic`: interpolation of a table between its points. `linear` is
    /// [`Linear`](Self::Linear).
    Shape(TableInterpolation),
    /// `beyond hold`: extrapolation of a table beyond its ends.
    Beyond(TableExtrapolation),
    /// `smooth V`: standard deviation of a table's points from the lines between their neighbours.
    Smooth(Expr),
}

/// A unit as written between brackets.
#[derive(Debug, Clone, PartialEq)]
pub struct WrittenUnit {
    /// Its place, brackets included.
    pub span: Span,
    /// The text between the brackets, trimmed.
    pub text: String,
    /// Units that the file declares, once these have been read.
    pub own: OwnUnits,
}

impl WrittenUnit {
    /// A unit that does not refer to declarations of a file.
    pub fn new(span: Span, text: impl Into<String>) -> WrittenUnit {
        WrittenUnit { span, text: text.into(), own: OwnUnits::default() }
    }

    /// That of a plain number.
    pub fn one(span: Span) -> WrittenUnit {
        WrittenUnit::new(span, "1")
    }

    /// Parses it.
    ///
    /// # Errors
    ///
    /// [`UnitError`] if the text is not a unit.
    pub fn read(&self) -> Result<units::Unit, UnitError> {
        parse_unit_with(&self.text, &self.own)
    }
}

/// An expression and its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Expr {
    /// Its place.
    pub span: Span,
    /// Its kind.
    pub kind: ExprKind,
}

/// Expressions. Sums, products and chains of `and` and `or` are flat, so that only brackets nest.
#[derive(Debug, Clone, PartialEq)]
pub enum ExprKind {
    /// `3.5e3` or `3 [m]`
    Number {
        /// Value as written, before any unit.
        value: f64,
        /// Spelling, kept for printing.
        text: String,
        /// Unit after it.
        unit: Option<WrittenUnit>,
    },
    /// A name.
    Name(String),
    /// `p[i - 1]`: the array, a name, and the index. Of `T[i][j]` the array is `T[i]`.
    Element(Box<Expr>, Box<Expr>),
    /// `sum(m[i] for i in 1..N)`
    Reduce(Box<Reduction>),
    /// `(0.1, 0.2)`: the values of an array's elements, or of its rows; allowed only there.
    List(Vec<Expr>),
    /// `f(a, b)`, `der(x)` included.
    Call {
        /// The function's name.
        function: Name,
        /// Arguments.
        arguments: Vec<Expr>,
    },
    /// `(e)`
    Group(Box<Expr>),
    /// `-e`
    Negate(Box<Expr>),
    /// `a + b - c`: two terms or more, the first with [`Sign::Plus`].
    Sum(Vec<(Sign, Expr)>),
    /// `a * b / c`: two factors or more, the first with [`FactorSide::Times`].
    Product(Vec<(FactorSide, Expr)>),
    /// `a ^ b`
    Power(Box<Expr>, Box<Expr>),
    /// `if c then a else b`
    If(Box<Expr>, Box<Expr>, Box<Expr>),
    /// `a < b`
    Compare(Comparison, Box<Expr>, Box<Expr>),
    /// `a and b and c`: two or more.
    And(Vec<Expr>),
    /// `a or b or c`: two or more.
    Or(Vec<Expr>),
    /// `not c`
    Not(Box<Expr>),
}

/// `sum(m[i]*g for i in 1..N)`
#[derive(Debug, Clone, PartialEq)]
pub struct Reduction {
    /// The operation on the values.
    pub kind: ReductionOperation,
    /// Place of its keyword.
    pub word: Span,
    /// The value for each index.
    pub body: Expr,
    /// The indices, the first outermost; at least one.
    pub counters: Vec<LoopCounter>,
}

/// The operation of a [`Reduction`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReductionOperation {
    /// `sum`
    Sum,
    /// `prod`
    Product,
    /// `min`
    Least,
    /// `max`
    Greatest,
    /// `mean`
    Mean,
}

impl ReductionOperation {
    /// All of them, each with its word.
    pub const ALL: [(&'static str, ReductionOperation); 5] = [
        ("sum", ReductionOperation::Sum),
        ("prod", ReductionOperation::Product),
        ("min", ReductionOperation::Least),
        ("max", ReductionOperation::Greatest),
        ("mean", ReductionOperation::Mean),
    ];

    /// Its noun in messages.
    pub fn noun(self) -> &'static str {
        match self {
            ReductionOperation::Sum => "the sum",
            ReductionOperation::Product => "the product",
            ReductionOperation::Least => "the least",
            ReductionOperation::Greatest => "the greatest",
            ReductionOperation::Mean => "the mean",
        }
    }

    /// Its word.
    pub fn word(self) -> &'static str {
        Self::ALL.iter().find(|(_, kind)| *kind == self).map_or("", |(word, _)| word)
    }
}

/// Sign of a term.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sign {
    /// `+`
    Plus,
    /// `-`
    Minus,
}

/// How a factor enters a product.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FactorSide {
    /// `*`
    Times,
    /// `/`
    Over,
}

/// `<`, `<=`, `>`, `>=`; real numbers are not compared for equality.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Comparison {
    /// `<`
    Less,
    /// `<=`
    LessEqual,
    /// `>`
    Greater,
    /// `>=`
    GreaterEqual,
}
