//! The site file: TOML with units, unknown keys refused, all problems reported together.

mod address;
mod alert;
mod broker;
mod cap;
mod check;
mod covariate;
mod declared;
mod destination;
mod drill;
mod duty;
mod every_way;
mod heartbeat;
mod hook;
mod keys;
mod link;
mod mqtt_out;
mod pattern;
mod problem;
mod record;
mod rule;
mod secret;
mod section;
mod source;
mod table;
mod token;
pub(crate) mod value;
mod vector;
mod webhook;
mod word_file;

pub use broker::{Broker, BrokerAddress};
pub use cap::CapFolder;
pub use check::{ConfigSummary, check};
pub use covariate::StatedCovariate;
pub use destination::{Destination, SharedDestination};
pub use drill::{Drill, EXERCISE};
pub use duty::DutyHours;
pub use heartbeat::Heartbeat;
pub use hook::{ADD_HOOK, NO_HOOK, way_out_tables};
pub use keys::{Key, Keys, ValueShape};
pub use link::Links;
pub use mqtt_out::MqttTopic;
pub use pattern::FilePattern;
pub use problem::{ConfigError, ConfigProblem, Severity};
pub use record::RecordFiles;
pub use secret::Secret;
pub use token::Token;
pub use vector::Vector;
pub use webhook::{Webhook, WebhookFormat};
pub use word_file::WordFileError;

use crate::alert::Level;
use crate::monitor::{Settings, WRITTEN};
use crate::reading::{BenchmarkId, Conventions, Dialect, Quantity, SummerTime, Timestamp, Unit};
use jiff::SignedDuration;
use problem::ConfigProblems;
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::fmt;
use std::io;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Duration;
use table::Section;

/// A site as its file describes it, every path resolved.
#[derive(Debug, Clone)]
pub struct Config {
    /// The file itself.
    pub file: PathBuf,
    /// `[site]`.
    pub site: SiteConfig,
    /// `[[source]]`s that are files; there is at least one of these or of the brokers.
    pub sources: Vec<FileSource>,
    /// `[[source]]`s that are topics of an MQTT broker.
    pub brokers: Vec<Broker>,
    /// `[[benchmark]]`; with none, whatever benchmarks the files name are taken.
    pub benchmarks: Vec<Benchmark>,
    /// `[alert]` and the benchmarks' own, `[explain]`, `[[event]]` and `[[covariate]]`, as the monitor takes them.
    pub settings: Settings,
    /// `[[covariate]]`, which stands in the settings too.
    pub covariates: Vec<StatedCovariate>,
    /// `[[hook]]`, `[[webhook]]`, `[[cap]]` and `[[mqtt_out]]`.
    pub hooks: Vec<HookConfig>,
    /// `[[heartbeat]]`.
    pub heartbeats: Vec<Heartbeat>,
    /// `[drill]`.
    pub drill: Option<Drill>,
    /// What is doubtful, but not refused.
    pub warnings: Vec<ConfigProblem>,
}

/// `[site]`.
#[derive(Debug, Clone)]
pub struct SiteConfig {
    /// What hooks call it.
    pub name: String,
    /// Where the daemon keeps what it writes.
    pub state_dir: PathBuf,
    /// Where the daemon answers questions.
    pub listen: Option<SocketAddr>,
    /// The file with the secret that whoever asks must know; never absent where others than this
    /// machine can reach `listen`.
    pub token_file: Option<PathBuf>,
    /// By which links in the messages alerts are acknowledged; `None`: by none.
    pub links: Option<Links>,
    /// Where all that is said is written as MCAP; `None`: nowhere.
    pub record: Option<RecordFiles>,
    /// The zone that people there live in.
    pub time_zone: jiff::tz::TimeZone,
    /// Data time for which every refit is kept; of older ones the first of each UTC day and benchmark is.
    pub keep_refits: SignedDuration,
}

/// What a source's files hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SourceKind {
    /// Comma-separated text with a header.
    Csv,
    /// A JSON object a line.
    Ndjson,
    /// Tables of a Campbell logger.
    Toa5,
    /// MCAP recordings.
    Mcap,
}

impl SourceKind {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Csv, Self::Ndjson, Self::Toa5, Self::Mcap];

    /// The word in the config.
    pub fn name(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Ndjson => "ndjson",
            Self::Toa5 => "toa5",
            Self::Mcap => "mcap",
        }
    }
}

/// `[[source]]`: files that readings come from.
#[derive(Debug, Clone)]
pub struct FileSource {
    /// What benchmarks call it.
    pub id: String,
    /// What the files hold.
    pub kind: SourceKind,
    /// Which files.
    pub pattern: FilePattern,
    /// How times and missing values are written in them.
    pub conventions: Conventions,
    /// How its tables are written.
    pub dialect: Dialect,
    /// Day 0 of a column `t_days`, where the config says it.
    pub epoch: Option<Timestamp>,
    /// Values wait this long for earlier ones; zero: not at all.
    pub reorder: SignedDuration,
}

