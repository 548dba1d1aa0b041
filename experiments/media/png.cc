#include "experiments/media/png.h"

#include <png.h>

#include "experiments/system/output_path.h"
#include "sim/base/check.h"

namespace turbidock::media {

void WritePng(const std::string& path, const Image3u8& image) {
  TD_CHECK(!image.empty(), "an image to write");
  system::RequireWritable(path);
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(image.width());
  png.height = static_cast<png_uint_32>(image.height());
  png.format = PNG_FORMAT_RGB;
  if (!png_image_write_to_file(&png, path.c_str(), /*convert_to_8_bit=*/0, image.data(),
                               /*row_stride=*/0, /*colormap=*/nullptr))
    throw SimulatorFault(path + ": " + png.message);
}

Image3u8 ReadPng(const std::string& path) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_file(&png, path.c_str())) throw ConfigError(path, png.message);
  png.format = PNG_FORMAT_RGB;
  Image3u8 image(static_cast<int>(png.width), static_cast<int>(png.height));
  const png_color black{0, 0, 0};
  if (!png_image_finish_read(&png, &black, image.data(), /*row_stride=*/0, /*colormap=*/nullptr))
    throw ConfigError(path, png.message);
  return image;
}

}  // namespace turbidock::media
