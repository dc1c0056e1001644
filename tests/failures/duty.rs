//! Hours: an alert outside of a hook's hours waits for the next shift. The hooks are processes.

use crate::notified::failing;
use crate::site::{Site, eventually};
use jiff::{SignedDuration, Timestamp, tz::TimeZone};
use slipwatch::runtime::clock;

/// A site with a second hook that notes when it is run, on duty for an hour from so long after now.
fn site(after: SignedDuration) -> (Site, Timestamp) {
    let begins = clock::now() + after;
    let begins = begins.round(jiff::Unit::Second).unwrap();
    let clock = |time: Timestamp| time.to_zoned(TimeZone::UTC).time().to_string();
    let ends = begins + SignedDuration::from_hours(1);
    let hours = format!("{}-{}", clock(begins), clock(ends));
    let site = Site::new(&format!(
        "[[benchmark]]\nid = \"5\"\nsource = \"logger\"\n[alert]\nevacuation_time = \"3h\"\n\
         [[hook]]\nrun = [\"/bin/sh\", \"office.sh\"]\nlevels = [\"red\"]\nhours = [\"{hours}\"]\n"
    ));
    std::fs::write(site.path("office.sh"), "date +%s >> office\n").unwrap();
    site.append(
        "incoming/5.csv",
        &format!("time,displacement_mm\n{}", failing(0..114)),
    );
    (site, begins)
}

/// How the red's delivery to the second hook stands.
fn standing(site: &Site) -> String {
    let database = rusqlite::Connection::open(site.path("state/slipwatch.db")).unwrap();
    let query = "SELECT status FROM outbox WHERE hook = '/bin/sh office.sh' AND level = 'red'";
    database
        .query_row(query, [], |row| row.get(0))
        .unwrap_or_default()
}

#[test]
fn what_still_stands_when_the_shift_begins_is_sent_then_and_once() {
    let (site, begins) = site(SignedDuration::from_secs(8));
    let program = site.caught_up();
    site.awaits_red();
    eventually("that the office is notified", || {
        standing(&site) == "delivered"
    });
    program.stop();
    let ran = site.lines("office");
    assert_eq!(ran.len(), 1, "{ran:?}");
    let at: i64 = ran[0].parse().unwrap();
    assert!(at >= begins.as_second(), "{at} before {begins}");
}

#[test]
fn what_is_acknowledged_before_the_shift_is_not_sent_and_a_restart_does_not_send_it_early() {
    let (site, _) = site(SignedDuration::from_hours(6));
    let program = site.caught_up();
    site.awaits_red();
    program.stop();
    let program = site.caught_up();
    eventually("that it waits", || standing(&site) == "waiting");
    site.printed(&["alerts", "ack", "--by", "Ada", "--config", "site.toml"]);
    eventually("that it is called off", || {
        standing(&site) == "acknowledged"
    });
    program.stop();
    assert!(site.lines("office").is_empty());
}

#[test]
fn check_names_the_first_hour_in_which_nobody_is_notified_of_red() {
    let (site, _) = site(SignedDuration::from_hours(6));
    let text = std::fs::read_to_string(site.path("site.toml")).unwrap();
    let said = site.checked_with_a_first_hook_for_unknown();
    assert!(said.contains("none of them is on duty from"), "{said}");
    let wrong = text.replace("hours = [\"", "hours = [\"weekdays ");
    std::fs::write(site.path("site.toml"), wrong).unwrap();
    let output = site.ask(&["check", "--config-only", "site.toml"]);
    assert_eq!(output.status.code(), Some(78), "{output:?}");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("mon-fri 07:00-19:00"), "{said}");
}
