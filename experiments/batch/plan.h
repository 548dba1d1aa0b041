#pragma once
// A plan: which trials a batch consists of. Every trial follows from the plan and its number alone,
// wherever, whenever and in whatever order it runs.
//
//   schema_version: 1
//   description: docking over turbidity
//   scenario: sea_night_active         # a bundled scenario or a file
//   seeds: 30                          # trials in each cell of the grid
//   precision: 0.03                    # or more of them, until its success rate is known so well
//   set: {trial.duration_s: 90}        # in every trial
//   grid:                              # every combination is a cell; `scenario` may be a key here
//     water.milk_ml_m3: [0, 10, 20]
//     sea.state: [calm, moderate]
//   cases:                             # cells by name, each with keys of its own; in every cell
//     as planned: {}                   # of the grid
//     one thruster weak: {vehicle.thrusters.effectiveness: [0.6, 1, 1, 1]}
//     pool: {scenario: pool_active}    # this case's; else the plan's
//   strata:                            # equally likely parts of the draws, met in turn by a cell
//     near: {start.distance_min_m: 0.6, start.distance_max_m: 1}
//     far: {start.distance_min_m: 1, start.distance_max_m: 1.4}
//   random:                            # drawn for each trial, and stored with it
//     start.heading_rad: {uniform: [0, 0.2]}
//     vehicle.rigid_body.mass_kg: {normal: [15, 0.5], within: [13, 17]}
//     cameras.sensor.read_noise_electrons: {log_uniform: [2, 20]}
//     cameras.delay_frames: {choice: [1, 2, 3]}
//
// Or, in place of `seeds`, `precision` and `strata`:
//
//   ranges:                            # one to three keys, over which `find` looks for the values
//     sea.current.gust_std_mps: {from: 0, to: 0.2, success: falls}  # where success crosses a rate
//   find: {rate: 0.9, width: 0.1}
//
// An element of a list that `set` or a case gives may be ranged, or be in the grid: it then has its
// own values. A list and its element cannot both be in the grid.
//
// Who uses a plan for more than a batch has a group of its own in it (kUseGroups), which decides
// no trial.
//
// A trial's scenario is that of its file with `set`, its case, its cell of the grid, its stratum,
// its draws and its seed set in this order by trial::Resolve, as `turbidock run --set` would, but
// presets in `set`, and those of a trial, first, as in a file. Files that a plan names are beside
// it.

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "experiments/batch/plan_keys.h"
#include "experiments/batch/plan_ranges.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/trial/scenario.h"
#include "sim/base/digest.h"
#include "sim/base/fields.h"

namespace turbidock::batch {

inline constexpr int kPlanSchema = 1;
inline constexpr int64_t kMaxTrials = 10'000'000;  // of a plan
// The parameters that `cases` and `strata` make.
inline constexpr const char *kCaseKey = "case", *kStratumKey = "stratum";

struct PlanSettings {
  int schema_version = 0;
  std::string description;
  std::string scenario;
  int64_t master_seed = 1;
  int seeds = 1;
  double precision = 0;
  bool common_seeds = true;
  double trial_time_limit_s = 3600;
  int series_every_frames = 0;

  static void Fields(auto& self, auto&& field) {
    field("schema_version", self.schema_version, InRange(kPlanSchema, kPlanSchema),
          "version of the keys of the file");
    field("description", self.description, Finite(), "description in one line, for people");
    field("scenario", self.scenario, Finite(),
          "scenario that the trials vary: a bundled one or a file; `grid` or `cases` may name "
          "others");
    field("master_seed", self.master_seed, AtLeast(0),
          "number from which every trial's seed and draws follow");
    field("seeds", self.seeds, InRange(1, 1e6), "number of trials in each cell of the grid");
    field("precision", self.precision, InRange(0, 0.5),
          "half width, as a share of the trials, of the 95 % Wilson interval of a cell's success "
          "rate: the cell runs on, `seeds` trials at a time, until it is as narrow, which strata "
          "help; 0: `seeds` trials");
    field("common_seeds", self.common_seeds, Finite(),
          "whether every cell has the same seeds and draws, so that cells compare pair by pair; "
          "with `ranges`, at the same values of these");
    field("trial_time_limit_s", self.trial_time_limit_s, InRange(0.1, 1e6),
          "wall time after which a trial counts as hung");
    field("series_every_frames", self.series_every_frames, InRange(0, 1e6),
          "number of frames from one stored row of a trial's log to the next; 0 stores none");
  }
};

// A key of the scenario and its value as YAML in one line.
struct Parameter {
  std::string key, value;

