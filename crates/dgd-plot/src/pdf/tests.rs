//! Tests of files against the standard, read back by a parser of a few lines.

use std::io::Read as _;

use flate2::read::ZlibDecoder;

use super::*;
use crate::scene::{TextAnchor, TextDirection};
use crate::text::MathText;

fn scene() -> Scene {
    let pen = Pen { colour: Colour(255, 0, 51), width: 1.6, dashes: &[6.0, 3.0] };
    let text = |text: MathText, direction| SceneMark::Text {
        text,
        at: (40.0, 50.0),
        anchor: TextAnchor::Start,
        direction,
        size: 10.0,
        colour: Colour(0, 0, 0),
    };
    let units = MathText::name("tau_b").then(MathText::plain(" (°C) −½ \\ ё"));
    let rectangle = Rectangle { left: 1.0, top: 2.0, width: 30.25, height: 4.0 };
    let marks = vec![
        SceneMark::Area { rectangle, colour: Colour(255, 255, 255) },
        SceneMark::Lines { lines: vec![vec![(0.0, 0.0), (10.004, 20.5)]], pen },
        SceneMark::Dots { centres: vec![(5.0, 6.0)], diameter: 3.0, colour: Colour(0, 0, 0) },
        text(units, TextDirection::Rightwards),
        text(MathText::plain("up"), TextDirection::Upwards),
    ];
    Scene { width: 400.0, height: 200.0, marks }
}

fn find(bytes: &[u8], text: &str) -> usize {
    let position = bytes.windows(text.len()).position(|window| window == text.as_bytes());
    position.unwrap_or_else(|| panic!("there is no `{text}`"))
}

/// The content of the page.
fn content(file: &[u8]) -> String {
    let start = find(file, "stream\n") + "stream\n".len();
    let length = find(file, "/Length ") + "/Length ".len();
    let digits = file[length..].iter().take_while(|byte| byte.is_ascii_digit());
    let length: usize = digits.fold(0, |n, digit| 10 * n + usize::from(digit - b'0'));
    assert_eq!(&file[start + length..start + length + 10], b"\nendstream");
    let mut text = String::new();
    let mut decoder = ZlibDecoder::new(&file[start..start + length]);
    decoder.read_to_string(&mut text).expect("it is deflated text");
    text
}

#[test]
fn every_object_is_where_the_table_says() {
    let file = write(&scene());
    let text = String::from_utf8_lossy(&file);
    assert!(file.starts_with(b"%PDF-1.4\n") && file.ends_with(b"%%EOF\n"));
    let start = text.rsplit("startxref\n").next().and_then(|end| end.lines().next());
    let start: usize = start.and_then(|n| n.parse().ok()).expect("a number");
    assert_eq!(find(&file, "xref\n"), start);
    let table = String::from_utf8_lossy(&file[start..]).into_owned();
    // Lines of the table are twenty bytes long.
    let rows: Vec<&str> = table.lines().filter(|line| line.ends_with(" n ")).collect();
    assert_eq!(rows.len(), 6);
    for (i, row) in rows.iter().enumerate() {
        assert_eq!(row.len(), 19);
        let place: usize = row[..10].parse().expect("a number");
        assert!(file[place..].starts_with(format!("{} 0 obj\n", i + 1).as_bytes()), "{row}");
    }
    assert!(text.contains("/MediaBox [0 0 300 150]"), "three quarters of the pixels");
}

#[test]
fn marks_become_operators_in_the_pixels_of_the_scene() {
    let content = content(&write(&scene()));
    let lines: Vec<&str> = content.lines().collect();
    assert_eq!(lines[0], "0.75 0 0 -0.75 0 150 cm 1 j");
    assert_eq!(lines[1], "1 1 1 rg 1 2 30.25 4 re f");
    assert_eq!(&lines[2..6], ["1 0 0.2 RG 1.6 w [6 3] 0 d", "0 0 m", "10 20.5 l", "S"]);
    assert_eq!(&lines[6..9], ["q 1 J 0 0 0 RG 3 w [] 0 d", "5 6 m 5 6 l", "S Q"]);
}

#[test]
fn text_is_text_in_two_fonts_and_what_has_no_code_is_drawn() {
    let content = content(&write(&scene()));
    // τ in Symbol at the line's start, its subscript smaller and lower.
    assert!(content.contains("1 0 0 -1 40 50 Tm <74> Tj"), "{content}");
    assert!(content.contains("BT /H 7.2 Tf 1 0 0 -1") && content.contains(" 52 Tm (b) Tj ET"));
    assert!(content.contains("( \\(\\260C\\) ) Tj"), "{content}");
    assert!(content.contains("<2d> Tj") && content.contains("(\\275 \\\\ ) Tj"), "{content}");
    // Cyrillic is in neither font: a filled path.
    let drawn = content.lines().find(|line| line.starts_with("q 1 0 0 1 "));
    assert!(drawn.is_some_and(|line| line.contains(" m ") && line.ends_with("f Q")), "{content}");
    assert!(content.contains("0 -1 -1 0 40 50 Tm (up) Tj ET"), "{content}");
}

#[test]
fn numbers_are_short() {
    for (x, text) in [(0.0, "0"), (-0.001, "0"), (1.5, "1.5"), (100.0, "100"), (-2.25, "-2.25")] {
        assert_eq!(number(x), text);
    }
}
