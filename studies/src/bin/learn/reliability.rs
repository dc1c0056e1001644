//! Whether chances come true: of looks evenly over each life, what was said and what came.

use crate::judge::FEWEST_READINGS;
use crate::looks::{first, in_two};
use crate::source;
use slipwatch::forecast::{Collapse, Indicators, Members, Network, Passage};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use studies::{Family, Simulated};

/// Seeds of the lives, how many of each family, and looks at each.
const FIRST_SEED: u64 = 5_000_000;
const LIVES: u64 = 30;
const LOOKS: usize = 100;
/// Within how many days a collapse is said to come.
const WITHIN: [f64; 4] = [1.0, 2.0, 7.0, 30.0];
/// Bounds of the classes of what was said.
const CLASSES: [f64; 8] = [0.01, 0.03, 0.1, 0.2, 0.35, 0.55, 0.75, 1.0];
/// A distribution that a forecast has.
type Distribution = fn(&Collapse) -> &Passage;
/// What is said, with the chances that it says.
const SAID: [(&str, Distribution); 3] = [
    ("`chances_of_collapse`", |collapse| &collapse.expected),
    ("that `failure_time` rests on", |collapse| &collapse.passage),
    ("that levels go by", |collapse| &collapse.sure),
];

/// What was said at one look of each of [`SAID`] within each of [`WITHIN`], and what came, where that is known.
struct Said {
    chances: [[f64; WITHIN.len()]; SAID.len()],
    came: [Option<bool>; WITHIN.len()],
}

/// The section on it: families that fail by the network of `slopes` that never saw them, those that stand by the one in force.
pub(crate) fn section(slopes: u64) -> anyhow::Result<String> {
    let in_force = source::in_force()?;
    let mut networks = BTreeMap::new();
    for family in Family::ALL.into_iter().filter(|family| family.fails()) {
        networks.insert(format!("{family:?}"), source::kept(family, slopes)?);
    }
    let jobs: Vec<(Family, u64)> = Family::ALL
        .iter()
        .flat_map(|family| (0..LIVES).map(|index| (*family, FIRST_SEED + index)))
        .collect();
    let said = in_two(&jobs, |(family, seed)| {
        let network = networks.get(&format!("{family:?}")).unwrap_or(&in_force);
        looks(&Simulated::draw(*family, *seed), network)
    });
    table(&said)
}

fn looks(slope: &Simulated, network: &Network) -> Vec<Said> {
    let values = &slope.observations.values;
    let after = values.len().saturating_sub(FEWEST_READINGS);
    let counts = (0..LOOKS).map(|look| FEWEST_READINGS + after * look / LOOKS);
    let said = counts.filter_map(|count| {
        let seen = first(&slope.observations, count);
        let now_days = seen.values.last()?.t_days;
        let found = Indicators::of(&seen)?.collapse_by(network, &Members::of(&seen));
        let came = WITHIN.map(|days| match slope.collapse_days {
            Some(collapse) => Some(collapse - now_days <= days),
            None => (slope.end_days - now_days >= days).then_some(false),
        });
        let chances = SAID.map(|(_, of)| WITHIN.map(|days| of(&found).chance_within(days)));
        Some(Said { chances, came })
    });
    said.collect()
}

fn table(said: &[Said]) -> anyhow::Result<String> {
    let mut out = format!(
        "\n### Whether what is said comes true\n\n\
         Of {LIVES} other slopes of each of these families, by the network that never saw it, and of {LIVES} of each family that stands, by the network in force: \
         {LOOKS} evaluations evenly over each record. What came of the chances in each class: mean said → share that came. *Log score*: the mean of −ln of the chance given to what \
         came, less is better. Only those of `chances_of_collapse` are meant to come true: the others are raised or lowered on purpose (src/forecast/collapse.rs).\n\n\
         | within | chances |"
    );
    for pair in CLASSES.windows(2) {
        write!(out, " {:.0} to {:.0} % |", 100.0 * pair[0], 100.0 * pair[1])?;
    }
    out += " log score |\n|---|---|";
    out += &"---|".repeat(CLASSES.len());
    out.push('\n');
    for (within, days) in WITHIN.iter().enumerate() {
        for (which, (name, _)) in SAID.iter().enumerate() {
            let known = said.iter();
            let known: Vec<(f64, bool)> = known
                .filter_map(|one| Some((one.chances[which][within], one.came[within]?)))
                .collect();
            write!(out, "| {days} d | {name} |")?;
            for pair in CLASSES.windows(2) {
                write!(out, " {} |", class(&known, pair[0], pair[1]))?;
            }
            writeln!(out, " {:.3} |", log_score(&known))?;
        }
    }
    Ok(out)
}

/// Mean said → share that came, of the chances from `from` on and below `to`; the last class holds 1 too.
fn class(known: &[(f64, bool)], from: f64, to: f64) -> String {
    let inside = known.iter();
    let inside = inside.filter(|(chance, _)| *chance >= from && (*chance < to || to >= 1.0));
    let (said, came, count) = inside.fold((0.0, 0.0, 0.0), |(said, came, count), one| {
        (said + one.0, came + f64::from(u8::from(one.1)), count + 1.0)
    });
    if count < 1.0 {
        return "–".to_owned();
    }
    format!("{:.2} → {:.2}", said / count, came / count)
}

fn log_score(known: &[(f64, bool)]) -> f64 {
    let each = known.iter().map(|(chance, came)| {
        let chance = chance.clamp(1e-4, 1.0 - 1e-4);
        -(if *came { chance } else { 1.0 - chance }).ln()
    });
    each.sum::<f64>() / known.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_class_has_the_mean_that_was_said_and_the_share_that_came() {
        let known = [
            (0.1, false),
            (0.2, true),
            (0.15, true),
            (0.5, true),
            (1.0, false),
        ];
        assert_eq!(class(&known, 0.1, 0.35), "0.15 → 0.67");
        assert_eq!(class(&known, 0.75, 1.0), "1.00 → 0.00");
        assert_eq!(class(&known, 0.01, 0.03), "–");
        assert!((log_score(&known[1..2]) - 5.0_f64.ln()).abs() < 1e-12);
    }
}
