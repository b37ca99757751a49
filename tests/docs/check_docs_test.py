# SPDX-License-Identifier: Apache-2.0
# Facewright: multi-resolution 3D morphable face models.
"""check_docs.py sees what is planted, and nothing else."""
import os
import sys
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "tools", "help"))
from check_docs import problems  # noqa: E402
from help_text import parse_help  # noqa: E402

HELP = """Draws faces.
Usage: draw-faces [OPTIONS] model

Positionals:
  model TEXT:FILE REQUIRED        Model (.h5)

Options:
  -h,--help                       Print this help message and exit
  -n,--count INT:INT in [1 - 1000000]=10
                                  Number of faces
  --units TEXT:{mm,cm}=mm         Length unit
  --no-glb{false}                 Write no .glb
  --yaw FLOAT=[0,30] ...          Turns
  --at FLOAT=[] x 2               Place
  --part i/n                      Part


Scans:
  -q,--quiet Excludes: --verbose  Print errors only

Example:
  draw-faces model.h5 -n 10
"""


class HelpText(unittest.TestCase):
    def test_reads_every_kind_of_option(self):
        program = parse_help("draw-faces", HELP)
        self.assertEqual(("Draws faces.", "draw-faces model.h5 -n 10"), (program.description, program.example))
        self.assertTrue(program.positionals[0].required)
        count = program.option("-n")
        self.assertEqual((["-n", "--count"], "INT", "1 .. 1000000", "10", "Number of faces"),
                         (count.names, count.kind, count.range, count.default, count.text))
        self.assertEqual((["mm", "cm"], "mm"), (program.option("--units").choices, program.option("--units").default))
        self.assertFalse(program.option("--no-glb").takes_value)
        self.assertEqual(("...", "[0,30]"), (program.option("--yaw").count, program.option("--yaw").default))
        self.assertEqual("2", program.option("--at").count)
        self.assertEqual(("i/n", ""), (program.option("--part").kind, program.option("--part").default))
        self.assertEqual((["--verbose"], "Scans"), (program.option("-q").excludes, program.option("-q").group))


class CheckDocs(unittest.TestCase):
    def found(self, text, name="page.md"):
        with tempfile.TemporaryDirectory() as root:
            os.makedirs(os.path.join(root, "docs"))
            for name, content in {"CMakePresets.json": '{"configurePresets": [{"name": "release"}]}',
                                  "other.md": "# Here and `there`\n", name: text,
                                  "tools/CMakeLists.txt": ""}.items():
                os.makedirs(os.path.dirname(os.path.join(root, name)), exist_ok=True)
                with open(os.path.join(root, name), "w", encoding="utf-8") as file:
                    file.write(content)
            return list(problems(root, [parse_help("draw-faces", HELP)]))

    def test_finds_nothing_in_a_page_in_order(self):
        self.assertEqual([], self.found("""# A page
[here](other.md#here-and-there), [below](#a-page), [away](https://example.org/nowhere#x), use `--count`
```sh
build/draw-faces model.h5 -n 10 --units=cm \\
  --no-glb -n5   # a comment with --anything
cmake --preset release
```
```python
x = 1
```
```json
{"a": [1]}
```
"""))

    def test_names_a_dead_link_a_missing_heading_and_a_picture(self):
        messages = self.found("[a](gone.md)\n[b](other.md#elsewhere)\n![c](gone.png)\n")
        self.assertEqual(["page.md:1:", "page.md:2:", "page.md:3:"], [m.split(" ")[0] for m in messages])

    def test_names_a_page_that_nothing_leads_to(self):
        self.assertEqual(["docs/lonely.md: no page leads here"], self.found("# Lonely\n", "docs/lonely.md"))

    def test_names_an_option_that_no_program_has(self):
        self.assertEqual(["page.md:2: no program has an option --cuont"], self.found("\nGive `--cuont 3`.\n"))

    def test_names_wrong_options_values_scripts_and_presets_in_commands(self):
        messages = self.found("```sh\ndraw-faces m --model x\ndraw-faces m --units inch\n\npipelines/gone\n"
                              "cmake --preset none\n```\n")
        self.assertEqual(["page.md:2: draw-faces has no option --model",
                          "page.md:3: draw-faces --units does not take 'inch'", "page.md:5: there is no pipelines/gone",
                          "page.md:6: there is no preset none"], messages)

    def test_names_code_that_does_not_parse_or_is_built_nowhere(self):
        messages = self.found("```python\nx = (\n```\n```cpp\nint x;\n```\n```toml\na = \n```\n")
        self.assertEqual(3, len(messages), messages)


if __name__ == "__main__":
    unittest.main()
