// Any bytes as a PNG: refused, or an image of a size that is allowed.

#include "experiments/media/png.h"
#include "sim/base/check.h"
#include "tests/fuzz/input_file.h"

using namespace turbidock;  // NOLINT(google-build-using-namespace)

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const testing::InputFile file(data, size);
  try {
    const Image3u8 image = media::ReadPng(file.path());
    media::RequireImageSize(image.width(), image.height(), "image");
  } catch (const ConfigError&) {
  }
  return 0;
}
