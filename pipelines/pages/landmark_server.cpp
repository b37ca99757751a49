// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
#include "pipelines/pages/landmark_server.h"

#include <httplib.h>

#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>

#include "libmodel/core/errors.h"
#include "libmodel/io/image_files.h"
#include "libmodel/io/landmark_files.h"
#include "pipelines/pages/assets.h"
#include "pipelines/pages/scan_bytes.h"

namespace facewright {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr size_t kMostBytes = 1 << 20;  // of a request: a thousand landmarks need a tenth

std::string secret() {
  std::random_device device;
  std::string text;
  for (int i = 0; i < 32; ++i) text += "0123456789abcdef"[device() % 16];
  return text;
}

const char* mime_type(const std::string& name) {
  if (name.ends_with(".html")) return "text/html; charset=utf-8";
  return name.ends_with(".css") ? "text/css; charset=utf-8" : "text/javascript; charset=utf-8";
}

json positions_of(const Landmarks& landmarks) {
  json all = json::object();
  for (const auto& [name, mark] : landmarks) all[name] = {mark.position[0], mark.position[1], mark.position[2]};
  return all;
}

// Those not moved keep their standard deviations.
Landmarks placed(const json& positions, const Landmarks& before) {
  Landmarks marks;
  for (const auto& [name, x] : positions.items()) {
    LandmarkPoint<3> mark;
    for (int k = 0; k < 3; ++k) mark.position[k] = x.at(static_cast<size_t>(k)).get<double>();
    if (name.empty() || x.size() != 3 || !mark.position.allFinite())
      throw InvalidInput("landmark '" + name + "' is no point of three numbers");
    const auto old = before.find(name);
    if (old != before.end() && old->second.position == mark.position) mark.stddev = old->second.stddev;
    marks[name] = mark;
  }
  return marks;
}

}  // namespace

struct LandmarkServer::Impl {
  std::vector<ScanFiles> scans;
  LandmarkServerOptions options;
  std::string token = secret(), address, host, localhost;
  httplib::Server http;
  std::mutex mutex;  // of what follows, and of the landmark files
  struct Loaded {
    size_t scan = 0;
    ScanBytes mesh;
    std::string texture;  // a PNG file
    std::vector<std::string> warnings;
  };
  std::optional<Loaded> loaded;

  // The file that is written.
  fs::path target(size_t i) const {
    if (!options.output.empty()) return options.output / (scans[i].id + ".json");
    return fs::path(scans[i].mesh).replace_extension(".json");
  }
  // What stands: the file written before, else the one found beside the scan.
  Landmarks landmarks(size_t i) const {
    if (fs::exists(target(i))) return read_landmarks(target(i));
    return scans[i].landmarks ? read_landmarks(*scans[i].landmarks) : Landmarks{};
  }
  const Loaded& scan(size_t i) {
    if (loaded && loaded->scan == i) return *loaded;
    loaded.reset();
    ScanFiles files;
    files.mesh = scans[i].mesh;
    files.units = Units::mm;  // whatever they are: places stay in the file's
    const Scan read = load_scan(files);
    return loaded.emplace(
        Loaded{i, scan_bytes(read.mesh), read.texture.empty() ? "" : png_bytes(read.texture), read.warnings});
  }

  json list() const {
    json all = json::array();
    for (size_t i = 0; i < scans.size(); ++i) {
      json entry = {{"id", scans[i].id}, {"file", scans[i].mesh.filename().string()}};
      try {
        entry["landmarks"] = landmarks(i).size();
      } catch (const IoError& error) {
        entry["error"] = error.what();
      }
      all.push_back(std::move(entry));
    }
    return all;
  }
  json describe(size_t i) {
    const Loaded& s = scan(i);
    return {{"id", scans[i].id},
            {"vertices", s.mesh.vertices},
            {"triangles", s.mesh.triangles},
            {"colours", s.mesh.has_colours},
            {"uv", s.mesh.has_uv},
            {"texture", !s.texture.empty()},
            {"centre", {s.mesh.centre[0], s.mesh.centre[1], s.mesh.centre[2]}},
            {"warnings", s.warnings},
            {"saved_as", target(i).filename().string()},
            {"landmarks", positions_of(landmarks(i))}};
  }
  void save(size_t i, const std::string& body) {
    const json positions = json::parse(body, nullptr, false);
    if (!positions.is_object()) throw InvalidInput("expected an object of landmarks");
    const Landmarks marks = placed(positions, landmarks(i));
    write_landmarks(target(i), marks);
    if (options.saved)
      options.saved(scans[i].id + ": " + std::to_string(marks.size()) + " landmarks in " + target(i).string());
  }

