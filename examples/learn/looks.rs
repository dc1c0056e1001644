//! What the members said at each look at each slope, and what came.

use slipwatch::forecast::{Corpus, Life, Members, members};

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

/// All looks at the first `count` slopes of the corpus for learning, in the order of their seeds.
pub(crate) fn all(count: u64) -> Vec<Look> {
    let seeds: Vec<u64> = (0..count.min(Corpus::LIVES)).collect();
    let half = seeds.len().div_ceil(2).max(1);
    let looks = |seeds: &[u64]| -> Vec<Look> {
        let lives = seeds.iter().map(|seed| Corpus::TRAINING.life(*seed));
        lives.flat_map(|life| of(&life)).collect()
    };
    std::thread::scope(|scope| {
        let parts: Vec<_> = seeds
            .chunks(half)
            .map(|part| scope.spawn(move || looks(part)))
            .collect();
        let done = parts.into_iter().filter_map(|part| part.join().ok());
        done.flatten().collect()
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
