//! The page behind the link in an alert's message: it shows the alert, and its button acknowledges it. Plain HTML, no script.

use super::caller::{NO_SUCH_PAGE, OwnNames};
use super::threads::ORDERS;
use crate::reading::{clock, local};
use crate::runtime::link::AskedLink;
use crate::runtime::view::{AlertLife, AlertView, LinkPage, LinkTarget, SiteReader};
use crate::store::StoreError;
use axum::Router;
use axum::extract::rejection::QueryRejection;
use axum::extract::{Form, Query, Request, State};
use axum::http::{StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use jiff::tz::TimeZone;
use serde::Deserialize;
use std::fmt::Write as _;
use std::sync::Arc;

/// Nothing runs and nothing is asked; the form goes to this page alone.
const POLICY: &str =
    "default-src 'none'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'";

/// The routes; there is no such page while messages have no links.
pub(super) fn router(reader: Arc<SiteReader>, names: Arc<OwnNames>) -> Router {
    Router::new()
        .route("/acknowledge", get(show).post(acknowledge))
        .with_state(Arc::clone(&reader))
        .layer(from_fn_with_state((reader, names), admit))
}

type LinkAdmission = (Arc<SiteReader>, Arc<OwnNames>);

/// Under our own names only, and no form of a foreign page.
async fn admit(
    State((reader, names)): State<LinkAdmission>,
    request: Request,
    next: Next,
) -> Response {
    let headers = request.headers();
    if reader.links().is_none() {
        (StatusCode::NOT_FOUND, NO_SUCH_PAGE).into_response()
    } else if names.is_our_host(headers) && names.is_our_page(headers) {
        next.run(request).await
    } else {
        (StatusCode::FORBIDDEN, "ask under the address of the link\n").into_response()
    }
}

/// What was cut short on the way is no link either.
type LinkQuery = Result<Query<AskedLink>, QueryRejection>;

async fn show(State(reader): State<Arc<SiteReader>>, asked: LinkQuery) -> Response {
    answer(reader, asked, None).await
}

#[derive(Debug, Deserialize)]
struct Filled {
    #[serde(default)]
    by: String,
}

async fn acknowledge(
    State(reader): State<Arc<SiteReader>>,
    asked: LinkQuery,
    Form(Filled { by }): Form<Filled>,
) -> Response {
    answer(reader, asked, Some(by)).await
}

/// The state is asked on a thread that may wait. With a name, which may be empty, the link is used.
async fn answer(reader: Arc<SiteReader>, asked: LinkQuery, by: Option<String>) -> Response {
    let zone = reader.zone();
    let work = move || {
        let Ok(Query(asked)) = asked else {
            return Ok(LinkPage::Forged);
        };
        by.map_or_else(|| reader.link(&asked), |by| reader.acknowledge(&asked, &by))
    };
    let found = ORDERS.run(work).await;
    let found = found.unwrap_or_else(|error| Err(StoreError::Unreadable(error.to_string())));
    let (status, title, body) = match found {
        Ok(page) => page_of(&page, &zone),
        Err(error) => {
            tracing::error!(%error, "a link cannot be answered");
            let text = "<p>The daemon cannot use its state. Nothing was acknowledged: \
                        call the people on duty.</p>";
            (
                StatusCode::SERVICE_UNAVAILABLE,
                "Not possible now",
                text.to_owned(),
            )
        }
    };
    let headers = [
        (header::CONTENT_TYPE, "text/html; charset=utf-8"),
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        // Of another policy a browser would not say which page the form stands on.
        (header::REFERRER_POLICY, "same-origin"),
        (header::CACHE_CONTROL, "no-store"),
    ];
    (status, headers, document(title, &body)).into_response()
}

fn document(title: &str, body: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"robots\" content=\"noindex\">\n<title>{title}</title></head>\n\
         <body><main><h1>{title}</h1>\n{body}\n</main></body></html>\n"
    )
}

