# SPDX-License-Identifier: Apache-2.0
# Facewright: multi-resolution 3D morphable face models.
"""Every source file opens with its licence, headers are guarded, and no file outgrows 600 lines.

usage: check_files.py SOURCE_DIR
"""
import os
import sys

FOLDERS = ["libmodel", "libregister", "pipelines", "tools", "tests", "docs", "examples", "cmake", ".ci"]
MAX_LINES = 600
SOURCES = (".h", ".cpp", ".py", ".cmake", ".md", "CMakeLists.txt")
DATA = ("_data.cpp", "_data.h", ".inc", ".bib")  # tables of numbers may be long


def source_files(root):
    yield from (name for name in os.listdir(root) if name.endswith(SOURCES))
    for folder in FOLDERS:
        for place, folders, files in os.walk(os.path.join(root, folder)):
            folders[:] = sorted(name for name in folders if name != "__pycache__")
            for name in sorted(files):
                yield os.path.relpath(os.path.join(place, name), root)


def check(root, path):
    with open(os.path.join(root, path), encoding="utf-8", errors="replace") as file:
        lines = file.read().split("\n")
    if path.endswith(SOURCES) and not path.endswith(DATA) and len(lines) > MAX_LINES:
        yield f"{path}: {len(lines)} lines, more than {MAX_LINES}; split it by purpose"
    if path.endswith((".h", ".cpp")):
        if lines[0] != "// SPDX-License-Identifier: Apache-2.0":
            yield f"{path}:1: expected // SPDX-License-Identifier: Apache-2.0"
        if not lines[1].startswith("// Facewright: "):
            yield f"{path}:2: expected // Facewright: ..."
    if path.endswith(".h") and "#pragma once" not in lines[:4]:
        yield f"{path}:3: expected #pragma once"
    if path.endswith(".py") and "SPDX-License-Identifier: Apache-2.0" not in "\n".join(lines[:2]):
        yield f"{path}:1: expected # SPDX-License-Identifier: Apache-2.0"


if __name__ == "__main__":
    messages = [m for path in source_files(sys.argv[1]) if path.endswith(SOURCES) for m in check(sys.argv[1], path)]
    print("\n".join(messages) or "all files are in order")
    sys.exit(1 if messages else 0)
