//! The folder of pictures and its index.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use dgd_plot::{Figure, render_svg};

use crate::chapters::Fallible;
use crate::claims::{Claim, count, missed};
use crate::page::{Finding, Section};

/// Width of a picture on a phone, pixels.
const NARROW: f64 = 380.0;

/// Writes each figure, wide and narrow, and the index.
pub(crate) fn write(folder: &Path, sections: &[Section]) -> Fallible<()> {
    fs::create_dir_all(folder)?;
    for finding in sections.iter().flat_map(|section| &section.findings) {
        let narrow = Figure { width: NARROW, columns: 1, ..finding.figure.clone() };
        fs::write(folder.join(file(finding, "")), render_svg(&finding.figure))?;
        fs::write(folder.join(file(finding, ".narrow")), render_svg(&narrow))?;
    }
    fs::write(folder.join("index.html"), index(sections)?)?;
    Ok(())
}

/// The picture of a finding.
fn file(finding: &Finding, kind: &str) -> String {
    format!("fig_{}{kind}.svg", finding.number.replace('.', "_"))
}

/// The page.
pub(crate) fn index(sections: &[Section]) -> Result<String, std::fmt::Error> {
    let (claims, missed) = (count(sections), missed(sections).len());
    let figures: usize = sections.iter().map(|section| section.findings.len()).sum();
    let mut page = HEAD.to_owned();
    let verdict = match missed {
        0 => format!(
            "<p class=\"all yes\">{figures} figures, {claims} claims: all of them hold.</p>"
        ),
        _ => format!(
            "<p class=\"all no\">{figures} figures, {claims} claims: {missed} of them do not hold.</p>"
        ),
    };
    writeln!(page, "{verdict}\n<nav>")?;
    for finding in sections.iter().flat_map(|section| &section.findings) {
        let number = finding.number;
        let kind =
            if finding.claims.iter().all(|claim| claim.holds) { "" } else { " class=\"no\"" };
        writeln!(page, "<a href=\"#fig_{number}\"{kind}>{number}</a>")?;
    }
    writeln!(page, "</nav>")?;
    for section in sections {
        writeln!(page, "<h2>{}</h2>", escaped(section.title))?;
        for finding in &section.findings {
            writeln!(
                page,
                "<section id=\"fig_{number}\">\n<h3><b>Fig {number}</b> {title}</h3>\n<p>{thesis}</p>\n\
                 <picture><source media=\"(max-width: 40em)\" srcset=\"{narrow}\">\
                 <img src=\"{wide}\" alt=\"{title}\"></picture>\n<p>{here}</p>\n{claims}</section>",
                number = finding.number,
                title = escaped(finding.title),
                thesis = escaped(finding.thesis),
                here = escaped(&finding.here),
                narrow = file(finding, ".narrow"),
                wide = file(finding, ""),
                claims = claims_table(&finding.claims)?,
            )?;
        }
    }
    page.push_str("</main>\n</body>\n</html>\n");
    Ok(page)
}

/// What must come out, a row each.
fn claims_table(claims: &[Claim]) -> Result<String, std::fmt::Error> {
    let mut table = "<table>\n<thead><tr><th>Claim</th><th>The thesis</th><th>Here</th>\
                     <th>Verdict</th></tr></thead>\n<tbody>\n"
        .to_owned();
    for claim in claims {
        let (kind, verdict) = if claim.holds { ("yes", "holds") } else { ("no", "does not hold") };
        writeln!(
            table,
            "<tr class=\"{kind}\"><th scope=\"row\">{}</th><td data-of=\"The thesis\">{}</td>\
             <td data-of=\"Here\">{}</td><td class=\"verdict\">{verdict}</td></tr>",
            escaped(claim.what),
            escaped(claim.thesis),
            escaped(&claim.here)
        )?;
    }
    table.push_str("</tbody>\n</table>\n");
    Ok(table)
}

const HEAD: &str = r#"<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>Haukanes 2015, figure by figure</title>
<style>
:root { --ink: #1d2127; --soft: #5b6470; --line: #d9dee4; --paper: #fff; --yes: #00704f; --no: #b23c00 }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e4e7ea; --soft: #a3adb8; --line: #3a424b; --paper: #1a1a1a; --yes: #4cc79c; --no: #ff9d66 }
  img { filter: invert(.9) hue-rotate(180deg) }
}
body { font: 16px/1.5 "Liberation Sans", Arial, sans-serif; color: var(--ink); background: var(--paper); margin: 0 }
main { max-width: 51rem; margin: 0 auto; padding: 1.5rem 1rem 4rem }
h1 { font-size: 1.6rem; line-height: 1.25; margin: 0 0 1rem } h2 { font-size: 1.3rem; margin: 3rem 0 0; padding-bottom: .3rem; border-bottom: 1px solid var(--line) }
h3 { font-size: 1.05rem; font-weight: normal; margin: 2.5rem 0 .3rem } p { margin: .5rem 0 }
section > p { color: var(--soft) } section > picture + p { color: var(--ink) }
img { width: 100%; height: auto; display: block; margin: .5rem 0 }
nav { display: flex; flex-wrap: wrap; gap: .3rem; margin: 1rem 0 } a { color: inherit }
nav a { border: 1px solid var(--line); border-radius: 3px; padding: .1rem .45rem; text-decoration: none; font-size: .9rem }
nav a:hover, nav a:focus { border-color: var(--ink) } nav a.no { color: var(--no); border-color: var(--no) }
table { border-collapse: collapse; width: 100%; font-size: .92rem; line-height: 1.35; margin: .8rem 0 0 }
th, td { text-align: left; vertical-align: top; padding: .35rem .8rem .35rem 0; border-bottom: 1px solid var(--line); font-weight: normal }
thead th { color: var(--soft); font-size: .85rem } tbody th { width: 36% } .verdict { white-space: nowrap; padding-right: 0 }
.yes .verdict, .all.yes { color: var(--yes) } .no .verdict, .all.no { color: var(--no); font-weight: bold }
@media (max-width: 40em) {
  thead { display: none } table, tbody, tr, th, td { display: block; width: auto !important; border: 0; padding: 0 }
  tr { border-bottom: 1px solid var(--line); padding: .5rem 0 } td[data-of]::before { content: attr(data-of) ": "; color: var(--soft) }
}
@media print { section { break-inside: avoid } nav { display: none } }
</style>
</head>
<body>
<main>
<h1>State and parameter identification for dual gradient drilling, figure by figure</h1>
<p>The data figures of Haukanes 2015, beside what the thesis says of them. Its field data is confidential, so those of
chapters 3 and 4 and of appendix B are drawn from the recordings in <code>examples/data/field/</code>, which are of a simulated rig with the
same instruments, richer than any model that is fitted here. What was true of it is in <code>examples/data/field/truth.json</code>, which
nothing on this page has read.</p>
<p>The thesis masks its figures in per cent. Here 100 % of a level is 1140 m: it calls 0.4 % less than 0.5 bar, which is 4.55 m
of mud. So its U-tubing, at some 21 %, happens at 240 m. 100 % of a flow is 4500 lpm, which is our choice.</p>
"#;

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