/// `[[benchmark]]`: one measured point.
#[derive(Debug, Clone)]
pub struct Benchmark {
    /// Its name.
    pub id: BenchmarkId,
    /// The source that its readings come from.
    pub source: String,
    /// The column that holds them; with none, the one whose name has the benchmark's id.
    pub column: Option<String>,
    /// Which of its quantities to take; with none, all.
    pub quantity: Option<Quantity>,
    /// The column's unit, where the column's name does not say it.
    pub unit: Option<Unit>,
    /// The columns that hold its components, where it moves in space.
    pub vector: Option<Vector>,
    /// The span over which each velocity is the mean.
    pub averaging: Option<SignedDuration>,
    /// Where it stands, for the map: east and north, and height where it is given, m.
    pub position: Option<Vec<f64>>,
}

impl Benchmark {
    /// What decides which numbers its readings are, in words that stay the same from version to version: with other ones they mean
    /// something else.
    pub fn read_as(&self, source: &str) -> String {
        let mut words = Vec::new();
        words.extend(
            self.column
                .as_ref()
                .map(|column| format!("column {column:?}")),
        );
        words.extend(self.unit.map(|unit| format!("unit {unit}")));
        words.extend(self.quantity.map(|quantity| quantity.name().to_owned()));
        if let Some(Vector {
            components,
            direction,
            unit,
        }) = &self.vector
        {
            words.push(format!(
                "components {components:?} in {unit} along {direction:?}"
            ));
        }
        let span = self
            .averaging
            .map(|span| format!("averaging {} s", span.as_secs()));
        words.extend(span);
        let own = words.join(", ");
        match (own.as_str(), source) {
            ("", source) => source.to_owned(),
            (own, "") => own.to_owned(),
            (own, source) if source.starts_with(WRITTEN) => format!("{own}{source}"),
            (own, source) => format!("{own}, {source}"),
        }
    }
}

impl FileSource {
    /// The same of whatever comes from the source, and how its files are written, where that is not as usual. How many lines stand before the
    /// header is not of it: without that no row is read at all.
    pub fn read_as(&self) -> String {
        let mut times = zone_in_words(&self.conventions);
        times.extend(self.epoch.map(|epoch| format!("day 0 on {epoch}")));
        let clock = self.conventions.clock.summer_time;
        let missing = self.conventions.missing.in_words();
        let (own, usual) = (&self.dialect, Dialect::default());
        let each = [
            (clock != SummerTime::default()).then(|| format!("dst {clock:?}")),
            (!missing.is_empty()).then(|| format!("missing {missing}")),
            unlike("decimal", &own.decimal, &usual.decimal),
            unlike("thousands", &own.thousands, &usual.thousands),
            unlike("delimiter", &own.delimiter, &usual.delimiter),
            unlike("time columns", &own.time_columns, &usual.time_columns),
            unlike("time format", &own.time_format, &usual.time_format),
        ];
        let words: Vec<String> = each.into_iter().flatten().collect();
        let written = if words.is_empty() {
            "as usual".to_owned()
        } else {
            format!("with {}", words.join(", "))
        };
        format!("{}{WRITTEN}{written}", times.join(", "))
    }
}

impl Broker {
    /// The same of its messages, which nobody can read again: only what makes their times others.
    fn read_as(&self) -> String {
        zone_in_words(&self.conventions).join(", ")
    }
}

/// A value with its name, where it is not the usual one.
fn unlike<T: PartialEq + fmt::Debug>(name: &str, own: &T, usual: &T) -> Option<String> {
    (own != usual).then(|| format!("{name} {own:?}"))
}

fn zone_in_words(conventions: &Conventions) -> Vec<String> {
    let zone = conventions.clock.zone.as_ref();
    let zone = zone.and_then(jiff::tz::TimeZone::iana_name);
    zone.map(|zone| format!("time zone {zone}"))
        .into_iter()
        .collect()
}

/// What reaches a hook only where it asks for it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ExtraMessages {
    /// Drills.
    pub drills: bool,
    /// Corrections: what late or corrected readings would have called in the past.
    pub corrections: bool,
}

