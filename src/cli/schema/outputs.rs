//! What has a schema, and which type of the program writes it.

use crate::cli::alerts::Redelivered;
use crate::cli::check::{Refused, Shown};
use crate::cli::doctor::DoctorReport;
use crate::cli::fit::SiteReport;
use crate::cli::hook::HookReport;
use crate::cli::init::ConfigWritten;
use crate::cli::score::ScoreReport;
use crate::cli::simulate::Simulation;
use crate::cli::state::FileWritten;
use crate::cli::status::SiteStatus;
use crate::effects::{Explanation, Together};
use crate::inversion::{FitReport, SweepReport};
use crate::monitor::{Event, Order};
use crate::runtime::hook::HookBody;
use crate::runtime::ingest::ConvertReport;
use crate::runtime::serve::DaemonStatus;
use crate::runtime::view::{AlertView, Asked, BenchmarkView, SiteView};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};

/// One form of JSON that the program writes or takes.
pub(super) struct Output {
    pub(super) name: &'static str,
    pub(super) says: &'static str,
    pub(super) schema: fn(&mut SchemaGenerator) -> Schema,
    /// Whether others write it.
    pub(super) is_taken: bool,
}

const fn output(
    name: &'static str,
    says: &'static str,
    schema: fn(&mut SchemaGenerator) -> Schema,
) -> Output {
    Output {
        name,
        says,
        schema,
        is_taken: false,
    }
}

/// All of them, in the order of the commands.
pub(super) const OUTPUTS: [Output; 22] = [
    output(
        "init",
        "A line of init --format json: what was written, then what check says.",
        |all| either(all, &[of::<ConfigWritten>, of::<Shown>, of::<Refused>]),
    ),
    output(
        "check",
        "check --format json: what the config amounts to, or what is wrong with it.",
        |all| either(all, &[of::<Shown>, of::<Refused>]),
    ),
    output("doctor", "doctor --format json.", of::<DoctorReport>),
    output(
        "event",
        "A line of replay, events or alerts list with --format json, of /api/events, and what /api/stream sends as change.",
        of::<Event>,
    ),
    output("status", "status --format json.", of::<SiteStatus>),
    output(
        "alert",
        "alerts show --format json, and /api/alert.",
        of::<AlertView>,
    ),
    output(
        "order",
        "alerts ack, shelve, silence, resolve or unsilence with --format json, and the answer of POST /api/orders.",
        of::<Order>,
    ),
    output(
        "redeliver",
        "alerts redeliver --format json.",
        of::<Redelivered>,
    ),
    output("backup", "backup --format json.", of::<FileWritten>),
    output(
        "hook",
        "What a hook gets on stdin and a webhook in its body.",
        of::<HookBody>,
    ),
    output("hook-test", "hook test --format json.", of::<HookReport>),
    output(
        "fit",
        "A line of fit --format json: a benchmark, or, after several, which of them fail together.",
        |all| either(all, &[of::<FitReport>, of::<SiteReport>]),
    ),
    output("sweep", "sweep --format json.", of::<SweepReport>),
    output(
        "explain",
        "explain --format json: of one series, or of several together.",
        |all| either(all, &[of::<Explanation>, of::<Together>]),
    ),
    output(
        "score",
        "A line of score --format json, one for each benchmark.",
        of::<ScoreReport>,
    ),
    output("simulate", "simulate --format json.", of::<Simulation>),
    output("convert", "convert --format json.", of::<ConvertReport>),
    output(
        "report",
        "report --format json: the page that was written.",
        of::<FileWritten>,
    ),
    output("api-status", "/api/status.", of::<DaemonStatus>),
    output("api-site", "/api/site.", of::<SiteView>),
    output("api-benchmark", "/api/benchmark.", of::<BenchmarkView>),
    Output {
        is_taken: true,
        ..output("api-order", "What POST /api/orders takes.", of::<Asked>)
    },
];

/// One of several.
fn either(generator: &mut SchemaGenerator, each: &[fn(&mut SchemaGenerator) -> Schema]) -> Schema {
    let each: Vec<Schema> = each.iter().map(|one| one(generator)).collect();
    json_schema!({ "anyOf": each })
}

/// A reference to the type's schema, which then stands under `$defs`.
fn of<T: JsonSchema>(generator: &mut SchemaGenerator) -> Schema {
    generator.subschema_for::<T>()
}
