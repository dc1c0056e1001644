//! Hooks that may write only where they are allowed to, run for real.

use crate::webhooks::alert;
use slipwatch::alert::Level;
use slipwatch::config::{ExtraMessages, HookConfig};
use slipwatch::runtime::deliver;
use slipwatch::runtime::hook::HookOutcome;
use slipwatch::runtime::sandbox::{self, WriteLimits};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;
use tempfile::TempDir;

fn folder() -> TempDir {
    tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap()
}

/// A folder outside /tmp, where every hook may write, wherever the repository lies.
fn folder_outside_tmp() -> Option<TempDir> {
    let home = std::env::var_os("HOME").map(PathBuf::from);
    let places = [PathBuf::from(env!("CARGO_TARGET_TMPDIR"))].into_iter();
    let others = ["/var/tmp", "/dev/shm"].map(PathBuf::from);
    let is_outside = |place: &PathBuf| {
        let place = fs::canonicalize(place);
        place.is_ok_and(|place| !place.starts_with("/tmp"))
    };
    let mut places = places.chain(others).chain(home).filter(is_outside);
    places.find_map(|place| tempfile::tempdir_in(place).ok())
}

fn limited(folder: &Path, run: &[&str]) -> HookConfig {
    HookConfig {
        extra: ExtraMessages::default(),
        links: None,
        zone: "UTC".to_owned(),
        site: false,
        to: None,
        escalate_after: None,
        hours: None,
        benchmarks: BTreeSet::new(),
        run: run.iter().map(|word| (*word).to_owned()).collect(),
        levels: vec![Level::Red],
        timeout: Duration::from_secs(30),
        folder: folder.to_owned(),
        sandbox: true,
        writable: Vec::new(),
        launcher: Some(env!("CARGO_BIN_EXE_slipwatch").into()),
    }
}

#[tokio::test]
#[cfg_attr(not(has_landlock), ignore = "this kernel has no landlock")]
async fn a_hook_writes_where_it_may_and_nowhere_else() {
    assert_ne!(sandbox::probe(), WriteLimits::Unsupported);
    let all = folder_outside_tmp().unwrap();
    let at = all.path();
    for name in ["own", "elsewhere", "allowed"] {
        fs::create_dir(at.join(name)).unwrap();
        fs::write(at.join(name).join("there"), "before").unwrap();
    }
    let script = "echo after > there; echo after > ../allowed/there; echo x > /dev/null\n\
                  t=$(mktemp /tmp/slipwatch-test-XXXXXX) && rm \"$t\" && echo ok > tmp\n\
                  for try in 'echo after > ../elsewhere/there' 'echo x > ../elsewhere/new' \
                  'rm ../elsewhere/there' 'mkdir ../elsewhere/folder' 'mv there ../elsewhere/'; do\n\
                  (eval \"$try\") 2>/dev/null && echo \"$try\" >> done\ndone\n\
                  cat ../elsewhere/there > read\n";
    fs::write(at.join("own/hook.sh"), script).unwrap();
    let mut hook = limited(&at.join("own"), &["/bin/sh", "hook.sh"]);
    hook.writable = vec![at.join("allowed"), at.join("not-there")];
    assert_eq!(
        deliver::run(&hook, &alert("5", "5/red/1"), 1).await,
        HookOutcome::Done
    );
    let read = |name: &str| fs::read_to_string(at.join(name)).unwrap_or_default();
    assert_eq!(read("own/done"), "", "written elsewhere");
    assert_eq!(read("own/there"), "after\n");
    assert_eq!(read("allowed/there"), "after\n");
    assert_eq!(read("own/tmp"), "ok\n");
    assert_eq!(read("elsewhere/there"), "before");
    assert_eq!(read("own/read"), "before", "reading is free");
}

