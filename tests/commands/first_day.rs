//! The first day at a site, when something is not as it should be: what the files hardly mean, what operators do, what
//! the machine does not allow.

use crate::office::{Office, PROGRAM, ended, plain, rows, site};
use jiff::SignedDuration;
use slipwatch::reading::Timestamp;
use slipwatch::runtime::clock;
use std::fmt::Write as _;
use std::fs;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Stdio};

const STATUS: [&str; 3] = ["status", "--config", "site.toml"];

/// Hourly rows, the last of them `ends` from now.
fn recent(count: i64, ends: SignedDuration) -> String {
    let mut text = "time,P1_displacement_mm\n".to_owned();
    for row in 0..count {
        text += &recent_row(row, ends - SignedDuration::from_hours(count - 1 - row));
    }
    text
}

fn recent_row(row: i64, from_now: SignedDuration) -> String {
    format!("{},{}\n", clock::now() + from_now, 0.5 * row as f64)
}

fn json(office: &Office, args: &[&str]) -> serde_json::Value {
    let args = [args, &["--format", "json"]].concat();
    serde_json::from_str(&office.done(&args)).unwrap()
}

fn written(office: &Office) -> Vec<String> {
    let text = fs::read_to_string(office.path("hook.txt")).unwrap_or_default();
    text.lines().map(str::to_owned).collect()
}

/// What stands in the way of the words, each with the suspicion's name.
fn suspect_files() -> [(&'static str, String, &'static str); 4] {
    let table = |row: &dyn Fn(jiff::civil::DateTime, f64) -> String| {
        format!("time,P1_displacement_mm\n{}", rows(60, row))
    };
    let wobble = |value: f64| value * 0.01 + (value * 7.0).sin();
    // A fourth reading after the fall would show that it was a reset.
    let fallen = table(&|time, value| {
        let after = if value > 28.0 { -400.0 } else { 0.0 };
        format!("{time}+02:00,{:.3}\n", wobble(value) + after)
    });
    let metres = table(&|time, value| format!("{time}+02:00,{:.3}\n", 12.345 + value / 1000.0));
    let marked = plain(60).replace("+02:00,25\n", "+02:00,-999\n");
    let ahead = recent(60, SignedDuration::from_mins(58));
    [
        ("mark", marked, "-999 stands 1 time"),
        ("fall", fallen, "it fell by 401.935 mm, "),
        ("scale", metres, "if they are metres, say unit = \"m\""),
        (
            "ahead",
            ahead,
            "ahead of this machine's clock: is the time_zone",
        ),
    ]
}

#[test]
fn a_suspicion_is_in_the_status_once_in_the_log_and_the_benchmark_is_unknown_live_as_in_a_replay() {
    for (name, text, evidence) in suspect_files() {
        let office = Office::with(&[("slope.csv", &text), ("site.toml", &site("slope.csv", ""))]);
        let daemon = office.run_logged(&["run", "site.toml"]);
        let status = office.status_until("in force:");
        let whole = status.replace("\n    ", " ");
        let line = whole.lines().find(|line| line.contains("suspicion: "));
        assert!(
            line.is_some_and(|line| line.contains(evidence)),
            "{name}: {status}"
        );
        let row = status.lines().find(|line| line.starts_with("P1 ")).unwrap();
        assert!(row.contains("unknown"), "{name}: {status}");
        let status = json(&office, &STATUS);
        let one = &status["benchmarks"][0];
        assert_eq!(one["is_unknown"], true, "{status}");
        assert!(
            one["suspicions"][0].as_str().unwrap().contains(evidence),
            "{status}"
        );
        drop(daemon);
        let log = office.log();
        assert_eq!(log.matches("suspicion: ").count(), 1, "{name}: {log}");
        let events = office.done(&["events", "--config", "site.toml", "--format", "json"]);
        assert!(
            events.contains(&format!("\"rule\":\"suspect-{name}\"")),
            "{name}: {events}"
        );
        let again = office.done(&["replay", "--state", "state", "--format", "json"]);
        assert!(again.starts_with(&events), "{name}: {again}");
    }
}

