//! `hook test`: a drill, with hooks that are real processes.

use assert_cmd::Command;
use std::fs;
use std::time::Duration;
use tempfile::TempDir;

/// A site with three hooks, each a script that writes what it receives; `last` is what the third then does.
fn site(last: &str) -> (TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("incoming")).unwrap();
    let hook = |name: &str, levels: &str, end: &str| {
        let script = format!(
            "env | grep SLIPWATCH_ | sort > {name}.env\ncat > {name}.stdin\necho once >> {name}.runs\n{end}\n"
        );
        fs::write(folder.path().join(format!("{name}.sh")), script).unwrap();
        format!("[[hook]]\nrun = [\"/bin/sh\", \"{name}.sh\"]\n{levels}timeout = \"5s\"\n")
    };
    let text = format!(
        "[site]\nname = \"Toc\"\nstate_dir = \"state\"\n\
         [[source]]\nid = \"logger\"\nkind = \"csv\"\npath = \"incoming/*.csv\"\n\
         [[benchmark]]\nid = \"5\"\nsource = \"logger\"\n{}{}{}",
        hook("low", "levels = [\"yellow\", \"orange\"]\n", "exit 0"),
        hook(
            "high",
            "levels = [\"orange\", \"red\", \"unknown\"]\n",
            "exit 0"
        ),
        hook("site", "levels = [\"red\"]\nsite = true\n", last),
    );
    let file = folder.path().join("site.toml");
    fs::write(&file, text).unwrap();
    let file = file.to_str().unwrap().to_owned();
    (folder, file)
}

fn drill(file: &str, more: &[&str]) -> assert_cmd::assert::Assert {
    let mut command = Command::new(env!("CARGO_BIN_EXE_slipwatch"));
    command.args(["hook", "test", "--config", file, "--format", "json"]);
    command.args(more).timeout(Duration::from_secs(60)).assert()
}

fn report(assert: &assert_cmd::assert::Assert) -> serde_json::Value {
    serde_json::from_slice(&assert.get_output().stdout).unwrap()
}

#[test]
fn a_drill_runs_each_hook_once_with_its_gravest_level_and_says_that_it_is_a_test() {
    let (folder, file) = site("exit 0");
    let report = report(&drill(&file, &[]).success());
    assert_eq!(report["status"], "Test");
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    for (index, (name, level, benchmark)) in [
        ("low", "orange", "5"),
        ("high", "red", "5"),
        ("site", "red", ""),
    ]
    .into_iter()
    .enumerate()
    {
        let env = read(&format!("{name}.env"));
        for line in [
            "SLIPWATCH_STATUS=Test".to_owned(),
            "SLIPWATCH_SITE=Toc".to_owned(),
            "SLIPWATCH_ATTEMPT=1".to_owned(),
            format!("SLIPWATCH_LEVEL={level}"),
            format!("SLIPWATCH_BENCHMARK={benchmark}"),
        ] {
            assert!(env.lines().any(|had| had == line), "{line} not in\n{env}");
        }
        let body: serde_json::Value =
            serde_json::from_str(&read(&format!("{name}.stdin"))).unwrap();
        assert_eq!(
            (&body["status"], &body["level"]),
            (&"Test".into(), &level.into())
        );
        assert!(
            body["text"].as_str().unwrap().starts_with("DRILL"),
            "{body}"
        );
        assert_eq!(read(&format!("{name}.runs")), "once\n");
        assert_eq!(report["hooks"][index]["is_taken"], true, "{report}");
    }
    // It is no affair of the site's state.
    assert!(!folder.path().join("state").exists());
}

#[test]
fn a_drill_of_one_level_runs_the_hooks_for_it_alone() {
    let (folder, file) = site("exit 0");
    let report = report(&drill(&file, &["--level", "yellow"]).success());
    assert_eq!(report["hooks"].as_array().unwrap().len(), 1);
    assert!(folder.path().join("low.runs").exists());
    assert!(!folder.path().join("high.runs").exists());
    drill(&file, &["--level", "green"]).code(2);
}

#[test]
fn a_hook_that_fails_its_drill_is_trouble_and_the_others_are_run_all_the_same() {
    for (last, outcome) in [
        ("exit 3", "ended with exit code 3"),
        ("sleep 60", "killed when its time was up"),
    ] {
        let (_folder, file) = site(last);
        let report = report(&drill(&file, &[]).code(1));
        let taken = |index: usize| report["hooks"][index]["is_taken"].as_bool().unwrap();
        assert_eq!([0, 1, 2].map(taken), [true, true, false]);
        assert_eq!(report["hooks"][2]["outcome"], outcome);
    }
}

#[test]
fn a_drill_that_would_reach_nobody_is_trouble() {
    let (_folder, file) = site("exit 0");
    let text = fs::read_to_string(&file).unwrap();
    let (without, _) = text.split_once("[[hook]]").unwrap();
    fs::write(&file, without).unwrap();
    drill(&file, &[]).code(1);
}
