// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include <cstdio>
#include <set>

#include "libmodel/core/errors.h"
#include "libmodel/io/image_files.h"
#include "libmodel/model/model_file.h"
#include "pipelines/model_pictures.h"
#include "tools/cli.h"
using namespace facewright;

namespace {

struct Settings {
  std::string model;
  std::vector<std::string> show;
  int level = -1, modes = 5, samples = 12, frames = 36, size = 240;
  double mode_sigma = 3, sample_sigma = 0.75, range_mm = 0;
  std::vector<double> yaws = {0, 35, 80};
};

const std::set<std::string> kPictures = {"mean",    "shape-modes", "colour-modes", "expression-modes", "deviation",
                                         "samples", "levels",      "texture-map",  "turntable"};

std::string frame_name(int i) {
  char name[32];
  std::snprintf(name, sizeof name, "%04d.png", i);
  return name;
}

/// All pictures that the model has.
std::vector<std::string> all_pictures(const MorphableModel& model) {
  std::vector<std::string> list = {"mean"};
  if (model.shape().mode_count() > 0) list.insert(list.end(), {"shape-modes", "deviation"});
  if (model.colour().mode_count() > 0) list.push_back("colour-modes");
  if (model.expression() && model.expression()->mode_count() > 0) list.push_back("expression-modes");
  list.insert(list.end(), {"samples", "levels"});
  if (model.uv().rows() > 0) list.push_back("texture-map");
  list.push_back("turntable");
  return list;
}

void write_turntable(const Mesh& mesh, const Settings& s, const CommonOptions& common,
                     const ModelPictureOptions& options) {
  const std::vector<Image> frames = turntable(mesh, s.frames, options);
  for (size_t i = 0; i < frames.size(); ++i)
    write_png(common.output / "turntable" / frame_name(static_cast<int>(i)), frames[i]);
}

Image picture(const std::string& name, const MorphableModel& model, const Settings& s, const CommonOptions& common,
              const ModelPictureOptions& options) {
  if (name == "mean") return mean_picture(model, options);
  if (name == "deviation") return deviation_picture(model, s.range_mm, options);
  if (name == "samples") return sample_picture(model, s.samples, s.sample_sigma, common.seed, options);
  if (name == "levels") return level_picture(model, options);
  if (name == "texture-map") return texture_map_picture(model, options);
  ModePictureOptions modes;
  modes.faces = options;
  modes.modes = s.modes;
  modes.sigma = s.mode_sigma;
  modes.family = name == "shape-modes"    ? ModeFamily::shape
                 : name == "colour-modes" ? ModeFamily::colour
                                          : ModeFamily::expression;
  return mode_picture(model, modes);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Pictures of a model: mean, modes, random faces, levels, texture map, a turn of the mean.",
               "render-model");
  CommonOptions common;
  add_common_options(app, common, CommonFlags::output | CommonFlags::jobs | CommonFlags::seed,
                     "render-model model.h5 --show mean,shape-modes --modes 8 -o pictures");
  Settings s;
  app.add_option("model", s.model, "Model (.h5)")->required()->check(CLI::ExistingFile);
  app.add_option("--show", s.show, "Only these pictures (default: all that the model has)")
      ->delimiter(',')
      ->check(CLI::IsMember(kPictures));
  app.add_option("--level", s.level, "Vertex count of the level, or its index from 0, the coarsest; -1 = finest");
  app.add_option("--size", s.size, "Width and height of each face, pixels")->check(CLI::Range(32, 2048));
  app.add_option("--yaw", s.yaws, "Views of mean, modes and deviation, degrees, > 0: the subject's left")
      ->delimiter(',');
  app.add_option("--modes", s.modes, "Modes on a sheet")->check(CLI::Range(1, 1000));
  app.add_option("--mode-sigma", s.mode_sigma, "Standard deviations to either side on the sheets of modes")
      ->check(CLI::Range(0.01, 100.0));
  app.add_option("--samples", s.samples, "Random faces")->check(CLI::Range(1, 1000));
  app.add_option("--sample-sigma", s.sample_sigma, "Standard deviation of the random faces' coefficients")
      ->check(CLI::Range(0.0, 10.0));
  app.add_option("--range", s.range_mm, "Deviation at which the colours end, mm; 0 = the largest there is")
      ->check(CLI::Range(0.0, 1000.0));
  app.add_option("--frames", s.frames, "Pictures of the turntable (folder turntable)")->check(CLI::Range(1, 10000));
  return run_program(argc, argv, app, common, [&] {
    try_model_file(s.model);
    const MorphableModel model = load_model(s.model);
    const int level = s.level < model.level_count() ? s.level : model.level_with(s.level);
    const ModelPictureOptions options{level, s.size, s.yaws, common.jobs};
    const std::vector<std::string> names = s.show.empty() ? all_pictures(model) : s.show;
    ProgressBar bar(common);
    int done = 0;
    for (const std::string& name : names) {
      if (name == "turntable")
        write_turntable(model.mean(level), s, common, options);
      else
        write_png(common.output / (name + ".png"), picture(name, model, s, common, options));
      bar.update({"rendering", ++done, static_cast<int>(names.size()), name});
    }
    report(common, "render-model: wrote " + std::to_string(names.size()) + " pictures to " + common.output.string());
    return ExitCode::ok;
  });
}
