//! Sends one alert to an address once: POST of what a hook gets on stdin, signed as Standard Webhooks asks.

use super::hook::{Alert, HookOutcome, state_name};
use super::way_out::{DeliveryAttempt, WayOut, destination};
use super::{alertmanager, clock, http, link, tls};
use crate::config::{HookConfig, Secret, Webhook, WebhookFormat};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use hmac::{Hmac, KeyInit, Mac};
use http_body_util::Full;
use hyper::body::Bytes;
use hyper::{Method, Request, header};
use sha2::Sha256;
use std::fmt::Write as _;
use std::sync::Arc;
use std::time::Duration;

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
fn signature(key: &[u8], id: &str, timestamp: i64, body: &[u8]) -> Option<String> {
    let mut mac = Hmac::<Sha256>::new_from_slice(key).ok()?;
    mac.update(format!("{id}.{timestamp}.").as_bytes());
    mac.update(body);
    let sum = mac.finalize().into_bytes();
    Some(format!("v1,{}", STANDARD.encode(sum)))
}

/// An address, by POST.
pub(super) static WEBHOOK: WayOut = WayOut {
    table: "webhook",
    send: |delivery| Box::pin(send(delivery)),
    repeat: Some(|hook, alerts| Box::pin(repeat(hook, alerts))),
    ready: |hook| {
        let webhook: &Webhook = destination(hook)?;
        let name = &webhook.name;
        let secret = webhook.secret_file.as_deref().map(Secret::read).transpose();
        let secret = secret.map_err(|error| error.to_string());
        let trusted = webhook.ca_file.as_deref().map(tls::own).transpose();
        match secret.and(trusted) {
            Ok(_) => Ok(format!("{name} has what it needs; hook test sends to it")),
            Err(error) => Err(format!("{name}: {error}")),
        }
    },
};

async fn send(delivery: DeliveryAttempt) -> HookOutcome {
    let to: &Webhook = match delivery.to() {
        Ok(to) => to,
        Err(outcome) => return outcome,
    };
    let (hook, alert, attempt) = (&delivery.hook, &delivery.alert, delivery.attempt);
    let link = link::of(hook, alert).await;
    let body = match to.format {
        WebhookFormat::Slipwatch => alert.body(attempt, link.as_deref()),
        WebhookFormat::Alertmanager => alertmanager::body(alert, &hook.levels, link.as_deref()),
    };
    let outcome = match body {
        Ok(body) => post(to, alert, body, hook.timeout).await,
        Err(error) => HookOutcome::NotStarted(error.to_string()),
    };
    tracing::info!(
        webhook = to.name,
        key = alert.key,
        attempt,
        ?outcome,
        "webhook ended"
    );
    outcome
}

/// Sends what is in force, or has ended of late, once more to Alertmanager, in one message.
async fn repeat(hook: Arc<HookConfig>, alerts: Vec<Alert>) -> HookOutcome {
    let (to, first) = match (destination::<Webhook>(&hook), alerts.first()) {
        (Ok(to), Some(first)) => (to, first),
        (Err(why), _) => return HookOutcome::NotStarted(why),
        (Ok(_), None) => return HookOutcome::Done,
    };
    let mut links = Vec::with_capacity(alerts.len());
    for alert in &alerts {
        links.push(link::of(&hook, alert).await);
    }
    let outcome = match alertmanager::again(alerts.iter().zip(&links), &hook.levels) {
        Ok(body) => post(to, first, body, hook.timeout).await,
        Err(error) => HookOutcome::NotStarted(error.to_string()),
    };
    let (webhook, alerts) = (&to.name, alerts.len());
    if outcome == HookOutcome::Done {
        tracing::debug!(webhook, alerts, "sent again");
    } else {
        tracing::warn!(
            webhook,
            alerts,
            ?outcome,
            "what is in force could not be sent again"
        );
    }
    outcome
}

/// Sends `alert`, whose JSON is `body`, within `limit`.
async fn post(webhook: &Webhook, alert: &Alert, body: Vec<u8>, limit: Duration) -> HookOutcome {
    let request = match request(webhook, alert, body) {
        Ok(request) => request,
        Err(why) => return HookOutcome::NotStarted(why),
    };
    let address = &webhook.address;
    match tokio::time::timeout(
        limit,
        http::answer(address, webhook.ca_file.as_deref(), request),
    )
    .await
    {
        Ok(Ok(status)) if (200..300).contains(&status) => HookOutcome::Done,
        Ok(Ok(status)) => HookOutcome::Refused(status),
        Ok(Err(why)) => HookOutcome::NotStarted(format!("{}: {why}", webhook.name)),
        Err(_elapsed) => HookOutcome::TimedOut,
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
        signature(key.bytes(), &id, timestamp, &body)
            .ok_or_else(|| "the secret is unusable".to_owned())
    });
    let signed = signed.transpose()?;
    let mut request = http::head(Method::POST, &webhook.address);
    if let Some(signature) = signed {
        request = request.header("webhook-signature", signature);
    }
    request
        .header(header::CONTENT_TYPE, "application/json")
        .header("webhook-id", id)
        .header("webhook-timestamp", timestamp)
        .body(Full::new(Bytes::from(body)))
        .map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of the Standard Webhooks specification.
    #[test]
    fn a_signature_is_that_of_the_specification() {
        let key = STANDARD.decode("MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw").unwrap();
        let body = br#"{"test": 2432232314}"#;
        let id = "msg_p5jXN8AQM9LWM0D4loKWxJek";
        assert_eq!(
            signature(&key, id, 1_614_265_330, body).unwrap(),
            "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE="
        );
    }
}
