//! `alerts`: lists those in force, shows one, or leaves an order in the state, beside a running daemon or without one.

mod bundle;
mod show;
mod words;

use super::args::OutputFormat;
use super::exit::UsageError;
use super::state::SiteArgs;
use super::text;
use crate::config::{Config, EXERCISE, value};
use crate::monitor::{Given, Order, OrderedBy};
use crate::reading::BenchmarkId;
use crate::runtime::clock;
use crate::runtime::standing::{acknowledged, closed, in_force, orders, silences};
use anyhow::Context;
use clap::Subcommand;
use jiff::SignedDuration;
use schemars::JsonSchema;
use serde::Serialize;
use std::io::Write;

/// List the alerts in force, acknowledge them, or have no hook run for a time
#[derive(Debug, clap::Args)]
pub(super) struct AlertsArgs {
    #[command(subcommand)]
    action: Action,
}

/// Who gives an order, and why: it stands in the events and in `alerts show`.
#[derive(Debug, clap::Args)]
struct GivenArgs {
    /// Who
    #[arg(long, value_name = "NAME")]
    by: Option<String>,
    /// Why
    #[arg(long, value_name = "TEXT")]
    why: Option<String>,
}

impl GivenArgs {
    fn given(&self) -> Given {
        Given {
            by: self.by.clone(),
            why: self.why.clone(),
            door: Some(OrderedBy::CommandLine),
            given_at: Some(clock::now()),
        }
    }
}

#[derive(Debug, Subcommand)]
enum Action {
    /// List the alerts in force
    List {
        #[command(flatten)]
        site: SiteArgs,
    },
    /// Say everything about one alert: what called it, what it recommends, who got it, who has seen it
    Show(show::ShowArgs),
    /// Somebody has seen what is in force: hooks that have not taken it are not tried again
    Ack {
        /// Where; default is everywhere
        #[arg(long, value_name = "ID")]
        benchmark: Option<String>,
        #[command(flatten)]
        given: GivenArgs,
        #[command(flatten)]
        site: SiteArgs,
    },
    /// Run no hook for the level in force at a benchmark or a lower one; for a higher one they are run at once
    Shelve {
        /// Where
        #[arg(long, value_name = "ID")]
        benchmark: String,
        /// For how long, such as 8h; thirty days at most
        #[arg(long = "for", value_name = "DURATION", value_parser = value::duration)]
        span: SignedDuration,
        #[command(flatten)]
        given: GivenArgs,
        #[command(flatten)]
        site: SiteArgs,
    },
    /// Have hooks tried again with the alerts that were given up: at the daemon's next start or reload
    Redeliver {
        #[command(flatten)]
        site: SiteArgs,
    },
    /// Run the hooks again, from now on, for what was silenced or shelved; what is in force is sent then
    #[command(visible_alias = "unshelve")]
    Unsilence {
        /// Where; default is everywhere
        #[arg(long, value_name = "ID")]
        benchmark: Option<String>,
        #[command(flatten)]
        given: GivenArgs,
        #[command(flatten)]
        site: SiteArgs,
    },
    /// Run no hook, not for red either; what is in force at the end, or has ended meanwhile, is sent then
    Silence {
        /// Where; default is everywhere
        #[arg(long, value_name = "ID")]
        benchmark: Option<String>,
        /// For how long, such as 30min; seven days at most
        #[arg(long = "for", value_name = "DURATION", value_parser = value::duration)]
        span: SignedDuration,
        #[command(flatten)]
        given: GivenArgs,
        #[command(flatten)]
        site: SiteArgs,
    },
}

