//! An event beside other effects is refined also where it seems to gain nothing at first.

use super::super::candidates::once;
use super::super::fixture::lake_and_step;
use super::super::kind::Kind;
use super::super::options::Options;
use super::super::ready::Ready;

#[test]
fn an_event_beside_the_lake_that_gains_nothing_where_it_is_tried_is_moved_to_where_it_does() {
    let (series, channels) = lake_and_step(0.05, 2);
    let ready = Ready::of(&series, &channels, &mut Vec::new()).unwrap();
    let options = Options::default();
    let mut search = ready.search(&options, false);
    let null = search.null(&ready.plain).unwrap();
    let ground = search.ground(&null).unwrap();
    let lake = search.through_covariates(&null, &ground, None);
    let lake = lake.into_iter().max_by(|a, b| a.gain.total_cmp(&b.gain));
    let base = lake.unwrap().fitted;
    let (mut tried, mut moved) = (0, 0);
    for at in (30..200).step_by(10) {
        let term = once(Kind::LOAD_STEP, at).next().unwrap();
        let start = search.best_start(&base, &term).unwrap();
        let gain = base.bic(&ready.problem) - start.bic(&ready.problem);
        if (-options.bic_margin..0.0).contains(&gain) {
            tried += 1;
            let found = search.refitted(&base, &term).unwrap();
            assert!(found.gain >= gain - 1e-9, "{at}: {gain} {}", found.gain);
            moved += usize::from(found.gain > gain + 1.0);
        }
    }
    assert!(tried > 0 && moved > 0, "{tried} {moved}");
}
