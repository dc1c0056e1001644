//! What the files of a site hold now, as the daemon would take it: a look before it starts.

mod covariate;
mod ending;
mod layout;
mod recording;
mod refused;
mod resets;
mod stated;
mod track;
mod view;
mod without_readings;

pub use refused::{RefusedKinds, RefusedRow};
pub use view::{
    BenchmarkPreview, BenchmarkWithoutReadings, ColumnView, CovariateView, LayoutView, Preview,
    Refusal, SourceView,
};

use super::clock;
use super::ingest::{Item, Meaning, is_packed, unpack};
use super::site::{Unproven, Untimely, untimely};
use super::tail::{Arrival, Decoder, LinesRead, TextReader, list};
use crate::config::{Config, FileSource, SourceKind};
use crate::monitor::{Declared, Input};
use crate::reading::{
    BenchmarkId, CovariateKind, LocalClock, MissingValues, Quantity, Sample, SummerTime, Suspicion,
    Timestamp, suspicion,
};
use crate::store::Store;
use covariate::PreviewCovariate;
use ending::RefusedEnds;
use layout::keep_layout;
use recording::read_recording;
use resets::DeclaredResets;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use track::{FilePlace, PreviewTrack};

/// Values and bad rows that are looked at, so that years of history cost a bounded time.
const MOST_VALUES: u64 = 2_000_000;
/// Bytes that are read at once.
const PIECE: usize = 64 * 1024;
/// What is said of a table of days where nothing says when they are counted from.
const DAY_ZERO: &str = "column \"t_days\": day 0 is taken as 2000-01-01T00:00:00Z; if it is another one, set epoch in [[source]] (--epoch)";
/// What every refusal of a value ahead of the clock is counted under.
const AHEAD: &str = "ahead of the clock";

/// Looks at the files of `config`.
pub fn preview(config: &Config) -> Preview {
    let mut look = PreviewSoFar {
        accepted: config.settings.accepted.clone(),
        stated: config.settings.covariates.clone(),
        declared: config.settings.declared.clone(),
        now: clock::now(),
        ..PreviewSoFar::default()
    };
    for source in &config.sources {
        look.source(source, &Decoder::new(source, &config.benchmarks));
    }
    let mut preview = look.finish(config);
    preview.without_readings = without_readings::without_readings(&preview, config);
    preview.absent = stated::absent(&preview, config);
    preview
}

/// What has been seen of one source.
#[derive(Debug)]
struct SourceSoFar {
    view: SourceView,
    files: Vec<PathBuf>,
    refused: RefusedKinds,
    /// What stands for no value in its files.
    marks: MissingValues,
}

impl SourceSoFar {
    fn name(&self, (file, line): FilePlace) -> String {
        let file = self
            .files
            .get(file)
            .map_or_else(String::new, |file| file.display().to_string());
        if line == 0 {
            file
        } else {
            format!("{file}, line {line}")
        }
    }
}

#[derive(Debug, Default)]
struct PreviewSoFar {
    sources: Vec<SourceSoFar>,
    benchmarks: BTreeMap<(String, BenchmarkId, Quantity), PreviewTrack>,
    covariates: BTreeMap<(String, String), PreviewCovariate>,
    ends: RefusedEnds,
    /// Sources that have readings of a benchmark which the config takes from another one.
    elsewhere: BTreeSet<(String, BenchmarkId)>,
    accepted: BTreeMap<BenchmarkId, BTreeSet<Suspicion>>,
    /// What the config states of covariates.
    stated: BTreeMap<String, CovariateKind>,
    declared: Vec<Declared>,
    values: u64,
    now: Timestamp,
}

