"""The skeleton of every report: one HTML file with its style, its script and its data inside."""
import html
import os
from pathlib import Path

from errors import ReportError
from plot_library import script_tags

CSS = Path(__file__).resolve().with_name("page.css")


def escape(value):
    """Text from data, made safe for HTML."""
    return html.escape(str(value), quote=True)


def paragraph(text, css_class=""):
    return f'<p class="{css_class}">{escape(text)}</p>'


def sentence(text):
    """A clause of a result file as a sentence."""
    return text[:1].upper() + text[1:].rstrip(".") + "."


def details(summary, content):
    """Content (HTML) that is folded until its summary is clicked."""
    return f"<details><summary>{escape(summary)}</summary>{content}</details>"


def verdict(kind, text, reasons=()):
    """The answer of a page: kind is good, fair or bad."""
    said = "".join(f"<li>{escape(reason)}</li>" for reason in reasons)
    return (f'<div class="verdict {kind}"><strong>{escape(text)}</strong>'
            f'{f"<ul>{said}</ul>" if said else ""}</div>')


class Document:
    """What a verb of report.py writes: the bytes or the text of render()."""

    def write(self, path):
        """Writes the file whole or not at all."""
        temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
        content = self.render()
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            temporary.write_bytes(content if isinstance(content, bytes) else content.encode())
            temporary.replace(path)
        except OSError as error:
            raise ReportError(f"{path}: can't be written: {error.strerror}") from error
        finally:
            temporary.unlink(missing_ok=True)


class Page(Document):
    """Collects sections; each has an entry in the navigation at the top."""

    def __init__(self, title, subtitle=""):
        self.title = title
        self.subtitle = subtitle
        self.sections = []

    def add(self, anchor, title, *blocks):
        """`blocks` are HTML; those that are empty are left out."""
        self.sections.append((anchor, title, [block for block in blocks if block]))

    def render(self):
        links = "".join(f'<a href="#{a}">{escape(t)}</a>' for a, t, _ in self.sections)
        body = "".join(
            f'<section id="{a}"><h2>{escape(t)}</h2>{"".join(blocks)}</section>'
            for a, t, blocks in self.sections)
        return (
            '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">'
            '<meta name="viewport" content="width=device-width, initial-scale=1">'
            '<link rel="icon" href="data:,">'
            f"<title>{escape(self.title)}</title><style>{CSS.read_text()}</style>"
            f"{script_tags(body)}</head><body>"
            f'<header><div><h1>{escape(self.title)}</h1><p>{escape(self.subtitle)}</p></div>'
            f"<nav>{links}</nav></header><main>{body}</main></body></html>\n")
