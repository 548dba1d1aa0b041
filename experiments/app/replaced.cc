#include "experiments/app/replaced.h"

#include <cstring>
#include <string_view>

namespace turbidock::app {
namespace {

// A command, or an option of a command that is still there.
struct Replaced {
  const char* command;
  const char* option;  // empty: the command itself
  const char* now;
};

constexpr Replaced kReplaced[] = {
    {"scenarios", "", "turbidock list scenarios, list keys, list --show SCENARIO"},
    {"plans", "", "turbidock list plans"},
    {"studies", "", "turbidock list studies"},
    {"slurm", "", "turbidock batch PLAN --out FILE --slurm TASKS, or --shard I/N and merge"},
    {"run", "--resolution", "--set rig.width_px=320 --set rig.height_px=240"},
    {"bench", "--resolution", "--set rig.width_px=320 --set rig.height_px=240"},
};

bool IsOption(std::string_view argument, std::string_view option) {
  return argument == option ||
         (argument.starts_with(option) && argument.substr(option.size()).starts_with('='));
}

}  // namespace

std::string ReplacedOn(int argc, const char* const* argv) {
  if (argc < 2) return "";
  for (const auto& [command, option, now] : kReplaced) {
    if (std::strcmp(argv[1], command) != 0) continue;
    if (*option == 0) return std::string(command) + " is gone; now: " + now;
    for (int i = 2; i < argc; ++i)
      if (IsOption(argv[i], option))
        return std::string(command) + " " + option + " is gone; now: " + now;
  }
  return "";
}

}  // namespace turbidock::app
