//! `[[hook]]` and `[[webhook]]`: whom alerts are sent to, and which.

use super::table::{Placed, Section};
use super::{HookConfig, Webhook, value};
use crate::alert::Level;
use crate::reading::BenchmarkId;
use std::collections::BTreeSet;
use std::path::Path;
use std::time::Duration;

const TIMEOUT: Duration = Duration::from_secs(10);

/// All of them: the programs first.
pub(super) fn hooks(root: &mut Section<'_>, base: &Path) -> Vec<HookConfig> {
    let programs = root.tables("hook", "hook").into_iter();
    let mut hooks: Vec<HookConfig> = programs
        .filter_map(|section| program(section, base))
        .collect();
    let mut taken = BTreeSet::new();
    for section in root.tables("webhook", "webhook") {
        hooks.extend(webhook(section, base, &mut taken));
    }
    unlike(root, &hooks);
    if hooks.is_empty() && !root.has("hook") && !root.has("webhook") {
        root.warning(
            root.at(),
            "there is no [[hook]]: nobody is notified of an alert".to_owned(),
            "add [[hook]] with run = [\"./notify.sh\"]",
        );
    }
    hooks
}

/// The outbox knows a hook by its command line: one that is run at once and again later needs two.
fn unlike(root: &Section<'_>, hooks: &[HookConfig]) {
    let later = hooks.iter().filter(|hook| hook.escalate_after.is_some());
    for hook in later.filter(|hook| hook.webhook.is_none()) {
        if hooks.iter().filter(|one| one.run == hook.run).count() > 1 {
            root.error(
                root.at(),
                format!(
                    "two hooks run {:?}, one of them with escalate_after: they cannot be told apart",
                    hook.run.join(" ")
                ),
                "give one of them an argument of its own, as in run = [\"./notify.sh\", \"escalation\"]",
            );
            return;
        }
    }
}

/// What a program and a webhook have in common.
struct Common {
    levels: Vec<Level>,
    benchmarks: BTreeSet<BenchmarkId>,
    site: bool,
    timeout: Duration,
    escalate_after: Option<Duration>,
}

fn common(section: &mut Section<'_>) -> Common {
    let benchmarks = section.texts("benchmarks");
    if let Some(given) = &benchmarks
        && given.value.is_empty()
    {
        section.error(
            &given.at,
            format!(
                "{} is empty: no alert would be sent",
                section.path("benchmarks")
            ),
            "leave it out for all, or write benchmarks = [\"5\"]",
        );
    }
    let benchmarks = benchmarks.map_or_else(Vec::new, |given| given.value);
    let timeout = section.parsed("timeout", value::duration);
    let escalate_after = section.parsed("escalate_after", value::duration);
    Common {
        levels: levels(section),
        benchmarks: (benchmarks.into_iter())
            .map(|word| BenchmarkId::new(word.value))
            .collect(),
        site: section.switch("site").unwrap_or(false),
        timeout: timeout.map_or(TIMEOUT, |given| given.value.unsigned_abs()),
        escalate_after: escalate_after.map(|given| given.value.unsigned_abs()),
    }
}

fn program(mut section: Section<'_>, base: &Path) -> Option<HookConfig> {
    let run = section.texts("run");
    if run.as_ref().is_none_or(|run| run.value.is_empty()) {
        let at = run.as_ref().map_or(section.at(), |run| &run.at);
        section.error(
            at,
            "hook.run names no program".to_owned(),
            "write run = [\"./notify.sh\"]",
        );
    }
    let common = common(&mut section);
    let sandbox = section.switch("sandbox").unwrap_or(true);
    let writable = section.texts("writable");
    if let Some(paths) = writable.as_ref().filter(|_| !sandbox) {
        section.warning(
            &paths.at,
            "hook.writable without a sandbox allows nothing more".to_owned(),
            "leave it out, or write sandbox = true",
        );
    }
    let writable = writable.map_or_else(Vec::new, |paths| paths.value);
    section.finish();
    Some(HookConfig {
        run: run?.value.into_iter().map(|word| word.value).collect(),
        webhook: None,
        levels: common.levels,
        benchmarks: common.benchmarks,
        site: common.site,
        timeout: common.timeout,
        escalate_after: common.escalate_after,
        folder: base.to_owned(),
        sandbox,
        writable: (writable.iter().map(|path| base.join(&path.value))).collect(),
        launcher: None,
    })
}

