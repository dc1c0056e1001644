//! Escalation: who is notified when nobody acknowledges in time. The hooks are processes, and the daemon stops and starts in between.

use crate::notified::failing;
use crate::site::{Program, Site, eventually};

/// A site with a second hook, which is to be run so long after an alert that nobody has acknowledged.
fn site(after: &str) -> Site {
    let site = Site::new(&format!(
        "[[benchmark]]\nid = \"5\"\nsource = \"logger\"\n[[benchmark]]\nid = \"6\"\nsource = \"logger\"\n[alert]\nevacuation_time = \"3h\"\n\
         [[hook]]\nrun = [\"/bin/sh\", \"next.sh\"]\nlevels = [\"orange\", \"red\"]\nescalate_after = \"{after}\"\n"
    ));
    let script = "echo $SLIPWATCH_KEY $SLIPWATCH_STATE >> escalated\n";
    std::fs::write(site.path("next.sh"), script).unwrap();
    site.append(
        "incoming/5.csv",
        &format!("time,displacement_mm\n{}", failing(0..114)),
    );
    site
}

/// Starts the daemon; the first hook has the red.
fn notified(site: &Site) -> Program {
    let program = site.caught_up();
    site.awaits_red();
    program
}

/// The same, once the red waits for the second hook.
fn waiting(site: &Site) -> Program {
    let program = notified(site);
    eventually("that it waits", || {
        standing(site) == ("waiting".to_owned(), 0)
    });
    program
}

/// How the red's delivery to the second hook stands: status and attempts.
fn standing(site: &Site) -> (String, i64) {
    let database = rusqlite::Connection::open(site.path("state/slipwatch.db")).unwrap();
    let query =
        "SELECT status, attempts FROM outbox WHERE hook = '/bin/sh next.sh' AND level = 'red'";
    database
        .query_row(query, [], |row| Ok((row.get(0)?, row.get(1)?)))
        .unwrap_or_default()
}

/// As if two hours had gone by since the alert came into the outbox, while nothing runs.
fn two_hours_later(site: &Site) {
    let database = rusqlite::Connection::open(site.path("state/slipwatch.db")).unwrap();
    let earlier = "UPDATE outbox SET noted = noted - 7200000000000 WHERE hook = '/bin/sh next.sh'";
    assert!(database.execute(earlier, []).unwrap() > 0);
}

fn escalated(site: &Site) -> usize {
    let lines = site.lines("escalated");
    lines
        .iter()
        .filter(|line| line.starts_with("5/red/"))
        .count()
}

#[test]
fn what_nobody_acknowledges_in_time_is_escalated() {
    let site = site("1s");
    let program = notified(&site);
    eventually("that it is escalated", || escalated(&site) == 1);
    eventually("the receipt", || {
        standing(&site) == ("delivered".to_owned(), 1)
    });
    program.stop();
    assert_eq!(escalated(&site), 1);
}

#[test]
fn an_escalation_outlasts_a_restart_is_not_made_by_it_and_is_made_once() {
    let site = site("1h");
    let program = waiting(&site);
    program.stop();
    assert_eq!(escalated(&site), 0, "a stop makes no escalation");
    let program = site.caught_up();
    program.stop();
    assert_eq!(escalated(&site), 0, "nor does a start");
    assert_eq!(standing(&site), ("waiting".to_owned(), 0));
    two_hours_later(&site);
    let program = site.caught_up();
    eventually("that it is escalated", || escalated(&site) == 1);
    program.stop();
    site.caught_up().stop();
    assert_eq!(escalated(&site), 1, "once");
    site.proven_events();
}

#[test]
fn an_acknowledgement_in_time_calls_an_escalation_off_for_good() {
    let site = site("1h");
    let program = waiting(&site);
    site.acknowledge("5", "Ada");
    eventually("that it is called off", || {
        standing(&site) == ("acknowledged".to_owned(), 0)
    });
    program.stop();
    two_hours_later(&site);
    // The past is read again, and what is in force is offered again.
    let program = site.caught_up();
    program.stop();
    assert_eq!(escalated(&site), 0);
    assert_eq!(standing(&site), ("acknowledged".to_owned(), 0));
    let record = site.printed(&["alerts", "show", "5/red", "--config", "site.toml"]);
    assert!(
        record.contains("/bin/sh next.sh was not run: somebody acknowledged it in time"),
        "{record}"
    );
}

