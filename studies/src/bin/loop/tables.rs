//! What an explanation says, as Markdown.

use slipwatch::effects::{Effect, Explanation, Kind};
use slipwatch::figures::title;

/// So many candidates are listed.
const MOST_CANDIDATES: usize = 6;
const HOURS_PER_DAY: f64 = 24.0;

/// Three digits that count, or a dash.
pub(crate) fn number(value: Option<f64>) -> String {
    let Some(value) = value else {
        return "–".to_owned();
    };
    let size = value.abs();
    let text = if size < 0.0995 {
        format!("{value:.3}")
    } else if size < 9.95 {
        format!("{value:.2}")
    } else if size < 99.95 {
        format!("{value:.1}")
    } else {
        format!("{value:.0}")
    };
    text.replace('-', "−")
}

/// Kind, channel, and the figures that it has.
pub(crate) fn effect(effect: &Effect) -> String {
    let mut parts = vec![format!("`{}`", effect.effect)];
    if let Some(channel) = &effect.channel {
        parts.push(format!("on `{channel}`"));
    }
    if let Some(form) = effect.form {
        parts.push(format!("({})", form.name()));
    }
    let mut figures = Vec::new();
    let mut add = |name: &str, value: Option<f64>, unit: &str| {
        if value.is_some() {
            figures.push(format!("{name} {}{unit}", number(value)));
        }
    };
    add("mean lag", effect.lag_days, " days");
    add("memory", effect.memory_days, " days");
    add("gain", effect.gain_per_sd, " per standard deviation");
    add(
        "period",
        effect.period_days.map(|d| HOURS_PER_DAY * d),
        " h",
    );
    if effect.effect == Kind::OFFSET || effect.effect == Kind::LOAD_STEP {
        let unit = effect
            .unit
            .as_deref()
            .map_or(String::new(), |unit| format!(" {unit}"));
        add("size", effect.size, &unit);
    }
    if let Some(at) = effect.at {
        figures.push(format!("on {}", at.strftime("%F")));
    }
    match effect.p_value {
        Some(p) if p < 0.001 => figures.push("p < 0.001".to_owned()),
        Some(p) => figures.push(format!("p = {p:.3}")),
        None => {}
    }
    let parts = parts.join(" ");
    if figures.is_empty() {
        parts
    } else {
        format!("{parts}: {}", figures.join(", "))
    }
}

/// Fit and held out, before and after, a line of one table.
pub(crate) fn error_cells(explanation: &Explanation) -> String {
    let error = &explanation.error;
    format!(
        "{} → {} | {} → {} | {} → {} | {}",
        number(error.fit.before),
        number(error.fit.after),
        number(error.held_out_step.before),
        number(error.held_out_step.after),
        number(error.held_out.before),
        number(error.held_out.after),
        error.unit,
    )
}

/// What was refused and why, those first that came nearest.
pub(crate) fn refused(explanation: &Explanation) -> String {
    let refused = explanation.candidates.iter().filter_map(|candidate| {
        let why = candidate.rejected_because.as_deref()?;
        let held_out = number(candidate.held_out);
        let gain = number(Some(candidate.bic_gain));
        Some(format!(
            "| {} | {gain} | {held_out} | {why} |\n",
            title(candidate)
        ))
    });
    let rows: String = refused.take(MOST_CANDIDATES).collect();
    if rows.is_empty() {
        return String::new();
    }
    format!(
        "\n| refused | fall of the BIC | held-out error, ratio | because |\n|---|---|---|---|\n{rows}"
    )
}
