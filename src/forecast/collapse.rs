//! The time of collapse: how likely it is within each span, by what the slope showed over multiples of that span.
//!
//! One small network gives the chance of a collapse within the span of a scale of [`Scales`] from the motion at that
//! scale and those around it, in ratios, so that minutes and months are judged alike. It was taught by simulated
//! slopes that fail and stand in many ways ([`super::world`]); its weights are in [`super::learned`]. What it says counts as far as the
//! slope is sure to accelerate at all ([`super::evidence`]); of the rest a small part is left, so that nothing is
//! called impossible.

use super::evidence;
use super::learned::LEARNED;
use super::network::Network;
use super::{Passage, Scale, Scales};
use crate::fit::Observations;

/// Numbers that the network is given of one span.
pub const INPUTS: usize = 47;
/// Spans beyond the longest scale that are still asked for, and the longest span, days.
const BEYOND: usize = 3;
const LONGEST_DAYS: f64 = 1200.0;
/// The share of the network's chance that is left where no acceleration shows, over long spans, and the span, days, at
/// which half of that is reached: within days nothing is called that the readings do not show.
const UNSEEN: f64 = 0.15;
const UNSEEN_DAYS: f64 = 4.0;
/// Steps of the distribution in one doubling of time.
const STEPS: u32 = 8;
/// The median velocity, mm/day, last read before a collapse (30 failures, Federico et al. 2012).
const LAST_VELOCITY: f64 = 93.0;
/// A slope whose newest velocity is under this share of its velocity over a span is the less likely to collapse within
/// the span: set with Century Mine 40-1938 in view, which jumped by 231 mm and lay still.
const SLOWED: f64 = 0.5;
/// Inputs lie between plus and minus this.
const MOST: f64 = 3.0;

/// When a slope is expected to collapse.
#[derive(Debug, Clone, PartialEq)]
pub struct Collapse {
    /// Days to it from the newest reading.
    pub passage: Passage,
    /// Probability that the slope accelerates, against steady motion under its usual fluctuations.
    pub accelerating: f64,
    /// Median of the newest spans between readings, days.
    pub interval_days: f64,
}

impl Collapse {
    /// What `observations` give; `None` with too few of them.
    pub fn of(observations: &Observations) -> Option<Self> {
        Self::by(&LEARNED, observations)
    }

    /// The same by another network.
    pub fn by(network: &Network, observations: &Observations) -> Option<Self> {
        let scales = Scales::of(observations)?;
        let ln_odds = evidence::ln_odds(observations, &scales);
        let accelerating = evidence::probability(ln_odds);
        let mut reached = 0.0_f64;
        let within = spans(&scales).map(|(power, days)| {
            let counts = accelerating + (1.0 - accelerating) * UNSEEN * days / (days + UNSEEN_DAYS);
            let chance = network.chance(&inputs(&scales, ln_odds, power));
            reached = reached.max(counts * chance * goes_on(&scales, power));
            (days, reached)
        });
        let within: Vec<(f64, f64)> = within.collect();
        Some(Self {
            passage: passage(&within, scales.centred_before_days),
            accelerating,
            interval_days: scales.interval_days,
        })
    }
}

/// The share of the chance within the span of scale `power` that is left to a slope that has slowed since.
fn goes_on(scales: &Scales, power: usize) -> f64 {
    let view = View::at(scales, power);
    let ratio = (view.ln_velocity(-view.span) - view.ln_velocity(0)).exp();
    (ratio / SLOWED).min(1.0)
}

/// The inputs of every span of `observations` with its length, days: what the network learns from. `None` with too few
/// observations.
pub fn questions(observations: &Observations) -> Option<Vec<(f64, [f64; INPUTS])>> {
    let scales = Scales::of(observations)?;
    let ln_odds = evidence::ln_odds(observations, &scales);
    let each = spans(&scales).map(|(power, days)| (days, inputs(&scales, ln_odds, power)));
    Some(each.collect())
}

