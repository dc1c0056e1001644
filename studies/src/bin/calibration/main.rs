//! Whether the probabilities of the posterior of a constant load hold, on series drawn from its own prior.
//!
//! ```text
//! cargo run --release -p studies --bin calibration            1,000 series that keep the law from the first reading on
//! cargo run --release -p studies --bin calibration 1000 onset  the same where half begin later
//! ```
//!
//! A central interval of 90 % should hold the truth nine times in ten, and of what is said to have a
//! probability of 30 % three in ten should be so. "failure" is the interval of the failure time with "never"
//! at infinity, "failure, if any" that among the laws that fail.

mod drawn;
mod score;
#[cfg(test)]
mod tests;

use std::io::Write as _;

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let count: u64 = arguments.next().map_or(Ok(1000), |text| text.parse())?;
    let starts = match arguments.next().as_deref() {
        Some("onset") => drawn::Starts::ToBeFound,
        _ => drawn::Starts::First,
    };
    let mut tally = score::Tally::default();
    for index in 0..count {
        tally.add(&drawn::drawn(index, starts), starts);
    }
    write!(std::io::stdout(), "{}", tally.table())?;
    Ok(())
}
