//! The synthetic slopes that `explain` is judged on hold what they are said to hold.

use crate::drawn::{Drawn, drawn};
use crate::family::{Range, SceneFamily};
use crate::score::{Grade, Outcome};
use crate::slope::{SlopeEffect, path};
use slipwatch::effects::{Effect, Explanation, Kind, Options, explain};
use slipwatch::model::{Accuracy, Law, Trajectory};
use slipwatch::runtime::ingest::{ReadOptions, read_files};

fn days() -> Vec<f64> {
    (0..=80).map(|index| f64::from(index) * 0.5).collect()
}

fn assert_close(got: &[f64], want: &[f64]) {
    assert_eq!(got.len(), want.len());
    for (index, (got, want)) in got.iter().zip(want).enumerate() {
        assert!(
            (got - want).abs() < 1e-7 * want.abs().max(1e-3),
            "{index}: {got} not {want}"
        );
    }
}

fn waves() -> SlopeEffect {
    let wave = |day: f64| (day, 0.6 * (day / 3.0).sin());
    let mut knots: Vec<_> = (0..200)
        .map(|index| wave(0.25 * f64::from(index)))
        .collect();
    knots.insert(101, (25.0, 1.0));
    knots.insert(102, (25.0, -0.5));
    SlopeEffect::Load(knots)
}

#[test]
fn steps_and_the_crates_solution_agree_under_a_load() {
    for (m, x_i) in [(0.8, 3.0), (0.6, 0.4), (1.4, 2.0), (0.5, 1.0)] {
        let law = Law::from_paper(m, x_i, 20.0, 1.0).unwrap();
        let exact = path(&law, &[waves()], &days()).unwrap();
        // A load that does not follow the slip, said as one that might.
        let stepped = path(&law, &[waves(), SlopeEffect::Geometry { k: 0.0 }], &days()).unwrap();
        assert_close(&stepped.velocity, &exact.velocity);
        assert_close(&stepped.displacement, &exact.displacement);
    }
}

#[test]
fn loads_that_stand_together_add_up() {
    let law = Law::from_paper(0.8, 3.0, 20.0, 1.0).unwrap();
    let rise = SlopeEffect::Load(vec![(0.0, 0.0), (10.0, 1.0)]);
    let step = SlopeEffect::Load(vec![(0.0, 0.0), (12.3, 0.0), (12.3, 0.5)]);
    let both = vec![(0.0, 0.0), (10.0, 1.0), (12.3, 1.0), (12.3, 1.5)];
    let apart = path(&law, &[rise, step], &days()).unwrap();
    let together = path(&law, &[SlopeEffect::Load(both)], &days()).unwrap();
    assert_close(&apart.velocity, &together.velocity);
    assert_close(&apart.displacement, &together.displacement);
}

/// Without healing ln y = -b slip / v_i, so that v e^(eta v + k slip - b slip / v_i) is v_i, times e^f, and
/// less by the factor from a reset on.
#[test]
fn loads_that_follow_the_motion_keep_what_the_law_keeps() {
    let (v_i, b, eta, k, reset) = (2.0, 0.02, 0.1, 0.004, 1.7_f64);
    let law = Law {
        v_i,
        r: b,
        kappa: 0.0,
        p: 0.0,
        a: 0.0,
        b,
    };
    let effects = [
        SlopeEffect::RateLimit { eta },
        SlopeEffect::Geometry { k },
        SlopeEffect::StateReset {
            day: 20.25,
            factor: reset,
        },
    ];
    let path = path(&law, &effects, &days()).unwrap();
    for (index, day) in days().into_iter().enumerate() {
        let (v, slip) = (path.velocity[index], path.displacement[index]);
        let kept = v.ln() + eta * v + (k - b / v_i) * slip;
        let want = v_i.ln() - if day > 20.25 { reset.ln() } else { 0.0 };
        assert!((kept - want).abs() < 1e-8, "day {day}: {kept} not {want}");
    }
}

#[test]
fn after_a_change_of_friction_the_new_law_runs_from_the_velocity_reached() {
    let before = Law::from_paper(0.8, 3.0, 20.0, 1.0).unwrap();
    let after = Law::from_paper(1.3, 2.0, 9.0, 1.0).unwrap();
    let change = SlopeEffect::FrictionChange {
        day: 20.0,
        law: after,
    };
    let path = path(&before, &[change], &days()).unwrap();
    let first = Trajectory::solve(&before, 21.0, Accuracy::Full)
        .at(20.0)
        .unwrap();
    let law = Law {
        v_i: first.velocity,
        ..after
    };
    let second = Trajectory::solve(&law, 21.0, Accuracy::Full);
    for (index, day) in days()
        .into_iter()
        .enumerate()
        .filter(|(_, day)| *day >= 20.0)
    {
        let motion = second.at(day - 20.0).unwrap();
        assert_close(&[path.velocity[index]], &[motion.velocity]);
        let slip = first.displacement + motion.displacement;
        assert_close(&[path.displacement[index]], &[slip]);
    }
}

