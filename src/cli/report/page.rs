//! The page: a heading, a part for each benchmark, then where everything comes from.

use super::Args;
use super::material::Material;
use super::sections;
use crate::cli::explain::STYLE;
use crate::cli::table::TextTable;
use crate::plot::escaped;
use std::fmt::Write as _;

/// On paper each figure and table row stays whole, and each benchmark begins a sheet.
const PRINT: &str = "
h3 { font-size: 1rem; margin: 1.4rem 0 .4rem; }
.scores table { font-size: .8rem; }
.scores th, .scores td:not(:first-child) { min-width: 0; padding-right: .5rem; white-space: normal !important; }
@media print {
body { font-size: 9pt; margin: 0; max-width: none; padding: 0; }
section.benchmark { break-before: page; }
section.benchmark:first-of-type { break-before: auto; }
figure, tr { break-inside: avoid; }
h2, h3 { break-after: avoid; }
.wide { overflow: visible; }
svg { max-height: 13cm; }
th, td { white-space: normal !important; }
thead { break-after: avoid; }
nav { display: none; }
}
";

/// The whole file.
pub(super) fn page(args: &Args, material: &Material) -> anyhow::Result<String> {
    let title = escaped(&material.title);
    let mut out = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
         <title>{title}</title>\n<style>{STYLE}{PRINT}</style>\n</head>\n<body>\n<h1>{title}</h1>\n",
    );
    if let Some(kind) = material.recording.reconstruction() {
        // Writing to a string cannot fail.
        let _ = writeln!(
            out,
            "<p class=\"subject\">These readings are a {}, not measured.</p>",
            escaped(kind)
        );
    }
    if let Some(zone) = material.zone.iana_name().filter(|name| *name != "UTC") {
        let _ = writeln!(
            out,
            "<p class=\"subject\">Times are those of {}; on the axes of figures they are in UTC.</p>",
            escaped(zone)
        );
    }
    out.push_str("<ul class=\"others\">\n");
    for (index, series) in material.recording.series.iter().enumerate() {
        let _ = writeln!(
            out,
            "<li><a href=\"#b{index}\">{}</a>: {}</li>",
            escaped(series.benchmark.as_str()),
            escaped(&sections::summary(material, series))
        );
    }
    out.push_str("</ul>\n");
    for index in 0..material.recording.series.len() {
        out.push_str(&benchmark(args, material, index)?);
    }
    out.push_str(&heading(2, "Provenance and versions"));
    out.push_str(&wide(&provenance(args, material)));
    let _ = writeln!(
        out,
        "<footer><p>slipwatch {}. Every forecast is shown as it was made, with the readings until then and no later one.</p></footer>\n</body>\n</html>",
        env!("CARGO_PKG_VERSION")
    );
    Ok(out)
}

fn benchmark(args: &Args, material: &Material, index: usize) -> anyhow::Result<String> {
    let series = &material.recording.series[index];
    let name = escaped(series.benchmark.as_str());
    let mut out = format!(
        "<section class=\"benchmark\" id=\"b{index}\">\n<h2>Benchmark {name}</h2>\n<p class=\"subject\">{}</p>\n",
        escaped(&sections::summary(material, series))
    );
    let mut pictures = 0;
    let figures = match series.readings[..] {
        [] => Vec::new(),
        _ => sections::figures(args, material, series),
    };
    for svg in figures {
        let _ = writeln!(
            out,
            "<figure>\n{}</figure>",
            own_names(&svg, index, pictures)
        );
        pictures += 1;
    }
    out.push_str(&heading(3, "Levels"));
    out.push_str(&wide(&sections::levels(args, material, series)));
    out.push_str(&heading(3, "In order"));
    match sections::in_order(material, series) {
        Some(table) => out.push_str(&wide(&table)),
        None => out.push_str("<p>Nothing was said.</p>\n"),
    }
    if args.config.is_none() && !args.no_search {
        out.push_str(&heading(3, "Closing the loop"));
        let found = sections::closing_the_loop(material, series);
        out.push_str(&own_names(&found, index, pictures));
    }
    if let Some(card) = sections::scorecard(args, material, series)? {
        out.push_str(&heading(3, "Scorecard"));
        out.push_str(&own_names(&card, index, pictures + 1));
    }
    out.push_str("</section>\n");
    Ok(out)
}

/// The names within a picture, so that they are its own among all of the page.
fn own_names(text: &str, benchmark: usize, picture: usize) -> String {
    let prefix = format!("b{benchmark}p{picture}-");
    text.replace(" id=\"", &format!(" id=\"{prefix}"))
        .replace("url(#", &format!("url(#{prefix}"))
}

fn heading(rank: usize, text: &str) -> String {
    format!("<h{rank}>{text}</h{rank}>\n")
}

fn wide(table: &TextTable) -> String {
    format!("<div class=\"wide\">{}</div>\n", table.html())
}

fn provenance(args: &Args, material: &Material) -> TextTable {
    let policy = &material.policy;
    let mut table = TextTable::plain();
    let mut row = |what: &str, which: String| table.row([what.to_owned(), which]);
    for (what, which) in &material.sources {
        row(what, which.clone());
    }
    for (what, which) in &material.recording.provenance {
        row(what, which.clone());
    }
    if let Some(failure) = args.failure_time {
        row("failure", failure.to_string());
    }
    row("evacuation time", format!("{:#}", policy.evacuation_time));
    row("outlook", format!("{:#}", policy.outlook));
    let critical = policy.critical_velocity_mm_per_day;
    row("critical velocity", format!("{critical} mm/day"));
    row("slipwatch", env!("CARGO_PKG_VERSION").to_owned());
    table
}

#[cfg(test)]
mod tests {
    use super::own_names;

    #[test]
    fn names_of_one_picture_are_not_those_of_another() {
        let svg = "<clipPath id=\"c0\"/><g clip-path=\"url(#c0)\"/>";
        let own = own_names(svg, 1, 2);
        assert_eq!(
            own,
            "<clipPath id=\"b1p2-c0\"/><g clip-path=\"url(#b1p2-c0)\"/>"
        );
    }
}
