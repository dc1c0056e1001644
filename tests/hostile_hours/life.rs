//! One life of a daemon, and what must hold in it.

use crate::clock::{self, set_wrong_by, truth};
use crate::host::Host;
use crate::logger::Logger;
use crate::people::Mood;
use crate::plan::{Mishap, Plan, Trouble};
use crate::radio::Radio;
use crate::slope::{Measured, Slope};
use crate::state::{is_over, is_what_a_replay_says, readings};
use jiff::{SignedDuration, Timestamp};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};
use slipwatch::alert::Level;
use slipwatch::config::{self, Config};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::time::Duration;
use tempfile::TempDir;

/// Hours of one life.
pub(crate) const LIFE_HOURS: u64 = 250;
/// The daemon takes its turns and the plan goes on each half hour.
const STEP: Duration = Duration::from_secs(1800);
pub(crate) const STEPS: usize = 500;
/// Within so much time in which the daemon runs and the hook works, people are notified: a turn, and the longest wait
/// between two attempts at a hook.
pub(crate) const BOUND: SignedDuration = SignedDuration::from_mins(45);
/// Steps without trouble at the end: what was held, kept or refused comes in.
const CALM: usize = 24;

/// What a life has seen.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(crate) struct Seen {
    hours: u64,
    readings: usize,
    pub(crate) reds_due: u64,
    pub(crate) reds_notified: u64,
    notified_unknown: u64,
    over: u64,
    pub(crate) restarts: u64,
    pub(crate) full_disk: u64,
    wrong_clock: u64,
    notified: u64,
    failed_runs: u64,
}

impl Seen {
    pub(crate) fn add(&mut self, other: &Self) {
        self.hours += other.hours;
        self.readings += other.readings;
        self.reds_due += other.reds_due;
        self.reds_notified += other.reds_notified;
        self.notified_unknown += other.notified_unknown;
        self.over += other.over;
        self.restarts += other.restarts;
        self.full_disk += other.full_disk;
        self.wrong_clock += other.wrong_clock;
        self.notified += other.notified;
        self.failed_runs += other.failed_runs;
    }
}

/// A red that people are to be notified of.
struct Due {
    name: &'static str,
    /// When the reading was measured that makes it due.
    of: Timestamp,
    /// Since when it could have been sent without a break, and neither it nor `unknown` has been.
    unnotified_since: Option<Timestamp>,
    was_unknown: bool,
}

/// One life.
struct Life<'a> {
    seed: u64,
    host: Host<'a>,
    folder: &'a Path,
    slopes: Vec<Slope>,
    loggers: Vec<Logger>,
    radio: Radio,
    random: Pcg64,
    dues: Vec<Due>,
    /// What could be read, by benchmark.
    readable: BTreeMap<&'static str, Vec<Measured>>,
    seen: Seen,
}

/// Lives through what the seed draws, with a hook that does this while nothing else is the matter with it. One life of
/// a process at a time: the limit that stands for a full disk is the process's.
pub(crate) fn live_with(seed: u64, hook: Mood) -> Seen {
    // In memory, where there is such a place: what the disk of the machine costs is not what is tested.
    let shared = Path::new("/dev/shm");
    let folder = if shared.is_dir() {
        TempDir::new_in(shared)
    } else {
        TempDir::new()
    }
    .unwrap();
    for name in ["incoming", "quiet"] {
        fs::create_dir(folder.path().join(name)).unwrap();
    }
    let config = config(folder.path());
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .start_paused(true)
        .build()
        .unwrap();
    let _entered = runtime.enter();
    clock::begin();
    let from = truth();
    let to = from + SignedDuration::try_from(STEP * STEPS as u32).unwrap();
    let slopes = [("a", 1), ("b", 2), ("m", 3), ("q", 3)];
    let slopes = (0..)
        .zip(slopes)
        .map(|(index, (name, hours))| Slope::new(name, hours, 31 * seed + index, (from, to)));
    let mut life = Life {
        seed,
        host: Host::new(&runtime, &config),
        folder: folder.path(),
        slopes: slopes.collect(),
        loggers: vec![
            Logger::new("a", &folder.path().join("incoming")),
            Logger::new("b", &folder.path().join("incoming")),
            Logger::new("q", &folder.path().join("quiet")),
        ],
        radio: Radio::new(),
        random: Pcg64::seed_from_u64(seed ^ 0xfeed),
        dues: Vec::new(),
        readable: BTreeMap::new(),
        seen: Seen {
            hours: LIFE_HOURS,
            ..Seen::default()
        },
    };
    {
        let mut people = life.host.hook.0.lock().unwrap();
        (people.mood, people.usual) = (hook.clone(), hook);
    }
    let plan = Plan::drawn(seed);
    if std::env::var_os("HOSTILE_LOG").is_some() {
        let _ = tracing_subscriber::fmt()
            .with_timer(clock::Truth)
            .with_ansi(false)
            .try_init();
        println!("{plan:#?}");
    }
    life.host.start();
    for step in 0..STEPS + CALM {
        life.step(step, &plan);
    }
    life.end();
    life.seen
}

