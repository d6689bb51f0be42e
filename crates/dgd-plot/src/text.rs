//! Text with subscripts and superscripts, and its creation from names and units.

/// A line of text with subscripts and superscripts.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct MathText {
    /// No run is empty and neighbours differ in script.
    runs: Vec<TextRun>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct TextRun {
    pub(crate) text: String,
    pub(crate) script: Script,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Script {
    Base,
    Subscript,
    Superscript,
}

/// Maximum number of characters after the symbol of a name, including underscores, that become a subscript.
const LONGEST_SUBSCRIPT: usize = 9;

impl MathText {
    /// Plain text.
    pub fn plain(text: &str) -> MathText {
        let mut line = MathText::default();
        line.push(text, Script::Base);
        line
    }

    /// A name typeset as in papers: `h_r` with subscript r, `c0` with subscript 0, `tau_b` with τ, an index as a
    /// subscript.
    ///
    /// A subscript is short and belongs to a symbol of one or two letters or a Greek letter's name: `pump_speed` and
    /// `q_of_the_third_pump` stay unchanged, as does the path of a dotted name.
    pub fn name(name: &str) -> MathText {
        // An argument, as in x(0), belongs to the whole name.
        if let Some(at) = name.find('(') {
            return MathText::name(&name[..at]).then(MathText::plain(&name[at..]));
        }
        let (path, last) = match name.rfind('.') {
            Some(dot) => name.split_at(dot + 1),
            None => ("", name),
        };
        let (word, index) = match last.find('[') {
            Some(bracket) => (&last[..bracket], last[bracket + 1..].trim_end_matches(']')),
            None => (last, ""),
        };
        let mut parts = word.split('_');
        let first = parts.next().unwrap_or_default();
        let letters = first.trim_end_matches(|c: char| c.is_ascii_digit());
        let is_short = word.chars().count() - first.chars().count() <= LONGEST_SUBSCRIPT;
        let is_symbol = (1..=2).contains(&letters.chars().count());
        let symbol = greek(letters).or(is_symbol.then_some(letters)).filter(|_| is_short);

        let mut text = MathText::plain(path);
        let Some(symbol) = symbol else {
            text.push(word, Script::Base);
            text.push(index, Script::Subscript);
            return text;
        };
        text.push(symbol, Script::Base);
        let number = &first[letters.len()..];
        let subscripts = [number].into_iter().chain(parts).chain([index]);
        for (i, part) in subscripts.filter(|part| !part.is_empty()).enumerate() {
            if i > 0 {
                text.push(",", Script::Subscript);
            }
            text.push(greek(part).unwrap_or(part), Script::Subscript);
        }
        text
    }

    /// The partial derivative ∂of/∂by of two names.
    pub fn derivative(of: &str, by: &str) -> MathText {
        MathText::plain("∂")
            .then(MathText::name(of))
            .then(MathText::plain("/∂"))
            .then(MathText::name(by))
    }

    /// A unit typeset as in papers: `m^3/s` with a superscript 3, `Pa*s` with a raised dot.
    pub fn unit(unit: &str) -> MathText {
        let mut text = MathText::default();
        let mut rest = unit.trim();
        while let Some(first) = rest.chars().next() {
            let length = match first {
                '^' => {
                    let (exponent, length) = exponent(&rest[1..]);
                    text.push(&exponent.replace('-', "−"), Script::Superscript);
                    1 + length
                }
                '*' => {
                    text.push("·", Script::Base);
                    1
                }
                _ if first.is_alphabetic() => {
                    let length = rest.find(|c: char| !c.is_alphabetic()).unwrap_or(rest.len());
                    text.push(unit_symbol(&rest[..length]), Script::Base);
                    length
                }
                _ => {
                    text.push(&rest[..first.len_utf8()], Script::Base);
                    first.len_utf8()
                }
            };
            rest = &rest[length..];
        }
        text
    }

    /// Appends a unit in brackets; `[–]` stands for a dimensionless quantity.
    #[must_use]
    pub fn with_unit(self, unit: &str) -> MathText {
        let unit = match unit.trim() {
            "" | "1" => MathText::plain("–"),
            unit => MathText::unit(unit),
        };
        let opening = if self.is_empty() { "[" } else { " [" };
        self.then(MathText::plain(opening)).then(unit).then(MathText::plain("]"))
    }

    /// Joins two texts.
    #[must_use]
    pub fn then(mut self, next: MathText) -> MathText {
        for run in next.runs {
            self.push(&run.text, run.script);
        }
        self
    }

    /// Whether there is nothing to draw.
    pub fn is_empty(&self) -> bool {
        self.runs.is_empty()
    }

    /// The text without markup: `q_a`, `m³/s`.
    pub fn to_plain(&self) -> String {
        let run = |run: &TextRun| match run.script {
            Script::Base => run.text.clone(),
            Script::Subscript => format!("_{}", run.text),
            Script::Superscript => {
                let raised: Option<String> = run.text.chars().map(raised).collect();
                raised.unwrap_or_else(|| format!("^{}", run.text))
            }
        };
        self.runs.iter().map(run).collect()
    }

    /// The text as markup of a web page.
    pub fn to_html(&self) -> String {
        let run = |run: &TextRun| {
            let text = escaped(&run.text);
            match run.script {
                Script::Base => text,
                Script::Subscript => format!("<sub>{text}</sub>"),
                Script::Superscript => format!("<sup>{text}</sup>"),
            }
        };
        self.runs.iter().map(run).collect()
    }

    pub(crate) fn runs(&self) -> &[TextRun] {
        &self.runs
    }

    pub(crate) fn push(&mut self, text: &str, script: Script) {
        if text.is_empty() {
            return;
        }
        // A line break or a tab would be drawn as a missing glyph and is not allowed in XML.
        let clean = text.chars().map(|c| if c.is_control() { ' ' } else { c });
        match self.runs.last_mut() {
            Some(last) if last.script == script => last.text.extend(clean),
            _ => self.runs.push(TextRun { text: clean.collect(), script }),
        }
    }
}

impl From<&str> for MathText {
    fn from(text: &str) -> MathText {
        MathText::plain(text)
    }
}

/// A digit or a sign as a superscript.
fn raised(c: char) -> Option<char> {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    match c {
        '−' | '-' => Some('⁻'),
        _ => c.to_digit(10).map(|digit| DIGITS[digit as usize]),
    }
}

/// Escapes text between tags.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// The exponent at the start of `text`, without its parentheses, and its length there.
fn exponent(text: &str) -> (&str, usize) {
    if let Some(inner) = text.strip_prefix('(')
        && let Some(close) = inner.find(')')
    {
        return (&inner[..close], close + 2);
    }
    let sign = usize::from(text.starts_with(['-', '+']));
    let digits = text[sign..].find(|c: char| !c.is_ascii_digit() && c != '.');
    let length = digits.map_or(text.len(), |digits| sign + digits);
    (&text[..length], length)
}

fn unit_symbol(unit: &str) -> &str {
    match unit {
        "degC" => "°C",
        "deg" => "°",
        "ohm" => "Ω",
        _ => unit,
    }
}

fn greek(name: &str) -> Option<&'static str> {
    GREEK.iter().find(|(spelling, _)| *spelling == name).map(|(_, letter)| *letter)
}

