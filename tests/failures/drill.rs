//! Scheduled drills: a made-up failure reaches the hooks that ask for it, and nothing of the site. The daemon is a process.

use crate::site::{Site, eventually, get};
use std::fs;

/// A site that has drills, whose second hook they reach, with a benchmark that creeps; and where it listens.
fn site(more: &str) -> (Site, String) {
    let site = Site::new(&format!(
        "[[benchmark]]\nid = \"5\"\nsource = \"logger\"\n\
         [[hook]]\nrun = [\"/bin/sh\", \"drilled.sh\"]\nlevels = [\"orange\"]\ndrills = true\n\
         [[cap]]\nfolder = \"cap\"\nsender = \"test@example.org\"\narea = \"here\"\ndrills = true\n\
         [drill]\nevery = \"1h\"\n{more}"
    ));
    // The line comes when the body is there.
    let script = "cat >> bodies\necho $SLIPWATCH_KEY $SLIPWATCH_BENCHMARK $SLIPWATCH_LEVEL $SLIPWATCH_STATE $SLIPWATCH_STATUS \
                  $SLIPWATCH_ACKNOWLEDGE_URL >> drilled\n";
    fs::write(site.path("drilled.sh"), script).unwrap();
    let address = site.listen();
    let text = fs::read_to_string(site.path("site.toml")).unwrap();
    let more = "public_url = \"http://localhost\"\nstate_dir";
    fs::write(site.path("site.toml"), text.replacen("state_dir", more, 1)).unwrap();
    let now = slipwatch::runtime::clock::now();
    let rows = (0..48).map(|row| {
        let time = now - jiff::SignedDuration::from_hours(47 - row);
        format!("{time},{}\n", row as f64 * 0.01)
    });
    let rows: String = rows.collect();
    site.append("incoming/5.csv", &format!("time,displacement_mm\n{rows}"));
    (site, address)
}

fn figure(address: &str, name: &str) -> f64 {
    let metrics = get(address, "/metrics");
    let line = metrics
        .lines()
        .find(|line| line.starts_with(&format!("slipwatch_{name} ")));
    line.unwrap().rsplit_once(' ').unwrap().1.parse().unwrap()
}

/// A count, or 1 for yes.
fn metric(address: &str, name: &str) -> i64 {
    figure(address, name).round() as i64
}

/// The site: who acknowledged, and nothing else. Its other hook was not run.
fn nothing_of_it_is_the_sites(site: &Site) {
    let events = site.proven_events();
    let of_it: Vec<&str> = events
        .lines()
        .filter(|line| line.contains("exercise"))
        .collect();
    assert_eq!(of_it.len(), 1, "{of_it:?}");
    assert!(of_it[0].contains("\"by\":\"Anna\""), "{of_it:?}");
    assert!(
        site.lines("notified")
            .iter()
            .all(|line| !line.contains("exercise"))
    );
    assert_eq!(
        site.values()
            .iter()
            .filter(|(name, ..)| name != "5")
            .count(),
        0
    );
    let status = site.printed(&["status", "--config", "site.toml"]);
    assert!(status.contains("last drill: passed"), "{status}");
    assert!(!status.contains("exercise"), "{status}");
}

#[test]
fn a_drill_goes_from_a_file_to_the_acknowledgement_and_nothing_of_it_reaches_the_site() {
    let (site, address) = site("acknowledge_within = \"30m\"\n");
    let program = site.caught_up();
    eventually("the drill at its hook", || site.lines("drilled").len() == 1);
    let line = site.lines("drilled").remove(0);
    let words: Vec<&str> = line.split(' ').collect();
    assert!(words[0].starts_with("exercise/red/"), "{line}");
    assert_eq!(words[1..5], ["exercise", "red", "firing", "Exercise"]);
    let link = words[5].strip_prefix("http://localhost").unwrap();
    assert!(get(&address, link).contains("Exercise: this is a drill"));
    let bodies = fs::read_to_string(site.path("bodies")).unwrap();
    assert!(
        bodies.contains("\"text\":\"EXERCISE, nothing has happened: "),
        "{bodies}"
    );
    assert_eq!(
        metric(&address, "drills_total"),
        0,
        "nobody has acknowledged"
    );
    site.acknowledge("exercise", "Anna");
    eventually("that it has passed", || {
        metric(&address, "drills_total") == 1
    });
    assert_eq!(metric(&address, "drill_failed"), 0);
    assert_eq!(metric(&address, "drill_overdue"), 0);
    assert!(figure(&address, "drill_latency_seconds") > 0.0);
    assert!(
        site.lines("drilled")[1].contains("red resolved Exercise"),
        "its end"
    );
    let messages = fs::read_dir(site.path("cap")).unwrap().flatten();
    let messages = messages.filter_map(|file| fs::read_to_string(file.path()).ok());
    let messages: String = messages.collect();
    assert!(messages.contains("<msgType>Cancel</msgType>"), "{messages}");
    assert_eq!(
        messages.matches("<status>").count(),
        messages.matches("<status>Exercise").count()
    );
    nothing_of_it_is_the_sites(&site);
    // The drill's own log follows from what it took in, as the site's does.
    let own = [
        "replay",
        "--state",
        "state/drill/run/state",
        "--format",
        "json",
    ];
    let own = site.printed(&own);
    assert!(
        own.contains("\"event\":\"alert\"") && own.contains("\"event\":\"refit\""),
        "{own}"
    );
    program.stop();
    // The next one is an hour away, over a restart too.
    let program = site.caught_up();
    assert_eq!(metric(&address, "drills_total"), 1);
    program.stop();
    assert_eq!(site.lines("drilled").len(), 2);
}

#[test]
fn a_drill_that_nobody_acknowledges_and_one_that_does_not_come_are_alarms() {
    let (site, address) = site("acknowledge_within = \"1s\"\n");
    let program = site.caught_up();
    eventually("that it has failed", || {
        metric(&address, "drill_failed") == 1
    });
    assert_eq!(metric(&address, "drills_total"), 0);
    assert!(site.log().contains("the drill failed"), "{}", site.log());
    let status = site.printed(&["status", "--config", "site.toml"]);
    assert!(
        status.contains("DRILL FAILED: nobody has acknowledged it within 1s"),
        "{status}"
    );
    assert!(!status.contains("OVERDUE"), "{status}");
    program.stop();
    // As if none had passed since last year.
    let file = site.path("state/drill/last.json");
    let mut record: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(&file).unwrap()).unwrap();
    let now = slipwatch::runtime::clock::now();
    record["since"] = (now - jiff::SignedDuration::from_hours(8760))
        .to_string()
        .into();
    fs::write(&file, record.to_string()).unwrap();
    let program = site.caught_up();
    eventually("that it is overdue", || {
        metric(&address, "drill_overdue") == 1
    });
    let status = site.printed(&["status", "--config", "site.toml"]);
    assert!(status.contains("DRILL OVERDUE since"), "{status}");
    program.stop();
}
