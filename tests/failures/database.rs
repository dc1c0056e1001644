//! 17: a database that must not be touched.

use crate::notified::failing;
use crate::site::{Site, command, eventually, get, has_own_mounts};
use rusqlite::Connection;
use std::fs;

/// A site whose state holds a few hundred readings.
fn used() -> Site {
    let site = Site::new("");
    let start = jiff::Timestamp::from_second(1_577_836_800).unwrap();
    let rows: String = (0..200)
        .map(|row| format!("{},{row}\n", start + jiff::SignedDuration::from_hours(row)))
        .collect();
    site.append("incoming/5.csv", &format!("time,displacement_mm\n{rows}"));
    site.caught_up().stop();
    assert_eq!(site.values().len(), 200);
    site
}

/// That it does not start, with 74, and says `what`; the database stays as it was.
fn is_refused(site: &Site, what: &str) {
    let file = site.path("state/slipwatch.db");
    let before = fs::read(&file).unwrap();
    let output = site.ask(&["run", "site.toml"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(74), "{said}");
    assert!(said.contains(what), "{said}");
    assert!(said.contains("state"), "where? {said}");
    assert!(fs::read(file).unwrap() == before, "it was written to");
}

#[test]
fn a_damaged_database_is_refused_with_what_to_do() {
    let site = used();
    let file = site.path("state/slipwatch.db");
    let mut bytes = fs::read(&file).unwrap();
    let middle = bytes.len() / 2 / 4096 * 4096;
    bytes[middle..middle + 8192]
        .iter_mut()
        .for_each(|byte| *byte ^= 0x5a);
    fs::write(file, bytes).unwrap();
    is_refused(&site, "restore a backup of slipwatch.db");
}

#[test]
fn a_database_of_a_later_version_is_refused_by_its_number() {
    let site = used();
    let database = Connection::open(site.path("state/slipwatch.db")).unwrap();
    database.pragma_update(None, "user_version", 99).unwrap();
    drop(database);
    is_refused(&site, "schema 99, from a later slipwatch");
}

#[test]
fn a_database_of_another_program_is_refused_and_so_is_what_is_none() {
    let site = Site::new("");
    fs::create_dir(site.path("state")).unwrap();
    let file = site.path("state/slipwatch.db");
    let database = Connection::open(&file).unwrap();
    database
        .execute_batch("CREATE TABLE cheese (name TEXT)")
        .unwrap();
    drop(database);
    is_refused(&site, "another program's database");
    fs::write(
        file,
        "no database at all, but a text of some length".repeat(40),
    )
    .unwrap();
    is_refused(&site, "move it away");
}

#[test]
fn a_second_daemon_is_refused_and_the_first_goes_on() {
    let site = used();
    let mut first = site.caught_up();
    let output = site.ask(&["run", "site.toml"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(74), "{said}");
    assert!(
        said.contains("another slipwatch is at work on it"),
        "{said}"
    );
    assert_eq!(said.matches("state folder").count(), 1, "{said}");
    assert_eq!(first.ended(), None);
    first.stop();
}

#[test]
fn a_second_daemon_is_refused_although_the_lock_file_was_deleted() {
    let site = used();
    let first = site.caught_up();
    fs::remove_file(site.path("state/lock")).unwrap();
    let output = site.ask(&["run", "site.toml"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(74), "{said}");
    assert!(
        said.contains("another slipwatch is at work on it"),
        "{said}"
    );
    first.stop();
}

/// Flips a bit in each of the values that were taken and the events that were said, one at a time.
#[test]
fn a_flipped_bit_in_what_was_taken_or_said_is_seen_at_the_next_start() {
    let site = used();
    let file = site.path("state/slipwatch.db");
    let changes = [
        "UPDATE step SET value = value + 0.0000001 WHERE seq = (SELECT max(seq) FROM step WHERE value IS NOT NULL)",
        "UPDATE step SET time = time + 1 WHERE seq = (SELECT min(seq) FROM step WHERE time IS NOT NULL)",
        "UPDATE event SET body = replace(body, '1', '3') WHERE seq = (SELECT min(seq) FROM event)",
    ];
    let whole = fs::read(&file).unwrap();
    for change in changes {
        fs::write(&file, &whole).unwrap();
        let database = Connection::open(&file).unwrap();
        assert_eq!(database.execute(change, []).unwrap(), 1, "{change}");
        drop(database);
        is_refused(&site, "is not what was written");
    }
    fs::write(&file, &whole).unwrap();
    site.caught_up().stop();
}

/// Values would go to another benchmark, or count for another length; `status` would show another figure.
#[test]
fn a_flipped_bit_in_what_a_series_is_or_in_a_newest_event_is_seen_by_whoever_opens_the_state() {
    let site = used();
    let file = site.path("state/slipwatch.db");
    let whole = fs::read(&file).unwrap();
    let replay = &["replay", "--state", "state"][..];
    let status = &["status", "--config", "site.toml"][..];
    for (change, looks) in [
        ("UPDATE series SET name = '4' WHERE name = '5'", replay),
        ("UPDATE series SET unit = 'm' WHERE unit = 'mm'", replay),
        (
            "UPDATE latest SET body = replace(body, '1', '3') WHERE kind = 'refit'",
            status,
        ),
        (
            "UPDATE latest SET benchmark = '4' WHERE kind = 'refit'",
            status,
        ),
    ] {
        fs::write(&file, &whole).unwrap();
        let database = Connection::open(&file).unwrap();
        assert_eq!(database.execute(change, []).unwrap(), 1, "{change}");
        drop(database);
        is_refused(&site, "is not what was written");
        let output = site.ask(looks);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(74), "{change}: {said}");
        assert!(said.contains("restore a backup"), "{change}: {said}");
    }
    fs::write(&file, &whole).unwrap();
    site.caught_up().stop();
}

#[test]
fn a_flipped_bit_in_the_memory_or_a_position_is_seen_and_both_are_made_anew() {
    let site = used();
    let before = site.proven_events();
    let file = site.path("state/slipwatch.db");
    let database = Connection::open(&file).unwrap();
    for table in ["memory", "position"] {
        let first = format!("SELECT name, body FROM {table} ORDER BY name LIMIT 1");
        let row = database.query_row(&first, [], |row| Ok((row.get(0)?, row.get(1)?)));
        let (name, mut body): (String, Vec<u8>) = row.unwrap();
        body[40] ^= 1;
        let flip = format!("UPDATE {table} SET body = ?2 WHERE name = ?1");
        let flipped = database.execute(&flip, rusqlite::params![name, body]);
        assert_eq!(flipped.unwrap(), 1, "{table}");
    }
    drop(database);
    site.caught_up().stop();
    assert!(
        site.log().contains("it is computed again"),
        "{}",
        site.log()
    );
    assert!(
        site.log().contains("from its start again"),
        "{}",
        site.log()
    );
    assert_eq!(site.values().len(), 200, "taken twice");
    assert!(site.proven_events().starts_with(&before));
}

/// All of a long record is judged again where the memory cannot be used: a stop on the way loses little of that.
#[test]
fn what_has_been_judged_again_is_saved_on_the_way_and_a_kill_does_not_begin_it_anew() {
    let site = used();
    let start = jiff::Timestamp::from_second(1_577_836_800).unwrap();
    let row = |row: i64| {
        let time =
            start + jiff::SignedDuration::from_hours(200) + jiff::SignedDuration::from_mins(row);
        format!("{time},{}\n", 200.0 + 0.016 * row as f64)
    };
    let running = site.caught_up();
    site.append("incoming/5.csv", &(1..=2600).map(row).collect::<String>());
    eventually("all readings", || site.values().len() == 2800);
    running.stop();
    let database = Connection::open(site.path("state/slipwatch.db")).unwrap();
    database
        .execute_batch("DELETE FROM memory; DELETE FROM meta WHERE name = 'memory_step'")
        .unwrap();
    drop(database);
    fs::write(site.path("log"), "").unwrap();
    let again = site.start(&[]);
    eventually("a part of it", || {
        site.log().contains("judged again so far: saved")
    });
    // Killed.
    drop(again);
    let database = Connection::open(site.path("state/slipwatch.db")).unwrap();
    let step = "SELECT value FROM meta WHERE name = 'memory_step'";
    let step: i64 = database.query_row(step, [], |row| row.get(0)).unwrap();
    assert!(step >= 2000, "{step}");
    drop(database);
    let before = site.proven_events();
    site.caught_up().stop();
    assert_eq!(site.values().len(), 2800, "taken twice");
    assert!(site.proven_events().starts_with(&before));
}

#[test]
fn a_flipped_bit_in_what_hooks_are_to_be_sent_is_seen_at_the_next_start() {
    let site = Site::new("");
    let rows = failing(0..114);
    site.append("incoming/5.csv", &format!("time,displacement_mm\n{rows}"));
    let program = site.caught_up();
    eventually("an alert", || !site.lines("notified").is_empty());
    program.stop();
    let file = site.path("state/slipwatch.db");
    let whole = fs::read(&file).unwrap();
    // Waiting or delivered, and how often it was tried, too: an alert that stands as delivered is not sent again.
    for flip in [
        "key = key || '1'",
        "status = 'delivered!'",
        "attempts = attempts + 4",
    ] {
        fs::write(&file, &whole).unwrap();
        let database = Connection::open(&file).unwrap();
        let flip = format!("UPDATE outbox SET {flip} WHERE id = (SELECT min(id) FROM outbox)");
        assert_eq!(database.execute(&flip, []).unwrap(), 1, "{flip}");
        drop(database);
        is_refused(&site, "is not what was written");
    }
}

#[test]
fn a_bit_that_flips_while_the_daemon_runs_is_reported() {
    for flip in [
        "UPDATE event SET body = replace(body, '1', '3') WHERE seq = (SELECT min(seq) FROM event)",
        "UPDATE series SET unit = 'm' WHERE unit = 'mm'",
        "UPDATE latest SET body = replace(body, '1', '3') WHERE kind = 'refit'",
    ] {
        let site = used();
        let listen = site.listen();
        let program = site.caught_up();
        eventually("ready", || get(&listen, "/readyz").contains("200 OK"));
        let database = Connection::open(site.path("state/slipwatch.db")).unwrap();
        assert_eq!(database.execute(flip, []).unwrap(), 1, "{flip}");
        drop(database);
        eventually(flip, || !get(&listen, "/readyz").contains("200 OK"));
        eventually("in the metrics", || {
            get(&listen, "/metrics").contains("slipwatch_store_damaged 1")
        });
        program.stop();
    }
}

#[test]
#[cfg_attr(
    not(has_own_mounts),
    ignore = "a process may not have mounts of its own here"
)]
fn a_file_system_that_becomes_read_only_under_the_daemon_is_said_to_be() {
    if !has_own_mounts(
        "database::a_file_system_that_becomes_read_only_under_the_daemon_is_said_to_be",
    ) {
        return;
    }
    let site = used();
    let state = site.path("state");
    let folder = state.to_str().unwrap();
    // It has its files open on the file system beneath.
    let program = site.caught_up();
    command(&["mount", "--bind", folder, folder]);
    command(&["mount", "-o", "remount,bind,ro", folder]);
    // While the daemon runs, what there is is shown.
    let status = site.printed(&["status", "--config", "site.toml"]);
    let status = status.replace("\n    ", " ");
    assert!(
        status.contains("FAULT since") && status.contains("read-only here"),
        "{status}"
    );
    let order = site.ask(&["alerts", "ack", "--config", "site.toml"]);
    let said = String::from_utf8_lossy(&order.stderr);
    assert!(
        !order.status.success() && said.contains("no order can be left"),
        "{said}"
    );
    program.stop();
}

