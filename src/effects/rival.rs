//! What would explain the same as an effect that was found: a kind of effect and the covariate it works through.

use super::kind::Kind;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// A kind of effect, with its covariate where it has one. In output it is its name: `hydrological lake_level_m`.
#[derive(Debug, Clone, PartialEq, Eq, JsonSchema, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Rival {
    /// Its kind.
    pub kind: Kind,
    /// The covariate's full name.
    pub channel: Option<String>,
}

impl Rival {
    /// Their names with commas between them, as people read them.
    pub fn listed(rivals: &[Self]) -> String {
        let name = |rival: &Self| {
            if rival.kind == Kind::UNEXPLAINED {
                "a load that changes over a while and that nothing measures".to_owned()
            } else {
                rival.to_string()
            }
        };
        let names: Vec<String> = rivals.iter().map(name).collect();
        names.join(", ")
    }
}

impl From<Kind> for Rival {
    fn from(kind: Kind) -> Self {
        Self {
            kind,
            channel: None,
        }
    }
}

impl fmt::Display for Rival {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.channel {
            Some(channel) => write!(f, "{} {channel}", self.kind),
            None => f.write_str(self.kind.name()),
        }
    }
}

impl From<Rival> for String {
    fn from(rival: Rival) -> Self {
        rival.to_string()
    }
}

impl TryFrom<String> for Rival {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let (name, channel) = match text.split_once(' ') {
            Some((name, channel)) => (name, Some(channel.to_owned())),
            None => (text.as_str(), None),
        };
        let kind = Kind::named(name).ok_or_else(|| format!("{name:?} is no kind of effect"))?;
        Ok(Self { kind, channel })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rival_is_read_back_from_its_name_whatever_its_channel_is_called() {
        for kind in Kind::all() {
            for channel in [None, Some("lake"), Some("hydrological station 2")] {
                let channel = channel.map(str::to_owned);
                let rival = Rival { kind, channel };
                let text = serde_json::to_string(&rival).unwrap();
                assert_eq!(serde_json::from_str::<Rival>(&text).unwrap(), rival);
            }
        }
        assert!(serde_json::from_str::<Rival>("\"magic wand\"").is_err());
    }
}
