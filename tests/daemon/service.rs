//! What the daemon reports to a service manager, on a real socket.

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::fs;
use std::os::unix::net::UnixDatagram;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

const PROGRAM: &str = env!("CARGO_BIN_EXE_slipwatch");
const LIMIT: Duration = Duration::from_secs(60);

struct Killed(Child);

impl Drop for Killed {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn the_service_manager_is_notified_of_readiness_the_work_loop_and_the_stop() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::create_dir(at.join("incoming")).unwrap();
    let text = "[site]\nname = \"Toc\"\nstate_dir = \"state\"\n\
                [[source]]\nid = \"logger\"\nkind = \"csv\"\npath = \"incoming/*.csv\"\n\
                [[hook]]\nrun = [\"/bin/true\"]\n";
    fs::write(at.join("site.toml"), text).unwrap();
    let socket = UnixDatagram::bind(at.join("notify")).unwrap();
    socket.set_read_timeout(Some(LIMIT)).unwrap();
    let mut said = Vec::new();
    let mut until = |wanted: &str| {
        let before = said.len();
        while !said[before..].iter().any(|line| line == wanted) {
            let mut bytes = [0; 4096];
            let count = socket.recv(&mut bytes).unwrap();
            let text = String::from_utf8(bytes[..count].to_vec()).unwrap();
            said.extend(text.lines().map(str::to_owned));
        }
        said[before..].to_vec()
    };
    let child = Command::new(PROGRAM)
        .args(["run", at.join("site.toml").to_str().unwrap()])
        .env("NOTIFY_SOCKET", at.join("notify"))
        .env("WATCHDOG_USEC", "400000")
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut child = Killed(child);
    until("READY=1");
    until("STATUS=watching");
    until("WATCHDOG=1");
    // With nothing to read the loop still turns.
    until("WATCHDOG=1");
    let pid = Pid::from_raw(i32::try_from(child.0.id()).unwrap());
    kill(pid, Signal::SIGTERM).unwrap();
    let last = until("STOPPING=1");
    assert!(!last.contains(&"READY=1".to_owned()), "{last:?}");
    assert!(child.0.wait().unwrap().success());
}
