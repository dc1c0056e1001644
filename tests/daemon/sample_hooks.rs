//! The hooks in `deploy/hooks`, each run as the daemon runs a hook, against what they speak to.

use nix::pty::openpty;
use nix::unistd::ttyname;
use std::fs::{self, File};
use std::io::{Read, Write};
use std::net::TcpListener;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::thread;

/// What an alert is: its level, its state and the delivery's status.
type Said<'a> = (&'a str, &'a str, &'a str);

/// The text with its times in Europe/Rome as a hook shows them on this machine: in UTC where it knows no zones.
fn by_clocks(text: &str) -> String {
    if Path::new("/usr/share/zoneinfo/Europe/Rome").exists() {
        return text.to_owned();
    }
    text.replace("2017-06-06 19:00 CEST", "2017-06-06 17:00 UTC")
        .replace("2017-06-07 05:00 CEST", "2017-06-07 03:00 UTC")
}

const RED: Said<'_> = ("red", "firing", "Actual");

/// Runs one with the environment and the input that the daemon gives it.
fn run(name: &str, arguments: &[&str], said: Said<'_>, more: &[(&str, &Path)]) -> Output {
    let input =
        r#"{"event": "alert", "text": "benchmark 5: red; chance of collapse 57 % within 48 h"}"#;
    run_with(name, arguments, said, (more, input))
}

/// The same with what it gets on stdin.
fn run_with(
    name: &str,
    arguments: &[&str],
    (level, state, status): Said<'_>,
    (more, given): (&[(&str, &Path)], &str),
) -> Output {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut command = Command::new(root.join("deploy/hooks").join(name));
    command
        .args(arguments)
        .env("SLIPWATCH_EVENT", "alert")
        .env(
            "SLIPWATCH_KEY",
            "5\nBcc: all@example.org/red/2017-06-06T17:00:00Z",
        )
        .env("SLIPWATCH_SITE", "Monte Toc")
        .env("SLIPWATCH_BENCHMARK", "5\nBcc: all@example.org")
        .env("SLIPWATCH_LEVEL", level)
        .env("SLIPWATCH_STATE", state)
        .env("SLIPWATCH_TIME", "2017-06-06T17:00:00Z")
        .env("SLIPWATCH_FAILURE_TIME", "2017-06-07T03:00:00Z")
        .env("SLIPWATCH_ATTEMPT", "1")
        .env("SLIPWATCH_STATUS", status)
        .env("SLIPWATCH_TIME_ZONE", "Europe/Rome")
        .env(
            "SLIPWATCH_TEXT",
            "benchmark 5: red; chance of collapse 57 % within 48 h",
        )
        .env("SLIPWATCH_RECOMMENDED", "Evacuate the area.")
        .envs(more.iter().copied())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let mut input = child.stdin.take().unwrap();
    // One that leaves at once has no use for it.
    let _ = input.write_all(given.as_bytes());
    drop(input);
    child.wait_with_output().unwrap()
}

fn program(folder: &Path, text: &str) -> PathBuf {
    let file = folder.join("program.sh");
    fs::write(&file, text).unwrap();
    fs::set_permissions(&file, fs::Permissions::from_mode(0o755)).unwrap();
    file
}

