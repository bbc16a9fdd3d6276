"""Scenes of many kinds, on which the estimated error of the reduction is held against the true one."""

from typing import Any

from benchmarks.scenes import four_bar_of

DAMPED = {"ratio": 0.02, "frequencies": [20, 200]}
BAR = {"kind": "bar", "width": 0.0254, "thickness": 0.0254}
PLATE = {**BAR, "kind": "plate_link", "eye_diameter": 0.045, "bore_diameter": 0.02}
STEP_LOAD = {"time": [0, 0.15, 0.1501, 2], "value": [0, 0, 1, 1]}


def varied_scenes() -> dict[str, dict[str, Any]]:
    """Short analyses of four-bars and arms: speed, damping, start, loads, thickness, step."""
    return {
        "bars, 150 rpm, from rest": _four_bar(150),
        "bars, 150 rpm, quasi-static": _four_bar(150, initial="quasi-static"),
        "bars, 600 rpm, damped": _four_bar(600, damping=DAMPED),
        "bars, 60 rpm": _four_bar(60),
        "bars, rho_inf 0.8": _four_bar(150, rho_inf=0.8),
        "bars, rho_inf 1": _four_bar(150, rho_inf=1.0),
        "bars, gravity, 30 rpm": _four_bar(30, initial="quasi-static", gravity=[0, -9.81, 0]),
        "bars, side load": _four_bar(150, loads={"side": _force("coupler", "N", [0, 0, 50])}),
        "bars, load put on at once": _four_bar(60, loads={"hit": _force("rocker", "M", [300, 0, 0], STEP_LOAD)}),
        "bars, two revolutions": _four_bar(300, revolutions=2),
        "bars, no flywheel, damped": _four_bar(300, damping=DAMPED, bodies={}),
        "bars, 6 mm thick": _four_bar(100, BAR | {"thickness": 0.006}, damping=DAMPED),
        "plates, 150 rpm, from rest": _four_bar(150, PLATE),
        "plates, quasi-static, damped": _four_bar(150, PLATE, initial="quasi-static", damping=DAMPED),
        "plates, 6 mm thick, 300 rpm": _four_bar(300, PLATE | {"thickness": 0.006}, damping=DAMPED),
        "arm, cycloidal": _arm(),
        "arm, cycloidal, slow": _arm(0.5, rise=0.4),
        "arm, damped": _arm(damping=DAMPED),
        "arm, 3 mm thick": _arm(thickness=0.003),
        "arm, sudden start": _arm(motion={"kind": "constant_speed", "speed": "60 rpm"}),
        "arm, tip force, rho_inf 0.6": _arm(rho_inf=0.6, loads={"tip": _force("arm", "P", [0, 20, 10])}),
        "arm, long step": _arm(step=2e-3),
    }


def _force(link: str, at: str, vector: list[float], factor: Any = None) -> dict[str, Any]:
    return {"kind": "force", "link": link, "at": at, "vector": vector, **({"factor": factor} if factor else {})}


def _four_bar(
    rpm: float, shape: dict[str, Any] | None = None, revolutions: float = 0.5, **changed: Any
) -> dict[str, Any]:
    """Half a turn in 360 steps; keys of the analysis and of the scene may be changed."""
    shape = shape or BAR
    raw = four_bar_of(shape, {"mesh": {"elements": [12, 2, 1]}} if shape["kind"] == "bar" else {})
    raw["drive"]["motion"]["speed"] = f"{rpm} rpm"
    raw["output"] = {"probes": {"stress": _probe("rocker", "M", "stress"), "middle": _probe("coupler", "N")}}
    return _changed(raw, {"revolutions": revolutions, "steps_per_revolution": 720}, changed)


def _arm(
    end: float = 0.2, rise: float = 0.1, thickness: float = 0.01, motion: Any = None, **changed: Any
) -> dict[str, Any]:
    shape = {"kind": "bar", "between": ["O", "P"], "width": 0.02, "thickness": thickness}
    raw: dict[str, Any] = {
        "points": {"O": [0, 0], "P": [0.5, 0.0], "Q": [0.25, 0.01]},
        "links": {"arm": {"material": "steel", "shape": shape, "mesh": {"elements": [16, 2, 1]}}},
        "joints": {"O": {"kind": "revolute", "links": ["ground", "arm"], "at": "O"}},
        "drive": {"joint": "O", "motion": motion or {"kind": "cycloidal", "angle": "60 deg", "rise": rise}},
        "output": {"probes": {"stress": _probe("arm", "Q", "stress"), "tip": _probe("arm", "P")}},
    }
    return _changed(raw, {"end_time": end, "step": 5e-4}, changed)


def _probe(link: str, at: str, quantity: str = "displacement") -> dict[str, Any]:
    return {"link": link, "at": at, "quantity": quantity}


def _changed(raw: dict[str, Any], analysis: dict[str, Any], changed: dict[str, Any]) -> dict[str, Any]:
    own = {key: changed.pop(key) for key in ("initial", "rho_inf", "step") if key in changed}
    return {**raw, "analysis": {**analysis, **own}, **changed}
