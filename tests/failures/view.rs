//! What an operator sees.

use crate::notified::failing;
use crate::site::{Site, eventually, get};
use jiff::SignedDuration;
use nix::sys::resource::{Resource, getrlimit, setrlimit};
use slipwatch::runtime::clock;
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs;
use std::io::Write;
use std::net::TcpStream;
use std::os::unix::ffi::OsStrExt;
use std::time::Duration;

const HEADER: &str = "time,displacement_mm\n";

#[test]
fn what_cannot_be_read_is_seen_until_it_can() {
    let site = Site::new("[[source]]\nid = \"far\"\nkind = \"csv\"\npath = \"mount/*.csv\"\n");
    let listen = site.listen();
    site.append("incoming/header.csv", "when,what\n1,2\n");
    // It ends in the middle.
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    let text = format!("{HEADER}{}", failing(0..20));
    packer.write_all(text.as_bytes()).unwrap();
    let packed = packer.finish().unwrap();
    let half = &packed[..packed.len() / 2];
    fs::write(site.path("incoming/5.csv.gz"), half).unwrap();
    let program = site.caught_up();
    let status = || site.printed(&["status", "--config", "site.toml"]);
    let faults = || status().matches("\nFAULT since ").count();
    eventually("all three", || faults() == 3);
    let said = status().replace("\n    ", " ");
    for text in [
        "mount cannot be listed",
        "header.csv is refused",
        "5.csv.gz cannot be read",
    ] {
        assert!(said.contains(text), "{said}");
    }
    for kind in ["folder-unreadable", "file-refused", "file-unreadable"] {
        let metric = format!("slipwatch_faults{{kind=\"{kind}\",source=");
        assert!(get(&listen, "/metrics").contains(&metric), "{kind}");
        let key = format!("\"kind\":\"{kind}\"");
        assert!(get(&listen, "/api/status").contains(&key), "{kind}");
    }
    fs::create_dir(site.path("mount")).unwrap();
    fs::write(site.path("incoming/5.csv.gz"), &packed).unwrap();
    fs::remove_file(site.path("incoming/header.csv")).unwrap();
    eventually("none", || faults() == 0);
    eventually("its readings", || site.values().len() == 20);
    // Another daemon has met none of the last one's faults.
    program.stop();
    assert!(!status().contains("FAULT"), "{}", status());
}

#[test]
fn a_benchmark_that_never_gave_a_reading_is_seen_and_unknown_from_the_start() {
    let ids = ["absent", "refused", "nan", "strange"];
    let benchmarks: String = ids
        .map(|id| format!("[[benchmark]]\nid = \"{id}\"\nsource = \"logger\"\n"))
        .concat();
    let site = Site::new(&benchmarks);
    let listen = site.listen();
    site.append("incoming/refused.csv", "when,what\n1,2\n");
    site.append(
        "incoming/nan.csv",
        "time,displacement_mm\n2020-01-01T00:00:00Z,NAN\n2020-01-02T00:00:00Z,NAN\n",
    );
    let strange = site
        .path("incoming")
        .join(OsStr::from_bytes(b"strange\xff.csv"));
    fs::write(strange, format!("{HEADER}{}", failing(0..20))).unwrap();
    let program = site.caught_up();
    let metrics = get(&listen, "/metrics");
    let status = site.printed(&["status", "--config", "site.toml"]);
    for id in ids {
        let line = format!("slipwatch_benchmark_unknown{{benchmark=\"{id}\"}} 1");
        assert!(metrics.contains(&line), "{metrics}");
        let row = status.lines().find(|line| line.starts_with(id)).unwrap();
        assert!(row.contains("unknown"), "{status}");
        eventually("notified", || {
            site.notified(&format!("{id}/unknown/"), "firing") == 1
        });
    }
    assert!(
        site.log().contains("its name is no UTF-8"),
        "{}",
        site.log()
    );
    site.append(
        "incoming/absent.csv",
        &format!("{HEADER}{}", failing(0..114)),
    );
    eventually("its end", || {
        site.notified("absent/unknown/", "resolved") == 1
    });
    assert!(
        get(&listen, "/metrics").contains("slipwatch_benchmark_unknown{benchmark=\"absent\"} 0")
    );
    program.stop();
    site.caught_up().stop();
    assert_eq!(
        site.notified("nan/unknown/", "firing"),
        1,
        "notified again after a restart"
    );
    site.proven_events();
}