#[test]
fn a_suspicion_that_is_put_right_in_the_config_is_over_in_status() {
    let (_, text, evidence) = suspect_files().into_iter().nth(2).unwrap();
    let benchmark = "[[benchmark]]\nid = \"P1\"\ncolumn = \"P1_displacement_mm\"\nquantity = \"displacement\"\n";
    let config = |unit: &str| site("slope.csv", &format!("{benchmark}unit = \"{unit}\"\n"));
    let office = Office::with(&[("slope.csv", &text), ("site.toml", &config("mm"))]);
    let daemon = office.run_logged(&["run", "site.toml"]);
    let status = office.status_until("suspicion");
    assert!(status.replace("\n    ", " ").contains(evidence), "{status}");
    drop(daemon);
    std::fs::write(office.path("site.toml"), config("m")).unwrap();
    let daemon = office.run_logged(&["run", "site.toml"]);
    office.until("the unit is taken", || {
        !office.done(&STATUS).contains("suspicion")
    });
    drop(daemon);
}

#[test]
fn a_suspicion_that_people_have_looked_into_is_accepted_in_the_config() {
    for (name, text, _) in suspect_files() {
        let more = format!("[[benchmark]]\nid = \"P1\"\naccept = [\"{name}\"]\n");
        let office = Office::with(&[
            ("slope.csv", &text),
            ("site.toml", &site("slope.csv", &more)),
        ]);
        assert!(
            !office.done(&["check", "site.toml"]).contains("suspicion"),
            "{name}"
        );
        let daemon = office.run_logged(&["run", "site.toml"]);
        office.until("all is read", || office.log().contains("caught up"));
        let status = office.done(&STATUS);
        assert!(!status.contains("suspicion"), "{name}: {status}");
        drop(daemon);
    }
    let more = "[[benchmark]]\nid = \"P1\"\naccept = [\"everything\"]\n";
    let office = Office::with(&[
        ("slope.csv", &plain(5)),
        ("site.toml", &site("slope.csv", more)),
    ]);
    let said = office.refused(78, &["check", "site.toml"]);
    assert!(said.contains("ahead, mark, fall, scale"), "{said}");
}

#[test]
fn twenty_thousand_bad_lines_are_few_lines_of_the_log_and_status_and_readyz_say_them() {
    let mut text = plain(30);
    for line in 0..20_000 {
        let _ = writeln!(text, "2017-06-05T00:00:00Z,bad{line}");
    }
    let free = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let office = Office::with(&[]);
    fs::create_dir_all(office.path("x/in")).unwrap();
    fs::write(office.path("x/in/slope.csv"), text).unwrap();
    let config =
        site("in/slope.csv", "").replace("[[source]]", &format!("listen = \"{free}\"\n[[source]]"));
    fs::write(office.path("x/site.toml"), config).unwrap();
    fs::write(
        office.path("site.toml"),
        site("x/in/slope.csv", "").replace("\"state\"", "\"x/state\""),
    )
    .unwrap();
    let daemon = office.run_logged(&["run", "x/site.toml"]);
    office.status_until("source logger: lines, records and files that could not be used: 20000");
    let ready = get(&free.to_string(), "/readyz");
    assert!(
        ready.contains("source logger: could not be used: 20000"),
        "{ready}"
    );
    drop(daemon);
    let status = office.done(&STATUS);
    assert!(status.contains("could not be used: 20000"), "{status}");
    let log = office.log();
    assert!(log.lines().count() < 60, "{log}");
    assert!(log.contains("x/in/slope.csv, line 32, column"), "{log}");
    for odd in ["x/in/x/in", "Counts {", "Reading {"] {
        assert!(!log.contains(odd), "{odd}: {log}");
    }
}

fn get(address: &str, path: &str) -> String {
    let mut stream = TcpStream::connect(address).unwrap();
    write!(
        stream,
        "GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"
    )
    .unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer
}