/// Greek letters that differ from all Latin ones.
static GREEK: &[(&str, &str)] = &[
    ("alpha", "α"),
    ("beta", "β"),
    ("gamma", "γ"),
    ("delta", "δ"),
    ("epsilon", "ε"),
    ("zeta", "ζ"),
    ("eta", "η"),
    ("theta", "θ"),
    ("kappa", "κ"),
    ("lambda", "λ"),
    ("mu", "µ"),
    ("nu", "ν"),
    ("xi", "ξ"),
    ("pi", "π"),
    ("rho", "ρ"),
    ("sigma", "σ"),
    ("tau", "τ"),
    ("phi", "φ"),
    ("chi", "χ"),
    ("psi", "ψ"),
    ("omega", "ω"),
    ("Gamma", "Γ"),
    ("Delta", "Δ"),
    ("Theta", "Θ"),
    ("Lambda", "Λ"),
    ("Xi", "Ξ"),
    ("Pi", "Π"),
    ("Sigma", "Σ"),
    ("Phi", "Φ"),
    ("Psi", "Ψ"),
    ("Omega", "Ω"),
];

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Scripts written as in TeX.
    pub(crate) fn show(text: &MathText) -> String {
        text.runs
            .iter()
            .map(|run| match run.script {
                Script::Base => run.text.clone(),
                Script::Subscript => format!("_{{{}}}", run.text),
                Script::Superscript => format!("^{{{}}}", run.text),
            })
            .collect()
    }

    #[test]
    fn names_become_symbols_with_subscripts() {
        for (name, shown) in [
            ("x", "x"),
            ("a_r", "a_{r}"),
            ("M_abc", "M_{abc}"),
            ("c0", "c_{0}"),
            ("F2_in", "F_{2,in}"),
            ("tau_b_max", "τ_{b,max}"),
            ("rho", "ρ"),
            ("c_rho", "c_{ρ}"),
            ("p[3]", "p_{3}"),
            ("T_w[i+1]", "T_{w,i+1}"),
            ("pump.w", "pump.w"),
            ("pump.q_in", "pump.q_{in}"),
            ("pump_speed", "pump_speed"),
            ("q_of_the_pump", "q_of_the_pump"),
            ("level2", "level2"),
            ("level[4]", "level_{4}"),
            ("_x", "_x"),
            ("x_", "x"),
            ("", ""),
            ("2x", "2x"),
            ("[", ""),
            ("a]b[c]d", "a]b_{c]d}"),
        ] {
            assert_eq!(show(&MathText::name(name)), shown, "{name}");
        }
        assert_eq!(show(&MathText::derivative("a_r", "c0")), "∂a_{r}/∂c_{0}");
    }

    #[test]
    fn units_get_exponents_and_dots() {
        for (unit, shown) in [
            ("m^3/s", "m^{3}/s"),
            ("Pa*s^2/m^6", "Pa·s^{2}/m^{6}"),
            ("kg*m^-2", "kg·m^{−2}"),
            ("Pa^(1/2)", "Pa^{1/2}"),
            ("degC", "°C"),
            ("m/(m^3/kg)", "m/(m^{3}/kg)"),
            ("m^", "m"),
            ("m^(2", "m(2"),
            ("%", "%"),
        ] {
            assert_eq!(show(&MathText::unit(unit)), shown, "{unit}");
        }
        assert_eq!(show(&MathText::name("q_a").with_unit("1")), "q_{a} [–]");
        assert_eq!(show(&MathText::default().with_unit("m")), "[m]");
        assert_eq!(MathText::unit("m^3/<s>").to_html(), "m<sup>3</sup>/&lt;s&gt;");
        assert_eq!(MathText::name("q_a").with_unit("m^3/s").to_plain(), "q_a [m³/s]");
        assert_eq!(MathText::unit("Pa^(1/2)*m^-2").to_plain(), "Pa^1/2·m⁻²");
    }
}
