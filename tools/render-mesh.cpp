// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <cmath>
#include <numbers>
#include <vector>

#include "libmodel/core/errors.h"
#include "libmodel/io/image_files.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/io/mesh_files.h"
#include "libmodel/render/framing.h"
#include "libmodel/render/overlays.h"
#include "libmodel/render/render_mesh.h"
#include "tools/cli.h"
using namespace facewright;

namespace {

struct Settings {
  std::vector<std::string> meshes;
  std::vector<double> yaws = {0};
  double pitch = 0;
  int size = 480;
  std::string texture, landmarks, write_landmarks;
  bool grey = false;
};

ImageLandmarks project(const Landmarks& marks, const OrthographicCamera& camera) {
  ImageLandmarks out;
  for (const auto& [name, mark] : marks) out[name].position = camera.affine().project(mark.position);
  return out;
}

/// Points that a .pts file can hold: the numbered ones.
ImageLandmarks numbered(const ImageLandmarks& marks) {
  ImageLandmarks out;
  for (const auto& [name, mark] : marks)
    if (name.find_first_not_of("0123456789") == name.npos) out.emplace(name, mark);
  return out;
}

Image load_texture(const Settings& settings, const std::string& mesh) {
  if (settings.grey) return {};
  if (!settings.texture.empty()) return read_image(settings.texture);
  const auto found = texture_file(mesh);
  return found ? read_image(*found) : Image();
}

void save_projected(const Settings& settings, const CommonOptions& common, const ImageLandmarks& marks) {
  const bool pts = std::filesystem::path(settings.write_landmarks).extension() == ".pts";
  const ImageLandmarks kept = pts ? numbered(marks) : marks;
  write_image_landmarks(settings.write_landmarks, kept);
  report(common, "render-mesh: wrote " + settings.write_landmarks + " (" + std::to_string(kept.size()) + " landmarks" +
                     (kept.size() < marks.size() ? ", " + std::to_string(marks.size() - kept.size()) +
                                                       " named ones left out: .pts has no names"
                                                 : "") +
                     ")");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Pictures of meshes: one, or a contact sheet over meshes (rows) and yaw angles (columns).",
               "render-mesh");
  CommonOptions common;
  add_common_options(app, common, CommonFlags::output | CommonFlags::jobs,
                     "render-mesh mean.ply scan.obj --yaw 0,30,60 --size 400 -o sheet.png");
  Settings settings;
  app.add_option("meshes", settings.meshes, "Meshes (.ply, .obj)")->required()->check(CLI::ExistingFile);
  app.add_option("--yaw", settings.yaws, "Head turns in degrees, > 0: the subject's left")->delimiter(',');
  app.add_option("--pitch", settings.pitch, "Head nod in degrees, > 0: down");
  app.add_option("--size", settings.size, "Width and height of each picture, pixels")->check(CLI::Range(16, 4096));
  app.add_option("--texture", settings.texture, "Texture image (default: the one the mesh file names)");
  app.add_flag("--grey", settings.grey, "Clay instead of colours and textures");
  app.add_option("--landmarks", settings.landmarks, "3D landmarks of the mesh, drawn as crosses");
  app.add_option("--write-landmarks", settings.write_landmarks,
                 "Save the projected landmarks (.pts, .json) instead of drawing them; one mesh, one yaw");
  return run_program(argc, argv, app, common, [&] {
    if (!settings.write_landmarks.empty() &&
        (settings.meshes.size() * settings.yaws.size() != 1 || settings.landmarks.empty()))
      throw InvalidInput("--write-landmarks needs --landmarks, one mesh and one yaw");
    constexpr double radians = std::numbers::pi / 180;
    const Landmarks marks = settings.landmarks.empty() ? Landmarks() : read_landmarks(settings.landmarks);
    RenderOptions options;
    options.width = options.height = settings.size;
    options.use_colours = !settings.grey;
    options.threads = common.jobs;
    std::vector<Image> pictures;
    for (const std::string& path : settings.meshes) {
      const Mesh mesh = read_mesh(path);
      const Image texture = load_texture(settings, path);
      for (const double yaw : settings.yaws) {
        const auto camera = frame_camera(mesh.V, settings.size, settings.size, yaw * radians, settings.pitch * radians);
        pictures.push_back(render_mesh(mesh, camera, options, texture));
        const ImageLandmarks projected = project(marks, camera);
        if (!settings.write_landmarks.empty())
          save_projected(settings, common, projected);
        else
          draw_landmarks(pictures.back(), projected, std::max(2.0, settings.size / 100.0), {220, 20, 40});
      }
    }
    const Image sheet = contact_sheet(pictures, static_cast<int>(settings.yaws.size()));
    write_png(common.output, sheet);
    report(common, "render-mesh: wrote " + common.output.string());
    return ExitCode::ok;
  });
}
