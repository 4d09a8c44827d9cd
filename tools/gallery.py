"""The gallery of the site: replays that play in a page without a server.

    python tools/gallery.py            # drives every command of docs/gallery.yaml
    python tools/gallery.py NAME ...   # drives some

docs/gallery.yaml names, for each replay, the command, the stretch and what to look at. A command is driven
into out/gallery/NAME unless a run is there already; the data of its replay goes to docs/gallery/NAME.js.
`mkdocs` is told this file as a hook: it makes the page `gallery.md` of the list, with the reports' player.
"""

from __future__ import annotations

import json
import shlex
import subprocess
import sys
from html import escape
from importlib import resources
from pathlib import Path
from typing import Any

import msgspec
import yaml

ROOT = Path(__file__).resolve().parents[1]
LIST, DATA = ROOT / "docs" / "gallery.yaml", ROOT / "docs" / "gallery"
OUT = Path("out/gallery")
WIDTH, HEIGHT = 480, 360  # px of a picture of a camera
EVERY = 5  # moments between two pictures
QUALITY = 42  # of pictures
GROUND = -1.5  # m below the lidar, under which a point is taken for the road
GRID = 0.25  # m between the points that are shown
LEGENDS = {
    "above": "from above; the ego is orange",
    "pictures": "drawn again from the recorded poses",
    "channels": "the world of each channel, and all together; boxes are objects, lines plans and predictions",
}
LEAD = """\
Each of these is a recorded run that plays here: press play, or draw the time. The command above a replay
drives the same run again on your machine, to the byte; the second one opens it in the
[cockpit](cockpit.md), with pictures. From above, water on the road is blue, ice pale blue, guard rails grey,
and the ego orange with the way that it has come."""


class Entry(msgspec.Struct, kw_only=True, forbid_unknown_fields=True):
    """One replay of the gallery."""

    name: str
    title: str
    look: str  # one sentence
    command: str  # without `skidpad` and `--out`
    begin: float  # s
    end: float
    mark: float | None = (
        None  # s at which the replay stands before it is played; None: at its begin
    )
    label: str = ""  # of that moment
    run: str = ""  # folder of the run within that of the command
    kind: str = "above"  # or pictures, channels
    view: str = "follow"  # of pictures
    lidar: bool = False  # the points of LIDAR, measured again from the recorded poses
    hazard: str = ""  # id, of channels


def read_list() -> list[Entry]:
    """Returns the entries of docs/gallery.yaml, in the order of the page."""
    return msgspec.convert(yaml.safe_load(LIST.read_text(encoding="utf-8")), list[Entry])


def words_of(entry: Entry, out: Path) -> list[str]:
    """Returns the command of an entry as words for the program, with its folder."""
    return [*shlex.split(entry.command), "--out", str(out)]


# --- driving, and cutting replays out of what was driven


def make(entry: Entry, out: Path, data: Path) -> Path:
    """Drive an entry's command unless its folder exists, and write its data; returns the file."""
    folder = out / entry.name
    if not folder.exists():
        words = words_of(entry, folder)
        subprocess.run([sys.executable, "-m", "skidpad", *words], cwd=ROOT, check=False)
    cut = {"above": cut_above, "pictures": cut_pictures, "channels": cut_channels}[entry.kind]
    text = json.dumps(cut(entry, folder / entry.run), separators=(",", ":"))
    path = data / f"{entry.name}.js"
    path.write_text(f'(window.skidpadReplays ??= {{}})["{entry.name}"] = {text};\n', "utf-8")
    return path


def cut_above(entry: Entry, run: Path) -> dict[str, Any]:
    """Returns the stretch of a run from above."""
    from skidpad.campaign.runs.road import load_road
    from skidpad.recording.run.log_files import read_log
    from skidpad.recording.run.surfaces import read_surfaces
    from skidpad.report.elements.replay import replay_stretch

    log = read_log(run)
    road = load_road(run, log.header)
    mark = entry.begin if entry.mark is None else entry.mark
    cut = replay_stretch(log, road, entry.begin, entry.end, mark, read_surfaces(run))
    points = {"points": lidar_points(entry, run)} if entry.lidar else {}
    return {**cut, **points, "label": entry.label}


def lidar_points(entry: Entry, run: Path) -> list[list[int]]:
    """Returns what the lidar of examples/lidar_brake.py met above the road, for each frame from above."""
    from dataclasses import replace

    import numpy as np

    from skidpad.campaign.driving.run_setup import stage_of
    from skidpad.cockpit.film import stretch_of
    from skidpad.cockpit.replay import RecordedRun
    from skidpad.core.geometry import Pose
    from skidpad.core.specs import LidarSpec
    from skidpad.report.elements.replay import STEP_S, UNIT
    from skidpad.sensors.requested import AskedSensors

    source = RecordedRun(run)
    spec = LidarSpec("lidar", Pose(0.0, 0.0, 1.7), range=50.0, points_per_second=200_000)
    setup = stage_of(source.spec).setup
    setup = replace(setup, specs=(spec,), asked=frozenset({spec.id}))
    sensors = AskedSensors(source.map, source.table, setup, seed=source.seed)
    moments = stretch_of(source, entry.begin, entry.end)
    first = source.moment(moments[0]).truth.states.pose(0)
    braking = np.zeros(len(source.table), np.bool_)
    places = []
    for k in moments:
        truth = source.moment(k).truth
        seen = sensors.read(truth.tick, truth.states, {}, truth.lights, braking)[spec.id].xyz
        seen = seen[seen[:, 2] > GROUND, :2]
        ego = truth.states.pose(0)
        c, s = np.cos(ego.yaw), np.sin(ego.yaw)
        place = seen @ np.array([[c, s], [-s, c]]) + (ego.x - first.x, ego.y - first.y)
        places.append(np.round(place / GRID).astype(int))
    each = round(STEP_S / setup.dt)  # ticks, whose points are shown together
    together = [np.concatenate(places[max(k - each + 1, 0) : k + 1]) for k in range(len(places))]
    scale = round(GRID / UNIT)
    return [(scale * np.unique(one, axis=0)).ravel().tolist() for one in together[::each]]


