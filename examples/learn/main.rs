//! Teaches the network that gives the chance of a collapse, on simulated slopes alone.
//!
//! - `learn [SLOPES]` teaches it on so many slopes of each family and writes src/forecast/learned.rs.
//! - `learn --left-out [SLOPES]` teaches one network for each family on all the others, judges each family by the network
//!   that never saw it, and writes docs/families.md.
//!
//! Slopes that teach have seeds from 0 on, those that judge from 1,000,000 on.

#![expect(clippy::print_stderr, reason = "progress is what it prints")]
#![expect(
    clippy::cast_possible_truncation,
    reason = "weights have single precision"
)]

mod descent;
mod judge;
mod looks;
mod source;
mod table;

use descent::{Row, teach};
use looks::Look;
use slipwatch::forecast::{Family, Network};

/// Slopes of each family that teach, unless another number is given.
const SLOPES: u64 = 500;
/// Passes over the looks: a first network finds the looks that mislead it, the second is taught on those too.
const PASSES: (usize, usize) = (6, 12);
/// The share of the standing slopes whose every reading the first network is asked about.
const ASKED: f64 = 0.4;

fn main() -> anyhow::Result<()> {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let is_left_out = arguments.iter().any(|one| one == "--left-out");
    arguments.retain(|one| one != "--left-out");
    let slopes = arguments.first().map_or(Ok(SLOPES), |text| text.parse())?;
    let looks = looks::of_families(slopes);
    eprintln!("{} looks at {slopes} slopes of each family", looks.len());
    if is_left_out {
        let families = Family::ALL.map(|family| {
            let network = learn(&looks, slopes, Some(family));
            eprintln!("taught without {family:?}");
            judge::family(family, &network)
        });
        return table::write(&families, slopes);
    }
    source::write(&learn(&looks, slopes, None), slopes)
}

/// A network taught on all families but one.
fn learn(looks: &[Look], slopes: u64, without: Option<Family>) -> Network {
    let counts = |look: &&Look| Some(look.family) != without;
    let mut rows: Vec<Row> = looks.iter().filter(counts).flat_map(looks::rows).collect();
    let first = teach(&rows, PASSES.0);
    #[expect(clippy::cast_sign_loss, reason = "a share of a count")]
    let asked = (slopes as f64 * ASKED) as u64;
    let misleading = looks::misleading(&first, asked, without);
    rows.extend(misleading.iter().flat_map(looks::rows));
    teach(&rows, PASSES.1)
}
