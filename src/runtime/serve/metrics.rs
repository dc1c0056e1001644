//! The metrics, as OpenMetrics 1.0 text. Names are part of the interface: `deploy/` queries them.

use crate::alert::Level;
use crate::reading::{BenchmarkId, plain, unix_seconds};
use crate::runtime::clock;
use crate::runtime::drilled::DrillRecord;
use crate::runtime::service_faults::{ServiceFaultKind, ServiceFaults};
use crate::runtime::vitals::{Health, Vitals, VitalsPoint};
use prometheus_client::collector::Collector;
use prometheus_client::encoding::{DescriptorEncoder, EncodeMetric, text};
use prometheus_client::metrics::MetricType;
use prometheus_client::metrics::counter::ConstCounter;
use prometheus_client::metrics::gauge::ConstGauge;
use prometheus_client::registry::Registry;
use std::fmt;
use std::sync::Arc;

/// Of an answer at `/metrics`.
pub const CONTENT_TYPE: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// All metrics as they stand.
pub(super) fn text(vitals: Arc<Vitals>) -> Result<String, fmt::Error> {
    let mut registry = Registry::with_prefix("slipwatch");
    registry.register_collector(Box::new(vitals));
    let mut text = String::new();
    text::encode(&mut text, &registry)?;
    Ok(text)
}

impl Collector for Vitals {
    fn encode(&self, encoder: DescriptorEncoder) -> fmt::Result {
        let mut sheet = Sheet(encoder);
        let health = self.health();
        let uptime = self.uptime().as_secs_f64();
        sheet.gauge("uptime_seconds", "Time since the start", uptime)?;
        let turn = self.since_turn().as_secs_f64();
        sheet.gauge(
            "work_loop_idle_seconds",
            "Time since the work loop turned",
            turn,
        )?;
        state(&mut sheet, &health)?;
        trouble(&mut sheet, &health)?;
        faults(&mut sheet, self.faults())?;
        counts(&mut sheet, &health)?;
        drills(&mut sheet, health.drill.as_ref())?;
        let about = "Time to work in a reading that led to a refit";
        sheet.whole("refit_seconds", about, self.refits())?;
        let levels = self
            .levels()
            .map(|(level, count)| (level.name(), count as f64));
        let about =
            "Benchmarks at each level, all of them; unknown stands beside a level above green";
        sheet.gauges("benchmarks", about, "level", levels)?;
        benchmarks(&mut sheet, &self.points().into_iter().collect::<Vec<_>>())
    }
}

fn flag(is: bool) -> f64 {
    f64::from(u8::from(is))
}

/// What somebody must see to.
fn trouble(sheet: &mut Sheet<'_>, health: &Health) -> fmt::Result {
    let gauges = [
        (
            "store_damaged",
            "1 when a row of the state is not what was written",
            flag(health.is_store_damaged),
        ),
        (
            "clock_wrong",
            "1 while the host's clock is earlier than readings that are known",
            flag(health.is_clock_wrong),
        ),
        (
            "held_inputs",
            "Inputs that wait, unacknowledged, until the host's clock is right",
            health.held as f64,
        ),
        (
            "record_failed",
            "1 while the record in MCAP files cannot be written",
            flag((health.record.as_ref()).is_some_and(|record| record.failure.is_some())),
        ),
        (
            "config_refused",
            "1 while the config file is not in force: it was not taken at a reload",
            flag(health.config_refused.is_some()),
        ),
        (
            "silences",
            "Orders in force by which alerts are not reported",
            health.silences.len() as f64,
        ),
    ];
    for (name, about, value) in gauges {
        sheet.gauge(name, about, value)?;
    }
    if let Some(until) = health.silences.iter().map(|mute| mute.until).max() {
        let about = "When the last order ends by which alerts are not reported, Unix time";
        sheet.gauge(
            "silenced_until_timestamp_seconds",
            about,
            unix_seconds(until),
        )?;
    }
    Ok(())
}

