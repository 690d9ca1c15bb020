"""Check a built site: all files that a page names are there, lessons show figures, all figures have a text."""

from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlparse


class _Page(HTMLParser):
    """Addresses, anchors and images of a page."""

    def __init__(self, path: Path):
        super().__init__()
        self.addresses: list[str] = []
        self.anchors: set[str] = set()
        self.images: list[str] = []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        named = {key: value or "" for key, value in attrs}
        self.anchors |= {named[key] for key in ("id", "name") if key in named}
        self.addresses += [named[key] for key in ("href", "src") if named.get(key)]
        if tag == "img":
            self.images.append(named.get("alt", ""))


def check_site(site: Path, lessons: list[str]) -> list[str]:
    """Return a sentence for each fault.

    Parameters
    ----------
    site : Path
        Folder of the HTML pages.
    lessons : list of str
        Pages that must show a figure. On all pages each has a text of four words or more that says what it shows.
    """
    pages = {path: _Page(path) for path in sorted(site.rglob("*.html")) if "_static" not in path.parts}
    faults = []
    for path, page in pages.items():
        name = path.relative_to(site)
        for address in page.addresses:
            url = urlparse(address)
            if url.scheme in ("http", "https", "mailto", "data", "javascript"):
                continue
            target = path if not url.path else (path.parent / unquote(url.path)).resolve()
            if not target.exists():
                faults.append(f"{name} names {address}, which is not there.")
            elif url.fragment and target in pages and unquote(url.fragment) not in pages[target].anchors:
                faults.append(f"{name} points to {address}, and there is no such anchor.")
        if path.stem in lessons and not page.images:
            faults.append(f"{name} shows no figure.")
        texts = [] if path.stem == "py-modindex" else page.images  # whose images are buttons
        if any(len(alt.split()) < 4 or "/" in alt.split(" ")[0] for alt in texts):
            faults.append(f"{name} has a figure without a text that says what it shows.")
    return faults
