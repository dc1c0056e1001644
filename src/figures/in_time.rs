//! What has a date along its axis: readings and fits, residuals, contributions, loads.

use super::{Picture, day};
use crate::effects::{Effect, Explanation, Structure};
use crate::plot::{Axis, BLACK, BLUE, Figure, GREEN, GREY, Legend, Mark, PURPLE, Panel, RED};
use crate::reading::HALF_WIDTH_90;

/// Size of a panel, in the sheet's units.
const PANEL: (f64, f64) = (920.0, 230.0);
/// The readings have more to show.
const TALL: (f64, f64) = (920.0, 360.0);
const DASHED: &str = "6 4";
const DOTTED: &str = "2 3";
/// More points than this no sheet can show.
const MOST_POINTS: usize = 1600;

/// Readings, both fits, and what the fits without the held-out block say of it.
pub(super) fn readings(explanation: &Explanation) -> Option<Picture> {
    let curves = &explanation.curves;
    let measured = points(explanation, &curves.readings)?;
    let mut marks = behind(explanation);
    marks.push((
        "readings".to_owned(),
        dots(thinned(measured.clone()), GREY, 2.4),
    ));
    let fits = [
        ("before", &curves.before, RED, ""),
        ("after", &curves.after, BLUE, ""),
        ("held out", &curves.before_held_out, RED, DASHED),
        ("held out", &curves.after_held_out, BLUE, DASHED),
    ];
    let mut shown: Vec<f64> = curves.readings.clone();
    for (name, values, colour, dash) in fits {
        let Some(mut fit) = points(explanation, values) else {
            continue;
        };
        if dash == DASHED {
            let from = explanation.error.held_out_from.map_or(f64::INFINITY, day);
            fit.retain(|point| point.0 >= from);
        }
        shown.extend(fit.iter().map(|point| point.1));
        marks.push((name.to_owned(), line(thinned(fit), colour, dash)));
    }
    let panel = Panel {
        title: format!("{}: readings and fits", explanation.benchmark),
        x: dates(&measured),
        y: bounded(&unit_label(explanation), &curves.readings, &shown),
        marks,
        legend: Legend::Above,
    };
    let caption = "Readings, the law under a constant load (before) and with the effects (after). \
                   Dashed: the same fitted without the shaded block at the end, which was held out.";
    Some(picture("readings", caption, TALL, vec![panel]))
}

/// Readings less fit, before and after, on one scale.
pub(super) fn residual(explanation: &Explanation) -> Option<Picture> {
    let curves = &explanation.curves;
    let less = |fit: &[f64]| -> Vec<f64> {
        let pairs = curves.readings.iter().zip(fit);
        pairs.map(|(reading, fit)| reading - fit).collect()
    };
    let both = [
        ("before", less(&curves.before), RED),
        ("after", less(&curves.after), BLUE),
    ];
    let all = both.iter().flat_map(|one| one.1.iter().copied());
    let y = Axis::around(&unit_label(explanation), all);
    let mut panels = Vec::new();
    for (name, values, colour) in &both {
        let points = points(explanation, values)?;
        let mut marks = behind(explanation);
        let x = dates(&points);
        marks.push((String::new(), zero(&x)));
        marks.push((String::new(), dots(thinned(points), colour, 1.8)));
        panels.push(Panel {
            title: format!("{}: residual {name} the effects", explanation.benchmark),
            x,
            y: y.clone(),
            marks,
            legend: Legend::Above,
        });
    }
    let caption = "Readings less fit, before and after, on one scale.";
    Some(picture("residual", caption, PANEL, panels))
}

