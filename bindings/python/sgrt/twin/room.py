"""The treatment room: two pods at the ceiling, each two cameras and a speckle projector.

Room frame: IEC 61217 fixed, mm, origin at the isocentre, X to the right of an observer who faces the
gantry, Y towards the gantry, Z up. The patient lies head first, supine: head towards +Y, front up, the
patient's left towards +X.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from . import checks, truth
from .calibration_error import perturbed_pod
from .camera import Camera
from .checks import Array
from .pattern import Projector
from .phantom import Phantom
from .render import View, expected_electrons
from .rig import rig_json
from .sensor import Sensor, stream

IMAGE_SIZE = (1280, 1024)
FOCAL_PX = 2400.0
BASELINE_MM = 250.0
PATTERN_SIZE = (1408, 1152)
# degrees from the vertical towards +X, degrees towards the patient's feet, mm from the isocentre
PODS = {"pod1": (-40.0, 14.0, 2000.0), "pod2": (38.0, 17.0, 1940.0)}


class Room:
    """A simulated treatment room.

    Parameters
    ----------
    seed : draws the lenses, the small mounting errors and the patterns; the same seed gives the same room.
    sensor : the image sensors; None is 12,000 electrons, 12 electrons of read noise, 8 bits, 0.55 px blur.

    Attributes
    ----------
    cameras : dict of id to Camera ("pod1-left", "pod1-right", "pod2-left", "pod2-right").
    projectors : dict of pod to Projector. pairs : dict of pod to (left id, right id).
    """

    def __init__(self, seed: int = 0, sensor: Sensor | None = None) -> None:
        self.seed = checks.integer("seed", seed)
        if sensor is not None and not isinstance(sensor, Sensor):
            raise ValueError(f"sensor must be a Sensor or None, got {type(sensor).__name__}")
        self.sensor = sensor or Sensor()
        self.cameras: dict[str, Camera] = {}
        self.projectors: dict[str, Projector] = {}
        self.pairs: dict[str, tuple[str, str]] = {}
        for pod in PODS:
            self._mount(pod)

    def _mount(self, pod: str) -> None:
        swing, feet, distance = PODS[pod]
        swing, feet = np.deg2rad(swing), np.deg2rad(feet)
        centre = distance * np.array([np.sin(swing) * np.cos(feet), -np.sin(feet), np.cos(swing) * np.cos(feet)])
        across = _look(centre, np.zeros(3))[0, :3]
        for side, sign in (("left", -0.5), ("right", 0.5)):
            name = f"{pod}-{side}"
            rng = stream(self.seed, name, "camera")
            place = centre + sign * BASELINE_MM * across + rng.normal(0.0, 0.5, 3)
            aim = rng.normal(0.0, 4.0, 3)
            self.cameras[name] = _draw_camera(name, _look(place, aim, rng.normal(0.0, 0.3)), rng)
        lamp = centre - 45.0 * _look(centre, np.zeros(3))[1, :3]  # above the middle of the baseline
        self.projectors[pod] = Projector(pod, PATTERN_SIZE, FOCAL_PX, _flat(_look(lamp, np.zeros(3))), self.seed)
        self.pairs[pod] = (f"{pod}-left", f"{pod}-right")

    def rig_json(self) -> str:
        """The true cameras as rig.json text."""
        return self._rig(self.cameras.values(), f"twin-{self.seed}", {"truth": True})

    def perturbed_rig_json(self, seed: int, sigma_px: float = 0.1) -> str:
        """The cameras as one calibration would have found them, as rig.json text.

        `sigma_px` is the expected root mean square change of a projection, per pixel coordinate, over the
        working volume; the error is correlated as a real one (see docs/theory/twin.md). 0 gives the true
        values.
        """
        seed, sigma_px = checks.integer("seed", seed), checks.number("sigma_px", sigma_px, 0.0, 5.0)
        found: dict[str, Camera] = {}
        for left, right in self.pairs.values():
            found[left], found[right] = perturbed_pod(self.cameras[left], self.cameras[right], seed, sigma_px)
        ordered = (found[name] for name in self.cameras)
        about = {"truth": False, "calibration_seed": seed, "sigma_px": sigma_px}
        return self._rig(ordered, f"twin-{self.seed}-calibration-{seed}", about)

    def _rig(self, cameras: Iterable[Camera], rig_id: str, about: dict) -> str:
        return rig_json(rig_id, cameras, self.pairs, {"source": "simulated room", "room_seed": self.seed, **about})

    def capture(
        self,
        phantom: Phantom,
        room_from_body: ArrayLike | None = None,
        *,
        seed: int,
        cameras: Iterable[str] | None = None,
    ) -> dict[str, np.ndarray]:
        """Expose cameras, one pod after the other, each lit by its own projector only.

        Parameters
        ----------
        phantom : the body.
        room_from_body : (4, 4) rigid, mm; None is the set-up position.
        seed : of the noise; give every capture its own. A camera's noise depends on it and on the id alone.
        cameras : ids, or None for all.

        Returns
        -------
        dict of camera id to (1024, 1280) uint8, uint16 above 8 bits.
        """
        seed = checks.integer("seed", seed)
        names = self._names(cameras)
        images = {}
        for name in names:
            electrons = self.render(name, phantom, room_from_body)
            images[name] = self.sensor.expose(electrons, self.cameras[name].offset_counts, stream(seed, name, "noise"))
        return images

    def render(self, camera: str, phantom: Phantom, room_from_body: ArrayLike | None = None) -> np.ndarray:
        """The expected electrons of one camera, without noise: (1024, 1280) float32."""
        name = self._camera(camera).id
        view = View(self.cameras[name], self.projectors[name.rsplit("-", 1)[0]], self.sensor)
        return expected_electrons(view, _body(phantom), checks.pose("room_from_body", room_from_body))

    def truth_depth(self, camera: str, phantom: Phantom, room_from_body: ArrayLike | None = None) -> Array:
        """The skin point that each pixel centre sees: (1024, 1280, 3), room frame, mm; NaN if none."""
        return truth.depth(self._camera(camera), _body(phantom), checks.pose("room_from_body", room_from_body))

    def true_match(self, pair: str, phantom: Phantom, room_from_body: ArrayLike | None = None) -> truth.Match:
        """The exact right pixel of each left pixel's skin point, and where it is visible and lit."""
        if pair not in self.pairs:
            raise ValueError(f"pair must be one of {sorted(self.pairs)}, got {pair!r}")
        left, right = (self.cameras[name] for name in self.pairs[pair])
        pose = checks.pose("room_from_body", room_from_body)
        return truth.match(left, right, self.projectors[pair], _body(phantom), pose)

    def _camera(self, camera: str) -> Camera:
        if not isinstance(camera, str) or camera not in self.cameras:
            raise ValueError(f"camera must be one of {sorted(self.cameras)}, got {camera!r}")
        return self.cameras[camera]

    def _names(self, cameras: Iterable[str] | None) -> list[str]:
        if cameras is None:
            return list(self.cameras)
        if isinstance(cameras, str) or not isinstance(cameras, Iterable):
            raise ValueError(f"cameras must be a list of camera ids or None, got {cameras!r}")
        names = list(cameras)
        for name in names:
            if not isinstance(name, str) or name not in self.cameras:
                raise ValueError(f"cameras must be among {sorted(self.cameras)}, got {name!r}")
        return names


