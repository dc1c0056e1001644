from os import PathLike

import numpy as np
import numpy.typing as npt

class ReadingError(ValueError):
    file: str | None
    line: int | None
    column: str | None
    value: str | None

class SelectionError(LookupError): ...
class SlipwatchError(Exception): ...

class Recording:
    @property
    def series(self) -> list[tuple[str, str, str, int]]: ...
    @property
    def channels(self) -> list[tuple[str, str | None, int]]: ...
    @property
    def provenance(self) -> dict[str, str]: ...
    def readings(
        self, benchmark: str | None = None, quantity: str | None = None
    ) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64], npt.NDArray[np.float64]]: ...
    def samples(self, channel: str) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]: ...

def read(files: list[str | PathLike[str]], columns: list[str]) -> Recording: ...
def fit(
    recording: Recording,
    chosen: tuple[str | None, str | None],
    between: tuple[str | None, str | None],
    m: float | None,
    critical_velocity_mm_per_day: float,
) -> str: ...
def explain(
    recording: Recording, chosen: tuple[str | None, str | None], seed: int, surrogates: int
) -> str: ...
def replayed(
    recording: Recording,
    chosen: tuple[str | None, str | None],
    until: str | None,
    evacuation_hours: float,
    critical_velocity_mm_per_day: float,
) -> list[str]: ...
