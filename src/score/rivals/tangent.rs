//! The improved tangent angle (Xu, Zeng, Qian, Wang and Huang 2009, "Study on a improved tangential angle and
//! the corresponding landslide pre-warning criteria", Geol. Bull. China 28, 501-505; Xu, Yuan, Zeng and Hack
//! 2011, "Some new pre-warning criteria for creep slope failure", Sci. China Technol. Sci. 54, 210-220).
//!
//! The displacement over the velocity of uniform creep is a time; the angle of its tangent against time is
//! arctan(v / v of uniform creep): 45 degrees while the creep is uniform, from 80 on danger, from 85 on imminent
//! failure. Published are these marks, not a time. Taken here: from 85 degrees on failure is now; up to 45 it
//! never comes; between, the straight line through the newest angles is drawn on to 85 degrees, and that line
//! is ours. Uniform creep is the velocity that was exceeded for half of the time until now.

use super::onset::LONG;
use super::straight::line_through;
use super::{point, rates};
use crate::fit::Rate;
use crate::forecast::Passage;
use crate::score::Known;

/// The angle of uniform creep, by the definition of the figure, and that of imminent failure, which its authors give.
const UNIFORM_DEGREES: f64 = 45.0;
const IMMINENT_DEGREES: f64 = 85.0;

/// Now, never, or where the trailing angles lead to the mark of imminent failure.
pub(in crate::score) fn forecast(known: &Known) -> Option<Passage> {
    let rates = rates(known);
    let newest = rates.get(rates.len().checked_sub(LONG)?..)?;
    let uniform = uniform_creep(&rates).filter(|velocity| *velocity > 0.0)?;
    let angles: Vec<(f64, f64, f64)> = newest
        .iter()
        .map(|rate| (rate.to, (rate.velocity / uniform).atan().to_degrees(), 1.0))
        .collect();
    let (_, angle, _) = *angles.last()?;
    if angle >= IMMINENT_DEGREES {
        return point(0.0);
    }
    let line = line_through(&angles)?;
    if angle <= UNIFORM_DEGREES || line.slope() <= 0.0 {
        return Some(Passage::default());
    }
    point(line.reaches(IMMINENT_DEGREES) - known.now_days)
}

/// The median over time of the velocity, mm/day.
fn uniform_creep(rates: &[Rate]) -> Option<f64> {
    let mut before = rates.first()?.from;
    let mut lasted: Vec<(f64, f64)> = Vec::with_capacity(rates.len());
    for rate in rates {
        lasted.push((rate.velocity, rate.to - before));
        before = rate.to;
    }
    lasted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * lasted.iter().map(|(_, days)| days).sum::<f64>();
    let mut slower = 0.0;
    let median = lasted.iter().find(|(_, days)| {
        slower += days;
        slower >= half
    });
    median.map(|(velocity, _)| *velocity)
}

#[cfg(test)]
mod tests {
    use super::super::drawn::{never, velocities, when};
    use super::*;

    /// 2 mm/day until day 60, then one degree a day: 85 degrees on day 100.
    fn creeping(t: f64) -> f64 {
        2.0 * (45.0 + (t - 60.0).max(0.0)).to_radians().tan()
    }

    #[test]
    fn an_angle_that_grows_by_a_degree_a_day_is_at_its_mark_on_the_day() {
        let known = velocities(1.0, 80.0, creeping);
        let days = when(&known, forecast(&known).as_ref());
        assert!((days - 100.0).abs() < 1e-6, "{days}");
        let known = velocities(1.0, 101.0, creeping);
        assert!((when(&known, forecast(&known).as_ref()) - 101.0).abs() < 1e-9);
    }

    #[test]
    fn uniform_and_slowing_creep_never_fail_and_a_short_record_says_nothing() {
        assert!(never(forecast(&velocities(1.0, 50.0, creeping)).as_ref()));
        let slowing = velocities(1.0, 30.0, |t| 50.0 / (1.0 + t));
        assert!(never(forecast(&slowing).as_ref()));
        assert_eq!(forecast(&velocities(1.0, 5.0, creeping)), None);
    }
}
