// turbidock from Python: the module `_core` behind the package.

#include <fmt/format.h>
#include <unistd.h>
#include <boost/algorithm/string/replace.hpp>

#include "experiments/app/main.h"
#include "experiments/batch/batch.h"
#include "experiments/batch/plan.h"
#include "experiments/batch/plan_keys.h"
#include "experiments/command/progress.h"
#include "experiments/config/data_files.h"
#include "experiments/config/yaml_fields.h"
#include "experiments/config/yaml_node.h"
#include "experiments/page/trial_page.h"
#include "experiments/python/bindings.h"
#include "experiments/report/json.h"
#include "experiments/report/report_json.h"
#include "experiments/statistics/sampling.h"
#include "experiments/studies/dataset/dataset.h"
#include "experiments/studies/gate/baseline.h"
#include "experiments/studies/gate/gate.h"
#include "experiments/system/build_info.h"
#include "experiments/system/output_path.h"
#include "experiments/trial/motion.h"
#include "experiments/trial/scenario.h"
#include "experiments/trial/series.h"
#include "sim/base/random.h"

namespace turbidock::python {

Held Hold(py::object object) {
  return {new py::object(std::move(object)), [](py::object* held) {
            const py::gil_scoped_acquire lock;
            delete held;
          }};
}

py::array View(const Image3u8& image, py::handle owner) {
  return View<uint8_t>({image.height(), image.width(), 3}, image.data(), owner);
}

py::array Copy(const Eigen::Ref<const Eigen::VectorXd>& values) {
  return View<double>({values.size()}, values.data(), py::handle());
}

Eigen::VectorXd NumbersOf(const py::object& given, int count, const std::string& rule) {
  const auto array = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(given);
  constexpr double kMost = 1e6;
  if (array && array.ndim() == 1 && array.shape(0) == count) {
    const Eigen::Map<const Eigen::VectorXd> numbers(array.data(), count);
    if ((numbers.array().abs() <= kMost).all()) return numbers;
  }
  PyErr_Clear();
  throw py::value_error(rule + ", not " + py::repr(given).cast<std::string>());
}

namespace {

using Assignments = std::vector<std::string>;

// With the interpreter told of it; the calling thread must not hold its lock.
pid_t ForkWithInterpreter() {
  const py::gil_scoped_acquire lock;
  PyOS_BeforeFork();
  const pid_t pid = ::fork();
  if (pid == 0)
    PyOS_AfterFork_Child();
  else
    PyOS_AfterFork_Parent();
  return pid;
}

// Tells Python how far something is, and hears from it whether to stop.
class Reporter {
 public:
  explicit Reporter(const py::object& callback)
      : callback_(callback.is_none() ? nullptr : Hold(callback)) {}

  // Share done in [0, 1] and a few words.
  void Show(double share, const std::string& words) {
    if (stopped_) return;
    const py::gil_scoped_acquire lock;
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      if (callback_) (*callback_)(share, words);
    } catch (py::error_already_set& error) {
      error_ = std::make_shared<py::error_already_set>(error);
      stopped_ = true;
    }
  }
  bool stopped() const { return stopped_; }
  // With the lock: goes on with what stopped it.
  void Rethrow() {
    if (!error_) return;
    error_->restore();
    throw py::error_already_set();
  }

