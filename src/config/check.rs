//! `check`: the site file and what it names on this machine, without starting anything.

use super::{
    Config, ConfigError, DutyHours, FileSource, HookConfig, SiteConfig, Token, WordFileError, duty,
    load,
};
use crate::alert::{Level, Threshold};
use crate::monitor::{Declaration, Order, SiteLevel};
use crate::reading::{BenchmarkId, Quantity};
use jiff::SignedDuration;
use schemars::JsonSchema;
use serde::Serialize;
use std::fmt;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

/// Longer than so a reading hardly waits for earlier ones with intent,
const LONGEST_REORDER: SignedDuration = SignedDuration::from_hours(24);
/// nor does an evacuation take longer than so.
const LONGEST_EVACUATION: SignedDuration = SignedDuration::from_hours(30 * 24);

/// What a right config amounts to.
#[derive(Debug, Clone, PartialEq, Eq, JsonSchema, Serialize)]
pub struct ConfigSummary {
    /// The site's name.
    pub site: String,
    /// Where the daemon keeps what it writes.
    pub state_dir: PathBuf,
    /// How many sources.
    pub sources: usize,
    /// How many benchmarks; zero means whatever the files name.
    pub benchmarks: usize,
    /// How many hooks.
    pub hooks: usize,
    /// What is doubtful, one line each.
    pub warnings: Vec<String>,
}

impl fmt::Display for ConfigSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "ok: {} (sources: {}, benchmarks: {}, hooks: {}, state in {})",
            self.site,
            self.sources,
            self.benchmarks,
            self.hooks,
            self.state_dir.display()
        )
    }
}

/// Checks the site file at `file`; what it names and is not there yet is a warning.
///
/// # Errors
/// [`ConfigError`] as from [`load`].
pub fn check(file: &Path) -> Result<ConfigSummary, ConfigError> {
    let config = load(file)?;
    config.site.token()?;
    let mut warnings: Vec<String> = config.warnings.iter().map(ToString::to_string).collect();
    let place = file.display();
    warnings.extend(
        (config.sources.iter().filter_map(missing_folder))
            .chain(config.hooks.iter().filter_map(missing_program))
            .chain(config.site.token_file.as_deref().and_then(open_token))
            .chain(slow_sampling(&config))
            .chain(levels_without_hook(&config))
            .chain(benchmarks_without_hook(&config))
            .chain(unknown_benchmarks(&config))
            .chain(only_escalated(&config))
            .chain(off_duty(&config))
            .chain(state_dir(&config.site.state_dir))
            .chain(site_level(&config))
            .chain(long_maintenance(&config))
            .chain(config.sources.iter().filter_map(long_reorder))
            .chain(long_evacuation(&config))
            .chain(lost_thresholds(&config))
            .map(|what| format!("{place}: warning: {what}")),
    );
    Ok(ConfigSummary {
        site: config.site.name,
        state_dir: config.site.state_dir,
        sources: config.sources.len() + config.brokers.len(),
        benchmarks: config.benchmarks.len(),
        hooks: config.hooks.len(),
        warnings,
    })
}

/// Where the daemon can write nothing.
fn state_dir(folder: &Path) -> Option<String> {
    let is_other = folder.exists() && !folder.is_dir();
    is_other.then(|| {
        format!(
            "site.state_dir: {} is no folder: the daemon cannot start",
            folder.display()
        )
    })
}

/// A level of the site that so few benchmarks never reach.
fn site_level(config: &Config) -> Option<String> {
    let Some(SiteLevel::AtLeast(needed)) = config.settings.site else {
        return None;
    };
    let named = config.benchmarks.len();
    (named > 0 && named < needed).then(|| {
        format!(
            "the site's level is that of {needed} benchmarks, and the config names {named}: the site never has one"
        )
    })
}

/// Maintenance in which nothing is judged for longer than anything may be silenced.
fn long_maintenance(config: &Config) -> impl Iterator<Item = String> {
    config.settings.declared.iter().filter_map(|declared| {
        let Declaration::Maintenance { until } = declared.kind else {
            return None;
        };
        let span = until.duration_since(declared.time);
        (span > Order::LONGEST_SILENCE).then(|| {
            let whose = declared.benchmark.as_ref();
            let whose = whose.map_or("the site".to_owned(), |id| format!("benchmark {id}"));
            format!(
                "event: {whose} is under maintenance from {} until {until}, {} days in which no reading is judged; is that right?",
                declared.time,
                span.as_hours() / 24
            )
        })
    })
}

/// Alerts that wait for days because the readings do.
fn long_reorder(source: &FileSource) -> Option<String> {
    (source.reorder > LONGEST_REORDER).then(|| {
        format!(
            "source {:?}: reorder = {:#}: every reading waits so long for earlier ones, and so does every alert, where none \
             comes that is newer; is that right?",
            source.id, source.reorder
        )
    })
}

