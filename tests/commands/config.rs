//! What the site file may say, and the exact words when it is wrong.

use slipwatch::alert::Level;
use slipwatch::config::{self, ConfigError, SourceKind};
use slipwatch::monitor::Explain;
use slipwatch::reading::{BenchmarkId, CovariateKind, SummerTime};
use std::path::Path;

const RIGHT: &str = r#"[site]
name = "Toc"
state_dir = "state"
[[source]]
id = "logger"
kind = "csv"
path = "incoming/*.csv"
[[hook]]
run = ["./notify.sh"]
"#;

fn problems(text: &str) -> Vec<String> {
    match config::parse(text, Path::new("site.toml")) {
        Err(ConfigError::Invalid { problems }) => {
            problems.iter().map(ToString::to_string).collect()
        }
        other => panic!("taken as right: {other:?}"),
    }
}

fn problem(addition: &str) -> String {
    let mut problems = problems(&format!("{RIGHT}{addition}"));
    assert_eq!(problems.len(), 1, "{problems:#?}");
    problems.remove(0)
}

#[test]
fn the_example_config_is_right_and_says_what_it_means() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/example.toml");
    let config = config::load(&file).unwrap();
    assert!(config.warnings.is_empty(), "{:?}", config.warnings);
    assert_eq!(config.site.name, "Monte Toc");
    assert_eq!(config.site.state_dir, file.parent().unwrap().join("state"));
    let kinds: Vec<SourceKind> = config.sources.iter().map(|source| source.kind).collect();
    assert_eq!(
        kinds,
        [
            SourceKind::Csv,
            SourceKind::Csv,
            SourceKind::Csv,
            SourceKind::Toa5,
            SourceKind::Mcap
        ]
    );
    let office = &config.sources[1].dialect;
    assert_eq!(office.time_columns, ["Date", "Time"]);
    assert_eq!(office.number("12,5"), Some(12.5));
    let day_zero = "2017-01-01T00:00:00Z".parse().unwrap();
    assert_eq!(config.sources[2].epoch, Some(day_zero));
    let campbell = &config.sources[3].conventions;
    assert_eq!(campbell.clock.summer_time, SummerTime::Standard);
    assert_eq!(campbell.clock.zone, Some(config.site.time_zone.clone()));
    assert!(campbell.missing.has("9999.0") && campbell.missing.has("BAD"));
    assert_eq!(config.benchmarks.len(), 4);
    let gnss = config.benchmarks[3].vector.as_ref().unwrap();
    let length: f64 = gnss.direction.iter().map(|part| part * part).sum();
    assert!((length - 1.0).abs() < 1e-12 && gnss.direction[2] < 0.0);
    let policy = &config.settings.policy;
    assert_eq!(policy.evacuation_time.as_hours(), 12);
    assert!((policy.critical_velocity_mm_per_day - 1000.0).abs() < 1e-9);
    assert_eq!(policy.thresholds.len(), 2);
    assert_eq!(policy.thresholds[1].acceleration_mm_per_day2, Some(5.0));
    let rules = &policy.rules;
    assert_eq!(rules.len(), 2);
    assert_eq!(
        rules[0].words(None),
        "velocity of 30 mm/day or more and chance of collapse of 0.02 or more within 12h and until the next reading, for 2h"
    );
    assert_eq!(
        (rules[1].level, rules[1].lasting.is_zero()),
        (Level::Orange, true)
    );
    let own = &config.settings.benchmarks[&BenchmarkId::new("upper")];
    assert_eq!(own.rules, policy.rules, "inherited");
    assert_eq!(own.evacuation_time.as_hours(), 6);
    // The site's 24 h go with its own evacuation time of 12 h.
    assert_eq!(own.red_within().as_hours(), 12);
    assert_eq!(policy.red_within().as_hours(), 24);
    assert_eq!(own.thresholds, policy.thresholds, "inherited");
    assert!(config.hooks[0].levels.contains(&Level::Unknown));
    assert!(config.hooks[0].program().is_file(), "the sample hook");
}

