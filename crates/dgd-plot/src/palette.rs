//! The table of colours and their meanings.
//!
//! Series with the same meaning have the same colour in every panel of every figure. A series without such a meaning is
//! one of several alike, and takes the colour of its position among them.

use crate::figure::{Panel, SeriesStyle};
use crate::scene::{Colour, Pen};

/// The meaning of a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SeriesMeaning {
    /// One of several alike, whose colour follows from its position among them in its panel.
    #[default]
    OneOfSeveral,
    /// One of several alike that has this position in every panel of the figure.
    Variant(usize),
    /// Recorded.
    Measured,
    /// Computed by the model.
    Simulated,
    /// Measured minus computed.
    Residual,
    /// Computed by a model before it was corrected.
    Before,
    /// Computed by the corrected model.
    After,
    /// An input, by its position among the model's.
    Input(usize),
}

// Okabe and Ito's colours, which are distinguishable with all common forms of colour blindness, without the yellow,
// which is too light for a line on white.
//
// Source: M. Okabe, K. Ito, *Color Universal Design* (2008), figure 16.
const BLUE: Colour = Colour(0x00, 0x72, 0xb2);
const VERMILION: Colour = Colour(0xd5, 0x5e, 0x00);
const GREEN: Colour = Colour(0x00, 0x9e, 0x73);
const PURPLE: Colour = Colour(0xcc, 0x79, 0xa7);
const SKY: Colour = Colour(0x56, 0xb4, 0xe9);
const ORANGE: Colour = Colour(0xe6, 0x9f, 0x00);
const BLACK: Colour = Colour(0x00, 0x00, 0x00);

/// Colours of specific meanings. Simulated values, residuals and the first of several are blue.
static MEANINGS: [(SeriesMeaning, Colour); 5] = [
    (SeriesMeaning::Measured, BLACK),
    (SeriesMeaning::Simulated, BLUE),
    (SeriesMeaning::Residual, BLUE),
    (SeriesMeaning::Before, VERMILION),
    (SeriesMeaning::After, GREEN),
];

// Paul Tol's muted colours, which are distinguishable from those above.
//
// Source: P. Tol, *Colour Schemes* (SRON technical note EPS 09-002, 2021), figure 4.
const WINE: Colour = Colour(0x88, 0x22, 0x55);
const OLIVE: Colour = Colour(0x99, 0x99, 0x33);
const TEAL: Colour = Colour(0x44, 0xaa, 0x99);
const ROSE: Colour = Colour(0xcc, 0x66, 0x77);

/// Colours of several alike: none of them has another meaning.
static SEVERAL: [Colour; 5] = [BLUE, WINE, OLIVE, TEAL, ROSE];

/// Colours of inputs.
static INPUTS: [Colour; 3] = [SKY, ORANGE, PURPLE];

/// Dash patterns that distinguish lines of the same colour.
static DASHES: [&[f32]; 4] = [&[], &[6.0, 3.0], &[2.0, 2.0], &[8.0, 3.0, 2.0, 3.0]];

pub(crate) const DOT_DIAMETER: f64 = 2.6;

/// Diameters of a prominent point, and of its white border.
pub(crate) const MARK_DIAMETER: f64 = 7.0;
pub(crate) const HALO_DIAMETER: f64 = 9.5;

/// Fraction of white in the colour of a recorded signal, so that a line in front of it stands out.
const TINT: f64 = 0.35;

/// Fraction of white in the colour of a shaded surface, so that grid and lines stand out.
const SURFACE_TINT: f64 = 0.72;

/// Colour of a surface without a line.
const GREY: Colour = Colour(0x88, 0x88, 0x88);

/// Colours from the lowest to the highest value of a heat map: lighter is higher, also for colour-blind readers and in
/// greyscale print.
///
/// Source: Nuñez, Anderton & Renslow, PLoS ONE 13 (2018) e0199239 (cividis).
static SCALE: [Colour; 10] = [
    Colour(0x00, 0x20, 0x4d),
    Colour(0x00, 0x33, 0x6f),
    Colour(0x39, 0x48, 0x6b),
    Colour(0x57, 0x5c, 0x6d),
    Colour(0x70, 0x71, 0x73),
    Colour(0x8a, 0x87, 0x79),
    Colour(0xa6, 0x9d, 0x75),
    Colour(0xc4, 0xb5, 0x6c),
    Colour(0xe4, 0xcf, 0x5b),
    Colour(0xff, 0xea, 0x46),
];

/// Number of colours of a heat map.
pub(crate) const LEVELS: usize = 32;

/// The colour of a level, from 0 to one below [`LEVELS`].
pub(crate) fn of_level(level: usize) -> Colour {
    let position = level as f64 / (LEVELS - 1) as f64 * (SCALE.len() - 1) as f64;
    let before = (position.floor() as usize).min(SCALE.len() - 2);
    let (Colour(r0, g0, b0), Colour(r1, g1, b1)) = (SCALE[before], SCALE[before + 1]);
    let part = position - before as f64;
    let mixed = |a: u8, b: u8| (f64::from(a) + part * (f64::from(b) - f64::from(a))).round() as u8;
    Colour(mixed(r0, r1), mixed(g0, g1), mixed(b0, b1))
}

