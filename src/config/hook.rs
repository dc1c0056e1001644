//! `[[hook]]`, `[[webhook]]`, `[[cap]]` and `[[mqtt_out]]`: whom alerts are sent to, and which.

use super::duty::{DutyHours, Shift};
use super::table::Section;
use super::{
    CapFolder, ExtraMessages, HookConfig, Webhook, WebhookFormat, address, mqtt_out, value,
};
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
    for section in root.tables("cap", "cap") {
        hooks.extend(cap(section, base, &mut taken));
    }
    for section in root.tables("mqtt_out", "mqtt_out") {
        hooks.extend(mqtt(section, base, &mut taken));
    }
    unlike(root, &hooks);
    if hooks.is_empty()
        && ["hook", "webhook", "cap", "mqtt_out"]
            .iter()
            .all(|key| !root.has(key))
    {
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
    let later = |hook: &&HookConfig| hook.escalate_after.is_some() || hook.hours.is_some();
    let later = hooks.iter().filter(later);
    for hook in later.filter(|hook| !hook.run.is_empty()) {
        if hooks.iter().filter(|one| one.run == hook.run).count() > 1 {
            root.error(
                root.at(),
                format!(
                    "two hooks run {:?}, one of them with escalate_after or hours: they cannot be distinguished",
                    hook.run.join(" ")
                ),
                "give one of them an argument of its own, as in run = [\"./notify.sh\", \"escalation\"]",
            );
            return;
        }
    }
    for (place, hook) in hooks.iter().enumerate() {
        let mut before = hooks[..place].iter();
        if !hook.run.is_empty() && before.any(|one| one.run == hook.run && overlap(one, hook)) {
            root.warning(
                root.at(),
                format!(
                    "two hooks run {:?} and ask for the same alerts: it is run once for each of these",
                    hook.run.join(" ")
                ),
                "leave one of them out, or give one an argument of its own",
            );
            return;
        }
    }
}

/// Whether there may be an alert that both ask for.
fn overlap(one: &HookConfig, other: &HookConfig) -> bool {
    let levels = one.levels.iter().any(|level| other.levels.contains(level));
    let benchmarks = one.benchmarks.is_empty()
        || other.benchmarks.is_empty()
        || !one.benchmarks.is_disjoint(&other.benchmarks);
    levels && benchmarks && one.site == other.site
}

/// What a program and a webhook have in common.
struct Common {
    levels: Vec<Level>,
    benchmarks: BTreeSet<BenchmarkId>,
    site: bool,
    timeout: Duration,
    escalate_after: Option<Duration>,
    hours: Option<DutyHours>,
    extra: ExtraMessages,
}

impl Common {
    /// All but the program, the address or the folder.
    fn without_a_way_out(self, base: &Path) -> HookConfig {
        HookConfig {
            run: Vec::new(),
            webhook: None,
            cap: None,
            mqtt: None,
            levels: self.levels,
            benchmarks: self.benchmarks,
            site: self.site,
            timeout: self.timeout,
            escalate_after: self.escalate_after,
            hours: self.hours,
            extra: self.extra,
            links: None,
            folder: base.to_owned(),
            sandbox: false,
            writable: Vec::new(),
            launcher: None,
        }
    }
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
        hours: hours(section),
        extra: ExtraMessages {
            drills: section.switch("drills").unwrap_or(false),
            corrections: section.switch("corrections").unwrap_or(false),
        },
        timeout: timeout.map_or(TIMEOUT, |given| given.value.unsigned_abs()),
        escalate_after: escalate_after.map(|given| given.value.unsigned_abs()),
    }
}

/// When it is on duty, by UTC until the site's time zone is known; `None`: always.
fn hours(section: &mut Section<'_>) -> Option<DutyHours> {
    let texts = section.texts("hours")?;
    let path = section.path("hours");
    if texts.value.is_empty() {
        section.error(
            &texts.at,
            format!("{path} is empty: no alert would ever be sent"),
            "leave it out for always, or write hours = [\"mon-fri 07:00-19:00\"]",
        );
        return None;
    }
    let mut shifts = Vec::new();
    for text in &texts.value {
        match Shift::parse(&text.value) {
            Ok(shift) => shifts.push(shift),
            Err(fix) => {
                let what = format!("{:?} in {path} is no shift", text.value);
                section.error(&text.at, what, fix);
            }
        }
    }
    Some(DutyHours::new(shifts))
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
        sandbox,
        writable: (writable.iter().map(|path| base.join(&path.value))).collect(),
        ..common.without_a_way_out(base)
    })
}

