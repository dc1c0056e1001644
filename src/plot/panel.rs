//! One pair of axes and what stands between them.

use super::axis::Axis;
use super::{BLACK, escaped, shortened, width_of};
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
}

/// Where a panel's legend stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Legend {
    /// In a corner.
    TopLeft,
    /// In a corner.
    TopRight,
    /// In a corner.
    BottomLeft,
    /// In one line above the panel, beside the title, where it hides nothing.
    Above,
}

/// Axes and what stands between them.
#[derive(Debug, Clone)]
pub struct Panel {
    /// Above it.
    pub title: String,
    /// From left to right.
    pub x: Axis,
    /// From the bottom up.
    pub y: Axis,
    /// Each with its name in the legend; without one where that is empty.
    pub marks: Vec<(String, Mark)>,
    /// Where that stands.
    pub legend: Legend,
}

/// How much of what lies below shows through a band or a shade.
const OPACITY: f64 = 0.18;
/// The width of a legend's sign with the room around it.
const SIGN: f64 = 44.0;
/// How much wider bold letters are.
const BOLD: f64 = 1.15;

/// Where a panel's plot stands on the sheet.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) width: f64,
    pub(super) height: f64,
    /// Where the label of the upright axis stands.
    pub(super) label: f64,
}

impl Panel {
    /// Draws it; `clip` is a name that no other panel of the page has.
    pub(super) fn draw(&self, frame: &Frame, clip: &str, out: &mut String) {
        let Frame {
            left,
            top,
            width,
            height,
            ..
        } = *frame;
        let (at, anchor) = match self.legend {
            Legend::Above => (left, "start"),
            Legend::TopLeft | Legend::TopRight | Legend::BottomLeft => {
                (left + 0.5 * width, "middle")
            }
        };
        // Writing to a string cannot fail.
        let _ = writeln!(
            out,
            r#"<text x="{at:.1}" y="{:.1}" text-anchor="{anchor}" font-weight="bold">{}</text>"#,
            top - 9.0,
            escaped(&self.title_beside_legend(width))
        );
        self.grid(frame, out);
        let _ = writeln!(
            out,
            r#"<clipPath id="{clip}"><rect x="{left:.1}" y="{top:.1}" width="{width:.1}" height="{height:.1}"/></clipPath><g clip-path="url(#{clip})">"#
        );
        for (_, mark) in &self.marks {
            self.mark(frame, mark, out);
        }
        let _ = writeln!(
            out,
            r#"</g><rect x="{left:.1}" y="{top:.1}" width="{width:.1}" height="{height:.1}" fill="none" stroke="{BLACK}"/>"#
        );
        self.legend(frame, out);
    }

    /// The title, shortened where the legend stands in its line.
    fn title_beside_legend(&self, width: f64) -> String {
        if self.legend != Legend::Above {
            return self.title.clone();
        }
        let names = self.marks.iter().map(|mark| &mark.0);
        let entries = names.filter(|name| !name.is_empty());
        let legend: f64 = entries.map(|name| width_of_entry(name)).sum();
        // Bold letters are wider.
        shortened(&self.title, (width - legend) / BOLD)
    }

    fn grid(&self, frame: &Frame, out: &mut String) {
        let bottom = frame.top + frame.height;
        let right = frame.left + frame.width;
        for (value, text) in self.x.ticks(frame.width) {
            let Some(share) = self.x.share(value) else {
                continue;
            };
            let x = frame.left + share * frame.width;
            let _ = writeln!(
                out,
                r##"<path d="M{x:.1} {:.1}V{bottom:.1}" stroke="#e4e4e4"/><text x="{x:.1}" y="{:.1}" text-anchor="middle">{text}</text>"##,
                frame.top,
                bottom + 16.0
            );
        }
        for (value, text) in self.y.ticks(frame.height) {
            let Some(share) = self.y.share(value) else {
                continue;
            };
            let y = bottom - share * frame.height;
            let _ = writeln!(
                out,
                r##"<path d="M{:.1} {y:.1}H{right:.1}" stroke="#e4e4e4"/><text x="{:.1}" y="{:.1}" text-anchor="end">{text}</text>"##,
                frame.left,
                frame.left - 6.0,
                y + 4.0
            );
        }
        let (x, y) = (frame.left + 0.5 * frame.width, bottom + 36.0);
        let _ = writeln!(
            out,
            r#"<text x="{x:.1}" y="{y:.1}" text-anchor="middle">{}</text>"#,
            escaped(&self.x.label)
        );
        let (x, y) = (frame.label, frame.top + 0.5 * frame.height);
        let _ = writeln!(
            out,
            r#"<text transform="translate({x:.1} {y:.1}) rotate(-90)" text-anchor="middle">{}</text>"#,
            escaped(&self.y.label)
        );
    }

