//! Rain that is given as a running total since some day, and not as it falls.

/// So many rises there must be,
const FEWEST_RISES: usize = 10;
/// so many of them for every fall: rain as it falls comes and goes.
const RISES_A_FALL: usize = 10;
/// A total that is set back begins again within this share of what it was: with the rain that has fallen since, which on a wet day may
/// be much of a young total.
const SET_BACK: f64 = 0.5;
/// One that falls by no more than this share of itself has evaporated, or jitters.
const JITTER: f64 = 0.01;

/// What shows values of rain to be a running total.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunningTotal {
    /// The values before which it was set back, by their place.
    pub set_back: Vec<usize>,
}

impl RunningTotal {
    /// Of values of rain in order of time; `None` where they are no running total.
    pub fn of(values: &[f64]) -> Option<Self> {
        let (mut rises, mut falls, mut set_back) = (0, 0, Vec::new());
        for (place, pair) in (1..).zip(values.windows(2)) {
            let (before, after) = (pair[0], pair[1]);
            if after < 0.0 || before < 0.0 {
                return None;
            }
            if after > before {
                rises += 1;
            } else if after < before {
                falls += 1;
                if after <= SET_BACK * before {
                    set_back.push(place);
                } else if after < (1.0 - JITTER) * before {
                    return None;
                }
            }
        }
        (rises >= FEWEST_RISES && falls * RISES_A_FALL <= rises).then_some(Self { set_back })
    }

    /// Whether values of rain are a running total, or may be one in a dry spell: it hardly rises then and stands above zero, where amounts are
    /// mostly zero.
    pub fn is_one_or_stands(values: &[f64]) -> bool {
        let steps = || values.windows(2).map(|pair| pair[1] - pair[0]);
        let rises = steps().filter(|step| *step > 0.0).count();
        let falls = steps().filter(|step| *step < 0.0).count();
        let above = values.iter().filter(|value| **value > 0.0).count();
        let stands = above > values.len() / 2 && rises + falls < values.len() / 2;
        Self::of(values).is_some() || stands && falls * RISES_A_FALL <= rises.max(FEWEST_RISES)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rain on one day in three.
    fn rain(days: u32) -> Vec<f64> {
        (0..days)
            .map(|day| {
                let drawn = (day * 7919 + 13) % 31;
                if drawn % 3 == 0 {
                    f64::from(drawn) / 2.0
                } else {
                    0.0
                }
            })
            .collect()
    }

    fn total(rain: &[f64], back_at: &[usize]) -> Vec<f64> {
        let mut sum = 0.0;
        let of_day = |(day, rain): (usize, &f64)| {
            if back_at.contains(&day) {
                sum = 0.0;
            }
            sum += rain;
            sum
        };
        rain.iter().enumerate().map(of_day).collect()
    }

    #[test]
    fn a_total_is_known_with_its_resets_and_rain_as_it_falls_is_none() {
        let rain = rain(360);
        assert_eq!(RunningTotal::of(&rain), None);
        for back_at in [&[][..], &[200], &[100, 250]] {
            let found = RunningTotal::of(&total(&rain, back_at)).unwrap();
            assert_eq!(found.set_back, back_at);
        }
        // Set back within a storm: what has fallen since is a fifth of the total before.
        let mut wet = rain.clone();
        wet[60] = 0.2 * wet[..60].iter().sum::<f64>();
        let found = RunningTotal::of(&total(&wet, &[60])).unwrap();
        assert_eq!(found.set_back, [60]);
        assert_eq!(RunningTotal::of(&[0.0; 50]), None);
        assert_eq!(RunningTotal::of(&[]), None);
        let storm: Vec<f64> = (0..50)
            .map(|hour| 25.0 - (f64::from(hour) - 25.0).abs())
            .collect();
        assert_eq!(RunningTotal::of(&storm), None);
    }
}
