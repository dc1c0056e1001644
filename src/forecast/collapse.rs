//! The time of collapse: how likely it is within each span, by what the slope showed over multiples of that span.
//!
//! One small network gives the chance of a collapse within the span of a scale of [`Scales`] from the motion at that
//! scale and those around it, in ratios, so that minutes and months are judged alike, and from what others expect
//! ([`Members`]): the law, and straight lines through inverse velocity. It was trained on simulated slopes that fail and
//! stand in many ways (`studies/src/world`); its weights are in [`super::learned`]. That is what is reported as chances. The time that
//! is reported is put sooner, and levels go by less: what it says counts for them as far as it is not unlikely that the slope accelerates at all ([`super::evidence`]), because
//! they are asked at every reading; of the rest a small part is left, so that nothing is called impossible.

use super::evidence::{self, Evidence};
use super::held_step;
use super::learned::LEARNED;
use super::members::{LARGEST_INPUT, LONGEST_DAYS, Members};
use super::network::{INPUTS, Network};
use super::spans::{
    AskedSpan, FAR_APART_DAYS, FIRST_SPANS, at_least, between_far_readings, passage, spans,
};
use super::sudden::slowed;
use super::{Passage, PastEvent, Scale, Scales};
use crate::fit::Observations;

/// The share of the network's chance that is left where no acceleration shows, over long spans, and the span, days, at
/// which half of that is reached: within days nothing is called that the readings do not show.
const UNSEEN: f64 = 0.15;
const UNSEEN_DAYS: f64 = 4.0;
/// The probability of an acceleration at which half of the chance within days counts for levels, and the days; over longer
/// spans the probability itself is the factor. Set on simulated slopes: where it was that within days too, red came late to
/// slopes that their noise hides for long; where it was not over a month, steady creep was orange. At as many reds on those that
/// stand, .02 calls one in a hundred collapses fewer in time, and .001 one more, but rules hardly anything out.
const NOT_UNLIKELY: f64 = 0.006;
const NEAR_DAYS: f64 = 6.0;
/// The median velocity, mm/day, last read before a collapse (30 failures, Federico et al. 2012).
const LAST_VELOCITY: f64 = 93.0;
/// A slope whose newest velocity is under this share of its velocity over a span is the less likely to collapse within the
/// span: set with Century Mine in view, where 40-1938 jumped by 231 mm and lay still.
const SLOWED: f64 = 0.5;
/// The same where the velocity over the span is under the highest before, which the slope survived: the power of their
/// ratio. Set on simulated slopes: storms, thaws and fits of stick-slip repeat, and a collapse is mostly faster than all
/// before it.
const SURVIVED: i32 = 2;
/// At this chance that the slope does not accelerate what is taken off a chance for either counts by its root; where it surely accelerates nothing is
/// taken off, as the first burst belongs to the same crisis. Set on drawn shapes of failure under measured noise: of 72, four more were red a day before, and of as
/// many that stand no more.
const ALL_BUT_SURE: f64 = 0.01;
/// A slope at this velocity, mm/day, or under it, is the less likely to collapse within a span: the slowest of 30 slopes that collapsed was
/// last read at .475 mm/day (Federico et al. 2012).
const SLOW: f64 = 0.25;
/// The same however sure it is that it accelerates.
const STILL: f64 = 0.1;
/// Over how many shorter scales the growth of the velocity is looked for.
const GROWN_SCALES: usize = 10;
/// How far the growth of a slope that runs up departs from a straight line in inverse velocity, and what is left of the chance
/// that is reported where the velocity has stopped growing and it is not sure that the slope accelerates; and the most, ln, that
/// one scale can speak for growth.
const UNEVEN: f64 = 0.4;
const STEADY: f64 = 0.1;
const ONE_SCALE: f64 = 3.0;
/// The power of the odds of the chances within each time where a collapse is sure to come, and ln of their factor. Families of
/// simulated slopes on which a network was not trained collapse sooner than it says, and less surely when it says (docs/families.md);
/// chosen on these, with the measured series in view.
const SPREAD: f64 = 0.85;
const SOONER: f64 = 1.2;
/// A chance under this calls nothing, and is not asked whether a step of the velocity makes it.
const WITH_STEP: f64 = 0.02;
/// The share of the chance by the readings since an event that counts for levels: most events are followed by others of their
/// kind. Set on simulated slopes: the whole of it calls a tenth more reds on those that stand.
const LATER: f64 = 0.6;
/// Readings since an event that are judged by themselves, at least and at most: the work is bounded.
const FEWEST_LATER: usize = 24;
const MOST_LATER: usize = 200_000;

