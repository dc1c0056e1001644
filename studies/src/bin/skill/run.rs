//! Every method at every look of every series, over a few threads.

use crate::corpus::Subjects;
use crate::record::{Record, SeriesForecasts};
use anyhow::Result;
use indicatif::{ProgressBar, ProgressStyle};
use slipwatch::score::Method;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

/// What was said of each series, in the order of the series whatever the threads.
pub(crate) fn run(
    subjects: &Subjects,
    methods: &[&Method],
    threads: usize,
) -> Result<Vec<SeriesForecasts>> {
    let bar = bar(subjects.count());
    let next = AtomicU64::new(0);
    let done = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        let work = || {
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                if index >= subjects.count() {
                    return;
                }
                let series = forecasts_of(subjects, index, methods);
                bar.inc(1);
                if let Ok(mut done) = done.lock() {
                    done.push((index, series));
                }
            }
        };
        let workers: Vec<_> = (0..threads.max(1)).map(|_| scope.spawn(work)).collect();
        for worker in workers {
            worker
                .join()
                .map_err(|_| anyhow::anyhow!("a worker panicked"))?;
        }
        anyhow::Ok(())
    })?;
    bar.finish_and_clear();
    let mut done = done
        .into_inner()
        .map_err(|_| anyhow::anyhow!("a worker panicked"))?;
    done.sort_by_key(|(index, _)| *index);
    Ok(done.into_iter().map(|(_, series)| series).collect())
}

fn forecasts_of(subjects: &Subjects, index: u64, methods: &[&Method]) -> SeriesForecasts {
    let subject = subjects.at(index);
    let mut records = Vec::new();
    for look in subject.looks() {
        let Some(known) = subject.history.at(look.at_days) else {
            continue;
        };
        let said = methods
            .iter()
            .map(|method| Record::of(&subject, &look, &known, method));
        records.extend(said);
    }
    SeriesForecasts {
        name: subject.name,
        kind: subject.kind,
        family: subject.family,
        epoch: subject.epoch,
        records,
    }
}

/// The bar hides itself where stderr is no terminal.
fn bar(count: u64) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len} series, {elapsed}").ok();
    let bar = ProgressBar::new(count);
    style.map_or(bar.clone(), |style| bar.with_style(style))
}
