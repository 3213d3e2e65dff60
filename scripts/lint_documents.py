#!/usr/bin/python3
"""Finds lines over 120 characters and sentences over 40 words in documents; tables and code apart.

    lint_documents.py [FILE.md...]    without files: all documents of the source
"""
import re
import subprocess
import sys
from pathlib import Path

LONGEST_LINE, LONGEST_SENTENCE = 120, 40
ABBREVIATIONS = re.compile(r"\b(e\.g|i\.e|eq|fig|al|vs|Tab|resp)\.")
LIST_ITEM = re.compile(r"^\s*([-*]|\d+\.)\s+")


def documents(root):
    """Paths of the Markdown files that belong to the source; None where git can't tell."""
    listed = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard", "*.md"], cwd=root,
                            capture_output=True, text=True)
    if listed.returncode != 0:
        return None
    return [root / name for name in sorted(listed.stdout.splitlines()) if (root / name).exists()]


def prose(text):
    """(line number, line) of what is neither code nor a table; a blank line where a block ends."""
    in_code = False
    for i, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith("```"):
            in_code = not in_code
            yield i, ""
        elif in_code or line.lstrip().startswith(("|", "#", "<")):
            yield i, ""
        else:
            yield i, line


def sentences(lines):
    """(line number, sentence): a sentence ends with its full stop, its paragraph or its list item."""
    start, words = None, []
    for i, line in [*lines, (0, "")]:
        if not line.strip() or LIST_ITEM.match(line):
            if words:
                yield start, " ".join(words)
            start, words = None, []
        line = LIST_ITEM.sub("", line)
        line = ABBREVIATIONS.sub(r"\1", re.sub(r"\]\([^)]*\)", "]", line))
        for word in line.split():
            start = start or i
            words.append(word)
            if re.search(r"[.!?][\"')*\]`]*$", word):
                yield start, " ".join(words)
                start, words = None, []


def complaints(path):
    lines = list(prose(Path(path).read_text(encoding="utf-8")))
    for i, line in lines:
        if len(line) > LONGEST_LINE and " " in line.strip():
            yield f"{path}:{i}: {len(line)} characters, {LONGEST_LINE} are allowed"
    for i, sentence in sentences(lines):
        count = sum(any(c.isalnum() for c in word) for word in sentence.split())
        if count > LONGEST_SENTENCE:
            yield f"{path}:{i}: a sentence of {count} words, {LONGEST_SENTENCE} are allowed"


def main(paths):
    paths = paths or documents(Path(__file__).resolve().parents[1]) or []
    found = [complaint for path in paths for complaint in complaints(path)]
    print("\n".join(found) if found else f"lint: {len(paths)} documents are clean")
    return bool(found)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