/// When a slope is expected to collapse.
#[derive(Debug, Clone, PartialEq)]
pub struct Collapse {
    /// Days to it from the newest reading: whose quantiles are reported. It is put sooner than is expected: collapses come sooner than networks that never saw their kind expect.
    pub passage: Passage,
    /// The same as it is expected: whose chances come true. None is under that which levels go by, but where the law and straight lines
    /// through inverse velocity agree on another time.
    pub expected: Passage,
    /// The same as far as the slope is sure to accelerate: what levels go by.
    pub sure: Passage,
}

/// What motion itself shows, before anything is expected of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Indicators {
    scales: Scales,
    evidence: Evidence,
    /// The same of the readings since an event that stands out of all else: beside it no later acceleration would look like
    /// one. And the share of their chance that counts for levels.
    later: Option<(f64, Box<Self>)>,
    /// The same of the motion slowed down, where it is many times as fast as ever before.
    slower: Option<Box<(Self, Members)>>,
}

impl Indicators {
    /// Those of `observations`; `None` with too few of them.
    pub fn of(observations: &Observations) -> Option<Self> {
        let mut whole = Self::by(observations, Scales::of(observations)?);
        whole.later = whole.scales.disturbed.and_then(|event| {
            let later = newest(observations, event.days)?;
            let scales = Scales::at(&later, later.values.len())?;
            let later = Self::by(&later, scales);
            let share = LATER * event.share * as_fast_as(&event, &later.scales);
            Some((share, Box::new(later)))
        });
        whole.slower = slowed(observations).and_then(|slower| {
            let scales = Scales::of(&slower)?;
            Some(Box::new((Self::by(&slower, scales), Members::of(&slower))))
        });
        Some(whole)
    }

    fn by(observations: &Observations, scales: Scales) -> Self {
        Self {
            evidence: Evidence::of(observations, &scales),
            scales,
            later: None,
            slower: None,
        }
    }

    /// Probability that the slope accelerates, against steady motion under its usual fluctuations.
    pub fn accelerating(&self) -> f64 {
        let whole = evidence::probability(self.evidence.ln_odds());
        let later = self.later.as_ref();
        later.map_or(whole, |(share, later)| {
            whole.max(share * later.accelerating())
        })
    }

    /// From the newest reading to the next one, as the newest few spans have it, days.
    pub fn to_next_days(&self) -> f64 {
        self.scales.to_next_days
    }

    /// The most that levels may be given of a chance within `days`, whatever is expected.
    fn most(&self, days: f64) -> f64 {
        let accelerating = evidence::probability(self.evidence.ln_odds_within(days));
        let unlikely = NOT_UNLIKELY * (1.0 + (days / NEAR_DAYS).powi(4));
        let shown = accelerating * (1.0 + unlikely) / (accelerating + unlikely);
        shown + (1.0 - shown) * UNSEEN * days / (days + UNSEEN_DAYS)
    }

