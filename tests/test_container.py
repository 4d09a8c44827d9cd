"""The container recipe is not built in CI; what it copies, installs and calls exists all the same."""

import re
import shlex
from fnmatch import fnmatch
from importlib import metadata
from pathlib import Path

import pytest
import typer
from packaging.specifiers import SpecifierSet

from skidpad.cli.main import app

ROOT = Path(__file__).resolve().parents[1]
RECIPE = (ROOT / "Containerfile").read_text(encoding="utf-8").replace("\\\n", " ")
PROJECT = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
STEPS = [line.split(maxsplit=1) for line in RECIPE.splitlines() if line and line[0] != "#"]


def steps(word):
    return [rest for name, rest in STEPS if name == word]


def of_project(name):
    """A value of pyproject.toml, as text."""
    return re.search(rf"^{name} = (.*)$", PROJECT, re.MULTILINE).group(1)


@pytest.mark.req("X-14")
def test_what_is_copied_exists_and_is_all_that_the_wheel_needs():
    copied = [p for s in steps("COPY") if "--from" not in s for p in shlex.split(s)[:-1]]
    for name in copied:
        assert (ROOT / name).exists(), name
    needed = {"pyproject.toml", "src", of_project("readme").strip('"')}
    assert needed | set(re.findall(r'"([^"]+)"', of_project("license-files"))) == set(copied)
    ignore = (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines()
    let_in = {line[1:] for line in ignore if line.startswith("!")}
    assert ignore[0] == "*"
    assert let_in == set(copied)
    dropped = [p.removeprefix("**/") for p in ignore[1:] if p[0] != "!"]
    tracked = (p for p in (ROOT / "src").rglob("*") if "__pycache__" not in p.parts)
    assert not [p for p in tracked if any(fnmatch(p.name, d) for d in dropped)]


@pytest.mark.req("X-14")
def test_base_images_have_a_python_that_the_project_takes_and_name_no_host():
    bases = [s.split()[0] for s in steps("FROM")]
    assert len(bases) == 2
    allowed = SpecifierSet(of_project("requires-python").strip('"'))
    for base in bases:
        version = re.fullmatch(r"python:(3\.\d+)(-slim)?", base)
        assert version, f"not an official image: {base}"
        assert version.group(1) in allowed
    assert not re.search(r"https?://|--index-url|--extra-index", RECIPE)


@pytest.mark.req("X-14")
def test_extras_and_commands_exist():
    extras = set(
        re.findall(r"^(\w+) = \[", PROJECT.split("[project.optional-dependencies]")[1], re.M)
    )
    for named in re.findall(r"(?:/source|skidpad)\[([\w,]+)\]", RECIPE):
        assert set(named.split(",")) <= extras
    scripts = {e.name for e in metadata.entry_points(group="console_scripts")}
    commands = typer.main.get_command(app).commands
    lines = (ROOT / "docs" / "container.md").read_text(encoding="utf-8").replace("\\\n", " ")
    called = [shlex.split(c)[0] for c in re.findall(r"skidpad +skidpad (.+)", lines)]
    assert len(called) == lines.count("docker run")
    (command,) = steps("CMD")
    program, first = re.findall(r'"([^"]+)"', command)
    assert {*called, first} <= set(commands)
    assert program in scripts | {"skidpad"}  # a source tree on the path has no scripts


def test_the_cluster_recipe_calls_programs_of_the_image():
    pytest.importorskip("distributed")
    text = (ROOT / "docs" / "campaigns.md").read_text(encoding="utf-8")
    named = re.findall(r"args: \[(\w+), (\w+)", text)
    assert named == [("dask", "scheduler"), ("dask", "worker")]
    assert "dask" in {e.name for e in metadata.entry_points(group="console_scripts")}
    assert {"scheduler", "worker"} <= {e.name for e in metadata.entry_points(group="dask_cli")}
