//! When each forecast said that the slope would fail, against when it was made: a life-expectancy plot.

use super::day;
use crate::plot::{Axis, Figure, Legend, Mark, Panel};
use crate::reading::Timestamp;
use crate::score::{Card, Score};
use std::collections::BTreeMap;

/// The methods that are drawn, with their colours: the program's own, and those most in use.
const DRAWN: [(&str, &str); 5] = [
    ("panel", "#0072b2"),
    ("inverse-velocity-line", "#d55e00"),
    ("inverse-velocity-short", "#e69f00"),
    ("saito", "#009e73"),
    ("voight", "#cc79a7"),
];
const BLACK: &str = "#000000";
/// A forecast farther off than this many times the longest time left is not drawn.
const FARTHEST_RATIO: f64 = 2.0;

/// The plot of a scorecard, one SVG text; `failure` is drawn where there was one.
pub fn life_expectancy(card: &Card, failure: Option<Timestamp>) -> String {
    let looks = looks(card);
    let first = looks.first().map_or(0.0, |(at, _)| day(*at));
    let last = looks
        .last()
        .map_or(first + 1.0, |(at, _)| day(*at))
        .max(first + 1e-3);
    let end = failure.map_or(last, day);
    let highest = FARTHEST_RATIO * (end - first).max(1e-3);
    let in_view = |left: f64| (left <= highest).then_some(left);
    let mut marks = Vec::new();
    if failure.is_some() {
        let truth = vec![(first, end - first), (end, 0.0)];
        marks.push(("what came".to_owned(), line(truth, BLACK, "4 3")));
    }
    let band: Vec<(f64, f64, f64)> = looks
        .iter()
        .filter_map(|(at, scores)| {
            let score = scores.get("panel")?;
            let left = |time: Timestamp| day(time) - day(*at);
            let high = score.high.map_or(highest, left).min(highest);
            Some((day(*at), in_view(left(score.low?))?, high))
        })
        .collect();
    marks.push((
        "panel, 90 %".to_owned(),
        Mark::Band {
            points: band,
            colour: DRAWN[0].1,
        },
    ));
    for (name, colour) in DRAWN {
        let points: Vec<(f64, f64)> = looks
            .iter()
            .filter_map(|(at, scores)| {
                let left = day(scores.get(name)?.median?) - day(*at);
                Some((day(*at), in_view(left)?))
            })
            .collect();
        marks.push((
            name.to_owned(),
            Mark::Dots {
                points: points.clone(),
                colour,
                radius: 2.5,
            },
        ));
        marks.push((String::new(), line(points, colour, "")));
    }
    Figure {
        description: "Days left to the failure as each method said, against when it said so"
            .to_owned(),
        columns: 1,
        panel: (860.0, 420.0),
        panels: vec![Panel {
            title: "Life expectancy".to_owned(),
            x: Axis::dates("forecast made", first, end.max(last)),
            y: Axis::linear("days left", 0.0, highest),
            marks,
            legend: Legend::TopRight,
        }],
    }
    .svg()
}

type Scores<'a> = &'a BTreeMap<&'static str, Score>;

/// Everything that was scored, in order of time.
fn looks(card: &Card) -> Vec<(Timestamp, Scores<'_>)> {
    let leads = card
        .leads
        .iter()
        .map(|lead| (lead.known_until, &lead.scores));
    let looks = card
        .looks
        .iter()
        .map(|look| (look.known_until, &look.scores));
    leads.chain(looks).collect()
}

fn line(points: Vec<(f64, f64)>, colour: &'static str, dash: &'static str) -> Mark {
    Mark::Line {
        points,
        colour,
        dash,
    }
}
