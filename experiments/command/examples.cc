#include <map>
#include <string>
#include <utility>

#include "experiments/command/command_line.h"

namespace turbidock::command {
namespace {

// What follows the program's name, by command.
const std::map<std::string, std::pair<const char*, const char*>> kExamples = {
    {"batch",
     {"batch turbidity_sweep --seeds 6 --out sweep.db",
      "batch turbidity_sweep --set sea.state=calm --out sweep.db --slurm 20 --workers 4"}},
    {"bench", {"bench", "bench sea_night_active --frames 300 --repeats 5 --json"}},
    {"calibrate", {"calibrate", "calibrate --generations 40 --workers 4 --out found.yaml"}},
    {"check-vehicle", {"check-vehicle vehicle.xml", "check-vehicle mine.xml --out report"}},
    {"compare",
     {"compare before.db after.db", "compare a.db b.db --ignore control.use --figure compare.pdf"}},
    {"dataset",
     {"dataset detector_images --seeds 2 --out images",
      "dataset detector_images --workers 4 --out images"}},
    {"estimate",
     {"estimate --left left.mp4 --right right.mp4 --rig rig.yaml",
      "estimate --left 'left_*.png' --right 'right_*.png' --overlay seen.mp4 --json"}},
    {"gate", {"gate gate.yaml --out report", "gate gate.yaml --set control.use=lqg --json"}},
    {"list", {"list", "list keys | grep milk"}},
    {"merge",
     {"merge all.db part1.db part2.db", "merge --complete all.db part1.db part2.db part3.db"}},
    {"recognize",
     {"recognize recognition_active --seconds 5 --out cells.db",
      "recognize recognition_passive --workers 4 --figure recognition.png"}},
    {"replay", {"replay sweep.db 17", "replay sweep.db 17 --no-video --out trial-17"}},
    {"report", {"report sweep.db --out sweep.html", "report out --out trial.html"}},
    {"run",
     {"run pool_active --seed 7",
      "run sea_night_active --set water.milk_ml_m3=20 --out out --video --report"}},
    {"status", {"status sweep.db", "status sweep.db --by sea.state --over water.milk_ml_m3"}},
    {"step-response", {"step-response", "step-response pool_active --axis yaw --out response"}},
    {"tune", {"tune tryout --out tuned", "tune mine.yaml --out tuned --workers 4"}},
    {"view", {"view pool_active", "view sea_night_active --set water.milk_ml_m3=20 --port 8080"}},
};

}  // namespace

std::string ExamplesOf(const std::string& command) {
  const auto found = kExamples.find(command);
  if (found == kExamples.end()) return "";
  const auto& [first, second] = found->second;
  return std::string("Examples:\n  turbidock ") + first + "\n  turbidock " + second;
}

}  // namespace turbidock::command
