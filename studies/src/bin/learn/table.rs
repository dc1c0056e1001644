//! docs/families.md: each family by the network that never saw it.

use crate::judge::{EVACUATIONS, Judged, Lead, Replay};
use crate::{reliability, source};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use studies::GaugeKind;

pub(crate) fn write(families: &[Judged], slopes: u64) -> anyhow::Result<()> {
    source::document("docs/families.md", &text(families, slopes)?)
}

fn text(families: &[Judged], slopes: u64) -> anyhow::Result<String> {
    let only = if families.iter().all(|one| one.family.fails()) {
        " --failing"
    } else {
        ""
    };
    let mut out = format!(
        "# Forecasts on families of slopes on which they were not trained\n\n\
         Written by `cargo run --release -p studies --bin learn -- --left-out {slopes}{only}`. Each family of simulated slopes (studies/src/world) is judged by a \
         network that was trained on all the other families, {slopes} slopes each, and never saw one of it. The network in force is trained on all \
         of them; what it is worth on a slope of no family here, nobody knows better than this table does.\n"
    );
    failing(&mut out, families)?;
    in_time(&mut out, families)?;
    out += &reliability::section(slopes)?;
    out += include_str!("notes.md");
    if families.iter().all(|one| one.family.fails()) {
        out += "\nFamilies that stand were not judged in this run. What the network in force calls on them, which was trained on others of the same \
                families: [false-alarms.md](false-alarms.md).\n";
        return Ok(out);
    }
    standing(&mut out, families)?;
    by_gauge(&mut out, families)?;
    by_sampling(&mut out, families)?;
    Ok(out)
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    sum / count
}

fn failing(out: &mut String, families: &[Judged]) -> anyhow::Result<()> {
    writeln!(
        out,
        "\n## Slopes that fail\n\nLeads are spread evenly in their logarithm from two readings (or an hour) to 60 days, since the acceleration stood ten times the \
         instrument's error out. *Holds*: the share of collapses within the 90 % interval. *Late*: median of (median forecast / time that remained). CRPS in \
         days, cut as in [skill.md](skill.md).\n\n\
         | family | forecasts | holds | late | CRPS | best rival | its CRPS | ratio |\n|---|---|---|---|---|---|---|---|"
    )?;
    let mut ratios = Vec::new();
    for one in families.iter().filter(|one| one.family.fails()) {
        let leads = &one.leads;
        let crps = mean(leads.iter().map(|lead| lead.crps_days));
        let (rival, its) = best_rival(leads);
        let covered = mean(
            leads
                .iter()
                .map(|lead| f64::from(u8::from(lead.is_covered))),
        );
        let mut ratio: Vec<f64> = leads
            .iter()
            .map(|lead| lead.median_days / lead.left_days)
            .collect();
        ratio.sort_by(f64::total_cmp);
        let late = ratio.get(ratio.len() / 2).copied().unwrap_or(f64::NAN);
        writeln!(
            out,
            "| {:?} | {} | {:.1} % | {late:.2} | {crps:.2} | {rival} | {its:.2} | {:.2} |",
            one.family,
            leads.len(),
            100.0 * covered,
            crps / its
        )?;
        ratios.push(crps / its);
    }
    writeln!(out, "\nMean ratio: {:.2}.", mean(ratios.into_iter()))?;
    Ok(())
}

fn best_rival(leads: &[Lead]) -> (&'static str, f64) {
    let mut sums: BTreeMap<&'static str, f64> = BTreeMap::new();
    for lead in leads {
        for (name, crps) in &lead.rivals {
            *sums.entry(name).or_default() += crps;
        }
    }
    let best = sums.into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or(("none", f64::NAN), |(name, sum)| {
        (name, sum / leads.len() as f64)
    })
}