fn config(folder: &Path) -> Config {
    let benchmarks: String = [
        ("a", "logger"),
        ("b", "logger"),
        ("q", "quiet"),
        ("m", "radio"),
    ]
    .map(|(id, source)| format!("[[benchmark]]\nid = \"{id}\"\nsource = \"{source}\"\n"))
    .concat();
    let text = format!(
        "[site]\nname = \"Toc\"\nstate_dir = \"state\"\n\
         [[source]]\nid = \"logger\"\nkind = \"csv\"\npath = \"incoming/*.csv\"\n\
         [[source]]\nid = \"quiet\"\nkind = \"csv\"\npath = \"quiet/*.csv\"\n\
         [[source]]\nid = \"radio\"\nkind = \"mqtt\"\nurl = \"mqtt://127.0.0.1:1\"\ntopic = \"m\"\n\
         {benchmarks}\
         [[alert.threshold]]\nlevel = \"red\"\nvelocity = \"100 mm/day\"\n\
         [explain]\nsearch = false\n\
         [[hook]]\nrun = [\"/bin/true\"]\nlevels = [\"yellow\", \"orange\", \"red\", \"unknown\"]\ntimeout = \"10s\"\n"
    );
    config::parse(&text, &folder.join("site.toml")).unwrap()
}

impl Life<'_> {
    fn step(&mut self, step: usize, plan: &Plan) {
        for (from, to, trouble) in &plan.troubles {
            let to = (*to).min(STEPS);
            if step == *from && *from < STEPS {
                self.begin(trouble);
            } else if step == to {
                self.end_of(trouble);
            }
        }
        for (_, mishap) in plan.mishaps.iter().filter(|(at, _)| *at == step) {
            self.happens(*mishap);
        }
        let is_calm = step >= STEPS;
        if !self.host.is_up() && (is_calm || !plan.is_down(step)) {
            self.radio.reconnect();
            self.seen.restarts += u64::from(self.host.start());
        }
        self.measure(is_calm);
        for (_, name) in plan.corrections.iter().filter(|(at, _)| *at == step) {
            let corrected = self.logger(name).correct();
            self.is_readable(name, corrected.into_iter().collect());
        }
        let was_well = self.is_machine_well();
        let sent = self.host.turn(&mut self.radio, &mut self.random);
        self.is_readable("m", sent);
        if self.host.is_settled() {
            self.loggers.iter_mut().for_each(Logger::settle);
        }
        self.host.wait(STEP);
        if was_well && self.is_machine_well() {
            self.nothing_keeps_the_quiet_one_waiting();
        }
        self.reds_are_notified();
    }

    /// Whether what concerns all benchmarks is well.
    fn is_machine_well(&self) -> bool {
        self.host.is_settled()
            && !self.host.is_full
            && !self.host.is_clock_wrong()
            && clock::wall() == truth()
    }

    fn begin(&mut self, trouble: &Trouble) {
        self.set(trouble, true);
        match trouble {
            Trouble::Down { is_killed: true } => self.host.kill(),
            Trouble::Down { is_killed: false } => self.host.stop(),
            Trouble::FullDisk => self.seen.full_disk += 1,
            Trouble::Clock(_) => self.seen.wrong_clock += 1,
            Trouble::FolderGone => {
                let _ = fs::rename(self.folder.join("incoming"), self.folder.join("away"));
            }
            Trouble::HookFails
            | Trouble::HookHangs
            | Trouble::HookHangsAt(_)
            | Trouble::LoggerAway(_)
            | Trouble::BrokerAway
            | Trouble::BrokerStutters
            | Trouble::HalfRows(_)
            | Trouble::LateRows(_) => {}
        }
    }

    fn end_of(&mut self, trouble: &Trouble) {
        self.set(trouble, false);
        match trouble {
            Trouble::FolderGone => {
                let _ = fs::rename(self.folder.join("away"), self.folder.join("incoming"));
            }
            Trouble::BrokerAway => self.radio.reconnect(),
            Trouble::Down { .. }
            | Trouble::FullDisk
            | Trouble::Clock(_)
            | Trouble::HookFails
            | Trouble::HookHangs
            | Trouble::HookHangsAt(_)
            | Trouble::LoggerAway(_)
            | Trouble::BrokerStutters
            | Trouble::HalfRows(_)
            | Trouble::LateRows(_) => {}
        }
    }

    fn set(&mut self, trouble: &Trouble, is_on: bool) {
        let usual = self.host.hook.0.lock().unwrap().usual.clone();
        let mood = |mood: Mood| if is_on { mood } else { usual.clone() };
        let people = &self.host.hook.0;
        match trouble {
            Trouble::Clock(span) => set_wrong_by(if is_on { *span } else { SignedDuration::ZERO }),
            Trouble::FullDisk => self.host.is_full = is_on,
            Trouble::HookFails => people.lock().unwrap().mood = mood(Mood::Fails),
            Trouble::HookHangs => people.lock().unwrap().mood = mood(Mood::Hangs),
            Trouble::HookHangsAt(name) => people.lock().unwrap().mood = mood(Mood::HangsAt(name)),
            Trouble::LoggerAway(name) => self.logger(name).is_away = is_on,
            Trouble::HalfRows(name) => self.logger(name).writes_halves = is_on,
            Trouble::LateRows(name) => self.logger(name).is_late = is_on,
            Trouble::BrokerAway => self.radio.is_away = is_on,
            Trouble::BrokerStutters => self.radio.stutters = is_on,
            Trouble::Down { .. } | Trouble::FolderGone => {}
        }
    }

    fn logger(&mut self, name: &str) -> &mut Logger {
        self.loggers
            .iter_mut()
            .find(|one| one.name == name)
            .unwrap()
    }

    fn happens(&mut self, mishap: Mishap) {
        match mishap {
            Mishap::Rotate(name) => self.logger(name).rotate(),
            Mishap::Replace(name) => self.logger(name).replace(),
            Mishap::CopyTruncate(name) => self.logger(name).copy_truncate(),
            Mishap::Garbage(name) => self
                .logger(name)
                .scribble("\u{0}\u{1}garbage;;,\n,,,\n2026-13-45,x\n"),
            Mishap::FarStamp(name) => {
                let line = format!("{},1.5\n", truth() + SignedDuration::from_hours(30 * 24));
                self.logger(name).scribble(&line);
            }
            Mishap::BigFile => {
                let row = format!("{},1.5\n", truth());
                let _ = fs::write(
                    self.folder.join("incoming/big.csv"),
                    format!("time,x_displacement_mm\n{}", row.repeat(120_000)),
                );
            }
            Mishap::Kill => self.host.kill(),
        }
    }

    fn measure(&mut self, is_calm: bool) {
        let now = truth();
        for slope in &mut self.slopes {
            let measured = if is_calm {
                Vec::new()
            } else {
                slope.measure(now)
            };
            match self.loggers.iter_mut().find(|one| one.name == slope.name) {
                Some(logger) => logger.keep(measured),
                None => measured.into_iter().for_each(|one| self.radio.publish(one)),
            }
        }
        for index in 0..self.loggers.len() {
            let name = self.loggers[index].name;
            let readable = self.loggers[index].write();
            self.is_readable(name, readable);
        }
    }

    fn is_readable(&mut self, name: &'static str, measured: Vec<Measured>) {
        let known = self.readable.entry(name).or_default();
        for one in measured {
            if known.contains(&one) {
                continue;
            }
            known.push(one);
            if one.calls_red {
                self.seen.reds_due += 1;
                self.dues.push(Due {
                    name,
                    of: one.time,
                    unnotified_since: None,
                    was_unknown: false,
                });
            }
        }
    }

    fn nothing_keeps_the_quiet_one_waiting(&self) {
        if let Some(newest) = self.readable.get("q").and_then(|all| all.last()) {
            assert!(
                self.host.has("q", newest),
                "seed {}, {}: {newest:?} waits",
                self.seed,
                truth()
            );
        }
    }

    fn reds_are_notified(&mut self) {
        let now = truth();
        let mut dues = std::mem::take(&mut self.dues);
        dues.retain_mut(|due| !self.is_done(due, now));
        self.dues = dues;
    }

    /// Whether nobody waits for this red any more.
    fn is_done(&mut self, due: &mut Due, now: Timestamp) -> bool {
        let (knows_red, knows_unknown) = {
            let people = self.host.hook.0.lock().unwrap();
            let knows_unknown =
                people.know(Some(due.name), Level::Unknown) || people.know(None, Level::Unknown);
            (people.know(Some(due.name), Level::Red), knows_unknown)
        };
        if knows_red {
            self.seen.reds_notified += 1;
            self.seen.notified_unknown += u64::from(due.was_unknown);
            return true;
        }
        due.was_unknown |= knows_unknown;
        if !self.host.is_up() || !self.host.notifies(due.name) || knows_unknown {
            due.unnotified_since = None;
            return false;
        }
        let store = self.host.store().expect("the daemon runs");
        if is_over(store, due.name, due.of) {
            self.seen.over += 1;
            return true;
        }
        let since = *due.unnotified_since.get_or_insert(now);
        assert!(
            now.duration_since(since) <= BOUND,
            "seed {}, {now}: red of {} at {} has not been notified",
            self.seed,
            due.of,
            due.name
        );
        false
    }

    /// The trouble is over.
    fn end(&mut self) {
        let seed = self.seed;
        assert!(
            self.radio.is_empty() && self.loggers.iter().all(Logger::is_empty),
            "seed {seed}: not all has been sent"
        );
        assert!(self.host.is_settled(), "seed {seed}: something is held");
        assert!(self.dues.is_empty(), "seed {seed}: a red waits");
        let store = self.host.store().expect("the daemon runs");
        let mut taken = readings(store);
        for (name, measured) in &self.readable {
            let mut own = taken.remove(*name).unwrap_or_default();
            let far = truth() + SignedDuration::from_hours(24);
            own.retain(|(time, value)| *time < far && value.to_bits() != 1.5_f64.to_bits());
            let mut expected: Vec<(Timestamp, f64)> =
                measured.iter().map(|one| (one.time, one.value)).collect();
            expected.sort_by_key(|(time, _)| *time);
            own.sort_by_key(|(time, _)| *time);
            let lost = expected.iter().filter(|one| !own.contains(one));
            let lost: Vec<_> = lost.collect();
            assert!(lost.is_empty(), "seed {seed}, {name}: lost {lost:?}");
            assert_eq!(
                own.len(),
                expected.len(),
                "seed {seed}, {name}: taken twice"
            );
            self.seen.readings += expected.len();
        }
        assert!(taken.is_empty(), "seed {seed}: {taken:?} was made up");
        assert_eq!(store.outbox(&[]).unwrap().0, 0, "seed {seed}: alerts wait");
        is_what_a_replay_says(seed, store);
        let people = self.host.hook.0.lock().unwrap();
        (self.seen.notified, self.seen.failed_runs) = (people.notified, people.failed);
    }
}
