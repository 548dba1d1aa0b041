#pragma once
// Photographs, small.

#include <string>

#include "sim/base/image.h"

namespace turbidock::media {

// The image as a JPEG file's bytes; quality 1 to 100.
std::string EncodeJpeg(const Image3u8& image, int quality);

}  // namespace turbidock::media
