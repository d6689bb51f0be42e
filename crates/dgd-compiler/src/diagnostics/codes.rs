//! The errors of the compiler, one entry each.
//!
//! The first digit is the stage: 1 syntax, 2 names, 3 units, 4 structure, 5 values, 6 data files. To add an error, add
//! its entry here and report it where it is detected; `dgd explain` and the documentation read this table.

use std::fmt;

/// The description of one kind of error.
#[derive(Debug, Clone, Copy)]
pub struct CodeInfo {
    /// The code itself.
    pub code: Code,
    /// Its spelling for users, such as `E301`.
    pub text: &'static str,
    /// A short title.
    pub title: &'static str,
    /// A paragraph, then an example of the error under `Wrong:` and its correction under `Right:`, both indented by
    /// four blanks.
    pub explanation: &'static str,
}

impl Code {
    /// The entry of this code.
    pub fn info(self) -> &'static CodeInfo {
        // One macro writes the enumeration and the table, in one order.
        &CODES[self as usize]
    }

    /// Whether it is about a file of data: stage 6.
    pub fn is_of_data(self) -> bool {
        self.info().text.starts_with("E6")
    }

    /// The code with this spelling, e.g. `E301`; case does not matter.
    pub fn from_text(text: &str) -> Option<Code> {
        CODES.iter().map(|info| info.code).find(|code| code.to_string().eq_ignore_ascii_case(text))
    }
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.info().text)
    }
}

/// Writes the enumeration and the table from the same entries, so that neither lacks a row.
macro_rules! codes {
    ($($code:ident $text:literal $title:literal $explanation:literal)*) => {
        /// The kind of error.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Code {
            $(#[doc = $title] $code,)*
        }

        /// Every code, in ascending order.
        pub static CODES: &[CodeInfo] = &[
            $(CodeInfo { code: Code::$code, text: $text, title: $title, explanation: $explanation },)*
        ];
    };
}

