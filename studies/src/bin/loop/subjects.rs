//! The series of the document: where each lies, what it is, and which figures show it.

use anyhow::Result;
use jiff::SignedDuration;
use slipwatch::effects::{Curves, Explanation, Options, explain};
use slipwatch::reading::{BenchmarkId, Recording, Series, Timestamp};
use slipwatch::runtime::ingest::{ReadOptions, read_files};
use std::path::PathBuf;

/// In the folder of measured series that may not be redistributed, which the tests read too.
const MEASURED: &str = "measured";
const RECORDED: &str = "recordings";

/// The file of that name in one of the two folders, where it is there.
fn file_in(folder: &str, name: &str) -> Option<PathBuf> {
    if folder == MEASURED {
        return studies::measured(name);
    }
    let root = studies::project();
    Some(root.join(RECORDED).join(name))
}

/// One benchmark to explain.
#[derive(Debug)]
pub(crate) struct Subject {
    /// Of its figures' files.
    pub(crate) name: &'static str,
    pub(crate) heading: &'static str,
    /// What it is, and by whom.
    pub(crate) origin: &'static str,
    folder: &'static str,
    files: &'static [&'static str],
    benchmark: Option<&'static str>,
    /// Velocities are means over so many hours before their time.
    averaging_hours: Option<i64>,
    /// Readings from then on are left out.
    until: Option<&'static str>,
    pub(crate) figures: &'static [&'static str],
    /// What the run shows and what it does not, in words.
    pub(crate) comment: &'static str,
}

impl Subject {
    /// Its readings and what stands beside them; nothing where its files are not at hand.
    pub(crate) fn recording(&self) -> Result<Option<Recording>> {
        let each = self.files.iter().map(|file| file_in(self.folder, file));
        let Some(files): Option<Vec<PathBuf>> = each.collect() else {
            return Ok(None);
        };
        let options = ReadOptions {
            averaging: self.averaging_hours.map(SignedDuration::from_hours),
            ..ReadOptions::default()
        };
        let (mut recording, _) = read_files(&files, &options)?;
        if let Some(until) = self.until {
            let until: Timestamp = until.parse()?;
            for series in &mut recording.series {
                series.readings.retain(|reading| reading.time < until);
            }
        }
        Ok(Some(recording))
    }

    /// Its own readings among them.
    pub(crate) fn series<'a>(&self, recording: &'a Recording) -> Result<&'a Series> {
        let benchmark = self.benchmark.map(BenchmarkId::new);
        Ok(recording.series(benchmark.as_ref(), None)?)
    }

    /// Nothing where its files are not at hand.
    pub(crate) fn explained(&self) -> Result<Option<Explanation>> {
        let Some(recording) = self.recording()? else {
            return Ok(None);
        };
        let series = self.series(&recording)?;
        let others = recording.series.iter();
        let neighbours: Vec<&Series> = others
            .filter(|other| other.benchmark != series.benchmark)
            .collect();
        let channels = &recording.channels;
        let options = Options::default();
        Ok(Some(explain(
            series,
            channels,
            &neighbours,
            &options,
            &mut |_| (),
        )))
    }

    /// What the figures may show of it.
    pub(crate) fn drawn(&self, explanation: &Explanation) -> Explanation {
        let mut drawn = explanation.clone();
        let run = drawn.curves.times.len().div_ceil(MOST_DRAWN);
        if self.folder == MEASURED && run > 1 {
            thin(&mut drawn.curves, run);
        }
        drawn
    }
}

fn thin(curves: &mut Curves, run: usize) {
    fn every<T: Copy>(values: &mut Vec<T>, run: usize) {
        *values = values.iter().copied().step_by(run).collect();
    }
    every(&mut curves.times, run);
    for values in [
        &mut curves.readings,
        &mut curves.before,
        &mut curves.after,
        &mut curves.before_held_out,
        &mut curves.after_held_out,
    ] {
        every(values, run);
    }
    every(&mut curves.load_before, run);
    every(&mut curves.load_after, run);
    let added = curves.contributions.values_mut();
    for values in added.chain(curves.log_loads.values_mut()) {
        every(values, run);
    }
}

/// Of readings that may not be redistributed no more than so many are drawn: a figure is no copy of the data.
const MOST_DRAWN: usize = 150;

const ALL: &[&str] = &["readings", "contributions", "undeclared-load", "rivals"];

