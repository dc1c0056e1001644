//! `alerts`: lists those in force, shows one, or leaves an order in the state, beside a running daemon or without one.

mod bundle;
mod show;
mod unwritten;
mod words;

use super::args::OutputFormat;
use super::exit::UsageError;
use super::state::{SiteArgs, is_known, no_benchmark};
use super::text;
use crate::alert::Level;
use crate::config::{EXERCISE, value};
use crate::monitor::{Given, Order, OrderedBy};
use crate::reading::BenchmarkId;
use crate::runtime::alarm_state::Alarms;
use crate::runtime::clock;
use crate::runtime::restored::{is_over, keys_in_force};
use crate::runtime::standing::{TakenOrders, closed, in_force, silence_of_the_site};
use crate::store::Store;
use anyhow::Context;
use clap::Subcommand;
use clap::builder::NonEmptyStringValueParser;
use jiff::SignedDuration;
use schemars::JsonSchema;
use serde::Serialize;
use std::io::Write;

/// List the alerts in force, acknowledge or end them, or have no hook run for a time
#[derive(Debug, clap::Args)]
pub(super) struct AlertsArgs {
    #[command(subcommand)]
    action: Action,
}

/// Who gives an order, and why: it stands in the events and in `alerts show`.
#[derive(Debug, clap::Args)]
struct GivenArgs {
    /// Who
    #[arg(long, value_name = "NAME", value_parser = NonEmptyStringValueParser::new())]
    by: Option<String>,
    /// Why
    #[arg(long, value_name = "TEXT", value_parser = NonEmptyStringValueParser::new())]
    why: Option<String>,
}

