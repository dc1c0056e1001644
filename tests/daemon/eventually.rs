//! Waiting for what a process beside the test does.

use std::time::Duration;

/// Waits until `claim` holds; how long that takes is not what is tested.
pub(crate) async fn eventually(what: &str, mut claim: impl FnMut() -> bool) {
    for _ in 0..3000 {
        if claim() {
            return;
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    panic!("never: {what}");
}
