//! What docs/seed.md says of the paper's studies holds, and is labelled where it was put in by hand.

use crate::claims::{Readings, claims};
use crate::claims_vaiont::{excess_below_one, has_the_papers_m, line_day};
use crate::document::Studies;
use crate::recorded::{Archive, RecordKind};
use crate::vaiont::Benchmark;
use slipwatch::reading::Quantity;
use slipwatch::regime::Regime;
use std::path::PathBuf;
use std::sync::LazyLock;

/// Everything, with few synthetic series.
static STUDIES: LazyLock<Studies> =
    LazyLock::new(|| Studies::run(3, &Archive::own().unwrap()).unwrap());
/// Synthetic series where their shares matter.
const SYNTHETICS: u64 = 30;

fn benchmark(id: &str) -> &'static Benchmark {
    STUDIES.vaiont.iter().find(|one| one.id == id).unwrap()
}

fn docs() -> PathBuf {
    studies::project().join("docs")
}

fn figures() -> Vec<(&'static str, String)> {
    let all = crate::figures::all(&STUDIES).unwrap();
    all.map(|(name, figure)| (name, figure.svg())).to_vec()
}

/// What a row of the document's first table says, by how the paper's statement begins.
fn claim(beginning: &str) -> crate::claims::Claim {
    let mut all = claims(&STUDIES).unwrap().into_iter();
    all.find(|claim| claim.paper.starts_with(beginning))
        .unwrap()
}

#[test]
fn the_best_m_of_each_vaiont_benchmark_is_the_papers_within_five_hundredths() {
    for (id, m) in [("5", 1.35), ("63", 1.24), ("67", 0.99), ("50", 1.00)] {
        let one = benchmark(id);
        let best = one.free.parameters.m.best.unwrap();
        assert!((best - m).abs() <= 0.05, "{id}: {best}");
        assert!(has_the_papers_m(one), "{id}");
    }
}

#[test]
fn simplexes_from_many_starts_find_the_papers_m_of_each_vaiont_benchmark() {
    for one in &STUDIES.vaiont {
        let found = one.simplex.unwrap();
        let least = one.free.rms.unwrap();
        println!("{}: {found:?}, least {least}", one.id);
        assert!(
            (found.m - one.paper_m).abs() <= 0.05,
            "{}: {found:?}",
            one.id
        );
        assert!(found.rms >= least * (1.0 - 1e-6), "{}: {found:?}", one.id);
    }
}

#[test]
fn laws_below_m_one_fit_5_and_63_only_slightly_worse_and_67_much_better() {
    for id in ["5", "63"] {
        let excess = excess_below_one(benchmark(id)).unwrap();
        assert!((0.0..0.1).contains(&excess), "{id}: {excess}");
    }
    let bent = benchmark("67");
    assert!(excess_below_one(bent).unwrap() < -0.5);
    assert!(bent.free.regime.probability_unstable.unwrap() < 0.05);
}

#[test]
fn the_line_through_each_vaiont_benchmark_meets_zero_within_a_day_of_the_papers() {
    for id in ["5", "63", "67", "50"] {
        let day = line_day(benchmark(id)).unwrap();
        assert!(
            (day - crate::vaiont::PAPER_LINE_DAY).abs() <= 1.0,
            "{id}: {day}"
        );
    }
}

#[test]
fn alpha_is_two_where_inverse_velocity_is_straight_and_less_where_it_bends_upwards() {
    let best = |id| benchmark(id).free.inverse_velocity.alpha.unwrap();
    for id in ["5", "63", "50"] {
        let alpha = best(id).best.unwrap();
        assert!((alpha - 2.0).abs() <= 0.1, "{id}: {alpha}");
    }
    assert!(best("67").high.unwrap() < 1.9, "{:?}", best("67"));
}

#[test]
fn vaionts_velocities_displacements_and_likenesses_are_the_papers() {
    for beginning in ["Vaiont: velocities from 5", "Vaiont: 5 and 63 alike"] {
        let claim = claim(beginning);
        assert!(claim.agrees, "{claim:?}");
    }
}

#[test]
fn that_the_increase_exhausts_itself_is_given_up_and_said_so() {
    let given_up = claim("Vaiont: the increase of the velocity exhausts itself");
    assert!(!given_up.agrees, "{given_up:?}");
    for one in &STUDIES.vaiont {
        let gain = crate::given_up::last_gain(&one.series).unwrap().unwrap();
        assert!(gain < 1.0, "{}: {gain}", one.id);
    }
    let text = crate::document::text(&STUDIES).unwrap();
    assert!(text.contains("given up is that the increase of 5 and 63 exhausts itself"));
}

