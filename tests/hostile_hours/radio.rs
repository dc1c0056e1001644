//! A broker that keeps each message until it is acknowledged, and may send it again before.

use crate::clock::truth;
use crate::slope::Measured;
use rand::seq::SliceRandom;
use rand_pcg::Pcg64;
use slipwatch::monitor::Input;
use slipwatch::reading::{BenchmarkId, Reading, Unit};
use slipwatch::runtime::clock::Stopwatch;
use slipwatch::runtime::mqtt::{Receipt, ReceivedMessage};
use slipwatch::runtime::tail::Arrival;
use std::collections::BTreeMap;
use tokio::sync::mpsc::{self, UnboundedReceiver, UnboundedSender};

/// The broker.
pub(crate) struct Radio {
    next: u64,
    /// Not acknowledged, and whether it has been sent over the connection that there is.
    kept: BTreeMap<u64, (Measured, bool)>,
    sender: UnboundedSender<u64>,
    acknowledged: UnboundedReceiver<u64>,
    pub(crate) is_away: bool,
    pub(crate) stutters: bool,
}

impl Radio {
    pub(crate) fn new() -> Self {
        let (sender, acknowledged) = mpsc::unbounded_channel();
        Self {
            next: 0,
            kept: BTreeMap::new(),
            sender,
            acknowledged,
            is_away: false,
            stutters: false,
        }
    }

    pub(crate) fn publish(&mut self, measured: Measured) {
        self.kept.insert(self.next, (measured, false));
        self.next += 1;
    }

    /// The connection is a new one: what was not acknowledged is sent again.
    pub(crate) fn reconnect(&mut self) {
        self.take_notice();
        for (_, was_sent) in self.kept.values_mut() {
            *was_sent = false;
        }
    }

    fn take_notice(&mut self) {
        while let Ok(number) = self.acknowledged.try_recv() {
            self.kept.remove(&number);
        }
    }

    /// What is sent now, and whether red is due once it has been read.
    pub(crate) fn send(&mut self, random: &mut Pcg64) -> Vec<(ReceivedMessage, Measured)> {
        self.take_notice();
        if self.is_away {
            return Vec::new();
        }
        let mut numbers: Vec<u64> = self
            .kept
            .iter()
            .filter(|(_, (_, sent))| !sent)
            .map(|(number, _)| *number)
            .collect();
        if self.stutters {
            numbers.extend_from_within(..);
            numbers.shuffle(random);
        }
        let mut sent = Vec::new();
        for number in numbers {
            let (measured, was_sent) = self.kept.get_mut(&number).unwrap();
            *was_sent = true;
            sent.push((delivery(number, measured, &self.sender), *measured));
        }
        sent
    }

    pub(crate) fn is_empty(&mut self) -> bool {
        self.take_notice();
        self.kept.is_empty()
    }
}

fn delivery(number: u64, measured: &Measured, sender: &UnboundedSender<u64>) -> ReceivedMessage {
    assert!(measured.time <= truth());
    let reading = Reading {
        time: measured.time,
        value: measured.value,
        sigma: None,
    };
    ReceivedMessage {
        arrivals: vec![Arrival {
            time: measured.time,
            input: Input::Reading {
                benchmark: BenchmarkId::new("m"),
                unit: Unit::MM,
                averaging: None,
                reading,
            },
        }],
        source: "radio".to_owned(),
        found: Stopwatch::start(),
        quarantined: 0,
        is_retained: false,
        receipt: Receipt::numbered(number, sender.clone()),
        room: None,
    }
}
