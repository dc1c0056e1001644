//! Runs one hook once: cleaned environment, alert on stdin, own process group, killed at its timeout.

mod processes;
mod status;

use super::many::{EarlierLevel, ManyAlerts};
use super::sandbox::{self, CANNOT_RUN, CANNOT_RUN_BECAUSE};
use crate::alert::Level;
use crate::config::HookConfig;
use crate::monitor::{CLOCK_FAULT, Event, EventKind};
use crate::reading::{BenchmarkId, Timestamp, local};
use crate::store::AlertIdentity;
use jiff::tz::TimeZone;
use processes::{ProcessGroup, RUN, kill_all_of, run_name};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::os::unix::process::ExitStatusExt;
use std::process::{ExitStatus, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWriteExt};
use tokio::process::Child;
use tokio::task::JoinHandle;

use status::CORRECTION;
pub(crate) use status::state_name;
pub use status::{MessageState, Status};

/// What of our own environment a hook sees.
const KEPT_VARIABLES: [&str; 4] = ["PATH", "HOME", "LANG", "TZ"];
/// Longest value of a variable, bytes.
const LONGEST_VALUE: usize = 4096;
/// How much of a hook's output is kept, bytes a stream.
const LONGEST_OUTPUT: usize = 4096;
/// After the hook's end: how long what it has just written may take to arrive.
const OUTPUT_GRACE: Duration = Duration::from_millis(200);
/// After the kill: how long the kernel may take to report the end.
const KILL_GRACE: Duration = Duration::from_secs(5);

/// The rule of an alert that reports many benchmarks at once.
pub(super) const FLOOD: &str = "flood";

/// An alert, or the correction of one, on its way to people.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Alert {
    /// The monitor's event.
    pub event: Event,
    /// Which level; of a correction the one that would have been called.
    pub level: Level,
    /// What the message says of it.
    pub state: MessageState,
    /// The event's idempotency key; a correction has one of its own.
    pub key: String,
    /// The site's name.
    pub site: String,
    /// The benchmark's forecast of failure when the alert was called: its median, which is put on the early side.
    pub failure_time: Option<Timestamp>,
    /// Of an end: the time that people were given of its call; none in an outbox of older versions.
    #[serde(default)]
    pub called: Option<Timestamp>,
    /// The lower levels of its benchmark that it, or the level that it ends, followed on: the lowest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub earlier: Vec<EarlierLevel>,
    /// The level in force at its benchmark, where it says that this is `unknown`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beside: Option<Level>,
    /// What it reports together, where it stands for many; none in an outbox of older versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub many: Option<ManyAlerts>,
    /// Whether it means what it says.
    pub status: Status,
}

/// What hooks and webhooks get: the event of the alert, and what goes with it.
#[derive(Debug, JsonSchema, Serialize)]
pub struct HookBody<'a> {
    #[serde(flatten)]
    event: &'a Event,
    #[serde(flatten)]
    correction: Option<CorrectionIdentity<'a>>,
    /// The site's name.
    site: &'a str,
    /// The benchmark's forecast of failure when the alert was called: its median, which is put on the early side.
    failure_time: Option<Timestamp>,
    /// Whether it means what it says.
    status: Status,
    /// What people are asked to do; null at the end of an alert.
    recommended: Option<String>,
    /// The level in force at the benchmark beside an `unknown`, which does not end it; null where there is none.
    level_in_force: Option<Level>,
    /// By which this alert, and no other, is acknowledged once; null where the site has no public address.
    acknowledge_url: Option<&'a str>,
    /// Which attempt this is, from 1.
    attempt: u32,
    /// Of this form, 1.
    schema_version: u32,
}

/// What a correction's message has beside its event, so that it can be known as an alert is.
#[derive(Debug, JsonSchema, Serialize)]
struct CorrectionIdentity<'a> {
    /// The level that would have been called.
    level: Level,
    /// `correction`.
    state: MessageState,
    /// The same at each attempt, and no alert's.
    key: &'a str,
}

