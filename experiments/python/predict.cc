// Short flights of the plant under recorded commands, many at a time: what identification compares
// with a log. In open water: nothing touches anything.

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>
#include <thread>

#include "control/playback.h"
#include "control/thrust_allocation.h"
#include "experiments/python/bindings.h"
#include "experiments/trial/motion.h"
#include "experiments/trial/recorded.h"
#include "experiments/trial/world.h"
#include "sim/base/random.h"
#include "sim/vehicle/plant.h"
#include "sim/vehicle/scene.h"

namespace turbidock::python {

py::dict ArraysOf(const config::NumberTable& table) {
  py::dict columns;
  for (size_t i = 0; i < table.names.size(); ++i)
    columns[py::str(table.names[i])] = View<double>({static_cast<py::ssize_t>(table.rows())},
                                                    table.columns[i].data(), py::handle());
  return columns;
}

config::NumberTable TableOf(const py::dict& columns) {
  config::NumberTable table;
  for (const auto& [name, values] : columns) {
    table.names.push_back(name.cast<std::string>());
    table.columns.push_back(values.cast<std::vector<double>>());
    if (table.columns.back().size() != table.columns.front().size())
      throw py::value_error("every column must have as many rows: " + table.names.back());
  }
  return table;
}

namespace {

using trial::Scenario;
using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Indices = py::array_t<int64_t, py::array::c_style | py::array::forcecast>;

// x, y, z of B in W, w, x, y, z of R_WB, ahead, left, up velocity in B, turn rates in B.
constexpr int kStateSize = 13;
using State = Eigen::Matrix<double, kStateSize, 1>;

State StateOf(const vehicle::VehicleTruth& truth) {
  State state;
  const Eigen::Quaterniond& q = truth.X_WB.q;
  state << truth.X_WB.p, q.w(), q.x(), q.y(), q.z(), truth.V_WB_B.v, truth.V_WB_B.w;
  return state;
}

struct Window {
  double begin_s = 0;           // a tick's time: where the state is given
  std::vector<double> times_s;  // increasing: where it is asked for
};

struct Flight {
  size_t model = 0, window = 0;
  State begin;
  std::vector<double> states;  // a row of kStateSize for each of the window's times
};

vehicle::Scene OpenWater(const Scenario& scenario) {
  vehicle::Scene scene = vehicle::LoadScene(trial::SceneFilesOf(scenario), scenario.rig);
  scene.model->opt.disableflags |= mjDSBL_CONTACT;
  return scene;
}

// A vehicle that flies windows of a log.
class Flyer {
 public:
  Flyer(const vehicle::Scene& scene, const Scenario& scenario, const control::Playback& commands,
        double sag_per_s)
      : clock_(scenario.clock),
        commands_(commands),
        sag_per_s_(sag_per_s),
        kinds_(scenario.vehicle.thrusters.Of(vehicle::NamesOf(scene.thrusters), "thrusters")),
        plant_(scene, WithoutDeadTime(scenario.vehicle), scenario.clock,
               trial::SeaOf(scenario, SeedTree(0).Stream("sea"))) {
    constexpr double kForgotten = 8;  // e^-8 of what the thrusters did before is left
    double lag_s = 0;
    for (const vehicle::ThrusterKind& kind : kinds_) lag_s = std::max(lag_s, kind.lag_s);
    warm_up_ticks_ = static_cast<int64_t>(std::ceil(kForgotten * lag_s / clock_.dt_s()));
  }

  void Fly(const Window& window, Flight* flight) {
    const State& begin = flight->begin;
    const Pose X_WB{Eigen::Quaterniond(begin[3], begin[4], begin[5], begin[6]).normalized(),
                    begin.head<3>()};
    const auto first = static_cast<int64_t>(std::llround(window.begin_s / clock_.dt_s()));
    plant_.Reset(X_WB, first - warm_up_ticks_);
    bool sound = true;
    while (sound && plant_.tick() < first) sound = Step();
    plant_.MoveTo(X_WB);
    plant_.SetVelocity({.w = begin.tail<3>(), .v = begin.segment<3>(7)});
    State before = StateOf(plant_.truth()), after = before;
    int64_t before_tick = plant_.tick();
    flight->states.assign(window.times_s.size() * kStateSize,
                          std::numeric_limits<double>::quiet_NaN());
    for (size_t i = 0; sound && i < window.times_s.size(); ++i) {
      while (sound && plant_.time_s() < window.times_s[i]) {
        before = after;
        before_tick = plant_.tick();
        sound = Step();
        after = StateOf(plant_.truth());
      }
      const double share = std::clamp(
          (window.times_s[i] - clock_.TimeOfTick(before_tick)) / clock_.dt_s(), 0.0, 1.0);
      State now = before + share * (after - before);
      now.segment<4>(3).normalize();
      if (sound) State::Map(flight->states.data() + i * kStateSize) = now;
    }
  }