def _body(phantom: Phantom) -> Phantom:
    if not isinstance(phantom, Phantom):
        raise ValueError(f"phantom must be a Phantom (torso() or head()), got {type(phantom).__name__}")
    return phantom


def _look(place: Array, target: Array, roll_deg: float = 0.0) -> Array:
    """camera_from_room of an upright camera at `place` that looks at `target`: x right, y down, z forward."""
    forward = (target - place) / np.sqrt(np.sum((target - place) ** 2))
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.sqrt(np.sum(right**2))
    down = np.cross(forward, right)
    c, s = np.cos(np.deg2rad(roll_deg)), np.sin(np.deg2rad(roll_deg))
    out = np.eye(4)
    out[:3, :3] = [c * right + s * down, c * down - s * right, forward]
    out[:3, 3] = -out[:3, :3] @ place
    return out


def _draw_camera(name: str, camera_from_room: Array, rng: np.random.Generator) -> Camera:
    """A camera of the series: every lens and sensor a little different."""
    width, height = IMAGE_SIZE
    fx = FOCAL_PX * (1.0 + rng.uniform(-0.01, 0.01))
    return Camera(
        id=name,
        image_size=IMAGE_SIZE,
        intrinsics=(
            fx,
            fx * (1.0 + rng.uniform(-4e-4, 4e-4)),
            0.5 * (width - 1) + rng.uniform(-12.0, 12.0),
            0.5 * (height - 1) + rng.uniform(-12.0, 12.0),
        ),
        distortion=(
            -0.10 + rng.uniform(-0.02, 0.02),
            0.12 + rng.uniform(-0.03, 0.03),
            rng.uniform(-8e-4, 8e-4),
            rng.uniform(-8e-4, 8e-4),
            -0.05 + rng.uniform(-0.03, 0.03),
        ),
        camera_from_room=_flat(camera_from_room),
        gain=1.0 + rng.uniform(-0.04, 0.04),
        offset_counts=rng.uniform(1.0, 3.0),
    )


def _flat(matrix: Array) -> tuple[float, ...]:
    return tuple(matrix.ravel().tolist())
