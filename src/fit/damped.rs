//! The descent of Levenberg (1944) and Marquardt (1963): steps of a problem that is linearised where it stands, shortened by a
//! damping that goes up after a step that gains nothing and down after one that gains.
//! Crates for it (levenberg-marquardt) hold one fixed set of residuals in nalgebra's matrices; here noise parameters are profiled out anew at each step.

/// How the damping goes up and down.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Damping {
    pub(crate) first: f64,
    /// After a step that gains nothing the damping is so many times as large, and so many times more after each further
    /// one in a row.
    pub(crate) tighten: f64,
    pub(crate) steeper: f64,
    /// What it is at least: after a step that gains nothing, and after one that gains.
    pub(crate) least_tightened: f64,
    pub(crate) least: f64,
    /// From here on no step gains any more.
    pub(crate) most: f64,
    /// Steps tried from one place, at most.
    pub(crate) most_tries: usize,
}

impl Damping {
    /// Goes up by a factor of 10 for as long as it takes.
    pub(crate) const PLAIN: Self = Self {
        first: 1e-3,
        tighten: 10.0,
        steeper: 1.0,
        least_tightened: 0.0,
        least: 0.0,
        most: f64::INFINITY,
        most_tries: usize::MAX,
    };
}

/// What a step came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum StepOutcome {
    /// The problem stands where it led; the next damping is `ease` times this one.
    Gained { gain: f64, ease: f64 },
    /// Nothing was gained: the problem stands where it stood.
    NoGain,
    /// Less is promised than is worth a step.
    Converged,
    /// No more evaluations are allowed.
    OutOfWork,
}

/// Why a descent ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum DescentEnd {
    /// No step gains enough any more.
    Converged,
    /// The problem could not be linearised, no step that was tried gained, or no more evaluations are allowed.
    Stopped,
    /// After as many rounds as were allowed.
    OutOfRounds,
}

/// What can be descended.
pub(crate) trait Descendable {
    /// Linearises the problem where it stands; `false` where that cannot be done.
    fn linearise(&mut self) -> bool;

    /// Takes the step of that damping, if it gains.
    fn step(&mut self, damping: f64) -> StepOutcome;

    /// Whether to go on after a step that gained so much.
    fn goes_on(&self, gain: f64) -> bool;
}

/// Descends for at most so many rounds, each of which is linearised once.
pub(crate) fn descend(
    problem: &mut impl Descendable,
    schedule: &Damping,
    rounds: usize,
) -> DescentEnd {
    let mut damping = schedule.first;
    for _ in 0..rounds {
        if !problem.linearise() {
            return DescentEnd::Stopped;
        }
        let (mut tighten, mut gained) = (schedule.tighten, None);
        for _ in 0..schedule.most_tries {
            if damping >= schedule.most {
                return DescentEnd::Converged;
            }
            match problem.step(damping) {
                StepOutcome::Gained { gain, ease } => {
                    gained = Some(gain);
                    damping = (damping * ease).max(schedule.least);
                    break;
                }
                StepOutcome::NoGain => {
                    damping = (damping * tighten).max(schedule.least_tightened);
                    tighten *= schedule.steeper;
                }
                StepOutcome::Converged => return DescentEnd::Converged,
                StepOutcome::OutOfWork => return DescentEnd::Stopped,
            }
        }
        match gained {
            None => return DescentEnd::Stopped,
            Some(gain) if !problem.goes_on(gain) => return DescentEnd::Converged,
            Some(_) => {}
        }
    }
    DescentEnd::OutOfRounds
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley as two residuals, 10 (y - x^2) and 1 - x.
    struct Valley {
        at: [f64; 2],
        tried: usize,
    }

    impl Valley {
        fn residuals([x, y]: [f64; 2]) -> [f64; 2] {
            [10.0 * (y - x * x), 1.0 - x]
        }

        fn cost(at: [f64; 2]) -> f64 {
            Self::residuals(at).iter().map(|one| one * one).sum()
        }
    }

    impl Descendable for Valley {
        fn linearise(&mut self) -> bool {
            true
        }

        fn step(&mut self, damping: f64) -> StepOutcome {
            self.tried += 1;
            let [first, second] = Self::residuals(self.at);
            let [a, b] = [-20.0 * self.at[0], 10.0];
            let (xx, xy, yy) = (a * a + 1.0, a * b, b * b);
            let (gx, gy) = (a * first - second, b * first);
            let (xx, yy) = (xx * (1.0 + damping), yy * (1.0 + damping));
            let determinant = xx * yy - xy * xy;
            let x = self.at[0] - (yy * gx - xy * gy) / determinant;
            let y = self.at[1] - (xx * gy - xy * gx) / determinant;
            let gain = Self::cost(self.at) - Self::cost([x, y]);
            if gain <= 0.0 {
                return StepOutcome::NoGain;
            }
            self.at = [x, y];
            StepOutcome::Gained { gain, ease: 0.1 }
        }

        fn goes_on(&self, gain: f64) -> bool {
            gain > 1e-12
        }
    }

    const SCHEDULE: Damping = Damping {
        tighten: 8.0,
        least: 1e-9,
        most: 1e7,
        ..Damping::PLAIN
    };

    #[test]
    fn a_bent_valley_is_followed_to_its_lowest_point() {
        let (at, tried) = ([-1.2, 1.0], 0);
        let mut valley = Valley { at, tried };
        assert_eq!(descend(&mut valley, &SCHEDULE, 200), DescentEnd::Converged);
        for coordinate in valley.at {
            assert!((coordinate - 1.0).abs() < 1e-5, "{:?}", valley.at);
        }
        assert!(valley.tried < 100, "{} steps", valley.tried);
    }

    #[test]
    fn rounds_and_tries_are_bounded() {
        let (at, tried) = ([-1.2, 1.0], 0);
        let mut valley = Valley { at, tried };
        assert_eq!(descend(&mut valley, &SCHEDULE, 2), DescentEnd::OutOfRounds);
        let at = [1.0, 1.0];
        let mut lowest = Valley { at, tried };
        let few = Damping {
            most_tries: 3,
            ..SCHEDULE
        };
        assert_eq!(descend(&mut lowest, &few, 9), DescentEnd::Stopped);
        assert_eq!(lowest.tried, 3);
    }
}
