//! How sure the law was of instability and of acceleration, over time, above the levels.

use super::{Replayed, ReplayedRefit, WIDTH, levels};
use crate::figures::day;
use crate::figures::in_time::{every_few, line};
use crate::monitor::LevelChance;
use crate::plot::{Axis, BLUE, GREY, Legend, Mark, Panel, RED, Stack};

/// Heights of both panels, in the sheet's units.
const PROBABILITIES: f64 = 220.0;
const CHANCES: f64 = 140.0;

/// Within what time the chance is by which `level` is called, and from which chance on; `otherwise` where the state does not say.
fn within(level: &str, called_by: Option<LevelChance>, otherwise: &str) -> String {
    called_by.map_or_else(
        || otherwise.to_owned(),
        |by| {
            format!(
                "within {:.0} h: {level} from {:.0} % (dotted)",
                by.within_hours,
                100.0 * by.at_least
            )
        },
    )
}

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
        let called_by = refits.last().and_then(|newest| newest.called_by);
        let (by_red, by_orange) = called_by.unzip();
        let mut chances = vec![
            (
                within("red", by_red, "within the evacuation time"),
                line(over_time(|refit| refit.for_red), RED, ""),
            ),
            (
                within("orange", by_orange, "within the outlook"),
                line(over_time(|refit| refit.for_orange), BLUE, "6 3"),
            ),
        ];
        for (called_by, colour) in [(by_red, RED), (by_orange, BLUE)] {
            let limit = called_by.map(|by| vec![(x.from, by.at_least), (x.to, by.at_least)]);
            chances.extend(limit.map(|limit| (String::new(), line(limit, colour, "1 3"))));
        }
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
