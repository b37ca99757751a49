# SPDX-License-Identifier: Apache-2.0
# Facewright: multi-resolution 3D morphable face models.
"""One flat namespace: no two headers may define a type of the same name (two definitions in one program are undefined
behaviour even when no file includes both).

usage: check_names.py SOURCE_DIR
"""
import os
import re
import sys

from check_files import source_files

# Definitions at namespace scope start at the margin; members are indented.
TYPE = re.compile(r"^(?:template <[^>]*>\s*)?(?:struct|class|enum class|enum)\s+(\w+)\s*(?:final)?\s*(?::[^;{]*)?\{", re.M)
ALIAS = re.compile(r"^using\s+(\w+)\s*=", re.M)


def problems(root):
    places = {}
    for path in source_files(root):
        if not path.endswith(".h"):
            continue
        with open(os.path.join(root, path), encoding="utf-8") as file:
            text = file.read()
        for match in [*TYPE.finditer(text), *ALIAS.finditer(text)]:
            line = text.count("\n", 0, match.start(1)) + 1
            places.setdefault(match.group(1), []).append(f"{path}:{line}")
    return [f"{name} is defined at {' and '.join(found)}" for name, found in sorted(places.items()) if len(found) > 1]


if __name__ == "__main__":
    messages = problems(sys.argv[1])
    print("\n".join(messages) or "every type has a name of its own")
    sys.exit(1 if messages else 0)
