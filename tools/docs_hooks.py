"""What `mkdocs` is told beside mkdocs.yml: the home page, commands and settings are generated.

The home page is README.md with its links turned round. The reference of commands is what the program
says of itself, so it cannot be out of date.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
OUTSIDE = {
    "SECURITY.md": "reliability.md", "../SECURITY.md": "reliability.md",
    "CONTRIBUTING.md": "contributing.md", "CITATION.cff": "contributing.md", "gallery.yaml": "gallery.md",
}  # fmt: skip


def on_files(files: Any, config: Any) -> Any:
    """Adds the generated pages to the site's files."""
    from mkdocs.structure.files import File

    pages = {
        "index.md": home_page(),
        "contributing.md": contributing_page(),
        "reference/cli.md": command_reference(),
        "reference/settings.md": settings_reference(),
        "llms.txt": page_list(config.nav),
    }
    for place, content in pages.items():
        files.append(File.generated(config, place, content=content))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Points links that lead out of docs/ to the page of the site that says the same."""
    for target, page in OUTSIDE.items():
        markdown = markdown.replace(f"]({target})", f"]({page})")
    return markdown


def page_list(nav: list[dict[str, Any]]) -> str:
    """Returns all pages by subject, for language models that read the site (llmstxt.org)."""
    lines = ["# Skidpad", "", "> A proving ground for driving automation in bad weather.", ""]
    for part in nav:
        for subject, pages in part.items():
            entries = pages if isinstance(pages, list) else [{subject: pages}]
            lines += [f"## {subject}", ""]
            lines += [
                f"- [{title}]({place.removesuffix('.md')}.html)"
                for entry in entries
                for title, place in entry.items()
            ]
            lines += [""]
    return "\n".join(lines)


def home_page() -> str:
    """Returns README.md with links as seen from docs/."""
    return _seen_from_docs("README.md")


def contributing_page() -> str:
    """Returns CONTRIBUTING.md and how to cite."""
    cited = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    return f"{_seen_from_docs('CONTRIBUTING.md')}\n## How to cite\n\n```yaml\n{cited}```\n"


def _seen_from_docs(name: str) -> str:
    text = (ROOT / name).read_text(encoding="utf-8")
    return re.sub(r"\]\(docs/", "](", text)


def command_reference() -> str:
    """Returns every command with its help, arguments and options, as Markdown."""
    from typer.main import get_command

    from skidpad.cli.main import app

    lines = ["# Commands", "", "Written by the program itself; `--help` says the same.", ""]
    root = get_command(app)
    context = root.context_class(root, info_name="skidpad")
    for path, command in sorted(_leaves(root, context, ("skidpad",))):
        lines += _command_section(path, command)
    return "\n".join(lines) + "\n"


def settings_reference() -> str:
    """Returns every setting with its meaning, values and default, as Markdown."""
    from skidpad.core.settings.parts import PARTS, load_profile
    from skidpad.core.settings.setting import describe_settings

    recommended = load_profile("recommended").to_plain()
    lines = ["# Settings", "", "Of `--set name=value`, `settings=` and a profile's file.", ""]
    for part, kind in PARTS.items():
        lines += [f"## {part}", "", (kind.__doc__ or "").strip(), ""]
        lines += ["| setting | meaning | values | recommended | source |", "|---|---|---|---|---|"]
        for name, one in describe_settings(kind).items():
            value = "none" if recommended[name] is None else recommended[name]
            lines += [f"| `{name}` | {one.text} | {one.range_text} | {value} | {one.source} |"]
        lines += [""]
    return "\n".join(lines) + "\n"


def _leaves(command: Any, context: Any, path: tuple[str, ...]) -> Any:
    if hasattr(command, "list_commands"):
        for name in command.list_commands(context):
            yield from _leaves(command.get_command(context, name), context, (*path, name))
    elif not command.hidden:
        yield " ".join(path), command


def _command_section(path: str, command: Any) -> list[str]:
    arguments = [p for p in command.params if p.param_type_name == "argument"]
    options = [p for p in command.params if p.param_type_name == "option" and not p.hidden]
    usage = " ".join([path, *(p.name.upper() for p in arguments)])
    lines = [f"## {path}", "", (command.help or "").strip(), "", "```text", usage, "```", ""]
    for title, rows in (("argument", arguments), ("option", options)):
        if rows:
            lines += [f"| {title} | meaning | default |", "|---|---|---|"]
            lines += [_row(p) for p in rows]
            lines += [""]
    return lines


def _row(parameter: Any) -> str:
    name = ", ".join(parameter.opts) if parameter.param_type_name == "option" else parameter.name
    default = getattr(parameter.default, "value", parameter.default)
    shown = "" if default in (None, [], False) or callable(default) else f"`{default}`"
    text = (getattr(parameter, "help", None) or "").replace("|", "\\|").replace("\n", " ")
    return f"| `{name}` | {text} | {shown} |"
