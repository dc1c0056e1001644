//! The tables of the site file, one function each.

use super::table::{Placed, Section, unique};
use super::{
    Benchmark, Broker, Config, FileSource, SiteConfig, alert, covariate, declared, drill,
    heartbeat, hook, link, record, source, value, vector,
};
use crate::alert::Policy;
use crate::monitor::{Explain, Settings, SiteLevel, Watched, first_readings_within};
use crate::reading::{BenchmarkId, Quantity, Suspicion, Unit};
use jiff::SignedDuration;
use jiff::tz::TimeZone;
use std::collections::{BTreeMap, BTreeSet};
use std::net::SocketAddr;
use std::path::Path;

/// Refits of the last three months are all kept.
const KEEP_REFITS: SignedDuration = SignedDuration::from_hours(90 * 24);

/// The whole file; `None` where something without which there is no config is missing.
pub(super) fn document(root: &mut Section<'_>, file: &Path) -> Option<Config> {
    let base = file.parent().unwrap_or(Path::new(""));
    let mut site_section = root.table("site", "site");
    let site_level = site_level(&mut site_section);
    let first = site_section.parsed("first_readings_within", value::duration_or_none);
    let (sources, brokers) = source::sources(root, base);
    let site = site(site_section, base, &sources);
    let policy = alert::policy(root.table("alert", "alert"), &Policy::default());
    let explain = explain(root.table("explain", "explain"));
    let known: Vec<&str> = (sources.iter().map(|source| source.id.as_str()))
        .chain(brokers.iter().map(|broker| broker.id.as_str()))
        .collect();
    let (benchmarks, own) = benchmarks(root, &known, &policy);
    let declared = declared::events(root, &benchmarks);
    let covariates = covariate::covariates(root, &benchmarks);
    let watched = watched(&sources, &brokers, &benchmarks);
    let mut hooks = hook::hooks(root, base);
    if let Some(site) = &site {
        for hook in &mut hooks {
            hook.links.clone_from(&site.links);
            if let Some(zone) = site.time_zone.iana_name() {
                zone.clone_into(&mut hook.zone);
            }
            let hours = hook.hours.take();
            hook.hours = hours.map(|hours| hours.in_zone(site.time_zone.clone()));
        }
    }
    let heartbeats = heartbeat::heartbeats(root, base);
    let drill = drill::drill(root, &hooks, &benchmarks);
    Some(Config {
        file: file.to_owned(),
        site: site?,
        sources,
        brokers,
        benchmarks,
        settings: Settings {
            policy,
            benchmarks: own.policies,
            explain,
            watched,
            declared,
            site: Some(site_level),
            first_readings_within: first.map_or_else(first_readings_within, |given| given.value),
            accepted: own.accepted,
            holds_scale: true,
            covariates: (covariates.iter())
                .map(|one| (one.column.clone(), one.kind))
                .collect(),
        },
        covariates,
        hooks,
        heartbeats,
        drill,
        warnings: Vec::new(),
    })
}

fn site(mut section: Section<'_>, base: &Path, sources: &[FileSource]) -> Option<SiteConfig> {
    let name = section.required("name", "\"Monte Toc\"");
    let state_dir = section.required("state_dir", "\"state\"");
    let listen = section.parsed("listen", |text| {
        text.parse()
            .map_err(|_| "write an address and a port: \"127.0.0.1:8642\"".to_owned())
    });
    let token_file = section.text("token_file");
    refuse_listening_without_token(&section, listen.as_ref(), token_file.is_some());
    let time_zone = section.parsed("time_zone", value::time_zone);
    let keep_refits = section.parsed("keep_refits", value::duration);
    let record = record::record(&mut section, base);
    if let Some(record) = &record {
        record::refuse_own(&section, record, sources);
    }
    let state_dir = state_dir.map(|given| base.join(given.value));
    let links = link::links(&mut section, listen.is_some(), state_dir.as_deref());
    section.finish();
    Some(SiteConfig {
        name: name?.value,
        state_dir: state_dir?,
        links,
        record,
        listen: listen.map(|given| given.value),
        token_file: token_file.map(|given| base.join(given.value)),
        time_zone: time_zone.map_or(TimeZone::UTC, |given| given.value),
        keep_refits: keep_refits.map_or(KEEP_REFITS, |given| given.value),
    })
}