#[test]
fn noise_as_it_is_drawn_hides_m_unless_it_is_tiny() {
    let share = |noise: f64| {
        let one = STUDIES.as_drawn.iter().find(|one| one.noise <= noise);
        one.unwrap().found.iter().sum::<f64>() / one.unwrap().found.len() as f64
    };
    assert!(share(0.04) < 0.3, "{:?}", STUDIES.as_drawn);
    assert!(share(1e-4) > 0.8, "{:?}", STUDIES.as_drawn);
}

#[test]
fn an_increase_that_exhausts_itself_moves_m_away_from_the_papers() {
    let [none, .., most] = STUDIES.trials.as_slice() else {
        panic!("no trials");
    };
    assert!(none.loss_per_day.abs() < f64::EPSILON && most.loss_per_day > 0.03);
    let paper = [1.35, 1.24, 1.00];
    for (index, m) in paper.into_iter().enumerate() {
        let of = |trial: &crate::given_up::LossTrial| (trial.of[index].0.unwrap() - m).abs();
        assert!(of(none) <= 0.05 && of(most) > 0.3, "{none:?} {most:?}");
    }
}

#[test]
fn benchmarks_5_63_and_50_pass_a_metre_a_day_within_a_day_of_the_collapse() {
    for id in ["5", "63", "50"] {
        let passage = benchmark(id).free.critical_velocity_time;
        let day = crate::recorded::vaiont_day(passage.median.unwrap()).unwrap();
        assert!(
            (day - crate::vaiont::COLLAPSE_DAY).abs() < 1.0,
            "{id}: {day}"
        );
        assert!(passage.probability.unwrap() > 0.9, "{id}: {passage:?}");
    }
}

#[test]
fn la_clapiere_to_1987_is_stable_with_the_papers_m_and_a_valley_that_holds_its_x_i() {
    let [free, paper, unit, imposed] = STUDIES.fits.as_slice() else {
        panic!("{} fits", STUDIES.fits.len());
    };
    assert_eq!(free.report.regime.label, Regime::StableAccelerating);
    let m = free.report.parameters.m.best.unwrap();
    assert!((m - crate::la_clapiere::PAPER_M).abs() <= 0.05, "{m}");
    let x_i = free.report.parameters.x_i.best.unwrap();
    assert!((20.0..80.0).contains(&x_i), "{x_i}");
    let rms = |fit: &crate::la_clapiere::Fit| fit.report.rms.unwrap();
    assert!(rms(paper) < 1.05 * rms(free));
    assert!(rms(imposed) > 1.5 * rms(free) && rms(unit) > 1.5 * rms(free));
}

#[test]
fn m_and_x_i_of_la_clapiere_are_poorly_constrained_along_a_valley() {
    let valley = STUDIES.valley.as_ref().unwrap();
    let (low, high) = valley.m(crate::valley::AS_GOOD).unwrap();
    assert!(
        (low..=high).contains(&crate::la_clapiere::PAPER_M),
        "{low} to {high}"
    );
    let (low, high) = valley.x_i(crate::valley::AS_GOOD).unwrap();
    assert!(
        (low..=high).contains(&crate::la_clapiere::PAPER_X_I),
        "{low} to {high}"
    );
    let (low, high) = valley.m(crate::valley::NEARLY).unwrap();
    assert!(
        low <= 0.9 && high > crate::la_clapiere::PAPER_M,
        "{low} to {high}"
    );
    let x_i = STUDIES.fits[0].report.parameters.x_i;
    let (low, high) = (x_i.low.unwrap(), x_i.high.unwrap());
    assert!(
        low < crate::la_clapiere::PAPER_X_I && high > 2.0 * low,
        "{x_i:?}"
    );
}

#[test]
fn m_of_la_clapiere_lies_between_nothing_and_one_for_every_t_max_but_the_first_two() {
    let rows = &STUDIES.growing.rows;
    assert_eq!(rows.len(), 13);
    for row in &rows[2..] {
        assert!(crate::claims::has_m_of_a_stable_law(row), "{row:?}");
    }
}

#[test]
fn the_transition_of_la_clapiere_recedes_as_t_max_grows() {
    let rows = &STUDIES.growing.rows;
    let transitions: Vec<_> = rows.iter().filter_map(|row| row.transition_time).collect();
    assert!(transitions.len() >= 11, "{transitions:?}");
    assert!(transitions.is_sorted(), "{transitions:?}");
    let years = |time| crate::recorded::decimal_year(time).unwrap();
    let (first, last) = (
        years(transitions[0]),
        years(transitions[transitions.len() - 1]),
    );
    assert!(last - first > 2.0, "{first} to {last}");
}

#[test]
fn the_river_explains_the_seasons_before_1986_and_nothing_after() {
    let river = &STUDIES.river;
    assert!(river.before.unwrap() > 0.5, "{river:?}");
    assert!(river.after.unwrap() < 0.1, "{river:?}");
}

