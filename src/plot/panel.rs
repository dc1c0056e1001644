//! One pair of axes and what stands between them.

use super::axis::Axis;
use super::mark::{BAR_OPACITY, Mark, OPACITY, SIGN, entry, width_of_entry};
use super::{BLACK, escaped, shortened, width_of};
use std::fmt::Write as _;

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

/// From a mark to the text beside it.
const GAP: f64 = 6.0;
/// How much wider bold letters are.
const BOLD: f64 = 1.15;
/// How much wider digits are.
const DIGITS: f64 = 1.15;
/// Room to the right of a plot, at least.
const EDGE: f64 = 12.0;

/// Where a panel's plot stands on the sheet.
#[derive(Debug, Clone, Copy)]
pub(super) struct PlotArea {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) width: f64,
    pub(super) height: f64,
    /// Where the label of the upright axis stands.
    pub(super) label: f64,
    pub(super) foot: Foot,
}

/// What stands under a panel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Foot {
    /// The ticks' texts and the label of the axis.
    Axis,
    /// Nothing: the axis is that of the panel below.
    Nothing,
}

impl Panel {
    /// Draws it; `clip` is a name that no other panel of the page has.
    pub(super) fn draw(&self, frame: &PlotArea, clip: &str, out: &mut String) {
        let PlotArea {
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

    fn grid(&self, frame: &PlotArea, out: &mut String) {
        let bottom = frame.top + frame.height;
        let right = frame.left + frame.width;
        for (value, text) in self.x.ticks(frame.width) {
            let Some(share) = self.x.share(value) else {
                continue;
            };
            let x = frame.left + share * frame.width;
            let _ = write!(
                out,
                r##"<path d="M{x:.1} {:.1}V{bottom:.1}" stroke="#e4e4e4"/>"##,
                frame.top
            );
            if frame.foot == Foot::Axis {
                // The last label stays on the sheet.
                let x = x.min(right + EDGE - 0.5 * DIGITS * width_of(&text));
                let _ = write!(
                    out,
                    r#"<text x="{x:.1}" y="{:.1}" text-anchor="middle">{text}</text>"#,
                    bottom + 16.0
                );
            }
            out.push('\n');
        }
        for (value, text) in self.y.upright_ticks(frame.height) {
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
        if frame.foot == Foot::Axis {
            let (x, y) = (frame.left + 0.5 * frame.width, bottom + 36.0);
            let _ = writeln!(
                out,
                r#"<text x="{x:.1}" y="{y:.1}" text-anchor="middle">{}</text>"#,
                escaped(&self.x.label)
            );
        }
        let (x, y) = (frame.label, frame.top + 0.5 * frame.height);
        let _ = writeln!(
            out,
            r#"<text transform="translate({x:.1} {y:.1}) rotate(-90)" text-anchor="middle">{}</text>"#,
            escaped(&self.y.label)
        );
    }

    /// Where a point stands on the sheet.
    fn place(&self, frame: &PlotArea, (x, y): (f64, f64)) -> Option<(f64, f64)> {
        let across = self.x.share(x)? * frame.width;
        let up = self.y.share(y)? * frame.height;
        Some((frame.left + across, frame.top + frame.height - up))
    }

    fn mark(&self, frame: &PlotArea, mark: &Mark, out: &mut String) {
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
            Mark::Shade { from, to, colour } => {
                self.shade(frame, *from, *to, colour, OPACITY, out);
            }
            Mark::Fill { from, to, .. } => self.fill(frame, *from, *to, mark, out),
            Mark::Lying { .. } | Mark::Standing { .. } | Mark::Strokes { .. } => {
                self.bars(frame, mark, out);
            }
            Mark::Words { .. } | Mark::Beside { .. } => self.words(frame, mark, out),
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

    fn shade(
        &self,
        frame: &PlotArea,
        from: f64,
        to: f64,
        colour: &str,
        opacity: f64,
        out: &mut String,
    ) {
        let (Some(from), Some(to)) = (self.x.share(from), self.x.share(to)) else {
            return;
        };
        let _ = writeln!(
            out,
            r#"<rect x="{:.1}" y="{:.1}" width="{:.1}" height="{:.1}" fill="{colour}" fill-opacity="{opacity}"/>"#,
            frame.left + from * frame.width,
            frame.top,
            ((to - from) * frame.width).max(0.0),
            frame.height
        );
    }

    fn fill(&self, frame: &PlotArea, from: f64, to: f64, mark: &Mark, out: &mut String) {
        let Mark::Fill {
            colour, ink, words, ..
        } = mark
        else {
            return;
        };
        self.shade(frame, from, to, colour, 1.0, out);
        let (Some(from), Some(to)) = (self.x.share(from), self.x.share(to)) else {
            return;
        };
        let (from, to) = (from.clamp(0.0, 1.0), to.clamp(0.0, 1.0));
        let room = (to - from) * frame.width - GAP;
        let Some(word) = words.iter().find(|word| BOLD * width_of(word) <= room) else {
            return;
        };
        let _ = writeln!(
            out,
            r#"<text x="{:.1}" y="{:.1}" text-anchor="middle" fill="{ink}">{}</text>"#,
            frame.left + f64::midpoint(from, to) * frame.width,
            frame.top + 0.5 * frame.height + 4.0,
            escaped(word)
        );
    }

    fn bars(&self, frame: &PlotArea, mark: &Mark, out: &mut String) {
        let mut bar = |from: (f64, f64), to: (f64, f64), (wide, high): (f64, f64), colour: &str| {
            let (Some(from), Some(to)) = (self.place(frame, from), self.place(frame, to)) else {
                return;
            };
            let _ = writeln!(
                out,
                r#"<rect x="{:.1}" y="{:.1}" width="{:.1}" height="{:.1}" fill="{colour}" fill-opacity="{BAR_OPACITY}"/>"#,
                from.0 - 0.5 * wide,
                to.1 - 0.5 * high,
                to.0 - from.0 + wide,
                from.1 - to.1 + high
            );
        };
        match mark {
            Mark::Lying { spans, colour } => {
                for &(from, to, y) in spans {
                    bar((from, y), (to, y), (0.0, 10.0), colour);
                }
            }
            Mark::Standing { spans, colour } => {
                for &(x, low, high) in spans {
                    bar((x, low), (x, high), (5.0, 0.0), colour);
                }
            }
            Mark::Strokes { points, colour } => {
                for (x, y) in points.iter().filter_map(|point| self.place(frame, *point)) {
                    let y = y - 8.0;
                    let _ = writeln!(
                        out,
                        r#"<path d="M{x:.1} {y:.1}v16" stroke="{colour}" stroke-width="3"/>"#
                    );
                }
            }
            Mark::Line { .. }
            | Mark::Dots { .. }
            | Mark::Stems { .. }
            | Mark::Band { .. }
            | Mark::Shade { .. }
            | Mark::Uprights { .. }
            | Mark::Fill { .. }
            | Mark::Words { .. }
            | Mark::Beside { .. } => {}
        }
    }

    fn words(&self, frame: &PlotArea, mark: &Mark, out: &mut String) {
        let right = frame.left + frame.width;
        let (text, colour, at, anchor) = match mark {
            Mark::Words { at, text, colour } => (text, colour, self.place(frame, *at), "start"),
            Mark::Beside {
                span: (from, to),
                y,
                text,
                colour,
            } => {
                let before = self.place(frame, (*from, *y));
                let after = self.place(frame, (*to, *y));
                let needed = width_of(text) + 3.0 * GAP;
                let fits = |place: &(f64, f64)| place.0 - frame.left >= needed;
                let roomier = after.is_none_or(|place| right - place.0 < needed);
                match before.filter(|place| fits(place) || roomier) {
                    Some((x, y)) => (text, colour, Some((x - 3.0 * GAP, y)), "end"),
                    None => (text, colour, after, "start"),
                }
            }
            Mark::Line { .. }
            | Mark::Dots { .. }
            | Mark::Stems { .. }
            | Mark::Band { .. }
            | Mark::Shade { .. }
            | Mark::Uprights { .. }
            | Mark::Fill { .. }
            | Mark::Lying { .. }
            | Mark::Standing { .. }
            | Mark::Strokes { .. } => return,
        };
        let Some((x, y)) = at else { return };
        let _ = writeln!(
            out,
            r#"<text x="{:.1}" y="{:.1}" text-anchor="{anchor}" fill="{colour}">{}</text>"#,
            x + GAP,
            y + 4.0,
            escaped(text)
        );
    }

    fn legend(&self, frame: &PlotArea, out: &mut String) {
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
            description: "a < b \"c\"".to_owned(),
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
    fn the_label_at_the_end_of_an_axis_stays_on_the_sheet() {
        let mut figure = panel("", Legend::TopLeft);
        figure.panels[0].x = Axis::dates("", 15_000.0, 15_010.0);
        let svg = figure.svg();
        let ends = svg.lines().filter_map(|line| {
            let (_, text) = line.split_once("<text x=\"")?;
            let (x, rest) = text.split_once('"')?;
            let (_, label) = rest.split_once("text-anchor=\"middle\">")?;
            let label = label.split('<').next()?;
            Some(x.parse::<f64>().ok()? + 0.5 * width_of(label))
        });
        let furthest = ends.fold(0.0, f64::max);
        assert!((280.0..300.0).contains(&furthest), "{furthest}: {svg}");
    }

    #[test]
    fn what_is_written_is_escaped_and_inner_names_begin_with_the_figure() {
        let svg = panel("p < q", Legend::Above).named("load-");
        assert!(svg.contains("p &lt; q") && svg.contains("<title>a &lt; b \"c\""));
        assert!(svg.contains("role=\"img\" aria-label=\"a &lt; b &quot;c&quot;\""));
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
