//! Refits of different benchmarks at once. What the next readings lead to is computed before they are taken, and used where
//! the record turns out to be the one that was computed with: the events are the same with any number of workers.

use super::track::{Prepared, StepContext, Track};
use super::{Input, Monitor, history};
use crate::alert::Policy;
use crate::reading::{BenchmarkId, Reading};
use std::collections::BTreeSet;
use std::fmt::Debug;

/// Benchmarks whose refits are computed together at most: an alert waits for no more than these.
const MOST_TOGETHER: usize = 32;

/// One piece of work that depends on no other.
pub type Task<'a> = Box<dyn FnOnce() + Send + 'a>;

/// Who does tasks: in any order, or several at once.
pub trait Workers: Debug {
    /// Does all of them and returns when the last is done.
    fn run(&self, tasks: Vec<Task<'_>>);
}

/// A benchmark whose refit is to be computed, by this policy, after this reading where it is not the newest that it has.
struct Due<'a> {
    track: &'a Track,
    policy: &'a Policy,
    next: Option<(history::MeasuredAs, &'a Reading)>,
}

impl Monitor {
    /// Computes what the readings at the beginning of `next` lead to; of how many inputs, so that the caller asks again
    /// after these: as far as they are readings, each of another benchmark, or while nothing is judged. Changes no event.
    pub fn prepare<'a>(
        &mut self,
        next: impl Iterator<Item = &'a Input>,
        workers: &dyn Workers,
    ) -> usize {
        if self.reads_all_past() {
            return MOST_TOGETHER;
        }
        let (mut seen, mut due) = (BTreeSet::new(), Vec::new());
        let mut count = 0;
        for input in next.take(MOST_TOGETHER) {
            let Input::Reading {
                benchmark,
                unit,
                averaging,
                reading,
            } = input
            else {
                break;
            };
            if !seen.insert(benchmark) {
                break;
            }
            count += 1;
            if let Some(track) = self.benchmarks.get(benchmark) {
                let source = history::MeasuredAs {
                    unit: *unit,
                    averaging: *averaging,
                };
                let policy = self.settings.policy(benchmark);
                let next = Some((source, reading));
                // A thread costs more than to take what is not judged.
                if track.may_judge(policy, reading.time, self.phase(benchmark, reading.time)) {
                    due.push((
                        benchmark,
                        Due {
                            track,
                            policy,
                            next,
                        },
                    ));
                }
            }
        }
        // Nobody else could work beside one.
        if due.len() > 1 {
            let prepared = self.compute(due, workers);
            self.keep(prepared);
        }
        count.max(1)
    }

    /// Computes what the next [`super::Notice::BatchEnd`] judges of what queued. Changes no event.
    pub fn prepare_queued(&mut self, workers: &dyn Workers) {
        if self.reads_all_past() {
            return;
        }
        let queued = self.batches.next();
        let due = queued.filter_map(|benchmark| {
            let track = self.benchmarks.get(benchmark)?;
            let policy = self.settings.policy(benchmark);
            let next = None;
            Some((
                benchmark,
                Due {
                    track,
                    policy,
                    next,
                },
            ))
        });
        let due: Vec<_> = due.collect();
        if due.len() > 1 {
            let prepared = self.compute(due, workers);
            self.keep(prepared);
        }
    }

    fn compute(
        &self,
        due: Vec<(&BenchmarkId, Due<'_>)>,
        workers: &dyn Workers,
    ) -> Vec<(BenchmarkId, Prepared)> {
        let mut prepared: Vec<(BenchmarkId, Prepared)> = (due.iter())
            .map(|(id, _)| ((*id).clone(), Prepared::default()))
            .collect();
        let covariates = &self.covariates;
        let tasks = due.into_iter().zip(&mut prepared);
        let tasks = tasks.map(|((id, due), (_, result))| -> Task<'_> {
            let now = due
                .next
                .map_or(self.tally.last_time(), |(_, reading)| Some(reading.time));
            let phase = self.phase(id, now.unwrap_or_default());
            let context = StepContext { phase, covariates };
            Box::new(move || *result = due.track.prepare(due.policy, due.next, &context))
        });
        workers.run(tasks.collect());
        prepared
    }

    fn keep(&mut self, prepared: Vec<(BenchmarkId, Prepared)>) {
        for (id, prepared) in prepared {
            if let Some(track) = self.benchmarks.get_mut(&id) {
                track.keep(prepared);
            }
        }
    }
}
