//! docs/false-alarms.md: years of slopes that stand, as people count alarms.

use crate::judge::{self, Replay, YEARS};
use crate::source;
use crate::table::{HEAD, alarms};
use slipwatch::forecast::{Family, GaugeKind, Network};
use std::fmt::Write as _;

pub(crate) fn write(network: &Network) -> anyhow::Result<()> {
    let stands = Family::ALL.iter().filter(|family| !family.fails());
    let mut families = Vec::new();
    for family in stands {
        families.push((*family, judge::years(*family, network)));
        eprintln!("followed {family:?}");
    }
    source::document("docs/false-alarms.md", &text(&families)?)
}

fn text(families: &[(Family, Vec<Vec<Replay>>)]) -> anyhow::Result<String> {
    let mut out = String::from(
        "# False alarms a year\n\n\
         Written by `cargo run --release --example learn -- --years`. Each row follows whole years of simulated slopes that stand \
         (src/forecast/world), looked at each six hours, or at each reading where these are further apart, by the network in force, which was taught on other \
         slopes of these families. Evacuation time 24 h; the chances by which levels go, without the policy's latch; alarms less than three days \
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