/// An evacuation that takes months: red would be called for what lies years ahead.
fn long_evacuation(config: &Config) -> impl Iterator<Item = String> {
    let site = (None, &config.settings.policy);
    let own = config.settings.benchmarks.iter();
    let own = own.map(|(id, policy)| (Some(id), policy));
    let of_site = config.settings.policy.evacuation_time;
    let all = std::iter::once(site).chain(own);
    all.filter_map(move |(id, policy)| {
        let span = policy.evacuation_time;
        let is_its_own = id.is_none() || span != of_site;
        (is_its_own && span > LONGEST_EVACUATION).then(|| {
            let whose = id.map_or(String::new(), |id| format!("benchmark {:?}: ", id.as_str()));
            format!(
                "{whose}evacuation_time = {span:#}, {} days: red looks {:#} ahead; is that right?",
                span.as_hours() / 24,
                policy.red_within()
            )
        })
    })
}

/// Thresholds of the site that do not hold for a benchmark which has some of its own.
fn lost_thresholds(config: &Config) -> impl Iterator<Item = String> {
    let site = &config.settings.policy.thresholds;
    config.settings.benchmarks.iter().filter_map(move |(id, policy)| {
        let own = figures(&policy.thresholds);
        let has = |level, name| own.iter().any(|one| one.0 == level && one.1 == name);
        let site = figures(site).into_iter();
        let lost = site.filter(|(level, name, _)| !has(*level, *name));
        let lost = lost.map(|(level, name, figure)| format!("{level} at {name} {figure}"));
        let lost: Vec<String> = lost.collect();
        (!lost.is_empty()).then(|| {
            format!(
                "benchmark {:?}: its own thresholds stand in the place of all of [alert]; these do not hold for it: {}; \
                 write them for the benchmark too where they are to hold",
                id.as_str(),
                lost.join(", ")
            )
        })
    })
}

/// Each figure of the thresholds: its level, what it is of, and the figure with its unit.
fn figures(thresholds: &[Threshold]) -> Vec<(Level, &'static str, String)> {
    let of = |one: &Threshold| {
        [
            ("velocity", one.velocity_mm_per_day, "mm/day"),
            ("displacement", one.displacement_mm, "mm"),
            ("acceleration", one.acceleration_mm_per_day2, "mm/day/day"),
        ]
        .map(|(name, figure, unit)| Some((one.level, name, format!("{} {unit}", figure?))))
    };
    thresholds.iter().flat_map(of).flatten().collect()
}

fn missing_folder(source: &FileSource) -> Option<String> {
    let folder = source.pattern.folder();
    (!folder.is_dir()).then(|| {
        format!(
            "source {:?}: there is no folder {}; create it before readings are due",
            source.id,
            folder.display()
        )
    })
}

fn missing_program(hook: &HookConfig) -> Option<String> {
    if let Some(to) = &hook.to {
        let lack = to.lacks()?;
        return Some(format!("{}: {lack}; alerts would go nowhere", to.table()));
    }
    let program = hook.program();
    let named_by_path = program.components().count() > 1;
    (named_by_path && !program.is_file()).then(|| {
        format!(
            "hook: there is no program {}; alerts would go nowhere",
            program.display()
        )
    })
}

/// Levels that no hook is notified of: then nobody is.
fn levels_without_hook(config: &Config) -> Vec<String> {
    if config.hooks.is_empty() {
        return Vec::new();
    }
    let is_notified = |level| config.hooks.iter().any(|hook| hook.levels.contains(&level));
    let mut lines = Vec::new();
    for (level, meaning) in [
        (Level::Red, "a failure is near"),
        (
            Level::Unknown,
            "a sensor is silent or at fault, or the clock is wrong",
        ),
    ] {
        if !is_notified(level) {
            lines.push(format!(
                "no hook has {level} among its levels: nobody is notified that {meaning}"
            ));
        }
    }
    lines
}

