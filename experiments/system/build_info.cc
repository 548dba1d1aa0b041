#include "experiments/system/build_info.h"

#include <fmt/format.h>
#include <xxhash.h>

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
  return id + " " + ProgramDigest();
}

std::string ProgramDigest() {
  std::ifstream file("/proc/self/exe", std::ios::binary);
  const std::string program(std::istreambuf_iterator<char>(file), {});
  return fmt::format("{:016x}", XXH64(program.data(), program.size(), 0));
}

std::string BuiltFrom() {
  return fmt::format("turbidock {}\ngit {}\ncompiler {}\nbuild {}\n", TURBIDOCK_VERSION, kGitHash,
                     TURBIDOCK_COMPILER, TURBIDOCK_BUILD_TYPE);
}

}  // namespace turbidock::system
