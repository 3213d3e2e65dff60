#!/usr/bin/python3
"""Builds the handbook as one site that opens offline, also on a machine without the source: site.py [--out=site]

Every Markdown document that belongs to the source, and the pictures beside them, become pages with one
navigation. Links to documents lead to their pages; a file of another kind that they link to becomes a page, too.
"""
import argparse
import html
import os
import re
import shutil
import sys
from pathlib import Path

try:
    import markdown
except ImportError:
    sys.exit("site: needs python3-markdown")

ROOT = Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True
sys.path.append(str(ROOT / "scripts"))

import lint_documents

CSS = ROOT / "scripts/report/page.css"
MORE = """
main { display: grid; grid-template-columns: 230px minmax(0, 1fr); gap: 24px; }
aside { font-size: 14px; } aside h2 { font-size: 13px; color: var(--muted); margin: 14px 0 2px; }
aside a { display: block; color: var(--ink); text-decoration: none; padding: 1px 0; }
aside a.here { color: var(--accent); font-weight: 600; } aside a:hover, article a { color: var(--accent); }
article { background: var(--paper); border: 1px solid var(--line); border-radius: 8px; padding: 8px 28px 28px; }
article img { max-width: 100%; border-radius: 6px; } article table { display: block; overflow-x: auto; }
article h1 { font-size: 24px; } article p, article li { max-width: 90ch; }
@media (max-width: 900px) { main { display: block; } article { padding: 4px 12px 16px; } }
@media print { aside { display: none; } main { display: block; } }
"""
GROUPS = [("Start", ["README.md", "config/handbook/README.md"]),
          ("Tutorials", [f"config/handbook/{name}.md" for name in (
              "px4", "ardupilot", "betaflight", "crazyflie", "laboratory", "autopilots", "python", "library")]),
          ("Understand", ["config/handbook/reading.md", "config/handbook/diagnosis.md", "config/handbook/inspection.md",
                          "config/handbook/simulators.md", "config/handbook/mathematics.md"]),
          ("Look up", ["config/README.md", "config/reference/", "config/handbook/evidence.md",
                       "config/handbook/changes.md"])]
LINK = re.compile(r'(href|src)="([^"#:]*)(#[^"]*)?"')


def documents():
    """Of the source: what git knows, else all Markdown files outside of builds."""
    known = lint_documents.documents(ROOT)
    names = [str(path.relative_to(ROOT)) for path in (ROOT.rglob("*.md") if known is None else known)]
    return sorted(name for name in names if known is not None or not name.startswith("build"))


def page_of(name):
    """README.md of a folder is its index.html."""
    path = Path(name)
    return path.with_name("index.html") if path.name == "README.md" else path.with_suffix(".html")


def title_of(name):
    text = (ROOT / name).read_text(encoding="utf-8")
    return re.search(r"^# (.*)$", text, re.M)[1]


def grouped(names):
    """(title, documents) in the order of the navigation; what no group names comes last, by folder."""
    left, groups = list(names), []
    for title, wanted in GROUPS:
        chosen = [n for w in wanted for n in names if n == w or (w.endswith("/") and n.startswith(w))]
        groups.append((title, chosen))
        left = [n for n in left if n not in chosen]
    return groups + [("Folders of the source", left)]


def navigation(here, groups):
    parts = []
    for title, names in groups:
        parts.append(f"<h2>{html.escape(title)}</h2>")
        for name in names:
            target = os.path.relpath(page_of(name), page_of(here).parent)
            mark = ' class="here"' if name == here else ""
            parts.append(f'<a href="{target}"{mark}>{html.escape(title_of(name))}</a>')
    return "".join(parts)


class Site:
    def __init__(self, out):
        self.out, self.names = out, documents()
        self.files, self.missing = set(), []

    def build(self):
        groups = grouped(self.names)
        for name in self.names:
            text = (ROOT / name).read_text(encoding="utf-8")
            body = markdown.markdown(text, extensions=["tables", "fenced_code", "toc", "sane_lists"])
            self._write(name, title_of(name), LINK.sub(lambda link: self._moved(link, name), body), groups)
        for name in sorted(self.files):
            text = html.escape((ROOT / name).read_text(encoding="utf-8"))
            self._write(f"{name}.md", name, f"<h1>{name}</h1><pre>{text}</pre>", groups)

    def _write(self, name, title, body, groups):
        page = self.out / page_of(name)
        page.parent.mkdir(parents=True, exist_ok=True)
        page.write_text(self._page(name, title, body, groups), encoding="utf-8")

    def _moved(self, link, name):
        attribute, target, anchor = link[1], link[2], link[3] or ""
        if not target:
            return link[0]
        path = Path(os.path.normpath(Path(name).parent / target))
        if str(path / "README.md") in self.names:
            path = path / "README.md"
        if str(path) in self.names:
            return f'{attribute}="{os.path.relpath(page_of(path), page_of(name).parent)}{anchor}"'
        if not (ROOT / path).is_file():
            self.missing.append(f"{name}: {target}")
        elif attribute == "src":
            (self.out / path).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / path, self.out / path)
        else:
            self.files.add(str(path))
            return f'href="{os.path.relpath(page_of(f"{path}.md"), page_of(name).parent)}"'
        return link[0]

    def _page(self, name, title, body, groups):
        return ('<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">'
                '<meta name="viewport" content="width=device-width, initial-scale=1"><link rel="icon" href="data:,">'
                f"<title>{html.escape(title)} - Trueline</title><style>{CSS.read_text()}{MORE}</style></head>"
                f"<body><header><div><h1>Trueline</h1><p>Handbook</p></div></header><main><aside>"
                f"{navigation(name, groups)}</aside><article>{body}</article></main></body></html>\n")


def main(argv):
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, default=ROOT / "site", help="folder of the site, made if missing")
    arguments = parser.parse_args(argv)
    site = Site(arguments.out)
    site.build()
    for missing in site.missing:
        print(f"site: {missing}: no such file; link to one", file=sys.stderr)
    print(f"site: {len(site.names)} pages; open {arguments.out / 'index.html'}")
    return 1 if site.missing else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
