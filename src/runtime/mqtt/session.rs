//! One kept session with a broker: in MQTT 5, and in MQTT 3.1.1 where the broker does not know that.
//!
//! In MQTT 5 a client states how many messages it takes before it acknowledges them; in 3.1.1 the broker decides it, and
//! 20 are usual: each twenty messages then wait for a commit.

use crate::config::{Broker, BrokerAddress};
use crate::runtime::{connect, tls};
use rumqttc::v5::mqttbytes::QoS as QoS5;
use rumqttc::v5::mqttbytes::v5 as packet5;
use rumqttc::v5::{self, mqttbytes::v5::ConnectReturnCode};
use rumqttc::{self as v3, QoS, SubscribeReasonCode, TlsConfiguration, Transport};
use std::borrow::Cow;
use std::error::Error;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Messages that a broker may send before the first of them is acknowledged.
pub(crate) const MOST_UNACKNOWLEDGED: u16 = 8192;
/// Longest packet that is taken from the broker at all, bytes: the longest there can be. What is too long is set aside
/// and acknowledged; refused, it would come again for ever, and nothing behind it.
const LONGEST_PACKET: u32 = 268_435_455 + 5;
/// Longest packet that we send, bytes.
const LONGEST_SENT: usize = 1 << 20;
/// Requests that may wait for the connection.
const REQUESTS: usize = 64;
/// By when an address of a broker must answer.
const CONNECT: Duration = Duration::from_secs(5);
/// How often we ping the broker.
const KEEP_ALIVE: Duration = Duration::from_secs(30);

/// Why there is no connection.
pub(super) type NoConnection = Box<dyn Error + Send + Sync>;

/// The session, connected or not.
pub(super) struct Session {
    client: BrokerClient,
    version: Version,
    /// Made with the first connection; over TLS again with each, so that other authorities hold from the next one on.
    link: Option<Link>,
    /// Whether a broker has accepted this version of the protocol.
    is_accepted: bool,
    /// Connections that have ended.
    ended: Arc<AtomicU64>,
}

/// As whom the session is held, and with which broker.
struct BrokerClient {
    broker: Broker,
    id: String,
    /// Whether the broker keeps what comes for it while there is no connection.
    is_kept: bool,
}

/// The versions of the protocol.
#[derive(Clone, Copy)]
enum Version {
    Five,
    Three,
}

enum Link {
    Five(v5::AsyncClient, Box<v5::EventLoop>),
    Three(v3::AsyncClient, Box<v3::EventLoop>),
}

/// What came from the broker.
pub(super) enum SessionEvent<M = BrokerMessage> {
    Connected {
        /// Whether the broker has kept the session, and with it what came in the meantime.
        is_kept: bool,
    },
    Message(M),
    Subscribed {
        /// Whether the broker keeps messages until they are acknowledged: it may grant less than is asked for.
        is_kept: bool,
    },
    SubscriptionRefused,
    Nothing,
}

/// A message, to be acknowledged over the connection that it came by.
#[derive(Debug)]
pub(super) struct BrokerMessage {
    of: Published,
    /// Connections that had ended when it came, and that have ended by now.
    came_after: u64,
    ended: Arc<AtomicU64>,
}

#[derive(Debug)]
enum Published {
    Five(v5::AsyncClient, packet5::Publish),
    Three(v3::AsyncClient, v3::Publish),
}

impl BrokerMessage {
    pub(super) fn topic(&self) -> Cow<'_, str> {
        match &self.of {
            Published::Five(_, publish) => String::from_utf8_lossy(&publish.topic),
            Published::Three(_, publish) => Cow::from(&publish.topic),
        }
    }

    pub(super) fn payload(&self) -> &[u8] {
        match &self.of {
            Published::Five(_, publish) => &publish.payload,
            Published::Three(_, publish) => &publish.payload,
        }
    }

    /// Whether it is a copy that the broker keeps for whoever subscribes: it may have been taken before.
    pub(super) fn is_retained(&self) -> bool {
        match &self.of {
            Published::Five(_, publish) => publish.retain,
            Published::Three(_, publish) => publish.retain,
        }
    }

    /// The content has been read: many messages may wait to be acknowledged. An emptied payload would still keep its memory.
    pub(super) fn forget_payload(&mut self) {
        match &mut self.of {
            Published::Five(_, publish) => {
                // Each of them is a part of the packet.
                drop(std::mem::take(&mut publish.payload));
                drop(std::mem::take(&mut publish.topic));
                publish.properties = None;
            }
            Published::Three(_, publish) => drop(std::mem::take(&mut publish.payload)),
        }
    }

    /// Acknowledges it to the broker, so that it does not come again. On a later connection that is void: the message comes again there, and
    /// its number may be another's.
    pub(super) async fn acknowledge(self) -> Result<(), NoConnection> {
        if self.ended.load(Ordering::Relaxed) != self.came_after {
            return Err("the connection that the message came by has ended".into());
        }
        match self.of {
            Published::Five(client, publish) => client.ack(&publish).await?,
            Published::Three(client, publish) => client.ack(&publish).await?,
        }
        Ok(())
    }
}

