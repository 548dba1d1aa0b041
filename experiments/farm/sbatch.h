#pragma once
// Scripts for Slurm, and handing them in.

#include <filesystem>
#include <string>
#include <vector>

namespace turbidock::farm {

// A word of the shell that means exactly this text.
std::string ShellQuoted(const std::string& text);

// This program, as a word of the shell.
std::string QuotedProgram();

// The lines that tell sbatch its options.
std::string Directives(const std::vector<std::string>& options);

// ConfigError when it cannot be written.
void WriteScriptFile(const std::filesystem::path& path, const std::string& text, bool executable);

// Hands a script in with sbatch and returns the job's number. SimulatorFault when sbatch is missing
// or refuses, in Slurm's own words.
std::string Sbatch(const std::vector<std::string>& arguments);

}  // namespace turbidock::farm