#[test]
fn la_clapiere_is_six_times_slower_over_1988_to_1990() {
    let fall = STUDIES.river.fall.unwrap();
    assert!((5.0..7.0).contains(&fall), "{fall}");
}

#[test]
fn every_statement_but_the_one_given_up_agrees() {
    for claim in claims(&STUDIES).unwrap() {
        // Three synthetic series of a kind are too few for their shares.
        if claim.readings != Readings::Synthetic {
            let is_given_up = claim.paper.contains("exhausts itself");
            assert_eq!(claim.agrees, !is_given_up, "{claim:?}");
        }
    }
}

#[test]
fn other_readings_in_a_folder_are_studied_and_called_no_reconstruction() {
    let folder = tempfile::tempdir().unwrap();
    let own = Archive::own().unwrap();
    let mut vaiont = own.vaiont.clone();
    vaiont.provenance = std::iter::once(("kind".to_owned(), "measured".to_owned())).collect();
    let la_clapiere = slipwatch::reading::Recording {
        series: vec![own.la_clapiere.clone()],
        ..slipwatch::reading::Recording::default()
    };
    for (name, recording) in [
        ("vaiont-1963", &vaiont),
        ("la-clapiere-1982-1995", &la_clapiere),
    ] {
        let file = folder.path().join(format!("{name}.mcap"));
        slipwatch::runtime::ingest::write_mcap(recording, &file).unwrap();
    }
    let archive = Archive::of(folder.path()).unwrap();
    assert_eq!(
        archive.vaiont_kind,
        RecordKind::Other("measured".to_owned())
    );
    assert_eq!(archive.vaiont.series, own.vaiont.series);
    assert_eq!(archive.la_clapiere, own.la_clapiere);
    let studies = Studies::run(1, &archive).unwrap();
    let text = crate::document::text(&studies).unwrap();
    assert!(!text.contains("Reconstruction") && !text.contains("reconstruction †"));
    assert!(text.contains("Vaiont: measured."));
    for (_, figure) in crate::figures::all(&studies).unwrap() {
        assert!(!figure.svg().contains("reconstruction"));
    }
}

#[test]
fn before_the_end_of_1986_minima_span_both_sides_and_by_1987_9_the_best_is_below_one() {
    let rows = &STUDIES.growing.rows;
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut sides = Vec::new();
    for row in rows {
        if crate::la_clapiere::is_before_the_end_of_1986(row.t_max).unwrap() {
            let range = row.alternatives.range_of_m().unwrap();
            (low, high) = (low.min(range.0), high.max(range.1));
            sides.push(row.m.unwrap() < 1.0);
        }
    }
    assert!(low < -5.0 && high > 20.0, "{low} to {high}");
    assert!(sides.contains(&true) && sides.contains(&false), "{sides:?}");
    for row in &rows[rows.len() - 2..] {
        assert!(crate::claims::has_m_of_a_stable_law(row), "{row:?}");
        assert!(row.regime.probability_unstable.unwrap() < 0.5, "{row:?}");
    }
}

#[test]
fn almost_all_fits_of_la_clapieres_velocity_have_m_below_one_and_x_i_above() {
    let rows = &STUDIES.growing_velocity.rows;
    let met = rows
        .iter()
        .filter(|row| crate::claims::is_below_one_from_above(row));
    assert!(met.count() >= 10, "{rows:#?}");
}

#[test]
fn displacement_and_velocity_give_one_regime_of_67() {
    let both = |id| {
        let one = benchmark(id);
        (&one.free, &one.from_displacement)
    };
    let m = |report: &slipwatch::inversion::FitReport| report.parameters.m.best.unwrap();
    let (velocity, displacement) = both("67");
    assert_eq!(velocity.regime.label, Regime::StableAccelerating);
    assert_eq!(displacement.regime.label, Regime::StableAccelerating);
    assert!(m(velocity) < 1.0 && m(displacement) < 1.0);
}

#[test]
fn of_synthetic_displacements_m_below_one_is_recovered_and_m_is_not() {
    let kind = crate::synthetic::KINDS[2];
    let study = crate::synthetic::study(Quantity::Displacement, kind, SYNTHETICS).unwrap();
    assert!(study.share(|draw| draw.m < 1.0) >= 0.9);
    assert!(study.share(|draw| draw.probability_below_one > 0.5) >= 0.9);
    assert!(study.share(|draw| (draw.m - crate::synthetic::M).abs() <= 0.05) <= 0.7);
    let spread = study.quantile(0.95, |draw| draw.m) - study.quantile(0.05, |draw| draw.m);
    assert!(spread > 0.3, "{spread}");
}

