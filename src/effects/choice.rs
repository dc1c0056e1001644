//! Which of the refitted candidates enters the law: the best that may be accepted, unless a load that nothing measures explains more.

use super::act::Act;
use super::companions::{go_together, is_rain};
use super::definition::{LiesIn, Support};
use super::judge::{block, jumps_at_once, named};
use super::kind::Kind;
use super::margin::{BY_SHAPE, SLOW_COURSE};
use super::objection::{Judgement, Objection, ObjectionWeight};
use super::prior::Prior;
use super::refit::Fitted;
use super::rival::Rival;
use super::search::{Accepted, OneMore, Refitted, SIGNIFICANT, Search};
use super::slow::SlowFit;

/// Instruments, mounts and the air come and go with the year by no more than this, mm.
const MOST_OF_AN_INSTRUMENT_MM: f64 = 5.0;
/// So many margins of the BIC a response with a long memory may gain more than waves by bending.
const BENT: f64 = 3.0;
/// A covariate with a memory of more than [`SLOW_COURSE`], or that changes the log-load by less than this standard deviation, leads a slow load by so
/// much of the margin: those of three drawn slopes that fail by a power law had memories of .30 and .39, or a load of .01, and led it by less; of five lakes
/// that are drawn down once, with memories of at most .12, four did too.
const HARDLY_ANYTHING: f64 = 0.05;
const LEADS_A_SLOW_LOAD: f64 = 0.5;
/// A load with this standard deviation hardly changes the velocity: by a tenth.
const WEAK_LOAD: f64 = 0.1;