impl Alert {
    /// What the outbox knows it by.
    pub(super) fn identity(&self) -> AlertIdentity<'_> {
        AlertIdentity {
            key: &self.key,
            level: self.level.name(),
            state: state_name(self.state),
        }
    }

    /// The alert or the correction in `event`; `None` where it is an event of another kind.
    pub fn new(
        event: &Event,
        site: &str,
        failure_time: Option<Timestamp>,
        status: Status,
    ) -> Option<Self> {
        let (level, state, key) = if let EventKind::Alert {
            level, state, key, ..
        } = &event.kind
        {
            (*level, (*state).into(), key.clone())
        } else if let EventKind::Correction { level_now, .. } = &event.kind {
            let benchmark = event.benchmark.as_ref()?;
            let key = format!("{benchmark}/{CORRECTION}/{}", event.time);
            (*level_now, MessageState::Correction, key)
        } else {
            return None;
        };
        Some(Self {
            level,
            state,
            key,
            event: event.clone(),
            site: site.to_owned(),
            failure_time,
            called: None,
            earlier: Vec::new(),
            beside: None,
            many: None,
            status,
        })
    }

    /// The message of its beginning, by which receipts know that.
    pub(super) fn beginning(&self) -> Self {
        let state = MessageState::Firing;
        Self {
            state,
            ..self.clone()
        }
    }

    /// Of an end: the same for another alert that ends with it, by its own key.
    pub(super) fn end_of(&self, benchmark: Option<&BenchmarkId>, level: Level, key: &str) -> Self {
        let mut end = self.clone();
        (end.level, end.key, end.called, end.many) = (level, key.to_owned(), None, None);
        end.event.benchmark = benchmark.cloned();
        end.earlier.retain(|one| one.level < level);
        if let EventKind::Alert {
            level: own_level,
            key: own_key,
            ..
        } = &mut end.event.kind
        {
            (*own_level, *own_key) = (level, key.to_owned());
        }
        end
    }

    /// Whether it is tried until a hook has taken it: people's safety depends on it.
    pub fn must_arrive(&self) -> bool {
        match self.level {
            Level::Orange | Level::Red | Level::Unknown => match self.state {
                MessageState::Firing | MessageState::Correction => true,
                MessageState::Resolved => false,
            },
            Level::Green | Level::Yellow => false,
        }
    }

    /// Whether it reports many benchmarks at once, each of which it stands for.
    pub fn is_flood(&self) -> bool {
        let is_of_many = self.event.benchmark.is_none() && self.is_correction();
        // The end of one of its benchmarks has the same rule.
        let is_of_one = self.event.benchmark.is_some();
        is_of_many
            || !is_of_one
                && matches!(&self.event.kind, EventKind::Alert { rule, .. } if rule == FLOOD)
    }

    /// Whether it corrects what was called, and calls nothing itself.
    pub fn is_correction(&self) -> bool {
        self.state == MessageState::Correction
    }

    /// Whether it says that the host's clock is wrong, or right again.
    pub fn is_of_the_clock(&self) -> bool {
        matches!(&self.event.kind, EventKind::Alert { rule, .. } if rule == CLOCK_FAULT)
    }

    /// What people are recommended to do; of what is over, nothing.
    fn recommended(&self) -> Option<String> {
        let is_firing = self.state == MessageState::Firing;
        let recommended = self.level.recommended_beside(self.beside);
        is_firing.then(|| self.status.marked(recommended))
    }

    /// What a hook gets in its environment; `zone`: in which people at the site live.
    fn variables(
        &self,
        attempt: u32,
        link: Option<&str>,
        zone: &TimeZone,
    ) -> [(&'static str, String); 17] {
        let benchmark = self.event.benchmark.as_ref();
        let count = self.many.as_ref().map_or(1, |many| many.members.len());
        let optional_time = self.failure_time.map(|time| time.to_string());
        let (rule, text) = if let EventKind::Alert { rule, text, .. } = &self.event.kind {
            (rule.clone(), text.clone())
        } else if let EventKind::Correction { text, .. } = &self.event.kind {
            (String::new(), text.clone())
        } else {
            (String::new(), String::new())
        };
        [
            ("SLIPWATCH_EVENT", self.event.kind.name().to_owned()),
            ("SLIPWATCH_KEY", self.key.clone()),
            ("SLIPWATCH_SITE", self.site.clone()),
            (
                "SLIPWATCH_BENCHMARK",
                benchmark.map(ToString::to_string).unwrap_or_default(),
            ),
            ("SLIPWATCH_COUNT", count.to_string()),
            ("SLIPWATCH_LEVEL", self.level.name().to_owned()),
            (
                "SLIPWATCH_IN_FORCE",
                self.beside
                    .map_or_else(String::new, |level| level.name().to_owned()),
            ),
            ("SLIPWATCH_STATE", state_name(self.state).to_owned()),
            ("SLIPWATCH_RULE", rule),
            ("SLIPWATCH_TEXT_LOCAL", local(&text, zone)),
            ("SLIPWATCH_TEXT", text),
            ("SLIPWATCH_TIME", self.event.time.to_string()),
            ("SLIPWATCH_FAILURE_TIME", optional_time.unwrap_or_default()),
            ("SLIPWATCH_ATTEMPT", attempt.to_string()),
            ("SLIPWATCH_STATUS", self.status.name().to_owned()),
            (
                "SLIPWATCH_RECOMMENDED",
                self.recommended().unwrap_or_default(),
            ),
            (
                "SLIPWATCH_ACKNOWLEDGE_URL",
                link.unwrap_or_default().to_owned(),
            ),
        ]
    }

    /// What a hook gets on stdin; `link`: by which it is acknowledged.
    pub(super) fn body(
        &self,
        attempt: u32,
        link: Option<&str>,
    ) -> Result<Vec<u8>, serde_json::Error> {
        let correction = self.is_correction().then_some(CorrectionIdentity {
            level: self.level,
            state: self.state,
            key: &self.key,
        });
        let mut body = serde_json::to_vec(&HookBody {
            event: &self.event,
            correction,
            site: &self.site,
            failure_time: self.failure_time,
            status: self.status,
            recommended: self.recommended(),
            level_in_force: self.beside,
            acknowledge_url: link,
            attempt,
            schema_version: 1,
        })?;
        body.push(b'\n');
        Ok(body)
    }
}

