//! Text from files and options that goes into sentences.

/// `text` on one line: a name or URI from a file may hold anything, and a terminal obeys control characters.
pub(crate) fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() || matches!(c, '\u{2028}' | '\u{2029}') { '\u{fffd}' } else { c }).collect()
}
