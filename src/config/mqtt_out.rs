//! `[[mqtt_out]]`: a broker's topic that alerts are published to.

use super::broker::BrokerAddress;
use super::every_way::common;
use super::table::Section;
use super::{Destination, HookConfig, SharedDestination, address};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// `[[mqtt_out]]`: a topic, and the broker that it is at.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MqttTopic {
    /// What logs and receipts call it.
    pub name: String,
    /// Where the broker is.
    pub address: BrokerAddress,
    /// The certificate authorities that are trusted instead of the machine's own, PEM.
    pub ca_file: Option<PathBuf>,
    /// The topic.
    pub topic: String,
    /// Whether the broker keeps the last message for whoever subscribes later.
    pub is_retained: bool,
}

impl Destination for MqttTopic {
    fn table(&self) -> &'static str {
        "mqtt_out"
    }

    fn name(&self) -> String {
        self.name.clone()
    }

    fn reads(&self) -> Vec<PathBuf> {
        self.ca_file.iter().cloned().collect()
    }

    fn lacks(&self) -> Option<String> {
        address::unreadable(self.ca_file.as_ref()?)
    }
}

/// Reads one; `taken` has what the ways out before it are called.
pub(super) fn read(
    mut section: Section<'_>,
    base: &Path,
    taken: &mut BTreeSet<String>,
) -> Option<HookConfig> {
    let topic = topic(&mut section, base);
    let common = common(&mut section);
    if let Some(one) = &topic
        && !taken.insert(one.name.clone())
    {
        section.error(
            section.at(),
            format!("there are two ways out {:?}", one.name),
            "give each its own name: name = \"control room\"",
        );
    }
    section.finish();
    Some(common.to(SharedDestination::new(topic?), base))
}

/// The keys of one, but for those that every way out has.
fn topic(section: &mut Section<'_>, base: &Path) -> Option<MqttTopic> {
    let broker = section
        .required("url", "\"mqtts://broker.example.org:8883\"")
        .and_then(|_| section.parsed("url", BrokerAddress::parse));
    let topic = section
        .required("topic", "\"site/alerts\"")
        .and_then(|_| section.parsed("topic", plain));
    let name = section.text("name").map(|given| given.value);
    let is_retained = section.switch("retain").unwrap_or(false);
    let is_secured = broker.as_ref().is_none_or(|one| one.value.is_secured);
    let ca_file = address::ca_file_where(section, is_secured);
    let (address, topic) = (broker?.value, topic?.value);
    Some(MqttTopic {
        name: name.unwrap_or_else(|| format!("mqtt {address:?} {topic}")),
        address,
        ca_file: ca_file.map(|given| base.join(given)),
        topic,
        is_retained,
    })
}

/// A topic to publish to stands for itself.
fn plain(text: &str) -> Result<String, String> {
    if text.contains(['+', '#', '\0']) {
        Err("write one topic, without + and #: \"site/alerts\"".to_owned())
    } else {
        Ok(text.to_owned())
    }
}
