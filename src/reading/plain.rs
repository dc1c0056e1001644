//! Text from files and messages, as it can be shown.

/// The text with its control characters written out (`\n`, `\u{1b}`): a name with a line break in it forges no line, and one with
/// an escape in it changes nobody's terminal.
pub fn plain(text: &str) -> String {
    if !text.chars().any(char::is_control) {
        return text.to_owned();
    }
    let mut plain = String::with_capacity(text.len() + 8);
    for letter in text.chars() {
        if letter.is_control() {
            plain.extend(letter.escape_default());
        } else {
            plain.push(letter);
        }
    }
    plain
}
