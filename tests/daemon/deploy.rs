//! What lies in `deploy/` fits the program: the unit, the package, the rules, the dashboard.

use slipwatch::config;
use slipwatch::reading::BenchmarkId;
use slipwatch::runtime::serve::{Limits, ListenOptions, Server};
use slipwatch::runtime::vitals::Vitals;
use std::collections::BTreeSet;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::Arc;
use std::time::Duration;

fn root() -> PathBuf {
    env!("CARGO_MANIFEST_DIR").into()
}

fn text(name: &str) -> String {
    std::fs::read_to_string(root().join(name)).unwrap()
}

/// Runs a tool in the repository.
fn tool(name: &str, arguments: &[&str]) -> Output {
    let mut command = Command::new(name);
    command.args(arguments).current_dir(root());
    let output = command.stdin(Stdio::null()).output();
    output.unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn said(output: &Output) -> String {
    let streams = [&output.stdout, &output.stderr];
    streams.map(|bytes| String::from_utf8_lossy(bytes)).concat()
}

#[test]
#[cfg_attr(
    not(has_systemd_analyze),
    ignore = "systemd-analyze was not found by build.rs"
)]
fn the_units_are_hardened_to_a_score_of_two_or_lower() {
    for unit in [
        "deploy/slipwatch.service",
        "deploy/slipwatch-report.service",
    ] {
        let arguments = [
            "security",
            "--offline=yes",
            "--threshold=20",
            "--no-pager",
            unit,
        ];
        let output = tool("systemd-analyze", &arguments);
        assert!(output.status.success(), "{}", said(&output));
    }
}

#[test]
#[cfg_attr(
    not(has_systemd_analyze),
    ignore = "systemd-analyze was not found by build.rs"
)]
fn the_weekly_report_is_written_from_the_daemons_state_by_its_own_user() {
    let unit = text("deploy/slipwatch-report.service");
    for line in [
        "ExecStart=slipwatch report --config /etc/slipwatch/site.toml --last 7d -o /var/lib/slipwatch/reports",
        "User=slipwatch",
        "DynamicUser=yes",
        "StateDirectory=slipwatch",
    ] {
        assert!(unit.lines().any(|had| had == line), "{line}");
    }
    let timer = text("deploy/slipwatch-report.timer");
    let calendar = timer
        .lines()
        .find_map(|line| line.strip_prefix("OnCalendar="));
    let output = tool("systemd-analyze", &["calendar", calendar.unwrap()]);
    assert!(output.status.success(), "{}", said(&output));
}

#[test]
fn the_command_of_the_weekly_report_writes_a_page_from_a_state() {
    let unit = text("deploy/slipwatch-report.service");
    let command = unit
        .lines()
        .find_map(|line| line.strip_prefix("ExecStart=slipwatch "));
    let folder = tempfile::tempdir().unwrap();
    let site = "[site]\nname = \"A slope\"\nstate_dir = \"state\"\n[[source]]\nid = \"l\"\nkind = \"csv\"\npath = \"in.csv\"\n\
                [[benchmark]]\nid = \"<5>\"\nsource = \"l\"\n[[benchmark]]\nid = \"never\"\nsource = \"l\"\n";
    std::fs::write(folder.path().join("site.toml"), site).unwrap();
    let state = folder.path().join("state");
    let store = slipwatch::store::Store::open(&state).unwrap();
    let mut batch = slipwatch::store::Batch::default();
    for hour in 0..24 * 20 {
        let time: jiff::Timestamp = "2026-01-01T00:00:00Z".parse().unwrap();
        let time = time + jiff::SignedDuration::from_hours(hour);
        let input = slipwatch::monitor::Input::Reading {
            benchmark: BenchmarkId::new("<5>"),
            unit: slipwatch::reading::Unit::MM,
            averaging: None,
            reading: slipwatch::reading::Reading {
                time,
                value: hour as f64,
                sigma: None,
            },
        };
        batch.step(time, &input, &[]);
    }
    store.commit(&batch).unwrap();
    let words = command.unwrap().split(' ').map(|word| match word {
        "/etc/slipwatch/site.toml" => "site.toml",
        "/var/lib/slipwatch/reports" => "reports",
        word => word,
    });
    let output = Command::new(env!("CARGO_BIN_EXE_slipwatch"))
        .args(words)
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", said(&output));
    let page = folder.path().join("reports/report-2026-01-20.html");
    let page = std::fs::read_to_string(page).unwrap();
    assert!(page.contains("<h1>A slope</h1>") && page.contains("Benchmark &lt;5&gt;"));
    // Of a week, to the end; the figures show four weeks before it too.
    assert!(
        page.contains("169 readings, 2026-01-13 23:00Z to 2026-01-20 23:00Z"),
        "{page:.2000}"
    );
    // One that has never read is in it.
    assert!(
        page.contains("never</a>: nothing is known; no reading since 2026-01-13 23:00Z"),
        "{page:.2000}"
    );
}

