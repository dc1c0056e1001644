//! What is answered to which request, and to whom.

use super::caller::{NO_SUCH_PAGE, OwnNames, SharedToken, is_this_machine};
use super::threads::READING;
use super::{ListenOptions, ServedState, acknowledge, metrics, page, views};
use crate::runtime::vitals::{Health, Vitals, VitalsPoint};
use axum::extract::{DefaultBodyLimit, Query, Request, State};
use axum::http::{HeaderValue, Method, StatusCode, header};
use axum::middleware::{Next, from_fn, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use axum::{Json, Router};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::{Debug, Write as _};
use std::sync::Arc;
use std::time::Duration;

/// Longest body of a request, bytes.
const LONGEST_BODY: usize = 64 * 1024;
/// Most events in one answer, and how many there are where nothing is asked for.
const MOST_EVENTS: usize = 1000;
/// The header that says where the next page starts.
const NEXT: &str = "slipwatch-next";

/// Past events, oldest first.
pub trait Archive: Debug + Send + Sync {
    /// At most `limit` events after the place that `since` names, which an earlier page gave; from
    /// the beginning without one. May block.
    ///
    /// # Errors
    /// [`ArchiveError`].
    fn events(&self, since: Option<&str>, limit: usize) -> Result<Page, ArchiveError>;
}

/// Some events.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Page {
    /// One JSON object a line, each with its newline.
    pub lines: String,
    /// What to ask for as `since` next.
    pub next: String,
}

/// Why no events could be given.
#[derive(Debug, thiserror::Error)]
pub enum ArchiveError {
    /// `since` is none that we gave.
    #[error("since={0} names no place in the log")]
    NoSuchPlace(String),
    /// The log cannot be read.
    #[error("the events cannot be read: {0}")]
    Unreadable(String),
}

impl IntoResponse for ArchiveError {
    fn into_response(self) -> Response {
        let status = match self {
            Self::NoSuchPlace(_) => StatusCode::BAD_REQUEST,
            Self::Unreadable(_) => StatusCode::SERVICE_UNAVAILABLE,
        };
        (status, format!("{self}\n")).into_response()
    }
}

/// All routes; every one but `/healthz` and the page's own files, which say nothing of the site, asks for the token,
/// where there is one. Whoever follows the link in a message knows its signature instead.
pub(super) fn router(
    options: &ListenOptions,
    token: SharedToken,
    vitals: Arc<Vitals>,
    served: ServedState,
) -> Router {
    let mut guarded = Router::new()
        .route("/readyz", get(ready))
        .route("/metrics", get(expose))
        .route("/api/status", get(status))
        .with_state(Arc::clone(&vitals));
    if let Some(archive) = served.archive {
        guarded = guarded.merge(
            Router::new()
                .route("/api/events", get(events))
                .with_state(archive),
        );
    }
    let mut open = Router::new()
        .route("/healthz", get(healthy))
        .with_state((vitals, options.limits.turn_time));
    let names = Arc::new(OwnNames::new(served.reader.clone()));
    if let Some(reader) = served.reader {
        open = open.merge(acknowledge::router(Arc::clone(&reader), Arc::clone(&names)));
        guarded = guarded.merge(views::router(reader));
        open = open.merge(page::router());
    }
    guarded
        .fallback(|| async { (StatusCode::NOT_FOUND, NO_SUCH_PAGE) })
        .layer(from_fn_with_state((token, names), admit))
        .merge(open)
        .layer(DefaultBodyLimit::max(LONGEST_BODY))
        .layer(from_fn(refuse_long_bodies))
}

/// Who may ask: the token, where there is one, and who may know it.
type Admission = (SharedToken, Arc<OwnNames>);

/// A caller without the token, a page of another site, and an order under a name that is not ours are refused.
async fn admit(State((token, names)): State<Admission>, request: Request, next: Next) -> Response {
    let headers = request.headers();
    let token = token.in_force();
    let is_admitted = match &token {
        Some(token) => bearer(&request).is_some_and(|given| token.is(given)),
        None => is_named_as_this_machine(&request),
    };
    if !is_admitted && token.is_none() {
        return (StatusCode::FORBIDDEN, "ask for localhost\n").into_response();
    }
    if !is_admitted {
        let challenge = [(header::WWW_AUTHENTICATE, "Bearer")];
        return (StatusCode::UNAUTHORIZED, challenge, "a token is needed\n").into_response();
    }
    if !names.is_our_page(headers) {
        return (StatusCode::FORBIDDEN, FOREIGN_PAGE).into_response();
    }
    if request.method() != Method::GET && !names.is_our_host(headers) {
        return (StatusCode::FORBIDDEN, FOREIGN_HOST).into_response();
    }
    next.run(request).await
}

