//! Examples of every command, for its page.

/// By command.
pub(super) const ALL: [(&str, &[&str]); 32] = [
    (
        "",
        &[
            "slipwatch demo",
            "slipwatch init slope.csv",
            "slipwatch run site.toml",
        ],
    ),
    ("demo", &["slipwatch demo", "slipwatch demo --pace 0s"]),
    (
        "init",
        &[
            "slipwatch init slope.csv --time-zone Europe/Rome --column \"Prisma 1=P1:displacement:mm\"",
            "slipwatch init slope.csv --decimal comma --time-format \"%d.%m.%Y %H:%M\" --time-zone Europe/Rome",
        ],
    ),
    ("run", &["slipwatch run site.toml"]),
    (
        "check",
        &[
            "slipwatch check site.toml",
            "slipwatch check --config-only - < site.toml",
        ],
    ),
    (
        "doctor",
        &[
            "slipwatch doctor site.toml",
            "slipwatch doctor site.toml --user slipwatch",
        ],
    ),
    (
        "replay",
        &[
            "slipwatch replay slope.csv --config site.toml",
            "zcat slope.csv.gz | slipwatch replay - --until 2017-06-06T17:00:00Z --format json",
            "slipwatch replay --state state --benchmark P1",
            "slipwatch replay slope.csv --config site.toml --record crisis.mcap",
        ],
    ),
    (
        "status",
        &[
            "slipwatch status --config site.toml",
            "slipwatch status --config site.toml --sources",
        ],
    ),
    (
        "events",
        &[
            "slipwatch events --config site.toml --kind alert --benchmark P1",
            "slipwatch events --config site.toml --follow --format json",
        ],
    ),
    ("alerts", &["slipwatch alerts list --config site.toml"]),
    ("alerts list", &["slipwatch alerts list --config site.toml"]),
    (
        "alerts show",
        &[
            "slipwatch alerts show P1/red --config site.toml",
            "slipwatch alerts show P1/red --config site.toml --bundle P1.zip",
        ],
    ),
    (
        "alerts ack",
        &[
            "slipwatch alerts ack --config site.toml --benchmark P1 --by \"the engineer on duty\" --why \"on the way\"",
        ],
    ),
    (
        "alerts shelve",
        &["slipwatch alerts shelve --config site.toml --benchmark P1 --for 8h"],
    ),
    (
        "alerts silence",
        &["slipwatch alerts silence --config site.toml --for 30min"],
    ),
    (
        "alerts unsilence",
        &["slipwatch alerts unsilence --config site.toml"],
    ),
    (
        "alerts resolve",
        &[
            "slipwatch alerts resolve --config site.toml --benchmark P1 --by \"the engineer on duty\" --why \"the wire was cut\"",
        ],
    ),
    (
        "alerts redeliver",
        &["slipwatch alerts redeliver --config site.toml"],
    ),
    ("backup", &["slipwatch backup copy.db --config site.toml"]),
    (
        "fit",
        &[
            "slipwatch fit slope.csv --benchmark P1",
            "slipwatch fit slope.csv --until 2017-06-06T17:00:00Z --format json",
        ],
    ),
    ("sweep", &["slipwatch sweep slope.csv --benchmark P1"]),
    (
        "explain",
        &[
            "slipwatch explain slope.csv --channels lake.csv",
            "slipwatch explain slope.csv --html slope.html",
        ],
    ),
    (
        "score",
        &[
            "slipwatch score slope.csv --failure-time 2017-06-06T17:00:00Z",
            "slipwatch score slope.csv --no-failure",
        ],
    ),
    (
        "plot",
        &[
            "slipwatch plot slope.csv --benchmark P1 --kind inverse-velocity -o slope.svg",
            "slipwatch plot slope.csv --benchmark P1 --kind forecast -o slope.png",
        ],
    ),
    (
        "report",
        &[
            "slipwatch report slope.csv -o report",
            "slipwatch report --config site.toml --last 7d -o report",
        ],
    ),
    (
        "simulate",
        &["slipwatch simulate --m 1.35 --x-i 0.6 --times 0,0.5,1,1.25"],
    ),
    (
        "schema",
        &["slipwatch schema fit", "slipwatch schema -o schema"],
    ),
    ("convert", &["slipwatch convert slope.csv slope.mcap"]),
    ("hook", &["slipwatch hook test --config site.toml"]),
    (
        "hook test",
        &["slipwatch hook test --config site.toml --level red"],
    ),
    ("completions", &["slipwatch completions bash"]),
    ("man", &["slipwatch man man"]),
];
