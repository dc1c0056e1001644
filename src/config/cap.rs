//! `[[cap]]`: a folder for messages of the Common Alerting Protocol.

use super::every_way::common;
use super::table::Section;
use super::{Destination, HookConfig, SharedDestination};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// `[[cap]]`: a folder for messages of the Common Alerting Protocol.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CapFolder {
    /// The folder.
    pub folder: PathBuf,
    /// Who sends: a name that is unique in the world, such as an address.
    pub sender: String,
    /// What the area is called.
    pub area: String,
    /// Its outline, as CAP writes it: pairs of latitude and longitude, the first one again at the end.
    pub polygon: Option<String>,
}

impl Destination for CapFolder {
    fn table(&self) -> &'static str {
        "cap"
    }

    fn name(&self) -> String {
        format!("cap {}", self.folder.display())
    }
}

/// Reads one; `taken` has what the ways out before it are called.
pub(super) fn read(
    mut section: Section<'_>,
    base: &Path,
    taken: &mut BTreeSet<String>,
) -> Option<HookConfig> {
    let folder = section.required("folder", "\"cap\"");
    let sender = section.required("sender", "\"slipwatch@example.org\"");
    let area = section.required("area", "\"the north slope of Monte Toc\"");
    let polygon = section.parsed("polygon", polygon);
    let common = common(&mut section);
    if let Some(one) = &folder
        && !taken.insert(format!("cap {}", one.value))
    {
        section.error(
            &one.at,
            format!("there are two [[cap]] with the folder {:?}", one.value),
            "give each its own folder",
        );
    }
    if let Some(one) = &sender
        && (one.value.is_empty() || one.value.contains([' ', ',', '<', '&']))
    {
        section.error(
            &one.at,
            format!("cap.sender = {:?} has a blank, a comma, < or &", one.value),
            "write it as in \"slipwatch@example.org\"",
        );
    }
    section.finish();
    let cap = CapFolder {
        folder: base.join(folder?.value),
        sender: sender?.value,
        area: area?.value,
        polygon: polygon.map(|given| given.value),
    };
    Some(common.to(SharedDestination::new(cap), base))
}

/// An outline as CAP writes it.
fn polygon(text: &str) -> Result<String, String> {
    let fix = || {
        "write four or more pairs of latitude,longitude in degrees, the first one again at the end: \
         \"46.27,12.33 46.28,12.35 46.26,12.36 46.27,12.33\""
            .to_owned()
    };
    let point = |pair: &str| {
        let (latitude, longitude) = pair.split_once(',')?;
        let (latitude, longitude): (f64, f64) = (latitude.parse().ok()?, longitude.parse().ok()?);
        (latitude.abs() <= 90.0 && longitude.abs() <= 180.0).then_some((latitude, longitude))
    };
    let pairs: Vec<&str> = text.split_whitespace().collect();
    let is_closed = pairs.len() >= 4 && pairs.first() == pairs.last();
    if is_closed && pairs.iter().all(|pair| point(pair).is_some()) {
        Ok(pairs.join(" "))
    } else {
        Err(fix())
    }
}
