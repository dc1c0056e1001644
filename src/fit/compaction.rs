//! Keeps a record bounded: what is old is remembered in ever larger steps.

use super::rates::Observations;

impl Observations {
    /// Readings that a bounded record keeps.
    pub const MOST_READINGS: usize = 2048;

    /// Where there are more than [`Self::MOST_READINGS`], lets those of the older half go that count as one with the
    /// reading before them, or else every second one of it.
    pub fn compact(&mut self) {
        if self.values.len() <= Self::MOST_READINGS {
            return;
        }
        let half = self.values.len() / 2;
        let newer = self.values[half].t_days;
        let apart = 0.999 * self.spacing_days();
        let mut kept = f64::NEG_INFINITY;
        let before = self.values.len();
        self.values.retain(|value| {
            let keep = value.t_days >= newer || value.t_days - kept >= apart;
            if keep {
                kept = value.t_days;
            }
            keep
        });
        if self.values.len() < before - before / 8 {
            return;
        }
        let half = self.values.len() / 2;
        let mut index = 0;
        self.values.retain(|_| {
            index += 1;
            index > half || index % 2 == 1
        });
    }
}