/// How a run of a hook ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum HookOutcome {
    /// Exit code 0: the message is on its way.
    Done,
    /// Another exit code.
    Failed(i32),
    /// Ended by a signal that was not ours.
    Signalled(i32),
    /// Killed with all its children when the time was up.
    TimedOut,
    /// The receiver of a webhook answered with this status.
    Refused(u16),
    /// It could not be run, or sent, at all.
    NotStarted(String),
}

impl HookOutcome {
    /// For a person.
    pub fn in_words(&self) -> String {
        match self {
            Self::Done => "done".to_owned(),
            Self::Failed(code) => format!("ended with exit code {code}"),
            Self::Signalled(signal) => format!("ended by signal {signal}"),
            Self::TimedOut => "killed when its time was up".to_owned(),
            Self::Refused(status) => format!("answered with status {status}"),
            Self::NotStarted(why) => format!("not started: {why}"),
        }
    }
}

/// In which people at the site live: what a hook shows times in, which it gets in UTC.
const TIME_ZONE: &str = "SLIPWATCH_TIME_ZONE";

/// Runs the program of `hook` for `alert`; `attempt` counts from 1.
pub(super) async fn run_program(
    hook: &HookConfig,
    alert: &Alert,
    attempt: u32,
    link: Option<&str>,
) -> HookOutcome {
    let run = run_name();
    let zone = TimeZone::get(&hook.zone).unwrap_or(TimeZone::UTC);
    let mut child = match start(hook, &alert.variables(attempt, link, &zone), &run) {
        Ok(child) => child,
        Err(reason) => return HookOutcome::NotStarted(reason),
    };
    let body = match alert.body(attempt, link) {
        Ok(body) => body,
        Err(error) => return HookOutcome::NotStarted(error.to_string()),
    };
    let mut group = ProcessGroup::of(&child, &run);
    let writer = child.stdin.take().map(|mut stdin| {
        // A hook may leave stdin unread: its closing the pipe is no error, its filling up only
        // holds this task, which ends with the hook.
        tokio::spawn(async move {
            let _ = stdin.write_all(&body).await;
        })
    });
    let stdout = child.stdout.take().map(Capture::of);
    let stderr = child.stderr.take().map(Capture::of);
    let ended = tokio::time::timeout(hook.timeout, child.wait()).await;
    let outcome = match ended {
        Ok(Ok(status)) => {
            group.leave();
            let outcome = outcome(status);
            // It is run again: what each attempt leaves behind would pile up. One that went well may leave something at work.
            if outcome != HookOutcome::Done {
                let _ = tokio::task::spawn_blocking(move || kill_all_of(&run)).await;
            }
            outcome
        }
        Ok(Err(error)) => HookOutcome::NotStarted(error.to_string()),
        Err(_elapsed) => {
            let _ = tokio::task::spawn_blocking(move || group.kill()).await;
            // Reaps the child; a process stuck in the kernel must not hold the alerts up.
            let _ = tokio::time::timeout(KILL_GRACE, child.wait()).await;
            HookOutcome::TimedOut
        }
    };
    if let Some(writer) = writer {
        writer.abort();
    }
    let (stdout, stderr) = tokio::join!(finish(stdout), finish(stderr));
    // What was to run it has said why it cannot.
    let cannot_run = outcome == HookOutcome::Failed(i32::from(CANNOT_RUN));
    let last = stderr.lines().next_back().filter(|_| cannot_run);
    let why = last.and_then(|last| last.strip_prefix(CANNOT_RUN_BECAUSE));
    let outcome = why.map_or(outcome, |why| HookOutcome::NotStarted(why.to_owned()));
    tracing::info!(hook = ?hook.run, key = alert.key, attempt, ?outcome, stdout, stderr, "hook ended");
    outcome
}

