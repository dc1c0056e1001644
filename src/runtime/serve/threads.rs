//! How many requests read or write the state at once: files are read by threads of the same pool, and a red does not wait for a page.

use tokio::sync::Semaphore;
use tokio::task::JoinError;

/// Requests that read the state.
pub(super) static READING: Threads = Threads(Semaphore::const_new(4));
/// Requests by which people acknowledge and order, which wait for no page either.
pub(super) static ORDERS: Threads = Threads(Semaphore::const_new(2));

/// Threads that may be in use at once.
#[derive(Debug)]
pub(super) struct Threads(Semaphore);

impl Threads {
    /// Does `work`, which may wait for a disk, on a thread when one is free. A request whose caller has gone before that is dropped.
    ///
    /// # Errors
    /// When the work breaks off.
    pub(super) async fn run<T: Send + 'static>(
        &'static self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, JoinError> {
        // It is never closed. What has begun is done, and holds its place until then, whether or not anybody waits for it.
        let place = self.0.acquire().await.ok();
        let work = move || {
            let _place = place;
            work()
        };
        tokio::task::spawn_blocking(work).await
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::Duration;
    use tokio::task::JoinSet;

    static FEW: Threads = Threads(Semaphore::const_new(2));

    #[tokio::test(flavor = "multi_thread")]
    async fn no_more_run_at_once_and_what_nobody_waits_for_does_not_begin() {
        static RUNNING: AtomicUsize = AtomicUsize::new(0);
        static MOST: AtomicUsize = AtomicUsize::new(0);
        static BEGUN: AtomicUsize = AtomicUsize::new(0);
        let mut requests = JoinSet::new();
        for _ in 0..100 {
            requests.spawn(FEW.run(|| {
                BEGUN.fetch_add(1, Ordering::SeqCst);
                MOST.fetch_max(RUNNING.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
                std::thread::sleep(Duration::from_millis(100));
                RUNNING.fetch_sub(1, Ordering::SeqCst);
            }));
        }
        requests.join_next().await.unwrap().unwrap().unwrap();
        requests.shutdown().await;
        let begun = BEGUN.load(Ordering::SeqCst);
        assert!(begun < 50, "{begun}");
        FEW.run(|| ()).await.unwrap();
        assert_eq!(MOST.load(Ordering::SeqCst), 2);
    }
}
