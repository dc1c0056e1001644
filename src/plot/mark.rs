//! What is drawn in a panel, and its sign in the legend.

use super::{escaped, width_of};
use std::fmt::Write as _;

/// What is drawn in a panel.
#[derive(Debug, Clone)]
pub enum Mark {
    /// A line; `dash` is SVG's `stroke-dasharray`, empty for an unbroken one.
    Line {
        /// From left to right.
        points: Vec<(f64, f64)>,
        /// As SVG has it.
        colour: &'static str,
        /// As SVG has it.
        dash: &'static str,
    },
    /// Dots of one radius.
    Dots {
        /// Their middles.
        points: Vec<(f64, f64)>,
        /// As SVG has it.
        colour: &'static str,
        /// In the sheet's units.
        radius: f64,
    },
    /// Upright strokes from zero to each point.
    Stems {
        /// Their ends.
        points: Vec<(f64, f64)>,
        /// As SVG has it.
        colour: &'static str,
    },
    /// The room between two lines, as (x, lower, upper).
    Band {
        /// From left to right.
        points: Vec<(f64, f64, f64)>,
        /// As SVG has it.
        colour: &'static str,
    },
    /// All of the panel's height between two places.
    Shade {
        /// Where it begins.
        from: f64,
        /// Where it ends.
        to: f64,
        /// As SVG has it.
        colour: &'static str,
    },
    /// Upright lines through all of the panel.
    Uprights {
        /// Where they stand.
        at: Vec<f64>,
        /// As SVG has it.
        colour: &'static str,
        /// As SVG has it.
        dash: &'static str,
    },
    /// All of the panel's height between two places, with nothing showing through, and a word in it.
    Fill {
        /// Where it begins.
        from: f64,
        /// Where it ends.
        to: f64,
        /// As SVG has it.
        colour: &'static str,
        /// Of the word.
        ink: &'static str,
        /// The first of these that has room is written.
        words: Vec<String>,
    },
    /// Bars that lie, as (from, to, y).
    Lying {
        /// Each one's ends and height.
        spans: Vec<(f64, f64, f64)>,
        /// As SVG has it.
        colour: &'static str,
    },
    /// Bars that stand, as (x, lower, upper).
    Standing {
        /// Each one's place and ends.
        spans: Vec<(f64, f64, f64)>,
        /// As SVG has it.
        colour: &'static str,
    },
    /// Short upright strokes across a bar that lies.
    Strokes {
        /// Their middles.
        points: Vec<(f64, f64)>,
        /// As SVG has it.
        colour: &'static str,
    },
    /// A text that begins right of a point.
    Words {
        /// The point.
        at: (f64, f64),
        /// The text.
        text: String,
        /// As SVG has it.
        colour: &'static str,
    },
    /// A text left of a span, or right of it where it has no room on the left.
    Beside {
        /// Where the span begins and ends.
        span: (f64, f64),
        /// At this height.
        y: f64,
        /// The text.
        text: String,
        /// As SVG has it.
        colour: &'static str,
    },
}

/// How much of a band or a shade covers what lies below.
pub(super) const OPACITY: f64 = 0.18;
/// The same of a bar.
pub(super) const BAR_OPACITY: f64 = 0.4;
/// The width of a legend's sign with the room around it.
pub(super) const SIGN: f64 = 44.0;

/// The room of a sign and a name in a legend above.
pub(super) fn width_of_entry(name: &str) -> f64 {
    SIGN + 4.0 + width_of(name)
}

/// A mark's sign and name; `y` is the middle of the line.
pub(super) fn entry(name: &str, mark: &Mark, (left, y): (f64, f64), out: &mut String) {
    let _ = match mark {
        Mark::Line { colour, dash, .. } => writeln!(
            out,
            r#"<path d="M{:.1} {y:.1}h26" stroke="{colour}" stroke-width="1.8" stroke-dasharray="{dash}"/>"#,
            left + 6.0
        ),
        Mark::Dots { colour, radius, .. } => writeln!(
            out,
            r#"<circle cx="{:.1}" cy="{y:.1}" r="{radius}" fill="{colour}"/>"#,
            left + 19.0
        ),
        Mark::Stems { colour, .. } => writeln!(
            out,
            r#"<path d="M{:.1} {:.1}v10" stroke="{colour}" stroke-width="3"/>"#,
            left + 19.0,
            y - 5.0
        ),
        Mark::Uprights { colour, dash, .. } => writeln!(
            out,
            r#"<path d="M{:.1} {:.1}v12" stroke="{colour}" stroke-width="1.2" stroke-dasharray="{dash}"/>"#,
            left + 19.0,
            y - 6.0
        ),
        Mark::Band { colour, .. } | Mark::Shade { colour, .. } => writeln!(
            out,
            r#"<rect x="{:.1}" y="{:.1}" width="26" height="10" fill="{colour}" fill-opacity="{OPACITY}"/>"#,
            left + 6.0,
            y - 5.0
        ),
        Mark::Fill { colour, .. } => writeln!(
            out,
            r#"<rect x="{:.1}" y="{:.1}" width="26" height="10" fill="{colour}"/>"#,
            left + 6.0,
            y - 5.0
        ),
        Mark::Lying { colour, .. } => writeln!(
            out,
            r#"<rect x="{:.1}" y="{:.1}" width="26" height="8" fill="{colour}" fill-opacity="{BAR_OPACITY}"/>"#,
            left + 6.0,
            y - 4.0
        ),
        Mark::Standing { colour, .. } => writeln!(
            out,
            r#"<rect x="{:.1}" y="{:.1}" width="5" height="14" fill="{colour}" fill-opacity="{BAR_OPACITY}"/>"#,
            left + 16.5,
            y - 7.0
        ),
        Mark::Strokes { colour, .. } => writeln!(
            out,
            r#"<path d="M{:.1} {:.1}v14" stroke="{colour}" stroke-width="3"/>"#,
            left + 19.0,
            y - 7.0
        ),
        Mark::Words { .. } | Mark::Beside { .. } => Ok(()),
    };
    let _ = writeln!(
        out,
        r#"<text x="{:.1}" y="{:.1}">{}</text>"#,
        left + 38.0,
        y + 4.0,
        escaped(name)
    );
}
