//! When each forecast said that the slope would collapse, against when it was made, above the levels.

use super::{Replayed, ReplayedRefit, WIDTH, levels};
use crate::figures::day;
use crate::figures::in_time::{dots, every_few, line};
use crate::plot::{Axis, BLACK, BLUE, GREY, Legend, Mark, Panel, Stack};

/// Heights of both panels, in the sheet's units.
const FORECASTS: f64 = 380.0;
const CHANCES: f64 = 80.0;
/// The upright axis ends so far after the record's end or the collapse, as a share of the time before.
const LATER: f64 = 0.75;

impl Replayed<'_> {
    /// The figure, one SVG text.
    pub fn forecasts(&self) -> String {
        let x = self.dates("forecast made");
        let refits: Vec<ReplayedRefit> = every_few(self.refits().collect());
        let title = self.title("forecasts of the collapse");
        Stack {
            description: format!(
                "{title}. The time forecast against the time at which it was forecast, its chance, and the levels in force."
            ),
            title,
            width: WIDTH,
            panels: vec![
                (FORECASTS, self.times_panel(&x, &refits)),
                (CHANCES, self.chances_panel(&x, &refits)),
                (levels::HEIGHT, levels::panel(self, &x)),
            ],
        }
        .svg()
    }

    fn times_panel(&self, x: &Axis, refits: &[ReplayedRefit]) -> Panel {
        let later = self.end() + LATER * (self.end() - self.start());
        let first = refits.first().map_or(x.from, |refit| day(refit.time));
        let y = Axis::dates("collapse forecast", first, later.max(x.to));
        let now = vec![(x.from, x.from), (x.to, x.to)];
        let mut marks = vec![("time of the forecast".to_owned(), line(now, GREY, "2 3"))];
        let spans = refits.iter().filter_map(|refit| {
            let failure = refit.failure_time;
            let high = failure.high.map_or(2.0 * y.to - y.from, day);
            Some((day(refit.time), day(failure.low?), high))
        });
        marks.push((
            "5 to 95 %".to_owned(),
            Mark::Standing {
                spans: spans.collect(),
                colour: BLUE,
            },
        ));
        let medians = refits
            .iter()
            .filter_map(|refit| Some((day(refit.time), day(refit.failure_time.median?))));
        marks.push(("median".to_owned(), dots(medians.collect(), BLUE, 3.2)));
        if let Some(collapse) = self.collapse.map(day) {
            let came = line(vec![(x.from, collapse), (x.to, collapse)], BLACK, "");
            marks.push(("collapse".to_owned(), came));
            marks.extend(self.collapse_line());
        }
        Panel {
            title: "time of the collapse".to_owned(),
            x: x.clone(),
            y,
            marks,
            legend: Legend::Above,
        }
    }

    fn chances_panel(&self, x: &Axis, refits: &[ReplayedRefit]) -> Panel {
        let chances = refits
            .iter()
            .map(|refit| (day(refit.time), refit.failure_time.probability));
        let chances: Vec<(f64, f64)> = chances.collect();
        let mut marks = vec![
            (String::new(), line(chances.clone(), GREY, "")),
            (String::new(), dots(chances, BLUE, 2.6)),
        ];
        marks.extend(self.collapse_line());
        let horizon = refits.first().map(|refit| refit.failure_time.horizon_days);
        let title = horizon.map_or_else(
            || "no forecast: too few readings".to_owned(),
            |days| {
                format!(
                    "chance of a collapse within {days:.0} days (a median where it is over 0.5)"
                )
            },
        );
        Panel {
            title,
            x: x.clone(),
            y: Axis::linear("chance", 0.0, 1.05),
            marks,
            legend: Legend::Above,
        }
    }
}
