//! How the velocity of one group against another's runs in time: constant, a break, or a drift.

use super::scan::{Break, SHORTEST, Scan, ScanNoise, apart};
use nalgebra::{DMatrix, DVector};

/// Fall of the BIC by which a break must beat a drift without one.
const BREAK_OVER_DRIFT: f64 = 3.0;
/// Fall of the BIC by which a ratio that had changed before the break shows.
const CHANGED_BEFORE: f64 = 6.0;
/// Correlation of successive innovations left by the break, in its standard errors, from which on the ratio
/// follows no break at all, and from which on something is left to explain.
const WITH_MEMORY: f64 = 3.5;
const LEFT: f64 = 2.0;
/// A drift before the break of less than this share of the change is none.
const DRIFT_SHARE: f64 = 0.2;
/// A relaxing ratio jumps by as much at least, in ln.
const LEAST_JUMP: f64 = 0.25;
/// Days of a relaxation, over what is left of the record, and how far from the best plain break it is looked for.
const RELAXATIONS: [f64; 4] = [0.03, 0.1, 0.3, 1.0];
const NEAR: usize = 12;
/// Twice the fall of the log-likelihood that bounds 90 % of a time.
const NINETY: f64 = 2.71;

/// The displacement of two groups, each as a multiple of the same motion before the break.
#[derive(Debug)]
pub(super) struct Pair<'a> {
    days: &'a [f64],
    reference: Vec<f64>,
    other: Vec<f64>,
    noise: &'a ScanNoise,
}

/// What the ratio does at the break.
#[derive(Debug, Clone, Copy, PartialEq)]
enum RatioShape {
    /// It takes another value.
    Step,
    /// It begins to drift.
    Hinge,
    /// It takes another value and goes on to a third, in so many days: what the law does after a load step, a jump of
    /// the state or a change of friction in one group.
    Relaxing(f64),
}

/// The break as the ratio shows it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct RatioCourse {
    /// When, days.
    pub(super) at: f64,
    /// 90 %, days.
    pub(super) interval: (f64, f64),
    /// Ratio of the velocities at the end over that before.
    pub(super) size: f64,
    /// Of the same ratio where it has changed most.
    pub(super) most: f64,
    /// Whether what is left runs on from one innovation to the next.
    pub(super) is_left: bool,
}

#[derive(Debug)]
struct FittedRatio {
    /// n ln(misfit), and the coefficients: offset, ratio, and those of the shapes.
    score: f64,
    coefficients: DVector<f64>,
    left: DVector<f64>,
}

impl<'a> Pair<'a> {
    /// The displacements of groups `one` and `other` of a break; the better read one is the reference.
    pub(super) fn of(
        scan: &'a Scan,
        days: &'a [f64],
        rows: &[Vec<f64>],
        found: &Break,
        groups: (usize, usize),
    ) -> (Self, bool) {
        let motion = |group: usize| {
            let members: Vec<usize> = (0..rows.len())
                .filter(|row| found.groups[*row] == group)
                .collect();
            let weight: f64 = members.iter().map(|row| found.loadings[*row].powi(2)).sum();
            let at = |time: usize| {
                let each = members.iter().map(|row| {
                    found.loadings[*row] * (rows[*row][time] - rows[*row][0]) / scan.scales[*row]
                });
                each.sum::<f64>() / weight.max(1e-12)
            };
            (weight, (0..days.len()).map(at).collect::<Vec<f64>>())
        };
        let (one, other) = (motion(groups.0), motion(groups.1));
        let is_turned = other.0 > one.0;
        let (reference, other) = if is_turned {
            (other.1, one.1)
        } else {
            (one.1, other.1)
        };
        (
            Self {
                days,
                reference,
                other,
                noise: &scan.noise,
            },
            is_turned,
        )
    }

