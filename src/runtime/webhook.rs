//! Sends one alert to an address once: POST of what a hook gets on stdin, signed as Standard Webhooks asks.

use super::clock;
use super::hook::{Alert, Outcome, state_name};
use super::tls;
use crate::config::{Secret, Webhook};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use hmac::{Hmac, KeyInit, Mac};
use http_body_util::Full;
use hyper::body::Bytes;
use hyper::client::conn::http1;
use hyper::{Request, header};
use hyper_util::rt::TokioIo;
use sha2::Sha256;
use std::fmt::Write as _;
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpStream;

/// Who calls.
const AGENT: &str = concat!("slipwatch/", env!("CARGO_PKG_VERSION"));

/// What distinguishes a message from every other, the same at each attempt: one key fires and is resolved. It may hold no full
/// stop, which parts what is signed, and nothing that a header does not take.
fn id(alert: &Alert) -> String {
    let plain = format!("{}/{}/{}", alert.key, alert.level, state_name(alert.state));
    let mut id = String::new();
    for byte in plain.bytes() {
        if byte.is_ascii_graphic() && !matches!(byte, b'.' | b'%') {
            id.push(char::from(byte));
        } else {
            // Writing to a string cannot fail.
            let _ = write!(id, "%{byte:02X}");
        }
    }
    id
}

/// The signature of a message; `None` where the key cannot be used.
fn signature(key: &[u8], (id, timestamp): (&str, i64), body: &[u8]) -> Option<String> {
    let mut mac = Hmac::<Sha256>::new_from_slice(key).ok()?;
    mac.update(format!("{id}.{timestamp}.").as_bytes());
    mac.update(body);
    let sum = mac.finalize().into_bytes();
    Some(format!("v1,{}", STANDARD.encode(sum)))
}

/// Sends `alert`, whose JSON is `body`, within `limit`.
pub(super) async fn send(
    webhook: &Webhook,
    alert: &Alert,
    (body, limit): (Vec<u8>, Duration),
) -> Outcome {
    let request = match request(webhook, alert, body) {
        Ok(request) => request,
        Err(why) => return Outcome::NotStarted(why),
    };
    match tokio::time::timeout(limit, answer(webhook, request)).await {
        Ok(Ok(status)) if (200..300).contains(&status) => Outcome::Done,
        Ok(Ok(status)) => Outcome::Refused(status),
        Ok(Err(why)) => Outcome::NotStarted(why),
        Err(_elapsed) => Outcome::TimedOut,
    }
}

/// The secret is read each time, so that another one holds from the next attempt on.
fn request(
    webhook: &Webhook,
    alert: &Alert,
    body: Vec<u8>,
) -> Result<Request<Full<Bytes>>, String> {
    let (id, timestamp) = (id(alert), clock::now().as_second());
    let signed = webhook.secret_file.as_deref().map(|file| {
        let key = Secret::read(file).map_err(|error| error.to_string())?;
        signature(key.bytes(), (&id, timestamp), &body)
            .ok_or_else(|| "the secret is unusable".to_owned())
    });
    let signed = signed.transpose()?;
    let address = &webhook.address;
    let path = address.path_and_query().map_or("/", |path| path.as_str());
    let host = address.authority().map_or("", |one| one.as_str());
    let mut request = Request::post(path);
    if let Some(signature) = signed {
        request = request.header("webhook-signature", signature);
    }
    request
        .header(header::HOST, host)
        .header(header::USER_AGENT, AGENT)
        .header(header::CONTENT_TYPE, "application/json")
        .header(header::CONNECTION, "close")
        .header("webhook-id", id)
        .header("webhook-timestamp", timestamp)
        .body(Full::new(Bytes::from(body)))
        .map_err(|error| error.to_string())
}

/// The status that the receiver answers with. A redirection is not followed: what it leads to nobody has allowed.
async fn answer(webhook: &Webhook, request: Request<Full<Bytes>>) -> Result<u16, String> {
    let address = &webhook.address;
    let host = address.host().unwrap_or_default();
    let host = host.trim_start_matches('[').trim_end_matches(']');
    let is_secured = address.scheme_str() == Some("https");
    let port = address
        .port_u16()
        .unwrap_or(if is_secured { 443 } else { 80 });
    let unreachable = |error: &dyn std::fmt::Display| format!("{}: {error}", webhook.name);
    let stream = (TcpStream::connect((host, port)).await).map_err(|error| unreachable(&error))?;
    if is_secured {
        let secured = tls::secured(stream, host, webhook.ca_file.as_deref()).await;
        exchange(secured.map_err(|error| unreachable(&error))?, request).await
    } else {
        exchange(stream, request).await
    }
    .map_err(|error| unreachable(&error))
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of the Standard Webhooks specification.
    #[test]
    fn a_signature_is_that_of_the_specification() {
        let key = STANDARD.decode("MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw").unwrap();
        let body = br#"{"test": 2432232314}"#;
        let id = ("msg_p5jXN8AQM9LWM0D4loKWxJek", 1_614_265_330);
        assert_eq!(
            signature(&key, id, body).unwrap(),
            "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE="
        );
    }
}
