//! A state folder that another site's files were read into.

use super::{Args, InitPlan, usage};
use crate::config;
use crate::runtime::inherited::InheritedReadings;

/// A state that has read none of the files of the new config, but others, is another site's.
pub(super) fn inherits_nothing(text: &str, args: &Args, plan: &InitPlan) -> anyhow::Result<()> {
    // What is wrong with the config `check` says.
    let Ok(config) = config::parse(text, &args.output_config) else {
        return Ok(());
    };
    let Some(inherited) = InheritedReadings::of(&config).filter(|inherited| inherited.is_all)
    else {
        return Ok(());
    };
    let (folder, state_dir) = (config.site.state_dir.display(), &plan.state_dir);
    let own = plan
        .sources
        .first()
        .map_or("own", |source| source.id.as_str());
    Err(usage(format!(
        "{folder}: this state folder holds {}, and the new config would read none of them: they would count as readings of its site, and \
         what was called by them as its alerts; give another folder, such as --state-dir {:?}, or --state-dir {state_dir} where its files go \
         on with the same points",
        inherited.what(),
        format!("state-{own}")
    )))
}
