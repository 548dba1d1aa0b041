#include "experiments/media/png.h"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <vector>

#include "experiments/system/output_path.h"
#include "sim/base/check.h"

namespace turbidock::media {

void RequireImageSize(int64_t width_px, int64_t height_px, const std::string& file) {
  if (width_px >= 1 && height_px >= 1 && width_px <= kLargestImage_px &&
      height_px <= kLargestImage_px)
    return;
  throw ConfigError(file, fmt::format("{} x {} pixels, at most {} x {} can be read", width_px,
                                      height_px, kLargestImage_px, kLargestImage_px));
}

namespace {

// Takes out what libpng would convert the values by: they count as they stand in the file, as other
// programs read them.
void RemoveColourSpace(std::string* png) {
  for (size_t at = 8; at + 12 <= png->size();) {
    size_t bytes = 12;  // of a chunk: its length, name and checksum, and as many as its length says
    for (int i = 0, shift = 24; i < 4; ++i, shift -= 8)
      bytes += size_t{static_cast<unsigned char>((*png)[at + static_cast<size_t>(i)])} << shift;
    const std::string name = png->substr(at + 4, 4);
    if (name == "gAMA" || name == "sRGB" || name == "cHRM" || name == "iCCP")
      png->erase(at, bytes);
    else
      at += bytes;
  }
}

void Write(const std::string& path, const auto& image, png_uint_32 format) {
  TD_CHECK(!image.empty(), "an image to write");
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(image.width());
  png.height = static_cast<png_uint_32>(image.height());
  png.format = format;
  std::string bytes(PNG_IMAGE_PNG_SIZE_MAX(png), '\0');
  png_alloc_size_t size = bytes.size();
  if (!png_image_write_to_memory(&png, bytes.data(), &size, /*convert_to_8_bit=*/0, image.data(),
                                 /*row_stride=*/0, /*colormap=*/nullptr))
    throw SimulatorFault(path + ": " + png.message);
  bytes.resize(size);
  if (format == PNG_FORMAT_LINEAR_Y) RemoveColourSpace(&bytes);  // as other readers take them
  system::WriteWhole(path, bytes);
}

}  // namespace

void WritePng(const std::string& path, const Image3u8& image) {
  Write(path, image, PNG_FORMAT_RGB);
}
void WritePng(const std::string& path, const Image1u8& image) {
  Write(path, image, PNG_FORMAT_GRAY);
}
void WritePng(const std::string& path, const Image1u16& image) {
  Write(path, image, PNG_FORMAT_LINEAR_Y);
}

Image3u8 ReadPng(const std::string& path) {
  std::string bytes = system::ReadWhole(path);
  if (bytes.empty()) throw ConfigError(path, "is empty");
  RemoveColourSpace(&bytes);
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()))
    throw ConfigError(path, png.message);
  // Laid over no background: values are as they stand in the file.
  const bool has_alpha = (png.format & PNG_FORMAT_FLAG_ALPHA) != 0;
  png.format = has_alpha ? PNG_FORMAT_RGBA : PNG_FORMAT_RGB;
  png.flags |= PNG_IMAGE_FLAG_16BIT_sRGB;  // 16 bits are not linear
  try {
    RequireImageSize(png.width, png.height, path);
  } catch (const ConfigError&) {
    png_image_free(&png);
    throw;
  }
  Image3u8 image(static_cast<int>(png.width), static_cast<int>(png.height));
  std::vector<uint8_t> with_alpha(has_alpha ? 4 * image.pixels() : 0);
  if (!png_image_finish_read(&png, /*background=*/nullptr,
                             has_alpha ? with_alpha.data() : image.data(), /*row_stride=*/0,
                             /*colormap=*/nullptr))
    throw ConfigError(path, png.message);
  for (size_t i = 0; i < with_alpha.size() / 4; ++i)
    std::copy_n(&with_alpha[4 * i], 3, image.data() + 3 * i);
  return image;
}

}  // namespace turbidock::media
