//! Readings, inverse velocity and the forecasts made at some dates, above the levels.

use super::levels;
use super::{Replayed, ReplayedRefit, WIDTH};
use crate::alert::chance_in_words;
use crate::figures::day;
use crate::figures::in_time::{dots, line, thinned};
use crate::fit::Rate;
use crate::forecast::InverseVelocityLine;
use crate::monitor::FailureTime;
use crate::plot::{Axis, BLACK, BLUE, GREY, Legend, Mark, PURPLE, Panel, Stack};
use crate::reading::{Quantity, Timestamp};

/// One for each date, and again from the beginning.
const COLOURS: [&str; 5] = [BLUE, PURPLE, "#8c5109", "#117777", "#444444"];
const DOTTED: &str = "2 3";
const READINGS: f64 = 150.0;
const INVERSE: f64 = 240.0;
const ROW: f64 = 30.0;
/// Where a row's bar stands in it, and its text, from below.
const BAR: f64 = 0.5;
/// The upright axis of inverse velocity holds all points in this last share of the record.
const HELD: f64 = 0.5;
/// A bound that is never reached lies off the sheet, so many lengths of the axis ahead.
const FAR: f64 = 20.0;

/// What was forecast at one date.
#[derive(Debug)]
struct Dated {
    date: Timestamp,
    colour: &'static str,
    refit: Option<ReplayedRefit>,
}

impl Replayed<'_> {
    /// The figure, one SVG text: the forecasts are those of the newest refit until each of `dates`.
    pub fn inverse_velocity(&self, dates: &[Timestamp]) -> String {
        let x = self.dates("");
        let colours = COLOURS.iter().cycle();
        let dated: Vec<Dated> = dates
            .iter()
            .zip(colours)
            .map(|(date, colour)| Dated {
                date: *date,
                colour,
                refit: self.refit_at(*date),
            })
            .collect();
        let mut panels = vec![
            (READINGS, self.readings_panel(&x, &dated)),
            (INVERSE, self.inverse_panel(&x, &dated)),
        ];
        if !dated.is_empty() {
            let height = ROW * dated.len() as f64;
            panels.push((height, self.forecasts_panel(&x, &dated)));
        }
        panels.push((levels::HEIGHT, levels::panel(self, &x)));
        let title = self.title("readings, forecasts and levels");
        Stack {
            description: format!(
                "{title}. Readings, inverse velocity with the forecasts as they were made, and the levels in force."
            ),
            title,
            width: WIDTH,
            panels,
        }
        .svg()
    }

    fn readings_panel(&self, x: &Axis, dated: &[Dated]) -> Panel {
        let factor = self.series.unit.factor();
        let readings = self.series.readings.iter();
        let points: Vec<(f64, f64)> = readings
            .map(|reading| (day(reading.time), reading.value * factor))
            .collect();
        let label = match self.series.quantity() {
            Quantity::Displacement => "displacement, mm",
            Quantity::Velocity => "velocity, mm/day",
        };
        let y = Axis::around(label, points.iter().map(|point| point.1));
        let points = thinned(points);
        let mut marks = uprights(dated);
        if let Some(first) = marks.first_mut() {
            "forecast made".clone_into(&mut first.0);
        }
        marks.push((String::new(), line(points.clone(), GREY, "")));
        marks.push(("reading".to_owned(), dots(points, BLACK, 2.2)));
        marks.extend(self.collapse_line());
        marks.extend(self.collapse.map(|collapse| {
            let word = Mark::Words {
                at: (day(collapse), 0.07f64.mul_add(y.to - y.from, y.from)),
                text: "collapse".to_owned(),
                colour: BLACK,
            };
            (String::new(), word)
        }));
        Panel {
            title: "readings".to_owned(),
            x: x.clone(),
            y,
            marks,
            legend: Legend::Above,
        }
    }

    fn inverse_panel(&self, x: &Axis, dated: &[Dated]) -> Panel {
        let rates = self.rates(self.span().unwrap_or_default().to);
        let forward = rates.iter().filter(|rate| rate.velocity > 0.0);
        let points: Vec<(f64, f64)> = forward
            .map(|rate| (rate.middle(), 1.0 / rate.velocity))
            .collect();
        let (start, end) = (self.start(), self.end());
        let top = highest(&points, end - HELD * (end - start));
        let mut marks = uprights(dated);
        let mut name = "line through the newest, to zero".to_owned();
        for one in dated {
            let Some(refit) = one.refit else { continue };
            if let Some(points) = straight(&self.rates(refit.time), &refit) {
                marks.push((std::mem::take(&mut name), line(points, one.colour, "6 3")));
            }
        }
        marks.push((
            "1 / mean velocity".to_owned(),
            dots(points.clone(), BLACK, 2.6),
        ));
        marks.extend(self.collapse_line());
        let above = points.iter().filter(|point| point.1 > top).count();
        let title = match above {
            0 => "inverse velocity".to_owned(),
            above => format!("inverse velocity ({above} points lie above)"),
        };
        Panel {
            title,
            x: x.clone(),
            y: Axis::linear("day/mm", 0.0, top),
            marks,
            legend: Legend::Above,
        }
    }

    fn forecasts_panel(&self, x: &Axis, dated: &[Dated]) -> Panel {
        let count = dated.len() as f64;
        let height = |index: usize| count - 1.0 - index as f64 + BAR;
        let rows = dated.iter().enumerate();
        let names = rows.map(|(index, one)| (height(index), self.short(one.date)));
        let y = Axis::named(0.0, count, names.collect());
        let mut marks = Vec::new();
        for (index, one) in dated.iter().enumerate() {
            marks.extend(self.row(one, index, height(index), x));
        }
        marks.extend(self.collapse_line());
        let horizon = dated.iter().find_map(|one| one.refit);
        let horizon = horizon.map_or_else(String::new, |refit| {
            let days = refit.failure_time.horizon_days;
            format!(", chance within {days:.0} days")
        });
        Panel {
            title: format!("forecast with the readings until then{horizon}"),
            x: x.clone(),
            y,
            marks,
            legend: Legend::Above,
        }
    }

    /// The marks of one forecast in its row, with their names in the first.
    fn row(&self, one: &Dated, index: usize, y: f64, x: &Axis) -> Vec<(String, Mark)> {
        let named = |name: &str| {
            if index == 0 {
                name.to_owned()
            } else {
                String::new()
            }
        };
        let colour = one.colour;
        let Some(refit) = one.refit else {
            let at = day(one.date);
            let text = "no forecast yet: too few readings".to_owned();
            return vec![(String::new(), beside((at, at), y, text, colour))];
        };
        let at = day(refit.time);
        let failure = refit.failure_time;
        let mut marks = vec![(named("made"), dots(vec![(at, y)], colour, 4.0))];
        let bar = failure.low.map(|low| (day(low), never(failure.high, x), y));
        marks.push((
            named("5 to 95 %"),
            Mark::Lying {
                spans: bar.into_iter().collect(),
                colour,
            },
        ));
        marks.push((
            named("median"),
            Mark::Strokes {
                points: failure
                    .median
                    .map(|time| (day(time), y))
                    .into_iter()
                    .collect(),
                colour,
            },
        ));
        let end = bar.map_or(at, |(_, high, _)| high);
        marks.push((
            String::new(),
            beside((at, end), y, self.described(&failure), colour),
        ));
        marks
    }

    /// A forecast in words.
    fn described(&self, failure: &FailureTime) -> String {
        let chance = format!("chance {}", chance_in_words(failure.probability));
        if failure.low.is_none() {
            return chance;
        }
        let bounds = [
            ("5 %", failure.low),
            ("median", failure.median),
            ("95 %", failure.high),
        ];
        let described = bounds.map(|(name, time)| match time {
            Some(time) => format!("{name} {}", self.short(time)),
            None => format!("{name} later"),
        });
        format!("{}; {chance}", described.join(", "))
    }
}

