"""The two bodies of the twin: a torso and a head, as parameters of the implicit function in phantom.py.

Both are of the project's own making: no scan of a person went into them. Lengths are mm in the body frame
(x to the patient's left, y to the head, z to the front, origin at the isocentre inside the body). Left and
right differ a little, as in a person.
"""

from __future__ import annotations

from . import checks
from .phantom import Blob, Phantom

Triple = tuple[float, float, float]


def torso(scale: float = 1.0, breath_mm: float = 0.0, albedo: float = 0.6, texture: float = 0.0) -> Phantom:
    """A trunk from the hips to the neck, isocentre in the chest, its front about 100 mm above it.

    Parameters
    ----------
    scale : size factor, 0.5 to 2.
    breath_mm : how far breathing lifts the belly, -10 to 30 mm nominal; the chest lifts less (not rigid).
    albedo : share of the light that the skin returns, 0 to 1.
    texture : relative variation of the albedo over the skin, 0 to 0.5; it moves with the body.
    """
    breath = checks.number("breath_mm", breath_mm, -10.0, 30.0)
    parts = (
        Blob(100, (0, 60, -12), (162, 225, 104)),  # thorax
        Blob(95, (2, -175, -20), (148, 200, 98)),  # abdomen
        Blob(92, (0, -300, -26), (174, 150, 94)),  # hips
        Blob(70, (132, 196, -26), (72, 76, 62)),  # shoulders
        Blob(70, (-136, 190, -28), (74, 74, 60)),
        Blob(60, (0, 255, -14), (60, 160, 60)),  # neck
    )
    bumps = (
        Blob(27, (76, 76, 84), (39, 37, 36)),  # breasts
        Blob(23, (-79, 72, 83), (38, 39, 36)),
        Blob(3.5, (84, 66, 112), (6, 6, 14)),
        Blob(3.5, (-87, 61, 108), (6, 6, 14)),
        Blob(-7, (1, 96, 90), (13, 75, 30)),  # hollow of the breast bone
        Blob(9, (94, -52, 58), (40, 30, 30), (0, 0, 24)),  # flare of the ribs
        Blob(8, (-95, -46, 58), (40, 30, 30), (0, 0, -26)),
        Blob(-8, (0, -62, 80), (26, 34, 24)),  # pit of the stomach
        Blob(10 + 1.2 * breath, (3, -165, 70), (85, 75, 44)),  # belly
        Blob(0.6 * breath, (0, 70, 75), (120, 120, 50)),  # chest, with the breath
        Blob(-10, (4, -172, 88), (9, 7, 26)),  # navel
        Blob(6, (66, 206, 50), (46, 8, 22), (0, 0, 14)),  # collar bones
        Blob(6, (-68, 203, 48), (46, 8, 22), (0, 0, -12)),
        Blob(-9, (1, 226, 52), (12, 13, 22)),  # notch above the breast bone
        Blob(4.5, (-72, 158, 66), (13, 11, 22), (0, 0, 20)),  # a port under the skin
    )
    return _build("torso", parts, bumps, 0.055, (-240.0, 190.0, -15.0), 3.0, (), scale, albedo, texture)


