//! The level of each benchmark, and of the site, as alerts come.

use crate::alert::Level;
use crate::monitor::{Event, EventKind};
use crate::reading::{BenchmarkId, Timestamp};
use crate::runtime::standing::after_alert;
use std::collections::BTreeMap;

/// `None`: the site.
type Place = Option<BenchmarkId>;

/// What is in force, and that it is unknown beside it.
pub(super) type LevelAndUnknown = (Level, bool);

/// The levels in force by what has been said so far.
#[derive(Debug, Default)]
pub(super) struct LevelsNow {
    in_force: BTreeMap<Place, (LevelAndUnknown, Timestamp)>,
    /// After a first start the past is judged when the present has been judged; it changes nothing of that.
    past: BTreeMap<Place, LevelAndUnknown>,
}

impl LevelsNow {
    /// Of one place; green where nothing was said of it.
    pub(super) fn of(&self, place: &Place) -> LevelAndUnknown {
        self.in_force
            .get(place)
            .map_or((Level::Green, false), |(level, _)| *level)
    }

    /// The places of which something was said.
    pub(super) fn places(&self) -> impl Iterator<Item = &Place> {
        self.in_force.keys()
    }

    /// Takes an alert; what is in force from its time on, where it changes that.
    pub(super) fn take(&mut self, event: &Event) -> Option<LevelAndUnknown> {
        let EventKind::Alert { level, state, .. } = &event.kind else {
            return None;
        };
        let (level, state) = (*level, *state);
        let unsaid = ((Level::Green, false), event.time);
        let (now, newest) = (self.in_force.entry(event.benchmark.clone())).or_insert(unsaid);
        let one = if event.time < *newest {
            let past = self.past.entry(event.benchmark.clone());
            past.or_insert((Level::Green, false))
        } else {
            *newest = event.time;
            now
        };
        let before = std::mem::replace(one, after_alert(*one, level, state));
        (before != *one).then_some(*one)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monitor::AlertState;

    fn alert(second: i64, level: Level, state: AlertState) -> Event {
        Event {
            time: Timestamp::from_second(second).unwrap(),
            benchmark: Some(BenchmarkId::new("5")),
            kind: EventKind::Alert {
                level,
                state,
                key: String::new(),
                rule: String::new(),
                text: String::new(),
            },
        }
    }

    #[test]
    fn what_is_said_of_the_past_later_leaves_what_is_in_force_as_it_is() {
        let mut levels = LevelsNow::default();
        let five = Some(BenchmarkId::new("5"));
        let red = alert(100, Level::Red, AlertState::Firing);
        assert_eq!(levels.take(&red), Some((Level::Red, false)));
        let yellow = alert(10, Level::Yellow, AlertState::Firing);
        assert_eq!(levels.take(&yellow), Some((Level::Yellow, false)));
        let ended = alert(20, Level::Yellow, AlertState::Resolved);
        assert_eq!(levels.take(&ended), Some((Level::Green, false)));
        assert_eq!(levels.of(&five), (Level::Red, false));
        let superseded = alert(100, Level::Orange, AlertState::Resolved);
        assert_eq!(levels.take(&superseded), None);
    }
}
