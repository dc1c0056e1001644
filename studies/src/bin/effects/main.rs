//! Synthetic slopes with a known effect in them, and how well `effects::explain` finds it: `effects`.
//!
//!     cargo run --release -p studies --bin effects -- --dump DIR --range dev --n 20
//!     cargo run --release -p studies --bin effects -- --range judged --n 20 --write
//!
//! Development and judgement have seeds of their own: nothing is tuned on what is judged.

mod drawn;
mod dump;
mod family;
mod ground;
mod instrument;
mod laws;
mod read;
mod scene;
mod schedule;
mod score;
mod slope;
mod table;
#[cfg(test)]
mod tests;
mod truth;
mod weather;

use anyhow::{Context, Result};
use clap::Parser;
use drawn::{Drawn, drawn};
use family::{Range, SceneFamily};
use score::Outcome;
use slipwatch::effects;
use slipwatch::reading::Series;
use slipwatch::runtime::clock::Stopwatch;
use std::io::Write as _;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

/// Draws slopes with known effects and has them explained.
#[derive(Debug, Parser)]
struct Arguments {
    /// Families, such as `hydrological`, `none`, `mixed`, `outside`; all where none is named.
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// Series of each family.
    #[arg(long, default_value_t = 20)]
    n: u64,
    /// The first series of each family.
    #[arg(long, default_value_t = 0)]
    from: u64,
    /// Which seeds.
    #[arg(long, value_enum, default_value = "dev")]
    range: Range,
    /// Writes every series and its truth into this folder, and explains nothing.
    #[arg(long)]
    dump: Option<PathBuf>,
    /// Writes docs/effects-table.md in place of showing the table.
    #[arg(long)]
    write: bool,
    /// Says under each series that is not right what was refused, and why.
    #[arg(long)]
    refused: bool,
    /// Threads.
    #[arg(long, default_value_t = 2)]
    threads: usize,
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    let families = families(&arguments.only)?;
    if let Some(folder) = &arguments.dump {
        let written = each(&arguments, &families, |_, name, drawn| {
            dump::write(folder, name, drawn)
        })?;
        return written.into_iter().collect();
    }
    let outcomes = each(&arguments, &families, |family, name, drawn| {
        explained(family, name, drawn, arguments.refused)
    })?;
    let document = table::document(&outcomes, arguments.range);
    if arguments.write {
        let file = studies::project().join("docs/effects-table.md");
        std::fs::write(file, document)?;
    } else {
        write!(std::io::stdout(), "{document}")?;
    }
    Ok(())
}

/// Explains one series and says in a line how that went; where `refused`, also what it refused.
fn explained(family: SceneFamily, name: &str, drawn: &Drawn, refused: bool) -> Outcome {
    let neighbours: Vec<&Series> = drawn.neighbours.iter().collect();
    let watch = Stopwatch::start();
    let explanation = effects::explain(
        &drawn.series,
        &drawn.channels,
        &neighbours,
        &effects::Options::default(),
        &mut |_| {},
    );
    let seconds = watch.elapsed().as_secs_f64();
    let outcome = Outcome::of(family, name, (drawn, &explanation), seconds);
    let mark = if outcome.right_kind() {
        "right"
    } else {
        "WRONG"
    };
    // Who reads the table can do without the lines.
    let _ = writeln!(
        std::io::stderr(),
        "{mark} {}: there {:?}, said {:?}, called {}, {seconds:.1} s",
        outcome.name,
        outcome.there,
        outcome.said,
        outcome.called
    );
    if refused && !outcome.right_kind() {
        let (of_all, given) = (&explanation.error.fit, given_the_truth(drawn));
        let _ = writeln!(
            std::io::stderr(),
            "    {} readings of {:?}; left of the fit: {:?} by the plain law, {:?} as explained, {given:?} given the truth; explained {:?}, not separated {:?}",
            drawn.truth.readings,
            drawn.series.quantity(),
            of_all.before,
            of_all.after,
            explanation.explained,
            explanation.cannot_separate_from
        );
        for one in &drawn.truth.effects {
            let _ = writeln!(
                std::io::stderr(),
                "    there: {} ({}) {:?}, at {:?}, size {:?}, {:.1} noises",
                one.effect,
                one.what,
                one.channel,
                one.at,
                one.size,
                one.rms_over_noise
            );
        }
        for one in &explanation.candidates {
            let _ = writeln!(
                std::io::stderr(),
                "    {} {:?}: BIC {:.1}, p {:?}, held out {:?}: {:?}",
                one.effect,
                one.at,
                one.bic_gain,
                one.p_value,
                one.held_out,
                one.rejected_because
            );
        }
    }
    outcome
}

/// What the fit of the law that was given the truth leaves, in the readings' unit.
fn given_the_truth(drawn: &Drawn) -> Option<f64> {
    let causes = score::causes(&drawn.truth)?;
    let options = effects::Options::default();
    let error = effects::error_given(&drawn.series, &drawn.channels, &causes, None, &options)?;
    error.fit.after
}

fn families(names: &[String]) -> Result<Vec<SceneFamily>> {
    if names.is_empty() {
        return Ok(SceneFamily::ALL.to_vec());
    }
    let named = |name: &String| {
        let known = SceneFamily::ALL.map(SceneFamily::name).join(", ");
        SceneFamily::named(name).with_context(|| format!("{name:?}: expected one of {known}"))
    };
    names.iter().map(named).collect()
}

/// Draws every series asked for and gives it to `task`; the results in the order of families and seeds.
fn each<T: Send>(
    arguments: &Arguments,
    families: &[SceneFamily],
    task: impl Fn(SceneFamily, &str, &Drawn) -> T + Sync,
) -> Result<Vec<T>> {
    let total = arguments.n * families.len() as u64;
    let next = AtomicU64::new(0);
    let done = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        let work = || -> Result<()> {
            loop {
                let place = next.fetch_add(1, Ordering::Relaxed);
                if place >= total {
                    return Ok(());
                }
                let family = families[usize::try_from(place / arguments.n)?];
                let index = arguments.from + place % arguments.n;
                let name = format!("{}-{index:03}", family.name());
                let one = drawn(family, arguments.range, index)
                    .with_context(|| format!("{name}: no draw meets the conditions"))?;
                let result = task(family, &name, &one);
                if let Ok(mut done) = done.lock() {
                    done.push((place, result));
                }
            }
        };
        let workers: Vec<_> = (0..arguments.threads).map(|_| scope.spawn(work)).collect();
        for worker in workers {
            worker
                .join()
                .map_err(|_| anyhow::anyhow!("a worker panicked"))??;
        }
        anyhow::Ok(())
    })?;
    let mut done = done
        .into_inner()
        .map_err(|_| anyhow::anyhow!("a worker panicked"))?;
    done.sort_by_key(|(place, _)| *place);
    Ok(done.into_iter().map(|(_, result)| result).collect())
}