    /// Where a point stands on the sheet.
    fn place(&self, frame: &Frame, (x, y): (f64, f64)) -> Option<(f64, f64)> {
        let across = self.x.share(x)? * frame.width;
        let up = self.y.share(y)? * frame.height;
        Some((frame.left + across, frame.top + frame.height - up))
    }

    fn mark(&self, frame: &Frame, mark: &Mark, out: &mut String) {
        let place = |point: &(f64, f64)| self.place(frame, *point);
        match mark {
            Mark::Line {
                points,
                colour,
                dash,
            } => {
                let line = joined(points.iter().filter_map(place));
                let _ = writeln!(
                    out,
                    r#"<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="1.8" stroke-dasharray="{dash}"/>"#
                );
            }
            Mark::Dots {
                points,
                colour,
                radius,
            } => {
                for (x, y) in points.iter().filter_map(place) {
                    let _ = writeln!(
                        out,
                        r#"<circle cx="{x:.1}" cy="{y:.1}" r="{radius}" fill="{colour}"/>"#
                    );
                }
            }
            Mark::Stems { points, colour } => {
                for point in points {
                    let foot = self.place(frame, (point.0, 0.0));
                    let (Some((x, from)), Some((_, to))) = (foot, place(point)) else {
                        continue;
                    };
                    let _ = writeln!(
                        out,
                        r#"<path d="M{x:.1} {from:.1}V{to:.1}" stroke="{colour}" stroke-width="3"/>"#
                    );
                }
            }
            Mark::Band { points, colour } => {
                let lower = points.iter().map(|&(x, low, _)| (x, low));
                let upper = points.iter().rev().map(|&(x, _, high)| (x, high));
                let edge = lower.chain(upper);
                let edge = joined(edge.filter_map(|point| self.place(frame, point)));
                let _ = writeln!(
                    out,
                    r#"<polygon points="{edge}" fill="{colour}" fill-opacity="{OPACITY}"/>"#
                );
            }
            Mark::Shade { from, to, colour } => self.shade(frame, (*from, *to), colour, out),
            Mark::Uprights { at, colour, dash } => {
                for share in at.iter().filter_map(|x| self.x.share(*x)) {
                    let x = frame.left + share * frame.width;
                    let _ = writeln!(
                        out,
                        r#"<path d="M{x:.1} {:.1}v{:.1}" stroke="{colour}" stroke-width="1.2" stroke-dasharray="{dash}"/>"#,
                        frame.top, frame.height
                    );
                }
            }
        }
    }

    fn shade(&self, frame: &Frame, (from, to): (f64, f64), colour: &str, out: &mut String) {
        let (Some(from), Some(to)) = (self.x.share(from), self.x.share(to)) else {
            return;
        };
        let _ = writeln!(
            out,
            r#"<rect x="{:.1}" y="{:.1}" width="{:.1}" height="{:.1}" fill="{colour}" fill-opacity="{OPACITY}"/>"#,
            frame.left + from * frame.width,
            frame.top,
            ((to - from) * frame.width).max(0.0),
            frame.height
        );
    }