codes! {
UnexpectedCharacter "E101" "unexpected character" "
A character that begins nothing in the language, such as `;`, `&` or a typographic minus. Names are
made of letters (Greek ones included), digits and `_`, and begin with a letter. Signs such as `%`,
`°C` and `²` belong between unit brackets.

Wrong:

    let volume = 3 [m^3];

Right:

    let volume = 3 [m^3]
"
MalformedNumber "E102" "malformed number" "
A number is written with digits before the decimal point and, if there is a point, digits after it;
an exponent has digits, too. A number is not followed by a letter: products need `*`.

Wrong:

    constant half = .5
    let doubled = 2half

Right:

    constant half = 0.5
    let doubled = 2*half
"
NumberOutOfRange "E103" "number out of range" "
Numbers are kept as 64-bit floating point, which reaches from about 1e-308 to 1e308. A number outside
of it would silently become infinite or zero.

Wrong:

    constant huge = 1e999

Right:

    constant huge = 1e300
"
UnclosedText "E104" "unclosed text or unit" r#"
A text begins and ends with `"` on one line, and a unit or an index begins with `[` and ends with `]`
on one line.

Wrong:

    constant g [m/s^2 = 9.81

Right:

    constant g [m/s^2] = 9.81
"#
UnexpectedToken "E105" "something else was expected" "
The text breaks the grammar here; the message names the expected words. Each item is on
its own line. It continues on the next line only while a parenthesis is open, or when the line
ends in a comma, a colon or an operator.

Wrong:

    constant a = 1
    let b = 2 a

Right:

    constant a = 1
    let b = 2*a
"
NestedTooDeep "E106" "nested too deep" "
Parentheses, calls, powers, signs, `if`s and blocks may nest 128 deep. Name a part of the expression
with `let`.

Wrong:

    let a = ((((…((b + c))…))))

Right:

    let part = ((b + c))
    let a = ((part))
"
MisplacedAttribute "E107" "attribute not allowed here" "
Attributes follow a value, separated by commas: a parameter takes `in`, `log`, `fixed`, `nominal` and
`prior`; a state or unknown takes `fixed` and `nominal`; an input takes `hold` or `linear`; an output
takes `noise`.

Wrong:

    input q [lpm] log

Right:

    input q [lpm] linear
"
RepeatedAttribute "E108" "attribute given twice" "
An attribute is given once. `hold` and `linear` exclude each other.

Wrong:

    parameter c = 1 fixed, fixed

Right:

    parameter c = 1 fixed
"
UnreadableComparison "E109" "comparison that cannot be read" "
A comparison has two sides, and comparisons are joined by `and` and `or`. There are `<`, `<=`, `>`
and `>=`; real numbers are not compared for equality.

Wrong:

    let inside = if 0 < x < 1 then 1 else 0

Right:

    let inside = if 0 < x and x < 1 then 1 else 0
"
MissingValue "E111" "missing value" "
A constant, a parameter, a `let` and a function need a value behind `=`. For an unknown or an input,
which the equations or the data determine, none is needed.

Wrong:

    constant g [m/s^2]

Right:

    constant g [m/s^2] = 9.81
"
EmptyFile "E112" "nothing to read" "
The file holds no item, only blanks or comments, or it is larger than the 2 GiB that can be read.

Wrong:

    # to be written

Right:

    constant g [m/s^2] = 9.81
"
NoModelLine "E113" "no model line" "
A file without a `model` line is a library of constants, `let`s and functions that models import. It
cannot be run or fitted itself.

Wrong:

    state h [m] = 1
    equation level: der(h) = 0 [m/s]

Right:

    model tank
    state h [m] = 1
    equation level: der(h) = 0 [m/s]
"
MisplacedModelLine "E114" "model line out of place" "
`model NAME` is the first item of its file, and there is one.

Wrong:

    constant g [m/s^2] = 9.81
    model tank

Right:

    model tank
    constant g [m/s^2] = 9.81
"
UnmatchedBracket "E115" "brackets do not match" "
Every `(` and `{` is closed by its own `)` or `}`. A parenthesis may stay open over several lines,
but not into the next item.

Wrong:

    let a = 2*(1 + 3

Right:

    let a = 2*(1 + 3)
"
NotAnItem "E116" "not the beginning of an item" "
Every item begins with its keyword: `constant`, `parameter`, `input`, `state`,
`unknown`, `let`, `function`, `equation`, `variant`, `output` or `import`.

Wrong:

    A = 3 [m^2]

Right:

    let A = 3 [m^2]
"
MisplacedUnit "E117" "unit out of place" "
In an expression a unit follows a number only: a name has the unit of its declaration, and a bracketed
expression that of its parts.

Wrong:

    constant width [m] = 2
    let area = width [m] * 3 [m]

Right:

    constant width [m] = 2
    let area = width * 3 [m]
"
DetachedDoc "E118" "doc comment that belongs to nothing" "
`///` above an item or at the end of its line belongs to that item and reaches the reports. A remark
that belongs to nothing begins with `#`.

Wrong:

    constant g [m/s^2] = 9.81

    /// End of the constants.

Right:

    constant g [m/s^2] = 9.81

    # End of the constants.
"
ReservedWord "E119" "word that cannot be a name" "
`and`, `or`, `not`, `if`, `then` and `else` are words of expressions everywhere, and `delay` is
a function of the language. Other keywords may be names.

Wrong:

    let else = 3

Right:

    let otherwise = 3
"
ClauseOutsideEffect "E120" "clause outside an effect" "
`kind`, `form`, `null`, `replace` and `add` describe the change that an effect makes. They belong to a file
that begins with `effect NAME on MODEL` or `effect NAME(y: output)`, and not within a block of it.

Wrong:

    model tank
    replace q_out by 2*q_out

Right:

    effect larger_outlet on tank
    kind plant
    replace q_out by 2*q_out
"
DeclarationInMode "E130" "declaration in a mode" "
A mode holds the equations that hold while it lasts, and nothing else. States, unknowns, `let`s and
outputs exist in every mode; declare them outside.

Wrong:

    state h [m] = 1
    modes tank {
      draining {
        parameter rate [m/s] = 0.1
        equation level: der(h) = -rate
      }
      empty { equation level: h = 0 [m] }
      draining -> empty when h falls below 0 [m]
    }

Right:

    state h [m] = 1
    parameter rate [m/s] = 0.1
    modes tank {
      draining { equation level: der(h) = -rate }
      empty    { equation level: h = 0 [m] }
      draining -> empty when h falls below 0 [m]
    }
"
ItemInLoop "E131" "item that a loop cannot hold" "
A loop holds equations, start equations, `let`s and what inputs of parts are, whose names end in the
loop's index between brackets, and `saturate`, `when` and `every`. Arrays and everything else are
declared in front of it. Of a part whose model has `modes` there is only one.

Wrong:

    size N = 10
    for i in 1..N {
      state x = 0
      equation decay: der(x) = -x / 1 [s]
    }

Right:

    size N = 10
    state x[1..N] = 0
    for i in 1..N { equation decay[i]: der(x[i]) = -x[i] / 1 [s] }
"
UnknownName "E201" "unknown name" "
The name is not declared in the model, in its imports, or in the variant's chosen branch. Names
are case-sensitive.

Wrong:

    constant rho [kg/m^3] = 1120
    let weight = Rho * 9.81 [m/s^2]

Right:

    constant rho [kg/m^3] = 1120
    let weight = rho * 9.81 [m/s^2]
"
DuplicateName "E202" "name defined twice" "
Constants, parameters, inputs, unknowns, `let`s and functions share one set of names; equations have
labels of their own. Only an output may bear the name of the unknown that it reads.

Wrong:

    constant A [m^2] = 1
    let A = 2 [m^2]

Right:

    constant A [m^2] = 1
    let A_small = 2 [m^2]
"
UnknownFunction "E203" "unknown function" "
No function of this name is built in or defined by `function`. Products need `*`: `a(b + c)` calls a
function `a`.

Wrong:

    let x = sine(0.5)

Right:

    let x = sin(0.5)
"
ArgumentCount "E204" "wrong number of arguments" "
A function is called with as many arguments as it has been defined with.

Wrong:

    function head(w, q) = w^2 - q
    let h = head(0.5)

Right:

    function head(w, q) = w^2 - q
    let h = head(0.5, 0.1)
"
MisusedName "E205" "name cannot be used here" "
The name exists, but what it stands for has no place here: an output is read from the model and does
not enter its equations, a number is not called, and a function is not used without arguments.

Wrong:

    state h [m] = 1
    equation level: der(h) = -leak
    output leak [m/s] = 0.1 [1/s] * h

Right:

    state h [m] = 1
    let leak = 0.1 [1/s] * h
    equation level: der(h) = -leak
    output leak_rate [m/s] = leak
"
CircularDefinition "E206" "definition that depends on itself" "
A `let`, a constant or a function leads back to itself. What two quantities determine together is
written with `unknown` and `equation`.

Wrong:

    let a = b + 1
    let b = 2*a

Right:

    unknown a
    unknown b
    equation first:  a = b + 1
    equation second: b = 2*a
"
UnknownVariant "E207" "unknown variant or choice" "
The model has no variant of this name, or the variant has no such choice. For a model with
`variant flow`, whose choices are `static` and `dynamic`:

Wrong:

    flow=stationary

Right:

    flow=static
"
UnusableImport "E208" "import that cannot be used" r#"
The imported file cannot be found or read, or is neither a model nor a library of constants, `let`s and
functions. Paths are relative to the importing file.

Wrong:

    import "effects/leak.dgd"

Right:

    import "friction.dgd"
"#
NoDerivative "E209" "derivative of something that has none" "
`der(x)` needs the name of a `state`: neither an expression, nor an input, nor an `unknown`.

Wrong:

    unknown h [m] = 50
    equation level: der(h) = 0 [m/s]

Right:

    state h [m] = 50
    equation level: der(h) = 0 [m/s]
"
ConditionAsNumber "E210" "condition and number confused" "
A comparison is a condition: it stands between `if` and `then`, or beside `and`, `or` and `not`.
Conditions cannot be used as numbers, nor numbers as conditions.

Wrong:

    constant level = 3
    let open = level > 2

Right:

    constant level = 3
    let open = if level > 2 then 1 else 0
"
ModelTooLarge "E211" "model that grows beyond measure when it is opened" "
Every call is replaced by its function's body and every `let` by its value. Functions that call one
another with ever new arguments, or definitions nested in hundreds of levels, would make a model too
large to compile, and so would sums and loops that are written out and have more than two million
operations. Name repeated parts with `let`, give functions fewer calls, and add up in a loop.

Wrong:

    function f1(x) = x + 1
    function f2(x) = f1(x) + f1(x + 1)
    function f3(x) = f2(x) + f2(x + 2)
    # … and so on, up to f40

Right:

    function f3(x) = 4*x + 8
"
EffectMismatch "E212" "effect that does not fit the model" "
An effect `on` one model cannot be applied to another. A template needs an argument for each of its
declared ones, and of the declared kind: an input, an output, a state, an equation or a
parameter. A name that an effect replaces must be used at the given place.

Wrong:

    effect wear on pump
    kind plant
    parameter wear [1] = 1
    null wear = 1
    replace head in no_such_equation by wear*head

Right:

    effect wear on pump
    kind plant
    parameter wear [1] = 1
    null wear = 1
    replace head in discharge by wear*head
"
IncompleteEffect "E213" "incomplete effect" "
An effect declares its kind once, `plant`, `sensor` or `input`, and changes something: `replace`
exchanges a name or an output for an expression, `add` adds to an equation. It may instead declare an
item that acts by itself, such as an `output`: other declarations alone do nothing.

Wrong:

    effect wear on pump
    parameter wear [1] = 1

Right:

    effect wear on pump
    kind plant
    parameter wear [1] = 1
    null wear = 1
    replace head by wear*head
"
ConflictingEffects "E214" "effects that exclude each other" "
Two plant effects replace the same name at the same place. Which of the two the model then follows
would depend on their order.

Wrong:

    pump_wear, pump_speed_exponent     # where both replace the pump's head

Right:

    pump_wear
"
InvalidDelay "E215" "delay that cannot be followed" "
How late an input arrives is made of constants and parameters. The delay of a state or unknown may
vary, with time, inputs, states and unknowns; then neither is late itself. Neither is below zero: only
outputs can be early.

Wrong:

    input flow [m^3/s]
    let late = delay(flow, 2 [m^3] / flow)

Right:

    input flow [m^3/s]
    unknown inflow [m^3/s]
    equation inflow: inflow = flow
    let late = delay(inflow, 2 [m^3] / flow)
"
UnknownMode "E216" "unknown mode" "
A transition leads from a mode of its `modes` block to another or to the same, and `start` names one
of them.

Wrong:

    state h [m] = 1
    modes tank {
      draining { equation level: der(h) = -0.1 [m/s] }
      empty    { equation level: h = 0 [m] }
      draining -> emtpy when h falls below 0 [m]
    }

Right:

    state h [m] = 1
    modes tank {
      draining { equation level: der(h) = -0.1 [m/s] }
      empty    { equation level: h = 0 [m] }
      draining -> empty when h falls below 0 [m]
    }
"
UnreadParameter "E217" "parameter that nothing reads" "
A parameter stands in no equation, no output and no other value. `dgd check` notes it: it may be left over, or its
name may be misspelt where it was to be read. An effect may still read it.

Wrong:

    parameter k [1/s] = 2
    parameter unread [1] = 3
    state x [1] = 1
    equation decay: der(x) = -k*x

Right:

    parameter k [1/s] = 2
    state x [1] = 1
    equation decay: der(x) = -k*x
"
UnboundInput "E220" "input of a part that is not bound" "
A part is a model, and every input that its chosen variants read must be bound: to an input of the
enclosing model, an unknown, or an output of another part. A variant that reads an unbound input
cannot be chosen.

Wrong:

    import \"tank.dgd\"
    input rain [m/s]
    part pond: tank

Right:

    import \"tank.dgd\"
    input rain [m/s]
    part pond: tank
    pond.q = rain
"
RecursiveModel "E221" "model that contains itself" "
A model is not a part of itself, neither directly nor through other parts: there would be no end to
it.

Wrong:

    model well
    part inner: well

Right:

    model field
    import \"well.dgd\"
    part north: well
    part south: well
"
NotAKnownWholeNumber "E230" "not a whole number that is known beforehand" "
Sizes, the ends of ranges and indices are whole numbers that are known before a run: numbers, sizes,
and within a loop its index, to which numbers are added. A range runs from the smaller end to the
larger.

Wrong:

    size N = 10
    parameter k = 2
    state x[1..N] = 0
    for i in 1..N { equation decay[i]: der(x[i]) = -x[k*i] / 1 [s] }

Right:

    size N = 10
    parameter k = 2
    state x[1..N] = 0
    for i in 1..N { equation decay[i]: der(x[i]) = -k*x[i] / 1 [s] }
"
IndexOutOfRange "E231" "index out of range" "
An element is read that the array does not have. Neighbours of the first and the last element need
equations of their own, or a loop that begins later or ends earlier.

Wrong:

    size N = 10
    state x[1..N] = 0
    for i in 1..N { equation chain[i]: der(x[i]) = (x[i-1] - x[i]) / 1 [s] }

Right:

    size N = 10
    state x[1..N] = 0
    equation inlet: der(x[1]) = -x[1] / 1 [s]
    for i in 2..N { equation chain[i]: der(x[i]) = (x[i-1] - x[i]) / 1 [s] }
"
ArrayAsNumber "E232" "array and single value confused" "
An array is read element by element, and only an array has elements.

Wrong:

    size N = 10
    state x[1..N] = 1
    for i in 1..N { equation decay[i]: der(x[i]) = -x / 1 [s] }

Right:

    size N = 10
    state x[1..N] = 1
    for i in 1..N { equation decay[i]: der(x[i]) = -x[i] / 1 [s] }
"
ValueCount "E233" "wrong number of values" "
An array has one value for all its elements, or a list with one for each. Of an array with several
indices the list holds a list for each value of the first.

Wrong:

    parameter k[1..3] [1/s] = (0.1, 0.2)

Right:

    parameter k[1..3] [1/s] = (0.1, 0.2, 0.3)
"
IncompatibleUnits "E301" "units that cannot be added or compared" "
Terms of a sum, sides of a comparison, and branches of an `if` must measure the same kind of quantity.
Their scales may differ: bar and psi can be added. Zero has every unit.

Wrong:

    let total = 3 [m] + 2 [s]

Right:

    let total = 3 [m] + 2 [s] * 1 [m/s]
"
UnitsOfSides "E302" "sides with different units" "
The two sides of an equation, or a value and the unit it is declared in, measure different kinds of
quantities.

Wrong:

    constant A [m^2] = 2 [m] * 3

Right:

    constant A [m^2] = 2 [m] * 3 [m]
"
PowerWithUnit "E303" "power with a unit" "
An exponent is a plain number. Where the base has a unit, the exponent must be a constant, for
otherwise the unit of the power would not be known.

Wrong:

    parameter k = 2
    let head = (3 [m])^k

Right:

    parameter k = 2
    let head = 1 [m] * (3 [m] / 1 [m])^k
"
ArgumentWithUnit "E304" "argument must be a plain number" "
Functions such as `exp`, `log` and `sin` take plain numbers, among which angles count (rad = 1).
Divide by a reference quantity first.

Wrong:

    let x = exp(3 [s])

Right:

    let x = exp(3 [s] / 10 [s])
"
UnknownUnit "E305" "unknown unit" "
The unit is not in the catalogue. Upper and lower case matter (`mPa` and `MPa` differ), and SI
prefixes are accepted only where they are in use.

Wrong:

    input q [ltr/min]

Right:

    input q [l/min]
"
MalformedUnit "E306" "malformed unit" "
A unit is a product of unit names with `*`, `/` and parentheses, read from left to right: `kg/m*s`
is (kg/m)·s. Exponents are integers or bracketed fractions: `m^2`, `s^-1`, `Pa^(1/2)`, `m²`, `m3`. A
plain number has the unit `1`.

Wrong:

    constant viscosity [Pa s] = 0.02

Right:

    constant viscosity [Pa*s] = 0.02
"
TooManyEquations "E401" "too many equations" "
There are more equations than unknowns. No unknown is left for the named equations: one of them may
repeat another, or an unknown has not been declared.

Wrong:

    state h [m] = 1
    equation level: der(h) = 0 [m/s]
    equation fixed_level: h = 1 [m]

Right:

    state h [m] = 1
    equation level: der(h) = 0 [m/s]
"
TooFewEquations "E402" "too few equations" "
There are more unknowns than equations. The unknowns named are those that no equation is left for.

Wrong:

    state h [m] = 1
    unknown q [m/s] = 0
    equation level: der(h) = q

Right:

    state h [m] = 1
    unknown q [m/s] = 0
    equation level: der(h) = q
    equation valve: q = -0.1 [1/s] * h
"
UndeterminedUnknowns "E403" "equations that do not determine the unknowns" "
There are as many equations as unknowns, but some equations share too few unknowns: they determine
those twice and others not at all.

Wrong:

    unknown a = 0
    unknown b = 0
    equation first:  a = 1
    equation second: a^2 = 1

Right:

    unknown a = 0
    unknown b = 0
    equation first:  a = 1
    equation second: a*b = 1
"
IrreducibleIndex "E404" "index that cannot be reduced" "
An equation ties states to one another, so that something else follows from its derivative with
respect to time only: a rod and its tension, a prescribed path and the force along it. The tool
differentiates such equations itself. It cannot where the derivative does not exist: where the
equation reads an input that is held, or the slope of a linear one, or a function that jumps. Nor
where the derivatives only repeat or contradict other equations.

Wrong:

    input position [m] hold
    state x [m] = 0
    state v [m/s] = 0
    equation motion: der(x) = v
    equation track:  x = position

Right:

    input position [m] linear
    state x [m] = 0
    unknown v [m/s] = 0
    equation motion: der(x) = v
    equation track:  x = position
"
EquationWithoutUnknown "E405" "equation without an unknown" "
The equation contains only constants, parameters and inputs, so that nothing can make it true. Values
are checked by a parameter's bounds.

Wrong:

    constant a = 1
    parameter b = 2
    equation same: a = b

Right:

    constant a = 1
    let b = a
"
UndeterminedDerivative "E406" "derivative that no equation gives" "
An output or a `let` reads `der(x)`, but in the chosen variant no equation contains it.

Wrong:

    input q_in [m^3/s]
    state q [m^3/s] = 0
    equation balance: q = q_in
    output slope [m^3/s^2] = der(q)

Right:

    input q_in [m^3/s]
    state q [m^3/s] = 0
    equation balance: 3 [s] * der(q) = q_in - q
    output slope [m^3/s^2] = der(q)
"
DelayedDerivative "E407" "derivative that acts late" "
An equation, a transition or a `let` that they read depends on a past value of a derivative. Only past
values of states and unknowns may act on a model: make the derivative, or the element of an array,
an unknown first.

Wrong:

    state level [m] = 1
    equation balance: der(level) = -0.1 [1/s] * level - 0.5*delay(der(level), 3 [s])

Right:

    state level [m] = 1
    unknown rate [m/s]
    equation rate:    rate = der(level)
    equation balance: der(level) = -0.1 [1/s] * level - 0.5*delay(rate, 3 [s])
"
DerivativesAtSeveralTimes "E408" "output that reads derivatives at several times" "
An output may read states, unknowns and inputs at several times. If it reads a derivative, all that it
reads must be at one time.

Wrong:

    state level [m] = 1
    equation balance: der(level) = -0.1 [1/s] * level
    output change [m/s] = der(level) - delay(der(level), 3 [s])

Right:

    state level [m] = 1
    unknown rate [m/s]
    equation rate:    rate = der(level)
    equation balance: der(level) = -0.1 [1/s] * level
    output change [m/s] = rate - delay(rate, 3 [s])
"
TooManyModes "E409" "too many combinations of modes" "
Every combination of the modes of all `modes` blocks is a system of its own, and all of them are
checked. Thirteen blocks of two modes each have 8192 combinations, more than the 4096 that are allowed.
Modes that change together belong into one block.

Wrong:

    modes pump_1  { off { equation flow_1: q_1 = 0 }  on { equation flow_1: q_1 = q_max } }
    modes pump_2  { off { equation flow_2: q_2 = 0 }  on { equation flow_2: q_2 = q_max } }
    # … and so on, up to pump_13

Right:

    input on_1
    equation flow_1: q_1 = if on_1 > 0.5 then q_max else 0
    # … and so on, up to on_13
"
BoundOfConstrainedUnknown "E410" "bound of an unknown that a constraint determines" "
A constraint between states is differentiated, and the states that it ties together move as it says.
One of them cannot stay at a bound of its own, nor can the force that keeps the constraint: the
constraint would be broken. Without the bound the model runs; a rope that goes slack is one with
`modes`, in which the constraint holds in one mode only.

Wrong:

    state h [m] = 1
    state h_2 [m] = 1
    unknown q_12 [m/s]
    equation level: der(h) = 0.01 [m/s] - q_12
    equation level_2: der(h_2) = q_12
    equation opening: h_2 = h
    saturate h <= 3 [m]

Right:

    state h [m] = 1
    let h_2 = h
    equation level: 2*der(h) = 0.01 [m/s]
    saturate h <= 3 [m]
"
DependentEquations "E411" "equations that are linearly dependent" "
Each equation has unknowns of its own to determine, and still some of them say the same of them, such as one that is a
multiple of another. `dgd check` notes it where it is so wherever it looks, with the parameters as they are; a run would
find no values to begin with. Often a flow or a force is balanced twice.

Wrong:

    state a = 1
    unknown b
    unknown c
    equation decay:  der(a) = -b / 1 [s]
    equation share:  b + c = a
    equation double: 2*b + 2*c = 2*a

Right:

    state a = 1
    unknown b
    unknown c
    equation decay: der(a) = -b / 1 [s]
    equation share: b + c = a
    equation ratio: b = 3*c
"
UnsolvableElement "E430" "derivative of an element that cannot be solved for" "
The derivative of an element may occur in one equation only, linearly, and without other derivatives.
Another equation that needs it reads an `unknown` instead. This is also the error if too many equations
of loops and elements remain to match them with unknowns.

Wrong:

    size N = 10
    state x[1..N] = 1
    equation first: der(x[1]) = -x[1] / 1 [s]
    for i in 2..N { equation next[i]: der(x[i]) + der(x[i-1]) = -x[i] / 1 [s] }

Right:

    size N = 10
    state x[1..N] = 1
    unknown rate[1..N] [1/s] = 0
    equation first: rate[1] = -x[1] / 1 [s]
    for i in 2..N { equation next[i]: rate[i] + rate[i-1] = -x[i] / 1 [s] }
    for i in 1..N { equation state_of[i]: der(x[i]) = rate[i] }
"
ElementInMode "E431" "mode that determines an element" "
Elements of arrays are determined by the same equations in all modes. A mode determines an `unknown`
that an equation of all modes reads.

Wrong:

    size N = 10
    state x[1..N] = 1
    unknown y = 1
    modes end {
      open   { equation last: x[N] = 0 }
      closed { equation last: x[N] = x[N-1] }
      open -> closed when y rises above 2
    }
    equation sum: y = x[1] + x[2]
    for i in 1..N-1 { equation decay[i]: der(x[i]) = (x[i+1] - x[i]) / 1 [s] }

Right:

    size N = 10
    state x[1..N] = 1
    unknown y = 1
    unknown at_end = 0
    modes end {
      open   { equation last: at_end = 0 }
      closed { equation last: at_end = x[N-1] }
      open -> closed when y rises above 2
    }
    equation sum: y = x[1] + x[2]
    equation last_cell: x[N] = at_end
    for i in 1..N-1 { equation decay[i]: der(x[i]) = (x[i+1] - x[i]) / 1 [s] }
"
ValueOutOfBounds "E501" "value outside its bounds" "
The value of a parameter does not lie within the bounds behind `in`.

Wrong:

    parameter c = 3 in 0 .. 1

Right:

    parameter c = 0.5 in 0 .. 1
"
ReversedBounds "E502" "bounds the wrong way round" "
The lower bound comes first and must lie below the upper one.

Wrong:

    parameter c = 0.5 in 1 .. 0

Right:

    parameter c = 0.5 in 0 .. 1
"
StartReadsUnknown "E503" "start value that depends on an unknown" "
A start value is an expression of constants, parameters and inputs, for these are known before the
unknowns are; where an input of a part is bound to a state, it is the state's start value. A `history`
is an expression of time, constants and parameters, and may bend but not jump. The condition of
`start MODE if CONDITION` may read states, too, as they start.

Wrong:

    state a = 1
    state b = 2*a
    equation first:  der(a) = 0
    equation second: der(b) = 0

Right:

    parameter a_0 = 1
    state a = a_0
    state b = 2*a_0
    equation first:  der(a) = 0
    equation second: der(b) = 0
"
ValueNotConstant "E504" "value must be known beforehand" "
Constants, bounds, `noise`, `nominal` and `prior` are finite numbers that depend on numbers and other
constants only, not on parameters, inputs or unknowns.

Wrong:

    parameter c = 1 in 0 .. d
    parameter d = 2

Right:

    constant d = 2
    parameter c = 1 in 0 .. d
"
SizeNotPositive "E505" "size that is not positive" "
`noise` is a standard deviation and `nominal` a size: both are above zero. An output without noise
simply has no `noise` attribute.

Wrong:

    constant depth [m] = 10
    output p [bar] = depth * 0.1 [bar/m]  noise 0 [bar]

Right:

    constant depth [m] = 10
    output p [bar] = depth * 0.1 [bar/m]  noise 0.01 [bar]
"
LogOfNonPositive "E506" "logarithm of a number that is not positive" "
A parameter with the attribute `log` is estimated by its logarithm, so that its value and its bounds
must be above zero.

Wrong:

    parameter c = 0 in 0 .. 1, log

Right:

    parameter c = 0.1 in 1e-3 .. 1, log
"
NoiseRelativeToOffset "E507" "noise relative to a zero of its own" "
2 % of 20 °C would be 0.4 K, and 2 % of the same temperature in °F 0.76 K. In a unit with an offset, such as
°C, °F, barg and psig, noise relative to the reading has no meaning. Nor is 0.5 °C a difference within a
formula.

Wrong:

    state T [K] = 300
    equation cooling: der(T) = -T/100 [s]
    output T [°C]  noise 0.1 [K] + 2 [%]*abs(T)

Right:

    state T [K] = 300
    equation cooling: der(T) = -T/100 [s]
    output T [K]  noise 0.1 [K] + 2 [%]*abs(T)
"
StartNotSteady "E508" "start that cannot be steady" "
`start steady` begins a run at the steady state for the inputs of its first row. A model that depends on the
time itself has none, a `modes` block does not say in which mode it is, and a `history` contradicts it.

Wrong:

    start steady

    state T [K] = 300
    equation heating: der(T) = 1 [K/s]*sin(time/1 [s]) - T/100 [s]

Right:

    start steady

    input T_room [K]
    state T [K] = 300
    equation heating: der(T) = (T_room - T)/100 [s]
"
UndeterminedStart "E509" "start equations that do not determine start values" "
Each `start equation` determines the start value of one state: of a state with `guess`, whose value is then only
where the search begins, or of one whose derivative it reads.

Wrong:

    start equation filling: A*h = 0.5 [m^3]

    constant A [m^2] = 2
    state h [m] = 1
    equation level: A*der(h) = -0.01 [m^2/s]*h

Right:

    start equation filling: A*h = 0.5 [m^3]

    constant A [m^2] = 2
    state h [m] = 1  guess
    equation level: A*der(h) = -0.01 [m^2/s]*h
"
BoundReadsUnknown "E510" "bound that follows an unknown" "
`saturate` keeps an unknown within a bound that is made of parameters, constants, inputs and time.

Wrong:

    state h [m] = 1
    state h_2 [m] = 1
    equation level: der(h) = 0.01 [m/s]
    equation level_2: der(h_2) = 0.01 [m/s]
    saturate h <= h_2

Right:

    parameter rim [m] = 2
    state h [m] = 1
    equation level: der(h) = 0.01 [m/s]
    saturate h <= rim
"
VaryingPeriod "E511" "period that varies" "
`every` acts at the times 0, T, 2 T and so on. T is made of parameters and constants.

Wrong:

    state h [m] = 1
    held u [%] = 50
    equation level: der(h) = 0.01 [m/s]
    every h*10 [s/m] { reset u = 60 }

Right:

    parameter T [s] = 10
    state h [m] = 1
    held u [%] = 50
    equation level: der(h) = 0.01 [m/s]
    every T { reset u = 60 }
"
InvalidTablePoints "E512" "points that make no table" "
A table has points at two places at least. Two points at one abscissa that follow each other are a step: up to there
the first of them holds, and from there on the second. There cannot be three, nor the same point twice.
`pchip` needs values that are known before a run; those that are fitted are joined by straight lines, `linear`,
or by a spline, `natural`.

Wrong:

    table head(q [lpm]) [m] = (0, 305), (1200, 301), (1200, 301)

Right:

    table head(q [lpm]) [m] = (0, 305), (1200, 301), (2400, 286)
"
ArgumentBeyondTable "E513" "argument beyond a table" "
A table may not be read beyond its first and last point, unless it says `beyond hold`, to go on with the value at
the end, or `beyond extend`, to go on with the slope there. A table that a loop reads must say one of them,
because the arguments of a loop's rows are not monitored.

Wrong:

    table head(q [lpm]) [m] = (0, 305), (1200, 301), (2400, 286)
    let shut_in = head(-1 [lpm])

Right:

    table head(q [lpm]) [m] = (0, 305), (1200, 301), (2400, 286) beyond extend
    let shut_in = head(-1 [lpm])
"
SmoothWithoutFittedValues "E514" "`smooth` of values that are not fitted" "
`smooth` is a prior for the distance of each point of a table from the line between its neighbours. The
table needs one argument, at least three points, and some values that are parameters, or sums of
parameters with constant factors; the others are constants.

Wrong:

    table head(q [lpm]) [m] = (0, 305), (1200, 301), (2400, 286) smooth 1

Right:

    parameter shut_in [m] = 305
    parameter middle [m] = 301
    table head(q [lpm]) [m] = (0, shut_in), (1200, middle), (2400, 286) linear, smooth 1
"
UnreadableFile "E601" "file that cannot be read" "
The file does not exist, may not be read, is empty, or is not text in UTF-8.

Wrong:

    missing.csv

Right:

    recording.csv
"
NoTimeColumn "E602" "no time column" "
The first column of a recording is `time [s]`.

Wrong:

    t,q_in [lpm]
    0,300

Right:

    time [s],q_in [lpm]
    0,300
"
NoInputColumn "E603" "no column for an input" "
Every input of the model needs a column of its name.

Wrong:

    time [s],q [lpm]
    0,300

Right:

    time [s],q_in [lpm]
    0,300
"
IncompatibleColumnUnit "E604" "column with another kind of unit" "
A column is converted to the unit that the model declares, which is possible only between units of
one kind.

Wrong:

    time [s],q_in [bar]
    0,300

Right:

    time [s],q_in [lpm]
    0,300
"
TimeRunsBackwards "E605" "time runs backwards" "
Rows are in the order of time.

Wrong:

    time [s],q_in [lpm]
    1,300
    0,310

Right:

    time [s],q_in [lpm]
    0,310
    1,300
"
DifferingReplicates "E606" "replicates with other inputs" "
Two rows with one time stamp are the values left and right of a jump. Three or more are replicates: readings of
one moment, in which all inputs are the same.

Wrong:

    time [s],q_in [lpm]
    1,300
    1,310
    1,320

Right:

    time [s],q_in [lpm]
    1,300
    1,320
"
NotANumber "E607" "not a number" r#"
A cell holds a number with a decimal point, or nothing or `NaN` where the value is missing.

Wrong:

    time [s],p [bar]
    0,"1,5"

Right:

    time [s],p [bar]
    0,1.5
"#
MissingInputValue "E608" "missing value of an input" "
Outputs may have gaps, inputs may not: the model needs them at every time. Fill the gap, or cut the
recording.

Wrong:

    time [s],q_in [lpm]
    0,300
    1,

Right:

    time [s],q_in [lpm]
    0,300
    1,300
"
MalformedHeader "E609" "malformed header" "
A column is headed `name [unit]`, with `[1]` for a plain number, and no name occurs twice.

Wrong:

    time [s],q_in
    0,300

Right:

    time [s],q_in [lpm]
    0,300
"
RowLength "E610" "row of another length" "
Every row has as many cells as the header.

Wrong:

    time [s],q_in [lpm]
    0,300,1

Right:

    time [s],q_in [lpm]
    0,300
"
UnknownColumn "E611" "column the model does not know" "
The column bears the name of no input and no output of the model. It is named once and not used.

Wrong:

    time [s],Q_in [lpm]
    0,300

Right:

    time [s],q_in [lpm]
    0,300
"
NoRows "E612" "no rows" "
The file has a header and nothing below it.

Wrong:

    time [s],q_in [lpm]

Right:

    time [s],q_in [lpm]
    0,300
"
UnknownSetColumn "E613" "set of something else" "
A column of a table of sets has the name of neither a parameter nor a state. Values that a set does not
have are the model's, so a misspelt column would go unnoticed. Constants are part of the compiled model:
declare a value that changes from set to set as a `parameter`, here `c0`.

Wrong:

    C0 [m]
    270
    280

Right:

    c0 [m]
    270
    280
"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_in_order_and_every_entry_has_both_examples() {
        assert!(CODES.is_sorted_by(|a, b| a.code.to_string() < b.code.to_string()));
        for info in CODES {
            assert_eq!(info.code.info().title, info.title);
            assert_eq!(Code::from_text(&info.code.to_string().to_lowercase()), Some(info.code));
            let wrong = info.explanation.find("\nWrong:\n\n    ");
            let right = info.explanation.find("\nRight:\n\n    ");
            assert!(wrong.is_some() && wrong < right, "{}", info.code);
        }
    }
}
