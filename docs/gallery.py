"""The picture of the small domains, from the answers of short recoveries: ``worlds.png``.

Each recovery is recorded, its last frame is drawn as ``walking-irl view --png`` does, and the part
that shows the world is kept. ``python docs/gallery.py`` takes a minute or two.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from PIL import Image

from walking_irl.recording.screenshot import save_screenshot
from walking_irl.run import session
from walking_irl.run.setup import Setup

ROWS = (("gridworld", "objectworld"), ("walking-path", "driving"), ("lqr", "random-mdp"))
"""Domains from left to right, from above to below."""
UPPER, LOWER = 0.035, {"gridworld": 0.54}
"""Where the upper views of a window begin and end, in shares of its height; most at .63."""
WIDTH = 860
"""Of a picture [px]."""


def window(domain: str, folder: Path) -> Image.Image:
    """The last frame of a recovery: the world, and the weights that are left where they are drawn."""
    recording, png = folder / f"{domain}.rrd", folder / f"{domain}.png"
    session.run(Setup(domain=domain, record=recording))
    image = Image.open(save_screenshot(recording, png)).convert("RGB")
    ends = (round(share * image.height) for share in (UPPER, LOWER.get(domain, 0.63)))
    image = image.crop((0, next(ends), image.width, next(ends)))
    return image.resize(
        (WIDTH, round(WIDTH * image.height / image.width)), Image.Resampling.LANCZOS
    )


def main() -> None:
    """Draw all and put them side by side."""
    with tempfile.TemporaryDirectory() as folder:
        rows = [[window(domain, Path(folder)) for domain in row] for row in ROWS]
    height = max(image.height for row in rows for image in row)
    picture = Image.new("RGB", (WIDTH * len(ROWS[0]), height * len(ROWS)), "white")
    for i, row in enumerate(rows):
        for j, image in enumerate(row):
            picture.paste(image, (j * WIDTH, i * height))
    picture.save(Path(__file__).with_name("worlds.png"), optimize=True)


if __name__ == "__main__":
    main()
