//! Whether the newest motion looks like growth to a collapse, or like a step of the velocity that holds.
//!
//! A velocity that stepped up lies far above all before it at every block that reaches over the step, and so looks like an acceleration for
//! as long as such blocks are the newest. Over four of the spans that are asked about the displacement itself shows the difference: from a
//! step on it is a straight line, and before a collapse it is bent to the end. A least-squares line with a term of the one kind is compared with one
//! with a term of the other; the odds of the two, each shape of a kind being as likely as another, are the factor of the odds of a collapse where they
//! speak against growth. Where they speak for it the chances stay as they are.

/// Displacements in blocks of one length, newest first: means, or the values at their ends.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct BlockDisplacements {
    /// Length of a block, days.
    pub(super) days: f64,
    /// From the newest reading back to what the newest block is of, days.
    pub(super) newest_days: f64,
    /// mm.
    pub(super) displacements: Vec<f64>,
    /// Which of the blocks hold a reading.
    pub(super) is_read: Vec<bool>,
}

/// Blocks that are looked at: doublings of them to a span, and how many, at most and at least.
pub(super) const DOUBLINGS: usize = 5;
const BLOCKS_A_SPAN: usize = 1 << DOUBLINGS;
pub(super) const MOST_BLOCKS: usize = 4 * BLOCKS_A_SPAN;
const LEAST_BLOCKS: usize = 30;
/// Fewest blocks that hold a reading.
const FEWEST_READ: usize = 8;
/// Fewest of these before a step, and after it; each step is so many times as long ago as the one before, or more.
const BESIDE_STEP: usize = 3;
const NEXT_STEP: f64 = 1.1;
/// Growth ends so many spans from now, with a velocity that goes with the time left to the power of minus one of these: exponents of Voight's relation of
/// 2.5, 2 and 1.5. What begins with a step goes on by the last two.
const ENDS: [f64; 7] = [0.05, 0.1, 0.2, 0.4, 0.8, 1.5, 3.0];
const POWERS: [f64; 3] = [2.0 / 3.0, 1.0, 2.0];
/// How likely it is that growth begins with a step within the blocks that are looked at, against growth all along. With none three
/// in ten of the crises that begin so are called too late, with as many as all along twice as many of the steps that hold are called.
const AFTER_STEP: f64 = 0.1;
/// ln of the odds against growth that change nothing yet.
const MARGIN: f64 = 0.5;
/// What one block's error has of the one before, at most, and the least error, mm.
const MOST_MEMORY: f64 = 0.9;
const LEAST_ERROR_MM: f64 = 1e-3;

/// How a displacement goes, up to a positive multiple and a straight line.
#[derive(Debug, Clone, Copy, PartialEq)]
enum MotionShape {
    /// A constant velocity.
    Steady,
    /// One that ends so many days from now, by one of [`POWERS`].
    Grows { end: f64, power: f64 },
}

/// A shape at each block, newest first.
struct ShapeAtBlocks {
    shape: MotionShape,
    values: Vec<f64>,
}

/// One least-squares fit.
#[derive(Debug, Clone, Copy)]
struct ShapeFit {
    /// Which of the terms.
    term: usize,
    /// Blocks since the step with which it begins, if it does.
    since: Option<usize>,
    /// What it takes off the sum of squares, mm^2.
    gain: f64,
}

/// The displacements of the blocks without their straight line.
struct Bent {
    /// Days up to 0, newest first, and the same from their mean.
    days: Vec<f64>,
    from_mean: Vec<f64>,
    square_of_days: f64,
    /// mm.
    rest: Vec<f64>,
}

/// BlockSums over the newest blocks.
#[derive(Debug, Clone, Copy, Default)]
struct BlockSums {
    count: f64,
    value: f64,
    square: f64,
    day: f64,
    value_day: f64,
    rest: f64,
    value_rest: f64,
}

/// ln of the factor of the odds of a collapse within `span` days, from `course`: at most 0, which is no change.
pub(super) fn ln_factor(course: &BlockDisplacements, span: f64) -> f64 {
    ln_odds(course, span).map_or(0.0, |ln_odds| (ln_odds + MARGIN).min(0.0))
}

/// ln of the odds of growth to a collapse against a step that holds; `None` with too few blocks.
fn ln_odds(course: &BlockDisplacements, span: f64) -> Option<f64> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a positive count, bounded"
    )]
    let four_spans = (4.0 * span / course.days).round().min(MOST_BLOCKS as f64) as usize;
    let blocks = course.displacements.iter().zip(&course.is_read).enumerate();
    let read = blocks
        .take(four_spans.max(LEAST_BLOCKS))
        .filter(|(_, (_, is_read))| **is_read)
        .map(|(block, (mm, _))| (-course.newest_days - block as f64 * course.days, *mm));
    let (days, mm): (Vec<f64>, Vec<f64>) = read.unzip();
    if days.len() < FEWEST_READ {
        return None;
    }
    let grow = ENDS.iter().flat_map(|share| {
        let end = share * span;
        POWERS.map(|power| MotionShape::Grows { end, power })
    });
    let shapes = std::iter::once(MotionShape::Steady).chain(grow);
    let terms: Vec<ShapeAtBlocks> = shapes
        .map(|shape| ShapeAtBlocks {
            shape,
            values: days.iter().map(|day| shape.at(*day)).collect(),
        })
        .collect();
    let bent = Bent::of(days, &mm);
    let fitted = bent.fit_all(&terms, span);
    bent.weighed(&terms, &fitted)
}