fn start(hook: &HookConfig, variables: &[(&str, String)], run: &str) -> Result<Child, String> {
    let program = hook.program();
    let mut command = sandbox::command(hook);
    command
        .env_clear()
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .process_group(0)
        .kill_on_drop(true);
    if !hook.folder.as_os_str().is_empty() {
        command.current_dir(&hook.folder);
    }
    for name in KEPT_VARIABLES {
        if let Some(value) = std::env::var_os(name) {
            command.env(name, value);
        }
    }
    for (name, value) in variables {
        command.env(name, capped(value));
    }
    command.env(RUN, run).env(TIME_ZONE, &hook.zone);
    command
        .spawn()
        .map_err(|error| format!("{}: {error}", program.display()))
}

/// What the kernel takes as a variable's value, and any script can print: no control characters, not too long, cut between characters.
/// They are not written out as `\n` either: the `echo` of some shells makes a line break of that.
fn capped(value: &str) -> String {
    let clean = value.replace(char::is_control, " ");
    let mut end = clean.len().min(LONGEST_VALUE);
    while !clean.is_char_boundary(end) {
        end -= 1;
    }
    clean[..end].to_owned()
}

fn outcome(status: ExitStatus) -> HookOutcome {
    match (status.code(), status.signal()) {
        (Some(0), _) => HookOutcome::Done,
        (Some(code), _) => HookOutcome::Failed(code),
        (None, signal) => HookOutcome::Signalled(signal.unwrap_or_default()),
    }
}

/// Reads a stream to its end and keeps its first part, so that neither a flood nor a grandchild
/// that holds the stream open stops anything.
#[derive(Debug)]
struct Capture {
    kept: Arc<Mutex<Kept>>,
    reader: JoinHandle<()>,
}

/// The first part of a stream, and how many bytes came after it.
#[derive(Debug, Default)]
struct Kept {
    first: Vec<u8>,
    more: usize,
}

impl Capture {
    fn of(mut stream: impl AsyncRead + Unpin + Send + 'static) -> Self {
        let kept = Arc::new(Mutex::new(Kept::default()));
        let sink = Arc::clone(&kept);
        let reader = tokio::spawn(async move {
            let mut buffer = vec![0; 8192];
            while let Ok(count @ 1..) = stream.read(&mut buffer).await {
                let mut kept = sink.lock().unwrap_or_else(PoisonError::into_inner);
                let taken = count.min(LONGEST_OUTPUT - kept.first.len());
                kept.first.extend_from_slice(&buffer[..taken]);
                kept.more += count - taken;
            }
        });
        Self { kept, reader }
    }
}

async fn finish(capture: Option<Capture>) -> String {
    let Some(mut capture) = capture else {
        return String::new();
    };
    if tokio::time::timeout(OUTPUT_GRACE, &mut capture.reader)
        .await
        .is_err()
    {
        capture.reader.abort();
    }
    let kept = capture.kept.lock().unwrap_or_else(PoisonError::into_inner);
    let first = String::from_utf8_lossy(&kept.first).trim_end().to_owned();
    match kept.more {
        0 => first,
        more => format!("{first} ... and {more} bytes more"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_cut_between_characters_and_has_no_nul() {
        let long = "\u{e9}".repeat(3000);
        assert_eq!(capped(&long).len(), LONGEST_VALUE);
        assert_eq!(capped(&format!("a{long}")).len(), LONGEST_VALUE - 1);
        assert_eq!(capped("a\0b"), "a b");
        assert_eq!(capped("x\n7  red\u{1b}[2J"), "x 7  red [2J");
    }

    #[tokio::test]
    async fn of_a_flood_the_first_part_is_kept_and_what_was_left_out_is_counted() {
        use tokio::io::AsyncReadExt;
        let flood = tokio::io::repeat(b'a').take(1_000_000);
        let kept = finish(Some(Capture::of(flood))).await;
        let left_out = 1_000_000 - LONGEST_OUTPUT;
        assert_eq!(
            kept,
            format!(
                "{} ... and {left_out} bytes more",
                "a".repeat(LONGEST_OUTPUT)
            )
        );
        assert_eq!(finish(Some(Capture::of(&b"short\n"[..]))).await, "short");
    }
}
