//! docs/false-alarms.md: years of slopes that stand, as people count alarms.

use crate::judge::{self, CHANCES, Replay, YEARS};
use crate::source;
use crate::table::{HEAD, alarms};
use slipwatch::forecast::Network;
use std::fmt::Write as _;
use studies::{Family, GaugeKind};

pub(crate) fn write(network: &Network) -> anyhow::Result<()> {
    let stands = Family::ALL.iter().filter(|family| !family.fails());
    let mut families = Vec::new();
    for family in stands {
        families.push((*family, judge::years(*family, network)));
        eprintln!("followed {family:?}");
    }
    let fails = Family::ALL.iter().filter(|family| family.fails());
    let failing: Vec<Replay> = fails
        .flat_map(|family| {
            eprintln!("following {family:?}");
            judge::failing_lives(*family, network)
        })
        .collect();
    let text = text(&families)? + &by_chance(&families, &failing)?;
    source::document("docs/false-alarms.md", &text)
}

/// What another chance than the default would give, on slopes that stand and on slopes that fail.
fn by_chance(
    families: &[(Family, Vec<Vec<Replay>>)],
    failing: &[Replay],
) -> anyhow::Result<String> {
    let mut out = String::from(
        "\n## What another `red_chance` gives\n\n\
         The same years, and simulated records of the eight families that fail (other seeds than any above or in [families.md](families.md); the network in force \
         was trained on others of the same families), with red called from another chance within 48 h on. *In time*: of the failing slopes read at \
         least each 6 h and seen to accelerate for a day or more, those that were red 24 h before the collapse or earlier. Whoever asks for fewer false \
         alarms pays in slopes that are called too late.\n\n| `red_chance` | in time |",
    );
    for (_, name, _) in YEARS {
        write!(out, " reds a year, read each {name} | time at red |")?;
    }
    out += "\n|---|---|";
    out += &"---|---|".repeat(YEARS.len());
    for (index, chance) in CHANCES.iter().enumerate() {
        let known = failing.iter();
        let known: Vec<bool> = known
            .filter_map(|life| life.in_time_by_chance[index])
            .collect();
        let came = known.iter().filter(|came| **came).count();
        write!(out, "\n| {chance} | {came} of {} |", known.len())?;
        for sampling in 0..YEARS.len() {
            let lives = families.iter().flat_map(|(_, years)| &years[sampling]);
            let (mut years, mut count, mut red) = (0.0, 0.0, 0.0);
            for life in lives {
                years += life.years;
                count += f64::from(life.by_chance[index].count);
                red += life.by_chance[index].years;
            }
            write!(
                out,
                " {:.2} | {:.2} % |",
                count / years,
                100.0 * red / years
            )?;
        }
    }
    Ok(out + "\n")
}

fn text(families: &[(Family, Vec<Vec<Replay>>)]) -> anyhow::Result<String> {
    let mut out = String::from(
        "# False alarms a year\n\n\
         Written by `cargo run --release -p studies --bin learn -- --years`. Each row follows whole years of simulated slopes that stand \
         (studies/src/world), looked at each two hours, or at each reading where these are further apart, by the network in force, which was trained on other \
         slopes of these families. Evacuation time 24 h, so that red looks 48 h ahead; the policy's rules, without its latch: a chance calls red once it has come to .2 in the mean over some twelve hours as well (of the ln of its odds), or to .6 at one look; alarms less than three days \
         apart are one. What drives a slope: rain 5 to 40 storms a year, frost and thaw 60, a draw-down of the reservoir in most years, 5 to 60 \
         fits of stick-slip, one change of rate, several resets of the instrument, or one acceleration that ends without a collapse \
         (Stopped, Plateau).\n",
    );
    for (index, (_, name, _)) in YEARS.iter().enumerate() {
        writeln!(out, "\n## Read each {name}\n\n| cause {HEAD}")?;
        for (family, years) in families {
            let replays: Vec<&Replay> = years[index].iter().collect();
            alarms(&mut out, &format!("{family:?}"), &replays)?;
        }
        let all: Vec<&Replay> = families
            .iter()
            .flat_map(|(_, years)| &years[index])
            .collect();
        alarms(&mut out, "all", &all)?;
        writeln!(out, "\n| instrument {HEAD}")?;
        for gauge in GaugeKind::ALL {
            let own = all.iter().filter(|replay| replay.gauge == gauge);
            let own: Vec<&Replay> = own.copied().collect();
            if !own.is_empty() {
                alarms(&mut out, &format!("{gauge:?}"), &own)?;
            }
        }
    }
    Ok(out)
}
