//! A scene as an SVG document.

use std::fmt::Write;

use crate::scene::{
    Colour, Pen, Rectangle, Scene, SceneMark, ScenePoint, TextAnchor, TextDirection,
};
use crate::text::MathText;
use crate::text::{Script, escaped};

/// Families with the widths of the embedded font; one of them is on every system with fonts.
const FAMILIES: &str = "Arial, 'Liberation Sans', Helvetica, Arimo, sans-serif";

pub(crate) fn write(scene: &Scene) -> String {
    let mut svg = String::new();
    // Writing to a string cannot fail.
    let _ = write_scene(&mut svg, scene);
    svg
}

fn write_scene(svg: &mut String, scene: &Scene) -> std::fmt::Result {
    let (width, height) = (number(scene.width), number(scene.height));
    writeln!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" font-family=\"{FAMILIES}\" \
         xml:space=\"preserve\" stroke-linejoin=\"round\" fill=\"none\">"
    )?;
    writeln!(svg, "<rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>")?;
    for mark in &scene.marks {
        match mark {
            SceneMark::Area { rectangle, colour } => write_area(svg, *rectangle, *colour)?,
            SceneMark::Surface { outlines, colour } => write_surface(svg, outlines, *colour)?,
            SceneMark::Lines { lines, pen } => write_lines(svg, lines, *pen)?,
            SceneMark::Dots { centres, diameter, colour } => {
                write_dots(svg, centres, *diameter, *colour)?;
            }
            SceneMark::Text { text, at, anchor, direction, size, colour } => {
                write!(svg, "<text ")?;
                match direction {
                    TextDirection::Rightwards => write_place(svg, *at)?,
                    TextDirection::Upwards => {
                        let (x, y) = (number(at.0), number(at.1));
                        write!(svg, "transform=\"translate({x} {y}) rotate(-90)\"")?;
                    }
                }
                let anchor = match anchor {
                    TextAnchor::Start => "",
                    TextAnchor::Middle => " text-anchor=\"middle\"",
                    TextAnchor::End => " text-anchor=\"end\"",
                };
                let (size_text, colour) = (number(*size), hex(*colour));
                write!(svg, "{anchor} font-size=\"{size_text}\" fill=\"{colour}\">")?;
                write_runs(svg, text, *size)?;
                writeln!(svg, "</text>")?;
            }
        }
    }
    writeln!(svg, "</svg>")
}

fn write_place(svg: &mut String, at: ScenePoint) -> std::fmt::Result {
    write!(svg, "x=\"{}\" y=\"{}\"", number(at.0), number(at.1))
}

fn write_area(svg: &mut String, rectangle: Rectangle, colour: Colour) -> std::fmt::Result {
    write!(svg, "<rect ")?;
    write_place(svg, (rectangle.left, rectangle.top))?;
    let (width, height) = (number(rectangle.width), number(rectangle.height));
    writeln!(svg, " width=\"{width}\" height=\"{height}\" fill=\"{}\"/>", hex(colour))
}

fn write_surface(
    svg: &mut String,
    outlines: &[Vec<ScenePoint>],
    colour: Colour,
) -> std::fmt::Result {
    if outlines.is_empty() {
        return Ok(());
    }
    // A filled path closes by itself.
    write!(svg, "<path d=\"")?;
    write_path(svg, outlines)?;
    writeln!(svg, "\" fill=\"{}\"/>", hex(colour))
}

fn write_lines(svg: &mut String, lines: &[Vec<ScenePoint>], pen: Pen) -> std::fmt::Result {
    if lines.is_empty() {
        return Ok(());
    }
    write!(svg, "<path d=\"")?;
    write_path(svg, lines)?;
    write!(svg, "\" stroke=\"{}\" stroke-width=\"{}\"", hex(pen.colour), number(pen.width))?;
    if !pen.dashes.is_empty() {
        let dashes: Vec<String> = pen.dashes.iter().map(|&d| number(f64::from(d))).collect();
        write!(svg, " stroke-dasharray=\"{}\"", dashes.join(" "))?;
    }
    writeln!(svg, "/>")
}

