# SPDX-License-Identifier: Apache-2.0
# Facewright: multi-resolution 3D morphable face models.
"""Every paper cited by key, like [tena2006] or [huber2016, tena2006], is in docs/bibliography.bib, which is sorted; and
every relative link of the documentation leads somewhere.

usage: check_citations.py SOURCE_DIR
"""
import os
import re
import sys

from check_files import source_files

KEY = r"[a-z]+[12][0-9]{3}[a-z]?"
CITATION = re.compile(rf"\[({KEY}(?:, ?{KEY})*)(?:,? [^\]\n]*)?\](?!\()")
LINK = re.compile(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)")


def read(path):
    with open(path, encoding="utf-8", errors="replace") as file:
        return file.read()


def problems(root):
    keys = re.findall(rf"^@\w+\{{({KEY}),", read(os.path.join(root, "docs", "bibliography.bib")), re.M)
    if keys != sorted(keys):
        yield "docs/bibliography.bib: entries are not sorted by key"
    for key in sorted({key for key in keys if keys.count(key) > 1}):
        yield f"docs/bibliography.bib: {key} is there twice"
    for path in source_files(root):
        if not path.endswith((".h", ".cpp", ".md")):
            continue
        text = read(os.path.join(root, path))
        for match in CITATION.finditer(text):
            for key in re.findall(KEY, match.group(1)):
                if key not in keys:
                    yield f"{path}:{text.count(chr(10), 0, match.start()) + 1}: [{key}] is not in docs/bibliography.bib"
        if path.endswith(".md"):
            for target in LINK.findall(text):
                if not os.path.exists(os.path.join(root, os.path.dirname(path), target)):
                    yield f"{path}: link to {target} leads nowhere"


if __name__ == "__main__":
    messages = list(problems(sys.argv[1]))
    print("\n".join(messages) or "all citations and links are in order")
    sys.exit(1 if messages else 0)
