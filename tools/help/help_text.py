# SPDX-License-Identifier: Apache-2.0
# Facewright: multi-resolution 3D morphable face models.
"""Reads what a program prints for --help: the one source of the option pages, the manual pages and shell completion."""
import os
import re
import subprocess
from dataclasses import dataclass, field

COLUMN = 34  # where descriptions begin, as tools/cli.cpp sets it


@dataclass
class Option:
    """An option, or a positional argument, whose only name is then its own without dashes."""
    names: list  # ["-o", "--output"]
    group: str  # "Options", or what the program calls the group
    kind: str = ""  # TEXT, INT, UINT, FLOAT, ENUM, or the form a value has, such as i/n; empty for a flag
    check: str = ""  # FILE, DIR, PATH(existing), NONNEGATIVE, POSITIVE, or empty
    choices: list = field(default_factory=list)
    range: str = ""  # "0 .. 1"
    default: str = ""
    count: str = ""  # "..." for any number of values, "2" for so many
    required: bool = False
    excludes: list = field(default_factory=list)
    text: str = ""

    @property
    def takes_value(self):
        return bool(self.kind)

    @property
    def long_name(self):
        return self.names[-1]


@dataclass
class Program:
    name: str
    description: str
    usage: str
    example: str
    positionals: list
    options: list

    def option(self, name):
        return next((o for o in self.options if name in o.names), None)


def parse_option(name_part, text, group):
    head, _, rest = name_part.strip().partition(" ")
    names = [re.sub(r"\{[^}]*\}$", "", name) for name in head.split(",")]
    option = Option(names, group, text=text)
    excludes = re.search(r"Excludes: ((?:--?[\w-]+ ?)+)", rest)
    if excludes:
        option.excludes = excludes.group(1).split()
        rest = rest.replace(excludes.group(0), "")
    option.required = "REQUIRED" in rest
    rest = rest.replace("REQUIRED", "").strip()
    if rest.endswith("..."):
        option.count, rest = "...", rest[:-3].strip()
    fixed = re.search(r" x (\d+)$", rest)
    if fixed:
        option.count, rest = fixed.group(1), rest[:fixed.start()]
    kind, colon, check = re.match(r"([^\s:=]*)(:?)(.*)$", rest).groups()
    option.kind = kind
    if not colon:
        check, option.default = "", check.removeprefix("=")
        return option
    match = re.match(r"(\{[^}]*\}|[A-Z]+ in \[[^\]]*\]|[A-Z]+(?:\([a-z]+\))?)(?:=(.*))?$", check)
    if not match:
        raise ValueError(f"cannot read the option {name_part!r}")
    check, option.default = match.group(1), match.group(2) or ""
    if check.startswith("{"):
        option.choices = check.strip("{}").split(",")
    elif " in [" in check:
        option.range = re.search(r"\[(.*)\]", check).group(1).replace(" - ", " .. ")
    else:
        option.check = check
    return option


def parse_help(name, text):
    body, _, footer = text.partition("\nExample:\n")
    lines = body.split("\n")
    usage_line = next(i for i, line in enumerate(lines) if line.startswith("Usage: "))
    description = " ".join(lines[:usage_line]).strip()
    positionals, options = [], []
    group, i = "", usage_line + 1
    while i < len(lines):
        line = lines[i]
        i += 1
        if not line.strip():
            continue
        if not line.startswith(" "):
            group = line.rstrip().rstrip(":")
            continue
        if i < len(lines) and lines[i].startswith(" " * COLUMN):  # too long for its column: described on the next line
            name_part, words = line, lines[i][COLUMN:]
            i += 1
        else:
            name_part, words = line[:COLUMN], line[COLUMN:]
        option = parse_option(name_part, words.strip(), group)
        (positionals if group == "Positionals" else options).append(option)
    return Program(name, description, lines[usage_line].removeprefix("Usage: "), footer.strip(), positionals, options)


def read_program(path):
    """The program at this path, asked for its --help."""
    environment = {**os.environ, "COLUMNS": "200"}
    text = subprocess.run([path, "--help"], capture_output=True, text=True, check=True, env=environment).stdout
    return parse_help(os.path.basename(path), text)


def program_names(root=os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))):
    """The installed programs, by name: those that tools/CMakeLists.txt declares."""
    with open(os.path.join(root, "tools", "CMakeLists.txt"), encoding="utf-8") as file:
        return sorted(re.findall(r"facewright_tool\(([a-z][\w-]*)", file.read()))


def read_programs(folder):
    """The installed programs in `folder`, by name; those that a smaller build lacks are left out."""
    paths = [os.path.join(folder, name) for name in program_names()]
    programs = [read_program(path) for path in paths if os.path.exists(path)]
    if not programs:
        raise FileNotFoundError(f"{folder}: none of the programs is there; build them first")
    return programs