fn spans(scales: &Scales) -> impl Iterator<Item = (usize, f64)> {
    let base = scales.base_days;
    let doubled = (0..scales.each.len() + BEYOND).scan(base, |days, power| {
        let this = *days;
        *days *= 2.0;
        Some((power, this))
    });
    doubled.take_while(|(_, days)| *days <= LONGEST_DAYS)
}

/// From (days, chance within them), counted from where the newest velocity is centred; between two of them the chance
/// grows evenly with ln of time, before the first with time.
fn passage(within: &[(f64, f64)], centred_before_days: f64) -> Passage {
    let mut times = Vec::new();
    let mut add =
        |days: f64, share: f64| times.push(((days - centred_before_days).max(0.0), share));
    let steps = f64::from(STEPS);
    if let Some((days, chance)) = within.first() {
        for step in 0..STEPS {
            add(days * (f64::from(step) + 0.5) / steps, chance / steps);
        }
    }
    for pair in within.windows(2) {
        let ((from, before), (to, chance)) = (pair[0], pair[1]);
        for step in 0..STEPS {
            let way = (f64::from(step) + 0.5) / steps;
            add(from * (to / from).powf(way), (chance - before) / steps);
        }
    }
    Passage::from_times(times)
}

/// What is seen from the scale of one span.
struct View<'a> {
    scales: &'a Scales,
    span: i64,
    longest: i64,
}

impl<'a> View<'a> {
    fn at(scales: &'a Scales, power: usize) -> Self {
        Self {
            scales,
            span: i64::try_from(power).unwrap_or(i64::MAX),
            longest: i64::try_from(scales.each.len()).unwrap_or(i64::MAX) - 1,
        }
    }

    /// The scale so many doublings longer than the span, or the nearest that there is.
    fn scale(&self, longer: i64) -> &Scale {
        let at = (self.span + longer).clamp(0, self.longest);
        &self.scales.each[usize::try_from(at).unwrap_or(0)]
    }

    /// ln of the newest velocity there, mm/day.
    fn ln_velocity(&self, longer: i64) -> f64 {
        let scale = self.scale(longer);
        ln_above(scale.velocity, error(scale))
    }
}

/// The usual error of a velocity, mm/day.
fn error(scale: &Scale) -> f64 {
    scale.near.usual / scale.days
}

/// ln of a value that may be under its error: half of v + sqrt(v^2 + 4 s^2).
fn ln_above(value: f64, error: f64) -> f64 {
    (0.5 * (value + value.hypot(2.0 * error))).max(1e-12).ln()
}

/// What the chance of a collapse within the span of scale `power`, which may lie beyond the scales, rests on.
fn inputs(scales: &Scales, ln_odds: f64, power: usize) -> [f64; INPUTS] {
    let view = View::at(scales, power);
    let mut inputs = Vec::with_capacity(INPUTS);
    inputs.push(1.0);
    motion(&view, &mut inputs);
    novelty(&view, &mut inputs);
    setting(&view, ln_odds, &mut inputs);
    let mut all = [0.0; INPUTS];
    for (slot, value) in all.iter_mut().zip(inputs) {
        *slot = if value.is_finite() { value } else { 0.0 };
    }
    all
}

/// How the velocity grows from scale to scale, and its changes against the usual ones.
fn motion(view: &View<'_>, inputs: &mut Vec<f64>) {
    let bounded = |value: f64| value.clamp(-MOST, MOST);
    for longer in -5..3 {
        inputs.push(bounded(
            view.ln_velocity(longer) - view.ln_velocity(longer + 1),
        ));
    }
    for longer in -5..4 {
        let near = view.scale(longer).near;
        inputs.push(bounded(0.4 * (near.newest / near.usual).asinh()));
    }
    for longer in [-4, -2, 0, 2] {
        let far = view.scale(longer).far;
        inputs.push(bounded(0.4 * (far.newest / far.usual).asinh()));
    }
    for longer in [-4, -2, 0, 2] {
        let scale = view.scale(longer);
        inputs.push(bounded(0.3 * (scale.velocity / error(scale)).asinh()));
    }
}

