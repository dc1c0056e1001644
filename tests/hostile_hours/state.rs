//! What the state of a daemon says.

use jiff::Timestamp;
use slipwatch::monitor::Input;
use slipwatch::runtime::replay::replay_state;
use slipwatch::runtime::shutdown;
use slipwatch::store::Store;
use std::collections::BTreeMap;

/// Whether the monitor has ended the red at `name` since the reading of `of`: what nobody was notified of before is not sent any more.
pub(crate) fn is_over(store: &Store, name: &str, of: Timestamp) -> bool {
    let (mut after, mut is_over) = (0, false);
    loop {
        let events = store.events(after, Some("alert"), Some(name)).unwrap();
        let Some((last, _)) = events.last() else {
            return is_over;
        };
        after = *last;
        for (_, body) in &events {
            let event: serde_json::Value = serde_json::from_str(body).unwrap();
            let time: Timestamp = event["time"].as_str().unwrap().parse().unwrap();
            if event["level"] == "red" && time >= of {
                is_over = event["state"] == "resolved";
            }
        }
    }
}

/// The readings that were taken, by benchmark.
pub(crate) fn readings(store: &Store) -> BTreeMap<String, Vec<(Timestamp, f64)>> {
    let (mut taken, mut after) = (BTreeMap::new(), 0);
    loop {
        let rows = store.steps(after).unwrap();
        let Some(last) = rows.last() else {
            return taken;
        };
        after = last.seq;
        for row in &rows {
            if let Input::Reading {
                benchmark, reading, ..
            } = &row.input
            {
                let own: &mut Vec<(Timestamp, f64)> =
                    taken.entry(benchmark.to_string()).or_default();
                own.push((reading.time, reading.value));
            }
        }
    }
}

/// That a replay of the state says what the daemon said.
pub(crate) fn is_what_a_replay_says(seed: u64, store: &Store) {
    let (_stop, stopped) = shutdown::pair();
    let mut said = Vec::new();
    let mut note = |event: &slipwatch::monitor::Event| {
        said.push(serde_json::to_string(event).unwrap());
        Ok(())
    };
    replay_state(store, None, None, &stopped, &mut |_| {}, &mut note).unwrap();
    // The summary is a replay's own.
    said.pop();
    let (mut stored, mut after) = (Vec::new(), 0);
    loop {
        let events = store.events(after, None, None).unwrap();
        let Some((last, _)) = events.last() else {
            break;
        };
        after = *last;
        stored.extend(events.into_iter().map(|(_, body)| body));
    }
    let differs = said
        .iter()
        .zip(&stored)
        .position(|(one, other)| one != other);
    if let Some(at) = differs {
        panic!(
            "seed {seed}: a replay says\n{}\nand the daemon said\n{}",
            said[at], stored[at]
        );
    }
    assert_eq!(said.len(), stored.len(), "seed {seed}: events");
}
