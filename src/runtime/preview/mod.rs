//! What the files of a site hold now, as the daemon would take it: a look before it starts.

mod view;

pub use view::{
    BenchmarkPreview, ColumnView, CovariateView, LayoutView, Preview, Refusal, SourceView, Unfed,
};

use super::clock;
use super::ingest::{IngestError, Item, Meaning, ReadOptions, is_packed, read_files, unpack};
use super::tail::{Arrival, BadLine, Decoder, LinesRead, TextReader, list};
use crate::config::{Config, FileSource, SourceKind};
use crate::monitor::Input;
use crate::reading::{
    BenchmarkId, LocalClock, Quantity, Recording, SummerTime, Suspicion, Timestamp, suspicion,
};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Values that are looked at, so that years of history cost a bounded time.
const MOST_VALUES: u64 = 2_000_000;
/// Readings of a benchmark that say how often it is measured, the latest.
const LATEST: usize = 200;
/// Readings from which on a sign is doubted, where of all that they go by this share is backwards.
const FEWEST_STEPS: usize = 10;
const HALF: f64 = 0.5;
/// Bytes that are read at once.
const PIECE: usize = 64 * 1024;

/// Looks at the files of `config`.
pub fn preview(config: &Config) -> Preview {
    let mut look = PreviewSoFar {
        accepted: config.settings.accepted.clone(),
        ..PreviewSoFar::default()
    };
    for source in &config.sources {
        let view = look.source(source, &Decoder::new(source, &config.benchmarks));
        look.views.push(view);
    }
    let unfed = look.unfed(config);
    let now = clock::now();
    Preview {
        is_whole: look.values <= MOST_VALUES,
        sources: look.views,
        benchmarks: look
            .benchmarks
            .into_values()
            .map(|track| track.finish(now))
            .collect(),
        covariates: look.covariates.into_values().collect(),
        unwatched: look.unwatched,
        unfed,
    }
}

#[derive(Debug)]
struct PreviewTrack {
    view: BenchmarkPreview,
    /// Suspicions that people have looked into.
    accepted: BTreeSet<Suspicion>,
    readings: Vec<(Timestamp, f64)>,
}

#[derive(Debug, Default)]
struct PreviewSoFar {
    views: Vec<SourceView>,
    benchmarks: BTreeMap<(String, BenchmarkId, Quantity), PreviewTrack>,
    covariates: BTreeMap<(String, String), CovariateView>,
    unwatched: BTreeSet<BenchmarkId>,
    /// Sources that have readings of a benchmark which the config takes from another one.
    elsewhere: BTreeSet<(String, BenchmarkId)>,
    accepted: BTreeMap<BenchmarkId, BTreeSet<Suspicion>>,
    values: u64,
}

/// What is wrong with lines, by kind.
type Refusals = BTreeMap<String, Refusal>;

impl PreviewSoFar {
    fn source(&mut self, source: &FileSource, decoder: &Decoder) -> SourceView {
        let mut view = SourceView {
            id: source.id.clone(),
            kind: source.kind.name(),
            path: source.pattern.to_string(),
            times: times(&source.conventions.clock, source.kind),
            files: 0,
            layouts: Vec::new(),
            refused: Vec::new(),
            remarks: Vec::new(),
        };
        let (mut files, not_text) = match list(&source.pattern, decoder) {
            Ok(listed) => listed,
            Err(error) => {
                let folder = source.pattern.folder().display();
                view.remarks.push(format!("cannot list {folder}: {error}"));
                return view;
            }
        };
        files.sort_by(|one, other| one.0.cmp(&other.0));
        view.files = files.len();
        let unreadable = not_text.iter().map(|file| {
            format!(
                "{}: its name is no UTF-8: it is not read; rename it",
                file.display()
            )
        });
        view.remarks.extend(unreadable);
        let mut refused = Refusals::new();
        for (file, _) in files {
            if self.values > MOST_VALUES {
                break;
            }
            let looked = match source.kind {
                SourceKind::Mcap => self.recording(&file, &source.id, decoder),
                SourceKind::Csv | SourceKind::Ndjson | SourceKind::Toa5 => {
                    self.text(&file, decoder, &mut view, &mut refused)
                }
            };
            if let Err(problem) = looked {
                view.remarks.push(problem);
            }
        }
        let elsewhere = self.elsewhere.iter().filter(|(id, _)| *id == source.id);
        view.remarks.extend(elsewhere.map(|(_, benchmark)| {
            format!(
                "it has readings of benchmark {:?}, which its [[benchmark]] takes from another source: they are not read",
                benchmark.as_str()
            )
        }));
        view.remarks.extend(decoder.doubtful_units());
        view.refused = refused.into_values().collect();
        view.refused.sort_by_key(|refusal| Reverse(refusal.rows));
        view
    }