/// `worst`, or `2 of 5`: so many of the benchmarks.
fn site_level(section: &mut Section<'_>) -> SiteLevel {
    let level = section.parsed("level", |text| {
        let fix = || "write \"worst\", or as in \"2 of 5\" how many benchmarks".to_owned();
        if text == "worst" {
            return Ok(SiteLevel::Worst);
        }
        let (count, of) = text.split_once(" of ").ok_or_else(fix)?;
        match (count.trim().parse(), of.trim().parse::<usize>()) {
            (Ok(count), Ok(of)) if (1..=of).contains(&count) => Ok(SiteLevel::AtLeast(count)),
            (Ok(_) | Err(_), _) => Err(fix()),
        }
    });
    level.map_or(SiteLevel::Worst, |given| given.value)
}

/// Whoever can reach the daemon over a network must know a secret.
fn refuse_listening_without_token(
    section: &Section<'_>,
    listen: Option<&Placed<SocketAddr>>,
    has_token: bool,
) {
    if let Some(listen) = listen
        && !listen.value.ip().is_loopback()
        && !has_token
    {
        section.error(
            &listen.at,
            format!(
                "site.listen = \"{}\" opens to other machines without a token",
                listen.value
            ),
            "add token_file = \"token\", or listen on 127.0.0.1",
        );
    }
}

/// With no search there is nothing to adopt.
fn explain(mut section: Section<'_>) -> Explain {
    let searches = section.switch("search").unwrap_or(true);
    let adopts = section.switch("adopt");
    if adopts == Some(true) && !searches {
        section.warning(
            section.at(),
            "explain.adopt = true without a search adopts nothing".to_owned(),
            "write search = true, or leave adopt out",
        );
    }
    section.finish();
    match (searches, adopts) {
        (false, _) => Explain::Off,
        (true, Some(false)) => Explain::Report,
        (true, Some(true) | None) => Explain::Adopt,
    }
}

/// Where every source has benchmarks of its own, no others are watched.
fn watched(sources: &[FileSource], brokers: &[Broker], benchmarks: &[Benchmark]) -> Watched {
    let of_files = sources.iter().map(|one| (&one.id, one.read_as()));
    let of_brokers = brokers.iter().map(|one| (&one.id, one.read_as()));
    let known: Vec<(&String, String)> = of_files.chain(of_brokers).collect();
    let names_its_own = |(source, _): &(&String, String)| {
        let mut sources = benchmarks.iter().map(|one| &one.source);
        sources.any(|one| one == *source)
    };
    let read_as = benchmarks.iter().filter_map(|benchmark| {
        let source = known.iter().find(|(id, _)| **id == benchmark.source);
        Some((benchmark.id.clone(), benchmark.read_as(&source?.1)))
    });
    let open = known.iter().filter(|source| !names_its_own(source));
    let open = open.map(|(id, read_as)| ((*id).clone(), read_as.clone()));
    Watched {
        named: benchmarks.iter().map(|one| one.id.clone()).collect(),
        is_open: !known.iter().all(names_its_own),
        read_as: read_as.collect(),
        sources: (benchmarks.iter())
            .map(|one| (one.id.clone(), one.source.clone()))
            .collect(),
        open: open.collect(),
    }
}

/// What `[[benchmark]]` says of single ones to the monitor.
#[derive(Debug, Default)]
struct OwnSettings {
    policies: BTreeMap<BenchmarkId, Policy>,
    accepted: BTreeMap<BenchmarkId, BTreeSet<Suspicion>>,
}

fn benchmarks(
    root: &mut Section<'_>,
    sources: &[&str],
    policy: &Policy,
) -> (Vec<Benchmark>, OwnSettings) {
    let (mut taken, mut own, mut benchmarks) =
        (BTreeSet::new(), OwnSettings::default(), Vec::new());
    for mut section in root.tables("benchmark", "benchmark") {
        let id = section.required("id", "\"5\"");
        unique(&section, id.as_ref(), &mut taken);
        let policy = section
            .has("alert")
            .then(|| alert::policy(section.table("alert", "benchmark.alert"), policy));
        // Asked for in any case, so that it is among the known keys.
        section.table("alert", "benchmark.alert");
        let accepted = accepted(&mut section);
        let benchmark = benchmark(section, id, sources);
        if let Some(benchmark) = &benchmark {
            let id = &benchmark.id;
            own.policies
                .extend(policy.map(|policy| (id.clone(), policy)));
            let some = (!accepted.is_empty()).then_some(accepted);
            own.accepted
                .extend(some.map(|accepted| (id.clone(), accepted)));
        }
        benchmarks.extend(benchmark);
    }
    (benchmarks, own)
}

