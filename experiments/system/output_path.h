#pragma once
// Whole files, and early and equal words for the commonest mistake: one that cannot be read or
// written.

#include <filesystem>
#include <string>

namespace turbidock::system {

// Throws ConfigError ("PATH: cannot be written: REASON") when no file can be written at `path`.
// Leaves the file system as it was.
void RequireWritable(const std::string& path);

// Writes a file complete or not at all: a reader never sees half of it. ConfigError when it cannot
// be written.
void WriteWhole(const std::filesystem::path& path, const std::string& text);

// Every byte of a file. ConfigError "PATH: cannot be read".
std::string ReadWhole(const std::filesystem::path& path);

}  // namespace turbidock::system
