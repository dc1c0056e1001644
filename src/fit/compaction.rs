//! Keeps a record bounded: what is old is remembered in ever larger steps.

use super::rates::Observations;

impl Observations {
    /// Readings that a bounded record keeps.
    pub const MOST: usize = 2048;

    /// Lets every second reading of the older half go where there are more than [`Self::MOST`].
    pub fn compact(&mut self) {
        if self.values.len() <= Self::MOST {
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
