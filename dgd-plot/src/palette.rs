//! Which colour stands for what: the one table of it.
//!
//! What means the same has the same colour in every panel of every figure. What has no such
//! meaning is one of several alike, and takes the colour of its place among them.

use crate::figure::{Panel, Style};
use crate::scene::{Colour, Pen};

/// What a series stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Meaning {
    /// One of several alike, whose colour follows from its place among them in its panel.
    #[default]
    OneOfSeveral,
    /// One of several alike that has this place in every panel of the figure.
    Variant(usize),
    /// Recorded.
    Measured,
    /// Computed by the model.
    Simulated,
    /// Computed by a model before it was corrected.
    Before,
    /// Computed by the corrected model.
    After,
    /// An input, by its place among the model's.
    Input(usize),
}

// Okabe and Ito's colours, which people with any of the common colour blindnesses tell apart,
// without the yellow that is too light for a line on white.
//
// Source: M. Okabe, K. Ito, *Color Universal Design* (2008), figure 16.
const BLUE: Colour = Colour(0x00, 0x72, 0xb2);
const VERMILION: Colour = Colour(0xd5, 0x5e, 0x00);
const GREEN: Colour = Colour(0x00, 0x9e, 0x73);
const PURPLE: Colour = Colour(0xcc, 0x79, 0xa7);
const SKY: Colour = Colour(0x56, 0xb4, 0xe9);
const ORANGE: Colour = Colour(0xe6, 0x9f, 0x00);
const BLACK: Colour = Colour(0x00, 0x00, 0x00);

/// Of what has a meaning of its own. The first of several is what a model computes, so it is blue
/// as well.
static MEANINGS: [(Meaning, Colour); 4] = [
    (Meaning::Measured, BLACK),
    (Meaning::Simulated, BLUE),
    (Meaning::Before, VERMILION),
    (Meaning::After, GREEN),
];

/// Of several alike.
static SEVERAL: [Colour; 6] = [BLUE, VERMILION, GREEN, PURPLE, SKY, ORANGE];

/// Of inputs.
static INPUTS: [Colour; 3] = [SKY, ORANGE, PURPLE];

/// What tells lines of the same colour apart.
static DASHES: [&[f32]; 4] = [&[], &[6.0, 3.0], &[2.0, 2.0], &[8.0, 3.0, 2.0, 3.0]];

pub(crate) const DOT_DIAMETER: f64 = 2.6;

/// Of a point that stands out, and of the white around it.
pub(crate) const MARK_DIAMETER: f64 = 7.0;
pub(crate) const HALO_DIAMETER: f64 = 9.5;

/// How much white a recorded signal has, so that a line in front of its noise stands out.
const TINT: f64 = 0.35;

/// How much white a shaded surface has, so that grid and lines stand out from it.
const SURFACE_TINT: f64 = 0.72;

/// Of a surface that belongs to no line.
const GREY: Colour = Colour(0x88, 0x88, 0x88);

/// How each series of a panel is drawn.
pub(crate) fn pens(panel: &Panel) -> Vec<Pen> {
    let mut alike = 0..;
    let pen = |(meaning, style)| {
        let (colour, dashes) = hue(meaning, &mut alike);
        let (width, tint) = match style {
            Style::Line => (1.6, 0.0),
            Style::ThinLine => (0.8, TINT),
            Style::Dots => (DOT_DIAMETER, TINT),
            Style::Marks => (MARK_DIAMETER, 0.0),
        };
        Pen { colour: tinted(colour, tint), width, dashes }
    };
    panel.series.iter().map(|series| (series.meaning, series.style)).map(pen).collect()
}

/// How a series is told from the others of its panel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// Red, green and blue; signals and dots have it with some white.
    pub colour: [u8; 3],
    /// Lengths of dashes and gaps, px; none where the line is whole.
    pub dashes: &'static [f32],
}

impl Panel {
    /// Red, green and blue of each envelope.
    pub fn surfaces(&self) -> Vec<[u8; 3]> {
        let colour = |around| {
            let Colour(red, green, blue) = surface(self, around);
            [red, green, blue]
        };
        self.envelopes.iter().map(|envelope| colour(envelope.around)).collect()
    }

    /// The look of each series.
    pub fn looks(&self) -> Vec<Look> {
        let mut alike = 0..;
        let look = |meaning| {
            let (Colour(red, green, blue), dashes) = hue(meaning, &mut alike);
            Look { colour: [red, green, blue], dashes }
        };
        self.series.iter().map(|series| series.meaning).map(look).collect()
    }
}

/// Colour and dashes of a meaning; the places of those that have none are counted.
fn hue(meaning: Meaning, alike: &mut impl Iterator<Item = usize>) -> (Colour, &'static [f32]) {
    let of_table = |colours: &[Colour], place: usize| {
        (colours[place % colours.len()], DASHES[place / colours.len() % DASHES.len()])
    };
    let known = MEANINGS.iter().find(|(other, _)| *other == meaning);
    match (meaning, known) {
        (_, Some((_, colour))) => (*colour, DASHES[0]),
        (Meaning::Input(place), _) => of_table(&INPUTS, place),
        (Meaning::Variant(place), _) => of_table(&SEVERAL, place),
        _ => of_table(&SEVERAL, alike.next().unwrap_or_default()),
    }
}

/// The colour of a surface around a series of a panel, or around none.
pub(crate) fn surface(panel: &Panel, around: Option<usize>) -> Colour {
    let mut alike = 0..;
    let hues: Vec<Colour> =
        panel.series.iter().map(|series| hue(series.meaning, &mut alike).0).collect();
    let colour = around.and_then(|index| hues.get(index)).copied();
    tinted(colour.unwrap_or(GREY), SURFACE_TINT)
}

/// A colour with some white in it.
fn tinted(Colour(red, green, blue): Colour, white: f64) -> Colour {
    let mixed = |part: u8| (f64::from(part) + white * (255.0 - f64::from(part))).round() as u8;
    Colour(mixed(red), mixed(green), mixed(blue))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::Series;

    fn panel(meanings: &[Meaning]) -> Panel {
        let series = |meaning: &Meaning| Series { meaning: *meaning, ..Series::default() };
        Panel { series: meanings.iter().map(series).collect(), ..Panel::default() }
    }

    #[test]
    fn what_means_the_same_has_one_colour_wherever_it_stands() {
        use Meaning::{After, Before, Input, Measured, OneOfSeveral, Simulated};
        let one = pens(&panel(&[Simulated, Measured, Input(1)]));
        let other = pens(&panel(&[OneOfSeveral, Input(1), Before, Measured, After, Simulated]));
        assert_eq!((one[0], one[1], one[2]), (other[5], other[3], other[1]));
        // And another one has another: what is measured, computed, before, after, and three inputs.
        let all = [Measured, Simulated, Before, After, Input(0), Input(1), Input(2)];
        let pens = pens(&panel(&all));
        for (i, pen) in pens.iter().enumerate() {
            assert!(pens[..i].iter().all(|other| other.colour != pen.colour), "{:?}", all[i]);
        }
    }

    #[test]
    fn several_alike_are_told_apart_and_do_not_count_what_has_a_meaning() {
        use Meaning::{Measured, OneOfSeveral};
        let alone = pens(&panel(&[OneOfSeveral; 20]));
        for (i, pen) in alone.iter().enumerate() {
            assert!(!alone[..i].contains(pen), "{i}");
        }
        let beside = pens(&panel(&[Measured, OneOfSeveral, OneOfSeveral]));
        assert_eq!(beside[1..], alone[..2]);
    }
}
