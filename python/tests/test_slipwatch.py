"""The package as a user has it: installed from its wheel, beside the program's own recordings."""

import math
import pathlib
from datetime import datetime, timedelta, timezone

import numpy as np
import pytest

import slipwatch

ROOT = pathlib.Path(__file__).resolve().parents[2]
PREONZO = ROOT / "recordings" / "preonzo-2012.mcap"


@pytest.fixture(scope="module")
def preonzo():
    return slipwatch.read(PREONZO)


def failing(rows):
    first = datetime(2020, 3, 1, tzinfo=timezone.utc)
    lines = ["time,displacement_mm,rain_mm"]
    for row in rows:
        slip = 200 * math.log(120 / (120 - row))
        lines.append(f"{(first + timedelta(hours=row)).isoformat()},{slip:.4f},{row % 3}")
    return "\n".join(lines) + "\n"


def test_readings_are_numpy_arrays_of_what_the_file_holds(tmp_path):
    file = tmp_path / "P1.csv"
    file.write_text(failing(range(100)))
    recording = slipwatch.read(file)
    assert recording.series == [
        {"benchmark": "P1", "quantity": "displacement", "unit": "mm", "readings": 100}
    ]
    times, values, sigma = recording.arrays("P1")
    assert times.dtype == np.dtype("datetime64[ns]") and values.dtype == np.float64
    assert times[1] == np.datetime64("2020-03-01T01:00:00")
    assert values[60] == pytest.approx(200 * math.log(2), abs=1e-4)
    assert np.isnan(sigma).all()
    _, rain = recording.channel("rain_mm")
    assert list(rain[:4]) == [0, 1, 2, 0]


def test_frames_share_the_arrays_times_and_values(preonzo):
    pandas = pytest.importorskip("pandas")
    times, values, _ = preonzo.arrays("E3")
    frame = preonzo.to_pandas("E3")
    assert str(frame.index.tz) == "UTC" and len(frame) == len(times)
    assert (frame["value"].to_numpy() == values).all()
    assert frame.index[0] == pandas.Timestamp(times[0], tz="UTC")


def test_polars_where_it_is_installed(preonzo):
    polars = pytest.importorskip("polars")
    frame = preonzo.to_polars("E3")
    assert frame.schema["time"] == polars.Datetime("ns", "UTC")
    assert frame["value"].to_list() == preonzo.arrays("E3")[1].tolist()


def test_a_fit_and_its_forecast_say_the_same_and_know_nothing_later(preonzo):
    until = datetime(2012, 5, 1, tzinfo=timezone.utc)
    fit = slipwatch.fit(preonzo, "E3", until=until)
    assert fit["last"] <= until < datetime(2012, 5, 15, tzinfo=timezone.utc)
    assert fit["regime"]["label"] in {
        "unstable-accelerating",
        "stable-accelerating",
        "unstable-decelerating",
        "stable-decelerating",
        "undetermined",
    }
    forecast = slipwatch.forecast(preonzo, "E3", until=until)
    assert forecast["failure_time"] == fit["failure_time"]
    assert 0 <= forecast["failure_time"]["probability"] <= 1
    held = slipwatch.fit(preonzo, "E3", m=1.5)
    assert held["parameters"]["m"]["best"] == pytest.approx(1.5)


def test_a_replay_is_the_programs_own_event_for_event(preonzo):
    events = slipwatch.replay(preonzo, "E3")
    assert events[-1]["event"] == "summary" and events == slipwatch.replay(preonzo, "E3")
    levels = [one["level"] for one in events if one["event"] == "alert"]
    assert "red" in levels
    early = slipwatch.replay(preonzo, "E3", until="2012-04-20T00:00:00Z")
    assert early[:-1] == events[: len(early) - 1]


def test_the_refits_of_a_replay_are_a_frame(preonzo):
    pytest.importorskip("pandas")
    events = slipwatch.replay(preonzo, "E3")
    frame = slipwatch.events_frame(events)
    assert len(frame) == sum(one["event"] == "refit" for one in events)
    assert frame["failure_time.probability"].between(0, 1).all()
    assert str(frame.index.tz) == "UTC"


def test_explain_gives_the_search_with_its_verdict(tmp_path):
    file = tmp_path / "P1.csv"
    file.write_text(failing(range(60)))
    found = slipwatch.explain(slipwatch.read(file), surrogates=99)
    assert found["benchmark"] == "P1" and "verdict" in found and "candidates" in found


def test_a_bad_cell_is_named_by_file_line_column_and_value(tmp_path):
    file = tmp_path / "P1.csv"
    file.write_text(failing(range(3)) + "2020-03-02T00:00:00Z,broken,0\n")
    with pytest.raises(slipwatch.ReadingError) as raised:
        slipwatch.read(file)
    error = raised.value
    assert isinstance(error, ValueError)
    assert (error.file, error.line) == (str(file), 5)
    assert (error.column, error.value) == ("displacement_mm", "broken")
    assert "line 5" in str(error)


def test_what_is_not_there_or_cannot_be_meant_says_so(tmp_path, preonzo):
    with pytest.raises(OSError, match="nowhere.csv"):
        slipwatch.read(tmp_path / "nowhere.csv")
    with pytest.raises(slipwatch.SelectionError, match="E3"):
        slipwatch.fit(preonzo, "E99")
    with pytest.raises(slipwatch.SelectionError, match="no channel"):
        preonzo.channel("snow_mm")
    with pytest.raises(ValueError, match="expected displacement or velocity"):
        slipwatch.fit(preonzo, "E3", "acceleration")
    with pytest.raises(ValueError, match="without a zone"):
        slipwatch.fit(preonzo, "E3", until=datetime(2012, 5, 1))
    with pytest.raises(ValueError, match="above 0"):
        slipwatch.replay(preonzo, "E3", evacuation_hours=0)


def test_the_types_are_there_for_checkers():
    folder = pathlib.Path(slipwatch.__file__).parent
    assert (folder / "py.typed").exists() and (folder / "_core.pyi").exists()
    stub = (folder / "_core.pyi").read_text()
    for name in dir(slipwatch._core):
        if not name.startswith("_"):
            assert f"def {name}(" in stub or f"class {name}" in stub, name