def head(scale: float = 1.0, albedo: float = 0.6, texture: float = 0.0) -> Phantom:
    """A head with a neck, isocentre in the brain, the tip of the nose 113 mm above it, vertex to +y.

    Landmarks (`Phantom.landmarks`): nose_apex, ala_left, ala_right, nasion, nasolabial_left,
    nasolabial_right, nasofacial_left, nasofacial_right, chin, eye_inner_left, eye_inner_right; left and
    right are the patient's own.

    Parameters
    ----------
    scale : size factor, 0.5 to 2.
    albedo : share of the light that the skin returns, 0 to 1.
    texture : relative variation of the albedo over the skin, 0 to 0.5; it moves with the body.
    """
    parts = (
        Blob(95, (0, 32, -12), (76, 86, 98)),  # skull
        Blob(70, (0, -34, 27), (61, 84, 68)),  # face
        Blob(50, (0, -76, 34), (45, 40, 56)),  # jaw
        Blob(56, (0, -120, -30), (54, 120, 56)),  # neck
    )
    bumps = (
        *_pair(5.5, (28, 36, 90), (18, 7, 16), (0, 0, -6)),  # brow
        *_pair(-11, (31, 18, 92), (13.5, 9.5, 16)),  # sockets
        *_pair(5, (31, 17, 90), (8.5, 6.5, 12)),  # eyes
        *_pair(-5, (15.5, 14, 94), (4.6, 5.2, 12)),  # inner corners
        Blob(13, (0, -4, 100), (7.5, 16, 20)),  # bridge of the nose
        Blob(15, (0.3, -22, 108), (8.5, 8.5, 16)),  # its tip
        Blob(8.0, (14.5, -27, 102), (5.8, 6.2, 12)),  # its wings
        Blob(7.6, (-14.2, -27, 102), (5.9, 6.2, 12)),
        Blob(-5, (0, 20, 100), (10, 6.5, 14)),  # its root
        *_pair(-3.5, (17.5, -12, 92), (4.5, 9, 14), (0, 0, 14)),  # furrows nose to cheek
        *_pair(-4.5, (20.5, -37, 90), (4.5, 7.5, 14), (0, 0, 32)),  # furrows wing to lip
        *_pair(6, (42, -12, 74), (19, 16, 22)),  # cheek bones
        Blob(4.2, (0, -49, 98), (17, 4.2, 12)),  # lips
        Blob(5.4, (0, -60.5, 98), (15, 4.8, 12)),
        Blob(-4, (0, -54.6, 98), (19, 2.6, 12)),
        Blob(-3, (0, -41, 98), (3.4, 5.5, 10)),  # philtrum
        Blob(-5, (0, -70, 96), (15, 4.8, 12)),  # furrow above the chin
        Blob(9.5, (0.2, -91, 90), (12.5, 9.5, 15)),  # chin
        *_pair(15, (76, 4, -14), (11, 27, 13), (18, 0, 0)),  # ears
        *_pair(-7, (84, 0, -6), (10, 11, 6), (18, 0, 0)),
    )
    marks = (
        ("nose_apex", (0.0, -22.0, 118.0), 1),
        ("ala_left", (16.0, -27.0, 106.0), 1),
        ("ala_right", (-16.0, -27.0, 106.0), 1),
        ("nasion", (0.0, 22.0, 90.0), -1),
        ("nasolabial_left", (20.0, -36.0, 92.0), -1),
        ("nasolabial_right", (-20.0, -36.0, 92.0), -1),
        ("nasofacial_left", (17.0, -12.0, 94.0), -1),
        ("nasofacial_right", (-17.0, -12.0, 94.0), -1),
        ("chin", (0.0, -94.0, 96.0), 1),
        ("eye_inner_left", (15.0, 14.0, 90.0), -1),
        ("eye_inner_right", (-15.0, 14.0, 90.0), -1),
    )
    return _build("head", parts, bumps, 0.09, (-110.0, 20.0, -5.0), 1.8, marks, scale, albedo, texture)


def _pair(
    size: float,
    centre: Triple,
    axes: Triple,
    turn_deg: Triple = (0, 0, 0),
) -> tuple[Blob, Blob]:
    """A feature on the left and its mirror image on the right, 3 % weaker."""
    (x, y, z), (a, b, c) = centre, turn_deg
    return Blob(size, centre, axes, turn_deg), Blob(0.97 * size, (-x, y, z), axes, (a, -b, -c))


def _build(
    name: str,
    parts: tuple[Blob, ...],
    bumps: tuple[Blob, ...],
    sharpness: float,
    spine: Triple,
    facet_mm: float,
    marks: tuple[tuple[str, Triple, int], ...],
    scale: float,
    albedo: float,
    texture: float,
) -> Phantom:
    k = checks.number("scale", scale, 0.5, 2.0)

    def grown(blobs: tuple[Blob, ...]) -> tuple[Blob, ...]:
        return tuple(Blob(k * b.size, _times(k, b.centre), _times(k, b.axes), b.turn_deg) for b in blobs if b.size)

    return Phantom(
        name=name,
        parts=grown(parts),
        bumps=grown(bumps),
        sharpness=sharpness / k,
        spine=_times(k, spine),
        facet_mm=k * facet_mm,
        marks=tuple((mark, _times(k, near), sign) for mark, near, sign in marks),
        albedo=albedo,
        texture=texture,
    )


def _times(k: float, v: Triple) -> Triple:
    return k * v[0], k * v[1], k * v[2]
