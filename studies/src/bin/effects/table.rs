//! docs/effects-table.md: how the families went.

use super::family::{Range, SceneFamily};
use super::score::{Grade, Outcome};
use slipwatch::effects::Kind;
use std::collections::BTreeMap;
use std::fmt::Write as _;

const HEAD: &str = "\
| family | n | right kind | and channel | exactly | left open | wrong ones called | median t0 error (intervals) | median error of gain or size | held-out error after / given the truth | within 15 % | median s |
|---|---|---|---|---|---|---|---|---|---|---|---|
";

const FOOT: &str = "
- *right kind*: the first effect named is one that is in the series, and the family's own kind is among those named;
  for `none` the verdict `none`, for `outside` the verdict `unexplained` and no effect named.
- *exactly*: all kinds that are in the series are named, and no other.
- *left open*: of those not right, the right kind stands under `cannot_separate_from`.
- *wrong ones called*: the first effect named in the series that are not right.
- *held-out error after / given the truth*: the median of the rms over the held-out block over that of the law which was
  given what is there (kinds, channels and about when), fitted to the same readings; *within 15 %*: where this is at most
  1.15, of those in which it can be seen.

Every series has 150 to 1,500 readings of a slope that creeps, accelerates, saturates, hardens or settles, hourly to
monthly, in part uneven and with gaps, with white noise (one in eight with effects has an AR(1) beside it, whose
naming is not counted), and one to four covariates of which at most one or two have to do with the slope. One series in
four has one to three benchmarks beside it that move in proportion. The effect stands inside the law. A series is drawn again
until the slope outlives the record, its velocity spans less than a factor of 300, and each effect inside the law shows: what the
best constant-load law leaves of the noiseless motion with that effect alone has an rms of 3 to 30 times the noise
(log-uniform, for the weakest effect), and the plain law of `explain`, a second search for it, leaves 3 times the noise too. That says that an effect can be seen, not that it can be distinguished from others. Offsets are 8
to 40 noises, temperature's part of the reading 3 to 12, an AR(1) 1.5 to 4 times the white noise, a random walk's step 0.3
to 1 of it; means over an interval stand over steps of the load or the last rise before a failure. `outside` has a
ramp, a pulse, a random walk or a chirp of the load, or a driver whose channel is not given.
";

/// The document.
pub(crate) fn document(outcomes: &[Outcome], range: Range) -> String {
    let seeds = match range {
        Range::Dev => "dev",
        Range::Judged => "judged",
    };
    let n = most_of_a_family(outcomes);
    let mut text = format!(
        "# What `explain` finds where the truth is known\n\n\
         Written by `cargo run --release -p studies --bin effects -- --range {seeds} --n {n} --write`.\n\n"
    );
    text.push_str(&table(outcomes));
    text.push_str(&false_discoveries(outcomes));
    text.push_str(FOOT);
    text
}

fn most_of_a_family(outcomes: &[Outcome]) -> usize {
    by_family(outcomes)
        .values()
        .map(Vec::len)
        .max()
        .unwrap_or(0)
}

fn by_family(outcomes: &[Outcome]) -> BTreeMap<SceneFamily, Vec<&Outcome>> {
    let mut families: BTreeMap<SceneFamily, Vec<&Outcome>> = BTreeMap::new();
    for outcome in outcomes {
        families.entry(outcome.family).or_default().push(outcome);
    }
    families
}

fn table(outcomes: &[Outcome]) -> String {
    let families = by_family(outcomes);
    let mut text = HEAD.to_owned();
    for (family, of) in &families {
        text.push_str(&row(family.name(), of));
    }
    let labelled: Vec<&Outcome> = families
        .iter()
        .filter(|(family, _)| matches!(family, SceneFamily::Of(kind) if *kind != Kind::NONE))
        .flat_map(|(_, of)| of.iter().copied())
        .collect();
    text.push_str(&row("every single kind", &labelled));
    text
}

fn row(name: &str, of: &[&Outcome]) -> String {
    let share = |is_so: fn(&Outcome) -> bool| {
        let count = of.iter().filter(|one| is_so(one)).count();
        format!(
            "{count} ({:.0} %)",
            100.0 * count as f64 / of.len().max(1) as f64
        )
    };
    let wrong = of.iter().filter(|one| !one.right_kind());
    let all = |errors: fn(&Outcome) -> &[f64]| -> Vec<f64> {
        of.iter()
            .flat_map(|one| errors(one).iter().copied())
            .collect()
    };
    let held_out: Vec<f64> = of.iter().filter_map(|one| one.held_out).collect();
    format!(
        "| {name} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |\n",
        of.len(),
        share(Outcome::right_kind),
        share(|one| one.grade == Grade::Right),
        share(Outcome::exactly),
        of.iter().filter(|one| one.grade == Grade::LeftOpen).count(),
        counted(wrong.map(|one| one.called.name())),
        median(all(|one| &one.at_errors)),
        median(all(|one| &one.size_errors)),
        median(held_out.clone()),
        within(&held_out),
        median(of.iter().map(|one| one.seconds).collect()),
    )
}

/// Effects named where there is none.
fn false_discoveries(outcomes: &[Outcome]) -> String {
    let nothing = SceneFamily::Of(Kind::NONE);
    let of: Vec<_> = outcomes
        .iter()
        .filter(|one| one.family == nothing)
        .collect();
    let false_ones: Vec<_> = of.iter().filter(|one| !one.said.is_empty()).collect();
    if of.is_empty() {
        return String::new();
    }
    let share = 100.0 * false_ones.len() as f64 / of.len() as f64;
    let mut text = String::new();
    // Writing to a String does not fail.
    let _ = writeln!(
        text,
        "\nFalse discoveries where there is no effect: {} of {} ({share:.1} %).",
        false_ones.len(),
        of.len()
    );
    text
}

fn counted<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for name in names {
        *counts.entry(name).or_default() += 1;
    }
    let words: Vec<String> = counts
        .iter()
        .map(|(name, count)| format!("{name} {count}"))
        .collect();
    words.join(", ")
}

/// How many held-out errors are at most 15 % above what they are measured by.
fn within(ratios: &[f64]) -> String {
    let near = ratios.iter().filter(|ratio| **ratio <= 1.15).count();
    format!("{near} of {}", ratios.len())
}

fn median(mut values: Vec<f64>) -> String {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.get(middle) {
        None => String::new(),
        Some(upper) if values.len() % 2 == 1 => format!("{upper:.2}"),
        Some(upper) => format!("{:.2}", f64::midpoint(values[middle - 1], *upper)),
    }
}
