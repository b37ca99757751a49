# SPDX-License-Identifier: Apache-2.0
# Facewright: multi-resolution 3D morphable face models.
"""What the pages say of files, programs and options is so: links, anchors and pictures lead somewhere, and every page and
picture of docs/ is led to; commands in code blocks name programs that exist and options that these have, with values they
take; every option named in the text is some program's; Python blocks parse, C++ blocks are parts of programs that the
tests build.

usage: check_docs.py SOURCE_DIR BIN_DIR
"""
import ast
import glob
import json
import os
import re
import shlex
import sys
import tomllib

from markdown import anchors, links, markdown_files, read, split

FLAG = re.compile(r"(?<![\w/-])--[a-z][a-z0-9_-]*")
# Options of programs that are not ours.
FOREIGN = set("""--preset --build --install --prefix --target --test-dir --output-on-failure --gtest_filter --repeat
--call-graph --benchmark_filter --benchmark_min_time --benchmark_repetitions --extra-arg --headless --list --user --recursive --force --depth""".split())


def problems_of_orphans(root):
    """Pages and pictures of docs/ that no page leads to."""
    linked = set()
    for path in markdown_files(root):
        for _, target in links(split(read(os.path.join(root, path)))[1]):
            linked.add(os.path.normpath(os.path.join(os.path.dirname(path), target.partition("#")[0])))
    for file in sorted(glob.glob(f"{root}/docs/**/*.md", recursive=True) + glob.glob(f"{root}/docs/images/*")):
        if os.path.relpath(file, root) not in linked:
            yield f"{os.path.relpath(file, root)}: no page leads here"


def scripts(root):
    """Programs of ours that are not built, or not installed: scripts, benchmarks, the maker of the built-in face."""
    for folder in ("pipelines", "docs", "tests", "tools"):
        for path in glob.glob(f"{root}/{folder}/**/*", recursive=True):
            named_like_a_program = "." not in os.path.basename(path) or "make-default-reference" in path
            if os.path.isfile(path) and "/tests/fuzz/" not in path and (named_like_a_program or "/benchmarks/" in path):
                yield path
    if os.path.exists(f"{root}/tests/fuzz/run"):  # the rest of that folder is damaged on purpose
        yield f"{root}/tests/fuzz/run"


def known_flags(root, programs):
    """Options of our programs, and of the scripts beside them."""
    flags = {name for program in programs for option in program.options for name in option.names}
    for path in scripts(root):
        flags |= set(re.findall(r"--[a-z][a-z0-9-]*", read(path)))
    return flags | FOREIGN


def problems_of_links(root, path, prose):
    for number, target in links(prose):
        if re.match(r"[a-z]+:", target):
            continue
        place, _, anchor = target.partition("#")
        file = os.path.normpath(os.path.join(root, os.path.dirname(path), place)) if place else os.path.join(root, path)
        if not os.path.exists(file):
            yield f"{path}:{number}: link to {target} leads nowhere"
        elif anchor and file.endswith(".md") and anchor not in anchors(read(file)):
            yield f"{path}:{number}: {place or 'this page'} has no heading #{anchor}"


def problems_of_words(program, words):
    """Options of one of our programs that it does not have, and values that they do not take."""
    for i, word in enumerate(words):
        if not re.match(r"--?[a-zA-Z]", word):
            continue
        name, equals, value = word.partition("=")
        option = program.option(name)
        if option is None and re.match(r"-[a-z].", word) and not word.startswith("--"):
            option, equals, value = program.option(word[:2]), "=", word[2:]  # -j2
        if option is None:
            yield f"{program.name} has no option {name}"
            continue
        if not equals and i + 1 < len(words):
            value = words[i + 1]
        values = value.split(",") if option.count else [value]
        if option.choices and not set(values) <= set(option.choices) and not re.search(r"[$|A-Z]", value):
            yield f"{program.name} {name} does not take {value!r}"


def commands(lines):
    """(index of the first line, words) of each command: continued lines joined, comments and what follows a pipe cut."""
    joined, first = "", 0
    for i, line in enumerate(lines):
        first = i if not joined else first
        joined += line.rstrip("\\") if line.endswith("\\") else line
        if line.endswith("\\"):
            continue
        text, joined = joined, ""
        try:
            words = shlex.split(text.strip().removeprefix("$ "), comments=True)
        except ValueError:  # a sentence with an apostrophe is no command
            continue
        part = []
        for word in [*words, ";"]:
            if word in ("|", ";", "&&", "||", ">", ">>", "2>", "do", "then"):
                if part:
                    yield first, part
                part = []
                continue
            if word.endswith(";"):
                yield first, [*part, word[:-1]]
                part = []
                continue
            if part or not re.match(r"\w+=", word):  # settings of the environment come first
                part.append(word)


def problems_of_commands(root, path, block, programs):
    by_name = {program.name: program for program in programs}
    presets = {p["name"] for p in json.loads(read(os.path.join(root, "CMakePresets.json")))["configurePresets"]}
    for index, words in commands(block.lines):
        where = f"{path}:{block.line + index}"
        name = os.path.basename(words[0])
        if name in by_name:
            for problem in problems_of_words(by_name[name], words[1:]):
                yield f"{where}: {problem}"
        elif re.match(r"(\./)?(pipelines|docs|examples|tests)/", words[0]):
            if not os.path.exists(os.path.join(root, words[0])):
                yield f"{where}: there is no {words[0]}"
        elif name in ("cmake", "ctest") and "--preset" in words and words[words.index("--preset") + 1] not in presets:
            yield f"{where}: there is no preset {words[words.index('--preset') + 1]}"


def built_sources(root):
    paths = glob.glob(f"{root}/examples/**/*.cpp", recursive=True) + glob.glob(f"{root}/docs/example_fit/*.cpp")
    return [read(path) for path in paths]


def problems_of_block(root, path, block, programs):
    text = "\n".join(block.lines)
    if block.info in ("", "sh"):
        yield from problems_of_commands(root, path, block, programs)
    elif block.info == "python":
        try:
            ast.parse(text)
        except SyntaxError as error:
            yield f"{path}:{block.line + (error.lineno or 1) - 1}: {error.msg}"
    elif block.info in ("json", "toml"):
        try:
            (json if block.info == "json" else tomllib).loads(text)
        except ValueError as error:
            yield f"{path}:{block.line}: {error}"
    elif block.info == "cpp" and not any(text in source for source in built_sources(root)):
        yield f"{path}:{block.line}: this C++ is no part of a program in examples/ or docs/example_fit"


def problems(root, programs):
    yield from problems_of_orphans(root)
    flags = known_flags(root, programs)
    for path in markdown_files(root):
        blocks, prose = split(read(os.path.join(root, path)))
        yield from problems_of_links(root, path, prose)
        for block in blocks:
            yield from problems_of_block(root, path, block, programs)
        for number, line in enumerate(prose, 1):
            for flag in FLAG.findall(line):
                if flag not in flags:
                    yield f"{path}:{number}: no program has an option {flag}"


if __name__ == "__main__":
    sys.path.insert(0, os.path.join(sys.argv[1], "tools", "help"))
    from help_text import read_programs

    messages = list(problems(sys.argv[1], read_programs(sys.argv[2])))
    print("\n".join(messages) or "links, commands and options of the documentation are in order")
    sys.exit(1 if messages else 0)
