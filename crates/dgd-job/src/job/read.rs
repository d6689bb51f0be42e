//! Parses a job file into a [`Job`]; errors give the place.

use std::collections::BTreeSet;
use std::path::Path;

use dgd_work::{Argument, Sentence, sentence};
use serde_json::{Map, Value};

use super::unique::UniqueKeys;
use super::{Asset, ExpectedValue, Job, JobMistake, Period, PeriodTask};
use crate::piece::PieceKind;
use crate::syntax::OptionSyntax;

/// What to give instead of an option that a job file has its own key for.
fn own_key(option: Argument) -> Option<Sentence> {
    Some(match option {
        Argument::Data => "recordings stand under `wells`".into(),
        Argument::Valid => "recordings stand under `wells`, as `valid`".into(),
        Argument::Seed => "the job has `seed`".into(),
        Argument::Threads => "the job has `threads`".into(),
        Argument::Memory => "the job has `memory`".into(),
        Argument::Scratch => "the folder is the machine's, by `TMPDIR`".into(),
        Argument::Starts | Argument::StartPoint => {
            "`do` takes { \"kind\": \"starts\", \"count\": 20 }".into()
        }
        Argument::Bootstrap | Argument::BootstrapFrom => {
            "`do` takes { \"kind\": \"replicates\", \"count\": 200 }".into()
        }
        Argument::Out => sentence!["results go to the folder of ", Argument::Into],
        Argument::Plot => "reports draw the results".into(),
        Argument::Resume => "pieces that have a result are not done again".into(),
        _ => return None,
    })
}

