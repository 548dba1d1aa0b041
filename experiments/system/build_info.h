#pragma once
// What this program was built from.

#include <string>

namespace turbidock::system {

// "0.1.0 1a2b3c4d5e6f": travels with every result.
std::string VersionAndCommit();

// Two programs with the same id give the same digests on the same machine type: version and commit,
// and for a build of files that are in no commit a digest of it.
std::string BuildId();

// Of the content of the program or library that has this address in memory.
std::string ModuleDigest(const void* address);
// The same with every library that this program loaded from outside the system's folders: what a
// user's code may consist of.
std::string CodeDigest(const void* address);

// Version, commit (with "-dirty" behind it for files that are in no commit), compiler and build
// type, a line each.
std::string BuiltFrom();

}  // namespace turbidock::system
