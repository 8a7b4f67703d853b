"""The Bayesian Volumetric Map with arrays in and out.

    from bayesian_programs import bvm

    head = bvm.Head()
    look = head.look(depth, focal_px=(525, 525), centre_px=(319.5, 239.5), yaw=0.1)
    head.map.occupancy          # P(O = 1), (ρ, elevation, azimuth)
    look["next"]["azimuth"]     # where to look next, rad to the left

The frame: x ahead, y to the left, z up, m. Azimuth and yaw are positive to the left, elevation and pitch upwards, rad.
"""

import json
from collections.abc import Sequence
from typing import Any

from ._native import Gaze, Head, Map, _experiment
from ._native import _disparities as disparities

__all__ = ["Gaze", "Head", "Map", "disparities", "experiment"]


def experiment(
    scenes: Sequence[str], policies: Sequence[str], seeds: Sequence[int], steps: int = 40
) -> list[dict[str, Any]]:
    """Runs of `bvm experiment` without files: a dict for each scene, policy and seed, in this order.

    `scenes` are names of built-in scenes or paths of scene files, `policies` names of `bvm explore`, or `oracle` and
    `floor`; `steps` is the number of looks. Runs go in parallel without the interpreter lock. A row has

    - `scene`, `policy`, `seed`, `steps`;
    - of the map after the last look: `entropy` and `occupancy_entropy`, Σ H(O, V) and Σ H(O) over all cells, nats;
      `reachable`, Σ H(O) over the cells that the truth says are visible, and `visible`, their number; `log_loss`, nats for
      each visible cell; `precision` and `recall` of surfaces; `false_occupied`, free cells taken for occupied;
    - `seconds` and `travel_rad`, what the head needed; `decision_us`, the median time of a decision, µs.

    All but `decision_us` depend on scene, policy, seed and steps only. Raises `Error` for a name that does not exist.
    """
    runs = json.loads(_experiment(scenes, policies, seeds, steps))
    return [_row(run) for run in runs]


def _row(run: dict[str, Any]) -> dict[str, Any]:
    about = {"scene": run["scene"], "policy": run["contender"], "seed": run["seed"], "steps": run["steps"]}
    return {**about, **run["looks"][-1], "decision_us": run["decision_us"]}