    fn recording(&mut self, file: &Path, source: &str, decoder: &Decoder) -> Result<(), String> {
        let read = read_files(&[file.to_owned()], &ReadOptions::default());
        let (
            Recording {
                series, channels, ..
            },
            _,
        ) = read.map_err(|error| error.to_string())?;
        for series in series {
            for reading in series.readings {
                let (benchmark, unit) = (series.benchmark.clone(), series.unit);
                let averaging = series.averaging;
                let item = Item::Reading {
                    benchmark,
                    unit,
                    averaging,
                    reading,
                };
                self.item(item, source, decoder);
            }
        }
        for channel in channels {
            for sample in channel.samples {
                let (channel, unit) = (channel.name.clone(), channel.unit.clone());
                let item = Item::Sample {
                    channel,
                    unit,
                    sample,
                };
                self.item(item, source, decoder);
            }
        }
        Ok(())
    }

    fn text(
        &mut self,
        file: &Path,
        decoder: &Decoder,
        view: &mut SourceView,
        refused: &mut Refusals,
    ) -> Result<(), String> {
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
            self.fed(fed, decoder, view, refused);
            if count == 0 || is_lost || self.values > MOST_VALUES {
                break;
            }
        }
        if text.is_within_a_line() && self.values <= MOST_VALUES {
            let file = file.display();
            view.remarks.push(format!(
                "{file}: its last line has no line break, and is read once it has one"
            ));
        }
        keep_layout(view, file, text.meanings());
        Ok(())
    }

    fn fed(
        &mut self,
        fed: LinesRead,
        decoder: &Decoder,
        view: &mut SourceView,
        refused: &mut Refusals,
    ) {
        for item in fed.items {
            self.item(item, &view.id, decoder);
        }
        for remark in fed.remarks {
            let is_new = view
                .remarks
                .iter()
                .all(|one| !one.starts_with(&remark.about));
            view.remarks.extend(is_new.then(|| remark.to_string()));
        }
        for line in &fed.bad {
            let refusal = refused.entry(kind_of(line)).or_insert_with(|| Refusal {
                rows: 0,
                first: shown(line),
            });
            refusal.rows += 1;
        }
    }

    fn item(&mut self, item: Item, source: &str, decoder: &Decoder) {
        self.values += 1;
        let benchmark = match &item {
            Item::Reading { benchmark, .. } => Some(benchmark.clone()),
            Item::Sample { .. } | Item::Missing { .. } => None,
        };
        match (decoder.arrival(item), benchmark) {
            (Some(arrival), _) => self.arrival(arrival, source),
            (None, Some(benchmark)) if decoder.is_elsewhere(&benchmark) => {
                self.elsewhere.insert((source.to_owned(), benchmark));
            }
            (None, Some(benchmark)) => {
                self.unwatched.insert(benchmark);
            }
            (None, None) => {}
        }
    }

    fn arrival(&mut self, arrival: Arrival, source: &str) {
        let time = arrival.time;
        if let Input::Sample { channel, unit, .. } = arrival.input {
            let key = (source.to_owned(), channel.clone());
            let view = self.covariates.entry(key).or_insert_with(|| CovariateView {
                name: channel,
                unit,
                source: source.to_owned(),
                values: 0,
                first: time,
                last: time,
            });
            view.values += 1;
            (view.first, view.last) = (view.first.min(time), view.last.max(time));
        } else if let Input::Reading {
            benchmark,
            unit,
            reading,
            ..
        } = arrival.input
        {
            let key = (source.to_owned(), benchmark.clone(), unit.quantity());
            let here = (time, reading.value);
            let accepted = self.accepted.get(&benchmark).cloned().unwrap_or_default();
            let track = self.benchmarks.entry(key).or_insert_with(|| PreviewTrack {
                view: BenchmarkPreview {
                    id: benchmark,
                    source: source.to_owned(),
                    quantity: unit.quantity(),
                    unit: unit.to_string(),
                    readings: 0,
                    first: here,
                    last: here,
                    every_s: None,
                    suspicions: Vec::new(),
                },
                accepted,
                readings: Vec::new(),
            });
            track.take(here);
        }
    }

    /// What the config names and the files do not have.
    fn unfed(&self, config: &Config) -> Vec<Unfed> {
        if self.values > MOST_VALUES {
            return Vec::new();
        }
        let mut unfed = Vec::new();
        for view in &self.views {
            let has = |id: &BenchmarkId| {
                self.benchmarks
                    .keys()
                    .any(|key| key.0 == view.id && key.1 == *id)
            };
            let mut named = config
                .benchmarks
                .iter()
                .filter(|one| one.source == view.id)
                .peekable();
            let is_open = named.peek().is_none();
            let absent = named
                .filter(|one| !has(&one.id))
                .map(|one| Some(one.id.clone()));
            let mut absent: Vec<Option<BenchmarkId>> = absent.collect();
            if is_open
                && view.files > 0
                && self.benchmarks.keys().all(|key| key.0 != view.id)
                && self.covariates.keys().all(|key| key.0 != view.id)
            {
                absent.push(None);
            }
            unfed.extend(absent.into_iter().map(|benchmark| Unfed {
                text: self.why(view, benchmark.as_ref()),
                benchmark,
                source: view.id.clone(),
            }));
        }
        if unfed.is_empty() && self.benchmarks.is_empty() && config.brokers.is_empty() {
            unfed.push(Unfed {
                benchmark: None,
                source: String::new(),
                text: format!(
                    "no file has readings of a benchmark: nothing is watched; {NAME_THEM}"
                ),
            });
        }
        unfed
    }

    fn why(&self, view: &SourceView, benchmark: Option<&BenchmarkId>) -> String {
        let SourceView { id, path, .. } = view;
        let whose = benchmark.map_or_else(
            || format!("source {id:?}"),
            |benchmark| format!("benchmark {:?}", benchmark.as_str()),
        );
        if view.files == 0 {
            return format!("{whose}: there is no file {path}; is the path right?");
        }
        if benchmark.is_none() {
            return format!("{whose}: its files have no reading of any benchmark; {NAME_THEM}");
        }
        let others: Vec<&str> = self.unwatched.iter().map(BenchmarkId::as_str).collect();
        let hint = match &others[..] {
            [] => NAME_THEM.to_owned(),
            others => format!(
                "they have {}, which no [[benchmark]] names; is the id right?",
                others.join(", ")
            ),
        };
        format!(
            "{whose}: the files that are there have no reading of it, and it is not watched; {hint}"
        )
    }
}