#[test]
fn three_readings_and_then_silence_are_unknown() {
    let site = Site::new("");
    site.append("incoming/5.csv", &format!("{HEADER}{}", failing(90..93)));
    let program = site.caught_up();
    eventually("notified", || site.notified("5/unknown/", "firing") == 1);
    program.stop();
    site.proven_events();
}

/// The alert of what is unknown stands beside the level of its benchmark.
#[test]
fn an_unknown_in_force_is_unacknowledged_until_somebody_acknowledges_it() {
    let site = Site::new("[[benchmark]]\nid = \"5\"\nsource = \"logger\"\n");
    let program = site.caught_up();
    eventually("notified", || site.notified("5/unknown/", "firing") == 1);
    let state = || {
        let words = ["--config", "site.toml", "--format", "json"];
        let alert = site.printed(&[&["alerts", "show", "5/unknown"], &words[..]].concat());
        let alert: serde_json::Value = serde_json::from_str(&alert).unwrap();
        (alert["state"].clone(), alert["alarm_state"].clone())
    };
    assert_eq!(state(), ("firing".into(), "unacknowledged".into()));
    let ask = |words: &[&str]| {
        let words = [
            &["alerts"],
            words,
            &["--by", "Ada", "--config", "site.toml"],
        ]
        .concat();
        assert!(site.ask(&words).status.success(), "{words:?}");
    };
    ask(&["ack"]);
    eventually("acknowledged", || {
        state() == ("firing".into(), "acknowledged".into())
    });
    ask(&["silence", "--for", "1h"]);
    eventually("silenced", || {
        state() == ("firing".into(), "suppressed".into())
    });
    ask(&["unsilence"]);
    eventually("not silenced", || {
        state() == ("firing".into(), "acknowledged".into())
    });
    site.append("incoming/5.csv", &format!("{HEADER}{}", failing(0..114)));
    eventually("its end", || {
        state() == ("resolved".into(), "normal".into())
    });
    program.stop();
    site.proven_events();
}

#[test]
fn a_benchmark_that_is_unknown_is_so_after_a_restart_too() {
    let site = Site::new("");
    let listen = site.listen();
    site.append("incoming/5.csv", &format!("{HEADER}{}", failing(0..60)));
    let is_unknown = || {
        let metrics = get(&listen, "/metrics");
        metrics.contains("slipwatch_benchmark_unknown{benchmark=\"5\"} 1")
            && get(&listen, "/api/status").contains("\"is_unknown\":true")
    };
    let program = site.caught_up();
    eventually("unknown", is_unknown);
    program.stop();
    let program = site.caught_up();
    assert!(is_unknown());
    program.stop();
}

/// Without the saved memory every step is gone through again, which takes a while.
#[test]
fn what_was_unknown_is_shown_so_before_the_stored_steps_have_been_gone_through() {
    let site = Site::new("[[benchmark]]\nid = \"absent\"\nsource = \"logger\"\n");
    let listen = site.listen();
    let silent = ["5", "6", "7", "8"];
    let benchmarks =
        silent.map(|id| format!("[[benchmark]]\nid = \"{id}\"\nsource = \"logger\"\n"));
    let text = fs::read_to_string(site.path("site.toml")).unwrap();
    fs::write(
        site.path("site.toml"),
        format!("{text}{}", benchmarks.concat()),
    )
    .unwrap();
    for id in silent {
        let file = format!("incoming/{id}.csv");
        site.append(&file, &format!("{HEADER}{}", failing(0..60)));
    }
    let all = ["5", "6", "7", "8", "absent"];
    let missing = || {
        let (metrics, status) = (get(&listen, "/metrics"), get(&listen, "/api/status"));
        let line = |id: &&str| format!("slipwatch_benchmark_unknown{{benchmark=\"{id}\"}} 1");
        let mut missing: Vec<&str> = all
            .into_iter()
            .filter(|id| !metrics.contains(&line(id)))
            .collect();
        if status.matches("\"is_unknown\":true").count() != all.len() {
            missing.push("status");
        }
        missing
    };
    let program = site.caught_up();
    eventually("unknown", || missing().is_empty());
    program.stop();
    let database = rusqlite::Connection::open(site.path("state/slipwatch.db")).unwrap();
    database.execute("DELETE FROM memory", []).unwrap();
    drop(database);
    let program = site.start(&[]);
    eventually("a start", || site.log().contains("listening"));
    for _ in 0..200 {
        let (is_over, missing) = (site.log().contains("caught up"), missing());
        assert!(missing.is_empty(), "{missing:?}: {}", site.log());
        if is_over {
            break;
        }
    }
    eventually("caught up", || site.log().contains("caught up"));
    assert!(missing().is_empty());
    program.stop();
}

