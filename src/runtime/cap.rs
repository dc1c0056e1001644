//! Writes one alert as a message of the Common Alerting Protocol 1.2 (OASIS): a file each, in a folder.
//!
//! Of each place the messages make a chain: an Alert, an Update for each change of level that follows on it, a Cancel at the end;
//! each names all that came before it. A correction is an Update that leaves the level as it is; where none is in force there is
//! nothing to update. The chain stands beside the messages and is written first, so that a second
//! attempt writes the same file again.

use super::clock;
use super::hook::{Alert, HookOutcome, MessageState, state_name};
use super::kept;
use super::way_out::{DeliveryAttempt, WayOut, destination};
use crate::alert::{Level, is_observed};
use crate::config::CapFolder;
use crate::monitor::EventKind;
use crate::reading::Timestamp;
use nix::unistd::{AccessFlags, access};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Messages that a chain names; the oldest go.
const LONGEST_CHAIN: usize = 50;
/// As the schema has a time: no letter for the zone.
const TIME: &str = "%Y-%m-%dT%H:%M:%S-00:00";

/// One message of a chain.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct CapMessage {
    identifier: String,
    sent: Timestamp,
    is_cancel: bool,
    /// The level in force; none in chains of an earlier version.
    #[serde(default)]
    level: Option<Level>,
    /// Whether it reports the beginning of an alert; not known in chains of an earlier version.
    #[serde(default)]
    begins: bool,
}

/// What a message is to those before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum MessageType {
    Alert,
    Update,
    Cancel,
}

/// A folder of messages.
pub(super) static CAP: WayOut = WayOut {
    table: "cap",
    send: |delivery| Box::pin(send(delivery)),
    repeat: None,
    ready: |hook| {
        let cap: &CapFolder = destination(hook)?;
        let folder = cap.folder.display();
        match writable(&cap.folder) {
            Ok(()) => Ok(format!(
                "{folder} can be written to; hook test writes a message"
            )),
            Err(error) => Err(format!("{folder}: {error}")),
        }
    },
};

async fn send(delivery: DeliveryAttempt) -> HookOutcome {
    let cap: CapFolder = match delivery.to::<CapFolder>() {
        Ok(cap) => cap.clone(),
        Err(outcome) => return outcome,
    };
    let DeliveryAttempt {
        hook,
        alert,
        attempt,
    } = delivery;
    let (name, key) = (hook.name(), alert.key.clone());
    // A disk may hang: the worker does not wait with it.
    let writing = tokio::task::spawn_blocking(move || write(&cap, &alert));
    let outcome = match tokio::time::timeout(hook.timeout, writing).await {
        Ok(written) => written.unwrap_or_else(|error| HookOutcome::NotStarted(error.to_string())),
        Err(_elapsed) => HookOutcome::TimedOut,
    };
    tracing::info!(hook = name, key, attempt, ?outcome, "CAP message ended");
    outcome
}

/// Whether a message could be written there, or the folder be made.
fn writable(folder: &Path) -> nix::Result<()> {
    // The last ancestor of a relative path is empty, and is the folder one is in.
    let is_here = |folder: &Path| folder.as_os_str().is_empty();
    let each = folder.ancestors();
    let mut each = each.map(|one| if is_here(one) { Path::new(".") } else { one });
    access(
        each.find(|folder| folder.is_dir()).unwrap_or(folder),
        AccessFlags::W_OK | AccessFlags::X_OK,
    )
}

/// Writes `alert` into the folder; where its file is there already it is written again, the same.
fn write(cap: &CapFolder, alert: &Alert) -> HookOutcome {
    let now = clock::now();
    let all = written(cap, alert, now).and_then(|()| end_members(cap, alert, now));
    match all {
        Ok(()) => HookOutcome::Done,
        Err(error) => HookOutcome::NotStarted(format!("{}: {error}", cap.folder.display())),
    }
}