/// The suspicions that people have looked into.
fn accepted(section: &mut Section<'_>) -> BTreeSet<Suspicion> {
    let words = section
        .texts("accept")
        .map_or_else(Vec::new, |given| given.value);
    let known = |word: &str| Suspicion::ALL.into_iter().find(|one| one.name() == word);
    let mut accepted = BTreeSet::new();
    for word in words {
        match known(&word.value) {
            Some(kind) => {
                accepted.insert(kind);
            }
            None => section.error(
                &word.at,
                format!(
                    "benchmark.accept has {:?}, which is no suspicion",
                    word.value
                ),
                format!("write {}", Suspicion::ALL.map(Suspicion::name).join(", ")),
            ),
        }
    }
    accepted
}

fn benchmark(
    mut section: Section<'_>,
    id: Option<Placed<String>>,
    sources: &[&str],
) -> Option<Benchmark> {
    let source = benchmark_source(&mut section, sources);
    let column = section.text("column");
    let quantity = section.parsed("quantity", |text| match text {
        "displacement" => Ok(Quantity::Displacement),
        "velocity" => Ok(Quantity::Velocity),
        _ => Err("write displacement or velocity".to_owned()),
    });
    let unit = section.parsed("unit", |text| {
        Unit::parse(text).map_err(|error| error.to_string())
    });
    let averaging = section.parsed("averaging", value::duration);
    let vector = vector::vector(&mut section, unit.as_ref().map(|given| given.value));
    let position = position(&mut section);
    if let (Some(unit), Some(quantity)) = (&unit, &quantity)
        && unit.value.quantity() != quantity.value
    {
        section.error(
            &unit.at,
            format!("benchmark.unit {} is no {}", unit.value, quantity.value),
            "write a unit of the quantity",
        );
    }
    let unit = unit
        .map(|given| given.value)
        .or(vector.as_ref().map(|vector| vector.unit))
        .or_else(|| column_unit(&section, column.as_ref()?));
    section.finish();
    Some(Benchmark {
        id: BenchmarkId::new(id?.value),
        source: source?,
        column: column.map(|given| given.value),
        quantity: quantity.map(|given| given.value),
        unit,
        averaging: averaging.map(|given| given.value),
        vector,
        position,
    })
}

/// East and north, and height where it is known, in metres of any plane frame.
fn position(section: &mut Section<'_>) -> Option<Vec<f64>> {
    let given = section.numbers("position")?;
    let is_place =
        (2..=3).contains(&given.value.len()) && given.value.iter().all(|n| n.is_finite());
    if is_place {
        return Some(given.value);
    }
    section.error(
        &given.at,
        format!("benchmark.position has {} numbers", given.value.len()),
        "write east and north in metres, and height if it is known: position = [120.0, 85.5, 1410.0]",
    );
    None
}

/// The unit that the column's name ends in, after its quantity or in brackets.
fn column_unit(section: &Section<'_>, column: &Placed<String>) -> Option<Unit> {
    let plain = column.value.to_ascii_lowercase();
    let unit = ["displacement_", "velocity_"].iter().find_map(|keyword| {
        let (_, unit) = plain.rsplit_once(keyword)?;
        let unit = Unit::parse(unit).ok()?;
        keyword.starts_with(unit.quantity().name()).then_some(unit)
    });
    let unit = unit.or_else(|| Unit::in_brackets_of(&column.value));
    if unit.is_none() && !section.has("unit") {
        section.error(
            &column.at,
            format!(
                "benchmark.column = {:?} does not say its unit",
                column.value
            ),
            "add unit = with the one that the column is in, such as \"mm\", \"m\" or \"mm_per_day\"",
        );
    }
    unit
}

fn benchmark_source(section: &mut Section<'_>, known: &[&str]) -> Option<String> {
    match (section.text("source"), known) {
        (None, [only]) => Some((*only).to_owned()),
        // Where none is understood, that is the problem.
        (_, []) => None,
        (None, _) => {
            section.error(
                section.at(),
                "benchmark.source is missing, and there are several sources".to_owned(),
                format!("add source = with one of: {}", known.join(", ")),
            );
            None
        }
        (Some(given), _) if known.contains(&given.value.as_str()) => Some(given.value),
        (Some(given), _) => {
            section.error(
                &given.at,
                format!("benchmark.source = {:?} is no [[source]]", given.value),
                format!("known sources: {}", known.join(", ")),
            );
            None
        }
    }
}
