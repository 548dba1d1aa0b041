#include "experiments/farm/sbatch.h"

#include <cerrno>
#include <cstring>
#include <fstream>

#include "experiments/system/subprocess.h"
#include "sim/base/check.h"

namespace turbidock::farm {

namespace fs = std::filesystem;

std::string ShellQuoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

std::string QuotedProgram() { return ShellQuoted(fs::read_symlink("/proc/self/exe").string()); }

std::string Directives(const std::vector<std::string>& options) {
  std::string text;
  for (const std::string& option : options) text += "#SBATCH " + option + "\n";
  return text;
}

void WriteScriptFile(const fs::path& path, const std::string& text, bool executable) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) throw ConfigError(path.string() + ": cannot be written: " + std::strerror(errno));
  if (executable) fs::permissions(path, fs::perms::owner_exec, fs::perm_options::add);
}

std::string Sbatch(const std::vector<std::string>& arguments) {
  std::vector<std::string> command = {"sbatch", "--parsable"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  // "JOB" or "JOB;CLUSTER"
  const std::string printed = system::Subprocess(command, "slurm-client").Finish();
  return printed.substr(0, printed.find_first_of(";\n"));
}

}  // namespace turbidock::farm
