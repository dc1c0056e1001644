//! Whether the probabilities of the posterior of a constant load hold, on series drawn from its own prior.
//!
//! ```text
//! cargo run --release -p studies --bin calibration            1,000 series that keep the law from the first reading on
//! cargo run --release -p studies --bin calibration 1000 onset  the same where half begin later
//! cargo run --release -p studies --bin calibration 300 onset 1000  the same with other seeds
//! ```
//!
//! A central interval of 90 % should hold the truth nine times in ten, and of what is said to have a
//! probability of 30 % three in ten should be so. "failure" is the interval of the failure time with "never"
//! at infinity, over all series: where little is known, those alone whose truth fails are held less often, and those that never
//! fail more often, by any posterior. "failure, if any" is that among the laws that fail, over the series that fail.

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
    let first: u64 = arguments.next().map_or(Ok(0), |text| text.parse())?;
    let mut tally = score::Tally::default();
    for index in first..first + count {
        tally.add(&drawn::drawn(index, starts), starts);
    }
    write!(std::io::stdout(), "{}", tally.table())?;
    Ok(())
}