/// What lasts and keeps the daemon from its work.
fn faults(sheet: &mut Sheet<'_>, faults: &ServiceFaults) -> fmt::Result {
    let about = "What lasts and keeps the daemon from its work: brokers out of reach, files that cannot be read, hooks that fail, the state";
    let mut family = (sheet.0).encode_descriptor("faults", about, None, MetricType::Gauge)?;
    let mut counts = faults.counts();
    for kind in ServiceFaultKind::ALL {
        if counts.keys().all(|(lasts, _)| *lasts != kind) {
            counts.insert((kind, None), 0);
        }
    }
    for ((kind, source), count) in counts {
        let source = source.unwrap_or_default();
        let labels = [
            ("kind", kind.name().to_owned()),
            ("source", label_value(&source)),
        ];
        ConstGauge::new(count as f64).encode(family.encode_family(&labels)?)?;
    }
    Ok(())
}

/// All zero where no drills are held.
fn drills(sheet: &mut Sheet<'_>, drill: Option<&DrillRecord>) -> fmt::Result {
    let count = |one: fn(&DrillRecord) -> u64| ConstCounter::new(drill.map_or(0, one));
    let about = "Drills in which every hook took the alert, and somebody acknowledged it where that is asked for";
    sheet.whole("drills", about, &count(|drill| drill.passed))?;
    let about = "Drills that failed";
    sheet.whole("drills_failed", about, &count(|drill| drill.failed))?;
    let failed = drill.is_some_and(|drill| drill.failure.is_some());
    sheet.gauge(
        "drill_failed",
        "1 when the newest drill failed",
        flag(failed),
    )?;
    let overdue = drill.is_some_and(|drill| drill.is_overdue(clock::now()));
    let about = "1 when no drill has passed for half as long again as from one to the next";
    sheet.gauge("drill_overdue", about, flag(overdue))?;
    let latency = drill.and_then(|drill| drill.latency_seconds).unwrap_or(0.0);
    let about = "From the readings of the last drill that passed being in their file to the first hook's start";
    sheet.gauge("drill_latency_seconds", about, latency)
}

fn state(sheet: &mut Sheet<'_>, health: &Health) -> fmt::Result {
    let gauges = [
        (
            "caught_up",
            "1 when the past has been read",
            flag(health.is_caught_up),
        ),
        (
            "store_writable",
            "1 when the last write to the state folder went well",
            flag(health.is_store_writable),
        ),
        (
            "ingest_paused",
            "1 while nothing is taken in because the disk is full",
            flag(health.is_paused),
        ),
        (
            "lag_seconds",
            "How long the oldest value that was found and is not durable yet has waited",
            health.lag_seconds,
        ),
        (
            "queue_batches",
            "Batches of values that wait for the monitor",
            health.queue as f64,
        ),
        (
            "outbox_alerts",
            "Alerts that a hook has not taken yet",
            health.outbox as f64,
        ),
        (
            "outbox_closed_alerts",
            "Alerts that waited for a hook that is not in the config any more",
            health.outbox_closed as f64,
        ),
        (
            "unwritten_inputs",
            "Inputs that wait, unacknowledged, for room on the disk",
            health.unwritten as f64,
        ),
        (
            "searches",
            "Searches for an effect that are at work",
            health.searches as f64,
        ),
    ];
    for (name, about, value) in gauges {
        sheet.gauge(name, about, value)?;
    }
    if let Some(time) = health.outbox_oldest {
        let about = "When the oldest alert that waits was called, data time, Unix time";
        sheet.gauge("outbox_oldest_timestamp_seconds", about, unix_seconds(time))?;
    }
    if let Some(bytes) = health.database_bytes {
        sheet.gauge("database_bytes", "Size of the database", bytes as f64)?;
    }
    Ok(())
}

