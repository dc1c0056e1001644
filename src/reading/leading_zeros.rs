//! Times whose digits nothing separates, of which a logger leaves out the leading zeros.

use std::borrow::Cow;

/// `text` with zeros before the digits of parts that nothing separates, as many as `pattern` writes: `2026 61 115` is `2026 61 0115` for
/// `%Y %j %H%M`. Loggers leave them out, and the first two digits of 115 are no hour.
pub(super) fn with_leading_zeros<'a>(pattern: &str, text: &'a str) -> Cow<'a, str> {
    // Asked for each time of a table: most patterns separate their parts.
    if !pattern
        .as_bytes()
        .windows(3)
        .any(|three| three[0] == b'%' && three[2] == b'%')
    {
        return text.into();
    }
    let Some(widths) = digits_together(pattern) else {
        return text.into();
    };
    let runs = text.split(|one: char| !one.is_ascii_digit());
    let runs: Vec<&str> = runs.filter(|run| !run.is_empty()).collect();
    let is_short =
        |(run, width): (&&str, &Option<usize>)| width.is_some_and(|width| run.len() < width);
    if runs.len() != widths.len() || !runs.iter().zip(&widths).any(is_short) {
        return text.into();
    }
    let (mut padded, mut rest) = (String::new(), text);
    for (run, width) in runs.iter().zip(widths) {
        let at = rest
            .find(|one: char| one.is_ascii_digit())
            .unwrap_or(rest.len());
        padded.push_str(&rest[..at]);
        padded.push_str(&"0".repeat(width.unwrap_or(0).saturating_sub(run.len())));
        padded.push_str(run);
        rest = &rest[at + run.len()..];
    }
    padded.push_str(rest);
    padded.into()
}

/// Of each run of digits that `pattern` writes: how many there are, where several parts make it up; `None` for the pattern of which that is not
/// known.
fn digits_together(pattern: &str) -> Option<Vec<Option<usize>>> {
    let mut runs: Vec<(usize, usize)> = Vec::new();
    let mut is_within = false;
    let mut letters = pattern.chars();
    while let Some(letter) = letters.next() {
        if letter != '%' {
            if letter.is_ascii_digit() {
                return None;
            }
            is_within = false;
            continue;
        }
        let width = match letters.next()? {
            'Y' => 4,
            'j' => 3,
            'd' | 'm' | 'y' | 'H' | 'I' | 'M' | 'S' => 2,
            'b' | 'B' | 'h' | 'a' | 'A' | 'p' | 'P' => {
                is_within = false;
                continue;
            }
            _ => return None,
        };
        match runs.last_mut().filter(|_| is_within) {
            Some((parts, digits)) => (*parts, *digits) = (*parts + 1, *digits + width),
            None => runs.push((1, width)),
        }
        is_within = true;
    }
    let each = runs.into_iter();
    Some(
        each.map(|(parts, digits)| (parts > 1).then_some(digits))
            .collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::with_leading_zeros;

    #[test]
    fn what_nothing_separates_is_as_long_as_the_pattern_writes_it_and_nothing_else_changes() {
        for (pattern, text, padded) in [
            ("%Y %j %H%M", "2026 61 115", "2026 61 0115"),
            ("%Y %j %H%M", "2026 61 0", "2026 61 0000"),
            ("%Y %j %H%M", "2026 61 1415", "2026 61 1415"),
            ("%d%m%Y %H:%M", "1092026 7:05", "01092026 7:05"),
            ("%d.%m.%Y %H:%M", "1.9.2026 7:05", "1.9.2026 7:05"),
            ("%d %b %Y %H%M", "1 Sep 2026 705", "1 Sep 2026 0705"),
            // One run of digits less, and one with more digits: for the pattern to refuse.
            ("%Y %j %H%M", "2026 61", "2026 61"),
            ("%Y %j %H%M", "2026 61 11500", "2026 61 11500"),
            // How many digits a fraction has is not known.
            ("%H%M%S%.f", "115.5", "115.5"),
        ] {
            assert_eq!(with_leading_zeros(pattern, text), padded, "{pattern}");
        }
    }
}