#[test]
fn an_email_goes_to_each_address_with_the_alert_in_it_and_no_name_forges_a_header() {
    let folder = tempfile::tempdir().unwrap();
    let mail = folder.path().join("mail");
    let sendmail = program(
        folder.path(),
        &format!(
            "#!/bin/sh\n[ \"$*\" = '-t -i' ] && cat > {}\n",
            mail.display()
        ),
    );
    let to = ["duty@example.org", "office@example.org"];
    let output = run("email.sh", &to, RED, &[("SENDMAIL", &sendmail)]);
    assert!(output.status.success(), "{output:?}");
    let mail = fs::read_to_string(mail).unwrap();
    let (head, body) = mail.split_once("\n\n").unwrap();
    let headers: Vec<&str> = head.lines().collect();
    assert_eq!(headers[0], "To: duty@example.org, office@example.org");
    assert_eq!(
        headers[1],
        "Subject: [Actual] Monte Toc: red called at 5Bcc: all@example.org"
    );
    assert!(
        !headers.iter().any(|line| line.starts_with("Bcc")),
        "{head}"
    );
    for part in [
        "Monte Toc: red called at 5Bcc: all@example.org, 2017-06-06 19:00 CEST\n\nWhat to do: Evacuate the area.\n",
        "Collapse forecast (median): 2017-06-07 05:00 CEST. It is put on the early side",
        "\nbenchmark 5: red; chance of collapse 57 % within 48 h.\n",
        r#""text": "benchmark 5: red; chance"#,
    ] {
        assert!(body.contains(&by_clocks(part)), "{part}: {body}");
    }
    let failing = program(folder.path(), "#!/bin/sh\ncat > /dev/null\nexit 75\n");
    let output = run("email.sh", &to, RED, &[("SENDMAIL", &failing)]);
    assert_eq!(output.status.code(), Some(75), "the daemon tries again");
    assert_eq!(run("email.sh", &[], RED, &[]).status.code(), Some(2));
}

#[test]
fn the_text_of_a_message_has_its_times_by_the_clocks_at_the_site() {
    let folder = tempfile::tempdir().unwrap();
    let mail = folder.path().join("mail");
    let mailer = program(
        folder.path(),
        &format!("#!/bin/sh\ncat > {}\n", mail.display()),
    );
    let local = Path::new("benchmark 5: red since 2017-06-06 18:00 CEST");
    let more = [("SENDMAIL", &*mailer), ("SLIPWATCH_TEXT_LOCAL", local)];
    let output = run("email.sh", &["duty@example.org"], RED, &more);
    assert!(output.status.success(), "{output:?}");
    let mail = fs::read_to_string(mail).unwrap();
    assert!(
        mail.contains("\n\nbenchmark 5: red since 2017-06-06 18:00 CEST.\n"),
        "{mail}"
    );
    assert!(!mail.contains("\nbenchmark 5: red; chance"), "{mail}");
}

/// Exim takes a message with a longer line, and bounces it.
#[test]
fn an_email_has_no_line_that_a_mailer_refuses_and_only_ascii_in_its_head() {
    let folder = tempfile::tempdir().unwrap();
    let mail = folder.path().join("mail");
    let mailer = program(
        folder.path(),
        &format!("#!/bin/sh\ncat > {}\n", mail.display()),
    );
    let fields: Vec<String> = (0..100)
        .map(|field| format!("\"field{field}\":\"value\""))
        .collect();
    let given = format!(
        "{{{},\"text\":\"{}\"}}",
        fields.join(","),
        "benchmark ".repeat(400)
    );
    let to = ["--mailer", mailer.to_str().unwrap(), "duty@example.org"];
    let site = [("SLIPWATCH_SITE", Path::new("La Clapi\u{e8}re"))];
    let output = run_with("email.sh", &to, RED, (&site, &given));
    assert!(output.status.success(), "{output:?}");
    let mail = fs::read_to_string(mail).unwrap();
    let longest = mail.lines().map(str::len).max();
    assert!(longest <= Some(998), "{longest:?}");
    let (head, body) = mail.split_once("\n\n").unwrap();
    assert!(head.is_ascii(), "{head}");
    assert!(head.contains("Subject: =?UTF-8?B?"), "{head}");
    assert!(body.contains("La Clapi\u{e8}re: red called at"), "{body}");
    assert!(body.contains("\"field7\":\"value\",\n\"field8\""), "{body}");
}

