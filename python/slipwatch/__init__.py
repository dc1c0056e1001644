"""Landslide early warning by the slider-block friction law.

    recording = slipwatch.read("recordings/preonzo-2012.mcap")
    slipwatch.fit(recording, "E3")["regime"]["label"]

Results are the dictionaries that the program's `--format json` gives, with times as timezone-aware `datetime`; what they
mean and in which unit stands in docs/schema. A number that is unbounded or does not exist is None. Bad input raises
`ReadingError` with `file`, `line`, `column` and `value`.
"""

from __future__ import annotations

import json
import re
from datetime import datetime
from os import PathLike
from typing import TYPE_CHECKING, Any, Iterable, Sequence

import numpy as np

from . import _core
from ._core import ReadingError, SelectionError, SlipwatchError

if TYPE_CHECKING:
    import pandas
    import polars

__all__ = [
    "ReadingError",
    "Recording",
    "SelectionError",
    "SlipwatchError",
    "events_frame",
    "explain",
    "fit",
    "forecast",
    "read",
    "replay",
]

_TIME = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d+)?Z")


def _opened(value: Any) -> Any:
    """Times as datetime; microseconds are as fine as these are."""
    if isinstance(value, dict):
        return {key: _opened(one) for key, one in value.items()}
    if isinstance(value, list):
        return [_opened(one) for one in value]
    if isinstance(value, str) and _TIME.fullmatch(value):
        seconds, _, fraction = value[:-1].partition(".")
        return datetime.fromisoformat(f"{seconds}.{fraction[:6]:0<6}+00:00")
    return value


def _text(time: datetime | str | None) -> str | None:
    if time is None or isinstance(time, str):
        return time
    if time.tzinfo is None:
        raise ValueError(f"found the time {time} without a zone, expected one with it")
    return time.isoformat()


class Recording:
    """The readings and covariates that files hold."""

    def __init__(self, core: _core.Recording) -> None:
        self._core = core

    def __repr__(self) -> str:
        of = [f"{id} ({quantity}, {count})" for id, quantity, _, count in self._core.series]
        return f"<slipwatch.Recording of {', '.join(of)}>"

    @property
    def series(self) -> list[dict[str, Any]]:
        """Of each series its benchmark, quantity, unit and number of readings."""
        keys = ("benchmark", "quantity", "unit", "readings")
        return [dict(zip(keys, one)) for one in self._core.series]

    @property
    def channels(self) -> list[dict[str, Any]]:
        """Of each covariate its name, unit and number of samples."""
        return [dict(zip(("name", "unit", "samples"), one)) for one in self._core.channels]

    @property
    def provenance(self) -> dict[str, str]:
        """Where the data come from, as the file says."""
        return self._core.provenance

    def arrays(
        self, benchmark: str | None = None, quantity: str | None = None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Times (datetime64[ns], UTC), values in the series' unit, and standard errors (NaN where none is stated)."""
        times, values, sigma = self._core.readings(benchmark, quantity)
        return times.view("datetime64[ns]"), values, sigma

    def channel(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Times (datetime64[ns], UTC) and values of a covariate."""
        times, values = self._core.samples(name)
        return times.view("datetime64[ns]"), values

    def to_pandas(
        self, benchmark: str | None = None, quantity: str | None = None
    ) -> "pandas.DataFrame":
        """Value and standard error by time."""
        import pandas

        times, values, sigma = self.arrays(benchmark, quantity)
        index = pandas.DatetimeIndex(times, name="time").tz_localize("UTC")
        return pandas.DataFrame({"value": values, "sigma": sigma}, index=index, copy=False)

    def to_polars(
        self, benchmark: str | None = None, quantity: str | None = None
    ) -> "polars.DataFrame":
        """Time, value and standard error."""
        import polars

        times, values, sigma = self.arrays(benchmark, quantity)
        frame = polars.DataFrame({"time": times, "value": values, "sigma": sigma})
        return frame.with_columns(polars.col("time").dt.replace_time_zone("UTC"))


def read(
    files: str | PathLike[str] | Iterable[str | PathLike[str]], columns: Sequence[str] = ()
) -> Recording:
    """Reads CSV, NDJSON, TOA5 or MCAP by the names' endings; values of a later file replace those of an earlier one.

    `columns` say what a column means whose name does not: "NAME=ID:QUANTITY:UNIT".
    """
    if isinstance(files, (str, PathLike)):
        files = [files]
    return Recording(_core.read(list(files), list(columns)))


def fit(
    recording: Recording,
    benchmark: str | None = None,
    quantity: str | None = None,
    *,
    from_time: datetime | str | None = None,
    until: datetime | str | None = None,
    m: float | None = None,
    critical_velocity_mm_per_day: float = 1000.0,
) -> dict[str, Any]:
    """One inversion: regime, parameters with intervals, failure time. Of readings between two times; `m` holds m there."""
    chosen, between = (benchmark, quantity), (_text(from_time), _text(until))
    report = _core.fit(recording._core, chosen, between, m, critical_velocity_mm_per_day)
    return _opened(json.loads(report))


def forecast(
    recording: Recording,
    benchmark: str | None = None,
    quantity: str | None = None,
    *,
    until: datetime | str | None = None,
    critical_velocity_mm_per_day: float = 1000.0,
) -> dict[str, Any]:
    """When the slope collapses and when it passes the critical velocity, as known at `until` or the last reading."""
    report = fit(
        recording,
        benchmark,
        quantity,
        until=until,
        critical_velocity_mm_per_day=critical_velocity_mm_per_day,
    )
    keys = ("benchmark", "last", "failure_time", "critical_velocity_time", "inverse_velocity")
    return {key: report[key] for key in keys}


def explain(
    recording: Recording,
    benchmark: str | None = None,
    quantity: str | None = None,
    *,
    seed: int = 1,
    surrogates: int = 399,
) -> dict[str, Any]:
    """What the law lacks here: residual, missing effect, error before and after."""
    found = _core.explain(recording._core, (benchmark, quantity), seed, surrogates)
    return _opened(json.loads(found))


def replay(
    recording: Recording,
    benchmark: str | None = None,
    quantity: str | None = None,
    *,
    until: datetime | str | None = None,
    evacuation_hours: float = 24.0,
    critical_velocity_mm_per_day: float = 1000.0,
) -> list[dict[str, Any]]:
    """What the monitor would have said, event by event in data time; the last one is a summary."""
    events = _core.replayed(
        recording._core,
        (benchmark, quantity),
        _text(until),
        evacuation_hours,
        critical_velocity_mm_per_day,
    )
    return [_opened(json.loads(event)) for event in events]


def events_frame(events: Sequence[dict[str, Any]], kind: str = "refit") -> "pandas.DataFrame":
    """The events of one kind as a table by time; what stands inside a key is a column `key.inner`."""
    import pandas

    frame = pandas.json_normalize([one for one in events if one["event"] == kind])
    if frame.empty:
        return frame
    return frame.set_index(pandas.DatetimeIndex(frame.pop("time"), name="time"))