impl PreviewSoFar {
    fn source(&mut self, source: &FileSource, decoder: &Decoder) {
        let mut so_far = SourceSoFar {
            view: SourceView {
                id: source.id.clone(),
                kind: source.kind.name(),
                path: source.pattern.to_string(),
                times: times(&source.conventions.clock, source.kind),
                files: 0,
                layouts: Vec::new(),
                refused: Vec::new(),
                remarks: Vec::new(),
                unwatched: BTreeSet::new(),
                missing: BTreeMap::new(),
                unread: BTreeMap::new(),
                unreadable: None,
            },
            files: Vec::new(),
            refused: RefusedKinds::default(),
            marks: source.conventions.missing.clone(),
        };
        match list(&source.pattern, decoder) {
            Ok((files, not_text)) => {
                so_far.files = files.into_iter().map(|(file, _)| file).collect();
                so_far.files.sort();
                let unreadable = not_text.iter().map(|file| {
                    format!(
                        "{}: its name is no UTF-8: it is not read; rename it",
                        file.display()
                    )
                });
                so_far.view.remarks.extend(unreadable);
            }
            Err(error) => {
                let folder = source.pattern.folder().display();
                let problem = format!("cannot list {folder}: {error}");
                so_far.view.cannot_be_read(problem);
                self.sources.push(so_far);
                return;
            }
        }
        so_far.view.files = so_far.files.len();
        for number in 0..so_far.files.len() {
            if self.values > MOST_VALUES {
                break;
            }
            match source.kind {
                SourceKind::Mcap => {
                    if let Err(problem) = self.recording(number, decoder, &mut so_far) {
                        so_far.refused.row(RefusedRow::of_text(problem));
                    }
                }
                SourceKind::Csv | SourceKind::Ndjson | SourceKind::Toa5 => {
                    let looked = self.text(number, decoder, &mut so_far);
                    if let Err(problem) = looked {
                        so_far.view.cannot_be_read(problem);
                    }
                }
            }
        }
        let elsewhere = self.elsewhere.iter().filter(|(id, _)| *id == source.id);
        so_far.view.remarks.extend(elsewhere.map(|(_, benchmark)| {
            format!(
                "it has readings of benchmark {:?}, which its [[benchmark]] takes from another source: they are not read",
                benchmark.as_str()
            )
        }));
        so_far.view.remarks.extend(decoder.doubtful_units());
        self.sources.push(so_far);
    }

    fn recording(
        &mut self,
        number: usize,
        decoder: &Decoder,
        so_far: &mut SourceSoFar,
    ) -> Result<(), String> {
        let file = so_far.files[number].clone();
        read_recording(&file, |found| {
            match found {
                Ok(item) => self.item(item, (number, 0), decoder, so_far),
                Err(row) => {
                    self.values += 1;
                    so_far.refused.row(row);
                }
            }
            self.values <= MOST_VALUES
        })
    }

    fn text(
        &mut self,
        number: usize,
        decoder: &Decoder,
        so_far: &mut SourceSoFar,
    ) -> Result<(), String> {
        let file = &so_far.files[number].clone();
        let Some(rows) = decoder.text_rows(file) else {
            return Ok(());
        };
        let fail = |error: io::Error| format!("cannot read {}: {error}", file.display());
        let mut reader: Box<dyn Read> = if is_packed(file) {
            Box::new(unpack(file).map_err(fail)?)
        } else {
            Box::new(File::open(file).map_err(fail)?)
        };
        let mut text = TextReader::new(rows);
        let mut piece = vec![0; PIECE];
        loop {
            let count = reader.read(&mut piece).map_err(fail)?;
            let bytes: &[u8] = match count {
                0 if text.is_within_a_line() && is_packed(file) => b"\n",
                count => &piece[..count],
            };
            let fed = text.feed(bytes);
            let is_lost = fed.is_lost;
            self.fed(fed, number, decoder, so_far);
            if count == 0 || is_lost || self.values > MOST_VALUES {
                break;
            }
        }
        let meanings = text.meanings();
        let view = &mut so_far.view;
        if decoder.is_day_zero_open() && meanings.iter().any(is_days) {
            let is_new = view.remarks.iter().all(|one| one != DAY_ZERO);
            view.remarks.extend(is_new.then(|| DAY_ZERO.to_owned()));
        }
        if text.is_within_a_line() && self.values <= MOST_VALUES {
            let file = file.display();
            view.remarks.push(format!(
                "{file}: its last line has no line break, and is read once it has one; after three rows that were ended only with the next one, at once"
            ));
        }
        let meant = |(name, meaning)| (name, decoder.meant(meaning));
        keep_layout(view, file, meanings.into_iter().map(meant).collect());
        Ok(())
    }

    fn fed(&mut self, fed: LinesRead, file: usize, decoder: &Decoder, so_far: &mut SourceSoFar) {
        self.ends
            .feed(&so_far.view.id, &fed, &so_far.name((file, 0)));
        for (line, item) in fed.items {
            self.item(item, (file, line), decoder, so_far);
        }
        let remarks = &mut so_far.view.remarks;
        for remark in fed.remarks {
            let is_new = remarks.iter().all(|one| !one.starts_with(&remark.about));
            remarks.extend(is_new.then(|| remark.to_string()));
        }
        for line in &fed.bad {
            self.values += 1;
            let name = so_far.name((file, 0));
            so_far.refused.row(RefusedRow::of_line(line, &name));
        }
    }

