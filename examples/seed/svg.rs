//! Panels of lines and points as SVG text: the same numbers give the same bytes.

use std::fmt::Write as _;

/// Distinct for every kind of colour vision (Okabe and Ito, 2008).
pub(crate) const BLUE: &str = "#0072b2";
pub(crate) const RED: &str = "#d55e00";
pub(crate) const GREEN: &str = "#009e73";
pub(crate) const PURPLE: &str = "#aa4499";
pub(crate) const GREY: &str = "#777777";
pub(crate) const BLACK: &str = "#111111";

/// How numbers stand along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Scale {
    Linear,
    Log,
}

/// One axis; what lies outside its range is cut off.
#[derive(Debug, Clone)]
pub(crate) struct Axis {
    /// Quantity and unit.
    pub(crate) label: String,
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) scale: Scale,
}

/// What is drawn in a panel.
#[derive(Debug, Clone)]
pub(crate) enum Mark {
    /// A line; `dash` is SVG's `stroke-dasharray`, empty for an unbroken one.
    Line {
        points: Vec<(f64, f64)>,
        colour: &'static str,
        dash: &'static str,
    },
    /// Dots of one radius.
    Dots {
        points: Vec<(f64, f64)>,
        colour: &'static str,
        radius: f64,
    },
}

/// A corner of a panel, for its legend.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Corner {
    TopLeft,
    TopRight,
    BottomLeft,
}

/// Axes and what stands between them.
#[derive(Debug, Clone)]
pub(crate) struct Panel {
    pub(crate) title: String,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    /// Each with its name in the legend; without one where that is empty.
    pub(crate) marks: Vec<(String, Mark)>,
    pub(crate) legend: Corner,
}

/// Panels in rows of `columns`.
#[derive(Debug, Clone)]
pub(crate) struct Figure {
    /// For those who hear the picture.
    pub(crate) description: String,
    pub(crate) columns: usize,
    /// Width and height of one panel with its labels.
    pub(crate) panel: (f64, f64),
    pub(crate) panels: Vec<Panel>,
}

/// Room around the plot within a panel.
const LEFT: f64 = 62.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 26.0;
const BOTTOM: f64 = 46.0;
const FONT: f64 = 12.0;
/// A linear axis has at most about so many ticks.
const TICKS: f64 = 6.0;
/// The mean width of a character of the font, over its size: for the room of a legend.
const CHARACTER: f64 = 0.56;

impl Axis {
    pub(crate) fn linear(label: &str, from: f64, to: f64) -> Self {
        Self {
            label: label.to_owned(),
            from,
            to,
            scale: Scale::Linear,
        }
    }

    pub(crate) fn log(label: &str, from: f64, to: f64) -> Self {
        Self {
            scale: Scale::Log,
            ..Self::linear(label, from, to)
        }
    }

    /// The share of the axis at `value`; `None` where it has none.
    fn share(&self, value: f64) -> Option<f64> {
        let share = match self.scale {
            Scale::Linear => (value - self.from) / (self.to - self.from),
            Scale::Log => (value / self.from).ln() / (self.to / self.from).ln(),
        };
        // Far outside is as good as the edge of the sheet, and keeps the numbers short.
        share.is_finite().then(|| share.clamp(-20.0, 20.0))
    }

    /// Where ticks stand, and what stands at them.
    fn ticks(&self) -> Vec<(f64, String)> {
        match self.scale {
            Scale::Linear => self.linear_ticks(),
            Scale::Log => self.decades(),
        }
    }

    fn linear_ticks(&self) -> Vec<(f64, String)> {
        let rough = (self.to - self.from) / TICKS;
        let decade = 10_f64.powf(rough.log10().floor());
        let factors = [1.0, 2.0, 5.0, 10.0];
        let factor = factors.iter().find(|factor| **factor * decade >= rough);
        let step = factor.copied().unwrap_or(10.0) * decade;
        let places = usize::from(step < 0.999) + usize::from(step < 0.0999);
        let first = (self.from / step - 1e-9).ceil();
        (0..40)
            .map(|index| (first + f64::from(index)) * step)
            .take_while(|value| *value <= self.to + 1e-9 * step)
            // A sum with zero has no sign.
            .map(|value| (value, format!("{:.places$}", value + 0.0)))
            .collect()
    }

    fn decades(&self) -> Vec<(f64, String)> {
        let span = (self.to / self.from).log10();
        let every = (span / TICKS).ceil().max(1.0);
        let first = (self.from.log10() / every - 1e-9).ceil() * every;
        let exponents = (0..40).map(|index| first + every * f64::from(index));
        exponents
            .take_while(|exponent| *exponent <= self.to.log10() + 1e-9)
            .map(|exponent| (10_f64.powf(exponent), power_of_ten(exponent)))
            .collect()
    }
}