    /// Whether levels may be given a chance within `days` of at least `chance`, whatever is expected.
    pub fn may_reach(&self, days: f64, chance: f64) -> bool {
        let days = days + self.scales.centred_before_days;
        // Between two spans the chance grows to that of the longer one, before the shortest to that of it; where readings are days apart the first
        // ones go by a later one.
        let are_far = self.scales.base_days > FAR_APART_DAYS.0;
        let first = if are_far { FIRST_SPANS } else { 0 };
        let mut counted = spans(&self.scales)
            .take_while(|span| span.power <= first || span.days < 2.0 * days)
            .map(|span| self.most(span.days));
        let later = self.later.as_ref();
        counted.any(|most| most >= chance)
            || later.is_some_and(|(share, later)| later.may_reach(days, chance / share))
            || (self.slower.as_deref()).is_some_and(|(slower, _)| slower.may_reach(days, chance))
    }

    /// The inputs of every span with its length, days.
    pub fn questions(&self, members: &Members) -> Vec<(f64, [f64; INPUTS])> {
        let each = spans(&self.scales);
        each.map(|span| (span.days, self.inputs(members, span.power, span.days)))
            .collect()
    }

    /// When the slope is expected to collapse.
    pub fn collapse(&self, members: &Members) -> Collapse {
        self.collapse_by(&LEARNED, members)
    }

    /// The same by another network.
    pub fn collapse_by(&self, network: &Network, members: &Members) -> Collapse {
        let (mut all, mut sure) = self.chances_by(network, members);
        if let Some((slower, expected)) = self.slower.as_deref() {
            let (others, counted) = slower.chances_by(network, expected);
            at_least(&mut all, &others);
            sure = sure.at_least(&counted);
        }
        let sure = match &self.later {
            Some((share, later)) => {
                let (_, since) = later.chances_by(network, members);
                sure.at_least(&Passage::default().pooled(&since, *share))
            }
            None => sure,
        };
        let all = passage(&all, &members.law, self.scales.centred_before_days);
        let agreed = members.agreed();
        // A relation that puts the collapse later takes nothing from what levels go by: a slope collapses at a finite velocity, before that
        // relation ends. Straight lines that agree with the law end when slopes collapse.
        let least = Passage::default().pooled(&sure, 1.0 - agreed);
        let expected = members.timed(&all, agreed).at_least(&least);
        Collapse {
            passage: Self::sooner(&expected, members.is_timed(agreed)).at_least(&least),
            expected,
            sure,
        }
    }

    /// The chance within each span, (days, chance), and as much of it as levels go by.
    fn chances_by(&self, network: &Network, members: &Members) -> (Vec<(f64, f64)>, Passage) {
        let (mut reached, mut sure) = (0.0_f64, 0.0_f64);
        let (mut all, mut counted) = (Vec::new(), Vec::new());
        let accelerating = self.accelerating();
        for span in spans(&self.scales) {
            let AskedSpan { power, days, share } = span;
            let creeps = (1.0 - accelerating) * (1.0 - may_grow(&self.scales, power, days));
            let chance = network.chance(&self.inputs(members, power, days)) * (1.0 - creeps);
            reached += share * (chance - reached).max(0.0);
            let goes_on = goes_on(&self.scales, power, accelerating);
            let shown = self.with_step(power, days, self.most(days) * chance * goes_on);
            sure += share * (shown - sure).max(0.0);
            all.push((span.counts_within(), reached));
            counted.push((span.counts_within(), sure));
        }
        for chances in [&mut all, &mut counted] {
            between_far_readings(chances);
        }
        let centred = self.scales.centred_before_days;
        (all, passage(&counted, &members.law, centred))
    }

    /// `chance` within the span of scale `power`, less as far as the motion looks like a step of the velocity that holds.
    fn with_step(&self, power: usize, days: f64, chance: f64) -> f64 {
        if chance < WITH_STEP {
            return chance;
        }
        let courses = &self.scales.courses;
        let shorter = power.saturating_sub(held_step::DOUBLINGS);
        let Some(course) = courses.get(shorter).or(courses.last()) else {
            return chance;
        };
        let factor = held_step::ln_factor(course, days).exp();
        factor * chance / (1.0 - chance + factor * chance)
    }