/// What each effect adds to the prediction, and to the log-load where it acts there.
pub(super) fn contributions(explanation: &Explanation) -> Option<Picture> {
    let curves = &explanation.curves;
    let unit = unit_label(explanation);
    let of_the_reading = curves
        .contributions
        .iter()
        .map(|one| ("in the reading", unit.as_str(), one, BLUE));
    let of_the_load = curves
        .log_loads
        .iter()
        .map(|one| ("in the log-load", "e-folds of velocity", one, GREEN));
    let mut panels = Vec::new();
    for (where_, label, (name, values), colour) in of_the_reading.chain(of_the_load) {
        let Some(points) = points(explanation, values) else {
            continue;
        };
        let x = dates(&points);
        let mut marks = behind(explanation);
        marks.push((String::new(), zero(&x)));
        marks.push((String::new(), line(thinned(points), colour, "")));
        panels.push(Panel {
            title: format!("{name}: {where_}"),
            x,
            y: Axis::around(label, values.iter().copied()),
            marks,
            legend: Legend::Above,
        });
    }
    let caption = "What each effect adds: to the prediction in the unit of the readings, and to the \
                   log-load where it acts there (one e-fold multiplies the velocity by 2.72).";
    (!panels.is_empty()).then(|| picture("contributions", caption, PANEL, panels))
}

/// The posterior of the load that nobody declared, before and after.
pub(super) fn undeclared_load(explanation: &Explanation) -> Option<Picture> {
    let curves = &explanation.curves;
    // What is left over after the effects is marked.
    let left = left_over(&explanation.residual.structure);
    let both = [
        ("before", &curves.load_before, RED, None),
        ("after", &curves.load_after, BLUE, Some(left)),
    ];
    let edges = |&(mean, sd): &(f64, f64)| [mean - HALF_WIDTH_90 * sd, mean + HALF_WIDTH_90 * sd];
    let all = both.iter().flat_map(|one| one.1.iter().flat_map(edges));
    let y = Axis::around("e-folds of velocity", all);
    let mut panels = Vec::new();
    for (name, load, colour, left) in both {
        let mean: Vec<f64> = load.iter().map(|one| one.0).collect();
        let Some(middle) = points(explanation, &mean) else {
            continue;
        };
        let x = dates(&middle);
        let days = curves.times.iter().map(|time| day(*time));
        let band = days.zip(load).map(|(day, one)| {
            let [low, high] = edges(one);
            (day, low, high)
        });
        let mut marks = behind(explanation);
        marks.extend(left.into_iter().flatten());
        let band = Mark::Band {
            points: every_few(band.collect()),
            colour,
        };
        marks.push(("90 %".to_owned(), band));
        marks.push((String::new(), zero(&x)));
        marks.push(("mean".to_owned(), line(every_few(middle), colour, "")));
        panels.push(Panel {
            title: format!("undeclared log-load {name}"),
            x,
            y: y.clone(),
            marks,
            legend: Legend::Above,
        });
    }
    let caption = "The load that nobody declared, as the readings show it, before and after: \
                   the residual in the law's own terms.";
    (!panels.is_empty()).then(|| picture("undeclared-load", caption, PANEL, panels))
}

fn picture(name: &'static str, caption: &str, panel: (f64, f64), panels: Vec<Panel>) -> Picture {
    let figure = Figure {
        description: caption.to_owned(),
        columns: 1,
        panel,
        panels,
    };
    Picture {
        name,
        caption: caption.to_owned(),
        svg: figure.named(name),
    }
}

/// What stands behind the data: the held-out block, the faults, the effects that have a time.
fn behind(explanation: &Explanation) -> Vec<(String, Mark)> {
    let mut marks = Vec::new();
    let last = explanation.curves.times.last();
    if let (Some(from), Some(last)) = (explanation.error.held_out_from, last) {
        let block = Mark::Shade {
            from: day(from),
            to: day(*last),
            colour: GREY,
        };
        marks.push((String::new(), block));
    }
    let faults = explanation.faults.iter().map(|fault| day(fault.at));
    let effects = explanation
        .effects()
        .filter_map(|effect: &Effect| effect.at.map(day));
    let uprights = [
        ("fault", faults.collect::<Vec<_>>(), PURPLE, DOTTED),
        ("effect", effects.collect(), GREEN, DASHED),
    ];
    for (name, at, colour, dash) in uprights {
        if !at.is_empty() {
            marks.push((name.to_owned(), Mark::Uprights { at, colour, dash }));
        }
    }
    marks
}