fn in_time(out: &mut String, families: &[Judged]) -> anyhow::Result<()> {
    writeln!(
        out,
        "\n### Red in time\n\nOf the failing slopes read at least four times an evacuation time and seen to accelerate for as long: the share for which red was called at least \
         that time before the collapse.\n\n| family | 12 h | 24 h | 72 h |\n|---|---|---|---|"
    )?;
    let fails = families.iter().filter(|one| one.family.fails());
    let each = fails.map(|one| (format!("{:?}", one.family), one.replays.iter().collect()));
    let mut rows: Vec<(String, Vec<&Replay>)> = each.collect();
    let all = rows.iter().flat_map(|(_, replays)| replays).copied();
    rows.push(("all".to_owned(), all.collect()));
    for (name, replays) in rows {
        write!(out, "| {name} |")?;
        for index in 0..EVACUATIONS.len() {
            let known = replays.iter().filter_map(|replay| replay.in_time[index]);
            let known: Vec<bool> = known.collect();
            let came = known.iter().filter(|came| **came).count();
            write!(out, " {came} of {} |", known.len())?;
        }
        writeln!(out)?;
    }
    Ok(())
}

pub(crate) const HEAD: &str = "| years | reds a year | oranges a year | time at red | time at orange or above |\n|---|---|---|---|---|---|";

fn standing(out: &mut String, families: &[Judged]) -> anyhow::Result<()> {
    writeln!(
        out,
        "\n## Slopes that stand\n\nWhole records, at every reading or at 1,500 of them evenly, evacuation time 24 h; alarms less than three days apart are one. Stopped and Plateau \
         accelerate as failing slopes do, and only then stop.\n\n| family {HEAD}"
    )?;
    for one in families.iter().filter(|one| !one.family.fails()) {
        let replays: Vec<&Replay> = one.replays.iter().collect();
        alarms(out, &format!("{:?}", one.family), &replays)?;
    }
    Ok(())
}

fn by_gauge(out: &mut String, families: &[Judged]) -> anyhow::Result<()> {
    writeln!(
        out,
        "\nThe same by instrument, over all of these families:\n\n| instrument {HEAD}"
    )?;
    for gauge in GaugeKind::ALL {
        let stands = families.iter().filter(|one| !one.family.fails());
        let replays = stands.flat_map(|one| &one.replays);
        let replays: Vec<&Replay> = replays.filter(|replay| replay.gauge == gauge).collect();
        alarms(out, &format!("{gauge:?}"), &replays)?;
    }
    Ok(())
}

/// Intervals between readings, days: their upper bounds and names.
const SAMPLINGS: [(f64, &str); 4] = [
    (1.0 / 48.0, "under 30 min"),
    (0.15, "30 min to 3.6 h"),
    (0.7, "3.6 to 17 h"),
    (f64::INFINITY, "17 h to 30 d"),
];

fn by_sampling(out: &mut String, families: &[Judged]) -> anyhow::Result<()> {
    writeln!(out, "\nAnd by sampling:\n\n| interval {HEAD}")?;
    let mut from = 0.0;
    for (to, name) in SAMPLINGS {
        let stands = families.iter().filter(|one| !one.family.fails());
        let replays = stands.flat_map(|one| &one.replays);
        let within = |replay: &&Replay| (from..to).contains(&replay.interval_days);
        let replays: Vec<&Replay> = replays.filter(within).collect();
        alarms(out, name, &replays)?;
        from = to;
    }
    Ok(())
}

pub(crate) fn alarms(out: &mut String, name: &str, replays: &[&Replay]) -> anyhow::Result<()> {
    let sum = |of: &dyn Fn(&Replay) -> f64| replays.iter().map(|replay| of(replay)).sum::<f64>();
    let years = sum(&|replay| replay.years);
    writeln!(
        out,
        "| {name} | {years:.1} | {:.2} | {:.2} | {:.2} % | {:.2} % |",
        sum(&|replay| f64::from(replay.red.count)) / years,
        sum(&|replay| f64::from(replay.orange.count)) / years,
        100.0 * sum(&|replay| replay.red.years) / years,
        100.0 * sum(&|replay| replay.orange.years) / years,
    )?;
    Ok(())
}
