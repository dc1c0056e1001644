//! Panels of their own heights, one above the other, on one horizontal axis.

use super::panel::{Foot, Panel, PlotArea};
use super::{escaped, opened, width_of};
use std::fmt::Write as _;

/// Panels under one title; the axis stands under the last of them.
#[derive(Debug, Clone)]
pub struct Stack {
    /// For screen readers.
    pub description: String,
    /// Above it.
    pub title: String,
    /// Of the sheet.
    pub width: f64,
    /// From the top down, each with the height of its plot; all have the same horizontal axis.
    pub panels: Vec<(f64, Panel)>,
}

/// Room for the title.
const HEAD: f64 = 30.0;
/// Above a panel, for its own title and legend.
const ABOVE: f64 = 28.0;
/// Below the last panel, for the axis.
const FOOT: f64 = 44.0;
/// Left of the ticks' labels, for the label of the axis.
const LABEL: f64 = 28.0;
const RIGHT: f64 = 14.0;
/// Digits are wider than the mean character.
const DIGITS: f64 = 1.15;

impl Stack {
    /// The figure as a file's text.
    pub fn svg(&self) -> String {
        let plots: f64 = self.panels.iter().map(|(height, _)| ABOVE + height).sum();
        let mut out = opened(self.width, HEAD + plots + FOOT, &self.description);
        let left = self.left();
        // Writing to a string cannot fail.
        let _ = writeln!(
            out,
            r#"<text x="{left:.1}" y="22" font-size="15" font-weight="bold">{}</text>"#,
            escaped(&self.title)
        );
        let mut top = HEAD;
        for (index, (height, panel)) in self.panels.iter().enumerate() {
            top += ABOVE;
            let frame = PlotArea {
                left,
                top,
                width: self.width - left - RIGHT,
                height: *height,
                label: 0.5 * LABEL,
                foot: if index + 1 == self.panels.len() {
                    Foot::Axis
                } else {
                    Foot::Nothing
                },
            };
            panel.draw(&frame, &format!("c{index}"), &mut out);
            top += height;
        }
        out.push_str("</svg>\n");
        out
    }

    /// One for all panels, so that they stand in line.
    fn left(&self) -> f64 {
        let labels = self
            .panels
            .iter()
            .flat_map(|(height, panel)| panel.y.upright_ticks(*height));
        let widest = labels
            .map(|(_, label)| width_of(&label))
            .fold(0.0, f64::max);
        LABEL + DIGITS * widest
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{Axis, BLACK, Legend, Mark};

    fn panel(marks: Vec<(String, Mark)>) -> Panel {
        Panel {
            title: String::new(),
            x: Axis::linear("x axis", 0.0, 10.0),
            y: Axis::named(0.0, 1.0, vec![(0.5, "a row".to_owned())]),
            marks,
            legend: Legend::Above,
        }
    }

    fn stack(panels: Vec<Panel>) -> String {
        Stack {
            description: "a stack".to_owned(),
            title: "p < q".to_owned(),
            width: 600.0,
            panels: panels.into_iter().map(|panel| (40.0, panel)).collect(),
        }
        .svg()
    }

    #[test]
    fn the_axis_stands_under_the_last_panel_alone() {
        let svg = stack(vec![panel(Vec::new()), panel(Vec::new())]);
        assert_eq!(svg.matches("x axis").count(), 1);
        assert_eq!(svg.matches("a row").count(), 2);
        assert!(svg.contains("p &lt; q"));
    }

    #[test]
    fn a_word_is_written_where_it_has_room_and_a_shorter_one_where_not() {
        let fill = |to: f64| Mark::Fill {
            from: 0.0,
            to,
            colour: "#ff0000",
            ink: BLACK,
            words: vec!["the longer word".to_owned(), "word".to_owned()],
        };
        let svg = |to: f64| stack(vec![panel(vec![(String::new(), fill(to))])]);
        assert!(svg(9.0).contains(">the longer word<"));
        assert!(svg(1.0).contains(">word<"));
        assert!(!svg(0.1).contains("word<"));
    }

    #[test]
    fn a_text_beside_a_span_stands_on_the_side_that_has_room() {
        let beside = |from: f64| Mark::Beside {
            span: (from, from + 0.5),
            y: 0.5,
            text: "some words beside it".to_owned(),
            colour: BLACK,
        };
        let svg = |from: f64| stack(vec![panel(vec![(String::new(), beside(from))])]);
        assert!(svg(9.0).contains(r##"text-anchor="end" fill="#111111">some words"##));
        assert!(svg(1.0).contains(r##"text-anchor="start" fill="#111111">some words"##));
    }
}
