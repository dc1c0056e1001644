//! The Tinée's flow by La Clapière, all invented but for its seasons: snow melt in spring, rain in autumn (paper).

use jiff::civil::{Date, date};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

pub(crate) const BASE_M3_S: f64 = 8.0;
/// Standard deviation of ln(flow) as it was gauged, and its memory from day to day.
pub(crate) const NOISE: f64 = 0.08;
pub(crate) const NOISE_MEMORY: f64 = 0.7;
/// Days by which the melt rises and falls (standard deviations of its two halves).
const MELT_RISE_DAYS: f64 = 20.0;
const MELT_FALL_DAYS: f64 = 28.0;
const RECESSION_DAYS: f64 = 9.0;

/// The melt and the rains of one year. Days are those of the year.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Year {
    number: i16,
    melt_peak_m3_s: f64,
    melt_day: f64,
    /// Day and flow at its peak, m3/s.
    rains: [(f64, f64); 2],
}

/// The years in which the river acts on the slope. The rains of 1982 come before the first reading.
const GIVEN: [Year; 6] = [
    Year {
        number: 1982,
        melt_peak_m3_s: 0.0,
        melt_day: 147.0,
        rains: [(268.0, 13.2), (327.0, 37.6)],
    },
    Year {
        number: 1983,
        melt_peak_m3_s: 43.7,
        melt_day: 157.8,
        rains: [(272.0, 13.2), (314.0, 9.7)],
    },
    Year {
        number: 1984,
        melt_peak_m3_s: 26.7,
        melt_day: 159.8,
        rains: [(277.0, 35.0), (330.0, 32.3)],
    },
    Year {
        number: 1985,
        melt_peak_m3_s: 18.0,
        melt_day: 138.1,
        rains: [(293.0, 43.5), (305.0, 26.2)],
    },
    Year {
        number: 1986,
        melt_peak_m3_s: 38.0,
        melt_day: 144.8,
        rains: [(280.0, 17.3), (340.0, 45.0)],
    },
    Year {
        number: 1987,
        melt_peak_m3_s: 42.4,
        melt_day: 153.3,
        rains: [(269.0, 16.7), (322.0, 27.0)],
    },
];

/// After them: ranges from which a year is drawn.
mod drawn {
    pub(super) const MELT_PEAK_M3_S: std::ops::Range<f64> = 26.0..38.0;
    pub(super) const MELT_DAY: std::ops::Range<f64> = 137.0..157.0;
    pub(super) const FIRST_RAIN_DAY: std::ops::Range<f64> = 265.0..300.0;
    pub(super) const SECOND_RAIN_DAY: std::ops::Range<f64> = 300.0..335.0;
    pub(super) const RAIN_M3_S: std::ops::Range<f64> = 12.0..40.0;
}

/// Every year from the first to the last.
pub(crate) fn years(seed: u64, first: i16, last: i16) -> Vec<Year> {
    let mut random = Pcg64::seed_from_u64(seed);
    let year = |year: i16| {
        let given = GIVEN.iter().find(|one| one.number == year);
        given
            .copied()
            .unwrap_or_else(|| Year::draw(year, &mut random))
    };
    (first..=last).map(year).collect()
}

/// The flow of a day before what the gauge errs by, m3/s.
pub(crate) fn flow_m3_s(years: &[Year], day: Date) -> f64 {
    let more = years.iter().map(|year| year.melt_and_rain_m3_s(day));
    BASE_M3_S + more.sum::<f64>()
}

impl Year {
    fn draw(year: i16, random: &mut Pcg64) -> Self {
        let mut rain = |days: std::ops::Range<f64>| {
            let day = random.random_range(days).round();
            (day, random.random_range(drawn::RAIN_M3_S))
        };
        let rains = [rain(drawn::FIRST_RAIN_DAY), rain(drawn::SECOND_RAIN_DAY)];
        Self {
            number: year,
            melt_peak_m3_s: random.random_range(drawn::MELT_PEAK_M3_S),
            melt_day: random.random_range(drawn::MELT_DAY).round(),
            rains,
        }
    }

    fn melt_and_rain_m3_s(&self, today: Date) -> f64 {
        let day = f64::from((today - date(self.number, 1, 1)).get_days());
        let from_peak = day - self.melt_day;
        let width = if from_peak < 0.0 {
            MELT_RISE_DAYS
        } else {
            MELT_FALL_DAYS
        };
        let melt = self.melt_peak_m3_s * (-0.5 * (from_peak / width).powi(2)).exp();
        let rain = |(at, peak): &(f64, f64)| {
            if day < *at {
                0.0
            } else {
                peak * ((at - day) / RECESSION_DAYS).exp()
            }
        };
        melt + self.rains.iter().map(rain).sum::<f64>()
    }
}