#[test]
fn a_heartbeat_is_checked_as_a_webhook_is() {
    for (lines, parts) in [
        (
            "url = \"ftp://a/b\"",
            [
                "site.toml:11:7",
                "heartbeat.url = \"ftp://a/b\" is neither http nor https",
            ],
        ),
        (
            "url = \"http://a/b\"\nevery = \"1ms\"",
            ["site.toml:12:9", "a second or more"],
        ),
        (
            "url = \"http://a/b\"\nca_file = \"a.pem\"",
            [
                "site.toml:12:11",
                "heartbeat.ca_file is not used without TLS",
            ],
        ),
        ("every = \"1m\"", ["site.toml:10", "heartbeat.url"]),
    ] {
        let said = problem(&format!("[[heartbeat]]\n{lines}\n"));
        for part in parts {
            assert!(said.contains(part), "{lines}: {said}");
        }
    }
}

#[test]
fn check_doubts_two_hooks_that_run_the_same_for_the_same_alerts() {
    let doubts = |levels: &str| {
        let more =
            format!("levels = [\"red\"]\n[[hook]]\nrun = [\"./notify.sh\"]\nlevels = [{levels}]\n");
        let config = config::parse(&format!("{RIGHT}{more}"), Path::new("site.toml")).unwrap();
        config
            .warnings
            .iter()
            .map(ToString::to_string)
            .collect::<String>()
    };
    let said = doubts("\"orange\", \"red\"");
    assert!(said.contains("it is run once for each of these"), "{said}");
    assert_eq!(doubts("\"orange\", \"unknown\""), "");
}

#[test]
fn two_hooks_whose_command_lines_read_the_same_are_refused() {
    let other = |run: &str| format!("{RIGHT}[[hook]]\nrun = [{run}]\n");
    let text =
        other("\"./notify.sh\", \"a b\"") + "[[hook]]\nrun = [\"./notify.sh\", \"a\", \"b\"]\n";
    let said = problems(&text).join("\n");
    assert!(said.contains("named \"./notify.sh a b\""), "{said}");
    config::parse(
        &other("\"./notify.sh\", \"a\", \"b\""),
        Path::new("site.toml"),
    )
    .unwrap();
}

#[test]
fn check_names_benchmarks_whose_own_red_reaches_nobody() {
    let doubts = |hooks: &str| {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("site.toml");
        let (of_site, _) = RIGHT.split_once("[[hook]]").unwrap();
        let benchmarks = ["P1", "P2", "P3"].map(|id| format!("[[benchmark]]\nid = \"{id}\"\n"));
        std::fs::write(&file, format!("{of_site}{hooks}{}", benchmarks.concat())).unwrap();
        config::check(&file).unwrap().warnings.join("\n")
    };
    let hook = |more: &str| format!("[[hook]]\nrun = [\"./notify.sh\"]\n{more}\n");
    let said = doubts(&hook("benchmarks = [\"P1\"]"));
    assert!(
        said.contains("asks for P2, P3: nobody is notified of their red"),
        "{said}"
    );
    let said = doubts(&hook("site = true"));
    assert!(said.contains("no hook of the red of a benchmark"), "{said}");
    let said = doubts(&(hook("site = true") + "[[hook]]\nrun = [\"./other.sh\"]\n"));
    assert!(!said.contains("nobody is notified of"), "{said}");
}

#[test]
fn a_link_that_nobody_could_follow_is_refused() {
    let said = |lines: &str| {
        let text = RIGHT.replace("name =", &format!("{lines}\nname ="));
        problems(&text).join("\n")
    };
    let listen = "listen = \"127.0.0.1:8642\"\n";
    for (lines, parts) in [
        (
            "public_url = \"https://a.example\"",
            ["site.toml:2:14", "without site.listen"],
        ),
        (
            "public_url = \"a.example\"",
            [
                "site.toml:2:14",
                "site.public_url = \"a.example\" is neither http nor https",
            ],
        ),
        (
            &format!("public_url = \"https://a.example/?b=1\"\n{listen}"),
            ["site.toml:2:14", "has more than a path"],
        ),
        (
            "acknowledge_within = \"soon\"",
            [
                "site.toml:2:22",
                "site.acknowledge_within = \"soon\" cannot be used",
            ],
        ),
    ] {
        let said = said(lines);
        for part in parts {
            assert!(said.contains(part), "{said}");
        }
    }
    let text = RIGHT.replace(
        "name =",
        &format!("{listen}public_url = \"http://a.example/b/\"\nname ="),
    );
    let config = config::parse(&text, Path::new("site.toml")).unwrap();
    let links = config.hooks[0].links.as_ref().unwrap();
    assert_eq!(links.public_url, "http://a.example/b");
    assert!(
        config.warnings[0].to_string().contains("without TLS"),
        "{:?}",
        config.warnings
    );
}

