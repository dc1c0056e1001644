//! The table of the ways out for alerts: a way out is one row, and everything else follows from it.

use crate::eventually::eventually;
use crate::identity::red_fires;
use crate::offered::offer;
use crate::webhooks::{alert, quick, text};
use slipwatch::config::{self, Destination, HookConfig, SharedDestination, way_out_tables};
use slipwatch::runtime::deliver::{Dispatcher, Runner, Senders};
use slipwatch::runtime::delivered::Delivered;
use slipwatch::runtime::hook::{Alert, HookOutcome};
use slipwatch::runtime::way_out::{WayOut, destination};
use slipwatch::runtime::ways_out::WAYS_OUT;
use slipwatch::store::{DeliveryOutcome, Store};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// What sirens have sounded for, and on which circuit.
static SOUNDED: Mutex<Vec<(u8, String, u32)>> = Mutex::new(Vec::new());

/// A way out of the test's own: sirens on circuits, of which the first attempt finds the relay busy.
static SIREN: WayOut = WayOut {
    table: "siren",
    send: |delivery| {
        Box::pin(async move {
            let circuit = match delivery.to::<Siren>() {
                Ok(siren) => siren.circuit,
                Err(outcome) => return outcome,
            };
            let (key, attempt) = (delivery.alert.key.clone(), delivery.attempt);
            SOUNDED.lock().unwrap().push((circuit, key, attempt));
            if attempt == 1 {
                HookOutcome::NotStarted("the relay is busy".to_owned())
            } else {
                HookOutcome::Done
            }
        })
    },
    repeat: None,
    ready: |hook| {
        let siren: &Siren = destination(hook)?;
        Ok(format!("circuit {} is closed", siren.circuit))
    },
};

#[derive(Debug, PartialEq)]
struct Siren {
    circuit: u8,
}

impl Destination for Siren {
    fn table(&self) -> &'static str {
        "siren"
    }

    fn name(&self) -> String {
        format!("siren {}", self.circuit)
    }
}

/// One of each table that is a way out.
const TABLES: &str = r#"[[hook]]
run = ["true"]
[[webhook]]
url = "http://127.0.0.1:9/alerts"
secret_file = "webhook.secret"
[[cap]]
folder = "cap"
sender = "slipwatch@example.org"
area = "the shore"
[[mqtt_out]]
url = "mqtt://127.0.0.1:9"
topic = "toc/alerts"
"#;

/// One of each way out that a config has.
fn hooks() -> Vec<HookConfig> {
    let site = Path::new("site.toml");
    config::parse(&text(TABLES), site).unwrap().hooks
}

fn siren(circuit: u8) -> HookConfig {
    HookConfig {
        run: Vec::new(),
        to: Some(SharedDestination::new(Siren { circuit })),
        ..hooks().remove(0)
    }
}

fn red() -> Alert {
    alert("5", "5/red/1")
}

#[tokio::test(flavor = "multi_thread")]
async fn a_way_out_that_is_one_row_gets_alerts_and_tries_again() {
    let ways = WAYS_OUT.into_iter().chain([&SIREN]).collect();
    let runner: Arc<dyn Runner> = Arc::new(Senders(ways));
    let folder = tempfile::tempdir().unwrap();
    let store = Arc::new(Store::open(folder.path()).unwrap());
    let delivered = Delivered::of(Arc::clone(&store));
    let dispatcher = Dispatcher::with(&runner, &[siren(7)], &quick(), delivered);
    offer(&dispatcher, &red());
    let is_delivered = || {
        let identity = red_fires("5/red/1");
        let fate = Some(DeliveryOutcome::Delivered);
        store.is_noted(identity, Some("siren 7"), fate).unwrap()
    };
    eventually("the siren sounds", is_delivered).await;
    assert_eq!(dispatcher.close(Duration::from_secs(10)).await, Some(0));
    let sounded = SOUNDED.lock().unwrap().clone();
    let once = |attempt| (7, "5/red/1".to_owned(), attempt);
    assert_eq!(sounded, [once(1), once(2)]);
    assert_eq!((SIREN.ready)(&siren(7)).unwrap(), "circuit 7 is closed");
}

#[tokio::test]
async fn what_no_row_sends_is_not_sent_and_no_row_takes_what_is_not_its_own() {
    let hook = Arc::new(siren(1));
    let outcome = Senders(WAYS_OUT.to_vec()).run(Arc::clone(&hook), red(), 1);
    let why = "no way out is called siren".to_owned();
    assert_eq!(outcome.await, HookOutcome::NotStarted(why));
    for way in WAYS_OUT.iter().filter(|way| way.table != "hook") {
        let error = (way.ready)(&hook).unwrap_err();
        assert_eq!(error, "[[siren]] is of another kind", "{}", way.table);
    }
}

#[test]
fn every_table_of_the_config_that_is_a_way_out_has_its_row_and_every_row_its_table() {
    let tables: BTreeSet<&str> = WAYS_OUT.iter().map(|way| way.table).collect();
    assert_eq!(tables.len(), WAYS_OUT.len());
    let read: BTreeSet<&str> = way_out_tables().chain(["hook"]).collect();
    assert_eq!(tables, read);
    let hooks = hooks();
    let had: BTreeSet<&str> = hooks.iter().map(HookConfig::table).collect();
    assert_eq!(had, tables);
    let names: BTreeSet<String> = hooks.iter().map(HookConfig::name).collect();
    assert_eq!(names.len(), hooks.len());
}

#[test]
fn destinations_are_compared_by_what_they_say() {
    assert_eq!(siren(1), siren(1));
    assert_ne!(siren(1), siren(2));
    assert_ne!(siren(1).to, hooks().remove(1).to);
}