#[test]
fn a_state_folder_that_was_removed_is_not_ready() {
    let site = Site::new("");
    let listen = site.listen();
    site.append("incoming/5.csv", &format!("{HEADER}{}", failing(0..20)));
    let program = site.caught_up();
    eventually("ready", || get(&listen, "/readyz").contains("200 OK"));
    fs::remove_dir_all(site.path("state")).unwrap();
    eventually("not ready", || {
        get(&listen, "/readyz").contains("cannot be written")
    });
    program.let_go();
}

#[test]
fn two_thousand_connections_that_ask_nothing_shut_nobody_out() {
    let site = Site::new("");
    let listen = site.listen();
    let program = site.caught_up();
    // This process holds the other ends.
    let (soft, hard) = getrlimit(Resource::RLIMIT_NOFILE).unwrap();
    setrlimit(Resource::RLIMIT_NOFILE, hard.min(soft.max(4096)), hard).unwrap();
    let mut held = Vec::new();
    for _ in 0..2000 {
        held.push(TcpStream::connect(&listen).unwrap());
    }
    assert!(get(&listen, "/healthz").contains("200 OK"));
    program.stop();
}

#[test]
fn a_name_with_a_line_break_in_it_forges_no_line_anywhere() {
    let site = Site::new("");
    let listen = site.listen();
    let forged = "x\n7  red  2026-01-01\u{1b}[2J";
    fs::write(site.path("incoming/5.mcap"), recording(forged)).unwrap();
    let program = site.caught_up();
    eventually("a reading", || !site.values().is_empty());
    let status = site.printed(&["status", "--config", "site.toml"]);
    assert!(
        !status.lines().any(|line| line.starts_with("7  red")),
        "{status}"
    );
    assert!(!status.contains('\u{1b}'), "{status}");
    let checked = site.ask(&["check", "site.toml"]);
    for said in [&checked.stdout, &checked.stderr] {
        let said = String::from_utf8_lossy(said);
        assert!(
            !said.lines().any(|line| line.starts_with("7  red")) && !said.contains('\u{1b}'),
            "{said}"
        );
    }
    let checked = String::from_utf8_lossy(&checked.stdout);
    assert!(checked.contains(r"benchmark x\n7  red"), "{checked}");
    let metrics = get(&listen, "/metrics");
    // The format's own line break, and a backslash that stands for itself.
    let label = r#"slipwatch_benchmark_level{benchmark="x\n7  red  2026-01-01\\u{1b}[2J"}"#;
    assert!(metrics.contains(label), "{metrics}");
    eventually("notified", || !site.lines("notified").is_empty());
    let notified = fs::read_to_string(site.path("notified")).unwrap();
    // The hook's echo makes one space of several.
    assert!(
        notified.starts_with("x 7 red 2026-01-01 [2J/unknown/"),
        "{notified}"
    );
    assert_eq!(notified.lines().count(), 1, "{notified}");
    program.stop();
    assert!(
        !site.log().lines().any(|line| line.starts_with("7  red")),
        "{}",
        site.log()
    );
}

