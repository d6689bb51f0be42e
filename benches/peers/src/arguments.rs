//! The command line.

/// What to measure, and for how long.
#[derive(Debug)]
pub(crate) struct Arguments {
    /// How often everything is run in turn.
    pub(crate) rounds: usize,
    /// How long a program repeats a run each time, s.
    pub(crate) span: f64,
    /// The cases to run; all where there are none.
    pub(crate) cases: Vec<String>,
    /// The peers to run; all where there are none.
    pub(crate) peers: Vec<String>,
}

const USAGE: &str = "\
usage: cargo run --release --manifest-path benches/peers/Cargo.toml -- [OPTIONS]

  --rounds N        how often everything is run in turn [5]
  --span SECONDS    for how long a program repeats a run each time [0.1]
  --cases A,B       only these, e.g. p1a,p5b
  --peers A,B       only these, e.g. dgd,diffsol
";

impl Arguments {
    /// Whether this case and this peer are asked for.
    pub(crate) fn asks_for(&self, case: &str, peer: &str) -> bool {
        let any = |list: &[String], name| list.is_empty() || list.iter().any(|x| x == name);
        any(&self.cases, case) && any(&self.peers, peer)
    }
}

/// Reads the command line.
///
/// # Errors
///
/// The usage, and what is wrong.
pub(crate) fn parse(words: impl Iterator<Item = String>) -> Result<Arguments, String> {
    let mut arguments = Arguments { rounds: 5, span: 0.1, cases: Vec::new(), peers: Vec::new() };
    let mut words = words;
    while let Some(option) = words.next() {
        let value = words.next().ok_or_else(|| USAGE.to_owned())?;
        let wrong = || format!("`{value}` does not fit {option}\n\n{USAGE}");
        let names = || value.split(',').map(str::to_owned).collect();
        match option.as_str() {
            "--rounds" => {
                arguments.rounds =
                    value.parse().ok().filter(|rounds| *rounds > 0).ok_or_else(wrong)?;
            }
            "--span" => {
                arguments.span =
                    value.parse().ok().filter(|span: &f64| *span >= 0.0).ok_or_else(wrong)?;
            }
            "--cases" => arguments.cases = names(),
            "--peers" => arguments.peers = names(),
            _ => return Err(USAGE.to_owned()),
        }
    }
    Ok(arguments)
}
