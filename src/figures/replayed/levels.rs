//! The levels in force over time, as a coloured band with words.

use super::Replayed;
use crate::alert::Level;
use crate::figures::day;
use crate::monitor::{LevelStretch, levels_in};
use crate::plot::{Axis, BLACK, GREY, Legend, Mark, Panel};
use crate::reading::days_since;

/// Height of the band.
pub(super) const HEIGHT: f64 = 26.0;
const WHITE: &str = "#ffffff";

/// Every stretch of one level, from the first reading to the last; then those in which it was unknown, which
/// stand beside the level.
pub(super) fn stretches(replayed: &Replayed) -> (Vec<LevelStretch>, Vec<LevelStretch>) {
    replayed.span().map_or_else(Default::default, |span| {
        levels_in(replayed.events, Some(&replayed.series.benchmark), span)
    })
}

/// The band.
pub(super) fn panel(replayed: &Replayed, x: &Axis) -> Panel {
    let (mut levels, unknown) = stretches(replayed);
    // In the order of the legend; none lies over another.
    levels.sort_by_key(|stretch| stretch.level);
    let mut marks: Vec<(String, Mark)> = Vec::new();
    for stretch in &levels {
        let named = marks.iter().any(|mark| mark.0 == stretch.level.name());
        let name = if named { "" } else { stretch.level.name() };
        marks.push((name.to_owned(), fill(replayed, stretch)));
    }
    if !unknown.is_empty() {
        let mark = Mark::Lying {
            spans: unknown
                .iter()
                .map(|stretch| (day(stretch.from), day(stretch.to), 0.1))
                .collect(),
            colour: GREY,
        };
        marks.push((Level::Unknown.name().to_owned(), mark));
    }
    marks.extend(replayed.collapse_line());
    Panel {
        title: "level in force".to_owned(),
        x: x.clone(),
        y: Axis::named(0.0, 1.0, Vec::new()),
        marks,
        legend: Legend::Above,
    }
}

fn fill(replayed: &Replayed, stretch: &LevelStretch) -> Mark {
    let name = stretch.level.name();
    let (colour, ink) = match stretch.level {
        Level::Green => ("#6cbf84", BLACK),
        Level::Yellow => ("#f7dc5a", BLACK),
        Level::Orange => ("#f2952f", BLACK),
        Level::Red => ("#c22f2a", WHITE),
        Level::Unknown => (GREY, WHITE),
    };
    let since = format!("{name} from {}", replayed.short(stretch.from));
    let before = replayed.collapse.map(|time| days_since(stretch.from, time));
    let before = before.filter(|days| *days > 0.0 && stretch.level > Level::Green);
    let before = before.map(|days| format!("{since}, {days:.1} days before collapse"));
    let words = before.into_iter().chain([since, name.to_owned()]);
    Mark::Fill {
        from: day(stretch.from),
        to: day(stretch.to),
        colour,
        ink,
        words: words.collect(),
    }
}
