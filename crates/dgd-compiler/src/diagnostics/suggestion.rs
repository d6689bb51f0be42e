//! Suggestions for misspelt names.

/// The candidate that a name was probably meant to be, if there is a likely one.
///
/// A likely name differs from it by few slips: a letter that is wrong, missing, superfluous, or swapped with its
/// neighbour, with one slip allowed for every three letters. Upper and lower case count as half a slip for the whole
/// name. Ties are broken in alphabetical order.
pub fn suggestion<'a>(
    name: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<&'a str> {
    let word = ComparedName::new(name);
    // In half slips. Replacing every letter is not a slip.
    let mut most =
        (2 * word.letters.len().div_ceil(3).min(4)).min((2 * word.letters.len()).checked_sub(1)?);
    let mut best: Option<(usize, &str)> = None;
    let mut other = ComparedName::default();
    for candidate in candidates {
        other.read(candidate);
        if candidate == name || !word.may_be_within(&other, most / 2) {
            continue;
        }
        // Ignoring case can only reduce the distance.
        let Some(lower) = distance_within(&word.lower, &other.lower, most / 2) else { continue };
        let exact = distance_within(&word.letters, &other.letters, most / 2);
        let slips = exact.map_or(usize::MAX, |exact| 2 * exact).min(2 * lower + 1);
        if slips <= most && best.is_none_or(|best| (slips, candidate) < best) {
            best = Some((slips, candidate));
            most = slips;
        }
    }
    best.map(|(_, candidate)| candidate)
}

/// A name prepared for comparisons.
#[derive(Default)]
struct ComparedName {
    letters: Vec<char>,
    lower: Vec<char>,
    /// A bit for each of its letters, in lower case; some letters share one.
    set: u64,
}

impl ComparedName {
    fn new(text: &str) -> Self {
        let mut word = ComparedName::default();
        word.read(text);
        word
    }

    fn read(&mut self, text: &str) {
        self.letters.clear();
        self.letters.extend(text.chars());
        self.lower.clear();
        self.lower.extend(text.chars().flat_map(char::to_lowercase));
        self.set = self.lower.iter().fold(0, |set, letter| set | 1 << (u32::from(*letter) % 64));
    }

    /// Whether lengths and letters allow so few slips: each slip adds or removes at most one letter.
    fn may_be_within(&self, other: &ComparedName, most: usize) -> bool {
        let missing =
            (self.set & !other.set).count_ones().max((other.set & !self.set).count_ones());
        missing as usize <= most && self.letters.len().abs_diff(other.letters.len()) <= most
    }
}

/// The optimal string alignment distance (insertions, deletions, replacements and swaps of neighbours) from `a` to `b`,
/// if it is at most `most`.
fn distance_within(a: &[char], b: &[char], most: usize) -> Option<usize> {
    if a.len().abs_diff(b.len()) > most {
        return None;
    }
    // rows[i % 3][j]: distance of the first i letters of a and the first j of b, near the diagonal
    let far = most + 1;
    let mut rows = [vec![far; b.len() + 1], (0..=b.len()).collect(), vec![far; b.len() + 1]];
    for i in 1..=a.len() {
        let [before, above, mut row] = rows;
        row.fill(far);
        row[0] = i;
        for j in i.saturating_sub(most).max(1)..=(i + most).min(b.len()) {
            let replaced = above[j - 1] + usize::from(a[i - 1] != b[j - 1]);
            row[j] = replaced.min(above[j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                row[j] = row[j].min(before[j - 2] + 1);
            }
        }
        if row.iter().all(|slips| *slips > most) {
            return None;
        }
        rows = [above, row, before];
    }
    Some(rows[1][b.len()]).filter(|slips| *slips <= most)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_count_slips() {
        for (a, b, expected) in
            [("", "abc", 3), ("kitten", "sitting", 3), ("lmp", "lpm", 1), ("same", "same", 0)]
        {
            let letters = |s: &str| s.chars().collect::<Vec<_>>();
            for most in 0..5 {
                let found = distance_within(&letters(a), &letters(b), most);
                assert_eq!(found, Some(expected).filter(|slips| *slips <= most), "{a} {b}");
            }
        }
    }

    #[test]
    fn likely_names_are_suggested_and_others_are_not() {
        let names = ["q_ssp", "q_boost", "h_r", "rho", "g"];
        assert_eq!(suggestion("q_spp", names), Some("q_ssp"));
        assert_eq!(suggestion("Rho", names), Some("rho"));
        assert_eq!(suggestion("boost", ["q_boost", "roost"]), Some("roost"));
        assert_eq!(suggestion("pressure", names), None);
        assert_eq!(suggestion("x", names), None);
        assert_eq!(suggestion("ab", ["aa", "bb", "ac"]), Some("aa"));
    }

    /// Compares with the definition, the shortest sequence of single slips, for all pairs of many names.
    #[test]
    fn a_suggestion_is_the_nearest_name() {
        let names: Vec<String> = (0..400)
            .map(|k| {
                let digit = |k: usize| ["a", "b", "A", "_", "x1"][k % 5];
                [digit(k), digit(k / 5), "q", digit(k / 7), digit(k / 25)].concat()
            })
            .collect();
        let distance = |a: &[char], b: &[char]| {
            let mut all = vec![vec![0; b.len() + 1]; a.len() + 1];
            for i in 0..=a.len() {
                for j in 0..=b.len() {
                    let mut least = if i == 0 || j == 0 { i + j } else { usize::MAX };
                    if i > 0 && j > 0 {
                        let replaced = all[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
                        least = replaced.min(all[i - 1][j] + 1).min(all[i][j - 1] + 1);
                    }
                    if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                        least = least.min(all[i - 2][j - 2] + 1);
                    }
                    all[i][j] = least;
                }
            }
            all[a.len()][b.len()]
        };
        let letters = |text: &str| text.chars().collect::<Vec<char>>();
        for name in ["abqab", "AbQa", "x1x1q_", "zzzz", "q", "bqa_x1b"] {
            let n = letters(name).len();
            let slips = |other: &str| {
                let exact = 2 * distance(&letters(name), &letters(other));
                let (lower, others) = (name.to_lowercase(), other.to_lowercase());
                exact.min(2 * distance(&letters(&lower), &letters(&others)) + 1)
            };
            let nearest = names
                .iter()
                .filter(|other| *other != name)
                .map(|other| (slips(other), other.as_str()))
                .filter(|(slips, _)| *slips <= 2 * n.div_ceil(3).min(4) && *slips < 2 * n)
                .min();
            let found = suggestion(name, names.iter().map(String::as_str));
            assert_eq!(found, nearest.map(|(_, other)| other), "{name}");
        }
    }
}