  std::string Assignment() const { return key + "=" + value; }
  bool operator==(const Parameter& other) const;  // however the value is written
};
// The same for every spelling of a parameter's value.
std::string CanonicalValue(const Parameter& parameter);

// Keys that change together. In the grid it is a value of the key `case`, of a stratum one of the
// key `stratum`.
struct Case {
  std::string name, scenario = {};  // the latter empty: the plan's
  std::vector<config::Assignment> values;
};

struct GridAxis {
  std::string key;
  std::vector<std::string> values;
  std::vector<config::YamlNode> nodes = {};  // where they stand; none of `case`
};

struct TrialSpec {
  int64_t trial = 0;   // in [0, Plan::trials())
  int64_t cell = 0;    // of the grid; the last key of the grid varies fastest
  int64_t sample = 0;  // within the cell
  int64_t seed = 0;    // the scenario's
  // The grid's keys (`case` first), `stratum`, then the random ones.
  std::vector<Parameter> parameters{};
};

// What the command line and the program around it may change in a plan.
struct PlanOverrides {
  // Scenario keys: over the plan's `set`, and over the cases of a gate or a study. What else varies
  // them is refused.
  std::vector<config::Assignment> assignments{};
  std::optional<int64_t> master_seed{};
  std::optional<int> seeds{};  // exactly so many: the precision is 0
  trial::Plugins plugins{};    // what else its scenarios may choose
  std::string use{};           // its group of kUseGroups; who reads none is told of them
  // What this use cannot take, and why: no file may give these keys.
  std::vector<PlanKey> refused{};
  bool sees_images = false;  // also of trials on the true pose
};

// A cell as a plan has it.
struct CellText {
  std::string name;           // "rough", "sea.state=calm"; "all" of the only one
  std::string given;          // "sea_night sea.state=calm": all that is given to its trials
  std::string scenario_file;  // where its scenario was found
};

class Plan {
 public:
  // The plan in a text; `file` stands for it in messages. ConfigError for whatever is wrong in it,
  // also for a trial whose scenario would be wrong: of each cell, and of what is drawn, those of
  // the first 10,000 are looked at.
  Plan(const std::string& text, const std::string& file, const PlanOverrides& overrides = {});
  explicit Plan(const config::YamlNode& plan, const PlanOverrides& overrides = {});

  const PlanSettings& settings() const { return settings_; }
  const trial::Plugins& plugins() const { return plugins_; }
  // Of the plug-ins that its trials use, a line each.
  std::string code() const;
  const std::vector<GridAxis>& grid() const { return grid_; }  // its ranges are the last axes
  const std::optional<EnvelopePlan>& envelope() const { return envelope_; }
  // Keys of a trial's parameters, in their order.
  const std::vector<std::string>& keys() const { return keys_; }
  // Its description, or the name of its file.
  const std::string& title() const { return title_; }
  // All that it was read from, and that its trials read: files, or names of bundled ones.
  std::vector<std::string> files() const;
  // What there is to say of its values, a sentence each: such as one that a preset after it undoes.
  const std::vector<std::string>& remarks() const { return remarks_; }
  int64_t cells() const { return cells_; }
  // Of all cells; with a precision, at most. With ranges the numbers that trials can have.
  int64_t trials() const { return cells_ * samples_; }
  // How many are run; with a precision or ranges, at most.
  int64_t most() const {
    return envelope_ ? cells_ / envelope_->points() * envelope_->find.trials : trials();
  }
  bool decides() const { return settings_.precision > 0 || envelope_; }  // on how many are run

  TrialSpec Trial(int64_t trial) const;
  TrialSpec FirstOf(int64_t cell) const { return Trial(NumberOf(cell, 0)); }
  int64_t NumberOf(int64_t cell, int64_t sample) const;
  CellText TextOf(int64_t cell) const;  // not of a resolved plan
  // A trial's, resolved, with a digest of each file that it reads (`model_files`) as it was when
  // the plan was read.
  trial::Scenario ScenarioOf(const TrialSpec& spec) const;
  // The trial of these parameters that is the so manieth of its cell; nothing where it has none.
  std::optional<int64_t> NumberOf(const std::vector<Parameter>& parameters, int64_t sample) const;
  // The keys that its cases, grid, strata and draws give values.
  VariedKeys Varied() const;
  // The same plan with other seeds, exactly so many a cell; nothing is read anew. ConfigError about
  // `seeds` for a number that it cannot have.
  Plan WithSeeds(std::optional<int64_t> master_seed, int seeds) const;

  // The plan with everything that decides its trials spelt out: the scenarios with every value, and
  // a digest of each file of their models. It is a plan itself, of the same trials.
  std::string resolved() const;
  std::string hash() const { return DigestOf(resolved()); }