/// How a column comes to be a benchmark's.
const NAME_THEM: &str = "name the column [ID_]displacement_UNIT or [ID_]velocity_UNIT, or say in [[benchmark]] its column and unit";

impl PreviewTrack {
    fn take(&mut self, here: (Timestamp, f64)) {
        let view = &mut self.view;
        view.readings += 1;
        if here.0 < view.first.0 {
            view.first = here;
        }
        if here.0 >= view.last.0 {
            view.last = here;
        }
        self.readings.push(here);
    }

    fn finish(mut self, now: Timestamp) -> BenchmarkPreview {
        let times: BTreeSet<Timestamp> = self.readings.iter().map(|reading| reading.0).collect();
        let latest: Vec<Timestamp> = times.into_iter().rev().take(LATEST).collect();
        let pairs = latest.iter().zip(latest.iter().skip(1));
        let mut gaps: Vec<i64> = pairs.map(|(b, a)| b.duration_since(*a).as_secs()).collect();
        gaps.sort_unstable();
        self.view.every_s = gaps.get(gaps.len() / 2).copied();
        self.view.suspicions = self.suspicions(now);
        self.view
    }

    fn suspicions(&mut self, now: Timestamp) -> Vec<String> {
        self.readings.sort_by_key(|(time, _)| *time);
        let BenchmarkPreview {
            last,
            quantity,
            unit,
            ..
        } = &self.view;
        let ahead = suspicion::ahead(last.0, now).into_iter();
        let all = ahead.chain(suspicion::of_values(&self.readings, *quantity, unit));
        let not_accepted = all.filter(|one| !self.accepted.contains(&one.kind));
        let texts = not_accepted.map(|one| one.text);
        texts.chain(self.moves_backwards()).collect()
    }