#[test]
fn the_unit_waits_for_readiness_feeds_the_watchdog_and_checks_before_it_starts_or_reloads() {
    let unit = text("deploy/slipwatch.service");
    for line in [
        "Type=notify",
        "WatchdogSec=120",
        "ExecStartPre=slipwatch check --config-only /etc/slipwatch/site.toml",
        "ExecStart=slipwatch run /etc/slipwatch/site.toml",
        "ExecReload=slipwatch check --config-only /etc/slipwatch/site.toml",
        "ExecReload=kill -HUP $MAINPID",
        "Restart=always",
    ] {
        assert!(unit.lines().any(|had| had == line), "{line}");
    }
}

/// Every name of ours in `text`.
fn metric_names(text: &str) -> BTreeSet<String> {
    let is_part = |c: char| c.is_ascii_lowercase() || c == '_' || c.is_ascii_digit();
    let words = text.split(|c| !is_part(c));
    let ours = words.filter(|word| word.starts_with("slipwatch_"));
    ours.map(str::to_owned).collect()
}

/// What `/metrics` has when there is something to say about everything.
async fn exposed() -> BTreeSet<String> {
    let vitals = Arc::new(Vitals::default());
    let time = "2017-06-06T17:00:00Z".parse().unwrap();
    vitals.read(&BenchmarkId::new("5"), time, &[], Duration::ZERO);
    let refit = include_str!("deploy/refit.json");
    let refit = serde_json::from_str(refit).unwrap();
    vitals.read(&BenchmarkId::new("5"), time, &[refit], Duration::ZERO);
    vitals.update(|health| {
        health.outbox_oldest = Some(time);
        health.database_bytes = Some(1);
        health.quarantined.insert("logger".to_owned(), 1);
    });
    let options = ListenOptions {
        listen: "127.0.0.1:0".parse().unwrap(),
        token: None,
        limits: Limits::default(),
    };
    let server = Server::start(options, vitals, None).await.unwrap();
    let mut stream = TcpStream::connect(server.address()).unwrap();
    let request = "GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n";
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    let samples = answer.lines().filter(|line| line.starts_with("slipwatch_"));
    let names = samples.filter_map(|line| line.split(['{', ' ']).next());
    names.map(str::to_owned).collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn rules_and_dashboard_ask_only_for_metrics_that_there_are_and_the_dashboard_for_all() {
    let exposed = exposed().await;
    let rules = metric_names(&text("deploy/prometheus-rules.yml"));
    let dashboard = metric_names(&text("deploy/grafana-dashboard.json"));
    assert!(rules.len() > 10 && dashboard.len() > 15);
    for name in rules.union(&dashboard) {
        assert!(exposed.contains(name), "{name} not in {exposed:#?}");
    }
    // What is left out: what the histogram consists of, and what only a number line shows.
    let quiet = [
        "slipwatch_refit_seconds_count",
        "slipwatch_refit_seconds_sum",
        "slipwatch_uptime_seconds",
        "slipwatch_benchmark_last_refit_seconds",
    ];
    let unasked = exposed.difference(&dashboard).map(String::as_str);
    let unasked: Vec<&str> = unasked.filter(|name| !quiet.contains(name)).collect();
    assert_eq!(unasked, [""; 0]);
}

#[test]
#[cfg_attr(not(has_promtool), ignore = "promtool was not found by build.rs")]
fn the_rules_are_ones_that_prometheus_takes() {
    let arguments = ["check", "rules", "deploy/prometheus-rules.yml"];
    let output = tool("promtool", &arguments);
    assert!(output.status.success(), "{}", said(&output));
}

#[test]
fn the_dashboard_is_json_and_every_panel_asks_the_chosen_data_source() {
    let dashboard: serde_json::Value =
        serde_json::from_str(&text("deploy/grafana-dashboard.json")).unwrap();
    let panels = dashboard["panels"].as_array().unwrap();
    let mut numbers = BTreeSet::new();
    for panel in panels {
        assert_eq!(panel["datasource"]["uid"], "${datasource}", "{panel}");
        assert!(numbers.insert(panel["id"].as_u64().unwrap()), "{panel}");
    }
}

#[test]
fn the_packages_own_config_is_right_and_opens_to_this_machine_only() {
    let config = config::load(&root().join("deploy/debian/site.toml")).unwrap();
    assert!(config.warnings.is_empty(), "{:?}", config.warnings);
    assert!(config.site.listen.unwrap().ip().is_loopback());
    assert_eq!(config.site.state_dir, Path::new("/var/lib/slipwatch"));
    let unit = text("deploy/slipwatch.service");
    assert!(unit.contains("StateDirectory=slipwatch"));
    assert!(unit.contains("BindReadOnlyPaths=-/srv/slipwatch/incoming"));
}

fn package() -> toml::Table {
    let manifest: toml::Table = text("Cargo.toml").parse().unwrap();
    manifest["package"]["metadata"]["deb"]
        .as_table()
        .unwrap()
        .clone()
}

#[test]
fn what_the_package_takes_is_there_and_its_config_is_the_administrators() {
    let package = package();
    let mut placed = BTreeSet::new();
    for asset in package["assets"].as_array().unwrap() {
        let word = |index: usize| asset[index].as_str().unwrap();
        let (from, to) = (word(0), word(1));
        assert!(
            from.starts_with("target/package/") || root().join(from).is_file(),
            "{from}"
        );
        placed.insert(format!("/{to}"));
    }
    for file in package["conf-files"].as_array().unwrap() {
        assert!(placed.contains(file.as_str().unwrap()), "{file}");
    }
}

#[test]
#[cfg_attr(
    not(has_cargo_deb),
    ignore = "cargo-deb and dpkg-deb were not found by build.rs"
)]
fn the_built_package_holds_the_program_the_unit_the_manual_and_the_completions() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let program = env!("CARGO_BIN_EXE_slipwatch");
    let built = tool("deploy/package.sh", &[out, program]);
    assert!(built.status.success(), "{}", said(&built));
    let file = std::fs::read_dir(folder.path()).unwrap().next().unwrap();
    let file = file.unwrap().path();
    let contents = tool("dpkg-deb", &["--contents", file.to_str().unwrap()]);
    let contents = said(&contents);
    for wanted in [
        "-rwxr-xr-x ./usr/bin/slipwatch",
        "-rw-r--r-- ./usr/lib/systemd/system/slipwatch.service",
        "-rw-r--r-- ./usr/lib/systemd/system/slipwatch-report.timer",
        "-rw-r--r-- ./usr/share/man/man1/slipwatch-run.1.gz",
        "-rw-r--r-- ./usr/share/man/man5/slipwatch-config.5.gz",
        "-rw-r--r-- ./usr/share/bash-completion/completions/slipwatch",
        "-rw-r--r-- ./etc/slipwatch/site.toml",
        "-rwxr-xr-x ./etc/slipwatch/notify.sh",
        "-rw-r--r-- ./usr/share/doc/slipwatch/examples/prometheus-rules.yml",
    ] {
        let squeezed = contents.lines().map(|line| {
            let words: Vec<&str> = line.split_whitespace().collect();
            format!("{} {}", words[0], words[words.len() - 1])
        });
        assert!(
            squeezed.into_iter().any(|had| had == wanted),
            "{wanted} not in\n{contents}"
        );
    }
    let conf_files = tool("dpkg-deb", &["--info", file.to_str().unwrap(), "conffiles"]);
    assert_eq!(said(&conf_files).lines().count(), 2);
}
