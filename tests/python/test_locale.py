"""Numbers keep their point where the process has a decimal comma: JSON, PLY (binary and text), messages and what the
command line prints are the same bytes as in the C locale, which localedef (Debian's package `locales`) makes."""

import re
import shutil
import subprocess
import sys

import pytest

WORK = """
import locale, os, sys
from pathlib import Path

comma = locale.setlocale(locale.LC_ALL, sys.argv[1]) != "C"
assert (locale.localeconv()["decimal_point"] == ",") == comma
import numpy as np
import sgrt
from sgrt.cli import main
from sgrt.io import read_surface, write_surface

os.chdir(sys.argv[2])
y, x = np.mgrid[-60:61:6, -60:61:6].astype(float)
z = 30 * np.cos(x / 55) * np.cos(y / 80) + 6 * np.sin(x / 14 + 0.4) * np.cos(y / 18)
skin = sgrt.Surface(np.stack([x, y, z], -1)).estimate_normals()
pose = np.eye(4)
pose[:3, 3] = 0.8, -0.6, 0.4
write_surface("reference.ply", skin)
write_surface("live.ply", skin.moved(pose))
rows = "\\n".join("%.3f %.3f %.3f" % tuple(p) for p in skin.points.reshape(-1, 3))
head = "ply\\nformat ascii 1.0\\nelement vertex %d\\n" % (rows.count("\\n") + 1)
head += "".join(f"property double {axis}\\n" for axis in "xyz") + "end_header\\n"
Path("text.ply").write_text(head + rows + "\\n")
print(read_surface("text.ply").points.sum())
print(sgrt.NurbsSurface.sphere((0.5, 0, -1.25), 12.75).to_json())
try:
    sgrt.icp_align(skin, skin, isocentre_mm=(0.25, 1.5e9, 0))
except sgrt.Error as error:
    print(error)
sys.stdout.flush()
words = ["register", "--reference", "reference.ply", "--live", "live.ply", "--isocentre", "0.5", "0", "-20.25"]
for more in (["--json"], []):
    print(main([*words, *more]), flush=True)
"""


# REQ-REL-005
def test_a_decimal_comma_changes_no_byte(tmp_path):
    if shutil.which("localedef") is None:
        pytest.skip("no localedef")
    locales = tmp_path / "locales"
    locales.mkdir()
    made = subprocess.run(
        ["localedef", "-i", "de_DE", "-f", "UTF-8", locales / "de_DE.UTF-8"], capture_output=True, text=True
    )
    if made.returncode != 0:
        pytest.skip(f"localedef: {made.stderr.strip()}")
    answers = []
    for name in ("C", "de_DE.UTF-8"):
        folder = tmp_path / name
        folder.mkdir()
        done = subprocess.run(
            [sys.executable, "-c", WORK, name, folder],
            capture_output=True,
            text=True,
            env={"LOCPATH": str(locales), "PATH": ""},
        )
        assert done.returncode == 0, done.stderr
        said, times = re.subn(r'("timing_ms": |iterations, )[\d.e+-]+', r"\1-", done.stdout)  # in JSON and in words
        assert times == 2
        answers.append((said, {p.name: p.read_bytes() for p in sorted(folder.iterdir())}))
    assert len(answers[0][1]) == 3 and '"lat_mm"' in answers[0][0]
    assert answers[0] == answers[1]
