//! Bars that lie, a row each, with what is said of each.

use super::axis::Axis;
use super::{BLACK, GREY, escaped, opened, shortened, width_of};
use std::fmt::Write as _;

/// One row.
#[derive(Debug, Clone)]
pub struct Bar {
    /// Left of it.
    pub name: String,
    /// How long it is.
    pub value: f64,
    /// As SVG has it.
    pub colour: &'static str,
    /// Right of all bars.
    pub note: String,
}

/// Rows of bars on one axis.
#[derive(Debug, Clone)]
pub struct Bars {
    /// For screen readers.
    pub description: String,
    /// Above it.
    pub title: String,
    /// Width of the sheet.
    pub width: f64,
    /// Under the bars, which begin at zero.
    pub axis: Axis,
    /// Where a dashed line stands, and its name.
    pub mark: (f64, String),
    /// From the top down.
    pub bars: Vec<Bar>,
}

/// Height of a bar's row, and the room above and below them, in the sheet's units.
const ROW: f64 = 22.0;
const TOP: f64 = 44.0;
const BOTTOM: f64 = 46.0;
/// The bars themselves have this share of the sheet.
const SHARE: f64 = 0.34;
/// From a bar's end to its value, and between columns.
const GAP: f64 = 8.0;

impl Bars {
    /// The figure as a file's text.
    pub fn svg(&self) -> String {
        let height = TOP + BOTTOM + ROW * self.bars.len() as f64;
        let names = self.bars.iter().map(|bar| width_of(&bar.name));
        let left = names.fold(0.0, f64::max) + 2.0 * GAP;
        let frame = BarsFrame {
            left,
            width: SHARE * self.width,
            bottom: height - BOTTOM,
        };
        let mut out = opened(self.width, height, &self.description);
        // Writing to a string cannot fail.
        let _ = writeln!(
            out,
            r#"<text x="{GAP}" y="17" font-weight="bold">{}</text>"#,
            escaped(&self.title)
        );
        self.grid(frame, &mut out);
        for (index, bar) in self.bars.iter().enumerate() {
            self.row(frame, index, bar, &mut out);
        }
        self.mark(frame, &mut out);
        out.push_str("</svg>\n");
        out
    }

    fn grid(&self, frame: BarsFrame, out: &mut String) {
        let BarsFrame {
            left,
            width,
            bottom,
        } = frame;
        for (value, text) in self.axis.ticks(width) {
            let x = frame.at(&self.axis, value);
            let _ = writeln!(
                out,
                r##"<path d="M{x:.1} {TOP}V{bottom:.1}" stroke="#e4e4e4"/><text x="{x:.1}" y="{:.1}" text-anchor="middle">{text}</text>"##,
                bottom + 16.0
            );
        }
        let _ = writeln!(
            out,
            r#"<text x="{:.1}" y="{:.1}" text-anchor="middle">{}</text>"#,
            left + 0.5 * width,
            bottom + 36.0,
            escaped(&self.axis.label)
        );
    }

    fn row(&self, frame: BarsFrame, index: usize, bar: &Bar, out: &mut String) {
        let middle = TOP + ROW * (index as f64 + 0.5);
        let (zero, end) = (frame.at(&self.axis, 0.0), frame.at(&self.axis, bar.value));
        let line = middle + 4.0;
        let _ = writeln!(
            out,
            r#"<text x="{:.1}" y="{line:.1}" text-anchor="end">{}</text>"#,
            frame.left - GAP,
            escaped(&bar.name)
        );
        let _ = writeln!(
            out,
            r#"<rect x="{:.1}" y="{:.1}" width="{:.1}" height="12" fill="{}"/>"#,
            zero.min(end),
            middle - 6.0,
            (end - zero).abs().max(0.5),
            bar.colour
        );
        let column = frame.left + frame.width + GAP + width_of("-00000");
        let _ = writeln!(
            out,
            r#"<text x="{column:.1}" y="{line:.1}" text-anchor="end">{:.0}</text><text x="{:.1}" y="{line:.1}">{}</text>"#,
            // A sum with zero has no sign.
            bar.value.round() + 0.0,
            column + 2.0 * GAP,
            escaped(&shortened(&bar.note, self.width - column - 3.0 * GAP))
        );
    }

    fn mark(&self, frame: BarsFrame, out: &mut String) {
        let zero = frame.at(&self.axis, 0.0);
        let x = frame.at(&self.axis, self.mark.0);
        let bottom = frame.bottom;
        let _ = writeln!(
            out,
            r#"<path d="M{zero:.1} {TOP}V{bottom:.1}" stroke="{BLACK}"/><path d="M{x:.1} {TOP}V{bottom:.1}" stroke="{GREY}" stroke-dasharray="4 3"/><text x="{x:.1}" y="{:.1}" text-anchor="middle">{}</text>"#,
            TOP - 6.0,
            escaped(&self.mark.1)
        );
    }
}

/// Where the bars stand on the sheet.
#[derive(Debug, Clone, Copy)]
struct BarsFrame {
    left: f64,
    width: f64,
    bottom: f64,
}

impl BarsFrame {
    /// Where a value stands; beyond the axis, at its end.
    fn at(self, axis: &Axis, value: f64) -> f64 {
        let share = axis.share(value).unwrap_or(0.0);
        self.left + share.clamp(0.0, 1.0) * self.width
    }
}