/// Median widths of the interval of m where slip does not scatter and where it scatters by 30 %.
fn widths_of_m() -> (f64, f64) {
    let width = |kind: crate::synthetic::SyntheticKind| {
        let study = crate::synthetic::study(Quantity::Displacement, kind, SYNTHETICS).unwrap();
        study.quantile(0.5, |draw| draw.interval.1 - draw.interval.0)
    };
    let [still, .., wild] = crate::synthetic::KINDS;
    (width(still), width(wild))
}

#[test]
fn the_more_the_slip_scatters_the_wider_the_interval_of_m() {
    let (narrow, wide) = widths_of_m();
    assert!(narrow < 0.15 && wide > 4.0 * narrow, "{narrow} {wide}");
}

#[test]
fn the_synthetic_series_inflect_when_they_are_said_to_and_are_the_same_each_time() {
    for kind in crate::synthetic::KINDS {
        let law = crate::synthetic::law(kind.inflection_years).unwrap();
        let years = law.transition_days().unwrap() / 365.25;
        assert!((years - kind.inflection_years).abs() < 1e-9, "{years}");
        let paper = law.paper();
        assert!((paper.m - crate::synthetic::M).abs() < 1e-12);
        assert!((paper.x_i.unwrap() - crate::synthetic::X_I).abs() < 1e-9);
    }
    let twice =
        || crate::synthetic::study(Quantity::Velocity, crate::synthetic::KINDS[3], 2).unwrap();
    assert_eq!(twice().draws, twice().draws);
    assert_ne!(twice().draws[0], twice().draws[1]);
}

#[test]
fn the_regimes_fail_slow_down_or_settle_as_their_curves_are_named() {
    for column in crate::regimes::columns().unwrap() {
        for curve in &column.curves {
            let at = |index: usize| curve.instants[index];
            let (first, last) = (at(0), at(curve.instants.len() - 1));
            let name = format!("{}, {}", column.title, curve.name);
            if name.ends_with("fails") {
                assert!(last.velocity > 1e3 * first.velocity, "{name}");
                assert!(last.state < 0.01 * first.state, "{name}");
            } else if name.ends_with("slows on") {
                assert!(last.velocity < 0.8 * first.velocity, "{name}");
            } else {
                let rises = first.velocity < 1.0;
                assert_eq!(rises, name.ends_with("rises to D"), "{name}");
                assert!((last.velocity - 1.0).abs() < 0.05, "{name}");
            }
        }
    }
}

#[test]
fn a_figure_is_whole_on_white_with_its_axes_named_and_no_number_missing() {
    for (name, svg) in figures() {
        assert!(
            svg.starts_with("<svg ") && svg.ends_with("</svg>\n"),
            "{name}"
        );
        assert!(svg.contains(r##"fill="#ffffff"/>"##), "{name}");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{name}");
        let is_plot_of_time = ["time / T", "days from", "year", "series, in"];
        assert!(
            is_plot_of_time.iter().any(|label| svg.contains(label)),
            "{name}"
        );
        if !["regimes", "synthetic"].contains(&name) {
            assert!(svg.contains("(reconstruction)"), "{name}");
        }
    }
    assert_eq!(figures(), figures());
}

#[test]
fn every_table_and_figure_of_a_reconstruction_says_so() {
    let text = crate::document::text(&STUDIES).unwrap();
    assert!(!text.contains("NaN"));
    for section in text.split("\n## ").skip(1) {
        let title = section.lines().next().unwrap();
        let tables = section.matches("|---|").count();
        let pictures = section.matches("](seed/").count();
        let labels = section.matches("Reconstruction").count();
        let is_of_recordings = title.contains("Vaiont")
            || title.contains("La Clapière")
            || title.starts_with("Displacement against");
        if is_of_recordings {
            let tables = section
                .lines()
                .filter(|line| line.starts_with("|---"))
                .count();
            assert!(tables > 0 && labels >= tables + pictures, "{title}");
        } else {
            assert!(tables == 0 || section.contains("reconstruction"), "{title}");
        }
    }
}

#[test]
fn the_document_gives_the_verdicts_that_its_studies_give_and_shows_figures_that_are_there() {
    let text = std::fs::read_to_string(docs().join("seed.md")).unwrap();
    for claim in claims(&STUDIES).unwrap() {
        let start = format!("| {} |", claim.paper);
        let row = text.lines().find(|line| line.starts_with(&start));
        let row = row.unwrap_or_else(|| panic!("no row: {}", claim.paper));
        let said = row.ends_with("| agrees |");
        assert!(
            claim.readings == Readings::Synthetic || said == claim.agrees,
            "run `cargo run --release -p studies --bin seed` again: {row}"
        );
    }
    for (name, _) in figures() {
        assert!(text.contains(&format!("](seed/{name}.svg)")), "{name}");
        assert!(docs().join("seed").join(format!("{name}.svg")).exists());
    }
}
