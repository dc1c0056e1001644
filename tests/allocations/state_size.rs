//! What a benchmark holds in memory is bounded, however many readings it has had.

use jiff::{SignedDuration, Timestamp};
use slipwatch::monitor::{Input, Monitor, Settings};
use slipwatch::reading::{BenchmarkId, Reading, Unit};

/// Displacements a second apart, which count as one, then hourly ones, on which the monitor forecasts.
fn watch(monitor: &mut Monitor, close: i64, hourly: i64) {
    let start: Timestamp = "2025-01-01T00:00:00Z".parse().unwrap();
    let seconds = (0..close).chain((0..hourly).map(|hour| close + 3600 * hour));
    for second in seconds {
        let time = start + SignedDuration::from_secs(second);
        let input = Input::Reading {
            benchmark: BenchmarkId::new("5"),
            unit: Unit::parse("mm").unwrap(),
            averaging: None,
            reading: Reading {
                time,
                value: 1e-4 * second as f64,
                sigma: None,
            },
        };
        monitor.step(time, &input);
    }
}

#[test]
fn a_benchmark_holds_less_than_256_kib_after_ever_so_many_readings() {
    // What all benchmarks share, such as the network, is there already.
    watch(&mut Monitor::new(Settings::default()), 0, 20);
    for close in [100, 3000, 12_000] {
        let mut monitor = Monitor::new(Settings::default());
        let held = allocation_counter::measure(|| watch(&mut monitor, close, 100));
        assert!(
            held.bytes_current < 256 * 1024,
            "{close}: {} bytes",
            held.bytes_current
        );
    }
}