impl Search<'_> {
    /// The best effect that may be added to `base`, refitted with it; an event and the mean that it is seen through are
    /// added together.
    pub(super) fn one_more(&mut self, base: &Fitted, round: usize) -> Option<OneMore> {
        (self.withheld, self.is_daily, self.is_slow_alike) = (None, false, false);
        self.may_have_acted.clear();
        let mut refitted = self.refits(base, round)?;
        if let Some(found) = self.averaged(base, &refitted, round) {
            return Some(found);
        }
        refitted.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        prefer_independent_evidence(&mut refitted, self.options.bic_margin);
        self.prefer_rain(&mut refitted);
        let mut refitted = with_other_delays_beside(refitted);
        let judged = refitted.iter().map(|one| self.judged(base, one));
        let mut judged: Vec<Judgement> = judged.collect();
        if let Some(found) = self.two_together(base, &refitted, &judged, round) {
            return Some(found);
        }
        let first = self.first_of(&refitted, &judged);
        let open = |judged: &[Judgement], k: usize| judged[k].1.is_none();
        let most = (0..refitted.len()).filter(|k| open(&judged, *k));
        let most = most.map(|k| refitted[k].gain).fold(f64::MIN, f64::max);
        let slower = first.and_then(|k| self.slower(base, &refitted[k], most));
        if let Some((found, reason)) = &slower {
            self.refuse_beside(found, reason, refitted.iter().zip(&mut judged));
        }
        let beside = slower
            .as_ref()
            .and_then(|_| self.first_of(&refitted, &judged));
        let slower = slower.filter(|_| beside.is_none());
        let chosen = beside.or(first.filter(|_| slower.is_none()));
        if chosen.is_none() {
            self.note_slip_alike(&refitted, &judged);
        }
        let mut ties = chosen.map_or_else(Vec::new, |k| self.ties(&refitted, k, &judged));
        ties.extend(self.is_slow_alike.then(|| Rival::from(Kind::UNEXPLAINED)));
        for (k, one) in refitted.iter().enumerate() {
            let (held, objection) = judged[k].clone();
            let reason = objection.map(|objection| objection.why);
            // Of one effect with two delays, or of two jumps, that one stands which was chosen, or else the better.
            let stands = chosen.filter(|first| refitted[*first].is_as(one));
            let stands = stands.unwrap_or(refitted.iter().position(|known| known.is_as(one))?);
            let has_one_note = one.term.channel.is_some() || one.term.is_jump_of_reading();
            if has_one_note && stands != k {
                continue;
            }
            let beaten = chosen.filter(|first| *first != k && reason.is_none());
            let reason = beaten.map_or(reason, |first| Some(self.beaten_by(&refitted[first], one)));
            let term = one.fitted.terms.last()?;
            self.note(term, one, held, reason);
        }
        if let Some((found, _)) = slower {
            return Some(found);
        }
        let one = refitted.swap_remove(chosen?);
        let how = Accepted {
            bic_gain: one.gain,
            p_value: one.p_value,
            ties,
        };
        let how = one.with_day(one.with_season(how, self.problem), self.problem);
        Some(OneMore::Effect(one.fitted, vec![how]))
    }

    /// The first that may be accepted. Of jumps of the velocity that the BIC cannot separate, that one which asks less of the law:
    /// which parameters are likely before any reading is part of what the fit goes by.
    fn first_of(&self, refitted: &[Refitted], judged: &[Judgement]) -> Option<usize> {
        let first = judged.iter().position(|one| one.1.is_none())?;
        let best = &refitted[first];
        let jump = self.jump_instead(best, refitted, judged);
        if jump.is_some() {
            return jump;
        }
        if !best.term.kind.jumps() {
            return Some(first);
        }
        let score = |k: usize| {
            let fitted = &refitted[k].fitted;
            let prior = Prior::of(self.problem, &fitted.terms);
            refitted[k].gain - prior.misfit(&fitted.parameters)
        };
        let rivals = (0..refitted.len()).filter(|k| {
            let one = &refitted[*k];
            let is_near = (one.gain - best.gain).abs() < self.options.bic_margin;
            judged[*k].1.is_none() && is_near && one.term.kind.jumps()
        });
        rivals.max_by(|a, b| score(*a).total_cmp(&score(*b)))
    }

    /// A jump of the reading that may be accepted and that the readings can hardly tell from `best`, which nothing but their shape supports: in the end a
    /// kind that can follow any bend stands only where it leaves nothing, and a jump that it had beaten would be lost with it.
    fn jump_instead(
        &self,
        best: &Refitted,
        refitted: &[Refitted],
        judged: &[Judgement],
    ) -> Option<usize> {
        if !best.term.kind.fits_any_bend() || best.term.is_jump_of_reading() {
            return None;
        }
        let margin = BY_SHAPE * self.options.bic_margin;
        (0..refitted.len()).find(|k| {
            let one = &refitted[*k];
            judged[*k].1.is_none() && one.term.is_jump_of_reading() && one.gain > best.gain - margin
        })
    }

    /// An event and the mean that it is seen through, where both together may be accepted.
    fn averaged(&mut self, base: &Fitted, refitted: &[Refitted], round: usize) -> Option<OneMore> {
        let (both, how) = self.averaged_event(base, refitted, round)?;
        let (held, objection) = self.judged(base, &both);
        let reason = objection.map(|objection| objection.why);
        let is_taken = reason.is_none();
        let slower = if is_taken {
            self.slower(base, &both, both.gain)
        } else {
            None
        };
        let reason = slower
            .as_ref()
            .map_or(reason, |slower| Some(slower.1.clone()));
        for term in &both.fitted.terms[base.terms.len()..] {
            self.note(term, &both, held, reason.clone());
        }
        match slower {
            Some((found, _)) => Some(found),
            None => is_taken.then_some(OneMore::Effect(both.fitted, how)),
        }
    }

    /// What enters, or ends the search, in place of effects that gain `most`, the first of them being `one`, with why they are refused:
    /// a slow load that explains more by the margin, or an event that does as well as it. `None` where there is no such load.
    pub(super) fn slower(
        &mut self,
        base: &Fitted,
        one: &Refitted,
        most: f64,
    ) -> Option<(OneMore, String)> {
        self.is_slow_alike = false;
        if !one.term.kind.definition().may_be_a_slow_load {
            return None;
        }
        // What has only just come says so by its date: whether it came at once or over a while nothing after it shows.
        let share = self.options.held_out_share;
        block(self.problem, &one.fitted.terms, share)?;
        let slow = self.slow_load(base)?;
        if jumps_at_once(self.problem, &slow.fitted) {
            // What moves the slope between two readings is not slow: it follows the jump that `one` is.
            return None;
        }
        let more = slow.gain - most;
        // A covariate supports an effect by its course: where that is slow, or does hardly anything, and any slow course does nearly as well, it
        // does not.
        let is_slow = self.is_slower_than(one, SLOW_COURSE);
        let is_weak = one.load_sd().is_some_and(|sd| sd < HARDLY_ANYTHING);
        let is_by_course = one.term.kind.definition().support == Support::Covariate;
        let asked = if is_by_course && (is_slow || is_weak) {
            -LEADS_A_SLOW_LOAD
        } else {
            1.0
        };
        if more < asked * self.options.bic_margin {
            let why = if more <= 0.0 {
                let less = -more;
                format!("an effect that was tried explains the same by {less:.0} more of the BIC")
            } else {
                format!(
                    "it cannot be separated from an effect that was tried: the BIC differs by {more:.0}"
                )
            };
            self.note_slow(&slow, why);
            self.is_slow_alike =
                one.term.at.is_some() && slow.gain > one.gain - self.options.bic_margin;
            return None;
        }
        if more >= self.options.bic_margin
            && let Some(found) = self.event_after_all(base, &slow, one.p_value)
        {
            return Some(found);
        }
        self.note_slow(
            &slow,
            "nothing that was tried acts so: the load itself is not explained".to_owned(),
        );
        let by = match more {
            more if more >= 0.0 => format!("by {more:.0} more of the BIC"),
            more => format!("by only {:.0} less of the BIC", -more),
        };
        let reason = format!(
            "a load that changes over a while, and that nothing measures, explains the same {by}"
        );
        Some((OneMore::SlowLoad(slow.fitted, slow.gain), reason))
    }

    /// Refuses what is open for what was `found` instead; but for what no slow load looks like, where that was found.
    fn refuse_beside<'b>(
        &mut self,
        found: &OneMore,
        reason: &str,
        each: impl Iterator<Item = (&'b Refitted, &'b mut Judgement)>,
    ) {
        for (one, judged) in each.filter(|(_, judged)| judged.1.is_none()) {
            let is_alike = one.term.kind.definition().may_be_a_slow_load;
            if is_alike || matches!(found, OneMore::Effect(..)) {
                judged.1 = Some(reason.to_owned().into());
                self.note_beside(found, one);
            }
        }
    }

    /// Keeps `one`, refused for what was `found` instead, as a rival of it where that is a slow load that it cannot be separated from.
    fn note_beside(&mut self, found: &OneMore, one: &Refitted) {
        if let OneMore::SlowLoad(_, gain) = found
            && one.gain > gain - self.options.bic_margin
        {
            self.may_have_acted.push(named(&one.term, self.drivers));
        }
    }

    /// Keeps the best that no chance gains and that is refused although it may have acted, as a rival of whatever is found instead.
    fn note_slip_alike(&mut self, refitted: &[Refitted], judged: &[Judgement]) {
        let mut each = refitted.iter().zip(judged);
        let best = each.find(|(one, (_, objection))| {
            let weight = objection.as_ref().map(|objection| objection.weight);
            weight == Some(ObjectionWeight::MayHaveActed) && one.p_value < SIGNIFICANT
        });
        self.may_have_acted
            .extend(best.map(|(one, _)| named(&one.term, self.drivers)));
    }

    /// The event that accounts for the readings as well as the slow load, where it may be accepted; it gains more than what had this
    /// p-value.
    fn event_after_all(
        &mut self,
        base: &Fitted,
        slow: &SlowFit,
        p_value: f64,
    ) -> Option<(OneMore, String)> {
        let (one, ties) = self.event_instead(base, slow)?;
        let one = Refitted { p_value, ..one };
        let (held, reason) = self.judged(base, &one);
        if reason.is_some() {
            return None;
        }
        self.note(&one.term, &one, held, None);
        let how = Accepted {
            bic_gain: one.gain,
            p_value,
            ties,
        };
        let reason = format!("{} from a better law explains more", one.term.kind);
        Some((OneMore::Effect(one.fitted, vec![how]), reason))
    }

    /// What cannot be separated from the one of that index: what may be accepted as well, and what gains more and is refused by so few
    /// readings of the later block that chance may have done it, or although it may have acted.
    fn ties(&self, refitted: &[Refitted], first: usize, judged: &[Judgement]) -> Vec<Rival> {
        let best = &refitted[first];
        let each = refitted.iter().zip(judged).enumerate();
        let may_be = |one: &Refitted, objection: Option<&Objection>| {
            objection.is_none_or(|objection| {
                objection.weight != ObjectionWeight::Against && one.gain >= best.gain
            })
        };
        let others =
            each.filter(|(k, (one, judged))| *k != first && may_be(one, judged.1.as_ref()));
        let mut ties = Vec::new();
        for (_, (one, _)) in others {
            let Some(term) = one.fitted.terms.last() else {
                continue;
            };
            let same = best.term.kind == one.term.kind && best.term.channel == one.term.channel;
            let is_near = one.gain > best.gain - self.options.bic_margin;
            if !same && (is_near || go_together(&best.term, term)) {
                ties.push(named(term, self.drivers));
            }
        }
        ties
    }

    /// Among what the BIC cannot separate from the first, rain goes before what it feeds.
    fn prefer_rain(&self, refitted: &mut [Refitted]) {
        let Some((first, others)) = refitted.split_first() else {
            return;
        };
        let leads = |one: &Refitted| {
            let is_near = (one.gain - first.gain).abs() < self.options.bic_margin;
            is_near && is_rain(&one.term, self.drivers) && go_together(&one.term, &first.term)
        };
        if !is_rain(&first.term, self.drivers)
            && let Some(place) = others.iter().position(leads)
        {
            refitted[..=place + 1].rotate_right(1);
        }
    }

    fn beaten_by(&self, best: &Refitted, one: &Refitted) -> String {
        let name = best
            .fitted
            .terms
            .last()
            .map(|term| named(term, self.drivers).to_string());
        let name = name.unwrap_or_default();
        let behind = best.gain - one.gain;
        if behind < self.options.bic_margin {
            let behind = behind.abs();
            format!("cannot be separated from {name}: the BIC differs by {behind:.0}")
        } else {
            format!("{name} explains the same by {behind:.0} more of the BIC")
        }
    }
}

