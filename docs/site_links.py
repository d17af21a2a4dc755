"""Check the links inside the built site: each leads to a page, a file or a heading that exists.

`make docs` runs it. Sphinx checks the links of pages; this also checks what it generates, and what
pages include. Links to other sites are checked by `make docs-links`.
"""

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    """The links and the anchors of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Collect what an element links, and its own name."""
        values = dict(attrs)
        self.links += [link for key in ("href", "src") if (link := values.get(key))]
        self.anchors |= {name for key in ("id", "name") if (name := values.get(key))}


def broken(site: Path) -> list[str]:
    """Return the links of a site that lead nowhere, each with its page."""
    pages = {
        path.resolve(): Page(path.read_text(encoding="utf-8")) for path in site.rglob("*.html")
    }
    return [
        f"{path.relative_to(site.resolve())}: {link}"
        for path, page in sorted(pages.items())
        for link in sorted(set(page.links))
        if not _leads_somewhere(link, path, pages)
    ]


def _leads_somewhere(link: str, path: Path, pages: dict[Path, Page]) -> bool:
    parts = urlsplit(link)
    if parts.scheme or parts.netloc:
        return True
    target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
    if target not in pages:
        return target.is_file() and not parts.fragment
    return not parts.fragment or unquote(parts.fragment) in pages[target].anchors


if __name__ == "__main__":
    found = broken(Path(sys.argv[1]))
    sys.exit("\n".join([*found, f"{len(found)} links lead nowhere"]) if found else 0)
