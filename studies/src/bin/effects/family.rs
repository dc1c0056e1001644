//! The families of series: one for each kind of effect, and those with none, two, or one outside the table.

use super::laws::{self, Character};
use super::schedule::Need;
use rand_pcg::Pcg64;
use slipwatch::effects::Kind;
use studies::random::{happens, one_of};

/// What a family's series have in them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum SceneFamily {
    /// One effect of this kind; with `Kind::NONE` white noise alone.
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
    (0.18, (Kind::HYDROLOGICAL, Kind::OFFSET)),
    (0.14, (Kind::SEASONAL, Kind::LOAD_STEP)),
    (0.12, (Kind::HYDROLOGICAL, Kind::LOAD_STEP)),
    (0.10, (Kind::SEASONAL, Kind::OFFSET)),
    (0.10, (Kind::TIDE, Kind::OFFSET)),
    (0.08, (Kind::HYDROLOGICAL, Kind::STATE_RESET)),
    (0.08, (Kind::THERMAL, Kind::LOAD_STEP)),
    (0.08, (Kind::HYDROLOGICAL, Kind::THERMAL)),
    (0.06, (Kind::HYDROLOGICAL, Kind::CORRELATED_NOISE)),
    (0.06, (Kind::LOAD_STEP, Kind::OFFSET)),
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

impl SceneFamily {
    pub(crate) const ALL: [Self; 17] = [
        Self::Of(Kind::HYDROLOGICAL),
        Self::Of(Kind::SEASONAL),
        Self::Of(Kind::TIDE),
        Self::Of(Kind::LOAD_STEP),
        Self::Of(Kind::STATE_RESET),
        Self::Of(Kind::FRICTION_CHANGE),
        Self::Of(Kind::RATE_LIMIT),
        Self::Of(Kind::GEOMETRY),
        Self::Of(Kind::PARTITION),
        Self::Of(Kind::OFFSET),
        Self::Of(Kind::THERMAL),
        Self::Of(Kind::INTERVAL_MEAN),
        Self::Of(Kind::CORRELATED_NOISE),
        Self::Of(Kind::NONE),
        Self::Mixed,
        Self::Outside,
        Self::Of(Kind::SEASONAL_READING),
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
            Self::Of(kind) if kind == Kind::NONE => Vec::new(),
            // A mean is recognised by what it blurs: a step, or the last rise.
            Self::Of(kind) if kind == Kind::INTERVAL_MEAN && happens(rng, 0.5) => {
                vec![Kind::INTERVAL_MEAN, Kind::LOAD_STEP]
            }
            Self::Of(kind) => vec![kind],
            Self::Outside => vec![Kind::UNEXPLAINED],
            Self::Mixed => {
                let (one, other) = one_of(rng, &PAIRS);
                vec![one, other]
            }
        };
        let any = |wanted: &[Kind]| kinds.iter().any(|kind| wanted.contains(kind));
        let need = if any(&[Kind::SEASONAL, Kind::SEASONAL_READING]) {
            Need::SEASON
        } else if any(&[Kind::TIDE]) {
            Need::TIDE
        } else if any(&[Kind::THERMAL, Kind::INTERVAL_MEAN]) {
            Need::FINE
        } else {
            Need::ANY
        };
        let chance_of_velocity = if any(&[Kind::INTERVAL_MEAN]) {
            1.0
        } else if any(&[
            Kind::OFFSET,
            Kind::THERMAL,
            Kind::SEASONAL_READING,
            Kind::CORRELATED_NOISE,
            Kind::PARTITION,
        ]) {
            0.0
        } else if any(&[Kind::TIDE]) {
            0.5
        } else {
            0.2
        };
        let characters: &[_] = if any(&[Kind::RATE_LIMIT]) {
            &[(1.0, Character::Failing)]
        } else if any(&[Kind::GEOMETRY]) {
            &[(0.7, Character::Accelerating), (0.3, Character::Failing)]
        } else if kinds == [Kind::INTERVAL_MEAN] {
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
