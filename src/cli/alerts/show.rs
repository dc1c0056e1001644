//! `alerts show KEY`: everything of one alert, as text, JSON or a bundle that can be checked elsewhere.

use super::{bundle, unwritten, words};
use crate::cli::exit::UsageError;
use crate::cli::state::SiteArgs;
use crate::runtime::view;
use std::path::PathBuf;

/// `alerts show`.
#[derive(Debug, clap::Args)]
pub(super) struct ShowArgs {
    /// Which, as a hook gets it in SLIPWATCH_KEY; or how it begins, such as 5/red: the newest of these
    #[arg(value_name = "KEY")]
    key: String,
    /// Also write everything that the decision rests on, and the command that reproduces it, to this ZIP file
    #[arg(long, value_name = "OUT.zip")]
    bundle: Option<PathBuf>,
    #[command(flatten)]
    site: SiteArgs,
}

/// Prints the alert, and writes its bundle where one is asked for.
pub(super) fn show(args: &ShowArgs) -> anyhow::Result<()> {
    let (config, store) = args.site.open()?;
    let Some(alert) = view::alert(&store, &config.site.name, &args.key)? else {
        let text = format!(
            "no alert {:?}: `slipwatch alerts list --format json` and `slipwatch events --kind alert --format json` show the keys",
            args.key
        );
        return Err(unwritten::explained(&config, UsageError(text).into()));
    };
    let zone = &config.site.time_zone;
    if let Some(file) = &args.bundle {
        bundle::write(file, &alert, &config, &store)?;
    }
    args.site
        .output
        .print(&alert, |alert| words::shown(alert, zone))
}