/// At the end of what was reported together: ends the chains of those that had been reported singly. A chain that has begun anew
/// since goes on.
fn end_members(cap: &CapFolder, alert: &Alert, now: Timestamp) -> io::Result<()> {
    let members = alert.many.iter().flat_map(|many| &many.members);
    for one in members.filter(|_| alert.state == MessageState::Resolved) {
        let benchmark = one.benchmark.as_ref();
        let end = alert.end_of(benchmark, alert.level, &one.key);
        let earlier = (alert.earlier.iter()).filter(|earlier| earlier.benchmark == one.benchmark);
        let ends = earlier.map(|one| alert.end_of(benchmark, one.level, &one.key));
        let begun: Vec<String> = ends
            .chain([end.clone()])
            .map(|end| identifier(&end.beginning()))
            .collect();
        let chain = chain_of(cap, &end)?;
        let is_its_own = chain.iter().any(|one| begun.contains(&one.identifier));
        if is_its_own {
            written(cap, &end, now)?;
        }
    }
    Ok(())
}

fn identifier(alert: &Alert) -> String {
    format!(
        "slipwatch-{}",
        short(&format!(
            "{}\n{}\n{}\n{}\n{}",
            alert.site,
            alert.key,
            alert.level,
            state_name(alert.state),
            alert.status.name()
        ))
    )
}

/// Where the chain of messages stands that `alert` belongs to. Several sites may write into one folder, where a program forwards what
/// comes there.
fn chain_file(cap: &CapFolder, alert: &Alert) -> PathBuf {
    named_chain(cap, &format!("{}\n{}", alert.site, place(alert)))
}

fn named_chain(cap: &CapFolder, name: &str) -> PathBuf {
    cap.folder
        .join("chains")
        .join(format!("{}.json", short(name)))
}

/// The chain that `alert` belongs to. Up to version 0.1.0 its name did not say of which site it was: the first site that asks for it takes it
/// over.
fn chain_of(cap: &CapFolder, alert: &Alert) -> io::Result<Vec<CapMessage>> {
    let file = chain_file(cap, alert);
    let former = named_chain(cap, &place(alert));
    if former.exists() && !file.exists() {
        fs::rename(&former, &file)?;
    }
    read(&file)
}

fn written(cap: &CapFolder, alert: &Alert, now: Timestamp) -> io::Result<()> {
    fs::create_dir_all(cap.folder.join("chains"))?;
    let place = chain_file(cap, alert);
    let mut chain = chain_of(cap, alert)?;
    let identifier = identifier(alert);
    let is_cancel = alert.state == MessageState::Resolved;
    let known = chain.iter().position(|one| one.identifier == identifier);
    let at = if let Some(at) = known {
        at
    } else {
        // After its end a place begins again.
        if chain.last().is_some_and(|last| last.is_cancel) {
            chain.clear();
        }
        // The level that followed on it has taken its place already, and is not over.
        let own = is_cancel.then(|| self::identifier(&alert.beginning()));
        let own = own.and_then(|own| chain.iter().position(|one| one.identifier == own));
        if own.is_some_and(|own| chain[own + 1..].iter().any(|one| one.begins)) {
            tracing::info!(
                key = alert.key,
                "the end of what a later CAP message has replaced"
            );
            return Ok(());
        }
        if chain.is_empty() && alert.state != MessageState::Firing {
            tracing::info!(
                key = alert.key,
                "the end, or the correction, of what no CAP message has reported"
            );
            return Ok(());
        }
        let level = match alert.state {
            MessageState::Firing | MessageState::Resolved => Some(alert.level),
            MessageState::Correction => chain.last().and_then(|last| last.level),
        };
        chain.push(CapMessage {
            identifier,
            sent: now,
            is_cancel,
            level,
            begins: alert.state == MessageState::Firing,
        });
        let excess = chain.len().saturating_sub(LONGEST_CHAIN);
        chain.drain(..excess);
        kept::replace(&place, &serde_json::to_vec(&chain)?)?;
        chain.len() - 1
    };
    let (message, before) = (&chain[at], &chain[..at]);
    let name = format!(
        "{}-{}.xml",
        message.sent.strftime("%Y%m%dT%H%M%SZ"),
        message.identifier
    );
    kept::replace(
        &cap.folder.join(name),
        xml(cap, alert, message, before).as_bytes(),
    )
}