 private:
  Held callback_;
  bool stopped_ = false;
  std::shared_ptr<py::error_already_set> error_;
};

// Does it without the interpreter's lock, then goes on with what stopped it.
template <class Do>
auto Reporting(const py::object& progress, const Do& act) {
  Reporter reporter(progress);
  auto done = [&] {
    const py::gil_scoped_release free;
    return act(&reporter);
  }();
  reporter.Rethrow();
  return done;
}

// Arrays by a column's name, stages as text.
py::dict ColumnsOf(const trial::Series& series) {
  py::dict columns;
  for (const auto& [name, values] : series.columns())
    columns[py::str(name)] = std::visit(
        []<class V>(const std::vector<V>& list) -> py::object {
          if constexpr (std::is_arithmetic_v<V>) {
            return View<V>({static_cast<py::ssize_t>(list.size())}, list.data(), py::handle());
          } else {
            py::list words;
            for (const V& value : list) words.append(NameOf(value));
            return words;
          }
        },
        values);
  return columns;
}

py::tuple Run(const trial::Scenario& scenario, const py::object& progress, bool motion) {
  std::optional<trial::MotionLog> log;
  const trial::TrialResult result = Reporting(progress, [&](Reporter* reporter) {
    trial::TrialOptions options;
    if (motion) {
      log.emplace(trial::ThrusterNamesOf(scenario));
      options.on_tick = [&](const trial::MotionTick& tick) { log->Add(tick); };
    }
    options.observe = [&](const trial::TrialFrame& frame) {
      constexpr int64_t kEvery = 30;
      if (frame.record.frame % kEvery == 0)
        reporter->Show(std::min(1.0, frame.record.time_s / scenario.duration_s),
                       fmt::format("{:.1f} s {}", frame.record.time_s, NameOf(frame.record.stage)));
    };
    options.stop_requested = [&] { return reporter->stopped(); };
    return trial::RunTrial(scenario, options);
  });
  return TupleOf(result, scenario) +
         py::make_tuple(log ? py::object(ArraysOf(log->table())) : py::object(py::none()));
}

batch::JobOptions JobsOf(int workers) {
  if (workers < 1) throw py::value_error("workers must be at least 1");
  return {.workers = workers, .fork = ForkWithInterpreter};
}

// A plan by its text, or where there is none by its name.
struct GivenPlan {
  std::string text, name;
  batch::PlanOverrides overrides;

  GivenPlan(std::string text_, std::string name_, const trial::Plugins& plugins,
            const Assignments& assignments, std::optional<int64_t> seed, std::optional<int> seeds)
      : text(std::move(text_)),
        name(std::move(name_)),
        overrides{.assignments = config::ParseAssignments(assignments),
                  .master_seed = seed,
                  .seeds = seeds,
                  .plugins = plugins} {}
  batch::Plan Load() const {
    return text.empty() ? batch::LoadPlan(name, overrides) : batch::Plan(text, name, overrides);
  }
};

// At the line that called the function of the package.
void Warn(const std::vector<std::string>& remarks) {
  const py::gil_scoped_acquire held;
  for (const std::string& remark : remarks)
    if (PyErr_WarnEx(PyExc_UserWarning, remark.c_str(), 2) != 0) throw py::error_already_set();
}

// Runs a plan into a file; all rows of the file as CSV.
std::string Batch(const GivenPlan& given, const std::string& out, int workers, bool anew,
                  const py::object& progress) {
  batch::RunOptions options;
  options.jobs = JobsOf(workers);
  return Reporting(progress, [&](Reporter* reporter) {
    const batch::Plan plan = given.Load();
    Warn(plan.remarks());
    batch::ResultStore store = batch::OpenResults(out, plan, {}, anew, options.jobs);
    options.stop_requested = [&] { return reporter->stopped(); };
    const auto show = [&](const batch::BatchProgress& now) {
      reporter->Show(static_cast<double>(now.done) / static_cast<double>(now.total),
                     fmt::format("{} of {} trials", now.done, now.total));
    };
    batch::RunBatch(plan, options, show, &store);
    return store.Csv();
  });
}

// How many images are in the folder.
int64_t Dataset(GivenPlan given, const std::string& out, int64_t pairs_per_shard, bool depth,
                int workers, const py::object& progress) {
  if (pairs_per_shard < 1) throw py::value_error("pairs_per_shard must be at least 1");
  given.overrides.refused = dataset::RefusedKeys();
  given.overrides.sees_images = true;
  dataset::DatasetOptions options{
      .pairs_per_shard = pairs_per_shard, .depth = depth, .jobs = JobsOf(workers)};
  return Reporting(progress, [&](Reporter* reporter) {
    double share = 0;
    options.on_progress = [&](int done, int of) { share = static_cast<double>(done) / of; };
    options.stop_requested = [&] {
      reporter->Show(share, "images");
      return reporter->stopped();
    };
    const batch::Plan plan = given.Load();
    Warn(plan.remarks());
    return dataset::MakeDataset(plan, out, options).images;
  });
}

// What a plan's `random` draws for these keys, as assignments: of a plan whose master_seed is this,
// the first trial's.
Assignments Draw(const std::map<std::string, std::string>& random, int64_t seed) {
  Assignments drawn;
  for (const auto& [key, distribution] : random) {
    const config::YamlNode node =
        config::ParseYamlValue(distribution, {nullptr, config::kFromSet, key});
    Rng rng = SeedTree(static_cast<uint64_t>(seed)).Stream("draw:" + key + ":0");
    drawn.push_back(key + "=" +
                    batch::RandomKey::Read(key, node).ValueAt(statistics::OpenUniform(&rng)));
  }
  return drawn;
}

std::string ReadResults(const std::string& file, bool timing) {
  const py::gil_scoped_release free;
  return batch::ResultStore::Read(file).Csv(timing);
}

trial::Series ReadSeries(const std::string& file, int64_t trial) {
  const py::gil_scoped_release free;
  return batch::ResultStore::Read(file).SeriesOf(trial);
}

// The gate's report as JSON, or, with `update`, what changed in its baseline.
std::string Gate(const std::string& file, const trial::Plugins& plugins,
                 const Assignments& assignments, int workers, bool update, double time_limit_s,
                 const py::object& progress) {
  const batch::JobOptions jobs = JobsOf(workers);
  return Reporting(progress, [&](Reporter* reporter) -> std::string {
    const gate::Gate gate = gate::LoadGate(file, plugins, config::ParseAssignments(assignments));
    Warn(gate.plan.remarks());
    const std::string& baseline = gate.settings.baseline;
    if (update) system::RequireReplaceable(baseline, gate::kBaselineFile);
    gate::GateRun run(gate, update ? std::nullopt : std::optional(gate::LoadBaseline(baseline)));
    try {
      run.Run({.jobs = jobs,
               .time_limit_s = time_limit_s,
               .stop_requested = [=] { return reporter->stopped(); }},
              nullptr, [=](const gate::GateProgress& now) {
                reporter->Show(static_cast<double>(now.done) / static_cast<double>(now.least),
                               fmt::format("{} of {}", now.done, now.least));
              });
      if (update) {
        system::WriteWhole(baseline, gate::BaselineText(run.Measured()));
        return baseline;
      }
      const gate::GateReport report = run.Report();
      return report::JsonText(report::Document(gate::ReportOf(report), report));
    } catch (const batch::Stopped&) {
      return "";
    }
  });
}

// The program with these plug-ins; its exit code.
int Main(std::vector<std::string> arguments, const trial::Plugins& plugins) {
  std::vector<char*> argv;
  argv.reserve(arguments.size() + 1);
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const py::gil_scoped_release free;
  return turbidock::Main(static_cast<int>(arguments.size()), argv.data(), plugins);
}

}  // namespace