    /// Where the ratio breaks; or why it does not.
    pub(super) fn course(&self) -> Result<RatioCourse, &'static str> {
        let count = (self.days.len() - 1) as f64;
        let mut scores: Vec<(f64, RatioShape, usize)> = Vec::new();
        for index in SHORTEST..self.days.len() - SHORTEST {
            for shape in [RatioShape::Step, RatioShape::Hinge] {
                if let Some(fitted) = self.broken(shape, index, &[]) {
                    scores.push((fitted.score + Self::price(shape) * count.ln(), shape, index));
                }
            }
        }
        let least = |scores: &[(f64, RatioShape, usize)]| {
            let each = scores.iter().copied();
            each.min_by(|a, b| a.0.total_cmp(&b.0))
                .ok_or("the ratio of the velocities is not determined")
        };
        let near = least(&scores)?.2;
        scores.extend(self.relaxing(near));
        let best = least(&scores)?;
        let fitted = self
            .broken(best.1, best.2, &[])
            .ok_or("the ratio of the velocities is not determined")?;
        if self.drifts(best.0, best.1) {
            return Err("the ratio of the velocities drifts without a break");
        }
        if self.had_changed(best.1, best.2, fitted.score) {
            return Err("the ratio of the velocities had been changing before");
        }
        let memory = lag_one(&fitted.left);
        if memory * count.sqrt() > WITH_MEMORY {
            return Err("the ratio of the velocities drifts, break or not");
        }
        let inflation = ((1.0 + memory.max(0.0)) / (1.0 - memory.clamp(0.0, 0.9))).max(1.0);
        let near = scores
            .iter()
            .filter(|one| one.0 - best.0 <= NINETY * inflation)
            .map(|one| one.2);
        let (first, last) = near.fold((best.2, best.2), |(low, high), one| {
            (low.min(one), high.max(one))
        });
        let at = match best.1 {
            RatioShape::Step | RatioShape::Relaxing(_) => {
                f64::midpoint(self.days[best.2 - 1], self.days[best.2])
            }
            RatioShape::Hinge => self.days[best.2],
        };
        let ratio = fitted.coefficients[1];
        let (first_change, change) = self.changes(best.1, best.2, &fitted.coefficients);
        // What drifts bends anywhere, but jumps nowhere.
        if matches!(best.1, RatioShape::Relaxing(_))
            && apart((ratio + first_change) / ratio) < LEAST_JUMP
        {
            return Err("the ratio of the velocities drifts, break or not");
        }
        let most = [first_change, change]
            .map(|change| (ratio + change) / ratio)
            .into_iter()
            .max_by(|a, b| apart(*a).total_cmp(&apart(*b)));
        Ok(RatioCourse {
            at,
            interval: (
                self.days[first - 1],
                self.days[(last + 1).min(self.days.len() - 1)],
            ),
            size: (ratio + change) / ratio,
            most: most.unwrap_or(1.0),
            is_left: memory * count.sqrt() > LEFT,
        })
    }

    /// Relaxing breaks about the time `near`, each with its score.
    fn relaxing(&self, near: usize) -> Vec<(f64, RatioShape, usize)> {
        let count = (self.days.len() - 1) as f64;
        let first = near.saturating_sub(NEAR).max(SHORTEST);
        let end = (near + NEAR + 1).min(self.days.len() - SHORTEST);
        let mut scores = Vec::new();
        for index in first..end {
            let left = self.days[self.days.len() - 1] - self.days[index];
            for share in RELAXATIONS {
                let shape = RatioShape::Relaxing(share * left);
                if let Some(fitted) = self.broken(shape, index, &[]) {
                    scores.push((fitted.score + Self::price(shape) * count.ln(), shape, index));
                }
            }
        }
        scores
    }

    /// Whether a drift that goes on all along does as well as a break of that score; against one that relaxes, it
    /// may bend as often as that has parameters.
    fn drifts(&self, score: f64, shape: RatioShape) -> bool {
        let count = (self.days.len() - 1) as f64;
        let most = match shape {
            RatioShape::Step | RatioShape::Hinge => 2,
            RatioShape::Relaxing(_) => 5,
        };
        let drifts: Vec<Vec<f64>> = (1..=most).map(|power| self.drift(power)).collect();
        (1..=drifts.len()).any(|powers| {
            let price = powers as f64 * count.ln();
            let drift = self.fit(&drifts[..powers].iter().collect::<Vec<_>>());
            drift.is_some_and(|drift| drift.score + price < score + BREAK_OVER_DRIFT)
        })
    }

    /// What a break adds to the ratio at once, and by the end of the record.
    fn changes(&self, shape: RatioShape, index: usize, coefficients: &DVector<f64>) -> (f64, f64) {
        let left = self.days[self.days.len() - 1] - self.days[index];
        let step = coefficients[2];
        match shape {
            RatioShape::Step => (step, step),
            RatioShape::Hinge => (0.0, step * left),
            RatioShape::Relaxing(days) => {
                let passing = coefficients[4];
                (step + passing, step + passing * (-left / days).exp())
            }
        }
    }

    /// Parameters of a break, with its time; that of a step lies anywhere in its interval, which is one more.
    fn price(shape: RatioShape) -> f64 {
        match shape {
            RatioShape::Step => 3.0,
            RatioShape::Hinge => 2.0,
            RatioShape::Relaxing(_) => 5.0,
        }
    }

    fn broken(&self, shape: RatioShape, index: usize, more: &[&Vec<f64>]) -> Option<FittedRatio> {
        let course = self.course_of(shape, index);
        let middle = f64::midpoint(self.days[index - 1], self.days[index]);
        let width = self.days[index] - self.days[index - 1];
        let within = self.course_of_days(|day| {
            if (day - middle).abs() < 0.25 * width {
                1.0
            } else {
                0.0
            }
        });
        let mut shapes = vec![&course];
        if shape != RatioShape::Hinge {
            shapes.push(&within);
        }
        let passing = self.passing(shape, index);
        shapes.extend(passing.iter());
        shapes.extend(more);
        self.fit(&shapes)
    }

    /// Displacement of the reference, its velocity times the shape.
    fn course_of(&self, shape: RatioShape, index: usize) -> Vec<f64> {
        let at = self.days[index];
        match shape {
            RatioShape::Step | RatioShape::Relaxing(_) => self.course_of_days(|day| {
                if day > f64::midpoint(self.days[index - 1], at) {
                    1.0
                } else {
                    0.0
                }
            }),
            RatioShape::Hinge => self.course_of_days(|day| (day - at).max(0.0)),
        }
    }

    /// What passes after a relaxing break; `None` where nothing does.
    fn passing(&self, shape: RatioShape, index: usize) -> Option<Vec<f64>> {
        let RatioShape::Relaxing(days) = shape else {
            return None;
        };
        let from = f64::midpoint(self.days[index - 1], self.days[index]);
        Some(self.course_of_days(|day| {
            if day > from {
                (-(day - from) / days).exp()
            } else {
                0.0
            }
        }))
    }

    /// Of the days, in the record's length.
    fn drift(&self, power: i32) -> Vec<f64> {
        let (first, last) = (self.days[0], self.days[self.days.len() - 1]);
        self.course_of_days(|day| ((day - first) / (last - first)).powi(power))
    }

    /// Whether the ratio drifts before the break, by a share of what it changes there.
    fn had_changed(&self, shape: RatioShape, index: usize, score: f64) -> bool {
        let at = self.days[index];
        let before = self.course_of_days(|day| (at - day).max(0.0));
        let Some(more) = self.broken(shape, index, &[&before]) else {
            return false;
        };
        let count = (self.days.len() - 1) as f64;
        let drift = more.coefficients[more.coefficients.len() - 1] * (at - self.days[0]);
        let (at_once, by_the_end) = self.changes(shape, index, &more.coefficients);
        let change = at_once.abs().max(by_the_end.abs());
        more.score + count.ln() + CHANGED_BEFORE < score && drift.abs() > DRIFT_SHARE * change
    }

    fn course_of_days(&self, shape: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut sum = 0.0;
        let steps = self
            .days
            .windows(2)
            .zip(self.reference.windows(2))
            .map(|(days, slip)| {
                sum += shape(f64::midpoint(days[0], days[1])) * (slip[1] - slip[0]);
                sum
            });
        std::iter::once(0.0)
            .chain(steps.collect::<Vec<f64>>())
            .collect()
    }

    /// Least squares of the other group's innovations on the reference's.
    fn fit(&self, shapes: &[&Vec<f64>]) -> Option<FittedRatio> {
        let ones = vec![1.0; self.days.len()];
        let mut columns: Vec<Vec<f64>> =
            vec![self.noise.whiten(&ones), self.noise.whiten(&self.reference)];
        columns.extend(shapes.iter().map(|shape| self.noise.whiten(shape)));
        let y = DVector::from_vec(self.noise.whiten(&self.other));
        let sizes: Vec<f64> = columns
            .iter()
            .map(|column| column.iter().map(|x| x * x).sum::<f64>().sqrt())
            .collect();
        // A random walk has no offset to fit.
        let size = |column: usize| {
            if sizes[column] > 0.0 {
                sizes[column]
            } else {
                1.0
            }
        };
        let basis = DMatrix::from_fn(y.len(), columns.len(), |row, column| {
            columns[column][row] / size(column)
        });
        let solved = basis.clone().svd(true, true).solve(&y, 1e-9).ok()?;
        let left = &y - &basis * &solved;
        let floor = 1e-18 * y.norm_squared();
        let score = y.len() as f64 * left.norm_squared().max(floor).max(f64::MIN_POSITIVE).ln();
        let coefficients = DVector::from_fn(solved.len(), |index, _| solved[index] / size(index));
        Some(FittedRatio {
            score,
            coefficients,
            left,
        })
    }
}

/// Correlation of successive values.
pub(super) fn lag_one(values: &DVector<f64>) -> f64 {
    let mean = values.mean();
    let square: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    let product: f64 = (1..values.len())
        .map(|index| (values[index] - mean) * (values[index - 1] - mean))
        .sum();
    if square > 0.0 { product / square } else { 0.0 }
}