/// What a chain belongs to: a place and whether it is known; what reports many benchmarks stands for itself. A drill is no part of
/// a chain of what is meant.
fn place(alert: &Alert) -> String {
    let status = alert.status.name();
    if alert.is_flood() {
        return format!("{status}\nmany\n{}", alert.key);
    }
    let benchmark = alert.event.benchmark.as_ref();
    let benchmark = benchmark.map_or("site\n", |one| one.as_str());
    format!("{status}\n{}\n{benchmark}", alert.level == Level::Unknown)
}

fn short(text: &str) -> String {
    let mut hex = String::new();
    for byte in &Sha256::digest(text.as_bytes())[..12] {
        // Writing to a string cannot fail.
        let _ = write!(hex, "{byte:02x}");
    }
    hex
}

/// The chain that a file holds. One that cannot be read as such is set aside, and a chain begins anew: an alert is written without
/// references rather than not at all.
fn read(file: &Path) -> io::Result<Vec<CapMessage>> {
    match fs::read(file) {
        Ok(bytes) => serde_json::from_slice(&bytes).or_else(|error| {
            let aside = file.with_extension("damaged");
            tracing::warn!(file = %file.display(), aside = %aside.display(), %error, "the messages to which a CAP message refers cannot be read: it is written without references");
            fs::rename(file, aside)?;
            Ok(Vec::new())
        }),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Vec::new()),
        Err(error) => Err(error),
    }
}

fn xml(cap: &CapFolder, alert: &Alert, message: &CapMessage, before: &[CapMessage]) -> String {
    let kind = match (alert.state, before.is_empty()) {
        (MessageState::Resolved, _) => MessageType::Cancel,
        (MessageState::Firing, true) => MessageType::Alert,
        (MessageState::Firing, false) | (MessageState::Correction, _) => MessageType::Update,
    };
    let mut out = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
                   <alert xmlns=\"urn:oasis:names:tc:emergency:cap:1.2\">\n"
        .to_owned();
    let sent = |one: &CapMessage| one.sent.strftime(TIME).to_string();
    element(&mut out, 1, "identifier", &message.identifier);
    element(&mut out, 1, "sender", &cap.sender);
    element(&mut out, 1, "sent", &sent(message));
    element(&mut out, 1, "status", alert.status.name());
    let kind_name = match kind {
        MessageType::Alert => "Alert",
        MessageType::Update => "Update",
        MessageType::Cancel => "Cancel",
    };
    element(&mut out, 1, "msgType", kind_name);
    element(&mut out, 1, "scope", "Restricted");
    element(
        &mut out,
        1,
        "restriction",
        "For those who decide whether the public is warned",
    );
    if !before.is_empty() {
        let each = before
            .iter()
            .map(|one| format!("{},{},{}", cap.sender, one.identifier, sent(one)));
        let references = each.collect::<Vec<_>>().join(" ");
        element(&mut out, 1, "references", &references);
    }
    let level = message.level.unwrap_or(alert.level);
    info(&mut out, cap, alert, level, kind);
    out += "</alert>\n";
    out
}

/// The rule of an alert, the text, and the keys of the alerts that a correction is about.
fn content(alert: &Alert) -> (&str, &str, Option<String>) {
    if let EventKind::Alert { rule, text, .. } = &alert.event.kind {
        (rule, text, None)
    } else if let EventKind::Correction { alerts, text, .. } = &alert.event.kind {
        (state_name(alert.state), text, Some(alerts.join(" ")))
    } else {
        (state_name(alert.state), "", None)
    }
}

