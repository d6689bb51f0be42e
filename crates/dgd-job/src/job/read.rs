//! Parses a job file into a [`Job`]; errors give the place.

use std::collections::BTreeSet;
use std::path::Path;

use dgd_work::meant;
use serde_json::{Map, Value};

use super::unique::UniqueKeys;
use super::{Asset, Job, Period, PeriodTask};
use crate::piece::PieceKind;

/// Options that a job file has its own keys for, with a hint to the key.
const ELSEWHERE: [(&str, &str); 14] = [
    ("--data", "recordings stand under `wells`"),
    ("--valid", "recordings stand under `wells`, as `valid`"),
    ("--seed", "the job has `seed`"),
    ("--threads", "the job has `threads`"),
    ("--memory", "the job has `memory`"),
    ("--scratch", "the folder is the machine's, by `TMPDIR`"),
    ("--starts", "`do` takes { \"kind\": \"starts\", \"count\": 20 }"),
    ("--start-point", "`do` takes { \"kind\": \"starts\", \"count\": 20 }"),
    ("--bootstrap", "`do` takes { \"kind\": \"replicates\", \"count\": 200 }"),
    ("--bootstrap-from", "`do` takes { \"kind\": \"replicates\", \"count\": 200 }"),
    ("--out", "results go to the folder of `--into`"),
    ("-o", "results go to the folder of `--into`"),
    ("--plot", "`dgd job report` draws the results"),
    ("--resume", "pieces that have a result are not done again"),
];

pub(super) fn job(text: &str, folder: &Path) -> Result<Job, String> {
    let UniqueKeys(value) = serde_json::from_str(text).map_err(|error| error.to_string())?;
    let known = ["model", "options", "seed", "threads", "memory", "do", "wells"];
    let document = object(&value, "the file", &known)?;
    let model = document.get("model").map(|model| string(model, "model")).transpose()?;
    let Some(todo) = document.get("do") else {
        return Err(
            "`do` is missing, what is done with each recording, as in \"do\": [\"fit\"]".to_owned()
        );
    };
    let todo = items(todo).iter().enumerate().map(|(k, one)| done(one, &format!("do[{k}]")));
    let todo = todo.collect::<Result<Vec<PeriodTask>, String>>()?;
    let Some(Value::Object(wells)) =
        document.get("wells").filter(|wells| wells.as_object().is_some_and(|w| !w.is_empty()))
    else {
        return Err("`wells` are missing, as in \"wells\": { \"A-1\": \"a1.csv\" }".to_owned());
    };
    let wells = wells.iter().map(|(name, value)| well(name, value));
    let wells = wells.collect::<Result<Vec<Asset>, String>>()?;
    let lost = wells.iter().find(|well| model.is_none() && well.model.is_none());
    if let Some(well) = lost {
        return Err(format!("there is no model for `wells.{}`: give the job a `model`", well.name));
    }
    Ok(Job {
        folder: folder.to_owned(),
        model: model.unwrap_or_default(),
        options: options(document, "options")?,
        seed: document.get("seed").map_or(Ok(0), |seed| number(seed, "seed", 0))?,
        threads: document.get("threads").map_or(Ok(1), |threads| number(threads, "threads", 1))?
            as usize,
        memory: document.get("memory").map(memory).transpose()?,
        todo,
        wells,
        begins: Vec::new(),
    })
}