impl Session {
    /// Connects when it is first asked for what came.
    pub(super) fn new(broker: Broker, client_id: String) -> Self {
        Self::of(BrokerClient {
            broker,
            id: client_id,
            is_kept: true,
        })
    }

    /// One that the broker forgets when the connection ends.
    pub(super) fn passing(broker: Broker, client_id: String) -> Self {
        Self::of(BrokerClient {
            broker,
            id: client_id,
            is_kept: false,
        })
    }

    fn of(client: BrokerClient) -> Self {
        Self {
            client,
            version: Version::Five,
            link: None,
            is_accepted: false,
            ended: Arc::default(),
        }
    }

    /// The version of the protocol that is used, or tried.
    pub(super) fn version(&self) -> &'static str {
        match self.version {
            Version::Five => "5",
            Version::Three => "3.1.1",
        }
    }

    /// The next that comes; connects where there is no connection.
    pub(super) async fn next(&mut self) -> Result<SessionEvent, NoConnection> {
        let link = match &mut self.link {
            Some(link) => link,
            none => none.insert(open(self.version, &self.client).await?),
        };
        let came = match link {
            Link::Five(client, connection) => match connection.poll().await {
                Ok(v5::Event::Incoming(packet)) => Ok(came_by_five(client, packet)),
                Ok(v5::Event::Outgoing(_)) => Ok(SessionEvent::Nothing),
                Err(error) => Err((may_be_another_version(&error), error.into())),
            },
            Link::Three(client, connection) => match connection.poll().await {
                Ok(v3::Event::Incoming(packet)) => Ok(came_by_three(client, packet)),
                Ok(v3::Event::Outgoing(_)) => Ok(SessionEvent::Nothing),
                Err(error) => {
                    let is_unreached = matches!(
                        error,
                        v3::ConnectionError::Io(_) | v3::ConnectionError::Tls(_)
                    );
                    Err((!is_unreached, error.into()))
                }
            },
        };
        match came {
            Ok(SessionEvent::Message(of)) => Ok(SessionEvent::Message(BrokerMessage {
                of,
                came_after: self.ended.load(Ordering::Relaxed),
                ended: Arc::clone(&self.ended),
            })),
            Ok(SessionEvent::Connected { is_kept }) => {
                self.is_accepted = true;
                Ok(SessionEvent::Connected { is_kept })
            }
            Ok(SessionEvent::Subscribed { is_kept }) => Ok(SessionEvent::Subscribed { is_kept }),
            Ok(SessionEvent::SubscriptionRefused) => Ok(SessionEvent::SubscriptionRefused),
            Ok(SessionEvent::Nothing) => Ok(SessionEvent::Nothing),
            Err((may_be_another_version, error)) => {
                self.ended.fetch_add(1, Ordering::Relaxed);
                let is_other = may_be_another_version && !self.is_accepted;
                if is_other {
                    self.version = match self.version {
                        Version::Five => Version::Three,
                        Version::Three => Version::Five,
                    };
                }
                // Opened anew: its name may lead elsewhere by now, and its certificates may be others.
                self.link = None;
                Err(error)
            }
        }
    }

    /// Asks for the messages of a topic, each at least once.
    pub(super) fn subscribe(&self, topic: &str) -> Result<(), NoConnection> {
        match &self.link {
            Some(Link::Five(client, _)) => client.try_subscribe(topic, QoS5::AtLeastOnce)?,
            Some(Link::Three(client, _)) => client.try_subscribe(topic, QoS::AtLeastOnce)?,
            None => return Err("there is no connection".into()),
        }
        Ok(())
    }

    /// Ends the connection; the session is kept.
    pub(super) fn disconnect(&self) {
        // Where requests queue already, the connection is no better than none.
        let _ = match &self.link {
            Some(Link::Five(client, _)) => client.try_disconnect().is_ok(),
            Some(Link::Three(client, _)) => client.try_disconnect().is_ok(),
            None => false,
        };
    }
}

/// Ready to connect.
async fn open(version: Version, client: &BrokerClient) -> Result<Link, NoConnection> {
    let (address, ca_file) = (&client.broker.address, client.broker.ca_file.as_deref());
    let transport = transport(address, ca_file)?;
    let to = (host_of(address).await?, address.port);
    Ok(match version {
        Version::Five => five(client, to, transport),
        Version::Three => three(client, to, transport),
    })
}

/// To which host to connect: the address of it that answers; over TLS its name, with which its certificate is compared.
pub(super) async fn host_of(address: &BrokerAddress) -> Result<String, String> {
    if address.is_secured {
        return Ok(address.host.clone());
    }
    let answering = connect::answering(&address.host, address.port);
    let answering = tokio::time::timeout(CONNECT, answering).await;
    answering.unwrap_or_else(|_| {
        Err(format!(
            "{}: no answer within {} s",
            address.host,
            CONNECT.as_secs()
        ))
    })
}

/// Over TLS where the address says so.
pub(super) fn transport(
    address: &BrokerAddress,
    ca_file: Option<&Path>,
) -> Result<Transport, String> {
    if !address.is_secured {
        return Ok(Transport::tcp());
    }
    let config = tls::config(ca_file)?;
    Ok(Transport::tls_with_config(TlsConfiguration::Rustls(config)))
}

