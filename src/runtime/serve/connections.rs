//! Takes connections, a bounded number for a bounded time, one request each.

use super::Limits;
use crate::runtime::shutdown::Shutdown;
use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::collections::VecDeque;
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};
use tokio::task::{AbortHandle, JoinSet};

/// Longest request line with its headers, bytes.
const LONGEST_HEAD: usize = 16 * 1024;
/// Most headers of a request.
const MOST_HEADERS: usize = 64;
/// After a connection could not be taken, as when there are no more file descriptors.
const RETRY_AFTER: Duration = Duration::from_millis(200);

/// Serves until `stopped`; open connections are then dropped. Where there are as many as may be, one more takes the
/// place of the oldest: whoever opens many and asks nothing keeps nobody else waiting.
pub(super) async fn serve(
    listener: TcpListener,
    router: Router,
    limits: Limits,
    mut stopped: Shutdown,
) {
    let mut open = JoinSet::new();
    let mut oldest: VecDeque<AbortHandle> = VecDeque::new();
    loop {
        // Whatever has ended is removed, or the set would grow for ever.
        while open.try_join_next().is_some() {}
        let accepted = tokio::select! {
            () = stopped.requested() => return,
            accepted = listener.accept() => accepted,
        };
        match accepted {
            Ok((stream, _)) => {
                oldest.retain(|one| !one.is_finished());
                if oldest.len() >= limits.connections
                    && let Some(first) = oldest.pop_front()
                {
                    first.abort();
                }
                let router = router.clone();
                oldest.push_back(open.spawn(answer(stream, router, limits)));
            }
            Err(error) => {
                tracing::warn!(%error, "a connection could not be taken");
                tokio::time::sleep(RETRY_AFTER).await;
            }
        }
    }
}

async fn answer(stream: TcpStream, router: Router, limits: Limits) {
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(limits.head_time)
        .max_buf_size(LONGEST_HEAD)
        .max_headers(MOST_HEADERS)
        // A caller that keeps its connection would keep a slot.
        .keep_alive(false)
        .serve_connection(TokioIo::new(stream), TowerToHyperService::new(router));
    match tokio::time::timeout(limits.request_time, connection).await {
        Ok(Ok(())) => {}
        Ok(Err(error)) => tracing::debug!(%error, "a request broke off"),
        Err(_elapsed) => tracing::debug!("a request took too long"),
    }
}
