"""The documents: lists that are made agree with the code, prose is short, links lead somewhere."""
import contextlib
import io
import os
import re
import runpy
import sys
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ.get("TRUELINE_TEST_SOURCE_DIR", Path(__file__).resolve().parents[2]))
BUILD = Path(os.environ.get("TRUELINE_TEST_BUILD_DIR", SOURCE / "build"))
LINK = re.compile(r"\]\(([^)#\s]*)(?:#([^)\s]*))?\)")
sys.path += [str(SOURCE / "scripts"), str(SOURCE / "scripts" / "handbook")]

import lint_documents
import reference


def documents():
    known = lint_documents.documents(SOURCE)
    if known is None:
        raise unittest.SkipTest("no git here: which documents belong to the source is not known")
    return known


def anchors(text):
    """As a Markdown viewer makes them of headings."""
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-")
            for heading in re.findall(r"^#+ (.*)$", text, re.M)}


class Reference(unittest.TestCase):
    def test_committed_lists_are_what_the_code_says(self):
        made, lacking = reference.pages(BUILD)
        self.assertEqual(lacking, [])
        for name, text in made.items():
            committed = (SOURCE / "config/reference" / name).read_text()
            self.assertTrue(committed == text, f"{name} differs; run scripts/handbook/reference.py")

    def test_what_lacks_a_description_is_named(self):
        with self.assertRaisesRegex(reference.Lacking, "new_finding.*old_finding"):
            reference.described("findings", ["stuck", "new_finding"], {"stuck": 1, "old_finding": 1})


class Prose(unittest.TestCase):
    def test_lines_and_sentences_are_short(self):
        self.assertEqual([c for path in documents() for c in lint_documents.complaints(path)], [])

    def test_long_ones_are_found(self):
        path = Path(self.enterContext(tempfile.TemporaryDirectory())) / "long.md"
        path.write_text("word " * 41 + "end.\n\n| a table | " + "word " * 50 + "|\n\nShort. Sentences. Are fine.\n")
        found = list(lint_documents.complaints(path))
        self.assertEqual([f.split(": ", 1)[1].split(",")[0] for f in found],
                         ["209 characters", "a sentence of 42 words"])

    def test_links_lead_somewhere(self):
        wrong = []
        for path in documents():
            text = re.sub(r"```.*?```", "", path.read_text(), flags=re.S)
            for target, anchor in LINK.findall(text):
                if target.startswith(("http", "mailto")):
                    continue
                file = (path.parent / target).resolve() if target else path
                if not file.exists() or (anchor and anchor not in anchors(file.read_text())):
                    wrong.append(f"{path.relative_to(SOURCE)}: {target}#{anchor}")
        self.assertEqual(wrong, [])

    def test_no_link_of_the_site_is_dead(self):
        out = Path(self.enterContext(tempfile.TemporaryDirectory())).resolve()
        with contextlib.redirect_stdout(io.StringIO()):
            self.assertEqual(runpy.run_path(SOURCE / "scripts/handbook/site.py")["main"]([f"--out={out}"]), 0)
        ids = {page: set(re.findall(r' id="([^"]*)"', page.read_text())) for page in out.glob("**/*.html")}
        self.assertGreater(len(ids), 30)
        dead = []
        for page in ids:
            for tag, target, anchor in re.findall(r'<(a|img) [^>]*?(?:href|src)="([^"#:]*)#?([^":]*)"', page.read_text()):
                file = (page.parent / target).resolve() if target else page
                if not file.is_relative_to(out) or not file.is_file() or (anchor and anchor not in ids[file]):
                    dead.append((str(page.relative_to(out)), target, anchor))
            dead += [(str(page.relative_to(out)), link) for link in re.findall(r"<a (?!href=)[^>]*>", page.read_text())]
        self.assertEqual(dead, [])

    def test_the_first_pages_stay_short(self):
        for name, lines in (("README.md", 110), ("config/README.md", 250)):
            self.assertLessEqual(len((SOURCE / name).read_text().splitlines()), lines, name)


if __name__ == "__main__":
    unittest.main()