#[test]
#[cfg_attr(
    not(has_own_mounts),
    ignore = "a process may not have mounts of its own here"
)]
fn a_state_on_a_read_only_file_system_is_said_to_be_there() {
    if !has_own_mounts("database::a_state_on_a_read_only_file_system_is_said_to_be_there") {
        return;
    }
    let site = used();
    let state = site.path("state");
    let folder = state.to_str().unwrap();
    command(&["mount", "--bind", folder, folder]);
    command(&["mount", "-o", "remount,bind,ro", folder]);
    for words in [
        &["status", "--config", "site.toml"][..],
        &["alerts", "silence", "--for", "1h", "--config", "site.toml"],
    ] {
        let output = site.ask(words);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success(), "{said}");
        assert!(
            said.contains("is on a read-only file system") && !said.contains("by user"),
            "{said}"
        );
    }
}

/// A copy that was made while a red was in force, and the red ended after it.
#[test]
fn a_backup_that_is_put_back_sends_again_what_was_in_force_and_the_next_red_is_notified() {
    let site = Site::new(
        "[[benchmark]]\nid = \"5\"\nsource = \"logger\"\n[[alert.threshold]]\nlevel = \"red\"\ndisplacement = \"100 mm\"\n",
    );
    let now = slipwatch::runtime::clock::now();
    let row = |minute: i64, value: f64| {
        format!(
            "{},{value}\n",
            now - jiff::SignedDuration::from_mins(60 - minute)
        )
    };
    site.append(
        "incoming/5.csv",
        &format!("time,displacement_mm\n{}{}", row(0, 0.0), row(10, 0.1)),
    );
    let program = site.caught_up();
    site.append("incoming/5.csv", &row(20, 130.0));
    site.awaits_red();
    site.printed(&["backup", "copy.db", "--config", "site.toml"]);
    let resolve = [
        "alerts",
        "resolve",
        "--benchmark",
        "5",
        "--by",
        "Ada",
        "--why",
        "a test",
    ];
    site.printed(&[&resolve[..], &["--config", "site.toml"]].concat());
    eventually("its end", || site.notified("5/red/", "resolved") == 1);
    program.stop();
    for name in ["slipwatch.db-wal", "slipwatch.db-shm"] {
        // Not there after an orderly stop.
        let _ = fs::remove_file(site.path("state").join(name));
    }
    fs::copy(site.path("copy.db"), site.path("state/slipwatch.db")).unwrap();
    let program = site.caught_up();
    eventually("the red again", || site.notified("5/red/", "firing") == 2);
    program.stop();
    let events = site.events();
    assert_eq!(
        events.matches("\"kind\":\"state-restored\"").count(),
        1,
        "{events}"
    );
    let program = site.caught_up();
    program.stop();
    assert_eq!(site.notified("5/red/", "firing"), 2, "once");
}
