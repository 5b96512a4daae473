"""Folders and names that the blocks of a page share, and what some pages take as given."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from blocks import ROOT, Block

# What a page leaves to its reader: points, images, a rig.
GIVEN = {
    "README.md": """
from pathlib import Path
import numpy as np
from sgrt import twin
points_of_the_plan, _ = twin.sample_surface(twin.torso(), 5000, 1)
points_of_now = np.array(twin.sample_surface(twin.torso(), 5000, 2)[0]) + [1, -2, 3]
room = twin.Room(1)
Path("rig.json").write_text(room.rig_json())
taken = room.capture(twin.torso(), seed=1)
images = {pod: [taken[name] for name in names] for pod, names in room.pairs.items()}
""",
    "docs/howto-python.md": """
from pathlib import Path
import sgrt
from sgrt import twin
room = twin.Room(1)
Path("rig.json").write_text(room.rig_json())
for side, image in zip(("left", "right"), room.capture(twin.torso(), seed=1, cameras=room.pairs["pod1"]).values()):
    sgrt.io.write_image(f"{side}.png", image)
""",
}


class Page:
    """A reader's folder, names and shell, kept from block to block."""

    def __init__(self, name: str, folder: Path) -> None:
        self.folder = folder
        self.names: dict[str, Any] = {"__name__": "__main__"}
        self.python(GIVEN.get(name, ""), name)

    def python(self, code: str, name: str) -> None:
        here = Path.cwd()
        os.chdir(self.folder)
        try:
            exec(compile(code, name, "exec"), self.names)
        finally:
            os.chdir(here)

    def shell(self, code: str) -> str:
        path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
        command = ["bash", "-euo", "pipefail", "-c", code]
        done = subprocess.run(
            command, cwd=self.folder, env=os.environ | {"PATH": path}, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, f"{code}\nexit code {done.returncode}\n{done.stdout}{done.stderr}"
        return done.stdout + done.stderr


@pytest.fixture(scope="session")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The Page of a block."""
    known: dict[Path, Page] = {}

    def page(block: Block) -> Page:
        if block.page not in known:
            name = str(block.page.relative_to(ROOT))
            known[block.page] = Page(name, tmp_path_factory.mktemp(block.page.stem))
        return known[block.page]

    return page