const FOREIGN_PAGE: &str = "a page of another site asks (Origin): only the daemon's own page may\n";
const FOREIGN_HOST: &str =
    "an order is taken under this machine's name or address, or that of site.public_url (Host)\n";

fn bearer(request: &Request) -> Option<&[u8]> {
    let value = request.headers().get(header::AUTHORIZATION)?.as_bytes();
    let (scheme, given) = value.split_at_checked(7)?;
    scheme.eq_ignore_ascii_case(b"bearer ").then_some(given)
}

/// Without a token only loopback is listened on, and a page in a browser there that had its own
/// name point to it would ask under that name.
fn is_named_as_this_machine(request: &Request) -> bool {
    let Some(host) = request.headers().get(header::HOST) else {
        return true;
    };
    is_this_machine(host.to_str().unwrap_or_default())
}

async fn refuse_long_bodies(request: Request, next: Next) -> Response {
    let length = request.headers().get(header::CONTENT_LENGTH);
    let length = length.and_then(|length| length.to_str().ok()?.parse::<usize>().ok());
    if length.is_some_and(|length| length > LONGEST_BODY) {
        return (StatusCode::PAYLOAD_TOO_LARGE, "the body is too long\n").into_response();
    }
    next.run(request).await
}

async fn healthy(State((vitals, longest)): State<(Arc<Vitals>, Duration)>) -> (StatusCode, String) {
    let since = vitals.since_turn();
    if since <= longest {
        (StatusCode::OK, "ok\n".to_owned())
    } else {
        let text = format!("the work loop has not turned for {since:.0?}\n");
        (StatusCode::SERVICE_UNAVAILABLE, text)
    }
}

async fn ready(State(vitals): State<Arc<Vitals>>) -> (StatusCode, String) {
    let health = vitals.health();
    let refused = refused(&health);
    match health.not_ready() {
        Some(why) => (StatusCode::SERVICE_UNAVAILABLE, format!("{why}\n{refused}")),
        None => (StatusCode::OK, format!("ready\n{refused}")),
    }
}

/// A line for each source of which something could not be used.
fn refused(health: &Health) -> String {
    let mut lines = String::new();
    for (source, count) in &health.quarantined {
        // Writing to a string cannot fail.
        let _ = writeln!(lines, "source {source}: could not be used: {count}");
    }
    lines
}

async fn expose(State(vitals): State<Arc<Vitals>>) -> Response {
    match metrics::text(vitals) {
        Ok(text) => ([(header::CONTENT_TYPE, metrics::CONTENT_TYPE)], text).into_response(),
        Err(error) => {
            tracing::error!(%error, "metrics cannot be written");
            StatusCode::INTERNAL_SERVER_ERROR.into_response()
        }
    }
}

/// What `/api/status` answers: how the daemon does.
#[derive(Debug, JsonSchema, Serialize)]
pub struct DaemonStatus {
    /// The daemon's version.
    version: &'static str,
    /// Since its start.
    uptime_seconds: u64,
    #[serde(flatten)]
    health: Health,
    /// How many benchmarks stand at each level.
    levels: BTreeMap<&'static str, usize>,
    /// Single figures, of at most 2,000 benchmarks.
    benchmarks: BTreeMap<String, VitalsPoint>,
}

async fn status(State(vitals): State<Arc<Vitals>>) -> Json<DaemonStatus> {
    let levels = vitals.levels().map(|(level, count)| (level.name(), count));
    let points = vitals.points().into_iter();
    Json(DaemonStatus {
        version: env!("CARGO_PKG_VERSION"),
        uptime_seconds: vitals.uptime().as_secs(),
        health: vitals.health(),
        levels: levels.into(),
        benchmarks: points.map(|(id, point)| (id.to_string(), point)).collect(),
    })
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct EventRange {
    since: Option<String>,
    limit: Option<usize>,
}

async fn events(
    State(archive): State<Arc<dyn Archive>>,
    Query(range): Query<EventRange>,
) -> Result<Response, ArchiveError> {
    let limit = range.limit.unwrap_or(MOST_EVENTS).min(MOST_EVENTS);
    let page = READING
        .run(move || archive.events(range.since.as_deref(), limit))
        .await
        .map_err(|error| ArchiveError::Unreadable(error.to_string()))??;
    let mut response = page.lines.into_response();
    let kind = HeaderValue::from_static("application/x-ndjson");
    response.headers_mut().insert(header::CONTENT_TYPE, kind);
    if let Ok(next) = HeaderValue::from_str(&page.next) {
        response.headers_mut().insert(NEXT, next);
    }
    Ok(response)
}
