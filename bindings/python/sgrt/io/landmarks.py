"""Landmarks, schema sgrt-landmarks/1: named places on a body, each with its covariance and score."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import compress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import Coarse, Context, LandmarkModel, Landmarks, coarse_align
from ..errors import FormatError
from ._files import PathLike, check_schema, naming, numbers, parse_json, plain, read_text, write_json, writing

SCHEMA = "sgrt-landmarks/1"


@dataclass(frozen=True)
class LandmarkSet:
    """names: N; position_mm: N x 3, room frame; covariance_mm2: N x 3 x 3, or None; score: N, NaN where there is none.

    A name that occurs twice stands for candidates, of which at most one is right.
    """

    names: tuple[str, ...]
    position_mm: NDArray[np.float64]
    covariance_mm2: NDArray[np.float64] | None = None
    score: NDArray[np.float64] | None = None

    def moved(self, pose: NDArray[np.float64]) -> LandmarkSet:
        """The set under a rigid motion, 4 x 4."""
        turn, shift = pose[:3, :3], pose[:3, 3]
        covariance = None if self.covariance_mm2 is None else turn @ self.covariance_mm2 @ turn.T
        return LandmarkSet(self.names, self.position_mm @ turn.T + shift, covariance, self.score)


def landmarks_align(
    reference: LandmarkSet,
    live: LandmarkSet,
    *,
    isocentre_mm: Sequence[float],
    context: Context | None = None,
    **known: float,
) -> Coarse:
    """coarse_align of two sets by their names; known: its options."""
    number = {name: i for i, name in enumerate(sorted({*reference.names, *live.names}))}
    ids = [np.array([number[name] for name in names], np.int32) for names in (reference.names, live.names)]
    return coarse_align(
        reference.position_mm.reshape(-1, 3),
        ids[0],
        live.position_mm.reshape(-1, 3),
        ids[1],
        isocentre_mm=isocentre_mm,
        reference_covariance_mm2=reference.covariance_mm2,
        live_covariance_mm2=live.covariance_mm2,
        context=context,
        **known,
    )


def _landmark(value: Any, where: str) -> tuple[str, Any, Any, float]:
    if not isinstance(value, dict):
        raise FormatError(f"{where} is {value!r}; expected an object")
    name = value.get("name")
    if not isinstance(name, str) or not name:
        raise FormatError(f"{where}.name is {name!r}; expected a text")
    if "position_mm" not in value:
        raise FormatError(f"{where}.position_mm is missing")
    position = numbers(value["position_mm"], (3,), f"{where}.position_mm")
    covariance = value.get("covariance_mm2")
    if covariance is not None:
        covariance = numbers(covariance, (3, 3), f"{where}.covariance_mm2")
    score = value.get("score")
    score = math.nan if score is None else float(numbers([score], (1,), f"{where}.score")[0])
    return name, position, covariance, score


def read_landmarks(path: PathLike) -> LandmarkSet:
    """The landmarks of a file; covariance_mm2 for all of them or for none. Raises OSError, FormatError."""
    text = read_text(path)
    with naming(path):
        value = parse_json(text)
        check_schema(value, SCHEMA)
        entries = value.get("landmarks")
        if not isinstance(entries, list):
            raise FormatError(f"landmarks is {entries!r}; expected a list")
        rows = [_landmark(entry, f"landmarks[{i}]") for i, entry in enumerate(entries)]
        without = [i for i, row in enumerate(rows) if row[2] is None]
        if without and len(without) < len(rows):
            raise FormatError(f"landmarks[{without[0]}].covariance_mm2 is missing, which others have")
        return LandmarkSet(
            tuple(row[0] for row in rows),
            np.array([row[1] for row in rows]).reshape(-1, 3),
            None if without or not rows else np.array([row[2] for row in rows]),
            np.array([row[3] for row in rows]),
        )


def _entries(landmarks: LandmarkSet) -> list[dict[str, Any]]:
    entries = []
    for i, name in enumerate(landmarks.names):
        entry: dict[str, Any] = {"name": name, "position_mm": landmarks.position_mm[i]}
        if landmarks.covariance_mm2 is not None:
            entry["covariance_mm2"] = landmarks.covariance_mm2[i]
        if landmarks.score is not None:
            entry["score"] = float(landmarks.score[i])
        entries.append(entry)
    return entries


def write_landmarks(path: PathLike, landmarks: LandmarkSet, **known: Any) -> None:
    """Writes a set; known: further keys of the document."""
    write_json(path, {"schema": SCHEMA, **known, "landmarks": _entries(landmarks)})


def landmarks_document(found: Landmarks | None, *, status: str | None = None, **known: Any) -> dict[str, Any]:
    """The JSON of located landmarks; those not in view are left out. status: of a search that has no result."""
    if found is None:
        return {"schema": SCHEMA, "status": status, "landmarks": [], **known}
    seen = np.isfinite(found.positions_mm[:, 0])
    names = tuple(compress(found.names, seen))
    places = LandmarkSet(names, found.positions_mm[seen], found.covariance_mm2[seen], found.scores[seen])
    entries = _entries(places)
    for entry, repeat in zip(entries, found.repeat_covariance_mm2[seen], strict=True):
        if not np.array_equal(repeat, entry["covariance_mm2"]):  # of a patient's own model
            entry["repeat_covariance_mm2"] = repeat
    document: dict[str, Any] = {
        "schema": SCHEMA,
        "status": found.status,
        "landmarks": entries,
        "not_in_view": list(compress(found.names, ~seen)),
        "score": found.score,
        "runner_up_score": found.runner_up_score,
        "live_from_model": found.live_from_model,
        "size": found.size,
        "scale_mm": found.scale_mm,
        "noise_mm": found.noise_mm,
        "candidates": found.candidate_count,
    }
    return plain(document | known)  # type: ignore[no-any-return]


def read_landmark_model(path: PathLike) -> LandmarkModel:
    """The model of a file, sgrt-landmark-model/1. Raises OSError, FormatError (the field is named), LimitError."""
    text = read_text(path)
    with naming(path):
        return LandmarkModel.from_json(text)


def write_landmark_model(path: PathLike, model: LandmarkModel) -> None:
    """Writes a model, all numbers to the last bit."""
    with writing(path) as stream:
        stream.write(model.to_json().encode())