#[test]
fn the_end_of_an_alert_that_falls_into_a_silence_is_sent_after_it_and_a_red_keeps_its_since() {
    let more = "[[hook]]\nrun = [\"./notify.sh\"]\nlevels = [\"red\", \"unknown\"]\n[alert]\n\
                [[alert.threshold]]\nlevel = \"red\"\nvelocity = \"5 mm/day\"\n";
    let office = Office::with(&[
        ("slope.csv", &recent(60, SignedDuration::from_hours(-20))),
        ("site.toml", &site("slope.csv", more)),
        (
            "notify.sh",
            "#!/bin/sh\necho \"$SLIPWATCH_LEVEL $SLIPWATCH_STATE $SLIPWATCH_BENCHMARK\" >> hook.txt\n",
        ),
    ]);
    fs::set_permissions(office.path("notify.sh"), fs::Permissions::from_mode(0o755)).unwrap();
    let daemon = office.run_logged(&["run", "site.toml"]);
    // Until then the level is dated by the newest reading.
    office.until("the past", || {
        office
            .log()
            .contains("before the first start has been judged")
    });
    let text = office.status_until("red, unknown");
    let status = json(&office, &STATUS);
    let one = &status["benchmarks"][0];
    let time = |key: &str| one[key].as_str().unwrap().parse::<Timestamp>().unwrap();
    assert!(time("since") < time("unknown_since"), "{status}");
    let since = time("since").strftime("%Y-%m-%d %H:%MZ").to_string();
    let text = text.replace("\n    ", " ");
    let in_force = format!("{since}  P1  ALERT red firing");
    assert!(text.contains(&in_force), "{in_force}: {text}");
    assert!(one["chance_within_evacuation_time"].is_number(), "{status}");
    let reason = one["reason"].as_str().unwrap();
    assert!(
        text.contains(reason) && reason.contains("benchmark P1: red; "),
        "{text}"
    );
    office.until("the unknown is sent", || {
        written(&office).contains(&"unknown firing P1".to_owned())
    });
    let alerts = |words: &[&str]| {
        office.done(&[&["alerts"], words, &["--config", "site.toml"]].concat());
    };
    alerts(&["silence", "--for", "1h"]);
    office.status_until("silence until");
    let slope = office.path("slope.csv");
    let mut file = fs::File::options().append(true).open(slope).unwrap();
    file.write_all(recent_row(60, SignedDuration::ZERO).as_bytes())
        .unwrap();
    let resolved = "ALERT unknown resolved";
    office.until("it reads again", || {
        office
            .done(&["events", "--config", "site.toml", "--kind", "alert"])
            .contains(resolved)
    });
    std::thread::sleep(std::time::Duration::from_secs(2));
    let is_end = |line: &String| line == "unknown resolved P1";
    assert!(!written(&office).iter().any(is_end), "it was silenced");
    alerts(&["unshelve"]);
    office.until("the end is sent", || written(&office).iter().any(is_end));
    std::thread::sleep(std::time::Duration::from_secs(2));
    assert_eq!(
        written(&office).iter().filter(|line| is_end(line)).count(),
        1
    );
    drop(daemon);
}

/// As somebody who is not the daemon's user: in a shell of their own, or by a cron job.
#[test]
fn who_may_not_read_the_state_learns_which_path_and_whose_it_is() {
    let office = Office::with(&[
        ("slope.csv", &plain(30)),
        ("site.toml", &site("slope.csv", "")),
    ]);
    let daemon = office.run(&["run", "site.toml"]);
    office.status_until("P1");
    drop(daemon);
    let mode = |name: &str, mode: u32| {
        fs::set_permissions(office.path(name), fs::Permissions::from_mode(mode)).unwrap();
    };
    mode(".", 0o755);
    let as_other = |args: &[&str]| {
        let mut command = office.command(args);
        if nix::unistd::Uid::effective().is_root() {
            use std::os::unix::process::CommandExt;
            command.uid(65_534).gid(65_534);
        }
        ended(&command.output().unwrap())
    };
    let order = ["alerts", "silence", "--for", "1h", "--config", "site.toml"];
    for (folder, file, args, wanted) in [
        (
            0o000,
            0o600,
            &STATUS[..],
            "state cannot be looked into by user",
        ),
        (
            0o755,
            0o000,
            &STATUS,
            "state/slipwatch.db cannot be read by user",
        ),
        (
            0o755,
            0o444,
            &order,
            "slipwatch.db cannot be written to by user",
        ),
    ] {
        mode("state/slipwatch.db", file);
        mode("state", folder);
        let (exit, out, err) = as_other(args);
        assert!(
            exit != 0 && err.contains(wanted),
            "{exit}, {wanted}: {out}{err}"
        );
        assert!(
            err.contains("run this as ") && err.contains("sudo -u"),
            "{err}"
        );
        mode("state", 0o755);
    }
}