    /// `passage` with the odds of each chance within a time by [`SPREAD`] and [`SOONER`], as far as it is likely that the slope
    /// collapses at all. Steady slopes keep theirs, and so do slopes on whose time of collapse law and lines agree, or that keep
    /// Voight's relation (`is_timed`, 0 to 1): put sooner, lines of inverse velocity that nothing bends came out at two thirds of
    /// the time that remained, and at four fifths without.
    fn sooner(passage: &Passage, is_timed: f64) -> Passage {
        let square = passage.chance_within(LONGEST_DAYS).powi(2);
        let counts = square / (square + 0.25) * (1.0 - is_timed);
        passage.by_odds(1.0 - (1.0 - SPREAD) * counts, SOONER * counts)
    }

    /// What the chance of a collapse within the span of scale `power`, which may lie beyond the scales, rests on.
    fn inputs(&self, members: &Members, power: usize, days: f64) -> [f64; INPUTS] {
        let inputs = self.listed(members, power, days);
        let mut all = [0.0; INPUTS];
        for (slot, value) in all.iter_mut().zip(inputs) {
            *slot = if value.is_finite() { value } else { 0.0 };
        }
        all
    }

    fn listed(&self, members: &Members, power: usize, days: f64) -> Vec<f64> {
        let view = View::at(&self.scales, power);
        let mut inputs = Vec::with_capacity(INPUTS);
        inputs.push(1.0);
        motion(&view, &mut inputs);
        novelty(&view, &mut inputs);
        setting(&view, self.evidence.ln_odds(), &mut inputs);
        members.expect(days, &mut inputs);
        let shown = self.evidence.ln_odds_within(days);
        inputs.push((0.2 * shown).clamp(-LARGEST_INPUT, LARGEST_INPUT));
        inputs
    }
}

/// The root of how fast the slope is by the readings since an event that it survived, of these `scales`, beside what it was in it, at most 1: by blocks no
/// longer than those over which the event is known, and less the error of each, which the event itself would make larger. What is slower than a surge that
/// stopped is mostly another one of its kind.
fn as_fast_as(event: &PastEvent, scales: &Scales) -> f64 {
    let each = scales.each.iter();
    let shorter = each.take_while(|scale| scale.days <= event.block_days.max(scales.base_days));
    let now = shorter.map(|scale| scale.velocity - scale.error);
    let fastest = now.fold(0.0, f64::max);
    (fastest / event.velocity.max(f64::MIN_POSITIVE))
        .min(1.0)
        .sqrt()
}

/// The newest readings, of the last `days`; `None` where these are too few to show by themselves what is usual.
fn newest(observations: &Observations, days: f64) -> Option<Observations> {
    let values = &observations.values;
    let since = values.last()?.t_days - days;
    let from = values.partition_point(|one| one.t_days < since);
    let is_enough = (FEWEST_LATER..=MOST_LATER).contains(&(values.len() - from));
    is_enough.then(|| Observations {
        values: values[from..].to_vec(),
        ..*observations
    })
}

/// The share of the chance within the span of scale `power` that is left to a slope that has slowed, since the span and
/// since it was fastest, or is slow, as far as it is not sure that it accelerates: brittle slopes run up from rates at which others creep for ever.
fn goes_on(scales: &Scales, power: usize, accelerating: f64) -> f64 {
    let view = View::at(scales, power);
    let scale = view.scale(0);
    let highest = ln_above(scale.highest_velocity, scale.error);
    let since = view.ln_velocity(-view.span) - view.ln_velocity(0);
    let ever = view.ln_velocity(0) - highest;
    let has_slowed = (since.exp() / SLOWED).min(1.0) * ever.exp().min(1.0).powi(SURVIVED);
    let unsure = (1.0 - accelerating) / (1.0 - accelerating + ALL_BUT_SURE);
    let fastest = fastest(scales, power);
    (has_slowed * above(fastest, SLOW)).powf(unsure) * above(fastest, STILL)
}

