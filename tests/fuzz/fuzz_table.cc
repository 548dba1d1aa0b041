// Any bytes as a table of motion, as commands that are played and as a measured current: refused,
// or a table that reads back as it was written, commands that thrusters take, a current that is
// finite.

#include <algorithm>
#include <cmath>

#include "experiments/config/number_table.h"
#include "experiments/trial/recorded.h"
#include "experiments/trial/world.h"
#include "sim/base/check.h"
#include "tests/fuzz/input_file.h"

using namespace turbidock;  // NOLINT(google-build-using-namespace)

namespace {

// What is not finite is written as nothing and comes back as no number.
bool AsWritten(const std::vector<double>& read, const std::vector<double>& written) {
  return std::ranges::equal(
      read, written, [](double a, double b) { return std::isfinite(b) ? a == b : std::isnan(a); });
}

void ReadsBack(const config::NumberTable& table) {
  const std::string csv = table.Csv();
  const testing::InputFile file(reinterpret_cast<const uint8_t*>(csv.data()), csv.size());
  const config::NumberTable again = config::ReadNumberTable(file.path());
  TD_CHECK(again.names == table.names, "the columns");
  TD_CHECK(std::ranges::equal(again.columns, table.columns, AsWritten), "every number");
}

template <typename Read>
void Try(const Read& read) {
  try {
    read();
  } catch (const ConfigError&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const trial::Scenario scenario = trial::LoadScenario("pool_active", {});
  static const control::VehicleModel vehicle = trial::ModelOf(scenario);
  const testing::InputFile file(data, size);
  Try([&] {
    const config::NumberTable table = config::ReadNumberTable(file.path());
    config::TimesOf(table, file.path());
    ReadsBack(table);
  });
  Try([&] {
    const control::Playback playback =
        trial::PlaybackOf({.file = file.path()}, vehicle, scenario.duration_s);
    TD_CHECK(playback.begin_s() <= playback.end_s(), "its end is not before its beginning");
    for (const double at_s : {playback.begin_s(), 0.0, playback.end_s()})
      for (const double volts : playback.At(at_s).volts)
        TD_CHECK(volts >= 0 && volts <= kMaxVolts, "a voltage");
  });
  Try([&] {
    vehicle::SeaParams sea;
    sea.current.file = file.path();
    for (const auto& [time_s, v_W] : trial::CurrentOf(sea))
      TD_CHECK(std::isfinite(time_s) && v_W.allFinite(), "a finite current");
  });
  return 0;
}