fn beside(span: (f64, f64), y: f64, text: String, colour: &'static str) -> Mark {
    Mark::Beside {
        span,
        y,
        text,
        colour,
    }
}

/// A day, or one far off the sheet for what is never reached.
fn never(time: Option<Timestamp>, x: &Axis) -> f64 {
    time.map_or(x.to + FAR * (x.to - x.from), day)
}

/// When the forecasts were made.
fn uprights(dated: &[Dated]) -> Vec<(String, Mark)> {
    let upright = |one: &Dated| {
        let made = Mark::Uprights {
            at: vec![day(one.refit.map_or(one.date, |refit| refit.time))],
            colour: one.colour,
            dash: DOTTED,
        };
        (String::new(), made)
    };
    dated.iter().map(upright).collect()
}

/// The line of a refit, from the oldest of the velocities it goes through to zero; `None` where these rates do not
/// give the line that the monitor reported.
fn straight(rates: &[Rate], refit: &ReplayedRefit) -> Option<Vec<(f64, f64)>> {
    let zero = day(refit.intercept?);
    InverseVelocityLine::segment(InverseVelocityLine::newest(rates), zero).map(Vec::from)
}

/// The top of the axis: above the points of the record's last part, as the slow ones before would press them flat.
fn highest(points: &[(f64, f64)], from: f64) -> f64 {
    let late = points.iter().filter(|point| point.0 >= from);
    let late = late.map(|point| point.1).reduce(f64::max);
    let any = points.iter().map(|point| point.1).reduce(f64::max);
    1.15 * late.or(any).unwrap_or(1.0)
}