/// `[[hook]]`: a program to run when a level is entered or left; or `[[webhook]]`, `[[cap]]` or `[[mqtt_out]]`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HookConfig {
    /// The program and its arguments; none where they go elsewhere.
    pub run: Vec<String>,
    /// Where its alerts go instead of to a program.
    pub to: Option<SharedDestination>,
    /// Which levels it is run for.
    pub levels: Vec<Level>,
    /// Of which benchmarks it is notified; none: of all.
    pub benchmarks: BTreeSet<BenchmarkId>,
    /// Whether it is notified of the whole site's level, and of nothing else; of its benchmarks' else.
    pub site: bool,
    /// It is notified only of what nobody has acknowledged within this time; `None`: of everything, at once.
    pub escalate_after: Option<Duration>,
    /// When the people behind it are on duty; alerts wait for that. `None`: always.
    pub hours: Option<DutyHours>,
    /// What it gets beside alerts.
    pub extra: ExtraMessages,
    /// By which links its alerts are acknowledged; `None`: by none.
    pub links: Option<Links>,
    /// The zone that people at the site live in, by its IANA name.
    pub zone: String,
    /// After this it is killed.
    pub timeout: Duration,
    /// Where it runs: the config's folder.
    pub folder: PathBuf,
    /// Whether it may write only below its folder, `writable` and `/tmp`, where the kernel can see to that.
    pub sandbox: bool,
    /// Where else it may write.
    pub writable: Vec<PathBuf>,
    /// This program, which limits where it may write and then becomes the hook; without it there is no limit.
    pub launcher: Option<PathBuf>,
}

/// Reads the site file at `file`.
///
/// # Errors
/// [`ConfigError`] when it cannot be read, or with every problem found in it.
pub fn load(file: &Path) -> Result<Config, ConfigError> {
    let text = read(file).map_err(|source| ConfigError::Unreadable {
        file: file.to_owned(),
        source,
    })?;
    parse(&text, file)
}

/// The site file at `file` as far as it is right, where it says which state is meant: for commands that only need that, a mistake elsewhere in the
/// file stops nothing. All benchmarks of the state are taken for watched.
///
/// # Errors
/// [`ConfigError`] as of [`load`], where nothing can be made of it.
pub fn load_as_far_as_right(file: &Path) -> Result<Config, ConfigError> {
    let refused = match load(file) {
        Err(refused @ ConfigError::Invalid { .. }) => refused,
        other => return other,
    };
    let text = read(file).unwrap_or_default();
    let (config, _) = taken(&text, file);
    let mut config = config
        .filter(|config| config.site.state_dir.is_dir())
        .ok_or(refused)?;
    config.settings.watched.is_open = true;
    Ok(config)
}

/// The text of the file; `-` is stdin, which is read once.
fn read(file: &Path) -> io::Result<String> {
    static STDIN: OnceLock<Result<String, io::ErrorKind>> = OnceLock::new();
    if file.as_os_str() != "-" {
        return std::fs::read_to_string(file);
    }
    let all = STDIN.get_or_init(|| io::read_to_string(io::stdin()).map_err(|error| error.kind()));
    all.clone().map_err(Into::into)
}

/// Reads a site file's `text`; relative paths in it start at the folder of `file`.
///
/// # Errors
/// [`ConfigError::Invalid`] with every problem found.
pub fn parse(text: &str, file: &Path) -> Result<Config, ConfigError> {
    let (config, found) = taken(text, file);
    let problems = found.close();
    let refused = problems
        .iter()
        .any(|problem| problem.severity == Severity::Error);
    match config {
        Some(config) if !refused => Ok(Config {
            warnings: problems,
            ..config
        }),
        Some(_) | None => Err(ConfigError::Invalid { problems }),
    }
}

/// The keys that the reader of a site file asks for in the tables that `text` has, whether they are there or not.
pub fn keys(text: &str) -> Keys {
    taken(text, Path::new("")).1.keys
}

/// Whether a text that is no TOML begins as a table: cells parted as in a header, and again in the next line.
fn is_table(text: &str) -> bool {
    let mut lines = text.lines().filter(|line| !line.trim().is_empty());
    let mut has_cells = || {
        lines.next().is_some_and(|line| {
            !line.starts_with(['[', '#']) && !line.contains('=') && line.contains([',', ';', '\t'])
        })
    };
    has_cells() && has_cells()
}

fn taken(text: &str, file: &Path) -> (Option<Config>, ConfigProblems) {
    let problems = RefCell::new(ConfigProblems::new(file, text));
    let (document, syntax) = toml::de::DeTable::parse_recoverable(text);
    if !syntax.is_empty() && is_table(text) {
        let problem = "it looks like a table of readings, not like the config of a site".to_owned();
        let expected = "write its config with slipwatch init FILE, and give that";
        problems.borrow_mut().error(&(0..0), problem, expected);
        return (None, problems.into_inner());
    }
    for error in &syntax {
        let at = error.span().unwrap_or(0..0);
        let message = error.message().replace('\n', ", ");
        problems
            .borrow_mut()
            .error(&at, message, "write it as TOML 1.0 asks");
    }
    let config = if syntax.is_empty() {
        let mut root = Section::root(document.get_ref(), &problems);
        let config = section::document(&mut root, file);
        root.finish();
        config
    } else {
        None
    };
    (config, problems.into_inner())
}
