//! The ways in which a monitor fails in the field, each a test, with real files, signals, disks and databases.
//!
//! | nr | what fails | tests |
//! |---|---|---|
//! | 1 | a file is truncated, or copied and truncated | `files` here; `a_truncated_file...`, `a_file_that_was_truncated...` in tests/daemon/follow.rs |
//! | 2 | inodes used again, files that begin alike | tests/daemon/follow.rs (`an_atomically_replaced...`, `a_deleted_file...`, `..._named_after`) |
//! | 3 | rotation | tests/daemon/follow.rs (`what_was_written_before_a_rotation...`, the packed files), tests/daemon/follow/gone.rs; the model in `model` |
//! | 4 | replaced, deleted, links that turn, folders and mounts that go | `files`, `machine`, `model`; tests/daemon/daemon.rs |
//! | 5 6 7 | partial, spoilt and endless lines | src/runtime/tail/lines.rs, tests/daemon/follow.rs |
//! | 8 | torn JSON | tests/library/ingest_ndjson.rs, tests/daemon/follow.rs |
//! | 9 | twice, corrected, late | tests/daemon/daemon.rs, tests/library/monitor.rs |
//! | 10 | clocks of loggers | `files` (1970); tests/commands/cli.rs (the future), tests/library/ingest_toa5.rs (summer time) |
//! | 11 | marks for no value | tests/library/ingest_toa5.rs, tests/daemon/follow.rs, tests/library/monitor.rs |
//! | 12 | no watches | `files`: none left to the user |
//! | 13 | a file that cannot be read, no file descriptors | `files`, `machine` (ESTALE, EIO, EACCES through strace; EMFILE) |
//! | 14 | the disk is full | `disk` (a full tmpfs); tests/daemon/daemon/crisis.rs (a limit on the length of files) |
//! | 15 | killed at any moment, at any system call | `killed` |
//! | 16 | a sync fails: at the start, of a commit, of the database | `disk` |
//! | 17 | a database that is damaged, newer, foreign, in use | `database` |
//! | 18 | hooks | tests/daemon/hooks.rs, tests/daemon/sandbox.rs |
//! | 19 | all benchmarks at once | `many_alerts`; flapping: src/alert/latch.rs |
//! | 20 | clocks that step, a machine that sleeps | `machine`, `orders`; the watchdog is in tests/daemon/service.rs |
//! | 21 | a config that is wrong, a benchmark that is taken out | `orders` |
//! | 22 | recordings | tests/daemon/follow.rs, tests/library/ingest_mcap.rs, tests/library/mutated_files.rs |
//! | 23 | a log that cannot be written | `log` |
//! | 24 | the host's clock, one wrong time stamp, a clock that was never set | `time`; src/runtime/site/timekeeper.rs |
//! | 25 | sensors that are stuck, spoilt, or give another quantity | `sensors`; src/monitor/suspect.rs |
//! | 26 | files, messages and brokers that give nothing | `feeds`; tests/daemon/mqtt.rs |
//! | 27 | backlogs, corrections, silences, slow hooks, hooks of the site | `notified`, `reach`; tests/daemon/hooks.rs |
//! | 28 | what an operator is to see: what never read, restarts, a state that is gone, forged names | `view` |
//! | 29 | much of it at once, for ten thousand hours | tests/hostile_hours |
//! | 30 | a first start on history; a row and its correction, read again | `past`; tests/library/first_start.rs |
//! | 31 | links in messages that are followed, forged, used again | `link` |
//! | 32 | an alert's whole way breaks without anybody seeing it | `drill` |
//! | 33 | the disk of the daemon's own record | `recorded` |
//! | 34 | a state that an earlier version wrote | `upgrade` |
//! | 35 | orders that people give while readings come late, or a red is called | `seen` |
//! | 36 | exports that are issued again, in any order; what a reload changes of what is called | `exports` |
//! | 37 | file systems that do not answer | `hanging` |
//!
//! docs/failure-modes.md says the same for operators.
//!
//! A test for which the machine lacks something (strace, mounts of one's own, libfaketime) is ignored, as `build.rs` finds
//! it. Not covered: a loss of power (a killed process leaves what the kernel has; whether a disk keeps what it said
//! was synced only pulling its plug shows), and a server whose files are gone (ESTALE is an answer that strace gives).

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::wildcard_enum_match_arm,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::option_option,
    clippy::format_push_string,
    clippy::format_collect,
    reason = "a test fails by panicking, and its rows are few and small"
)]

mod database;
mod disk;
mod drill;
mod duty;
mod escalation;
mod exports;
mod feeds;
mod files;
mod hanging;
mod killed;
mod link;
mod log;
mod machine;
mod many_alerts;
mod model;
mod notified;
mod orders;
mod past;
mod reach;
mod record;
mod recorded;
mod reread;
mod seen;
mod sensors;
mod site;
mod time;
mod upgrade;
mod view;
