//! Pages: each command writes a self-contained one with the numbers of the result, and escapes names.

use std::fmt::Write as _;
use std::fs;

use serde_json::Value;
use tempfile::TempDir;

use crate::support::{column, dgd_in, folder_with};

const MODEL: &str = "\
model tank
input u [1] hold
parameter tau [s] = 10 in 1 .. 100
parameter idle [1] = 1 in 0 .. 2
state x [1] = 2
equation tank: tau * der(x) = u - x
output y [bar] = 1 [bar] * x  noise 0.01 [bar]
";

/// The tank with tau = 20 s, sampled every two seconds with a small alternating error.
fn recording() -> String {
    let (mut x, mut text) = (2.0_f64, "time [s],u [1],y [bar]\n".to_owned());
    for k in 0..300 {
        let u = if k / 100 % 2 == 0 { 1.0 } else { 3.0 };
        let error = if k % 3 == 0 { 0.01 } else { -0.005 };
        let _ = writeln!(text, "{},{u},{}", 2 * k, x + error);
        x = u + (x - u) * (-2.0_f64 / 20.0).exp();
    }
    text
}

fn folder() -> TempDir {
    folder_with(&[("m.dgd", MODEL.as_bytes()), ("d.csv", recording().as_bytes())])
}

fn read(folder: &TempDir, name: &str) -> String {
    fs::read_to_string(folder.path().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// The numbers of a page.
fn data(page: &str) -> Value {
    let (_, rest) = page.split_once("id=\"data\">").expect("the page has data");
    let (json, _) = rest.split_once("</script>").expect("they end");
    serde_json::from_str(json).expect("they are JSON")
}

/// The series with this name in the panel with this title.
fn series(page: &str, title: &str, name: &str) -> [Vec<f64>; 2] {
    let data = data(page);
    let figures = data["figures"].as_array().expect("figures");
    let panels = figures.iter().flat_map(|figure| figure["panels"].as_array().expect("panels"));
    let expected = panels.filter(|panel| panel["title"] == title);
    let mut entries = expected.flat_map(|panel| panel["series"].as_array().expect("series"));
    let result = entries.find(|one| one["name"] == name).unwrap_or_else(|| panic!("no {name}"));
    ["x", "y"].map(|axis| {
        let place = result[axis].as_u64().expect("a place") as usize;
        let column = data["columns"][place].as_array().expect("a column");
        column.iter().map(|value| value.as_f64().unwrap_or(f64::NAN)).collect()
    })
}

#[test]
fn each_command_writes_a_page_that_stands_by_itself() {
    let folder = folder();
    for (command, more) in [
        ("simulate", &[][..]),
        ("sensitivity", &["--of", "x"]),
        ("linearize", &["--at", "steady"]),
        ("fit", &["--fix", "idle"]),
        ("track", &["--free", "tau", "-o", "t.csv"]),
    ] {
        let page = format!("{command}.html");
        let args = [&[command, "m.dgd", "--data", "d.csv", "--plot", &page], more].concat();
        dgd_in(folder.path(), &args).done();
        let text = read(&folder, &page);
        assert!(text.starts_with("<!DOCTYPE html>"), "{command}");
        let (head, _) = text.split_once("<body>").expect("a body");
        assert!(head.contains("default-src 'none'; script-src 'sha256-"), "{command}");
        assert!(text.contains("<h1") && text.contains("</svg>"), "{command}");
        // The command and the digests of its inputs.
        assert!(text.contains(&format!("dgd {command} m.dgd --data d.csv")), "{command}");
        assert_eq!(text.matches("sha256:").count(), 2, "{command}: of the model and the data");
        let bare = text.len() - data(&text).to_string().len() - text.matches("<svg").count();
        let pictures: usize =
            text.split("<svg").skip(1).map(|s| s.find("</svg>").unwrap_or(0)).sum();
        assert!(bare - pictures < 150_000, "{command}: {} bytes", bare - pictures);
        dgd_in(folder.path(), &args).done();
        assert_eq!(text, read(&folder, &page), "{command}: the same every time");
    }
    dgd_in(folder.path(), &["screen", "--data", "d.csv", "--plot", "s.html"]).done();
    assert!(read(&folder, "s.html").contains("sha256:"));
    let refused =
        dgd_in(folder.path(), &["simulate", "m.dgd", "--data", "d.csv", "--plot", "a.gif"]);
    refused.refused(2, &["a.gif", ".pdf", ".html"]);
}

#[test]
fn a_picture_is_svg_pdf_or_png() {
    let folder = folder();
    let plots = ["--plot", "a.svg", "--plot", "a.pdf", "--plot", "a.png"];
    dgd_in(folder.path(), &[&["simulate", "m.dgd", "--data", "d.csv"], &plots[..]].concat()).done();
    let pdf = fs::read(folder.path().join("a.pdf")).expect("a picture");
    assert!(pdf.starts_with(b"%PDF-1.4") && pdf.ends_with(b"%%EOF\n"));
    // The page size equals that of the picture, at 96 pixels to an inch and 72 points.
    let svg = read(&folder, "a.svg");
    let size = |name: &str| -> f64 {
        let (_, rest) = svg.split_once(&format!(" {name}=\"")).expect(name);
        rest.split('"').next().and_then(|n| n.parse().ok()).expect("a number")
    };
    let media = format!("/MediaBox [0 0 {} {}]", 0.75 * size("width"), 0.75 * size("height"));
    assert!(String::from_utf8_lossy(&pdf).contains(&media), "{media}");
}

const LINE: &str = "\
model line
size N = 6
state T[1..N] [degC] = 20 [degC]
state q[1..N] [m] = 1
for i in 1..N {
  equation heat[i]: der(T[i]) = i*1 [K/s]
  equation flow[i]: der(q[i]) = -i*q[i]/1 [s]
}
output T [degC]
";

#[test]
fn an_array_is_a_heat_map_over_place_and_time() {
    let folder = folder_with(&[("line.dgd", LINE.as_bytes())]);
    let plots = ["--plot", "l.html", "--plot", "l.svg"];
    let args = ["simulate", "line.dgd", "--until", "2", "--every", "0.5", "-o", "l.csv"];
    dgd_in(folder.path(), &[&args[..], &plots].concat()).done();
    let data = data(&read(&folder, "l.html"));
    let panels = data["figures"][0]["panels"].as_array().expect("panels");
    let titles: Vec<&str> = panels.iter().filter_map(|panel| panel["title"].as_str()).collect();
    assert_eq!(titles, ["q [m]", "T [°C]"], "two maps and nothing else");
    let column = |place: &Value| -> Vec<f64> {
        let place = place.as_u64().expect("a place") as usize;
        let column = data["columns"][place].as_array().expect("a column");
        column.iter().map(|value| value.as_f64().expect("a number")).collect()
    };
    for panel in panels {
        let map = &panel["map"];
        assert_eq!(column(&map["places"]), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        for (i, row) in map["rows"].as_array().expect("rows").iter().enumerate() {
            let n = (i + 1) as f64;
            for (t, value) in column(&map["x"]).iter().zip(column(row)) {
                let exact = if panel["title"] == "q [m]" { (-n * t).exp() } else { 20.0 + n * t };
                assert!((value - exact).abs() < 1e-4, "{panel} {value} {exact}");
            }
        }
    }
    let svg = read(&folder, "l.svg");
    // The lowest and highest colour of the scale.
    assert!(svg.contains("#00204d") && svg.contains("#ffea46"), "{svg}");
}

#[test]
fn a_page_has_the_numbers_of_the_table() {
    let folder = folder();
    let args = ["simulate", "m.dgd", "--data", "d.csv", "--plot", "p.html", "-o", "p.csv"];
    dgd_in(folder.path(), &args).done();
    let (page, table) = (read(&folder, "p.html"), read(&folder, "p.csv"));
    let [times, simulated] = series(&page, "y", "simulated");
    assert_eq!(times, column(&table, "time [s]"));
    let column_of_y = column(&table, "y [bar]");
    assert_eq!(simulated.len(), column_of_y.len());
    for (shown, value) in simulated.iter().zip(&column_of_y) {
        assert!((shown - value).abs() < 1e-5, "{shown} {value}");
    }
    // tau = 10 s where 20 s is true: Ljung's fit, computed here.
    let [_, measured] = series(&page, "y", "measured");
    let mean = measured.iter().sum::<f64>() / measured.len() as f64;
    let squares: f64 = measured.iter().zip(&column_of_y).map(|(y, w)| (y - w).powi(2)).sum();
    let scatter: f64 = measured.iter().map(|y| (y - mean).powi(2)).sum();
    let fit = 100.0 * (1.0 - (squares / scatter).sqrt());
    assert!(page.contains(&format!("to {fit:.1} %")), "{fit}");
}

#[test]
fn a_name_with_markup_is_a_name() {
    let name = "<img src=x onerror=alert(1)>&\"'.csv";
    let folder = folder_with(&[("m.dgd", MODEL.as_bytes()), (name, recording().as_bytes())]);
    for (command, more) in
        [("simulate", &["--plot", "simulate.html"][..]), ("fit", &["--plot", "fit.html"])]
    {
        let args = [&[command, "m.dgd", "--data", name], more].concat();
        dgd_in(folder.path(), &args).done();
        let page = read(&folder, &format!("{command}.html"));
        assert!(
            page.contains("&lt;img src=x onerror=alert(1)&gt;&amp;&quot;&#39;.csv"),
            "{command}"
        );
        assert!(!page.contains("<img"), "{command}");
        assert_eq!(page.matches("<script").count(), 2, "{command}");
    }
}

#[test]
fn the_page_of_a_fit_says_what_to_believe() {
    let folder = folder();
    let fit = |out: &str, more: &[&str]| {
        let args = ["fit", "m.dgd", "--data", "d.csv", "--valid", "d.csv", "-o", out];
        let run = dgd_in(folder.path(), &[&args[..], more].concat());
        let result = read(&folder, &format!("{out}/result.json"));
        let result: Value = serde_json::from_str(&result).expect("JSON");
        (run, read(&folder, &format!("{out}/report.html")), result)
    };
    let (run, page, result) = fit("out", &["--profile", "tau", "--information"]);
    run.done();
    assert!(page.contains("<h1 class=\"doubt\">Converged, but the residuals of <code>y</code>"));
    // Nothing depends on it.
    assert!(page.contains("Do not rely on <code>idle</code> (no standard deviation)"), "{page}");
    for heading in [
        "Parameters",
        "Correlation of the estimates",
        "Residuals: autocorrelation",
        "Residuals: cross-correlation with the inputs",
        "Residuals against each input",
        "Residuals: distribution",
        "Profiles",
        "Which data determines the parameters",
        "Operating points",
    ] {
        assert!(page.contains(&format!("<h2>{heading}</h2>")), "{heading}");
    }
    for role in [", training</h2>", ", validation</h2>"] {
        assert_eq!(page.matches(role).count(), 1, "{role}");
    }
    // The page and the result have the same autocorrelation and fit.
    let quality = &result["outputs"]["y"]["quality"]["train"];
    let [_, shown] = series(&page, "y", "correlation");
    let result: Vec<f64> = quality["whiteness"]["autocorrelation"]
        .as_array()
        .expect("correlations")
        .iter()
        .map(|r| r.as_f64().expect("a number"))
        .collect();
    assert!(
        shown.len() == result.len() && shown.iter().zip(&result).all(|(a, b)| (a - b).abs() < 1e-5)
    );
    let fit_percent = quality["fit_percent"].as_f64().expect("a fit");
    assert!(page.contains(&format!(">{fit_percent:.2}</td>")), "{fit_percent}");

    // Estimators that do not simulate also show rows.
    let (run, page, _) = fit("rows", &["--estimator", "separable", "--fix", "idle"]);
    run.done();
    assert!(page.contains("By rows, as the estimator sees them"));
    let (run, page, _) = fit("short", &["--evaluations", "2", "--fix", "idle"]);
    run.refused(3, &[]);
    assert!(page.contains("<h1 class=\"doubt\">Not converged"), "it is written all the same");
}

#[test]
fn an_ensemble_has_a_page() {
    let folder = folder();
    fs::write(folder.path().join("s.csv"), "tau [s]\n10\n20\n40\n").expect("a file");
    let args = ["simulate", "m.dgd", "--data", "d.csv", "--ensemble", "s.csv", "--plot", "e.html"];
    dgd_in(folder.path(), &args).done();
    let page = read(&folder, "e.html");
    assert!(page.contains("3 sets simulated"));
    let [_, median] = series(&page, "x", "median");
    let run = |tau: &str| {
        let set = format!("tau={tau}");
        let args = ["simulate", "m.dgd", "--data", "d.csv", "--set", &set];
        column(&dgd_in(folder.path(), &args).done().out, "y [bar]")
    };
    let runs = ["10", "20", "40"].map(run);
    assert_eq!(median.len(), runs[0].len());
    for (k, shown) in median.iter().enumerate() {
        let mut three = [runs[0][k], runs[1][k], runs[2][k]];
        three.sort_by(f64::total_cmp);
        assert!((shown - three[1]).abs() < 1e-5, "{shown} {three:?}");
    }
}
