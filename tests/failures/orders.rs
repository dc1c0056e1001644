//! 20 and 21: configs that change under a daemon at work.

use crate::site::{Site, eventually, get};
use nix::sys::signal::Signal;

const BENCHMARKS: &str = "[[benchmark]]\nid = \"4\"\nsource = \"logger\"\n\
                          [[benchmark]]\nid = \"5\"\nsource = \"logger\"\n";
const POLICY: &str = "[alert]\nevacuation_time = \"3h\"\n";

/// Hourly readings up to now that run away.
fn failing(name: &str) -> String {
    let now = slipwatch::runtime::clock::now();
    let rows = (0..=113).map(|row: i32| {
        let time = now - jiff::SignedDuration::from_hours(i64::from(113 - row));
        format!(
            "{time},{:.4}\n",
            200.0 * (120.0 / f64::from(120 - row)).ln()
        )
    });
    format!("time,{name}_displacement_mm\n{}", rows.collect::<String>())
}

/// 21.
#[test]
fn a_wrong_config_on_sighup_is_not_taken_and_a_benchmark_taken_out_is_closed_and_reported() {
    let site = Site::new(&format!("{BENCHMARKS}{POLICY}"));
    for name in ["4", "5"] {
        site.append(&format!("incoming/{name}.csv"), &failing(name));
    }
    let mut program = site.caught_up();
    let is_notified = |what: &str, state: &str| {
        let notified = site.lines("notified");
        (notified.iter()).any(|line| line.starts_with(what) && line.ends_with(state))
    };
    eventually("both reds", || {
        is_notified("4/red", "firing") && is_notified("5/red", "firing")
    });
    site.configure("[alert]\nevacuation_time = \"never\"\n");
    program.signal(Signal::SIGHUP);
    eventually("that it is refused", || {
        site.log()
            .contains("the config is not taken: the old one stays in force")
    });
    assert!(
        site.log().contains("evacuation_time"),
        "why? {}",
        site.log()
    );
    assert_eq!(program.ended(), None);
    let one = BENCHMARKS
        .split_inclusive("source = \"logger\"\n")
        .last()
        .unwrap();
    site.configure(&format!("{one}{POLICY}"));
    program.signal(Signal::SIGHUP);
    eventually("that it is taken", || {
        site.log().contains("the config is taken")
    });
    eventually("the end notified", || is_notified("4/red", "resolved"));
    assert!(!is_notified("5/red", "resolved"), "5 is still watched");
    let status = site.printed(&["status", "--config", "site.toml"]);
    assert!(!status.contains("not acknowledged"), "{status}");
    program.stop();
    site.proven_events();
}

/// A config that is refused, and one that is right but for the path of its source, are seen by those who look.
#[test]
fn a_config_that_is_not_taken_and_a_mistyped_path_are_reported_and_no_longer_when_mended() {
    let site = Site::new(POLICY);
    let address = site.listen();
    site.append("incoming/5.csv", &failing("5"));
    let program = site.caught_up();
    let right = std::fs::read_to_string(site.path("site.toml")).unwrap();
    let reload = |text: &str| {
        std::fs::write(site.path("site.toml"), text).unwrap();
        program.signal(Signal::SIGHUP);
    };
    let refused = || get(&address, "/metrics").contains("\nslipwatch_config_refused 1");
    assert!(!refused());
    reload(&right.replace("evacuation_time = \"3h\"", "evacuation_time = \"never\""));
    eventually("that it is refused", refused);
    assert!(get(&address, "/api/status").contains("\"config_refused\":\""));
    std::fs::write(site.path("site.toml"), &right).unwrap();
    let status = site.printed(&["status", "--config", "site.toml"]);
    assert!(status.contains("CONFIG NOT TAKEN"), "{status}");
    reload(&right.replace("incoming/*.csv", "incomming/*.csv"));
    eventually("that it is taken", || !refused());
    eventually("that there is no file", || {
        site.events().contains("\"kind\":\"no-file\"")
    });
    let status = site
        .printed(&["status", "--config", "site.toml"])
        .replace("\n    ", " ");
    assert!(!status.contains("CONFIG NOT TAKEN"), "{status}");
    assert!(status.contains("source \"logger\": the folder"), "{status}");
    reload(&right);
    eventually("the right one", || {
        site.log().matches("the config is taken").count() == 2
    });
    program.stop();
    let events = site.proven_events();
    let kinds = |kind: &str| events.matches(&format!("\"kind\":\"{kind}\"")).count();
    // That there is no recording either is no news.
    assert_eq!(
        (kinds("config-refused"), kinds("no-file")),
        (1, 1),
        "{events}"
    );
    assert!(events.contains("evacuation_time"), "{events}");
}

