//! What an explanation comes to, in sentences.

use crate::cli::table::time;
use crate::effects::{
    DeclaredEffect, Effect, Explained, Explanation, Form, Kind, Rival, Structure, TOO_FEW, Together,
};
use crate::reading::BenchmarkId;

const HOURS_PER_DAY: f64 = 24.0;
/// Spans under so many days are given in hours.
const A_FEW_DAYS: f64 = 2.0;

/// The verdict in one sentence.
pub(super) fn verdict(explanation: &Explanation) -> String {
    let effect = &explanation.verdict;
    let benchmark = &explanation.benchmark;
    let is_declared = !explanation.given.is_empty();
    match effect.effect {
        Kind::None | Kind::Unexplained if is_declared => format!(
            "{benchmark}: nothing of what was declared stands{}",
            most_marked(&explanation.residual.structure)
        ),
        Kind::None if explanation.remarks.iter().any(|one| one == TOO_FEW) => {
            format!("{benchmark}: nothing can be said of what the law lacks")
        }
        Kind::None => format!(
            "{benchmark}: the residual cannot be distinguished from noise; these readings show nothing that the law lacks"
        ),
        Kind::Unexplained => format!(
            "{benchmark}: unexplained: the law lacks something here, and no effect that was tried explains it{}",
            most_marked(&explanation.residual.structure)
        ),
        Kind::Hydrological
        | Kind::Seasonal
        | Kind::Tide
        | Kind::LoadStep
        | Kind::StateReset
        | Kind::FrictionChange
        | Kind::RateLimit
        | Kind::Geometry
        | Kind::Partition
        | Kind::Offset
        | Kind::Thermal
        | Kind::IntervalMean
        | Kind::CorrelatedNoise => format!("{benchmark}: consistent with {}", phrase(effect)),
    }
}

/// What several benchmarks show together, a line or two.
pub(super) fn parting(found: &Together) -> String {
    let names: Vec<&str> = found.benchmarks.iter().map(BenchmarkId::as_str).collect();
    let names = names.join(", ");
    if found.verdict.effect == Kind::Partition {
        return format!("{names}: consistent with {}\n", phrase(&found.verdict));
    }
    let mut refused = found.candidates.iter();
    let why = refused.find_map(|one| one.rejected_because.as_deref());
    let why = why.map_or(String::new(), |why| format!(" (refused: {why})"));
    format!("{names}: no partition into groups was found{why}\n")
}

/// What else there is to say, a sentence each: how far it goes, what else, what it may be taken for.
pub(super) fn others(explanation: &Explanation) -> Vec<String> {
    let mut said = Vec::new();
    let left = most_marked(&explanation.residual.structure);
    let mut rivals = explanation.cannot_separate_from.iter();
    let is_one_channel = rivals.all(|rival| rival.channel.is_none());
    if !matches!(explanation.verdict.effect, Kind::None | Kind::Unexplained) {
        said.push(match explanation.explained {
            Explained::Full => {
                "Explained in full: the residual that is left passes for noise.".to_owned()
            }
            Explained::Partly if is_one_channel => {
                format!("Explained in part: structure is left in the residual{left}.")
            }
            Explained::Partly => {
                format!("Explained in part: which channel acts cannot be distinguished{left}.")
            }
            Explained::None => format!("Not explained: structure is left in the residual{left}."),
        });
        if explanation.verdict.effect.is_of_the_reading() {
            said.push("It lies in the measurement, not in the slope.".to_owned());
        }
    }
    for effect in &explanation.also {
        said.push(format!("Also consistent with {}.", phrase(effect)));
    }
    said.extend(explanation.given.iter().filter_map(refused));
    if !explanation.cannot_separate_from.is_empty() {
        let rivals = Rival::listed(&explanation.cannot_separate_from);
        said.push(format!("Cannot be separated from: {rivals}."));
    }
    said.extend(explanation.remarks.iter().cloned());
    said.extend(explanation.error.caveat.clone());
    said
}

/// Why something that was declared does not stand; `None` of what does.
fn refused(one: &DeclaredEffect) -> Option<String> {
    let why = one.rejected_because.as_ref()?;
    let fitted = one.effect.as_ref();
    let fitted = fitted.map_or(String::new(), |effect| {
        format!(" (fitted as {})", phrase(effect))
    });
    Some(format!(
        "Declared, and does not stand: {}{fitted}: {why}.",
        one.declared
    ))
}

/// Where and when structure stands out most, behind a colon; nothing where it is not known.
fn most_marked(structure: &[Structure]) -> String {
    let most = structure
        .iter()
        .max_by(|a, b| a.z.abs().total_cmp(&b.z.abs()));
    most.map_or(String::new(), |most| {
        format!(
            "; it stands out most from {} to {} (log-load {:+.2}, {:.1} standard errors)",
            time(Some(most.from)),
            time(Some(most.until)),
            most.log_load,
            most.z.abs()
        )
    })
}

/// An effect with its figures.
fn phrase(effect: &Effect) -> String {
    let about = details(effect);
    let about = if about.is_empty() {
        String::new()
    } else {
        format!(" ({})", about.join("; "))
    };
    let p = effect.p_value.map(tail_probability);
    let p = p.map_or(String::new(), |p| match p.strip_prefix('<') {
        Some(bound) => format!(", p <{bound}"),
        None => format!(", p = {p}"),
    });
    format!("{}{about}{p}", head(effect))
}