/// The same in the same order, but for an effect's second delay, which is judged right after the first.
fn with_other_delays_beside(refitted: Vec<Refitted>) -> Vec<Refitted> {
    let mut ordered: Vec<Refitted> = Vec::with_capacity(refitted.len());
    for one in refitted {
        let beside = ordered.iter().rposition(|known| {
            let is_of_a_covariate = one.term.channel.is_some();
            is_of_a_covariate && known.is_as(&one)
        });
        let place = beside.map_or(ordered.len(), |last| last + 1);
        ordered.insert(place, one);
    }
    ordered
}

/// Of waves of the year in the reading that are larger than an instrument's and those of the load, which the BIC cannot separate, the ground's go first.
fn prefer_the_ground(near: &mut [Refitted]) {
    let waves_in = |one: &Refitted, place: LiesIn| {
        let definition = one.term.kind.definition();
        definition.lies_in == place && !definition.wave_periods.is_empty()
    };
    let too_large = |one: &Refitted| {
        waves_in(one, LiesIn::Reading) && one.wave_amplitude() > MOST_OF_AN_INSTRUMENT_MM
    };
    let first = near.iter().position(too_large);
    let of_the_ground = near.iter().position(|one| one.term.kind == Kind::SEASONAL);
    if let (Some(first), Some(of_the_ground)) = (first, of_the_ground)
        && first < of_the_ground
    {
        near[first..=of_the_ground].rotate_right(1);
    }
}

