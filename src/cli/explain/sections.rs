//! The tables of an explanation, the same for the terminal and for the page.

use super::sentence::{brief, tail_probability};
use crate::alert::percent_in_words;
use crate::cli::table::{TextTable, time};
use crate::effects::{Change, EXPLAINED_DAYS, Effect, Explanation, Form};
use crate::reading::Timestamp;

/// A table under its heading.
#[derive(Debug)]
pub(super) struct PageSection {
    pub(super) heading: &'static str,
    pub(super) table: TextTable,
}

/// Before and after, in the readings and in the forecast.
pub(super) fn gained(explanation: &Explanation) -> [PageSection; 2] {
    [
        ("Error", error(explanation)),
        ("What the effects change", forecast(explanation)),
    ]
    .map(|(heading, table)| PageSection { heading, table })
}

/// What that rests on, where there is anything to see.
pub(super) fn grounds(explanation: &Explanation) -> Vec<PageSection> {
    let all = [
        ("Effects", effects(explanation)),
        ("Residual", Some(residual(explanation))),
        ("Structure that is left", structure(explanation)),
        ("Everything tried", candidates(explanation)),
        ("Faults of the data", faults(explanation)),
        ("Noise", Some(noise(explanation))),
        ("Settings", Some(settings(explanation))),
    ];
    let present = all.into_iter();
    present
        .filter_map(|(heading, table)| table.map(|table| PageSection { heading, table }))
        .collect()
}

/// Whose readings, and which.
pub(super) fn subject(explanation: &Explanation) -> String {
    format!(
        "benchmark {}, {} in {}, {} readings, {} to {}",
        explanation.benchmark,
        explanation.quantity,
        explanation.unit,
        explanation.readings,
        time(explanation.first),
        time(explanation.last),
    )
}

fn error(explanation: &Explanation) -> TextTable {
    let error = &explanation.error;
    let mut table = TextTable::headed([
        format!("rms in {}", error.unit),
        "before".to_owned(),
        "after".to_owned(),
        "change".to_owned(),
    ]);
    let from = error.held_out_from;
    let held_out = from.map_or("held out".to_owned(), |from| {
        format!("held out from {}", time(Some(from)))
    });
    let rows = [
        ("fit".to_owned(), error.fit),
        (held_out, error.held_out),
        (
            "the same, from reading to reading".to_owned(),
            error.held_out_step,
        ),
    ];
    for (name, change) in rows {
        table.row([
            name,
            number(change.before),
            number(change.after),
            percent_change(change),
        ]);
    }
    table
}

fn percent_change(change: Change) -> String {
    let (Some(before), Some(after)) = (change.before, change.after) else {
        return dash();
    };
    let percent = 100.0 * (after / before - 1.0);
    if percent.is_finite() {
        format!("{percent:+.0} %")
    } else {
        dash()
    }
}

fn forecast(explanation: &Explanation) -> TextTable {
    let forecast = &explanation.forecast;
    let mut table = TextTable::headed(["", "before", "after"]);
    let within = format!("chance of failure within {EXPLAINED_DAYS:.0} days");
    let shares: [(&str, _); 2] = [
        (
            "probability that it is unstable (m > 1)",
            forecast.probability_unstable,
        ),
        (&within, forecast.probability_of_failure),
    ];
    for (name, change) in shares {
        table.row([
            name.to_owned(),
            percent(change.before),
            percent(change.after),
        ]);
    }
    let failure = forecast.failure_time;
    table.row([
        "median time of failure".to_owned(),
        time(failure.before),
        time(failure.after),
    ]);
    table
}

/// What is said of an effect in one row.
type PageCell = fn(&Effect) -> String;

