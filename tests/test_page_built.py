"""The page inside the package is the one that its sources make."""

import gzip
import hashlib
import re
from pathlib import Path

from surfsig.page.document import viewer

WEB = Path(__file__).parents[1] / "web"


def sources_hash() -> str:
    """Take the hash of what the page is made of, as web/build.mjs does."""
    made = hashlib.sha256()
    files = [file for file in (WEB / "src").rglob("*") if file.is_file()]
    files += [WEB / name for name in ("package-lock.json", "engine_exports.txt", "build.mjs")]
    for name in sorted(file.relative_to(WEB).as_posix() for file in files):
        made.update(name.encode() + b"\0")
        made.update((WEB / name).read_text(encoding="utf-8").replace("\r\n", "\n").encode())
    return made.hexdigest()


def test_the_page_is_that_of_its_sources() -> None:
    (built_from,) = re.findall(r'<meta name="sources" content="(\w+)"', viewer())
    assert built_from == sources_hash(), "the page is out of date: run `make page`"


def test_the_page_is_small() -> None:
    assert len(gzip.compress(viewer().encode())) < 1_500_000
