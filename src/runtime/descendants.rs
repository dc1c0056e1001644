//! Processes that another one has started, and those that these have.

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use std::collections::BTreeMap;

/// How often they are looked for: what is started meanwhile is seen the next time.
const MOST_LOOKS: usize = 8;

/// Ends all of `ancestor`'s, whatever group, session and environment they have. Those whose parent has ended are found where
/// `ancestor` takes them up, as a subreaper does.
pub(super) fn kill_descendants(ancestor: Pid) {
    for _ in 0..MOST_LOOKS {
        let living = descendants(ancestor);
        if living.is_empty() {
            return;
        }
        for process in living {
            // It may have ended meanwhile.
            let _ = kill(process, Signal::SIGKILL);
        }
    }
}

/// Those that have not ended.
fn descendants(ancestor: Pid) -> Vec<Pid> {
    let mut children: BTreeMap<i32, Vec<(i32, bool)>> = BTreeMap::new();
    let Ok(processes) = std::fs::read_dir("/proc") else {
        return Vec::new();
    };
    for process in processes.flatten() {
        let number = process.file_name();
        let number = number.to_str().and_then(|name| name.parse().ok());
        let stat = std::fs::read(process.path().join("stat"));
        if let (Some(number), Ok(stat)) = (number, stat)
            && let Some((parent, is_over)) = parent_in(&stat)
        {
            children.entry(parent).or_default().push((number, is_over));
        }
    }
    let (mut found, mut next) = (Vec::new(), vec![ancestor.as_raw()]);
    while let Some(parent) = next.pop() {
        // Taken out, so that this ends whatever the numbers say.
        for (child, is_over) in children.remove(&parent).unwrap_or_default() {
            next.push(child);
            if !is_over {
                found.push(Pid::from_raw(child));
            }
        }
    }
    found
}

/// The parent in the line of a process in `/proc`, and whether the process has ended and nobody has asked how.
fn parent_in(stat: &[u8]) -> Option<(i32, bool)> {
    // A name may hold anything, parentheses too.
    let after_name = stat.iter().rposition(|byte| *byte == b')')?;
    let rest = std::str::from_utf8(stat.get(after_name + 1..)?).ok()?;
    let mut fields = rest.split_ascii_whitespace();
    let is_over = matches!(fields.next()?, "Z" | "X");
    Some((fields.next()?.parse().ok()?, is_over))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parent_is_found_behind_a_name_that_holds_anything() {
        assert_eq!(
            parent_in(b"12 (a) Z 1 (b)) S 34 12 12 0"),
            Some((34, false))
        );
        assert_eq!(parent_in(b"12 (sh) Z 1 12 12 0"), Some((1, true)));
        assert_eq!(parent_in(b"12 (sh"), None);
    }
}