#[test]
fn a_benchmark_that_never_reads_is_dated_by_the_clock_and_not_by_the_year_1677() {
    let more = "[[benchmark]]\nid = \"P1\"\n[[benchmark]]\nid = \"P9\"\n[[hook]]\nrun = [\"/bin/sh\", \"hook.sh\"]\nlevels = [\"unknown\"]\n\
                [[cap]]\nfolder = \"cap\"\nlevels = [\"unknown\"]\nsender = \"a@b.org\"\narea = \"here\"\n";
    let office = Office::with(&[
        ("site.toml", &site("slope*.csv", more)),
        (
            "hook.sh",
            "echo $SLIPWATCH_TIME >> hook.txt\ncat >> hook.txt\n",
        ),
    ]);
    let before = clock::now();
    let daemon = office.run(&["run", "site.toml"]);
    office.until("it is reported", || !written(&office).is_empty());
    let first = written(&office)[0].parse::<Timestamp>().unwrap();
    let apart = first.duration_since(before).abs();
    assert!(apart < SignedDuration::from_mins(5), "{first}");
    for args in [
        &STATUS[..],
        &["alerts", "list", "--config", "site.toml"],
        &["events", "--config", "site.toml"],
    ] {
        let text = office.done(args);
        assert!(
            text.contains("before any reading") && !text.contains("1677"),
            "{text}"
        );
    }
    let status = json(&office, &STATUS);
    assert_eq!(
        status["benchmarks"][0]["unknown_since"],
        serde_json::Value::Null,
        "{status}"
    );
    assert_eq!(status["benchmarks"][0]["is_unknown"], true, "{status}");
    drop(daemon);
    for file in fs::read_dir(office.path("cap"))
        .into_iter()
        .flatten()
        .flatten()
    {
        let text = fs::read_to_string(file.path()).unwrap_or_default();
        assert!(!text.contains("<value>1677"), "{text}");
    }
}

#[test]
fn text_has_the_clocks_of_the_site_and_json_has_utc() {
    let config =
        site("slope.csv", "").replace("[[source]]", "time_zone = \"Europe/Rome\"\n[[source]]");
    let office = Office::with(&[("slope.csv", &plain(60)), ("site.toml", &config)]);
    let daemon = office.run(&["run", "site.toml"]);
    office.status_until("in force:");
    drop(daemon);
    for args in [
        &STATUS[..],
        &["events", "--config", "site.toml"],
        &["alerts", "list", "--config", "site.toml"],
        &["replay", "slope.csv", "--config", "site.toml"],
    ] {
        let text = office.done(args);
        assert!(text.contains("2017-06-03 11:00 CEST"), "{args:?}: {text}");
        assert!(
            !text.contains("2017-06-03T") && !text.contains("09:00Z"),
            "{args:?}: {text}"
        );
        let json = office.done(&[args, &["--format", "json"]].concat());
        assert!(
            json.contains("2017-06-03T09:00:00Z") && !json.contains("CEST"),
            "{args:?}: {json}"
        );
    }
}

#[test]
fn stdin_is_a_file_in_any_format() {
    let office = Office::with(&[
        ("slope.csv", &plain(60)),
        ("site.toml", &site("slope.csv", "")),
    ]);
    office.done(&["convert", "slope.csv", "slope.ndjson"]);
    office.done(&["convert", "slope.csv", "slope.mcap"]);
    let piped = |file: &str, args: &[&str]| {
        let input = fs::File::open(office.path(file)).unwrap();
        let output = office
            .command(args)
            .stdin(Stdio::from(input))
            .output()
            .unwrap();
        let (exit, out, err) = ended(&output);
        assert_eq!(exit, 0, "{args:?}: {err}");
        out
    };
    for file in ["slope.csv", "slope.ndjson", "slope.mcap"] {
        let from_file = office.done(&["replay", file, "--format", "json"]);
        assert_eq!(
            piped(file, &["replay", "-", "--format", "json"]),
            from_file,
            "{file}"
        );
        let fit = piped(file, &["fit", "-", "--format", "json"]);
        assert!(fit.contains("\"readings\":60"), "{fit}");
    }
    for args in [
        &["score", "-", "--no-failure"][..],
        &["explain", "-"],
        &["sweep", "-", "--steps", "2"],
    ] {
        assert!(!piped("slope.csv", args).is_empty(), "{args:?}");
    }
    let said = piped("site.toml", &["check", "-"]);
    assert!(
        said.starts_with("ok: ") && said.contains("60 readings"),
        "{said}"
    );
    let bad = Office::with(&[("bad.csv", "time,P1_displacement_mm\nnoon,1\n")]);
    let input = fs::File::open(bad.path("bad.csv")).unwrap();
    let output = bad
        .command(&["fit", "-"])
        .stdin(Stdio::from(input))
        .output()
        .unwrap();
    let (exit, _, err) = ended(&output);
    assert!(exit == 65 && err.starts_with("stdin, line 2"), "{err}");
}