/// The task for each occasion.
fn done(value: &Value, place: &str) -> Result<PeriodTask, String> {
    if let Some(kind) = value.as_str() {
        let kinds = match kind {
            "fit" => vec![PieceKind::Fit],
            "discover" => vec![PieceKind::Discover],
            "starts" | "replicates" | "profile" => {
                return Err(format!("`{place}`: `{kind}` is written as {}", example(kind)));
            }
            other => return Err(unknown(place, other)),
        };
        return Ok(PeriodTask { kinds, options: Vec::new() });
    }
    let fields = object(value, place, &["kind", "count", "each", "of", "options"])?;
    let Some(kind) = fields.get("kind").and_then(Value::as_str) else {
        return Err(format!("`{place}` has no `kind`, as in {}", example("starts")));
    };
    let key = |key: &str| format!("{place}.{key}");
    let needed = |name: &str| {
        let needs = || format!("`{place}` has no `{name}`, as in {}", example(kind));
        fields.get(name).ok_or_else(needs)
    };
    let takes: &[&str] = match kind {
        "starts" => &["count"],
        "replicates" => &["count", "each"],
        "profile" => &["of"],
        _ => &[],
    };
    let taken = ["kind", "options"];
    if let Some(other) =
        fields.keys().find(|k| !takes.contains(&k.as_str()) && !taken.contains(&k.as_str()))
    {
        return Err(format!("`{place}`: `{kind}` takes no `{other}`"));
    }
    let kinds = match kind {
        "fit" => vec![PieceKind::Fit],
        "discover" => vec![PieceKind::Discover],
        "starts" => {
            let points = number(needed("count")?, &key("count"), 1)?;
            let points = u32::try_from(points).ok().filter(|points| *points <= 100_000);
            let points =
                points.ok_or_else(|| format!("`{}`: at most 100000 points", key("count")))?;
            (0..points).map(|number| PieceKind::Start { number, of: points }).collect()
        }
        "replicates" => {
            let count = number(needed("count")?, &key("count"), 1)? as usize;
            let each = fields.get("each").map(|each| number(each, &key("each"), 1)).transpose()?;
            let each = each.map_or(count, |each| each as usize);
            let firsts = (0..count).step_by(each);
            firsts
                .map(|from| PieceKind::Replicates { from, count: each.min(count - from) })
                .collect()
        }
        "profile" => {
            let names = strings(needed("of")?, &key("of"))?;
            names.into_iter().map(|of| PieceKind::Profile { of }).collect()
        }
        other => return Err(unknown(place, other)),
    };
    Ok(PeriodTask { kinds, options: options(fields, &key("options"))? })
}

fn unknown(place: &str, kind: &str) -> String {
    let help = meant(kind, &["fit", "starts", "replicates", "profile", "discover"]);
    format!("`{place}`: nothing is called `{kind}`; {help}")
}

/// The notation of a kind of task.
fn example(kind: &str) -> &'static str {
    match kind {
        "replicates" => r#"{ "kind": "replicates", "count": 200, "each": 20 }"#,
        "profile" => r#"{ "kind": "profile", "of": ["c0", "c2"] }"#,
        _ => r#"{ "kind": "starts", "count": 20 }"#,
    }
}

fn well(name: &str, value: &Value) -> Result<Asset, String> {
    let place = format!("wells.{name}");
    let (model, own, recordings) = match value {
        Value::Object(all) if all.contains_key("recordings") => {
            let fields = object(value, &place, &["model", "options", "recordings"])?;
            let model = fields.get("model").map(|model| string(model, &format!("{place}.model")));
            let own_options = options(fields, &format!("{place}.options"))?;
            (model.transpose()?, own_options, &fields["recordings"])
        }
        other => (None, Vec::new(), other),
    };
    let occasions = items(recordings).iter().enumerate();
    let occasions = occasions.map(|(k, one)| match recordings {
        Value::Array(_) => occasion(one, &format!("{place}[{k}]")),
        _ => occasion(one, &place),
    });
    let occasions = occasions.collect::<Result<Vec<Period>, String>>()?;
    if occasions.is_empty() {
        return Err(format!("`{place}` has no recordings"));
    }
    let mut dates = BTreeSet::new();
    if let Some(twice) = occasions.iter().find(|one| !dates.insert(&one.when)) {
        return Err(format!(
            "`{place}` has recordings of `{}` twice: tell them apart, as in {{ \"when\": \"2024-03\", \"data\": \"…\" }}",
            twice.when
        ));
    }
    Ok(Asset { name: name.to_owned(), model, options: own, occasions })
}

