"""A page as one file: what it runs and how it looks is named by digest, and nothing else runs."""

import base64
import hashlib
import html
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from planner.messages import plain

HERE = Path(__file__).parent
SCRIPTS = ("words.js", "map.js", "marks.js", "curves.js", "page.js")  # one after the other
POLICY = re.compile(r'(<meta http-equiv="Content-Security-Policy"[^>]*>)')
NO_PARTS = dict.fromkeys(("ABOUT", "SOON", "ODDS", "STILL", "DOTS", "METHODS", "LEGS", "NOTES"), "")
# Has a page that is to be replaced by a better one looked for again every few seconds: by the
# browser where no script runs, and else by the script, which keeps what is looked at.
AGAIN = '<noscript><meta http-equiv="refresh" content="3"></noscript>\n'
# In a script: a text; and spaces around a sign, but between two that would become one of their own.
TEXT = re.compile(r"""("(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*'|`(?:\\.|[^`\\])*`)""")
SPACED = re.compile(r" *([{}()\[\];,:<>=*/%&|?!.]+|(?<![-+])(?<![-+] )[-+]=?(?! *[-+])) *")
# What would end the block that data stand in, or a line of a script.
UNSAFE = str.maketrans({c: f"\\u{ord(c):04x}" for c in "<>&\u2028\u2029"})


def document(*, title: str, data: Mapping[str, Any], parts: Mapping[str, str]) -> str:
    """Return a page.

    Parameters
    ----------
    data
        What its script takes, plain.
    parts
        Markup, as `markup` makes it safe, by the names that ``template.html`` has for it.
    """
    script = "(() => {\n" + "".join(_lean(name) for name in SCRIPTS) + "})();\n"
    script, style = '"use strict";\n' + script, _lean("style.css")
    every = {
        **parts,
        "TITLE": markup(title),
        "SCRIPT": script,
        "STYLE": style,
        "SCRIPT_DIGEST": digest(script),
        "STYLE_DIGEST": digest(style),
        "DATA": embedded(data),
    }
    template = (HERE / "template.html").read_text(encoding="utf-8")
    return filled(template, every)


def reloading(text: str) -> str:
    """Return a page that looks for a better one in its place."""
    return text.replace("<title>", f"{AGAIN}<title>", 1)


def settled(text: str) -> str:
    """Return a page that does not, or no longer."""
    return text.replace(AGAIN, "", 1)


def filled(template: str, parts: Mapping[str, str]) -> str:
    """Return a template with markup in place of the names in double braces."""
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], template)


def instrument(text: str, *, form: str, state: Mapping[str, Any]) -> str:
    """Return a page with a form that asks its own server for plans, which the page alone cannot.

    Parameters
    ----------
    text
        Of the page, as `document` makes it.
    form
        Markup, safe.
    state
        What the form's script takes, plain.
    """
    script = '"use strict";\n(() => {\n' + _lean("instrument.js") + "})();\n"
    style = _lean("instrument.css")
    allowed = {
        "default-src 'none';": "default-src 'none'; connect-src 'self';",
        "script-src ": f"script-src '{digest(script)}' ",
        "style-src ": f"style-src '{digest(style)}' ",
    }
    before, policy, after = re.split(POLICY, text, maxsplit=1)
    for old, new in allowed.items():
        policy = policy.replace(old, new, 1)
    body, end = (before + policy + after).rsplit("</body>", 1)
    return (
        f"{body}{form}<style>{style}</style>"
        f'<script type="application/json" id="asked">{embedded(state)}</script>'
        f"<script>{script}</script>\n</body>{end}"
    )


def markup(text: str) -> str:
    """Return other people's words as text of a page: no markup, nothing that turns it round."""
    return html.escape(plain(text))


def embedded(data: Mapping[str, Any]) -> str:
    """Return plain data as JSON that no words in it can end before its end."""
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.translate(UNSAFE)


def digest(text: str) -> str:
    """Return a text's digest as a content security policy names it."""
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")


def _lean(name: str) -> str:
    """Return a file of this folder without indentation, blank lines and lines of comments."""
    lines = (HERE / name).read_text(encoding="utf-8").splitlines()
    kept = (line.strip() for line in lines)
    text = "".join(f"{line}\n" for line in kept if line and not line.startswith(("//", "/*")))
    return tight(text) if name.endswith(".js") else text


def tight(script: str) -> str:
    """Return a script without the spaces that only part its signs; its texts stay as they are.

    It may hold no regular expression between slashes, as these are not told from divisions.
    """
    parts = re.split(TEXT, script)  # every other one is a text
    parts[::2] = [SPACED.sub(r"\1", part) for part in parts[::2]]
    return "".join(parts)
