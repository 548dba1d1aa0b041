// Any bytes as a rig file of ours or a calibration, alone and as both files of a pair: refused, or
// a rig that is finite.

#include "experiments/config/rig_file.h"
#include "sim/base/check.h"
#include "tests/fuzz/input_file.h"

using namespace turbidock;  // NOLINT(google-build-using-namespace)

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const testing::InputFile file(data, size);
  for (const std::vector<std::string>& files :
       {std::vector{file.path()}, std::vector{file.path(), file.path()}})
    try {
      const StereoRig rig = config::LoadRig(files, 640, 480).rig;
      for (const Side side : kSides) {
        TD_CHECK(rig[side].X_HC.IsFinite(), "a finite pose");
        TD_CHECK(rig[side].fx_px > 0 && rig[side].fy_px > 0, "focal lengths");
      }
    } catch (const ConfigError&) {
    }
  return 0;
}
