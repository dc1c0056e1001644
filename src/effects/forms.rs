//! Whether a covariate acts by its value or by its rate of change, where the readings leave that open.

use super::explanation::{Candidate, Effect};
use super::findings::Findings;
use super::kind::Form;
use super::search::SIGNIFICANT;

/// A form whose error over the held-out readings is more than so many times as large is not open.
const NO_WORSE: f64 = 1.2;

/// A sentence for each effect of a covariate that its other form explains as well: by less than `margin` of the BIC apart, and not
/// refused before a later block was asked.
pub(super) fn left_open(findings: &Findings, margin: f64) -> Vec<String> {
    let effects = findings.effects();
    let sentences = effects.filter_map(|effect| {
        let mut others = findings.candidates.iter();
        let other = others.find(|one| is_other_form(effect, one, margin))?;
        sentence(effect, other)
    });
    sentences.collect()
}

fn is_other_form(effect: &Effect, one: &Candidate, margin: f64) -> bool {
    let is_one_channel = effect.channel.is_some() && effect.channel == one.channel;
    is_one_channel
        && effect.effect == one.effect
        && effect.form != one.form
        && one.held_out.is_some_and(|ratio| ratio <= NO_WORSE)
        && (one.bic_gain - effect.bic_gain).abs() < margin
        && one.p_value.is_some_and(|p| p < SIGNIFICANT)
}

fn sentence(effect: &Effect, other: &Candidate) -> Option<String> {
    let words = |form: Form| match form {
        Form::Level => "its value",
        Form::Rate => "its rate of change",
    };
    let (own, other_form) = (words(effect.form?), words(other.form?));
    Some(format!(
        "{} by {other_form} explains the same as by {own}: the BIC differs by {:.0}, and which of the two acts is open.",
        effect.channel.as_ref()?,
        (effect.bic_gain - other.bic_gain).abs()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Kind;
    use crate::reading::Unit;

    fn candidate(form: Form, bic_gain: f64) -> Candidate {
        Candidate {
            effect: Kind::HYDROLOGICAL,
            channel: Some("lake_level_m".to_owned()),
            form: Some(form),
            at: None,
            lag_days: Some(12.0),
            bic_gain,
            p_value: Some(1e-3),
            held_out: Some(0.8),
            rejected_because: None,
        }
    }

    #[test]
    fn the_other_form_of_a_covariate_is_remarked_where_it_explains_the_same_and_not_where_it_explains_less()
     {
        let mut findings = Findings::none(Unit::MM);
        findings.verdict = Effect {
            channel: Some("lake_level_m".to_owned()),
            form: Some(Form::Rate),
            bic_gain: 52.0,
            ..Effect::of(Kind::HYDROLOGICAL)
        };
        findings.candidates = vec![candidate(Form::Rate, 52.0), candidate(Form::Level, 47.0)];
        assert_eq!(
            left_open(&findings, 10.0),
            [
                "lake_level_m by its value explains the same as by its rate of change: the BIC differs by 5, and which of the two acts is open."
            ]
        );
        findings.candidates[1].bic_gain = 31.0;
        assert!(left_open(&findings, 10.0).is_empty());
    }
}
