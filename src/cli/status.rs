//! `status`: how a site stands, with or without a running daemon.

use super::args::OutputFormat;
use super::preview::shown;
use super::state::SiteArgs;
use super::table::TextTable;
use super::text;
use crate::alert::{Level, chance_in_words};
use crate::monitor::{
    CalledLevel, ChancesOfCollapse, Event, EventKind, KindShown, SUSPECT, SUSPECT_ENDS,
};
use crate::reading::{BEFORE_ALL, BenchmarkId, Timestamp, figure};
use crate::runtime::alarm_state::{AlarmState, Alarms};
use crate::runtime::clock;
use crate::runtime::drilled::DrillRecord;
use crate::runtime::preview::{Preview, preview};
use crate::runtime::recorded::RecordStanding;
use crate::runtime::reloaded::{ConfigRefusal, sources_without_files};
use crate::runtime::service_faults::{ServiceFault, faults_in};
use crate::runtime::standing::{InForce, TakenOrders, closed, every, in_force};
use crate::store::Store;
use jiff::{SignedDuration, tz::TimeZone};
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::io::{self, IsTerminal, Write};
use std::time::Duration;

/// Say what a site's benchmarks do: level, regime, failure time, newest reading
#[derive(Debug, clap::Args)]
pub(super) struct StatusArgs {
    #[command(flatten)]
    site: SiteArgs,
    /// Also what the files of its sources hold now, as check shows it: the last row of each benchmark and covariate,
    /// rows that are refused
    #[arg(long)]
    sources: bool,
    /// Say it again every two seconds, until interrupted
    #[arg(long)]
    watch: bool,
}

/// How often `--watch` reads the state.
const POLL_INTERVAL: Duration = Duration::from_secs(2);
/// Of the table, in characters: that of the terminals on which it is read.
const WIDTH: usize = 80;
/// What a line begins with that goes on with the one before it.
const CONTINUED: &str = "    ";
/// Puts a terminal's cursor at the top of an empty screen.
const CLEAR_SCREEN: &str = "\u{1b}[H\u{1b}[2J";

/// How one benchmark stands.
#[derive(Debug, JsonSchema, Serialize)]
pub(super) struct StatusStanding {
    /// Which.
    benchmark: BenchmarkId,
    /// The level in force.
    level: Level,
    /// How its alarm stands, by the names of ISA-18.2.
    alarm_state: AlarmState,
    /// Since when.
    since: Option<Timestamp>,
    /// Since when nothing can be said of it: no data, a sensor fault. Null too where it has been so before any reading.
    unknown_since: Option<Timestamp>,
    /// Whether nothing can be said of it now; so it is before its first reading.
    is_unknown: bool,
    /// When its newest reading was measured.
    newest_reading: Option<Timestamp>,
    /// The regime at the newest refit.
    regime: Option<String>,
    /// The velocity then.
    velocity_mm_per_day: Option<f64>,
    /// The median of the forecast of collapse then.
    failure_time: Option<Timestamp>,
    /// How likely it was then that a collapse comes at all.
    chances_of_collapse: Option<ChancesOfCollapse>,
    /// The chance of collapse within the evacuation time then.
    chance_within_evacuation_time: Option<f64>,
    /// The level that the newest forecast calls for, and the chances that levels are called by.
    called: Option<CalledLevel>,
    /// Why it is at its level.
    reason: Option<String>,
    /// Why nothing can be said of it.
    unknown_reason: Option<String>,
    /// What its readings hardly mean.
    suspicions: Vec<String>,
}

/// How a site stands.
#[derive(Debug, JsonSchema, Serialize)]
pub(super) struct SiteStatus {
    /// Its name.
    site: String,
    /// Each benchmark.
    benchmarks: Vec<StatusStanding>,
    /// Inputs taken.
    steps: i64,
    /// Alerts that wait for a hook.
    alerts_waiting: usize,
    /// Size of the state on the disk.
    bytes: u64,
    /// Since when nothing can be said of the site: too many benchmarks are unknown, or the clock is wrong.
    site_unknown_since: Option<Timestamp>,
    /// Whether a daemon watches the site now.
    is_running: bool,
    /// The alerts in force.
    alerts: Vec<Event>,
    /// Acknowledgements of them.
    acknowledged: Vec<Event>,
    /// The alerts that have ended and that nobody has acknowledged, the newest of each place.
    returned: Vec<Event>,
    /// When each of these ended.
    returned_ended: Vec<Timestamp>,
    /// The orders by which no hook is run.
    silences: Vec<Event>,
    /// Alerts in force that a hook did not take and will not: it is not in the config any more.
    closed: Vec<Event>,
    /// Lines, records and files that could not be used, a source.
    quarantined: BTreeMap<String, u64>,
    /// How drills stand, where they are held.
    drill: Option<DrillRecord>,
    /// Whether no drill has passed for too long.
    is_drill_overdue: bool,
    /// How the record in MCAP files stands, where one is kept.
    record: Option<RecordStanding>,
    /// Why the config file as it is now is not in force; null where it is.
    config_refusal: Option<ConfigRefusal>,
    /// What lasts and keeps the daemon that runs from its work.
    faults: Vec<ServiceFault>,
    /// Sources of which there is no file now, a line each.
    sources_without_files: Vec<String>,
    /// What the files hold, where that was asked for.
    preview: Option<Preview>,
    /// The sources that are brokers: what could not be used of them is in no file.
    #[serde(skip)]
    brokers: BTreeSet<String>,
}

