// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/landmark_record.h"

#include <nlohmann/json.hpp>

#include "libmodel/io/atomic_file.h"
#include "libmodel/io/landmark_files.h"
#include "libmodel/io/sha256.h"
#include "pipelines/json_text.h"

namespace facewright {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

// ID.found, of ID.json as of ID.mrk.json.
fs::path record_file(const fs::path& landmarks) {
  std::string name = landmarks.filename().string();
  for (const char* extension : {".mrk.json", ".json", ".fcsv", ".csv", ".ljson", ".tlms", ".pts", ".pp", ".lm3"})
    if (name.ends_with(extension)) {
      name.resize(name.size() - std::string(extension).size());
      break;
    }
  return landmarks.parent_path() / (name + ".found");
}

void write_record(const fs::path& landmarks, const Json& record) {
  write_file(record_file(landmarks), json_text(record, 1) + "\n");
}

}  // namespace

std::optional<LandmarkRecord> landmark_record(const fs::path& landmarks) {
  const fs::path file = record_file(landmarks);
  if (!fs::exists(file)) return std::nullopt;
  const Json record = Json::parse(read_file(file), nullptr, false);
  if (!record.is_object()) return std::nullopt;
  const auto text = [&](const char* name) {
    const auto at = record.find(name);
    return at != record.end() && at->is_string() ? at->get<std::string>() : std::string();
  };
  return LandmarkRecord{text("key"), text("sha256"), text("reason")};
}

bool is_by_hand(const fs::path& landmarks) {
  if (!fs::exists(landmarks)) return false;
  const auto record = landmark_record(landmarks);
  return !record || record->sha256 != sha256(read_file(landmarks));
}

void write_found_landmarks(const fs::path& file, const Landmarks& landmarks, const std::string& key) {
  const fs::path draft = file.parent_path() / (".found_" + file.filename().string());
  write_landmarks(draft, landmarks);
  std::error_code ignored;
  fs::remove(file, ignored);  // else it would not be what the record says
  write_record(file, {{"key", key}, {"sha256", sha256(read_file(draft))}});
  fs::rename(draft, file);
}

void write_search_in_vain(const fs::path& file, const std::string& reason, const std::string& key) {
  std::error_code ignored;
  fs::remove(file, ignored);
  write_record(file, {{"key", key}, {"reason", reason}});
}

}  // namespace facewright