/// The stretches in which structure is left; one name for all of them.
fn left_over(structure: &[Structure]) -> Vec<(String, Mark)> {
    let named = ["structure left"].into_iter().chain(std::iter::repeat(""));
    let stretches = structure.iter().zip(named).map(|(stretch, name)| {
        let shade = Mark::Shade {
            from: day(stretch.from),
            to: day(stretch.until),
            colour: RED,
        };
        (name.to_owned(), shade)
    });
    stretches.collect()
}

/// Days and values; `None` where a value is missing for a time, or there are none.
fn points(explanation: &Explanation, values: &[f64]) -> Option<Vec<(f64, f64)>> {
    let times = &explanation.curves.times;
    if times.is_empty() || times.len() != values.len() {
        return None;
    }
    let points = times
        .iter()
        .map(|time| day(*time))
        .zip(values.iter().copied());
    let points: Vec<_> = points.filter(|point| point.1.is_finite()).collect();
    (!points.is_empty()).then_some(points)
}

fn dates(points: &[(f64, f64)]) -> Axis {
    let days = Axis::around("", points.iter().map(|point| point.0));
    Axis::dates("", days.from, days.to)
}

/// An axis that shows all readings, and of what else is shown no more than as much again on either
/// side: a fit that grows far beyond its data would press the data flat.
fn bounded(label: &str, readings: &[f64], shown: &[f64]) -> Axis {
    let core = Axis::around(label, readings.iter().copied());
    let span = core.to - core.from;
    let near = shown
        .iter()
        .map(|value| value.clamp(core.from - span, core.to + span));
    Axis::around(label, near)
}

fn unit_label(explanation: &Explanation) -> String {
    format!("{}, {}", explanation.quantity, explanation.unit)
}

pub(super) fn line(points: Vec<(f64, f64)>, colour: &'static str, dash: &'static str) -> Mark {
    Mark::Line {
        points,
        colour,
        dash,
    }
}

pub(super) fn dots(points: Vec<(f64, f64)>, colour: &'static str, radius: f64) -> Mark {
    Mark::Dots {
        points,
        colour,
        radius,
    }
}

fn zero(x: &Axis) -> Mark {
    line(vec![(x.from, 0.0), (x.to, 0.0)], BLACK, "1 3")
}

/// As many points as a sheet can show: of each run of neighbours the lowest and the highest.
pub(super) fn thinned(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    if points.len() <= MOST_POINTS {
        return points;
    }
    let run = (2 * points.len()).div_ceil(MOST_POINTS);
    let mut thin = Vec::new();
    for run in points.chunks(run) {
        let lower = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let ends = [run.iter().min_by(lower), run.iter().max_by(lower)];
        let mut ends: Vec<_> = ends.into_iter().flatten().copied().collect();
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        thin.extend(ends);
    }
    thin
}

/// The same for what is smooth: one of each run of neighbours.
pub(super) fn every_few<T: Copy>(points: Vec<T>) -> Vec<T> {
    let run = points.len().div_ceil(MOST_POINTS).max(1);
    let last = points.len().saturating_sub(1);
    let kept = points.into_iter().enumerate();
    kept.filter(|(index, _)| index % run == 0 || *index == last)
        .map(|(_, point)| point)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_a_spike() {
        let mut points: Vec<_> = (0..10_000).map(|x| (f64::from(x), 0.0)).collect();
        points[7_777].1 = 5.0;
        let thin = thinned(points);
        assert!(thin.len() <= MOST_POINTS + 2, "{}", thin.len());
        assert!(thin.contains(&(7777.0, 5.0)));
        assert!(thin.windows(2).all(|pair| pair[0].0 <= pair[1].0));
    }

    #[test]
    fn a_fit_that_runs_away_leaves_the_readings_a_third_of_the_panel() {
        let axis = bounded("mm", &[0.0, 10.0], &[0.0, 10.0, 1e9, f64::NAN]);
        assert!(10.0 / (axis.to - axis.from) > 0.3, "{axis:?}");
    }
}
