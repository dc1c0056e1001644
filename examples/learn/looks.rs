//! What the members said at each look at each slope, and what came.

use slipwatch::forecast::{Fate, Life, Members, members};

const LEADS: [f64; 7] = [40.0, 20.0, 10.0, 5.0, 2.0, 1.0, 0.5];
/// Looks evenly over the record of a slope that fails, and of one that stands.
const EVENLY: (usize, usize) = (6, 12);

pub(crate) struct Look {
    pub(crate) members: Members,
    /// Whether the slope failed; otherwise it stood until the record ended.
    pub(crate) failed: bool,
    /// Days until then.
    pub(crate) remaining: f64,
    /// Of the record so far, days.
    pub(crate) length: f64,
}

/// All looks at so many slopes, drawn from the seeds for learning.
pub(crate) fn all(failing: u64, standing: u64) -> Vec<Look> {
    let lives: Vec<(Fate, u64)> = (0..failing)
        .map(|seed| (Fate::Failing, 900_000 + seed))
        .chain((0..standing).map(|seed| {
            let fates = [Fate::Saturating, Fate::Steady, Fate::Settling];
            (fates[seed as usize % fates.len()], 950_000 + seed)
        }))
        .collect();
    let half = lives.len().div_ceil(2);
    std::thread::scope(|scope| {
        let parts: Vec<_> = lives
            .chunks(half)
            .map(|part| {
                scope.spawn(|| {
                    part.iter()
                        .flat_map(|(fate, seed)| of(&Life::draw(*fate, *seed)))
                        .collect::<Vec<Look>>()
                })
            })
            .collect();
        parts
            .into_iter()
            .flat_map(|part| part.join().unwrap_or_default())
            .collect()
    })
}

fn of(life: &Life) -> Vec<Look> {
    let (Some((first, _)), Some((last, _))) = (life.readings.first(), life.readings.last()) else {
        return Vec::new();
    };
    let end = life.failure_days.unwrap_or(*last);
    let evenly = if life.failure_days.is_some() {
        EVENLY.0
    } else {
        EVENLY.1
    };
    let mut times: Vec<(f64, f64)> = (0..evenly)
        .map(|look| ((look as f64 + 0.5) / evenly as f64 * end, f64::INFINITY))
        .collect();
    if life.failure_days.is_some() {
        times.extend(LEADS.map(|lead| (end - lead, 2.0 * lead)));
    }
    let mut looks = Vec::new();
    for (at, farthest) in times {
        let read = life.readings.partition_point(|(days, _)| *days <= at);
        let Some((now, _)) = read.checked_sub(1).map(|last| life.readings[last]) else {
            continue;
        };
        let remaining = end - now;
        // A gap in the readings leaves nothing to judge at a lead.
        if remaining > farthest || remaining <= 0.0 {
            continue;
        }
        let Some(members) = members(&life.known(now), Life::CRITICAL_MM_PER_DAY) else {
            continue;
        };
        looks.push(Look {
            members,
            failed: life.failure_days.is_some(),
            remaining,
            length: now - first,
        });
    }
    looks
}
