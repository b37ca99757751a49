# SPDX-License-Identifier: Apache-2.0
# Facewright: multi-resolution 3D morphable face models.
"""Plants violations in a small tree: the layer checker must name each of them and nothing else."""
import os
import tempfile
import unittest

import check_layers


def plant(files):
    folder = tempfile.TemporaryDirectory()
    for path, text in files.items():
        full = os.path.join(folder.name, path)
        os.makedirs(os.path.dirname(full), exist_ok=True)
        with open(full, "w", encoding="utf-8") as out:
            out.write(text)
    return folder


class LayerChecker(unittest.TestCase):
    def found(self, files):
        with plant(files) as folder:
            return check_layers.problems(folder)

    def test_accepts_what_the_table_allows(self):
        self.assertEqual([], self.found({
            "libmodel/core/CMakeLists.txt": "facewright_module(core HEADERS mesh.h SOURCES mesh.cpp)",
            "libmodel/core/mesh.h": "#include <Eigen/Core>\n#include <vector>\n",
            "libmodel/surface/nearest.cpp": '#include <CGAL/AABB_tree.h>\n#include "libmodel/core/mesh.h"\n',
            "pipelines/recipe.cpp": '#include "libregister/registration/register_scan.h"\n'}))

    def test_names_a_forbidden_module_with_its_line(self):
        messages = self.found({"libregister/registration/a.cpp": '#include <map>\n\n#include "libmodel/building/pca.h"\n'})
        self.assertEqual(1, len(messages))
        self.assertTrue(messages[0].startswith("libregister/registration/a.cpp:3:"), messages)

    def test_refuses_a_library_in_a_public_header(self):
        messages = self.found({"libmodel/surface/CMakeLists.txt": "facewright_module(surface HEADERS a.h SOURCES a.cpp)",
                               "libmodel/surface/a.h": "#include <CGAL/Surface_mesh.h>\n"})
        self.assertEqual(1, len(messages))

    def test_refuses_heavy_libraries_in_the_fitting_part(self):
        self.assertEqual(1, len(self.found({"libmodel/fitting/a.cpp": "#include <CGAL/AABB_tree.h>\n"})))

    def test_refuses_tools_and_relative_includes_in_libraries(self):
        self.assertEqual(2, len(self.found({"libmodel/io/a.cpp": '#include "tools/cli.h"\n#include "b.h"\n'})))


if __name__ == "__main__":
    unittest.main()