#[test]
fn a_topic_that_alerts_cannot_be_published_to_is_refused() {
    for (lines, parts) in [
        (
            "url = \"mqtt://a:1\"",
            ["site.toml:10", "mqtt_out.topic is missing"],
        ),
        (
            "url = \"http://a\"\ntopic = \"a\"",
            [
                "site.toml:11:7",
                "mqtt_out.url = \"http://a\" cannot be used",
            ],
        ),
        (
            "url = \"mqtt://a:1\"\ntopic = \"a/+\"",
            ["site.toml:12:9", "without + and #"],
        ),
        (
            "url = \"mqtt://a:1\"\ntopic = \"a\"\nca_file = \"b\"",
            [
                "site.toml:13:11",
                "mqtt_out.ca_file is not used without TLS",
            ],
        ),
    ] {
        let said = problem(&format!("[[mqtt_out]]\n{lines}\n"));
        for part in parts {
            assert!(said.contains(part), "{said}");
        }
    }
}

#[test]
fn corrections_for_alertmanager_are_refused() {
    let said = problem(
        "[[webhook]]\nurl = \"http://127.0.0.1:9093/api/v2/alerts\"\nformat = \"alertmanager\"\ncorrections = true\n",
    );
    assert!(
        said.contains("webhook.corrections with format = \"alertmanager\""),
        "{said}"
    );
}

#[test]
fn a_drill_that_reaches_nobody_or_never_ends_is_refused() {
    let hook = "[[hook]]\nrun = [\"./drilled.sh\"]\ndrills = true\n";
    for (lines, parts) in [
        (
            "[drill]\nevery = \"7d\"".to_owned(),
            ["site.toml:10", "no hook has drills = true"],
        ),
        (
            format!("{hook}[drill]\nevery = \"1s\""),
            ["site.toml:14:9", "drill.every = \"1s\" cannot be used"],
        ),
        (
            format!("{hook}[drill]\nat = \"10:00\""),
            ["site.toml:13", "drill.every is missing"],
        ),
        (
            format!("{hook}[drill]\nevery = \"7d\"\nat = \"ten\""),
            ["site.toml:15:6", "drill.at = \"ten\" cannot be used"],
        ),
        (
            format!("{hook}[drill]\nevery = \"1h\"\nacknowledge_within = \"2h\""),
            ["site.toml:15:22", "not shorter than every"],
        ),
        (
            format!("{hook}[drill]\nevery = \"7d\"\n[[benchmark]]\nid = \"exercise\""),
            ["site.toml:13", "\"exercise\" is a benchmark"],
        ),
    ] {
        let said = problem(&format!("{lines}\n"));
        for part in parts {
            assert!(said.contains(part), "{said}");
        }
    }
}

#[test]
fn a_rule_that_cannot_be_meant_is_refused_where_it_stands() {
    let rule = |lines: &str| format!("[[alert.rule]]\nname = \"near\"\nlevel = \"red\"\n{lines}\n");
    for (text, parts) in [
        (
            rule("all = [\"velocity 20\"]"),
            [
                "site.toml:13:8",
                "\"velocity 20\" is no condition of an alert.rule",
                "50 mm/day",
            ],
        ),
        (
            rule("all = [\"chance 5 within 12h\"]"),
            [
                "site.toml:13:8",
                "\"chance 5 within 12h\"",
                "over 0 and up to 1",
            ],
        ),
        (
            rule("any = [\"rain 20 mm\"]"),
            ["site.toml:13:8", "\"rain 20 mm\"", "unexplained-residual"],
        ),
        (
            rule(""),
            ["site.toml:10", "under either all or any", "add all ="],
        ),
        (
            rule("all = [\"velocity 2 mm/day\"]\nany = [\"velocity 2 mm/day\"]"),
            ["site.toml:10", "under either all or any", "add all ="],
        ),
        (
            rule("all = [\"velocity 2 mm/day\"]").replace("near", "near one"),
            [
                "site.toml:11:8",
                "\"near one\" cannot stand in an alert",
                "letters",
            ],
        ),
        (
            rule("all = [\"velocity 2 mm/day\"]").repeat(2),
            ["site.toml:15:8", "\"near\" is there twice", "own name"],
        ),
    ] {
        let said = problem(&text);
        for part in parts {
            assert!(said.contains(part), "{text}{said}");
        }
    }
}

