"""Restart files: states of a run on disk, from which it continues with the same rows after an interruption.

A state belongs to rows that are in the results file, to a scene, to the contents of its files and to this version of
kedfem. It is put in place whole, after its rows; it goes when the run is complete, or when another one's first rows
take the place of its rows.
"""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from secrets import token_hex
from time import perf_counter
from typing import Any

import numpy as np
import scipy.sparse as sp

from kedfem.accuracy.prepared import Prepared
from kedfem.errors import OutputError, SceneError
from kedfem.folders import sealed, unsealed
from kedfem.memory import Packed, packed
from kedfem.results import replacing
from kedfem.results.differences import flat
from kedfem.results.layout import installed_version
from kedfem.scene import Scene, geometry_files
from kedfem.store import contents, software

STATE = "state.kept"
EVERY = 10.0  # seconds between two states: what a kill may cost
SHARE = 20.0  # times what storing takes: a twentieth of a run's time at most
# times `every`, after which a state is stored though it is large: steps wait for their stresses
OVERDUE = 4.0
FORMAT = 3
ROUNDING = 1e-9  # of a model's numbers, on another machine


@dataclass
class Keeper:
    """Stores the states of one run, and puts one back.

    folder : of the results
    origin : what the run depends on, key → value
    every : seconds between two states
    run : a name that no other run has
    stored : the state to go on from, if there is one
    failed : why the last state could not be stored
    """

    folder: Path
    origin: dict[str, Any]
    every: float = EVERY
    run: str = ""
    stored: Packed | None = None
    failed: str = ""
    _since: float = 0.0
    _takes: float = 0.0

    @classmethod
    def of(cls, scene: Scene, folder: Path, resumes: bool, every: float = EVERY) -> "Keeper":
        """Of a run that begins, or goes on with the one whose state is in its folder.

        Raises
        ------
        OutputError
            There is no state to go on from, or it is damaged.
        SceneError
            It belongs to another scene, to other files, or to another version.
        """
        keeper = cls(folder, origin(scene), every, token_hex(8), _since=perf_counter())
        if resumes:
            keeper.stored = _read(folder / STATE)
            keeper.run = str(keeper.stored.content["run"])
            _refuse_other(keeper.stored.put_back("origin"), keeper.origin, "changed back")
        return keeper

    @property
    def steps(self) -> int:
        """Time points up to the state to go on from."""
        return int(self.stored.content["steps"]) if self.stored else 0

    def prepared(self, ready: Prepared) -> None:
        """What was planned and meshed belongs to the state to go on from."""
        self.origin |= {f"planned {key}": value for key, value in flat(ready.scene.model_dump(mode="json")).items()}
        model = _fingerprint(ready)
        if self.stored:
            remedy = "planned and meshed again as before (it is, where KEDFEM_CACHE still has both)"
            before = self.stored.put_back("all")
            same = _alike(before.pop("model"), model)
            _refuse_other(before, self.origin, remedy)
            if not same:
                message = "model: must be that of the run to be resumed, got other meshes or modes of links"
                raise SceneError(f"{message}; they have to be {remedy}, or run without --resume")
        self.origin["model"] = model

    def put_back(self, memories: Mapping[str, Any]) -> None:
        """Everything that the run remembers, as it was."""
        if self.stored:
            try:
                for name, each in memories.items():
                    self.stored.put_back(name, each)
            except ValueError as error:
                raise OutputError(f"{self.folder / STATE}: must be a stored state, got {error}") from error

    def due(self, waits: bool) -> bool:
        """Whether it is time to store a state; later, while steps wait whose stresses were not examined."""
        since = perf_counter() - self._since
        return since >= max(self.every, SHARE * self._takes) * (OVERDUE if waits else 1.0)

    def keep(self, steps: int, memories: Mapping[str, Any]) -> None:
        """Store a state that belongs to so many time points; where it cannot be, the run goes on without."""
        began = perf_counter()
        own = {k: v for k, v in self.origin.items() if k != "model" and not k.startswith("planned ")}
        header = {"format": FORMAT, "run": self.run, "steps": steps, "all": self.origin, "origin": own}
        content = packed(header | dict(memories))
        try:
            with replacing(self.folder / STATE) as part:
                part.write_bytes(sealed(content))
            self.failed = ""
        except OutputError as error:
            self.failed = str(error)
        self._since = perf_counter()
        self._takes = self._since - began

    def warnings(self) -> tuple[str, ...]:
        """What a user should know of states that could not be stored."""
        return (f"{self.failed}; had this run been killed, it could not have gone on",) if self.failed else ()


def remove_state(folder: Path) -> None:
    """A state that belongs to no rows any more goes."""
    with suppress(OSError):
        (folder / STATE).unlink(missing_ok=True)


def has_state(folder: Path) -> bool:
    """Whether there is a state to go on from."""
    return (folder / STATE).is_file()


def origin(scene: Scene) -> dict[str, Any]:
    """What a run depends on: kedfem and its libraries, the scene key by key, the contents of its files."""
    named = {f"contents of {name}": contents(files).hex() for name, files in geometry_files(scene).items()}
    return {"kedfem": installed_version(), "software": software(), **flat(scene.model_dump(mode="json")), **named}


def _refuse_other(before: Mapping[str, Any], now: Mapping[str, Any], remedy: str) -> None:
    """Only what has not changed can be gone on with; the first key that differs, or is there in one alone, is named."""
    for key in {**before, **now}:
        then, here = before.get(key, "nothing"), now.get(key, "nothing")
        if then != here:
            what = f"{key}: must be {_short(then)}, as in the run to be resumed, got {_short(here)}"
            raise SceneError(f"{what}; it has to be {remedy}, or run without --resume")


def _short(x: Any) -> str:
    text = str(x)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _read(path: Path) -> Packed:
    try:
        whole = path.read_bytes()
    except FileNotFoundError:
        message = f"{path}: must be the stored state of a run, got nothing there: the run is complete, ended before"
        raise OutputError(f"{message} it stored any, or cannot store them; run without --resume") from None
    except OSError as error:
        raise OutputError(f"{path}: must be a readable file, got {error.strerror}") from error
    try:
        content = unsealed(whole)
        if content is None:
            raise ValueError("other bytes than were written")
        found = Packed(content)
        if found.content.get("format") != FORMAT:
            raise ValueError("another layout")
        return found
    except ValueError as error:
        raise OutputError(f"{path}: must be a stored state, got {error}; run without --resume") from error


def _fingerprint(ready: Prepared) -> list[list[float]]:
    """Of the model's numbers, three for each array: how many, the sum of their sizes, and a sum that shows their places.

    Another processor's kernels change the last digits of stiffnesses, and of these.
    """
    out = []
    for link, joint in zip(ready.model.links, ready.model.joints, strict=True):
        K0 = link.K0.data if sp.issparse(link.K0) else link.K0
        for each in (link.X, link.m1, K0, joint.weights, joint.B, joint.columns):
            x = np.asarray(each, float).ravel()
            out.append([float(x.size), float(np.abs(x).sum()), float(np.cos(np.arange(x.size)) @ x)])
    return out


def _alike(one: list[list[float]], other: list[list[float]]) -> bool:
    """Whether two models are the same to rounding."""
    if len(one) != len(other):
        return False
    pairs = list(zip(one, other, strict=True))
    return all(a[0] == b[0] and max(abs(a[1] - b[1]), abs(a[2] - b[2])) <= ROUNDING * a[1] for a, b in pairs)
