#include "experiments/system/build_info.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <string_view>

#include "experiments/system/git_hash.h"

namespace turbidock::system {
namespace {

// Programs and libraries that are in memory.
struct Modules {
  std::string there = "/proc/self/exe";  // the one that has an address
  std::set<std::string> own;             // those that are not the system's
};

Modules LoadedModules(const void* address) {
  constexpr std::array kSystem = {"/lib/", "/lib64/", "/usr/lib/", "/usr/lib64/"};
  Modules modules;
  // A line a mapping: "begin-end rights offset device inode path".
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    uintptr_t begin = 0, end = 0;
    const auto at = reinterpret_cast<uintptr_t>(address);
    std::array<char, 5> rights{};
    const size_t slash = line.find('/');
    if (slash == std::string::npos ||
        std::sscanf(line.c_str(), "%lx-%lx %4s", &begin, &end, rights.data()) != 3)
      continue;
    const std::string path = line.substr(slash);
    if (begin <= at && at < end) modules.there = path;
    if (rights[2] == 'x' && std::ranges::none_of(kSystem, [&path](const char* folder) {
          return path.starts_with(folder);
        }))
      modules.own.insert(path);
  }
  return modules;
}

XXH64_hash_t DigestOf(const std::string& path, XXH64_hash_t seed) {
  std::ifstream file(path, std::ios::binary);
  const std::string content(std::istreambuf_iterator<char>(file), {});
  return XXH64(content.data(), content.size(), seed);
}

}  // namespace

std::string VersionAndCommit() { return std::string(TURBIDOCK_VERSION) + " " + kGitHash; }

std::string BuildId() {
  std::string id = VersionAndCommit();
  const std::string_view hash = kGitHash;
  if (!hash.ends_with("-dirty") && hash != "unknown") return id;
  return id + " " + ModuleDigest(kGitHash);
}

std::string ModuleDigest(const void* address) {
  const Modules modules = LoadedModules(address);
  return fmt::format("{:016x}", DigestOf(modules.there, 0));
}

std::string CodeDigest(const void* address) {
  const Modules modules = LoadedModules(address);
  XXH64_hash_t digest = DigestOf(modules.there, 0);
  for (const std::string& path : modules.own)
    if (path != modules.there) digest = DigestOf(path, digest);
  return fmt::format("{:016x}", digest);
}

std::string BuiltFrom() {
  return fmt::format("turbidock {}\ngit {}\ncompiler {}\nbuild {}\n", TURBIDOCK_VERSION, kGitHash,
                     TURBIDOCK_COMPILER, TURBIDOCK_BUILD_TYPE);
}

}  // namespace turbidock::system