fn occasion(value: &Value, place: &str) -> Result<Period, String> {
    if let Some(file) = value.as_str() {
        let data = vec![file.to_owned()];
        return Ok(Period { when: stem(file), data, valid: Vec::new(), options: Vec::new() });
    }
    if !value.is_object() {
        return Err(format!(
            "`{place}` is {value}; a recording is a file, or {{ \"data\": \"a.csv\" }}"
        ));
    }
    let fields = object(value, place, &["when", "data", "valid", "options"])?;
    let files = |name: &str| {
        let files = fields.get(name).map(|files| strings(files, &format!("{place}.{name}")));
        files.transpose().map(Option::unwrap_or_default)
    };
    let data = files("data")?;
    let Some(first) = data.first() else {
        return Err(format!("`{place}` has no `data`"));
    };
    let when = match fields.get("when") {
        Some(Value::Number(number)) => number.to_string(),
        Some(when) => string(when, &format!("{place}.when"))?,
        None => stem(first),
    };
    let own_options = options(fields, &format!("{place}.options"))?;
    Ok(Period { when, valid: files("valid")?, data, options: own_options })
}

/// The name of a file without folder and extension.
fn stem(file: &str) -> String {
    let name = file.rsplit(['/', '\\']).next().unwrap_or(file);
    name.split_once('.').map_or(name, |(stem, _)| stem).to_owned()
}

fn object<'a>(
    value: &'a Value,
    place: &str,
    known: &[&str],
) -> Result<&'a Map<String, Value>, String> {
    let Some(all) = value.as_object() else {
        return Err(format!("`{place}` is {value}, where an object was expected"));
    };
    if let Some(other) = all.keys().find(|key| !known.contains(&key.as_str())) {
        let path = if place == "the file" { other.clone() } else { format!("{place}.{other}") };
        return Err(format!("`{path}`: there is no such key; {}", meant(other, known)));
    }
    Ok(all)
}

/// The items of a list, or the one value itself.
fn items(value: &Value) -> &[Value] {
    value.as_array().map_or(std::slice::from_ref(value), Vec::as_slice)
}

fn string(value: &Value, place: &str) -> Result<String, String> {
    let text = value.as_str().filter(|text| !text.is_empty());
    text.map(str::to_owned)
        .ok_or_else(|| format!("`{place}` is {value}, where a text was expected"))
}

/// A list of texts, or a single one.
fn strings(value: &Value, place: &str) -> Result<Vec<String>, String> {
    items(value).iter().map(|item| string(item, place)).collect()
}

fn options(all: &Map<String, Value>, place: &str) -> Result<Vec<String>, String> {
    let Some(value) = all.get("options") else { return Ok(Vec::new()) };
    if !value.is_array() {
        return Err(format!(
            "`{place}` is {value}, where a list of words was expected, as in [\"--free\", \"c0,c2\"]"
        ));
    }
    let words = strings(value, place)?;
    for word in &words {
        let option = word.split('=').next().unwrap_or(word);
        if let Some((_, instead)) = ELSEWHERE.iter().find(|(known, _)| *known == option) {
            return Err(format!("`{place}` has `{option}`: {instead}"));
        }
    }
    Ok(words)
}

fn number(value: &Value, place: &str, least: u64) -> Result<u64, String> {
    let number = value.as_u64().filter(|number| *number >= least);
    number.ok_or_else(|| {
        format!("`{place}` is {value}, where a whole number from {least} on was expected")
    })
}

fn memory(value: &Value) -> Result<u64, String> {
    let wrong = || format!("`memory` is {value}, where a size was expected, as in \"2 GB\"");
    value.as_str().and_then(bytes).ok_or_else(wrong)
}

/// A size as usually written: `2 GB`, `500MB`, `1.5 GiB`.
pub fn bytes(text: &str) -> Option<u64> {
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic() || c == ' ');
    let unit = match text[digits.len()..].trim() {
        "B" => 1.0,
        "kB" | "KB" => 1e3,
        "MB" => 1e6,
        "GB" => 1e9,
        "KiB" => 1024.0,
        "MiB" => 1024.0 * 1024.0,
        "GiB" => 1024.0 * 1024.0 * 1024.0,
        _ => return None,
    };
    let size = digits.trim().parse::<f64>().ok()? * unit;
    (1.0..1e18).contains(&size).then_some(size as u64)
}