fn power_of_ten(exponent: f64) -> String {
    if (-2.0..=3.0).contains(&exponent) {
        let places = if exponent < 0.0 { -exponent } else { 0.0 };
        return match places {
            2.0 => "0.01".to_owned(),
            1.0 => "0.1".to_owned(),
            _ => format!("{:.0}", 10_f64.powf(exponent)),
        };
    }
    let raised = |digit: char| match digit {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '4' => '⁴',
        '5' => '⁵',
        '6' => '⁶',
        '7' => '⁷',
        '8' => '⁸',
        '9' => '⁹',
        _ => '⁰',
    };
    let digits: String = format!("{exponent:.0}").chars().map(raised).collect();
    format!("10{digits}")
}

impl Figure {
    /// The figure as a file's text.
    pub(crate) fn svg(&self) -> String {
        let rows = self.panels.len().div_ceil(self.columns);
        let width = self.panel.0 * self.columns as f64;
        let height = self.panel.1 * rows as f64;
        let mut out = String::new();
        // Writing to a string cannot fail.
        let _ = writeln!(
            out,
            r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" font-family="DejaVu Sans, Verdana, sans-serif" font-size="{FONT}" fill="{BLACK}">"#
        );
        let _ = writeln!(out, "<title>{}</title>", escaped(&self.description));
        let _ = writeln!(
            out,
            r##"<rect width="{width}" height="{height}" fill="#ffffff"/>"##
        );
        for (index, panel) in self.panels.iter().enumerate() {
            let x = self.panel.0 * (index % self.columns) as f64;
            let y = self.panel.1 * (index / self.columns) as f64;
            let frame = Frame {
                left: x + LEFT,
                top: y + TOP,
                width: self.panel.0 - LEFT - RIGHT,
                height: self.panel.1 - TOP - BOTTOM,
            };
            panel.draw(&frame, index, &mut out);
        }
        out.push_str("</svg>\n");
        out
    }
}

/// Where a panel's plot stands on the sheet.
#[derive(Debug, Clone, Copy)]
struct Frame {
    left: f64,
    top: f64,
    width: f64,
    height: f64,
}

impl Panel {
    fn draw(&self, frame: &Frame, index: usize, out: &mut String) {
        let Frame {
            left,
            top,
            width,
            height,
        } = *frame;
        let middle = left + 0.5 * width;
        let _ = writeln!(
            out,
            r#"<text x="{middle:.1}" y="{:.1}" text-anchor="middle" font-weight="bold">{}</text>"#,
            top - 9.0,
            escaped(&self.title)
        );
        self.grid(frame, out);
        let _ = writeln!(
            out,
            r#"<clipPath id="c{index}"><rect x="{left:.1}" y="{top:.1}" width="{width:.1}" height="{height:.1}"/></clipPath><g clip-path="url(#c{index})">"#
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

    fn grid(&self, frame: &Frame, out: &mut String) {
        let bottom = frame.top + frame.height;
        let right = frame.left + frame.width;
        for (value, text) in self.x.ticks() {
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
        for (value, text) in self.y.ticks() {
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
        let (x, y) = (frame.left - 46.0, frame.top + 0.5 * frame.height);
        let _ = writeln!(
            out,
            r#"<text transform="translate({x:.1} {y:.1}) rotate(-90)" text-anchor="middle">{}</text>"#,
            escaped(&self.y.label)
        );
    }

    fn mark(&self, frame: &Frame, mark: &Mark, out: &mut String) {
        let place = |(x, y): &(f64, f64)| {
            let across = self.x.share(*x)? * frame.width;
            let up = self.y.share(*y)? * frame.height;
            Some((frame.left + across, frame.top + frame.height - up))
        };
        match mark {
            Mark::Line {
                points,
                colour,
                dash,
            } => {
                let places = points.iter().filter_map(place);
                let line: Vec<String> = places.map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
                let _ = writeln!(
                    out,
                    r#"<polyline points="{}" fill="none" stroke="{colour}" stroke-width="1.8" stroke-dasharray="{dash}"/>"#,
                    line.join(" ")
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
        }
    }

    fn legend(&self, frame: &Frame, out: &mut String) {
        let named: Vec<_> = self
            .marks
            .iter()
            .filter(|mark| !mark.0.is_empty())
            .collect();
        let Some(longest) = named.iter().map(|mark| mark.0.chars().count()).max() else {
            return;
        };
        let (width, height) = (
            44.0 + CHARACTER * FONT * longest as f64,
            6.0 + 16.0 * named.len() as f64,
        );
        let left = match self.legend {
            Corner::TopLeft | Corner::BottomLeft => frame.left + 6.0,
            Corner::TopRight => frame.left + frame.width - width - 6.0,
        };
        let top = match self.legend {
            Corner::TopLeft | Corner::TopRight => frame.top + 6.0,
            Corner::BottomLeft => frame.top + frame.height - height - 6.0,
        };
        let _ = writeln!(
            out,
            r##"<rect x="{left:.1}" y="{top:.1}" width="{width:.1}" height="{height:.1}" fill="#ffffff" fill-opacity="0.85"/>"##
        );
        for (index, (name, mark)) in named.into_iter().enumerate() {
            let y = top + 11.0 + 16.0 * index as f64;
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
            };
            let _ = writeln!(
                out,
                r#"<text x="{:.1}" y="{:.1}">{}</text>"#,
                left + 38.0,
                y + 4.0,
                escaped(name)
            );
        }
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}
