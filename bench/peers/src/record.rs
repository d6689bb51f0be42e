//! Writes the results into the repository.

use std::fs;
use std::path::Path;

/// Lines of `docs/speed.md` around the table.
const BEGIN: &str = "<!-- written by bench/peers -- --record -->\n";
const END: &str = "<!-- until here -->\n";

/// Writes `table` into `docs/speed.md` of the repository, and `all` into `results.md` of this folder.
///
/// # Errors
///
/// A file cannot be read or written, or the page has no place for a table.
pub(crate) fn write(folder: &Path, root: &Path, table: &str, all: &str) -> Result<(), String> {
    let path = root.join("docs").join("speed.md");
    let describe = |error: std::io::Error| format!("{}: {error}", path.display());
    let page = fs::read_to_string(&path).map_err(describe)?;
    let page = replaced(&page, table).ok_or("docs/speed.md has no place for the table")?;
    fs::write(&path, page).map_err(describe)?;
    let results = folder.join("results.md");
    let before = fs::read_to_string(&results).unwrap_or_default();
    let text = format!(
        "# Measured\n\n[README.md](README.md) says what is compared, and how.\n\n{all}{}",
        of_other_programs(&before)
    );
    fs::write(&results, text).map_err(|error| format!("{}: {error}", results.display()))
}

/// Results of other programs: everything from the section on discovery on.
fn of_other_programs(results: &str) -> String {
    match results.find("\n## Discovery\n") {
        Some(at) => results[at..].to_owned(),
        None => String::new(),
    }
}

/// The page with the table replaced.
fn replaced(page: &str, table: &str) -> Option<String> {
    let (before, rest) = page.split_once(BEGIN)?;
    let (_, after) = rest.split_once(END)?;
    Some(format!("{before}{BEGIN}\n{table}\n{END}{after}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_around_the_table_stays() {
        let page = format!("a\n{BEGIN}\nold\n{END}b\n");
        let expected = format!("a\n{BEGIN}\nnew\n{END}b\n");
        assert_eq!(replaced(&page, "new"), Some(expected));
    }

    #[test]
    fn what_other_programs_have_measured_stays() {
        let results = "# Measured\n\nold\n\n## Discovery\n\ntable\n";
        assert_eq!(of_other_programs(results), "\n## Discovery\n\ntable\n");
        assert_eq!(of_other_programs("# Measured\n"), "");
    }

    #[test]
    fn without_a_place_nothing_is_written() {
        assert_eq!(replaced("a\n", "new"), None);
    }
}