#[test]
fn the_least_config_is_taken_with_the_defaults() {
    let config = config::parse(RIGHT, Path::new("site.toml")).unwrap();
    assert_eq!(
        config.settings,
        slipwatch::monitor::Settings {
            site: Some(slipwatch::monitor::SiteLevel::Worst),
            watched: slipwatch::monitor::Watched {
                open: [("logger".to_owned(), "; written as usual".to_owned())].into(),
                ..slipwatch::monitor::Watched::default()
            },
            ..slipwatch::monitor::Settings::default()
        },
        "nothing given, nothing changed but that there is a site"
    );
    assert_eq!(config.hooks[0].timeout.as_secs(), 10);
    assert!(config.benchmarks.is_empty());
}

#[test]
fn what_is_done_about_the_unexplained_is_read_and_wrong_words_are_refused() {
    let explain = |addition: &str| {
        let text = format!("{RIGHT}[explain]\n{addition}");
        let config = config::parse(&text, Path::new("site.toml")).unwrap();
        (config.settings.explain, config.warnings.len())
    };
    assert_eq!(explain(""), (Explain::Adopt, 0));
    assert_eq!(explain("adopt = false\n"), (Explain::Report, 0));
    assert_eq!(explain("search = false\n"), (Explain::Off, 0));
    assert_eq!(
        explain("search = false\nadopt = true\n"),
        (Explain::Off, 1),
        "adopting without a search is doubtful"
    );
    assert_eq!(
        problem("[explain]\nadopts = true\n"),
        "site.toml:11:1: error: unknown key explain.adopts; known here: search, adopt"
    );
    assert_eq!(
        problem("[explain]\nsearch = \"no\"\n"),
        "site.toml:11:10: error: explain.search is of type string, not true or false; \
         write search = true"
    );
}

#[test]
fn a_column_that_does_not_say_its_unit_needs_one() {
    assert_eq!(
        problem("[[benchmark]]\nid = \"5\"\ncolumn = \"ext_1\"\n"),
        "site.toml:12:10: error: benchmark.column = \"ext_1\" does not say its unit; \
         add unit = with the one that the column is in, such as \"mm\", \"m\" or \"mm_per_day\""
    );
    let in_brackets = "[[benchmark]]\nid = \"5\"\ncolumn = \"P1 East [m]\"\n";
    let text = format!("{RIGHT}{in_brackets}");
    let config = config::parse(&text, Path::new("site.toml")).unwrap();
    let metres = slipwatch::reading::Unit::parse("m").unwrap();
    let own = config.benchmarks.iter().find(|one| one.id.as_str() == "5");
    assert_eq!(own.unwrap().unit, Some(metres));
    let unit = "[[benchmark]]\nid = \"5\"\ncolumn = \"ext_1\"\nunit = \"mm_per_h\"\n";
    assert!(config::parse(&format!("{RIGHT}{unit}"), Path::new("site.toml")).is_ok());
}

#[test]
fn a_bad_unit_is_named_with_its_line_and_the_fix() {
    assert_eq!(
        problem("[alert]\ncritical_velocity = \"1 furlong/day\"\n"),
        "site.toml:11:21: error: alert.critical_velocity = \"1 furlong/day\" cannot be used; \
         write a positive number and a unit: \"50 mm/day\" or \"1 m/day\""
    );
}

