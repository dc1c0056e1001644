//! File systems that do not answer. A share whose server is away cannot be had here: a library in front of the system's makes the daemon's
//! calls wait as that does.

use crate::machine::of;
use crate::notified::failing;
use crate::site::{Program, Site, command, eventually};
use nix::sys::signal::Signal;
use std::fs;
use std::path::Path;
use std::time::Duration;

const HEADER: &str = "time,displacement_mm\n";
const SHARE: &str = "[alert]\nevacuation_time = \"3h\"\n\
                     [[source]]\nid = \"share\"\nkind = \"csv\"\npath = \"remote/*.csv\"\n";

/// A site with a source on a share; the daemon waits for it while the file `away` is there.
fn with_a_share() -> Site {
    let site = Site::new(SHARE);
    fs::create_dir(site.path("remote")).unwrap();
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/failures/hanging.c");
    let (source, library) = (source.display().to_string(), site.path("hanging.so"));
    let library = library.display().to_string();
    command(&["cc", "-shared", "-fPIC", "-o", &library, &source, "-ldl"]);
    site
}

fn start(site: &Site) -> Program {
    let library = format!("LD_PRELOAD={}", site.path("hanging.so").display());
    let away = format!("AWAY={}", site.path("away").display());
    site.start(&["env", &library, &away])
}

#[test]
#[cfg_attr(not(has_cc), ignore = "cc was not found by build.rs")]
fn a_share_that_does_not_answer_keeps_no_other_source_from_being_read_and_is_read_on_when_it_does()
{
    let site = with_a_share();
    site.append("incoming/5.csv", &format!("{HEADER}{}", failing(0..90)));
    site.append("remote/7.csv", &format!("{HEADER}{}", failing(0..20)));
    let program = start(&site);
    eventually("both", || of(&site, "5") == 90 && of(&site, "7") == 20);
    eventually("caught up", || site.log().contains("caught up"));
    fs::write(site.path("away"), "").unwrap();
    site.append("remote/7.csv", &failing(20..30));
    // So that it is met before the rest comes.
    std::thread::sleep(Duration::from_secs(3));
    site.append("incoming/5.csv", &failing(90..114));
    site.awaits_red();
    let faults = || fs::read_to_string(site.path("state/faults.json")).unwrap_or_default();
    eventually("a fault", || {
        faults().contains("folder-unreadable") && faults().contains("remote does not answer")
    });
    // A reload waits for it no longer than for anything else.
    program.signal(Signal::SIGHUP);
    eventually("the config", || site.log().contains("the config is taken"));
    fs::remove_file(site.path("away")).unwrap();
    eventually("what came to the share", || of(&site, "7") == 30);
    eventually("no fault", || !faults().contains("does not answer"));
    program.stop();
    assert_eq!(site.values().len(), 114 + 30, "nothing twice");
    site.proven_events();
}

#[test]
#[cfg_attr(not(has_cc), ignore = "cc was not found by build.rs")]
fn a_daemon_that_starts_while_a_share_does_not_answer_warns_by_the_other_sources_and_can_be_stopped()
 {
    let site = with_a_share();
    site.append("incoming/5.csv", &format!("{HEADER}{}", failing(0..114)));
    fs::write(site.path("away"), "").unwrap();
    let program = start(&site);
    site.awaits_red();
    program.stop();
}

/// While the daemon does not run.
#[test]
fn a_pipe_in_place_of_a_followed_file_keeps_no_other_one_from_being_read() {
    let site = Site::new("[alert]\nevacuation_time = \"3h\"\n");
    site.append("incoming/5.csv", &format!("{HEADER}{}", failing(0..90)));
    site.append("incoming/7.csv", &format!("{HEADER}{}", failing(0..20)));
    site.caught_up().stop();
    fs::remove_file(site.path("incoming/7.csv")).unwrap();
    let pipe = site.path("incoming/7.csv").display().to_string();
    command(&["mkfifo", &pipe]);
    site.append("incoming/5.csv", &failing(90..114));
    let program = site.start(&[]);
    site.awaits_red();
    program.stop();
}
