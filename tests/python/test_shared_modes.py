"""The rig's own uncertainty travels with its surfaces: through files, fusion and registration."""

import json

import numpy as np
import pytest
import sgrt
from conftest import BASE, DEPTH, FOCAL, HEIGHT, WIDTH, rig_document, speckle
from sgrt.cli import main

SIGMAS = {"fx": 0.03, "cx": 0.03, "rx": 1e-5, "ry": 1e-5, "rz": 1e-5, "tx": 0.01, "ty": 0.01, "tz": 0.01}


def uncertain() -> dict:
    document = rig_document()
    names = [f"{camera['id']}.{name}" for camera in document["cameras"] for name in SIGMAS]
    document["uncertainty"] = {
        "parameters": names,
        "modes": np.diag(list(SIGMAS.values()) * 2).tolist(),
        "residual_px": 0.05,
    }
    return document


def relief(seed: int) -> list[np.ndarray]:
    """What the cameras see of a speckled relief, with noise of its own."""
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH].astype(float)
    shift = FOCAL * BASE / DEPTH + 5 * np.cos(u / 50) * np.cos(v / 40)
    rng = np.random.default_rng(seed)
    images = [speckle(x, v) + rng.normal(0, 1, u.shape) for x in (u, u + shift)]
    return [np.clip(np.rint(image), 0, 255).astype(np.uint8) for image in images]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("modes")
    (folder / "sure.json").write_text(json.dumps(rig_document()))
    (folder / "unsure.json").write_text(json.dumps(uncertain()))
    for seed in (1, 2):
        for side, image in zip(("left", "right"), relief(seed), strict=True):
            sgrt.io.write_image(folder / f"{side}{seed}.png", image)
        for rig in ("sure", "unsure"):
            arguments = ["stereo", "--rig", f"{rig}.json", "--pair", "pod1", f"left{seed}.png", f"right{seed}.png"]
            code = main([a if "." not in a else str(folder / a) for a in [*arguments, "--out", f"{rig}{seed}.ply"]])
            assert code == 0
    return folder


def test_surfaces_carry_eight_named_modes(folder):
    sure, unsure = (sgrt.io.read_surface(folder / f"{rig}1.ply") for rig in ("sure", "unsure"))
    assert sure.modes is None
    assert sure.mode_names is None
    assert unsure.modes.shape[0] == 8
    assert unsure.mode_names == sgrt.io.read_surface(folder / "unsure2.ply").mode_names
    assert all(name.startswith(rig_document()["id"] + " ") for name in unsure.mode_names)
    assert len(set(unsure.mode_names)) == 8
    # What the eight leave out is in the points' own covariance.
    assert np.nanmean(unsure.sigma_mm) > np.nanmean(sure.sigma_mm)


def test_a_cause_that_both_surfaces_have_cancels(folder, capfd):
    def shared(reference: str, live: str) -> np.ndarray:
        files = ["--reference", str(folder / f"{reference}.ply"), "--live", str(folder / f"{live}.ply")]
        assert main(["register", *files, "--isocentre", "0", "0", "0", "--json"]) == 0
        return np.diag(json.loads(capfd.readouterr().out)["covariance_shared"])

    none, one, both = shared("sure1", "sure2"), shared("sure1", "unsure2"), shared("unsure1", "unsure2")
    assert np.all(none > 0)  # the reference's noise
    assert np.all(one[3:] > none[3:])
    assert one[5] > 1000 * none[5]  # the depth of the whole surface
    assert np.all(both < 4 * none)


def test_names_survive_the_file(tmp_path):
    names = ["a rig 0", "", "%", "Bestrahlungsraum \N{LATIN SMALL LETTER U WITH DIAERESIS}\t2"]
    surface = sgrt.Surface(np.zeros((3, 3)), modes=np.ones((4, 3, 3)), mode_names=names)
    for format in ("binary", "ascii"):
        sgrt.io.write_surface(tmp_path / "s.ply", surface, format=format)
        assert sgrt.io.read_surface(tmp_path / "s.ply").mode_names == names