 private:
  void CountTrials(const std::string& key);  // which says how many, for messages
  void ReadSet(const config::YamlNode& plan, const std::vector<config::Assignment>& assignments);
  void ReadGrid(const config::YamlNode& node);
  void RequireNoListOf(const std::string& key, const config::YamlNode& at) const;
  void ReadRanges(const config::YamlNode& plan, const PlanOverrides& overrides);
  // Those of a key of the plan, and the parameter that they are values of: kCaseKey, kStratumKey.
  std::vector<Case> CasesIn(const config::YamlNode& node, const std::string& parameter);
  void ReadRandom(const config::YamlNode& node);
  void LoadScenarios(const config::YamlNode& plan);
  // The name of a trial's or a cell's scenario; empty where nothing gives one.
  const std::string& ScenarioNameOf(const std::vector<Parameter>& parameters) const;
  void AddFiles(trial::Scenario scenario);
  void RequireSameFiles(const config::YamlNode& before) const;
  // Ends that a key may not have; and of the vehicle's keys draws that leave out its own value, as
  // a study's that was copied may do.
  void CheckDraws();
  bool IsAtEnds(int64_t cell) const;
  void CheckTrials(const std::string& file, bool sees_images);
  // Presets come first, as in a file: what else a trial is named by is what it has.
  // As in a file: what else a trial is named by is what it has.
  void PutPresetsFirst(std::vector<config::Assignment>* values) const;
  std::vector<config::Assignment> AssignmentsOf(const std::vector<Parameter>& parameters) const;
  double DrawOf(const RandomKey& random, const std::string& cell, int64_t sample) const;
  std::string Resolve(const config::YamlNode& plan) const;
  // A file's name in a resolved plan, from its folder if it moves with it; and where that is now.
  std::string NameFromFolder(const std::string& file) const;
  std::string FileOf(const std::string& name) const;

  PlanSettings settings_;
  std::string title_;
  std::string folder_;  // of its file, absolute
  trial::Plugins plugins_;
  std::vector<GridAxis> grid_;
  std::optional<EnvelopePlan> envelope_;
  std::vector<Case> cases_, strata_;
  std::vector<RandomKey> random_;
  std::vector<config::YamlNode> distributions_;  // of each of those
  std::vector<std::string> keys_, presets_;
  VariedKeys given_;
  int64_t cells_ = 1, samples_ = 1;                   // samples: trials of a cell, at most
  std::vector<config::Assignment> set_;               // in every trial
  std::map<std::string, std::string> found_;          // by a scenario's name: where it was found
  std::map<std::string, trial::Scenario> scenarios_;  // by name, with `set`
  // By the files that a scenario names: those and all that they include.
  std::map<std::string, std::vector<trial::ModelFile>> files_;
  std::vector<std::string> remarks_;
  std::set<std::string> code_;
  std::string trials_;  // of the resolved plan, all but its settings
};

// The trials that a cell runs at most: so many that any success rate is known to the precision, or
// to 0.001, in whole times `seeds`.
int64_t SamplesOf(int64_t seeds, double precision);

// Reads a group of a plan's file that a use of it has (kUseGroups), and checks it.
template <HasFields Settings>
Settings ReadUse(const config::YamlNode& plan, const std::string& group) {
  const std::optional<config::YamlNode> node = plan.Find(group);
  if (!node) throw ConfigError(plan.file + ": " + group + ": this key is required");
  Settings settings;
  config::Origins origins;
  config::ReadFields(*node, &settings, &origins);
  config::CheckSettings(settings, origins, group);
  return settings;
}

// Every key of a plan, with what it means.
std::vector<config::KeyDoc> PlanKeys();

// Reads a plan: a YAML file or the name of a bundled one.
Plan LoadPlan(const std::string& name, const PlanOverrides& overrides = {});

// The files of scenarios, with a digest of each, as YAML under the key `model_files`.
std::string ModelFilesText(const std::map<std::string, trial::ModelFile>& files);

// A text as YAML, with quotes where they are needed.
std::string YamlText(const std::string& text);

// One of `count` parts of a batch that together do every trial once: number `index`, from 1. With a
// precision a cell's trials are all in the same part, with strata one of each; with ranges those of
// a combination of case and grid.
struct Shard {
  int index = 1, count = 1;

  bool Has(int64_t number) const { return number % count == index - 1; }  // of a trial or a cell
  std::string Text() const { return std::to_string(index) + "/" + std::to_string(count); }
  bool operator==(const Shard&) const = default;
};

// "2/4". ConfigError for anything else.
Shard ParseShard(const std::string& text);

}  // namespace turbidock::batch