/// Lists alerts, or leaves an order.
pub(super) fn run(args: &AlertsArgs) -> anyhow::Result<()> {
    let until = |span: SignedDuration| clock::now().checked_add(span).context("that is too long");
    let (site, order) = match &args.action {
        Action::List { site } => return list(site),
        Action::Show(args) => return show::show(args),
        Action::Redeliver { site } => return redeliver(site),
        Action::Ack {
            benchmark,
            given,
            site,
        } => {
            let (benchmark, given) = (benchmark.as_ref().map(BenchmarkId::new), given.given());
            let order = Order::Acknowledge {
                benchmark,
                alert: None,
                given,
            };
            (site, order)
        }
        Action::Shelve {
            benchmark,
            span,
            given,
            site,
        } => {
            limit(*span, Order::LONGEST_SHELVE)?;
            let order = Order::Shelve {
                benchmark: BenchmarkId::new(benchmark),
                until: until(*span)?,
                given: given.given(),
            };
            (site, order)
        }
        Action::Silence {
            benchmark,
            span,
            given,
            site,
        } => {
            limit(*span, Order::LONGEST_SILENCE)?;
            let order = Order::Silence {
                benchmark: benchmark.as_ref().map(BenchmarkId::new),
                until: until(*span)?,
                given: given.given(),
            };
            (site, order)
        }
        Action::Unsilence {
            benchmark,
            given,
            site,
        } => {
            let (benchmark, given) = (benchmark.as_ref().map(BenchmarkId::new), given.given());
            (site, Order::Unsilence { benchmark, given })
        }
    };
    let (config, store) = site.open()?;
    let is_known =
        |benchmark: &BenchmarkId| config.benchmarks.iter().any(|one| one.id == *benchmark);
    if let Some(benchmark) = order.benchmark()
        && !is_of_a_drill(&config, &order)
        && !is_known(benchmark)
        && !store.benchmarks()?.contains_key(benchmark)
    {
        anyhow::bail!("benchmark {benchmark} has given no readings yet");
    }
    store.ask(&order)?;
    site.output.print(&order, |_| {
        "noted; the daemon takes it within a second, or at its next start\n".to_owned()
    })
}

/// A drill waits for the acknowledgement of its own benchmark.
fn is_of_a_drill(config: &Config, order: &Order) -> bool {
    let is_acknowledged = matches!(order, Order::Acknowledge { .. });
    let place = order.benchmark().map(BenchmarkId::as_str);
    config.drill.is_some() && is_acknowledged && place == Some(EXERCISE)
}

/// Nobody is to be left without alerts for ever by one order.
fn limit(span: SignedDuration, longest: SignedDuration) -> anyhow::Result<()> {
    if span > longest {
        let hours = longest.as_hours();
        let text =
            format!("--for {span:#} is too long: {hours}h at most, then give the order again");
        return Err(UsageError(text).into());
    }
    Ok(())
}

/// What `redeliver` has done.
#[derive(Debug, JsonSchema, Serialize)]
pub(super) struct Redelivered {
    /// Deliveries that wait again.
    deliveries: usize,
}

fn redeliver(site: &SiteArgs) -> anyhow::Result<()> {
    let (_, store) = site.open()?;
    let deliveries = store.redeliver()?;
    site.output.print(&Redelivered { deliveries }, |again| {
        format!(
            "{} deliveries wait again; the daemon makes them at its next start or reload\n",
            again.deliveries
        )
    })
}

fn list(site: &SiteArgs) -> anyhow::Result<()> {
    let (config, store) = site.open()?;
    let mut stdout = std::io::stdout().lock();
    let (in_force, orders) = (in_force(&store, None)?, orders(&store)?);
    let mut standing = silences(&orders, clock::now());
    standing.extend(acknowledged(&orders, &in_force));
    standing.extend(closed(&store, &in_force)?);
    standing.extend(in_force.into_values());
    standing.sort_by_key(|event| event.time);
    for event in &standing {
        match site.output.format {
            OutputFormat::Json => writeln!(stdout, "{}", serde_json::to_string(event)?)?,
            OutputFormat::Text => {
                writeln!(stdout, "{}", text::line(event, &config.site.time_zone))?;
            }
        }
    }
    Ok(())
}
