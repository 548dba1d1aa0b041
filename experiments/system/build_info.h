#pragma once
// What this program was built from.

#include <string>

namespace turbidock::system {

// "0.1.0 1a2b3c4d5e6f": travels with every result.
std::string VersionAndCommit();

// Two programs with the same id give the same digests on the same machine type: version and commit,
// and for a build of files that are in no commit the digest of the executable.
std::string BuildId();

// Of the content of this program's file.
std::string ProgramDigest();

// Version, commit (with "-dirty" behind it for files that are in no commit), compiler and build
// type, a line each.
std::string BuiltFrom();

}  // namespace turbidock::system
