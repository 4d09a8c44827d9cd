"""The log-in page: what a browser without a session is shown. It holds no data of the fleet.

A one-time address goes to the guard as it is. A credential goes to the session exchange in a header,
so that it stands in no address and no log.
"""

from __future__ import annotations

from html import escape

ASK = (
    "Log in with a one-time address of this fleet, or with the credential that you got when you were"
    " enrolled."
)
PAGE = """<!doctype html><html lang="en"><meta charset="utf-8">
<meta name="viewport" content="width=device-width,initial-scale=1"><title>Skidpad fleet: log in</title>
<style>:root{{color-scheme:dark}}body{{background:#14181d;color:#e8eaed;margin:0;padding:16px;
font:16px/1.45 system-ui,sans-serif}}main{{max-width:32rem;margin:10vh auto}}input,button{{font:inherit;
width:100%;box-sizing:border-box;min-height:44px;margin:6px 0;padding:6px 10px}}#wrong{{color:#ff8b84}}
</style><main><h1>Skidpad fleet</h1><p>{ask}</p>
<form id="log-in" autocomplete="off"><label for="key">One-time address or credential</label>
<input id="key" type="password" required autofocus><button>Log in</button></form>
<p id="wrong" role="alert">{wrong}</p></main>
<script>
const wrong = document.getElementById("wrong");
document.getElementById("log-in").addEventListener("submit", async event => {{
  event.preventDefault();
  const key = document.getElementById("key").value.trim();
  const invitation = key.match(/[?&]token=([^&#\\s]+)/);
  if (invitation) {{
    const path = key.match(/^(?:https?:\\/\\/[^/?#]*)?(\\/[^?#]*)/);
    location.assign("/" + (path ? path[1] : "").replace(/^[\\/\\\\]+/, "") + "?token=" + invitation[1]);
    return;
  }}
  try {{
    const headers = {{Authorization: "Bearer " + key}};
    const answer = await fetch("/api/v1/session", {{method: "POST", headers}});
    const said = await answer.json();
    if (answer.ok) location.assign(said.path);
    else wrong.textContent = said.detail;
  }} catch (error) {{
    wrong.textContent = "This is neither an address nor a credential, or the fleet does not answer.";
  }}
}});
</script></html>
"""


def log_in_page(wrong: str) -> str:
    """Returns the HTML page to log in, with what was wrong about the last attempt ("" for the first)."""
    return PAGE.format(ask=escape(ASK), wrong=escape(wrong))
