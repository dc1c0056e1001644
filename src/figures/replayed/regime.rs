//! How sure the law was of instability and of acceleration, over time, above the levels.

use super::{Replayed, ReplayedRefit, WIDTH, levels};
use crate::figures::day;
use crate::figures::in_time::{every_few, line};
use crate::plot::{Axis, BLUE, GREY, Legend, Mark, Panel, RED, Stack};

/// Heights of both panels, in the sheet's units.
const PROBABILITIES: f64 = 220.0;
const CHANCES: f64 = 140.0;

impl Replayed<'_> {
    /// The figure, one SVG text.
    pub fn regimes(&self) -> String {
        let x = self.dates("");
        let refits: Vec<ReplayedRefit> = every_few(self.refits().collect());
        let title = self.title("regime");
        let over_time = |of: fn(&ReplayedRefit) -> f64| -> Vec<(f64, f64)> {
            refits
                .iter()
                .map(|refit| (day(refit.time), of(refit)))
                .collect()
        };
        let half = line(vec![(x.from, 0.5), (x.to, 0.5)], GREY, "2 3");
        let regime = vec![
            (String::new(), half),
            (
                "unstable: kappa > 0".to_owned(),
                line(over_time(|refit| refit.unstable), RED, ""),
            ),
            (
                "accelerating: r > 0".to_owned(),
                line(over_time(|refit| refit.accelerating), BLUE, "6 3"),
            ),
        ];
        let chances = vec![
            (
                "within the evacuation time".to_owned(),
                line(over_time(|refit| refit.within_evacuation_time), RED, ""),
            ),
            (
                "within the outlook".to_owned(),
                line(over_time(|refit| refit.within_outlook), BLUE, "6 3"),
            ),
        ];
        Stack {
            description: format!(
                "{title}. The probability of instability and of acceleration, the chance of a collapse, and the levels in force."
            ),
            title,
            width: WIDTH,
            panels: vec![
                (PROBABILITIES, self.shares("probability", &x, regime)),
                (CHANCES, self.shares("chance of a collapse", &x, chances)),
                (levels::HEIGHT, levels::panel(self, &x)),
            ],
        }
        .svg()
    }

    fn shares(&self, title: &str, x: &Axis, mut marks: Vec<(String, Mark)>) -> Panel {
        let collapse = self.collapse_line();
        marks.extend(collapse.map(|(_, mark)| ("collapse".to_owned(), mark)));
        Panel {
            title: title.to_owned(),
            x: x.clone(),
            y: Axis::linear("", 0.0, 1.05),
            marks,
            legend: Legend::Above,
        }
    }
}