#[test]
fn a_named_pipe_is_read_once_and_as_a_file_is() {
    let office = Office::with(&[("slope.csv", &plain(5000))]);
    office.done(&["convert", "slope.csv", "from_file.ndjson"]);
    let made = std::process::Command::new("mkfifo")
        .arg(office.path("pipe.csv"))
        .status();
    assert!(made.unwrap().success());
    let (pipe, text) = (office.path("pipe.csv"), plain(5000));
    // Where nobody reads it to its end this thread is left behind.
    std::thread::spawn(move || fs::write(pipe, text));
    let mut command = office.command(&["convert", "pipe.csv", "from_pipe.ndjson"]);
    let mut convert = crate::office::Daemon(command.stdout(Stdio::null()).spawn().unwrap());
    let mut ended = None;
    for _ in 0..crate::office::ATTEMPTS {
        ended = convert.0.try_wait().unwrap();
        if ended.is_some() {
            break;
        }
        std::thread::sleep(crate::office::PAUSE);
    }
    assert!(ended.is_some_and(|status| status.success()), "{ended:?}");
    let read = |name: &str| fs::read_to_string(office.path(name)).unwrap();
    assert!(read("from_pipe.ndjson") == read("from_file.ndjson"));
}

#[test]
fn a_loggers_table_in_a_csv_file_is_known_behind_a_byte_order_mark() {
    let body = (0..30).fold(String::new(), |mut text, hour| {
        let (day, hour_of_day) = (1 + hour / 24, hour % 24);
        let _ = writeln!(text, "\"2017-06-{day:02} {hour_of_day:02}:00:00\",{hour}");
        text
    });
    let text = format!(
        "\u{feff}\"TOA5\",\"CR1000\",\"CR1000\",\"1\",\"OS\",\"CPU:p.CR1\",\"2\",\"Hourly\"\n\"TIMESTAMP\",\"P1_displacement\"\n\"TS\",\"mm\"\n\"\",\"Smp\"\n{body}"
    );
    let office = Office::with(&[("slope.csv", &text)]);
    let fit = office.done(&["fit", "slope.csv", "--format", "json"]);
    assert!(fit.contains("\"readings\":30"), "{fit}");
    office.done(&["init", "slope.csv", "--time-zone", "UTC"]);
    let config = fs::read_to_string(office.path("site.toml")).unwrap();
    assert!(config.contains("kind = \"toa5\""), "{config}");
}

#[test]
fn a_state_that_no_user_could_open_is_no_matter_of_the_user() {
    let office = Office::with(&[
        ("slope.csv", &plain(30)),
        ("site.toml", &site("slope.csv", "")),
    ]);
    fs::create_dir_all(office.path("state/slipwatch.db")).unwrap();
    let (exit, out, err) = office.say(&STATUS);
    assert!(exit != 0 && out.is_empty(), "{exit}: {out}");
    assert!(
        err.contains("unable to open database file") && !err.contains("by user"),
        "{err}"
    );
}

#[test]
fn every_example_of_a_message_is_a_line_that_a_file_may_hold() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/messages.md");
    let page = fs::read_to_string(page).unwrap();
    let lines: Vec<&str> = page.lines().filter(|line| line.starts_with('{')).collect();
    let text = lines.join("\n") + "\n";
    assert_eq!(text.lines().count(), 5, "{text}");
    let config = site("slope.ndjson", "").replace("\"csv\"", "\"ndjson\"");
    let office = Office::with(&[("slope.ndjson", &text), ("site.toml", &config)]);
    let said = office.done(&["check", "site.toml"]);
    for part in [
        "2 readings of displacement",
        "1 readings of velocity",
        "covariate lake_level_m (logger): 1 values, m",
        "covariate rain_mm",
    ] {
        assert!(said.contains(part), "no {part:?} in {said}");
    }
    assert!(!said.contains("refused"), "{said}");
}

