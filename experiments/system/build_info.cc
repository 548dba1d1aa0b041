#include "experiments/system/build_info.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <string_view>

#include "experiments/system/git_hash.h"

namespace turbidock::system {

std::string VersionAndCommit() { return std::string(TURBIDOCK_VERSION) + " " + kGitHash; }

std::string BuildId() {
  const std::string id = VersionAndCommit();
  const std::string_view hash = kGitHash;
  if (!hash.ends_with("-dirty") && hash != "unknown") return id;
  return id + " " + ModuleDigest(kGitHash);
}

std::string ModuleDigest(const void* address) {
  // A line a mapping: "begin-end rights offset device inode path".
  std::ifstream maps("/proc/self/maps");
  std::string path = "/proc/self/exe";
  for (std::string line; std::getline(maps, line);) {
    uintptr_t begin = 0, end = 0;
    const auto at = reinterpret_cast<uintptr_t>(address);
    if (std::sscanf(line.c_str(), "%lx-%lx", &begin, &end) == 2 && begin <= at && at < end &&
        line.find('/') != std::string::npos)
      path = line.substr(line.find('/'));
  }
  std::ifstream file(path, std::ios::binary);
  const std::string content(std::istreambuf_iterator<char>(file), {});
  return fmt::format("{:016x}", XXH64(content.data(), content.size(), 0));
}

std::string BuiltFrom() {
  return fmt::format("turbidock {}\ngit {}\ncompiler {}\nbuild {}\n", TURBIDOCK_VERSION, kGitHash,
                     TURBIDOCK_COMPILER, TURBIDOCK_BUILD_TYPE);
}

}  // namespace turbidock::system
