//! slipwatch for Python: the library's own functions, arrays as numpy's, results as JSON that `slipwatch/__init__.py` opens.

mod errors;

use errors::{bad_input, raise};
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use slipwatch::alert::Policy;
use slipwatch::effects::{self, Options};
use slipwatch::fit::Exponent;
use slipwatch::inversion::{Inversion, InversionOptions};
use slipwatch::monitor::{Event, Settings};
use slipwatch::reading::{BenchmarkId, Quantity, Series, Timestamp};
use slipwatch::runtime::clock::Stopwatch;
use slipwatch::runtime::ingest::{ColumnMap, ReadOptions, read_files};
use slipwatch::runtime::replay::{ReplayPace, ReplayPlan, replay};
use slipwatch::runtime::shutdown;
use std::path::PathBuf;

/// Times in nanoseconds since 1970, UTC, and as many values.
type Columns<'py> = (
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
);

/// A benchmark and a quantity, or two times; None: not chosen.
type Pair = (Option<String>, Option<String>);

/// What files hold.
#[pyclass(frozen, module = "slipwatch._core")]
struct Recording(slipwatch::reading::Recording);

fn nanoseconds(times: impl Iterator<Item = Timestamp>) -> PyResult<Vec<i64>> {
    times
        .map(|time| {
            let nanoseconds = i64::try_from(time.as_nanosecond());
            nanoseconds.map_err(|_| {
                bad_input(&format!(
                    "the time {time} is no time of numpy's: 1678 to 2261"
                ))
            })
        })
        .collect()
}

impl Recording {
    fn chosen(&self, benchmark: Option<&str>, quantity: Option<&str>) -> PyResult<&Series> {
        let benchmark = benchmark.map(BenchmarkId::new);
        let quantity = quantity.map(quantity_of).transpose()?;
        self.0.series(benchmark.as_ref(), quantity).map_err(raise)
    }
}

#[pymethods]
impl Recording {
    /// Of each series its benchmark, quantity, unit and number of readings.
    #[getter]
    fn series(&self) -> Vec<(String, &'static str, String, usize)> {
        let one = |series: &Series| {
            let (id, unit) = (series.benchmark.to_string(), series.unit.to_string());
            (id, series.quantity().name(), unit, series.readings.len())
        };
        self.0.series.iter().map(one).collect()
    }

    /// Of each covariate its name, unit and number of samples.
    #[getter]
    fn channels(&self) -> Vec<(String, Option<String>, usize)> {
        let channels = self.0.channels.iter();
        channels
            .map(|one| (one.name.clone(), one.unit.clone(), one.samples.len()))
            .collect()
    }

    /// Where the data come from, as the file says.
    #[getter]
    fn provenance(&self) -> std::collections::BTreeMap<String, String> {
        self.0.provenance.clone()
    }

    /// Times, values and standard errors (NaN: none) of a benchmark.
    #[pyo3(signature = (benchmark=None, quantity=None))]
    fn readings<'py>(
        &self,
        py: Python<'py>,
        benchmark: Option<&str>,
        quantity: Option<&str>,
    ) -> PyResult<Columns<'py>> {
        let rows = &self.chosen(benchmark, quantity)?.readings;
        let times = nanoseconds(rows.iter().map(|row| row.time))?;
        let values: Vec<f64> = rows.iter().map(|row| row.value).collect();
        let sigma = rows.iter().map(|row| row.sigma.unwrap_or(f64::NAN));
        let sigma: Vec<f64> = sigma.collect();
        Ok((
            times.into_pyarray(py),
            values.into_pyarray(py),
            sigma.into_pyarray(py),
        ))
    }

    /// Times and values of a covariate.
    fn samples<'py>(
        &self,
        py: Python<'py>,
        channel: &str,
    ) -> PyResult<(Bound<'py, PyArray1<i64>>, Bound<'py, PyArray1<f64>>)> {
        let found = self.0.channels.iter().find(|one| one.name == channel);
        let found = found.ok_or_else(|| {
            let names: Vec<&str> = self
                .0
                .channels
                .iter()
                .map(|one| one.name.as_str())
                .collect();
            errors::not_there(&format!(
                "there is no channel {channel}: expected one of {names:?}"
            ))
        })?;
        let times = nanoseconds(found.samples.iter().map(|one| one.time))?;
        let values: Vec<f64> = found.samples.iter().map(|one| one.value).collect();
        Ok((times.into_pyarray(py), values.into_pyarray(py)))
    }
}

/// Reads files as every command does, a later one over an earlier one.
#[pyfunction]
fn read(py: Python<'_>, files: Vec<PathBuf>, columns: Vec<String>) -> PyResult<Recording> {
    let columns = columns.iter().map(|map| {
        let parsed: Result<ColumnMap, _> = map.parse();
        parsed.map_err(|error| bad_input(&format!("{map}: {error}")))
    });
    let options = ReadOptions {
        columns: columns.collect::<PyResult<_>>()?,
        ..ReadOptions::default()
    };
    let read = py.detach(|| read_files(&files, &options));
    Ok(Recording(read.map_err(raise)?.0))
}

