//! The command line.

use std::str::FromStr;

/// What to measure, and for how long.
#[derive(Debug)]
pub(crate) struct Arguments {
    /// Number of rounds, in each of which everything is run in turn.
    pub(crate) rounds: usize,
    /// Time for which a program repeats its run in a round, s.
    pub(crate) span: f64,
    /// The cases to run; all if empty.
    pub(crate) cases: Vec<String>,
    /// The peers to run; all if empty.
    pub(crate) peers: Vec<String>,
    /// Whether to fetch missing peers.
    pub(crate) install: bool,
    /// Whether to write the table of `docs/speed.md` and the complete results.
    pub(crate) record: bool,
}

const USAGE: &str = "\
usage: cargo run --release --manifest-path bench/peers/Cargo.toml -- [OPTIONS]

  --rounds N        how often everything is run in turn [5]
  --span SECONDS    for how long a program repeats a run each time [0.1]
  --cases A,B       only these, e.g. p1a,p5b; `build` is a user's crate
  --peers A,B       only these, e.g. dgd,diffsol
  --install         fetch SciPy, CasADi and SUNDIALS where they are missing, into the target folder
  --record          write results.md and the table in docs/speed.md
";

impl Arguments {
    /// Whether this case and this peer are requested.
    pub(crate) fn asks_for(&self, case: &str, peer: &str) -> bool {
        let any = |list: &[String], name| list.is_empty() || list.iter().any(|x| x == name);
        any(&self.cases, case) && any(&self.peers, peer)
    }
}

/// Reads the command line.
///
/// # Errors
///
/// The usage, and the error.
pub(crate) fn parse(mut words: impl Iterator<Item = String>) -> Result<Arguments, String> {
    let mut arguments = Arguments {
        rounds: 5,
        span: 0.1,
        cases: Vec::new(),
        peers: Vec::new(),
        install: false,
        record: false,
    };
    while let Some(option) = words.next() {
        let mut value = || words.next().ok_or_else(|| USAGE.to_owned());
        match option.as_str() {
            "--rounds" => arguments.rounds = number(&option, &value()?, |rounds| *rounds > 0)?,
            "--span" => arguments.span = number(&option, &value()?, |span| *span >= 0.0)?,
            "--cases" => arguments.cases = names(&value()?),
            "--peers" => arguments.peers = names(&value()?),
            "--install" => arguments.install = true,
            "--record" => arguments.record = true,
            _ => return Err(USAGE.to_owned()),
        }
    }
    if arguments.record && !(arguments.cases.is_empty() && arguments.peers.is_empty()) {
        return Err(format!("what is recorded is all cases and all peers\n\n{USAGE}"));
    }
    Ok(arguments)
}

fn number<T: FromStr>(option: &str, text: &str, fits: impl Fn(&T) -> bool) -> Result<T, String> {
    let number = text.parse().ok().filter(fits);
    number.ok_or_else(|| format!("`{text}` does not fit {option}\n\n{USAGE}"))
}

fn names(text: &str) -> Vec<String> {
    text.split(',').map(str::to_owned).collect()
}
