"""From images: two pods of a simulated room see the patient as planned and as he lies now; prints the displacement."""

import numpy as np
import sgrt
from sgrt import twin

room, patient = twin.Room(seed=1), twin.torso()
rig = sgrt.Rig(room.rig_json())


def surface_of(images: dict[str, np.ndarray]) -> sgrt.Surface:
    """The skin that the pods' images show, fused in the room frame."""
    volume = {"volume_min_mm": (-400, -500, -300), "volume_max_mm": (400, 500, 300)}
    pods = [sgrt.stereo_match(rig, p.id, images[p.left], images[p.right], **volume).surface for p in rig.pairs]
    return sgrt.surface_fuse(pods)[0]


moved, truth = twin.random_displacement(seed=5)
reference = surface_of(room.capture(patient, np.eye(4), seed=1))
live = surface_of(room.capture(patient, moved, seed=2))
result = sgrt.icp_align(reference, live, isocentre_mm=(0, 0, 0))
for name, value in result.displacement.as_dict().items():
    print(f"{name:10} true {truth[name]:+8.3f}  measured {value:+8.3f}")
print(f"verdict: {result.verdict}, one sigma {np.round(result.sigma_mm, 3)} mm")
