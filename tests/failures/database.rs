//! 17: a database that must not be touched.

use crate::site::Site;
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
