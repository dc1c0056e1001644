//! The load that nobody declared, over the record, before and after the effects that a search found.

use crate::effects::Curves;
use crate::reading::Timestamp;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Points of such a course, at most: it goes into an event.
const MOST_POINTS: usize = 48;
/// Figures are kept to a ten-thousandth of an e-fold.
const PLACES: f64 = 1e4;

/// The log-load that the readings ask for beyond the law, e-folds of velocity: its posterior mean and standard deviation
/// at a part of the readings, evenly by count.
#[derive(Debug, Clone, Default, PartialEq, JsonSchema, Serialize, Deserialize)]
pub struct UndeclaredLoad {
    /// When the readings were taken.
    pub times: Vec<Timestamp>,
    /// The mean under the law with a constant load.
    pub before: Vec<f64>,
    /// Its standard deviation.
    pub before_sd: Vec<f64>,
    /// The mean under the law with the effects found; empty where the residual leaves no room for a load.
    pub after: Vec<f64>,
    /// Its standard deviation.
    pub after_sd: Vec<f64>,
}

impl UndeclaredLoad {
    /// Of an explanation's curves; `None` where the readings leave no room for a load.
    pub(super) fn of(curves: &Curves) -> Option<Box<Self>> {
        let count = curves.times.len();
        if count == 0 || curves.load_before.len() != count {
            return None;
        }
        let kept = count.min(MOST_POINTS);
        let at = |point: usize| point * (count - 1) / (kept - 1).max(1);
        let course = |load: &[(f64, f64)]| -> (Vec<f64>, Vec<f64>) {
            let load = if load.len() == count { load } else { &[] };
            let points = (0..kept).filter_map(|point| load.get(at(point)));
            points.map(|(mean, sd)| (short(*mean), short(*sd))).unzip()
        };
        let (before, before_sd) = course(&curves.load_before);
        let (after, after_sd) = course(&curves.load_after);
        Some(Box::new(Self {
            times: (0..kept).map(|point| curves.times[at(point)]).collect(),
            before,
            before_sd,
            after,
            after_sd,
        }))
    }
}

fn short(value: f64) -> f64 {
    (value * PLACES).round() / PLACES
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curves(count: i64) -> Curves {
        let times = (0..count).map(|hour| Timestamp::from_second(3600 * hour).unwrap());
        Curves {
            times: times.collect(),
            load_before: (0..count).map(|i| (0.01 * i as f64, 0.1)).collect(),
            ..Curves::default()
        }
    }

    #[test]
    fn the_course_begins_and_ends_with_the_record_and_is_bounded() {
        let course = UndeclaredLoad::of(&curves(600)).unwrap();
        assert_eq!(course.times.len(), MOST_POINTS);
        assert_eq!(course.before.len(), MOST_POINTS);
        assert_eq!((course.before[0], course.before[47]), (0.0, 5.99));
        assert_eq!(course.times[47], curves(600).times[599]);
        assert!(course.after.is_empty() && course.after_sd.is_empty());
        assert_eq!(UndeclaredLoad::of(&curves(1)).unwrap().before, [0.0]);
    }

    #[test]
    fn without_a_load_there_is_no_course() {
        let none = Curves {
            load_before: Vec::new(),
            ..curves(9)
        };
        assert_eq!(UndeclaredLoad::of(&none), None);
    }
}