#[test]
fn what_looks_odd_in_a_report_is_explained_there() {
    let recording = |name: &str| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("recordings")
            .join(name);
        path.to_str().unwrap().to_owned()
    };
    let preonzo = recording("preonzo-2012.mcap");
    let office = Office::with(&[]);
    let fit = office.done(&["fit", &preonzo, "--benchmark", "E3"]);
    for part in [" *", "outside of its interval", "The two regimes differ"] {
        assert!(fit.contains(part), "no {part:?} in {fit}");
    }
    let plain = office.done(&[
        "fit",
        &recording("vaiont-1963-reconstruction.mcap"),
        "--benchmark",
        "5",
    ]);
    assert!(!plain.contains("regimes differ"), "{plain}");
    let failure = ["--failure-time", "2012-05-15T01:30:00Z"];
    let score = office.done(&[&["score", &preonzo, "--benchmark", "E3"], &failure[..]].concat());
    assert!(
        score.contains("panel") && !score.contains("river"),
        "{score}"
    );
    let faster = rows(30, |time, value| {
        let value = value + 4.0 * (value - 8.0).max(0.0);
        format!("{time}+02:00,{value}\n")
    });
    let config = site(
        "slope.csv",
        "[alert]\n[[alert.threshold]]\nlevel = \"yellow\"\nvelocity = \"30 mm/day\"\n",
    );
    let faster = format!("time,P1_displacement_mm\n{faster}");
    let office = Office::with(&[("slope.csv", &faster), ("site.toml", &config)]);
    let events = office.done(&["replay", "slope.csv", "--config", "site.toml"]);
    let wanted = " (five times the record's length, shorter than the outlook of 30 days)";
    assert!(events.contains(wanted), "{events}");
}

#[test]
fn the_readme_says_of_which_commands_the_output_has_a_format() {
    let office = Office::with(&[]);
    let readme = Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md");
    let readme = fs::read_to_string(readme).unwrap();
    let without = ["demo", "plot", "schema", "completions", "man"];
    let said =
        "All but `demo`, `plot`, `schema`, `completions` and `man` take `--format text|json`";
    assert!(readme.contains(said));
    let all = [
        "demo",
        "init",
        "run",
        "check",
        "doctor",
        "replay",
        "status",
        "events",
        "alerts list",
        "backup",
        "fit",
        "sweep",
        "explain",
        "score",
        "plot",
        "simulate",
        "convert",
        "hook test",
        "schema",
        "completions",
        "man",
    ];
    for command in all {
        let args: Vec<&str> = command.split(' ').chain(["--help"]).collect();
        let has = office.done(&args).contains("--format <FORMAT>");
        assert_eq!(has, !without.contains(&command), "{command}");
    }
}

#[test]
#[cfg_attr(not(is_root), ignore = "only root can become another user")]
fn doctor_tries_it_as_the_user_that_will_do_it() {
    let office = Office::with(&[
        ("slope.csv", &plain(5)),
        ("site.toml", &site("slope.csv", "")),
    ]);
    let mode = |name: &str, mode: u32| {
        fs::set_permissions(office.path(name), fs::Permissions::from_mode(mode)).unwrap();
    };
    fs::create_dir(office.path("state")).unwrap();
    mode("", 0o755);
    mode("state", 0o700);
    mode("slope.csv", 0o600);
    // Where that user can reach it.
    fs::copy(PROGRAM, office.path("slipwatch")).unwrap();
    mode("slipwatch", 0o755);
    let examine = |user: &[&str]| {
        let mut command = Command::new(office.path("slipwatch"));
        command
            .args(["doctor", "site.toml"])
            .args(user)
            .current_dir(office.folder.path());
        loop {
            match command.output() {
                // A test beside this one may have begun a process while the copy was open for writing.
                Err(error) if error.kind() == std::io::ErrorKind::ExecutableFileBusy => {
                    std::thread::sleep(std::time::Duration::from_millis(50));
                }
                output => return ended(&output.unwrap()),
            }
        }
    };
    let (_, out, _) = examine(&[]);
    assert!(
        out.contains("looked at as root, who may do everything"),
        "{out}"
    );
    let (exit, out, err) = examine(&["--user", "nobody"]);
    assert_eq!(exit, 1, "{out}{err}");
    for part in [
        "nothing can be written to state",
        "slope.csv cannot be read as this user",
        "checked as user",
    ] {
        let line = out.lines().find(|line| line.contains(part));
        assert!(line.is_some(), "no {part:?} in {out}");
    }
    let (exit, _, err) = examine(&["--user", "nosuchuser"]);
    assert!(
        exit == 2 && err.contains("there is no user nosuchuser"),
        "{err}"
    );
}
