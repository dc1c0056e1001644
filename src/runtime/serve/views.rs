//! What the page asks: the site, a benchmark, changes as they come, and orders to be given.

use super::threads::{ORDERS, READING, Threads};
use crate::monitor::Order;
use crate::reading::Timestamp;
use crate::runtime::view::{
    AlertView, Asked, BenchmarkView, OrderError, SiteReader, SiteView, TimeWindow,
};
use crate::store::{Heads, StoreError};
use axum::body::Body;
use axum::extract::{Query, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use futures_util::stream;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use std::convert::Infallible;
use std::fmt::Write as _;
use std::str::FromStr;
use std::sync::Arc;
use std::time::Duration;

/// How often the state is read for changes.
const POLL_INTERVAL: Duration = Duration::from_secs(1);
/// A stream ends after so many reads; its client asks again, from where it ended. So none holds a connection for
/// ever, and all end before [`super::Limits::request_time`].
const MOST_POLLS: u32 = 20;
/// Events sent in one round; after more of them the next round follows at once.
const MOST_SENT: usize = 500;

/// The routes.
pub(super) fn router(reader: Arc<SiteReader>) -> Router {
    Router::new()
        .route("/api/site", get(site))
        .route("/api/benchmark", get(benchmark))
        .route("/api/alert", get(alert))
        .route("/api/stream", get(changes))
        .route("/api/orders", post(ask))
        .with_state(reader)
}

/// What could not be answered.
#[derive(Debug)]
enum Failure {
    Store(StoreError),
    Order(OrderError),
    NoSuch(String),
    Broken(String),
}

impl From<StoreError> for Failure {
    fn from(error: StoreError) -> Self {
        Self::Store(error)
    }
}

impl IntoResponse for Failure {
    fn into_response(self) -> Response {
        let (status, text) = match self {
            Self::Store(error) => (StatusCode::SERVICE_UNAVAILABLE, error.to_string()),
            Self::Order(error) => {
                let status = match &error {
                    OrderError::NotHere => StatusCode::FORBIDDEN,
                    OrderError::Wrong(_) => StatusCode::UNPROCESSABLE_ENTITY,
                    OrderError::Store(_) => StatusCode::SERVICE_UNAVAILABLE,
                };
                (status, error.to_string())
            }
            Self::NoSuch(what) => (StatusCode::NOT_FOUND, format!("no {what}")),
            Self::Broken(what) => (StatusCode::INTERNAL_SERVER_ERROR, what),
        };
        (status, text + "\n").into_response()
    }
}

/// As [`Threads::run`], for what is asked of the state.
async fn blocking<T: Send + 'static>(
    threads: &'static Threads,
    work: impl FnOnce() -> Result<T, Failure> + Send + 'static,
) -> Result<T, Failure> {
    let done = threads.run(work).await;
    done.unwrap_or_else(|error| Err(Failure::Broken(error.to_string())))
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SiteMoment {
    #[serde(default, deserialize_with = "instant")]
    at: Option<Timestamp>,
}

/// What a query gives for a time.
fn instant<'de, D: Deserializer<'de>>(given: D) -> Result<Option<Timestamp>, D::Error> {
    parsed(given, "a time such as 2026-11-26T08:00:00Z")
}

/// What a query gives for a count.
fn count<'de, D: Deserializer<'de>>(given: D) -> Result<Option<usize>, D::Error> {
    parsed(given, "a whole number, 0 or more")
}

fn parsed<'de, D: Deserializer<'de>, T: FromStr>(
    given: D,
    expected: &str,
) -> Result<Option<T>, D::Error> {
    let text = String::deserialize(given)?;
    let found = text.parse().map(Some);
    found.map_err(|_| D::Error::custom(format!("found {text:?}, expected {expected}")))
}

async fn site(
    State(reader): State<Arc<SiteReader>>,
    Query(moment): Query<SiteMoment>,
) -> Result<Json<SiteView>, Failure> {
    blocking(&READING, move || Ok(reader.site(moment.at)?))
        .await
        .map(Json)
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct OfBenchmark {
    id: String,
    #[serde(default, deserialize_with = "instant")]
    at: Option<Timestamp>,
    #[serde(default, deserialize_with = "instant")]
    from: Option<Timestamp>,
    #[serde(default, deserialize_with = "instant")]
    to: Option<Timestamp>,
    #[serde(default, deserialize_with = "count")]
    buckets: Option<usize>,
}

async fn benchmark(
    State(reader): State<Arc<SiteReader>>,
    Query(asked): Query<OfBenchmark>,
) -> Result<Json<BenchmarkView>, Failure> {
    let window = TimeWindow {
        at: asked.at,
        from: asked.from,
        to: asked.to,
        buckets: asked.buckets,
    };
    let found = blocking(&READING, move || {
        let view = reader.benchmark(&asked.id, window)?;
        view.ok_or_else(|| Failure::NoSuch(format!("benchmark {:?}", asked.id)))
    });
    found.await.map(Json)
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct OfAlert {
    key: String,
}

async fn alert(
    State(reader): State<Arc<SiteReader>>,
    Query(asked): Query<OfAlert>,
) -> Result<Json<AlertView>, Failure> {
    let found = blocking(&READING, move || {
        let view = reader.alert(&asked.key)?;
        view.ok_or_else(|| Failure::NoSuch(format!("alert {:?}", asked.key)))
    });
    found.await.map(Json)
}

async fn ask(
    State(reader): State<Arc<SiteReader>>,
    Json(asked): Json<Asked>,
) -> Result<Json<Order>, Failure> {
    let taken = blocking(&ORDERS, move || reader.ask(&asked).map_err(Failure::Order));
    taken.await.map(Json)
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Since {
    since: Option<i64>,
}

/// Server-sent events: each event of the site with its number as id, and `progress` when anything was taken in.
async fn changes(State(reader): State<Arc<SiteReader>>, Query(since): Query<Since>) -> Response {
    let place = StreamPosition {
        reader,
        event: since.since,
        step: None,
        polls: 0,
        is_behind: false,
    };
    let parts = stream::unfold(place, |mut place| async move {
        if place.polls == MOST_POLLS {
            return None;
        }
        if place.polls > 0 && !place.is_behind {
            tokio::time::sleep(POLL_INTERVAL).await;
        }
        place.polls += 1;
        let (place, text) = blocking(&READING, move || {
            let text = place.look()?;
            Ok((place, text))
        })
        .await
        .ok()?;
        Some((Ok::<_, Infallible>(text), place))
    });
    let headers = [
        (header::CONTENT_TYPE, "text/event-stream"),
        (header::CACHE_CONTROL, "no-store"),
    ];
    (headers, Body::from_stream(parts)).into_response()
}

/// How far a stream has been sent.
struct StreamPosition {
    reader: Arc<SiteReader>,
    /// The last event; `None`: only what comes from now on is sent.
    event: Option<i64>,
    step: Option<i64>,
    polls: u32,
    /// Whether there is more to send than one round sends.
    is_behind: bool,
}

impl StreamPosition {
    /// What has changed since the last time; a comment where nothing has, so that a dead connection shows.
    fn look(&mut self) -> Result<String, StoreError> {
        let Heads { step, event } = self.reader.heads()?;
        let sent = self.event.unwrap_or(event);
        let mut fresh = if event > sent {
            self.reader.events_after(sent)?
        } else {
            Vec::new()
        };
        self.is_behind = fresh.len() > MOST_SENT;
        fresh.truncate(MOST_SENT);
        let mut text = String::new();
        for (number, body) in &fresh {
            let _ = write!(text, "id: {number}\nevent: change\ndata: {body}\n\n");
        }
        let sent = fresh.last().map_or(event, |(number, _)| *number);
        if self.step != Some(step) {
            let _ = write!(
                text,
                "id: {sent}\nevent: progress\ndata: {{\"step\":{step},\"event\":{event}}}\n\n"
            );
        }
        (self.event, self.step) = (Some(sent), Some(step));
        Ok(if text.is_empty() {
            ": nothing new\n\n".to_owned()
        } else {
            text
        })
    }
}