fn five(client: &BrokerClient, to: (String, u16), transport: Transport) -> Link {
    let mut options = v5::MqttOptions::new(&client.id, to.0, to.1);
    options
        .set_clean_start(!client.is_kept)
        .set_session_expiry_interval(client.is_kept.then_some(u32::MAX))
        .set_receive_maximum(Some(MOST_UNACKNOWLEDGED))
        .set_max_packet_size(Some(LONGEST_PACKET))
        .set_manual_acks(true)
        .set_keep_alive(KEEP_ALIVE)
        .set_transport(transport);
    if let Some((user, password)) = &client.broker.address.login {
        options.set_credentials(user, password);
    }
    let (client, connection) = v5::AsyncClient::new(options, REQUESTS);
    Link::Five(client, Box::new(connection))
}

fn three(client: &BrokerClient, to: (String, u16), transport: Transport) -> Link {
    let mut options = v3::MqttOptions::new(&client.id, to.0, to.1);
    options
        .set_clean_session(!client.is_kept)
        .set_manual_acks(true)
        .set_keep_alive(KEEP_ALIVE)
        .set_max_packet_size(LONGEST_PACKET as usize, LONGEST_SENT)
        .set_transport(transport);
    if let Some((user, password)) = &client.broker.address.login {
        options.set_credentials(user, password);
    }
    let (client, connection) = v3::AsyncClient::new(options, REQUESTS);
    Link::Three(client, Box::new(connection))
}

fn came_by_five(client: &v5::AsyncClient, packet: packet5::Packet) -> SessionEvent<Published> {
    match packet {
        packet5::Packet::ConnAck(answer) => SessionEvent::Connected {
            is_kept: answer.session_present,
        },
        packet5::Packet::Publish(publish) => {
            SessionEvent::Message(Published::Five(client.clone(), publish))
        }
        packet5::Packet::SubAck(answer) => {
            let is_granted = |code| matches!(code, &packet5::SubscribeReasonCode::Success(_));
            if answer.return_codes.iter().all(is_granted) {
                let is_less = |code| {
                    matches!(
                        code,
                        &packet5::SubscribeReasonCode::Success(QoS5::AtMostOnce)
                    )
                };
                SessionEvent::Subscribed {
                    is_kept: !answer.return_codes.iter().any(is_less),
                }
            } else {
                SessionEvent::SubscriptionRefused
            }
        }
        packet5::Packet::Auth(_)
        | packet5::Packet::Connect(..)
        | packet5::Packet::PubAck(_)
        | packet5::Packet::PingReq(_)
        | packet5::Packet::PingResp(_)
        | packet5::Packet::Subscribe(_)
        | packet5::Packet::PubRec(_)
        | packet5::Packet::PubRel(_)
        | packet5::Packet::PubComp(_)
        | packet5::Packet::Unsubscribe(_)
        | packet5::Packet::UnsubAck(_)
        | packet5::Packet::Disconnect(_) => SessionEvent::Nothing,
    }
}

fn came_by_three(client: &v3::AsyncClient, packet: v3::Packet) -> SessionEvent<Published> {
    match packet {
        v3::Packet::ConnAck(answer) => SessionEvent::Connected {
            is_kept: answer.session_present,
        },
        v3::Packet::Publish(publish) => {
            SessionEvent::Message(Published::Three(client.clone(), publish))
        }
        v3::Packet::SubAck(answer)
            if answer.return_codes.contains(&SubscribeReasonCode::Failure) =>
        {
            SessionEvent::SubscriptionRefused
        }
        v3::Packet::SubAck(answer) => SessionEvent::Subscribed {
            is_kept: !answer
                .return_codes
                .contains(&SubscribeReasonCode::Success(QoS::AtMostOnce)),
        },
        v3::Packet::Connect(_)
        | v3::Packet::PubAck(_)
        | v3::Packet::PubRec(_)
        | v3::Packet::PubRel(_)
        | v3::Packet::PubComp(_)
        | v3::Packet::Subscribe(_)
        | v3::Packet::Unsubscribe(_)
        | v3::Packet::UnsubAck(_)
        | v3::Packet::PingReq
        | v3::Packet::PingResp
        | v3::Packet::Disconnect => SessionEvent::Nothing,
    }
}

/// Whether a broker was reached and may know no MQTT 5: it says so, or answers what cannot be read, or nothing.
pub(super) fn may_be_another_version(error: &v5::ConnectionError) -> bool {
    match error {
        v5::ConnectionError::Io(_)
        | v5::ConnectionError::Tls(_)
        | v5::ConnectionError::RequestsDone => false,
        v5::ConnectionError::ConnectionRefused(code) => matches!(
            code,
            ConnectReturnCode::RefusedProtocolVersion
                | ConnectReturnCode::UnsupportedProtocolVersion
        ),
        v5::ConnectionError::MqttState(_)
        | v5::ConnectionError::Timeout(_)
        | v5::ConnectionError::NotConnAck(_) => true,
    }
}
