//! An explanation for the terminal: the verdict first, then what it rests on.

use super::sections::{gained, grounds, subject};
use super::sentence;
use crate::effects::{Explanation, Together};
use std::fmt::Write as _;

/// Several benchmarks: whether they part, then each by itself.
pub(super) fn together(found: &Together) -> String {
    let mut out = sentence::parting(found);
    for explanation in &found.each {
        let line = if out.is_empty() {
            String::new()
        } else {
            format!("\n{:=<72}\n", "")
        };
        out.push_str(&line);
        out.push_str(&text(explanation));
    }
    out
}

/// One explanation.
pub(super) fn text(explanation: &Explanation) -> String {
    let mut out = sentence::verdict(explanation);
    out.push('\n');
    for sentence in sentence::others(explanation) {
        out.push_str(&sentence);
        out.push('\n');
    }
    // Writing to a string cannot fail.
    let _ = writeln!(out, "\n{}", subject(explanation));
    for section in gained(explanation).into_iter().chain(grounds(explanation)) {
        let _ = write!(out, "\n{}\n{}", section.heading, section.table);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{Effect, Explained, Form, Kind};
    use crate::figures::fixture::{an_offset, bare, lake, time};
    use crate::reading::BenchmarkId;

    fn first_line(explanation: &Explanation) -> String {
        text(explanation).lines().next().unwrap().to_owned()
    }

    /// The verdict on an effect, without the benchmark's name.
    fn verdict(effect: Effect) -> String {
        let line = first_line(&Explanation {
            verdict: effect,
            ..bare(Kind::NONE)
        });
        line.strip_prefix("BLKM: consistent with ")
            .unwrap()
            .to_owned()
    }

    #[test]
    fn the_verdict_comes_first_with_its_delay_its_gain_and_its_p_value() {
        assert_eq!(
            first_line(&lake()),
            "BLKM: consistent with hydrological forcing by lake_level_m (level; mean delay 12 days; \
             95 % of the response within 36 days; one sd more at once raises the velocity by a factor of 2.4), p = .005"
        );
    }

    #[test]
    fn the_text_says_how_far_it_goes_what_else_and_what_it_may_be_taken_for() {
        let said = text(&lake());
        for part in [
            "Explained in part: structure is left in the residual; it stands out most from 2017-06-01T00:00Z",
            "Also consistent with an offset of the readings at 2017-09-10T00:00Z, of -74 mm",
            "Cannot be separated from: seasonal.",
            "rain & season may stand in",
            "7.89    3.31   -58 %",
            "held out from 2017-09-07T00:00Z",
            "-46 %",
            "82 %    31 %",
            "refused: held-out error rises",
            "reset  lake_sensor_raw_m  2017-06-06T17:00Z",
            "a1b2c3d4e5f60718",
        ] {
            assert!(said.contains(part), "{part} is not in:\n{said}");
        }
        assert!(!said.to_lowercase().contains("caused by"), "{said}");
        assert!(!said.contains("NaN") && !said.contains("inf "), "{said}");
    }

    #[test]
    fn the_two_ends_without_an_effect_claim_none() {
        let none = text(&bare(Kind::NONE));
        assert!(
            none.starts_with("BLKM: the residual cannot be distinguished from noise"),
            "{none}"
        );
        let mut fitted = bare(Kind::UNEXPLAINED);
        let not_fitted = text(&fitted);
        assert!(
            not_fitted.starts_with("BLKM: nothing can be said"),
            "{not_fitted}"
        );
        fitted.error.fit.before = Some(3.0);
        let unexplained = text(&fitted);
        assert!(
            unexplained.starts_with("BLKM: unexplained"),
            "{unexplained}"
        );
        let first = unexplained.lines().next().unwrap();
        assert!(
            first.contains("from 2017-06-01T00:00Z to 2017-06-20T00:00Z"),
            "{first}"
        );
        for text in [none, unexplained] {
            assert!(!text.contains("consistent with"), "{text}");
            assert!(!text.contains("Explained in"), "{text}");
        }
    }

    #[test]
    fn what_is_missing_is_a_dash() {
        let text = text(&bare(Kind::NONE));
        let fit = text.lines().find(|line| line.starts_with("fit ")).unwrap();
        assert_eq!(
            fit.split_whitespace().collect::<Vec<_>>(),
            ["fit", "-", "-", "-"]
        );
        assert!(
            text.contains("median time of failure                   -       -"),
            "{text}"
        );
    }

    #[test]
    fn a_full_explanation_says_that_noise_is_left() {
        let full = Explanation {
            explained: Explained::Full,
            ..lake()
        };
        assert!(text(&full).contains(
            "Explained in full: the residual that is left cannot be distinguished from noise."
        ));
    }

    #[test]
    fn an_effect_of_the_reading_is_not_said_of_the_slope() {
        let offset = Explanation {
            verdict: an_offset(),
            explained: Explained::Full,
            ..lake()
        };
        assert!(text(&offset).contains("It lies in the measurement, not in the slope."));
        let forward = Explanation {
            verdict: Effect {
                size: Some(12.0),
                ..an_offset()
            },
            also: Vec::new(),
            ..lake()
        };
        let said = text(&forward);
        assert!(said.contains("or the slope has slipped"), "{said}");
        assert!(!said.contains("not in the slope"), "{said}");
        assert!(!text(&lake()).contains("It lies in the measurement"));
    }

    #[test]
    fn every_kind_is_said_in_its_own_words() {
        let at = Some(time("1987-12-05T06:00:00Z"));
        let step = Effect {
            at,
            size: Some(-0.7),
            ..Effect::of(Kind::LOAD_STEP)
        };
        assert_eq!(
            verdict(step),
            "a step of the load at 1987-12-05T06:00Z, which at once lowers the velocity by a factor of 2.01"
        );
        let tide = Effect {
            period_days: Some(12.42 / 24.0),
            p_value: Some(0.0),
            ..Effect::of(Kind::TIDE)
        };
        assert_eq!(
            verdict(tide),
            "tidal forcing (strongest period 12.4 h), p < .001"
        );
        let draw_down = Effect {
            channel: Some("reservoir_level_m".to_owned()),
            form: Some(Form::Rate),
            gain_per_sd: Some(-1.0),
            velocity_factor_per_sd: Some(0.5),
            ..Effect::of(Kind::HYDROLOGICAL)
        };
        assert_eq!(
            verdict(draw_down),
            "hydrological forcing by reservoir_level_m (rate; one sd more of its rate of change \
             lowers the velocity by a factor of 2)"
        );
        let parted = Effect {
            at,
            groups: Some(vec![
                vec![BenchmarkId::new("5"), BenchmarkId::new("7")],
                vec![BenchmarkId::new("9")],
            ]),
            ..Effect::of(Kind::PARTITION)
        };
        assert!(verdict(parted).ends_with(": [5, 7] and [9]"));
        let kinds = [
            Kind::SEASONAL,
            Kind::STATE_RESET,
            Kind::FRICTION_CHANGE,
            Kind::RATE_LIMIT,
            Kind::GEOMETRY,
            Kind::THERMAL,
            Kind::INTERVAL_MEAN,
            Kind::CORRELATED_NOISE,
        ];
        let words: std::collections::BTreeSet<String> =
            kinds.map(|kind| verdict(Effect::of(kind))).into();
        assert_eq!(words.len(), kinds.len());
    }
}
