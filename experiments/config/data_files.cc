#include "experiments/config/data_files.h"

#include <dlfcn.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "experiments/config/nearest_name.h"
#include "experiments/config/yaml_node.h"
#include "experiments/system/output_path.h"
#include "sim/base/check.h"

// In a program that is linked with the installed package (cmake/turbidockConfig.cmake.in), the
// package's data.
extern "C" __attribute__((weak)) const char turbidock_package_data[];

namespace turbidock::config {
namespace {

namespace fs = std::filesystem;

bool IsDataDir(const fs::path& dir) {
  std::error_code ignored;
  return fs::is_directory(dir / "models", ignored) && fs::is_directory(dir / "assets", ignored);
}

}  // namespace

std::string DataDir() {
  std::error_code error;
  const fs::path executable = fs::read_symlink("/proc/self/exe", error);
  const fs::path beside = executable.parent_path().parent_path() / "share/turbidock";
  Dl_info library{};
  dladdr(reinterpret_cast<const void*>(&DataDir), &library);
  const fs::path with_library =
      fs::path(library.dli_fname ? library.dli_fname : "").parent_path() / "share/turbidock";
  if (const char* given = std::getenv("TURBIDOCK_DATA")) {
    if (IsDataDir(given)) return given;
    throw ConfigError(std::string("TURBIDOCK_DATA=") + given + ": holds no models/ and assets/");
  }
  const char* const package = turbidock_package_data;
  for (const fs::path& dir :
       {beside, with_library, fs::path(package ? package : TURBIDOCK_INSTALLED_DATA)})
    if (IsDataDir(dir)) return dir.string();
  throw ConfigError("the program's data (models/, assets/) is neither in " + beside.string() +
                    " nor in " + TURBIDOCK_INSTALLED_DATA +
                    "; set TURBIDOCK_DATA to PREFIX/share/turbidock of the installed package");
}

std::string ModelPath(const std::string& file) { return DataDir() + "/models/" + file; }
bool IsBundledModel(const std::string& name) {
  std::error_code ignored;
  return name.find('/') == std::string::npos && fs::is_regular_file(ModelPath(name), ignored);
}

std::string AssetPath(const std::string& file) { return DataDir() + "/assets/" + file; }

std::vector<std::string> BundledNames(const std::string& folder) {
  std::vector<std::string> names;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(AssetPath(folder), ignored)) {
    if (entry.path().extension() != ".yaml") continue;
    // Baselines and scenarios stand beside the gates that name them.
    if (folder == "gates" && !LoadYaml(entry.path().string()).Find("gate")) continue;
    names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::string FindBundled(const std::string& folder, const std::string& what,
                        const std::string& name) {
  const std::string why = system::WhyUnreadable(name);
  if (why.empty()) return name;
  const std::vector<std::string> bundled = BundledNames(folder);
  if (std::ranges::count(bundled, name) > 0) return AssetPath(folder + "/" + name + ".yaml");
  for (const auto& [other, command] :
       {std::pair{"scenarios", "run"}, {"plans", "batch"}, {"gates", "gate"}, {"studies", "tune"}})
    if (std::ranges::count(BundledNames(other), name) > 0)
      throw ConfigError(fmt::format("{}: is one of the bundled {}, not of the {}: turbidock {} {}",
                                    name, other, folder, command, name));
  throw ConfigError(fmt::format("{}: {}, and no bundled {} of that name{} (bundled: {})", name, why,
                                what, DidYouMean(name, bundled), fmt::join(bundled, ", ")));
}

}  // namespace turbidock::config
