//! Solving a law again, reading it, and following it under a load allocate nothing.

use allocation_counter::measure;
use slipwatch::model::{Accuracy, Law, Load, LoadedLaw, Trajectory};

/// One of every kind: to failure, for ever slower, relaxing from far and from near, and at m = 1.
fn laws() -> Vec<Law> {
    let mut laws: Vec<Law> = [
        (1.35, 0.6),
        (1.35, 2.0),
        (0.98, 39.0),
        (0.5, 1.001),
        (-1.0, 3.0),
    ]
    .iter()
    .map(|(m, x_i)| Law::from_paper(*m, *x_i, 1.0, 1.0).unwrap())
    .collect();
    laws.push(Law::at_unit_m(1.5, 2.0, 3.0).unwrap());
    laws
}

#[test]
fn the_counter_counts() {
    let counted = measure(|| drop(std::hint::black_box(vec![0.0; 100])));
    assert!(counted.count_total > 0);
}

#[test]
fn solving_again_and_reading_allocates_nothing() {
    let laws = laws();
    for accuracy in [Accuracy::Fit, Accuracy::Full] {
        let mut solution = Trajectory::solve(&laws[0], 1.0, accuracy);
        // Once over all of them, to take the room that the longest needs.
        for law in &laws {
            solution.solve_again(law, 50.0, accuracy);
        }
        let mut read = 0;
        let counted = measure(|| {
            for law in &laws {
                solution.solve_again(law, 50.0, accuracy);
                for step in 0..100 {
                    let t = 0.5 * f64::from(step);
                    read += usize::from(solution.at(t).is_some());
                }
                read += usize::from(solution.failure_days().is_some());
                read += usize::from(law.days_to_velocity(1e3).is_some());
            }
        });
        assert!(read > 300, "{read} motions");
        assert_eq!(counted.count_total, 0, "{accuracy:?}");
    }
}

#[test]
fn following_a_load_allocates_nothing() {
    let knots = (0..200).map(|k| (f64::from(k) * 0.25, f64::from(k % 7) * 0.1));
    let load = Load::new(knots.collect()).unwrap();
    let times: Vec<f64> = (0..100).map(|k| f64::from(k) * 0.5).collect();
    let mut motions = vec![None; times.len()];
    let mut read = 0;
    let laws = laws();
    let counted = measure(|| {
        for law in &laws {
            let loaded = LoadedLaw::new(law, &load, Accuracy::Fit).unwrap();
            loaded.motions(&times, &mut motions);
            read += motions.iter().flatten().count();
            read += usize::from(loaded.failure_days(50.0).is_some());
            read += usize::from(loaded.days_to_velocity(1e3, 50.0).is_some());
        }
    });
    assert!(read > 300, "{read} motions");
    assert_eq!(counted.count_total, 0);
}