fn counts(sheet: &mut Sheet<'_>, health: &Health) -> fmt::Result {
    let counters = [
        ("readings", "Values that the monitor took", health.readings),
        (
            "repeated",
            "Values that had been taken before",
            health.repeated,
        ),
        (
            "from_the_future",
            "Values measured in the future, set aside",
            health.from_the_future,
        ),
        (
            "without_clock",
            "Values of a time that no clock gives that is set, set aside",
            health.without_clock,
        ),
        (
            "log_lines_lost",
            "Lines of the log that could not be written",
            health.log_lines_lost,
        ),
        (
            "heartbeats",
            "Reports that the site is watched, taken",
            health.heartbeats,
        ),
        (
            "heartbeats_failed",
            "Reports that the site is watched, not taken",
            health.heartbeats_failed,
        ),
    ];
    for (name, about, count) in counters {
        sheet.whole(name, about, &ConstCounter::new(count))?;
    }
    let about = "Lines, records and files that could not be used";
    let mut family = sheet
        .0
        .encode_descriptor("quarantined", about, None, MetricType::Counter)?;
    for (source, count) in &health.quarantined {
        let labels = [("source", label_value(source))];
        ConstCounter::new(*count).encode(family.encode_family(&labels)?)?;
    }
    Ok(())
}

fn benchmarks(sheet: &mut Sheet<'_>, points: &[(BenchmarkId, VitalsPoint)]) -> fmt::Result {
    type PointFigure = fn(&VitalsPoint) -> Option<f64>;
    let figures: [(&str, &str, PointFigure); 6] = [
        (
            "last_reading_timestamp_seconds",
            "When the newest reading was measured, Unix time",
            |point| point.newest.map(unix_seconds),
        ),
        (
            "level",
            "The level in force: 0 green, 1 yellow, 2 orange, 3 red",
            |point| Some(rank(point.level)),
        ),
        (
            "unknown",
            "1 while nothing can be said of the benchmark: no readings, or readings or a sensor at fault",
            |point| Some(f64::from(u8::from(point.is_unknown))),
        ),
        (
            "last_refit_seconds",
            "Time to work in the last reading that led to a refit",
            |point| point.refit_seconds,
        ),
        (
            "residual_surprise_nats",
            "How much less likely the newest reading was than the usual one; 0 where it does not stand out",
            |point| Some(point.surprise_nats),
        ),
        (
            "velocity_mm_per_day",
            "The velocity of the last refit",
            |point| point.velocity_mm_per_day,
        ),
    ];
    for (name, about, figure) in figures {
        let values = points
            .iter()
            .filter_map(|(id, point)| Some((id.as_str(), figure(point)?)));
        sheet.gauges(&format!("benchmark_{name}"), about, "benchmark", values)?;
    }
    Ok(())
}

fn rank(level: Level) -> f64 {
    match level {
        Level::Green | Level::Unknown => 0.0,
        Level::Yellow => 1.0,
        Level::Orange => 2.0,
        Level::Red => 3.0,
    }
}

/// The format has a way to write a line break, which stays; of other control characters it knows nothing.
fn label_value(text: &str) -> String {
    let lines: Vec<String> = text.split('\n').map(plain).collect();
    lines.join("\n")
}

struct Sheet<'a>(DescriptorEncoder<'a>);

impl Sheet<'_> {
    fn gauge(&mut self, name: &str, about: &str, value: f64) -> fmt::Result {
        self.whole(name, about, &ConstGauge::new(value))
    }

    fn whole(&mut self, name: &str, about: &str, metric: &impl EncodeMetric) -> fmt::Result {
        let encoder = self
            .0
            .encode_descriptor(name, about, None, metric.metric_type())?;
        metric.encode(encoder)
    }

    fn gauges<'v>(
        &mut self,
        name: &str,
        about: &str,
        label: &str,
        values: impl IntoIterator<Item = (&'v str, f64)>,
    ) -> fmt::Result {
        let mut family = self
            .0
            .encode_descriptor(name, about, None, MetricType::Gauge)?;
        for (of, value) in values {
            ConstGauge::new(value).encode(family.encode_family(&[(label, label_value(of))])?)?;
        }
        Ok(())
    }
}
