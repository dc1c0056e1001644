//! An explanation as one HTML file that needs no other: no network, no scripts.

use super::sections::{PageSection, gained, grounds, subject};
use super::sentence;
use crate::effects::Explanation;
use crate::figures::pictures;
use crate::plot::escaped;
use std::fmt::Write as _;

/// In the dark the figures' own colours are turned as well: a style outranks an attribute.
pub(in crate::cli) const STYLE: &str = "
:root { color-scheme: light dark; --ground: #ffffff; --text: #1a1a1a; --faint: #5a5a5a; --line: #d8d8d8; --note: #f3f5f8; }
body { background: var(--ground); color: var(--text); font: 16px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 62rem; padding: 0 1rem; }
h1 { font-size: 1.35rem; line-height: 1.35; margin: 0 0 .8rem; }
h2 { font-size: 1.1rem; margin: 2rem 0 .5rem; }
.others { background: var(--note); border-left: 4px solid #0072b2; list-style: none; margin: 0; padding: .6rem 1rem; }
.subject, figcaption, footer { color: var(--faint); font-size: .9rem; }
figure { margin: 1.6rem 0; }
svg { display: block; height: auto; max-width: 100%; }
.wide { margin-bottom: 1rem; overflow-x: auto; }
table { border-collapse: collapse; font-size: .88rem; font-variant-numeric: tabular-nums; }
th, td { border-bottom: 1px solid var(--line); padding: .25rem .8rem .25rem 0; text-align: left; vertical-align: top; }
th, td:not(:last-child) { white-space: nowrap; }
td:last-child { min-width: 6rem; }
@media (max-width: 50rem) { th, td:not(:last-child) { white-space: normal; } }
@media (prefers-color-scheme: dark) {
:root { --ground: #16181c; --text: #e6e6e6; --faint: #a5a5a5; --line: #3a3d42; --note: #1f2329; }
svg { fill: #e6e6e6; }
svg rect[fill=\"#ffffff\"] { fill: #16181c; }
svg [stroke=\"#e4e4e4\"] { stroke: #33363b; }
svg [stroke=\"#111111\"] { stroke: #b0b0b0; }
svg [stroke=\"#0072b2\"] { stroke: #56b4e9; }
svg [fill=\"#0072b2\"] { fill: #56b4e9; }
svg [fill=\"#777777\"] { fill: #9a9a9a; }
}
";

/// The whole file.
pub(super) fn page(explanation: &Explanation) -> String {
    let verdict = escaped(&sentence::verdict(explanation));
    let mut out = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
         <title>{}: what the law lacks</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<h1>{verdict}</h1>\n",
        escaped(explanation.benchmark.as_str()),
    );
    // Writing to a string cannot fail.
    let others = sentence::others(explanation);
    if !others.is_empty() {
        out.push_str("<ul class=\"others\">\n");
        for sentence in others {
            let _ = writeln!(out, "<li>{}</li>", escaped(&sentence));
        }
        out.push_str("</ul>\n");
    }
    let _ = writeln!(
        out,
        "<p class=\"subject\">{}</p>",
        escaped(&subject(explanation))
    );
    for section in gained(explanation) {
        out.push_str(&element(&section));
    }
    for picture in pictures(explanation) {
        let _ = writeln!(
            out,
            "<figure id=\"{}\">\n{}<figcaption>{}</figcaption>\n</figure>",
            picture.name,
            picture.svg,
            escaped(&picture.caption)
        );
    }
    for section in grounds(explanation) {
        out.push_str(&element(&section));
    }
    let _ = writeln!(
        out,
        "<footer><p>slipwatch {}. An effect is what the readings are consistent with; it is not proved to cause them.</p></footer>\n</body>\n</html>",
        escaped(&explanation.settings.version)
    );
    out
}

/// What is found, in short, as a part of another page.
pub(in crate::cli) fn part(explanation: &Explanation) -> String {
    let mut out = format!("<p>{}</p>\n", escaped(&sentence::verdict(explanation)));
    // Writing to a string cannot fail.
    for sentence in sentence::others(explanation) {
        let _ = writeln!(out, "<p>{}</p>", escaped(&sentence));
    }
    for section in gained(explanation) {
        let table = section.table.html();
        let _ = writeln!(out, "<div class=\"wide\">{table}</div>");
    }
    out
}

fn element(section: &PageSection) -> String {
    format!(
        "<h2>{}</h2>\n<div class=\"wide\">{}</div>\n",
        escaped(section.heading),
        section.table.html()
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Kind;
    use crate::figures::fixture::{bare, lake};

    #[test]
    fn the_page_has_the_verdict_the_figures_and_the_tables_and_needs_no_other_file() {
        let page = page(&lake());
        for part in [
            "<h1>BLKM: consistent with hydrological forcing",
            "<figure id=\"readings\">",
            "<figure id=\"residual\">",
            "<figure id=\"autocorrelation\">",
            "<figure id=\"contributions\">",
            "<figure id=\"undeclared-load\">",
            "<figure id=\"rivals\">",
            "<h2>Everything tried</h2>",
            "rain &amp; season",
            "prefers-color-scheme: dark",
        ] {
            assert!(page.contains(part), "{part} is not in the page");
        }
        let outside = page.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
        for sign in ["http", "src=", "href=", "@import", "<script", "<link"] {
            assert!(!outside.contains(sign), "{sign}");
        }
        assert!(!page.contains("NaN") && !page.contains("inf,"));
    }

    #[test]
    fn names_within_the_page_are_its_own() {
        let page = page(&lake());
        let mut names: Vec<&str> = page
            .split(" id=\"")
            .skip(1)
            .map(|rest| rest.split('"').next().unwrap())
            .collect();
        let count = names.len();
        assert!(count > 8, "{names:?}");
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count);
    }

    #[test]
    fn a_page_without_numbers_is_a_page_without_figures() {
        let page = page(&bare(Kind::NONE));
        assert!(!page.contains("<svg") && page.contains("cannot be distinguished from noise"));
    }

    #[test]
    fn a_name_cannot_break_out_of_its_place() {
        let mut explanation = lake();
        explanation.verdict.channel = Some("<script>x</script>".to_owned());
        explanation.candidates[0].channel = explanation.verdict.channel.clone();
        assert!(!page(&explanation).contains("<script"));
    }
}
