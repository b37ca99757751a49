# SPDX-License-Identifier: Apache-2.0
# Facewright: multi-resolution 3D morphable face models.
"""The completion and manual pages that the build wrote do what they should, asked from the shells themselves.

usage: completion_test.py BIN_DIR HELP_FILES
"""
import os
import shutil
import subprocess
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "tools", "help"))
from help_text import read_programs  # noqa: E402

COMPLETE = """source "$1"; function=$(complete -p "$2" | sed 's/.*-F \\([^ ]*\\).*/\\1/'); shift
COMP_WORDS=("$@"); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); "$function"; printf '%s\\n' "${COMPREPLY[@]}" """


def path(*parts):
    return os.path.join(HELP_FILES, *parts)


def run(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def bash_offers(program, *words):
    return run("bash", "-c", COMPLETE, "bash", path("bash", program), program, *words).split()


class Completion(unittest.TestCase):
    def test_bash_offers_every_option_of_every_program(self):
        for program in read_programs(BIN_DIR):
            names = {name for option in program.options for name in option.names}
            self.assertEqual(names, set(bash_offers(program.name, "-")), program.name)

    def test_bash_completes_options_and_their_values(self):
        self.assertEqual(["--denoise"], bash_offers("build-model", "scans", "--den"))
        self.assertEqual(["bilateral"], bash_offers("build-model", "scans", "--denoise", "b"))
        self.assertEqual(["median"], bash_offers("build-model", "--denoise", "=", "m"))
        self.assertEqual(["exclude", "slide", "fixed", "contour"], bash_offers("fit-model", "--jaw", "="))
        self.assertEqual([], bash_offers("build-model", "--jobs", ""))
        self.assertEqual([], bash_offers("build-model", ""))  # left to the completion of file names

    def test_fish_completes_options_and_their_values(self):
        if not shutil.which("fish"):
            self.skipTest("fish is not installed")
        def offers(line):
            answer = run("fish", "--no-config", "-c", f"source '{path('fish', 'build-model.fish')}'; complete -C '{line}'")
            return [entry.split("\t")[0] for entry in answer.split("\n") if entry]
        self.assertEqual(["--denoise"], offers("build-model --den"))
        self.assertEqual(["bilateral"], offers("build-model --denoise b"))

    def test_zsh_accepts_its_files(self):
        if not shutil.which("zsh"):
            self.skipTest("zsh is not installed")
        for program in read_programs(BIN_DIR):
            run("zsh", "-n", path("zsh", "_" + program.name))

    def test_every_manual_page_has_every_option_and_no_mistakes(self):
        for program in read_programs(BIN_DIR):
            page = path("man", program.name + ".1")
            with open(page, encoding="utf-8") as file:
                text = file.read().replace("\\-", "-")
            for option in program.options:
                self.assertIn(f"\\fB{option.long_name}\\fR", text, program.name)
            if shutil.which("groff"):
                answer = subprocess.run(["groff", "-man", "-ww", "-Tascii", page], capture_output=True, text=True)
                self.assertEqual("", answer.stderr)


if __name__ == "__main__":
    BIN_DIR, HELP_FILES = sys.argv[1:3]
    unittest.main(argv=sys.argv[:1])
