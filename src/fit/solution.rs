//! A law that the inversion under a constant load ended at.

use crate::model::Law;

/// A law that fits, at a local minimum of the misfit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution {
    /// The law, t = 0 at the first reading, velocity in the readings' unit (a length's per day).
    pub law: Law,
    /// Modelled displacement at the first reading, in the readings' unit; 0 for velocities.
    pub displacement_at_start: f64,
    /// Root mean square of the residuals, in the readings' unit.
    pub rms: f64,
    /// Where the search ended: inside the box of m, or at its side.
    pub place: EndOfSearch,
}

/// Whether m was free where a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EndOfSearch {
    /// A minimum within the branch.
    Inside,
    /// The misfit still falls beyond the bound of m.
    AtBoundOfM,
}

/// What is held in an inversion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Exponent {
    /// m is fitted.
    Free,
    /// m is this.
    Fixed(f64),
}