/// Answers one request with a status; gives its address and what it got.
fn answering(status: &'static str) -> (String, thread::JoinHandle<String>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}/monte-toc", listener.local_addr().unwrap());
    let got = thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let (mut got, mut part) = (String::new(), [0; 4096]);
        while !got.ends_with("within 48 h") {
            let count = stream.read(&mut part).unwrap();
            assert!(count > 0, "{got}");
            got += std::str::from_utf8(&part[..count]).unwrap();
        }
        write!(stream, "HTTP/1.1 {status}\r\ncontent-length: 0\r\n\r\n").unwrap();
        got
    });
    (url, got)
}

#[test]
#[cfg_attr(not(has_curl), ignore = "curl was not found by build.rs")]
fn a_push_message_has_the_priority_of_the_level_and_a_server_that_refuses_it_is_a_failure() {
    // What is unknown ends no level that is in force beside it.
    for (said, beside, priority) in [
        (RED, "", "Priority: 5"),
        (("unknown", "firing", "Actual"), "", "Priority: 4"),
        (("unknown", "firing", "Actual"), "yellow", "Priority: 4"),
        (("unknown", "firing", "Actual"), "red", "Priority: 5"),
        (("red", "resolved", "Test"), "", "Priority: 3"),
    ] {
        let (url, got) = answering("200 OK");
        let in_force = [("SLIPWATCH_IN_FORCE", Path::new(beside))];
        let output = run("ntfy.sh", &[&url], said, &in_force);
        assert!(output.status.success(), "{output:?}");
        let got = got.join().unwrap();
        assert!(got.starts_with("POST /monte-toc HTTP/1.1\r\n"), "{got}");
        let state = if said.1 == "firing" {
            "called"
        } else {
            "ended"
        };
        let (mark, level) = (
            if said.2 == "Test" { "TEST: " } else { "" },
            said.0.to_uppercase(),
        );
        let beside = match beside {
            "" => String::new(),
            level => format!(", {level} stays in force"),
        };
        let title =
            format!("Title: {mark}{level} {state}: Monte Toc, 5Bcc: all@example.org{beside}\r\n");
        let text = if said.1 == "firing" {
            "\r\n\r\nEvacuate the area. At 2017-06-06 19:00 CEST; collapse forecast (median, on the early side) 2017-06-07 05:00 CEST; benchmark 5"
        } else {
            "\r\n\r\nThis is no all-clear: somebody has to look at the slope before anyone goes back. At 2017-06-06 19:00 CEST; benchmark 5"
        };
        for part in [title.as_str(), priority, text] {
            assert!(got.contains(&by_clocks(part)), "{part}: {got}");
        }
    }
    let (url, got) = answering("403 Forbidden");
    let output = run("ntfy.sh", &[&url], RED, &[]);
    assert!(!output.status.success());
    got.join().unwrap();
}

#[test]
fn a_relay_is_switched_by_a_red_alone_and_by_a_drill_only_where_that_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let relay = folder.path().join("brightness");
    let file = relay.to_str().unwrap();
    let after = |said: Said<'_>, more: &[&str]| {
        let output = run("relay.sh", &[&[file], more].concat(), said, &[]);
        assert!(output.status.success(), "{output:?}");
        fs::read_to_string(&relay).unwrap_or_default()
    };
    assert_eq!(after(("orange", "firing", "Actual"), &[]), "");
    assert_eq!(after(("red", "firing", "Test"), &[]), "");
    assert_eq!(after(RED, &[]), "1\n");
    for other in [
        ("unknown", "firing", "Actual"),
        ("orange", "resolved", "Actual"),
        ("red", "resolved", "Exercise"),
    ] {
        assert_eq!(after(other, &[]), "1\n", "{other:?}");
    }
    // Whether another benchmark is red is not known.
    let ended = ("red", "resolved", "Actual");
    let output = run("relay.sh", &[file], ended, &[]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        !output.status.success() && said.contains("site = true"),
        "{said}"
    );
    // A message of many benchmarks names none, and is not of the site.
    let of_many = [
        ("SLIPWATCH_BENCHMARK", Path::new("")),
        ("SLIPWATCH_COUNT", Path::new("14")),
    ];
    let output = run("relay.sh", &[file, "--one-benchmark"], ended, &of_many);
    assert!(!output.status.success(), "{output:?}");
    assert_eq!(fs::read_to_string(&relay).unwrap(), "1\n");
    assert_eq!(after(ended, &["--one-benchmark"]), "0\n");
    assert_eq!(after(("red", "firing", "Test"), &["--drills"]), "1\n");
    let of_the_site = [("SLIPWATCH_BENCHMARK", Path::new(""))];
    assert!(
        run("relay.sh", &[file], ended, &of_the_site)
            .status
            .success()
    );
    assert_eq!(fs::read_to_string(&relay).unwrap(), "0\n");
    fs::remove_file(&relay).unwrap();
    fs::create_dir(&relay).unwrap();
    let output = run("relay.sh", &[file], RED, &[]);
    assert!(!output.status.success(), "the daemon tries again");
}

