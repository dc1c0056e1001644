//! Sends one alert to a broker's topic: a connection of its own, QoS 1, done when the broker has acknowledged it.
//!
//! In MQTT 5 a broker says where it does not let us publish; one that knows 3.1.1 only acknowledges that too, and drops the message.

use super::session::{NoConnection, host_of, may_be_another_version, transport};
use crate::config::MqttTopic;
use crate::runtime::hook::HookOutcome;
use crate::runtime::way_out::{DeliveryAttempt, WayOut, destination};
use crate::runtime::{link, tls};
use rumqttc::v5::mqttbytes::QoS as QoS5;
use rumqttc::v5::mqttbytes::v5::{Packet as Packet5, PubAckReason};
use rumqttc::{self as v3, QoS, v5};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Longest packet, bytes: far more than an alert.
const LONGEST_PACKET: u32 = 1 << 20;
/// Requests of one connection: the message, and its end.
const REQUESTS: usize = 2;

/// A topic of a broker.
pub(in crate::runtime) static MQTT_OUT: WayOut = WayOut {
    table: "mqtt_out",
    send: |delivery| Box::pin(send(delivery)),
    repeat: None,
    ready: |hook| {
        let topic: &MqttTopic = destination(hook)?;
        let name = &topic.name;
        match topic.ca_file.as_deref().map(tls::own).transpose() {
            Ok(_) => Ok(format!(
                "{name} has what it needs; hook test publishes to it"
            )),
            Err(error) => Err(format!("{name}: {error}")),
        }
    },
};

async fn send(delivery: DeliveryAttempt) -> HookOutcome {
    let to: &MqttTopic = match delivery.to() {
        Ok(to) => to,
        Err(outcome) => return outcome,
    };
    let (hook, alert, attempt) = (&delivery.hook, &delivery.alert, delivery.attempt);
    let link = link::of(hook, alert).await;
    let outcome = match alert.body(attempt, link.as_deref()) {
        Ok(body) => publish(to, body, hook.timeout).await,
        Err(error) => HookOutcome::NotStarted(error.to_string()),
    };
    let (name, key) = (&to.name, &alert.key);
    tracing::info!(name, key, attempt, ?outcome, "MQTT message ended");
    outcome
}

/// Publishes `body` within `limit`.
async fn publish(to: &MqttTopic, body: Vec<u8>, limit: Duration) -> HookOutcome {
    match tokio::time::timeout(limit, published(to, body)).await {
        Ok(Ok(())) => HookOutcome::Done,
        Ok(Err(error)) => HookOutcome::NotStarted(format!("{}: {error}", to.name)),
        Err(_elapsed) => HookOutcome::TimedOut,
    }
}

async fn published(to: &MqttTopic, body: Vec<u8>) -> Result<(), NoConnection> {
    match by_five(to, body.clone()).await {
        Err(PublishRefusal::Version) => by_three(to, body).await,
        Err(PublishRefusal::Otherwise(error)) => Err(error),
        Ok(()) => Ok(()),
    }
}

/// Why nothing was published.
enum PublishRefusal {
    /// The broker may know no MQTT 5.
    Version,
    Otherwise(NoConnection),
}

impl<E: Into<NoConnection>> From<E> for PublishRefusal {
    fn from(error: E) -> Self {
        Self::Otherwise(error.into())
    }
}

async fn by_five(to: &MqttTopic, body: Vec<u8>) -> Result<(), PublishRefusal> {
    let address = &to.address;
    let host = host_of(address).await?;
    let mut options = v5::MqttOptions::new(client_id(), host, address.port);
    options
        .set_clean_start(true)
        .set_max_packet_size(Some(LONGEST_PACKET))
        .set_transport(transport(address, to.ca_file.as_deref())?);
    if let Some((user, password)) = &address.login {
        options.set_credentials(user, password);
    }
    let (client, mut connection) = v5::AsyncClient::new(options, REQUESTS);
    client.try_publish(&to.topic, QoS5::AtLeastOnce, to.is_retained, body)?;
    loop {
        match connection.poll().await {
            Ok(v5::Event::Incoming(Packet5::PubAck(answer))) => {
                // The alert is there; how the connection ends does not matter any more.
                let _ = client.try_disconnect().is_ok() && connection.poll().await.is_ok();
                let is_taken = matches!(
                    answer.reason,
                    PubAckReason::Success | PubAckReason::NoMatchingSubscribers
                );
                return if is_taken {
                    Ok(())
                } else {
                    Err(format!("the broker does not take it: {:?}", answer.reason).into())
                };
            }
            Ok(_) => {}
            Err(error) if may_be_another_version(&error) => return Err(PublishRefusal::Version),
            Err(error) => return Err(error.into()),
        }
    }
}

async fn by_three(to: &MqttTopic, body: Vec<u8>) -> Result<(), NoConnection> {
    let address = &to.address;
    let host = host_of(address).await?;
    let mut options = v3::MqttOptions::new(client_id(), host, address.port);
    options
        .set_clean_session(true)
        .set_max_packet_size(LONGEST_PACKET as usize, LONGEST_PACKET as usize)
        .set_transport(transport(address, to.ca_file.as_deref())?);
    if let Some((user, password)) = &address.login {
        options.set_credentials(user, password);
    }
    let (client, mut connection) = v3::AsyncClient::new(options, REQUESTS);
    client.try_publish(&to.topic, QoS::AtLeastOnce, to.is_retained, body)?;
    loop {
        if let v3::Event::Incoming(v3::Packet::PubAck(_)) = connection.poll().await? {
            let _ = client.try_disconnect().is_ok() && connection.poll().await.is_ok();
            return Ok(());
        }
    }
}

/// Never that of another connection of ours: a broker would end the other one.
fn client_id() -> String {
    static SENT: AtomicU64 = AtomicU64::new(0);
    let number = SENT.fetch_add(1, Ordering::Relaxed);
    format!("slipwatch-out-{}-{number}", std::process::id())
}