/// Says how the site stands, once or until interrupted.
pub(super) fn status(args: &StatusArgs) -> anyhow::Result<()> {
    loop {
        // Looked up before the screen is emptied, so that it does not flicker.
        let status = gathered(args)?;
        if args.watch && args.site.output.format == OutputFormat::Text && io::stdout().is_terminal()
        {
            write!(io::stdout(), "{CLEAR_SCREEN}")?;
        }
        let (status, zone) = &status;
        args.site.output.print(status, |status| {
            let preview = status.preview.as_ref();
            let files = preview.map_or_else(String::new, |preview| shown(preview, zone));
            status_text(status, zone) + &files
        })?;
        if !args.watch {
            return Ok(());
        }
        std::thread::sleep(POLL_INTERVAL);
    }
}

fn gathered(args: &StatusArgs) -> anyhow::Result<(SiteStatus, TimeZone)> {
    let (config, store) = args.site.open()?;
    let (levels, orders) = (in_force(&store, None)?, TakenOrders::read(&store, None)?);
    let (refits, faults) = (newest_refits(&store)?, faults_in(&config.site.state_dir));
    let suspicions = suspicions(&store)?;
    let alarms = Alarms::read(&store, None, clock::now(), &config.settings.declared)?;
    let mut newest: BTreeMap<BenchmarkId, Option<Timestamp>> = BTreeMap::new();
    newest.extend(config.benchmarks.iter().map(|one| (one.id.clone(), None)));
    let watched = &config.settings.watched;
    // What is known of one that is not watched any more is of the past.
    let read = (store.benchmarks()?.into_iter()).filter(|(id, _)| watched.includes(id));
    newest.extend(read.map(|(benchmark, time)| (benchmark, Some(time))));
    let each = newest.into_iter().map(|(benchmark, newest)| {
        let standing = StatusStanding {
            level: Level::Green,
            since: None,
            unknown_since: None,
            is_unknown: newest.is_none(),
            newest_reading: newest,
            regime: None,
            velocity_mm_per_day: None,
            failure_time: None,
            chances_of_collapse: None,
            chance_within_evacuation_time: None,
            called: None,
            alarm_state: AlarmState::Normal,
            reason: None,
            unknown_reason: None,
            suspicions: suspicions.get(&benchmark).cloned().unwrap_or_default(),
            benchmark,
        };
        let mut standing = stands(standing, &levels, &refits);
        standing.alarm_state = alarms.state(Some(&standing.benchmark), standing.called.as_ref());
        standing
    });
    let preview = args.sources.then(|| preview(&config));
    let drill = config.drill.as_ref();
    let drill = drill.and_then(|_| DrillRecord::read(&config.site.state_dir));
    let sources_without_files = sources_without_files(&config);
    let is_running = Store::is_held(&config.site.state_dir);
    let zone = config.site.time_zone;
    let returned = alarms.returned();
    let status = SiteStatus {
        site: config.site.name,
        benchmarks: each.collect(),
        steps: store.last_step(),
        alerts_waiting: store.waiting()?.len(),
        bytes: store.bytes()?,
        site_unknown_since: levels.get(&(None, Level::Unknown)).and_then(dated),
        is_running,
        acknowledged: orders.acknowledged(&levels),
        returned_ended: returned.iter().map(|one| one.ended).collect(),
        returned: returned.into_iter().map(|one| one.event).collect(),
        silences: orders.silences(clock::now()),
        closed: closed(&store, &levels)?,
        quarantined: store.quarantined()?,
        alerts: levels.into_values().collect(),
        is_drill_overdue: drill
            .as_ref()
            .is_some_and(|drill| drill.is_overdue(clock::now())),
        drill,
        record: (config.site.record.as_ref())
            .and_then(|_| RecordStanding::read(&config.site.state_dir)),
        // Nothing is in force where no daemon runs; the next one takes the file as it is then.
        config_refusal: ConfigRefusal::read(&config.site.state_dir).filter(|_| is_running),
        faults: if is_running { faults } else { Vec::new() },
        sources_without_files,
        preview,
        brokers: config.brokers.into_iter().map(|one| one.id).collect(),
    };
    Ok((status, zone))
}