/// A column each; what none of them has is left out.
fn effects(explanation: &Explanation) -> Option<TextTable> {
    let all = explanation.effects();
    let accepted: Vec<&Effect> = all.filter(|effect| is_an_effect(effect)).collect();
    if accepted.is_empty() {
        return None;
    }
    let names = accepted.iter().map(|effect| effect.effect.to_string());
    let mut table = TextTable::headed([String::new()].into_iter().chain(names));
    let adds = format!("adds to the readings, rms {}", explanation.unit);
    let per_sd = format!("in the reading per sd, {}", explanation.unit);
    let per_sd_bounds = format!("{per_sd}, 5 to 95 %");
    let rows: [(&str, PageCell); 18] = [
        ("channel", |effect| {
            effect.channel.clone().unwrap_or_else(dash)
        }),
        ("form", |effect| form(effect.form)),
        ("at", |effect| time(effect.at)),
        ("at, 5 %", |effect| {
            time(effect.at_interval.map(|bounds| bounds[0]))
        }),
        ("at, 95 %", |effect| {
            time(effect.at_interval.map(|bounds| bounds[1]))
        }),
        ("size", |effect| {
            with_unit(effect.size, effect.unit.as_deref())
        }),
        ("size, 5 to 95 %", |effect| interval(effect.size_interval)),
        ("velocity factor since", |effect| {
            number(effect.velocity_factor)
        }),
        ("velocity factor per sd", |effect| {
            number(effect.velocity_factor_per_sd)
        }),
        ("log-load per sd", |effect| {
            number(effect.gain_per_sd.filter(|_| !is_in_the_reading(effect)))
        }),
        ("log-load per sd, 5 to 95 %", |effect| {
            interval(effect.gain_interval.filter(|_| !is_in_the_reading(effect)))
        }),
        (&per_sd, |effect| {
            number(effect.gain_per_sd.filter(|_| is_in_the_reading(effect)))
        }),
        (&per_sd_bounds, |effect| {
            interval(effect.gain_interval.filter(|_| is_in_the_reading(effect)))
        }),
        ("mean delay, days", |effect| number(effect.lag_days)),
        ("95 % of the response, days", |effect| {
            number(effect.memory_days)
        }),
        ("strongest period, days", |effect| {
            number(effect.period_days)
        }),
        ("p", |effect| p_value(effect.p_value)),
        (&adds, |effect| number(effect.contribution_rms)),
    ];
    for (name, said) in rows {
        let cells: Vec<String> = accepted.iter().map(|effect| said(effect)).collect();
        if cells.iter().any(|cell| *cell != dash()) {
            table.row([name.to_owned()].into_iter().chain(cells));
        }
    }
    let gains = accepted.iter().map(|effect| gain(effect.bic_gain));
    table.row(["BIC gain".to_owned()].into_iter().chain(gains));
    Some(table)
}

/// What acts in the reading has a unit; a load is a pure number.
fn is_in_the_reading(effect: &Effect) -> bool {
    effect.unit.is_some()
}

fn interval(bounds: Option<[f64; 2]>) -> String {
    bounds.map_or_else(dash, |bounds| bounds.map(brief).join(" to "))
}

fn is_an_effect(effect: &Effect) -> bool {
    !effect.effect.is_an_end()
}

fn residual(explanation: &Explanation) -> TextTable {
    let tests = &explanation.residual;
    let mut table = TextTable::headed(["", "before", "after"]);
    let mut row = |name: &str, change: Change, said: fn(Option<f64>) -> String| {
        table.row([name.to_owned(), said(change.before), said(change.after)]);
    };
    row("runs test of the innovations, p", tests.runs, p_value);
    let gap_safe = "Stoffer-Toloi test (gap-safe Ljung-Box), p";
    row(gap_safe, tests.stoffer_toloi, p_value);
    let load = tests.undeclared_load_bic_gain;
    row("BIC gain of an undeclared load", load, |gained| {
        gained.map_or_else(dash, gain)
    });
    let sd = "its standard deviation, e-folds of velocity";
    row(sd, tests.undeclared_load_sd, number);
    table
}