/// The next daemon takes the file as it is then.
#[test]
fn where_no_daemon_runs_no_config_is_said_to_be_in_force() {
    let site = Site::new(POLICY);
    let address = site.listen();
    site.append("incoming/5.csv", &failing("5"));
    let program = site.caught_up();
    let right = std::fs::read_to_string(site.path("site.toml")).unwrap();
    std::fs::write(site.path("site.toml"), right.replace("[site]", "[site")).unwrap();
    program.signal(Signal::SIGHUP);
    eventually("that it is refused", || {
        get(&address, "/metrics").contains("\nslipwatch_config_refused 1")
    });
    // It reads the file itself.
    let output = site.ask(&["status", "--config", "site.toml"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(
        !output.status.success() && said.contains("site.toml"),
        "{said}"
    );
    std::fs::write(site.path("site.toml"), &right).unwrap();
    let status = || site.printed(&["status", "--config", "site.toml"]);
    assert!(status().contains("CONFIG NOT TAKEN"), "{}", status());
    program.stop();
    let status = status();
    assert!(status.contains("NO DAEMON RUNS"), "{status}");
    assert!(!status.contains("CONFIG NOT TAKEN"), "{status}");
}

/// 21. A hook that is at work while the config changes is waited for.
#[test]
fn what_a_hook_is_being_sent_while_the_config_changes_is_reported_once() {
    let site = Site::new(POLICY);
    let script = "echo $SLIPWATCH_KEY >> begun\nsleep 1\necho $SLIPWATCH_KEY >> notified\n";
    std::fs::write(site.path("hook.sh"), script).unwrap();
    site.append("incoming/5.csv", &failing("5"));
    let program = site.caught_up();
    let is_red = |name: &str| {
        let lines = site.lines(name);
        lines
            .iter()
            .filter(|line| line.starts_with("5/red/"))
            .count()
    };
    eventually("a hook at work", || is_red("begun") == 1);
    program.signal(Signal::SIGHUP);
    eventually("that it is taken", || {
        site.log().contains("the config is taken")
    });
    program.stop();
    assert_eq!(
        (is_red("begun"), is_red("notified")),
        (1, 1),
        "{}",
        site.log()
    );
}

/// 20. Whoever sets the clock back, data time stays: a reading of the future waits for nobody.
#[test]
fn data_time_never_goes_back_in_what_is_stored() {
    let site = Site::new(POLICY);
    let now = slipwatch::runtime::clock::now();
    let late: String = [3, 1, 5, 2, 4]
        .map(|hours| format!("{},1\n", now - jiff::SignedDuration::from_hours(hours)))
        .concat();
    site.append("incoming/5.csv", &format!("time,displacement_mm\n{late}"));
    site.caught_up().stop();
    let store = slipwatch::store::Store::look(&site.path("state")).unwrap();
    let steps = store.steps(0).unwrap();
    assert!(steps.len() >= 5);
    assert!(steps.is_sorted_by_key(|step| step.now), "{steps:?}");
}

/// What stands in the outbox of benchmark 5's red, a line each: hook and status.
fn outbox(site: &Site) -> Vec<String> {
    let database = rusqlite::Connection::open(site.path("state/slipwatch.db")).unwrap();
    let mut query = database
        .prepare("SELECT hook || ' ' || status FROM outbox WHERE key LIKE '5/red/%' ORDER BY id")
        .unwrap();
    let rows = query.query_map([], |row| row.get(0)).unwrap();
    rows.collect::<Result<_, _>>().unwrap()
}

/// Another command line in the config; the old one has taken nothing.
#[test]
fn an_alert_that_waits_for_a_hook_whose_command_line_changed_goes_to_the_new_one_and_nothing_waits()
{
    let site = Site::new(POLICY);
    let listen = site.listen();
    std::fs::write(site.path("hook.sh"), "exit 1\n").unwrap();
    std::fs::write(
        site.path("new.sh"),
        "echo $SLIPWATCH_KEY $SLIPWATCH_STATE >> notified\n",
    )
    .unwrap();
    site.append("incoming/5.csv", &failing("5"));
    let program = site.caught_up();
    eventually("that the red waits", || {
        outbox(&site) == ["/bin/sh hook.sh waiting"]
    });
    let text = std::fs::read_to_string(site.path("site.toml")).unwrap();
    std::fs::write(site.path("site.toml"), text.replace("hook.sh", "new.sh")).unwrap();
    program.signal(Signal::SIGHUP);
    eventually("that the new one has taken it", || {
        outbox(&site) == ["/bin/sh hook.sh closed", "/bin/sh new.sh delivered"]
    });
    let notified = site.lines("notified");
    let reds = notified.iter().filter(|line| line.starts_with("5/red/"));
    assert_eq!(reds.count(), 1, "{notified:?}");
    let closed = "alerts waited for a hook that does not ask for them any more";
    assert!(site.log().contains(closed), "{}", site.log());
    eventually("that it is counted", || {
        crate::site::get(&listen, "/metrics").contains("slipwatch_outbox_closed_alerts 1")
    });
    for words in [&["status"][..], &["alerts", "list"]] {
        let said = site.printed(&[words, &["--config", "site.toml"]].concat());
        let said = said.replace("\n    ", " ");
        assert!(
            said.contains("hook \"/bin/sh hook.sh\" has not taken the red alert"),
            "{said}"
        );
    }
    program.stop();
    site.proven_events();
}

/// It is found at a start too, and where no other hook asks for the level.
#[test]
fn an_alert_that_no_hook_asks_for_any_more_is_closed_at_the_next_start_and_can_be_had_again() {
    let site = Site::new(POLICY);
    std::fs::write(site.path("hook.sh"), "exit 1\n").unwrap();
    site.append("incoming/5.csv", &failing("5"));
    let program = site.caught_up();
    eventually("that the red waits", || {
        outbox(&site) == ["/bin/sh hook.sh waiting"]
    });
    program.stop();
    let before = std::fs::read_to_string(site.path("site.toml")).unwrap();
    let levels = "\"yellow\", \"orange\", \"red\", \"unknown\"";
    std::fs::write(site.path("site.toml"), before.replace(levels, "\"yellow\"")).unwrap();
    let program = site.caught_up();
    eventually("that it is closed", || {
        outbox(&site) == ["/bin/sh hook.sh closed"]
    });
    program.stop();
    std::fs::write(site.path("site.toml"), before).unwrap();
    std::fs::write(site.path("hook.sh"), "echo $SLIPWATCH_KEY >> notified\n").unwrap();
    site.printed(&["alerts", "redeliver", "--config", "site.toml"]);
    let program = site.caught_up();
    eventually("that it is notified", || {
        outbox(&site) == ["/bin/sh hook.sh delivered"]
    });
    program.stop();
}

/// Another address of a heartbeat is asked from the reload on, and the old one no more.
#[test]
fn another_heartbeat_begins_with_the_config_that_names_it() {
    let listeners = [(); 2].map(|()| std::net::TcpListener::bind("127.0.0.1:0").unwrap());
    let heartbeat = |listener: &std::net::TcpListener| {
        let address = listener.local_addr().unwrap();
        format!("{POLICY}[[heartbeat]]\nurl = \"http://{address}/\"\nevery = \"1s\"\n")
    };
    let comes = |listener: &std::net::TcpListener| {
        use std::io::{Read, Write};
        let (mut stream, _) = listener.accept().unwrap();
        let mut request = [0; 1024];
        let length = stream.read(&mut request).unwrap();
        assert!(request[..length].starts_with(b"GET / "));
        let answer = b"HTTP/1.1 204 No Content\r\nconnection: close\r\n\r\n";
        stream.write_all(answer).unwrap();
    };
    let site = Site::new(&heartbeat(&listeners[0]));
    site.append("incoming/5.csv", &failing("5"));
    let program = site.caught_up();
    comes(&listeners[0]);
    site.configure(&heartbeat(&listeners[1]));
    program.signal(Signal::SIGHUP);
    comes(&listeners[1]);
    eventually("that it is taken", || {
        site.log().contains("the config is taken")
    });
    // What had come before the reload may still wait; after it nothing more comes.
    listeners[0].set_nonblocking(true).unwrap();
    while listeners[0].accept().is_ok() {}
    comes(&listeners[1]);
    comes(&listeners[1]);
    assert!(listeners[0].accept().is_err(), "the old one is still asked");
    program.stop();
}

/// As of another version, or written by hand.
#[test]
fn an_order_that_cannot_be_read_is_left_out_and_ends_no_daemon() {
    let site = Site::new("");
    site.append(
        "incoming/5.csv",
        "time,displacement_mm\n2020-01-01T00:00:00Z,1\n",
    );
    site.caught_up().stop();
    let database = rusqlite::Connection::open(site.path("state/slipwatch.db")).unwrap();
    let insert = "INSERT INTO command (body) VALUES ('{\"order\": 7}')";
    database.execute(insert, []).unwrap();
    let program = site.caught_up();
    eventually("that it is reported", || {
        site.log()
            .contains("an order that cannot be read is left out")
    });
    // Orders given meanwhile are refused by the daemon, and do not end it either.
    database.execute(insert, []).unwrap();
    let left = || -> i64 {
        let count = "SELECT count(*) FROM command";
        database.query_row(count, [], |row| row.get(0)).unwrap()
    };
    eventually("that it is taken out", || left() == 0);
    program.stop();
}