/// A modem on a pseudo-terminal, which answers `refusing` with an error; gives its device and what it was sent.
fn modem(refusing: &'static str) -> (PathBuf, File, thread::JoinHandle<Vec<String>>) {
    let ends = openpty(None, None).unwrap();
    let device = ttyname(&ends.slave).unwrap();
    let mut line = File::from(ends.master);
    let got = thread::spawn(move || {
        let (mut said, mut part) = (Vec::new(), String::new());
        let mut byte = [0; 1];
        // Ends with the last one who holds the device open.
        while line.read_exact(&mut byte).is_ok() {
            if !matches!(byte[0], b'\r' | 0x1a) {
                part.push(char::from(byte[0]));
                continue;
            }
            let answer = match part.as_str() {
                sent if sent == refusing => "\r\n+CMS ERROR: 500\r\n",
                sent if sent.trim_start_matches('\u{1b}').starts_with("AT+CMGS=") => "\r\n> ",
                sent if sent.starts_with("AT") => "\r\nOK\r\n",
                _ => "\r\n+CMGS: 1\r\n\r\nOK\r\n",
            };
            said.push(std::mem::take(&mut part));
            line.write_all(answer.as_bytes()).unwrap();
        }
        said
    });
    (device, File::from(ends.slave), got)
}

#[test]
#[cfg_attr(not(has_python3), ignore = "python3 was not found by build.rs")]
fn a_text_message_goes_to_each_number_and_a_modem_that_refuses_is_a_failure() {
    let (device, held, got) = modem("");
    let device = device.to_str().unwrap();
    let output = run("sms.py", &[device, "+391", "+392"], RED, &[]);
    assert!(output.status.success(), "{output:?}");
    drop(held);
    let text = "RED: Monte Toc, 5 Bcc: all@example.org. EVACUATE by the plan. Collapse forecast 2017-06-07 05:00 CEST. \
                At 2017-06-06 19:00 CEST: chance of collapse";
    let mut text = by_clocks(text);
    if text.contains("UTC") {
        // Two letters shorter: one figure more has room.
        text += " 57%";
    }
    let text = text.as_str();
    assert_eq!(
        got.join().unwrap(),
        [
            "AT",
            "AT+CMGF=1",
            "AT+CMGS=\"+391\"",
            text,
            "AT+CMGS=\"+392\"",
            text
        ]
    );
    let (device, held, got) = modem("AT+CMGS=\"+391\"");
    let output = run(
        "sms.py",
        &[device.to_str().unwrap(), "+391", "+392"],
        RED,
        &[],
    );
    assert_eq!(output.status.code(), Some(1), "the daemon tries again");
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("+391: the modem answers"), "{said}");
    drop(held);
    // What is left of a message is ended first.
    assert_eq!(got.join().unwrap()[3..], ["\x1bAT+CMGS=\"+392\"", text]);
    let (device, held, got) = modem("AT+CMGF=1");
    let output = run("sms.py", &[device.to_str().unwrap(), "+391"], RED, &[]);
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("+CMS ERROR: 500"), "{said}");
    drop(held);
    got.join().unwrap();
}
