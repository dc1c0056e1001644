//! `demo --serve`: the measured crisis on the page, as it was lived, and then for as long as one likes to look.

use super::{Args, CRISES, pace, policy, recording};
use crate::cli::run::asynchronous;
use crate::monitor::{Settings, SiteLevel};
use crate::runtime::exhibit::{Exhibit, show};
use crate::runtime::replay;
use crate::runtime::serve::{Limits, ListenOptions};
use crate::runtime::shutdown::Shutdown;
use crate::runtime::view::{Facts, Now};
use anyhow::Context;
use std::collections::BTreeMap;
use std::io::Write;
use std::net::SocketAddr;
use std::path::Path;
use std::time::Duration;

/// The crisis takes so long where nothing else is asked for.
pub(super) const PACE: Duration = Duration::from_secs(120);

/// Serves the first crisis until interrupted.
pub(super) fn serve(args: &Args, listen: SocketAddr, folder: &Path) -> anyhow::Result<()> {
    let crisis = &CRISES[0];
    let recording = recording(folder, crisis)?;
    let arrivals = replay::arrivals(&recording);
    let exhibit = Exhibit {
        recording: &recording,
        settings: Settings {
            policy: policy(crisis),
            site: Some(SiteLevel::Worst),
            ..Settings::default()
        },
        pace: pace(args.pace.unwrap_or(PACE), &arrivals),
        facts: Facts {
            has_drills: false,
            links: None,
            name: crisis.site.to_owned(),
            time_zone: "Europe/Zurich".to_owned(),
            named: Vec::new(),
            positions: BTreeMap::new(),
            // Nothing is at stake: there is no hook.
            takes_orders: true,
            now: Now::Data,
            collapse: crisis.failed(),
        },
        options: ListenOptions {
            listen,
            token: None,
            limits: Limits::default(),
        },
    };
    let mut opened = |address| {
        let said = format!(
            "{}, {}: http://{address}/\nIt plays in {:.0?}; the slider goes back to any moment. Ctrl-C ends it.",
            crisis.site,
            crisis.kind,
            args.pace.unwrap_or(PACE)
        );
        let _ = writeln!(std::io::stdout().lock(), "{said}");
    };
    asynchronous()?.block_on(async {
        let shutdown = Shutdown::on_signals().context("cannot listen for signals")?;
        show(exhibit, &folder.join("state"), shutdown, &mut opened).await?;
        Ok(())
    })
}
