//! A logger whose clock is set back: its readings from before lie ahead of those that it gives from then on, until time has passed them. They would be the
//! newest all that time, and what moves would be late.

use super::BenchmarkRecord;
use crate::monitor::event::Event;
use crate::reading::Timestamp;

impl BenchmarkRecord {
    /// Leaves out the readings after `time`, that of the last of several by which the clock of their logger has been set back: nobody knows when they
    /// were measured.
    pub(in crate::monitor::track) fn leave_out_after(&mut self, time: Timestamp) -> Option<Event> {
        let newest = self.history.newest()?;
        let mut count = 0;
        while self.history.newest().is_some_and(|newest| newest > time) {
            self.history.take_out_newest()?;
            count += 1;
        }
        let text = format!(
            "benchmark {}: readings after {time}, up to {newest}, are left out ({count}): the clock of their logger has been set back since, as the newest \
             ones agree with this machine's clock, and these lie ahead of it",
            self.benchmark
        );
        (count > 0).then(|| self.fault(self.data_time(newest), "clock-set-back", text))
    }
}

#[cfg(test)]
mod tests {
    use crate::monitor::track::fixture::{DISPLACEMENT, at, reading, record};

    #[test]
    fn what_lies_after_the_readings_of_a_clock_that_was_set_back_is_left_out() {
        let mut record = record([0.0, 1.0, 2.0, 3.0, 4.0]);
        record.take(DISPLACEMENT, &reading(2, 90.0));
        assert!(record.leave_out_after(at(2)).is_some());
        assert_eq!(record.history().newest(), Some(at(2)));
        assert!(record.leave_out_after(at(2)).is_none());
        // Data time does not go back.
        assert_eq!(record.data_time(at(3)), at(4));
    }
}