    fn item(&mut self, item: Item, place: FilePlace, decoder: &Decoder, so_far: &mut SourceSoFar) {
        self.values += 1;
        let benchmark = match &item {
            Item::Reading { benchmark, .. } => Some(benchmark.clone()),
            Item::Sample { .. } | Item::Missing { .. } => None,
        };
        match (decoder.arrival(item), benchmark) {
            (Some(arrival), _) => self.arrival(arrival, place, so_far),
            (None, Some(benchmark)) if decoder.is_elsewhere(&benchmark) => {
                let source = so_far.view.id.clone();
                self.elsewhere.insert((source, benchmark));
            }
            // Its other quantity is read.
            (None, Some(benchmark)) if decoder.knows(&benchmark) => {}
            (None, Some(benchmark)) => {
                so_far.view.unwatched.insert(benchmark);
            }
            (None, None) => {}
        }
    }

    fn arrival(&mut self, arrival: Arrival, place: FilePlace, so_far: &mut SourceSoFar) {
        let time = arrival.time;
        let why = untimely(time, self.now);
        if let Some(why) = why {
            let what = arrival.input.series_name().to_owned();
            let (kind, expected) = expected_time(why, time, self.now);
            let at = so_far.name(place);
            so_far.refused.count(kind, || {
                format!("{at}, {what:?}: found {time}, expected {expected}")
            });
        }
        let source = so_far.view.id.clone();
        if let Input::Missing {
            benchmark, what, ..
        } = arrival.input
        {
            Self::missing(benchmark, &what, so_far);
        } else if why.is_none()
            && let Input::Sample {
                channel,
                unit,
                sample,
            } = arrival.input
        {
            let stated = self.stated.get(&channel).copied();
            let view = CovariateView {
                kind: CovariateKind::stated_or_of(stated, &channel, unit.as_deref()),
                is_stated: stated.is_some(),
                name: channel,
                unit,
                source,
                values: 0,
                first: time,
                last: time,
                suspicions: Vec::new(),
                remarks: Vec::new(),
            };
            self.sample(view, sample.value);
        } else if why.is_none_or(|why| why == Untimely::Future)
            && let Input::Reading {
                benchmark,
                unit,
                reading,
                ..
            } = arrival.input
        {
            let key = (source.clone(), benchmark.clone(), unit.quantity());
            let accepted = self.accepted.get(&benchmark).cloned().unwrap_or_default();
            let here = Sample {
                time,
                value: reading.value,
            };
            let declared = &self.declared;
            let track = self.benchmarks.entry(key).or_insert_with(|| {
                let resets = DeclaredResets::of(declared, &benchmark);
                let view = BenchmarkPreview::new(benchmark, source, unit, here);
                PreviewTrack::new(view, unit, accepted, resets)
            });
            track.take(here, unit, place, why.is_some());
        }
    }

    /// A reading that should be there and is not.
    fn missing(benchmark: BenchmarkId, what: &str, so_far: &mut SourceSoFar) {
        // Of a component the mark is followed by its column.
        let mark = what.split(" in ").next().unwrap_or_default();
        let is_mark = what.starts_with("nothing in ") || mark == "null" || so_far.marks.has(mark);
        let view = &mut so_far.view;
        if !is_mark {
            *view.unread.entry(benchmark.clone()).or_default() += 1;
        }
        let (all, out_of_range) = view.missing.entry(benchmark).or_default();
        *all += 1;
        *out_of_range += u64::from(MissingValues::is_out_of_range(mark));
    }

    fn sample(&mut self, one: CovariateView, value: f64) {
        let here = Sample {
            time: one.first,
            value,
        };
        let key = (one.source.clone(), one.name.clone());
        let so_far = self.covariates.entry(key);
        so_far
            .or_insert_with(|| PreviewCovariate::new(one))
            .take(here);
    }

