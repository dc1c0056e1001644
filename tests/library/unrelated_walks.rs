//! What has nothing to do with a slope is no driver of it, also where its law without any effect fits poorly.

use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use slipwatch::effects::{Kind, Options, explain};
use slipwatch::reading::{BenchmarkId, Channel, Sample, Series};
use slipwatch::runtime::ingest::{ReadOptions, read_files};
use std::path::Path;

const SEEDS: u64 = 6;

/// Three walks of independent steps at the times of the readings.
fn walks(series: &Series, seed: u64) -> Vec<Channel> {
    let mut generator = Pcg64::seed_from_u64(seed);
    let walk = |name: &str| {
        let mut level = 0.0;
        let samples = series.readings.iter().map(|reading| {
            level += generator.sample::<f64, _>(StandardNormal);
            Sample {
                time: reading.time,
                value: level,
            }
        });
        Channel {
            name: name.to_owned(),
            unit: None,
            stated: None,
            samples: samples.collect(),
        }
    };
    ["w0_level_m", "w1_level_m", "w2_level_m"].map(walk).into()
}

#[test]
fn no_walk_displaces_the_load_step_of_preonzo() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("recordings/preonzo-2012.mcap");
    let recording = read_files(&[file], &ReadOptions::default());
    let recording = recording.unwrap().0;
    let series = recording.series(Some(&BenchmarkId::new("E1")), None);
    let series = series.unwrap();
    let (mut taken, mut displaced) = (Vec::new(), Vec::new());
    for seed in 0..SEEDS {
        let channels = walks(series, seed);
        let said = explain(series, &channels, &[], &Options::default(), &mut |_| ());
        let mut effects = std::iter::once(&said.verdict).chain(&said.also);
        if effects.any(|one| one.channel.is_some()) {
            taken.push(seed);
        }
        if said.verdict.effect != Kind::LOAD_STEP {
            displaced.push(seed);
        }
    }
    assert!(
        taken.is_empty() && displaced.is_empty(),
        "{taken:?} {displaced:?}"
    );
}