    /// What to do where the displacement falls all along.
    fn moves_backwards(&self) -> Option<String> {
        let steps = self.readings.windows(2).map(|pair| pair[1].1 - pair[0].1);
        let (mut sum, mut sizes) = (0.0, 0.0);
        for step in steps {
            sum += step;
            sizes += step.abs();
        }
        let is_displacement = self.view.quantity == Quantity::Displacement;
        let is_known = self.accepted.contains(&Suspicion::Fall);
        let falls = is_displacement
            && !is_known
            && self.readings.len() >= FEWEST_STEPS
            && sum < -HALF * sizes;
        falls.then(|| {
            "its displacement falls: motion counts as positive, and a slope that moves backwards calls no red; if its sign is \
             the other way, write components = [\"COLUMN\"] and direction = [-1.0] for this benchmark"
                .to_owned()
        })
    }
}

fn keep_layout(view: &mut SourceView, file: &Path, meanings: Vec<(String, Meaning)>) {
    let columns: Vec<ColumnView> = meanings
        .into_iter()
        .map(|(name, meaning)| ColumnView { name, meaning })
        .collect();
    if columns.is_empty() {
        return;
    }
    match view
        .layouts
        .iter_mut()
        .find(|layout| layout.columns == columns)
    {
        Some(layout) => layout.files += 1,
        None => view.layouts.push(LayoutView {
            file: file.to_owned(),
            files: 1,
            columns,
        }),
    }
}

/// Two lines with the same are wrong in the same way.
fn kind_of(line: &BadLine) -> String {
    match line.error.downcast_ref::<IngestError>() {
        Some(IngestError::Field {
            column, expected, ..
        }) => format!("{column} {expected}"),
        _ => line
            .error
            .to_string()
            .replace(|c: char| c.is_ascii_digit(), ""),
    }
}

fn shown(line: &BadLine) -> String {
    let text = line.error.to_string();
    if line.error.is::<IngestError>() {
        text
    } else {
        format!("line {}: {text}", line.number)
    }
}

fn times(clock: &LocalClock, kind: SourceKind) -> String {
    let name = clock.zone.as_ref().and_then(|zone| zone.iana_name());
    let summer = match clock.summer_time {
        SummerTime::Standard => ", winter time all year",
        SummerTime::Reject | SummerTime::Earlier | SummerTime::Later => "",
    };
    match (name, kind) {
        (_, SourceKind::Mcap) => "instants".to_owned(),
        (Some(zone), _) => format!("with an offset, or in {zone}{summer}"),
        (None, SourceKind::Toa5) => "in UTC".to_owned(),
        (None, SourceKind::Csv | SourceKind::Ndjson) => "with an offset".to_owned(),
    }
}