fn quantity_of(name: &str) -> PyResult<Quantity> {
    match name {
        "displacement" => Ok(Quantity::Displacement),
        "velocity" => Ok(Quantity::Velocity),
        _ => Err(bad_input(&format!(
            "quantity: found {name:?}, expected displacement or velocity"
        ))),
    }
}

fn time_of(name: &str, text: Option<&str>) -> PyResult<Option<Timestamp>> {
    let parsed = text.map(|text| {
        let wrong = || {
            bad_input(&format!(
                "{name}: found {text:?}, expected a time with its offset"
            ))
        };
        text.parse().map_err(|_| wrong())
    });
    parsed.transpose()
}

fn json(value: &impl serde::Serialize) -> PyResult<String> {
    serde_json::to_string(value).map_err(|error| bad_input(&error.to_string()))
}

/// One inversion, as `fit --format json` gives it.
#[pyfunction]
fn fit(
    py: Python<'_>,
    recording: &Recording,
    chosen: Pair,
    between: Pair,
    m: Option<f64>,
    critical_velocity_mm_per_day: f64,
) -> PyResult<String> {
    let series = recording.chosen(chosen.0.as_deref(), chosen.1.as_deref())?;
    let (from, until) = between;
    let options = InversionOptions {
        from: time_of("from_time", from.as_deref())?,
        until: time_of("until", until.as_deref())?,
        exponent: m.map_or(Exponent::Free, Exponent::Fixed),
        critical_velocity_mm_per_day,
        ..InversionOptions::default()
    };
    if m.is_some_and(|m| !(m.is_finite() && m != 0.0 && (-20.0..=29.0).contains(&m))) {
        return Err(bad_input(&format!(
            "m: found {m:?}, expected -20 to 29, not 0"
        )));
    }
    let report = py.detach(|| {
        let inversion = Inversion::new(series, &options);
        let stopwatch = Stopwatch::start();
        let least_squares = inversion.least_squares();
        inversion.report(&least_squares, stopwatch.elapsed().as_secs_f64())
    });
    json(&report)
}

/// What the law lacks, as `explain --format json` gives it.
#[pyfunction]
fn explain(
    py: Python<'_>,
    recording: &Recording,
    chosen: Pair,
    seed: u64,
    surrogates: usize,
) -> PyResult<String> {
    let series = recording.chosen(chosen.0.as_deref(), chosen.1.as_deref())?;
    if !(99..=9999).contains(&surrogates) {
        return Err(bad_input(&format!(
            "surrogates: found {surrogates}, expected 99 to 9999"
        )));
    }
    let options = Options {
        seed,
        surrogates,
        ..Options::default()
    };
    let others = recording.0.series.iter();
    let others: Vec<&Series> = others
        .filter(|one| one.benchmark != series.benchmark)
        .collect();
    let explanation = py.detach(|| {
        effects::explain(
            series,
            &recording.0.channels,
            &others,
            &options,
            &mut |_| {},
        )
    });
    json(&explanation)
}

/// What the monitor would have said, an event a line, as `replay --format json` gives it.
#[pyfunction]
fn replayed(
    py: Python<'_>,
    recording: &Recording,
    chosen: Pair,
    until: Option<&str>,
    evacuation_hours: f64,
    critical_velocity_mm_per_day: f64,
) -> PyResult<Vec<String>> {
    let mut played = recording.0.clone();
    if chosen != (None, None) {
        let series = recording.chosen(chosen.0.as_deref(), chosen.1.as_deref())?;
        played.series = vec![series.clone()];
    }
    let evacuation_time = jiff::SignedDuration::try_from_secs_f64(evacuation_hours * 3600.0);
    let evacuation_time = evacuation_time.ok().filter(|time| time.is_positive());
    let evacuation_time = evacuation_time.ok_or_else(|| {
        bad_input(&format!(
            "evacuation_hours: found {evacuation_hours}, expected a number above 0"
        ))
    })?;
    let settings = Settings {
        policy: Policy {
            evacuation_time,
            critical_velocity_mm_per_day,
            ..Policy::default()
        },
        ..Settings::default()
    };
    let plan = ReplayPlan {
        site: "replay",
        settings: &settings,
        hooks: &[],
        pace: ReplayPace::Max,
        until: time_of("until", until)?,
    };
    let mut events: Vec<Event> = Vec::new();
    py.detach(|| {
        let runtime = tokio::runtime::Builder::new_multi_thread();
        let runtime = { runtime }.enable_all().build()?;
        // Nobody pulls it: an event is what ends a replay of a recording.
        let (_trigger, asked) = shutdown::pair();
        let mut keep = |event: &Event| {
            events.push(event.clone());
            Ok(())
        };
        let done = runtime.block_on(replay(&played, &plan, asked, &mut keep));
        done.map(drop).map_err(raise)
    })?;
    events.iter().map(json).collect()
}

#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    errors::register(module)?;
    module.add_class::<Recording>()?;
    module.add_function(wrap_pyfunction!(read, module)?)?;
    module.add_function(wrap_pyfunction!(fit, module)?)?;
    module.add_function(wrap_pyfunction!(explain, module)?)?;
    module.add_function(wrap_pyfunction!(replayed, module)?)
}
