//! The families of series: one for each kind of effect, and those with none, two, or one outside the table.

use super::chance::{one_of, so};
use super::laws::{self, Character};
use super::schedule::Need;
use rand_pcg::Pcg64;
use slipwatch::effects::Kind;

/// What a family's series have in them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Family {
    /// One effect of this kind; with `Kind::None` white noise alone.
    Of(Kind),
    /// Two kinds at once.
    Mixed,
    /// A load that no label fits.
    Outside,
}

/// The seeds of a family: what is developed on is never what is judged on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Range {
    Dev,
    Judged,
}

/// Kinds that may stand together in one series.
const PAIRS: [(f64, (Kind, Kind)); 10] = [
    (0.18, (Kind::Hydrological, Kind::Offset)),
    (0.14, (Kind::Seasonal, Kind::LoadStep)),
    (0.12, (Kind::Hydrological, Kind::LoadStep)),
    (0.10, (Kind::Seasonal, Kind::Offset)),
    (0.10, (Kind::Tide, Kind::Offset)),
    (0.08, (Kind::Hydrological, Kind::StateReset)),
    (0.08, (Kind::Thermal, Kind::LoadStep)),
    (0.08, (Kind::Hydrological, Kind::Thermal)),
    (0.06, (Kind::Hydrological, Kind::CorrelatedNoise)),
    (0.06, (Kind::LoadStep, Kind::Offset)),
];

/// What is asked of a series before anything of it is drawn.
#[derive(Debug, Clone)]
pub(crate) struct Recipe {
    pub(crate) kinds: Vec<Kind>,
    pub(crate) need: Need,
    /// The chance that velocities are read.
    pub(crate) chance_of_velocity: f64,
    pub(crate) characters: &'static [(f64, Character)],
}

impl Family {
    pub(crate) const ALL: [Self; 16] = [
        Self::Of(Kind::Hydrological),
        Self::Of(Kind::Seasonal),
        Self::Of(Kind::Tide),
        Self::Of(Kind::LoadStep),
        Self::Of(Kind::StateReset),
        Self::Of(Kind::FrictionChange),
        Self::Of(Kind::RateLimit),
        Self::Of(Kind::Geometry),
        Self::Of(Kind::Partition),
        Self::Of(Kind::Offset),
        Self::Of(Kind::Thermal),
        Self::Of(Kind::IntervalMean),
        Self::Of(Kind::CorrelatedNoise),
        Self::Of(Kind::None),
        Self::Mixed,
        Self::Outside,
    ];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Of(kind) => kind.name(),
            Self::Mixed => "mixed",
            Self::Outside => "outside",
        }
    }

    pub(crate) fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|family| family.name() == name)
    }

    /// The seed of the `index`-th series of a range.
    pub(crate) fn seed(self, range: Range, index: u64) -> u64 {
        let place = (1..).zip(Self::ALL).find(|(_, family)| *family == self);
        let beginning = 1_000_000 * place.map_or(0, |(place, _)| place);
        match range {
            Range::Dev => beginning + index,
            Range::Judged => beginning + 500_000 + index,
        }
    }

    pub(crate) fn recipe(self, rng: &mut Pcg64) -> Recipe {
        let kinds = match self {
            Self::Of(Kind::None) => Vec::new(),
            // A mean is recognised by what it blurs: a step, or the last rise.
            Self::Of(Kind::IntervalMean) if so(rng, 0.5) => {
                vec![Kind::IntervalMean, Kind::LoadStep]
            }
            Self::Of(kind) => vec![kind],
            Self::Outside => vec![Kind::Unexplained],
            Self::Mixed => {
                let (one, other) = one_of(rng, &PAIRS);
                vec![one, other]
            }
        };
        let any = |wanted: &[Kind]| kinds.iter().any(|kind| wanted.contains(kind));
        let need = if any(&[Kind::Seasonal]) {
            Need::SEASON
        } else if any(&[Kind::Tide]) {
            Need::TIDE
        } else if any(&[Kind::Thermal, Kind::IntervalMean]) {
            Need::FINE
        } else {
            Need::ANY
        };
        let chance_of_velocity = if any(&[Kind::IntervalMean]) {
            1.0
        } else if any(&[
            Kind::Offset,
            Kind::Thermal,
            Kind::CorrelatedNoise,
            Kind::Partition,
        ]) {
            0.0
        } else if any(&[Kind::Tide]) {
            0.5
        } else {
            0.2
        };
        let characters: &[_] = if any(&[Kind::RateLimit]) {
            &[(1.0, Character::Failing)]
        } else if any(&[Kind::Geometry]) {
            &[(0.7, Character::Accelerating), (0.3, Character::Failing)]
        } else if kinds == [Kind::IntervalMean] {
            &[(1.0, Character::AtTheBrink)]
        } else {
            &laws::ANY
        };
        Recipe {
            kinds,
            need,
            chance_of_velocity,
            characters,
        }
    }
}
