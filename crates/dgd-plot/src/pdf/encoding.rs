//! Character codes in the fonts that every PDF reader has.
//!
//! Sources: ISO 32000-1:2008, annexes D.2 and D.5; widths from Adobe's metrics of Symbol.

/// The font and code of a character.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum CharCode {
    /// Helvetica, whose widths are those of the embedded font.
    Latin(u8),
    /// Symbol, with the width there in thousandths of the size.
    Symbol(u8, f64),
}

/// The code of a character; `None` if neither font has it.
pub(super) fn code(character: char) -> Option<CharCode> {
    match character {
        ' '..='~' | '\u{a0}'..='\u{ff}' => {
            u8::try_from(u32::from(character)).ok().map(CharCode::Latin)
        }
        _ => {
            let latin = LATIN.iter().find(|(known, _)| *known == character);
            let symbol = || SYMBOL.iter().find(|(known, ..)| *known == character);
            latin
                .map(|(_, code)| CharCode::Latin(*code))
                .or_else(|| symbol().map(|(_, code, width)| CharCode::Symbol(*code, *width)))
        }
    }
}

/// Codes of WinAnsiEncoding that differ from Unicode.
static LATIN: [(char, u8); 16] = [
    ('€', 0x80),
    ('…', 0x85),
    ('†', 0x86),
    ('‰', 0x89),
    ('Š', 0x8a),
    ('Œ', 0x8c),
    ('‘', 0x91),
    ('’', 0x92),
    ('“', 0x93),
    ('”', 0x94),
    ('•', 0x95),
    ('–', 0x96),
    ('—', 0x97),
    ('™', 0x99),
    ('š', 0x9a),
    ('œ', 0x9c),
];

static SYMBOL: [(char, u8, f64); 57] = [
    ('Α', b'A', 722.0),
    ('Β', b'B', 667.0),
    ('Γ', b'G', 603.0),
    ('Δ', b'D', 612.0),
    ('Ε', b'E', 611.0),
    ('Ζ', b'Z', 611.0),
    ('Η', b'H', 722.0),
    ('Θ', b'Q', 741.0),
    ('Ι', b'I', 333.0),
    ('Κ', b'K', 722.0),
    ('Λ', b'L', 686.0),
    ('Μ', b'M', 889.0),
    ('Ν', b'N', 722.0),
    ('Ξ', b'X', 645.0),
    ('Ο', b'O', 722.0),
    ('Π', b'P', 768.0),
    ('Ρ', b'R', 556.0),
    ('Σ', b'S', 592.0),
    ('Τ', b'T', 611.0),
    ('Υ', b'U', 690.0),
    ('Φ', b'F', 763.0),
    ('Χ', b'C', 722.0),
    ('Ψ', b'Y', 795.0),
    ('Ω', b'W', 768.0),
    ('α', b'a', 631.0),
    ('β', b'b', 549.0),
    ('γ', b'g', 411.0),
    ('δ', b'd', 494.0),
    ('ε', b'e', 439.0),
    ('ζ', b'z', 494.0),
    ('η', b'h', 603.0),
    ('θ', b'q', 521.0),
    ('ι', b'i', 329.0),
    ('κ', b'k', 549.0),
    ('λ', b'l', 549.0),
    ('μ', b'm', 576.0),
    ('ν', b'n', 521.0),
    ('ξ', b'x', 493.0),
    ('ο', b'o', 549.0),
    ('π', b'p', 549.0),
    ('ρ', b'r', 549.0),
    ('ς', b'V', 439.0),
    ('σ', b's', 603.0),
    ('τ', b't', 439.0),
    ('υ', b'u', 576.0),
    ('φ', b'f', 521.0),
    ('χ', b'c', 549.0),
    ('ψ', b'y', 686.0),
    ('ω', b'w', 686.0),
    ('−', 0x2d, 549.0),
    ('∂', 0xb6, 494.0),
    ('√', 0xd6, 549.0),
    ('∞', 0xa5, 713.0),
    ('≤', 0xa3, 549.0),
    ('≥', 0xb3, 549.0),
    ('≈', 0xbb, 549.0),
    ('→', 0xae, 987.0),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sign_of_figures_has_a_code_of_its_own() {
        let mut seen = Vec::new();
        for character in "azAZ09αωΓΩτ∂×·°−±√²³µ…–[](){}_^*/.,'≤→".chars()
        {
            let code = code(character).unwrap_or_else(|| panic!("{character} has no code"));
            assert!(!seen.contains(&code), "{character}");
            seen.push(code);
        }
        assert_eq!(code('ё'), None);
        assert_eq!(code('\u{90}'), None, "a control character");
    }
}
