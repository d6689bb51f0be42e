//! Results as readable JSON text: an array of numbers takes one line.

use serde_json::Value;

/// A document with one member per line, and arrays of plain values on one line each.
pub fn json_text(value: &Value) -> String {
    let mut text = String::new();
    push(&mut text, value, 0);
    text.push('\n');
    text
}

fn push(text: &mut String, value: &Value, depth: usize) {
    match value {
        Value::Object(members) if !members.is_empty() => {
            text.push('{');
            for (k, (name, member)) in members.iter().enumerate() {
                begin_line(text, k, depth + 1);
                text.push_str(&Value::from(name.as_str()).to_string());
                text.push_str(": ");
                push(text, member, depth + 1);
            }
            end_line(text, depth);
            text.push('}');
        }
        Value::Array(items) if items.iter().any(|item| item.is_array() || item.is_object()) => {
            text.push('[');
            for (k, item) in items.iter().enumerate() {
                begin_line(text, k, depth + 1);
                push(text, item, depth + 1);
            }
            end_line(text, depth);
            text.push(']');
        }
        Value::Array(items) => {
            text.push('[');
            for (k, item) in items.iter().enumerate() {
                text.push_str(if k > 0 { ", " } else { "" });
                text.push_str(&item.to_string());
            }
            text.push(']');
        }
        plain => text.push_str(&plain.to_string()),
    }
}

fn begin_line(text: &mut String, k: usize, depth: usize) {
    text.push_str(if k > 0 { ",\n" } else { "\n" });
    text.extend(std::iter::repeat_n("  ", depth));
}

fn end_line(text: &mut String, depth: usize) {
    text.push('\n');
    text.extend(std::iter::repeat_n("  ", depth));
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn arrays_of_plain_values_take_a_line() {
        let value =
            json!({ "a": [1.5, null, "x\"y"], "b": [[1, 2], [3]], "c": {}, "d": [{ "e": [] }] });
        let text = json_text(&value);
        let expected = "{\n  \"a\": [1.5, null, \"x\\\"y\"],\n  \"b\": [\n    [1, 2],\n    [3]\n  ],\n  \"c\": {},\n  \"d\": [\n    {\n      \"e\": []\n    }\n  ]\n}\n";
        assert_eq!(text, expected);
        assert_eq!(serde_json::from_str::<Value>(&text).expect("JSON"), value);
    }
}
