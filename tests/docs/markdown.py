# SPDX-License-Identifier: Apache-2.0
# Facewright: multi-resolution 3D morphable face models.
"""As much of Markdown as the tests of the documentation need: fenced blocks, links, headings."""
import os
import re
from dataclasses import dataclass

SKIPPED = {"build", "demo", "node_modules", ".git", "__pycache__"}


@dataclass
class Block:
    """A fenced block: what follows the fence, its lines, the line number of the first, the comment right above it."""
    info: str
    lines: list
    line: int
    comment: str = ""


def markdown_files(root):
    for place, folders, files in os.walk(root):
        folders[:] = sorted(f for f in folders if f not in SKIPPED and not f.startswith("build-"))
        yield from (os.path.relpath(os.path.join(place, f), root) for f in sorted(files) if f.endswith(".md"))


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def split(text):
    """The blocks of a page, and its prose with the blocks' lines emptied, so that line numbers stay."""
    blocks, prose, block, above = [], [], None, ""
    for number, line in enumerate(text.split("\n"), 1):
        fence = re.match(r"\s*```(.*)$", line)
        if fence and block is None:
            comment = re.match(r"<!--\s*(.*?)\s*-->$", above.strip())
            block = Block(fence.group(1).strip(), [], number + 1, comment.group(1) if comment else "")
        elif fence:
            blocks.append(block)
            block, above = None, ""
        elif block is not None:
            block.lines.append(line)
        else:
            prose.append(line)
            above = line if line.strip() else above
            continue
        prose.append("")
    return blocks, prose


def anchors(text):
    """What can stand after # in a link to this page: GitHub's names of its headings."""
    found, counts = set(), {}
    for line in split(text)[1]:
        heading = re.match(r"#{1,6} +(.*?) *#*$", line)
        if not heading:
            continue
        words = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading.group(1)).replace("`", "")
        name = re.sub(r"[^\w\- ]", "", words.lower()).replace(" ", "-")
        count = counts[name] = counts.get(name, -1) + 1
        found.add(name if count == 0 else f"{name}-{count}")
    return found


def links(prose):
    """(line number, target) of every link and picture."""
    for number, line in enumerate(prose, 1):
        for target in re.findall(r"\]\(\s*<?([^)\s>]+)", re.sub(r"`[^`]*`", "", line)):
            yield number, target