 private:
  bool Step() { return !plant_.Step(CommandNow()).has_value(); }

  // Ticks may be long here: dead times, which the plant rounds to them, are taken off the commands.
  static vehicle::VehicleParams WithoutDeadTime(vehicle::VehicleParams params) {
    params.thrusters.dead_time_s = 0;
    for (auto& thruster : params.thrusters.individual) thruster.dead_time_s = 0;
    return params;
  }

  // Where a command changes within a tick or thrust sags, what has the mean of the thrusts that are
  // left.
  ThrusterCommand CommandNow() const {
    const double left = std::clamp(1 - sag_per_s_ * plant_.time_s(), 0.0, 1.0);
    ThrusterCommand command;
    command.volts.resize(kinds_.size());
    std::vector<control::Playback::Part> parts;
    for (size_t i = 0; i < kinds_.size(); ++i) {
      if (i == 0 || kinds_[i].dead_time_s != kinds_[i - 1].dead_time_s) {
        const double sent_s = plant_.time_s() - kinds_[i].dead_time_s;
        parts = commands_.Within(sent_s, sent_s + clock_.dt_s());
      }
      command.volts[i] = parts.front().command->volts[i];
      if (parts.size() == 1 && left == 1) continue;
      double newton = 0;
      for (const auto& [share, part] : parts) newton += share * kinds_[i].Thrust(part->volts[i]);
      command.volts[i] = kinds_[i].Volts(left * newton);
    }
    return command;
  }

