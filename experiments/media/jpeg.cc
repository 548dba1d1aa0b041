#include "experiments/media/jpeg.h"

// jpeglib.h needs FILE and size_t
#include <cstddef>
#include <cstdio>
#include <cstdlib>
// clang-format off
#include <jpeglib.h>
// clang-format on

#include "sim/base/check.h"

namespace turbidock::media {

std::string EncodeJpeg(const Image3u8& image, int quality) {
  TD_CHECK(!image.empty(), "an image to encode");
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  unsigned char* bytes = nullptr;
  unsigned long count = 0;  // NOLINT(google-runtime-int): libjpeg's type
  jpeg_mem_dest(&jpeg, &bytes, &count);
  jpeg.image_width = static_cast<JDIMENSION>(image.width());
  jpeg.image_height = static_cast<JDIMENSION>(image.height());
  jpeg.input_components = 3;
  jpeg.in_color_space = JCS_RGB;
  jpeg_set_defaults(&jpeg);
  jpeg_set_quality(&jpeg, quality, TRUE);
  jpeg_start_compress(&jpeg, TRUE);
  const size_t stride = 3 * static_cast<size_t>(image.width());
  while (jpeg.next_scanline < jpeg.image_height) {
    // libjpeg's interface has no const
    auto* row = const_cast<uint8_t*>(image.data() + stride * jpeg.next_scanline);  // NOLINT
    jpeg_write_scanlines(&jpeg, &row, 1);
  }
  jpeg_finish_compress(&jpeg);
  std::string file(reinterpret_cast<const char*>(bytes), count);
  jpeg_destroy_compress(&jpeg);
  std::free(bytes);  // NOLINT(cppcoreguidelines-no-malloc): allocated by libjpeg
  return file;
}

}  // namespace turbidock::media