#[test]
fn what_a_covariate_measures_is_read_and_what_cannot_be_is_refused_with_its_line() {
    let one = |column: &str, kind: &str| {
        format!("[[covariate]]\ncolumn = \"{column}\"\nkind = \"{kind}\"\n")
    };
    let right = format!("{RIGHT}{}{}", one("Nied_1h", "rain"), one("Pegel", "level"));
    let config = config::parse(&right, Path::new("site.toml")).unwrap();
    let stated: Vec<(&str, CovariateKind)> = (config.settings.covariates.iter())
        .map(|(column, kind)| (column.as_str(), *kind))
        .collect();
    assert_eq!(
        stated,
        [
            ("Nied_1h", CovariateKind::Rain),
            ("Pegel", CovariateKind::Level)
        ]
    );
    assert_eq!(
        problem(&one("Nied_1h", "snow")),
        "site.toml:12:8: error: covariate.kind = \"snow\" cannot be used; \
         write one of rain, flow, level, temperature, humidity, pressure, other"
    );
    assert_eq!(
        problem("[[covariate]]\ncolumn = \"Nied_1h\"\n"),
        "site.toml:10:1: error: covariate.kind is missing; add kind = \"rain\""
    );
    assert_eq!(
        problem(&one("Pegel", "level").repeat(2)),
        "site.toml:14:10: error: covariate.column = \"Pegel\" is there twice; state each column once"
    );
    let benchmark = "[[benchmark]]\nid = \"5\"\ncolumn = \"ext_1\"\nunit = \"mm\"\n";
    assert_eq!(
        problem(&format!("{benchmark}{}", one("ext_1", "rain"))),
        "site.toml:15:10: error: covariate.column = \"ext_1\" holds the readings of benchmark \"5\"; \
         name a column that no [[benchmark]] takes"
    );
}

#[test]
fn an_unknown_key_is_refused_with_the_known_ones() {
    assert_eq!(
        problem("[alert]\nevacuation_tme = \"12h\"\n"),
        "site.toml:11:1: error: unknown key alert.evacuation_tme; known here: evacuation_time, \
         outlook, red_within, critical_velocity, steady_for, red_chance, orange_chance, yellow_chance, threshold, rule"
    );
    assert_eq!(
        problem("[allert]\n"),
        "site.toml:10:2: error: unknown key allert; known here: site, source, alert, explain, \
         benchmark, event, covariate, hook, webhook, cap, mqtt_out, heartbeat, drill"
    );
}

#[test]
fn an_id_that_is_there_twice_is_refused() {
    assert_eq!(
        problem("[[benchmark]]\nid = \"5\"\n[[benchmark]]\nid = \"5\"\n"),
        "site.toml:13:6: error: benchmark.id = \"5\" is there twice; give each its own id"
    );
    assert_eq!(
        problem("[[source]]\nid = \"logger\"\nkind = \"mcap\"\npath = \"x.mcap\"\n"),
        "site.toml:11:6: error: source.id = \"logger\" is there twice; give each its own id"
    );
}

#[test]
fn a_benchmark_that_names_a_missing_source_is_refused() {
    assert_eq!(
        problem("[[benchmark]]\nid = \"5\"\nsource = \"lager\"\n"),
        "site.toml:12:10: error: benchmark.source = \"lager\" is no [[source]]; \
         known sources: logger"
    );
}

#[test]
fn a_duration_of_zero_is_refused() {
    assert_eq!(
        problem("[alert]\nevacuation_time = \"0h\"\n"),
        "site.toml:11:19: error: alert.evacuation_time = \"0h\" cannot be used; \
         write a duration longer than zero, such as \"12h\""
    );
    assert!(problem("timeout = \"0s\"\n").contains("site.toml:10:11: error: hook.timeout"));
}

#[test]
fn a_kind_that_is_not_built_yet_says_so() {
    assert_eq!(
        problem("[[source]]\nid = \"b\"\nkind = \"nats\"\npath = \"x\"\n"),
        "site.toml:12:8: error: source.kind = \"nats\" cannot be used; \
         not yet supported; supported: csv, ndjson, toa5, mcap, mqtt"
    );
}

