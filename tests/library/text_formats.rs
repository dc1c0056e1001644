//! The table of text formats: a format is one row, and everything else follows from it.

use slipwatch::reading::{BenchmarkId, Reading, Recording, Series, Timestamp, Unit};
use slipwatch::runtime::ingest::{
    Item, LineReader, LineResult, ReadOptions, TEXT_FORMATS, TextFormat, TextRows, look_through,
    read_files,
};
use std::collections::BTreeSet;
use std::io::Write;
use std::path::Path;

/// A format of the test's own: `second;displacement in mm`, of the benchmark after which the file is named.
static PAIRS: TextFormat = TextFormat {
    name: "pairs",
    extensions: &["pairs"],
    begins: |text| text.contains(&b';'),
    reader: |file, _| {
        Box::new(Pairs(BenchmarkId::new(
            file.file_stem().unwrap().to_string_lossy(),
        )))
    },
    write: |recording, out| {
        for reading in &recording.series[0].readings {
            writeln!(out, "{};{}", reading.time.as_second(), reading.value).unwrap();
        }
        Ok(())
    },
    states_averaging: false,
};

#[derive(Debug)]
struct Pairs(BenchmarkId);

impl LineReader for Pairs {
    fn take(&mut self, _: u64, text: &str) -> LineResult {
        let pair = text.split_once(';');
        let item = pair.map(|(second, value)| Item::Reading {
            benchmark: self.0.clone(),
            unit: Unit::MM,
            averaging: None,
            reading: Reading {
                time: Timestamp::from_second(second.parse().unwrap()).unwrap(),
                value: value.parse().unwrap(),
                sigma: None,
            },
        });
        LineResult {
            items: item.into_iter().collect(),
            ..LineResult::default()
        }
    }
}

fn recording() -> Recording {
    let readings = (0..5_i32).map(|day| Reading {
        time: Timestamp::from_second(86_400 * i64::from(day)).unwrap(),
        value: 1.5 * f64::from(day),
        sigma: None,
    });
    Recording {
        series: vec![Series {
            benchmark: BenchmarkId::new("5"),
            unit: Unit::MM,
            averaging: None,
            readings: readings.collect(),
        }],
        ..Recording::default()
    }
}

#[test]
fn a_format_that_is_one_row_is_written_read_line_by_line_and_surveyed() {
    let mut text = Vec::new();
    (PAIRS.write)(&recording(), &mut text).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("5.pairs");
    std::fs::write(&file, &text).unwrap();
    let survey = look_through(&PAIRS, &file, &ReadOptions::default()).unwrap();
    let found = BTreeSet::from([(BenchmarkId::new("5"), Unit::MM)]);
    assert_eq!(survey.readings, found);
    let mut rows = TextRows::new(&PAIRS, Path::new("5.pairs"), &ReadOptions::default());
    let text = String::from_utf8(text).unwrap();
    let items: Vec<Item> = text
        .lines()
        .zip(1..)
        .flat_map(|(line, number)| rows.take(number, line).items)
        .collect();
    let expected = recording().series.remove(0);
    let readings = expected.readings.into_iter().map(|reading| Item::Reading {
        benchmark: expected.benchmark.clone(),
        unit: Unit::MM,
        averaging: None,
        reading,
    });
    assert_eq!(items, readings.collect::<Vec<_>>());
}

#[test]
fn every_row_of_the_table_reads_back_what_it_writes_and_is_recognised_by_name_ending_and_beginning()
{
    let folder = tempfile::tempdir().unwrap();
    for format in TEXT_FORMATS {
        let mut text = Vec::new();
        (format.write)(&recording(), &mut text).unwrap();
        let named = TextFormat::named(format.name).unwrap();
        assert!(std::ptr::eq(named, format), "{}", format.name);
        let begins = TEXT_FORMATS.into_iter().find(|one| (one.begins)(&text));
        assert_eq!(begins.unwrap().name, format.name);
        for extension in format.extensions {
            let found = TextFormat::of_extension(extension).unwrap();
            assert_eq!(found.name, format.name, "{extension}");
            let file = folder.path().join(format!("slope.{extension}"));
            let mut out = std::fs::File::create(&file).unwrap();
            out.write_all(&text).unwrap();
            let (read, _) = read_files(&[file], &ReadOptions::default()).unwrap();
            assert_eq!(read.series, recording().series, "{extension}");
        }
    }
}