fn structure(explanation: &Explanation) -> Option<TextTable> {
    let stretches = &explanation.residual.structure;
    let mut table = TextTable::headed(["from", "to", "log-load", "standard errors"]);
    for one in stretches {
        table.row([
            time(Some(one.from)),
            time(Some(one.until)),
            format!("{:+.3}", one.log_load),
            format!("{:.1}", one.z.abs()),
        ]);
    }
    (!stretches.is_empty()).then_some(table)
}

fn candidates(explanation: &Explanation) -> Option<TextTable> {
    let tried = &explanation.candidates;
    let mut table = TextTable::headed([
        "effect",
        "channel",
        "form",
        "at",
        "delay days",
        "BIC gain",
        "p",
        "held out",
        "outcome",
    ]);
    for one in tried {
        let refused = one.rejected_because.as_ref();
        table.row([
            one.effect.to_string(),
            one.channel.clone().unwrap_or_else(dash),
            form(one.form),
            time(one.at),
            number(one.lag_days),
            gain(one.bic_gain),
            p_value(one.p_value),
            one.held_out
                .map_or_else(dash, |ratio| format!("x {ratio:.2}")),
            refused.map_or("accepted".to_owned(), |why| format!("refused: {why}")),
        ]);
    }
    (!tried.is_empty()).then_some(table)
}

fn faults(explanation: &Explanation) -> Option<TextTable> {
    let faults = &explanation.faults;
    let mut table =
        TextTable::headed(["fault", "where", "from", "to", "size", "values", "copy of"]);
    for fault in faults {
        table.row([
            fault.kind.name().to_owned(),
            fault.channel.clone().unwrap_or("readings".to_owned()),
            time(Some(fault.at)),
            time(fault.until),
            with_unit(fault.size, fault.unit.as_deref()),
            fault.values.to_string(),
            time(fault.copy_of),
        ]);
    }
    (!faults.is_empty()).then_some(table)
}

fn noise(explanation: &Explanation) -> TextTable {
    let noise = &explanation.noise;
    let unit = explanation.unit;
    let mut table = TextTable::plain();
    table.row([
        "white".to_owned(),
        format!("{} {unit}", number(Some(noise.white))),
    ]);
    table.row([
        "correlated".to_owned(),
        format!("{} {unit}", number(Some(noise.correlated))),
    ]);
    let memory = noise
        .memory_days
        .map_or_else(dash, |days| format!("{} days", number(Some(days))));
    table.row(["memory".to_owned(), memory]);
    table
}

fn settings(explanation: &Explanation) -> TextTable {
    let settings = &explanation.settings;
    let mut table = TextTable::plain();
    table.row(["slipwatch", &settings.version]);
    table.row(["seed".to_owned(), settings.seed.to_string()]);
    table.row(["surrogates".to_owned(), settings.surrogates.to_string()]);
    table.row(["BIC margin".to_owned(), number(Some(settings.bic_margin))]);
    let hash = Some(settings.data_hash.clone()).filter(|hash| !hash.is_empty());
    table.row(["hash of the data".to_owned(), hash.unwrap_or_else(dash)]);
    table
}

fn percent(share: Option<f64>) -> String {
    share.map_or_else(dash, percent_in_words)
}

/// A fall of the BIC: fractions of one mean nothing.
fn gain(value: f64) -> String {
    // A sum with zero has no sign.
    format!("{:.0}", value.round() + 0.0)
}

fn form(form: Option<Form>) -> String {
    form.map_or_else(dash, |form| form.name().to_owned())
}

fn with_unit(size: Option<f64>, unit: Option<&str>) -> String {
    match (size, unit) {
        (Some(size), Some(unit)) => format!("{} {unit}", brief(size)),
        (size, _) => number(size),
    }
}

fn number(value: Option<f64>) -> String {
    value.map_or_else(dash, brief)
}

fn p_value(p: Option<f64>) -> String {
    p.map_or_else(dash, tail_probability)
}

fn dash() -> String {
    time(None::<Timestamp>)
}