impl MotionShape {
    fn at(self, day: f64) -> f64 {
        match self {
            Self::Steady => day,
            Self::Grows { end, power } => {
                let left = end - day;
                if (power - 1.0).abs() < 1e-9 {
                    -left.ln()
                } else {
                    left.powf(1.0 - power) / (power - 1.0)
                }
            }
        }
    }

    fn may_begin_with_a_step(self) -> bool {
        match self {
            Self::Steady => true,
            Self::Grows { power, .. } => power >= 1.0,
        }
    }
}

impl BlockSums {
    fn add(&mut self, value: f64, day: f64, rest: f64) {
        self.count += 1.0;
        self.value += value;
        self.square += value * value;
        self.day += day;
        self.value_day += value * day;
        self.rest += rest;
        self.value_rest += value * rest;
    }

    /// What a shape takes off the sum of squares that is 0 before these blocks and there its value less `start`.
    fn gain(&self, start: f64, bent: &Bent) -> f64 {
        let sum = self.value - self.count * start;
        let square = self.square - 2.0 * start * self.value + self.count * start * start;
        let along = self.value_day - start * self.day;
        let own = square - sum * sum / bent.days.len() as f64 - along * along / bent.square_of_days;
        let product = (self.value_rest - start * self.rest).max(0.0);
        product * product / own.max(1e-9 * square).max(f64::MIN_POSITIVE)
    }
}

impl Bent {
    fn of(days: Vec<f64>, mm: &[f64]) -> Self {
        let from_mean = without_mean(&days);
        let square_of_days = from_mean.iter().map(|day| day * day).sum();
        let mut bent = Self {
            days,
            from_mean,
            square_of_days,
            rest: Vec::new(),
        };
        bent.rest = bent.without_line(&without_mean(mm));
        bent
    }

    /// `values` of mean 0 without what of them goes with time.
    fn without_line(&self, values: &[f64]) -> Vec<f64> {
        let slope = product(values, &self.from_mean) / self.square_of_days;
        let pairs = values.iter().zip(&self.from_mean);
        pairs.map(|(one, day)| one - slope * day).collect()
    }

    /// How many blocks there are since each step that may have been, newest first, within four spans.
    fn steps(&self, span: f64) -> Vec<usize> {
        let mut last = 0.0;
        let since = BESIDE_STEP..=self.days.len().saturating_sub(BESIDE_STEP);
        let within = since.take_while(|since| -self.step_at(*since) <= 4.0 * span);
        let apart = within.filter(|since| {
            let ago = -self.step_at(*since);
            let is_apart = ago >= NEXT_STEP * last;
            if is_apart {
                last = ago;
            }
            is_apart
        });
        apart.collect()
    }

    /// Where a step lies since which there are so many blocks, days.
    fn step_at(&self, since: usize) -> f64 {
        f64::midpoint(self.days[since - 1], self.days[since])
    }

    /// Each term from each step on, and what grows also all along.
    fn fit_all(&self, terms: &[ShapeAtBlocks], span: f64) -> Vec<ShapeFit> {
        let steps = self.steps(span);
        let mut all = Vec::new();
        for (term, ShapeAtBlocks { shape, values }) in terms.iter().enumerate() {
            let mut sums = BlockSums::default();
            let mut steps = steps.iter().copied().peekable();
            for (block, value) in values.iter().enumerate() {
                sums.add(*value, self.from_mean[block], self.rest[block]);
                let begins = steps.next_if_eq(&(block + 1));
                if let Some(since) = begins.filter(|_| shape.may_begin_with_a_step()) {
                    let gain = sums.gain(shape.at(self.step_at(since)), self);
                    let since = Some(since);
                    all.push(ShapeFit { term, since, gain });
                }
            }
            if *shape != MotionShape::Steady {
                let (since, gain) = (None, sums.gain(0.0, self));
                all.push(ShapeFit { term, since, gain });
            }
        }
        all
    }

    /// What is left of the blocks by one fit, mm.
    fn left(&self, term: &ShapeAtBlocks, fitted: &ShapeFit) -> Vec<f64> {
        let start = (fitted.since).map_or(0.0, |since| term.shape.at(self.step_at(since)));
        let count = fitted.since.unwrap_or(self.days.len());
        let values = term.values.iter().enumerate();
        let shape = values.map(|(block, one)| if block < count { one - start } else { 0.0 });
        let shape: Vec<f64> = shape.collect();
        let shape = self.without_line(&without_mean(&shape));
        let size = product(&self.rest, &shape) / product(&shape, &shape).max(f64::MIN_POSITIVE);
        let pairs = self.rest.iter().zip(&shape);
        pairs.map(|(mm, one)| mm - size.max(0.0) * one).collect()
    }