    /// Why the readings that lie ahead of the clock are taken; `None` where they are refused. A daemon on a first start
    /// judges by the files whether the clock is wrong, and one with a state has shown there whether it found it so.
    fn why_ahead_is_taken(&self, state_dir: &Path) -> Option<&'static str> {
        if matches!(Store::file(state_dir).try_exists(), Ok(false)) {
            return self.proves_the_clock_wrong().then_some(
                "readings go on beyond this machine's clock: a daemon that starts now, on a new state, takes them, and reports its clock as wrong",
            );
        }
        let known = Store::look(state_dir).and_then(|store| store.benchmarks());
        let newest = known.ok()?.into_values().max()?;
        (newest.duration_since(self.now) > clock::TOLERANCE).then_some(
            "readings go on beyond this machine's clock: the daemon has taken such, and reports its clock as wrong",
        )
    }

    /// Whether a daemon on a first start would take the readings that lie ahead of the clock, and call the clock wrong.
    fn proves_the_clock_wrong(&self) -> bool {
        let mut unproven = Unproven::default();
        for ((_, id, _), track) in &self.benchmarks {
            let (ahead, newest) = track.times_ahead();
            let Some(newest) = newest else { continue };
            unproven.comes(id, newest);
            for time in ahead {
                unproven.continues(id, time, newest);
            }
        }
        unproven.proven(self.now).is_some()
    }

    fn finish(mut self, config: &Config) -> Preview {
        let taken = self.why_ahead_is_taken(&config.site.state_dir);
        let mut benchmarks = Vec::new();
        for ((id, ..), track) in std::mem::take(&mut self.benchmarks) {
            let so_far = self.sources.iter().find(|one| one.view.id == id);
            let source = config.sources.iter().find(|one| one.id == id);
            let clock = source.map(|source| &source.conventions.clock);
            let name = |place| so_far.map_or_else(String::new, |one| one.name(place));
            let mut view = track.finish(self.now, taken.is_some(), clock, &name);
            let missing = so_far.and_then(|one| one.view.missing.get(&view.id));
            (view.missing, view.out_of_range) = missing.copied().unwrap_or_default();
            benchmarks.push(view);
        }
        doubt_second_quantities(&mut benchmarks);
        let sources = self.sources.into_iter().map(|mut one| {
            if let Some(why) = taken
                && one.refused.forget(AHEAD)
            {
                one.view.remarks.push(why.to_owned());
            }
            one.view.refused = one.refused.sorted();
            one.view
        });
        let sources: Vec<SourceView> = sources.collect();
        Preview {
            is_whole: self.values <= MOST_VALUES,
            unwatched: (sources.iter())
                .flat_map(|one| one.unwatched.iter().cloned())
                .collect(),
            sources,
            benchmarks,
            covariates: (self.covariates.into_values())
                .map(PreviewCovariate::finish)
                .collect(),
            refused_ends: self.ends.lines(),
            without_readings: Vec::new(),
            absent: Vec::new(),
        }
    }
}

/// The kind of a refusal by time, and what was expected.
fn expected_time(why: Untimely, time: Timestamp, now: Timestamp) -> (&'static str, String) {
    match why {
        Untimely::Future => {
            let hint = suspicion::like_a_zone(time.duration_since(now));
            let hint = hint.map_or_else(String::new, |hint| format!("; {hint}"));
            let expected = format!(
                "a time no more than an hour ahead of this machine's clock, {now:.0}{hint}"
            );
            (AHEAD, expected)
        }
        Untimely::BeforeAll => ("too early", "a time from 1678 on".to_owned()),
        Untimely::WithoutClock => (
            "no clock",
            "another day than the first of 1970, where a logger starts whose clock is not set"
                .to_owned(),
        ),
    }
}

/// Whether a column gives times in days.
fn is_days((name, meaning): &(String, Meaning)) -> bool {
    *meaning == Meaning::Time && name.eq_ignore_ascii_case("t_days")
}

/// The monitor goes by the quantity of a benchmark that it reads first.
fn doubt_second_quantities(benchmarks: &mut [BenchmarkPreview]) {
    let all: Vec<(BenchmarkId, Quantity)> = benchmarks
        .iter()
        .map(|one| (one.id.clone(), one.quantity))
        .collect();
    for one in benchmarks {
        let is_other =
            |(id, quantity): &&(BenchmarkId, Quantity)| *id == one.id && *quantity != one.quantity;
        if let Some((_, other)) = all.iter().find(is_other) {
            one.remarks.push(format!(
                "its files have its {other} too, and the one that is read first is monitored: write quantity = \"{}\" or quantity = \"{other}\" for this benchmark",
                one.quantity
            ));
        }
    }
}

fn times(clock: &LocalClock, kind: SourceKind) -> String {
    let name = clock.zone.as_ref().and_then(|zone| zone.iana_name());
    let summer = match clock.summer_time {
        SummerTime::Standard => ", winter time all year",
        SummerTime::Reject | SummerTime::Earlier | SummerTime::Later => "",
    };
    match (name, kind) {
        (_, SourceKind::Mcap) | (None, SourceKind::Toa5) => "in UTC".to_owned(),
        (Some(zone), _) => format!("with an offset, or in {zone}{summer}"),
        (None, SourceKind::Csv | SourceKind::Ndjson) => "with an offset".to_owned(),
    }
}
