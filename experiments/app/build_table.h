#pragma once
// What this program was built from and runs on, for people.

#include <string>
#include <utility>
#include <vector>

namespace turbidock::app {

// (name, value) rows: turbidock, git, compiler, build, MuJoCo, Mesa, OpenCV. Makes a GL context to
// ask Mesa for its version; without one that row says why.
std::vector<std::pair<std::string, std::string>> BuildTable();

}  // namespace turbidock::app