  using Handler = std::function<void(size_t scan, const httplib::Request&, httplib::Response&)>;
  // Requests for a scan by its number, which may fail with one of our errors.
  httplib::Server::Handler of_scan(Handler handler) {
    return [this, handler](const httplib::Request& request, httplib::Response& response) {
      const std::string number = request.matches[1];
      const size_t i = number.size() < 9 ? std::stoul(number) : scans.size();
      if (i >= scans.size()) {
        response.status = 404;
        return;
      }
      const std::lock_guard<std::mutex> lock(mutex);
      try {
        handler(i, request, response);
      } catch (const std::exception& error) {
        response.status = 422;
        response.set_content(json{{"error", error.what()}}.dump(-1, ' ', false, json::error_handler_t::replace),
                             "application/json");
      }
    };
  }
  static void answer(httplib::Response& response, const json& content) {
    response.set_content(content.dump(-1, ' ', false, json::error_handler_t::replace), "application/json");
  }

  // Pages of other sites may send requests here, and names of theirs may lead here; neither knows the secret or can
  // change the host they ask for.
  httplib::Server::HandlerResponse admit(const httplib::Request& request, httplib::Response& response) const {
    using Result = httplib::Server::HandlerResponse;
    const std::string asked = request.get_header_value("Host");
    const bool is_here = asked == host || asked == localhost;
    const bool is_secret = request.path.starts_with("/api/");
    if (is_here && (!is_secret || request.get_header_value("X-Facewright-Secret") == token)) return Result::Unhandled;
    response.status = 403;
    response.set_content("open the address that landmark-scan printed", "text/plain");
    return Result::Handled;
  }

  void route() {
    http.set_payload_max_length(kMostBytes);
    http.set_default_headers(
        {{"Cache-Control", "no-store"},
         {"X-Content-Type-Options", "nosniff"},
         {"Content-Security-Policy",
          "default-src 'self'; img-src 'self' blob: data:; style-src 'self'; frame-ancestors 'none'"}});
    http.set_pre_routing_handler([this](const auto& request, auto& response) { return admit(request, response); });
    http.Get(R"(/([A-Za-z.]*))", [](const httplib::Request& request, httplib::Response& response) {
      const std::string name = request.matches[1].length() ? request.matches[1].str() : "index.html";
      const auto asset = page_asset(name);
      if (asset)
        response.set_content(std::string(*asset), mime_type(name));
      else
        response.status = 404;
    });
    http.Get("/api/scans", [this](const auto&, httplib::Response& response) {
      const std::lock_guard<std::mutex> lock(mutex);
      answer(response, list());
    });
    http.Get(R"(/api/scans/(\d+))",
             of_scan([this](size_t i, const auto&, httplib::Response& response) { answer(response, describe(i)); }));
    http.Get(R"(/api/scans/(\d+)/mesh)", of_scan([this](size_t i, const auto&, httplib::Response& response) {
               response.set_content(scan(i).mesh.bytes, "application/octet-stream");
             }));
    http.Get(R"(/api/scans/(\d+)/texture)", of_scan([this](size_t i, const auto&, httplib::Response& response) {
               response.set_content(scan(i).texture, "image/png");
             }));
    http.Put(R"(/api/scans/(\d+)/landmarks)",
             of_scan([this](size_t i, const auto& request, httplib::Response& response) {
               save(i, request.body);
               answer(response, {{"saved", target(i).filename().string()}});
             }));
  }
};

LandmarkServer::LandmarkServer(std::vector<ScanFiles> scans, const LandmarkServerOptions& options)
    : impl_(std::make_unique<Impl>()) {
  if (scans.empty()) throw InvalidInput("landmark page: there are no scans");
  if (!page_asset("three.core.js"))
    throw InvalidInput(
        "landmark page: this program was built without three.js. Run pipelines/fetch-packages BUILD/node_modules "
        "pipelines/pages/package-lock.json, configure and build again; or correct the landmark files by hand");
  impl_->scans = std::move(scans);
  impl_->options = options;
  impl_->route();
  const char* loopback = "127.0.0.1";
  const int port = options.port == 0                                  ? impl_->http.bind_to_any_port(loopback)
                   : impl_->http.bind_to_port(loopback, options.port) ? options.port
                                                                      : -1;
  if (port < 0)
    throw IoError("127.0.0.1:" + std::to_string(options.port), "cannot be listened on; name another with --port");
  impl_->host = std::string(loopback) + ":" + std::to_string(port);
  impl_->localhost = "localhost:" + std::to_string(port);
  impl_->address = "http://" + impl_->host + "/#" + impl_->token;
}

LandmarkServer::~LandmarkServer() = default;

const std::string& LandmarkServer::address() const { return impl_->address; }
void LandmarkServer::run() { impl_->http.listen_after_bind(); }
void LandmarkServer::stop() { impl_->http.stop(); }

}  // namespace facewright