/// The status, the title and the rest of a page.
type PageAnswer = (StatusCode, &'static str, String);

const UNCHANGED: &str = "Nothing was changed.";

/// A form without an address goes to that of its page, so that a proxy may put any path before ours.
const FORM: &str = "<form method=\"post\">\n<p><label>Your name, if you like: <input name=\"by\" maxlength=\"100\" \
                    autocomplete=\"name\"></label></p>\n<p><button>Acknowledge</button></p>\n</form>";

fn page_of(page: &LinkPage, zone: &TimeZone) -> PageAnswer {
    match page {
        LinkPage::Open(LinkTarget::Alert(alert)) => {
            let text = described(alert, zone) + FORM;
            (StatusCode::OK, "Acknowledge this alert?", text)
        }
        LinkPage::Open(LinkTarget::Drill(status)) => {
            let status = status.name();
            let text = format!("<p>{status}: this is a drill. Nothing has happened.</p>{FORM}");
            (StatusCode::OK, "Acknowledge this drill?", text)
        }
        LinkPage::Taken(LinkTarget::Alert(alert)) => {
            let text = "<p>It is not tried any further and not escalated. It stays in force; a higher level is a new \
                        alert.</p>"
                .to_owned()
                + &described(alert, zone);
            (StatusCode::OK, "The alert is acknowledged", text)
        }
        LinkPage::Taken(LinkTarget::Drill(status)) => {
            let text = format!("<p>{}: nothing has happened.</p>", status.name());
            (StatusCode::OK, "The drill is acknowledged", text)
        }
        LinkPage::Used(alert) => {
            let why = "It can be used once.";
            gone("This link has been used", why, alert.as_deref(), zone)
        }
        LinkPage::Seen(alert) => gone("This alert has been acknowledged", "", Some(alert), zone),
        LinkPage::Over(alert) => over(alert, zone),
        LinkPage::Expired(until) => {
            let until = clock(*until, zone);
            let text = format!("<p>It was good until {until}. {UNCHANGED}</p>");
            (StatusCode::GONE, "This link has expired", text)
        }
        LinkPage::Forged => {
            let text = "It was cut short or changed on the way, or comes from elsewhere.";
            let text = format!("<p>{text} {UNCHANGED}</p>");
            (StatusCode::FORBIDDEN, "This link is not valid", text)
        }
        LinkPage::Foreign => {
            let text = format!("<p>The state here knows no such alert. {UNCHANGED}</p>");
            (StatusCode::NOT_FOUND, "There is no such alert", text)
        }
        LinkPage::WrongName => {
            let text = format!("<p>Write one line of 100 bytes at most. {UNCHANGED}</p>");
            let title = "This name cannot be kept";
            (StatusCode::UNPROCESSABLE_ENTITY, title, text)
        }
    }
}

/// What there is no more to acknowledge.
fn gone(title: &'static str, why: &str, alert: Option<&AlertView>, zone: &TimeZone) -> PageAnswer {
    let described = alert.map_or_else(String::new, |alert| described(alert, zone));
    let text = format!("<p>{why} {UNCHANGED}</p>{described}");
    (StatusCode::GONE, title, text)
}

fn over(alert: &AlertView, zone: &TimeZone) -> PageAnswer {
    let why = match alert.state {
        AlertLife::Superseded => {
            "A higher level has taken its place; that has a message of its own."
        }
        AlertLife::Resolved | AlertLife::Firing => "It has ended. That is no all-clear.",
    };
    gone("This alert is over", why, Some(alert), zone)
}

/// The alert for people, and who has acknowledged it.
fn described(alert: &AlertView, zone: &TimeZone) -> String {
    let place = alert.benchmark.as_ref().map_or_else(
        || "the whole site".to_owned(),
        |one| format!("benchmark {one}"),
    );
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = write!(
        text,
        "<p><strong>{}: {}, {}</strong>, since {}</p>\n<p>{}</p>\n<p>{}</p>\n",
        escaped(&alert.site),
        alert.level,
        escaped(&place),
        clock(alert.since, zone),
        escaped(&local(&alert.text, zone)),
        escaped(alert.recommended),
    );
    if let Some((at, by)) = alert.acknowledged() {
        let at = at.map_or_else(String::new, |at| format!(" at {}", clock(at, zone)));
        let by = by.map_or_else(String::new, |by| format!(" by {}", escaped(by)));
        let _ = writeln!(text, "<p>Acknowledged{at}{by}.</p>");
    }
    text
}

/// Text as HTML takes it between tags.
fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;");
    text.replace('>', "&gt;").replace('"', "&quot;")
}