    fn legend(&self, frame: &Frame, out: &mut String) {
        let named: Vec<_> = self
            .marks
            .iter()
            .filter(|mark| !mark.0.is_empty())
            .collect();
        if self.legend == Legend::Above {
            // From the right, so that the title has its room.
            let mut right = frame.left + frame.width;
            for (name, mark) in named.into_iter().rev() {
                right -= width_of_entry(name);
                entry(name, mark, (right, frame.top - 13.0), out);
            }
            return;
        }
        let Some(widest) = named.iter().map(|mark| width_of(&mark.0)).reduce(f64::max) else {
            return;
        };
        let (width, height) = (SIGN + widest, 6.0 + 16.0 * named.len() as f64);
        let left = match self.legend {
            Legend::TopLeft | Legend::BottomLeft | Legend::Above => frame.left + 6.0,
            Legend::TopRight => frame.left + frame.width - width - 6.0,
        };
        let top = match self.legend {
            Legend::TopLeft | Legend::TopRight | Legend::Above => frame.top + 6.0,
            Legend::BottomLeft => frame.top + frame.height - height - 6.0,
        };
        let _ = writeln!(
            out,
            r##"<rect x="{left:.1}" y="{top:.1}" width="{width:.1}" height="{height:.1}" fill="#ffffff" fill-opacity="0.85"/>"##
        );
        for (index, (name, mark)) in named.into_iter().enumerate() {
            let y = top + 11.0 + 16.0 * index as f64;
            entry(name, mark, (left, y), out);
        }
    }
}

fn joined(places: impl Iterator<Item = (f64, f64)>) -> String {
    let places: Vec<String> = places.map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
    places.join(" ")
}

/// The room of a sign and a name in a legend above.
fn width_of_entry(name: &str) -> f64 {
    SIGN + 4.0 + width_of(name)
}

/// A mark's sign and name; `y` is the middle of the line.
fn entry(name: &str, mark: &Mark, (left, y): (f64, f64), out: &mut String) {
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
    };
    let _ = writeln!(
        out,
        r#"<text x="{:.1}" y="{:.1}">{}</text>"#,
        left + 38.0,
        y + 4.0,
        escaped(name)
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{Figure, GREY};

    fn panel(title: &str, legend: Legend) -> Figure {
        let at = vec![1.0];
        let mark = Mark::Uprights {
            at,
            colour: GREY,
            dash: "",
        };
        let panel = Panel {
            title: title.to_owned(),
            x: Axis::linear("x", 0.0, 2.0),
            y: Axis::linear("y", 0.0, 100_000.0),
            marks: vec![("a name".to_owned(), mark)],
            legend,
        };
        Figure {
            description: "a < b".to_owned(),
            columns: 1,
            panel: (300.0, 200.0),
            panels: vec![panel],
        }
    }

    #[test]
    fn a_title_gives_way_to_the_legend_in_its_line() {
        let title = "a title that is far too long to stand there";
        assert!(panel(title, Legend::TopLeft).svg().contains(title));
        let beside = panel(title, Legend::Above).svg();
        assert!(
            !beside.contains(title) && beside.contains("a title"),
            "{beside}"
        );
        assert!(panel("short", Legend::Above).svg().contains(">short<"));
    }

    #[test]
    fn what_is_written_is_escaped_and_inner_names_begin_with_the_figure() {
        let svg = panel("p < q", Legend::Above).named("load-");
        assert!(svg.contains("p &lt; q") && svg.contains("a &lt; b"));
        assert!(svg.contains("id=\"load-c0\"") && svg.contains("url(#load-c0)"));
    }

    #[test]
    fn long_numbers_beside_the_axis_push_it_to_the_right() {
        let left = |figure: &Figure| {
            let svg = figure.svg();
            let (_, rest) = svg.split_once("id=\"c0\"><rect x=\"").unwrap();
            rest.split('"').next().unwrap().parse::<f64>().unwrap()
        };
        let wide = panel("", Legend::TopLeft);
        let mut narrow = wide.clone();
        narrow.panels[0].y.to = 10.0;
        assert!((left(&narrow) - 62.0).abs() < 1e-9);
        assert!(left(&wide) > 65.0);
    }
}