/// Benchmarks whose own red reaches nobody: hooks ask for other benchmarks, or for the site's level alone.
fn benchmarks_without_hook(config: &Config) -> Option<String> {
    const MOST_NAMED: usize = 5;
    let asks = |hook: &&HookConfig| hook.levels.contains(&Level::Red);
    let of_one = config.hooks.iter().filter(asks).filter(|hook| !hook.site);
    if of_one.clone().any(|hook| hook.benchmarks.is_empty()) {
        return None;
    }
    if of_one.clone().next().is_none() {
        let of_site = config.hooks.iter().find(asks)?;
        return Some(format!(
            "{:?} is notified of the site's red, and no hook of the red of a benchmark: where the site is red already, nobody is notified of another one",
            of_site.name()
        ));
    }
    let named = config.benchmarks.iter().map(|benchmark| &benchmark.id);
    let mut missed = named.filter(|id| !of_one.clone().any(|hook| hook.benchmarks.contains(*id)));
    let first: Vec<String> = (missed.by_ref().take(MOST_NAMED))
        .map(ToString::to_string)
        .collect();
    let more = match missed.count() {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    (!first.is_empty()).then(|| {
        format!(
            "no hook that has red among its levels asks for {}{more}: nobody is notified of their red",
            first.join(", ")
        )
    })
}

/// Levels of which the first notification comes only when nobody has acknowledged what nobody was notified of.
fn only_escalated(config: &Config) -> Vec<String> {
    let mut lines = Vec::new();
    for level in [Level::Yellow, Level::Orange, Level::Red, Level::Unknown] {
        let asked = || {
            config
                .hooks
                .iter()
                .filter(|hook| hook.levels.contains(&level))
        };
        if asked().count() > 0 && asked().all(|hook| hook.escalate_after.is_some()) {
            lines.push(format!(
                "every hook that has {level} among its levels has escalate_after: nobody is notified of it at once"
            ));
        }
    }
    lines
}

/// When in the week nobody is on duty who is notified of red at once.
fn off_duty(config: &Config) -> Option<String> {
    let at_once = |hook: &&HookConfig| hook.escalate_after.is_none() && !hook.site;
    let asked = config.hooks.iter().filter(at_once);
    let mut asked = asked.filter(|hook| hook.levels.contains(&Level::Red));
    let hours: Option<Vec<&DutyHours>> = asked.by_ref().map(|hook| hook.hours.as_ref()).collect();
    let hours = hours.filter(|hours| !hours.is_empty())?;
    let from = duty::gap(&hours)?;
    Some(format!(
        "every hook that has red among its levels has hours, and none of them is on duty from {from}: nobody is notified of red then"
    ))
}

/// A hook of a benchmark whose name is mistyped would never be notified.
fn unknown_benchmarks(config: &Config) -> impl Iterator<Item = String> {
    let is_known = |id: &BenchmarkId| config.benchmarks.iter().any(|one| one.id == *id);
    let asked = config.hooks.iter().flat_map(|hook| &hook.benchmarks);
    asked
        .filter(move |id| !config.benchmarks.is_empty() && !is_known(id))
        .map(|id| {
            format!(
                "a hook asks for benchmark {:?}, which the config does not name",
                id.as_str()
            )
        })
}

fn open_token(file: &Path) -> Option<String> {
    let mode = std::fs::metadata(file).ok()?.permissions().mode();
    (mode & 0o007 != 0).then(|| {
        format!(
            "site.token_file: everyone on this machine can read {}; chmod o= it",
            file.display()
        )
    })
}

/// A mean over longer than the evacuation takes shows the danger when it is too late.
fn slow_sampling(config: &Config) -> impl Iterator<Item = String> {
    config.benchmarks.iter().filter_map(|benchmark| {
        let policy = config
            .settings
            .benchmarks
            .get(&benchmark.id)
            .unwrap_or(&config.settings.policy);
        let averaging = benchmark.averaging.unwrap_or(SignedDuration::ZERO);
        let is_mean = benchmark
            .unit
            .is_none_or(|unit| unit.quantity() == Quantity::Velocity);
        (is_mean && averaging >= policy.evacuation_time).then(|| {
            format!(
                "benchmark {:?}: averaging {averaging:#} is not shorter than evacuation_time {:#}; \
                 this sampling cannot protect anyone, measure more often",
                benchmark.id.as_str(),
                policy.evacuation_time
            )
        })
    })
}

impl Config {
    /// The names of the hooks for which alerts wait on purpose.
    pub fn later_hooks(&self) -> Vec<String> {
        let hooks = self.hooks.iter();
        let later = hooks.filter(|hook| hook.waits_on_purpose());
        later.map(HookConfig::name).collect()
    }

    /// Has the hooks run in a sandbox by `program`, which must be this one, but for those that ask not to be.
    pub fn sandbox_hooks(&mut self, program: &Path) {
        for hook in self.hooks.iter_mut().filter(|hook| hook.sandbox) {
            hook.launcher = Some(program.to_owned());
        }
    }
}

impl SiteConfig {
    /// What callers must know, where they must.
    ///
    /// # Errors
    /// [`WordFileError`].
    pub fn token(&self) -> Result<Option<Token>, WordFileError> {
        self.token_file.as_deref().map(Token::read).transpose()
    }
}

impl HookConfig {
    /// Whether an alert waits before it is given to this hook: until nobody has acknowledged it for some time, or until people are on duty.
    pub fn waits_on_purpose(&self) -> bool {
        self.escalate_after.is_some() || self.hours.is_some()
    }

    /// The table of the config that it stands in.
    pub fn table(&self) -> &'static str {
        self.to.as_ref().map_or("hook", |to| to.table())
    }

    /// The program's path: a name with a slash starts at the config's folder, a bare one is looked
    /// up in `PATH`.
    pub fn program(&self) -> PathBuf {
        let name = self.run.first().map_or("", String::as_str);
        if name.contains('/') {
            self.folder.join(name)
        } else {
            PathBuf::from(name)
        }
    }
}
