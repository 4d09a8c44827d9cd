"""The README keeps its word: its example is the one that runs, its commands exist."""

import re
from pathlib import Path

import click
import typer
from PIL import Image

from skidpad.cli.main import app
from skidpad.core.errors import install_command

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_example_stack_is_the_file_in_examples():
    block = re.search(r"```python\n(from math.*?)```", README, re.DOTALL).group(1)
    assert block in (ROOT / "examples" / "follow_lane.py").read_text(encoding="utf-8")
    assert len([line for line in block.splitlines() if line.strip()]) <= 30


def test_the_example_with_a_lidar_is_the_file_in_examples():
    text = (ROOT / "docs" / "your-stack.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    assert block in (ROOT / "examples" / "lidar_brake.py").read_text(encoding="utf-8")


def commands(group, prefix=""):
    found = set()
    for name, command in group.commands.items():
        found.add(prefix + name)
        if isinstance(command, click.Group):
            found |= commands(command, prefix + name + " ")
    return found


def test_every_command_named_in_the_readme_exists():
    known = {name.split()[0] for name in commands(typer.main.get_command(app))}
    told = set(re.findall(r"skidpad ([a-z][a-z-]*)(?= |`|\n)", README)) - {"import"}
    assert told <= known, f"not a command: {sorted(told - known)}"


def test_readme_makefile_and_project_name_one_range_of_python():
    low, high = re.search(
        r'requires-python = ">=(3\.\d+),<(3\.\d+)"', text_of("pyproject.toml")
    ).groups()
    last = f"3.{int(high.split('.')[1]) - 1}"
    for name in ("README.md", "Makefile"):
        assert f"Python {low} to {last}" in text_of(name), name
    asked = re.search(
        r"\((3,\d+)\) <= sys.version_info\[:2\] < \((3,\d+)\)", text_of("Makefile")
    ).groups()
    assert asked == (low.replace(".", ","), high.replace(".", ","))


def test_no_command_asks_a_registry_for_skidpad():
    """It is not published: what is told to install must work in a clone."""
    for page in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))):
        assert not re.search(r"pip install '?skidpad", page.read_text(encoding="utf-8")), page.name
    assert "pip install -e" in install_command("carla")


def test_configurations_weathers_and_times_are_named_in_words():
    functions = (
        "adaptive cruise control",
        "lane centring",
        "traffic-light assist",
        "speed limiter",
    )
    others = ("sunrise", "heavy rain", "a minute of processor time", "source .venv/bin/activate")
    for words in functions + others:
        assert words in README, words


def test_pictures_are_those_that_make_figures_writes():
    tool = text_of("tools/readme_pictures.py")
    assert "tools/readme_pictures.py docs/img" in text_of("Makefile")
    for target in re.findall(r"!\[[^\]]*\]\((docs/img/[^)]+)\)", README):
        assert f'"{Path(target).name}"' in tool, target
        with Image.open(ROOT / target) as picture:
            assert picture.size[0] >= 800, target
            assert getattr(picture, "n_frames", 1) == 1, "a page, no film"


def text_of(name):
    return (ROOT / name).read_text(encoding="utf-8")


def test_links_of_the_readme_lead_somewhere():
    targets = re.findall(r"\]\(([^)#]+)\)", README)
    assert len(targets) > 5
    for target in targets:
        assert (ROOT / target).exists(), target


def test_numbers_of_what_it_found_stand_on_the_page_beside_them():
    table = README.split("## What it found so far")[1].split("\n## ")[0]
    rows = re.findall(r"^\| [^|]+\? \| ([^|]+) \| \[[^\]]+\]\(([^)#]+)", table, re.MULTILINE)
    assert len(rows) > 4
    for answer, page in rows:
        text = (ROOT / page).read_text(encoding="utf-8")
        numbers = re.findall(r"\d+(?:\.\d+)?", answer)
        assert numbers, answer
        lost = [
            n for n in numbers if not re.search(rf"(?<![\d.]){re.escape(n)}(?![\d]|\.\d)", text)
        ]
        assert lost == [], page