/// Waves of the year in the reading go before a load that hardly changes the velocity, where the BIC cannot separate them or it follows the year:
/// most instruments do so by a few millimetres, and a response with a long memory bends a little more than waves do. What
/// follows the year so weakly is no rarer without any effect than the waves are. They go before any load that follows the year where they explain more.
fn prefer_the_reading(refitted: &mut [Refitted], margin: f64) {
    let may_be_theirs = |one: &Refitted| {
        let definition = one.term.kind.definition();
        let are_waves =
            definition.lies_in == LiesIn::Reading && !definition.wave_periods.is_empty();
        are_waves && one.wave_amplitude() <= MOST_OF_AN_INSTRUMENT_MM
    };
    let Some(place) = refitted.iter().position(may_be_theirs) else {
        return;
    };
    let is_weak = |one: &Refitted| one.load_sd().is_some_and(|sd| sd < WEAK_LOAD);
    let (gain, p_value) = (refitted[place].gain, refitted[place].p_value);
    for one in refitted.iter_mut() {
        if one.follows_season && is_weak(one) {
            one.p_value = one.p_value.max(p_value);
        }
    }
    let first = &refitted[0];
    let are_known = gain > margin && p_value < SIGNIFICANT;
    let follows = first.follows_season && are_known;
    let is_near = gain > first.gain - margin || follows && gain > first.gain - BENT * margin;
    if is_weak(first) && is_near || follows && gain > first.gain {
        refitted[..=place].rotate_right(1);
    }
}

/// Among what the BIC cannot separate from the best, an effect that a covariate supports goes first, and then
/// the simplest; a change of friction goes before a step of the load that hardly jumps. A covariate that follows the year goes before the bare season if it leaves the smaller error.
fn prefer_independent_evidence(refitted: &mut [Refitted], margin: f64) {
    let Some(best) = refitted.first().map(|one| one.gain) else {
        return;
    };
    let near = refitted.partition_point(|one| one.gain > best - margin);
    refitted[..near].sort_by(|a, b| {
        let has_channel = |one: &Refitted| one.term.channel.is_some();
        let simpler = a.term.parameters().total_cmp(&b.term.parameters());
        has_channel(b)
            .cmp(&has_channel(a))
            .then(simpler)
            .then(b.gain.total_cmp(&a.gain))
    });
    prefer_the_ground(&mut refitted[..near]);
    prefer_the_reading(refitted, margin);
    let place = |is_so: fn(&Act) -> bool| refitted.iter().position(|one| is_so(&one.term.act));
    let step = place(|act| matches!(act, Act::Step));
    let friction = place(|act| matches!(act, Act::Friction(_)));
    if let (Some(step), Some(friction)) = (step, friction)
        && step < friction
        && friction < near
        && refitted[step].hardly_jumps()
    {
        refitted[step..=friction].rotate_right(1);
    }
    let season = refitted
        .iter()
        .position(|one| one.term.kind == Kind::SEASONAL);
    let follower = refitted
        .iter()
        .position(|one| one.follows_season && one.p_value < SIGNIFICANT);
    if let (Some(season), Some(follower)) = (season, follower)
        && season < follower
        && refitted[follower].rms < refitted[season].rms
    {
        refitted[season..=follower].rotate_right(1);
    }
}
