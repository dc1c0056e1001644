//! Makes the recordings of Preonzo and Longjingcun from the CSV files of `recordings/digitised`:
//! `archive_digitised recordings`.

use anyhow::{Context, Result};
use slipwatch::reading::{Disorder, Recording};
use slipwatch::runtime::ingest::{ReadOptions, read_files, write_mcap};
use std::path::Path;

/// What is said of each recording that was read off a figure.
pub(crate) struct Digitised {
    /// The CSV file in `recordings/digitised`, without its ending.
    pub(crate) source: &'static str,
    /// The recording in `recordings`.
    pub(crate) file: &'static str,
    title: &'static str,
    /// The figure that was digitised.
    figure: &'static str,
    /// What is known of the end.
    outcome: &'static str,
    /// Names of columns that do not say whose they are.
    columns: &'static [&'static str],
    /// Benchmark and error of digitisation, mm.
    errors_mm: &'static [(&'static str, f64)],
    /// Where these errors come from, and what else to know.
    notes: &'static str,
}

/// Every recording that was read off a figure.
pub(crate) const ALL: [Digitised; 2] = [
    Digitised {
        source: "preonzo_2012",
        file: "preonzo-2012.mcap",
        title: "Preonzo, Ticino, Switzerland, 10 April to 15 May 2012: displacement of extensometers E1 to E5",
        figure: "7",
        outcome: "collapsed on 15 May 2012 in the early hours: 01:30Z is taken, 2 h either way",
        columns: &[],
        errors_mm: &[
            ("E1", 0.4),
            ("E2", 0.4),
            ("E3", 1.2),
            ("E4", 1.3),
            ("E5", 1.0),
        ],
        notes: "sigma is the error of digitisation: 0.4 mm for E1 and E2 and 1.3 mm for E4 are stated; \
                1.2 mm for E3 and 1.0 mm for E5 are the step between neighbouring values, which in E1, \
                E2 and E4 is the stated error; the error of the instruments is not stated; times are \
                local midnights, which is assumed",
    },
    Digitised {
        source: "longjingcun_2019",
        file: "longjingcun-2019.mcap",
        title: "Longjingcun, Xingyi, Guizhou, China, 28 January to 17 February 2019: displacement",
        figure: "9",
        outcome: "collapsed on 17 February 2019: 05:53 local time is taken",
        columns: &["displacement_mm=Longjingcun:displacement:mm"],
        errors_mm: &[("Longjingcun", 1.5)],
        notes: "sigma is the error of digitisation, 1.5 mm; the instrument is not stated, nor its error; \
                times are local midnights, which is assumed; the last reading carries the date of the \
                failure, so at its midnight it cannot have been known: it is later, or part of the failure",
    },
];

fn main() -> Result<()> {
    let folder = std::env::args_os().nth(1);
    let folder = folder.context("usage: archive_digitised RECORDINGS_FOLDER")?;
    let folder = Path::new(&folder);
    for digitised in &ALL {
        let recording = digitised.recording(folder)?;
        write_mcap(&recording, &folder.join(digitised.file))
            .with_context(|| format!("writing {}", digitised.file))?;
    }
    Ok(())
}

impl Digitised {
    /// The recording, from the CSV file below the folder of recordings.
    ///
    /// # Errors
    /// When the file cannot be read, is out of order, or holds a series whose error is not known.
    pub(crate) fn recording(&self, recordings: &Path) -> Result<Recording> {
        let file = recordings
            .join("digitised")
            .join(format!("{}.csv", self.source));
        let columns = self.columns.iter().map(|column| column.parse());
        let options = ReadOptions {
            columns: columns.collect::<Result<_, _>>()?,
            ..ReadOptions::default()
        };
        let (mut recording, disorder) = read_files(&[file], &options)?;
        anyhow::ensure!(
            disorder == Disorder::default(),
            "{}: found {disorder:?}, expected rows in order",
            self.source
        );
        for series in &mut recording.series {
            let id = series.benchmark.as_str();
            let error = self.errors_mm.iter().find(|(of, _)| *of == id);
            let (_, sigma) = error.with_context(|| format!("no error of {id}"))?;
            for reading in &mut series.readings {
                reading.sigma = Some(*sigma);
            }
        }
        recording.provenance = self.provenance();
        Ok(recording)
    }

    fn provenance(&self) -> std::collections::BTreeMap<String, String> {
        let attribution = format!(
            "Ma et al., IEEE Access 13, 2025, figure {}, CC BY 4.0; digitised",
            self.figure
        );
        let entries = [
            ("title", self.title),
            ("attribution", &attribution),
            ("licence", "CC BY 4.0"),
            ("kind", "measured (digitised)"),
            (
                "changes",
                "read off the figure, gathered into MCAP, times in UTC, values as in the CSV file",
            ),
            ("outcome", self.outcome),
            ("notes", self.notes),
            (
                "made_by",
                "cargo run --release -p studies --bin archive_digitised -- recordings",
            ),
        ];
        entries
            .map(|(key, text)| (key.to_owned(), text.to_owned()))
            .into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use slipwatch::runtime::ingest::encode_mcap;
    use std::path::PathBuf;

    fn folder() -> PathBuf {
        studies::project().join("recordings")
    }

    fn read(file: PathBuf) -> Recording {
        read_files(&[file], &ReadOptions::default()).unwrap().0
    }

    #[test]
    fn the_digitised_recordings_come_out_of_their_csv_files_byte_for_byte() {
        for digitised in &ALL {
            let recording = digitised.recording(&folder()).unwrap();
            let mut bytes = std::io::Cursor::new(Vec::new());
            encode_mcap(&recording, &mut bytes).unwrap();
            let committed = std::fs::read(folder().join(digitised.file)).unwrap();
            assert!(committed == bytes.into_inner(), "{}", digitised.file);
        }
    }

    #[test]
    fn the_digitised_recordings_are_attributed_and_carry_their_error() {
        for digitised in &ALL {
            let recording = read(folder().join(digitised.file));
            let said = &recording.provenance;
            assert_eq!(said["kind"], "measured (digitised)");
            assert_eq!(said["licence"], "CC BY 4.0");
            assert!(said["attribution"].contains("Ma et al., IEEE Access 13, 2025"));
            assert!(said["outcome"].contains("collapsed"));
            for series in &recording.series {
                for reading in &series.readings {
                    let sigma = reading.sigma.unwrap();
                    assert!((0.4..=1.5).contains(&sigma), "{}", series.benchmark);
                }
            }
        }
    }

    #[test]
    #[cfg_attr(not(measured_data), ignore = "no measured data here")]
    fn the_digitised_recordings_hold_the_values_that_were_digitised() {
        for digitised in &ALL {
            let name = format!("{}.csv", digitised.source);
            let file = studies::measured(&name).unwrap();
            let kept = std::fs::read(folder().join("digitised").join(&name)).unwrap();
            assert!(kept == std::fs::read(file).unwrap(), "{name}");
        }
    }
}
