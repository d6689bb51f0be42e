use dgd_compiler::diagnostics::{Diagnostics, render::{render, Style}};
use dgd_compiler::effects::Effect;
use dgd_compiler::pipeline::load;
use dgd_compiler::source::{Source, Sources};
use dgd_compiler::syntax::parse;
use dgd_discover::*;
use dgd_runtime::*;
use dgd_runtime::identify::Recording;
fn rec(path: &str) -> Recording {
    let t = std::fs::read_to_string(path).unwrap();
    let mut cols: Vec<Vec<f64>> = vec![Vec::new(); 8];
    for l in t.lines().skip(1) { for (c, v) in cols.iter_mut().zip(l.split(',')) { c.push(v.trim().parse().unwrap_or(f64::NAN)); } }
    let sc = [1.0, 0.01, 1.0/60000.0, 1.0/60000.0, 1e5, 1e5, 1e5, 1.0/60000.0];
    for (c, s) in cols.iter_mut().zip(sc) { for v in c.iter_mut() { *v *= s; } }
    let i = |name, interpolation, k: usize| Column { name, interpolation, values: &cols[k] };
    let inputs = Inputs::recorded(&cols[0], &[i("w_ssp", Interpolation::Hold, 1), i("q_boost", Interpolation::Linear, 2), i("q_tf", Interpolation::Hold, 3)]).unwrap();
    let mut r = Recording::new(cols[0].clone(), inputs, (4..8).map(|k| Some(cols[k].clone())).collect());
    let h = 305.0 - (cols[4][0] - 101325.0) / 1120.0 / 9.81;
    r.start = vec![(0, h), (1, cols[7][0])];
    r
}
fn main() {
    let case = std::env::args().nth(1).unwrap();
    let mut sources = Sources::default();
    let mut d = Diagnostics::default();
    let asts = load(Source { name: "m".into(), text: std::fs::read_to_string("models/mud_circulation.dgd").unwrap() }, &mut |_| Err("x".into()), &mut sources, &mut d).unwrap();
    let mut lib = Vec::new();
    let mut files: Vec<_> = std::fs::read_dir("models/effects").unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    let mut all = Vec::new();
    for f in files { if f.is_dir() { for e in std::fs::read_dir(&f).unwrap() { all.push(e.unwrap().path()); } } else { all.push(f); } }
    for f in all {
        let id = sources.add(Source { name: f.display().to_string(), text: std::fs::read_to_string(&f).unwrap() });
        let mut d = Diagnostics::default();
        match parse(id, &sources, &mut d).and_then(|ast| Effect::read(ast, &mut d)) { Ok(e) => lib.push(e), Err(_) => for x in d.sorted() { eprintln!("{}", render(&[x], &sources, Style::Plain)); } }
    }
    let base = BaseModel { asts, options: Default::default(), free: vec![], fix: vec![] };
    let dir = std::env::var("DATA").unwrap_or("/work/shared/data/hidden_effects".into());
    let (a, b) = (rec(&format!("{dir}/{case}.train.csv")), rec(&format!("{dir}/{case}.valid.csv")));
    let t = std::time::Instant::now();
    match discover(&base, &lib, Experiments { train: &[a], valid: &[b] }, Options::default(), 2) { Ok(s) => println!("{s}"), Err(e) => println!("{e}") }
    println!("{:?}", t.elapsed());
}
