#pragma once
// What this program was built from and runs on.

#include <string>
#include <utility>
#include <vector>

namespace turbidock::experiments {

// "0.1.0 1a2b3c4d5e6f": travels with every result.
std::string VersionAndCommit();

// Two programs with the same id give the same digests on the same machine type: version and commit,
// and for a build of files that are in no commit the digest of the executable.
std::string BuildId();

// (name, value) rows: turbidock, git, compiler, build, MuJoCo, Mesa, OpenCV. Makes a GL context to
// ask Mesa for its version; without one that row says why.
std::vector<std::pair<std::string, std::string>> BuildInfo();

}  // namespace turbidock::experiments
