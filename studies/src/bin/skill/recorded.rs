//! The recorded series: where each lies, and what came of it.
//!
//! Not among them: Columbia Glacier, whose ice slides at metres a day and is in no danger, so that passing a critical
//! velocity would say nothing of it. What was measured of 40-1938 at Century Mine stands in two files, with
//! different zeros and other days, and is scored from each.

use crate::corpus::{LOOKS, SkillSubject, SubjectKind, SubjectTruth};
use anyhow::{Context, Result};
use jiff::SignedDuration;
use slipwatch::reading::{Recording, Series, Timestamp, days_since};
use slipwatch::runtime::ingest::{ReadOptions, read_files};
use slipwatch::score::WholeRecord;
use std::path::PathBuf;

/// The default of a site file: passing 1 m/day is failure, mm/day.
const CRITICAL_MM_PER_DAY: f64 = 1000.0;

/// How it went.
#[derive(Debug, Clone, Copy)]
enum End {
    /// It failed then; later readings are not used.
    Failed {
        at: &'static str,
        /// Days before the failure.
        leads: &'static [f64],
    },
    /// No failure until its readings end.
    Stood,
}

#[derive(Debug)]
struct Source {
    heading: &'static str,
    kind: SubjectKind,
    file: &'static str,
    /// Velocities are means over so many hours before their time.
    averaging_hours: Option<i64>,
    /// The channel of a river's flow.
    flow: Option<&'static str>,
    end: End,
}

const HOUR: f64 = 1.0 / 24.0;
/// The rock came down between 08:15 and 08:40.
const LANZADA: End = End::Failed {
    at: "2025-11-11T08:15:00+01:00",
    leads: &[
        24.0 * HOUR,
        18.0 * HOUR,
        12.0 * HOUR,
        8.0 * HOUR,
        6.0 * HOUR,
        4.0 * HOUR,
        3.0 * HOUR,
        2.0 * HOUR,
        HOUR,
    ],
};
/// From chronicles; the paper gives no hour.
const VAIONT: End = End::Failed {
    at: "1963-10-09T22:39:00+01:00",
    leads: &[20.0, 10.0, 5.0, 2.0, 1.0],
};

/// In the early hours.
const PREONZO: End = End::Failed {
    at: "2012-05-15T01:30:00Z",
    leads: &[15.0, 12.0, 10.0, 8.0, 7.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.0],
};
const LONGJINGCUN: End = End::Failed {
    at: "2019-02-17T05:53:00+08:00",
    leads: &[10.0, 8.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.0],
};

const SOURCES: [Source; 12] = [
    Source::measured("Preonzo", "preonzo-2012.mcap", PREONZO),
    Source::measured("Longjingcun", "longjingcun-2019.mcap", LONGJINGCUN),
    Source::measured("Lanzada F1", "lanzada_2025_f1.csv", LANZADA).averaged(1),
    Source::measured("Lanzada F4", "lanzada_2025_f4.csv", LANZADA).averaged(1),
    Source::measured("Century Mine west", "century-mine-2013.mcap", End::Stood),
    Source::measured(
        "Century Mine south-west",
        "century-mine-2014-southwest.mcap",
        End::Stood,
    ),
    Source::measured("Salmon Falls", "salmon_falls_2017.csv", End::Stood).beside("river_flow_cfs"),
    Source::measured("Bazimen", "bazimen_2006.csv", End::Stood),
    Source::measured("Baishuihe", "baishuihe_2006.csv", End::Stood),
    // It does not slide: its instrument's height jumps.
    Source::measured("Houston", "houston_msfx_2013.csv", End::Stood),
    Source::reconstructed("Vaiont", "vaiont-1963-reconstruction.mcap", VAIONT),
    Source::reconstructed(
        "La Clapière",
        "la-clapiere-1982-1995-reconstruction.mcap",
        End::Stood,
    )
    .beside("tinee_flow_m3_s"),
];

/// Every series that is at hand; tells `left_out` the heading of one that is not.
pub(crate) fn load(left_out: impl Fn(&str)) -> Result<Vec<SkillSubject>> {
    let mut subjects = Vec::new();
    for source in &SOURCES {
        let Some(file) = source.file() else {
            left_out(source.heading);
            continue;
        };
        let of = source
            .subjects(file.clone())
            .with_context(|| file.display().to_string())?;
        subjects.extend(of);
    }
    Ok(subjects)
}

impl Source {
    const fn measured(heading: &'static str, file: &'static str, end: End) -> Self {
        Self {
            heading,
            kind: SubjectKind::Measured,
            file,
            averaging_hours: None,
            flow: None,
            end,
        }
    }

    const fn reconstructed(heading: &'static str, file: &'static str, end: End) -> Self {
        let source = Self::measured(heading, file, end);
        Self {
            kind: SubjectKind::Reconstruction,
            ..source
        }
    }

    const fn averaged(self, hours: i64) -> Self {
        Self {
            averaging_hours: Some(hours),
            ..self
        }
    }

    const fn beside(self, flow: &'static str) -> Self {
        Self {
            flow: Some(flow),
            ..self
        }
    }

    /// In the recordings, or in the folder of series that may not be redistributed; `None` where it is in neither.
    fn file(&self) -> Option<PathBuf> {
        let root = studies::project();
        let recorded = root.join("recordings").join(self.file);
        if recorded.exists() {
            return Some(recorded);
        }
        studies::measured(self.file)
    }

    fn subjects(&self, file: PathBuf) -> Result<Vec<SkillSubject>> {
        let options = ReadOptions {
            averaging: self.averaging_hours.map(SignedDuration::from_hours),
            ..ReadOptions::default()
        };
        let (recording, _) = read_files(&[file], &options)?;
        let series = recording.series.iter();
        series
            .map(|series| self.subject(series, &recording))
            .collect()
    }

    fn subject(&self, series: &Series, recording: &Recording) -> Result<SkillSubject> {
        let readings = &series.readings;
        let (Some(first), Some(last)) = (readings.first(), readings.last()) else {
            anyhow::bail!("{}: no readings", series.benchmark);
        };
        let day = |time: Timestamp| days_since(first.time, time);
        let (truth, leads) = match self.end {
            End::Failed { at, leads } => (SubjectTruth::FailedAt(day(at.parse()?)), leads),
            End::Stood => (SubjectTruth::StoodUntil(day(last.time)), &[][..]),
        };
        let named = |name| {
            let mut channels = recording.channels.iter();
            let channel = channels.find(|channel| channel.name == name);
            channel.with_context(|| format!("no channel {name}"))
        };
        let river = self.flow.map(named).transpose()?;
        let channels = river.map_or(&[][..], std::slice::from_ref);
        let mut history = WholeRecord::of(series, channels, CRITICAL_MM_PER_DAY);
        if let SubjectTruth::FailedAt(failure) = truth {
            let values = &mut history.observations.values;
            values.retain(|value| value.t_days <= failure);
        }
        let benchmark = series.benchmark.as_str();
        Ok(SkillSubject {
            name: format!("{}, {benchmark}", self.heading),
            kind: self.kind,
            family: self.heading.to_owned(),
            epoch: Some(first.time),
            history,
            spread: match truth {
                SubjectTruth::FailedAt(_) => 0,
                SubjectTruth::StoodUntil(_) => LOOKS,
            },
            truth,
            leads: leads.to_vec(),
        })
    }
}
