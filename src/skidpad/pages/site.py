"""NiceGUI's pages as an ASGI application. NiceGUI keeps its state in its module: one per process."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from skidpad.core.errors import MissingExtra, SkidpadError

if TYPE_CHECKING:
    from fastapi import FastAPI

Builder = Callable[..., Any]  # fills the page that NiceGUI opens around it
_BUILT: list[str] = []
KEPT = 3.0  # s; NiceGUI's own

STYLE = """
:root { color-scheme: dark; --ink: #e8eaed; --dim: #9aa5b1; --ground: #14181d; --card: #1d232b;
        --line: #303944; --accent: #ff8552; --good: #4fce7f; --bad: #ff5b52; --cool: #4d9dff; }
body { background: var(--ground); color: var(--ink); font: 14px/1.45 system-ui, sans-serif; }
.nicegui-content { padding: 8px; gap: 8px; }
"""


def nicegui() -> Any:
    """Returns the module nicegui; MissingExtra without it."""
    try:
        import nicegui
    except ImportError as error:
        raise MissingExtra("Skidpad's pages", "cockpit") from error
    return nicegui


def site(
    title: str,
    pages: Mapping[str, Builder],
    *,
    routes: Callable[[FastAPI], None] | None = None,
    style: str = "",
    kept: float = KEPT,
) -> FastAPI:
    """Returns an application with these pages by path; SkidpadError for a second one in a process.

    routes: adds routes that are no pages; they come first, as NiceGUI answers to any path.
    style: CSS after that of all sites.
    kept: s for which the page of a tab that does not answer is kept; later it is loaded anew.
    """
    module = nicegui()
    from fastapi import FastAPI

    if _BUILT:
        raise SkidpadError(
            f"this process serves {_BUILT[0]!r} already, and NiceGUI serves one site"
        )
    _BUILT.append(title)
    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    if routes is not None:
        routes(app)
    for path, builder in pages.items():
        module.ui.page(path, reconnect_timeout=kept)(builder)
    module.ui.add_css(STYLE + style, shared=True)
    module.ui.run_with(app, title=title, dark=True, tailwind=False, show_welcome_message=False)
    return app