/// Red, green and blue of the levels of heat maps, from the lowest to the highest.
pub fn scale_of_colours() -> Vec<[u8; 3]> {
    (0..LEVELS).map(of_level).map(|Colour(red, green, blue)| [red, green, blue]).collect()
}

/// How each series of a panel is drawn.
pub(crate) fn pens(panel: &Panel) -> Vec<Pen> {
    let mut alike = 0..;
    let pen = |(meaning, style)| {
        let (colour, dashes) = hue(meaning, &mut alike);
        let (width, tint) = match style {
            SeriesStyle::Line => (1.6, 0.0),
            SeriesStyle::ThinLine => (0.8, TINT),
            SeriesStyle::Dots => (DOT_DIAMETER, TINT),
            SeriesStyle::Marks => (MARK_DIAMETER, 0.0),
        };
        Pen { colour: tinted(colour, tint), width, dashes }
    };
    panel.series.iter().map(|series| (series.meaning, series.style)).map(pen).collect()
}

/// How a series is distinguished from the others of its panel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeriesLook {
    /// Red, green and blue; lightened for signals and dots.
    pub colour: [u8; 3],
    /// Lengths of dashes and gaps, px; empty for a solid line.
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
    pub fn looks(&self) -> Vec<SeriesLook> {
        let mut alike = 0..;
        let look = |meaning| {
            let (Colour(red, green, blue), dashes) = hue(meaning, &mut alike);
            SeriesLook { colour: [red, green, blue], dashes }
        };
        self.series.iter().map(|series| series.meaning).map(look).collect()
    }
}

/// Colour and dashes of a meaning; `alike` numbers the series without a specific one.
fn hue(
    meaning: SeriesMeaning,
    alike: &mut impl Iterator<Item = usize>,
) -> (Colour, &'static [f32]) {
    let of_table = |colours: &[Colour], place: usize| {
        (colours[place % colours.len()], DASHES[place / colours.len() % DASHES.len()])
    };
    let known = MEANINGS.iter().find(|(other, _)| *other == meaning);
    match (meaning, known) {
        (_, Some((_, colour))) => (*colour, DASHES[0]),
        (SeriesMeaning::Input(place), _) => of_table(&INPUTS, place),
        (SeriesMeaning::Variant(place), _) => of_table(&SEVERAL, place),
        _ => of_table(&SEVERAL, alike.next().unwrap_or_default()),
    }
}

/// The colour of a surface around a series of a panel, or of one without a series.
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
    use crate::figure::PlotSeries;

    fn panel(meanings: &[SeriesMeaning]) -> Panel {
        let series =
            |meaning: &SeriesMeaning| PlotSeries { meaning: *meaning, ..PlotSeries::default() };
        Panel { series: meanings.iter().map(series).collect(), ..Panel::default() }
    }

    #[test]
    fn what_means_the_same_has_one_colour_wherever_it_stands() {
        use SeriesMeaning::{After, Before, Input, Measured, OneOfSeveral, Simulated};
        let one = pens(&panel(&[Simulated, Measured, Input(1)]));
        let other = pens(&panel(&[OneOfSeveral, Input(1), Before, Measured, After, Simulated]));
        assert_eq!((one[0], one[1], one[2]), (other[5], other[3], other[1]));
        // Different meanings have different colours: measured, simulated, before, after, and three inputs.
        let all = [Measured, Simulated, Before, After, Input(0), Input(1), Input(2)];
        let pens = pens(&panel(&all));
        for (i, pen) in pens.iter().enumerate() {
            assert!(pens[..i].iter().all(|other| other.colour != pen.colour), "{:?}", all[i]);
        }
    }

    #[test]
    fn several_alike_have_no_colour_that_stands_for_something() {
        use SeriesMeaning::{After, Before, Input, Measured, Simulated, Variant};
        let meant = [Measured, Before, After, Input(0), Input(1), Input(2)];
        let several: Vec<SeriesMeaning> = (0..SEVERAL.len()).map(Variant).collect();
        let (meant, several) = (pens(&panel(&meant)), pens(&panel(&several)));
        assert!(several.iter().all(|one| meant.iter().all(|other| other.colour != one.colour)));
        // The first has the colour of simulated values.
        assert_eq!(several[0].colour, pens(&panel(&[Simulated]))[0].colour);
    }

    #[test]
    fn a_scale_of_colours_gets_lighter_all_the_way() {
        let luma =
            |[r, g, b]: [u8; 3]| 0.299 * f64::from(r) + 0.587 * f64::from(g) + 0.114 * f64::from(b);
        let all: Vec<f64> = scale_of_colours().into_iter().map(luma).collect();
        assert_eq!(all.len(), LEVELS);
        assert!(all.windows(2).all(|pair| pair[1] > pair[0]), "{all:?}");
        assert_eq!((of_level(0), of_level(LEVELS - 1)), (SCALE[0], SCALE[9]));
    }

    #[test]
    fn several_alike_are_told_apart_and_do_not_count_what_has_a_meaning() {
        use SeriesMeaning::{Measured, OneOfSeveral};
        let alone = pens(&panel(&[OneOfSeveral; 20]));
        for (i, pen) in alone.iter().enumerate() {
            assert!(!alone[..i].contains(pen), "{i}");
        }
        let beside = pens(&panel(&[Measured, OneOfSeveral, OneOfSeveral]));
        assert_eq!(beside[1..], alone[..2]);
    }
}
