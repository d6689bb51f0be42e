"""Pages to open in a browser, or to look at in a notebook."""

from __future__ import annotations

import html
import os
import tempfile
import webbrowser


class Report:
    """A page as dgd writes it, one file that needs nothing besides. A notebook shows it in place."""

    def __init__(self, text: str) -> None:
        #: The page's HTML.
        self.html = text

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the page to a file."""
        with open(path, "w", encoding="utf-8") as file:
            file.write(self.html)

    def open(self) -> None:
        """Shows the page in the browser."""
        with tempfile.NamedTemporaryFile("w", suffix=".html", delete=False, encoding="utf-8") as file:
            file.write(self.html)
        webbrowser.open(f"file://{file.name}")

    def __repr__(self) -> str:
        return f"<dgd.Report: {len(self.html)} characters; `.save(path)` writes it, `.open()` shows it>"

    def _repr_html_(self) -> str:
        source = html.escape(self.html, quote=True)
        frame = "width:100%;height:720px;border:1px solid #ccc"
        return f'<iframe sandbox="allow-scripts allow-downloads" style="{frame}" srcdoc="{source}"></iframe>'
