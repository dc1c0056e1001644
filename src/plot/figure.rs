//! A sheet of panels in rows.

use super::panel::{Foot, Panel, PlotArea};
use super::{opened, width_of};

/// Panels in rows of `columns`.
#[derive(Debug, Clone)]
pub struct Figure {
    /// For screen readers.
    pub description: String,
    /// How many stand in a row.
    pub columns: usize,
    /// Width and height of one panel with its labels.
    pub panel: (f64, f64),
    /// By row, from left to right.
    pub panels: Vec<Panel>,
}

/// Room around the plot within a panel.
const LEFT: f64 = 62.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 26.0;
const BOTTOM: f64 = 46.0;
/// The middle of the upright axis's label, from a panel's left edge.
const LABEL: f64 = 16.0;
/// The label of a tick that `LEFT` has room for.
const SHORT: &str = "00000";

impl Figure {
    /// The figure as a file's text.
    pub fn svg(&self) -> String {
        self.named("")
    }

    /// The same, its inner names beginning with `name`: those of two figures of one page must differ.
    pub fn named(&self, name: &str) -> String {
        let rows = self.panels.len().div_ceil(self.columns);
        let width = self.panel.0 * self.columns as f64;
        let height = self.panel.1 * rows as f64;
        let mut out = opened(width, height, &self.description);
        let left = self.left();
        for (index, panel) in self.panels.iter().enumerate() {
            let x = self.panel.0 * (index % self.columns) as f64;
            let y = self.panel.1 * (index / self.columns) as f64;
            let frame = PlotArea {
                left: x + left,
                top: y + TOP,
                width: self.panel.0 - left - RIGHT,
                height: self.panel.1 - TOP - BOTTOM,
                label: x + LABEL,
                foot: Foot::Axis,
            };
            panel.draw(&frame, &format!("{name}c{index}"), &mut out);
        }
        out.push_str("</svg>\n");
        out
    }

    /// One for all panels, so that they stand in line.
    fn left(&self) -> f64 {
        let labels = self
            .panels
            .iter()
            .flat_map(|panel| panel.y.upright_ticks(self.panel.1));
        let widest = labels
            .map(|(_, label)| width_of(&label))
            .fold(0.0, f64::max);
        LEFT + (widest - width_of(SHORT)).max(0.0)
    }
}
