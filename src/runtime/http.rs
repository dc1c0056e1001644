//! One request to an address, over TLS where it says so.

use super::connect::connect;
use super::tls;
use http_body_util::Full;
use hyper::body::Bytes;
use hyper::client::conn::http1;
use hyper::http::request;
use hyper::{Method, Request, Uri, header};
use hyper_util::rt::TokioIo;
use std::path::Path;
use tokio::io::{AsyncRead, AsyncWrite};

/// Who calls.
const AGENT: &str = concat!("slipwatch/", env!("CARGO_PKG_VERSION"));

/// What each request to this address begins with.
pub(super) fn head(method: Method, address: &Uri) -> request::Builder {
    let path = address.path_and_query().map_or("/", |path| path.as_str());
    let host = address.authority().map_or("", |one| one.as_str());
    Request::builder()
        .method(method)
        .uri(path)
        .header(header::HOST, host)
        .header(header::USER_AGENT, AGENT)
        .header(header::CONNECTION, "close")
}

/// The status that the receiver answers with. A redirection is not followed: what it leads to nobody has allowed.
pub(super) async fn answer(
    address: &Uri,
    ca_file: Option<&Path>,
    request: Request<Full<Bytes>>,
) -> Result<u16, String> {
    let host = address.host().unwrap_or_default();
    let host = host.trim_start_matches('[').trim_end_matches(']');
    let is_secured = address.scheme_str() == Some("https");
    let port = address
        .port_u16()
        .unwrap_or(if is_secured { 443 } else { 80 });
    let stream = connect(host, port).await?;
    if is_secured {
        let secured = tls::secured(stream, host, ca_file).await?;
        exchange(secured, request).await
    } else {
        exchange(stream, request).await
    }
    .map_err(|error| error.to_string())
}

async fn exchange<S: AsyncRead + AsyncWrite + Unpin + Send + 'static>(
    stream: S,
    request: Request<Full<Bytes>>,
) -> hyper::Result<u16> {
    let (mut sender, connection) = http1::handshake(TokioIo::new(stream)).await?;
    let exchange = async {
        let response = sender.send_request(request).await;
        response.map(|response| response.status().as_u16())
    };
    let mut exchange = std::pin::pin!(exchange);
    // The connection does the work; it ends with this call.
    tokio::select! {
        status = &mut exchange => status,
        ended = connection => match ended {
            // The answer may have come with the end.
            Ok(()) => exchange.await,
            Err(error) => Err(error),
        },
    }
}
