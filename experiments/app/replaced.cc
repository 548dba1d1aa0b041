#include "experiments/app/replaced.h"

#include <string>
#include <utility>

namespace turbidock::app {
namespace {

// "command" or "command --option --option", and what took its place.
const std::pair<std::string, const char*> kReplaced[] = {
    {"scenarios", "turbidock list scenarios, list keys, list --show SCENARIO"},
    {"plans", "turbidock list plans"},
    {"studies", "turbidock list studies"},
    {"list --json", "the same as text; Python: turbidock.keys(), turbidock.scenarios()"},
    {"selftest",
     "--version for what it was built from; run pool_active --out FOLDER --video uses all it "
     "needs"},
    {"slurm", "turbidock batch PLAN --out FILE --slurm TASKS, or --shard I/N and merge"},
    {"curve", "turbidock status FILE --over KEY, report FILE --figure PNG --over KEY"},
    {"bench", "turbidock run SCENARIO, which says what a frame takes, stage by stage"},
    {"verify", "turbidock replay FILE TRIAL, which compares digests"},
    {"report --trial", "turbidock replay FILE TRIAL --out FOLDER, report FOLDER"},
    {"report --ignore", "turbidock compare A B --ignore KEY --out FILE.html"},
    {"export", "sqlite3 -header -csv FILE 'SELECT * FROM results'; Python: turbidock.read_results"},
    {"run --resolution", "--set rig.width_px=320 --set rig.height_px=240"},
    {"view --quality", "nothing: pictures have a JPEG quality of 80"},
    {"gate --max-trials", "max_trials in the gate's file"},
    {"gate --rate --margin --alpha --beta",
     "margins.success_rate, alpha and beta in the gate's file"},
    {"gate --simulate --design --plan-size",
     "gate GATE.yaml, whose report says exactly which loss each condition would have seen"},
    {"gate --figure", "gate --out FOLDER, whose report.html has the verdict; nothing is drawn"},
    {"compare --metrics", "time, tracking error, effort and final error, always"},
    {"step-response --cameras", "--set pose_source=cameras"},
    {"step-response --true-pose", "nothing: true poses are the default"},
    {"step-response --no-noise", "--set true_pose.noise=[0, 0, 0, 0]"},
    {"step-response --turn --step --force",
     "a step of 5° and of 5 cm, a push of 1 N or 0.1 N m, always"},
    {"step-response --amplitude", "sinusoids of 12 % of what the vehicle can give, always"},
    {"step-response --sea", "nothing: it is measured in still water"},
    {"check-vehicle --names", "the table in models/names.md"},
    {"estimate --preset", "--set estimator.preset=published"},
    {"estimate --fps", "30 frames a second"},
    {"estimate --csv", "its records in --json, one a frame"},
    {"estimate --wall-clock", "--set estimator.generations_per_frame=20"},
    {"recognize --csv", "its cells in --json"},
    {"calibrate --seconds", "turbidock recognize --table FILE with the values found"},
    {"compare-estimators",
     "turbidock recognize --set pose_estimator=NAME, once for each; right and wrong_and_sure in "
     "--json"},
};

}  // namespace

std::string ReplacedOn(int argc, const char* const* argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i], option = " " + word.substr(0, word.find('=')) + " ";
    for (const auto& [gone, now] : kReplaced) {
      const bool is_option = gone.starts_with(std::string(argv[1]) + " --");
      if (i == 1 ? gone == word : is_option && (gone + " ").find(option) != std::string::npos)
        return (i == 1 ? word : argv[1] + option.substr(0, option.size() - 1)) +
               " is gone; now: " + now;
    }
  }
  return "";
}

}  // namespace turbidock::app
