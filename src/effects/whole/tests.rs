//! What helps to predict no reading that its fit did not know leaves again, and what does stays.

use super::super::candidates::in_load;
use super::super::fixture::{channel, daily, driven_by_the_lake, generator, normals, series};
use super::super::kind::{Form, Kind};
use super::super::options::Options;
use super::super::ready::Ready;
use super::super::refit::{Start, refit};
use super::super::response::Response;
use super::*;
use crate::reading::{Channel, Quantity, Series};

/// What is left, by name, of an explanation by all of these channels, each in the load at once.
fn left_of(series: &Series, channels: &[Channel]) -> Vec<String> {
    let ready = Ready::of(series, channels, &mut Vec::new()).unwrap();
    let options = Options::default();
    let mut search = ready.search(&options, false);
    let null = search.null(&ready.plain).unwrap();
    let at_once = Response {
        form: Form::Level,
        stages: 1,
        mean_days: 0.0,
        before: 0.0,
    };
    let terms = ready.drivers.iter();
    let terms = terms.map(|own| in_load(&ready.problem, Kind::HYDROLOGICAL, own, at_once));
    let terms: Vec<_> = terms.map(Option::unwrap).collect();
    let start = Start::at(&null).joined(&terms);
    let mut full = refit(&ready.problem, &start, &ready.bank, &mut search.scratch).unwrap();
    let one = |gain| Accepted {
        bic_gain: gain,
        p_value: 1e-3,
        ties: Vec::new(),
    };
    let mut accepted: Vec<Accepted> = (0..terms.len()).map(|k| one(20.0 + k as f64)).collect();
    let laws = WithoutAny {
        plain: &ready.plain,
        null: &null,
    };
    search.judge_together(laws, &mut full, &mut accepted);
    assert_eq!(accepted.len(), full.terms.len());
    let names = full.terms.iter();
    let names = names.map(|term| ready.drivers[term.channel.unwrap()].name.clone());
    names.collect()
}

/// Whether a covariate leaves that has nothing to do with the readings is half a matter of chance: by chance it may help to predict a block in one way.
#[test]
fn covariates_that_help_to_predict_nothing_leave_and_the_one_that_acts_stays() {
    let (_, channels) = driven_by_the_lake();
    let (mut left, mut left_alone) = (0, 0);
    for seed in 1..=12 {
        let days = daily(240);
        let noise = normals(&mut generator(seed), days.len());
        let mut moved = 0.0;
        let level = &channels[0].samples;
        let values = level.iter().zip(noise).map(|(level, noise)| {
            moved += (0.5 * level.value).exp();
            moved + 0.2 * noise
        });
        let values: Vec<f64> = values.collect();
        let unrelated = normals(&mut generator(100 + seed), days.len());
        let beside = [channels[0].clone(), channel("unrelated", &days, &unrelated)];
        let moving = series(Quantity::Displacement, &days, &values);
        let stays = left_of(&moving, &beside);
        assert!(stays.contains(&"lake".to_owned()), "{seed}: {stays:?}");
        left += usize::from(stays.len() == 1);
        left_alone += usize::from(left_of(&moving, &beside[1..]).is_empty());
    }
    assert!(left > 0 && left_alone > 0, "{left} {left_alone}");
}
