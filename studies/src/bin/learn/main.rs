//! Trains the network that gives the chance of a collapse, on simulated slopes alone.
//!
//! - `learn [SLOPES]` trains it on so many slopes of each family and writes src/forecast/learned.txt.
//! - `learn --left-out [SLOPES] [--failing]` trains one network for each family on all the others, judges each family by
//!   the network that never saw it, and writes docs/families.md. That takes hours: a network that is trained is kept in
//!   target/left-out, and the next run goes on from there. `--failing`: the families that fail alone.
//!
//! - `learn --years` follows years of standing slopes, and lives of failing ones, by the network in force and writes docs/false-alarms.md.
//! - `learn --steady [SERIES]` follows so many series of steady creep, and of a rate that doubles and stays, and writes
//!   docs/steady-creep.md.
//!
//! Slopes for training have seeds from 0 on, those for judging from 1,000,000 on.

#![expect(clippy::print_stderr, reason = "progress is what it prints")]
#![expect(
    clippy::cast_possible_truncation,
    reason = "weights have single precision"
)]

mod descent;
mod judge;
mod looks;
mod reliability;
mod source;
mod steady;
mod table;
mod years;

use descent::{NETWORKS, Row, train};
use judge::Judged;
use looks::Look;
use slipwatch::forecast::Network;
use studies::Family;

/// Slopes of each family for training, unless another number is given.
const SLOPES: u64 = 1000;
/// Steady series, unless another number is given.
const STEADY: u64 = 500;
/// Passes over the looks: a first network finds the looks that mislead it, the second is trained on those too.
const PASSES: (usize, usize) = (6, 12);
fn main() -> anyhow::Result<()> {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut has = |flag: &str| {
        let before = arguments.len();
        arguments.retain(|one| one != flag);
        arguments.len() < before
    };
    let (is_left_out, fails_only) = (has("--left-out"), has("--failing"));
    if arguments.iter().any(|one| one == "--years") {
        return years::write(&source::in_force()?);
    }
    if arguments.first().is_some_and(|one| one == "--steady") {
        let series = arguments.get(1).map_or(Ok(STEADY), |text| text.parse())?;
        return steady::write(&source::in_force()?, series);
    }
    let slopes = arguments.first().map_or(Ok(SLOPES), |text| text.parse())?;
    if is_left_out {
        let families = Family::ALL.into_iter();
        let families: Vec<Family> = families
            .filter(|family| family.fails() || !fails_only)
            .collect();
        return table::write(&left_out(&families, slopes)?, slopes);
    }
    source::write(&Material::of(slopes).learn(None))
}

/// Each of `families` judged by a network that was trained on all the others; those that an earlier run has trained are not
/// trained again.
fn left_out(families: &[Family], slopes: u64) -> anyhow::Result<Vec<Judged>> {
    let missing = families.iter().copied();
    let missing: Vec<Family> = missing
        .filter(|family| source::kept(*family, slopes).is_err())
        .collect();
    if !missing.is_empty() {
        let material = Material::of(slopes);
        let written = looks::in_two(&missing, |family| {
            let network = material.learn(Some(*family));
            eprintln!("trained without {family:?}");
            vec![source::keep(&network, *family, slopes)]
        });
        written.into_iter().collect::<anyhow::Result<()>>()?;
    }
    let judged = families.iter().map(|family| {
        let judged = judge::family(*family, &source::kept(*family, slopes)?);
        eprintln!("judged {family:?}");
        Ok(judged)
    });
    judged.collect()
}

/// What networks are trained on.
struct Material {
    looks: Vec<Look>,
    /// Of which only those count that mislead.
    standing: Vec<Look>,
}

impl Material {
    /// Looks at so many slopes of each family.
    fn of(slopes: u64) -> Self {
        let material = Self {
            looks: looks::of_families(slopes),
            standing: looks::of_standing(slopes),
        };
        eprintln!(
            "{} looks at {slopes} slopes of each family, and {} at those that stand",
            material.looks.len(),
            material.standing.len()
        );
        material
    }

    /// A network trained on all families but one.
    fn learn(&self, without: Option<Family>) -> Network {
        let counts = |look: &&Look| Some(look.family) != without;
        let looks = self.looks.iter().filter(counts);
        let mut rows: Vec<Row> = looks.flat_map(looks::rows).collect();
        let first = train(&rows, PASSES.0, 1);
        let standing: Vec<&Look> = self.standing.iter().filter(counts).collect();
        let misleading = looks::misleading(&first, &standing);
        rows.extend(misleading.into_iter().flat_map(looks::rows));
        train(&rows, PASSES.1, NETWORKS)
    }
}
