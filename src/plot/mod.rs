//! Panels of lines, points, bands and bars as SVG text: the same numbers give the same bytes.
//! Crates for plots (plotters) place text by the fonts of the machine, so that their bytes differ.

mod axis;
mod bars;
mod calendar;
mod figure;
mod mark;
mod panel;
mod stack;

pub use axis::{Axis, AxisScale};
pub use bars::{Bar, Bars};
pub use figure::Figure;
pub use mark::Mark;
pub use panel::{Legend, Panel};
pub use stack::Stack;

/// Blue. All colours are distinct for every kind of colour vision (Okabe and Ito, 2008).
pub const BLUE: &str = "#0072b2";
/// Vermilion.
pub const RED: &str = "#d55e00";
/// Bluish green.
pub const GREEN: &str = "#009e73";
/// Reddish purple.
pub const PURPLE: &str = "#aa4499";
/// Grey, for what stands behind.
pub const GREY: &str = "#777777";
/// Of text and frames.
pub const BLACK: &str = "#111111";

/// Size of text, in the sheet's units.
const FONT: f64 = 12.0;
/// The mean width of a character of the font, over its size: for the room of a legend.
const CHARACTER: f64 = 0.56;

/// The room that a text takes, in the sheet's units.
fn width_of(text: &str) -> f64 {
    CHARACTER * FONT * text.chars().count() as f64
}

/// `text` as it may stand between tags; what XML cannot hold is left out.
pub fn escaped(text: &str) -> String {
    let held = |letter: &char| !letter.is_control() || matches!(letter, '\t' | '\n' | '\r');
    let held: String = text.chars().filter(held).collect();
    held.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

/// The opening of a sheet: its size, its title for screen readers, and a white ground.
fn opened(width: f64, height: f64, description: &str) -> String {
    let description = escaped(description);
    let label = description.replace('"', "&quot;");
    format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" role="img" aria-label="{label}" viewBox="0 0 {width} {height}" width="{width}" height="{height}" font-family="DejaVu Sans, Verdana, sans-serif" font-size="{FONT}" fill="{BLACK}">
<title>{description}</title>
<rect width="{width}" height="{height}" fill="#ffffff"/>
"##
    )
}

/// As much of a text as has room.
fn shortened(text: &str, room: f64) -> String {
    if width_of(text) <= room {
        return text.to_owned();
    }
    let mut short = String::new();
    for letter in text.chars() {
        if width_of(&short) + width_of("x…") > room {
            break;
        }
        short.push(letter);
    }
    format!("{}…", short.trim_end())
}