fn each_family(range: Range, mut see: impl FnMut(SceneFamily, &Drawn)) {
    for family in SceneFamily::ALL {
        for index in 0..6 {
            see(family, &drawn(family, range, index).unwrap());
        }
    }
}

#[test]
fn every_effect_of_the_motion_shows_over_the_noise() {
    each_family(Range::Dev, |family, one| {
        for effect in &one.truth.effects {
            let of_the_reading = [
                Kind::OFFSET,
                Kind::THERMAL,
                Kind::SEASONAL_READING,
                Kind::CORRELATED_NOISE,
            ];
            let least = if of_the_reading.contains(&effect.effect) {
                1.0
            } else {
                3.0
            };
            let shows = effect.rms_over_noise;
            assert!(shows >= least, "{family:?}: {shows} of {effect:?}");
        }
        let is_empty = one.truth.effects.is_empty();
        assert_eq!(is_empty, family == SceneFamily::Of(Kind::NONE));
    });
}

#[test]
fn readings_scatter_about_the_true_prediction_as_the_truth_says() {
    each_family(Range::Dev, |family, one| {
        let noise = one.truth.noise;
        if noise.correlated > 0.0 {
            return;
        }
        let pairs = one.series.readings.iter().zip(&one.truth.prediction);
        let squares = pairs.map(|(reading, prediction)| {
            let unit = if noise.is_share_of_velocity {
                *prediction
            } else {
                1.0
            };
            ((reading.value - prediction) / unit / noise.white).powi(2)
        });
        let count = one.series.readings.len() as f64;
        let rms = (squares.sum::<f64>() / count).sqrt();
        assert!(
            (rms - 1.0).abs() < 4.0 / (2.0 * count).sqrt(),
            "{family:?}: {rms}"
        );
    });
}

#[test]
fn a_seed_gives_one_series_and_what_is_judged_is_not_what_is_developed_on() {
    let family = SceneFamily::Of(Kind::HYDROLOGICAL);
    let dev = drawn(family, Range::Dev, 3).unwrap();
    assert_eq!(dev.series, drawn(family, Range::Dev, 3).unwrap().series);
    assert_ne!(dev.series, drawn(family, Range::Judged, 3).unwrap().series);
}

#[test]
fn what_is_dumped_reads_back_as_what_was_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let one = drawn(SceneFamily::Of(Kind::PARTITION), Range::Dev, 0).unwrap();
    crate::dump::write(folder.path(), "one", &one).unwrap();
    let file = folder.path().join("one.csv");
    let (recording, _) = read_files(&[file], &ReadOptions::default()).unwrap();
    assert_eq!(recording.series.len(), 1 + one.neighbours.len());
    assert_eq!(recording.series[0], one.series);
    assert_eq!(recording.channels, one.channels);
    assert!(
        one.truth.effects[0]
            .groups
            .as_ref()
            .is_some_and(|groups| groups.len() == 2)
    );
}

#[test]
fn a_step_seen_through_a_mean_is_named_with_the_mean_and_a_step_read_at_once_without_it() {
    let named = |kind: Kind, index: u64| -> Vec<Kind> {
        let one = drawn(SceneFamily::Of(kind), Range::Dev, index).unwrap();
        let options = Options::default();
        let said = explain(&one.series, &one.channels, &[], &options, &mut |_| {});
        let all = std::iter::once(&said.verdict).chain(&said.also);
        all.map(|effect| effect.effect).collect()
    };
    for index in [0, 1] {
        let kinds = named(Kind::INTERVAL_MEAN, index);
        assert_eq!(kinds, [Kind::INTERVAL_MEAN, Kind::LOAD_STEP], "{index}");
    }
    assert_eq!(named(Kind::LOAD_STEP, 1), [Kind::LOAD_STEP]);
}

/// An explanation that names what is given and no more.
fn saying(one: &Drawn, named: Vec<Effect>) -> Explanation {
    let mut short = one.series.clone();
    short.readings.truncate(3);
    let mut said = explain(&short, &[], &[], &Options::default(), &mut |_| {});
    said.cannot_separate_from.clear();
    let mut named = named.into_iter();
    said.verdict = named.next().unwrap_or_else(|| Effect::of(Kind::NONE));
    said.also = named.collect();
    said
}

fn score(family: SceneFamily, one: &Drawn, said: &Explanation) -> Outcome {
    Outcome::of(family, "one", (one, said), 0.0)
}

