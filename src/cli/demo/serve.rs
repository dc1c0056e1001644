//! `demo --serve`: the measured crisis on the page, as it happened, and then for as long as it is looked at.

use super::{Args, CRISES, Crisis, WRITTEN, pace, policy, recording, sample_hook, show_hook};
use crate::cli::run::asynchronous;
use crate::config::Token;
use crate::monitor::{Settings, SiteLevel, Watched};
use crate::reading::{BenchmarkId, Recording};
use crate::runtime::replay;
use crate::runtime::serve::{Limits, ListenOptions};
use crate::runtime::served_replay::{ServedReplay, show};
use crate::runtime::shutdown::Shutdown;
use crate::runtime::view::{Ending, Facts, Now};
use anyhow::Context;
use std::collections::BTreeMap;
use std::io::Write;
use std::net::SocketAddr;
use std::path::Path;
use std::time::Duration;

/// The crisis takes so long where nothing else is asked for.
pub(super) const PACE: Duration = Duration::from_secs(120);

/// What the page asks for: nothing is at stake, and everybody may know it.
const TOKEN: &str = "slipwatch-demo-token";
/// East, north and height, m: where the extensometers stand on the sketch.
const POSITIONS: [(&str, [f64; 3]); 5] = [
    ("E1", [0.0, 60.0, 12.0]),
    ("E2", [45.0, 72.0, 18.0]),
    ("E3", [95.0, 66.0, 16.0]),
    ("E4", [140.0, 50.0, 10.0]),
    ("E5", [175.0, 20.0, 0.0]),
];
const POSITIONS_ARE: &str =
    "Drawn for the demo: the source of these readings states no positions of the extensometers.";

/// Serves the first crisis until interrupted.
pub(super) fn serve(args: &Args, listen: SocketAddr, folder: &Path) -> anyhow::Result<()> {
    let crisis = &CRISES[0];
    let recording = recording(folder, crisis)?;
    let arrivals = replay::arrivals(&recording);
    let token = folder.join("token");
    std::fs::write(&token, TOKEN).with_context(|| format!("cannot write {}", token.display()))?;
    let hooks = [sample_hook(folder)?];
    let served_replay = ServedReplay {
        hooks: &hooks,
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
            watched: Watched::default(),
            level: SiteLevel::Worst,
            declared: Vec::new(),
            positions: positions(),
            positions_are: Some(POSITIONS_ARE),
            takes_orders: true,
            now: Now::Data,
            ending: ending(crisis, &recording),
        },
        options: ListenOptions {
            listen,
            token: Some(Token::read(&token)?),
            limits: Limits::default(),
        },
    };
    let mut opened = |address| {
        let said = format!(
            "{}, {}: http://{address}/\nThe token that the page asks for is {TOKEN}\n\
             It plays in {:.0?}; the slider goes back to any moment. A sample hook writes to\n{}\nCtrl-C ends it.",
            crisis.site,
            crisis.kind,
            args.pace.unwrap_or(PACE),
            folder.join(WRITTEN).display()
        );
        let _ = writeln!(std::io::stdout().lock(), "{said}");
    };
    asynchronous()?.block_on(async {
        let shutdown = Shutdown::on_signals().context("cannot listen for signals")?;
        show(served_replay, &folder.join("state"), shutdown, &mut opened).await?;
        anyhow::Ok(())
    })?;
    show_hook(&mut std::io::stdout().lock(), folder)
}

fn positions() -> BTreeMap<BenchmarkId, Vec<f64>> {
    let placed = POSITIONS.map(|(name, at)| (BenchmarkId::new(name), at.to_vec()));
    placed.into()
}

/// When the slope collapsed, which the page says once all readings have been played.
fn ending(crisis: &Crisis, recording: &Recording) -> Option<Ending> {
    let readings = recording.series.iter().flat_map(|one| &one.readings);
    Some(Ending {
        collapse: crisis.failed()?,
        last_reading: readings.map(|reading| reading.time).max()?,
    })
}