impl GivenArgs {
    fn given(&self) -> Given {
        Given {
            by: self.by.clone(),
            why: self.why.clone(),
            door: Some(OrderedBy::CommandLine),
            given_at: Some(clock::now()),
            called_since: Vec::new(),
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
    /// Acknowledge the alerts in force: hooks that have not taken them are not tried again
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
        /// For how long, such as 8h; thirty days at most, seven of a red: the next red is not reported either
        #[arg(long = "for", value_name = "DURATION", value_parser = value::duration)]
        span: SignedDuration,
        #[command(flatten)]
        given: GivenArgs,
        #[command(flatten)]
        site: SiteArgs,
    },
    /// The level in force is over, because people know why it was called: it ends, and hooks get its end
    ///
    /// What is known of the slope stays: the next reading calls the level again, as a new alert, if it still calls for it.
    #[command(group = clap::ArgGroup::new("place").required(true))]
    Resolve {
        /// Where
        #[arg(long, value_name = "ID", group = "place")]
        benchmark: Option<String>,
        /// Everywhere
        #[arg(long, group = "place")]
        all: bool,
        /// Who
        #[arg(long, value_name = "NAME")]
        by: String,
        /// Why
        #[arg(long, value_name = "TEXT")]
        why: String,
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
    let (site, order) = match &args.action {
        Action::List { site } => return list(site),
        Action::Show(args) => return show::show(args),
        Action::Redeliver { site } => return redeliver(site),
        Action::Ack { site, .. }
        | Action::Shelve { site, .. }
        | Action::Silence { site, .. }
        | Action::Resolve { site, .. }
        | Action::Unsilence { site, .. } => (site, args.action.order()?),
    };
    let Some(order) = order else {
        return Ok(());
    };
    let (config, store) = site.open()?;
    // A drill waits for the acknowledgement of its own benchmark.
    let is_of_a_drill = config.drill.is_some() && order.acknowledges(EXERCISE);
    if let Some(benchmark) = order.benchmark()
        && !is_of_a_drill
        && !is_known(&config, &store, benchmark)?
    {
        return Err(unwritten::explained(&config, no_benchmark(benchmark)));
    }
    if let Some(silence) = silence_of_the_site(&store, &order, clock::now())? {
        let silence = text::line(&silence, &config.site.time_zone);
        anyhow::bail!(
            "the whole site is silenced, which unsilence without --benchmark ends: {}",
            silence.trim()
        );
    }
    if !is_of_a_drill && config.drill.is_none() {
        needs_an_alert(&store, &order).map_err(|error| unwritten::explained(&config, error))?;
    }
    let asked = store.ask(&order, None);
    asked.map_err(|error| unwritten::explained(&config, error.into()))?;
    let is_running = Store::is_held(&config.site.state_dir);
    let concerned = concerned(&store, &order)?;
    site.output
        .print(&order, |_| taken(&order, is_running) + &concerned)
}

/// What an acknowledgement or a silence of the whole site concerns: whoever leaves out `--benchmark` may mean one.
fn concerned(store: &Store, order: &Order) -> anyhow::Result<String> {
    let what = match order {
        Order::Acknowledge {
            benchmark: None, ..
        } => "acknowledges all that is in force",
        Order::Silence {
            benchmark: None, ..
        } => "silences the whole site, in force there now",
        Order::Acknowledge { .. }
        | Order::Silence { .. }
        | Order::Shelve { .. }
        | Order::Resolve { .. }
        | Order::Unsilence { .. } => return Ok(String::new()),
    };
    let in_force = in_force(store, None)?;
    let each = in_force.keys().map(|(place, level)| {
        let place = place.as_ref().map_or("the site", BenchmarkId::as_str);
        format!("{level} of {}", text::plain(place))
    });
    let each = each.collect::<Vec<String>>().join(", ");
    let each = if each.is_empty() { "nothing" } else { &each };
    Ok(format!("{what}: {each}; --benchmark names one alone\n"))
}

/// What becomes of an order that has been left in the state.
fn taken(order: &Order, is_running: bool) -> String {
    let when = if is_running {
        "noted; the daemon takes it within a second\n"
    } else {
        "noted, but NO DAEMON RUNS: it is taken at the next start\n"
    };
    let again = match order {
        Order::Resolve { .. } => {
            "the next reading calls the level again, as a new alert, if it still calls for it\n"
        }
        Order::Acknowledge { .. }
        | Order::Shelve { .. }
        | Order::Silence { .. }
        | Order::Unsilence { .. } => "",
    };
    format!("{when}{again}")
}

/// What acknowledges or ends an alert needs one.
fn needs_an_alert(store: &Store, order: &Order) -> anyhow::Result<()> {
    let place = order.benchmark();
    let shown = place.map_or_else(
        || "anywhere".to_owned(),
        |benchmark| format!("at benchmark {benchmark}"),
    );
    let in_force = in_force(store, None)?;
    let mut here = (in_force.keys()).filter(|(at, _)| place.is_none() || at.as_ref() == place);
    match order {
        Order::Acknowledge { .. } => {
            let alarms = Alarms::read(store, None, clock::now(), &[])?;
            if here.next().is_none() && alarms.is_all_seen(place) {
                anyhow::bail!("no alert is in force {shown}: there is nothing to acknowledge");
            }
        }
        Order::Resolve { .. } => {
            if !here.any(|(_, level)| *level != Level::Unknown) {
                anyhow::bail!("no level is in force {shown}: there is nothing to resolve");
            }
        }
        Order::Shelve {
            benchmark, until, ..
        } => {
            let levels: Vec<Level> = here.map(|(_, level)| *level).collect();
            let is_long = until.duration_since(clock::now()) > Order::LONGEST_SILENCE;
            if levels.contains(&Level::Red) && is_long {
                anyhow::bail!(
                    "red is in force {shown}, which is shelved for seven days at most: the next red is not reported either"
                );
            }
            if levels == [Level::Unknown] {
                anyhow::bail!(
                    "only unknown is in force {shown}, which is not shelved: `slipwatch alerts silence --benchmark {benchmark}` \
                     holds back everything of it"
                );
            }
        }
        Order::Silence { .. } | Order::Unsilence { .. } => {}
    }
    Ok(())
}

impl Action {
    /// The order that is given; `None` of what is none.
    fn order(&self) -> anyhow::Result<Option<Order>> {
        let until = |span: SignedDuration| {
            let until = clock::now().checked_add(span);
            until.context("that is too long")
        };
        let place = |benchmark: &Option<String>| benchmark.as_ref().map(BenchmarkId::new);
        Ok(Some(match self {
            Self::List { .. } | Self::Show(_) | Self::Redeliver { .. } => return Ok(None),
            Self::Ack {
                benchmark, given, ..
            } => Order::Acknowledge {
                benchmark: place(benchmark),
                alert: None,
                given: given.given(),
            },
            Self::Shelve {
                benchmark,
                span,
                given,
                ..
            } => {
                limit(*span, Order::LONGEST_SHELVE)?;
                Order::Shelve {
                    benchmark: BenchmarkId::new(benchmark),
                    until: until(*span)?,
                    given: given.given(),
                }
            }
            Self::Silence {
                benchmark,
                span,
                given,
                ..
            } => {
                limit(*span, Order::LONGEST_SILENCE)?;
                Order::Silence {
                    benchmark: place(benchmark),
                    until: until(*span)?,
                    given: given.given(),
                }
            }
            Self::Resolve {
                benchmark, by, why, ..
            } => {
                let (by, why) = (Some(by.clone()), Some(why.clone()));
                let given = GivenArgs { by, why }.given();
                Order::Resolve {
                    benchmark: place(benchmark),
                    given,
                }
            }
            Self::Unsilence {
                benchmark, given, ..
            } => Order::Unsilence {
                benchmark: place(benchmark),
                given: given.given(),
            },
        }))
    }
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
    /// Deliveries that do not: of the beginning of alerts that are over.
    left_out: usize,
}

fn redeliver(site: &SiteArgs) -> anyhow::Result<()> {
    let (_, store) = site.open()?;
    let keys = keys_in_force(&store)?;
    let (deliveries, left_out) = store.redeliver(&|body| is_over(body, &keys))?;
    let again = Redelivered {
        deliveries,
        left_out,
    };
    site.output.print(&again, |again| {
        let left_out = match again.left_out {
            0 => String::new(),
            count => format!("{count} are left out: their alerts are over\n"),
        };
        format!(
            "{} deliveries wait again; the daemon makes them at its next start or reload\n{left_out}",
            again.deliveries
        )
    })
}

fn list(site: &SiteArgs) -> anyhow::Result<()> {
    let (config, store) = site.open()?;
    let mut stdout = std::io::stdout().lock();
    let (in_force, orders) = (in_force(&store, None)?, TakenOrders::read(&store, None)?);
    let mut standing = orders.silences(clock::now());
    standing.extend(orders.acknowledged(&in_force));
    standing.extend(closed(&store, &in_force)?);
    standing.extend(in_force.into_values());
    standing.sort_by_key(|event| event.time);
    if let Some(fault) = unwritten::fault(&config) {
        writeln!(std::io::stderr(), "warning: {fault}")?;
    }
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
