//! An explanation, a scorecard and a replay in figures: each one SVG text, for a page or a file of its own.

#[cfg(test)]
pub(crate) mod fixture;
mod in_time;
mod life_expectancy;
mod of_the_search;
mod replayed;

pub use life_expectancy::life_expectancy;
pub use replayed::Replayed;

use crate::effects::{Candidate, Explanation};
use crate::reading::{Timestamp, days_since};

/// One figure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Short and its own among the figures of an explanation: `readings`, `residual`.
    pub name: &'static str,
    /// What there is to see.
    pub caption: String,
    /// The picture; its inner names begin with `name`.
    pub svg: String,
}

/// The figures of an explanation, those left out for which it holds no numbers: the readings and
/// both fits, the residual, its autocorrelation, what each effect adds, the load that nobody
/// declared, the rivals.
pub fn pictures(explanation: &Explanation) -> Vec<Picture> {
    let all = [
        in_time::readings(explanation),
        in_time::residual(explanation),
        of_the_search::autocorrelation(explanation),
        in_time::contributions(explanation),
        in_time::undeclared_load(explanation),
        of_the_search::rivals(explanation),
    ];
    all.into_iter().flatten().collect()
}

/// The residual alone, where there is one.
pub fn residual(explanation: &Explanation) -> Option<Picture> {
    in_time::residual(explanation)
}

/// The residual, and what each effect adds, those left out for which there are no numbers.
pub fn of_the_loop(explanation: &Explanation) -> Vec<Picture> {
    let both = [
        in_time::residual(explanation),
        in_time::contributions(explanation),
    ];
    both.into_iter().flatten().collect()
}

/// What was tried, on one line: its kind, channel, form and time.
pub fn title(candidate: &Candidate) -> String {
    let channel = candidate.channel.clone();
    let form = candidate.form.map(|form| form.name().to_owned());
    let at = candidate.at.map(|at| at.strftime("%Y-%m-%d").to_string());
    let parts = [Some(candidate.effect.name().to_owned()), channel, form, at];
    parts.into_iter().flatten().collect::<Vec<_>>().join(" ")
}

/// Days since 1970-01-01, as an axis of dates has them.
fn day(time: Timestamp) -> f64 {
    days_since(Timestamp::UNIX_EPOCH, time)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Kind;

    #[test]
    fn every_figure_is_drawn_from_whole_numbers_and_where_there_are_none_is_left_out() {
        let drawn = pictures(&fixture::lake());
        let names: Vec<&str> = drawn.iter().map(|picture| picture.name).collect();
        let all = [
            "readings",
            "residual",
            "autocorrelation",
            "contributions",
            "undeclared-load",
            "rivals",
        ];
        assert_eq!(names, all);
        for picture in drawn {
            assert!(picture.svg.starts_with("<svg ") && picture.svg.ends_with("</svg>\n"));
            assert!(!picture.svg.contains("NaN"), "{}", picture.name);
        }
        assert!(pictures(&fixture::bare(Kind::UNEXPLAINED)).is_empty());
    }

    #[test]
    fn a_contribution_that_is_known_at_no_time_has_no_panel() {
        let mut explanation = fixture::lake();
        let panels = |explanation: &Explanation| {
            let drawn = pictures(explanation);
            let own = drawn.iter().find(|one| one.name == "contributions");
            own.map_or(0, |picture| picture.svg.matches("<clipPath").count())
        };
        let before = panels(&explanation);
        let values = explanation.curves.contributions.values_mut().next();
        values.unwrap().fill(f64::NAN);
        assert!(before > 0);
        assert_eq!(panels(&explanation), before - 1);
    }

    #[test]
    fn curves_that_do_not_fit_their_times_are_not_drawn() {
        let mut explanation = fixture::lake();
        explanation.curves.load_after.pop();
        explanation.curves.after.pop();
        let drawn = pictures(&explanation);
        assert!(drawn.iter().all(|picture| picture.name != "residual"));
        let load = drawn.iter().find(|one| one.name == "undeclared-load");
        assert_eq!(load.unwrap().svg.matches("undeclared log-load").count(), 1);
    }

    #[test]
    fn a_reading_without_a_fit_leaves_no_hole_in_the_page() {
        let mut explanation = fixture::lake();
        explanation.curves.before[5] = f64::NAN;
        explanation.curves.load_before[5] = (f64::NAN, f64::INFINITY);
        for picture in pictures(&explanation) {
            assert!(!picture.svg.contains("NaN") && !picture.svg.contains("inf"));
        }
    }
}
