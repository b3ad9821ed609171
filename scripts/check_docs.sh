#!/usr/bin/env bash
# Checks what documents and code name: links of .md files lead to files and headings that exist, files named in `code` exist, and so
# do the sections that comments cite (docs/design.md, "Silhouettes"). Says which are not, and fails.
#
# Files that a document shows as examples are named in a comment of its own: <!-- example files: a/b.cpp c/d.cl -->
set -euo pipefail
cd "$(dirname "$0")/.."

exec python3 - <<'PYTHON'
import os
import re
import subprocess
import sys

FOLDERS = ("docs/", "data/", "host/", "include/", "kernels/", "scripts/", "tests/", ".ci/")
FENCE = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
CITATION = re.compile(r'\b((?:docs|kernels|data)/[\w/.-]*\.md)(?:\s*[#,]\s*(?://\s*)?"([^"]+)")?')
wrong = []


def listed(*patterns):
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "--", *patterns]
    return [name for name in subprocess.run(command, check=True, capture_output=True, text=True).stdout.split("\n")
            if name and os.path.exists(name)]


def read(name):
    with open(name, encoding="utf-8") as file:
        return file.read()


def fail(name, text, at, message):
    wrong.append(f"{name}:{text.count(chr(10), 0, at) + 1}: {message}")


def blank(match):
    """The same number of lines with nothing in them."""
    return "\n" * match.group().count("\n")


def headings(name):
    return [re.sub(r"[`*]", "", title).strip() for title in re.findall(r"^#+ +(.*)$", FENCE.sub(blank, read(name)), re.MULTILINE)]


def anchor(title):
    return re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-")


def check_document(name):
    text = read(name)
    prose = FENCE.sub(blank, text)
    examples = set(" ".join(re.findall(r"<!-- example files: (.*?) -->", text)).split())
    for match in re.finditer(r"\]\(([^)\s]+)\)", re.sub(r"`[^`\n]*`", lambda m: " " * len(m.group()), prose)):
        target, _, fragment = match.group(1).partition("#")
        if re.match(r"[a-z]+:", target):
            continue
        path = os.path.normpath(os.path.join(os.path.dirname(name), target)) if target else name
        if not os.path.exists(path):
            fail(name, prose, match.start(), f"{target}: no such file")
        elif fragment and fragment not in map(anchor, headings(path)):
            fail(name, prose, match.start(), f"{path}: expected a heading for #{fragment}")
    for match in re.finditer(r"`([\w./-]+)`", prose):
        path = match.group(1)
        if path.startswith(FOLDERS) and path not in examples and not os.path.exists(path):
            fail(name, prose, match.start(), f"{path}: no such file")


def check_citations(name):
    text = read(name)
    for match in CITATION.finditer(text):
        path, title = match.groups()
        if not os.path.exists(path):
            fail(name, text, match.start(), f"{path}: no such file")
        elif title and " ".join(title.split()) not in headings(path):
            fail(name, text, match.start(), f'{path}: expected a heading "{title}"')


documents = listed("*.md")
for document in documents:
    check_document(document)
for source in listed("*.cpp", "*.hpp", "*.h", "*.cl", "*.py", "*.sh", "*.txt", "*.cmake"):
    if source != "scripts/check_docs.sh":
        check_citations(source)
if wrong:
    print("\n".join(wrong), file=sys.stderr)
    sys.exit(f"check_docs: expected every link and citation to lead somewhere (found {len(wrong)} that do not)")
PYTHON
