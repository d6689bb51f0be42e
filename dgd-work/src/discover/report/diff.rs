//! The change of a model as a patch.

use similar::{ChangeTag, TextDiff};

/// Unchanged lines around each change.
const CONTEXT: usize = 3;

/// A unified diff that `patch` and `git apply` take; empty where nothing changed.
pub(super) fn unified(before: &str, after: &str, name: &str) -> String {
    TextDiff::from_lines(before, after)
        .unified_diff()
        .context_radius(CONTEXT)
        .header(&format!("a/{name}"), &format!("b/{name}"))
        .to_string()
}

/// A line of a diff or of a list with changes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Changed<T> {
    /// `same`, `removed` or `added`, or `place` where lines are left out.
    pub(super) class: &'static str,
    pub(super) content: T,
}

/// The lines of a unified diff behind its header, each with what it says.
pub(super) fn lines(diff: &str) -> Vec<Changed<&str>> {
    let class = |line: &str| match line.chars().next() {
        Some('+') => "added",
        Some('-') => "removed",
        Some('@') => "place",
        _ => "same",
    };
    diff.lines().skip(2).map(|content| Changed { class: class(content), content }).collect()
}

/// The entries of two lists in one: what was removed stands before what was added.
pub(super) fn merged<T: Clone>(
    before: &[T],
    after: &[T],
    text: impl Fn(&T) -> String,
) -> Vec<Changed<T>> {
    let (old, new): (Vec<String>, Vec<String>) =
        (before.iter().map(&text).collect(), after.iter().map(&text).collect());
    let (old, new): (Vec<&str>, Vec<&str>) =
        (old.iter().map(String::as_str).collect(), new.iter().map(String::as_str).collect());
    let changes = TextDiff::from_slices(&old, &new);
    let entry = |list: &[T], index: Option<usize>| index.and_then(|at| list.get(at)).cloned();
    changes
        .iter_all_changes()
        .filter_map(|change| {
            let (class, content) = match change.tag() {
                ChangeTag::Equal => ("same", entry(after, change.new_index())),
                ChangeTag::Delete => ("removed", entry(before, change.old_index())),
                ChangeTag::Insert => ("added", entry(after, change.new_index())),
            };
            content.map(|content| Changed { class, content })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_is_a_patch_and_no_change_is_nothing() {
        let diff = unified("a\nb\nc\n", "a\nB\nc\n", "m.dgd");
        assert_eq!(diff, "--- a/m.dgd\n+++ b/m.dgd\n@@ -1,3 +1,3 @@\n a\n-b\n+B\n c\n");
        let classes: Vec<_> = lines(&diff).iter().map(|line| line.class).collect();
        assert_eq!(classes, ["place", "same", "removed", "added", "same"]);
        assert_eq!(unified("a\n", "a\n", "m.dgd"), "");
    }

    #[test]
    fn lists_are_merged_with_old_entries_before_new_ones() {
        let all = merged(&[1, 2, 3], &[1, 4, 3, 5], i32::to_string);
        let shown: Vec<_> = all.iter().map(|c| (c.class, c.content)).collect();
        let (same, added) = ("same", "added");
        assert_eq!(shown, [(same, 1), ("removed", 2), (added, 4), (same, 3), (added, 5)]);
    }
}