    /// ln of the odds of what grows against a step that holds, under normal errors of which each has a part of the one before.
    fn weighed(&self, terms: &[ShapeAtBlocks], all: &[ShapeFit]) -> Option<f64> {
        let best = all.iter().max_by(|a, b| a.gain.total_cmp(&b.gain))?;
        let left = self.left(&terms[best.term], best);
        let neighbours = product(&left[1..], &left[..left.len() - 1]);
        let memory = neighbours / product(&left, &left).max(f64::MIN_POSITIVE);
        let memory = memory.clamp(0.0, MOST_MEMORY);
        let count = self.days.len() as f64;
        let independent = count * (1.0 - memory) / (1.0 + memory);
        let whole = product(&self.rest, &self.rest);
        let least = (count - 3.0) * LEAST_ERROR_MM * LEAST_ERROR_MM;
        let square = |gain: f64| (whole - gain).max(least);
        let likelihood = |one: &ShapeFit| {
            let ratio = square(one.gain) / square(best.gain);
            ratio.powf(-0.5 * independent)
        };
        let mean = |asked: &dyn Fn(&ShapeFit) -> bool| {
            let each = all.iter().filter(|one| asked(one)).map(likelihood);
            let (sum, count) = each.fold((0.0, 0.0), |(sum, count), one| (sum + one, count + 1.0));
            if count > 0.0 { sum / count } else { 0.0 }
        };
        let is_steady = |one: &ShapeFit| terms[one.term].shape == MotionShape::Steady;
        let all_along = mean(&|one| one.since.is_none());
        let after_step = mean(&|one| one.since.is_some() && !is_steady(one));
        let holds = mean(&is_steady);
        (holds > 0.0).then(|| {
            ((all_along + AFTER_STEP * after_step) / holds)
                .max(f64::MIN_POSITIVE)
                .ln()
        })
    }
}

fn without_mean(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|one| one - mean).collect()
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Blocks of an hour and a half, of errors of about half a millimetre.
    fn course(count: usize, mm: impl Fn(f64) -> f64) -> BlockDisplacements {
        let days = 1.0 / 16.0;
        let values = (0..count).map(|block| {
            let day = -days * block as f64;
            mm(day) + 0.7 * (977.0 * day).sin()
        });
        BlockDisplacements {
            days,
            newest_days: 0.0,
            displacements: values.collect(),
            is_read: vec![true; count],
        }
    }

    #[test]
    fn a_step_of_the_velocity_that_holds_or_slows_is_no_growth() {
        for ago in [0.7, 1.5, 3.0, 6.0] {
            let holds = course(400, |day| 0.5 * day + 30.0 * (day + ago).max(0.0));
            let ln_odds = ln_odds(&holds, 2.0).unwrap();
            assert!(ln_odds < -1.0, "holds, {ago}: {ln_odds}");
        }
        for ago in [0.7, 1.5, 3.0] {
            let slows = |day: f64| 0.5 * day + 30.0 * (1.0 + (day + ago).max(0.0)).ln();
            let ln_odds = ln_odds(&course(400, slows), 2.0).unwrap();
            assert!(ln_odds < -1.0, "slows, {ago}: {ln_odds}");
        }
    }

    #[test]
    fn growth_to_a_collapse_all_along_or_after_a_step_keeps_its_chance() {
        for end in [0.5, 1.0, 2.0, 4.0] {
            for power in [0.7, 1.0, 2.0] {
                let moved = move |day: f64| -moved_since(day, end, power);
                let ln_factor = ln_factor(&course(400, moved), 2.0);
                assert!(ln_factor > -1.5, "{end} {power}: {ln_factor}");
            }
        }
        let after_step = |day: f64| {
            0.2 * day
                + if day > -3.0 {
                    -20.0 * (1.0 - day).ln()
                } else {
                    -20.0 * 4.0_f64.ln()
                }
        };
        assert!(ln_factor(&course(400, after_step), 2.0) > -1.5);
    }

    /// Displacement from `day` to 0 of 40 mm/day times (end / left) to `power`.
    fn moved_since(day: f64, end: f64, power: f64) -> f64 {
        let steps = 2000;
        let width = -day / f64::from(steps);
        let each = (0..steps).map(|step| {
            let at = day + (f64::from(step) + 0.5) * width;
            40.0 * (end / (end - at)).powf(power) * width
        });
        each.sum()
    }

    #[test]
    fn straight_motion_and_few_blocks_change_nothing() {
        assert!(ln_factor(&course(400, |day| 5.0 * day), 2.0) > -0.7);
        assert!(ln_factor(&course(7, |day| 5.0 * day), 2.0).abs() < 1e-12);
    }
}