fn head(effect: &Effect) -> String {
    let at = effect
        .at
        .map_or(String::new(), |at| format!(" at {}", time(Some(at))));
    let by = effect
        .channel
        .as_ref()
        .map_or(String::new(), |name| format!(" by {name}"));
    let size = effect.size.map(|size| match &effect.unit {
        Some(unit) => format!("{} {unit}", brief(size)),
        None => brief(size),
    });
    let of = |words: &str| {
        size.as_ref()
            .map_or(String::new(), |size| format!("{words}{size}"))
    };
    match effect.effect {
        Kind::Hydrological => format!("hydrological forcing{by}"),
        Kind::Seasonal => "a load that comes and goes with the year".to_owned(),
        Kind::Tide => "tidal forcing".to_owned(),
        Kind::LoadStep => format!("a step of the load{at}{}", step(effect)),
        Kind::StateReset => format!(
            "a reset of the contacts' state{at}{}",
            of(", by a factor of ")
        ),
        Kind::FrictionChange => format!("a change of the friction's parameters{at}"),
        Kind::RateLimit => "a load that falls with the velocity (damping or inertia)".to_owned(),
        Kind::Geometry => {
            "a load that falls with the slip (the slope flattens under the block)".to_owned()
        }
        Kind::Partition => format!(
            "benchmarks that move as groups from then on{at}{}",
            groups(effect)
        ),
        Kind::Offset => format!("an offset of the readings{at}{}", of(", of ")),
        Kind::Thermal => format!("temperature in the readings{by}"),
        Kind::IntervalMean => format!("velocities that are means over an interval{}", of(" of ")),
        Kind::CorrelatedNoise => "noise of the readings that remembers".to_owned(),
        Kind::Unexplained => "nothing that was tried".to_owned(),
        Kind::None => "noise".to_owned(),
    }
}

fn details(effect: &Effect) -> Vec<String> {
    let form = effect.form.map(|form| form.name().to_owned());
    let between = effect
        .at_interval
        .map(|[low, high]| format!("between {} and {}", time(Some(low)), time(Some(high))));
    let period = effect
        .period_days
        .map(|days| format!("strongest period {}", span(days)));
    let lag = effect
        .lag_days
        .map(|days| format!("mean delay {}", span(days)));
    let memory = effect.memory_days.map(|days| {
        if effect.effect == Kind::CorrelatedNoise {
            format!("over {}", span(days))
        } else {
            format!("95 % of the response within {}", span(days))
        }
    });
    let gain = effect.gain_per_sd.map(|gain| gain_words(effect, gain));
    let parts = [form, between, period, lag, memory, gain];
    parts.into_iter().flatten().collect()
}

fn gain_words(effect: &Effect, gain: f64) -> String {
    let more = match effect.form {
        Some(Form::Rate) => "one sd more of its rate of change",
        Some(Form::Level) | None => "one sd more",
    };
    if effect.effect.is_of_the_reading() {
        let unit = effect
            .unit
            .as_deref()
            .map_or(String::new(), |unit| format!(" {unit}"));
        return format!("{more} adds {}{unit} to the reading", brief(gain));
    }
    let verb = if gain < 0.0 { "lowers" } else { "raises" };
    format!(
        "{more} {verb} the velocity by a factor of {}",
        brief(gain.abs().exp())
    )
}

/// The size of a step is a log-load.
fn step(effect: &Effect) -> String {
    effect.size.map_or(String::new(), |size| {
        let verb = if size < 0.0 { "lowers" } else { "raises" };
        format!(
            ", which at once {verb} the velocity by a factor of {}",
            brief(size.abs().exp())
        )
    })
}

fn groups(effect: &Effect) -> String {
    let named = |group: &Vec<BenchmarkId>| {
        let names: Vec<&str> = group.iter().map(BenchmarkId::as_str).collect();
        format!("[{}]", names.join(", "))
    };
    effect.groups.as_ref().map_or(String::new(), |groups| {
        let groups: Vec<String> = groups.iter().map(named).collect();
        format!(": {}", groups.join(" and "))
    })
}

/// Days, or hours where they are few.
fn span(days: f64) -> String {
    if days.abs() < A_FEW_DAYS {
        format!("{} h", brief(HOURS_PER_DAY * days))
    } else {
        format!("{} days", brief(days))
    }
}

/// A p-value to three places, as `.005`; one that these cannot show as `< .001`.
pub(super) fn tail_probability(p: f64) -> String {
    if p < 0.0005 {
        return "< .001".to_owned();
    }
    let text = format!("{p:.3}");
    text.strip_prefix('0').unwrap_or(&text).to_owned()
}

/// As a sentence has a number: three digits, and no zeros at their end behind the point.
pub(super) fn brief(value: f64) -> String {
    let size = value.abs();
    if size >= 1e6 || (size > 0.0 && size < 1e-3) {
        return format!("{value:.2e}");
    }
    let places = match size {
        size if size >= 100.0 => 0,
        size if size >= 10.0 => 1,
        size if size >= 1.0 => 2,
        _ => 3,
    };
    let text = format!("{value:.places$}");
    if places == 0 {
        return text;
    }
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}