fn webhook(
    mut section: Section<'_>,
    base: &Path,
    taken: &mut BTreeSet<String>,
) -> Option<HookConfig> {
    let example = "\"http://127.0.0.1:9000/alerts\"";
    let url = section.required("url", example);
    let address = url.as_ref().and_then(|url| address::of(&section, url));
    let name = section.text("name");
    let format = section.parsed("format", WebhookFormat::parse);
    let format = format.map_or(WebhookFormat::Slipwatch, |given| given.value);
    let secret = match format {
        WebhookFormat::Slipwatch => section.required("secret_file", "\"webhook.secret\""),
        // It checks no signature.
        WebhookFormat::Alertmanager => section.text("secret_file"),
    };
    let ca_file = address::ca_file(&mut section, address.as_ref());
    let common = common(&mut section);
    if common.extra.corrections && format == WebhookFormat::Alertmanager {
        section.error(
            section.at(),
            "webhook.corrections with format = \"alertmanager\": it has no message that corrects an alert".to_owned(),
            "leave corrections out, or add a [[webhook]] without format for them",
        );
    }
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
        webhook: Some(Webhook {
            name: name.map_or(url, |given| given.value),
            address,
            ca_file: ca_file.map(|given| base.join(given)),
            format,
            secret_file: secret.map(|given| base.join(given.value)),
        }),
        ..common.without_a_way_out(base)
    })
}

fn cap(mut section: Section<'_>, base: &Path, taken: &mut BTreeSet<String>) -> Option<HookConfig> {
    let folder = section.required("folder", "\"cap\"");
    let sender = section.required("sender", "\"slipwatch@example.org\"");
    let area = section.required("area", "\"the north slope of Monte Toc\"");
    let polygon = section.parsed("polygon", polygon);
    let common = common(&mut section);
    if let Some(one) = &folder
        && !taken.insert(format!("cap {}", one.value))
    {
        section.error(
            &one.at,
            format!("there are two [[cap]] with the folder {:?}", one.value),
            "give each its own folder",
        );
    }
    if let Some(one) = &sender
        && (one.value.is_empty() || one.value.contains([' ', ',', '<', '&']))
    {
        section.error(
            &one.at,
            format!("cap.sender = {:?} has a blank, a comma, < or &", one.value),
            "write it as in \"slipwatch@example.org\"",
        );
    }
    section.finish();
    Some(HookConfig {
        cap: Some(CapFolder {
            folder: base.join(folder?.value),
            sender: sender?.value,
            area: area?.value,
            polygon: polygon.map(|given| given.value),
        }),
        ..common.without_a_way_out(base)
    })
}

fn mqtt(mut section: Section<'_>, base: &Path, taken: &mut BTreeSet<String>) -> Option<HookConfig> {
    let topic = mqtt_out::topic(&mut section, base);
    let common = common(&mut section);
    if let Some(one) = &topic
        && !taken.insert(one.name.clone())
    {
        section.error(
            section.at(),
            format!("there are two ways out {:?}", one.name),
            "give each its own name: name = \"control room\"",
        );
    }
    section.finish();
    Some(HookConfig {
        mqtt: Some(topic?),
        ..common.without_a_way_out(base)
    })
}

/// An outline as CAP writes it.
fn polygon(text: &str) -> Result<String, String> {
    let fix = || {
        "write four or more pairs of latitude,longitude in degrees, the first one again at the end: \
         \"46.27,12.33 46.28,12.35 46.26,12.36 46.27,12.33\""
            .to_owned()
    };
    let point = |pair: &str| {
        let (latitude, longitude) = pair.split_once(',')?;
        let (latitude, longitude): (f64, f64) = (latitude.parse().ok()?, longitude.parse().ok()?);
        (latitude.abs() <= 90.0 && longitude.abs() <= 180.0).then_some((latitude, longitude))
    };
    let pairs: Vec<&str> = text.split_whitespace().collect();
    let is_closed = pairs.len() >= 4 && pairs.first() == pairs.last();
    if is_closed && pairs.iter().all(|pair| point(pair).is_some()) {
        Ok(pairs.join(" "))
    } else {
        Err(fix())
    }
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