fn write_path(svg: &mut String, lines: &[Vec<ScenePoint>]) -> std::fmt::Result {
    for line in lines {
        let mut last = (0, 0);
        for (i, &point) in line.iter().enumerate() {
            let (x, y) = (hundredths(point.0), hundredths(point.1));
            let (dx, dy) = (x - last.0, y - last.1);
            last = (x, y);
            match i {
                0 => write_pair(svg, 'M', x, y)?,
                _ if dx == 0 && dy == 0 && line.len() > 2 => {}
                _ => write_pair(svg, 'l', dx, dy)?,
            }
        }
    }
    Ok(())
}

fn write_dots(
    svg: &mut String,
    centres: &[ScenePoint],
    diameter: f64,
    colour: Colour,
) -> std::fmt::Result {
    if centres.is_empty() {
        return Ok(());
    }
    write!(svg, "<path d=\"")?;
    let mut last = (0, 0);
    for &centre in centres {
        let point = (hundredths(centre.0), hundredths(centre.1));
        write_pair(svg, 'm', point.0 - last.0, point.1 - last.1)?;
        write!(svg, "h0")?;
        last = point;
    }
    let (colour, width) = (hex(colour), number(diameter));
    writeln!(svg, "\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linecap=\"round\"/>")
}

fn write_runs(svg: &mut String, text: &MathText, size: f64) -> std::fmt::Result {
    let mut shift = 0.0;
    for run in text.runs() {
        let move_down = size * run.script.shift() - shift;
        shift += move_down;
        match run.script {
            Script::Base if move_down == 0.0 => svg.push_str(&escaped(&run.text)),
            Script::Base => {
                write!(svg, "<tspan dy=\"{}\">", number(move_down))?;
                write!(svg, "{}</tspan>", escaped(&run.text))?;
            }
            Script::Subscript | Script::Superscript => {
                let (dy, size) = (number(move_down), number(size * run.script.scale()));
                write!(svg, "<tspan dy=\"{dy}\" font-size=\"{size}\">")?;
                write!(svg, "{}</tspan>", escaped(&run.text))?;
            }
        }
    }
    Ok(())
}

fn hex(Colour(red, green, blue): Colour) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

fn hundredths(x: f64) -> i64 {
    (x * 100.0).round() as i64
}

fn number(x: f64) -> String {
    let mut text = String::new();
    push_hundredths(&mut text, hundredths(x));
    text
}

/// A command of a path with its two numbers, as short as the grammar allows.
fn write_pair(svg: &mut String, command: char, x: i64, y: i64) -> std::fmt::Result {
    svg.write_char(command)?;
    push_hundredths(svg, x);
    if y >= 0 {
        svg.write_char(' ')?;
    }
    push_hundredths(svg, y);
    Ok(())
}

fn push_hundredths(svg: &mut String, x: i64) {
    if x < 0 {
        svg.push('-');
    }
    let (whole, rest) = (x.unsigned_abs() / 100, x.unsigned_abs() % 100);
    // Writing to a string cannot fail.
    let _ = match (whole, rest) {
        (_, 0) => write!(svg, "{whole}"),
        (0, _) if rest % 10 == 0 => write!(svg, ".{}", rest / 10),
        (0, _) => write!(svg, ".{rest:02}"),
        (_, _) if rest % 10 == 0 => write!(svg, "{whole}.{}", rest / 10),
        (_, _) => write!(svg, "{whole}.{rest:02}"),
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_two_decimals_and_no_more_digits_than_needed() {
        for (x, shown) in
            [(0.0, "0"), (-0.001, "0"), (12.0, "12"), (0.5, ".5"), (-1.25, "-1.25"), (3.07, "3.07")]
        {
            assert_eq!(number(x), shown);
        }
    }

    #[test]
    fn text_is_escaped_and_scripts_return_to_the_base_line() {
        let mut svg = String::new();
        let text = MathText::name("a_b").then(MathText::plain(" <&> c"));
        assert!(write_runs(&mut svg, &text, 10.0).is_ok());
        assert_eq!(
            svg,
            "a<tspan dy=\"2\" font-size=\"7.2\">b</tspan><tspan dy=\"-2\"> &lt;&amp;&gt; c</tspan>"
        );
    }
}