/// The newest refit of each benchmark.
fn newest_refits(store: &Store) -> anyhow::Result<BTreeMap<BenchmarkId, EventKind>> {
    let mut refits = BTreeMap::new();
    for body in store.latest(KindShown::REFIT.name)? {
        let event: Event = serde_json::from_str(&body)?;
        if let Some(benchmark) = event.benchmark {
            refits.insert(benchmark, event.kind);
        }
    }
    Ok(refits)
}

impl StatusStanding {
    /// The chance that red is called by; in states of older versions that within the evacuation time.
    fn chance(&self) -> Option<f64> {
        let called = self.called.as_ref();
        called.map_or(self.chance_within_evacuation_time, |called| {
            Some(called.red.chance)
        })
    }
}

fn stands(
    mut standing: StatusStanding,
    levels: &InForce,
    refits: &BTreeMap<BenchmarkId, EventKind>,
) -> StatusStanding {
    for ((place, level), event) in levels {
        if place.as_ref() != Some(&standing.benchmark) {
            continue;
        }
        let reason = if let EventKind::Alert { text, .. } = &event.kind {
            Some(text.clone())
        } else {
            None
        };
        if *level == Level::Unknown {
            (standing.unknown_since, standing.is_unknown) = (dated(event), true);
            standing.unknown_reason = reason;
        } else {
            (standing.level, standing.since) = (*level, Some(event.time));
            standing.reason = reason;
        }
    }
    if let Some(EventKind::Refit {
        regime,
        failure_time,
        chances_of_collapse,
        velocity_mm_per_day,
        chance_within_evacuation_time,
        called,
        ..
    }) = refits.get(&standing.benchmark)
    {
        standing.regime = Some(regime.label.to_string());
        standing.velocity_mm_per_day = *velocity_mm_per_day;
        standing.failure_time = failure_time.median;
        standing.chances_of_collapse = chances_of_collapse.as_deref().copied();
        standing.chance_within_evacuation_time = Some(*chance_within_evacuation_time);
        standing.called = called.as_deref().cloned();
    }
    standing
}

/// When it was said; before the first reading there is no data time.
fn dated(event: &Event) -> Option<Timestamp> {
    Some(event.time).filter(|time| *time > BEFORE_ALL)
}

/// The suspicions that have not ended, by benchmark.
fn suspicions(store: &Store) -> anyhow::Result<BTreeMap<BenchmarkId, Vec<String>>> {
    let mut open: BTreeMap<(BenchmarkId, String), String> = BTreeMap::new();
    for event in every(store, KindShown::FAULT.name)? {
        let (Some(benchmark), EventKind::Fault { kind, text }) = (event.benchmark, event.kind)
        else {
            continue;
        };
        if !kind.starts_with(SUSPECT) {
            continue;
        }
        match kind.strip_suffix(SUSPECT_ENDS) {
            Some(begun) => open.remove(&(benchmark, begun.to_owned())),
            None => open.insert((benchmark, kind), text),
        };
    }
    let mut all: BTreeMap<BenchmarkId, Vec<String>> = BTreeMap::new();
    for ((benchmark, _), text) in open {
        all.entry(benchmark).or_default().push(text);
    }
    Ok(all)
}

/// Of a collapse forecast within so long of the newest reading the time of the day is given too.
const CLOCK_WITHIN: SignedDuration = SignedDuration::from_hours(72);