pub(super) fn job(text: &str, folder: &Path, syntax: OptionSyntax) -> Result<Job, JobMistake> {
    let UniqueKeys(value) = serde_json::from_str(text).map_err(JobMistake::NotJson)?;
    let known = ["model", "options", "seed", "threads", "memory", "do", "wells"];
    let document = object(&value, "", &known)?;
    let model = document.get("model").map(|model| string(model, "model")).transpose()?;
    let Some(todo) = document.get("do") else {
        return Err(JobMistake::NoTask);
    };
    let todo =
        items(todo).iter().enumerate().map(|(k, one)| done(one, &format!("do[{k}]"), syntax));
    let todo = todo.collect::<Result<Vec<PeriodTask>, JobMistake>>()?;
    let Some(Value::Object(wells)) =
        document.get("wells").filter(|wells| wells.as_object().is_some_and(|w| !w.is_empty()))
    else {
        return Err(JobMistake::NoAssets);
    };
    let wells = wells.iter().map(|(name, value)| well(name, value, syntax));
    let wells = wells.collect::<Result<Vec<Asset>, JobMistake>>()?;
    let lost = wells.iter().find(|well| model.is_none() && well.model.is_none());
    if let Some(well) = lost {
        return Err(JobMistake::NoModel(well.name.clone()));
    }
    Ok(Job {
        folder: folder.to_owned(),
        model: model.unwrap_or_default(),
        options: options(document, "options", syntax)?,
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
fn done(value: &Value, place: &str, syntax: OptionSyntax) -> Result<PeriodTask, JobMistake> {
    if let Some(kind) = value.as_str() {
        let kinds = match kind {
            "fit" => vec![PieceKind::Fit],
            "discover" => vec![PieceKind::Discover],
            "starts" | "replicates" | "profile" => {
                let (place, kind) = (place.to_owned(), kind.to_owned());
                return Err(JobMistake::ShortTask { place, kind });
            }
            other => return Err(unknown(place, other)),
        };
        return Ok(PeriodTask { kinds, options: Vec::new() });
    }
    let fields = object(value, place, &["kind", "count", "each", "of", "options"])?;
    let Some(kind) = fields.get("kind").and_then(Value::as_str) else {
        return Err(JobMistake::NoKind(place.to_owned()));
    };
    let key = |key: &str| format!("{place}.{key}");
    let needed = |name: &str| {
        fields.get(name).ok_or_else(|| JobMistake::LacksKey {
            place: place.to_owned(),
            key: name.to_owned(),
            kind: kind.to_owned(),
        })
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
        return Err(JobMistake::ExtraKey {
            place: place.to_owned(),
            kind: kind.to_owned(),
            key: other.clone(),
        });
    }
    let kinds = match kind {
        "fit" => vec![PieceKind::Fit],
        "discover" => vec![PieceKind::Discover],
        "starts" => {
            let points = number(needed("count")?, &key("count"), 1)?;
            let points = u32::try_from(points).ok().filter(|points| *points <= 100_000);
            let points = points.ok_or_else(|| JobMistake::TooManyPoints(key("count")))?;
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
    Ok(PeriodTask { kinds, options: options(fields, &key("options"), syntax)? })
}

fn unknown(place: &str, kind: &str) -> JobMistake {
    JobMistake::UnknownKind { place: place.to_owned(), kind: kind.to_owned() }
}

fn well(name: &str, value: &Value, syntax: OptionSyntax) -> Result<Asset, JobMistake> {
    let place = format!("wells.{name}");
    let (model, own, recordings) = match value {
        Value::Object(all) if all.contains_key("recordings") => {
            let fields = object(value, &place, &["model", "options", "recordings"])?;
            let model = fields.get("model").map(|model| string(model, &format!("{place}.model")));
            let own_options = options(fields, &format!("{place}.options"), syntax)?;
            (model.transpose()?, own_options, &fields["recordings"])
        }
        other => (None, Vec::new(), other),
    };
    let occasions = items(recordings).iter().enumerate();
    let occasions = occasions.map(|(k, one)| match recordings {
        Value::Array(_) => occasion(one, &format!("{place}[{k}]"), syntax),
        _ => occasion(one, &place, syntax),
    });
    let occasions = occasions.collect::<Result<Vec<Period>, JobMistake>>()?;
    if occasions.is_empty() {
        return Err(JobMistake::NoRecordings(place));
    }
    let mut dates = BTreeSet::new();
    if let Some(twice) = occasions.iter().find(|one| !dates.insert(&one.when)) {
        return Err(JobMistake::SameDate { place, when: twice.when.clone() });
    }
    Ok(Asset { name: name.to_owned(), model, options: own, occasions })
}

fn occasion(value: &Value, place: &str, syntax: OptionSyntax) -> Result<Period, JobMistake> {
    if let Some(file) = value.as_str() {
        let data = vec![file.to_owned()];
        return Ok(Period { when: stem(file), data, valid: Vec::new(), options: Vec::new() });
    }
    if !value.is_object() {
        return Err(wrong_type(place, value, ExpectedValue::Recording));
    }
    let fields = object(value, place, &["when", "data", "valid", "options"])?;
    let files = |name: &str| {
        let files = fields.get(name).map(|files| strings(files, &format!("{place}.{name}")));
        files.transpose().map(Option::unwrap_or_default)
    };
    let data = files("data")?;
    let Some(first) = data.first() else {
        return Err(JobMistake::NoData(place.to_owned()));
    };
    let when = match fields.get("when") {
        Some(Value::Number(number)) => number.to_string(),
        Some(when) => string(when, &format!("{place}.when"))?,
        None => stem(first),
    };
    let own_options = options(fields, &format!("{place}.options"), syntax)?;
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
) -> Result<&'a Map<String, Value>, JobMistake> {
    let Some(all) = value.as_object() else {
        return Err(wrong_type(place, value, ExpectedValue::Object));
    };
    if let Some(other) = all.keys().find(|key| !known.contains(&key.as_str())) {
        let known = known.iter().map(|&key| key.to_owned()).collect();
        return Err(JobMistake::UnknownKey { place: place.to_owned(), key: other.clone(), known });
    }
    Ok(all)
}

fn wrong_type(place: &str, value: &Value, expected: ExpectedValue) -> JobMistake {
    let place = if place.is_empty() { "the file" } else { place };
    JobMistake::WrongType { place: place.to_owned(), value: value.clone(), expected }
}

/// The items of a list, or the one value itself.
fn items(value: &Value) -> &[Value] {
    value.as_array().map_or(std::slice::from_ref(value), Vec::as_slice)
}

fn string(value: &Value, place: &str) -> Result<String, JobMistake> {
    let text = value.as_str().filter(|text| !text.is_empty());
    text.map(str::to_owned).ok_or_else(|| wrong_type(place, value, ExpectedValue::Text))
}

/// A list of texts, or a single one.
fn strings(value: &Value, place: &str) -> Result<Vec<String>, JobMistake> {
    items(value).iter().map(|item| string(item, place)).collect()
}

fn options(
    all: &Map<String, Value>,
    place: &str,
    syntax: OptionSyntax,
) -> Result<Vec<String>, JobMistake> {
    let Some(value) = all.get("options") else { return Ok(Vec::new()) };
    if !value.is_array() {
        let example = (syntax.words)(&Argument::Free.with("c0,c2"));
        return Err(wrong_type(place, value, ExpectedValue::Words(example)));
    }
    let words = strings(value, place)?;
    for word in &words {
        let option = (syntax.read)(word).map(|(option, _)| option);
        if let Some((option, instead)) = option.and_then(|o| Some((o, own_key(o)?))) {
            return Err(JobMistake::OwnKey { place: place.to_owned(), option, instead });
        }
    }
    Ok(words)
}

fn number(value: &Value, place: &str, least: u64) -> Result<u64, JobMistake> {
    let number = value.as_u64().filter(|number| *number >= least);
    number.ok_or_else(|| wrong_type(place, value, ExpectedValue::Whole(least)))
}

fn memory(value: &Value) -> Result<u64, JobMistake> {
    let size = value.as_str().and_then(bytes);
    size.ok_or_else(|| wrong_type("memory", value, ExpectedValue::Size))
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
