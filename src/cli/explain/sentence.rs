//! What an explanation comes to, in sentences.

use crate::cli::table::time;
use crate::effects::{
    DeclaredEffect, Effect, Explained, Explanation, Form, Kind, Rival, SizeInWords, Structure,
    TOO_FEW, Together, may_be_slip,
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
    if !effect.effect.is_an_end() {
        return format!("{benchmark}: consistent with {}", phrase(effect));
    }
    let structure = most_marked(&explanation.residual.structure);
    let has_too_few = explanation.remarks.iter().any(|one| one == TOO_FEW);
    if is_declared {
        format!("{benchmark}: nothing of what was declared stands{structure}")
    } else if effect.effect == Kind::UNEXPLAINED && explanation.error.fit.before.is_none() {
        format!(
            "{benchmark}: nothing can be said of what the law lacks: it was not fitted to these readings"
        )
    } else if effect.effect == Kind::UNEXPLAINED {
        format!(
            "{benchmark}: unexplained: the law lacks something here, and no effect that was tried explains it{structure}"
        )
    } else if has_too_few {
        format!("{benchmark}: nothing can be said of what the law lacks")
    } else {
        format!(
            "{benchmark}: the residual cannot be distinguished from noise; these readings show nothing that the law lacks"
        )
    }
}

/// What several benchmarks show together, a line or two; nothing where they are one, read as two quantities.
pub(super) fn parting(found: &Together) -> String {
    if found.benchmarks.len() < 2 {
        return String::new();
    }
    let names: Vec<&str> = found.benchmarks.iter().map(BenchmarkId::as_str).collect();
    let names = names.join(", ");
    if found.verdict.effect == Kind::PARTITION {
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
    let rivals = || explanation.cannot_separate_from.iter();
    let is_one_channel = rivals().all(|rival| rival.channel.is_none());
    let is_slow_alike = rivals().any(|rival| rival.kind == Kind::UNEXPLAINED);
    if !explanation.verdict.effect.is_an_end() {
        said.push(match explanation.explained {
            Explained::Full if explanation.verdict.effect == Kind::CORRELATED_NOISE => {
                "No effect is found: with that noise the residual cannot be distinguished from noise."
                    .to_owned()
            }
            Explained::Full => {
                "Explained in full: the residual that is left cannot be distinguished from noise."
                    .to_owned()
            }
            Explained::Partly if is_slow_alike => format!(
                "Explained in part: a load that nothing measures would explain as much{left}."
            ),
            Explained::Partly if is_one_channel => {
                format!("Explained in part: structure is left in the residual{left}.")
            }
            Explained::Partly => {
                format!("Explained in part: which channel acts cannot be distinguished{left}.")
            }
            Explained::None => format!("Not explained: structure is left in the residual{left}."),
        });
        if explanation.verdict.effect == Kind::CORRELATED_NOISE {
            // Correlated noise may be the instrument's, and may be motion that no effect that was tried makes.
            said.push(
                "Whether the instrument makes it or the slope, these readings do not show."
                    .to_owned(),
            );
        } else if explanation.verdict.effect.is_of_the_reading() {
            let mut also = explanation.also.iter();
            let is_all = also.all(|effect| effect.effect.is_of_the_reading());
            said.push(if may_be_slip(explanation) {
                "It lies in the measurement, or the slope has slipped: these readings do not show which.".to_owned()
            } else if is_all && explanation.explained != Explained::Partly {
                "It lies in the measurement, not in the slope.".to_owned()
            } else {
                "That lies in the measurement; not all that follows does.".to_owned()
            });
        }
    }
    for effect in &explanation.also {
        said.push(format!("Also consistent with {}.", phrase(effect)));
    }
    said.extend(explanation.given.iter().filter_map(refused));
    if !explanation.cannot_separate_from.is_empty() {
        let rivals = Rival::listed(&explanation.cannot_separate_from);
        said.push(format!("Cannot be separated from: {rivals}."));
        let mut kinds = explanation.cannot_separate_from.iter();
        let is_said = explanation.verdict.effect == Kind::SEASONAL_READING;
        if !is_said && kinds.any(|rival| rival.kind == Kind::SEASONAL) {
            said.push(
                "A wave of the year may lie in the readings themselves too, as in those of GNSS."
                    .to_owned(),
            );
        }
    }
    said.extend(explanation.remarks.iter().cloned());
    said.extend(explanation.error.caveat.clone());
    said
}

/// Why something that was declared does not stand; `None` of what does.
fn refused(one: &DeclaredEffect) -> Option<String> {
    let why = one.rejected_because.as_ref()?.trim_end_matches('.');
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

/// What it is called, with its covariate, its time, its groups and its size.
fn head(effect: &Effect) -> String {
    let definition = effect.effect.definition();
    let by = effect.channel.as_ref();
    let by = by.map_or(String::new(), |name| format!(" by {name}"));
    let at = effect.at;
    let at = at.map_or(String::new(), |at| format!(" at {}", time(Some(at))));
    let groups = groups(effect);
    let size = effect.size.map_or(String::new(), |size| {
        match (definition.size_in_words, &effect.unit) {
            (SizeInWords::Unsaid, _) => String::new(),
            (SizeInWords::Behind(words), Some(unit)) => format!("{words}{} {unit}", brief(size)),
            (SizeInWords::Behind(words), None) => format!("{words}{}", brief(size)),
            (SizeInWords::JumpOfVelocity, _) => jump_of_velocity(size),
        }
    });
    format!("{}{by}{at}{groups}{size}", definition.title)
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
        // Noise has a memory, and no delay.
        if effect.lag_days.is_none() {
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
    // What it does at once the state of the law takes back in part, or carries on.
    let (at_once, factor) = effect
        .velocity_factor_per_sd
        .map_or((" at once", gain), |factor| ("", factor.ln()));
    let verb = if factor < 0.0 { "lowers" } else { "raises" };
    format!(
        "{more}{at_once} {verb} the velocity by a factor of {}",
        brief(factor.abs().exp())
    )
}

/// A size that is a log-load.
fn jump_of_velocity(size: f64) -> String {
    let verb = if size < 0.0 { "lowers" } else { "raises" };
    format!(
        ", which at once {verb} the velocity by a factor of {}",
        brief(size.abs().exp())
    )
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