#[test]
fn what_was_acknowledged_while_the_daemon_was_down_is_not_escalated_by_its_start() {
    let site = site("1h");
    let program = waiting(&site);
    program.stop();
    two_hours_later(&site);
    site.acknowledge("5", "Ada");
    let program = site.caught_up();
    eventually("that it is called off", || {
        standing(&site) == ("acknowledged".to_owned(), 0)
    });
    program.stop();
    assert_eq!(escalated(&site), 0);
    site.proven_events();
}

#[test]
fn what_was_ended_while_the_daemon_was_down_is_not_escalated_by_its_start_and_is_ended_once() {
    let site = site("1h");
    let program = waiting(&site);
    program.stop();
    let resolve = ["alerts", "resolve", "--benchmark", "5", "--by", "Ada"];
    let why = ["--why", "rockfall on the wire", "--config", "site.toml"];
    site.printed(&[&resolve[..], &why].concat());
    two_hours_later(&site);
    let program = site.caught_up();
    eventually("the end", || site.notified("5/red/", "resolved") == 1);
    program.stop();
    assert_eq!(escalated(&site), 0);
    let orders = site.events().matches("\"event\":\"order\"").count();
    assert_eq!(orders, 1, "{}", site.events());
}

#[test]
fn another_command_line_of_its_hook_does_not_begin_the_time_of_an_escalation_anew() {
    let site = site("1h");
    let program = waiting(&site);
    program.stop();
    let database = rusqlite::Connection::open(site.path("state/slipwatch.db")).unwrap();
    let earlier = "UPDATE outbox SET noted = noted - 7200000000000";
    assert!(database.execute(earlier, []).unwrap() > 0);
    drop(database);
    // Another name on the rota.
    let text = std::fs::read_to_string(site.path("site.toml")).unwrap();
    let other = text.replace("\"next.sh\"", "\"next.sh\", \"Bob\"");
    std::fs::write(site.path("site.toml"), other).unwrap();
    let program = site.caught_up();
    eventually("that it is escalated", || escalated(&site) == 1);
    program.stop();
    site.proven_events();
}

#[test]
fn a_silence_that_covers_an_alert_calls_its_escalation_off_and_one_elsewhere_does_not() {
    let site = site("1h");
    let program = waiting(&site);
    let silence = |more: &[&str]| {
        let words = [
            "alerts",
            "silence",
            "--for",
            "30min",
            "--config",
            "site.toml",
        ];
        site.printed(&[&words[..], more].concat());
    };
    silence(&["--benchmark", "6"]);
    eventually("that it is taken", || {
        site.printed(&["events", "--kind", "order", "--config", "site.toml"])
            .contains("silence")
    });
    assert_eq!(standing(&site), ("waiting".to_owned(), 0));
    silence(&[]);
    eventually("that it is called off", || {
        standing(&site) == ("silenced".to_owned(), 0)
    });
    program.stop();
}

#[test]
fn check_says_that_nobody_is_notified_at_once_and_refuses_two_hooks_that_cannot_be_distinguished() {
    let site = site("15m");
    let text = std::fs::read_to_string(site.path("site.toml")).unwrap();
    let said = site.checked_with_a_first_hook_for_unknown();
    assert!(
        said.contains("every hook that has red among its levels has escalate_after"),
        "{said}"
    );
    std::fs::write(site.path("site.toml"), text.replace("next.sh", "hook.sh")).unwrap();
    let output = site.ask(&["check", "--config-only", "site.toml"]);
    assert_eq!(output.status.code(), Some(78), "{output:?}");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("they cannot be distinguished"), "{said}");
}
