//! Topics of which no message can be used any more.

use crate::reading::counted;
use crate::runtime::service_faults::{FaultPlace, ServiceFaults};
use crate::runtime::tail::{MOST_REFUSED, RefusedRows};
use std::collections::BTreeMap;
use std::error::Error;

/// Topics that are counted.
const MOST_TOPICS: usize = 1024;

/// The newest messages of each topic, where none of them could be used. A filter may take topics that hold no readings: once a topic has
/// given one, only such topics count.
#[derive(Debug, Default)]
pub(super) struct RefusedTopics {
    each: BTreeMap<String, RefusedRows>,
    /// Whether something has become otherwise since it was reported.
    is_news: bool,
}

impl RefusedTopics {
    /// A message of `topic` has been read: whether it gave a value, and what is wrong with it.
    pub(super) fn note(&mut self, topic: &str, is_used: bool, fault: Option<&dyn Error>) {
        if !self.each.contains_key(topic) {
            if self.each.len() >= MOST_TOPICS {
                // One that has given a reading stays.
                let useless = self.each.iter().find(|(_, rows)| !rows.is_below_used);
                let Some(topic) = useless.map(|(topic, _)| topic.clone()) else {
                    return;
                };
                self.each.remove(&topic);
            }
            self.each.insert(topic.to_owned(), RefusedRows::default());
        }
        let Some(refused) = self.each.get_mut(topic) else {
            return;
        };
        if is_used {
            self.is_news |= refused.count > 0 || !refused.is_below_used;
            refused.end();
        } else if let Some(error) = fault {
            refused.add(error);
            // The count that is shown need not be the newest.
            self.is_news |= refused.count == MOST_REFUSED || refused.count.is_power_of_two();
        }
    }

    /// Puts what is to be said of them among `faults`, where it is news.
    pub(super) fn report(&mut self, faults: &ServiceFaults, place: &FaultPlace) {
        if std::mem::take(&mut self.is_news) {
            match self.fault() {
                Some(text) => faults.begin_fault(place.clone(), &text),
                None => faults.end_fault(place),
            }
        }
    }

    fn fault(&self) -> Option<String> {
        let has_given = self.each.values().any(|topic| topic.is_below_used);
        let mut refused = self.each.iter().filter_map(|(topic, rows)| {
            let (count, why) = rows.fault()?;
            (rows.is_below_used || !has_given).then_some((topic, count, why))
        });
        let (topic, count, why) = refused.next()?;
        let others = match refused.count() {
            0 => String::new(),
            others => format!(
                " (so with {})",
                counted(others, "other topic", "other topics")
            ),
        };
        Some(format!(
            "none of the newest {count} messages of the topic {topic:?} could be used{others}: {why}"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt;

    fn send(topics: &mut RefusedTopics, topic: &str, used: bool, times: usize) {
        for _ in 0..times {
            topics.note(topic, used, (!used).then_some(&fmt::Error));
        }
    }

    #[test]
    fn a_topic_of_readings_that_gives_none_any_more_is_a_fault_and_one_that_never_gave_any_is_none_beside_it()
     {
        let mut topics = RefusedTopics::default();
        send(&mut topics, "site/battery", false, 4);
        assert_eq!(topics.fault(), None);
        send(&mut topics, "site/battery", false, 1);
        assert!(topics.fault().unwrap().contains("newest 5 messages"));
        send(&mut topics, "site/P1", true, 1);
        send(&mut topics, "site/P2", true, 1);
        assert_eq!(topics.fault(), None);
        send(&mut topics, "site/P1", false, 6);
        send(&mut topics, "site/P2", true, 9);
        let text = topics.fault().unwrap();
        assert!(text.contains("newest 6 messages of the topic \"site/P1\""));
        send(&mut topics, "site/P2", false, 5);
        assert!(topics.fault().unwrap().contains("with 1 other topic"));
        send(&mut topics, "site/P1", true, 1);
        send(&mut topics, "site/P2", true, 1);
        assert_eq!(topics.fault(), None);
    }
}