/// How the newest motion compares with all that the record showed before.
fn novelty(view: &View<'_>, inputs: &mut Vec<f64>) {
    let bounded = |value: f64| value.clamp(-MOST, MOST);
    for longer in [-4, -2, -1, 0, 2] {
        let scale = view.scale(longer);
        let before = ln_above(scale.highest_velocity, error(scale));
        inputs.push(bounded(view.ln_velocity(longer) - before));
    }
    for longer in [-4, -2, 0, 1] {
        let near = view.scale(longer).near;
        let before = ln_above(near.largest, near.usual);
        inputs.push(bounded(0.5 * (ln_above(near.newest, near.usual) - before)));
    }
    for longer in [-2, 0] {
        let scale = view.scale(longer);
        let median = ln_above(scale.median_velocity, error(scale));
        inputs.push(bounded(0.5 * (view.ln_velocity(longer) - median)));
    }
}

/// Where the span stands between the sampling and the record, how fast the slope is, and what else there is.
fn setting(view: &View<'_>, ln_odds: f64, inputs: &mut Vec<f64>) {
    let scales = view.scales;
    inputs.push(0.2 * view.span.min(5) as f64);
    inputs.push(0.3 * (view.longest - view.span).clamp(-5, 4) as f64);
    for longer in [0, -4] {
        let faster = view.ln_velocity(longer) - LAST_VELOCITY.ln();
        inputs.push(0.3 * (0.5 * faster).clamp(-5.0, 5.0));
    }
    inputs.push(view.scale(0).jump);
    inputs.push(view.scale(-2).jump);
    inputs.push((0.2 * ln_odds).clamp(-MOST, MOST));
    inputs.push(0.1 * (view.longest + 1) as f64);
    let span = scales.base_days.ln() + std::f64::consts::LN_2 * view.span as f64;
    inputs.push(0.3 * span.clamp(-4.0, 4.0));
    inputs.push(0.4 * scales.length_days.max(1e-6).ln().clamp(-3.0, 6.0));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Observation;
    use crate::reading::Quantity;

    fn readings(count: u32, interval: f64, at: impl Fn(f64) -> f64) -> Observations {
        let values = (0..count).map(|index| {
            let t_days = interval * f64::from(index);
            Observation {
                t_days,
                value: at(t_days),
                sigma: None,
            }
        });
        Observations {
            quantity: Quantity::Displacement,
            averaging_days: 0.0,
            values: values.collect(),
        }
    }

    #[test]
    fn every_input_has_its_place() {
        let scales = Scales::of(&readings(400, 0.25, |t| t)).unwrap();
        let view = View {
            scales: &scales,
            span: 3,
            longest: 5,
        };
        let mut all = vec![1.0];
        motion(&view, &mut all);
        novelty(&view, &mut all);
        setting(&view, 0.0, &mut all);
        assert_eq!(all.len(), INPUTS);
    }

    #[test]
    fn a_line_in_inverse_velocity_collapses_about_where_it_meets_zero_and_a_straight_line_does_not()
    {
        let failing = readings(190, 0.5, |t| -60.0 * (1.0 - t / 100.0).ln());
        let found = Collapse::of(&failing).unwrap();
        let median = found.passage.quantile(0.5, 400.0).unwrap();
        assert!((2.5..11.0).contains(&median), "{median}");
        let steady = Collapse::of(&readings(190, 0.5, |t| 12.0 * t)).unwrap();
        assert!(steady.passage.chance_within(30.0) < 0.1, "{steady:?}");
        assert!(steady.passage.chance_within(1.0) < 0.02, "{steady:?}");
    }

    #[test]
    fn chances_grow_with_the_span_and_never_pass_one() {
        let failing = readings(190, 0.5, |t| -60.0 * (1.0 - t / 96.0).ln());
        let found = Collapse::of(&failing).unwrap();
        assert!(found.passage.times().iter().all(|(_, share)| *share >= 0.0));
        let all = found.passage.chance_within(f64::INFINITY);
        assert!(all > 0.5 && all <= 1.0, "{all}");
    }
}
