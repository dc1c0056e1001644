//! Why a candidate is refused, and how much that weighs.

/// What was said of a candidate: its held-out error over that without it, and why it is refused.
pub(super) type Judgement = (Option<f64>, Option<Objection>);

/// Why a candidate is refused.
#[derive(Debug, Clone)]
pub(super) struct Objection {
    pub(super) why: String,
    pub(super) weight: ObjectionWeight,
}

/// How much an objection weighs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ObjectionWeight {
    /// It is not what acted.
    Against,
    /// The later block alone speaks against it, by no more than chance may in so few readings.
    WithinChance,
    /// It may be what acted all the same: nothing speaks against it but that chance gains as much too often (of a covariate), or that slip
    /// of the ground would look the same (of a jump of the reading).
    MayHaveActed,
}

impl From<String> for Objection {
    fn from(why: String) -> Self {
        Self {
            why,
            weight: ObjectionWeight::Against,
        }
    }
}
