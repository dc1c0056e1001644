//! Alerts to a topic of a real Mosquitto: at QoS 1, tried again while it is away, over TLS only where it is trusted.

use crate::eventually::eventually;
use crate::identity::red_fires;
use crate::mqtt::{Mosquitto, refusing_version_5};
use crate::offered::offer;
use crate::webhooks::{alert, quick, text};
use rumqttc::{AsyncClient, Event, MqttOptions, Packet, Publish, QoS};
use slipwatch::config::{self, HookConfig};
use slipwatch::runtime::deliver::{self, Dispatcher};
use slipwatch::runtime::delivered::Delivered;
use slipwatch::runtime::hook::HookOutcome;
use slipwatch::store::{DeliveryOutcome, Store};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// The ways out of a config with this one.
fn ways(lines: &str) -> Vec<HookConfig> {
    let text = text(&format!("[[mqtt_out]]\nlevels = [\"red\"]\n{lines}\n"));
    config::parse(&text, Path::new("site.toml")).unwrap().hooks
}

fn way(broker: &Mosquitto, lines: &str) -> Vec<HookConfig> {
    ways(&format!(
        "url = \"mqtt://127.0.0.1:{}\"\n{lines}",
        broker.port
    ))
}

/// The next message of a topic, for somebody who subscribes now.
async fn next_of(broker: &Mosquitto, topic: &str) -> Publish {
    let options = MqttOptions::new("reader", "127.0.0.1", broker.port);
    let (client, mut connection) = AsyncClient::new(options, 10);
    client.subscribe(topic, QoS::AtLeastOnce).await.unwrap();
    let next = async {
        loop {
            match connection.poll().await {
                Ok(Event::Incoming(Packet::Publish(publish))) => return publish,
                Ok(_) => {}
                // The broker is not up yet.
                Err(_) => tokio::time::sleep(Duration::from_millis(50)).await,
            }
        }
    };
    tokio::time::timeout(Duration::from_secs(30), next)
        .await
        .unwrap()
}

/// Runs it until the broker is up.
async fn sent(hook: &HookConfig) -> HookOutcome {
    for _ in 0..200 {
        let outcome = deliver::run(hook, &alert("5", "5/red/1"), 2).await;
        let is_away =
            matches!(&outcome, HookOutcome::NotStarted(why) if why.contains("refused (os error"));
        if !is_away {
            return outcome;
        }
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    panic!("the broker does not come up");
}

#[tokio::test(flavor = "multi_thread")]
#[cfg_attr(not(has_mosquitto), ignore = "Mosquitto was not found by build.rs")]
async fn a_topic_gets_what_a_hook_gets_and_keeps_it_where_that_is_asked_for() {
    let broker = Mosquitto::start();
    let hooks = way(&broker, "topic = \"toc/alerts\"\nretain = true");
    assert_eq!(
        hooks[0].name(),
        format!("mqtt 127.0.0.1:{} toc/alerts", broker.port)
    );
    assert_eq!(sent(&hooks[0]).await, HookOutcome::Done);
    // Whoever comes later gets it too.
    let message = next_of(&broker, "toc/#").await;
    assert_eq!(
        (message.topic.as_str(), message.qos),
        ("toc/alerts", QoS::AtLeastOnce)
    );
    assert!(message.retain);
    let body: serde_json::Value = serde_json::from_slice(&message.payload).unwrap();
    for (key, value) in [
        ("event", "alert"),
        ("key", "5/red/1"),
        ("level", "red"),
        ("status", "Actual"),
    ] {
        assert_eq!(body[key], value, "{key}");
    }
    assert_eq!(body["attempt"], 2);
}

#[tokio::test(flavor = "multi_thread")]
#[cfg_attr(not(has_mosquitto), ignore = "Mosquitto was not found by build.rs")]
async fn an_alert_reaches_a_broker_that_knows_only_3_1_1() {
    let broker = Mosquitto::start();
    // The broker is up when it has taken this one.
    let directly = way(&broker, "topic = \"toc/first\"");
    assert_eq!(sent(&directly[0]).await, HookOutcome::Done);
    let (port, refused) = refusing_version_5(broker.port).await;
    let older = ways(&format!(
        "url = \"mqtt://127.0.0.1:{port}\"\ntopic = \"toc/alerts\"\nretain = true"
    ));
    assert_eq!(sent(&older[0]).await, HookOutcome::Done);
    assert_eq!(refused.load(Ordering::Relaxed), 1);
    let message = next_of(&broker, "toc/alerts").await;
    assert_eq!(message.qos, QoS::AtLeastOnce);
    let body: serde_json::Value = serde_json::from_slice(&message.payload).unwrap();
    assert_eq!(body["key"], "5/red/1");
}

#[tokio::test(flavor = "multi_thread")]
#[cfg_attr(not(has_mosquitto), ignore = "Mosquitto was not found by build.rs")]
async fn an_alert_waits_for_a_broker_that_is_away_and_one_that_is_not_let_in_is_a_failure() {
    let mut broker = Mosquitto::start_with(|folder| {
        let rules = folder.join("rules");
        std::fs::write(&rules, "topic readwrite toc/#\n").unwrap();
        format!("acl_file {}\n", rules.display())
    });
    let denied = way(&broker, "topic = \"elsewhere\"");
    let outcome = sent(&denied[0]).await;
    assert!(
        matches!(&outcome, HookOutcome::NotStarted(why) if why.contains("NotAuthorized")),
        "{outcome:?}"
    );
    let hooks = way(&broker, "topic = \"toc/alerts\"\nretain = true");
    broker.process.kill().unwrap();
    broker.process.wait().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let store = Arc::new(Store::open(folder.path()).unwrap());
    let dispatcher = Dispatcher::start(&hooks, &quick(), Delivered::of(Arc::clone(&store)));
    let (alert, name) = (alert("5", "5/red/1"), hooks[0].name());
    let identity = red_fires("5/red/1");
    offer(&dispatcher, &alert);
    eventually("attempts", || store.attempts(identity, &name).unwrap() >= 2).await;
    assert!(
        !store
            .is_noted(identity, Some(&name), Some(DeliveryOutcome::Delivered))
            .unwrap()
    );
    broker.start_again();
    eventually("its delivery", || {
        store
            .is_noted(identity, Some(&name), Some(DeliveryOutcome::Delivered))
            .unwrap()
    })
    .await;
    assert!(!next_of(&broker, "toc/alerts").await.payload.is_empty());
    dispatcher.close(Duration::from_secs(10)).await;
}

#[tokio::test(flavor = "multi_thread")]
#[cfg_attr(not(has_mosquitto), ignore = "Mosquitto was not found by build.rs")]
async fn an_alert_goes_over_tls_to_a_broker_that_proves_its_name_and_to_no_other() {
    let (broker, port) = Mosquitto::start_secured();
    let secured = |authority: &str| {
        let file = broker.folder.path().join(authority);
        let lines = format!(
            "url = \"mqtts://localhost:{port}\"\nca_file = {file:?}\ntopic = \"toc/alerts\"\nretain = true"
        );
        ways(&lines)
    };
    assert_eq!(sent(&secured("authority.pem")[0]).await, HookOutcome::Done);
    assert!(!next_of(&broker, "toc/alerts").await.payload.is_empty());
    let outcome = sent(&secured("stranger.pem")[0]).await;
    assert!(
        matches!(&outcome, HookOutcome::NotStarted(why) if why.contains("certificate")),
        "{outcome:?}"
    );
}