#[test]
fn all_problems_are_reported_together_in_the_order_of_the_file() {
    let found = problems(
        "[site]\nname = 5\n[[source]]\nid = \"a\"\nkind = \"csv\"\npath = \"in/*/*.csv\"\n\
         [alert]\noutlook = \"30\"\nred_chance = 5\n[[hook]]\nrun = []\nlevels = [\"purple\"]\n",
    );
    let lines: Vec<&str> = found
        .iter()
        .map(|problem| problem.split(' ').next().unwrap())
        .collect();
    assert_eq!(
        lines,
        [
            "site.toml:1:1:",
            "site.toml:2:8:",
            "site.toml:6:8:",
            "site.toml:8:11:",
            "site.toml:9:14:",
            "site.toml:11:7:",
            "site.toml:12:11:"
        ],
        "{found:#?}"
    );
}

#[test]
fn what_is_no_toml_is_reported_with_its_place() {
    let found = problems("[site\nname = \"Toc\"\n");
    assert!(found[0].starts_with("site.toml:1:6: error: "), "{found:?}");
}

#[test]
fn a_policy_that_cannot_mean_anything_is_a_warning() {
    let warning = |keys: &str| {
        let text = format!("{RIGHT}[alert]\n{keys}\n");
        let config = config::parse(&text, Path::new("site.toml")).unwrap();
        let each: Vec<String> = config.warnings.iter().map(ToString::to_string).collect();
        each.join("\n")
    };
    assert_eq!(
        warning("evacuation_time = \"20d\"\noutlook = \"30d\""),
        "site.toml:11:19: warning: red looks 960h ahead, further than outlook 720h: red would be \
         called before orange; make outlook several times evacuation_time"
    );
    assert_eq!(
        warning("evacuation_time = \"12h\"\nred_within = \"6h\""),
        "site.toml:11:19: warning: red_within 6h is shorter than evacuation_time 12h: red would be \
         called too late; leave red_within out: it is twice evacuation_time then"
    );
    for (keys, part) in [
        (
            "red_chance = 0.9999",
            "red_chance 0.9999 is so high that few collapses are called in time; leave it out: it is 0.27 then",
        ),
        ("orange_chance = 0.99", "leave it out: it is 0.7 then"),
        (
            "critical_velocity = \"0.01 mm/day\"",
            "critical_velocity 0.01 mm/day: slopes creep faster than that for years",
        ),
        (
            "critical_velocity = \"1000 m/day\"",
            "few slopes are ever read at such a velocity",
        ),
        (
            "[[hook]]\nrun = [\"./notify.sh\"]\ntimeout = \"30d\"",
            "hook.timeout 720h: while an attempt hangs for so long",
        ),
    ] {
        let said = warning(keys);
        assert!(said.contains(part), "{said}");
    }
    let usual = format!("{RIGHT}[alert]\nred_chance = 0.4\ncritical_velocity = \"2 m/day\"\n");
    let config = config::parse(&usual, Path::new("site.toml")).unwrap();
    assert!(config.warnings.is_empty(), "{:?}", config.warnings);
}

#[test]
fn check_warns_of_spans_that_can_hardly_be_meant_and_of_thresholds_that_a_benchmark_loses() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("site.toml");
    let warnings = |text: &str| {
        std::fs::write(&file, text).unwrap();
        config::check(&file).unwrap().warnings.join("\n")
    };
    let threshold = |table: &str, level: &str, figure: &str| {
        format!("[[{table}.threshold]]\nlevel = \"{level}\"\n{figure}\n")
    };
    let own = "[[benchmark]]\nid = \"5\"\n[benchmark.alert]\n";
    let text = |reorder: &str, evacuation: &str| {
        format!(
            "[site]\nname = \"Toc\"\nstate_dir = \"state\"\n[[source]]\nid = \"logger\"\nkind = \"csv\"\n\
             path = \"*.csv\"\nreorder = \"{reorder}\"\n[alert]\nevacuation_time = \"{evacuation}\"\noutlook = \"400d\"\n{}{}{own}{}",
            threshold("alert", "orange", "velocity = \"5 mm/day\""),
            threshold(
                "alert",
                "red",
                "velocity = \"50 mm/day\"\ndisplacement = \"1 m\""
            ),
            threshold("benchmark.alert", "red", "velocity = \"80 mm/day\""),
        )
    };
    let said = warnings(&text("10d", "60d"));
    for part in [
        "source \"logger\": reorder = 240h",
        "evacuation_time = 1440h, 60 days",
        "these do not hold for it: orange at velocity 5 mm/day, red at displacement 1000 mm;",
    ] {
        assert!(said.contains(part), "no {part:?} in {said}");
    }
    let said = warnings(&text("24h", "30d"));
    assert!(
        !said.contains("reorder") && !said.contains("evacuation_time ="),
        "{said}"
    );
    assert!(!said.contains("red at velocity"), "it has its own: {said}");
}