pub(crate) const SUBJECTS: [Subject; 14] = [
    Subject {
        name: "salmon-falls-blkm",
        heading: "Salmon Falls Creek, BLKM",
        origin: "Measured: GPS along the slope, Idaho, 2017-2018, from I. Lauer's public repository (UNAVCO, USGS and NOAA data). Beside it: lake level and creek stage, each corrected and as logged, river flow, rain, air temperature.",
        folder: MEASURED,
        files: &["salmon_falls_2017.csv"],
        benchmark: Some("blkm"),
        averaging_hours: None,
        until: None,
        figures: ALL,
        comment: "A plain rate model fitted by hand to the lake level leaves 3.3 mm in the fit and 11.3 mm held out. The fit here and the held-out error are both smaller. None of the other channels earns a place after the lake.",
    },
    Subject {
        name: "salmon-falls-ntoe",
        heading: "Salmon Falls Creek, NTOE",
        origin: "Measured: as BLKM, at the toe.",
        folder: MEASURED,
        files: &["salmon_falls_2017.csv"],
        benchmark: Some("ntoe"),
        averaging_hours: None,
        until: None,
        figures: &["readings"],
        comment: "The same rate model: 4.0 mm in the fit and 13.0 mm held out; here too the fit and the held-out error are both smaller; the held-out one hangs on which response of the lake is taken. Whether the level or its rate of change acts cannot be distinguished from this record alone: the two stand side by side among the candidates.",
    },
    Subject {
        name: "bazimen",
        heading: "Bazimen, ZG110",
        origin: "Measured: monthly GPS, Three Gorges, 2006-2012, of the Hubei Yangtze Three Gorges Landslide National Field Station. Beside it: monthly rain, the reservoir's level.",
        folder: MEASURED,
        files: &["bazimen_2006.csv"],
        benchmark: None,
        averaging_hours: None,
        until: None,
        figures: &["readings", "contributions"],
        comment: "The gain is negative: a falling reservoir speeds the slope up. The reservoir is drawn down once a year, so a season cannot be distinguished from it. From reading to reading the held-out error falls by 37 %. Extrapolated over two years it rises, and the reason is the law's drift: the law with the reservoir is off by some 50 mm from the first summer of the block on, and stays so to the end, while the plain law is off by turns on either side; without the mean error of each, 48 mm fall to 39.",
    },
    Subject {
        name: "baishuihe",
        heading: "Baishuihe, ZG118",
        origin: "Measured: as Bazimen.",
        folder: MEASURED,
        files: &["baishuihe_2006.csv"],
        benchmark: None,
        averaging_hours: None,
        until: None,
        figures: &["readings"],
        comment: "Reservoir and rain act together here, and rather from a threshold on than in proportion. One channel stands for both; the explanation is partial, and says so. The copied row is no slip: it is named and taken out.",
    },
    Subject {
        name: "columbia",
        heading: "Columbia Glacier, marker 1",
        origin: "Measured: speed of a tidewater glacier, 1985 (Krimmel and Vaughn 1987, Walters and Dunlap 1987, digitised by E. Welty). Beside it: rain. The record is its authors' smooth curve.",
        folder: MEASURED,
        files: &["columbia_1985_marker1.csv", "columbia_1985_rain.csv"],
        benchmark: None,
        averaging_hours: None,
        until: None,
        figures: &["readings", "contributions"],
        comment: "The moon's tide, which no daily melt can imitate. The values are vertices of a drawn curve, so no error about them says much of the noise. Extrapolated the error rises by 4 %: in its last days the glacier is faster by 3.7 m/day than either law has it, which rules the error whatever the tide does.",
    },
    Subject {
        name: "houston",
        heading: "Houston, MSFX, height",
        origin: "Measured: a GNSS station that does not slide, from GNSS_Step_Detect_Remove (2021). Its height jumps by some 70 mm, there and back, four times.",
        folder: MEASURED,
        files: &["houston_msfx_2013.csv"],
        benchmark: Some("up"),
        averaging_hours: None,
        until: None,
        figures: &["readings", "residual"],
        comment: "All of it lies in the reading: no load was adopted, and the monitor replaying the record raises no alert but for its gaps. One of the steps is reported as two, 45 mm and then 21 mm three weeks later.",
    },
    Subject {
        name: "lanzada",
        heading: "Lanzada, F1",
        origin: "Measured: crackmeter velocity, means of the trailing hour, up to the collapse of 2025-11-11, 08:15 to 08:40 (ARPA Lombardia, digitised from published plots by DnMdr). No covariate.",
        folder: MEASURED,
        files: &["lanzada_2025_f1.csv"],
        benchmark: None,
        averaging_hours: Some(1),
        until: None,
        figures: &["readings", "undeclared-load"],
        comment: "A failing slope that bends away from the straight line in 1/v before it fails. The plain law follows it as closely as the law with any effect does, but leaves structure; a jump of the state on the first day is the nearest label, and refused. Nothing here is a reason to expect a pause.",
    },
    Subject {
        name: "lanzada-temperature",
        heading: "Lanzada, F1, with the rock's temperature",
        origin: "Measured: as above, with the rock's temperature every quarter of an hour.",
        folder: MEASURED,
        files: &["lanzada_2025_f1.csv", "lanzada_2025_rock_temperature.csv"],
        benchmark: None,
        averaging_hours: Some(1),
        until: None,
        figures: &[],
        comment: "The temperature is found neither as a load nor in the reading: the BIC does not fall with it. It does not enter the forecast of the failure.",
    },
    Subject {
        name: "la-clapiere",
        heading: "La Clapière, benchmark 10",
        origin: "A reconstruction, not measured: the displacement of 1982 to 1995 and the Tinée's flow, made from the published statements on them (see docs/la-clapiere.md).",
        folder: RECORDED,
        files: &["la-clapiere-1982-1995-reconstruction.mcap"],
        benchmark: None,
        averaging_hours: None,
        until: None,
        figures: ALL,
        comment: "The series was made with a river that acts until 1986 and another law from the end of November 1987 on. The river is not found: the flow does not lower the BIC. The change is found at its date as what it is, a change of the friction alone; without it the extrapolation is out by metres.",
    },
    Subject {
        name: "la-clapiere-until-1988",
        heading: "La Clapière, benchmark 10, until April 1988",
        origin: "The same reconstruction, not measured; the readings after March 1988 are left out, and the last third of the rest is the held-out block.",
        folder: RECORDED,
        files: &["la-clapiere-1982-1995-reconstruction.mcap"],
        benchmark: None,
        averaging_hours: None,
        until: Some("1988-04-01T00:00:00Z"),
        figures: &["readings"],
        comment: "The river that was put in gains no more than a search does by chance. Where the law does change, at the end of November 1987, too few readings follow for an event to be concluded: what is left is said to be unexplained.",
    },
    Subject {
        name: "vaiont",
        heading: "Vaiont, benchmark 5",
        origin: "A reconstruction, not measured: velocities of August to October 1963 and the reservoir's level, made from the published statements on them.",
        folder: RECORDED,
        files: &["vaiont-1963-reconstruction.mcap"],
        benchmark: Some("5"),
        averaging_hours: None,
        until: None,
        figures: &["readings"],
        comment: "The law needs no load here, and the remark says the one thing that mattered.",
    },
    Subject {
        name: "century-40-1938",
        heading: "Century Mine, prism 40-1938",
        origin: "Measured: Queensland, 2013-2014 (T. de Wit, Zenodo 10.5281/zenodo.15003054, CC BY 4.0; rain: Bureau of Meteorology). Beside it: daily rain.",
        folder: RECORDED,
        files: &["century-mine-2013.mcap"],
        benchmark: Some("40-1938"),
        averaging_hours: None,
        until: None,
        figures: &["readings", "contributions"],
        comment: "Flat, then 231 mm in a day after 115 mm of rain, then slow sliding that stopped: no failure is known, and the model case of a false alarm. The rain is what the step is consistent with; a single storm cannot prove it, and extrapolated over the held-out block, which holds the storm, the law does little better.",
    },
    Subject {
        name: "century-31-1931",
        heading: "Century Mine, prism 31-1931",
        origin: "Measured: as above.",
        folder: RECORDED,
        files: &["century-mine-2013.mcap"],
        benchmark: Some("31-1931"),
        averaging_hours: None,
        until: None,
        figures: &[],
        comment: "The step of 46 mm in the same storm follows the rain too, and a jump of the state cannot be distinguished from it. Over the held-out block the error falls to about a third, extrapolated and from reading to reading.",
    },
    Subject {
        name: "preonzo",
        heading: "Preonzo, E2",
        origin: "Measured: an extensometer of the rockslide above Preonzo, Ticino, daily until its collapse on 2012-05-15 (digitised by Ma et al., IEEE Access 13, 2025, CC BY 4.0). No covariate.",
        folder: RECORDED,
        files: &["preonzo-2012.mcap"],
        benchmark: Some("E2"),
        averaging_hours: None,
        until: None,
        figures: &["readings"],
        comment: "On 8 May the pause began for which the record is known, and the load falls then. E1 and E2 part from the three others a week before. Too few readings follow to hold a block out.",
    },
];