  ClockParams clock_;
  const control::Playback& commands_;
  double sag_per_s_;
  std::vector<vehicle::ThrusterKind> kinds_;
  vehicle::Plant plant_;
  int64_t warm_up_ticks_ = 0;
};

// Flights of one model follow each other. Each thread takes some of them at a time: which thread
// does what changes no result.
void FlyAll(const std::vector<Scenario>& models, const std::vector<double>& sag_per_s,
            const vehicle::Scene& scene, const control::Playback& commands,
            const std::vector<Window>& windows, int workers, std::vector<Flight>* flights) {
  constexpr size_t kAtATime = 16;
  std::atomic<size_t> next = 0;
  std::mutex mutex;
  std::exception_ptr failed;
  const auto work = [&] {
    try {
      for (size_t begin; (begin = next.fetch_add(kAtATime)) < flights->size();) {
        std::optional<Flyer> flyer;
        for (size_t i = begin; i < std::min(begin + kAtATime, flights->size()); ++i) {
          Flight& flight = (*flights)[i];
          if (!flyer || flight.model != (*flights)[i - 1].model)
            flyer.emplace(scene, models[flight.model], commands, sag_per_s[flight.model]);
          flyer->Fly(windows[flight.window], &flight);
        }
      }
    } catch (...) {
      const std::lock_guard lock(mutex);
      failed = std::current_exception();
      next = flights->size();
    }
  };
  std::vector<std::thread> threads;
  threads.reserve(static_cast<size_t>(workers));
  for (int i = 1; i < workers; ++i) threads.emplace_back(work);
  work();
  for (std::thread& thread : threads) thread.join();
  if (failed) std::rethrow_exception(failed);
}

std::vector<Window> WindowsOf(const Numbers& begin_s, const std::vector<Numbers>& times_s) {
  if (begin_s.ndim() != 1 || begin_s.size() != static_cast<py::ssize_t>(times_s.size()))
    throw py::value_error("a list of times for each window");
  std::vector<Window> windows;
  windows.reserve(times_s.size());
  for (size_t i = 0; i < times_s.size(); ++i) {
    const double* times = times_s[i].data();
    windows.push_back({begin_s.data()[i], {times, times + times_s[i].size()}});
    constexpr double kMost_s = 86400;
    const Window& window = windows.back();
    if (!(std::abs(window.begin_s) < kMost_s) || !std::ranges::is_sorted(window.times_s) ||
        (!window.times_s.empty() && !(window.times_s.back() - window.begin_s < kMost_s)))
      throw py::value_error("a window's times must increase, within a day");
  }
  return windows;
}

std::vector<Flight> FlightsOf(const Indices& model, const Indices& window, const Numbers& state,
                              size_t models, size_t windows) {
  if (model.size() != window.size() || state.ndim() != 2 || state.shape(0) != model.size() ||
      state.shape(1) != kStateSize)
    throw py::value_error("a model, a window and a state of 13 numbers for each flight");
  std::vector<Flight> flights(static_cast<size_t>(model.size()));
  for (size_t i = 0; i < flights.size(); ++i) {
    Flight& flight = flights[i];
    flight.model = static_cast<size_t>(model.data()[i]);
    flight.window = static_cast<size_t>(window.data()[i]);
    flight.begin = State::Map(state.data() + i * kStateSize);
    if (flight.model >= models || flight.window >= windows || !flight.begin.allFinite())
      throw py::value_error("a flight of a model or a window that is not there, or not finite");
  }
  return flights;
}

std::vector<py::array> Predict(const std::vector<Scenario>& models, const py::dict& commands,
                               const Numbers& begin_s, const std::vector<Numbers>& times_s,
                               const Indices& model, const Indices& window, const Numbers& state,
                               int workers, std::vector<double> sag_per_s) {
  if (models.empty() || workers < 1) throw py::value_error("a model and a worker at least");
  sag_per_s.resize(models.size());
  const config::NumberTable table = TableOf(commands);
  const std::vector<Window> windows = WindowsOf(begin_s, times_s);
  std::vector<Flight> flights = FlightsOf(model, window, state, models.size(), windows.size());
  {
    const py::gil_scoped_release free;
    const vehicle::Scene scene = OpenWater(models[0]);
    const control::VehicleModel known = trial::ModelOf(models[0].known_vehicle, scene);
    const control::Playback playback(trial::CommandsIn(table, "commands", known),
                                     known.thrusters.size());
    FlyAll(models, sag_per_s, scene, playback, windows, workers, &flights);
  }
  std::vector<py::array> states;
  states.reserve(flights.size());
  for (const Flight& flight : flights)
    states.push_back(
        View<double>({static_cast<py::ssize_t>(windows[flight.window].times_s.size()), kStateSize},
                     flight.states.data(), py::handle()));
  return states;
}

// Times, and a row of volts for each.
py::tuple Commands(const Scenario& scenario, const py::dict& columns, const std::string& where) {
  const auto rows = trial::CommandsIn(TableOf(columns), where, trial::ModelOf(scenario));
  const size_t thrusters = rows.front().command.volts.size();
  std::vector<double> times_s, volts;
  times_s.reserve(rows.size());
  volts.reserve(rows.size() * thrusters);
  for (const control::Playback::Row& row : rows) {
    times_s.push_back(row.time_s);
    volts.insert(volts.end(), row.command.volts.begin(), row.command.volts.end());
  }
  const auto count = static_cast<py::ssize_t>(rows.size());
  return py::make_tuple(
      View<double>({count}, times_s.data(), py::handle()),
      View<double>({count, static_cast<py::ssize_t>(thrusters)}, volts.data(), py::handle()));
}

py::tuple Authority(const Scenario& scenario) {
  const control::ForceAllocation allocation({}, trial::ModelOf(scenario), /*may_lack_axes=*/true);
  return py::make_tuple(Copy(allocation.most()), Copy(allocation.most_back()));
}

}  // namespace

void AddPredict(py::module_* module) {
  module->def("thrusters", &trial::ThrusterNamesOf);
  module->def("authority", &Authority);
  module->def("commands", &Commands);
  module->def("predict", &Predict, py::arg("models"), py::arg("commands"), py::arg("begin_s"),
              py::arg("times_s"), py::arg("model"), py::arg("window"), py::arg("state"),
              py::arg("workers"), py::arg("sag_per_s") = std::vector<double>());
}

}  // namespace turbidock::python