#[tokio::test]
async fn walls_change_neither_the_arguments_nor_the_environment_nor_stdin() {
    let folder = folder();
    let script = "printf '%s|' \"$@\" > args; env > env; cat > stdin";
    let odd = ["--writable", "--", "a b", "$(touch no)", ""];
    let mut run = vec!["/bin/sh", "-c", script, "name"];
    run.extend(odd);
    let mut outcomes = Vec::new();
    for launcher in [true, false] {
        let mut hook = limited(folder.path(), &run);
        if !launcher {
            hook.launcher = None;
        }
        outcomes.push(deliver::run(&hook, &alert("5", "5/red/1"), 1).await);
        let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
        assert_eq!(read("args"), "--writable|--|a b|$(touch no)||");
        assert!(read("env").contains("SLIPWATCH_KEY=5/red/1"));
        for name in ["LD_", "CARGO", "RUST"] {
            assert!(!read("env").contains(&format!("\n{name}")), "{name} leaked");
        }
        assert_eq!(read("stdin").lines().count(), 1);
    }
    assert_eq!(outcomes, [HookOutcome::Done, HookOutcome::Done]);
}

#[tokio::test]
async fn a_hook_within_walls_that_is_missing_fails_and_one_that_hangs_is_killed() {
    let folder = folder();
    let missing = limited(folder.path(), &["./not-there.sh"]);
    let outcome = deliver::run(&missing, &alert("5", "5/red/1"), 1).await;
    assert!(
        matches!(&outcome, HookOutcome::NotStarted(why) if why.contains("No such file")),
        "{outcome:?}"
    );
    let mut hanging = limited(folder.path(), &["/bin/sh", "-c", "sleep 300 & sleep 300"]);
    hanging.timeout = Duration::from_millis(500);
    assert_eq!(
        deliver::run(&hanging, &alert("5", "5/red/1"), 1).await,
        HookOutcome::TimedOut
    );
}

#[tokio::test]
async fn a_hook_of_a_config_under_a_relative_path_is_found() {
    let folder = folder();
    let here = fs::canonicalize(std::env::current_dir().unwrap()).unwrap();
    let there = fs::canonicalize(folder.path()).unwrap();
    // Up to the root and down again.
    let mut relative: PathBuf = here.iter().skip(1).map(|_| "..").collect();
    relative.push(there.strip_prefix("/").unwrap());
    let relative = relative.as_path();
    fs::write(folder.path().join("hook.sh"), "#!/bin/sh\ntouch ran\n").unwrap();
    let mode = std::os::unix::fs::PermissionsExt::from_mode(0o755);
    fs::set_permissions(folder.path().join("hook.sh"), mode).unwrap();
    for launcher in [true, false] {
        let mut hook = limited(relative, &["./hook.sh"]);
        if !launcher {
            hook.launcher = None;
        }
        assert_eq!(
            deliver::run(&hook, &alert("5", "5/red/1"), 1).await,
            HookOutcome::Done
        );
        fs::remove_file(folder.path().join("ran")).unwrap();
    }
}

#[tokio::test]
async fn a_hook_within_walls_ends_as_its_program_does_and_leaves_at_work_what_it_left_if_that_went_well()
 {
    let folder = folder();
    for (script, outcome) in [
        ("exit 0", HookOutcome::Done),
        ("exit 7", HookOutcome::Failed(7)),
        ("kill -KILL $$", HookOutcome::Signalled(9)),
        ("kill -TERM $$", HookOutcome::Signalled(15)),
        // What asks its whole group to end is for it to take.
        (
            "trap 'exit 3' TERM; kill -TERM 0; exit 4",
            HookOutcome::Failed(3),
        ),
    ] {
        let hook = limited(folder.path(), &["/bin/sh", "-c", script]);
        let ended = deliver::run(&hook, &alert("5", "5/red/1"), 1).await;
        assert_eq!(ended, outcome, "{script}");
    }
    let script = "(env -i setsid sh -c 'sleep 1; touch later' > /dev/null 2>&1 &)\nexit 0";
    let hook = limited(folder.path(), &["/bin/sh", "-c", script]);
    let ended = deliver::run(&hook, &alert("5", "5/red/1"), 1).await;
    assert_eq!(ended, HookOutcome::Done);
    for _ in 0..300 {
        if folder.path().join("later").exists() {
            return;
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    panic!("what a hook left that went well was ended");
}
