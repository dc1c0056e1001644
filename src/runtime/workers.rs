//! Tasks on all cores that this process may use.

use crate::monitor::{Task, Workers};
use std::num::NonZero;
use std::sync::{Mutex, PoisonError};
use std::thread;

/// All cores.
#[derive(Debug, Clone, Copy)]
pub(super) struct AllCores;

impl Workers for AllCores {
    fn run(&self, tasks: Vec<Task<'_>>) {
        let cores = thread::available_parallelism().map_or(1, NonZero::get);
        let helpers = cores.min(tasks.len()).saturating_sub(1);
        let tasks = Mutex::new(tasks.into_iter());
        let next = || tasks.lock().unwrap_or_else(PoisonError::into_inner).next();
        let work = || {
            while let Some(task) = next() {
                task();
            }
        };
        thread::scope(|scope| {
            for _ in 0..helpers {
                // Where no thread can be had this one does the work.
                drop(thread::Builder::new().spawn_scoped(scope, work));
            }
            work();
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_task_is_done_once() {
        let mut done = vec![0; 1000];
        let tasks = done
            .iter_mut()
            .map(|one| -> Task<'_> { Box::new(|| *one += 1) });
        AllCores.run(tasks.collect());
        assert!(done.iter().all(|one| *one == 1));
        AllCores.run(Vec::new());
    }
}
