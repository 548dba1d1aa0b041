// Any lines as what a tab says to a trial under way: each changes what it says, or nothing.

#include "experiments/studies/live/live_session.h"
#include "sim/base/check.h"

using namespace turbidock;  // NOLINT(google-build-using-namespace)

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  // the controller whose making costs least: each input begins a trial
  static const trial::Scenario scenario = trial::LoadScenario(
      "sea_night_active",
      {"estimator.pose_source=true_pose", "trial.duration_s=5", "control.use=p_voltage"});
  live::LiveSession session(scenario);
  const std::string text(reinterpret_cast<const char*>(data), size);
  const auto settings = [&] { return trial::SaveScenario(session.settings()); };
  std::string before = settings();
  for (size_t begin = 0; begin < text.size();) {
    const size_t end = std::min(text.find('\n', begin), text.size());
    bool refused = false;
    try {
      session.Handle(text.substr(begin, end - begin));
    } catch (const ConfigError&) {
      refused = true;
    }
    const std::string after = settings();
    TD_CHECK(!refused || after == before, "refused, so unchanged");
    before = after;
    TD_CHECK(session.speed() > 0 && session.push_newton().allFinite(), "numbers in their ranges");
    if (session.wants_step()) session.Step(false);
    begin = end + 1;
  }
  CheckFields(session.settings(), "");
  return 0;
}
