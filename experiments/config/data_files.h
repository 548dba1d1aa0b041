#pragma once
// Where the program's own data is: models/ and assets/, both in a build tree and installed.

#include <string>
#include <vector>

namespace turbidock::config {

// The folder that holds models/ and assets/: the environment's TURBIDOCK_DATA, else
// share/turbidock beside the executable's bin/ or beside the library that this is part of (a Python
// module), or of the package that the program is linked with, or the installed one. Throws
// ConfigError when none is there.
std::string DataDir();

std::string ModelPath(const std::string& file);  // DataDir()/models/file
bool IsBundledModel(const std::string& name);
std::string AssetPath(const std::string& file);  // DataDir()/assets/file

// The names of assets/folder/NAME.yaml, sorted; and such a file, or `name` itself when it names
// a file. Throws ConfigError that lists the bundled names and suggests the nearest, or the command
// for what is bundled elsewhere; `what` is the word for one of them.
std::vector<std::string> BundledNames(const std::string& folder);
std::string FindBundled(const std::string& folder, const std::string& what,
                        const std::string& name);

}  // namespace turbidock::config
