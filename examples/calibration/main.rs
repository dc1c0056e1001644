//! Whether the posterior's probabilities hold.
use std::io::Write as _;
mod drawn;
mod score;

fn main() -> std::io::Result<()> {
    let mut args = std::env::args().skip(1);
    let count = args.next().and_then(|n| n.parse().ok()).unwrap_or(1000);
    let with_onset = args.next().is_some_and(|one| one == "onset");
    let mut tally = score::Tally::default();
    for index in 0..count {
        tally.add(&drawn::drawn(index, with_onset), with_onset);
    }
    write!(std::io::stdout(), "{}", tally.table())
}