def cut_pictures(entry: Entry, run: Path) -> dict[str, Any]:
    """Returns the stretch of a run as pictures of a camera, with scenery."""
    from base64 import b64encode
    from io import BytesIO

    from PIL import Image

    from skidpad.cockpit.film import frames, stretch_of
    from skidpad.cockpit.replay import RecordedRun
    from skidpad.cockpit.studio import View
    from skidpad.core.setup import DT

    source = RecordedRun(run)
    moments = stretch_of(source, entry.begin, entry.end)[::EVERY]
    shown = []
    for picture in frames(source, moments, View(entry.view)):
        content = BytesIO()
        image = Image.fromarray(picture[..., ::-1]).resize((WIDTH, HEIGHT), Image.Resampling.BOX)
        image.save(content, "webp", quality=QUALITY, method=6)
        shown.append("data:image/webp;base64," + b64encode(content.getvalue()).decode())
    step = EVERY * source.step * DT
    mark = 0 if entry.mark is None else round((entry.mark - entry.begin) / step)
    return {"pictures": shown, "dt": step, "t0": entry.begin, "mark": mark, "label": entry.label}


def cut_channels(entry: Entry, run: Path) -> dict[str, Any]:
    """Returns the worlds of the channels around a hazard of a monitor's folder."""
    from skidpad.recording.hazards.records import read_hazards
    from skidpad.report.channels.worlds import worlds_replay

    record = next(r for r in read_hazards(run) if r.id == entry.hazard)
    cut = worlds_replay(record)
    assert cut is not None, f"{entry.name}: the hazard {entry.hazard} holds no worlds"
    return cut


# --- the page, as a hook of mkdocs


def on_files(files: Any, config: Any) -> Any:
    """Adds the page and its player to the site's files."""
    from mkdocs.structure.files import File

    pages = {"gallery.md": gallery_page(), "gallery/player.js": player(), "gallery/player.css": CSS}
    for place, content in pages.items():
        files.append(File.generated(config, place, content=content))
    return files


def gallery_page() -> str:
    """Returns the page, as Markdown with a figure for each replay."""
    entries = read_list()
    parts = ["# Gallery", "", LEAD, "", '<link rel="stylesheet" href="gallery/player.css">', ""]
    parts += [part for entry in entries for part in section_of(entry)]
    scripts = [*(entry.name for entry in entries), "player"]
    parts += [f'<script defer src="gallery/{name}.js"></script>' for name in scripts]
    return "\n".join(parts) + "\n"


def section_of(entry: Entry) -> list[str]:
    """Returns the lines of one replay: title, what to look at, commands, figure."""
    folder = OUT / entry.name
    again = f"skidpad replay {folder / entry.run}".rstrip("/")
    again += f" --id {entry.hazard}" if entry.hazard else ""
    kind = "worlds" if entry.kind == "channels" else "replay"
    canvas = f'<canvas role="img" aria-label="{escape(entry.title)}"></canvas>'
    legend = f"<figcaption>{LEGENDS[entry.kind]}</figcaption>"
    return [
        f"## {entry.title}", "", entry.look, "",
        "```console", f"$ skidpad {entry.command} --out {folder}", f"$ {again}", "```", "",
        f'<figure class="{kind}" id="{entry.name}">{canvas}{legend}</figure>', "",
    ]  # fmt: skip


def player() -> str:
    """Returns the script of the reports that plays replays."""
    assets = resources.files("skidpad.report").joinpath("assets")
    names = ("replay.js", "worlds.js")
    return "".join(assets.joinpath(name).read_text(encoding="utf-8") for name in names)


CSS = """\
.highlight code { white-space: pre-wrap; overflow-wrap: anywhere; }
figure.replay, figure.worlds { width: 100%; max-width: 760px; margin: .6rem 0 2rem; }
figure.worlds { max-width: none; }
figure.replay canvas, figure.worlds canvas { width: 100%; display: block; border-radius: 6px; }
figure .bar { display: flex; gap: .6rem; align-items: center; margin-top: .3rem; }
figure .bar input { flex: 1; min-width: 0; }
figure .bar small { min-width: 9rem; font-variant-numeric: tabular-nums; }
figure .bar button { font: inherit; border: 1px solid currentColor; border-radius: 6px; padding: .1rem .7rem;
  cursor: pointer; }
figure figcaption { font-size: .7rem; max-width: none; margin: .3rem 0; }
@media (max-width: 600px) { figure .bar small { min-width: 0; } figure .bar { flex-wrap: wrap; } }
"""


def main(names: list[str]) -> None:
    """Makes the replays of these names, or all."""
    entries = read_list()
    unknown = set(names) - {entry.name for entry in entries}
    if unknown:
        sys.exit(f"docs/gallery.yaml has no {', '.join(sorted(unknown))}")
    DATA.mkdir(exist_ok=True)
    for entry in entries:
        if not names or entry.name in names:
            path = make(entry, ROOT / OUT, DATA)
            print(f"{path.relative_to(ROOT)}: {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main(sys.argv[1:])
