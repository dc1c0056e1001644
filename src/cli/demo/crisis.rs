//! The archived crises: their readings, what kind of data they are, and what happened in the end.

use crate::reading::Timestamp;

/// How a crisis ended.
#[derive(Debug, Clone, Copy)]
pub(super) enum End {
    /// The slope failed then.
    Failed(&'static str),
    /// It never did.
    Stood(&'static str),
}

/// One archived crisis.
#[derive(Debug)]
pub(super) struct Crisis {
    pub(super) site: &'static str,
    pub(super) benchmarks: &'static [&'static str],
    /// `measured`, `measured (digitised)` or `reconstruction`.
    pub(super) kind: &'static str,
    pub(super) evacuation_hours: i64,
    pub(super) end: End,
    pub(super) file: &'static str,
    pub(super) recording: &'static [u8],
}

/// In the order in which they are played.
pub(super) const CRISES: [Crisis; 4] = [
    Crisis {
        site: "Preonzo 2012",
        benchmarks: &["E3", "E5"],
        kind: "measured (digitised)",
        evacuation_hours: 24,
        end: End::Failed("2012-05-15T01:30:00Z"),
        file: "preonzo-2012.mcap",
        recording: include_bytes!("../../../recordings/preonzo-2012.mcap"),
    },
    Crisis {
        site: "Vaiont 1963",
        benchmarks: &["5", "63"],
        kind: "reconstruction",
        evacuation_hours: 72,
        // 22:39 local, from chronicles; the paper's line through 1/v is zero on 10 October, 12:00.
        end: End::Failed("1963-10-09T22:39:00+01:00"),
        file: "vaiont-1963-reconstruction.mcap",
        recording: include_bytes!("../../../recordings/vaiont-1963-reconstruction.mcap"),
    },
    Crisis {
        site: "La Clapière 1982-1995",
        benchmarks: &["10"],
        kind: "reconstruction",
        evacuation_hours: 24,
        end: End::Stood("never failed; contemporaries forecast collapse for 1988-1990"),
        file: "la-clapiere-1982-1995-reconstruction.mcap",
        recording: include_bytes!("../../../recordings/la-clapiere-1982-1995-reconstruction.mcap"),
    },
    Crisis {
        site: "Century Mine 2013-14",
        benchmarks: &["40-1938"],
        kind: "measured",
        evacuation_hours: 24,
        end: End::Stood(
            "231 mm in a day after 115 mm of rain, then slid and stopped; never failed",
        ),
        file: "century-mine-2013.mcap",
        recording: include_bytes!("../../../recordings/century-mine-2013.mcap"),
    },
];

impl Crisis {
    /// When it failed, where it did.
    pub(super) fn failed(&self) -> Option<Timestamp> {
        match self.end {
            End::Failed(time) => time.parse().ok(),
            End::Stood(_) => None,
        }
    }
}
