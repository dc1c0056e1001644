//! The page's own files, embedded in the program: they hold nothing of the site and ask nothing of anybody else.

use axum::Router;
use axum::extract::Request;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use std::hash::{DefaultHasher, Hash, Hasher};

/// Nothing but our own files runs or is asked: no script in the page's text, no other site, no frame around it.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";

struct Asset {
    path: &'static str,
    kind: &'static str,
    text: &'static str,
}

const ASSETS: [Asset; 12] = [
    Asset {
        path: "/",
        kind: "text/html; charset=utf-8",
        text: include_str!("page/index.html"),
    },
    Asset {
        path: "/page/icon.svg",
        kind: "image/svg+xml",
        text: include_str!("page/icon.svg"),
    },
    Asset {
        path: "/page/page.css",
        kind: STYLE,
        text: include_str!("page/page.css"),
    },
    Asset {
        path: "/page/uplot.css",
        kind: STYLE,
        text: include_str!("page/uPlot.min.css"),
    },
    Asset {
        path: "/page/uplot.js",
        kind: SCRIPT,
        text: include_str!("page/uPlot.iife.min.js"),
    },
    Asset {
        path: "/page/uplot.license",
        kind: "text/plain; charset=utf-8",
        text: include_str!("page/uPlot.LICENSE"),
    },
    Asset {
        path: "/page/main.js",
        kind: SCRIPT,
        text: include_str!("page/main.js"),
    },
    Asset {
        path: "/page/ask.js",
        kind: SCRIPT,
        text: include_str!("page/ask.js"),
    },
    Asset {
        path: "/page/words.js",
        kind: SCRIPT,
        text: include_str!("page/words.js"),
    },
    Asset {
        path: "/page/site.js",
        kind: SCRIPT,
        text: include_str!("page/site.js"),
    },
    Asset {
        path: "/page/benchmark.js",
        kind: SCRIPT,
        text: include_str!("page/benchmark.js"),
    },
    Asset {
        path: "/page/charts.js",
        kind: SCRIPT,
        text: include_str!("page/charts.js"),
    },
];

/// The routes of all files.
pub(super) fn router() -> Router {
    ASSETS.iter().fold(Router::new(), |router, asset| {
        let answer = move |request: Request| async move { give(asset, request.headers()) };
        router.route(asset.path, get(answer))
    })
}

fn give(asset: &Asset, asked: &HeaderMap) -> Response {
    let tag = tag(asset.text);
    let is_known = asked
        .get(header::IF_NONE_MATCH)
        .is_some_and(|had| *had == tag);
    let body = if is_known { "" } else { asset.text };
    let status = if is_known {
        StatusCode::NOT_MODIFIED
    } else {
        StatusCode::OK
    };
    let headers = [
        (header::CONTENT_TYPE, HeaderValue::from_static(asset.kind)),
        (
            header::CONTENT_SECURITY_POLICY,
            HeaderValue::from_static(POLICY),
        ),
        (
            header::X_CONTENT_TYPE_OPTIONS,
            HeaderValue::from_static("nosniff"),
        ),
        (
            header::REFERRER_POLICY,
            HeaderValue::from_static("no-referrer"),
        ),
        // Asked for again each time, so that a new version of the daemon shows its own page.
        (header::CACHE_CONTROL, HeaderValue::from_static("no-cache")),
        (header::ETAG, tag),
    ];
    (status, headers, body).into_response()
}

fn tag(text: &str) -> HeaderValue {
    let mut hasher = DefaultHasher::new();
    text.hash(&mut hasher);
    let tag = format!("\"{:016x}\"", hasher.finish());
    HeaderValue::from_str(&tag).unwrap_or(HeaderValue::from_static("\"\""))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_together_is_under_200_kilobytes_and_no_script_stands_in_the_text() {
        let size: usize = ASSETS.iter().map(|asset| asset.text.len()).sum();
        assert!(size < 200_000, "{size} bytes");
        let page = ASSETS[0].text;
        for tag in page.split("<script").skip(1) {
            let (attributes, rest) = tag.split_once('>').unwrap();
            assert!(attributes.contains(" src=\"/page/"), "{attributes}");
            assert!(rest.starts_with("</script>"), "{rest}");
        }
        assert!(!page.contains("style=") && !page.contains(" onclick"));
    }

    #[test]
    fn nothing_of_another_site_is_asked_for() {
        for asset in ASSETS.iter().filter(|asset| asset.path != "/page/uplot.js") {
            // The name of the SVG namespace is no address.
            let text = asset.text.replace("http://www.w3.org/2000/svg", "");
            assert!(
                !text.contains("http:") && !text.contains("https:"),
                "{}",
                asset.path
            );
        }
    }
}
