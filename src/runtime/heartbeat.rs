//! Reports to others that the site is watched, for as long as it is: their alarm is that nothing comes.

use super::http;
use super::log::is_logged;
use super::serve::Limits;
use super::shutdown::Shutdown;
use super::vitals::Vitals;
use crate::config::Heartbeat;
use http_body_util::Full;
use hyper::Method;
use hyper::body::Bytes;
use std::sync::Arc;
use std::time::Duration;
use tokio::task::JoinSet;

/// By when it must be answered.
const ANSWER: Duration = Duration::from_secs(10);

/// Begins to report to each; ends with `shutdown`, or when the tasks are dropped.
pub(super) fn start(
    heartbeats: &[Heartbeat],
    vitals: &Arc<Vitals>,
    shutdown: &Shutdown,
) -> JoinSet<()> {
    let mut tasks = JoinSet::new();
    for heartbeat in heartbeats {
        tasks.spawn(follow(
            heartbeat.clone(),
            Arc::clone(vitals),
            shutdown.clone(),
        ));
    }
    tasks
}

async fn follow(heartbeat: Heartbeat, vitals: Arc<Vitals>, mut shutdown: Shutdown) {
    let mut failed = 0_u64;
    loop {
        let watches = vitals.since_turn() <= Limits::default().turn_time
            && vitals.health().not_ready().is_none();
        if watches {
            let sent = tokio::select! {
                sent = send(&heartbeat) => sent,
                () = shutdown.requested() => return,
            };
            let is_taken = sent.is_ok();
            match sent {
                Ok(()) => failed = 0,
                Err(error) => {
                    failed += 1;
                    if is_logged(failed) {
                        let address = heartbeat.address.to_string();
                        tracing::warn!(address, error, failed, "a heartbeat has not been taken");
                    }
                }
            }
            vitals.update(|health| {
                health.heartbeats += u64::from(is_taken);
                health.heartbeats_failed += u64::from(!is_taken);
            });
        }
        // While it does not watch, it looks more often: the others are to know soon that it watches again.
        let wait = if watches {
            heartbeat.every
        } else {
            heartbeat.every.min(Duration::from_secs(1))
        };
        tokio::select! {
            () = tokio::time::sleep(wait) => {}
            () = shutdown.requested() => return,
        }
    }
}

async fn send(heartbeat: &Heartbeat) -> Result<(), String> {
    let request = http::head(Method::GET, &heartbeat.address).body(Full::new(Bytes::new()));
    let request = request.map_err(|error| error.to_string())?;
    let answer = http::answer(&heartbeat.address, heartbeat.ca_file.as_deref(), request);
    match tokio::time::timeout(ANSWER, answer).await {
        Ok(Ok(status)) if (200..300).contains(&status) => Ok(()),
        Ok(Ok(status)) => Err(format!("answered with status {status}")),
        Ok(Err(why)) => Err(why),
        Err(_elapsed) => Err(format!("no answer within {ANSWER:?}")),
    }
}