/// A recording with one reading of a benchmark of this name.
fn recording(name: &str) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let options = mcap::WriteOptions::new().use_chunks(false);
    let mut writer = options.create(&mut bytes).unwrap();
    let topic = format!("/benchmarks/{name}/displacement");
    let channel = writer
        .add_channel(0, &topic, "json", &BTreeMap::default())
        .unwrap();
    // So long ago that the benchmark has fallen silent, and not so long that nobody is to be notified of it.
    let time = clock::now() - SignedDuration::from_hours(20 * 24);
    let nanoseconds = u64::try_from(time.as_nanosecond()).unwrap();
    let header = mcap::records::MessageHeader {
        channel_id: channel,
        sequence: 0,
        log_time: nanoseconds,
        publish_time: nanoseconds,
    };
    let body = format!(r#"{{"time":"{time}","value":1.0,"unit":"mm"}}"#);
    writer
        .write_to_known_channel(&header, body.as_bytes())
        .unwrap();
    writer.finish().unwrap();
    drop(writer);
    bytes.into_inner()
}

/// Two benchmarks that rain and a lake move, with eight covariates beside them.
fn moved_by_water(rows: i32) -> String {
    let mut text = "time,rain_mm,lake_level_m,temp_c,pore_kpa,tide_m,flow_m3_s,wind_m_s,snow_mm,\
                    a_displacement_mm,b_displacement_mm\n"
        .to_owned();
    let now = clock::now();
    let (mut level, mut slip) = (0.0_f64, [0.0, 0.0]);
    for row in 0..rows {
        let time = now - SignedDuration::from_hours(4 * i64::from(rows - 1 - row));
        let chance = |seed: i32| f64::from((row * 7919 + seed * 104_729).rem_euclid(997)) / 997.0;
        let rain = if chance(1) < 0.2 {
            20.0 * chance(2)
        } else {
            0.0
        };
        level = 0.95 * level + 0.1 * rain;
        let phase = f64::from(row);
        let others = [
            rain,
            level,
            10.0 + 5.0 * (phase / 30.0).sin(),
            20.0 + 3.0 * level,
            (phase * 0.9).sin(),
            5.0 + level,
            9.0 * chance(3),
            (phase / 90.0).sin().max(0.0),
        ];
        text += &time.to_string();
        for value in others {
            text += &format!(",{value:.4}");
        }
        for (index, slip) in (0..).zip(&mut slip) {
            *slip += 0.5 * (0.3 * level).exp() * (1.0 + 0.02 * f64::from(index));
            text += &format!(",{:.4}", *slip + 0.2 * chance(4 + index));
        }
        text.push('\n');
    }
    text
}

#[test]
fn a_search_that_is_at_work_does_not_hold_the_work_loop() {
    let site = Site::new("");
    let listen = site.listen();
    site.append("incoming/all.csv", &moved_by_water(150));
    let program = site.start(&[]);
    eventually("a start", || site.log().contains("listening"));
    let (mut searches, mut longest) = (0.0_f64, 0.0_f64);
    for _ in 0..600 {
        let metrics = get(&listen, "/metrics");
        let figure = |name: &str| -> f64 {
            let line = metrics.lines().find(|line| line.starts_with(name)).unwrap();
            line.rsplit_once(' ').unwrap().1.parse().unwrap()
        };
        searches = searches.max(figure("slipwatch_searches "));
        longest = longest.max(figure("slipwatch_work_loop_idle_seconds "));
        if site.log().contains("caught up") {
            break;
        }
        std::thread::sleep(Duration::from_millis(200));
    }
    assert!(site.log().contains("caught up"));
    assert!(searches > 0.0, "no search was made");
    assert!(longest < 15.0, "the work loop stood still for {longest} s");
    assert!(get(&listen, "/healthz").contains("200 OK"));
    program.stop();
}

/// A benchmark that the config names is unknown until it has read, on a first start with history too.
#[test]
fn a_named_benchmark_with_history_is_not_unknown_in_the_metrics() {
    let site = Site::new("[[benchmark]]\nid = \"5\"\nsource = \"logger\"\n");
    let listen = site.listen();
    let rows: String = (0..60)
        .map(|hour| {
            let time = clock::now() - SignedDuration::from_hours(60 - hour);
            format!(
                "{time},{:.2}\n",
                0.3 * hour as f64 + 0.1 * (hour as f64).sin()
            )
        })
        .collect();
    site.append("incoming/5.csv", &format!("{HEADER}{rows}"));
    let program = site.caught_up();
    eventually("known", || {
        let metrics = get(&listen, "/metrics");
        metrics.contains("slipwatch_benchmark_unknown{benchmark=\"5\"} 0")
    });
    program.stop();
}
