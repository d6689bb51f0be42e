//! Pairs of recordings of a drilling rig in which effects are hidden, and the truth about them.
//!
//! ```text
//! cargo run --release --example hidden_effects -- --out DIR [--seed N] [--minutes M]
//!     [--effects NAME,NAME] [--name NAME]
//! ```
//!
//! writes `CASE.train.csv`, `CASE.valid.csv` and `truth.json`: each effect of the library alone, some
//! pairs of them, three rigs with nothing hidden and three with what no library has a name for. With
//! `--effects` there is one case, which hides all of those together (none of them for an empty list),
//! and with `--name` that case and its truth bear the name. The recordings beside the other data are
//!
//! ```text
//! cargo run --release --example hidden_effects -- --out examples/data --minutes 45 --seed 8
//!     --effects booster_u_tubing --name booster_stop
//! ```

mod drilling_rig;

use std::error::Error;
use std::fs;
use std::path::PathBuf;

use drilling_rig::effects::{Effect, LIBRARY, OUTSIDE, PAIRS, Place};
use drilling_rig::random::Random;
use drilling_rig::recording::{ACTIVE, five_digits};
use drilling_rig::{Pair, Scenario, record};

struct Arguments {
    out: PathBuf,
    seed: u64,
    minutes: Option<f64>,
    effects: Option<Vec<String>>,
    name: Option<String>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = parse(std::env::args().skip(1))?;
    fs::create_dir_all(&arguments.out)?;

    let cases: Vec<Vec<&str>> = match &arguments.effects {
        Some(names) => vec![names.iter().map(String::as_str).collect()],
        None => default_cases(),
    };
    let mut truth = Vec::new();
    for (index, names) in cases.iter().enumerate() {
        let seed = arguments.seed.wrapping_mul(1000).wrapping_add(index as u64);
        let drawn = Random::new(seed, 0).between(70.0, 110.0);
        let scenario = Scenario::drawn(seed, arguments.minutes.unwrap_or(drawn), names)
            .ok_or_else(|| format!("there is no such effect; {}", known_effects()))?;
        let pair = record(&scenario);

        let case = arguments.name.clone().unwrap_or_else(|| format!("case{index:03}"));
        fs::write(arguments.out.join(format!("{case}.train.csv")), pair.train.csv())?;
        fs::write(arguments.out.join(format!("{case}.valid.csv")), pair.valid.csv())?;
        println!("{case}  {}", if names.is_empty() { "none".into() } else { names.join(" + ") });
        truth.push(format!(" {case:?}: {}", truth_of(&scenario, &pair)));
    }
    let file =
        arguments.name.map_or_else(|| "truth.json".into(), |name| format!("{name}.truth.json"));
    fs::write(arguments.out.join(file), format!("{{\n{}\n}}\n", truth.join(",\n")))?;
    Ok(())
}

fn default_cases() -> Vec<Vec<&'static str>> {
    let alone = LIBRARY.iter().chain(&OUTSIDE).map(|&name| vec![name]);
    let together = PAIRS.iter().map(|pair| pair.to_vec());
    alone.chain(together).chain(std::iter::repeat_n(Vec::new(), 3)).collect()
}

fn known_effects() -> String {
    let names = [LIBRARY.as_slice(), &OUTSIDE].concat();
    format!("there are {}", names.join(", "))
}

fn parse(mut words: impl Iterator<Item = String>) -> Result<Arguments, Box<dyn Error>> {
    let mut out = None;
    let (mut seed, mut minutes, mut effects, mut name) = (1, None, None, None);
    while let Some(word) = words.next() {
        let value = words.next().ok_or_else(|| format!("`{word}` wants a value"))?;
        match word.as_str() {
            "--out" => out = Some(PathBuf::from(value)),
            "--seed" => seed = value.parse()?,
            "--minutes" => {
                let length: f64 = value.parse()?;
                if !(1.0..=10_000.0).contains(&length) {
                    return Err("a recording lasts 1 to 10000 minutes".into());
                }
                minutes = Some(length);
            }
            "--effects" => {
                let names = value.split(',').filter(|name| !name.is_empty());
                effects = Some(names.map(str::to_owned).collect());
            }
            "--name" => name = Some(value),
            _ => return Err(format!("`{word}` is no option").into()),
        }
    }
    if name.is_some() && effects.is_none() {
        return Err("`--name` names the case of `--effects`".into());
    }
    let out = out.ok_or("`--out DIR` says where the recordings go")?;
    Ok(Arguments { out, seed, minutes, effects, name })
}

/// One case's entry in the truth, in JSON.
fn truth_of(scenario: &Scenario, pair: &Pair) -> String {
    let names: Vec<&str> = scenario.effects.iter().map(Effect::name).collect();
    let kind = match names.as_slice() {
        [] => "none".to_owned(),
        ["?"] => "outside".to_owned(),
        names => names.join("+"),
    };
    let mut twins: Vec<&str> =
        scenario.effects.iter().flat_map(Effect::near_twins).copied().collect();
    twins.retain(|twin| !names.contains(twin));
    let onset = scenario.effects.iter().find_map(Effect::onset);
    let windows: Vec<String> = if pair.rig.plant.booster_line.is_some() {
        let windows = pair.train.windows(ACTIVE);
        windows.iter().map(|(first, last)| format!("[{first}, {last}]")).collect()
    } else {
        Vec::new()
    };

    let plant = &pair.rig.plant;
    let mut parameters = vec![
        ("M_ssp [kg/m^4]", plant.inertia),
        ("c0 [m]", plant.c0),
        ("c2 [s^2/m^5]", plant.c2),
        ("F2 [Pa*s^2/m^6]", plant.f2),
    ];
    let mut sensors = Vec::new();
    for (place, name, value) in scenario.effects.iter().flat_map(Effect::sizes) {
        match place {
            Place::Parameters => parameters.push((name, value)),
            Place::Sensors => sensors.push((name, value)),
        }
    }

    let strings = |names: &[&str]| -> String {
        let quoted: Vec<String> = names.iter().map(|name| format!("{name:?}")).collect();
        format!("[{}]", quoted.join(", "))
    };
    let numbers = |entries: &[(&str, f64)]| -> String {
        let lines: Vec<String> = entries
            .iter()
            .map(|(name, value)| format!("\n   {name:?}: {}", five_digits(*value)))
            .collect();
        if lines.is_empty() { "{}".to_owned() } else { format!("{{{}\n  }}", lines.join(",")) }
    };
    format!(
        "{{\n  \"kind\": {kind:?},\n  \"effects\": {},\n  \"equivalents\": {},\n  \"onset\": {},\n  \
         \"windows\": [{}],\n  \"parameters\": {},\n  \"sensors\": {}\n }}",
        strings(&names),
        strings(&twins),
        onset.map_or_else(|| "null".to_owned(), |onset| onset.to_string()),
        windows.join(", "),
        numbers(&parameters),
        numbers(&sensors),
    )
}