/// `level`: what is in force, or has ended.
fn info(out: &mut String, cap: &CapFolder, alert: &Alert, level: Level, kind: MessageType) {
    let (rule, text, corrects) = content(alert);
    let is_over = kind == MessageType::Cancel;
    let (response, urgency, severity) = match level {
        Level::Red => ("Evacuate", "Immediate", "Extreme"),
        Level::Orange => ("Prepare", "Future", "Severe"),
        Level::Yellow => ("Monitor", "Future", "Moderate"),
        Level::Green => ("None", "Past", "Minor"),
        Level::Unknown => ("Monitor", "Unknown", "Unknown"),
    };
    let headline = headline(alert, level);
    *out += "  <info>\n";
    element(out, 2, "language", "en");
    element(out, 2, "category", "Geo");
    element(out, 2, "event", "Landslide");
    element(
        out,
        2,
        "responseType",
        if is_over { "Assess" } else { response },
    );
    element(out, 2, "urgency", urgency);
    element(out, 2, "severity", severity);
    element(out, 2, "certainty", certainty(level, rule));
    element(
        out,
        2,
        "senderName",
        &format!("slipwatch at {}", alert.site),
    );
    element(out, 2, "headline", &headline);
    element(out, 2, "description", text);
    let instruction = if is_over {
        "The level has ended. People look at the slope before anybody goes back."
    } else {
        level.recommended_beside(alert.beside)
    };
    element(out, 2, "instruction", &alert.status.marked(instruction));
    parameters(out, alert, level, rule, corrects);
    *out += "    <area>\n";
    element(out, 3, "areaDesc", &cap.area);
    if let Some(polygon) = &cap.polygon {
        element(out, 3, "polygon", polygon);
    }
    *out += "    </area>\n  </info>\n";
}

/// Which site, where in it, which level. What reports many benchmarks says how many: that is what makes it urgent.
fn headline(alert: &Alert, level: Level) -> String {
    let place = match (&alert.event.benchmark, &alert.many) {
        (Some(benchmark), _) => format!("benchmark {benchmark}"),
        (None, Some(many)) => format!("{} more benchmarks", many.members.len()),
        // As an earlier version has kept it.
        (None, None) if alert.is_flood() => "many benchmarks".to_owned(),
        (None, None) => "the whole site".to_owned(),
    };
    let what = match alert.state {
        MessageState::Firing => "",
        MessageState::Resolved => " ends",
        MessageState::Correction => " is in force; what was called before is corrected",
    };
    let headline = format!("{}, {place}: {level}{what}", alert.site);
    alert.status.marked(&headline)
}

fn parameters(out: &mut String, alert: &Alert, level: Level, rule: &str, corrects: Option<String>) {
    let median = alert.failure_time.map(|time| time.to_string());
    let parameters = [
        ("level", Some(level.name().to_owned())),
        ("state", Some(state_name(alert.state).to_owned())),
        ("rule", Some(rule.to_owned())),
        ("key", Some(alert.key.clone())),
        ("corrects", corrects),
        ("called-at", Some(alert.event.time.to_string())),
        ("failure-time-median", median),
    ];
    for (name, value) in parameters {
        let Some(value) = value else { continue };
        *out += "    <parameter>\n";
        element(out, 3, "valueName", name);
        element(out, 3, "value", &value);
        *out += "    </parameter>\n";
    }
}

/// CAP's words: observed; likely; possible. Red is never less certain than orange, as receivers leave out what is: its chance is that of the next
/// two evacuation times alone, and the one within the outlook is higher.
fn certainty(level: Level, rule: &str) -> &'static str {
    if level == Level::Unknown {
        "Unknown"
    } else if is_observed(rule) {
        "Observed"
    } else if matches!(level, Level::Orange | Level::Red) {
        "Likely"
    } else {
        "Possible"
    }
}

fn element(out: &mut String, depth: usize, name: &str, text: &str) {
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "{:1$}<{name}>{2}</{name}>",
        "",
        2 * depth,
        escaped(text)
    );
}

/// Text as XML 1.0 takes it; what it takes in no form becomes U+FFFD.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '\t' | '\n' | '\r' => out.push(' '),
            '\u{0}'..='\u{1f}' | '\u{fffe}' | '\u{ffff}' => out.push('\u{fffd}'),
            other => out.push(other),
        }
    }
    out
}
