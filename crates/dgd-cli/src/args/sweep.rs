//! Pairs of names that label or mark curves over a quantity.

/// `head=speed`: curves, and the labels at their ends.
pub(super) fn label(text: &str) -> Result<(String, String), String> {
    pair(text, '=', "this must be two names, as in `head=speed`")
}

/// `q_op,h_op`: the coordinates of points.
pub(super) fn mark(text: &str) -> Result<(String, String), String> {
    pair(text, ',', "this must be two names, as in `q_op,h_op`")
}

fn pair(text: &str, between: char, what: &str) -> Result<(String, String), String> {
    let (first, second) = text.split_once(between).ok_or(what)?;
    let (first, second) = (first.trim(), second.trim());
    if first.is_empty() || second.is_empty() || second.contains(between) {
        return Err(what.to_owned());
    }
    Ok((first.to_owned(), second.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_are_two_names() {
        assert_eq!(label("head = speed"), Ok(("head".to_owned(), "speed".to_owned())));
        assert_eq!(mark("q,h"), Ok(("q".to_owned(), "h".to_owned())));
        for wrong in ["", "q", "q,", ",h", "q,h,x"] {
            assert!(mark(wrong).is_err(), "{wrong}");
        }
        assert!(label("q,h").is_err());
    }
}
