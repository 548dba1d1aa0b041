#pragma once
// Where the program's own data is: models/, assets/ and scenarios/, both in a build tree and
// installed.

#include <string>
#include <vector>

namespace turbidock::experiments {

// The folder that holds models/, assets/ and scenarios/: share/turbidock beside the executable's
// bin/, or the installed one. Throws ConfigError when neither is there.
std::string DataDir();

std::string ModelPath(const std::string& file);  // DataDir()/models/file
std::string AssetPath(const std::string& file);  // DataDir()/assets/file

// A bundled scenario's file, or `name` itself when it names a file. Throws ConfigError that lists
// the bundled names and suggests the nearest.
std::string FindScenario(const std::string& name);
std::vector<std::string> BundledScenarios();  // names, sorted

}  // namespace turbidock::experiments