/// The highest velocity now of the scale `power` and the shorter ones, mm/day.
fn fastest(scales: &Scales, power: usize) -> f64 {
    let view = View::at(scales, power);
    let each = (-view.span..=0).map(|shorter| view.ln_velocity(shorter));
    each.fold(f64::NEG_INFINITY, f64::max).exp()
}

/// The share of a chance that is left to a slope of this velocity, where one at `slow` has half of it; both mm/day.
fn above(velocity: f64, slow: f64) -> f64 {
    1.0 / (1.0 + (slow / velocity).powi(4))
}

/// The share of the chance within such a span that is reported of a slope that may creep steadily: all scales
/// count together.
fn may_grow(scales: &Scales, power: usize, span: f64) -> f64 {
    let each = growth(scales, power, span).map(|ln| ln.min(ONE_SCALE));
    STEADY + (1.0 - STEADY) * share(each.sum())
}

/// What an even chance becomes by a likelihood ratio under 1, over one half.
fn share(ln_ratio: f64) -> f64 {
    let ratio = ln_ratio.min(0.0).exp();
    2.0 * ratio / (1.0 + ratio)
}

/// ln of the likelihood ratio of growth against none, at the scale `power`, whose span is `span` days, and each shorter one. A
/// straight line in inverse velocity that meets zero after the span D grows by s / (D + 2 s) of itself from one block of s days
/// to the next; [`UNEVEN`] is the standard deviation of that, as a share of it.
fn growth(scales: &Scales, power: usize, span: f64) -> impl Iterator<Item = f64> {
    let shorter = power.saturating_sub(GROWN_SCALES);
    let last = (power + 1).min(scales.each.len());
    let each = scales.each.get(shorter..last).unwrap_or_default().iter();
    each.map(move |scale| {
        let moved = ln_above(scale.velocity, scale.error).exp() * scale.days;
        let expected = moved * scale.days / (span + 2.0 * scale.days);
        let deviation = scale.near.usual.hypot(UNEVEN * expected);
        expected * (scale.near.newest - 0.5 * expected) / (deviation * deviation)
    })
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
        ln_above(scale.velocity, scale.error)
    }
}

/// ln of a value that may be under its error: half of v + sqrt(v^2 + 4 s^2).
fn ln_above(value: f64, error: f64) -> f64 {
    (0.5 * (value + value.hypot(2.0 * error))).max(1e-12).ln()
}

/// How the velocity grows from scale to scale, and its changes against the usual ones.
fn motion(view: &View<'_>, inputs: &mut Vec<f64>) {
    let bounded = |value: f64| value.clamp(-LARGEST_INPUT, LARGEST_INPUT);
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
        inputs.push(bounded(0.3 * (scale.velocity / scale.error).asinh()));
    }
}

/// How the newest motion compares with all that the record showed before.
fn novelty(view: &View<'_>, inputs: &mut Vec<f64>) {
    let bounded = |value: f64| value.clamp(-LARGEST_INPUT, LARGEST_INPUT);
    for longer in [-4, -2, -1, 0, 2] {
        let scale = view.scale(longer);
        let before = ln_above(scale.highest_velocity, scale.error);
        inputs.push(bounded(view.ln_velocity(longer) - before));
    }
    for longer in [-4, -2, 0, 1] {
        let near = view.scale(longer).near;
        let before = ln_above(near.largest, near.usual);
        inputs.push(bounded(0.5 * (ln_above(near.newest, near.usual) - before)));
    }
    for longer in [-2, 0] {
        let scale = view.scale(longer);
        let median = ln_above(scale.median_velocity, scale.error);
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
    inputs.push((0.2 * ln_odds).clamp(-LARGEST_INPUT, LARGEST_INPUT));
    inputs.push(0.1 * (view.longest + 1) as f64);
    let span = scales.base_days.ln() + std::f64::consts::LN_2 * view.span as f64;
    inputs.push(0.3 * span.clamp(-4.0, 4.0));
    inputs.push(0.4 * scales.length_days.max(1e-6).ln().clamp(-3.0, 6.0));
}

#[cfg(test)]
mod tests;