#[test]
fn check_warns_when_the_sampling_cannot_protect_and_when_the_hook_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("site.toml");
    let addition = "[[benchmark]]\nid = \"5\"\naveraging = \"24h\"\n\
                    [alert]\nevacuation_time = \"12h\"\n";
    std::fs::write(&file, format!("{RIGHT}{addition}")).unwrap();
    let summary = config::check(&file).unwrap();
    let warnings = summary.warnings.join("\n");
    assert_eq!(summary.warnings.len(), 3, "{warnings}");
    assert!(
        warnings.contains("averaging 24h is not shorter"),
        "{warnings}"
    );
    assert!(warnings.contains("there is no program"), "{warnings}");
    assert!(warnings.contains("there is no folder"), "{warnings}");
}

#[test]
fn how_a_source_writes_its_tables_is_checked() {
    let source = |kind: &str, lines: &str| {
        format!("[[source]]\nid = \"b\"\nkind = \"{kind}\"\npath = \"b.txt\"\n{lines}")
    };
    let cases = [
        (
            "csv",
            "delimiter = \"|\"\n",
            "14:13: error: source.delimiter = \"|\" cannot be used; write comma, semicolon or tab",
        ),
        (
            "csv",
            "time_format = \"dd.mm.yyyy\"\n",
            "14:15: error: source.time_format = \"dd.mm.yyyy\" cannot be used; write a pattern",
        ),
        (
            "csv",
            "time_column = 1\n",
            "14:15: error: source.time_column is of type integer, not a string",
        ),
        (
            "csv",
            "skip_lines = 1.5\n",
            "14:14: error: source.skip_lines = 1.5 is no number of lines; write a whole number from 0 to 1000",
        ),
        (
            "ndjson",
            "skip_lines = 2\n",
            "14:14: error: source.skip_lines does nothing for this kind; leave it out",
        ),
        (
            "csv",
            "thousands = \"point\"\n",
            "14:13: error: source.thousands = \"point\" is what stands before the decimals too; write thousands = \"point\" beside",
        ),
        (
            "csv",
            "thousands = \"dot\"\n",
            "14:13: error: source.thousands = \"dot\" cannot be used; write comma, point, blank or apostrophe",
        ),
        (
            "toa5",
            "thousands = \"comma\"\n",
            "14:13: error: source.thousands does nothing for this kind; leave it out",
        ),
        (
            "toa5",
            "decimal = \"comma\"\n",
            "14:11: error: source.decimal does nothing for this kind; leave it out",
        ),
    ];
    for (kind, lines, expected) in cases {
        let found = problem(&source(kind, lines));
        assert!(
            found.starts_with(&format!("site.toml:{expected}")),
            "{found}"
        );
    }
}

#[test]
fn how_a_source_writes_times_and_missing_values_is_checked() {
    let source =
        |lines: &str| format!("[[source]]\nid = \"b\"\nkind = \"toa5\"\npath = \"b.dat\"\n{lines}");
    let cases = [
        (
            "time_zone = \"Roma\"\n",
            "14:13: error: source.time_zone = \"Roma\" cannot be used; write an IANA name",
        ),
        (
            "dst = \"standard\"\n",
            "14:7: error: source.dst is given without source.time_zone",
        ),
        (
            "time_zone = \"Europe/Rome\"\ndst = \"winter\"\n",
            "15:7: error: source.dst = \"winter\" cannot be used; write reject",
        ),
        (
            "missing = -7999\n",
            "14:11: error: source.missing is of type integer, not a list; write missing = [-7999",
        ),
        (
            "missing = [true]\n",
            "14:12: error: source.missing is of type boolean, not a number or a string",
        ),
    ];
    for (lines, expected) in cases {
        let found = problem(&source(lines));
        assert!(
            found.starts_with(&format!("site.toml:{expected}")),
            "{found}"
        );
    }
}