// NOLINTNEXTLINE: the macro's own
PYBIND11_MODULE(_core, module) {
  module.doc() = "The C++ side of the package turbidock.";
  py::register_exception<ConfigError>(module, "ConfigError", PyExc_ValueError);
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      std::rethrow_exception(std::move(thrown));
    } catch (const ConfigError& error) {  // nobody gave an option here
      std::string words = error.what();
      boost::replace_all(words, "--set ", "");
      boost::replace_all(words, "--out", "out");
      boost::replace_all(words, "--anew", "anew=True");
      PyErr_SetString(py::module_::import("turbidock").attr("ConfigError").ptr(), words.c_str());
    }
  });
  py::register_exception<SimulatorFault>(module, "SimulatorFault", PyExc_RuntimeError);
  AddPlugins(&module);
  AddScenario(&module);
  py::class_<trial::Series>(module, "Series")
      .def("columns", &ColumnsOf)
      .def("csv", &trial::Series::Csv)
      .def(py::pickle([](const trial::Series& series) { return py::bytes(series.Bytes()); },
                      [](const py::bytes& bytes) { return trial::Series::FromBytes(bytes); }));
  AddRunning(&module);
  AddPredict(&module);

  module.def("gives_seed",
             [](const std::string& assignment) { return trial::Gives(assignment, "trial.seed"); });
  module.def("names", [](const std::string& folder) { return config::BundledNames(folder); });
  module.def("version", &system::VersionAndCommit);
  module.def("data_dir", &config::DataDir);
  module.def("draw", &Draw);
  module.def("run", &Run);
  module.def("trial_model", [](const trial::Scenario& scenario) {
    return report::JsonText(page::TrialModel(scenario));
  });
  py::class_<GivenPlan>(module, "Plan")
      .def(py::init<std::string, std::string, const trial::Plugins&, const Assignments&,
                    std::optional<int64_t>, std::optional<int>>());
  module.def("batch", &Batch);
  module.def("dataset", &Dataset);
  module.def("read_results", &ReadResults);
  module.def("read_series", &ReadSeries);
  module.def("gate", &Gate);
  module.def("main", &Main);
  module.def("stop_signal", &command::StopSignal);
}

}  // namespace turbidock::python