fn status_text(status: &SiteStatus, zone: &TimeZone) -> String {
    let mut table = TextTable::headed([
        "benchmark",
        "level",
        "newest reading",
        "mm/day",
        "collapse",
        "chance",
    ]);
    let clock = |time: Timestamp| text::clock(time, zone);
    let dash = || "-".to_owned();
    for one in &status.benchmarks {
        let velocity = one.velocity_mm_per_day;
        let day = |time: Timestamp| match one.newest_reading {
            Some(newest) if time <= newest + CLOCK_WITHIN => clock(time),
            Some(_) | None => time.to_zoned(zone.clone()).strftime("%Y-%m-%d").to_string(),
        };
        table.row([
            text::plain(one.benchmark.as_str()),
            // Since when, and why, stands below the table.
            match (one.is_unknown, one.since) {
                (true, Some(_)) => format!("{}, unknown", one.level),
                (true, None) => "unknown".to_owned(),
                (false, _) if one.alarm_state == AlarmState::OutOfService => {
                    format!("{}, out of service", one.level)
                }
                (false, _) => one.level.to_string(),
            },
            one.newest_reading.map_or_else(dash, clock),
            velocity.map_or_else(dash, |velocity| figure(velocity, 3)),
            one.failure_time.map_or_else(dash, day),
            chance(one.chance()),
        ]);
    }
    let lines = |events: &[Event]| -> String {
        events
            .iter()
            .map(|event| text::line(event, zone) + "\n")
            .collect()
    };
    let table = table.within(WIDTH);
    let dead = if status.is_running {
        ""
    } else {
        "NO DAEMON RUNS: nothing is watched; what follows is as of its last reading\n"
    };
    let refused = not_used(status, zone);
    let suspicions = status.benchmarks.iter().flat_map(|one| &one.suspicions);
    let suspicions: String = suspicions
        .map(|one| text::local(&text::plain(one), zone) + "\n")
        .collect();
    let head = format!(
        "{dead}{}: {} inputs taken, {} alerts wait for a hook\n{}{}{}{}{}{refused}{suspicions}",
        text::plain(&status.site),
        status.steps,
        status.alerts_waiting,
        lines(&status.silences),
        lines(&status.acknowledged),
        lines(&status.closed),
        drilled(status, zone),
        recorded(status, zone),
    );
    let legend = "collapse: median of the forecast, on the early side\nchance: of collapse within twice the evacuation time (or red_within) of the next\n\
                  reading, by which red is called";
    let ended = status.returned.iter().zip(&status.returned_ended);
    let alerts = text::listed("in force", &status.alerts, zone) + &text::returned(ended, zone);
    format!("{}\n{table}{legend}\n{}", folded(&head), folded(&alerts))
}

/// What is not used or not judged, a line each: what sources could not give, and readings under maintenance.
fn not_used(status: &SiteStatus, zone: &TimeZone) -> String {
    let mut lines = String::new();
    if let Some(why) = status
        .config_refusal
        .as_ref()
        .and_then(|one| one.refused.as_ref())
    {
        let why = text::plain(why);
        let _ = writeln!(
            lines,
            "CONFIG NOT TAKEN at its reload, the one before is in force: {why}"
        );
    }
    for fault in &status.faults {
        let source = fault.source.as_ref();
        let source = source.map_or_else(String::new, |source| format!("source {source}: "));
        let text = text::plain(&format!("{source}{}", fault.text));
        let since = text::clock(fault.since, zone);
        let _ = writeln!(lines, "FAULT since {since}: {text}");
    }
    for line in &status.sources_without_files {
        let _ = writeln!(lines, "{}", text::plain(line));
    }
    for (source, count) in &status.quarantined {
        let (what, shown) = if status.brokers.contains(source) {
            let shown = "the daemon's log has the first ones with topic and reason (message, or line of one, quarantined)";
            ("messages and lines of them", shown)
        } else {
            let shown = "status --sources shows the first of each kind";
            ("lines, records and files", shown)
        };
        // Writing to a string cannot fail.
        let _ = writeln!(
            lines,
            "source {source}: {what} that could not be used: {count}; {shown}"
        );
    }
    let each = status.benchmarks.iter();
    for one in each.filter(|one| one.alarm_state == AlarmState::OutOfService) {
        let _ = writeln!(
            lines,
            "{}: declared maintenance: its readings are kept and NOT JUDGED; the velocity and the chance are from before it",
            text::plain(one.benchmark.as_str())
        );
    }
    lines
}

/// Lines of no more than the table's width.
fn folded(lines: &str) -> String {
    let lines = lines.lines();
    lines
        .map(|line| text::wrapped(line, WIDTH, CONTINUED) + "\n")
        .collect()
}

/// Whether the record can be written; nothing where it can, or where none is kept.
fn recorded(status: &SiteStatus, zone: &TimeZone) -> String {
    let failing = status.record.as_ref().and_then(|record| {
        let since = text::clock(record.failing_since?, zone);
        Some((since, record.failure.as_ref()?))
    });
    failing.map_or_else(String::new, |(since, why)| {
        format!("NO RECORD since {since}: {}\n", text::plain(why))
    })
}

/// What became of the newest drill; nothing where none has been held yet and none is overdue.
fn drilled(status: &SiteStatus, zone: &TimeZone) -> String {
    let Some(drill) = &status.drill else {
        return String::new();
    };
    let overdue = if status.is_drill_overdue {
        format!(
            "DRILL OVERDUE since {}\n",
            text::clock(drill.overdue_after, zone)
        )
    } else {
        String::new()
    };
    let newest = match (&drill.failure, drill.passed_at) {
        (Some(why), _) => format!("DRILL FAILED: {}\n", text::plain(why)),
        (None, Some(at)) => format!(
            "last drill: passed {}, {:.1} s from the readings to the hook\n",
            text::clock(at, zone),
            drill.latency_seconds.unwrap_or_default()
        ),
        (None, None) => String::new(),
    };
    newest + &overdue
}

fn chance(chance: Option<f64>) -> String {
    chance.map_or_else(|| "-".to_owned(), chance_in_words)
}
