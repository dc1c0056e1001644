//! Searches for missing effects beside the monitor: threads of their own, answers at a time the data decide.

use crate::monitor::{SearchFinding, SearchJob};
use crate::reading::{BenchmarkId, Timestamp};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::sync::{Arc, Mutex, PoisonError};

/// Most threads; one core is left to the monitor where there are several.
const MOST_WORKERS: usize = 4;

/// The searches under way, one a benchmark.
#[derive(Debug, Default)]
pub(super) struct Searches {
    asked: BTreeMap<BenchmarkId, RunningSearch>,
    /// `None` until the first search.
    queue: Option<Sender<SearchOrder>>,
}

#[derive(Debug)]
struct RunningSearch {
    job: SearchJob,
    /// Nothing comes from it if the search failed.
    answer: Receiver<SearchFinding>,
}

/// A search and where its answer goes.
type SearchOrder = (SearchJob, Sender<SearchFinding>);

impl Searches {
    /// Notes a search that a restart has still to make.
    pub(super) fn note(&mut self, job: SearchJob) {
        let (_, answer) = channel();
        self.asked
            .insert(job.benchmark.clone(), RunningSearch { job, answer });
    }

    /// Has the searches made that were only noted.
    pub(super) fn resume(&mut self) {
        let jobs: Vec<SearchJob> = self.jobs().cloned().collect();
        for job in jobs {
            self.start(job);
        }
    }

    /// What has been asked for and not been answered.
    pub(super) fn jobs(&self) -> impl Iterator<Item = &SearchJob> {
        self.asked.values().map(|asked| &asked.job)
    }

    /// The answer is known already.
    pub(super) fn forget(&mut self, benchmark: &BenchmarkId) {
        self.asked.remove(benchmark);
    }

    /// Goes on with the searches at these benchmarks alone.
    pub(super) fn retain(&mut self, goes_on: impl Fn(&BenchmarkId) -> bool) {
        self.asked.retain(|benchmark, _| goes_on(benchmark));
    }

    /// Has the search made as soon as a thread is free.
    pub(super) fn start(&mut self, job: SearchJob) {
        let (sender, answer) = channel();
        let queue = self.queue.get_or_insert_with(workers);
        // With no thread to take it, the answer goes nowhere.
        let _ = queue.send((job.clone(), sender));
        self.asked
            .insert(job.benchmark.clone(), RunningSearch { job, answer });
    }

    /// The answer that is due at a reading of `time`, if there is one by now.
    pub(super) fn answered(
        &mut self,
        benchmark: &BenchmarkId,
        time: Timestamp,
    ) -> Option<SearchFinding> {
        let asked = self.asked.get(benchmark)?;
        if asked.job.due > time {
            return None;
        }
        let finding = match asked.answer.try_recv() {
            Ok(finding) => finding,
            Err(TryRecvError::Disconnected) => asked.job.broken_off(),
            Err(TryRecvError::Empty) => return None,
        };
        self.asked.remove(benchmark);
        Some(finding)
    }

    /// The answer that is due at a reading of `time`; waits for it where the search is still at work.
    pub(super) fn due(
        &mut self,
        benchmark: &BenchmarkId,
        time: Timestamp,
    ) -> Option<SearchFinding> {
        if self.asked.get(benchmark)?.job.due > time {
            return None;
        }
        let RunningSearch { job, answer } = self.asked.remove(benchmark)?;
        Some(answer.recv().unwrap_or_else(|_| job.broken_off()))
    }
}

/// Threads that make searches until the queue is gone. They are not joined: whoever drops the queue no longer
/// wants the answers, and a stop must not wait for seconds of work that is thrown away.
fn workers() -> Sender<SearchOrder> {
    let (queue, orders) = channel();
    let orders = Arc::new(Mutex::new(orders));
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    for _ in 0..(cores - 1).clamp(1, MOST_WORKERS) {
        let orders = Arc::clone(&orders);
        let worker = std::thread::Builder::new().name("search".to_owned());
        let started = worker.spawn(move || work(&orders));
        if let Err(error) = started {
            tracing::error!(%error, "no thread to search on");
        }
    }
    queue
}

fn work(orders: &Mutex<Receiver<SearchOrder>>) {
    loop {
        let order = orders.lock().unwrap_or_else(PoisonError::into_inner).recv();
        let Ok((job, answer)) = order else { return };
        // A search that panics must not end the thread, on which the next searches depend.
        if let Ok(finding) = catch_unwind(AssertUnwindSafe(|| job.run())) {
            // Nobody waits any more when the site is closed.
            let _ = answer.send(finding);
        } else {
            tracing::error!(benchmark = %job.benchmark, "the search failed");
        }
    }
}
