//! A recording with everything in it that is easily lost, and the reading back of one.

use jiff::SignedDuration;
use slipwatch::reading::{
    BenchmarkId, Channel, Disorder, Reading, Recording, Sample, Series, Unit,
};
use slipwatch::runtime::ingest::{IngestError, ReadOptions, read_files};
use std::path::Path;

pub(crate) fn reading(time: &str, value: f64, sigma: Option<f64>) -> Reading {
    let time = time.parse().unwrap();
    Reading { time, value, sigma }
}

/// Readings from before 1970 on, standard errors, averaging, awkward names and numbers.
pub(crate) fn made_up() -> Recording {
    Recording {
        series: vec![
            Series {
                benchmark: BenchmarkId::new("5"),
                unit: Unit::MM_PER_DAY,
                averaging: Some(SignedDuration::from_mins(90)),
                readings: vec![
                    reading("1963-08-02T00:00:00Z", 5.0, Some(0.1)),
                    reading("1963-08-02T00:00:00.000000001Z", 0.1 + 0.2, None),
                    reading("1971-01-01T00:00:00Z", 1.0e9, Some(5e-324)),
                ],
            },
            Series {
                benchmark: BenchmarkId::new("west wall/Ü 5,\"b\""),
                unit: Unit::parse("ft").unwrap(),
                averaging: None,
                readings: vec![reading("1963-08-03T00:00:00Z", -1.0 / 3.0, None)],
            },
        ],
        channels: vec![
            Channel {
                name: "lake_level_m".to_owned(),
                unit: Some("m".to_owned()),
                stated: None,
                samples: vec![Sample {
                    time: "1963-08-01T12:00:00Z".parse().unwrap(),
                    value: 650.25,
                }],
            },
            Channel {
                name: "quality/of day".to_owned(),
                unit: None,
                stated: None,
                samples: vec![Sample {
                    time: "1963-08-01T12:00:00Z".parse().unwrap(),
                    value: f64::MIN_POSITIVE,
                }],
            },
        ],
        provenance: [("title".to_owned(), "made up".to_owned())].into(),
    }
}

pub(crate) fn read(file: &Path) -> Result<(Recording, Disorder), IngestError> {
    read_files(&[file.to_owned()], &ReadOptions::default())
}

/// Compares bits too: `==` holds 0.0 and -0.0 for one number.
pub(crate) fn assert_identical(a: &Recording, b: &Recording) {
    assert_eq!(a, b);
    let bits = |recording: &Recording| -> Vec<u64> {
        let readings = recording.series.iter().flat_map(|series| &series.readings);
        let samples = recording
            .channels
            .iter()
            .flat_map(|channel| &channel.samples);
        readings
            .flat_map(|row| [row.value.to_bits(), row.sigma.unwrap_or(0.0).to_bits()])
            .chain(samples.map(|row| row.value.to_bits()))
            .collect()
    };
    assert_eq!(bits(a), bits(b));
}