fn webhook(
    mut section: Section<'_>,
    base: &Path,
    taken: &mut BTreeSet<String>,
) -> Option<HookConfig> {
    let example = "\"http://127.0.0.1:9000/alerts\"";
    let url = section.required("url", example);
    let address = url.as_ref().and_then(|url| address(&section, url));
    let name = section.text("name");
    let secret = section.required("secret_file", "\"webhook.secret\"");
    let ca_file = section.text("ca_file");
    if let Some(given) = &ca_file
        && address.as_ref().and_then(hyper::Uri::scheme_str) == Some("http")
    {
        section.error(
            &given.at,
            "webhook.ca_file without TLS trusts nobody".to_owned(),
            "leave it out, or write url = \"https://...\"",
        );
    }
    let common = common(&mut section);
    if let Some(one) = name.as_ref().or(url.as_ref())
        && !taken.insert(one.value.clone())
    {
        section.error(
            &one.at,
            format!("there are two webhooks {:?}", one.value),
            "give each its own name: name = \"control room\"",
        );
    }
    section.finish();
    let (url, address) = (url?.value, address?);
    Some(HookConfig {
        run: Vec::new(),
        webhook: Some(Webhook {
            name: name.map_or(url, |given| given.value),
            address,
            ca_file: ca_file.map(|given| base.join(given.value)),
            secret_file: base.join(secret?.value),
        }),
        levels: common.levels,
        benchmarks: common.benchmarks,
        site: common.site,
        timeout: common.timeout,
        escalate_after: common.escalate_after,
        folder: base.to_owned(),
        sandbox: false,
        writable: Vec::new(),
        launcher: None,
    })
}

fn address(section: &Section<'_>, url: &Placed<String>) -> Option<hyper::Uri> {
    let refuse = |why: &str, fix: &str| {
        let what = format!("webhook.url = {:?} {why}", url.value);
        section.error(&url.at, what, fix);
        None
    };
    let Ok(address) = url.value.parse::<hyper::Uri>() else {
        return refuse("is no address", "write it as in \"http://host:port/path\"");
    };
    match address.scheme_str() {
        Some("http" | "https") => {}
        Some(_) | None => {
            let fix = "write it as in \"https://host/path\" or \"http://host:port/path\"";
            return refuse("is neither http nor https", fix);
        }
    }
    let has_user = (address.authority()).is_some_and(|one| one.as_str().contains('@'));
    if address.host().is_none_or(str::is_empty) {
        return refuse("names no host", "write it as in \"http://host:port/path\"");
    }
    if has_user {
        return refuse(
            "holds a password, which logs would show",
            "leave it out; the receiver checks the signature",
        );
    }
    Some(address)
}

fn levels(section: &mut Section<'_>) -> Vec<Level> {
    let Some(words) = section.texts("levels") else {
        return vec![Level::Orange, Level::Red, Level::Unknown];
    };
    let path = section.path("levels");
    if words.value.is_empty() {
        section.error(
            &words.at,
            format!("{path} is empty: no alert would be sent"),
            "write levels = [\"orange\", \"red\"]",
        );
    }
    let mut levels = Vec::new();
    for word in words.value {
        match value::level(&word.value) {
            Ok(level) => levels.push(level),
            Err(fix) => section.error(
                &word.at,
                format!("{path} has {:?}, which is no level", word.value),
                fix,
            ),
        }
    }
    levels
}
