//! Between when and when what happened once may have happened: how far its time can be moved, reading by reading, before the law with all
//! else free misses the readings by more than 90 % of the cases in which that is its time.

use super::act::Act;
use super::candidates::jump;
use super::noise::Whitener;
use super::problem::Problem;
use super::ready::Ready;
use super::refit::{Fitted, Start, towards};
use super::term::{Scratch, Term};
use crate::reading::{CHI_SQUARED_90, Timestamp, after_days};

/// 90 % quantile of chi squared with one degree of freedom.
const DROP: f64 = CHI_SQUARED_90;
/// Most steps of one refit, which begins at that of a time nearby, and most refits on one side.
const STEPS: usize = 6;
const MOST_REFITS: usize = 24;

/// The misfit over the time of one event.
struct TimeProfile<'a> {
    problem: &'a Problem,
    whitener: &'a Whitener,
    full: &'a Fitted,
    index: usize,
}

/// Bounds of 90 % of the time of a term, under the noise in force: at least the gap between the two readings around it. `None` of what acts
/// all along, and where the readings leave it open towards an end of the record.
pub(super) fn interval(
    ready: &Ready,
    full: &Fitted,
    index: usize,
    scratch: &mut Scratch,
) -> Option<[Timestamp; 2]> {
    let problem = &ready.problem;
    let at = full.terms.get(index)?.at?;
    let whitener = ready.bank.iter().find(|one| one.noise == full.noise)?;
    let profile = TimeProfile {
        problem,
        whitener,
        full,
        index,
    };
    let earliest = profile.farthest((at, 1), scratch)?;
    let latest = profile.farthest((at, problem.used - 1), scratch)?;
    let time = |reading: usize| after_days(problem.epoch, *problem.t.get(reading)?);
    Some([time(earliest.checked_sub(1)?)?, time(latest)?])
}

impl TimeProfile<'_> {
    /// The reading farthest from that of the event, towards `end`, before which it may have happened as well; `None` where that is `end`.
    fn farthest(&self, (at, end): (usize, usize), scratch: &mut Scratch) -> Option<usize> {
        let room = at.abs_diff(end);
        let moved = |away: usize| if end < at { at - away } else { at + away };
        let (mut inside, mut refits) = (0, 0);
        let mut nearest = self.full.clone();
        let mut outside: Option<usize> = None;
        // Ever farther until it is too far, and then halfway between.
        let mut away = 1;
        while outside.is_none_or(|outside| outside > inside + 1) {
            if away > room || refits == MOST_REFITS {
                return None;
            }
            refits += 1;
            match self.at(&nearest, moved(away), scratch) {
                Some(there) => (inside, nearest) = (away, there),
                None => outside = Some(away),
            }
            away = match outside {
                Some(outside) => usize::midpoint(inside, outside),
                None if inside == room => return None,
                None => (2 * inside).min(room),
            };
        }
        Some(moved(inside))
    }

    /// The law with the event before another reading, where that is no worse than 90 % of such misses.
    fn at(&self, nearest: &Fitted, reading: usize, scratch: &mut Scratch) -> Option<Fitted> {
        let mut start = Start::at(nearest);
        let own = start.terms.get_mut(self.index)?;
        let is_earlier = self.full.terms[self.index].at > Some(reading);
        *own = before(self.problem, own, (reading, is_earlier));
        let there = towards(self.problem, &start, self.whitener, (STEPS, scratch))?;
        (there.deviance <= self.full.deviance + DROP).then_some(there)
    }
}

/// The same before an earlier reading, or a later one: where the time between that and the one before it is nearest to its own.
fn before(problem: &Problem, term: &Term, (reading, is_earlier): (usize, bool)) -> Term {
    if matches!(term.act, Act::Reading(_)) {
        return jump(problem, term.kind, reading);
    }
    Term {
        at: Some(reading),
        share: if is_earlier { 1.0 } else { 0.0 },
        ..term.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::super::candidates::once;
    use super::super::fixture::{daily, epoch, generator, normals, series};
    use super::super::kind::Kind;
    use super::*;
    use crate::reading::{Quantity, days_since};

    /// Bounds, in days, of when a slope that moves by 1 mm/day became so many e-folds faster, halfway between days 119 and 120.
    fn bounds(by: f64) -> [f64; 2] {
        let days = daily(200);
        let noise = normals(&mut generator(5), days.len());
        let moved = |day: f64| day + (day - 119.5).max(0.0) * by.exp_m1();
        let values = days
            .iter()
            .zip(noise)
            .map(|(day, noise)| moved(*day) + noise);
        let values: Vec<f64> = values.collect();
        let series = series(Quantity::Displacement, &days, &values);
        let ready = Ready::of(&series, &[], &mut Vec::new()).unwrap();
        let step = once(Kind::LOAD_STEP, 120).next().unwrap();
        let start = Start::at(&ready.plain).with_size(&step, by);
        let noise = |one: &&Whitener| one.noise == ready.plain.noise;
        let whitener = ready.bank.iter().find(noise).unwrap();
        let scratch = &mut Scratch::default();
        let full = towards(&ready.problem, &start, whitener, (20, scratch)).unwrap();
        interval(&ready, &full, 0, scratch)
            .unwrap()
            .map(|bound| days_since(epoch(), bound))
    }

    #[test]
    fn the_time_of_a_large_step_is_known_to_some_readings_and_of_a_small_one_to_more() {
        let [large, small] = [1.5, 0.4].map(bounds);
        for [from, until] in [large, small] {
            assert!(from <= 119.0 && until >= 120.0, "{from} {until}");
        }
        let length = |[from, until]: [f64; 2]| until - from;
        assert!(length(large) <= 5.0, "{large:?}");
        assert!(length(small) > length(large), "{small:?} {large:?}");
        assert!(length(small) < 60.0, "{small:?}");
    }
}