/// A series of that family beside whose noise stands none that remembers.
fn plain(family: SceneFamily) -> Drawn {
    (0..20)
        .filter_map(|index| drawn(family, Range::Dev, index))
        .find(|one| !one.truth.background_noise_remembers)
        .unwrap()
}

#[test]
fn the_right_kind_through_the_wrong_channel_is_half_right() {
    let family = SceneFamily::Of(Kind::HYDROLOGICAL);
    let one = plain(family);
    let mut effect = Effect::of(Kind::HYDROLOGICAL);
    effect.channel.clone_from(&one.truth.effects[0].channel);
    effect.gain_per_sd = one.truth.effects[0].gain_per_sd.map(|gain| 1.25 * gain);
    let right = score(family, &one, &saying(&one, vec![effect.clone()]));
    assert!(right.grade == Grade::Right && right.exactly());
    assert!((right.size_errors[0] - 0.25).abs() < 1e-12);
    effect.channel = Some("dice_m".to_owned());
    let wrong = score(family, &one, &saying(&one, vec![effect]));
    assert_eq!(wrong.grade, Grade::WrongChannel);
}

#[test]
fn a_wrong_kind_is_left_open_where_the_right_one_could_not_be_separated() {
    let family = SceneFamily::Of(Kind::LOAD_STEP);
    let one = plain(family);
    let mut said = saying(&one, vec![Effect::of(Kind::STATE_RESET)]);
    let closed = score(family, &one, &said);
    assert_eq!(closed.grade, Grade::Wrong);
    assert!(!closed.exactly());
    assert_eq!(closed.called, Kind::STATE_RESET);
    said.cannot_separate_from = vec![Kind::LOAD_STEP.into()];
    assert_eq!(score(family, &one, &said).grade, Grade::LeftOpen);
}

#[test]
fn an_effect_named_too_many_is_not_exactly_right() {
    let family = SceneFamily::Of(Kind::LOAD_STEP);
    let one = plain(family);
    let mut step = Effect::of(Kind::LOAD_STEP);
    step.at = one.truth.effects[0].at;
    let both = vec![step, Effect::of(Kind::SEASONAL)];
    let score = score(family, &one, &saying(&one, both));
    assert!(score.right_kind() && !score.exactly());
    assert_eq!(score.at_errors, [0.0]);
}

#[test]
fn nothing_is_the_right_answer_to_noise_and_unexplained_to_what_no_label_fits() {
    let (none, outside) = (SceneFamily::Of(Kind::NONE), SceneFamily::Outside);
    let (noise, unknown) = (plain(none), plain(outside));
    let nothing = |one| saying(one, Vec::new());
    let open = |one| saying(one, vec![Effect::of(Kind::UNEXPLAINED)]);
    assert!(score(none, &noise, &nothing(&noise)).right_kind());
    assert!(!score(none, &noise, &open(&noise)).right_kind());
    assert!(score(outside, &unknown, &open(&unknown)).right_kind());
    assert!(!score(outside, &unknown, &nothing(&unknown)).right_kind());
    let step = saying(&unknown, vec![Effect::of(Kind::LOAD_STEP)]);
    assert!(!score(outside, &unknown, &step).right_kind());
}

/// What `explain` calls the `index`-th slope for development, and whether that is right.
fn called(family: SceneFamily, index: u64) -> Outcome {
    let one = drawn(family, Range::Dev, index).unwrap();
    let neighbours: Vec<_> = one.neighbours.iter().collect();
    let options = Options::default();
    let said = explain(
        &one.series,
        &one.channels,
        &neighbours,
        &options,
        &mut |_| {},
    );
    score(family, &one, &said)
}

/// A load step of two per cent explains the same readings, by the pace that it changes and not by its jump.
#[test]
fn a_changed_pace_without_a_jump_is_a_change_of_friction() {
    let friction = called(SceneFamily::Of(Kind::FRICTION_CHANGE), 3);
    assert_eq!(friction.called, Kind::FRICTION_CHANGE);
    assert!(friction.at_errors[0] < 20.0, "{:?}", friction.at_errors);
}

#[test]
fn a_group_that_relaxes_after_it_parted_is_a_partition() {
    let parted = called(SceneFamily::Of(Kind::PARTITION), 2);
    assert_eq!(parted.called, Kind::PARTITION);
    assert!(parted.at_errors[0] < 20.0, "{:?}", parted.at_errors);
}

/// A change of friction would be accepted, and leaves three times the noise.
#[test]
fn a_pulse_of_the_load_that_no_label_accounts_for_is_unexplained() {
    let outside = called(SceneFamily::Outside, 0);
    assert!(outside.right_kind(), "{:?}", outside.said);
}
