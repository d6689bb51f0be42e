//! What is said where nothing is hidden: whether p-values are uniform, and how often something is named all the same.

#[path = "../../tests/support/uniform.rs"]
mod uniform;

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde_json::Value;

use crate::bank::Domain;
use crate::bank::cases::{Planned, nulls};
use uniform::kolmogorov_smirnov;

/// Domains that are looked at where there are as many.
pub(crate) const DOMAINS: usize = 8;

/// Cases of white noise without anything hidden, as many of each domain as come to a number.
pub(crate) fn cases(domains: &[&'static Domain], seed: u64, number: usize) -> Vec<Planned> {
    let domains = &domains[..domains.len().min(DOMAINS)];
    let each = number.div_ceil(domains.len().max(1));
    let mut all: Vec<Planned> =
        domains.iter().flat_map(|domain| nulls(domain, seed, each)).collect();
    all.truncate(number);
    all
}

/// What was said of one of them.
#[derive(Debug, Clone)]
pub(crate) struct Null {
    domain: &'static str,
    p_value: Option<f64>,
    verdict: String,
    names: usize,
}

impl Null {
    pub(crate) fn new(domain: &'static str, json: &Value) -> Null {
        Null {
            domain,
            p_value: json["p_value"].as_f64(),
            verdict: json["verdict"].as_str().unwrap_or("error").to_owned(),
            names: json["effects"].as_array().map_or(0, Vec::len),
        }
    }
}

/// A line for each domain, and one for all.
pub(crate) fn table(all: &[Null]) -> String {
    let mut of_domains: BTreeMap<&str, Vec<&Null>> = BTreeMap::new();
    for null in all {
        of_domains.entry(null.domain).or_default().push(null);
    }
    let mut text = String::from(
        "domain              nulls  p-values  Kolmogorov-Smirnov  <= 0.01  <= 0.05  <= 0.1  <= 0.5  not sufficient  named\n",
    );
    for (domain, nulls) in &of_domains {
        let _ = writeln!(text, "{}", line(domain, nulls));
    }
    let _ = writeln!(text, "{}", line("all", &all.iter().collect::<Vec<_>>()));
    text
}

fn line(name: &str, nulls: &[&Null]) -> String {
    let p_values: Vec<f64> = nulls.iter().filter_map(|null| null.p_value).collect();
    let below = |limit: f64| p_values.iter().filter(|p| **p <= limit).count();
    let test = match p_values.as_slice() {
        [] => "-".to_owned(),
        some => format!("{:.3}", kolmogorov_smirnov(some)),
    };
    format!(
        "{name:18} {:6} {:9} {test:>19} {:8} {:8} {:7} {:7} {:15} {:6}",
        nulls.len(),
        p_values.len(),
        below(0.01),
        below(0.05),
        below(0.1),
        below(0.5),
        nulls.iter().filter(|null| null.verdict != "sufficient").count(),
        nulls.iter().filter(|null| null.names > 0).count(),
    )
}