#[test]
fn a_vector_without_a_direction_or_a_unit_is_refused() {
    let cases = [
        (
            "components = [\"east_mm\", \"north_mm\"]\n",
            "are not both given",
        ),
        (
            "components = [\"east_mm\", \"north_mm\"]\ndirection = [1]\n",
            "1 numbers for 2 components",
        ),
        (
            "components = [\"east_mm\", \"north_mm\"]\ndirection = [0, 0.0]\n",
            "is no direction",
        ),
        (
            "components = [\"east_mm\", \"north_cm\"]\ndirection = [1, 1]\n",
            "do not all say one unit",
        ),
        (
            "column = \"x_mm\"\nunit = \"mm\"\ncomponents = [\"east\", \"north\"]\ndirection = [1, 1]\n",
            "do not go with",
        ),
    ];
    for (lines, expected) in cases {
        let found = problem(&format!("[[benchmark]]\nid = \"5\"\n{lines}"));
        assert!(found.contains(expected), "{found}");
    }
}

#[test]
fn a_broker_is_read_its_password_never_logged_and_a_wrong_address_refused() {
    let source = "[[source]]\nid = \"radio\"\nkind = \"mqtt\"\nurl = \"mqtt://toc:secret@broker.local\"\n\
                  topic = \"site/+/displacement\"\n[[benchmark]]\nid = \"5\"\nsource = \"radio\"\n";
    let config = config::parse(&format!("{RIGHT}{source}"), Path::new("site.toml")).unwrap();
    let address = &config.brokers[0].address;
    assert_eq!(
        (address.host.as_str(), address.port),
        ("broker.local", 1883)
    );
    assert!(
        !format!("{config:?}").contains("secret"),
        "a password in a log"
    );
    for (right, wrong) in [
        ("mqtt://", "mqttt://"),
        ("local\"", "local:99999\""),
        ("site/+", "site/a+"),
    ] {
        let found = problems(&format!("{RIGHT}{}", source.replace(right, wrong)));
        assert!(found[0].contains("cannot be used; write"), "{found:?}");
    }
}

#[test]
fn declared_events_are_read_and_what_means_nothing_is_refused() {
    use slipwatch::monitor::{Declaration, SiteLevel};
    let least = |addition: &str| {
        format!(
            "[site]\nname = \"S\"\nstate_dir = \"state\"\nlevel = \"2 of 5\"\n\
             [[source]]\nid = \"s\"\nkind = \"csv\"\npath = \"*.csv\"\nreorder = \"10m\"\n{addition}"
        )
    };
    let file = std::path::Path::new("site.toml");
    let event = "[[event]]\ntime = \"2020-01-01T00:00:00Z\"\n";
    let text = format!(
        "{event}kind = \"reset\"\nsize = -7.4\nunit = \"cm\"\n{event}kind = \"maintenance\"\n{event}kind = \"blast\"\n"
    );
    let taken = slipwatch::config::parse(&least(&text), file).unwrap();
    let kinds: Vec<Declaration> = taken.settings.declared.iter().map(|one| one.kind).collect();
    let until = "2020-01-01T01:00:00Z".parse().unwrap();
    assert_eq!(
        kinds,
        [
            Declaration::Reset {
                size_mm: Some(-74.0)
            },
            Declaration::Maintenance { until },
            Declaration::Blast
        ]
    );
    assert_eq!(taken.settings.site, Some(SiteLevel::AtLeast(2)));
    assert_eq!(taken.sources[0].reorder.as_secs(), 600);
    for wrong in [
        "kind = \"reset\"\nsize = 7\n",
        "kind = \"reset\"\nunit = \"mm\"\n",
        "kind = \"blast\"\nsize = 7\nunit = \"mm\"\n",
        "kind = \"blast\"\nuntil = \"2020-01-01T02:00:00Z\"\n",
        "kind = \"maintenance\"\nuntil = \"2019-01-01T02:00:00Z\"\n",
        "kind = \"party\"\n",
    ] {
        let text = least(&format!("{event}{wrong}"));
        assert!(slipwatch::config::parse(&text, file).is_err(), "{wrong}");
    }
}
