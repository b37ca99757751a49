# SPDX-License-Identifier: Apache-2.0
# Facewright: multi-resolution 3D morphable face models.
"""Runs the commands of a page, in order, in an empty folder, and holds the page to what happens.

usage: run_page.py PAGE BIN_DIR[:MORE] WORK_DIR            fails where the page does not agree
       run_page.py PAGE BIN_DIR[:MORE] WORK_DIR --update   mends quoted lines and pictures instead (docs/make-pictures)

- A block marked `sh` is run by bash and must end with exit code 0. `<!-- not run: why -->` above it leaves it out.
- A block marked `text` quotes what the block before it printed on stdout. A line `...` stands for any lines, the sign
  … within a line for anything; the rest must be the same to the letter.
- `<!-- from FILE -->` above a picture: the picture is FILE in the folder, which must exist and have the same size.
- `examples/` is that of the source tree.
- Names of files in the text, in back-quotes, exist afterwards, in the folder or in the source tree.
"""
import glob
import os
import re
import shutil
import struct
import subprocess
import sys
import time

from markdown import read, split

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
NUMBER = r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?"
FILE_NAME = re.compile(r"[\w*][\w./*-]*(?:/|\.(?:png|h5|json|ply|obj|pts|csv|md|html|glb|toml|txt|svg|mtl|cpp|reference))")


def pattern_of(line, numbers_free=False):
    parts = re.split(rf"(…|(?<![\w.]){NUMBER}| +)" if numbers_free else "(…)", line.rstrip())
    return "".join("(.*?)" if p == "…" else f"({NUMBER})" if re.fullmatch(NUMBER, p) and numbers_free else
                   "( +)" if numbers_free and p and not p.strip() else f"({re.escape(p)})" for p in parts) + r"\s*"


def disagreement(expected, actual):
    """The first quoted line that is not what was printed, or None."""
    at, skipping = 0, False
    for line in expected:
        if line.strip() == "...":
            skipping = True
            continue
        places = range(at, len(actual)) if skipping else range(at, min(at + 1, len(actual)))
        found = next((i for i in places if re.fullmatch(pattern_of(line), actual[i])), None)
        if found is None:
            return line
        at, skipping = found + 1, False
    return None if skipping or at == len(actual) else f"(the end; there is more: {actual[at]!r})"


def mended(expected, actual):
    """The quoted lines with the numbers that were printed now."""
    result, at = [], 0
    for line in expected:
        for i in range(at, len(actual)):
            match = re.fullmatch(pattern_of(line, numbers_free=True), actual[i]) if line.strip() != "..." else None
            if match:
                signs = re.split(rf"(…|(?<![\w.]){NUMBER}| +)", line.rstrip())
                pairs = [*zip(signs, match.groups()), ("", "")]
                line = "".join("…" if sign == "…" else group[:len(sign)] if after == "…" else group  # 0.67… stays as short
                               for (sign, group), (after, _) in zip(pairs, pairs[1:])).rstrip()
                at = i + 1
                break
        result.append(line)
    return result


def png_size(path):
    with open(path, "rb") as file:
        return struct.unpack(">II", file.read(24)[16:])


class Page:
    def __init__(self, path, binaries, folder, update):
        self.path, self.folder, self.update = path, folder, update
        self.binaries = os.pathsep.join(map(os.path.abspath, binaries.split(os.pathsep)))
        self.text, self.messages = read(path), []

    def complain(self, line, message):
        self.messages.append(f"{os.path.basename(self.path)}:{line}: {message}")

    def run(self, block):
        environment = {**os.environ, "PATH": self.binaries + os.pathsep + os.environ["PATH"], "LC_ALL": "C.UTF-8"}
        started = time.monotonic()
        done = subprocess.run(["bash", "-euo", "pipefail", "-c", "\n".join(block.lines)], cwd=self.folder,
                              env=environment, capture_output=True, text=True, check=False)
        print(f"{time.monotonic() - started:6.1f} s  {block.lines[0]}", flush=True)
        if done.returncode != 0:
            self.complain(block.line, f"exit code {done.returncode}\n{done.stdout}{done.stderr}")
        return done.stdout.rstrip("\n").split("\n") if done.stdout.strip() else []

    def compare(self, block, output):
        if self.update:
            old = "\n".join(block.lines)
            self.text = self.text.replace(f"```text\n{old}\n```", "```text\n" + "\n".join(mended(block.lines, output)) + "\n```")
            block.lines = mended(block.lines, output)
        line = disagreement(block.lines, output)
        if line is not None:
            self.complain(block.line, f"quoted but not printed: {line}\nwhat was printed:\n" + "\n".join(output))

    def run_blocks(self, blocks):
        output = []
        for block in blocks:
            if block.info == "sh" and not block.comment.startswith("not run"):
                output = self.run(block)
            elif block.info == "text":
                self.compare(block, output)

    def check_pictures(self):
        for match in re.finditer(r"<!-- from (\S+) -->\s*!\[[^\]]*\]\(([^)]+)\)", self.text):
            line = self.text.count("\n", 0, match.start()) + 1
            made, shown = os.path.join(self.folder, match.group(1)), os.path.join(os.path.dirname(self.path), match.group(2))
            if not os.path.exists(made):
                self.complain(line, f"{match.group(1)} was not made")
            elif self.update:
                shutil.copyfile(made, shown)
            elif not os.path.exists(shown) or png_size(made) != png_size(shown):
                self.complain(line, f"{match.group(2)} is not {match.group(1)}; run docs/make-pictures")

    def check_files(self, prose):
        for number, line in enumerate(prose, 1):
            for name in re.findall(r"`([^`]+)`", re.sub(r"\]\([^)]*\)", "]", line)):
                if FILE_NAME.fullmatch(name) and not any(glob.glob(os.path.join(place, name)) for place in (self.folder, ROOT)):
                    self.complain(number, f"there is no {name}")


def main():
    page = Page(*sys.argv[1:4], sys.argv[4:] == ["--update"])
    shutil.rmtree(page.folder, ignore_errors=True)
    os.makedirs(page.folder)
    os.symlink(os.path.join(ROOT, "examples"), os.path.join(page.folder, "examples"))
    blocks, prose = split(page.text)
    page.run_blocks(blocks)
    page.check_pictures()
    page.check_files(prose)
    if page.update:
        with open(page.path, "w", encoding="utf-8") as file:
            file.write(page.text)
    print("\n".join(page.messages) or f"{os.path.basename(page.path)} is what happens")
    sys.exit(1 if page.messages else 0)


if __name__ == "__main__":
    main()
