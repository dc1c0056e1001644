//! The same covariate with other values.

use super::Driver;

impl Driver {
    /// The places of its values between two days, without these.
    pub(in crate::effects) fn places_between(
        &self,
        from: f64,
        until: f64,
    ) -> std::ops::Range<usize> {
        let day = |k: usize| self.start + k as f64 * self.step;
        let slack = 0.01 * self.step;
        let first = (0..self.values.len()).find(|k| day(*k) > from + slack);
        let first = first.unwrap_or(self.values.len());
        let end = (first..self.values.len()).find(|k| day(*k) > until - slack);
        first..end.unwrap_or(self.values.len())
    }

    /// The same covariate with so much more at each of these places.
    pub(in crate::effects) fn with_more(&self, places: &std::ops::Range<usize>, more: f64) -> Self {
        let mut changed = self.clone();
        for value in &mut changed.values[places.clone()] {
            *value += more;
        }
        changed
    }

    /// The same covariate, its values no less and no more than those of `known`.
    pub(in crate::effects) fn held_to_what_was(mut self, known: &Self) -> Self {
        let least = known.values.iter().copied().fold(f64::INFINITY, f64::min);
        let most = known.values.iter().copied().fold(least, f64::max);
        for value in &mut self.values {
            *value = value.clamp(least, most);
        }
        self
    }
}
