//! The change of a model as a patch.

use std::convert::Infallible;
use std::fmt::Write as _;
use std::ops::Range;

use similar::algorithms::{Capture, Compact, Replace, myers};
use similar::{DiffOp, DiffTag, group_diff_ops};

/// Unchanged lines around each change.
const CONTEXT: usize = 3;

/// The shortest edit script between two lists. A single algorithm and type keep the others out of the build.
fn changes(old: &[&str], new: &[&str]) -> Vec<DiffOp> {
    let mut hook = Compact::new(Replace::new(Capture::new()), old, new);
    let done: Result<(), Infallible> = myers::diff(&mut hook, old, 0..old.len(), new, 0..new.len());
    let Ok(()) = done;
    hook.into_inner().into_inner().into_ops()
}

/// A unified diff for `patch` and `git apply`; empty if nothing changed.
pub(super) fn unified(before: &str, after: &str, name: &str) -> String {
    let (old, new): (Vec<&str>, Vec<&str>) =
        (before.split_inclusive('\n').collect(), after.split_inclusive('\n').collect());
    let mut text = String::new();
    for hunk in group_diff_ops(changes(&old, &new), CONTEXT) {
        let (Some(first), Some(last)) = (hunk.first(), hunk.last()) else { continue };
        if text.is_empty() {
            text = format!("--- a/{name}\n+++ b/{name}\n");
        }
        let old_lines = lines_from(first.old_range().start, last.old_range().end);
        let new_lines = lines_from(first.new_range().start, last.new_range().end);
        let _ = writeln!(text, "@@ -{old_lines} +{new_lines} @@");
        for change in &hunk {
            let (removed, added) = (&old[change.old_range()], &new[change.new_range()]);
            let shown: &[(char, &[&str])] = match change.tag() {
                DiffTag::Equal => &[(' ', removed)],
                _ => &[('-', removed), ('+', added)],
            };
            for (sign, line) in
                shown.iter().flat_map(|(sign, lines)| lines.iter().map(move |line| (sign, line)))
            {
                let _ = write!(text, "{sign}{line}");
                if !line.ends_with('\n') {
                    text.push_str("\n\\ No newline at end of file\n");
                }
            }
        }
    }
    text
}

/// The line range of a hunk's header; an empty range gives the line before it.
fn lines_from(start: usize, end: usize) -> String {
    match end - start {
        0 => format!("{start},0"),
        1 => format!("{}", start + 1),
        count => format!("{},{count}", start + 1),
    }
}

/// A line of a diff or of a list with changes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ChangedLine<T> {
    /// `same`, `removed` or `added`, or `place` for omitted lines.
    pub(super) class: &'static str,
    pub(super) content: T,
}

/// The lines of a unified diff after its header, each with its class.
pub(super) fn lines(diff: &str) -> Vec<ChangedLine<&str>> {
    let class = |line: &str| match line.chars().next() {
        Some('+') => "added",
        Some('-') => "removed",
        Some('@') => "place",
        _ => "same",
    };
    diff.lines().skip(2).map(|content| ChangedLine { class: class(content), content }).collect()
}

/// Two lists merged into one; removed entries come before added ones.
pub(super) fn merged<T: Clone>(
    before: &[T],
    after: &[T],
    text: impl Fn(&T) -> String,
) -> Vec<ChangedLine<T>> {
    let (old, new): (Vec<String>, Vec<String>) =
        (before.iter().map(&text).collect(), after.iter().map(&text).collect());
    let (old, new): (Vec<&str>, Vec<&str>) =
        (old.iter().map(String::as_str).collect(), new.iter().map(String::as_str).collect());
    let entries = |class: &'static str, list: &[T], range: Range<usize>| -> Vec<ChangedLine<T>> {
        list[range].iter().map(|entry| ChangedLine { class, content: entry.clone() }).collect()
    };
    let entries_of = |change: DiffOp| {
        if change.tag() == DiffTag::Equal {
            return entries("same", after, change.new_range());
        }
        let removed = entries("removed", before, change.old_range());
        [removed, entries("added", after, change.new_range())].concat()
    };
    changes(&old, &new).into_iter().flat_map(entries_of).collect()
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
    fn hunks_of_nothing_of_one_line_and_without_a_last_newline_are_as_patch_reads_them() {
        let header = "--- a/m.dgd\n+++ b/m.dgd\n";
        let written = |before, after| unified(before, after, "m.dgd").replacen(header, "", 1);
        assert_eq!(written("", "a\n"), "@@ -0,0 +1 @@\n+a\n");
        assert_eq!(written("a\n", ""), "@@ -1 +0,0 @@\n-a\n");
        let newline = "\n\\ No newline at end of file\n";
        assert_eq!(written("a\nb", "a\nc"), format!("@@ -1,2 +1,2 @@\n a\n-b{newline}+c{newline}"));
        let lines = |changed: &str| {
            (0..20).map(|i| if i % 12 == 3 { changed.into() } else { format!("{i}\n") }).collect()
        };
        let (before, after): (String, String) = (lines("x\n"), lines("y\n"));
        let hunks = written(&before, &after);
        assert!(hunks.starts_with("@@ -1,7 +1,7 @@\n") && hunks.contains("@@ -13,7 +13,7 @@\n"));
    }

    #[test]
    fn lists_are_merged_with_old_entries_before_new_ones() {
        let entries = merged(&[1, 2, 3], &[1, 4, 3, 5], i32::to_string);
        let shown: Vec<_> = entries.iter().map(|c| (c.class, c.content)).collect();
        let (same, added) = ("same", "added");
        assert_eq!(shown, [(same, 1), ("removed", 2), (added, 4), (same, 3), (added, 5)]);
    }
}
